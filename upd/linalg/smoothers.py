"""Gauss-Seidel of a multigrid level, line by line, in single precision: see `upd.linalg.sweeps`."""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_array

from upd.errors import ConvergenceError
from upd.linalg.blocks import Single
from upd.linalg.common import EPS, FloatArray, IntArray
from upd.linalg.lines import find_cross_lines, find_lines, in_line_order
from upd.linalg.sweeps import Lines, first_cross, first_lines, last_cross, last_lines, width_of


class Smoother:
    """Blocks of 3 line by line, then along the lines across these, see `upd.linalg.lines`; blocks
    of any other size node by node.

    Attributes
    ----------
    order : (n,) ndarray of int or None
        Dofs of A line by line; vectors given and taken are in this order. None: that of A.
    """

    def __init__(self, A: bsr_array) -> None:
        """From the level's operator in double precision."""
        n, size = len(A.indptr) - 1, A.blocksize[0]
        nodes, starts = np.arange(n), np.arange(n + 1)
        self.order: IntArray | None = None
        if size == 3:
            nodes, starts = find_lines(A)
            self.order = (3 * nodes[:, None] + np.arange(3)).ravel()
        self._A = indptr, indices, data = in_line_order(A.indptr, A.indices, A.data, nodes)
        row = np.repeat(np.arange(n), np.diff(indptr))
        own = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
        begin, end = (np.asarray(bounds, np.int64) for bounds in (indptr[:-1], indptr[1:]))
        before, after = (
            begin + np.bincount(row[indices < starts[later][row]], minlength=n)
            for later in (own, own + 1)
        )
        self._rows = (begin, before, after, end, indices, data)
        self._lines: Lines = (np.arange(n), starts, *_factors(A, nodes, starts))
        self._cross: Lines | None = None
        if size == 3:
            across, starts = find_cross_lines(A, nodes, starts)
            place = np.empty(n, np.int64)
            place[nodes] = np.arange(n)
            self._cross = (place[across], starts, *_factors(A, across, starts))
        self._size = (0,) * size

    @property
    def nbytes(self) -> int:
        """Memory."""
        parts = [*self._A, *self._rows[:4], *self._lines, *(self._cross or ()), self.order]
        return int(sum(v.nbytes for v in parts if v is not None))

    def first(self, b: Single) -> tuple[Single, Single]:
        """A forward sweep from zero: x and b - A x, for (n,) or (n, w)."""
        B = b.reshape(len(b), -1)
        shape = (self._size, width_of(B))
        x, r = first_lines(self._rows, self._lines, B, shape)
        if self._cross is not None:
            first_cross(self._rows, self._cross, x, r, shape)
        return x.reshape(b.shape), r.reshape(b.shape)

    def last(self, b: Single, x: Single) -> None:
        """A backward sweep of x."""
        B, X = b.reshape(len(b), -1), x.reshape(len(x), -1)
        shape = (self._size, width_of(B))
        if self._cross is not None:
            last_cross(self._rows, self._cross, B, X, shape)
        last_lines(self._rows, self._lines, B, X, shape)

    def residual(self, b: Single, x: Single) -> Single:
        """b - A x, both in the smoother's order."""
        indptr, indices, data = self._A
        found: Single = b - bsr_array((data, indices, indptr), shape=(len(b), len(b))) @ x
        return found


def _factors(A: bsr_array, nodes: IntArray, starts: IntArray) -> tuple[Single, Single]:
    """Inverses of the pivots S_i and W_i = A_i(i-1) S_(i-1)^-1 (k, b, b) of all lines, node after
    node of each.
    """
    n, k = len(A.indptr) - 1, len(nodes)
    rank = np.arange(k) - np.repeat(starts[:-1], np.diff(starts))
    inverse, down = np.empty((k, *A.blocksize)), np.zeros((k, *A.blocksize))
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
