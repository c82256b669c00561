"""What the targets of a fit leave unknown, to first order.

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
from upd.fitting.residuals import Residuals

Array = NDArray[np.float64]
#: quantile of 95 % intervals
_T = float(norm.ppf(0.975))
#: shares of a first-order half-width by which its ends may be off: without a note; and such that
#: a 95 % interval keeps its probability to half of its last digit, 2 t phi(t) share = 0.005
TOLD, KEPT = 0.1, 0.005 / (2.0 * _T * float(norm.pdf(_T)))


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
