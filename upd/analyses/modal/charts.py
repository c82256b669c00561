"""Charts of a rig for the report, from the run folder's content alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.plot.chart import Array, Arrays, Axis, Chart, Entry, Trace, picked
from upd.plot.common import magnitude, response_chart

_HEADLINE = ("f1_free", "f2_free", "f1_glued", "f2_glued", "f1_reduced", "peak_frequency", "peak_accelerance", "half_power_damping")


def headline(rows: list[Entry]) -> list[Entry]:
    """Lowest frequencies, free and glued, the reduction's, and the peak of the response."""
    return picked(rows, _HEADLINE)


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Responses of both blades, and frequencies beside their references."""
    return [*_responses(arrays), *_frequencies(summary)]


def _responses(arrays: Arrays) -> list[Chart]:
    blades: dict[str, dict[str, tuple[Array, Array]]] = {}
    unit = ""
    for name, group in arrays.items():
        if not name.startswith("response ") or "frequency" not in group:
            continue
        for key, variable in group.items():
            if key.startswith("accelerance_"):
                H = magnitude(variable)
                if H.max() > 0.0:
                    curves = blades.setdefault(key.removeprefix("accelerance_"), {})
                    curves[name.removeprefix("response ")] = (np.asarray(group["frequency"].data), H)
                unit = variable.units.replace("m/s2", "m/s²")
    order = sorted(blades, key=lambda blade: blade != "right")
    out = [response_chart("Frequency response", blades[b], unit, "response") for b in order]
    return [Chart(c.title, c.x, c.y, c.traces, case=f"{b} blade", figure=c.figure) for c, b in zip(out, order, strict=True)]


def _frequencies(summary: Mapping[str, Any]) -> list[Chart]:
    """Difference of every frequency from its reference, per case."""
    cases: dict[str, tuple[list[float], list[float]]] = {}
    for row in summary["results"]:
        if row["unit"] == "Hz" and row["error"] is not None:
            f, e = cases.setdefault(f"{row['case']}, against {row['source']}", ([], []))
            f.append(row["value"])
            e.append(100.0 * row["error"])
    traces = tuple(Trace(case, np.array(f), np.array(e), "points", k) for k, (case, (f, e)) in enumerate(cases.items()))
    axes = (Axis("frequency", "Hz"), Axis("difference from the reference", "%"))
    return [Chart("Frequencies against their references", *axes, traces)] if traces else []
