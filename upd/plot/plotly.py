"""Chart -> the dictionary plotly draws.

The Python package of plotly is not imported: its figure is plain data.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator
from html import escape
from textwrap import wrap
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from upd.plot import style
from upd.plot.chart import Area, Array, Axis, Band, Chart, Map, Mark, Scatter, Trace

_DASH = {"dashed": "dash", "dotted": "dot", "dashdot": "dashdot"}
_MODE = {"line": "lines", "both": "lines+markers"} | dict.fromkeys(_DASH, "lines")
_MARKER: dict[str, dict[str, Any]] = {
    "open points": {"symbol": "circle-open", "size": 7, "line": {"width": 1.5}},
    "crosses": {"symbol": "x-thin", "size": 7, "line": {"width": 1.5}},
    "star": {"symbol": "star", "size": 15},
}
#: pixels of the letters beside a mark, and of a screen per point of a page
_LETTERS, _PIXELS = 11, 4.0 / 3.0
_GRID = "#e6e6e6"
#: letters of an upright axis' name that have room,
_LINE = 42
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
        ``data`` and ``layout`` of a plotly figure; ``wide``, width over height of the drawing.
    """
    chart = style.with_room(chart)
    names = {escape(name) for name in style.legend_names(chart)}
    data = list(_traces(chart))
    for trace in data:
        # Curves of one name, as of the contact faces of one load, have one entry.
        trace["showlegend"] = trace["name"] in names
        names.discard(trace["name"])
    layout: dict[str, Any] = {
        "xaxis": _axis(chart, "x"),
        "yaxis": _axis(chart, "y", _LINE),
        "hovermode": "closest",
        "showlegend": any(trace["showlegend"] for trace in data),
        "shapes": [shape for band in chart.bands for shape in _band(band)],
    }
    if chart.equal:
        layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1, "constrain": "domain"}
        layout["xaxis"] |= {"constrain": "domain"}
    # maps keep their own shape
    wide = 1.0 / (chart.equal * style.proportion(chart) or 1.0 / _WIDE)
    return {"data": data, "layout": layout, "wide": wide}


def _axis(chart: Chart, which: Literal["x", "y"], letters: int = 1000) -> dict[str, Any]:
    """One axis; its name is broken into lines of so many ``letters``."""
    axis: Axis = getattr(chart, which)
    log, grid = style.is_log(chart, which), not chart.maps
    out: dict[str, Any] = {
        "title": {"text": "<br>".join(escape(line) for line in wrap(axis.label, letters))},
        "showgrid": grid,
        "gridcolor": _GRID,
        "zeroline": False,
        "automargin": True,
    }
    if log:
        out["type"] = "log"
    if axis.ticks:
        at = {
            "tickmode": "array",
            "tickvals": [at for at, _ in axis.ticks],
            "ticktext": [escape(text) for _, text in axis.ticks],
        }
        # The last word may reach beyond the axis.
        out |= at | {"ticklabeloverflow": "allow"}
    if axis.low is not None or axis.high is not None:
        out["range"] = _range(axis, style.coordinates(chart, which), log)
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


def pack(values: NDArray[Any]) -> dict[str, str]:
    """An array as plotly reads it from base64: single precision, integers of two bytes as they are,
    or the smallest integers.
    """
    kind = "i2" if values.dtype == np.int16 else "f4"
    if values.dtype.kind in "iu" and kind == "f4":
        most = values.max(initial=0)
        kind = "u1" if most < 256 else "u2" if most < 65536 else "u4"
    data = np.ascontiguousarray(values.astype(f"<{kind}")).tobytes()
    out = {"dtype": kind, "bdata": base64.b64encode(data).decode("ascii")}
    return out | ({"shape": ",".join(map(str, values.shape))} if values.ndim > 1 else {})


def _numbers(values: Any) -> dict[str, str]:
    return pack(np.asarray(values, float))


def _scatter(x: Any, y: Any, mode: str, **more: Any) -> dict[str, Any]:
    """A trace of points or lines, without a name."""
    out = {"type": "scatter", "mode": mode, "name": "", "x": _numbers(x), "y": _numbers(y)}
    return out | more


def _template(text: str) -> str:
    """Text inside a template, where % and braces have a meaning."""
    return escape(text).replace("%", "&#37;").replace("{", "&#123;")


def _value(axis: Axis, place: str) -> str:
    """A line of the pointer's text: a name with its value and unit."""
    unit = f" {_template(axis.unit)}" if axis.unit else ""
    return f"{_template(axis.name.partition(',')[0])}: %{{{place}:.4g}}{unit}"


def _hover(chart: Chart, *more: str, name: str = "") -> str:
    """Template of the text at the pointer: both style.coordinates, further lines, a name."""
    x = f"{_template(chart.x.name)}: %{{x}}" if chart.x.ticks else _value(chart.x, "x")
    lines = "<br>".join((x, _value(chart.y, "y"), *more))
    return f"{lines}<extra>{_template(name)}</extra>"


def _traces(chart: Chart) -> Iterator[dict[str, Any]]:
    """All of a chart, what lies below first."""
    low, high = style.colour_range(chart.maps)
    for k, m in enumerate(chart.maps):
        yield _map(chart, m, low, high) | {"showscale": k == 0 and (bool(m.states) or low < high)}
    for area in chart.areas:
        yield from _area(chart, area)
    for trace in chart.traces:
        yield _curve(chart, trace)
    for k, points in enumerate(chart.scatters):
        yield _coloured(chart, points, first=k == 0)
    yield from _marks(chart)
    for band in chart.bands:
        yield _band_entry(band)


def _curve(chart: Chart, t: Trace) -> dict[str, Any]:
    colour, name = style.colour_of(t), escape(t.entry or t.label)
    marker: dict[str, Any] = {"color": colour, "size": 6} | _MARKER.get(t.style, {})
    if "line" in marker:
        marker["line"] = {"color": colour, **marker["line"]}
    # A circle over a map would catch the hover meant for the map; closed forms lie over the curves
    # that follow them.
    hover = {"hoverinfo": "skip"} if t.outline else {"hovertemplate": _hover(chart, name=t.label)}
    return _scatter(
        t.x,
        t.y,
        _MODE.get(t.style, "markers"),
        name=name,
        legendgroup=name,
        line={"color": colour, "width": 1.4, "dash": _DASH.get(t.style, "solid")},
        marker=marker,
        zorder=int(t.closed),
        **hover,
    )


def _marks(chart: Chart) -> Iterator[dict[str, Any]]:
    """Dots, one trace per colour, with their words at the pointer and, where there is room, above.

    Plotly itself omits a mark without a place on its axes.
    """
    groups: dict[str, list[tuple[Mark, bool, str]]] = {}
    for mark, shown, side in zip(
        chart.marks, style.labelled(chart), style.sides(chart), strict=True
    ):
        groups.setdefault(style.colour_of(mark), []).append((mark, bool(shown), side))
    for colour, found in groups.items():
        words = [escape(m.text).replace("\n", "<br>") for m, *_ in found]
        yield _scatter(
            [m.x for m, *_ in found],
            [m.y for m, *_ in found],
            "markers+text",
            customdata=words,
            text=[text if shown else "" for text, (_, shown, _) in zip(words, found, strict=True)],
            textposition=[f"top {side}" for *_, side in found],
            textfont={"color": colour, "size": _LETTERS},
            hovertemplate=_hover(chart, "%{customdata}"),
            marker={"color": colour, "size": 6},
            zorder=2,
        )


def _band(b: Band) -> list[dict[str, Any]]:
    """Dashed lines at its ends, a wide pale line, or a pale span."""
    other, colour = "y" if b.axis == "x" else "x", style.colour_of(b)
    shared: dict[str, Any] = {"layer": "below", f"{b.axis}ref": b.axis, f"{other}ref": "paper"}
    shared |= {f"{other}0": 0, f"{other}1": 1}
    if b.low != b.high and not b.dashed:
        look: dict[str, Any] = {"type": "rect", "fillcolor": colour, "line": {"width": 0}}
        return [shared | look | {"opacity": 0.2, f"{b.axis}0": b.low, f"{b.axis}1": b.high}]
    line = {"width": 1.2, "dash": "dash"} if b.dashed else {"width": 5}
    look = {"type": "line", "line": {"color": colour} | line, "opacity": 1.0 if b.dashed else 0.3}
    return [
        shared | look | {f"{b.axis}0": at, f"{b.axis}1": at}
        for at in dict.fromkeys((b.low, b.high))
    ]


def _band_entry(b: Band) -> dict[str, Any]:
    """The legend entry of a band, which also makes the axis reach to it."""
    colour = style.colour_of(b)
    line = {"color": colour, "width": 1.2, "dash": "dash"}
    if not b.dashed:
        line = {"color": _pale(colour, 0.35), "width": 8}
    places = {"x": [None, None], "y": [None, None], b.axis: [b.low, b.high]}
    shared = {"type": "scatter", "mode": "lines", "hoverinfo": "skip"}
    return shared | {"name": escape(b.label), "line": line, **places}


def _pale(colour: str, alpha: float) -> str:
    return f"rgba({','.join(str(int(colour[k : k + 2], 16)) for k in (1, 3, 5))},{alpha:g})"


def _area(chart: Chart, a: Area) -> Iterator[dict[str, Any]]:
    """The lower curve, unseen, and the upper one filled down to it, its width at the pointer."""
    colour, name = style.colour_of(a), escape(a.label)
    width = _value(Axis(a.label or "width", chart.y.unit), "customdata")
    x = _hover(chart).partition("<br>")[0]
    yield _scatter(a.x, a.low, "lines", line={"width": 0}, hoverinfo="skip")
    yield _scatter(
        a.x,
        a.high,
        "lines",
        name=name,
        legendgroup=name,
        customdata=_numbers(np.asarray(a.high) - np.asarray(a.low)),
        line={"width": 0, "color": colour},
        fill="tonexty",
        fillcolor=colour if a.state else _pale(colour, 0.22),
        hovertemplate=f"{x}<br>{width}<extra></extra>",
    )


def _scale(axis: Axis, low: float, high: float) -> dict[str, Any]:
    """Colours of values; a horizontal bar under the drawing leaves a phone its width."""
    title = {"text": escape(axis.label), "side": "bottom"}
    return {
        "colorscale": "Viridis",
        "colorbar": {"orientation": "h", "thickness": 12, "title": title},
        "cmin": low,
        "cmax": high if high > low else low + 1.0,
    }


def _coloured(chart: Chart, s: Scatter, *, first: bool) -> dict[str, Any]:
    """Coloured points; the first of a chart have the colour bar that all share."""
    marker = _scale(s.axis, *style.colour_range(chart.scatters)) | {
        "size": _numbers(_PIXELS * np.sqrt(0.7 * style.marker_area(s.size))),
        "color": _numbers(s.value),
        "opacity": 1,
        "line": {"color": "#ffffff", "width": 0.5},
        "showscale": first,
    }
    if not first:
        del marker["colorbar"]
    template = _hover(chart, _value(s.axis, "marker.color"))
    return _scatter(s.x, s.y, "markers", marker=marker, hovertemplate=template)


def _map(chart: Chart, m: Map, low: float, high: float) -> dict[str, Any]:
    """A cell for every value."""
    out: dict[str, Any] = {"type": "heatmap", "name": "", "hoverongaps": False}
    out |= {"x": _numbers(m.x), "y": _numbers(m.y), "z": _numbers(m.z.T)}
    if m.states:
        n, colours, known = len(m.states), style.state_colours(m), np.isfinite(m.z.T)
        names = np.array([escape(state) for state in m.states], object)
        steps = [[(k + end) / n, colour] for k, colour in enumerate(colours) for end in (0, 1)]
        bar = {"orientation": "h", "thickness": 12, "tickvals": list(range(n))}
        return out | {
            "zmin": -0.5,
            "zmax": n - 0.5,
            "colorscale": steps,
            "colorbar": bar | {"ticktext": names.tolist()},
            "xgap": 0.5,
            "ygap": 0.5,
            "text": np.where(known, names[np.where(known, m.z.T, 0.0).astype(int)], "").tolist(),
            "hovertemplate": _hover(chart, "%{text}"),
        }
    scale = _scale(m.value, low, high)
    out |= {"zmin": scale.pop("cmin"), "zmax": scale.pop("cmax"), **scale}
    out["hovertemplate"] = _hover(chart, _value(m.value, "z"))
    return out
