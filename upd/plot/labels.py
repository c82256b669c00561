"""Words beside marks: which marks have them, and room for them."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Array, Chart
from upd.plot.style import coordinates, is_log

#: part of the width of a drawing that the words of a mark cover, and of its height that a line of
#: them takes with its air: "397.4 Hz" in small letters on a phone
_WIDE, _LINE = 0.19, 0.09


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
    return replace(chart, y=replace(chart.y, high=10.0**end if _is_log(chart, "y") else end))


def _heights(chart: Chart) -> Array:
    """Parts of the height that the words of the marks take, (n,)."""
    return np.array([_LINE * (1 + mark.text.count("\n")) for mark in chart.marks])


def _is_log(chart: Chart, name: Literal["x", "y"]) -> bool:
    return is_log(getattr(chart, name), coordinates(chart, name))


def _ends(chart: Chart, name: Literal["x", "y"]) -> tuple[float, float]:
    """Ends of an axis: those it is given, else those of the data; logarithms on such an axis."""
    axis, values, log = getattr(chart, name), coordinates(chart, name), _is_log(chart, name)
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
    if _is_log(chart, name):
        at = np.log10(at, out=np.full(len(at), np.nan), where=at > 0.0)
    return np.asarray((at - low) / (high - low or 1.0))
