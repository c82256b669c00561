"""Ladders of a forced response.

Harmonics, samples, modes kept, and the choice of contact points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    check_levels,
    followed,
    matching,
    no_levels,
)
from upd.scene import ForcedScene

#: numbers a ladder follows beside those the analysis names first: where the model changes, the
#: stuck frequencies
_MORE = ("peak_?_frequency", "peak_?_accelerance", "stuck_in_phase", "stuck_out_of_phase")
_LEVELS = {
    "harmonics": (1, 3, 5, 7),
    "samples": (32, 64, 128, 256, 512),
    "modes": (0, 2, 5, 10, 20, 40),
}
_LEAST = {"harmonics": 1, "samples": 8, "modes": 0}
_SETTING = {
    "harmonics": "balance.harmonics",
    "samples": "balance.samples",
    "modes": "reduction.modes",
}
_LABELS = {"harmonics": "to harmonic {}", "samples": "{} samples", "modes": "{} modes a blade"}
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
        "harmonics": highest harmonic. "samples": per period. "modes": fixed-interface modes a
        blade. "contacts": rows and columns of contact points.
    levels
        Of harmonics, samples or modes; None for the usual ones.

    Raises
    ------
    InputError
        For levels that are none, and for any of contacts.
    """
    names = followed(scene, *_MORE)
    curves, table = partial(forced_curves, names=names), partial(forced_table, names=names)
    title = f"{scene.title or scene.name}: what accuracy costs, {vary}"
    return ConvergenceStudy(title, tuple(forced_points(scene, vary, levels)), curves, table)


def forced_points(scene: ForcedScene, vary: str, levels: Levels = None) -> list[StudyPoint]:
    """Points of `forced_study`."""
    # Where most slips: at a load under which every point sticks no level differs from another.
    # One path of the balance: the ranges of sweeps are not what these levels change.
    base: Settings = (
        ("want", ["response"]),
        ("contact.stiffness", [next(iter(scene.stiffnesses))]),
        ("excitation.centrifugal_to_force", [min(scene.excitation.centrifugal_to_force)]),
        ("balance.method", "balance"),
        *([("excitation.force", [])] if scene.excitation.force else []),
    )
    if vary == "contacts":
        no_levels(levels, "the choices of contact points are fixed")
        choices = _SYMMETRIC if scene.arrangement == "symmetric" else _ASYMMETRIC
        return [
            StudyPoint(
                "contacts",
                label,
                (*base, ("contact.rows", rows), ("contact.columns", columns)),
            )
            for label, rows, columns in choices
        ]
    check_levels(levels, _LEAST[vary])
    return [
        StudyPoint(vary, _LABELS[vary].format(n), (*base, (_SETTING[vary], n)), 1.0 / (1 + n))
        for n in sorted(levels or _LEVELS[vary])
    ]


def forced_curves(solved: Sequence[SolvedPoint], names: Sequence[str]) -> list[ConvergenceCurve]:
    """Error of every followed number against the finest level, over the seconds of the curve with
    friction alone.
    """
    good = [one for one in solved if not one.outcome.failure]
    return finest_curves(good, _followed(good, names), _friction_seconds)


def _friction_seconds(one: SolvedPoint) -> float:
    return next(
        (value for (name, _), value in one.values.items() if name == "curve_seconds"),
        one.outcome.seconds,
    )


def forced_table(solved: Sequence[SolvedPoint], names: Sequence[str]) -> TextTable:
    """The followed numbers of every level: what the choices of contact points are read from."""
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
