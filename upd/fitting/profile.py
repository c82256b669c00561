"""Sets of parameters that fit as well as an answer: profiles, one parameter moved, the others
fitted.

References
----------
G. A. F. Seber, C. J. Wild, Nonlinear Regression (1989), 5.4.
"""

from __future__ import annotations

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
    rise : ndarray
        (k,) of |r|^2 above the answer's.
    ends : tuple of float
        Of ln(factor) between which they fit as well.
    bounded : tuple of bool
        Whether an end is one of the bounds.
    """

    parameter: int
    z: Array
    rise: Array
    ends: tuple[float, float]
    bounded: tuple[bool, bool]


#: points of a profile to each side at most, and halvings of the interval that holds an end
_POINTS, _HALVINGS = 40, 10
_LONGER = 1.3


def profile(residuals: Residuals, known: Knowledge, best: Array, k: int) -> Profile:
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
    """
    least = float((residuals(best) ** 2).sum())
    span = float(residuals.high[k] - residuals.low[k])
    step = span / _POINTS
    if residuals.known and known.error is not None:
        step = min(step, 0.25 * float(known.error[k]))

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
                inside, outside, on_bound = float(here[k]), float(one.end[k]), False
                for _ in range(_HALVINGS):
                    middle = 0.5 * (inside + outside)
                    again = at(middle, here)
                    inside, outside = (middle, outside) if fits(again) else (inside, middle)
                    if fits(again):
                        rows.append((again.end, again.misfit - least))
                        here = again.end
                end = inside
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
        k, z, np.array([rise for _, rise in rows]), (ends[0], ends[1]), (bounded[0], bounded[1])
    )
