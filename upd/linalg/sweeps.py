"""Sweeps of a multigrid level line by line, in single precision.

With A = L + D + L' by lines, a forward sweep from zero is (L + D) x = b, so that b - A x = -L' x:
each of both passes over A takes one triangle.

Blocks of 3 dofs per node are worked on in registers. Levels of blocks of any other size go node by
node: their lines are single nodes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.linalg.compiled import compiled, inlined

Single = NDArray[np.float32]
Index = NDArray[Any]
Three = tuple[np.float32, np.float32, np.float32]
#: of each row, in line order with rising columns: where its entries begin, where those of lines
#: before its own end, where those of later lines begin, where all end; columns and blocks
Rows = tuple[Index, Index, Index, Index, Index, Single]
#: rows of A line by line, where lines begin there, inverses of the pivots and what is below them
Lines = tuple[Index, Index, Single, Single]


@inlined
def _less(begin: int, end: int, indices: Index, data: Single, x: Single, r: Three) -> Three:
    """Some blocks of 3 of a row times x, off r."""
    r0, r1, r2 = r
    for k in range(begin, end):
        j = 3 * indices[k]
        x0, x1, x2 = x[j], x[j + 1], x[j + 2]
        r0 -= data[k, 0, 0] * x0 + data[k, 0, 1] * x1 + data[k, 0, 2] * x2
        r1 -= data[k, 1, 0] * x0 + data[k, 1, 1] * x1 + data[k, 1, 2] * x2
        r2 -= data[k, 2, 0] * x0 + data[k, 2, 1] * x1 + data[k, 2, 2] * x2
    return r0, r1, r2


@compiled
def _take(
    span: tuple[int, int], nodes: Index, entries: Rows, b: Single, x: Single, out: Single
) -> None:
    """b - A x of the rows nodes[at] of a span into ``out`` at these places, over the entries from
    their begin to ``low`` and from ``high`` to their end.
    """
    begin, low, high, end, indices, data = entries
    m = data.shape[1]
    if m == 3:
        for at in range(span[0], span[1]):
            i = nodes[at]
            r0, r1, r2 = b[3 * i], b[3 * i + 1], b[3 * i + 2]
            r0, r1, r2 = _less(begin[i], low[i], indices, data, x, (r0, r1, r2))
            r0, r1, r2 = _less(high[i], end[i], indices, data, x, (r0, r1, r2))
            out[3 * at], out[3 * at + 1], out[3 * at + 2] = r0, r1, r2
        return
    for at in range(span[0], span[1]):
        i = nodes[at]
        for a in range(m):
            total = b[m * i + a]
            for some in ((begin[i], low[i]), (high[i], end[i])):
                for k in range(some[0], some[1]):
                    for e in range(m):
                        total -= data[k, a, e] * x[m * indices[k] + e]
            out[m * at + a] = total


@compiled
def _solve_line(span: tuple[int, int], inverse: Single, down: Single, x: Single) -> None:
    """A line's equations, x its residual before and its answer after.

    With pivots S_i = A_ii - W_i A_(i-1)i and W_i = A_i(i-1) S_(i-1)^-1: y_i = r_i - W_i y_(i-1),
    then x_i = S_i^-1 y_i - W_(i+1)' x_(i+1).
    """
    first, end = span
    m = inverse.shape[1]
    if m != 3:
        y = x[m * first : m * end].copy()
        for a in range(m):
            total = np.float32(0.0)
            for e in range(m):
                total += inverse[first, a, e] * y[e]
            x[m * first + a] = total
        return
    for i in range(first + 1, end):
        y0, y1, y2 = x[3 * i - 3], x[3 * i - 2], x[3 * i - 1]
        for a in range(3):
            x[3 * i + a] -= down[i, a, 0] * y0 + down[i, a, 1] * y1 + down[i, a, 2] * y2
    x0, x1, x2 = np.float32(0.0), np.float32(0.0), np.float32(0.0)
    for i in range(end - 1, first - 1, -1):
        y0, y1, y2 = x[3 * i], x[3 * i + 1], x[3 * i + 2]
        r0 = inverse[i, 0, 0] * y0 + inverse[i, 0, 1] * y1 + inverse[i, 0, 2] * y2
        r1 = inverse[i, 1, 0] * y0 + inverse[i, 1, 1] * y1 + inverse[i, 1, 2] * y2
        r2 = inverse[i, 2, 0] * y0 + inverse[i, 2, 1] * y1 + inverse[i, 2, 2] * y2
        if i < end - 1:
            r0 -= down[i + 1, 0, 0] * x0 + down[i + 1, 1, 0] * x1 + down[i + 1, 2, 0] * x2
            r1 -= down[i + 1, 0, 1] * x0 + down[i + 1, 1, 1] * x1 + down[i + 1, 2, 1] * x2
            r2 -= down[i + 1, 0, 2] * x0 + down[i + 1, 1, 2] * x1 + down[i + 1, 2, 2] * x2
        x[3 * i], x[3 * i + 1], x[3 * i + 2] = r0, r1, r2
        x0, x1, x2 = r0, r1, r2


@compiled
def first_lines(rows: Rows, lines: Lines, b: Single) -> tuple[Single, Single]:
    """A forward sweep from zero, and b - A x after it.

    Parameters
    ----------
    rows, lines
        See `Rows` and `Lines`.
    b : (n,) ndarray

    Returns
    -------
    x, r : (n,) ndarray
    """
    begin, before, after, end, indices, data = rows
    nodes, starts, inverse, down = lines
    earlier = (begin, before, end, end, indices, data)
    later = (after, after, after, end, indices, data)
    x, r = np.empty(b.shape, np.float32), np.zeros(b.shape, np.float32)
    for line in range(len(starts) - 1):
        span = (starts[line], starts[line + 1])
        _take(span, nodes, earlier, b, x, x)
        _solve_line(span, inverse, down, x)
    _take((0, len(nodes)), nodes, later, r, x, r)
    return x, r


@compiled
def last_lines(rows: Rows, lines: Lines, b: Single, x: Single) -> None:
    """A backward sweep of x; the rest as for `first_lines`."""
    nodes, starts, inverse, down = lines
    for line in range(len(starts) - 2, -1, -1):
        span = (starts[line], starts[line + 1])
        _take(span, nodes, rows, b, x, x)
        _solve_line(span, inverse, down, x)


@compiled
def first_cross(rows: Rows, lines: Lines, x: Single, r: Single) -> None:
    """A forward sweep of x along cross lines of blocks of 3; its residual r is kept up by symmetric
    columns.
    """
    begin, _, _, end, indices, data = rows
    nodes, starts, inverse, down = lines
    y = np.empty(3 * len(nodes), np.float32)
    for line in range(len(starts) - 1):
        span = (starts[line], starts[line + 1])
        for at in range(span[0], span[1]):
            y[3 * at : 3 * at + 3] = r[3 * nodes[at] : 3 * nodes[at] + 3]
        _solve_line(span, inverse, down, y)
        for at in range(span[0], span[1]):
            i = nodes[at]
            y0, y1, y2 = y[3 * at], y[3 * at + 1], y[3 * at + 2]
            x[3 * i] += y0
            x[3 * i + 1] += y1
            x[3 * i + 2] += y2
            for k in range(begin[i], end[i]):
                for a in range(3):
                    r[3 * indices[k] + a] -= (
                        data[k, 0, a] * y0 + data[k, 1, a] * y1 + data[k, 2, a] * y2
                    )


@compiled
def last_cross(rows: Rows, lines: Lines, b: Single, x: Single) -> None:
    """A backward sweep of x along cross lines."""
    begin, _, _, end, indices, data = rows
    nodes, starts, inverse, down = lines
    whole = (begin, end, end, end, indices, data)
    y = np.empty(3 * len(nodes), np.float32)
    for line in range(len(starts) - 2, -1, -1):
        span = (starts[line], starts[line + 1])
        _take(span, nodes, whole, b, x, y)
        _solve_line(span, inverse, down, y)
        for at in range(span[0], span[1]):
            x[3 * nodes[at] : 3 * nodes[at] + 3] += y[3 * at : 3 * at + 3]
