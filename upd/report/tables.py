"""The numbers, errors, effects and checks of summary.json as tables, what warns as sentences, and
its charts: the terminal, the page and the notebook draw the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

from upd import labels
from upd.analyses import analysis_named
from upd.analyses.base import Effect
from upd.errors import InputError
from upd.plot.answer_table import AnswerTable
from upd.plot.chart import Chart, Entry
from upd.results import Arrays, ErrorPart
from upd.results.check import worst_check, worst_checks
from upd.results.number import from_json
from upd.results.quantities import CLOSED_FORM_ERROR, number_label, number_title
from upd.results.sampled import SampledNumber, sample_sentence

#: numbers of a run whose analysis is not known
_MOST = 8
#: cases that a table of several cases shows
_CASES = 8
#: heading of numbers that belong to no case
_WHOLE = "whole run"
#: notes beside an answer; what matters less is folded, or counted
MOST_NOTES = 3


def filled(heading: str, columns: Mapping[str, Sequence[str]], note: str = "") -> AnswerTable:
    """A table of ``columns`` (head -> cells) without those that are empty in every row."""
    kept = {head: cells for head, cells in columns.items() if any(cells)}
    return AnswerTable(heading, tuple(kept), tuple(zip(*kept.values(), strict=True)), note)


def main_numbers(size: Mapping[str, Any], entries: Sequence[Entry]) -> list[Entry]:
    """The numbers an engineer asks for first; of an unknown analysis, those with a reference.

    Parameters
    ----------
    size
        Of the run: it names the analysis.
    entries
        Numbers as summary.json has them.
    """
    analysis = analysis_named(str(size.get("analysis", "")))
    found = analysis.headline(entries) if analysis else []
    return found or sorted(entries, key=lambda entry: entry["reference"] is None)[:_MOST]


def answer_tables(size: Mapping[str, Any], entries: Sequence[Entry]) -> list[AnswerTable]:
    """The tables that are the answer: those of the analysis of a run, else its main numbers and,
    where several cases have the same numbers, a row for each of them.

    Parameters
    ----------
    size
        Of the run: it names the analysis.
    entries
        Numbers as summary.json has them.
    """
    analysis = analysis_named(str(size.get("analysis", "")))
    own = analysis.answer(entries) if analysis and analysis.answer else []
    if any(table.rows for table in own):
        return [table for table in own if table.rows]
    main = [entry for entry in main_numbers(size, entries) if not entry.get("withheld")]
    order = [entry["value"] for entry in entries if entry["name"] == CLOSED_FORM_ERROR.name]
    names = {entry["name"] for entry in main}
    note = _not_estimated(entry for entry in entries if entry["name"] in names)
    if order:
        exact = labels.percent_of(max(order) / 100)
        note = f"The closed forms are exact to the order (a/R)² = {exact}. {note}".rstrip()
    cases = _case_tables(entries, analysis.headline_names if analysis else ())
    return [
        table for table in (number_table("Main numbers", main, note=note), *cases) if table.rows
    ]


def _not_estimated(entries: Iterable[Entry]) -> str:
    """Why numbers have no estimate of their error."""
    reasons: dict[str, list[str]] = {}
    for entry in entries:
        lost = [p["basis"] for p in entry.get("error_parts", ()) if p["error"] is None]
        for basis in lost[:1]:
            why = basis.removeprefix("not estimated: ").rstrip(".")
            reasons.setdefault(why, []).append(number_label(entry["name"]))
    without = (f"{labels.listed(names, None)} without ±: {why}." for why, names in reasons.items())
    return " ".join(without)


def number_table(
    heading: str, entries: Iterable[Entry], case: str = "", note: str = ""
) -> AnswerTable:
    """A row for every number; above those of another case than ``case``, a row with its label."""
    rows: list[tuple[str, Entry | None]] = []
    for entry in entries:
        if entry["case"] != case:
            case = entry["case"]
            rows.append((case or _WHOLE, None))
        rows.append((number_label(entry["name"]), entry))

    def column(text: Callable[[Entry], str]) -> list[str]:
        return ["" if entry is None else text(entry) for _, entry in rows]

    return filled(
        heading,
        {
            "number": [name for name, _ in rows],
            "# value": column(labels.shown),
            "# ±": column(lambda e: labels.plus_minus(e).lstrip("±")),
            "# reference": column(lambda e: labels.number(e["reference"])),
            "# difference": column(lambda e: labels.percent(e.get("error"))),
            "# thesis": column(lambda e: labels.percent(e.get("thesis_error"))),
            "source": column(lambda e: e.get("source", "")),
        },
        note,
    )


def all_numbers(entries: Sequence[Entry]) -> list[AnswerTable]:
    """All numbers, a table for every case."""
    return [
        number_table(case or _WHOLE, [e for e in entries if e["case"] == case], case)
        for case in dict.fromkeys(entry["case"] for entry in entries)
    ]


def _case_tables(entries: Sequence[Entry], patterns: Sequence[str]) -> list[AnswerTable]:
    """A table for all cases that have the same of the numbers that matter; most numbers first."""
    cases: dict[str, dict[str, Entry]] = {}
    for one in patterns:
        for entry in entries:
            if fnmatchcase(entry["name"], one):
                cases.setdefault(entry["case"], {}).setdefault(entry["name"], entry)
    alike: dict[tuple[str, ...], list[list[Entry]]] = {}
    for mine in cases.values():
        alike.setdefault(tuple(mine), []).append(list(mine.values()))
    several = [rows for rows in alike.values() if len(rows) > 1]
    return [_case_table(rows) for rows in sorted(several, key=lambda rows: -len(rows[0]))]


def _case_table(cases: Sequence[Sequence[Entry]]) -> AnswerTable:
    """A row for each of the first cases, a column for every number."""
    kept = cases[: _CASES - (len(cases) > _CASES)]
    more = len(cases) - len(kept)
    columns = {"case": [row[0]["case"] for row in kept]}
    for k, one in enumerate(cases[0]):
        columns[f"# {with_unit(number_label(one['name']), one['unit'])}"] = [
            f"{labels.shown(row[k], unit=False)} {labels.plus_minus(row[k])}".rstrip()
            for row in kept
        ]
    return filled("By case", columns, f"{more} more cases: see all numbers." if more else "")


def effects_table(effects: Sequence[Mapping[str, Any]]) -> AnswerTable:
    """What was simulated and what was not, with the checks of it."""
    columns = {
        "effect": [str(e["name"]) for e in effects],
        "simulated": [from_json(Effect, e).word for e in effects],
        "why": [str(e["why"]) for e in effects],
        "check": [str(e.get("verdict") or "").partition(":")[0] for e in effects],
    }
    return filled("What was simulated", columns)


def checks_table(checks: Sequence[Mapping[str, Any]]) -> AnswerTable:
    """The worst case of every self-check."""
    worst = worst_checks(checks)
    columns = {
        "self-check": [f"{c['name']}: {c['says']}" for c in worst],
        "worst case": [c["case"] for c in worst],
        "# value": [labels.check_number(c, "value") for c in worst],
        "# limit": [labels.check_number(c, "limit") for c in worst],
        "verdict": [c["verdict"] for c in worst],
    }
    return filled("Self-checks", columns)


def error_parts(entry: Entry) -> list[tuple[str, float | None, str, str]]:
    """Sources of a number's error and its uncertain inputs, each with those not found first and
    then the largest: name, error, seconds that half of it costs, how it was estimated.
    """
    errors = [
        (part["source"], part["error"], from_json(ErrorPart, part).half_words, part["basis"])
        for part in entry.get("error_parts", ())
    ]
    inputs = [
        (f"input {part['path']}", part["share"], "", part["basis"])
        for part in entry.get("input_parts", ())
    ]
    return [
        part
        for parts in (errors, inputs)
        for part in sorted(parts, key=lambda part: (part[1] is not None, -(part[1] or 0.0)))
    ]


def budget_table(entries: Sequence[Entry]) -> AnswerTable:
    """Sources of the errors of numbers, and what the inputs known within limits do to them."""
    rows = [(entry, *part) for entry in entries for part in error_parts(entry)]
    columns = {
        "number": [number_label(entry["name"]) for entry, *_ in rows],
        "case": [entry["case"] for entry, *_ in rows],
        "source": [source for _, source, *_ in rows],
        "# error": [labels.percent_of(error) for _, _, error, *_ in rows],
        "# half of it costs": [half for *_, half, _ in rows],
        "how it was estimated": [basis for *_, basis in rows],
    }
    note = (
        "The errors of all sources are added: their signs are not known. Independent inputs add as "
        "squares. Half of it costs: seconds that the run would take longer."
    )
    return filled("Error budget", columns, note)


def stage_table(seconds: Mapping[str, float]) -> AnswerTable:
    """Seconds of every stage, and their share."""
    total = sum(seconds.values()) or 1.0
    columns = {
        "stage": list(seconds),
        "# seconds": [f"{s:.2f}" for s in seconds.values()],
        "# share": [f"{100.0 * s / total:.0f} %" for s in seconds.values()],
    }
    return filled("Cost", columns)


def with_unit(title: str, unit: str) -> str:
    """A title with the unit of its numbers."""
    return f"{title}, {labels.unit_label(unit)}" if unit else title


def sample_table(numbers: Sequence[SampledNumber]) -> AnswerTable:
    """Every number with its first-order band and the sampled one."""

    def band(*values: float | None) -> str:
        return " to ".join(f"±{labels.percent_of(value)}" for value in values if value is not None)

    def ends(*values: float | None) -> str:
        return " to ".join(labels.number(value) for value in values if value is not None)

    middle = "middle 95 %" if all(n.resolved for n in numbers) else "least to largest"
    columns = {
        "number": [with_unit(number_title(n.name, n.case), n.unit) for n in numbers],
        "# as given": [labels.number(n.nominal) for n in numbers],
        "# first order": [band(n.first_order) for n in numbers],
        "# sample": [band(n.band) for n in numbers],
        "# 95 % interval of the sample's band": [band(n.band_low, n.band_high) for n in numbers],
        f"# {middle}": [ends(n.low, n.high) for n in numbers],
        "# points": [str(n.count) for n in numbers],
        "compared": [n.verdict for n in numbers],
    }
    note = sample_sentence(numbers) + " sample.csv has all digits, means and deviations."
    return filled("Bands by the inputs, to first order and sampled", columns, note)


# ---------------------------------------------------------------- sentences


def warnings(
    checks: Iterable[Mapping[str, Any]], results: Iterable[Entry], most: int | None = None
) -> list[str]:
    """The sentences: a check in its worst case, which is named first.

    Parameters
    ----------
    checks, results
        As they stand in summary.json.
    most
        Cases and numbers that are named in each; all of them when None.
    """
    out, failed = [], [check for check in checks if check["verdict"] != "passed"]
    for name in dict.fromkeys(check["name"] for check in failed):
        mine = [check for check in failed if check["name"] == name]
        worst = worst_check(mine)
        cases = labels.listed([worst["case"], *(c["case"] for c in mine)], most, " ({})")
        remedy = f". {labels.sentence(worst['remedy'], '')}" if worst.get("remedy") else ""
        out.append(labels.sentence(f"{name}{cases}: {labels.check_words(worst)}{remedy}"))
    lost = [entry for entry in results if entry.get("withheld")]
    for reason in dict.fromkeys(entry["withheld"] for entry in lost):
        numbers = [entry for entry in lost if entry["withheld"] == reason]
        names = labels.listed([number_label(entry["name"]) for entry in numbers], most)
        cases = labels.listed([entry["case"] for entry in numbers], most, " ({})")
        out.append(labels.sentence(f"{names}{cases}: not reached, {reason}"))
    return out


# ---------------------------------------------------------------- charts


def analysis_charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """The charts of a run that its analysis knows; none of an unknown one.

    Raises InputError where another version of upd wrote other arrays.
    """
    analysis = analysis_named(str(summary["size"].get("analysis", "")))
    if analysis is None:
        return []
    try:
        return analysis.charts(arrays, summary)
    except (IndexError, KeyError) as error:
        raise InputError(
            f"run of {summary['scene']}: its arrays are not those that this version of upd draws "
            f"({error}); to fix it: run the scene in its folder again, upd run RUN/scene.toml"
        ) from error
