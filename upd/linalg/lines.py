"""Lines of nodes along the long edges of stretched elements, smoothed a line at a time.

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

from typing import Any

import numpy as np
from scipy.sparse import bsr_array

from upd.linalg.blocks import Index, Single
from upd.linalg.common import IntArray
from upd.linalg.compiled import compiled
from upd.linalg.strength import STRONG


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
    return _on_lines(A, *_links(A))


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
    order, starts = _on_lines(A, rows[across], columns[across])
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


def _on_lines(A: bsr_array, rows: Index, columns: Index) -> tuple[IntArray, IntArray]:
    """All nodes line by line, and where lines begin, from links in their order."""
    beside = _linked(rows, columns, A.indptr, A.indices)
    order, starts = _in_order(beside, A.indptr, A.indices)
    return order, starts


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
def _in_order(beside: Index, indptr: Index, indices: Index) -> tuple[Index, Index]:
    """Nodes line by line, and the starts of lines; a line that comes back beside itself is cut."""
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


@compiled
def in_line_order(
    indptr: Index, indices: Index, data: Any, order: Index
) -> tuple[Index, Index, Single]:
    """Rows and columns of a symmetric matrix of blocks in another order, in single precision.

    Row by row of A in the new order, which is column by column: so the columns of each row come
    in their order, and a column's blocks are those of the row, transposed.

    Parameters
    ----------
    indptr, indices, data : (n + 1,), (m,), (m, b, b) ndarray
        In compressed rows.
    order : (n,) ndarray of int

    Returns
    -------
    indptr, indices, data : ndarray
        Columns of a row rise.
    """
    n, size = len(order), data.shape[1]
    place = np.empty(n, indices.dtype)
    pointers, columns = np.empty_like(indptr), np.empty_like(indices)
    blocks = np.empty(data.shape, np.float32)
    pointers[0] = 0
    for at in range(n):
        place[order[at]] = at
        pointers[at + 1] = pointers[at] + indptr[order[at] + 1] - indptr[order[at]]
    free = pointers[:-1].copy()
    for at in range(n):
        row = order[at]
        for k in range(indptr[row], indptr[row + 1]):
            to = place[indices[k]]
            columns[free[to]] = at
            for a in range(size):
                for b in range(size):
                    blocks[free[to], a, b] = data[k, b, a]
            free[to] += 1
    return pointers, columns, blocks
