"""Harwell-Boeing files of real assembled matrices, symmetric ones included, which scipy's reader
refuses.

Source: I. S. Duff, R. G. Grimes, J. G. Lewis, Users' Guide for the Harwell-Boeing Sparse Matrix
Collection, TR/PA/92/86 (1992). Ansys' HBMAT writes such files (type RSA: the lower triangle by
columns, one number per line, exponents with D, right-hand side at the end).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, diags_array, tril

_PER_LINE = {"I": 8, "E": 3}
_VALUE_WIDTH = 25


@dataclass(frozen=True)
class _Header:
    """The first four lines.

    Type, shape, entries, lines of each section, characters per number of each, lines of the
    right-hand side.
    """

    kind: str
    shape: tuple[int, int]
    nnz: int
    lines: tuple[int, int, int]
    widths: tuple[int, int, int]
    right_hand_side: int


def read_harwell_boeing(path: Path) -> csr_array:
    """Read a matrix; a right-hand side is passed over.

    Parameters
    ----------
    path
        Harwell-Boeing file, type RSA or RUA.

    Returns
    -------
    (m, n) csr_array
        Both triangles of a symmetric one.

    Raises
    ------
    ValueError
        For a file that is none, or a complex, pattern or elemental matrix.
    """
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        head = [file.readline().rstrip("\r\n") for _ in range(4)]
        header = _header(head)
        # A line for the right-hand side's own format follows when there is one.
        if header.right_hand_side > 0:
            file.readline()
        sections = [[file.readline() for _ in range(count)] for count in header.lines]
        rest = sum(1 for line in file if line.strip())
    if rest < header.right_hand_side:
        raise ValueError(
            f"{rest} lines of the right-hand side are left, {header.right_hand_side} are "
            "announced: lines are missing"
        )
    m, n = header.shape
    pointers = _numbers(sections[0], header.widths[0], n + 1).astype(np.int64) - 1
    rows = _numbers(sections[1], header.widths[1], header.nnz).astype(np.int64) - 1
    values = _numbers(sections[2], header.widths[2], header.nnz)
    if (
        len(pointers) != n + 1
        or len(rows) != header.nnz
        or len(values) != header.nnz
        or pointers[0] != 0
        or pointers[-1] != header.nnz
    ):
        raise ValueError(
            f"{len(pointers)} pointers, {len(rows)} row numbers, {len(values)} values do "
            f"not fit {header.nnz} entries of {header.shape}"
        )
    if (np.diff(pointers) < 0).any() or rows.min(initial=0) < 0 or rows.max(initial=0) >= m:
        raise ValueError("pointers that fall, or row numbers outside the matrix")
    A = csc_array((values, rows, pointers), shape=(m, n))
    A.sum_duplicates()
    if header.kind[1] == "S":
        # Either triangle may be stored; its mirror image less the diagonal completes it.
        both = tril(A, -1).nnz and tril(A.T, -1).nnz
        if not both:
            A = csc_array(A + A.T - diags_array(A.diagonal()))
    return csr_array(A)


def _header(head: list[str]) -> _Header:
    counts = [int(word) for word in head[1].split()]
    words = head[2].split()
    if len(counts) < 4 or len(words) < 4 or not re.fullmatch(r"[A-Za-z]{3}", words[0]):
        raise ValueError("the header is not that of a Harwell-Boeing file")
    kind = words[0].upper()
    if kind[0] != "R" or kind[1] not in "SU" or kind[2] != "A":
        raise ValueError(
            f"type {kind}: only real, assembled, symmetric or unsymmetric ones (RSA, RUA) "
            "are stiffness or mass matrices"
        )
    formats = re.findall(r"\(([^()]*)\)", head[3])
    widths = [
        int(found.group(1))
        for one in formats[:3]
        if (found := re.search(r"[IEDFG](\d+)", one.upper()))
    ]
    if len(widths) != 3:
        raise ValueError(
            f"formats {head[3].strip()!r}: three of the kind (8I10) or (3E25.16) are expected"
        )
    shape, right = (int(words[1]), int(words[2])), counts[4] if len(counts) > 4 else 0
    return _Header(
        kind,
        shape,
        int(words[3]),
        (counts[1], counts[2], counts[3]),
        (widths[0], widths[1], widths[2]),
        right,
    )


def _numbers(lines: list[str], width: int, count: int) -> NDArray[np.float64]:
    """`count` numbers from some lines.

    Where they touch, cut at their fixed width (which some writers do not keep to otherwise).
    """
    words = "".join(lines).split()
    if len(words) != count:
        stripped = [line.rstrip() for line in lines]
        words = " ".join(
            line[k : k + width] for line in stripped for k in range(0, len(line), width)
        ).split()
    return np.array([word.replace("D", "E").replace("d", "e") for word in words], dtype=np.float64)


def write_harwell_boeing(path: Path, A: csr_array, title: str = "upd") -> None:
    """Write a symmetric matrix as RSA: its lower triangle by columns, 17 digits.

    Parameters
    ----------
    path
        File to write.
    A : (n, n) csr_array
        Symmetric.
    title
        First line, at most 72 characters of it.
    """
    lower = csc_array(tril(A, format="csc"))
    lower.sort_indices()
    width = len(str(max(lower.nnz + 1, lower.shape[0]))) + 2
    sections = [
        _lines([f"{i:{width}d}" for i in lower.indptr.astype(np.int64) + 1], _PER_LINE["I"]),
        _lines([f"{i:{width}d}" for i in lower.indices.astype(np.int64) + 1], _PER_LINE["I"]),
        _lines([f"{v:{_VALUE_WIDTH}.16E}" for v in lower.data], _PER_LINE["E"]),
    ]
    counts = [len(section) for section in sections]
    integer, value = f"({_PER_LINE['I']}I{width})", f"({_PER_LINE['E']}E{_VALUE_WIDTH}.16)"
    head = [
        f"{title[:72]:<72}{'upd':<8}",
        "".join(f"{count:14d}" for count in (sum(counts), *counts, 0)),
        f"{'RSA':<14}" + "".join(f"{v:14d}" for v in (*lower.shape, lower.nnz, 0)),
        f"{integer:<16}{integer:<16}{value:<20}{'':<20}",
    ]
    path.write_text(
        "\n".join([*head, *(line for section in sections for line in section)]) + "\n",
        encoding="ascii",
    )


def _lines(words: list[str], per_line: int) -> list[str]:
    return ["".join(words[k : k + per_line]) for k in range(0, len(words), per_line)]
