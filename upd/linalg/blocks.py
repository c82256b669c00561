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
Three = tuple[np.float32, np.float32, np.float32]


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
def _applied_3(data: Single, k: int, x0: np.float32, x1: np.float32, x2: np.float32) -> Three:
    """Block k times three numbers."""
    return (
        data[k, 0, 0] * x0 + data[k, 0, 1] * x1 + data[k, 0, 2] * x2,
        data[k, 1, 0] * x0 + data[k, 1, 1] * x1 + data[k, 1, 2] * x2,
        data[k, 2, 0] * x0 + data[k, 2, 1] * x1 + data[k, 2, 2] * x2,
    )


@compiled
def _times_3(data: Single, k: int, x: Single, j: int) -> Three:
    """Block k times the entries of block row j of x."""
    found: Three = _applied_3(data, k, x[3 * j], x[3 * j + 1], x[3 * j + 2])
    return found


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
                d0, d1, d2 = _times_3(data, k, x, j)
                r0, r1, r2 = r0 - d0, r1 - d1, r2 - d2
        x[3 * i], x[3 * i + 1], x[3 * i + 2] = _applied_3(inverse, i, r0, r1, r2)


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
                d0, d1, d2 = _times_3(data, k, x, j)
                r0, r1, r2 = r0 - d0, r1 - d1, r2 - d2
        x[3 * i], x[3 * i + 1], x[3 * i + 2] = _applied_3(inverse, i, r0, r1, r2)


@compiled
def residual_3(indptr: Index, indices: Index, data: Single, x: Single) -> Single:
    """b - A x after `first_sweep_3`: -U x, as (D + L) x = b."""
    n = len(indptr) - 1
    r = np.zeros(3 * n, np.float32)
    for i in range(n):
        r0, r1, r2 = np.float32(0.0), np.float32(0.0), np.float32(0.0)
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j > i:
                d0, d1, d2 = _times_3(data, k, x, j)
                r0, r1, r2 = r0 - d0, r1 - d1, r2 - d2
        r[3 * i], r[3 * i + 1], r[3 * i + 2] = r0, r1, r2
    return r


@compiled
def count_blocks(indptr: Index, indices: Index, place: Index, first: Index, n: int) -> Index:
    """Row pointers of a whole symmetric matrix in blocks of 3, from its upper triangle.

    Parameters
    ----------
    indptr, indices : ndarray
        Upper triangle in compressed rows.
    place : ndarray of int
        Where each dof goes among the blocks' rows, rising.
    first : (n + 1,) ndarray of int
        First dof of each block row.
    n : int
        Block rows.

    Returns
    -------
    (n + 1,) ndarray of int
    """
    counts = np.zeros(n + 1, np.int64)
    seen = np.full(n, -1, np.int64)
    for node in range(n):
        seen[node] = node
        counts[node + 1] += 1
        for row in range(first[node], first[node + 1]):
            for k in range(indptr[row], indptr[row + 1]):
                other = place[indices[k]] // 3
                if seen[other] != node:
                    seen[other] = node
                    counts[node + 1] += 1
                    counts[other + 1] += 1
    return np.cumsum(counts)


@compiled
def fill_blocks(
    indptr: Index,
    indices: Index,
    data: NDArray[np.float64],
    place: Index,
    first: Index,
    pointers: Index,
    columns: Index,
    blocks: NDArray[np.float64],
) -> None:
    """Block columns and blocks of the whole matrix that `count_blocks` counted.

    Parameters
    ----------
    indptr, indices, data, place, first
        As for `count_blocks`, with the values.
    pointers : (n + 1,) ndarray of int
        Its row pointers.
    columns, blocks : (m,), (m, 3, 3) ndarray
        Filled; `blocks` come as zeros.
    """
    n = len(pointers) - 1
    cursor = pointers[:-1].copy()
    seen = np.full(n, -1, np.int64)
    upper, lower = np.empty(n, np.int64), np.empty(n, np.int64)
    for node in range(n):
        seen[node] = node
        upper[node] = lower[node] = cursor[node]
        columns[cursor[node]] = node
        cursor[node] += 1
        for row in range(first[node], first[node + 1]):
            a = place[row] % 3
            for k in range(indptr[row], indptr[row + 1]):
                column = place[indices[k]]
                other, b = column // 3, column % 3
                if seen[other] != node:
                    seen[other] = node
                    upper[other], lower[other] = cursor[node], cursor[other]
                    columns[cursor[node]], columns[cursor[other]] = other, node
                    cursor[node] += 1
                    cursor[other] += 1
                blocks[upper[other], a, b] = data[k]
                blocks[lower[other], b, a] = data[k]


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


#: right-hand sides that are worked on at once, as many single-precision numbers as a register has
WIDTH = 8


@compiled
def symmetric_product_many(
    indptr: Index, indices: Index, data: NDArray[np.float64], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """As `symmetric_product` with `WIDTH` vectors.

    Parameters
    ----------
    indptr, indices, data : (n + 1,), (nnz,), (nnz,) ndarray
        As there.
    x : (n, WIDTH) ndarray

    Returns
    -------
    (n, WIDTH) ndarray
    """
    n = len(indptr) - 1
    y = np.zeros((n, WIDTH))
    total = np.empty(WIDTH)
    for i in range(n):
        first = indptr[i]
        for c in range(WIDTH):
            total[c] = data[first] * x[i, c]
        for k in range(first + 1, indptr[i + 1]):
            j = indices[k]
            for c in range(WIDTH):
                total[c] += data[k] * x[j, c]
                y[j, c] += data[k] * x[i, c]
        for c in range(WIDTH):
            y[i, c] += total[c]
    return y


@compiled
def sweep_3_many(
    indptr: Index, indices: Index, data: Single, inverse: Single, b: Single, x: Single, step: int
) -> None:
    """As `sweep_3` with `WIDTH` vectors, (n, WIDTH); written out, so that registers serve."""
    n = len(indptr) - 1
    r0, r1, r2 = (
        np.empty(WIDTH, np.float32),
        np.empty(WIDTH, np.float32),
        np.empty(WIDTH, np.float32),
    )
    for count in range(n):
        i = count if step > 0 else n - 1 - count
        for c in range(WIDTH):
            r0[c], r1[c], r2[c] = b[3 * i, c], b[3 * i + 1, c], b[3 * i + 2, c]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j != i:
                d00, d01, d02 = data[k, 0, 0], data[k, 0, 1], data[k, 0, 2]
                d10, d11, d12 = data[k, 1, 0], data[k, 1, 1], data[k, 1, 2]
                d20, d21, d22 = data[k, 2, 0], data[k, 2, 1], data[k, 2, 2]
                for c in range(WIDTH):
                    x0, x1, x2 = x[3 * j, c], x[3 * j + 1, c], x[3 * j + 2, c]
                    r0[c] -= d00 * x0 + d01 * x1 + d02 * x2
                    r1[c] -= d10 * x0 + d11 * x1 + d12 * x2
                    r2[c] -= d20 * x0 + d21 * x1 + d22 * x2
        for c in range(WIDTH):
            for a in range(3):
                x[3 * i + a, c] = (
                    inverse[i, a, 0] * r0[c] + inverse[i, a, 1] * r1[c] + inverse[i, a, 2] * r2[c]
                )


@compiled
def residual_3_many(indptr: Index, indices: Index, data: Single, b: Single, x: Single) -> Single:
    """b - A x with blocks of 3 and `WIDTH` vectors, (n, WIDTH)."""
    n = len(indptr) - 1
    r = np.empty((3 * n, WIDTH), np.float32)
    r0, r1, r2 = (
        np.empty(WIDTH, np.float32),
        np.empty(WIDTH, np.float32),
        np.empty(WIDTH, np.float32),
    )
    for i in range(n):
        for c in range(WIDTH):
            r0[c], r1[c], r2[c] = b[3 * i, c], b[3 * i + 1, c], b[3 * i + 2, c]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            d00, d01, d02 = data[k, 0, 0], data[k, 0, 1], data[k, 0, 2]
            d10, d11, d12 = data[k, 1, 0], data[k, 1, 1], data[k, 1, 2]
            d20, d21, d22 = data[k, 2, 0], data[k, 2, 1], data[k, 2, 2]
            for c in range(WIDTH):
                x0, x1, x2 = x[3 * j, c], x[3 * j + 1, c], x[3 * j + 2, c]
                r0[c] -= d00 * x0 + d01 * x1 + d02 * x2
                r1[c] -= d10 * x0 + d11 * x1 + d12 * x2
                r2[c] -= d20 * x0 + d21 * x1 + d22 * x2
        for c in range(WIDTH):
            r[3 * i, c], r[3 * i + 1, c], r[3 * i + 2, c] = r0[c], r1[c], r2[c]
    return r


@compiled
def sweep_many(
    indptr: Index, indices: Index, data: Single, inverse: Single, b: Single, x: Single, step: int
) -> None:
    """As `sweep` with `WIDTH` vectors, (n, WIDTH)."""
    n, m = len(indptr) - 1, inverse.shape[1]
    r = np.empty((m, WIDTH), np.float32)
    for count in range(n):
        i = count if step > 0 else n - 1 - count
        for a in range(m):
            for c in range(WIDTH):
                r[a, c] = b[m * i + a, c]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j != i:
                for a in range(m):
                    for e in range(m):
                        for c in range(WIDTH):
                            r[a, c] -= data[k, a, e] * x[m * j + e, c]
        for a in range(m):
            for c in range(WIDTH):
                x[m * i + a, c] = 0.0
            for e in range(m):
                for c in range(WIDTH):
                    x[m * i + a, c] += inverse[i, a, e] * r[e, c]
