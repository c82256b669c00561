"""The error budget of a run: the errors of its main numbers by source, as a table and as bars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from upd.labels import number_label, percent_of
from upd.plot.chart import Axis, Bars, Chart, Entry

#: most numbers of the figure
_MOST = 12


@dataclass(frozen=True)
class BudgetRow:
    """What one source adds to the error of a number, in words and as figures of the page.

    Attributes
    ----------
    number, case
        The number, in words.
    source
        Of the error.
    error
        "0.30 %", or "not found".
    share
        Of the sum of all sources, in per cent; None where that is not known.
    half
        Seconds that half of it adds to the run, in words; "" where they are not predicted.
    basis
        How it was estimated, or why it was not.
    """

    number: str
    case: str
    source: str
    error: str
    share: float | None
    half: str
    basis: str


def budget_rows(entries: Sequence[Entry]) -> list[BudgetRow]:
    """Sources of the numbers' errors, the largest of each number first.

    Parameters
    ----------
    entries
        Numbers as summary.json has them.
    """
    rows = []
    for entry in entries:
        total = entry.get("estimated_error")
        for part in _largest_first(entry):
            error, half = part["error"], part.get("half_cost_s")
            rows.append(
                BudgetRow(
                    number_label(entry["name"]),
                    entry["case"],
                    part["source"],
                    percent_of(error),
                    100.0 * error / total if total and error is not None else None,
                    "" if half is None or not error else f"{half:+.3g} s",
                    part["basis"],
                )
            )
        rows += [
            BudgetRow(
                number_label(entry["name"]),
                entry["case"],
                f"input {part['path']}",
                percent_of(part["share"]),
                None,
                "",
                part["basis"],
            )
            for part in _inputs(entry)
        ]
    return rows


def budget_line(entry: Entry) -> str:
    """The sources of a number's error in one sentence; "" where none was estimated."""
    parts = _largest_first(entry)
    known = _of_inputs(entry)
    if not parts:
        return known
    told = []
    for part in parts:
        half = part.get("half_cost_s")
        costs = half is not None and part["error"]
        cost = f" (half of it: {half:+.3g} s)" if costs else ""
        told.append(f"{part['source']} {percent_of(part['error'])}{cost}")
    error = f"Error of the {number_label(entry['name'])}: {', '.join(told)}"
    return f"{error}. {known}" if known else error


def _of_inputs(entry: Entry) -> str:
    """What the inputs known within limits do to a number, in one sentence."""
    band = entry.get("input_error")
    if band is None:
        return ""
    told = ", ".join(f"{part['path']} {percent_of(part['share'])}" for part in _inputs(entry))
    return f"Inputs known within limits move it by {percent_of(band)}: {told}"


def _inputs(entry: Entry) -> list[Mapping[str, Any]]:
    """What each input does, the largest first, those that were not found before them."""
    parts: list[Mapping[str, Any]] = list(entry.get("input_parts", ()))

    def size(part: Mapping[str, Any]) -> float:
        return float("inf") if part["share"] is None else float(part["share"])

    return sorted(parts, key=size, reverse=True)


def budget_charts(entries: Sequence[Entry]) -> list[Chart]:
    """Bars of the main numbers' errors by source, a colour per source; none without estimates."""
    known = [e for e in entries if e.get("estimated_error") and e.get("error_parts")][:_MOST]
    if not known:
        return []
    sources = list(dict.fromkeys(p["source"] for e in known for p in e["error_parts"]))
    parts = {s: np.array([100.0 * _error(e, s) for e in known]) for s in sources}
    texts = {s: ("",) * len(known) for s in sources}
    cases = tuple(number_label(e["name"]) + (f", {e['case']}" if e["case"] else "") for e in known)
    return [
        Chart(
            "Error budget",
            Axis("estimated bound of the error, sources added", "%", low=0.0),
            Axis(""),
            bars=(Bars(cases, parts, texts, above=True),),
            figure="error_budget",
            columns=1,
            size=(9.0, 1.7 + 0.5 * len(known)),
            note="What each source adds to the errors of the main numbers.",
        )
    ]


def _error(entry: Entry, source: str) -> float:
    return sum(p["error"] or 0.0 for p in entry["error_parts"] if p["source"] == source)


def _largest_first(entry: Entry) -> list[Mapping[str, Any]]:
    """The parts of an error, those that were not found first."""
    parts: list[Mapping[str, Any]] = list(entry.get("error_parts", ()))

    def size(part: Mapping[str, Any]) -> float:
        return float("inf") if part["error"] is None else float(part["error"])

    return sorted(parts, key=size, reverse=True)
