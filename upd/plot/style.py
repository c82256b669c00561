"""What both backends share, so that a page and a PNG show the same.

Colours, ends of scales, ticks, entries of legends.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Area, Array, Band, Chart, Map, Mark, Scatter, Trace

#: colours of curves: dark enough on white, different to colour-blind eyes too (Okabe and Ito 2008)
COLOURS = ("#1f5fa8", "#c1561a", "#2a8a68", "#a24b8f", "#6b6b6b", "#b38600", "#3fa0d0", "#8c2d2d")
#: of maps of states: open, slip and stick in the order of `upd.plot.chart.STATES`, then others
STATE_COLOURS = ("#f4f4f4", "#f0a35e", "#2b6cb0", "#8cc3a8", "#c9a0bd", "#c0695f")
#: shares of a cycle by state; lift-off is darker than an open point, which lies on white
SHARE_COLOURS = {"stick": "#2b6cb0", "slip": "#f0a35e", "lift-off": "#b9b9b9", "open": "#f4f4f4"}
OUTLINE, CLOSED = "#222222", "#555555"
MEASURED, LIMIT = "#d98200", "#333333"
#: width over height from which the colour bar of a map lies below it
_WIDE_MAP = 1.6
#: area of a marker in square points: of the size 0, and what the size 1 adds. Few points have room
#: for larger ones
_SMALL, _LARGE, _FEW_POINTS = (40.0, 220.0), (110.0, 600.0), 40
#: part of the width of a drawing that the words of a mark cover, and of its height that a line of
#: them takes with its air: "397.4 Hz" in small letters on a phone
_WIDE, _LINE = 0.19, 0.09


def colour_of(part: Trace | Mark | Area | Band) -> str:
    """Colour of a part of a chart: black outlines, grey closed forms, contact states and bands
    without a number (measurements; dashed: limits) their own, else that of its number.
    """
    if isinstance(part, Trace) and part.outline:
        return OUTLINE
    if isinstance(part, (Trace, Mark)) and part.closed:
        return CLOSED
    if isinstance(part, Area) and part.state in SHARE_COLOURS:
        return SHARE_COLOURS[part.state]
    if isinstance(part, Band) and part.colour < 0:
        return LIMIT if part.dashed else MEASURED
    return COLOURS[part.colour % len(COLOURS)]


def state_colours(m: Map) -> list[str]:
    """Colours of the states of a map, in their order."""
    return [SHARE_COLOURS.get(s, c) for s, c in zip(m.states, STATE_COLOURS, strict=False)]


def plain(text: str) -> str:
    """Text matplotlib does not take for mathematics."""
    return text.replace("$", r"\$")


def coordinates(chart: Chart, name: Literal["x", "y"]) -> Array:
    """All finite positions of a chart along one axis, (n,)."""
    parts = [
        getattr(part, name) for kind in (chart.traces, chart.scatters, chart.maps) for part in kind
    ]
    parts += [np.array([getattr(mark, name) for mark in chart.marks])]
    parts += [np.array([band.low, band.high]) for band in chart.bands if band.axis == name]
    parts += [
        a for area in chart.areas for a in ((area.x,) if name == "x" else (area.low, area.high))
    ]
    found = np.concatenate([np.zeros(0), *(np.asarray(part, float).ravel() for part in parts)])
    return np.asarray(found[np.isfinite(found)])


def proportion(chart: Chart) -> float:
    """Height over width of a chart with maps or coloured points; 0 of others."""
    if not (chart.maps or chart.scatters):
        return 0.0
    x, y = np.ptp(coordinates(chart, "x")), np.ptp(coordinates(chart, "y"))
    return float(y / x) if x > 0.0 else 0.0


def is_wide(chart: Chart) -> bool:
    """Whether a chart of one scale along both axes is so wide that its colour bar lies below it."""
    return chart.equal and 0.0 < proportion(chart) < 1.0 / _WIDE_MAP


def is_log(chart: Chart, name: Literal["x", "y"]) -> bool:
    """Whether an axis is drawn logarithmic: not without a positive value."""
    return bool(getattr(chart, name).log and (coordinates(chart, name) > 0.0).any())


def colour_range(parts: Iterable[Map | Scatter]) -> tuple[float, float]:
    """Ends of the colour scale that all maps, or all scattered points, of a chart share.

    They are equal where all is one value.
    """
    lows, highs = [], []
    for part in parts:
        values = np.asarray(part.z if isinstance(part, Map) else part.value, float)
        found = values[np.isfinite(values)]
        low, high = (
            (part.low, part.top) if isinstance(part, Map) else (part.axis.low, part.axis.high)
        )
        if found.size:
            lows.append(float(found.min()) if low is None else low)
            highs.append(float(found.max()) if high is None else high)
    low, high = min(lows, default=0.0), max(highs, default=1.0)
    return (0.0, 1.0) if low == high == 0.0 else (low, max(low, high))


def marker_area(size: Array) -> Array:
    """Area in square points of markers whose ``size`` (n,) goes from 0 to 1."""
    least, more = _LARGE if len(size) <= _FEW_POINTS else _SMALL
    return np.asarray(least + more * np.clip(size, 0.0, 1.0))


def legend_names(chart: Chart) -> list[str]:
    """Entries of the legend, each once.

    None when the title, the case or the axis has the words of the only one already.
    """
    names = [t.entry or t.label for t in chart.traces] + [
        part.label for kind in (chart.areas, chart.bands) for part in kind
    ]
    found = [name for name in dict.fromkeys(names) if name]
    shown = " ".join((chart.title, chart.case, chart.y.name)).casefold()
    return [] if len(found) == 1 and found[0].casefold() in shown else found


# ---------------------------------------------------------------- words beside marks


def labelled(chart: Chart) -> NDArray[np.bool_]:
    """Which marks have words beside them, (n,).

    From the highest down, those whose words have room beside the words of the higher ones; the
    page shows the others at the pointer.
    """
    x, y, tall = _parts(chart, "x"), _parts(chart, "y"), _heights(chart)
    shift = {"right": _WIDE / 2, "center": 0.0, "left": -_WIDE / 2}
    middle = x + [shift[side] for side in sides(chart)]
    out = np.zeros(len(chart.marks), bool)
    for k in sorted(range(len(out)), key=lambda k: -y[k] if np.isfinite(y[k]) else np.inf):
        near = out & (np.abs(middle - middle[k]) < _WIDE) & (np.abs(y - y[k]) < tall[k])
        out[k] = bool(chart.marks[k].text) and 0.0 <= x[k] <= 1.0 and y[k] >= 0.0 and not near.any()
    return out


def sides(chart: Chart) -> list[Literal["left", "center", "right"]]:
    """Where the words of each mark stand above it, (n,): away from the ends of x."""
    x = _parts(chart, "x")
    return ["right" if at < _WIDE / 2 else "left" if at > 1.0 - _WIDE / 2 else "center" for at in x]


def with_room(chart: Chart) -> Chart:
    """The chart with room for words above its highest mark, where the end of y is free."""
    shown = labelled(chart)
    if chart.y.high is not None or not shown.any():
        return chart
    low, high = _ends(chart, "y")
    # where the part of the height above a mark is that of its words
    ends = _parts(chart, "y")[shown] / (1.0 - _heights(chart)[shown])
    end = low + (high - low) * max(1.0, float(ends.max()))
    return replace(chart, y=replace(chart.y, high=10.0**end if is_log(chart, "y") else end))


def _heights(chart: Chart) -> Array:
    """Parts of the height that the words of the marks take, (n,)."""
    return np.array([_LINE * (1 + mark.text.count("\n")) for mark in chart.marks])


def _ends(chart: Chart, name: Literal["x", "y"]) -> tuple[float, float]:
    """Ends of an axis: those it is given, else those of the data; logarithms on such an axis."""
    axis, values, log = getattr(chart, name), coordinates(chart, name), is_log(chart, name)
    values = values[values > 0.0] if log else values
    low = values.min() if axis.low is None else axis.low
    high = values.max() if axis.high is None else axis.high
    return (float(np.log10(low)), float(np.log10(high))) if log else (float(low), float(high))


def _parts(chart: Chart, name: Literal["x", "y"]) -> Array:
    """Places of the marks along an axis, (n,), from 0 to 1 between its ends; nan for none."""
    at = np.array([getattr(mark, name) for mark in chart.marks], float)
    if not at.size:
        return at
    low, high = _ends(chart, name)
    if is_log(chart, name):
        at = np.log10(at, out=np.full(len(at), np.nan), where=at > 0.0)
    return np.asarray((at - low) / (high - low or 1.0))
