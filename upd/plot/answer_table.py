"""A table of an answer as data: the terminal, the page and the notebook draw it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self


class Rounded(str):
    """A number as a table prints it; `value` has all its digits."""

    value: float

    def __new__(cls, value: float, digits: str = ".4g", text: str = "{}") -> Self:
        """The number in a text, with a format of its digits."""
        made = super().__new__(cls, text.format(f"{value:{digits}}"))
        made.value = float(value)
        return made


@dataclass(frozen=True)
class AnswerTable:
    """A table of an answer.

    Attributes
    ----------
    heading : str
        Above it.
    columns : tuple of str
        Heads; those that begin with # hold numbers, to the right.
    rows : tuple of tuple of str
        One cell for every column.
    note : str
        Below it.
    """

    heading: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""

    def as_dict(self) -> dict[str, Any]:
        """As JSON takes it: numbers with all their digits, null where they are infinite."""
        return {
            "heading": self.heading,
            "columns": [head.removeprefix("#") for head in self.columns],
            "rows": [[_plain(cell) for cell in row] for row in self.rows],
            "note": self.note,
        }


def _plain(cell: str) -> str | float | None:
    if not isinstance(cell, Rounded):
        return cell
    return cell.value if math.isfinite(cell.value) else None
