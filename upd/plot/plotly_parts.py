"""The parts of a chart as plotly's traces and shapes."""

from __future__ import annotations

from html import escape
from textwrap import wrap
from typing import Any

import numpy as np

from upd.plot.chart import Area, Band, Chart, Mark, Trace
from upd.plot.labels import labelled, sides
from upd.plot.plotly_values import hover, numbers, template, unit
from upd.plot.style import (
    PART_COLOURS,
    area_colour,
    band_colour,
    colour_of,
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
#: pixels of the letters beside a mark
_LETTERS = 11


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
        "x": numbers(t.x),
        "y": numbers(t.y),
        "hovertemplate": hover(chart, name=t.label),
        "line": {"color": colour, "width": 1.4, "dash": _DASH.get(t.style, "solid")},
        "marker": marker,
    }
    if t.closed:
        # The linear limits lie over the curves that follow them.
        out["zorder"] = 1
    # A circle over a map would catch the hover meant for the map.
    return out | ({"hoverinfo": "skip", "hovertemplate": None} if t.outline else {})


def marks(chart: Chart) -> list[dict[str, Any]]:
    """Dots, one trace per colour, with their words at the pointer and, where there is room, above.

    A mark without a place on its axes is left out by plotly itself.
    """
    groups: dict[str, list[tuple[Mark, bool, str]]] = {}
    for mark, told, side in zip(chart.marks, labelled(chart), sides(chart), strict=True):
        groups.setdefault(colour_of(mark), []).append((mark, bool(told), side))
    return [
        {
            "type": "scatter",
            "mode": "markers+text",
            "name": "",
            "showlegend": False,
            "x": numbers([m.x for m, *_ in found]),
            "y": numbers([m.y for m, *_ in found]),
            "customdata": [_lines(m.text) for m, *_ in found],
            "text": [_lines(m.text) if told else "" for m, told, _ in found],
            "textposition": [f"top {side}" for *_, side in found],
            "textfont": {"color": colour, "size": _LETTERS},
            "hovertemplate": hover(chart, value="<br>%{customdata}"),
            "marker": {"color": colour, "size": 6},
            "zorder": 2,
        }
        for colour, found in groups.items()
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
    width = f"<br>{template(a.label) or 'width'}: %{{customdata:.4g}}{unit(chart.y)}"
    lower = {
        "type": "scatter",
        "mode": "lines",
        "x": numbers(a.x),
        "y": numbers(a.low),
        "line": {"width": 0},
        "hoverinfo": "skip",
    }
    upper = {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "legendgroup": name,
        "x": numbers(a.x),
        "y": numbers(a.high),
        "customdata": numbers(np.asarray(a.high) - np.asarray(a.low)),
        "line": {"width": 0, "color": colour},
        "fill": "tonexty",
        "fillcolor": colour if a.state else _pale(colour, 0.22),
        "hovertemplate": f"{hover(chart).partition('<br>')[0]}{width}<extra></extra>",
    }
    return [lower | {"name": "", "showlegend": False}, upper]


def bars(chart: Chart) -> list[dict[str, Any]]:
    """Stacked horizontal bars: one trace per part."""
    labels = list(dict.fromkeys(label for b in chart.bars for label in b.parts))
    out, begin = [], 0
    for b in chart.bars:
        for label, values in b.parts.items():
            told = (
                f"%{{customdata}}<br>{template(label)}: "
                f"%{{x:.4g}}{unit(chart.x)}<br>%{{text}}<extra></extra>"
            )
            out.append(
                {
                    "type": "bar",
                    "orientation": "h",
                    "name": escape(label),
                    "legendgroup": escape(label),
                    "x": numbers(values),
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
