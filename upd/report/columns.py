"""Columns of a table in plain text: fitted to a width by omitting columns, never digits."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Sequence
from itertools import zip_longest

from upd.plot.answer_table import AnswerTable

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


#: whether it holds numbers, flush right; its head and its cells, of one or more lines
Column = tuple[bool, tuple[str, ...]]


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
    columns = [
        (head.startswith("#"), (folded_head(head.lstrip("# "), max(map(len, cells))), *cells))
        for head, cells in zip(table.columns, zip(*table.rows, strict=True), strict=True)
    ]
    while cut and len(columns) > 2 and _wide(columns) > width:
        columns.pop()
    whole = _folded(columns, width)
    if _wide(whole) <= width:
        return _lines(whole)
    # the words before the first numbers tell what a row is of
    first = next((k for k, (right, _) in enumerate(columns) if k and right), 1)
    groups: list[list[Column]] = []
    for column in columns[first:]:
        if column[1][0] == "±" and groups:
            groups[-1].append(column)
        else:
            groups.append([column])
    blocks = [columns[:first]]
    for group in groups:
        if len(blocks[-1]) > first and _wide([*blocks[-1], *group]) > width:
            blocks.append(columns[:first])
        blocks[-1] = [*blocks[-1], *group]
    return [line for block in blocks for line in _lines(_folded(block, width))]


def _width(column: Column) -> int:
    """Characters of the longest line."""
    return max(len(line) for text in column[1] for line in text.split("\n"))


def _wide(columns: Sequence[Column]) -> int:
    return sum(map(_width, columns)) + GAP * (len(columns) - 1)


def _folded(columns: Sequence[Column], width: int) -> list[Column]:
    """The columns with the words of the widest, one after the other, folded as far as they can be
    read.
    """
    out = list(columns)
    for k in sorted(range(len(out)), key=lambda k: -_width(out[k])):
        (right, texts), over, mine = out[k], _wide(out) - width, _width(out[k])
        if over > 0 and not right:
            words = [len(word) for text in texts for word in text.split()]
            most = max(mine - over, min(mine, _WORDS), *words)
            head, *cells = texts
            folded = ("\n".join(textwrap.wrap(cell, most)) for cell in cells)
            out[k] = right, (folded_head(head, most), *folded)
    return out


def _lines(columns: Sequence[Column]) -> list[str]:
    """Heads, which end on one line, and rows, whose cells begin on one."""
    heads, *rows = zip(*(texts for _, texts in columns), strict=True)
    most = max(head.count("\n") for head in heads)
    lines: list[tuple[str, ...]] = []
    for row in (["\n" * (most - head.count("\n")) + head for head in heads], *rows):
        lines += zip_longest(*(cell.split("\n") for cell in row), fillvalue="")
    forms = [f"{{:{'>' if column[0] else '<'}{_width(column)}}}" for column in columns]
    return [(" " * GAP).join(forms).format(*line).rstrip() for line in lines]
