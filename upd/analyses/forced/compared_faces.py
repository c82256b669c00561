"""A forced response with its contact on springs, then on more and more nodes of both whole faces.

Springs on points are the cheap model; both faces node by node, with elastic bodies and no springs,
are what they stand for. What each costs, where its peaks lie, and how far these are from the finest
mesh of the faces.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from upd.analyses.forced.interface_model import INTERFACE
from upd.analyses.seated.varied import PATCH
from upd.errors import InputError
from upd.labels import percent
from upd.plot.work_precision import change_charts
from upd.results import Case, Result
from upd.results.quantities import PEAK_ACCELERANCE, PEAK_FREQUENCY, quantity_of
from upd.scene import ForcedScene
from upd.vary.curves import ConvergenceCurve, make_curve
from upd.vary.ladder import Asked, Ladder, StudyReport, chosen_levels, even
from upd.vary.outcome import SolvedPoint, without_failed
from upd.vary.tables import level_table, points_table
from upd.vary.variation import Key, Overrides, Variation

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
NODE_BY_NODE = ("hex8i", "hex8")
#: curve of the levels on springs
SPRINGS = "springs"
#: numbers of a peak that are compared
_KINDS = (PEAK_FREQUENCY, PEAK_ACCELERANCE)


def at_ratio(scene: ForcedScene) -> Overrides:
    """What every level of a response sets: the lowest F_C/F_E, where most slips.

    At a load under which every point sticks no level differs from another.
    """
    return (
        ("want", ["response"]),
        ("left_out.solve", "no"),
        ("excitation.centrifugal_to_force", [min(scene.excitation.centrifugal_to_force)]),
        *([("excitation.force", [])] if scene.excitation.force else []),
    )


def whole_faces_points(scene: ForcedScene, asked: Asked = None) -> list[Variation]:
    """One level for each stiffness of the springs, one for each mesh of both faces.

    Parameters
    ----------
    asked
        Elements up the patch or pad, those along it in proportion; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none, and for a rig whose faces are not divided by these parameters.
    """
    base = at_ratio(scene)
    made = []
    for name in scene.stiffnesses:
        overrides = (*base, ("contact.model", SPRINGS), ("contact.stiffness", [name]))
        made.append(Variation(SPRINGS, name, overrides, 1.0))
    for mesh in _meshes(scene, asked):
        slope, along = list(mesh.values())[:2]
        geometry = ((f"geometry.{k}", n) for k, n in mesh.items())
        overrides = (*base, *_of_faces(scene), *geometry)
        made.append(Variation(INTERFACE, f"{slope} x {along}", overrides, 1.0 / slope))
    return made


def _of_faces(scene: ForcedScene) -> Overrides:
    """What a contact by whole faces asks of the scene."""
    mine = scene.mesh.element
    return (
        ("contact.model", INTERFACE),
        ("mesh.element", mine if mine in NODE_BY_NODE else NODE_BY_NODE[0]),
        ("balance.method", "march"),
    )


def _meshes(scene: ForcedScene, asked: Asked) -> Iterator[dict[str, int]]:
    """Parameter -> elements, of every level: up the face first, then along it."""
    known = _MESHES[scene.arrangement]
    chosen = chosen_levels(
        asked or _USUAL[scene.arrangement],
        lambda n: float(n).is_integer() and n >= 2,
        "whole numbers of elements up a face, 2 or more",
        least=1,
    )
    slope, others = PATCH[scene.arrangement]
    missing = [key for key in (slope, *others) if key not in scene.geometry]
    if missing:
        raise InputError(
            f"--vary contact: the recipe has no {' and no '.join(missing)}, by which it divides "
            "the faces; to fix it: run the scene with meshes of your own"
        )
    most = max(known)
    for n in map(int, chosen):
        counts = known.get(n) or tuple(even(n * one / most) for one in known[most])
        yield {slope: n} | dict(zip(others, counts, strict=True))


def _notes(scene: ForcedScene) -> Iterator[str]:
    """What the levels set in the scene."""
    ratio, span = min(scene.excitation.centrifugal_to_force), scene.excitation
    yield f"every level: F_C/F_E {ratio:g} alone, {span.start:g} to {span.stop:g} Hz"
    changes = ((key, value) for key, value in _of_faces(scene) if isinstance(value, str))
    settings = ", ".join(f'{key} = "{value}"' for key, value in changes)
    yield f"interface, elements up x along a face: {settings}"
    yield "springs: method, points and mesh as in the scene"
    yield "change of a range over both sweeps: that of its end which is farther off"


class LevelNumber(NamedTuple):
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

    @property
    def text(self) -> str:
        """The number, both ends, or that one of the sweeps does not have it."""
        if self.ends is None:
            return "not reached"
        low, high = (f"{value:.5g}" for value in self.ends)
        if low != high:
            return f"{low} to {high}"
        return f"{low} or none" if self.why else low

    def change(self, from_: LevelNumber | None) -> float | None:
        """Relative difference of the end that is farther off; None where one has none."""
        if self.ends is None or from_ is None or from_.ends is None:
            return None
        pairs = zip(self.ends, from_.ends, strict=True)
        return max((mine / other - 1.0 for mine, other in pairs), key=abs)


#: name of a number -> what a level has of it
Numbers = Mapping[str, LevelNumber]


def peak_numbers(one: SolvedPoint) -> Numbers:
    """Frequencies and heights of the peaks of a level with friction.

    Peaks are numbered by the mode in which the blades move, so that numbers of levels whose
    contacts have other names belong together.
    """
    found: dict[str, list[Result]] = {}
    for result in one.outcome.results:
        # curves of linear limits have no F_C/F_E
        if quantity_of(result.name)[0] in _KINDS and result.case.force_ratio is not None:
            found.setdefault(result.name, []).append(result)
    return {name: _level_number(results) for name, results in found.items()}


def _level_number(results: Sequence[Result]) -> LevelNumber:
    """One number of the sweeps of a level."""
    mode = next((r.case.mode for r in results if r.case.mode), "")
    values = [r.value for r in results if not r.withheld]
    why = next((r.withheld for r in results if r.withheld), "")
    return LevelNumber(mode, (min(values), max(values)) if values else None, why)


def finest(solved: Sequence[SolvedPoint]) -> SolvedPoint | None:
    """The finest mesh of both faces that was solved."""
    good = [p for p in without_failed(solved) if p.point.source == INTERFACE]
    return min(good, key=lambda p: p.point.size, default=None)


def change_curves(solved: Sequence[SolvedPoint]) -> Iterator[ConvergenceCurve]:
    """Change of every peak's numbers from the finest mesh over the seconds of a level.

    A curve for the meshes of both faces, one for each stiffness of the springs.
    """
    fine = finest(solved)
    ways: dict[str, list[SolvedPoint]] = {}
    for one in without_failed(solved):
        way = one.name if one.point.source == SPRINGS else INTERFACE
        ways.setdefault(way, []).append(one)
    for number, reference in peak_numbers(fine).items() if fine else ():
        if fine is None or reference.ends is None:
            continue
        name = (number, Case(mode=reference.mode))
        for way, points in ways.items():
            numbers = [(one, peak_numbers(one).get(number)) for one in points]
            changes = [(one, n.change(reference)) for one, n in numbers if n is not None]
            known = [(one, change) for one, change in changes if change is not None]
            if known:
                mine, errors = zip(*known, strict=True)
                yield make_curve(way, name, mine, errors, reference.ends[1], fine.name)


def _report(scene: ForcedScene, solved: Sequence[SolvedPoint], names: Sequence[str]) -> StudyReport:
    """What every level costs, the peaks on every level, their changes, why sweeps lack one."""
    del scene, names
    fine, levels = finest(solved), {one.name: peak_numbers(one) for one in solved}
    modes: dict[str, str] = {}
    for name, found in ((name, n) for numbers in levels.values() for name, n in numbers.items()):
        modes[name] = modes.get(name) or found.mode
    keys: list[Key] = [(name, Case(mode=mode)) for name, mode in sorted(modes.items())]

    def value(one: SolvedPoint, key: Key) -> str:
        found = levels[one.name].get(key[0])
        return "none" if found is None else found.text

    def change(one: SolvedPoint, key: Key) -> str:
        found = levels[one.name].get(key[0])
        if found is None or fine is None or one is fine:
            return ""
        return percent(found.change(levels[fine.name].get(key[0])))

    tables = [points_table(solved), level_table("Peaks", keys, solved, value)]
    if fine is not None:
        tables.append(level_table(f"Change from {fine.name}", keys, solved, change))
    # frequency and height share one reason
    reasons = dict.fromkeys(
        f"{name}, peak {quantity_of(number)[1]}: {found.why}"
        for name, numbers in levels.items()
        for number, found in numbers.items()
        if found.why
    )
    curves = tuple(change_curves(solved))
    return StudyReport(
        tuple(tables), fine is not None, tuple(reasons), curves, charts=change_charts
    )


def _title(scene: ForcedScene, vary: str) -> str:
    del vary
    return f"springs and whole faces, F_C/F_E {min(scene.excitation.centrifugal_to_force):g}"


LADDER = Ladder(whole_faces_points, report=_report, notes=_notes, title=_title)
