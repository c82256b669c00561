"""Least distances under inequalities, in a finite number of steps, by non-negative least squares.

References
----------
C. L. Lawson, R. J. Hanson, Solving Least Squares Problems (1974), 23.4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import nnls

FloatArray = NDArray[np.float64]
_DIGITS = float(np.sqrt(np.finfo(float).eps))


def least_distance(G: FloatArray, h: FloatArray) -> FloatArray | None:
    """The shortest v with G v >= h.

    With E = [G, h]' and r = E u - e_last of the u >= 0 that makes r least, v = -r / r_last.

    Parameters
    ----------
    G : (m, k) ndarray
    h : (m,) ndarray

    Returns
    -------
    (k,) ndarray or None
        None when no v does: r vanishes, to half of the digits.

    Raises
    ------
    RuntimeError
        When the least squares do not end in the steps scipy allows.

    Examples
    --------
    The point nearest to the origin with x + y >= 2.

    >>> import numpy as np
    >>> from upd.linalg.least_distance import least_distance
    >>> least_distance(np.array([[1.0, 1.0]]), np.array([2.0])).round(12).tolist()
    [1.0, 1.0]
    """
    found = least_distance_with_multipliers(G, h)
    return None if found is None else found[0]


def least_distance_with_multipliers(
    G: FloatArray, h: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """The shortest v with G v >= h as in `least_distance`, and its multipliers.

    Parameters
    ----------
    G : (m, k) ndarray
    h : (m,) ndarray

    Returns
    -------
    tuple of (k,) ndarray and (m,) ndarray, or None
        v = G'u, u >= 0 and above zero only where G v = h.

    Raises
    ------
    RuntimeError
        As in `least_distance`.
    """
    size = float(np.abs(h).max(initial=0.0))
    if not (h > 0.0).any():
        return np.zeros(G.shape[1]), np.zeros(len(h))
    E = np.vstack((G.T, h / size))
    e = np.zeros(len(E))
    e[-1] = 1.0
    u = nnls(E, e, maxiter=30 * (len(h) + 10))[0]
    r = E @ u - e
    if np.linalg.norm(r) <= _DIGITS:
        return None
    return -size * r[:-1] / r[-1], -size * u / r[-1]


def least_positive(A: FloatArray, b: FloatArray) -> FloatArray | None:
    """The x >= 0 with A x = b and the least sum of squares; None when there is none.

    x = x0 + Z z with the least x0 of all signs and A Z = 0: the least z with Z z >= -x0.

    Parameters
    ----------
    A : (r, n) ndarray
        Rows of like size.
    b : (r,) ndarray

    Returns
    -------
    (n,) ndarray or None
    """
    x0 = np.asarray(np.linalg.lstsq(A, b, rcond=_DIGITS)[0], np.float64)
    Z = null_space(A, rcond=_DIGITS)
    z = least_distance(Z, -x0)
    # what rounding leaves below zero
    return None if z is None else np.asarray(np.maximum(x0 + Z @ z, 0.0))
