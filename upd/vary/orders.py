"""Convergence rates and error estimates from results on several meshes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import fdtri, stdtrit

from upd.errors import InputError

FloatArray = NDArray[np.float64]

#: factors of safety of P. J. Roache: of an order that levels confirm, and of one they do not
_CONFIRMED, UNCONFIRMED = 1.25, 3.0
#: orders a level sequence is trusted with: the formal order 2 of displacements with linear elements
#: above, and what still is convergence below (C. J. Roy, as below)
_LOWEST, _FORMAL = 0.5, 2.0
#: order assumed of two levels, which cannot show one: the lowest the method has, that of stresses
ASSUMED = 1.0
#: share of the variance of the logarithms that a power law explains where an order is clear
_EXPLAINED = 0.9
#: two orders agree when they differ by no more than this share of the formal one (Roy, as below)
_AGREE = 0.1


def fit_rate(h: ArrayLike, error: ArrayLike) -> float:
    """Order p of |error| = C h^p, least squares in the logarithms over all meshes.

    Parameters
    ----------
    h, error
        (n,), n >= 2. Exact zeros in the error are left out.

    Returns
    -------
    float
        nan when fewer than two points remain, or when a power law explains less than nine tenths of
        the variance of the logarithms: the scatter of nodes at the contact's edge.
    """
    size, e = np.asarray(h, float), np.abs(np.asarray(error, float))
    good = e > 0.0
    if good.sum() < 2:
        return float("nan")
    x, y = np.log(size[good]), np.log(e[good])
    slope, start = np.polyfit(x, y, 1)
    variance = float(np.sum((y - y.mean()) ** 2))
    explained = (
        1.0 - float(np.sum((y - slope * x - start) ** 2)) / variance if variance > 0.0 else 0.0
    )
    return float(slope) if explained >= _EXPLAINED else float("nan")


@dataclass(frozen=True)
class Extrapolation:
    """Limit of q(h) = limit + C h^order, and the largest deviation of the meshes from the fit,
    relative to the limit.
    """

    limit: float
    order: float
    scatter: float


def extrapolate(h: ArrayLike, values: ArrayLike) -> Extrapolation:
    """Fit q(h) = limit + C h^p over three or more meshes.

    p is the best of a fine grid from 0.5 to 4, limit and C are linear.

    For exactly three meshes with a constant ratio of sizes this is Richardson's extrapolation (P.
    J. Roache, Verification and Validation in Computational Science and Engineering, 1998, chapter
    5). Finer meshes weigh more (1 / h).
    """
    size, q = np.asarray(h, float), np.asarray(values, float)
    if size.shape != q.shape or len(size) < 3:
        raise InputError(
            "extrapolation needs three meshes or more, with one value each; got "
            f"{size.shape} and {q.shape}"
        )
    weight = np.sqrt(1.0 / size)

    def fit(p: float) -> tuple[float, np.ndarray[tuple[int], np.dtype[np.float64]]]:
        A = np.column_stack([np.ones_like(size), (size / size.max()) ** p])
        solution, *_ = np.linalg.lstsq(A * weight[:, None], q * weight, rcond=None)
        return float(np.sum((weight * (A @ solution - q)) ** 2)), solution

    grid = np.linspace(0.5, 4.0, 141)
    best = min(grid, key=lambda p: fit(p)[0])
    solution = fit(best)[1]
    model = solution[0] + solution[1] * (size / size.max()) ** best
    scale = abs(solution[0]) or 1.0
    return Extrapolation(float(solution[0]), float(best), float(np.abs(model - q).max() / scale))


def two_level_error(coarse: float, fine: float, ratio: float, order: float = 1.0) -> float:
    """Richardson's relative error of ``fine``, no factor of safety.

    Parameters
    ----------
    coarse, fine
        The number on two meshes.
    ratio
        Of their sizes, above 1.
    order
        The order p the error is taken to have.

    Returns
    -------
    float
        abs(fine - coarse) / (ratio^p - 1), relative to abs(fine).

    Raises
    ------
    InputError
        When the ratio is not above 1.

    References
    ----------
    P. J. Roache, Verification and Validation in Computational Science and Engineering (1998), eq.
    (5.4.2).
    """
    if not ratio > 1.0:
        raise InputError(
            f"the coarse mesh must be coarser: ratio of sizes {ratio:g} is not above 1"
        )
    if fine == 0.0:
        return 0.0 if coarse == 0.0 else float("inf")
    return float(abs(fine - coarse) / (ratio**order - 1.0) / abs(fine))


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated bound of the relative error of the finest level.

    Attributes
    ----------
    error
        Fraction of the finest value; nan with one level.
    order
        Order of convergence the levels show; nan where they show none.
    basis
        How it was estimated, in words.
    falls
        Order with which the bound falls: the observed one, that of the scatter, or the lowest.
    """

    error: float
    order: float
    basis: str
    falls: float = ASSUMED

    @property
    def clear(self) -> bool:
        """Whether the levels show an order."""
        return bool(np.isfinite(self.order))


def estimate_error(h: ArrayLike, values: ArrayLike) -> ErrorEstimate:
    """Bound the error of the finest of several levels by their differences.

    Richardson's error e(p) = abs(q2 - q1) / (r^p - 1) of the two finest levels (sizes in the ratio
    r), times a factor of safety:

    - two levels show no order: 3 e(1);
    - three levels show an order p: 3 e(p), with p at most the formal 2. More than a tenth above
      that their last difference may be small by chance: at least 1.25 times the range of the three;
    - four levels whose finer and coarser three show the same order, within a tenth of the formal
      one: 1.25 e(p), the lower of the two and at most 2;
    - four levels whose threes show different orders, both at most 2: 1.25 e(p) with p as far below
      the lower as that is below the upper, which is the order to come where it changes as much
      again and the careful one where it grows; if it is 1/2 or more;
    - differences that change sign or grow, and orders below 1/2, are no clear order: 3 times the
      range of the three finest levels, and at least 3 e(1/2) while they shrink.

    Parameters
    ----------
    h
        (n,) sizes of the levels, all different.
    values
        (n,) the number on each.

    Returns
    -------
    ErrorEstimate

    Raises
    ------
    InputError
        For sizes that are not positive or not different, and when there are not as many values.

    References
    ----------
    .. [1] P. J. Roache, Verification and Validation in Computational Science and Engineering
       (1998), chapter 5: factors 3 for two grids, 1.25 for three or more with the observed order.
    .. [2] P. J. Roache, J. Fluids Eng. 133 (2011) 115501: the factor 3 again where the observed
       order is not a reasonable one.
    .. [3] C. J. Roy, Review of discretization error estimators in scientific computing, AIAA paper
       2010-126: orders kept between 1/2 and the formal one, agreement within 10 %.
    .. [4] L. Eca, M. Hoekstra, J. Comput. Phys. 262 (2014) 104, and the earlier forms it cites: the
       range of the data as the scale of an error where levels scatter.
    """
    size, q = _levels(h, values)
    fine_first = np.argsort(size)
    size, q = size[fine_first], q[fine_first]
    if len(size) < 2:
        return ErrorEstimate(float("nan"), float("nan"), "one level: no estimate")
    scale = abs(float(q[0]))

    def richardson(order: float) -> float:
        return two_level_error(float(q[1]), float(q[0]), float(size[1] / size[0]), order)

    def share(difference: float) -> float:
        return difference / scale if scale else float("inf") if difference else 0.0

    if len(size) == 2:
        basis = f"two levels, order {ASSUMED:g} assumed, factor {UNCONFIRMED:g}"
        return ErrorEstimate(UNCONFIRMED * richardson(ASSUMED), float("nan"), basis)
    order, spread = observed_order(size[:3], q[:3]), share(float(np.ptp(q[:3])))
    if not order >= _LOWEST:
        slow = UNCONFIRMED * richardson(_LOWEST) if order > 0.0 else 0.0
        basis = f"no clear order: {UNCONFIRMED:g} times the range of three levels"
        return ErrorEstimate(max(slow, UNCONFIRMED * spread), float("nan"), basis)
    before = observed_order(size[1:4], q[1:4]) if len(size) > 3 else float("nan")
    lower, upper = sorted((min(order, _FORMAL), min(before, _FORMAL)))
    if lower >= _LOWEST and upper - lower <= _AGREE * _FORMAL:
        basis = f"order {order:.1f} of four levels, factor {_CONFIRMED:g}"
        return ErrorEstimate(_CONFIRMED * richardson(lower), order, basis)
    further = 2.0 * lower - upper
    if further >= _LOWEST:
        basis = (
            f"orders {before:.1f} and {order:.1f} of four levels, {further:.1f} to come, "
            f"factor {_CONFIRMED:g}"
        )
        return ErrorEstimate(_CONFIRMED * richardson(further), order, basis)
    error = UNCONFIRMED * richardson(min(order, _FORMAL))
    if order > (1.0 + _AGREE) * _FORMAL:
        error = max(error, _CONFIRMED * spread)
    shown = f"order {order:.1f}" if order <= 2.0 * _FORMAL else f"an order above {2.0 * _FORMAL:g}"
    return ErrorEstimate(error, order, f"{shown} of three levels, factor {UNCONFIRMED:g}")


def _levels(h: ArrayLike, values: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Sizes and values as arrays (n,); InputError where they are none of levels."""
    size, q = np.asarray(h, float), np.asarray(values, float)
    if size.ndim != 1 or size.shape != q.shape:
        raise InputError(f"one value per level: got {size.shape} sizes and {q.shape} values")
    if not np.all(size > 0.0) or len(set(size.tolist())) < len(size):
        raise InputError(f"sizes of levels must be positive and differ: got {size.tolist()}")
    return size, q


def observed_order(h: ArrayLike, values: ArrayLike) -> float:
    """Order p of q(h) = limit + C h^p through three levels.

    Parameters
    ----------
    h
        (3,) sizes, all different.
    values
        (3,) the number on each.

    Returns
    -------
    float
        Negative where the differences grow under refinement, inf where the finer one is zero; nan
        where they change sign, or nothing changes.

    References
    ----------
    P. J. Roache, Verification and Validation in Computational Science and Engineering (1998), eq.
    (5.10.6.1): any ratios of sizes.
    """
    size, q = np.asarray(h, float), np.asarray(values, float)
    coarse_first = np.argsort(-size)
    (x1, x2, x3), (d1, d2) = np.log(size[coarse_first]), np.diff(q[coarse_first])
    if d1 * d2 < 0.0 or d1 == 0.0:
        return float("nan")
    if d2 == 0.0:
        return float("inf")

    def excess(p: float) -> float:
        """log of (h1^p - h2^p) / (h2^p - h3^p), which rises with p, over that of the values."""
        steep, flat = (
            np.log(np.expm1(p * step) / p) if p else np.log(step) for step in (x1 - x2, x2 - x3)
        )
        return float(steep - flat + p * (x2 - x3) - np.log(d1 / d2))

    # Far more than any sequence can show: exp stays finite for ratios of sizes up to e^7.
    low, high = -100.0, 100.0
    if excess(low) >= 0.0 or excess(high) <= 0.0:
        return float("-inf") if excess(low) >= 0.0 else float("inf")
    return float(brentq(excess, low, high))


def change_order(h: ArrayLike, values: ArrayLike) -> float:
    """Order p at which a quantity still changes under refinement, from |dq / d log h| = C h^p.

    Needs no limit, so it shows a missing one.

    q = limit + C h^p gives p > 0; q = C h^-s (the pressure at the edge of a flat punch) gives -s, q
    = C log h gives 0: no limit. h, values : (n,), n >= 3. nan as in `fit_rate`.
    """
    size, q = np.asarray(h, float), np.asarray(values, float)
    order = np.argsort(-size)
    size, q = size[order], q[order]
    if len(size) < 3:
        return float("nan")
    change = np.diff(q) / np.diff(np.log(size))
    x, y = 0.5 * (np.log(size[1:]) + np.log(size[:-1])), np.abs(change)
    if not np.all(y > 0.0) or len(set(np.sign(change))) > 1:
        return float("nan")
    return float(np.polyfit(x, np.log(y), 1)[0])


#: power of the element size h that the scatter of a contact's numbers goes with: the pressure falls
#: to zero as the root of the distance from the edge, which a lattice places to one spacing, so that
#: forces over a contact of radius a scatter with (h / a)^(3/2)
SCATTER = 1.5
#: confidence of an interval
CONFIDENCE = 0.95


def fitted_error(h: ArrayLike, values: ArrayLike) -> ErrorEstimate:
    """Bound the error of the finest of four or more levels that may scatter; of fewer as
    `estimate_error`.

    q(h) = limit + C h^p + scatter, by least squares with deviations that go with h^(3/2). The order
    p is the formal one, 2, unless another of 1/2 to 2 explains the levels so much better that an
    F test at 5 % shows. The bound is 1.25 times the finest level's distance from the limit (Roache)
    and, beside it, the half-width of the limit's 95 % interval (Student's t). Levels without
    scatter get 1.25 times Richardson's error this way, levels that are scatter alone its size.

    Parameters
    ----------
    h
        (n,) sizes of the levels, all different.
    values
        (n,) the number on each.

    Returns
    -------
    ErrorEstimate

    Raises
    ------
    InputError
        As `estimate_error`.

    References
    ----------
    .. [1] L. Eca, M. Hoekstra, A procedure for the estimation of the numerical uncertainty of CFD
       calculations based on grid refinement studies, J. Comput. Phys. 262 (2014) 104: least squares
       over levels that scatter, weights by their size.
    .. [2] N. R. Draper, H. Smith, Applied Regression Analysis, 3rd ed. (1998), 1.4 and 2.7: the
       interval of a coefficient, the extra sum of squares.
    """
    size, q = _levels(h, values)
    if len(size) < 4:
        return estimate_error(size, q)
    x, fine = size / size.min(), float(q[np.argmin(size)])
    if not np.ptp(q):
        return ErrorEstimate(0.0, float("inf"), "the same on all levels")
    if fine == 0.0:
        return ErrorEstimate(float("inf"), float("nan"), "the finest level is zero")
    found = {p: _weighted_fit(x, q, p) for p in np.linspace(_LOWEST, _FORMAL, 31)}
    best, n = min(found, key=lambda p: found[p].squares), len(q)
    least = found[best].squares / (n - 3)
    gain = found[_FORMAL].squares - found[best].squares
    free = best < _FORMAL and gain > fdtri(1, n - 3, CONFIDENCE) * least
    p, dof = (best, n - 3) if free else (_FORMAL, n - 2)
    fit = found[p]
    scatter = math.sqrt(fit.squares / dof * fit.variance)
    half_width = float(stdtrit(dof, 0.5 + 0.5 * CONFIDENCE)) * scatter
    away = _CONFIRMED * abs(fine - fit.limit)
    order = float(p) if away > half_width else float("nan")
    shown = f"order {p:.1f}" if away > half_width else "scatter above convergence"
    basis = f"{shown}, least squares of {n} levels, {100 * CONFIDENCE:.0f} % interval"
    falls = float(p) if away > half_width else SCATTER
    return ErrorEstimate((away + half_width) / abs(fine), order, basis, falls)


def ladder_error(h: ArrayLike, values: ArrayLike) -> ErrorEstimate:
    """Bound the error of the finest of several levels: by their differences where they rise or fall
    all the way (`estimate_error`), by least squares where they scatter (`fitted_error`).

    Parameters, returns and errors as for both.

    Parameters
    ----------
    h, values
        (n,) sizes of the levels, all different, and the number on each.
    """
    steps = np.diff(np.asarray(values, float)[np.argsort(np.asarray(h, float))])
    one_way = bool(np.all(steps >= 0.0) or np.all(steps <= 0.0))
    return estimate_error(h, values) if one_way else fitted_error(h, values)


@dataclass(frozen=True)
class _Fit:
    """limit + C h^p: the limit, its variance over that of the weighted deviations, the sum of their
    squares.
    """

    limit: float
    variance: float
    squares: float


def _weighted_fit(
    x: np.ndarray[Any, np.dtype[np.float64]], q: np.ndarray[Any, np.dtype[np.float64]], p: float
) -> _Fit:
    """Least squares with deviations that go with x^(3/2)."""
    weight = x**-SCATTER
    A = np.column_stack([weight, weight * x**p])
    solution, *_ = np.linalg.lstsq(A, weight * q, rcond=None)
    off = weight * q - A @ solution
    return _Fit(float(solution[0]), float(np.linalg.inv(A.T @ A)[0, 0]), float(off @ off))
