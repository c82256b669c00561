"""What other levels make of the optimum of a performance curve.

The optimum is min over r = F_C/F_E of h(r), the highest peak. Of a smooth h its derivative with
respect to anything else is that of h at the optimum, r held: dh*/dp = dh/dp + (dh/dr) dr*/dp, and
dh/dr = 0 there (the envelope theorem). So its peak is marched again on every level at its own
F_C/F_E, and no other.

References
----------
P. Milgrom, I. Segal, Econometrica 70 (2002) 583: envelope theorems, of a minimum at a kink too.
"""

from __future__ import annotations

import math

import numpy as np

from upd.analyses.forced.level_values import Key
from upd.analyses.forced.marches_again import SweptPeakAt
from upd.analyses.forced.model import Array
from upd.analyses.forced.performance_curve import Performance
from upd.analyses.forced.solution import ForcedSolution
from upd.results import Case

#: numbers of the optimum, and the attributes of a level's peak that they are
KINDS = (("optimum_frequency", "frequency"), ("optimum_peak", "height"))


def optimum_keys(name: str) -> list[tuple[Key, str]]:
    """Numbers of the optimum of one stiffness, each with the attribute of a level's peak."""
    case = Case(stiffness=name, name="performance")
    return [((number, case), attribute) for number, attribute in KINDS]


def optimum_at(solution: ForcedSolution, name: str) -> SweptPeakAt | None:
    """The highest peak of the sweeps at the optimum; None where no sweep has one there."""
    performance = solution.performances.get(name)
    if performance is None or performance.optimum is None:
        return None
    here = [one for one in performance.sweeps if one.ratio == performance.optimum[0]]
    found = [(peak, one) for one in here for peak in one.peaks["right"]]
    if not found:
        return None
    peak, sweep = max(found, key=lambda one: one[0].height)
    return SweptPeakAt(solution.plan, sweep, "right", peak)


def between_ratios(performance: Performance) -> float:
    """How far the least height may lie below that of the optimum, between the F_C/F_E of the curve,
    as a share of it, if the curve over log F_C/F_E is convex there.

    A convex curve lies above the chords of its neighbours taken on: below no point between two of
    its F_C/F_E than where both cross. NaN where the curve has too few, or is not convex.
    """
    ratio, _, height, _ = performance.highest
    best = int(height.argmin())
    x = np.log(ratio)
    least = [
        _crossing(x[k - 1 : k + 3], height[k - 1 : k + 3])
        for k in (best - 1, best)
        if 0 < k < len(x) - 2
    ]
    if len(least) < 2:
        return math.nan
    return float(1.0 - min(least) / height[best])


def _crossing(x: Array, y: Array) -> float:
    """Height between the middle two of four points below which no convex curve through them is;
    NaN where they are not convex.
    """
    slopes = np.diff(y) / np.diff(x)
    if not np.all(np.diff(slopes) >= 0.0):
        return math.nan
    if slopes[2] == slopes[0]:
        return float(min(y[1:3]))
    at = (y[2] - y[1] + slopes[0] * x[1] - slopes[2] * x[2]) / (slopes[0] - slopes[2])
    return float(y[1] + slopes[0] * (at - x[1]))
