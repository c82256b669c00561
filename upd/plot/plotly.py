"""Chart -> the dictionary plotly draws. The Python package of plotly is not imported: its figure is plain data."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Array, Axis, Chart, Map, Trace

#: colours of curves: dark enough on white, told apart by colour-blind eyes too (Okabe and Ito 2008)
COLOURS = ("#1f5fa8", "#c1561a", "#2a8a68", "#a24b8f", "#6b6b6b", "#b38600", "#3fa0d0", "#8c2d2d")
STATE_COLOURS = ("#f4f4f4", "#f0a35e", "#2b6cb0")
_DASH = {"dashed": "dash", "dotted": "dot"}
_MODE = {"points": "markers", "both": "lines+markers"}
_GRID = "#e6e6e6"
#: up to here a logarithmic axis has marks between its decades
_FEW_DECADES = 3


def figure(chart: Chart) -> dict[str, Any]:
    """Data and layout of a chart, ready for JSON."""
    maps = [t for k, m in enumerate(chart.maps) for t in _map(chart, m, k, _common_top(chart.maps))]
    traces = [_trace(chart, t) for t in chart.traces]
    for k, trace in enumerate(traces):
        # Curves of one name, as of the contact faces of one load, have one entry.
        trace["showlegend"] = all(trace["name"] != earlier["name"] for earlier in traces[:k])
    layout: dict[str, Any] = {
        "xaxis": _axis(chart.x, grid=not chart.maps, values=(t.x for t in chart.traces)),
        "yaxis": _axis(chart.y, grid=not chart.maps, values=(t.y for t in chart.traces)),
        "hovermode": "closest",
        "showlegend": len(chart.traces) > 1 or any(t.outline for t in chart.traces),
    }
    if chart.equal:
        layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1, "constrain": "domain"}
        layout["xaxis"] |= {"constrain": "domain"}
    return {"data": maps + traces, "layout": layout, "wide": _wide(chart)}


def pack(values: NDArray[Any]) -> dict[str, str]:
    """An array as plotly reads it from base64: single precision, or the smallest integers."""
    if values.dtype.kind in "iu":
        kind = "u1" if values.size == 0 or values.max() < 256 else "u2" if values.max() < 65536 else "u4"
        values = values.astype(f"<{kind}")
    else:
        kind, values = "f4", values.astype("<f4")
    out = {"dtype": kind, "bdata": base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")}
    return out | ({"shape": ",".join(map(str, values.shape))} if values.ndim > 1 else {})


def _axis(axis: Axis, *, grid: bool, values: Iterable[Array]) -> dict[str, Any]:
    out: dict[str, Any] = {
        "title": {"text": escape(axis.label)},
        "showgrid": grid,
        "gridcolor": _GRID,
        "zeroline": False,
        "automargin": True,
    }
    if axis.log:
        out |= {"type": "log"} | _log_ticks(np.concatenate([np.zeros(0), *values]))
    return out | {"linecolor": "#999999", "ticks": "outside", "ticklen": 4, "tickcolor": "#999999", "mirror": not grid, "showline": True}


def _log_ticks(values: Array) -> dict[str, Any]:
    """Marks of a logarithmic axis: decades, and 2 and 5 between them where there are few."""
    found = values[np.isfinite(values) & (values > 0.0)]
    if found.size == 0:
        return {}
    low, high = np.floor(np.log10(found.min())), np.ceil(np.log10(found.max()))
    between: tuple[float, ...] = (1.0, 2.0, 5.0) if high - low <= _FEW_DECADES else (1.0,)
    if found.max() < 10.0 * found.min():
        between = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)
    marks = [m * 10.0**k for k in range(int(low), int(high) + 1) for m in between]
    return {"tickmode": "array", "tickvals": marks, "ticktext": [f"{m:.12g}" if 1e-3 <= m < 1e5 else f"{m:.0e}" for m in marks]}


def _unit(axis: Axis) -> str:
    return f" {escape(axis.unit)}" if axis.unit else ""


def _hover(chart: Chart, value: str = "", name: str = "") -> str:
    x, y = (escape(a.name.partition(",")[0]) for a in (chart.x, chart.y))
    return f"{x}: %{{x:.4g}}{_unit(chart.x)}<br>{y}: %{{y:.4g}}{_unit(chart.y)}{value}<extra>{escape(name).replace('%', '&#37;')}</extra>"


def _trace(chart: Chart, t: Trace) -> dict[str, Any]:
    colour = "#222222" if t.outline else COLOURS[t.colour % len(COLOURS)]
    out: dict[str, Any] = {
        "type": "scatter",
        "mode": _MODE.get(t.style, "lines"),
        "name": escape(t.entry or t.label),
        "legendgroup": escape(t.entry or t.label),
        "x": pack(np.asarray(t.x, float)),
        "y": pack(np.asarray(t.y, float)),
        "hovertemplate": _hover(chart, name=t.label),
        "line": {"color": colour, "width": 1.4, "dash": _DASH.get(t.style, "solid")},
        "marker": {"color": colour, "size": 6},
    }
    # A circle over a map would catch the hover meant for the map.
    return out | ({"hoverinfo": "skip", "hovertemplate": None} if t.outline else {})


def _common_top(maps: tuple[Map, ...]) -> float:
    tops = [m.top if m.top is not None else float(np.nanmax(m.z, initial=0.0)) for m in maps]
    return max(tops, default=0.0) or 1.0


def _map(chart: Chart, m: Map, k: int, top: float) -> list[dict[str, Any]]:
    shared: dict[str, Any] = {
        "type": "heatmap",
        "name": "",
        "x": pack(m.x),
        "y": pack(m.y),
        "z": pack(m.z.T),
        "zmin": 0,
        "zmax": top,
        "showlegend": False,
        "showscale": k == 0,
    }
    if m.states:
        return [shared | _states(chart, m)]
    value = f"<br>{escape(m.value.name)}: %{{z:.4g}}{_unit(m.value)}"
    # A horizontal bar under the map leaves a phone its width.
    bar = {"title": {"text": escape(m.value.label), "side": "bottom"}, "orientation": "h", "thickness": 12, "y": -0.24, "yanchor": "top"}
    return [shared | {"colorscale": "Viridis", "colorbar": bar, "hovertemplate": _hover(chart, value), "hoverongaps": False}]


def _states(chart: Chart, m: Map) -> dict[str, Any]:
    n = len(m.states)
    steps = [[(k + end) / n, colour] for k, colour in enumerate(STATE_COLOURS[:n]) for end in (0, 1)]
    bar = {"orientation": "h", "thickness": 12, "y": -0.24, "yanchor": "top", "tickvals": list(range(n)), "ticktext": [*m.states]}
    text = np.array(m.states)[m.z.T.astype(int)].tolist()
    return {
        "zmin": -0.5,
        "zmax": n - 0.5,
        "colorscale": steps,
        "colorbar": bar,
        "xgap": 0.5,
        "ygap": 0.5,
        "text": text,
        "hovertemplate": _hover(chart, "<br>%{text}"),
    }


def _wide(chart: Chart) -> float:
    """Width over height of the drawing: maps keep their own shape."""
    if not (chart.equal and chart.maps):
        return 1.5
    x = np.concatenate([m.x for m in chart.maps])
    y = np.concatenate([m.y for m in chart.maps])
    return float(np.ptp(x) / np.ptp(y)) if np.ptp(y) > 0.0 else 1.5
