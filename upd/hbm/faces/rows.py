"""Rows of numbers in compiled loops: copied, and summed with weights.

No view of a row is made: one costs two atomic counts of references, as much as the row itself.
"""

from __future__ import annotations

from upd.linalg.compiled import inlined


@inlined
def put(part, row, k):  # type: ignore[no-untyped-def]
    """Numbers into a row, from a place on; the place after them.

    Parameters
    ----------
    part, row : ndarray
        `row` is overwritten.
    k : int

    Returns
    -------
    int
    """
    # loops: whole-array assignments take seconds to compile
    for j in range(len(part)):
        row[k + j] = part[j]
    return k + len(part)


@inlined
def put_row(part, rows, k):  # type: ignore[no-untyped-def]
    """Numbers into row k of an array.

    Parameters
    ----------
    part : (j,) ndarray
    rows : (i, j) ndarray
        Overwritten.
    k : int
    """
    for j in range(len(part)):
        rows[k, j] = part[j]


@inlined
def fetch_row(rows, k, part):  # type: ignore[no-untyped-def]
    """What `put_row` did, undone.

    Parameters
    ----------
    rows : (i, j) ndarray
    k : int
    part : (j,) ndarray
        Overwritten.
    """
    for j in range(len(part)):
        part[j] = rows[k, j]


@inlined
def add_rows(x, sign, weights, rows, k, M, one):  # type: ignore[no-untyped-def]
    """Add to x rows of M[one] with weights.

    Parameters
    ----------
    x : (j,) ndarray
        Overwritten.
    sign : float
        Of all weights, 1 or -1.
    weights : (k,) ndarray or longer
    rows : (k,) ndarray of int or longer
        Which rows.
    k : int
    M : (B, i, j) ndarray
    one : int
    """
    # four rows a pass: x is read and written a quarter as often, in the order of one by one
    i = 0
    while i + 4 <= k:
        a, b, c, d = rows[i], rows[i + 1], rows[i + 2], rows[i + 3]
        wa, wb = sign * weights[i], sign * weights[i + 1]
        wc, wd = sign * weights[i + 2], sign * weights[i + 3]
        for j in range(len(x)):
            x[j] = (
                x[j] + wa * M[one, a, j] + wb * M[one, b, j] + wc * M[one, c, j] + wd * M[one, d, j]
            )
        i += 4
    while i < k:
        a, wa = rows[i], sign * weights[i]
        for j in range(len(x)):
            x[j] += wa * M[one, a, j]
        i += 1
