"""A forced response with its contact on springs, then on more and more nodes of both whole faces.

Springs on points are the cheap model; both faces node by node, with elastic bodies and no springs,
are what they stand for. What each costs, where its peaks lie, and how far these are from the finest
mesh of the faces.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from upd.analyses.forced.whole_faces import INTERFACE
from upd.analyses.seated.varied import PATCH
from upd.batch.curves import ConvergenceCurve, make_curve
from upd.batch.ladder import Ladder, Levels, StudyReport, even, shown
from upd.batch.point import PointResult
from upd.batch.response_ladders import at_ratio
from upd.batch.study_point import Settings, SolvedPoint, StudyPoint, solved_alone
from upd.batch.study_tables import TableColumn, TextTable, cost_columns, make_table
from upd.errors import InputError
from upd.labels import percent
from upd.plot.work_precision import change_charts
from upd.results import Case
from upd.results.quantities import PEAK_ACCELERANCE, PEAK_FREQUENCY, quantity_of
from upd.results.quantity import Quantity
from upd.scene import ForcedScene

#: meshes of both faces: 60, 198 and 468 nodes of the symmetric damper's half (the last has the
#: thesis's elements), 60, 196 and 460 of the asymmetric one's
_MESHES: Mapping[str, Mapping[int, tuple[int, ...]]] = {
    "symmetric": {4: (10,), 8: (20,), 12: (34,)},
    "asymmetric": {3: (6, 3), 6: (12, 6), 9: (20, 9)},
}
#: the levels run unless others are asked for: 60 and 126 nodes, 60 and 95, minutes each where the
#: finer ones take half an hour to hours
_USUAL = {"symmetric": (4, 6), "asymmetric": (3, 4)}
#: elements whose faces of four nodes carry a contact node by node; the first stands in for others
_NODE_BY_NODE = ("hex8i", "hex8")
#: curve of the levels on springs
SPRINGS = "springs"
#: numbers of a peak, their heads in a table, and the digits it shows
_KINDS = {PEAK_FREQUENCY: ("frequency\nHz", 5), PEAK_ACCELERANCE: ("height\n(m/s2)/N", 4)}
#: number of a peak, and which number of it
PeakKey = tuple[int, Quantity]


def whole_faces_points(scene: ForcedScene, levels: Levels = None) -> list[StudyPoint]:
    """One point for each stiffness of the springs, one for each mesh of both faces.

    Parameters
    ----------
    levels
        Elements up the patch or pad, those along it in proportion; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none, and for a rig whose faces are not divided by these parameters.
    """
    base = at_ratio(scene)
    springs = [
        StudyPoint(
            SPRINGS, name, (*base, ("contact.model", SPRINGS), ("contact.stiffness", [name]))
        )
        for name in scene.stiffnesses
    ]
    faces = []
    for mesh in _meshes(scene, levels):
        slope, along = list(mesh.values())[:2]
        settings = (*base, *_of_faces(scene), *((f"geometry.{k}", n) for k, n in mesh.items()))
        faces.append(StudyPoint(INTERFACE, f"{slope} x {along}", settings, 1.0 / slope))
    return [*springs, *faces]


def _of_faces(scene: ForcedScene) -> Settings:
    """What a contact by whole faces asks of the scene."""
    mine = scene.mesh.element
    return (
        ("contact.model", INTERFACE),
        ("mesh.element", mine if mine in _NODE_BY_NODE else _NODE_BY_NODE[0]),
        ("balance.method", "march"),
    )


def _meshes(scene: ForcedScene, levels: Levels) -> Iterator[dict[str, int]]:
    """Parameter -> elements, of every level: up the face first, then along it."""
    known = _MESHES[scene.arrangement]
    asked = levels or ()
    chosen = {int(n) for n in asked if float(n).is_integer() and n >= 2}
    if len(chosen) < len(asked):
        raise InputError(
            f"--levels {shown(asked)}: give different whole numbers of elements up a face, 2 or "
            "more"
        )
    slope, others = PATCH[scene.arrangement]
    missing = [key for key in (slope, *others) if key not in scene.geometry]
    if missing:
        raise InputError(
            f"--vary contact: the recipe has no {' and no '.join(missing)}, by which it divides "
            "the faces; to fix it: run the scene with meshes of your own"
        )
    most = max(known)
    for n in sorted(chosen or _USUAL[scene.arrangement]):
        counts = known.get(n) or tuple(even(n * one / most) for one in known[most])
        yield {slope: n} | dict(zip(others, counts, strict=True))


def _notes(scene: ForcedScene) -> Iterator[str]:
    """What the levels set in the scene."""
    static = f'"{state}"' if isinstance(state := scene.contact.static, str) else "as given"
    ratio = min(scene.excitation.centrifugal_to_force)
    yield (
        f'every level: F_C/F_E {ratio:g} alone, want = ["response"], left_out.solve = "no", '
        f"contact.static = {static}, "
        f"{scene.excitation.start:g} to {scene.excitation.stop:g} Hz"
    )
    changes = {key: value for key, value in _of_faces(scene) if not isinstance(value, list)}
    had = {
        "mesh.element": scene.mesh.element,
        "balance.method": scene.balance.method,
        "contact.model": scene.contact.model,
    }
    words = (
        f'{key} = "{value}"' + f' (the scene: "{had[key]}")' * (had[key] != value)
        for key, value in changes.items()
    )
    yield f"interface, elements up x along a face: {', '.join(words)}"
    yield f'springs: balance.method = "{scene.balance.method}", points and mesh as in the scene'
    yield "change of a range over both sweeps: that of its end which is farther off"


@dataclass(frozen=True)
class LevelNumber:
    """Frequency or height of a peak on one level.

    Attributes
    ----------
    mode
        How the blades move there.
    ends
        Least and largest value: of the path of the springs, or of the sweeps up and down; None
        where none was reached.
    why
        Why a sweep did not reach it.
    """

    mode: str
    ends: tuple[float, float] | None
    why: str

    def text(self, digits: int) -> str:
        """The number, both ends, or that one of the sweeps does not have it."""
        if self.ends is None:
            return "not reached"
        low, high = (f"{value:.{digits}g}" for value in self.ends)
        if low != high:
            return f"{low} to {high}"
        return f"{low} or none" if self.why else low

    def change(self, from_: LevelNumber) -> float | None:
        """Relative difference of the end that is farther off; None where one has none."""
        if self.ends is None or from_.ends is None:
            return None
        pairs = zip(self.ends, from_.ends, strict=True)
        return max((mine / other - 1.0 for mine, other in pairs), key=abs)


def finest(solved: Sequence[SolvedPoint]) -> SolvedPoint | None:
    """The finest mesh of both faces that was solved."""
    good = [p for p in solved_alone(solved) if p.point.curve == INTERFACE]
    return min(good, key=lambda p: p.point.h, default=None)


def peak_numbers(one: SolvedPoint) -> dict[PeakKey, LevelNumber]:
    """Number of the peak and its frequency or accelerance -> what the level has of it.

    Peaks are numbered by the mode in which the blades move, so that numbers of levels whose
    contacts have other names belong together.
    """
    found: dict[PeakKey, list[PointResult]] = {}
    for result in one.outcome.results:
        quantity, n = quantity_of(result.name)
        # curves of linear limits have no F_C/F_E
        if quantity in _KINDS and result.case.force_ratio is not None:
            found.setdefault((int(n), quantity), []).append(result)
    return {key: _level_number(results) for key, results in found.items()}


def _level_number(results: Sequence[PointResult]) -> LevelNumber:
    """One number of the sweeps of a level."""
    mode = next((r.case.mode for r in results if r.case.mode), "")
    values = [r.value for r in results if r.value is not None]
    why = next((r.withheld for r in results if r.value is None), "")
    return LevelNumber(mode, (min(values), max(values)) if values else None, why)


def change_curves(solved: Sequence[SolvedPoint]) -> list[ConvergenceCurve]:
    """Change of every peak's numbers from the finest mesh over the seconds of a level.

    Each stiffness of the springs is a curve of one level.
    """
    fine = finest(solved)
    if fine is None:
        return []
    ladders: dict[str, list[SolvedPoint]] = {}
    for p in solved_alone(solved):
        ladders.setdefault(p.name if p.point.curve == SPRINGS else INTERFACE, []).append(p)
    curves = []
    for key, reference in peak_numbers(fine).items():
        if reference.ends is None:
            continue
        name = (key[1].named(key[0]), Case(mode=reference.mode))
        for curve, points in ladders.items():
            found = [(p, n.change(reference)) for p in points if (n := peak_numbers(p).get(key))]
            changes = {p.name: change for p, change in found if change is not None}
            mine = [p for p, _ in found if p.name in changes]
            if mine:
                last = reference.ends[1]
                curves.append(make_curve(curve, name, mine, changes.values(), last, fine.name))
    return curves


def _report(scene: ForcedScene, solved: Sequence[SolvedPoint]) -> StudyReport:
    """What every level costs, then each peak on every level, then why sweeps lack one."""
    fine = finest(solved)
    numbers = sorted({k for one in solved for k, _ in peak_numbers(one)})
    costs = (_LEVEL, ("nodes", "r", _nodes), *cost_columns(digits=1))
    tables = [
        make_table("What every contact costs", costs, solved, whole=True),
        *(_peak_table(solved, k, fine) for k in numbers),
    ]
    return StudyReport(
        tuple(tables),
        fine is not None,
        (*_notes(scene), *_reasons(solved)),
        tuple(change_curves(solved)),
        charts=change_charts,
    )


_LEVEL: TableColumn = ("contact", "l", lambda one: str(one.name))


def _nodes(one: SolvedPoint) -> str:
    """Points of the springs, or nodes of both faces, in the model that was solved."""
    count = next((r.value for r in one.outcome.results if r.name == "contact_points"), None)
    return "" if count is None else f"{count:.0f}"


def _peak_table(solved: Sequence[SolvedPoint], peak: int, fine: SolvedPoint | None) -> TextTable:
    """A row per level: frequency, height, and their change from the finest mesh."""
    reference = {} if fine is None else peak_numbers(fine)
    modes = {n.mode for one in solved for (k, _), n in peak_numbers(one).items() if k == peak}
    columns = [_LEVEL]
    for kind, (head, digits) in _KINDS.items():
        key = (peak, kind)

        def value(one: SolvedPoint, key: PeakKey = key, digits: int = digits) -> str:
            found = peak_numbers(one).get(key)
            return "none" if found is None else found.text(digits)

        def change(one: SolvedPoint, key: PeakKey = key) -> str:
            found, other = peak_numbers(one).get(key), reference.get(key)
            if found is None or other is None or one is fine:
                return ""
            return percent(found.change(other))

        columns += [(head, "r", value), ("its\nchange", "r", change)]
    title = f"Peak {peak}" + f", {' or '.join(sorted(modes - {''}))}" * bool(modes - {""})
    if fine is not None:
        title += f"; change from {fine.name}"
    return make_table(title, columns, solved, whole=True)


def _reasons(solved: Sequence[SolvedPoint]) -> list[str]:
    """Why peaks were not reached, level by level; frequency and height share one reason."""
    return list(
        dict.fromkeys(
            f"{one.name}, peak {k}: {found.why}"
            for one in solved
            for (k, _), found in peak_numbers(one).items()
            if found.why
        )
    )


def _title(scene: ForcedScene, vary: str) -> str:
    return f"springs and whole faces, F_C/F_E {min(scene.excitation.centrifugal_to_force):g}"


CONTACT: Mapping[str, Ladder] = {
    "contact": Ladder(whole_faces_points, subject=_title, report=_report)
}
