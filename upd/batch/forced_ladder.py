"""Ladders of a forced response: harmonics, samples, modes kept, and the choice of contact points."""

from __future__ import annotations

from typing import Any

import numpy as np

from upd.batch.ladder import Outcome, Point
from upd.batch.work_precision import Curve
from upd.errors import InputError
from upd.scene import ForcedScene

VARIATIONS = ("harmonics", "samples", "modes", "contacts")
#: numbers the studies follow: the curve with friction and, where the model changes, the stuck frequencies
FOLLOWED = ("peak_1_frequency", "peak_1_accelerance", "peak_2_frequency", "peak_2_accelerance", "stuck_in_phase", "stuck_out_of_phase")
_LEVELS = {"harmonics": (1, 3, 5, 7), "samples": (32, 64, 128, 256, 512), "modes": (0, 2, 5, 10, 20, 40)}
_LEAST = {"harmonics": 1, "samples": 8, "modes": 0}
_SETTING = {"harmonics": "balance.harmonics", "samples": "balance.samples", "modes": "reduction.modes"}
#: cases of the linear curves, whose peaks are the stuck and free frequencies
_LINEAR = ("free", "stuck")
#: choices of contact points on the symmetric patch of 5 x 11 lattice lines, and on the asymmetric faces of 4 rows; the whole face last
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


def forced_points(scene: ForcedScene, vary: str, levels: tuple[int, ...] | None = None) -> list[Point]:
    """The ladder of a variation, for the scene's first stiffness and F_C/F_E; ``levels`` as for ``vary``, none for contacts.

    harmonics : highest harmonic. samples : per period. modes : fixed-interface modes a blade. contacts : rows and columns of points.
    """
    if vary not in VARIATIONS:
        raise InputError(f"--vary {vary}: choose one of {', '.join(VARIATIONS)}")
    base: tuple[tuple[str, Any], ...] = (
        ("want", ["response"]),
        ("contact.stiffness", [next(iter(scene.stiffnesses))]),
        ("excitation.centrifugal_to_force", [scene.excitation.centrifugal_to_force[0]]),
    )
    if vary == "contacts":
        if levels is not None:
            raise InputError("--levels: the choices of contact points are fixed; leave it out")
        choices = _SYMMETRIC if scene.arrangement == "symmetric" else _ASYMMETRIC
        chosen = [(("contact.rows", rows), ("contact.columns", columns)) for _, rows, columns in choices]
        return [
            Point("contacts", label, (*base, *c), 1.0 / (1 + k)) for k, ((label, *_), c) in enumerate(zip(choices, chosen, strict=True))
        ]
    if levels is not None and (len(levels) < 2 or min(levels) < _LEAST[vary]):
        raise InputError(f"--levels {levels}: give at least two whole numbers, {_LEAST[vary]} or more")
    label = {"harmonics": "to harmonic {}", "samples": "{} samples", "modes": "{} modes a blade"}[vary]
    return [Point(vary, label.format(n), (*base, (_SETTING[vary], n)), 1.0 / (1 + n)) for n in sorted(levels or _LEVELS[vary])]


def forced_curves(outcomes: list[Outcome]) -> list[Curve]:
    """Error of every followed number against the finest level, over the seconds of the curve with friction alone."""
    good = [o for o in outcomes if not o.failure]
    keys = list(dict.fromkeys(k for name in FOLLOWED for o in good for k in o.values if _followed(k) and k.split("|")[0] == name))
    found = [_curve(good, key) for key in keys]
    # what the variation does not touch, a stuck frequency over harmonics, has no error to show
    return [curve for curve in found if curve is not None and any(curve.error)]


def _curve(outcomes: list[Outcome], key: str) -> Curve | None:
    mine = [o for o in outcomes if key in o.values]
    # A number the finest level does not have, a second peak for example, has nothing to be compared with.
    if len(mine) < 2 or mine[-1] is not outcomes[-1]:
        return None
    name, case = key.split("|")
    values = np.array([o.values[key] for o in mine])
    reference = float(values[-1])
    seconds = tuple(next((v for k, v in o.values.items() if k.startswith("curve_seconds|")), o.seconds) for o in mine)
    return Curve(
        mine[0].curve, name, case, tuple(o.label for o in mine), tuple(o.h for o in mine), tuple(map(float, values / reference - 1.0)),
        seconds, tuple(o.memory_mb for o in mine), reference, "finest level", float("nan"), None, None,
    )  # fmt: skip


def forced_table(outcomes: list[Outcome]) -> list[tuple[str, dict[str, float], str]]:
    """(level, number -> value, failure) of every point: what the choices of contact points are read from."""

    def name(key: str) -> str:
        return key.split("|")[0] + " downwards" * key.endswith("downwards")

    return [(o.label, {name(k): v for k, v in o.values.items() if _followed(k)}, o.failure) for o in outcomes]


def _followed(key: str) -> bool:
    return key.split("|")[0] in FOLLOWED and not key.endswith(_LINEAR)
