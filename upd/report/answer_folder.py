"""Answers of one figure and a few tables: their text, their page and their folder."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from upd.cache.files import whole_files
from upd.cache.sources import versions
from upd.errors import InputError, one_line
from upd.plot.chart import Chart
from upd.report.answer import opened, table_lines
from upd.report.columns import wrapped
from upd.report.page import Section, page_text, versions_text
from upd.results.answer_table import AnswerTable
from upd.scene import AnyScene
from upd.scene.keys import scene_as_run

#: characters of a line of an answer: a terminal of 80 columns shows it whole
WIDTH = 79


@dataclass(frozen=True, repr=False)
class FigureAnswer(ABC):
    """A verdict, a few tables and notes, and one figure.

    Attributes
    ----------
    source : AnyScene
        The scene that the question was about.
    folder : Path, optional
        Where its files lie; None when nothing was written.
    """

    source: AnyScene
    folder: Path | None = field(default=None, kw_only=True)

    @property
    @abstractmethod
    def verdict(self) -> str:
        """One sentence."""

    @property
    @abstractmethod
    def outcome(self) -> tuple[str, str]:
        """Its first word, and its kind: passed, warning or failed."""

    @property
    @abstractmethod
    def charts(self) -> list[Chart]:
        """The charts of its figure."""

    @property
    @abstractmethod
    def figure(self) -> str:
        """Name of the figure, without ending."""

    @property
    @abstractmethod
    def tables(self) -> tuple[AnswerTable, ...]:
        """Its main numbers, the most important table first; empty ones are not shown."""

    @property
    @abstractmethod
    def notes(self) -> tuple[str, ...]:
        """What a reader has to know beside the tables, a sentence each."""

    @property
    def scene(self) -> AnyScene:
        """The scene on its page; one that is not that of the question is a file too."""
        return self.source

    def as_dict(self) -> dict[str, Any]:
        """Verdict, tables and notes as JSON takes them: numbers have all their digits."""
        return {
            "scene": self.source.name,
            "title": self.source.title,
            "outcome": self.outcome[0],
            "verdict": self.verdict,
            "tables": [table.as_dict() for table in self.tables if table.rows],
            "notes": self.notes,
            "versions": versions(),
        }

    def page(self, charts: Sequence[Chart]) -> str:
        """Its page as HTML that needs nothing beside it.

        Parameters
        ----------
        charts
            Those of its figure.
        """
        word, kind = self.outcome
        sections = [
            Section("Answer", self.tables),
            Section("Notes", texts=self.notes),
            Section("Figures", charts=charts),
            Section("Scene file", file=self._scene_file),
        ]
        title = self.source.title or self.source.name
        verdict = (kind, word, f"{self.verdict}.")
        return page_text(title, sections, verdict=verdict, footer=versions_text(versions()))

    @property
    def _scene_file(self) -> str:
        return f"# {self.verdict}\n{scene_as_run(self.scene)}"

    def write(self, out: str | Path) -> Self:
        """Write figure, page, numbers and a new scene into a folder, all of them or none; the same
        with it.

        Parameters
        ----------
        out
            The folder, made where there is none.

        Raises
        ------
        InputError
            When it cannot be written.
        """
        # matplotlib is slow to import
        from upd.plot.matplotlib import write_sheets

        charts, folder = self.charts, Path(out)
        summary = json.dumps(self.as_dict(), indent=1, allow_nan=False) + "\n"
        files = {"summary.json": summary, "report.html": self.page(charts)}
        if self.scene is not self.source:
            files[f"{self.scene.name}.toml"] = self._scene_file
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            with whole_files(folder) as stage:
                for file, content in files.items():
                    (stage / file).write_text(content, encoding="utf-8")
                write_sheets(charts, stage)
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be written ({one_line(error)}); choose another with --out"
            ) from None
        return replace(self, folder=folder)

    def plot(self) -> list[Any]:
        """Draw the charts of its figure with matplotlib, and return the axes."""
        from upd.plot.matplotlib import draw_all

        return draw_all(self.charts)

    def table(self) -> str:
        """Its verdict, all its tables and its notes as text."""
        lines = wrapped(self.verdict, WIDTH)
        for table in self.tables:
            lines += [text for text, _ in table_lines(table, WIDTH)]
        lines += [""] * bool(self.notes)
        return "\n".join([*lines, *(line for note in self.notes for line in wrapped(note, WIDTH))])

    def __repr__(self) -> str:
        return opened(self.table())
