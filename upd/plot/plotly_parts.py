"""The parts of a chart as plotly's traces and shapes."""

from __future__ import annotations

import base64
from html import escape
from textwrap import wrap
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Area, Array, Axis, Band, Chart, Map, Mark, Pies, Trace
from upd.plot.labels import labelled
from upd.plot.style import (
    CROSS,
    PART_COLOURS,
    SHARE_COLOURS,
    STATE_COLOURS,
    area_colour,
    band_colour,
    colour_of,
    colour_range,
    even_levels,
    marker_area,
)

_DASH = {"dashed": "dash", "dotted": "dot", "dashdot": "dashdot"}
_MODE = {
    "points": "markers",
    "both": "lines+markers",
    "open points": "markers",
    "crosses": "markers",
    "star": "markers",
}
_MARKER: dict[str, dict[str, Any]] = {
    "open points": {"symbol": "circle-open", "size": 7, "line": {"width": 1.5}},
    "crosses": {"symbol": "x-thin", "size": 7, "line": {"width": 1.5}},
    "star": {"symbol": "star", "size": 15},
}
#: letters of a line beside a bar
_WORDS = 20
#: a horizontal bar under the drawing leaves a phone its width
_BAR: dict[str, Any] = {"orientation": "h", "thickness": 12, "y": -0.24, "yanchor": "top"}
#: pixels of a screen per point of a page
_PIXELS = 4.0 / 3.0


def pack(values: NDArray[Any]) -> dict[str, str]:
    """An array as plotly reads it from base64: single precision, or the smallest integers."""
    if values.dtype.kind in "iu":
        kind = (
            "u1"
            if values.size == 0 or values.max() < 256
            else "u2"
            if values.max() < 65536
            else "u4"
        )
        values = values.astype(f"<{kind}")
    else:
        kind, values = "f4", values.astype("<f4")
    out = {
        "dtype": kind,
        "bdata": base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii"),
    }
    return out | ({"shape": ",".join(map(str, values.shape))} if values.ndim > 1 else {})


def _numbers(values: Any) -> dict[str, str]:
    return pack(np.asarray(values, float))


def _unit(axis: Axis) -> str:
    return f" {_template(axis.unit)}" if axis.unit else ""


def _template(text: str) -> str:
    """Text inside a template, where % and braces have a meaning."""
    return escape(text).replace("%", "&#37;").replace("{", "&#123;")


def _hover(chart: Chart, value: str = "", name: str = "") -> str:
    x, y = (_template(a.name.partition(",")[0]) for a in (chart.x, chart.y))
    first = f"{x}: " + ("%{x}" if chart.x.ticks else f"%{{x:.4g}}{_unit(chart.x)}")
    return f"{first}<br>{y}: %{{y:.4g}}{_unit(chart.y)}{value}<extra>{_template(name)}</extra>"


def trace(chart: Chart, t: Trace) -> dict[str, Any]:
    """One curve."""
    colour, name = colour_of(t), escape(t.entry or t.label)
    marker: dict[str, Any] = {"color": colour, "size": 6} | _MARKER.get(t.style, {})
    if "line" in marker:
        marker["line"] = {"color": colour, **marker["line"]}
    out: dict[str, Any] = {
        "type": "scatter",
        "mode": _MODE.get(t.style, "lines"),
        "name": name,
        "legendgroup": name,
        "x": _numbers(t.x),
        "y": _numbers(t.y),
        "hovertemplate": _hover(chart, name=t.label),
        "line": {"color": colour, "width": 1.4, "dash": _DASH.get(t.style, "solid")},
        "marker": marker,
    }
    if t.closed:
        # The linear limits lie over the curves that follow them.
        out["zorder"] = 1
    # A circle over a map would catch the hover meant for the map.
    return out | ({"hoverinfo": "skip", "hovertemplate": None} if t.outline else {})


def marks(chart: Chart) -> list[dict[str, Any]]:
    """Dots, one trace per colour, with their words at the pointer."""
    groups: dict[str, list[Mark]] = {}
    for mark in chart.marks:
        groups.setdefault(colour_of(mark), []).append(mark)
    return [
        {
            "type": "scatter",
            "mode": "markers",
            "name": "",
            "showlegend": False,
            "x": _numbers([m.x for m in found]),
            "y": _numbers([m.y for m in found]),
            "customdata": [_lines(m.text) for m in found],
            "hovertemplate": _hover(chart, value="<br>%{customdata}"),
            "marker": {"color": colour, "size": 6},
            "zorder": 2,
        }
        for colour, found in groups.items()
    ]


def labels(chart: Chart) -> list[dict[str, Any]]:
    """Every mark with its words, none where it has no label.

    The page places them when it knows its width.
    """
    return [
        {
            "x": float(mark.x),
            "y": float(mark.y),
            "text": _lines(mark.text) if told else "",
            "color": colour_of(mark),
        }
        for mark, told in zip(chart.marks, labelled(chart.marks), strict=True)
        if np.isfinite([mark.x, mark.y]).all()
    ]


def _lines(text: str) -> str:
    return escape(text).replace("\n", "<br>")


def band(b: Band) -> list[dict[str, Any]]:
    """The shapes of a band: dashed lines at its ends, a wide pale line, or a pale span."""
    other = "y" if b.axis == "x" else "x"
    shared: dict[str, Any] = {"xref": "x", "yref": "y", "layer": "below"} | {
        f"{other}ref": "paper",
        f"{other}0": 0,
        f"{other}1": 1,
    }
    colour = band_colour(b)
    ends = list(dict.fromkeys((b.low, b.high)))
    if b.dashed:
        line = {"color": colour, "width": 1.2, "dash": "dash"}
        return [
            shared | {"type": "line", "line": line, f"{b.axis}0": at, f"{b.axis}1": at}
            for at in ends
        ]
    if len(ends) == 1:
        return [
            shared
            | {
                "type": "line",
                "line": {"color": colour, "width": 5},
                "opacity": 0.3,
                f"{b.axis}0": b.low,
                f"{b.axis}1": b.high,
            }
        ]
    return [
        shared
        | {
            "type": "rect",
            "fillcolor": colour,
            "line": {"width": 0},
            "opacity": 0.2,
            f"{b.axis}0": b.low,
            f"{b.axis}1": b.high,
        }
    ]


def band_entry(b: Band) -> dict[str, Any]:
    """The legend entry of a band, which also makes the axis reach to it."""
    at: list[float | None] = [b.low, b.high]
    nowhere: list[float | None] = [None, None]
    line = (
        {"color": band_colour(b), "width": 1.2, "dash": "dash"}
        if b.dashed
        else {"color": _pale(band_colour(b), 0.35), "width": 8}
    )
    return {
        "type": "scatter",
        "mode": "lines",
        "name": escape(b.label),
        "x": at if b.axis == "x" else nowhere,
        "y": nowhere if b.axis == "x" else at,
        "line": line,
        "hoverinfo": "skip",
    }


def _pale(colour: str, alpha: float) -> str:
    return f"rgba({','.join(str(int(colour[k : k + 2], 16)) for k in (1, 3, 5))},{alpha:g})"


def area(chart: Chart, a: Area) -> list[dict[str, Any]]:
    """The lower curve, unseen, and the upper one filled down to it.

    The width is told at the pointer.
    """
    name, colour = escape(a.label), area_colour(a)
    width = f"<br>{_template(a.label) or 'width'}: %{{customdata:.4g}}{_unit(chart.y)}"
    lower = {
        "type": "scatter",
        "mode": "lines",
        "x": _numbers(a.x),
        "y": _numbers(a.low),
        "line": {"width": 0},
        "hoverinfo": "skip",
    }
    upper = {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "legendgroup": name,
        "x": _numbers(a.x),
        "y": _numbers(a.high),
        "customdata": _numbers(np.asarray(a.high) - np.asarray(a.low)),
        "line": {"width": 0, "color": colour},
        "fill": "tonexty",
        "fillcolor": colour if a.state else _pale(colour, 0.22),
        "hovertemplate": f"{_hover(chart).partition('<br>')[0]}{width}<extra></extra>",
    }
    return [lower | {"name": "", "showlegend": False}, upper]


def bars(chart: Chart) -> list[dict[str, Any]]:
    """Stacked horizontal bars: one trace per part."""
    labels = list(dict.fromkeys(label for b in chart.bars for label in b.parts))
    out, begin = [], 0
    for b in chart.bars:
        for label, values in b.parts.items():
            told = (
                f"%{{customdata}}<br>{_template(label)}: "
                f"%{{x:.4g}}{_unit(chart.x)}<br>%{{text}}<extra></extra>"
            )
            out.append(
                {
                    "type": "bar",
                    "orientation": "h",
                    "name": escape(label),
                    "legendgroup": escape(label),
                    "x": _numbers(values),
                    "y": list(range(begin, begin + len(b.cases))),
                    "width": 0.6,
                    "text": [escape(t) for t in b.texts.get(label, ())],
                    "customdata": [escape(case) for case in b.cases],
                    "textposition": "inside",
                    "insidetextanchor": "middle",
                    "textfont": {"color": "#ffffff"},
                    "marker": _bar_look(labels.index(label), hatched=label in b.hatched),
                    "hovertemplate": told,
                }
            )
        begin += len(b.cases)
    return out


def _bar_look(number: int, *, hatched: bool) -> dict[str, Any]:
    """Marker of a part of bars."""
    colour = PART_COLOURS[number % len(PART_COLOURS)]
    if not hatched:
        return {"color": colour}
    pattern = {"shape": "/", "fgcolor": colour, "bgcolor": "#ffffff", "size": 6}
    return {"color": colour, "pattern": pattern, "line": {"color": colour, "width": 1}}


def cases_axis(chart: Chart) -> dict[str, Any]:
    """The upright axis of bars: the cases, the first on top."""
    cases = [
        "<br>".join(wrap(escape(case), _WORDS)) if b.above else escape(case)
        for b in chart.bars
        for case in b.cases
    ]
    return {
        "tickmode": "array",
        "tickvals": list(range(len(cases))),
        "ticktext": cases,
        "range": [len(cases) - 0.5, -0.5],
    }


def pies(chart: Chart) -> list[dict[str, Any]]:
    """Where the pies are: markers that tell the shares.

    The sectors are shapes (`sectors`); every state has an entry.
    """
    out: list[dict[str, Any]] = []
    for p in chart.pies:
        shares = [
            "<br>".join(
                f"{escape(s)}: {100.0 * v:.3g} %" for s, v in zip(p.states, row, strict=True)
            )
            for row in p.shares
        ]
        size = f"<br>{_template(p.what)}: %{{marker.color:.3g}} of the largest" if p.what else ""
        out.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "",
                "showlegend": False,
                "x": _numbers(p.x),
                "y": _numbers(p.y),
                "customdata": shares,
                # Unseen below its sectors; the colour carries the size to the pointer.
                "marker": {"size": _numbers(_diameter(p)), "color": _numbers(p.size), "opacity": 0},
                "hovertemplate": _hover(chart, f"<br>%{{customdata}}{size}"),
            }
        )
        out += [_entry(state) for state in p.states]
    return out


def _entry(state: str) -> dict[str, Any]:
    marker = {"size": 10, "color": SHARE_COLOURS.get(state)}
    return {
        "type": "scatter",
        "mode": "markers",
        "name": escape(state),
        "x": [None],
        "y": [None],
        "marker": marker,
        "hoverinfo": "skip",
    }


def _diameter(p: Pies) -> Array:
    return np.asarray(_PIXELS * np.sqrt(marker_area(p.size)))


def sectors(chart: Chart) -> list[dict[str, Any]]:
    """The sectors of all pies as shapes in pixels about their points, so that they stay round on
    any axes.
    """
    out = []
    for p in chart.pies:
        for x, y, row, diameter in zip(p.x, p.y, p.shares, _diameter(p), strict=True):
            begin = 0.0
            for state, share in zip(p.states, row, strict=True):
                if share > 0.0:
                    place = {
                        "xref": "x",
                        "yref": "y",
                        "xsizemode": "pixel",
                        "ysizemode": "pixel",
                        "xanchor": float(x),
                        "yanchor": float(y),
                    }
                    shape = {
                        "type": "path",
                        "path": _sector(begin, begin + float(share), 0.5 * float(diameter)),
                    }
                    out.append(
                        place
                        | shape
                        | {"fillcolor": SHARE_COLOURS.get(state), "line": {"width": 0}}
                    )
                begin += float(share)
    return out


def _sector(begin: float, end: float, radius: float) -> str:
    """From the top clockwise, about the origin, upwards positive.

    The arcs are cubic curves of at most a quarter each.
    """
    n = max(int(np.ceil(4.0 * (end - begin) - 1e-9)), 1)
    angle = 2.0 * np.pi * (0.25 - np.linspace(begin, end, n + 1))
    # A cubic curve along an arc of the angle t has its handles at 4/3 tan(t/4).
    handle = 4.0 / 3.0 * np.tan((angle[1] - angle[0]) / 4.0)
    rim = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    along = handle * radius * np.column_stack([-np.sin(angle), np.cos(angle)])
    x, y = rim[0]
    path = f"M0,0L{x:.2f},{y:.2f}"
    for k in range(n):
        a, b, c = rim[k] + along[k], rim[k + 1] - along[k + 1], rim[k + 1]
        path += f"C{a[0]:.2f},{a[1]:.2f} {b[0]:.2f},{b[1]:.2f} {c[0]:.2f},{c[1]:.2f}"
    return path + "Z"


def scatters(chart: Chart) -> list[dict[str, Any]]:
    """Coloured points with the colour bar they share."""
    low, high = colour_range(chart.scatters)
    out = []
    for k, s in enumerate(chart.scatters):
        bar = {"title": {"text": escape(s.axis.label), "side": "bottom"}} | _BAR
        marker: dict[str, Any] = {
            "size": _numbers(_PIXELS * np.sqrt(0.7 * marker_area(s.size))),
            "color": _numbers(s.value),
            "colorscale": "Viridis",
            "cmin": low,
            "cmax": high if high > low else low + 1.0,
            "opacity": 1,
            "line": {"color": "#ffffff", "width": 0.5},
            "showscale": k == 0,
        }
        value = f"<br>{_template(s.axis.name)}: %{{marker.color:.4g}}{_unit(s.axis)}"
        shared = {
            "type": "scatter",
            "mode": "markers",
            "name": "",
            "showlegend": False,
            "x": _numbers(s.x),
            "y": _numbers(s.y),
        }
        out.append(
            shared
            | {
                "marker": marker | ({"colorbar": bar} if k == 0 else {}),
                "hovertemplate": _hover(chart, value),
            }
        )
    return out


def maps(chart: Chart) -> list[dict[str, Any]]:
    """Maps with the colour bar they share."""
    low, high = colour_range(chart.maps)
    return [
        t
        for k, m in enumerate(chart.maps)
        for t in (_map(chart, m, k == 0, low, high), *(_points(m) if m.contours else []))
    ]


def _map(chart: Chart, m: Map, bar: bool, low: float, high: float) -> dict[str, Any]:
    shared: dict[str, Any] = {
        "type": "heatmap",
        "name": "",
        "x": _numbers(m.x),
        "y": _numbers(m.y),
        "z": _numbers(m.z.T),
    }
    shared |= {"showlegend": False, "showscale": bar}
    if m.states:
        return shared | _states(chart, m)
    shared |= {
        "zmin": low,
        "zmax": high if high > low else low + 1.0,
        "colorscale": "Viridis",
        "hoverongaps": False,
    }
    # One value everywhere has no scale.
    shared["showscale"] = bar and low < high
    shared["colorbar"] = {"title": {"text": escape(m.value.label), "side": "bottom"}} | _BAR
    shared["hovertemplate"] = _hover(
        chart, f"<br>{_template(m.value.name)}: %{{z:.4g}}{_unit(m.value)}"
    )
    whole = bool(np.isfinite(m.z).all()) and min(m.z.shape) > 1
    if m.contours and whole and low < high:
        levels = even_levels(low, high)
        ends = {
            "start": levels[0],
            "end": levels[-1],
            "size": levels[1] - levels[0],
            "coloring": "fill",
        }
        # The colours of matplotlib's levels: each that of its middle.
        return shared | {
            "type": "contour",
            "zmin": levels[0],
            "zmax": levels[-1],
            "contours": ends,
            "line": {"width": 0, "smoothing": 0},
        }
    return shared | ({"zsmooth": "best"} if m.smooth and whole else {})


def _points(m: Map) -> list[dict[str, Any]]:
    """Dots at the points of a map, crosses where there is no value."""
    x, y = np.meshgrid(m.x, m.y, indexing="ij")
    known = np.isfinite(m.z)
    dot = {
        "symbol": "circle",
        "size": 5,
        "color": "#ffffff",
        "line": {"color": "#333333", "width": 0.7},
    }
    cross = {"symbol": "x-thin", "size": 8, "color": CROSS, "line": {"color": CROSS, "width": 2}}
    shared = {
        "type": "scatter",
        "mode": "markers",
        "name": "",
        "showlegend": False,
        "cliponaxis": False,
    }
    # Over a dot the map tells its value; over a cross there is none.
    out = [
        shared
        | {"x": _numbers(x[known]), "y": _numbers(y[known]), "marker": dot, "hoverinfo": "skip"}
    ]
    if not known.all():
        out.append(
            shared
            | {
                "x": _numbers(x[~known]),
                "y": _numbers(y[~known]),
                "marker": cross,
                "hovertemplate": "no value<extra></extra>",
            }
        )
    return out


def _states(chart: Chart, m: Map) -> dict[str, Any]:
    n = len(m.states)
    colours = [SHARE_COLOURS.get(s, c) for s, c in zip(m.states, STATE_COLOURS, strict=False)]
    known = np.isfinite(m.z.T)
    text = np.where(
        known, np.array(m.states, object)[np.where(known, m.z.T, 0.0).astype(int)], ""
    ).tolist()
    return {
        "zmin": -0.5,
        "zmax": n - 0.5,
        "colorscale": [
            [(k + end) / n, colour] for k, colour in enumerate(colours) for end in (0, 1)
        ],
        "colorbar": _BAR | {"tickvals": list(range(n)), "ticktext": [escape(s) for s in m.states]},
        "xgap": 0.5,
        "ygap": 0.5,
        "hoverongaps": False,
        "text": text,
        "hovertemplate": _hover(chart, "<br>%{text}"),
    }
