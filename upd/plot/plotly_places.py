"""What lies on the plane of a chart as plotly's traces and shapes: pies, coloured points, maps."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np

from upd.plot.chart import Array, Chart, Map, Pies
from upd.plot.plotly_values import hover, numbers, template, unit
from upd.plot.style import (
    CROSS,
    SHARE_COLOURS,
    STATE_COLOURS,
    colour_range,
    even_levels,
    marker_area,
)

#: a horizontal bar under the drawing leaves a phone its width
_BAR: dict[str, Any] = {"orientation": "h", "thickness": 12, "y": -0.24, "yanchor": "top"}
#: pixels of a screen per point of a page
_PIXELS = 4.0 / 3.0


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
        size = f"<br>{template(p.what)}: %{{marker.color:.3g}} of the largest" if p.what else ""
        out.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "",
                "showlegend": False,
                "x": numbers(p.x),
                "y": numbers(p.y),
                "customdata": shares,
                # Unseen below its sectors; the colour carries the size to the pointer.
                "marker": {"size": numbers(_diameter(p)), "color": numbers(p.size), "opacity": 0},
                "hovertemplate": hover(chart, f"<br>%{{customdata}}{size}"),
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
            "size": numbers(_PIXELS * np.sqrt(0.7 * marker_area(s.size))),
            "color": numbers(s.value),
            "colorscale": "Viridis",
            "cmin": low,
            "cmax": high if high > low else low + 1.0,
            "opacity": 1,
            "line": {"color": "#ffffff", "width": 0.5},
            "showscale": k == 0,
        }
        value = f"<br>{template(s.axis.name)}: %{{marker.color:.4g}}{unit(s.axis)}"
        shared = {
            "type": "scatter",
            "mode": "markers",
            "name": "",
            "showlegend": False,
            "x": numbers(s.x),
            "y": numbers(s.y),
        }
        out.append(
            shared
            | {
                "marker": marker | ({"colorbar": bar} if k == 0 else {}),
                "hovertemplate": hover(chart, value),
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
        "x": numbers(m.x),
        "y": numbers(m.y),
        "z": numbers(m.z.T),
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
    shared["hovertemplate"] = hover(
        chart, f"<br>{template(m.value.name)}: %{{z:.4g}}{unit(m.value)}"
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
        | {"x": numbers(x[known]), "y": numbers(y[known]), "marker": dot, "hoverinfo": "skip"}
    ]
    if not known.all():
        out.append(
            shared
            | {
                "x": numbers(x[~known]),
                "y": numbers(y[~known]),
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
        "hovertemplate": hover(chart, "<br>%{text}"),
    }
