"""Answers as text: of a run in the terminal, with verdict, tables, checks, cost, files and what
warns; of one figure and a few tables. `print` shows the first lines.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Self

from upd.analyses import analysis_named
from upd.analyses.base import CHOSEN_BY_ACCURACY
from upd.cache.files import whole_files
from upd.cache.sources import versions
from upd.errors import InputError, one_line
from upd.labels import check_number, number, percent, percent_of, plus_minus, shown
from upd.plot.answer_table import AnswerTable
from upd.plot.chart import Chart, Entry
from upd.report import tables
from upd.report.columns import SHORT, whole_table, wrapped
from upd.report.page import Section, page_text, versions_text
from upd.results.check import FAILED, WARNED, outcome_of, worst_check
from upd.results.quantities import number_label, quantity_of
from upd.scene import AnyScene
from upd.scene.keys import scene_as_run

#: lines that fit on a screen
LINES = 40
#: characters of a line of an answer of one figure: a terminal of 80 columns shows it whole
WIDTH = 79
#: mood of the line above numbers
TITLE = "title"
#: a line, and its mood: the outcome it reports, "title" for what stands above numbers, "" otherwise
AnswerLine = tuple[str, str]


def answer(
    summary: Mapping[str, Any],
    width: int,
    folder: Path | None = None,
    faults: Sequence[str] = (),
    *,
    full: bool = False,
) -> list[AnswerLine]:
    """The answer of a run in lines of ``width`` characters (paths may be longer).

    Parameters
    ----------
    summary
        As in summary.json.
    folder, faults
        Where the files of the run are, and what went wrong with its pictures.
    full
        With all numbers, effects, checks, sources of errors, sizes and stages.
    """
    size, entries = summary["size"], summary["results"]
    lines, end = _verdict(summary, width), _end(summary, width, folder, faults, full=full)
    analysis = analysis_named(str(size.get("analysis", "")))
    own = analysis is not None and analysis.answer is not None
    found = tables.answer_tables(size, entries) if own or not full else []
    for table in found:
        block = table_lines(table, width, cut=not own)
        # the tables of an analysis are whole; of others those that fit on a screen
        if own or table is found[0] or len(lines) + len(block) + len(end) < LINES:
            lines += block
    if full:
        for table in (
            *tables.all_numbers(entries),
            tables.budget_table(tables.main_numbers(size, entries)),
            tables.effects_table(summary["effects"]),
            tables.checks_table(summary["checks"]),
            tables.stage_table(summary["cost"].get("stages", {})),
        ):
            lines += table_lines(table, width)
    return lines + end


def opened(text: str) -> str:
    """What `print` shows of an answer: its first lines, and what shows all of it."""
    lines = text.splitlines()
    return "\n".join(lines if len(lines) <= SHORT else [*lines[: SHORT - 1], "... .table()"])


def table_lines(table: AnswerTable, width: int, *, cut: bool = False) -> list[AnswerLine]:
    """A table with its heading and its note; where it may be ``cut``, without the last columns that
    find no room.
    """
    if not table.rows:
        return []
    lines = [("", ""), *[(table.heading, TITLE)] * bool(table.heading)]
    lines += [(line, "") for line in whole_table(table, width, cut=cut)]
    return lines + _wrapped(table.note, width)


def _verdict(summary: Mapping[str, Any], width: int) -> list[AnswerLine]:
    """Name, outcome and the number that matters most with its reference, or the case of one
    without; why when the run failed.
    """
    outcome = outcome_of(summary["status"])
    text = f"{summary['scene']}: {summary['status'] if outcome == FAILED else outcome}"
    main = None if outcome == FAILED else _most_important(summary)
    if main is not None:
        text += f" - {number_label(main['name'])} {shown(main)} {plus_minus(main)}".rstrip()
        beside = [main["case"]]
        if main["reference"] is not None:
            reference = f"{main['source']} {number(main['reference'])}".strip()
            beside = [reference, percent(main["error"])]
        whole = f"{text} ({', '.join(filter(None, beside))})" if any(beside) else text
        text = whole if len(whole) <= width else text
    title = summary["title"] if summary["title"] != summary["scene"] else ""
    return [*_wrapped(text, width, outcome), *_wrapped(title, width)]


def _most_important(summary: Mapping[str, Any]) -> Entry | None:
    """The number of the verdict: the one its analysis names, the first of the main ones else."""
    size, entries = summary["size"], summary["results"]
    analysis = analysis_named(str(size.get("analysis", "")))
    names = analysis.verdict_names if analysis else ()
    named = (entry for name in names for entry in entries if entry["name"] == name)
    found = (*named, *tables.main_numbers(size, entries))
    return next((entry for entry in found if not entry.get("withheld")), None)


def _end(
    summary: Mapping[str, Any],
    width: int,
    folder: Path | None,
    faults: Sequence[str],
    *,
    full: bool,
) -> list[AnswerLine]:
    """Chosen levels, sources of the main error, checks, cost and files; at last what warns."""
    lines = [("", "")]
    # what a run that chose its levels raised, what it did not need, and what it spared
    mine = (e for e in summary["effects"] if e["name"] in CHOSEN_BY_ACCURACY)
    reached = [f"Accuracy reached, {e['why'].partition('; rounds:')[0]}" for e in mine][:1]
    for text in (*reached, _budget(summary), checked(summary), _cost(summary)):
        lines += _wrapped(text, width)
    has_page = folder is not None and (folder / "report.html").is_file()
    if folder is not None:
        lines.append((f"Run folder: {folder}", ""))
        lines += [(f"Report: {folder / 'report.html'}", "")] * has_page
    if outcome_of(summary["status"]) == FAILED:
        return lines
    named = None if full else 2
    notes = [*faults, *tables.warnings(summary["checks"], summary["results"], named)]
    most = len(notes) if full else tables.MOST_NOTES
    for note in notes[:most]:
        lines += _wrapped(f"Warning: {note}", width, WARNED)
    if (more := len(notes) - most) > 0:
        where = "on the page" if has_page else "printed by --full"
        lines.append((f"Warnings besides: {more}, {where}.", WARNED))
    return lines


def _budget(summary: Mapping[str, Any]) -> str:
    """The sources of the error of the first main number that has some."""
    main = [_most_important(summary), *tables.main_numbers(summary["size"], summary["results"])]
    for entry in filter(None, main):
        error, band = entry.get("estimated_error"), entry.get("input_error")
        if error is not None or band is not None:
            parts = (f"{name} {percent_of(part)}" for name, part, *_ in tables.error_parts(entry))
            more = error is not None and band is not None and band > error
            useless = "; its inputs move it by more: finer levels do not help" * more
            return f"Error of the {number_label(entry['name'])}: {', '.join(parts)}{useless}"
    return ""


def checked(summary: Mapping[str, Any]) -> str:
    """How many checks passed, and the largest change by an effect left out."""
    checks, effects = summary["checks"], summary["effects"]
    good = sum(check["verdict"] == "passed" for check in checks)
    text = f"Self-checks: {good} of {len(checks)} passed" if checks else "No self-checks"
    names = [str(e["name"]) for e in effects if not e["on"] and e.get("applies", True)]
    solved = [check for check in checks if check.get("quantity")]
    if not names:
        return text
    if not solved:
        return f"{text}. Left out: {', '.join(names)}"
    worst = worst_check(solved)
    value, limit = (check_number(worst, key) for key in ("value", "limit"))
    of, whole = number_label(worst["quantity"]), quantity_of(worst["quantity"])[0].part_of
    what = f"the {whole}, for {of}" if whole else of
    return f"{text}. Left out, worth at most {value} of {what} (limit {limit}): {', '.join(names)}"


def _cost(summary: Mapping[str, Any]) -> str:
    """Seconds, memory and size, and what shows all numbers."""
    size, cost = summary["size"], summary["cost"]
    parts = [f"{cost['total_s']:.1f} s", f"{cost['peak_rss_mb']:.0f} MB"] if cost else []
    if dofs := sum(size.get("n_dof", {}).values()):
        parts.append(f"{dofs} dofs")
    if size.get("n_pairs") is not None:
        parts.append(f"{size['n_pairs']} contact pairs")
    return f"Cost: {', '.join(parts)}; all {len(summary['results'])} numbers: --full"


def _wrapped(text: str, width: int, mood: str = "") -> list[AnswerLine]:
    """A text on as many lines as it needs."""
    return [(line, mood) for line in wrapped(text, width)]


# -- answers of one figure and a few tables: their text, their page and their folder --------------


@dataclass(frozen=True, repr=False)
class FigureAnswer(ABC):
    """A verdict, a few tables and notes, and one figure.

    Attributes
    ----------
    figure : str
        Name of the figure, without ending.
    source : AnyScene
        The scene that the question was about.
    folder : Path, optional
        Where its files lie; None when nothing was written.
    """

    figure: ClassVar[str]

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
