"""A table of an answer as data: the terminal, the page and the notebook draw it."""

from __future__ import annotations

from dataclasses import dataclass


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
