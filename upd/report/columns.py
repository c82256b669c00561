"""Columns of a table in plain text: fitted to a width by omitting columns, never digits."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

from upd.results.answer_table import AnswerTable

#: between two columns
GAP = 2
#: width of text that goes to no terminal
WIDTH = 120
_LEAST_WIDTH = 40
#: most lines of a column's head
_HEAD_LINES = 3
#: most lines that `print` shows of a result
SHORT = 10
#: characters of a column of words that are read with ease
_WORDS = 20


@dataclass(frozen=True)
class TextColumn:
    """A column.

    Attributes
    ----------
    head
        Its head; may have several lines.
    cells
        One per row; may have several lines.
    right
        Flush right, as numbers are.
    rank
        The column of the highest rank is omitted first; one of rank 0 stays.
    folds
        Characters to which words may be folded; 0 for numbers, which stay whole.
    """

    head: str
    cells: tuple[str, ...]
    right: bool = False
    rank: int = 0
    folds: int = 0

    @property
    def width(self) -> int:
        """Characters of the longest line."""
        return max(len(line) for text in (self.head, *self.cells) for line in text.split("\n"))

    def line(self, text: str) -> str:
        """A cell of the column, filled up."""
        return text.rjust(self.width) if self.right else text.ljust(self.width)


def text_width() -> int:
    """Columns of the terminal ($COLUMNS where it is set), 120 when there is none; no fewer than
    a table needs.
    """
    return max(_LEAST_WIDTH, shutil.get_terminal_size((WIDTH, 24)).columns)


def fitted(
    columns: Iterable[TextColumn], width: int, *, gap: int = GAP
) -> tuple[list[TextColumn], list[TextColumn]]:
    """The columns that fit into the width, and those left out.

    A column that is empty in every row is neither.
    """
    kept = [column for column in columns if not column.rank or any(column.cells)]
    left_out: list[TextColumn] = []
    while sum(_least(c) for c in kept) + gap * (len(kept) - 1) > width:
        worst = max(kept, key=lambda column: column.rank)
        if not worst.rank:
            break
        kept.remove(worst)
        left_out.insert(0, worst)
    return kept, left_out


def _least(column: TextColumn) -> int:
    """Characters a column needs."""
    return min(column.width, column.folds) if column.folds else column.width


def text_lines(columns: Sequence[TextColumn]) -> tuple[list[str], list[str]]:
    """Lines of the heads, and of each row."""
    heads = [column.head.split("\n") for column in columns]
    most = max(map(len, heads))
    tops = [["", *[""] * (most - 1 - len(head)), *head][-most:] for head in heads]
    rows = zip(*(column.cells for column in columns), strict=True)
    return (
        [_joined(columns, line) for line in zip(*tops, strict=True)],
        [
            "\n".join(_joined(columns, line) for line in zip_longest(*lines, fillvalue=""))
            for lines in ([cell.split("\n") for cell in row] for row in rows)
        ],
    )


def _joined(columns: Sequence[TextColumn], texts: Iterable[str]) -> str:
    cells = (column.line(text) for column, text in zip(columns, texts, strict=True))
    return (" " * GAP).join(cells).rstrip()


def folded_head(words: str, least: int = 8) -> str:
    """A head on as many lines as keep its column narrow, at most three."""
    width = max(least, *map(len, words.split()))
    while len(lines := textwrap.wrap(words, width)) > _HEAD_LINES:
        width += 1
    return "\n".join(lines)


def whole_table(table: AnswerTable, width: int, *, cut: bool = False) -> list[str]:
    """Lines of a table with all its columns, at most ``width`` characters each.

    Words are folded where that is enough; else the columns that find no room stand below, beside
    the first ones again, or, where the table may be ``cut``, its last ones are left out.
    """
    columns = [
        TextColumn(
            folded_head(head.lstrip("# "), max(map(len, cells))), cells, right=head.startswith("#")
        )
        for head, cells in zip(table.columns, zip(*table.rows, strict=True), strict=True)
    ]
    while cut and len(columns) > 2 and _wide(columns) > width:
        columns.pop()
    whole = _folded(columns, width)
    if _wide(whole) <= width:
        return _lines(whole)
    # the words before the first numbers tell what a row is of
    first = next((k for k, column in enumerate(columns) if k and column.right), 1)
    groups: list[list[TextColumn]] = []
    for column in columns[first:]:
        if column.head == "±" and groups:
            groups[-1].append(column)
        else:
            groups.append([column])
    blocks = [columns[:first]]
    for group in groups:
        if len(blocks[-1]) > first and _wide([*blocks[-1], *group]) > width:
            blocks.append(columns[:first])
        blocks[-1] = [*blocks[-1], *group]
    return [line for block in blocks for line in _lines(_folded(block, width))]


def _wide(columns: Sequence[TextColumn]) -> int:
    return sum(column.width for column in columns) + GAP * (len(columns) - 1)


def _folded(columns: Sequence[TextColumn], width: int) -> list[TextColumn]:
    """The columns with the words of the widest, one after the other, folded as far as they can be
    read.
    """
    out = list(columns)
    for k in sorted((k for k, c in enumerate(out) if not c.right), key=lambda k: -out[k].width):
        over, column = _wide(out) - width, out[k]
        if over > 0:
            words = [word for text in (column.head, *column.cells) for word in text.split()]
            most = max(column.width - over, min(column.width, _WORDS), *map(len, words))
            cells = tuple("\n".join(textwrap.wrap(cell, most)) for cell in column.cells)
            out[k] = replace(column, head=folded_head(column.head, most), cells=cells)
    return out


def _lines(columns: Sequence[TextColumn]) -> list[str]:
    heads, rows = text_lines(columns)
    return [line for row in (*heads, *rows) for line in row.split("\n")]
