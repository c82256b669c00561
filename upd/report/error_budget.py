"""The charts of a run: those of its analysis, and the error budget of its main numbers as bars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from upd.analyses import analysis_named
from upd.labels import number_label, percent_of
from upd.plot.chart import Arrays, Axis, Bars, Chart, Entry
from upd.report.tables import inputs_exceed, main_numbers

#: most numbers of the figure
_MOST = 12
_INPUT = "input "


def run_charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """All charts of a run, the most important first.

    Parameters
    ----------
    arrays
        As in result.nc.
    summary
        As in summary.json, with the tables of the scene file under "scene_file".
    """
    main = main_numbers(summary["size"], summary["results"])
    return [*analysis_charts(arrays, summary), *budget_charts(main)]


def analysis_charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """The charts of a run that its analysis knows; none of an unknown one."""
    analysis = analysis_named(str(summary["size"].get("analysis", "")))
    return analysis.charts(arrays, summary) if analysis else []


def budget_charts(entries: Sequence[Entry]) -> list[Chart]:
    """Bars of the main numbers' errors by source, a colour per source, and under each a hatched one
    of what the inputs known within limits do to it; none without either.

    Parts of errors add up. Those of independent inputs add as squares: of their bar, which is as
    long as the band, each has its share of the sum of squares.
    """
    rows: list[tuple[str, Mapping[str, float]]] = []
    known = [e for e in entries if e.get("estimated_error") or e.get("input_error")]
    for entry in known[:_MOST]:
        name = number_label(entry["name"]) + (f", {entry['case']}" if entry["case"] else "")
        errors: dict[str, float] = {}
        for part in entry.get("error_parts", ()) if entry.get("estimated_error") else ():
            errors[part["source"]] = errors.get(part["source"], 0.0) + (part["error"] or 0.0)
        rows.append((name if errors else f"{name}: error not estimated", errors))
        if inputs := entry.get("input_parts"):
            band = entry.get("input_error")
            squares = {f"{_INPUT}{p['path']}": p["share"] ** 2 / band for p in inputs if band}
            more = ", more than its error" * inputs_exceed(entry)
            rows.append((f"by its inputs: {percent_of(band)}{more}", squares))
    labels = dict.fromkeys(key for _, mine in rows for key in mine)
    hatched = tuple(label for label in labels if label.startswith(_INPUT))
    labels = dict.fromkeys([*(key for key in labels if key not in hatched), *hatched])
    if not labels:
        return []
    parts = {
        label: np.array([100.0 * mine.get(label, 0.0) for _, mine in rows]) for label in labels
    }
    texts = {label: ("",) * len(rows) for label in labels}
    cases = tuple(name for name, _ in rows)
    return [
        Chart(
            "Error budget",
            Axis("error bound, sources added", "%", low=0.0),
            Axis(""),
            bars=(Bars(cases, parts, texts, above=True, hatched=hatched),),
            figure="error_budget",
            columns=1,
            size=(9.0, 1.7 + 0.5 * len(rows)),
            note="Sources of the errors of the main numbers."
            + " Hatched: how far the inputs known within limits move them. Where that is more, "
            "finer levels do not make a number better known." * bool(hatched),
        )
    ]
