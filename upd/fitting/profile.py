"""Sets of parameters that fit as well as an answer: profiles, one parameter moved, the others
fitted.

References
----------
G. A. F. Seber, C. J. Wild, Nonlinear Regression (1989), 5.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.fitting.first_order import Knowledge
from upd.fitting.residuals import Residuals, Start

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Profile:
    """Sets of parameters that fit as well as the answer, one parameter moved, the others fitted.

    Attributes
    ----------
    parameter : int
        Which is moved.
    z : ndarray
        (k, n) sets, rising in the parameter moved.
    ends : tuple of float
        Of ln(factor) between which they fit as well.
    bounded : tuple of bool
        Whether an end is one of the bounds.
    models : int
        Solved for it.
    """

    parameter: int
    z: Array
    ends: tuple[float, float]
    bounded: tuple[bool, bool]
    models: int = 0


#: points of a profile to each side at most, and cuts of the interval that holds an end
_POINTS, _CUTS = 40, 10
_LONGER = 1.3
#: first step of a profile, and how closely its ends are found, as shares of the half-width
FIRST, _CLOSE = 0.25, 5e-3
#: least share of an interval that is cut off
_CUT = 0.05


def profile(
    residuals: Residuals, known: Knowledge, best: Array, k: int, first: float = FIRST
) -> Profile:
    """The profile of one parameter, from the answer to both sides.

    A set fits as well while |r|^2 rises by no more than 1, with half-widths: an interval in the
    same multiple of standard deviations as they are; without, while the targets are met.

    Parameters
    ----------
    residuals
        Of the fit.
    known
        At the answer.
    best
        (n,) the answer.
    k
        Number of the parameter.
    first
        Step from the answer, as a share of the first-order half-width where there is one.
    """
    before = residuals.responses.evaluations
    least = float((residuals(best) ** 2).sum())
    span = float(residuals.high[k] - residuals.low[k])
    step = span / _POINTS
    if residuals.known and known.error is not None:
        step = min(step, first * float(known.error[k]))

    def fits(one: Start) -> bool:
        if residuals.known:
            return one.misfit - least <= 1.0
        return bool(np.isfinite(one.misfit)) and residuals.met(one.end)

    def at(place: float, near: Array) -> Start:
        begin = near.copy()
        begin[k] = place
        others = np.arange(len(begin)) != k
        begin[others] = residuals.inside(begin)[others]
        return residuals.solve(begin, held=k)

    sides, ends, bounded = [], [], []
    for sign, bound in ((-1.0, residuals.low[k]), (1.0, residuals.high[k])):
        rows, here, length = [(best, 0.0)], best, step
        end, on_bound = float(best[k]), False
        for _ in range(_POINTS):
            place = here[k] + sign * length
            on_bound = bool(sign * (place - bound) >= 0.0)
            one = at(float(bound) if on_bound else float(place), here)
            if not fits(one):
                on_bound = False
                rows += _closed_in(at, fits, rows[-1], one, k, least)
                end = float(rows[-1][0][k])
                break
            here, end = one.end, float(one.end[k])
            rows.append((here, one.misfit - least))
            if on_bound:
                break
            length = min(length * _LONGER, span / _POINTS)
        sides.append(rows)
        ends.append(end)
        bounded.append(on_bound)
    low, high = sides
    rows = [*reversed(low[1:]), *high]
    z = np.array([row for row, _ in rows])
    return Profile(
        k,
        z,
        (ends[0], ends[1]),
        (bounded[0], bounded[1]),
        residuals.responses.evaluations - before,
    )


def _closed_in(
    at: Callable[[float, Array], Start],
    fits: Callable[[Start], bool],
    inside: tuple[Array, float],
    outside: Start,
    k: int,
    least: float,
) -> list[tuple[Array, float]]:
    """Sets that fit as well, ever nearer to the end of a profile, with their rises.

    The root of the rise is proportional to the distance where the misfit is quadratic: its chord
    leads to where it is 1; where the outer set has none, the middle does.

    Parameters
    ----------
    at
        The set with a value of the parameter moved, from another set.
    fits
        Whether one fits as well.
    inside
        The last set that does, and its rise.
    outside
        One beyond the end.
    k
        Number of the parameter.
    least
        |r|^2 of the answer.
    """
    rows: list[tuple[Array, float]] = []
    for _ in range(_CUTS):
        z, rise = rows[-1] if rows else inside
        low, high = float(z[k]), float(outside.end[k])
        q, top = (math.sqrt(max(v, 0.0)) for v in (rise, outside.misfit - least))
        wanted = 1.0 - 0.5 * _CLOSE
        share = (wanted - q) / (top - q) if top > 1.0 and math.isfinite(top) else 0.5
        one = at(low + min(max(share, _CUT), 1.0 - _CUT) * (high - low), z)
        if not fits(one):
            outside = one
            continue
        rows.append((one.end, one.misfit - least))
        if 1.0 - _CLOSE <= math.sqrt(max(rows[-1][1], 0.0)) <= 1.0:
            break
    return rows
