"""Answers of one figure and a few tables: their text, their folder, and what a notebook shows."""

from __future__ import annotations

import json
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import Any, Self

from upd.cache.files import whole_files
from upd.errors import InputError, one_line
from upd.plot.chart import Chart
from upd.plot.matplotlib import chart_png, write_sheet
from upd.plot.png import png_uri
from upd.report.columns import whole_table
from upd.results.answer_table import AnswerTable

#: characters of a line of an answer: a terminal of 80 columns shows it whole
WIDTH = 79


def wrapped(text: str, indent: str = "  ") -> list[str]:
    """A sentence as a terminal shows it, its further lines indented by two more.

    Parameters
    ----------
    text
        Without indentation.
    indent
        Of its first line.
    """
    return textwrap.wrap(
        text,
        WIDTH,
        initial_indent=indent,
        subsequent_indent="  " + indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


@dataclass(frozen=True, repr=False)
class FigureAnswer(ABC):
    """A verdict, a few tables and notes, and one figure.

    Attributes
    ----------
    folder : Path, optional
        Where its files lie; None when nothing was written.
    """

    folder: Path | None = field(default=None, kw_only=True)

    @property
    @abstractmethod
    def verdict(self) -> str:
        """One sentence."""

    @property
    @abstractmethod
    def charts(self) -> list[Chart]:
        """The charts of its figure."""

    @property
    @abstractmethod
    def figure(self) -> str:
        """Name of the figure and of the numbers, without ending."""

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """All numbers with their units, as JSON takes them; what is not known is null."""

    @property
    @abstractmethod
    def tables(self) -> tuple[AnswerTable, ...]:
        """Its main numbers, the most important table first; empty ones are not shown."""

    @property
    @abstractmethod
    def notes(self) -> tuple[str, ...]:
        """What a reader has to know beside the tables, a sentence each."""

    def texts(self, numbers: Mapping[str, Any], charts: Sequence[Chart]) -> dict[str, str]:
        """Name of a further file -> its text.

        Parameters
        ----------
        numbers, charts
            Of the answer.
        """
        del numbers, charts
        return {}

    def write(self, out: str | Path) -> Self:
        """Write the numbers, the figure and further files into a folder, all of them or none; the
        same with it.

        Parameters
        ----------
        out
            The folder, made where there is none.

        Raises
        ------
        InputError
            When it cannot be written.
        """
        numbers, charts, folder = self.as_dict(), self.charts, Path(out)
        text = json.dumps(numbers, indent=1, allow_nan=False) + "\n"
        files = {f"{self.figure}.json": text, **self.texts(numbers, charts)}
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            with whole_files(folder) as stage:
                for file, content in files.items():
                    (stage / file).write_text(content, encoding="utf-8")
                write_sheet(charts, stage / f"{self.figure}.png")
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be written ({one_line(error)}); choose another with --out"
            ) from None
        return replace(self, folder=folder)

    def __str__(self) -> str:
        lines = wrapped(self.verdict, "")
        for table in self.tables:
            if table.rows:
                rows = [f"  {line}" for line in whole_table(table, WIDTH - 2)]
                lines += ["", f"{table.heading}:", *rows, *wrapped(table.note)]
        lines += [""] * bool(self.notes)
        return "\n".join([*lines, *(line for note in self.notes for line in wrapped(note, ""))])

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        """As a notebook shows it: its text and its figure."""
        uri = png_uri(chart_png(self.charts))
        return f'<pre>{escape(str(self))}</pre><img src="{uri}">'
