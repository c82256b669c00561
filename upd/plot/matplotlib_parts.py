"""The parts of a chart as matplotlib artists."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PathCollection
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.path import Path as Outline
from matplotlib.transforms import IdentityTransform, ScaledTranslation

from upd.plot.chart import Area, Axis, Band, Chart, Map, Mark, Pies, Trace
from upd.plot.style import (
    CROSS,
    SHARE_COLOURS,
    area_colour,
    band_colour,
    colour_of,
    colour_range,
    even_levels,
    is_wide,
    labelled,
    legend_names,
    marker_area,
    plain,
    sector,
    sides,
    state_colours,
)

_STYLE: dict[str, dict[str, Any]] = {
    "line": {"ls": "-"},
    "dashed": {"ls": "--"},
    "dotted": {"ls": ":"},
    "dashdot": {"ls": "-."},
    "points": {"ls": "", "marker": "o", "ms": 4},
    "both": {"ls": "-", "marker": "o", "ms": 4},
    "open points": {"ls": "", "marker": "o", "ms": 4.5, "mfc": "white"},
    "crosses": {"ls": "", "marker": "x", "ms": 5},
    "star": {"ls": "", "marker": "*", "ms": 13},
}
#: points of the letters of a legend and of the words beside a mark, of what stands before an entry
#: of a legend, and rows of it at most
_SMALL, _HANDLE, _ROWS = 7.0, 32.0, 6
#: inches from the axes to their legend: room for the numbers and words of the axis
_BELOW = 0.42
#: cells of a map of states along one side that have lines between them
_FEW_CELLS = 32
#: room below and above pies, as a part of their height
_AROUND_PIES = 0.25


def draw_trace(t: Trace, ax: Axes) -> None:
    """One curve."""
    # The linear limits lie over the curves that follow them, and leave their edges to be seen.
    lw, zorder = (1.0, 3.0) if t.closed else (1.3, 2.0)
    ax.plot(
        t.x,
        t.y,
        color=colour_of(t),
        lw=lw,
        label=plain(t.entry or t.label) or None,
        zorder=zorder,
        **_STYLE[t.style],
    )


def draw_marks(marks: Sequence[Mark], ax: Axes) -> None:
    """A dot at every mark; their words come last (`draw_labels`)."""
    for mark in marks:
        ax.plot(mark.x, mark.y, "o", ms=3.5, color=colour_of(mark), zorder=4)


def draw_band(band: Band, ax: Axes) -> None:
    """What lies between two values of one axis, or a line at one."""
    line, span = (ax.axvline, ax.axvspan) if band.axis == "x" else (ax.axhline, ax.axhspan)
    style: dict[str, Any] = {"color": band_colour(band), "label": plain(band.label) or None}
    if band.dashed:
        for k, at in enumerate(dict.fromkeys((band.low, band.high))):
            line(at, ls="--", lw=1.0, zorder=1.5, **style | ({"label": None} if k else {}))
    elif band.low == band.high:
        # Wide and pale: a measured value is no curve.
        line(band.low, lw=4.0, alpha=0.3, zorder=0.5, **style)
    else:
        span(band.low, band.high, alpha=0.2, lw=0.0, zorder=0.5, **style)


def draw_area(area: Area, ax: Axes) -> None:
    """What lies between two curves; states are opaque, for they are stacked."""
    style: dict[str, Any] = (
        {"alpha": 1.0, "zorder": 1.0} if area.state else {"alpha": 0.22, "zorder": 0.8}
    )
    ax.fill_between(
        area.x,
        area.low,
        area.high,
        color=area_colour(area),
        lw=0.0,
        label=plain(area.label) or None,
        **style,
    )


def draw_pies(pies: Pies, ax: Axes) -> None:
    """Sectors drawn as markers, so that they stay round on any axes."""
    area = marker_area(pies.size)
    end = np.cumsum(pies.shares, axis=1)
    for k, state in enumerate(pies.states):
        on = np.flatnonzero(pies.shares[:, k] > 0.0)
        if on.size:
            sectors = [Outline(sector(end[p, k] - pies.shares[p, k], end[p, k])) for p in on]
            places = np.column_stack([pies.x, pies.y])[on]
            drawn = PathCollection(
                sectors,
                area[on],
                offsets=places,
                offset_transform=ax.transData,
                fc=SHARE_COLOURS.get(state),
                lw=0.0,
            )
            # Sizes in points, whatever the axes.
            drawn.set_transform(IdentityTransform())
            drawn.set(zorder=2.5, gid=state)
            ax.add_collection(drawn, autolim=False)
    tall = float(np.ptp(pies.y)) or 1.0
    # Invisible corners of what the axes show: room for the pies themselves.
    ax.update_datalim(
        [
            (pies.x.min(), pies.y.min() - _AROUND_PIES * tall),
            (pies.x.max(), pies.y.max() + _AROUND_PIES * tall),
        ]
    )
    ax.margins(0.12, 0.0)
    ax.autoscale_view()


def draw_scatters(chart: Chart, ax: Axes) -> None:
    """Coloured points with the colour bar they share."""
    low, high = colour_range(chart.scatters)
    for k, s in enumerate(chart.scatters):
        area = 0.7 * marker_area(s.size)
        drawn = ax.scatter(
            s.x,
            s.y,
            area,
            s.value,
            cmap="viridis",
            vmin=low,
            vmax=high,
            zorder=2.5,
            edgecolors="white",
            linewidths=0.4,
        )
        if k == 0:
            _bar(drawn, chart, s.axis, ax)
    if chart.scatters:
        ax.margins(0.08)


def draw_maps(chart: Chart, ax: Axes) -> None:
    """Maps with the colour bar they share."""
    low, high = colour_range(chart.maps)
    for k, m in enumerate(chart.maps):
        drawn = _states(m, ax) if m.states else _field(m, low, high, ax)
        if m.contours:
            _points(m, ax)
        # Axes for a colour bar cost as much as the map: states of a compact map stand in the
        # legend. One value everywhere has no scale.
        if k == 0 and (is_wide(chart) if m.states else low < high):
            bar = _bar(drawn, chart, m.value, ax, extend=_extend(chart.maps, low, high))
            if m.states:
                bar.set_ticks(list(range(len(m.states))), labels=[plain(s) for s in m.states])


def _states(m: Map, ax: Axes) -> Any:
    n = len(m.states)
    colours = ListedColormap(state_colours(m))
    # Between many cells the lines would take more room than the cells.
    edges: dict[str, Any] = {"edgecolors": "w", "lw": 0.2} if max(m.z.shape) <= _FEW_CELLS else {}
    return ax.pcolormesh(
        m.x, m.y, m.z.T, cmap=colours, vmin=-0.5, vmax=n - 0.5, shading="nearest", **edges
    )


def _field(m: Map, low: float, high: float, ax: Axes) -> ScalarMappable:
    whole = bool(np.isfinite(m.z).all())
    drawn: Any
    if m.contours and whole and low < high and min(m.z.shape) > 1:
        drawn = ax.contourf(m.x, m.y, m.z.T, levels=even_levels(low, high), cmap="viridis")
    else:
        # Shading between points needs all of them.
        shading: Any = "gouraud" if m.smooth and whole and min(m.z.shape) > 1 else "nearest"
        drawn = ax.pcolormesh(
            m.x,
            m.y,
            np.ma.masked_invalid(m.z.T),
            cmap="viridis",
            vmin=low,
            vmax=high,
            shading=shading,
        )
    return drawn  # type: ignore[no-any-return]


def _points(m: Map, ax: Axes) -> None:
    """Dots at the points of a map, crosses where there is no value."""
    x, y = np.meshgrid(m.x, m.y, indexing="ij")
    known = np.isfinite(m.z)
    ax.plot(x[known], y[known], "o", color="white", mec="#333333", mew=0.5, ms=3, clip_on=False)
    if not known.all():
        # without points matplotlib's layout makes room for one in the corner of the sheet
        ax.plot(x[~known], y[~known], "x", color=CROSS, ms=6, clip_on=False)


def _extend(maps: Sequence[Map], low: float, high: float) -> str:
    """Where values go on beyond the ends of the scale."""
    below = any(bool((m.z < low).any()) for m in maps if not m.states)
    above = any(bool((m.z > high).any()) for m in maps if not m.states)
    return ("neither", "min", "max", "both")[below + 2 * above]


def _bar(drawn: Any, chart: Chart, axis: Axis, ax: Axes, extend: str = "neither") -> Any:
    """Colour bar: beside the axes, below those of a wide drawing."""
    place: dict[str, Any] = {"shrink": 0.85}
    if is_wide(chart):
        place |= {"location": "bottom", "aspect": 40.0}
    # Contours have their own ends.
    if not hasattr(drawn, "levels"):
        place["extend"] = extend
    bar: Any = ax.figure.colorbar(drawn, ax=ax, **place)
    bar.set_label(plain(axis.label) if axis.name != "state" else "")
    bar.formatter.set_useOffset(False)
    return bar


def draw_legend(chart: Chart, ax: Axes) -> None:
    """Below the axes: an entry per name in the order of the names, and the states of maps."""
    drawn, labels = ax.get_legend_handles_labels()
    handles: dict[str, Any] = {
        name: drawn[labels.index(plain(name))]
        for name in legend_names(chart)
        if plain(name) in labels
    }
    for state in (state for pies in chart.pies for state in pies.states):
        handles[state] = Line2D([], [], marker="o", ls="", color=SHARE_COLOURS.get(state))
    for m in () if is_wide(chart) else chart.maps:
        for state, colour in zip(m.states, state_colours(m), strict=False):
            handles[state] = Patch(facecolor=colour, edgecolor="#999999", lw=0.4)
    if not handles:
        return
    figure = ax.figure.get_figure(root=True)
    assert figure is not None
    wide = 72.0 * figure.get_figwidth() * ax.get_position(original=True).width
    columns = max(int(wide / (0.55 * _SMALL * max(map(len, handles)) + _HANDLE)), 1)
    shown = dict(list(handles.items())[: _ROWS * columns - 1])
    if more := len(handles) - len(shown):
        shown |= {f"and {more} more": Line2D([], [], ls="")} if more > 1 else handles
    what = [p.what for p in chart.pies if p.what]
    ax.legend(
        list(shown.values()),
        [plain(name) for name in shown],
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        # below the axis' own words, however high the axes are
        bbox_transform=ax.transAxes + ScaledTranslation(0.0, -_BELOW, figure.dpi_scale_trans),
        ncols=min(columns, len(shown)),
        frameon=False,
        fontsize=_SMALL,
        title=plain(f"sector: share of the cycle, size: {what[0]}") if what else None,
        title_fontsize=_SMALL,
    )


def draw_labels(chart: Chart, ax: Axes) -> None:
    """Words above the marks that have room for them."""
    align = {"right": "left", "center": "center", "left": "right"}
    for mark, shown, side in zip(chart.marks, labelled(chart), sides(chart), strict=True):
        if shown:
            ax.annotate(
                plain(mark.text),
                (mark.x, mark.y),
                (0.0, 3.0),
                textcoords="offset points",
                ha=align[side],
                va="bottom",
                fontsize=_SMALL,
                color=colour_of(mark),
                bbox={"fc": "white", "ec": "none", "alpha": 0.7, "pad": 0.5},
            )
