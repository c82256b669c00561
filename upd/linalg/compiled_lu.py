"""LU of small dense matrices for compiled loops: LAPACK's, which other threads go on beside.

References
----------
E. Anderson et al., LAPACK Users' Guide (1999): dgetrf, dgetri.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.np.linalg import _LAPACK, F_INT_nptype

from upd.linalg.compiled import compiled

#: type of the numbers of exchanged rows
PIVOT = F_INT_nptype
#: the compiler's own way to LAPACK, by which it makes np.linalg.inv: kept on disk as that is
_LIBRARY: Any = _LAPACK
_FACTOR = _LIBRARY.numba_xxgetrf(types.float64)
_INVERT = _LIBRARY.numba_ez_xxgetri(types.float64)
_KIND = ord("d")


@compiled
def factor_columns(A, pivots):  # type: ignore[no-untyped-def]
    """LU with exchanges of rows.

    Parameters
    ----------
    A : (k * k,) ndarray
        Column by column; overwritten.
    pivots : (k,) ndarray of PIVOT
        Overwritten: the row that each was exchanged with, from 1.

    Returns
    -------
    bool
        False where the matrix is singular, or no number.
    """
    k = len(pivots)
    done = _FACTOR(_KIND, k, k, A.ctypes, k, pivots.ctypes)
    fine = done == 0
    for i in range(k):
        fine = fine and np.isfinite(A[i * k + i])
    return fine


@compiled
def invert_columns(A, pivots):  # type: ignore[no-untyped-def]
    """Factors of `factor_columns` overwritten by the inverse, column by column.

    Returns
    -------
    bool
        False where the matrix is singular.
    """
    k = len(pivots)
    done = _INVERT(_KIND, k, A.ctypes, k, pivots.ctypes)
    return done == 0


@compiled
def solve_columns(A, pivots, b):  # type: ignore[no-untyped-def]
    """Solve for a few right-hand sides.

    Parameters
    ----------
    A, pivots
        As `factor_columns` leaves them.
    b : (k, C) ndarray
        Overwritten by the answer.
    """
    k, x = len(pivots), np.empty(len(pivots))
    for c in range(b.shape[1]):
        x[:] = b[:, c]
        for i in range(k):
            other = pivots[i] - 1
            x[i], x[other] = x[other], x[i]
        for j in range(k):
            weight, column = x[j], A[j * k : (j + 1) * k]
            for i in range(j + 1, k):
                x[i] -= weight * column[i]
        for j in range(k - 1, -1, -1):
            column = A[j * k : (j + 1) * k]
            x[j] /= column[j]
            weight = x[j]
            for i in range(j):
                x[i] -= weight * column[i]
        b[:, c] = x
