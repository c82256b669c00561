"""The answer of a run, the same in the terminal and in `print(result)`.

Verdict, main numbers, checks, cost, files, warnings: the tables of its analysis whole, or at most
40 lines where that gives none.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Protocol

from upd.analyses import analysis_named
from upd.analyses.base import CHOSEN_BY_ACCURACY
from upd.labels import check_number, number, percent, plus_minus, shown, unit_label
from upd.plot.chart import Entry
from upd.report import generic
from upd.report.columns import (
    TextColumn,
    fitted,
    folded_head,
    text_lines,
    text_width,
    whole_table,
)
from upd.report.error_budget import budget_line
from upd.report.notes import MOST_NOTES, short_notes
from upd.results import FAILED, WARNED, Check, Result, warning_details, worst_check
from upd.results.answer_table import AnswerTable
from upd.results.quantities import number_label

#: lines that fit on a screen
LINES = 40
#: warnings told with value and remedy, most lines of another text
_WARNINGS, _TEXT_LINES = 6, 3
#: fewest lines of numbers, whatever warns
_LEAST_NUMBERS = 10
#: fewest rows of a table of several cases
_LEAST_ROWS = 3
#: rows for which a table takes over numbers from the list above it
_FEW_ROWS = 5
_INDENT = "  "
#: heading of numbers that belong to no case
_WHOLE = "whole run"
#: mood of the line above numbers
TITLE = "title"


class Told(Protocol):
    """What an answer is made of; a `RunResult` is one."""

    @property
    def scene(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def status(self) -> str: ...
    @property
    def outcome(self) -> str: ...
    @property
    def results(self) -> tuple[Result, ...]: ...
    @property
    def effects(self) -> tuple[dict[str, Any], ...]: ...
    @property
    def checks(self) -> tuple[Check, ...]: ...
    @property
    def size(self) -> Mapping[str, Any]: ...
    @property
    def cost(self) -> Mapping[str, Any]: ...
    @property
    def folder(self) -> Path | None: ...
    @property
    def faults(self) -> tuple[str, ...]: ...


@dataclass(frozen=True)
class AnswerLine:
    """A line of the answer.

    Attributes
    ----------
    text
        Its words.
    mood
        The outcome it tells, "title" for what stands above numbers, "" otherwise.
    """

    text: str
    mood: str = ""


@dataclass(frozen=True)
class RunAnswer:
    """The answer of a run.

    Attributes
    ----------
    verdict
        How it ended and the number that matters most.
    numbers
        Main numbers.
    end
        Checks, cost, files, and at last what warns.
    has_tables
        Whether the numbers are tables of the analysis.
    """

    verdict: tuple[AnswerLine, ...]
    numbers: tuple[AnswerLine, ...]
    end: tuple[AnswerLine, ...]
    has_tables: bool = False

    @property
    def lines(self) -> tuple[AnswerLine, ...]:
        """All lines in order."""
        return (*self.verdict, *self.numbers, *self.end)


def as_text(result: Told) -> str:
    """The answer as it is printed, for the terminal there is."""
    return "\n".join(line.text for line in answer(result, text_width()).lines)


def answer(result: Told, width: int) -> RunAnswer:
    """The answer of a run in lines of ``width`` characters (paths may be longer)."""
    entries: list[Entry] = [r.as_dict() for r in result.results]
    first = _verdict(result, entries, width)
    tables = answer_tables(result.size, entries)
    if tables:
        numbers = tuple(line for table in tables for line in _whole(table, width))
        return RunAnswer(first, numbers, _end_of_tables(result, entries, width), has_tables=True)
    end = _end(result, width)
    # what warns must not take the place of the numbers
    left = LINES - len(first) - len(end) - 1
    warns = _warnings(result, width, left - _LEAST_NUMBERS)
    room = max(left - len(warns), _LEAST_NUMBERS)
    numbers = tuple(_numbers(result, entries, width, room))
    budget = tuple(map(AnswerLine, _wrapped(_budget(result), width)))
    if len(first) + len(numbers) + len(end) + len(warns) + len(budget) < LINES:
        # below the line between, where there is room; the page has it always
        end = (*end[:1], *budget, *end[1:])
    return RunAnswer(first, numbers, (*end, *warns))


def answer_tables(size: Mapping[str, Any], entries: Sequence[Entry]) -> list[AnswerTable]:
    """The tables that are the answer, as the analysis of a run gives them; none where it gives none
    or they have no rows.

    Parameters
    ----------
    size
        Of the run: it names the analysis.
    entries
        Numbers as summary.json has them.
    """
    analysis = analysis_named(str(size.get("analysis", "")))
    if analysis is None or analysis.answer is None:
        return []
    return [table for table in analysis.answer(entries) if table.rows]


def headline(result: Told, entries: Sequence[Entry]) -> list[Entry]:
    """The numbers an engineer asks for first."""
    analysis = analysis_named(str(result.size.get("analysis", "")))
    return (analysis.headline(entries) if analysis else []) or generic.headline(list(entries))


def _verdict(result: Told, entries: Sequence[Entry], width: int) -> tuple[AnswerLine, ...]:
    """Name, outcome and the number that matters most; why when the run failed."""
    if result.outcome == FAILED:
        told = f"{result.scene}: {result.status}"
    else:
        told = f"{result.scene}: {result.outcome}"
        main = _most_important(result, entries)
        if main is not None:
            told += f" - {number_label(main['name'])} {shown(main)} {plus_minus(main)}".rstrip()
            whole = told + _beside(main)
            told = whole if len(whole) <= width else told
    title = [AnswerLine(result.title)] if result.title and result.title != result.scene else []
    # why a run failed, and the remedy, is all there is to say
    most = LINES - _LEAST_NUMBERS if result.outcome == FAILED else _TEXT_LINES
    return (*(AnswerLine(line, result.outcome) for line in _wrapped(told, width, most)), *title)


def _beside(entry: Entry) -> str:
    """The reference of a number with its source, or the case of one without."""
    if entry["reference"] is None:
        return f" ({entry['case']})" if entry["case"] else ""
    told = f"{entry['source']} {number(entry['reference'])}".strip()
    return f" ({told}, {percent(entry['error'])})" if entry["error"] is not None else f" ({told})"


def _most_important(result: Told, entries: Sequence[Entry]) -> Entry | None:
    """The number of the verdict: the one its analysis names, the first of the main ones else."""
    reached = [entry for entry in entries if not entry.get("withheld")]
    analysis = analysis_named(str(result.size.get("analysis", "")))
    for name in analysis.verdict_names if analysis else ():
        for entry in reached:
            if entry["name"] == name:
                return entry
    return next((e for e in headline(result, entries) if not e.get("withheld")), None)


def _whole(table: AnswerTable, width: int) -> list[AnswerLine]:
    """A table with its heading and its note."""
    lines = [AnswerLine(""), AnswerLine(table.heading, TITLE)]
    lines += map(AnswerLine, whole_table(table, width))
    return [*lines, *map(AnswerLine, _wrapped(table.note, width, None))]


def _end_of_tables(result: Told, entries: Sequence[Entry], width: int) -> tuple[AnswerLine, ...]:
    """Checks, cost, files and the first notes: what warns does not displace a table."""
    good = sum(check.passed for check in result.checks)
    lines = [AnswerLine(""), *map(AnswerLine, _wrapped(_accuracy(result), width))]
    lines.append(AnswerLine(f"Checks: {good} of {len(result.checks)} passed."))
    lines += _cost_and_files(result, width)
    if result.outcome == FAILED:
        return tuple(lines)
    notes = [*result.faults, *short_notes((c.as_dict() for c in result.checks), entries)]
    for note in notes[:MOST_NOTES]:
        lines += (AnswerLine(line, WARNED) for line in _wrapped(f"Warning: {note}", width, None))
    if (left := len(notes) - MOST_NOTES) > 0:
        told = "1 more note is" if left == 1 else f"{left} more notes are"
        where = "on the page" if _page(result) else "told by --full"
        lines.append(AnswerLine(f"{told} {where}.", WARNED))
    return tuple(lines)


def _numbers(
    result: Told, entries: Sequence[Entry], width: int, room: int
) -> tuple[AnswerLine, ...]:
    """The main numbers under their cases, then tables of several cases while there is room."""
    # why a number was not reached stands among the warnings
    main = [entry for entry in headline(result, entries) if not entry.get("withheld")]
    tables = [_tabled(rows, width) for rows in _by_case(entries, _patterns(result))]
    lines = _listed(main, width)
    if tables:
        # Numbers without a reference stand in the first table, where it has room.
        rest = [e for e in main if e["reference"] is not None or not tables[0].holds(e)]
        short = _listed(rest, width)
        least = len(tables[0].heads) + min(len(tables[0].rows), _FEW_ROWS)
        if len(short) + least + 2 <= room:
            lines = short
    lines = [AnswerLine(""), *lines][:room] if lines else []
    for table in tables:
        left = room - len(lines) - len(table.heads) - 1
        if left >= min(len(table.rows), _LEAST_ROWS):
            lines += [AnswerLine(""), *table.lines(left)]
    return tuple(lines)


@dataclass(frozen=True)
class _CaseTable:
    """Numbers of several cases, a column each."""

    heads: tuple[str, ...]
    rows: tuple[str, ...]
    shown: frozenset[tuple[str, str]]

    def holds(self, entry: Entry) -> bool:
        """Whether the number stands in it."""
        return (entry["name"], entry["case"]) in self.shown

    def lines(self, most: int) -> list[AnswerLine]:
        """Heads and at most so many rows; the last says how many more there are."""
        rows = list(self.rows)
        if len(rows) > most:
            rows = [*rows[: most - 1], f"and {len(rows) - most + 1} more"]
        return [*(AnswerLine(head, TITLE) for head in self.heads), *map(AnswerLine, rows)]


def _listed(main: Sequence[Entry], width: int) -> list[AnswerLine]:
    """One number per line beside its reference, under the case it belongs to."""
    if not main:
        return []
    columns = [
        TextColumn("number", tuple(number_label(e["name"]) for e in main)),
        TextColumn("value", tuple(map(shown, main)), right=True),
        TextColumn("error", tuple(map(plus_minus, main)), right=True, rank=1),
        TextColumn("reference", tuple(number(e["reference"]) for e in main), right=True, rank=3),
        TextColumn("difference", tuple(percent(e["error"]) for e in main), right=True, rank=2),
        TextColumn("thesis", tuple(percent(e["thesis_error"]) for e in main), right=True, rank=4),
        TextColumn("source", tuple(e["source"] for e in main), rank=5),
    ]
    heads, rows = text_lines(fitted(columns, width - len(_INDENT))[0])
    lines = [AnswerLine(_INDENT + head, TITLE) for head in heads]
    case = ""
    for entry, row in zip(main, rows, strict=True):
        if entry["case"] != case:
            case = entry["case"]
            lines.append(AnswerLine(case or _WHOLE))
        lines.append(AnswerLine(_INDENT + row))
    return lines


def _patterns(result: Told) -> tuple[str, ...]:
    """Names of the numbers that matter, most important first."""
    analysis = analysis_named(str(result.size.get("analysis", "")))
    return analysis.headline_names if analysis else ()


def _by_case(entries: Sequence[Entry], patterns: Sequence[str]) -> list[list[list[Entry]]]:
    """Tables of the numbers that matter: cases that have the same ones, a row of numbers each."""
    cases: dict[str, dict[str, Entry]] = {}
    for entry in entries:
        if any(fnmatchcase(entry["name"], one) for one in patterns):
            cases.setdefault(entry["case"], {}).setdefault(entry["name"], entry)
    alike: dict[tuple[str, ...], list[list[Entry]]] = {}
    for mine in cases.values():
        order = sorted(mine, key=lambda name: _rank(name, patterns))
        alike.setdefault(tuple(order), []).append([mine[name] for name in order])
    tables = [(names, rows) for names, rows in alike.items() if len(rows) > 1]
    # most columns first: they are the answer, single numbers belong to it
    return [rows for _, rows in sorted(tables, key=lambda table: -len(table[0]))]


def _rank(name: str, patterns: Sequence[str]) -> int:
    return next(k for k, one in enumerate(patterns) if fnmatchcase(name, one))


def _tabled(table: Sequence[Sequence[Entry]], width: int) -> _CaseTable:
    """Rows of the cases, a column per number, as many as fit."""
    columns = [TextColumn("case", tuple(row[0]["case"] for row in table))]
    for k, entry in enumerate(table[0]):
        unit = unit_label(entry["unit"])
        head = number_label(entry["name"]) + (f", {unit}" if unit else "")
        cells = (f"{shown(row[k], unit=False)} {plus_minus(row[k])}".rstrip() for row in table)
        columns.append(TextColumn(folded_head(head), tuple(cells), right=True, rank=k))
    kept, _ = fitted(columns, width)
    heads, rows = text_lines(kept)
    places = [k for k, column in enumerate(columns[1:]) if column in kept]
    found = frozenset((row[k]["name"], row[k]["case"]) for row in table for k in places)
    return _CaseTable(tuple(heads), tuple(rows), found)


def _end(result: Told, width: int) -> tuple[AnswerLine, ...]:
    """Levels that were chosen, checks, cost and files."""
    lines = [AnswerLine(""), *map(AnswerLine, _wrapped(_accuracy(result), width))]
    lines += map(AnswerLine, _wrapped(_checked(result), width, 2))
    return (*lines, *_cost_and_files(result, width))


def _cost_and_files(result: Told, width: int) -> list[AnswerLine]:
    """Seconds and sizes, the run folder, its page."""
    lines = [AnswerLine(line) for line in _wrapped(_cost(result) if result.cost else "", width)]
    if result.folder is not None:
        lines.append(AnswerLine(f"Run folder: {result.folder}"))
    if page := _page(result):
        lines.append(AnswerLine(f"Report: {page}"))
    return lines


def _page(result: Told) -> Path | None:
    """The page of the run, where there is one."""
    page = result.folder / "report.html" if result.folder is not None else None
    return page if page is not None and page.is_file() else None


def _accuracy(result: Told) -> str:
    """What a run that chose its levels raised, what it did not need, and what it spared."""
    mine = (e for e in result.effects if e["name"] in CHOSEN_BY_ACCURACY)
    return next((f"Accuracy reached, {e['why'].partition('; rounds:')[0]}" for e in mine), "")


def _budget(result: Told) -> str:
    """What the error of the first main number is made of that has one; without any, what its inputs
    do to it.
    """
    entries = [r.as_dict() for r in result.results]
    main = _most_important(result, entries)
    mine = [e for e in [main, *headline(result, entries)] if e]
    known = [e for e in mine if plus_minus(e)] or [e for e in mine if e.get("input_error")]
    return next(map(budget_line, known), "")


def _warnings(result: Told, width: int, room: int) -> tuple[AnswerLine, ...]:
    """What warns, each whole with its remedy where it finds room."""
    if result.outcome == FAILED:
        return ()
    told = [*result.faults, *warning_details(result.checks, result.results)]
    texts = [f"Warning: {one}" for one in told[:_WARNINGS]]
    if len(told) > _WARNINGS:
        names = ", ".join(one.partition(":")[0] for one in told[_WARNINGS:])
        texts.append(f"Warnings besides: {names}")
    whole = [len(_wrapped(text, width, len(text))) for text in texts]
    return tuple(
        AnswerLine(line, WARNED)
        for text, most in zip(texts, _shared(whole, room), strict=True)
        for line in _wrapped(text, width, most)
    )


def _shared(wanted: Sequence[int], room: int) -> list[int]:
    """Lines of every text: what it wants, the longest less until all find room, at least one."""
    most = max(wanted, default=1)
    while most > 1 and sum(min(lines, most) for lines in wanted) > room:
        most -= 1
    return [min(lines, most) for lines in wanted]


def _wrapped(text: str, width: int, most: int | None = _TEXT_LINES) -> list[str]:
    """A text on at most so many lines, all it needs where None; the page has the rest."""
    wrapper = textwrap.TextWrapper(
        width,
        subsequent_indent=_INDENT,
        break_on_hyphens=False,
        break_long_words=False,
        max_lines=most,
        placeholder=" ...",
    )
    return wrapper.wrap(text)


def _checked(result: Told) -> str:
    """How many checks passed, and what the effects left out change at most."""
    good = sum(check.passed for check in result.checks)
    told = f"Self-checks: {good} of {len(result.checks)} passed"
    out = [e for e in result.effects if not e["on"] and e.get("applies", True)]
    if not out:
        return told
    again = [c.as_dict() for c in result.checks if c.quantity]
    names = ", ".join(str(e["name"]) for e in out)
    if not again:
        return f"{told}. Left out: {names}"
    worst = worst_check(again)
    value, limit = (check_number(worst, key) for key in ("value", "limit"))
    # What it is worth before what it is: a narrow terminal cuts the end.
    return (
        f"{told}. Left out, worth at most {value} of {number_label(worst['quantity'])} "
        f"(limit {limit}): {names}"
    )


def _cost(result: Told) -> str:
    """Seconds, memory and size."""
    size, cost = result.size, result.cost
    dofs = size.get("n_dof", {})
    parts = [f"{cost['total_s']:.1f} s", f"{cost['peak_rss_mb']:.0f} MB"]
    if dofs:
        parts.append(f"{sum(dofs.values())} dofs")
    if size.get("n_pairs") is not None:
        parts.append(f"{size['n_pairs']} contact pairs")
    return f"Cost: {', '.join(parts)}; all {len(result.results)} numbers: --full"
