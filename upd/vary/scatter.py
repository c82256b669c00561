"""Error of a number that scatters with the place of a contact's edge between the nodes, from levels
that are each sampled at neighbouring loads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import stdtr, stdtrit

from upd.results.case import Case
from upd.vary.orders import CONFIDENCE, SCATTER, ErrorEstimate

FloatArray = NDArray[np.float64]
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
    fits = [_fit(t, x, y, p) for p in ORDERS]
    away, spread, squares = (np.array(column) for column in zip(*fits, strict=True))
    spread = spread * np.sqrt(squares / freedom)
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


def _fit(t: FloatArray, x: FloatArray, y: FloatArray, order: float) -> tuple[float, float, float]:
    """The limit at t = 0, its standard error over that of a weighted deviation, their squares."""
    weight = x**-SCATTER
    A = np.column_stack([np.ones_like(t), t, t**2, x**order]) * weight[:, None]
    solution, *_ = np.linalg.lstsq(A, weight * y, rcond=None)
    off = weight * y - A @ solution
    spread = np.sqrt(np.linalg.pinv(A.T @ A)[0, 0])
    return float(solution[0]), float(spread), float(off @ off)


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
