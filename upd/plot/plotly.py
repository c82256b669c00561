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
from upd.plot.chart import Array, Axis, Chart
from upd.plot.labels import with_room
from upd.plot.plotly_parts import pack
from upd.plot.style import coordinates, is_log, legend_names, log_ticks, log_view, tick_text

__all__ = ["figure", "pack"]

_GRID = "#e6e6e6"
#: letters of an upright axis' name that have room, and pixels of a bar with its words
_LETTERS, _ROW = 42, 54


def figure(chart: Chart) -> dict[str, Any]:
    """Data and layout of a chart, ready for JSON.

    Parameters
    ----------
    chart
        What to draw.

    Returns
    -------
    dict
        ``data`` and ``layout`` of a plotly figure; ``wide``, width over height of the drawing, and
        ``least``, pixels that its height has at least.
    """
    chart = with_room(chart)
    names = {escape(name) for name in legend_names(chart)}
    data = list(parts.traces(chart))
    for trace in data:
        # Curves of one name, as of the contact faces of one load, have one entry.
        trace["showlegend"] = trace["name"] in names
        names.discard(trace["name"])
    layout: dict[str, Any] = {
        "xaxis": _axis(chart, chart.x, coordinates(chart, "x")),
        "yaxis": _axis(chart, chart.y, coordinates(chart, "y"), _LETTERS),
        "hovermode": "closest",
        "showlegend": any(trace["showlegend"] for trace in data),
        "shapes": parts.shapes(chart),
    }
    if chart.equal:
        layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1, "constrain": "domain"}
        layout["xaxis"] |= {"constrain": "domain"}
    if chart.bars:
        layout |= {"barmode": "stack"}
        layout["yaxis"] |= parts.cases_axis(chart)
    least = _ROW * sum(len(bars.cases) for bars in chart.bars)
    return {"data": data, "layout": layout, "wide": _wide(chart), "least": least}


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
        out["range"] = [_end(axis.low, log), _end(axis.high, log)]
    return out | {
        "linecolor": "#999999",
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": "#999999",
        "mirror": not grid,
        "showline": True,
    }


def _end(value: float | None, log: bool) -> float | None:
    """The end of an axis as plotly takes it: a logarithm on a logarithmic one; that of the data
    where it is None.
    """
    if value is None or not log:
        return value
    return math.log10(value) if value > 0.0 else None


def _wide(chart: Chart) -> float:
    """Width over height of the drawing: maps keep their own shape."""
    placed = [*chart.maps, *chart.scatters]
    if not (chart.equal and placed):
        return 1.5
    x, y = (np.concatenate([np.asarray(getattr(p, name)) for p in placed]) for name in ("x", "y"))
    return float(np.ptp(x) / np.ptp(y)) if np.ptp(y) > 0.0 else 1.5
