"""Sweeps of a multigrid level line by line, for one vector or several and blocks of any size, in
single precision; and the product with a symmetric matrix of which the upper triangle is stored.

With A = L + D + L' by lines, a forward sweep from zero is (L + D) x = b, so that b - A x = -L' x:
each of both passes over A takes one triangle.

Vectors are (n, w). The size of the blocks and the width w are tuples of so many zeros, so that the
compiler knows both: sums of one vector stay in registers, those of several go eight at a time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.linalg.compiled import compiled, inlined

#: right-hand sides that are worked on at once, as many single-precision numbers as a register has
WIDTH = 8
Single = NDArray[np.float32]
Index = NDArray[Any]
Zeros = tuple[int, ...]
Three = tuple[np.float32, np.float32, np.float32]
#: size of the blocks and width of the vectors
Shape = tuple[Zeros, Zeros]
#: of each row, in line order with rising columns: where its entries begin, where those of lines
#: before its own end, where those of later lines begin, where all end; columns and blocks
Rows = tuple[Index, Index, Index, Index, Index, Single]
#: rows of A line by line, where lines begin there, inverses of the pivots and what is below them
Lines = tuple[Index, Index, Single, Single]


def width_of(x: NDArray[Any]) -> Zeros:
    """The width of vectors (n, w) as the compiler knows it."""
    return (0,) * int(x.shape[1])


@inlined
def _less(begin: int, end: int, indices: Index, data: Single, x: Single, r: Three) -> Three:
    """Some blocks of 3 of a row times one vector, off r."""
    r0, r1, r2 = r
    for k in range(begin, end):
        j = 3 * indices[k]
        x0, x1, x2 = x[j, 0], x[j + 1, 0], x[j + 2, 0]
        r0 -= data[k, 0, 0] * x0 + data[k, 0, 1] * x1 + data[k, 0, 2] * x2
        r1 -= data[k, 1, 0] * x0 + data[k, 1, 1] * x1 + data[k, 1, 2] * x2
        r2 -= data[k, 2, 0] * x0 + data[k, 2, 1] * x1 + data[k, 2, 2] * x2
    return r0, r1, r2


@compiled
def _take(
    span: tuple[int, int],
    nodes: Index,
    entries: Rows,
    b: Single,
    x: Single,
    out: Single,
    strip: Single,
    shape: Shape,
) -> None:
    """b - A x of the rows nodes[at] of a span into ``out`` at these places, over the entries from
    their begin to ``low`` and from ``high`` to their end; ``strip`` is a place to work at.
    """
    begin, low, high, end, indices, data = entries
    m, w = len(shape[0]), len(shape[1])
    if m == 3 and w == 1:
        for at in range(span[0], span[1]):
            i = nodes[at]
            r0, r1, r2 = b[3 * i, 0], b[3 * i + 1, 0], b[3 * i + 2, 0]
            r0, r1, r2 = _less(begin[i], low[i], indices, data, x, (r0, r1, r2))
            r0, r1, r2 = _less(high[i], end[i], indices, data, x, (r0, r1, r2))
            out[3 * at, 0], out[3 * at + 1, 0], out[3 * at + 2, 0] = r0, r1, r2
        return
    for at in range(span[0], span[1]):
        i = nodes[at]
        for a in range(m):
            for c in range(w):
                strip[a, c] = b[m * i + a, c]
        for some in ((begin[i], low[i]), (high[i], end[i])):
            for k in range(some[0], some[1]):
                j = m * indices[k]
                if m == 3:
                    d00, d01, d02 = data[k, 0, 0], data[k, 0, 1], data[k, 0, 2]
                    d10, d11, d12 = data[k, 1, 0], data[k, 1, 1], data[k, 1, 2]
                    d20, d21, d22 = data[k, 2, 0], data[k, 2, 1], data[k, 2, 2]
                    for c in range(w):
                        x0, x1, x2 = x[j, c], x[j + 1, c], x[j + 2, c]
                        strip[0, c] -= d00 * x0 + d01 * x1 + d02 * x2
                        strip[1, c] -= d10 * x0 + d11 * x1 + d12 * x2
                        strip[2, c] -= d20 * x0 + d21 * x1 + d22 * x2
                    continue
                for a in range(m):
                    for c in range(w):
                        total = np.float32(0.0)
                        for e in range(m):
                            total += data[k, a, e] * x[j + e, c]
                        strip[a, c] -= total
        for a in range(m):
            for c in range(w):
                out[m * at + a, c] = strip[a, c]


@compiled
def _solve_one(first: int, end: int, inverse: Single, down: Single, x: Single) -> None:
    """As `_solve_line` for one vector and blocks of 3, in registers."""
    for i in range(first + 1, end):
        y0, y1, y2 = x[3 * i - 3, 0], x[3 * i - 2, 0], x[3 * i - 1, 0]
        for a in range(3):
            x[3 * i + a, 0] -= down[i, a, 0] * y0 + down[i, a, 1] * y1 + down[i, a, 2] * y2
    x0, x1, x2 = np.float32(0.0), np.float32(0.0), np.float32(0.0)
    for i in range(end - 1, first - 1, -1):
        y0, y1, y2 = x[3 * i, 0], x[3 * i + 1, 0], x[3 * i + 2, 0]
        r0 = inverse[i, 0, 0] * y0 + inverse[i, 0, 1] * y1 + inverse[i, 0, 2] * y2
        r1 = inverse[i, 1, 0] * y0 + inverse[i, 1, 1] * y1 + inverse[i, 1, 2] * y2
        r2 = inverse[i, 2, 0] * y0 + inverse[i, 2, 1] * y1 + inverse[i, 2, 2] * y2
        if i < end - 1:
            r0 -= down[i + 1, 0, 0] * x0 + down[i + 1, 1, 0] * x1 + down[i + 1, 2, 0] * x2
            r1 -= down[i + 1, 0, 1] * x0 + down[i + 1, 1, 1] * x1 + down[i + 1, 2, 1] * x2
            r2 -= down[i + 1, 0, 2] * x0 + down[i + 1, 1, 2] * x1 + down[i + 1, 2, 2] * x2
        x[3 * i, 0], x[3 * i + 1, 0], x[3 * i + 2, 0] = r0, r1, r2
        x0, x1, x2 = r0, r1, r2


@compiled
def _solve_line(
    first: int, end: int, inverse: Single, down: Single, x: Single, strip: Single, shape: Shape
) -> None:
    """A line's equations, x its residual before and its answer after.

    With pivots S_i = A_ii - W_i A_(i-1)i and W_i = A_i(i-1) S_(i-1)^-1: y_i = r_i - W_i y_(i-1),
    then x_i = S_i^-1 y_i - W_(i+1)' x_(i+1).
    """
    m, w = len(shape[0]), len(shape[1])
    if m == 3 and w == 1:
        _solve_one(first, end, inverse, down, x)
        return
    for i in range(first + 1, end):
        for a in range(m):
            for e in range(m):
                d = down[i, a, e]
                for c in range(w):
                    x[m * i + a, c] -= d * x[m * i - m + e, c]
    for i in range(end - 1, first - 1, -1):
        for a in range(m):
            for c in range(w):
                strip[a, c] = 0.0
            for e in range(m):
                d = inverse[i, a, e]
                for c in range(w):
                    strip[a, c] += d * x[m * i + e, c]
        if i < end - 1:
            for a in range(m):
                for e in range(m):
                    d = down[i + 1, e, a]
                    for c in range(w):
                        strip[a, c] -= d * x[m * i + m + e, c]
        for a in range(m):
            for c in range(w):
                x[m * i + a, c] = strip[a, c]


@compiled
def first_lines(rows: Rows, lines: Lines, b: Single, shape: Shape) -> tuple[Single, Single]:
    """A forward sweep from zero, and b - A x after it.

    Parameters
    ----------
    rows, lines
        See `Rows` and `Lines`.
    b : (n, w) ndarray
    shape
        Size of the blocks and w, as tuples.

    Returns
    -------
    x, r : (n, w) ndarray
    """
    begin, before, after, end, indices, data = rows
    nodes, starts, inverse, down = lines
    earlier = (begin, before, end, end, indices, data)
    later = (after, after, after, end, indices, data)
    x, r = np.empty(b.shape, np.float32), np.zeros(b.shape, np.float32)
    strip = np.empty((len(shape[0]), len(shape[1])), np.float32)
    for line in range(len(starts) - 1):
        span = (starts[line], starts[line + 1])
        _take(span, nodes, earlier, b, x, x, strip, shape)
        _solve_line(span[0], span[1], inverse, down, x, strip, shape)
    _take((0, len(nodes)), nodes, later, r, x, r, strip, shape)
    return x, r


@compiled
def last_lines(rows: Rows, lines: Lines, b: Single, x: Single, shape: Shape) -> None:
    """A backward sweep of x; the rest as for `first_lines`."""
    nodes, starts, inverse, down = lines
    strip = np.empty((len(shape[0]), len(shape[1])), np.float32)
    for line in range(len(starts) - 2, -1, -1):
        span = (starts[line], starts[line + 1])
        _take(span, nodes, rows, b, x, x, strip, shape)
        _solve_line(span[0], span[1], inverse, down, x, strip, shape)


@compiled
def first_cross(rows: Rows, lines: Lines, x: Single, r: Single, shape: Shape) -> None:
    """A forward sweep of x along cross lines; its residual r is kept up by symmetric columns."""
    begin, _, _, end, indices, data = rows
    nodes, starts, inverse, down = lines
    m, w = len(shape[0]), len(shape[1])
    y, strip = np.empty((m * len(nodes), w), np.float32), np.empty((m, w), np.float32)
    for line in range(len(starts) - 1):
        for at in range(starts[line], starts[line + 1]):
            for a in range(m):
                for c in range(w):
                    y[m * at + a, c] = r[m * nodes[at] + a, c]
        _solve_line(starts[line], starts[line + 1], inverse, down, y, strip, shape)
        for at in range(starts[line], starts[line + 1]):
            i = nodes[at]
            for a in range(m):
                for c in range(w):
                    x[m * i + a, c] += y[m * at + a, c]
            y0, y1, y2 = y[3 * at, 0], y[3 * at + 1, 0], y[3 * at + 2, 0]
            for k in range(begin[i], end[i]):
                j = 3 * indices[k]
                for a in range(3):
                    d0, d1, d2 = data[k, 0, a], data[k, 1, a], data[k, 2, a]
                    if w == 1:
                        r[j + a, 0] -= d0 * y0 + d1 * y1 + d2 * y2
                        continue
                    for c in range(w):
                        r[j + a, c] -= (
                            d0 * y[3 * at, c] + d1 * y[3 * at + 1, c] + d2 * y[3 * at + 2, c]
                        )


@compiled
def last_cross(rows: Rows, lines: Lines, b: Single, x: Single, shape: Shape) -> None:
    """A backward sweep of x along cross lines."""
    begin, _, _, end, indices, data = rows
    nodes, starts, inverse, down = lines
    whole = (begin, end, end, end, indices, data)
    m, w = len(shape[0]), len(shape[1])
    y, strip = np.empty((m * len(nodes), w), np.float32), np.empty((m, w), np.float32)
    for line in range(len(starts) - 2, -1, -1):
        span = (starts[line], starts[line + 1])
        _take(span, nodes, whole, b, x, y, strip, shape)
        _solve_line(span[0], span[1], inverse, down, y, strip, shape)
        for at in range(span[0], span[1]):
            for a in range(m):
                for c in range(w):
                    x[m * nodes[at] + a, c] += y[m * at + a, c]


@compiled
def symmetric_product(
    indptr: Index, indices: Index, data: NDArray[np.float64], x: NDArray[np.float64], width: Zeros
) -> NDArray[np.float64]:
    """Product of a symmetric matrix and vectors.

    Parameters
    ----------
    indptr, indices, data : (n + 1,), (nnz,), (nnz,) ndarray
        Upper triangle in compressed rows that start with their diagonal.
    x : (n, w) ndarray
    width
        w as a tuple.

    Returns
    -------
    (n, w) ndarray
    """
    n, w = len(indptr) - 1, len(width)
    y = np.zeros((n, w))
    if w == 1:
        u, v = x.reshape(n), y.reshape(n)
        for i in range(n):
            one = data[indptr[i]] * u[i]
            for k in range(indptr[i] + 1, indptr[i + 1]):
                one += data[k] * u[indices[k]]
                v[indices[k]] += data[k] * u[i]
            v[i] += one
        return y
    total = np.empty(w)
    for i in range(n):
        for c in range(w):
            total[c] = data[indptr[i]] * x[i, c]
        for k in range(indptr[i] + 1, indptr[i + 1]):
            j = indices[k]
            for c in range(w):
                total[c] += data[k] * x[j, c]
                y[j, c] += data[k] * x[i, c]
        for c in range(w):
            y[i, c] += total[c]
    return y
