"""Columns of a table in plain text: fitted to a width by leaving columns out, never digits."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

#: between two columns
GAP = 2
#: width of text that goes to no terminal
WIDTH = 120
#: most lines of a column's head
_HEAD_LINES = 3


@dataclass(frozen=True)
class TextColumn:
    """A column.

    Attributes
    ----------
    head
        Its head; may have several lines.
    cells
        One per row.
    right
        Flush right, as numbers are.
    rank
        The column of the highest rank is left out first; one of rank 0 stays.
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
        return max(map(len, (*self.head.split("\n"), *self.cells)))

    def line(self, text: str) -> str:
        """A cell of the column, filled up."""
        return text.rjust(self.width) if self.right else text.ljust(self.width)


def text_width() -> int:
    """Columns of the terminal ($COLUMNS where it is set), 120 when there is none."""
    return shutil.get_terminal_size((WIDTH, 24)).columns


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
    """Lines of the heads and of the rows."""
    heads = [column.head.split("\n") for column in columns]
    most = max(map(len, heads))
    tops = [["", *[""] * (most - 1 - len(head)), *head][-most:] for head in heads]
    rows = zip(*(column.cells for column in columns), strict=True)
    return (
        [_joined(columns, line) for line in zip(*tops, strict=True)],
        [_joined(columns, row) for row in rows],
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
