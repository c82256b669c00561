"""Compiled sweeps of block Gauss-Seidel with blocks of any size, node by node, in single precision.

With A = L + D + L' by blocks, a forward sweep from zero is (L + D) x = b, so that b - A x = -L' x:
each of both passes over A takes one triangle.
"""

from __future__ import annotations

import numpy as np

from upd.linalg.blocks import WIDTH, Index, Single
from upd.linalg.compiled import compiled


@compiled
def _take(
    indptr: Index, indices: Index, data: Single, x: Single, r: Single, i: int, low: int, high: int
) -> None:
    """Row i of A x off r, of A the columns before ``low`` and from ``high`` on."""
    m = len(r)
    for k in range(indptr[i], indptr[i + 1]):
        j = indices[k]
        if j < low or j >= high:
            for a in range(m):
                for c in range(m):
                    r[a] -= data[k, a, c] * x[m * j + c]


@compiled
def _put(inverse: Single, r: Single, x: Single, i: int) -> None:
    """The inverse of block i times r."""
    m = len(r)
    for a in range(m):
        total = np.float32(0.0)
        for c in range(m):
            total += inverse[i, a, c] * r[c]
        x[m * i + a] = total


@compiled
def first_blocks(indptr: Index, indices: Index, data: Single, inverse: Single, b: Single) -> Single:
    """A forward sweep from zero."""
    n, m = len(indptr) - 1, inverse.shape[1]
    x, r = np.empty(len(b), np.float32), np.empty(m, np.float32)
    for i in range(n):
        r[:] = b[m * i : m * i + m]
        _take(indptr, indices, data, x, r, i, i, n)
        _put(inverse, r, x, i)
    return x


@compiled
def residual_blocks(indptr: Index, indices: Index, data: Single, x: Single) -> Single:
    """b - A x after `first_blocks`."""
    n, m = len(indptr) - 1, data.shape[1]
    r = np.zeros(len(x), np.float32)
    for i in range(n):
        _take(indptr, indices, data, x, r[m * i : m * i + m], i, 0, i + 1)
    return r


@compiled
def last_blocks(
    indptr: Index, indices: Index, data: Single, inverse: Single, b: Single, x: Single
) -> None:
    """A backward sweep of x."""
    n, m = len(indptr) - 1, inverse.shape[1]
    r = np.empty(m, np.float32)
    for i in range(n - 1, -1, -1):
        r[:] = b[m * i : m * i + m]
        _take(indptr, indices, data, x, r, i, i, i + 1)
        _put(inverse, r, x, i)


@compiled
def _take_many(
    indptr: Index, indices: Index, data: Single, x: Single, r: Single, i: int, low: int, high: int
) -> None:
    """As `_take` with `WIDTH` vectors, r of (m, WIDTH)."""
    m = len(r)
    for k in range(indptr[i], indptr[i + 1]):
        j = indices[k]
        if j < low or j >= high:
            for a in range(m):
                for e in range(m):
                    for c in range(WIDTH):
                        r[a, c] -= data[k, a, e] * x[m * j + e, c]


@compiled
def _put_many(inverse: Single, r: Single, x: Single, i: int) -> None:
    """As `_put`."""
    m = len(r)
    for a in range(m):
        for c in range(WIDTH):
            x[m * i + a, c] = 0.0
        for e in range(m):
            for c in range(WIDTH):
                x[m * i + a, c] += inverse[i, a, e] * r[e, c]


@compiled
def first_blocks_many(
    indptr: Index, indices: Index, data: Single, inverse: Single, b: Single
) -> Single:
    """As `first_blocks` with `WIDTH` vectors, (n, WIDTH)."""
    n, m = len(indptr) - 1, inverse.shape[1]
    x, r = np.empty(b.shape, np.float32), np.empty((m, WIDTH), np.float32)
    for i in range(n):
        r[:] = b[m * i : m * i + m]
        _take_many(indptr, indices, data, x, r, i, i, n)
        _put_many(inverse, r, x, i)
    return x


@compiled
def residual_blocks_many(indptr: Index, indices: Index, data: Single, x: Single) -> Single:
    """As `residual_blocks`."""
    n, m = len(indptr) - 1, data.shape[1]
    r = np.zeros(x.shape, np.float32)
    for i in range(n):
        _take_many(indptr, indices, data, x, r[m * i : m * i + m], i, 0, i + 1)
    return r


@compiled
def last_blocks_many(
    indptr: Index, indices: Index, data: Single, inverse: Single, b: Single, x: Single
) -> None:
    """As `last_blocks`."""
    n, m = len(indptr) - 1, inverse.shape[1]
    r = np.empty((m, WIDTH), np.float32)
    for i in range(n - 1, -1, -1):
        r[:] = b[m * i : m * i + m]
        _take_many(indptr, indices, data, x, r, i, i, i + 1)
        _put_many(inverse, r, x, i)
