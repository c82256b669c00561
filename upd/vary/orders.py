"""Convergence rates and error estimates from results on several meshes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import fdtri, stdtr, stdtrit

from upd.errors import InputError
from upd.results.case import Case

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


def extrapolate(h: ArrayLike, values: ArrayLike) -> tuple[float, float]:
    """Limit and order p of q(h) = limit + C h^p over three or more meshes.

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

    grid = np.linspace(0.5, 4.0, 141)
    fits = {p: _limit([np.ones_like(size), (size / size.max()) ** p], q, weight) for p in grid}
    best = min(grid, key=lambda p: fits[p][2])
    return fits[best][0], float(best)


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

    if len(size) == 2:
        basis = f"two levels, order {ASSUMED:g} assumed, factor {UNCONFIRMED:g}"
        return ErrorEstimate(UNCONFIRMED * richardson(ASSUMED), float("nan"), basis)
    order, spread = observed_order(size[:3], q[:3]), float(np.ptp(q[:3]))
    spread = spread / scale if scale else float("inf") if spread else 0.0
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
    orders = np.linspace(_LOWEST, _FORMAL, 31)
    found = {p: _limit([np.ones_like(x), x**p], q, x**-SCATTER) for p in orders}
    best, n = min(found, key=lambda p: found[p][2]), len(q)
    least = found[best][2] / (n - 3)
    gain = found[_FORMAL][2] - found[best][2]
    free = best < _FORMAL and gain > fdtri(1, n - 3, CONFIDENCE) * least
    p, dof = (best, n - 3) if free else (_FORMAL, n - 2)
    limit, variance, squares = found[p]
    scatter = math.sqrt(squares / dof * variance)
    half_width = float(stdtrit(dof, 0.5 + 0.5 * CONFIDENCE)) * scatter
    away = _CONFIRMED * abs(fine - limit)
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


def _limit(
    columns: Sequence[FloatArray], q: FloatArray, weight: FloatArray
) -> tuple[float, float, float]:
    """Weighted least squares: the first coefficient, its variance over that of the weighted
    deviations, the sum of their squares.
    """
    A = np.column_stack(columns) * weight[:, None]
    solution, *_ = np.linalg.lstsq(A, weight * q, rcond=None)
    off = weight * q - A @ solution
    return float(solution[0]), float(np.linalg.pinv(A.T @ A)[0, 0]), float(off @ off)


# -- levels that are each sampled at neighbouring loads --------------------------------------------

#: name and case of a number -> (n, 2): logarithms of neighbouring loads over that of the case, in
#: one row 0, and the number at each
Samples = Mapping[tuple[str, Case], FloatArray]
#: orders of what scatter leaves: 1 of numbers that count nodes, whose edge is known to one spacing;
#: 2 of integrals, the formal order of linear elements
ORDERS = (1.0, 2.0)
#: power of the load that the radius of a smooth curved contact goes with (Hertz)
RADIUS = 1.0 / 3.0
#: coefficients of a fit: the number, its slope and curvature over the load, the error
_COEFFICIENTS = 4


def sampled_error(sizes: Sequence[float], samples: Sequence[FloatArray]) -> ErrorEstimate:
    r"""Bound the error of the finest of several levels by what each shows at neighbouring loads.

    Nothing but x = h / a(F), the spacing over the radius of the contact, distinguishes a curved
    contact on a lattice from its limit, if the bodies are large against it. So a number is

    q(F, h) = Q(F) (1 + C x^p + s(x)),

    with a smooth Q, a part of order p and a part s that changes its sign as the edge passes from
    node to node. Levels at one load draw s once each and cannot tell it from C x^p. Neighbouring
    loads move the edge through the lattice on one level, at the price of a contact set. Over all
    loads and levels

    log q = log Q(F0) + b t + c t^2 + C x^p,   t = log(F / F0),   x = h / a(F0) exp(-t / 3)

    is fitted by least squares with deviations that go with x^(3/2), as the pressure falls to zero
    as the root of the distance from the edge. What a sum over the lattice leaves on average is of
    order 2, of a count of nodes of order 1; nothing shows which a number is, so both are fitted and
    weighted by their likelihood, squares^(-n/2) with the same number of coefficients. n counts
    levels, not loads: s changes little from a load to its neighbour, so that a level is one
    observation of it; counted by loads, the weights go to the wrong order. The bound is exceeded by
    the distance of the finest level's plain value from log Q(F0), under the two Student's t of this
    limit with their weights, with a probability of 5 %.

    Numbers that change their sign are fitted themselves instead of their logarithms.

    Parameters
    ----------
    sizes
        Of the levels over that of the finest, which is the first.
    samples
        Of each level, (n, 2): t and the number; of the finest one row has t = 0.

    Returns
    -------
    ErrorEstimate
        NaN where the samples are too few, or where the number is zero.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics (1985), sections 3.4 and 4.2: similarity, a ~ F^(1/3).
    .. [2] J. A. Hoeting, D. Madigan, A. E. Raftery, C. T. Volinsky, Bayesian model averaging: a
       tutorial, Statistical Science 14 (1999) 382: weights of models, averaged intervals.
    .. [3] N. R. Draper, H. Smith, Applied Regression Analysis, 3rd ed. (1998), 1.4: the interval of
       a coefficient.
    """
    t = np.concatenate([one[:, 0] for one in samples])
    q = np.concatenate([one[:, 1] for one in samples])
    x = np.concatenate(
        [h * np.exp(-RADIUS * one[:, 0]) for h, one in zip(sizes, samples, strict=True)]
    )
    fine = float(samples[0][samples[0][:, 0] == 0.0, 1][0])
    freedom = len(q) - _COEFFICIENTS
    if freedom < 1 or fine == 0.0:
        why = "the number is zero" if fine == 0.0 else f"{len(q)} samples: no estimate"
        return ErrorEstimate(float("nan"), float("nan"), why)
    logarithmic = bool(np.all(q / fine > 0.0))
    y = np.log(q / fine) if logarithmic else q / fine - 1.0
    fits = [_limit([np.ones_like(t), t, t**2, x**p], y, x**-SCATTER) for p in ORDERS]
    away, variance, squares = (np.array(column) for column in zip(*fits, strict=True))
    spread = np.sqrt(variance) * np.sqrt(squares / freedom)
    least = float(squares.min())
    weight = (squares / least) ** (-0.5 * len(sizes)) if least else (squares == 0.0).astype(float)
    weight /= weight.sum()
    bound = _exceeded(away, spread, weight, freedom)
    k = int(weight.argmax())
    share = ", ".join(f"{100 * w:.0f} % order {p:g}" for p, w in zip(ORDERS, weight, strict=True))
    clear = abs(away[k]) > stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE) * spread[k]
    return ErrorEstimate(
        float(np.expm1(bound)) if logarithmic else bound,
        ORDERS[k] if clear else float("nan"),
        f"least squares of {len(q)} neighbouring loads on {len(sizes)} levels ({share}), "
        f"{100 * CONFIDENCE:.0f} % interval",
        ORDERS[k] if clear else SCATTER,
    )


def _exceeded(away: FloatArray, spread: FloatArray, weight: FloatArray, freedom: int) -> float:
    """What the distances ``away`` +- Student's t times ``spread`` exceed with a probability of 5 %
    under their weights.
    """
    likely = weight > 0.0
    away, spread, weight = np.abs(away[likely]), spread[likely], weight[likely]
    highest = float(np.max(away + stdtrit(freedom, 0.5 + 0.5 * CONFIDENCE) * spread))
    if not np.all(spread > 0.0):
        return highest

    def excess(bound: float) -> float:
        beyond = stdtr(freedom, -(bound - away) / spread)
        beyond = beyond + stdtr(freedom, -(bound + away) / spread)
        return float(weight @ beyond) - (1.0 - CONFIDENCE)

    return float(brentq(excess, 0.0, highest)) if excess(highest) < 0.0 else highest
