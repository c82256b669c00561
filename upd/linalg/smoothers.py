"""Block Gauss-Seidel sweeps of a multigrid level, in single precision, compiled for blocks of any
size, node by node.

With A = L + D + L' by blocks, a forward sweep from zero is (L + D) x = b, so that b - A x = -L' x:
each of both passes over A takes one triangle.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_array

from upd.errors import ConvergenceError
from upd.linalg.blocks import WIDTH, Index, Single
from upd.linalg.common import EPS, FloatArray, IntArray
from upd.linalg.compiled import compiled
from upd.linalg.lines import (
    find_cross_lines,
    find_lines,
    first_cross,
    first_lines,
    in_line_order,
    last_cross,
    last_lines,
    residual_lines,
)
from upd.linalg.lines_many import (
    first_cross_many,
    first_lines_many,
    last_cross_many,
    last_lines_many,
    residual_lines_many,
)


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


class BlockSmoother:
    """Node by node, with blocks of any size.

    Attributes
    ----------
    order : None
        Its vectors are in the order of A.
    """

    order: IntArray | None = None

    def __init__(self, A: bsr_array) -> None:
        """From the level's operator in double precision."""
        single = A.data.astype(np.float32), A.indices, A.indptr
        self._A = bsr_array(single, shape=A.shape, blocksize=A.blocksize)
        diagonal = _blocks_at(A, np.arange(len(A.indptr) - 1))
        self._inverse = _inverses(diagonal).astype(np.float32)

    @property
    def nbytes(self) -> int:
        """Memory."""
        A = self._A
        return int(sum(v.nbytes for v in (A.data, A.indices, A.indptr, self._inverse)))

    def first(self, b: Single) -> tuple[Single, Single]:
        """A forward sweep from zero: x and b - A x, for (n,) or (n, WIDTH)."""
        forward, rest = (
            (first_blocks, residual_blocks)
            if b.ndim == 1
            else (first_blocks_many, residual_blocks_many)
        )
        A = self._A
        x = forward(A.indptr, A.indices, A.data, self._inverse, b)
        return x, rest(A.indptr, A.indices, A.data, x)

    def last(self, b: Single, x: Single) -> None:
        """A backward sweep of x."""
        A, back = self._A, last_blocks if b.ndim == 1 else last_blocks_many
        back(A.indptr, A.indices, A.data, self._inverse, b, x)

    def residual(self, b: Single, x: Single) -> Single:
        """b - A x."""
        found: Single = b - self._A @ x
        return found


class LineSmoother:
    """Line by line with blocks of 3, then along the lines across these, see `upd.linalg.lines`.

    Attributes
    ----------
    order : (n,) ndarray of int
        Dofs of A line by line; vectors given and taken are in this order.
    """

    order: IntArray | None

    def __init__(self, A: bsr_array) -> None:
        """From the level's operator in double precision."""
        nodes, self._starts = find_lines(A)
        self.order = (3 * nodes[:, None] + np.arange(3)).ravel()
        self._A = in_line_order(A.indptr, A.indices, A.data, nodes)
        self._inverse, self._down = _factors(A, nodes, self._starts)
        across, starts = find_cross_lines(A, nodes, self._starts)
        place = np.empty(len(nodes), np.int64)
        place[nodes] = np.arange(len(nodes))
        self._cross = (*_factors(A, across, starts), place[across], starts)

    @property
    def nbytes(self) -> int:
        """Memory."""
        own = (self._inverse, self._down, self._starts, self.order)
        return int(sum(v.nbytes for v in (*self._A, *own, *self._cross) if v is not None))

    def first(self, b: Single) -> tuple[Single, Single]:
        """A forward sweep from zero: x and b - A x, for (n,) or (n, WIDTH)."""
        forward, rest, across = (
            (first_lines, residual_lines, first_cross)
            if b.ndim == 1
            else (first_lines_many, residual_lines_many, first_cross_many)
        )
        x = forward(*self._A, self._inverse, self._down, self._starts, b)
        r = rest(*self._A, self._starts, x)
        across(*self._A, *self._cross, x, r)
        return x, r

    def last(self, b: Single, x: Single) -> None:
        """A backward sweep of x."""
        back, across = (
            (last_lines, last_cross) if b.ndim == 1 else (last_lines_many, last_cross_many)
        )
        across(*self._A, *self._cross, b, x)
        back(*self._A, self._inverse, self._down, self._starts, b, x)

    def residual(self, b: Single, x: Single) -> Single:
        """b - A x, both in the smoother's order."""
        indptr, indices, data = self._A
        found: Single = b - bsr_array((data, indices, indptr), shape=(len(b), len(b))) @ x
        return found


def _factors(A: bsr_array, nodes: IntArray, starts: IntArray) -> tuple[Single, Single]:
    """Inverses of the pivots S_i and W_i = A_i(i-1) S_(i-1)^-1 (k, 3, 3) of all lines, node after
    node of each.
    """
    n, k = len(A.indptr) - 1, len(nodes)
    rank = np.arange(k) - np.repeat(starts[:-1], np.diff(starts))
    inverse, down = np.empty((k, 3, 3)), np.zeros((k, 3, 3))
    diagonal = _blocks_at(A, np.arange(n))[nodes]
    before = np.full(n, -1)
    later = np.flatnonzero(rank)
    before[nodes[later]] = nodes[later - 1]
    beside = _blocks_at(A, before)[nodes]
    by_rank = np.argsort(rank, kind="stable")
    for some in np.split(by_rank, np.cumsum(np.bincount(rank))[:-1]):
        pivots = diagonal[some]
        if len(some) and rank[some[0]]:
            down[some] = beside[some] @ inverse[some - 1]
            pivots = pivots - down[some] @ beside[some].transpose(0, 2, 1)
        inverse[some] = _inverses(pivots)
    return inverse.astype(np.float32), down.astype(np.float32)


def _blocks_at(A: bsr_array, columns: IntArray) -> FloatArray:
    """The block of each row in one column (n, b, b); zero where that is -1."""
    rows = len(A.indptr) - 1
    row = np.repeat(np.arange(rows), np.diff(A.indptr))
    found = np.zeros((rows, *A.blocksize))
    on = A.indices == columns[row]
    found[row[on]] = A.data[on]
    return found


def _inverses(blocks: FloatArray) -> FloatArray:
    """Inverses of diagonal blocks (n, b, b).

    A block that is singular belongs to modes that its aggregate does not tell apart: those
    directions, zero to rounding, are left alone.
    """
    values, vectors = np.linalg.eigh(0.5 * (blocks + blocks.transpose(0, 2, 1)))
    largest = values[:, -1:]
    if not (largest > 0.0).all():
        raise ConvergenceError(
            "Multigrid: a diagonal block of a level is not positive: the body "
            "floats, hold the distant set."
        )
    regular = values > blocks.shape[1] * EPS * largest * 1e3
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=regular)
    found: FloatArray = (vectors * inverse[:, None, :]) @ vectors.transpose(0, 2, 1)
    return found


def block_rows(M: bsr_array, order: IntArray) -> bsr_array:
    """Block rows of a matrix in another order.

    Parameters
    ----------
    M : bsr_array
    order : (n,) ndarray of int

    Returns
    -------
    bsr_array
    """
    counts = np.diff(M.indptr)[order]
    pointers = np.concatenate([[0], np.cumsum(counts)]).astype(M.indptr.dtype)
    taken = np.arange(pointers[-1]) + np.repeat(M.indptr[order] - pointers[:-1], counts)
    return bsr_array(
        (M.data[taken], M.indices[taken], pointers), shape=M.shape, blocksize=M.blocksize
    )
