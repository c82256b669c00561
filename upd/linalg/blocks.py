"""Compiled loops that gather a matrix in small dense blocks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.linalg.compiled import compiled

Single = NDArray[np.float32]
Index = NDArray[Any]


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
