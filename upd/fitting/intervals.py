"""What the targets of a fit leave unknown: to first order, and by profiles, one parameter moved and
the others fitted.

J = dr/dz at the answer shows what is known: with the singular values s and right singular vectors w
of J diag(high - low), a share t of the room along w_i moves the residuals by s_i t. The covariance
of z is (J'J)^-1, in squared half-widths of the targets.

References
----------
G. A. F. Seber, C. J. Wild, Nonlinear Regression (1989), 3.3 and 5.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from upd.errors import UpdError
from upd.fitting.residuals import Residuals, Start

Array = NDArray[np.float64]
#: quantile of 95 % intervals
_T = float(norm.ppf(0.975))
#: shares of a first-order half-width by which its ends may be off: without a note; and such that
#: a 95 % interval keeps its probability to half of its last digit, 2 t phi(t) share = 0.005
SHOWN, KEPT = 0.1, 0.005 / (2.0 * _T * float(norm.pdf(_T)))
#: points of a profile to each side at most, and cuts of the interval that holds an end
_POINTS, _CUTS = 40, 10
_LONGER = 1.3
#: first step of a profile, and how closely its ends are found, as shares of the half-width
FIRST, _CLOSE = 0.25, 5e-3
#: least share of an interval that is cut off
_CUT = 0.05


@dataclass(frozen=True)
class Knowledge:
    """What the targets tell of the parameters at an answer, to first order.

    Attributes
    ----------
    singular : ndarray
        (n,) singular values, falling, of J times the room of ln(factor) between the bounds: how far
        residuals move from bound to bound; 0 beyond the targets' number.
    directions : ndarray
        (n, n) a row each, of length 1 in ln(factor).
    unknown : ndarray
        (n,) of bool: directions that leave all residuals as they are. With half-widths those that
        move residuals by less than one from bound to bound.
    correlation : ndarray, optional
        (n, n) of the parameters; None where directions are unknown.
    error : ndarray, optional
        (n,) half-widths of ln(factor), or what ln(factor) moves as every target is known to its own
        size alone; None where directions are unknown.
    rises : ndarray, optional
        (n, 2) how far the misfit rises to the ends of the intervals, 1 where it is quadratic; None
        where there are none, or all profiles were traced.
    """

    singular: Array
    directions: Array
    unknown: NDArray[np.bool_]
    correlation: Array | None
    error: Array | None
    rises: Array | None = None


def misfit_rises(
    residuals: Callable[[Array], Array], known: Knowledge, z: Array, low: Array, high: Array
) -> Array:
    """How far the misfit rises to the ends of the first-order intervals.

    With C = (J'J)^-1 the least misfit with z_k held moves z along C e_k: to the end of its interval
    by d_k = C e_k / C_kk^(1/2), and to first order the misfit rises by |J d_k|^2 = 1. Where slopes
    change within the interval, as where contact points begin to slip, it rises otherwise.

    Parameters
    ----------
    residuals
        z (n,) -> (m,) in half-widths.
    known
        Of the answer, with its correlation and errors.
    z, low, high
        (n,) the answer and the bounds.

    Returns
    -------
    ndarray
        (n, 2) at the lower and the upper end; nan beyond a bound, where nothing was solved,
        and where the scene refuses the parameters.

    References
    ----------
    D. M. Bates, D. G. Watts, Nonlinear Regression Analysis and Its Applications (1988), 6.1.
    """
    assert known.correlation is not None and known.error is not None
    steps = known.correlation * known.error
    best = float(np.sum(residuals(z) ** 2))

    def rise(at: Array) -> float:
        if (at < low).any() or (at > high).any():
            return math.nan
        try:
            return float(np.sum(residuals(at) ** 2)) - best
        except UpdError:
            return math.nan

    return np.array([[rise(z - d), rise(z + d)] for d in steps])


def is_bent(rises: Array, share: float) -> bool:
    """Whether the misfit is not quadratic within a first-order interval: its true end is about the
    half-width over the root of the rise away.

    Parameters
    ----------
    rises
        (2,) to its ends; nan where not known.
    share
        Of the half-width by which an end may be off.
    """
    roots = np.sqrt(np.maximum(rises[np.isfinite(rises)], 0.0))
    return bool((np.abs(roots - 1.0) > share).any())


def knowledge(residuals: Residuals, z: Array) -> Knowledge:
    """What is known at an answer.

    Parameters
    ----------
    residuals
        Of the fit.
    z
        (n,) the answer.
    """
    J, span = residuals.jacobian(z), residuals.high - residuals.low
    n = len(span)
    _, s, W = np.linalg.svd(J * span)
    s = np.concatenate([s, np.zeros(n - len(s))])
    V = W * span
    V /= np.linalg.norm(V, axis=1)[:, None]
    unknown = s < (1.0 if residuals.known else residuals.rounding * s[0])
    if unknown.any():
        return Knowledge(s, V, unknown, None, None)
    covariance = span[:, None] * ((W.T / s**2) @ W) * span
    error = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(error, error)
    return Knowledge(s, V, unknown, correlation, error)


# -- profiles --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Profile:
    """Sets of parameters that fit as well as the answer, one parameter moved, the others fitted.

    Attributes
    ----------
    parameter : int
        Which is moved.
    z : ndarray
        (k, n) sets, rising in the parameter moved.
    """

    parameter: int
    z: Array


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

    sides = []
    for sign, bound in ((-1.0, residuals.low[k]), (1.0, residuals.high[k])):
        rows, here, length = [(best, 0.0)], best, step
        for _ in range(_POINTS):
            place = here[k] + sign * length
            on_bound = bool(sign * (place - bound) >= 0.0)
            one = at(float(bound) if on_bound else float(place), here)
            if not fits(one):
                rows += _closed_in(at, fits, rows[-1], one, k, least)
                break
            here = one.end
            rows.append((here, one.misfit - least))
            if on_bound:
                break
            length = min(length * _LONGER, span / _POINTS)
        sides.append(rows)
    low, high = sides
    rows = [*reversed(low[1:]), *high]
    return Profile(k, np.array([row for row, _ in rows]))


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
