"""Columns of a table in plain text: fitted to a width by omitting columns, never digits."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Sequence
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
class _Column:
    """A column: its head and its cells, all of one or more lines; numbers are flush right."""

    head: str
    cells: tuple[str, ...]
    right: bool = False

    @property
    def width(self) -> int:
        """Characters of the longest line."""
        return max(len(line) for text in (self.head, *self.cells) for line in text.split("\n"))


def text_width() -> int:
    """Columns of the terminal ($COLUMNS where it is set), 120 when there is none; no fewer than
    a table needs.
    """
    return max(_LEAST_WIDTH, shutil.get_terminal_size((WIDTH, 24)).columns)


def wrapped(text: str, width: int) -> list[str]:
    """A text on lines of ``width`` characters, its further lines indented by two; words and paths
    stay whole.
    """
    return textwrap.wrap(
        text, width, subsequent_indent="  ", break_on_hyphens=False, break_long_words=False
    )


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
    columns = _columns(table)
    while cut and len(columns) > 2 and _wide(columns) > width:
        columns.pop()
    whole = _folded(columns, width)
    if _wide(whole) <= width:
        return _lines(whole)
    # the words before the first numbers tell what a row is of
    first = next((k for k, column in enumerate(columns) if k and column.right), 1)
    groups: list[list[_Column]] = []
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


def _columns(table: AnswerTable) -> list[_Column]:
    return [
        _Column(folded_head(head.lstrip("# "), max(map(len, cells))), cells, head.startswith("#"))
        for head, cells in zip(table.columns, zip(*table.rows, strict=True), strict=True)
    ]


def _wide(columns: Sequence[_Column]) -> int:
    return sum(column.width for column in columns) + GAP * (len(columns) - 1)


def _folded(columns: Sequence[_Column], width: int) -> list[_Column]:
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


def _lines(columns: Sequence[_Column]) -> list[str]:
    """Heads, which end on one line, and rows, whose cells begin on one."""
    heads = [column.head.split("\n") for column in columns]
    most = max(map(len, heads))
    lines = list(zip(*([""] * (most - len(head)) + head for head in heads), strict=True))
    for row in zip(*(column.cells for column in columns), strict=True):
        lines += zip_longest(*(cell.split("\n") for cell in row), fillvalue="")
    aligned = (
        [
            text.rjust(column.width) if column.right else text.ljust(column.width)
            for column, text in zip(columns, line, strict=True)
        ]
        for line in lines
    )
    return [(" " * GAP).join(cells).rstrip() for cells in aligned]
