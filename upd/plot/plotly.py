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
from upd.plot.style import (
    coordinates,
    is_log,
    legend_names,
    log_ticks,
    log_view,
    proportion,
    tick_text,
)

__all__ = ["figure", "pack"]

_GRID = "#e6e6e6"
#: letters of an upright axis' name that have room, and pixels of a bar with its words
_LETTERS, _ROW = 42, 54
#: width over height of a chart
_WIDE = 1.5
#: part of an axis beyond the data, as plotly leaves it
_AIR = 0.05


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
    # maps keep their own shape
    wide = 1.0 / (chart.equal * proportion(chart) or 1.0 / _WIDE)
    least = _ROW * sum(len(bars.cases) for bars in chart.bars)
    return {"data": data, "layout": layout, "wide": wide, "least": least}


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


def _range(axis: Axis, values: Array, log: bool) -> list[float]:
    """Ends of an axis as plotly takes them: logarithms on a logarithmic one.

    Those of the data with some air where none is given, for plotly does not keep one that is alone.
    """
    seen = np.log10(values[values > 0.0]) if log else values
    given = [
        None if end is None or (log and end <= 0.0) else math.log10(end) if log else end
        for end in (axis.low, axis.high)
    ]
    data = (float(seen.min()), float(seen.max())) if seen.size else (0.0, 1.0)
    low, high = (d if end is None else end for end, d in zip(given, data, strict=True))
    air = _AIR * (high - low)
    return [low - air * (given[0] is None), high + air * (given[1] is None)]
