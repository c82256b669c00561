"""Tables of text: what a study shows on a terminal and in study.md."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from upd.batch.study_point import SolvedPoint

#: head, "l" or "r", and what makes the cell of a row
TableColumn = tuple[str, str, Callable[[Any], str]]


@dataclass(frozen=True)
class TextTable:
    """A table for a terminal.

    Cells as text, ``align`` a letter per column ("l", "r"), the first column at least ``width``
    wide. Columns of words named in ``spare`` are left out first where the terminal is narrow.
    """

    title: str
    columns: tuple[str, ...]
    align: str
    rows: tuple[tuple[str, ...], ...]
    width: int = 0
    spare: tuple[str, ...] = ()


def make_table(
    title: str,
    columns: Sequence[TableColumn],
    rows: Iterable[Any],
    *,
    whole: bool = False,
    spare: tuple[str, ...] = (),
) -> TextTable:
    """A table of rows of any kind. ``whole``: words of its first column are not broken, however
    narrow the terminal.
    """
    cells = tuple(tuple(cell(row) for _, _, cell in columns) for row in rows)
    return TextTable(
        title,
        tuple(head for head, _, _ in columns),
        "".join(letter for _, letter, _ in columns),
        cells,
        max((len(row[0]) for row in cells), default=0) if whole else 0,
        spare,
    )


def cost_columns(digits: int = 2) -> tuple[TableColumn, ...]:
    """What a solved point costs, and why it failed."""

    def seconds(one: SolvedPoint) -> str:
        return f"{one.outcome.seconds:.{digits}f}"

    return (
        ("dofs", "r", lambda one: f"{one.outcome.n_dof}"),
        ("seconds", "r", seconds),
        ("peak MB", "r", lambda one: f"{one.outcome.memory_mb:.0f}"),
        ("note", "l", lambda one: str(one.outcome.failure)),
    )


def markdown_table(table: TextTable) -> list[str]:
    """Lines of a table in Markdown."""
    heads = (head.replace("\n", " ") for head in table.columns)
    marks = "".join("---:|" if letter == "r" else "---|" for letter in table.align)
    lines = (f"| {' | '.join(row)} |" for row in table.rows)
    return [f"| {' | '.join(heads)} |", f"|{marks}", *lines]
