"""The error budget of a run: the errors of its main numbers by source, and beside them what its
inputs known within limits do to them, as a table and as bars.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from upd.labels import percent_of
from upd.plot.chart import Axis, Bars, Chart, Entry
from upd.results import read_part
from upd.results.quantities import number_label

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
        Seconds that half of it adds to the run, or why it is out of reach, in words; "" where they
        are not predicted.
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
            error = part["error"]
            rows.append(
                BudgetRow(
                    number_label(entry["name"]),
                    entry["case"],
                    part["source"],
                    percent_of(error),
                    100.0 * error / total if total and error is not None else None,
                    read_part(part).half_words,
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
    """The sources of a number's error in one sentence, and whether its inputs leave more open; ""
    where nothing was estimated.
    """
    parts = _largest_first(entry)
    name = number_label(entry["name"])
    if not parts:
        alone = _of_inputs(entry, f"the {name}")
        return alone[:1].upper() + alone[1:]
    told = []
    for part in parts:
        half = read_part(part).half_words
        cost = f" (half of it: {half})" if half else ""
        told.append(f"{part['source']} {percent_of(part['error'])}{cost}")
    line = f"Error of the {name}: {', '.join(told)}"
    if entry.get("input_error") is None:
        return line
    # before the inputs' names: a narrow terminal cuts the end
    wasted = "finer levels are money wasted: " * _is_wasted(entry)
    return f"{line}; {wasted}{_of_inputs(entry, 'it')}"


def _is_wasted(entry: Entry) -> bool:
    """Whether a number is known better than its inputs let it be."""
    band, error = entry.get("input_error"), entry.get("estimated_error")
    return band is not None and error is not None and band > error


def _of_inputs(entry: Entry, what: str) -> str:
    """What the inputs known within limits do to a number, in a few words."""
    band = entry.get("input_error")
    if band is None:
        return ""
    told = ", ".join(f"{part['path']} {percent_of(part['share'])}" for part in _inputs(entry))
    return f"inputs known within limits move {what} by {percent_of(band)} ({told})"


def _inputs(entry: Entry) -> list[Mapping[str, Any]]:
    """What each input does, the largest first, those that were not found before them."""
    parts: list[Mapping[str, Any]] = list(entry.get("input_parts", ()))

    def size(part: Mapping[str, Any]) -> float:
        return float("inf") if part["share"] is None else float(part["share"])

    return sorted(parts, key=size, reverse=True)


def budget_charts(entries: Sequence[Entry]) -> list[Chart]:
    """Bars of the main numbers' errors by source, a colour per source, and under each a hatched one
    of what the inputs known within limits do to it; none without either.

    Parts of errors add up. Those of independent inputs add as squares: of their bar, which is as
    long as the band, each has its share of the sum of squares.
    """
    known = [e for e in entries if e.get("estimated_error") or e.get("input_error")][:_MOST]
    rows: list[tuple[str, Mapping[str, float]]] = []
    for entry in known:
        name = number_label(entry["name"]) + (f", {entry['case']}" if entry["case"] else "")
        errors = _errors(entry)
        rows.append((name if errors else f"{name}: error not estimated", errors))
        if entry.get("input_parts"):
            rows.append((_inputs_row(entry), _squares(entry)))
    if not any(mine for _, mine in rows):
        return []
    inputs = list(dict.fromkeys(key for e in known for key in _squares(e)))
    sources = [key for _, mine in rows for key in mine if key not in inputs]
    labels = list(dict.fromkeys([*sources, *inputs]))
    parts = {s: np.array([100.0 * mine.get(s, 0.0) for _, mine in rows]) for s in labels}
    texts = {s: ("",) * len(rows) for s in labels}
    cases = tuple(name for name, _ in rows)
    what = "estimated bound of the error, sources added"
    return [
        Chart(
            "Error budget",
            Axis(f"{what}; hatched: band by the inputs" if inputs else what, "%", low=0.0),
            Axis(""),
            bars=(Bars(cases, parts, texts, above=True, hatched=tuple(inputs)),),
            figure="error_budget",
            columns=1,
            size=(9.0, 1.7 + 0.5 * len(rows)),
            note=_note(known),
        )
    ]


def _note(entries: Sequence[Entry]) -> str:
    """What the bars show, and of how many numbers finer levels are money wasted."""
    says = "What each source adds to the errors of the main numbers."
    if not any(e.get("input_parts") for e in entries):
        return says
    compared = [e for e in entries if e.get("input_error") and e.get("estimated_error")]
    says += " Hatched: how far the inputs known within limits move them."
    if not compared:
        return says
    count = sum(map(_is_wasted, compared))
    return f"{says} Finer levels are money wasted on {count} of {len(compared)} numbers."


def _inputs_row(entry: Entry) -> str:
    """Words over the bar of a number's inputs."""
    band = entry.get("input_error")
    if band is None:
        return "by its inputs: not found for all of them"
    return f"by its inputs: {percent_of(band)}" + "; finer levels are money wasted" * _is_wasted(
        entry
    )


def _squares(entry: Entry) -> Mapping[str, float]:
    """Of a band by independent inputs, each one's share of the sum of squares."""
    band = entry.get("input_error")
    if not band:
        return {}
    out: dict[str, float] = {}
    for part in _inputs(entry):
        out[f"input {part['path']}"] = part["share"] ** 2 / band
    return out


def _errors(entry: Entry) -> Mapping[str, float]:
    """Errors of a number by source; empty where one of them was not found."""
    out: dict[str, float] = {}
    for part in entry.get("error_parts", ()) if entry.get("estimated_error") else ():
        out[part["source"]] = out.get(part["source"], 0.0) + (part["error"] or 0.0)
    return out


def _largest_first(entry: Entry) -> list[Mapping[str, Any]]:
    """The parts of an error, those that were not found first."""
    parts: list[Mapping[str, Any]] = list(entry.get("error_parts", ()))

    def size(part: Mapping[str, Any]) -> float:
        return float("inf") if part["error"] is None else float(part["error"])

    return sorted(parts, key=size, reverse=True)
