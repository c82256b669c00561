"""Gauss-Seidel of a multigrid level, line by line, in single precision: see `upd.linalg.sweeps`.

Across a stretched element of sides L and h << L the stiffness of a displacement is about G / h^2
times a mean along L, with the symbol (1 + cos theta) / 2 for elements with incompatible modes and
(2 + cos theta) / 3 without them. So a displacement that changes its sign from node to node along
the long edges has, however it changes across them, the share (h / L)^2 of the diagonal only: point
by point Gauss-Seidel hardly sees it, and as it changes across the near nodes too, no aggregate of
them has it. Along the long edges such blocks are positive, half the diagonal; the near ones are
negative. Nodes that couple so are put on one line and solved for at once, which leaves nothing of
that displacement, as the lines beside see none of it.

An element that is short one way only is long two ways, and a node is on one line. What changes its
sign along the other long edges stays beside these lines. So nodes that still couple so, across the
lines, are put on cross lines and solved for once more.

References
----------
.. [1] D. J. Mavriplis, J. Comput. Phys. 145 (1998) 141 (lines found in the couplings).
.. [2] U. Trottenberg, C. Oosterlee, A. Schueller, Multigrid (2001), section 5.1.3 (smoothing by
   lines).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import bsr_array, csr_array

from upd.errors import ConvergenceError
from upd.linalg.common import EPS, FloatArray, IntArray
from upd.linalg.compiled import compiled
from upd.linalg.nodes import STRONG
from upd.linalg.sweeps import (
    Index,
    Lines,
    Single,
    first_cross,
    first_lines,
    last_cross,
    last_lines,
)


class Smoother:
    """Blocks of 3 line by line, then along the lines across these; blocks of any other size node by
    node.

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
        self._A = in_order(A, nodes, nodes)
        indptr, indices, data = self._A.indptr, self._A.indices, self._A.data
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

    def first(self, b: Single) -> tuple[Single, Single]:
        """A forward sweep from zero: x and b - A x."""
        x, r = first_lines(self._rows, self._lines, b)
        if self._cross is not None:
            first_cross(self._rows, self._cross, x, r)
        return x, r

    def last(self, b: Single, x: Single) -> None:
        """A backward sweep of x."""
        if self._cross is not None:
            last_cross(self._rows, self._cross, b, x)
        last_lines(self._rows, self._lines, b, x)

    def residual(self, b: Single, x: Single) -> Single:
        """b - A x, both in the smoother's order."""
        found: Single = b - self._A @ x
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


def in_order(A: bsr_array, rows: IntArray, columns: IntArray | None = None) -> bsr_array:
    """Rows, and columns, of a matrix of blocks in another order, in single precision.

    Parameters
    ----------
    A : bsr_array
    rows, columns : (n,) ndarray of int
        Columns of a row then rise; None: they stay.

    Returns
    -------
    bsr_array
    """
    # blocks by their numbers, from 1: a zero would be no entry
    shape = tuple(np.array(A.shape) // A.blocksize)
    at = csr_array((np.arange(1, len(A.indices) + 1), A.indices, A.indptr), shape=shape)[rows]
    if columns is not None:
        at = csr_array(at[:, columns])
        at.sort_indices()
    blocks = A.data.astype(np.float32)[at.data - 1]
    return bsr_array((blocks, at.indices, at.indptr), shape=A.shape)


def find_lines(A: bsr_array) -> tuple[IntArray, IntArray]:
    """Lines of nodes that are coupled strongly by positive blocks.

    The strongest first, two neighbours at most, and none that is coupled with another node of its
    line than the ones beside it: the block of a line is tridiagonal.

    Parameters
    ----------
    A : (3 n, 3 n) bsr_array
        Blocks of nodes, symmetric, with its diagonal.

    Returns
    -------
    order : (n,) ndarray of int
        The nodes line by line.
    starts : (m + 1,) ndarray of int
        Where each line begins there; most nodes of a mesh that is not stretched are lines of one.
    """
    order, starts = _on_lines(*_links(A), A.indptr, A.indices)
    return order, starts


def find_cross_lines(A: bsr_array, order: IntArray, starts: IntArray) -> tuple[IntArray, IntArray]:
    """Lines as of `find_lines` across the first ones, of the couplings between these.

    Parameters
    ----------
    A : (3 n, 3 n) bsr_array
        As for `find_lines`.
    order, starts : (n,), (m + 1,) ndarray of int
        The first lines.

    Returns
    -------
    nodes : (k,) ndarray of int
        The nodes of lines of two and more, line by line.
    starts : (l + 1,) ndarray of int
        Where each line begins there.
    """
    line = np.empty(len(order), np.int64)
    line[order] = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    rows, columns = _links(A)
    across = line[rows] != line[columns]
    order, starts = _on_lines(rows[across], columns[across], A.indptr, A.indices)
    lengths = np.diff(starts)
    long = lengths > 1
    return order[np.repeat(long, lengths)], np.concatenate([[0], np.cumsum(lengths[long])])


def _links(A: bsr_array) -> tuple[Index, Index]:
    """Nodes that are coupled strongly by positive blocks, each pair once, the strongest first."""
    n = len(A.indptr) - 1
    rows = np.repeat(np.arange(n), np.diff(A.indptr))
    traces = np.einsum("kii->k", A.data)
    diagonal = np.zeros(n)
    on = rows == A.indices
    diagonal[rows[on]] = traces[on]
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = traces / np.sqrt(diagonal[rows] * diagonal[A.indices])
    links = np.flatnonzero((rows < A.indices) & (shares > STRONG))
    links = links[np.argsort(-shares[links], kind="stable")]
    return rows[links], A.indices[links]


@compiled
def _coupled(indptr: Index, indices: Index, i: int, j: int) -> bool:
    found = False
    for k in range(indptr[i], indptr[i + 1]):
        found = found or indices[k] == j
    return found


@compiled
def _root(parents: Index, i: int) -> int:
    """Of the tree of i, whose paths are halved on the way."""
    while parents[i] != i:
        parents[i] = parents[parents[i]]
        i = parents[i]
    return i


@compiled
def _linked(first: Index, second: Index, indptr: Index, indices: Index) -> Index:
    """The nodes beside each on its line (n, 2), -1 for none, from links in their order."""
    n = len(indptr) - 1
    beside, parents = np.full((n, 2), -1, np.int64), np.arange(n)
    for link in range(len(first)):
        i, j = first[link], second[link]
        if beside[i, 1] >= 0 or beside[j, 1] >= 0:
            continue
        # the node behind must not be coupled with the one ahead: lines are straight
        if beside[i, 0] >= 0 and _coupled(indptr, indices, beside[i, 0], j):
            continue
        if beside[j, 0] >= 0 and _coupled(indptr, indices, beside[j, 0], i):
            continue
        ri, rj = _root(parents, i), _root(parents, j)
        if ri == rj:
            continue
        parents[ri] = rj
        beside[i, 0 if beside[i, 0] < 0 else 1] = j
        beside[j, 0 if beside[j, 0] < 0 else 1] = i
    return beside


@compiled
def _on_lines(
    first: Index, second: Index, indptr: Index, indices: Index
) -> tuple[IntArray, IntArray]:
    """All nodes line by line, and the starts of lines, from links in their order; a line that comes
    back beside itself is cut.
    """
    beside = _linked(first, second, indptr, indices)
    n = len(beside)
    order, starts = np.empty(n, np.int64), np.empty(n + 1, np.int64)
    line = np.full(n, -1, np.int64)
    placed, lines = 0, 0
    for node in range(n):
        if line[node] >= 0:
            continue
        end = node
        if beside[node, 1] >= 0:
            before, end = node, beside[node, 0]
            while beside[end, 1] >= 0:
                after = beside[end, 0] if beside[end, 0] != before else beside[end, 1]
                before, end = end, after
        before = -1
        while end >= 0:
            cut = before < 0
            for k in range(indptr[end], indptr[end + 1]):
                other = indices[k]
                if other != before and other != end and line[other] == lines - 1 and not cut:
                    cut = True
            if cut:
                starts[lines] = placed
                lines += 1
            order[placed], line[end] = end, lines - 1
            placed += 1
            after = beside[end, 0] if beside[end, 0] != before else beside[end, 1]
            before, end = end, after
    starts[lines] = n
    return order, starts[: lines + 1].copy()
