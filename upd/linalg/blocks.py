"""Compiled loops over matrices of small dense blocks, in single precision, and the product with a
symmetric matrix of which the upper triangle is stored.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.linalg.compiled import compiled

Single = NDArray[np.float32]
Index = NDArray[Any]


@compiled
def symmetric_product(
    indptr: Index, indices: Index, data: NDArray[np.float64], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Product of a symmetric matrix and a vector.

    Parameters
    ----------
    indptr, indices, data : (n + 1,), (nnz,), (nnz,) ndarray
        Upper triangle in compressed rows that start with their diagonal.
    x : (n,) ndarray

    Returns
    -------
    (n,) ndarray
    """
    n = len(indptr) - 1
    y = np.zeros(n)
    for i in range(n):
        first = indptr[i]
        xi = x[i]
        total = data[first] * xi
        for k in range(first + 1, indptr[i + 1]):
            j = indices[k]
            total += data[k] * x[j]
            y[j] += data[k] * xi
        y[i] += total
    return y


@compiled
def sweep_3(
    indptr: Index, indices: Index, data: Single, inverse: Single, b: Single, x: Single, step: int
) -> None:
    """One sweep of block Gauss-Seidel with blocks of 3, forwards (step 1) or backwards (-1)."""
    n = len(indptr) - 1
    for count in range(n):
        i = count if step > 0 else n - 1 - count
        r0, r1, r2 = b[3 * i], b[3 * i + 1], b[3 * i + 2]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j != i:
                x0, x1, x2 = x[3 * j], x[3 * j + 1], x[3 * j + 2]
                r0 -= data[k, 0, 0] * x0 + data[k, 0, 1] * x1 + data[k, 0, 2] * x2
                r1 -= data[k, 1, 0] * x0 + data[k, 1, 1] * x1 + data[k, 1, 2] * x2
                r2 -= data[k, 2, 0] * x0 + data[k, 2, 1] * x1 + data[k, 2, 2] * x2
        x[3 * i] = inverse[i, 0, 0] * r0 + inverse[i, 0, 1] * r1 + inverse[i, 0, 2] * r2
        x[3 * i + 1] = inverse[i, 1, 0] * r0 + inverse[i, 1, 1] * r1 + inverse[i, 1, 2] * r2
        x[3 * i + 2] = inverse[i, 2, 0] * r0 + inverse[i, 2, 1] * r1 + inverse[i, 2, 2] * r2


@compiled
def first_sweep_3(
    indptr: Index, indices: Index, data: Single, inverse: Single, b: Single, x: Single
) -> None:
    """A forward sweep from zero: what lies above the diagonal does not count yet."""
    n = len(indptr) - 1
    for i in range(n):
        r0, r1, r2 = b[3 * i], b[3 * i + 1], b[3 * i + 2]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j < i:
                x0, x1, x2 = x[3 * j], x[3 * j + 1], x[3 * j + 2]
                r0 -= data[k, 0, 0] * x0 + data[k, 0, 1] * x1 + data[k, 0, 2] * x2
                r1 -= data[k, 1, 0] * x0 + data[k, 1, 1] * x1 + data[k, 1, 2] * x2
                r2 -= data[k, 2, 0] * x0 + data[k, 2, 1] * x1 + data[k, 2, 2] * x2
        x[3 * i] = inverse[i, 0, 0] * r0 + inverse[i, 0, 1] * r1 + inverse[i, 0, 2] * r2
        x[3 * i + 1] = inverse[i, 1, 0] * r0 + inverse[i, 1, 1] * r1 + inverse[i, 1, 2] * r2
        x[3 * i + 2] = inverse[i, 2, 0] * r0 + inverse[i, 2, 1] * r1 + inverse[i, 2, 2] * r2


@compiled
def sweep(
    indptr: Index, indices: Index, data: Single, inverse: Single, b: Single, x: Single, step: int
) -> None:
    """One sweep of block Gauss-Seidel with blocks of any size."""
    n, m = len(indptr) - 1, inverse.shape[1]
    r = np.empty(m, np.float32)
    for count in range(n):
        i = count if step > 0 else n - 1 - count
        for a in range(m):
            r[a] = b[m * i + a]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j != i:
                for a in range(m):
                    for c in range(m):
                        r[a] -= data[k, a, c] * x[m * j + c]
        for a in range(m):
            total = np.float32(0.0)
            for c in range(m):
                total += inverse[i, a, c] * r[c]
            x[m * i + a] = total
