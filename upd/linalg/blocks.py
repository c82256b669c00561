"""Compiled loops that gather a matrix in small dense blocks, and the product with a symmetric
matrix of which the upper triangle is stored.
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
