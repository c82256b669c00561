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

from upd.errors import ConvergenceError

FloatArray = NDArray[np.float64]
_DIGITS = float(np.sqrt(np.finfo(float).eps))


def least_distance(G: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """The shortest v with G v >= h, and its multipliers.

    With E = [G, h]' and r = E u - e_last of the u >= 0 that makes r least, v = -r / r_last.

    Parameters
    ----------
    G : (m, k) ndarray
    h : (m,) ndarray

    Returns
    -------
    v : (k,) ndarray
        None, with its multipliers, when no v does: r vanishes, to half of the digits.
    multipliers : (m,) ndarray
        v = G'u, u >= 0 and above zero only where G v = h.

    Raises
    ------
    ConvergenceError
        When the least squares do not end in the steps they are allowed.

    Examples
    --------
    The point nearest to the origin with x + y >= 2.

    >>> import numpy as np
    >>> from upd.linalg.least_distance import least_distance
    >>> v, u = least_distance(np.array([[1.0, 1.0]]), np.array([2.0]))
    >>> v.round(12).tolist(), u.round(12).tolist()
    ([1.0, 1.0], [1.0])
    """
    size = float(np.abs(h).max(initial=0.0))
    if not (h > 0.0).any():
        return np.zeros(G.shape[1]), np.zeros(len(h))
    E = np.vstack((G.T, h / size))
    e = np.eye(len(E))[-1]
    try:
        u = nnls(E, e, maxiter=30 * (len(h) + 10))[0]
    except RuntimeError as problem:
        raise ConvergenceError(f"the least distance problem found no answer ({problem})") from None
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
    x0, Z = np.linalg.lstsq(A, b, rcond=_DIGITS)[0], null_space(A, rcond=_DIGITS)
    found = least_distance(Z, np.asarray(-x0, np.float64))
    # what rounding leaves below zero
    return None if found is None else np.asarray(np.maximum(x0 + Z @ found[0], 0.0))
