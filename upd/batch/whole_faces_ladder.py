"""A forced response with its contact on springs, then on more and more nodes of both whole faces.

Springs on points are the cheap model; both faces node by node, with elastic bodies and no springs,
are what they stand for. What each costs, where its peaks lie, and how far these are from the finest
mesh of the faces.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from upd.analyses.forced.whole_faces import INTERFACE
from upd.batch.ladder import (
    Levels,
    Settings,
    SolvedPoint,
    Study,
    StudyMaker,
    StudyPoint,
    StudyReport,
    TextTable,
    markdown_report,
    told,
)
from upd.batch.level_peaks import (
    KINDS,
    SPRINGS,
    finest,
    ladder_curves,
    level_name,
    peak_numbers,
)
from upd.cache.files import write_text
from upd.errors import InputError
from upd.labels import percent
from upd.plot.matplotlib import write_sheets
from upd.plot.work_precision import change_charts
from upd.scene import ForcedScene

#: arrangement -> elements up a face that are divided, and those that grow with them
_DIVIDED = {
    "symmetric": ("patch_along_slope", ("patch_along_y",)),
    "asymmetric": ("pad_along_slope", ("pad_along_y", "face_along_z")),
}
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
#: numbers of a peak, and the digits a table shows
_DIGITS = {"frequency": 5, "accelerance": 4}


@dataclass(frozen=True)
class WholeFacesStudy:
    """Levels of both models of the contact at one F_C/F_E.

    Attributes
    ----------
    notes
        What the levels set in the scene.
    """

    title: str
    points: tuple[StudyPoint, ...]
    notes: tuple[str, ...]

    def present(self, solved: Sequence[SolvedPoint]) -> StudyReport:
        """What every level costs, then each peak on every level, then why ranges are ranges."""
        fine = finest(solved)
        tables = [_cost_table(solved), *(_peak_table(solved, k, fine) for k in _numbers(solved))]
        return StudyReport(tuple(tables), fine is not None, (*self.notes, *_reasons(solved)))

    def write(self, folder: Path, solved: Sequence[SolvedPoint]) -> list[Path]:
        """study.md, study.csv, study.json and work_precision.png."""
        curves = [asdict(one) for one in ladder_curves(solved)]
        table, text, data = (folder / f"study.{ending}" for ending in ("md", "csv", "json"))
        content = {
            "title": self.title,
            "points": [one.as_dict() for one in solved],
            "curves": curves,
            "notes": list(self.notes),
        }
        write_text(data, json.dumps(content, indent=1) + "\n")
        write_text(text, _csv(solved))
        report = self.present(solved)
        write_text(table, markdown_report(self.title, report, report.notes))
        return [table, text, data, *write_sheets(change_charts(curves), folder)]


def whole_faces_study(scene: ForcedScene, vary: str, levels: Levels = None) -> Study:
    """Springs, then both faces node by node, at the scene's lowest F_C/F_E.

    Parameters
    ----------
    vary
        "contact".
    levels
        Elements up the patch or pad, those along it in proportion; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none, and for a rig whose faces are not divided by these parameters.
    """
    ratio = min(scene.excitation.centrifugal_to_force)
    title = f"{scene.title or scene.name}: springs and whole faces, F_C/F_E {ratio:g}"
    return WholeFacesStudy(
        title, tuple(whole_faces_points(scene, vary, levels)), tuple(_notes(scene, ratio))
    )


def whole_faces_points(scene: ForcedScene, vary: str, levels: Levels = None) -> list[StudyPoint]:
    """Points of `whole_faces_study`: one for each stiffness of the springs, one for each mesh."""
    base: Settings = (
        ("want", ["response"]),
        ("left_out.solve", "no"),
        ("excitation.centrifugal_to_force", [min(scene.excitation.centrifugal_to_force)]),
        *([("excitation.force", [])] if scene.excitation.force else []),
    )
    springs = [
        StudyPoint(
            SPRINGS,
            name,
            (*base, ("contact.model", SPRINGS), ("contact.stiffness", [name])),
        )
        for name in scene.stiffnesses
    ]
    return [*springs, *(_faces_point(base, scene, mesh) for mesh in _meshes(scene, levels))]


def _faces_point(base: Settings, scene: ForcedScene, mesh: Mapping[str, int]) -> StudyPoint:
    slope, along = list(mesh.values())[:2]
    settings = (*base, *_of_faces(scene), *((f"geometry.{k}", n) for k, n in mesh.items()))
    return StudyPoint(INTERFACE, f"{slope} x {along}", settings, 1.0 / slope)


def _of_faces(scene: ForcedScene) -> Settings:
    """What a contact by whole faces asks of the scene."""
    return (
        ("contact.model", INTERFACE),
        ("mesh.element", _element(scene)),
        ("balance.method", "march"),
        ("balance.time_march", []),
    )


def _element(scene: ForcedScene) -> str:
    mine = scene.mesh.element
    return mine if mine in _NODE_BY_NODE else _NODE_BY_NODE[0]


def _meshes(scene: ForcedScene, levels: Levels) -> Iterator[dict[str, int]]:
    """Parameter -> elements, of every level: up the face first, then along it."""
    known = _MESHES[scene.arrangement]
    chosen = (
        None if levels is None else [int(n) for n in levels if float(n).is_integer() and n >= 2]
    )
    if levels is not None and chosen is not None and len(set(chosen)) < len(levels):
        raise InputError(
            f"--levels {told(levels)}: give different whole numbers of elements up a face, 2 or "
            "more"
        )
    slope, others = _DIVIDED[scene.arrangement]
    missing = [key for key in (slope, *others) if key not in scene.geometry]
    if missing:
        raise InputError(
            f"--vary contact: the recipe has no {' and no '.join(missing)}, by which it divides "
            "the faces; to fix it: run the scene with meshes of your own"
        )
    most = max(known)
    for n in sorted(chosen or _USUAL[scene.arrangement]):
        counts = known.get(n) or tuple(_even(n * one / most) for one in known[most])
        yield {slope: n} | dict(zip(others, counts, strict=True))


def _even(count: float) -> int:
    """An even number of elements, at least 4: the plane y = 0 and the core's side need lines."""
    return max(4, 2 * round(count / 2.0))


def _notes(scene: ForcedScene, ratio: float) -> Iterator[str]:
    """What the levels set in the scene."""
    yield (
        f'every level: F_C/F_E {ratio:g} alone, want = ["response"], left_out.solve = "no", '
        f"contact.static = {_quoted(scene.contact.static)}, "
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
    yield "change of a range: that of its end which is farther off"


def _quoted(static: Any) -> str:
    return f'"{static}"' if isinstance(static, str) else "as given"


def _numbers(solved: Sequence[SolvedPoint]) -> list[int]:
    """Numbers of the peaks that any level tells of."""
    return sorted({k for one in solved for k, _ in peak_numbers(one)})


def _nodes(one: SolvedPoint) -> str:
    """Points of the springs, or nodes of both faces, in the model that was solved."""
    count = next((r.value for r in one.outcome.results if r.name == "contact_points"), None)
    return "" if count is None else f"{count:.0f}"


def _cost_table(solved: Sequence[SolvedPoint]) -> TextTable:
    heads = ("contact", "nodes", "dofs", "seconds", "peak MB", "note")
    rows = tuple(
        (
            level_name(p),
            _nodes(p),
            f"{p.outcome.n_dof}",
            f"{p.outcome.seconds:.1f}",
            f"{p.outcome.memory_mb:.0f}",
            p.outcome.failure,
        )
        for p in solved
    )
    return TextTable("What every contact costs", heads, "lrrrrl", rows, _widest(solved))


def _peak_table(solved: Sequence[SolvedPoint], peak: int, fine: SolvedPoint | None) -> TextTable:
    """A row per level: frequency, height, and their change from the finest mesh."""
    reference = {} if fine is None else peak_numbers(fine)
    modes = {n.mode for one in solved for (k, _), n in peak_numbers(one).items() if k == peak}
    rows = []
    for one in solved:
        row, found = [level_name(one)], peak_numbers(one)
        for kind, digits in _DIGITS.items():
            told, other = found.get((peak, kind)), reference.get((peak, kind))
            row += ["none" if told is None else told.text(digits)]
            if told is None or other is None or one is fine:
                row += [""]
            else:
                row += [percent(told.change(other))]
        rows.append(tuple(row))
    heads = ("contact", "frequency\nHz", "its\nchange", "height\n(m/s2)/N", "its\nchange")
    title = f"Peak {peak}" + f", {' or '.join(sorted(modes - {''}))}" * bool(modes - {""})
    if fine is not None:
        title += f"; change from {level_name(fine)}"
    return TextTable(title, heads, "lrrrr", tuple(rows), _widest(solved))


def _widest(solved: Sequence[SolvedPoint]) -> int:
    return max((len(level_name(one)) for one in solved), default=0)


def _reasons(solved: Sequence[SolvedPoint]) -> list[str]:
    """Why peaks are ranges or were not reached, level by level; frequency and height share one."""
    return [
        f"{name}: {why}"
        for name, why in dict.fromkeys(
            (f"{level_name(one)}, peak {k}", told.why)
            for one in solved
            for (k, _), told in peak_numbers(one).items()
            if told.why
        )
    ]


def _csv(solved: Sequence[SolvedPoint]) -> str:
    """A row per level with all digits: cost, both ends of every number, changes, reasons."""
    fine, keys = finest(solved), [(k, kind) for k in _numbers(solved) for kind in KINDS]
    reference = {} if fine is None else peak_numbers(fine)
    heads = ["model", "level", "nodes", "dofs", "seconds", "memory_mb"]
    for k, kind in keys:
        heads += [f"peak_{k}_{kind}_{end} ({KINDS[kind]})" for end in ("low", "high")]
        heads += [f"peak_{k}_{kind}_change"]
    out = io.StringIO()
    write = csv.writer(out, lineterminator="\n").writerow
    write([*heads, "why", "failure", "warnings"])
    for one in solved:
        found, row = peak_numbers(one), [one.point.curve, one.point.label, _nodes(one)]
        o = one.outcome
        row += [f"{o.n_dof}", f"{o.seconds:.3f}", f"{o.memory_mb:.1f}"]
        for key in keys:
            told = found.get(key)
            ends = (None, None) if told is None or told.ends is None else told.ends
            change = told.change(reference[key]) if told and key in reference else None
            row += ["" if value is None else repr(value) for value in (*ends, change)]
        why = "; ".join(_reasons([one]))
        write([*row, why, o.failure, "; ".join(o.warnings)])
    return out.getvalue()


LADDERS: Mapping[str, StudyMaker] = {"contact": whole_faces_study}
