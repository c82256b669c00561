"""What is read between neighbours of a peak over F_C/F_E: cubics of their values and slopes, not
beyond the values of both ends where these are not of one branch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from upd.hbm.curve_peaks import PeakPoint
from upd.hbm.peaks import JUMP_FREQUENCY

Array = NDArray[np.float64]
#: ln(F_C/F_E): points that are one
SAME = 1e-6
#: ln of heights: how far values and slopes of neighbours of one branch may miss each other
MISS = 0.02
#: step of slopes that are read from a curve
_STEP = 2e-3


def of_one_branch(h: float, a: PeakPoint, b: PeakPoint, miss: float = MISS) -> bool:
    """Whether points h apart are of one branch.

    A cubic with the values y and the slopes g of its ends has
    y_b - y_a - h (g_a + g_b)/2 = -h^3 y'''/12: none where it is a parabola.
    """
    if abs(b.frequency / a.frequency - 1.0) > JUMP_FREQUENCY:
        return False
    return abs(b.log_height - a.log_height - 0.5 * h * (a.slope + b.slope)) <= miss


def with_slopes(s: Sequence[float], points: Sequence[PeakPoint]) -> list[PeakPoint]:
    """Points of one peak, slopes that are not known by differences to second order."""
    if len(s) < 2:
        return [replace(p, slope=0.0 if math.isnan(p.slope) else p.slope) for p in points]
    y = np.array([p.log_height for p in points])
    read = np.gradient(y, np.array(s), edge_order=2 if len(s) > 2 else 1)
    return [
        replace(p, slope=float(g)) if math.isnan(p.slope) else p
        for p, g in zip(points, read, strict=True)
    ]


def slope_of(curve: Callable[[Array], Array], s: float, low: float, high: float) -> float:
    ends = np.clip([s - _STEP, s + _STEP], low, high)
    values = curve(ends)
    if not ends[1] > ends[0] or not np.isfinite(values).all():
        # at the rim of what is known
        return math.nan
    return float((values[1] - values[0]) / (ends[1] - ends[0]))


def joined_cubics(
    x: Array, points: Sequence[PeakPoint], joined: NDArray[np.bool_]
) -> Callable[[Array], Array]:
    """The cubics through values and slopes of one peak; -inf outside and where neighbours are not
    joined.

    Parameters
    ----------
    x
        (n,) ln r.
    points
        n of the peak.
    joined
        (n - 1,).
    """
    v = np.array([p.log_height for p in points])
    if len(x) > 1:
        cubic = CubicHermiteSpline(x, v, [p.slope for p in points])
        ends = zip(pairwise(x), pairwise(points), strict=True)
        one = [of_one_branch(b - a, p, q) for (a, b), (p, q) in ends]
        low = np.where(one, -math.inf, np.minimum(v[:-1], v[1:]))
        high = np.where(one, math.inf, np.maximum(v[:-1], v[1:]))

    def value(at: Array) -> Array:
        at = np.asarray(at, float)
        out = np.full(at.shape, -math.inf)
        for s, y in zip(x, v, strict=True):
            out[np.abs(at - s) <= SAME] = y
        if len(x) > 1:
            k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
            inside = (at >= x[0]) & (at <= x[-1]) & joined[k]
            read = np.clip(cubic(np.clip(at, x[0], x[-1])), low[k], high[k])
            out = np.where(inside, read, out)
        return out

    return value
