"""Ladders of a forced response.

Harmonics, samples, time steps, modes kept, and the choice of contact points.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from upd.batch.convergence import ConvergenceStudy
from upd.batch.curves import ConvergenceCurve, finest_curves
from upd.batch.ladder import (
    Key,
    Levels,
    Settings,
    SolvedPoint,
    Study,
    StudyMaker,
    StudyPoint,
    TextTable,
    followed,
    matching,
    no_levels,
    whole_levels,
)
from upd.batch.point import PointResult
from upd.scene import ForcedScene

#: numbers a ladder follows beside those the analysis names first: where the model changes, the
#: stuck frequencies
FORCED_NAMES = ("peak_?_frequency", "peak_?_accelerance", "stuck_in_phase", "stuck_out_of_phase")
#: the same of peaks that are ranges
_ENDS = tuple(f"{end}_{name}" for end in ("lowest", "highest") for name in FORCED_NAMES[:2])
#: stage of a run that marches up and down
_SWEEPS = "sweeps"
_PEAK = re.compile(r"(left_)?peak_\d+_(frequency|accelerance)")
_LEVELS = {
    "harmonics": (1, 3, 5, 7),
    "samples": (32, 64, 128, 256, 512),
    "steps": (32, 64, 128, 256),
    "modes": (0, 2, 5, 10, 20, 40),
}
_LEAST = {"harmonics": 1, "samples": 8, "steps": 8, "modes": 0}
_SETTING = {
    "harmonics": "balance.harmonics",
    "samples": "balance.samples",
    "steps": "balance.samples",
    "modes": "reduction.modes",
}
_LABELS = {
    "harmonics": "to harmonic {}",
    "samples": "{} samples",
    "steps": "{} steps a period",
    "modes": "{} modes a blade",
}
#: kinds of the linear curves, whose peaks are the stuck and free frequencies
_LINEAR = ("free", "stuck")
#: choices of contact points on the symmetric patch of 5 x 11 lattice lines, and on the asymmetric
#: faces of 4 rows; the whole face last
_SYMMETRIC: tuple[tuple[str, Any, Any], ...] = (
    ("row 2", [2], 3),
    ("rows 0-1, 2 spots", [0, 1], [1, 9]),
    ("rows 0-1", [0, 1], 3),
    ("rows 1-2, 2 spots", [1, 2], [1, 9]),
    ("rows 1-2", [1, 2], 3),
    ("rows 0-2", [0, 1, 2], 3),
    ("all rows, 2 spots", "all", [1, 9]),
    ("all rows", "all", 3),
)
_ASYMMETRIC: tuple[tuple[str, Any, Any], ...] = (
    ("rows 1-2", [1, 2], 2),
    ("rows 0 and 3", [0, 3], 2),
    ("2 groups of rows", 2, 2),
    ("all rows, 1 column", "all", 1),
    ("all rows, 2 columns", "all", 2),
    ("all rows, 4 columns", "all", 4),
)


def forced_study(scene: ForcedScene, vary: str, levels: Levels = None) -> Study:
    """The ladder of a variation, for the scene's first stiffness and lowest F_C/F_E.

    Parameters
    ----------
    vary
        "harmonics": highest harmonic. "samples": per period. "steps": time steps a period of the
        sweeps up and down, where a peak may be a range: both its ends are followed. "modes":
        fixed-interface modes a blade. "contacts": rows and columns of contact points.
    levels
        Of harmonics, samples, steps or modes; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none, and for any of contacts.
    """
    names = (*_ENDS, *followed(scene, *FORCED_NAMES))
    curves, table = partial(forced_curves, names=names), partial(forced_table, names=names)
    points = tuple(forced_points(scene, vary, levels))
    return ConvergenceStudy(ladder_title(scene, vary), points, curves, table)


def ladder_title(scene: ForcedScene, vary: str) -> str:
    """Title of a ladder, with the load it is run at."""
    ratio = min(scene.excitation.centrifugal_to_force)
    return f"{scene.title or scene.name}: what accuracy costs, {vary}, F_C/F_E {ratio:g}"


def base_settings(scene: ForcedScene, method: str = "balance") -> Settings:
    """What every level of a ladder sets.

    The lowest F_C/F_E, where most slips: at a load under which every point sticks no level differs
    from another. One path of the balance, or the sweeps alone.
    """
    return (
        ("want", ["response"]),
        ("left_out.solve", "no"),
        ("contact.stiffness", [next(iter(scene.stiffnesses))]),
        ("excitation.centrifugal_to_force", [min(scene.excitation.centrifugal_to_force)]),
        ("balance.method", method),
        *([("excitation.force", [])] if scene.excitation.force else []),
    )


def forced_points(scene: ForcedScene, vary: str, levels: Levels = None) -> list[StudyPoint]:
    """Points of `forced_study`."""
    # The ranges of sweeps are what time steps change, and what the other levels do not.
    base = base_settings(scene, "march" if vary == "steps" else "balance")
    if vary == "contacts":
        no_levels(levels, "the choices of contact points are fixed")
        choices = _SYMMETRIC if scene.arrangement == "symmetric" else _ASYMMETRIC
        return [
            StudyPoint(
                "contacts",
                label,
                (
                    *base,
                    ("contact.rule", "lines"),
                    ("contact.rows", rows),
                    ("contact.columns", columns),
                ),
            )
            for label, rows, columns in choices
        ]
    return [
        StudyPoint(vary, _LABELS[vary].format(n), (*base, (_SETTING[vary], n)), 1.0 / (1 + n))
        for n in sorted(whole_levels(levels, _LEAST[vary]) or _LEVELS[vary])
    ]


def forced_curves(solved: Sequence[SolvedPoint], names: Sequence[str]) -> list[ConvergenceCurve]:
    """Error of every followed number against the finest level, over the seconds of the curve with
    friction and its sweeps alone.
    """
    good = with_ends([one for one in solved if not one.outcome.failure])
    return finest_curves(good, _followed(good, names), _friction_seconds)


def with_ends(solved: Sequence[SolvedPoint]) -> list[SolvedPoint]:
    """The points with both ends of every peak that is a range on one of them, in place of one
    number.

    Sweeps up and down do not tell the same of such a peak; where they do, its ends are one.
    """
    ranges = {
        (r.name, r.case)
        for one in solved
        for r in one.outcome.results
        if _PEAK.fullmatch(r.name) and r.low is not None
    }
    if not ranges:
        return list(solved)
    split = []
    for one in solved:
        results: list[PointResult] = []
        for r in one.outcome.results:
            results += _both_ends(r) if (r.name, r.case) in ranges else [r]
        split.append(replace(one, outcome=replace(one.outcome, results=tuple(results))))
    return split


def _both_ends(result: PointResult) -> list[PointResult]:
    low, high = (result.value if end is None else end for end in (result.low, result.high))
    ends = {"lowest": low, "highest": high}
    return [replace(result, name=f"{end}_{result.name}", value=v) for end, v in ends.items()]


def _friction_seconds(one: SolvedPoint) -> float:
    """Of the curve with friction and its sweeps, which the levels change."""
    curve = [value for (name, _), value in one.values.items() if name == "curve_seconds"]
    if not curve:
        return one.outcome.seconds
    return curve[0] + one.outcome.stages.get(_SWEEPS, 0.0)


def forced_table(solved: Sequence[SolvedPoint], names: Sequence[str]) -> TextTable:
    """The followed numbers of every level: what the choices of contact points are read from."""
    solved = with_ends(solved)
    keys = _followed(solved, names)
    named = [name for name, _ in keys]
    rows = []
    for name, case in keys:
        cells = (
            f"{p.values[name, case]:.5g}"
            if (name, case) in p.values
            else "failed" * bool(p.outcome.failure)
            for p in solved
        )
        label = name.replace("_", " ") + (f" ({case.label})" if named.count(name) > 1 else "")
        rows.append((label, *cells))
    heads = ("Hz, (m/s2)/N", *(p.point.label for p in solved))
    return TextTable("Numbers of every level", heads, "l" * len(heads), tuple(rows))


def _followed(solved: Sequence[SolvedPoint], names: Sequence[str]) -> list[Key]:
    """Numbers of the curve with friction, and what the model gives."""
    return [(name, case) for name, case in matching(solved, names) if case.kind not in _LINEAR]


LADDERS: Mapping[str, StudyMaker] = dict.fromkeys((*_LEVELS, "contacts"), forced_study)
