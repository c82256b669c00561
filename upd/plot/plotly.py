"""Chart -> the dictionary plotly draws.

The Python package of plotly is not imported: its figure is plain data.
"""

from __future__ import annotations

import math
import textwrap
from html import escape
from typing import Any

import numpy as np

from upd.plot import plotly_parts as parts
from upd.plot import plotly_places as places
from upd.plot.chart import Array, Axis, Chart
from upd.plot.labels import with_room
from upd.plot.plotly_values import pack
from upd.plot.style import coordinates, is_log, legend_names, log_ticks, log_view, tick_text

__all__ = ["figure", "pack"]

_GRID = "#e6e6e6"
#: part of an axis beyond the data, as plotly leaves it
_AIR = 0.05
#: letters of an upright axis' name that have room
_LETTERS = 42


def figure(chart: Chart) -> dict[str, Any]:
    """Data and layout of a chart, ready for JSON.

    Parameters
    ----------
    chart
        What to draw.

    Returns
    -------
    dict
        ``data`` and ``layout`` of a plotly figure; ``wide``, width over height of the drawing.
    """
    chart = with_room(chart)
    names = {escape(name) for name in legend_names(chart)}
    data = [
        *places.maps(chart),
        *(t for area in chart.areas for t in parts.area(chart, area)),
        *parts.bars(chart),
    ]
    data += [parts.trace(chart, t) for t in chart.traces]
    data += [
        *places.pies(chart),
        *places.scatters(chart),
        *parts.marks(chart),
        *(parts.band_entry(band) for band in chart.bands),
    ]
    told: set[str] = set()
    for trace in data:
        name = trace.get("name", "")
        # Curves of one name, as of the contact faces of one load, have one entry.
        trace["showlegend"] = trace.get("showlegend", True) and name in names - told
        told |= {name} if trace["showlegend"] else set()
    layout: dict[str, Any] = {
        "xaxis": _axis(chart, chart.x, coordinates(chart, "x")),
        "yaxis": _axis(chart, chart.y, coordinates(chart, "y"), _LETTERS),
        "hovermode": "closest",
        "showlegend": bool(names),
    }
    if chart.equal:
        layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1, "constrain": "domain"}
        layout["xaxis"] |= {"constrain": "domain"}
    if chart.bars:
        layout |= {"barmode": "stack"}
        layout["yaxis"] |= parts.cases_axis(chart)
    shapes = [shape for band in chart.bands for shape in parts.band(band)] + places.sectors(chart)
    if shapes:
        layout["shapes"] = shapes
    return {"data": data, "layout": layout, "wide": _wide(chart)}


def _axis(chart: Chart, axis: Axis, values: Array, letters: int = 1000) -> dict[str, Any]:
    """One axis; its name is broken into lines of so many ``letters``."""
    grid = not (chart.maps or chart.bars)
    out: dict[str, Any] = {
        "title": {"text": "<br>".join(escape(line) for line in textwrap.wrap(axis.label, letters))},
        "showgrid": grid,
        "gridcolor": _GRID,
        "zeroline": False,
        "automargin": True,
    }
    log = is_log(axis, values)
    if log:
        out["type"] = "log"
        ticks = log_ticks(log_view(axis, values))
        out |= {"tickmode": "array", "tickvals": ticks, "ticktext": [tick_text(t) for t in ticks]}
    if axis.ticks:
        at = {
            "tickmode": "array",
            "tickvals": [at for at, _ in axis.ticks],
            "ticktext": [escape(text) for _, text in axis.ticks],
        }
        # The last word may reach beyond the axis.
        out |= at | {"ticklabeloverflow": "allow"}
    if axis.low is not None or axis.high is not None:
        out["range"] = _range(axis, values, log)
    return out | {
        "linecolor": "#999999",
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": "#999999",
        "mirror": not grid,
        "showline": True,
    }


def _range(axis: Axis, values: Array, log: bool) -> list[float | None]:
    """Ends of an axis as plotly takes them: logarithms on a logarithmic one.

    Those of the data with their air where none is given, for plotly forgets one that stands alone;
    nothing without data.
    """
    seen = np.log10(values[values > 0.0]) if log else values
    ends: list[float | None] = [
        None if value is None or (log and value <= 0.0) else math.log10(value) if log else value
        for value in (axis.low, axis.high)
    ]
    if seen.size:
        known = [
            end if end is not None else float(f(seen))
            for end, f in zip(ends, (np.min, np.max), strict=True)
        ]
        air = _AIR * (known[1] - known[0])
        ends = [known[0] - air * (ends[0] is None), known[1] + air * (ends[1] is None)]
    return ends


def _wide(chart: Chart) -> float:
    """Width over height of the drawing: maps keep their own shape."""
    placed = [*chart.maps, *chart.scatters]
    if not (chart.equal and placed):
        return 1.5
    x, y = (np.concatenate([np.asarray(getattr(p, name)) for p in placed]) for name in ("x", "y"))
    return float(np.ptp(x) / np.ptp(y)) if np.ptp(y) > 0.0 else 1.5
