"""As `upd.linalg.lines` with `WIDTH` vectors at once, (n, WIDTH).

Written out once more: one vector by the loops of several takes 1.7 times as long (measured on the
block of 94 000 dofs), as its sums then go through memory instead of registers.
"""

from __future__ import annotations

import numpy as np

from upd.linalg.blocks import WIDTH, Index, Single
from upd.linalg.compiled import compiled


@compiled
def _solve_line_many(inverse: Single, down: Single, x: Single, first: int, end: int) -> None:
    """As `upd.linalg.lines._solve_line`."""
    for i in range(first + 1, end):
        for a in range(3):
            for e in range(3):
                for c in range(WIDTH):
                    x[3 * i + a, c] -= down[i, a, e] * x[3 * i - 3 + e, c]
    r = np.empty((3, WIDTH), np.float32)
    for i in range(end - 1, first - 1, -1):
        for a in range(3):
            for c in range(WIDTH):
                r[a, c] = (
                    inverse[i, a, 0] * x[3 * i, c]
                    + inverse[i, a, 1] * x[3 * i + 1, c]
                    + inverse[i, a, 2] * x[3 * i + 2, c]
                )
        if i < end - 1:
            for a in range(3):
                for e in range(3):
                    for c in range(WIDTH):
                        r[a, c] -= down[i + 1, e, a] * x[3 * i + 3 + e, c]
        for a in range(3):
            for c in range(WIDTH):
                x[3 * i + a, c] = r[a, c]


@compiled
def _outside_many(
    indptr: Index,
    indices: Index,
    data: Single,
    b: Single,
    x: Single,
    out: Single,
    bounds: tuple[int, int, int, int],
) -> None:
    """b - A x of the nodes from ``first`` to ``end`` into ``out``, of A the columns before ``low``
    and from ``high`` on: ``bounds`` is (first, end, low, high).
    """
    first, end, low, high = bounds
    r0, r1, r2 = (
        np.empty(WIDTH, np.float32),
        np.empty(WIDTH, np.float32),
        np.empty(WIDTH, np.float32),
    )
    for i in range(first, end):
        for c in range(WIDTH):
            r0[c], r1[c], r2[c] = b[3 * i, c], b[3 * i + 1, c], b[3 * i + 2, c]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j < low or j >= high:
                d00, d01, d02 = data[k, 0, 0], data[k, 0, 1], data[k, 0, 2]
                d10, d11, d12 = data[k, 1, 0], data[k, 1, 1], data[k, 1, 2]
                d20, d21, d22 = data[k, 2, 0], data[k, 2, 1], data[k, 2, 2]
                for c in range(WIDTH):
                    x0, x1, x2 = x[3 * j, c], x[3 * j + 1, c], x[3 * j + 2, c]
                    r0[c] -= d00 * x0 + d01 * x1 + d02 * x2
                    r1[c] -= d10 * x0 + d11 * x1 + d12 * x2
                    r2[c] -= d20 * x0 + d21 * x1 + d22 * x2
        for c in range(WIDTH):
            out[3 * i, c], out[3 * i + 1, c], out[3 * i + 2, c] = r0[c], r1[c], r2[c]


@compiled
def first_lines_many(
    indptr: Index,
    indices: Index,
    data: Single,
    inverse: Single,
    down: Single,
    starts: Index,
    b: Single,
) -> Single:
    """As `upd.linalg.lines.first_lines`."""
    x, n = np.empty(b.shape, np.float32), len(indptr) - 1
    for line in range(len(starts) - 1):
        first, end = starts[line], starts[line + 1]
        _outside_many(indptr, indices, data, b, x, x, (first, end, first, n))
        _solve_line_many(inverse, down, x, first, end)
    return x


@compiled
def residual_lines_many(
    indptr: Index, indices: Index, data: Single, starts: Index, x: Single
) -> Single:
    """As `upd.linalg.lines.residual_lines`."""
    r, nothing = np.empty(x.shape, np.float32), np.zeros(x.shape, np.float32)
    for line in range(len(starts) - 1):
        first, end = starts[line], starts[line + 1]
        _outside_many(indptr, indices, data, nothing, x, r, (first, end, 0, end))
    return r


@compiled
def last_lines_many(
    indptr: Index,
    indices: Index,
    data: Single,
    inverse: Single,
    down: Single,
    starts: Index,
    b: Single,
    x: Single,
) -> None:
    """As `upd.linalg.lines.last_lines`."""
    for line in range(len(starts) - 2, -1, -1):
        first, end = starts[line], starts[line + 1]
        _outside_many(indptr, indices, data, b, x, x, (first, end, first, end))
        _solve_line_many(inverse, down, x, first, end)


@compiled
def first_cross_many(
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
    """As `upd.linalg.lines.first_cross`."""
    y = np.empty((3 * len(nodes), WIDTH), np.float32)
    for line in range(len(starts) - 1):
        first, end = starts[line], starts[line + 1]
        for at in range(first, end):
            for a in range(3):
                for c in range(WIDTH):
                    y[3 * at + a, c] = r[3 * nodes[at] + a, c]
        _solve_line_many(inverse, down, y, first, end)
        for at in range(first, end):
            i = nodes[at]
            for a in range(3):
                for c in range(WIDTH):
                    x[3 * i + a, c] += y[3 * at + a, c]
            for k in range(indptr[i], indptr[i + 1]):
                j = indices[k]
                for a in range(3):
                    d0, d1, d2 = data[k, 0, a], data[k, 1, a], data[k, 2, a]
                    for c in range(WIDTH):
                        r[3 * j + a, c] -= (
                            d0 * y[3 * at, c] + d1 * y[3 * at + 1, c] + d2 * y[3 * at + 2, c]
                        )


@compiled
def last_cross_many(
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
    """As `upd.linalg.lines.last_cross`."""
    y, n = np.empty((3 * len(nodes), WIDTH), np.float32), len(indptr) - 1
    rest = np.empty(x.shape, np.float32)
    for line in range(len(starts) - 2, -1, -1):
        first, end = starts[line], starts[line + 1]
        for at in range(first, end):
            i = nodes[at]
            _outside_many(indptr, indices, data, b, x, rest, (i, i + 1, n, n))
            for a in range(3):
                for c in range(WIDTH):
                    y[3 * at + a, c] = rest[3 * i + a, c]
        _solve_line_many(inverse, down, y, first, end)
        for at in range(first, end):
            for a in range(3):
                for c in range(WIDTH):
                    x[3 * nodes[at] + a, c] += y[3 * at + a, c]
