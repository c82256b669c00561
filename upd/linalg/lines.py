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

Three = tuple[np.float32, np.float32, np.float32]


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
    """Rows and columns of a symmetric matrix of blocks of 3 in another order, in single precision.

    Row by row of A in the new order, which is column by column: so the columns of each row come
    in their order, and a column's blocks are those of the row, transposed.

    Parameters
    ----------
    indptr, indices, data : (n + 1,), (m,), (m, 3, 3) ndarray
        In compressed rows.
    order : (n,) ndarray of int

    Returns
    -------
    indptr, indices, data : ndarray
        Columns of a row rise.
    """
    n = len(order)
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
            for a in range(3):
                for b in range(3):
                    blocks[free[to], a, b] = data[k, b, a]
            free[to] += 1
    return pointers, columns, blocks


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
def _solve_line(inverse: Single, down: Single, x: Single, first: int, end: int) -> None:
    """A line's equations, x its residual before and its answer after.

    With pivots S_i = A_ii - W_i A_(i-1)i and W_i = A_i(i-1) S_(i-1)^-1: y_i = r_i - W_i y_(i-1),
    then x_i = S_i^-1 y_i - W_(i+1)' x_(i+1).
    """
    for i in range(first + 1, end):
        d0, d1, d2 = _times_3(down, i, x, i - 1)
        x[3 * i] -= d0
        x[3 * i + 1] -= d1
        x[3 * i + 2] -= d2
    for i in range(end - 1, first - 1, -1):
        r0, r1, r2 = _times_3(inverse, i, x, i)
        if i < end - 1:
            x0, x1, x2 = x[3 * i + 3], x[3 * i + 4], x[3 * i + 5]
            r0 -= down[i + 1, 0, 0] * x0 + down[i + 1, 1, 0] * x1 + down[i + 1, 2, 0] * x2
            r1 -= down[i + 1, 0, 1] * x0 + down[i + 1, 1, 1] * x1 + down[i + 1, 2, 1] * x2
            r2 -= down[i + 1, 0, 2] * x0 + down[i + 1, 1, 2] * x1 + down[i + 1, 2, 2] * x2
        x[3 * i], x[3 * i + 1], x[3 * i + 2] = r0, r1, r2


@compiled
def first_lines(
    indptr: Index,
    indices: Index,
    data: Single,
    inverse: Single,
    down: Single,
    starts: Index,
    b: Single,
) -> Single:
    """A forward sweep from zero: lines that follow do not count yet."""
    x = np.empty(len(b), np.float32)
    for line in range(len(starts) - 1):
        first, end = starts[line], starts[line + 1]
        for i in range(first, end):
            r0, r1, r2 = b[3 * i], b[3 * i + 1], b[3 * i + 2]
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                if j < first:
                    d0, d1, d2 = _times_3(data, k, x, j)
                    r0, r1, r2 = r0 - d0, r1 - d1, r2 - d2
            x[3 * i], x[3 * i + 1], x[3 * i + 2] = r0, r1, r2
        _solve_line(inverse, down, x, first, end)
    return x


@compiled
def residual_lines(indptr: Index, indices: Index, data: Single, starts: Index, x: Single) -> Single:
    """b - A x after `first_lines`: -U x with the lines that follow, as (D + L) x = b."""
    r = np.empty(len(x), np.float32)
    for line in range(len(starts) - 1):
        end = starts[line + 1]
        for i in range(starts[line], end):
            r0, r1, r2 = np.float32(0.0), np.float32(0.0), np.float32(0.0)
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                if j >= end:
                    d0, d1, d2 = _times_3(data, k, x, j)
                    r0, r1, r2 = r0 - d0, r1 - d1, r2 - d2
            r[3 * i], r[3 * i + 1], r[3 * i + 2] = r0, r1, r2
    return r


@compiled
def last_lines(
    indptr: Index,
    indices: Index,
    data: Single,
    inverse: Single,
    down: Single,
    starts: Index,
    b: Single,
    x: Single,
) -> None:
    """A backward sweep."""
    for line in range(len(starts) - 2, -1, -1):
        first, end = starts[line], starts[line + 1]
        for i in range(first, end):
            r0, r1, r2 = b[3 * i], b[3 * i + 1], b[3 * i + 2]
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                if j < first or j >= end:
                    d0, d1, d2 = _times_3(data, k, x, j)
                    r0, r1, r2 = r0 - d0, r1 - d1, r2 - d2
            x[3 * i], x[3 * i + 1], x[3 * i + 2] = r0, r1, r2
        _solve_line(inverse, down, x, first, end)


@compiled
def first_cross(
    indptr: Index,
    indices: Index,
    data: Single,
    inverse: Single,
    down: Single,
    nodes: Index,
    starts: Index,
    x: Single,
    r: Single,
) -> None:
    """A forward sweep of x along cross lines; its residual r is kept up by symmetric columns."""
    y = np.empty(3 * len(nodes), np.float32)
    for line in range(len(starts) - 1):
        first, end = starts[line], starts[line + 1]
        for at in range(first, end):
            i = nodes[at]
            y[3 * at], y[3 * at + 1], y[3 * at + 2] = r[3 * i], r[3 * i + 1], r[3 * i + 2]
        _solve_line(inverse, down, y, first, end)
        for at in range(first, end):
            i = nodes[at]
            y0, y1, y2 = y[3 * at], y[3 * at + 1], y[3 * at + 2]
            x[3 * i] += y0
            x[3 * i + 1] += y1
            x[3 * i + 2] += y2
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                r[3 * j] -= data[k, 0, 0] * y0 + data[k, 1, 0] * y1 + data[k, 2, 0] * y2
                r[3 * j + 1] -= data[k, 0, 1] * y0 + data[k, 1, 1] * y1 + data[k, 2, 1] * y2
                r[3 * j + 2] -= data[k, 0, 2] * y0 + data[k, 1, 2] * y1 + data[k, 2, 2] * y2


@compiled
def last_cross(
    indptr: Index,
    indices: Index,
    data: Single,
    inverse: Single,
    down: Single,
    nodes: Index,
    starts: Index,
    b: Single,
    x: Single,
) -> None:
    """A backward sweep along cross lines."""
    y = np.empty(3 * len(nodes), np.float32)
    for line in range(len(starts) - 2, -1, -1):
        first, end = starts[line], starts[line + 1]
        for at in range(first, end):
            i = nodes[at]
            r0, r1, r2 = b[3 * i], b[3 * i + 1], b[3 * i + 2]
            for k in range(indptr[i], indptr[i + 1]):
                d0, d1, d2 = _times_3(data, k, x, indices[k])
                r0, r1, r2 = r0 - d0, r1 - d1, r2 - d2
            y[3 * at], y[3 * at + 1], y[3 * at + 2] = r0, r1, r2
        _solve_line(inverse, down, y, first, end)
        for at in range(first, end):
            i = nodes[at]
            x[3 * i] += y[3 * at]
            x[3 * i + 1] += y[3 * at + 1]
            x[3 * i + 2] += y[3 * at + 2]
