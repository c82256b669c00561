"""Charts drawn by matplotlib.

On axes, on the PNG sheets of a run folder, and as pictures for pages read without script.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, ScalarFormatter
from matplotlib.transforms import ScaledTranslation

from upd.cache.files import whole_file
from upd.plot import style
from upd.plot.chart import MOST_PANELS, Area, Axis, Band, Chart, Trace

Drawing = Callable[[Axes], Any]

#: inches of one drawing, dots per inch
_SIZE, _DPI = (5.6, 4.4), 130
#: the same of a page's pictures
_PAGE_DPI = 110


def draw_sheet(
    drawings: Sequence[Drawing],
    columns: int,
    size: tuple[float, float] = _SIZE,
    dpi: int = _DPI,
) -> Figure:
    """A figure of ``dpi`` dots per inch with each of ``drawings`` on axes of ``size`` inches,
    ``columns`` side by side.
    """
    columns = min(columns, len(drawings))
    rows = -(-len(drawings) // columns)
    figure = Figure(figsize=(size[0] * columns, size[1] * rows), dpi=dpi, layout="constrained")
    FigureCanvasAgg(figure)
    for k, draw in enumerate(drawings):
        ax = figure.add_subplot(rows, columns, k + 1)
        draw(ax)
        for axis in (ax.xaxis, ax.yaxis):
            # Ticks with words stay all.
            if isinstance(locator := axis.get_major_locator(), MaxNLocator):
                locator.set_params(nbins=6)
    return figure


def write_png(figure: Figure, path: Path) -> list[Path]:
    """Write a figure as PNG, whole or not at all; returns its path."""
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png")
    return [path]


#: points of the letters of titles and ticks, and mean width of a letter as a part of them
_LETTERS, _WIDE = 9.0, 0.56
#: largest over smallest value up to which an axis has ticks between its decades
_FEW_DECADES = 1e3
#: inches a title may reach over its axes on both sides together
_OVER = 0.45
#: inches beside, and above and below, a wide map on its panel: labels, title and colour bar
_BESIDE, _ABOVE = 1.05, 2.0


def draw(chart: Chart, ax: Axes) -> Axes:
    """Draw a chart on matplotlib axes; returns them."""
    chart = style.with_room(chart)
    ax.tick_params(labelsize=_LETTERS)
    if not chart.maps:
        ax.grid(visible=True, which="major", color="#dddddd", lw=0.6)
        ax.set_axisbelow(True)
    _draw_maps(chart, ax)
    for area in chart.areas:
        _draw_area(area, ax)
    for band in chart.bands:
        _draw_band(band, ax)
    for trace in chart.traces:
        _draw_trace(trace, ax)
    _draw_scatters(chart, ax)
    _axis(chart, chart.x, "x", ax)
    _axis(chart, chart.y, "y", ax)
    for mark in chart.marks:
        ax.plot(mark.x, mark.y, "o", ms=3.5, color=style.colour_of(mark), zorder=4)
    if chart.equal:
        ax.set_aspect("equal")
    _draw_legend(chart, ax)
    _titles(chart, ax)
    _draw_labels(chart, ax)
    return ax


def draw_all(charts: Sequence[Chart]) -> list[Axes]:
    """Charts side by side in a figure of pyplot, two a row; returns their axes."""
    import matplotlib.pyplot as plt

    columns = min(2, len(charts))
    rows = -(-len(charts) // columns)
    sheet = plt.figure(figsize=(6.4 * columns, 4.2 * rows), layout="constrained")
    return [draw(chart, sheet.add_subplot(rows, columns, k + 1)) for k, chart in enumerate(charts)]


def chart_png(charts: Sequence[Chart]) -> bytes:
    """A sheet of ``charts`` as PNG for a page, at most `MOST_PANELS`."""
    out = io.BytesIO()
    _sheet(charts, _PAGE_DPI).savefig(out, format="png")
    return out.getvalue()


def write_sheets(charts: Iterable[Chart], folder: Path, *, keep: bool = False) -> list[Path]:
    """Write the charts of every figure (`Chart.figure`) as ``<figure>.png`` into ``folder``, whole
    or not at all.

    Parameters
    ----------
    charts
        Those of a figure that belong to its sheet (`Chart.sheet`) are drawn, at most
        `MOST_PANELS`, with the columns and the size of the first.
    keep
        Leave files that are there already as they are.

    Returns
    -------
    list of Path
        The files written.
    """
    sheets: dict[Path, list[Chart]] = {}
    for chart in charts:
        if chart.figure and chart.sheet:
            sheets.setdefault(folder / f"{chart.figure}.png", []).append(chart)
    missing = [path for path in sheets if not (keep and path.exists())]
    return [made for path in missing for made in write_png(_sheet(sheets[path], _DPI), path)]


def _sheet(charts: Sequence[Chart], dpi: int) -> Figure:
    first = charts[0]
    wide, tall = first.size
    if all(style.is_wide(chart) for chart in charts):
        # Wide maps leave no empty place above each other.
        tall = min(
            tall, max(style.proportion(chart) for chart in charts) * (wide - _BESIDE) + _ABOVE
        )
    drawings = [partial(draw, chart) for chart in charts[:MOST_PANELS]]
    return draw_sheet(drawings, first.columns, (wide, tall), dpi)


def _axis(chart: Chart, axis: Axis, name: Literal["x", "y"], ax: Axes) -> None:
    """Scale, ticks and ends of one axis."""
    which = ax.xaxis if name == "x" else ax.yaxis
    values = style.coordinates(chart, name)
    limits = getattr(ax, f"set_{name}lim")
    if style.is_log(chart, name):
        getattr(ax, f"set_{name}scale")("log", nonpositive="mask")
        seen = values[values > 0.0]
        few = seen.max() < _FEW_DECADES * seen.min()
        which.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
        which.set_major_formatter("{x:g}")
        which.set_minor_formatter(NullFormatter())
        ax.grid(visible=True, which="minor", axis=name, color="#eeeeee", lw=0.4)
    elif isinstance(which.get_major_formatter(), ScalarFormatter):
        # Numbers as they are, without an offset in a corner.
        ax.ticklabel_format(axis=name, useOffset=False)
    if name == "x" and any(area.state for area in chart.areas):
        ax.margins(x=0.0)
    if axis.ticks:
        which.set_ticks(
            [at for at, _ in axis.ticks], labels=[style.plain(text) for _, text in axis.ticks]
        )
    if axis.low is not None or axis.high is not None:
        # matplotlib would take the free end from the view of this moment: let it be that of all
        # data.
        ax.autoscale_view()
        limits(axis.low, axis.high)


def _titles(chart: Chart, ax: Axes) -> None:
    """Title and names of the axes, in lines that their place holds."""
    figure, box = ax.figure.get_figure(root=True), ax.get_position(original=True)
    assert figure is not None
    across = int(72.0 * (figure.get_figwidth() * box.width + _OVER) / (_WIDE * _LETTERS))
    upwards = int(72.0 * (figure.get_figheight() * box.height + _OVER) / (_WIDE * _LETTERS))
    ax.set_xlabel(_lines(chart.x.label, across), fontsize=_LETTERS)
    ax.set_ylabel(_lines(chart.y.label, upwards), fontsize=_LETTERS)
    words = chart.title, ", ".join(filter(None, (chart.case, chart.detail)))
    title, case = (text.replace("muN", "µN") for text in words)
    whole = f"{title}: {case}" if case else title
    own_lines = case and across < len(whole) and max(len(title), len(case)) <= across
    text = f"{title}\n{case}" if own_lines else whole
    # Its height given, matplotlib does not look for one: that costs a quarter of all drawing.
    ax.set_title(style.plain(text) if own_lines else _lines(text, across), fontsize=_LETTERS, y=1.0)


def _lines(text: str, letters: int) -> str:
    """A text on at most two lines of so many letters; what does not fit is cut."""
    lines = textwrap.wrap(text, max(letters, 12), max_lines=2, placeholder=" …")
    return style.plain("\n".join(lines))


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


def _draw_trace(t: Trace, ax: Axes) -> None:
    """One curve."""
    # The linear limits lie over the curves that follow them, and leave their edges to be seen.
    lw, zorder = (1.0, 3.0) if t.closed else (1.3, 2.0)
    ax.plot(
        t.x,
        t.y,
        color=style.colour_of(t),
        lw=lw,
        label=style.plain(t.entry or t.label) or None,
        zorder=zorder,
        **_STYLE[t.style],
    )


def _draw_band(band: Band, ax: Axes) -> None:
    """What lies between two values of one axis, or a line at one."""
    line, span = (ax.axvline, ax.axvspan) if band.axis == "x" else (ax.axhline, ax.axhspan)
    look: dict[str, Any] = {
        "color": style.colour_of(band),
        "label": style.plain(band.label) or None,
    }
    if band.dashed:
        for k, at in enumerate(dict.fromkeys((band.low, band.high))):
            line(at, ls="--", lw=1.0, zorder=1.5, **look | ({"label": None} if k else {}))
    elif band.low == band.high:
        # Wide and pale: a measured value is no curve.
        line(band.low, lw=4.0, alpha=0.3, zorder=0.5, **look)
    else:
        span(band.low, band.high, alpha=0.2, lw=0.0, zorder=0.5, **look)


def _draw_area(area: Area, ax: Axes) -> None:
    """What lies between two curves; states are opaque, for they are stacked."""
    look: dict[str, Any] = (
        {"alpha": 1.0, "zorder": 1.0} if area.state else {"alpha": 0.22, "zorder": 0.8}
    )
    ax.fill_between(
        area.x,
        area.low,
        area.high,
        color=style.colour_of(area),
        lw=0.0,
        label=style.plain(area.label) or None,
        **look,
    )


def _draw_scatters(chart: Chart, ax: Axes) -> None:
    """Coloured points with the colour bar they share."""
    low, high = style.colour_range(chart.scatters)
    for k, s in enumerate(chart.scatters):
        area = 0.7 * style.marker_area(s.size)
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


def _draw_maps(chart: Chart, ax: Axes) -> None:
    """Maps, a cell for every value, with the colour bar they share."""
    low, high = style.colour_range(chart.maps)
    for k, m in enumerate(chart.maps):
        look: dict[str, Any] = {"cmap": "viridis", "vmin": low, "vmax": high}
        if m.states:
            ends = {"vmin": -0.5, "vmax": len(m.states) - 0.5}
            look = {"cmap": ListedColormap(style.state_colours(m))} | ends
            if max(m.z.shape) <= _FEW_CELLS:
                # Between many cells the lines would take more room than the cells.
                look |= {"edgecolors": "w", "lw": 0.2}
        z = np.ma.masked_invalid(m.z.T)
        drawn = ax.pcolormesh(m.x, m.y, z, shading="nearest", **look)
        # Axes for a colour bar cost as much as the map: states of a compact map stand in the
        # legend. One value everywhere has no scale.
        if k == 0 and (style.is_wide(chart) if m.states else low < high):
            bar = _bar(drawn, chart, m.value, ax)
            if m.states:
                bar.set_ticks(list(range(len(m.states))), labels=[style.plain(s) for s in m.states])


def _bar(drawn: Any, chart: Chart, axis: Axis, ax: Axes) -> Any:
    """Colour bar: beside the axes, below those of a wide drawing."""
    place: dict[str, Any] = {"shrink": 0.85}
    if style.is_wide(chart):
        place |= {"location": "bottom", "aspect": 40.0}
    bar: Any = ax.figure.colorbar(drawn, ax=ax, **place)
    bar.set_label(style.plain(axis.label) if axis.name != "state" else "")
    bar.formatter.set_useOffset(False)
    return bar


def _draw_legend(chart: Chart, ax: Axes) -> None:
    """Below the axes: an entry per name in the order of the names, and the states of maps."""
    drawn, labels = ax.get_legend_handles_labels()
    handles: dict[str, Any] = {
        name: drawn[labels.index(style.plain(name))]
        for name in style.legend_names(chart)
        if style.plain(name) in labels
    }
    for m in () if style.is_wide(chart) else chart.maps:
        for state, colour in zip(m.states, style.state_colours(m), strict=False):
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
    ax.legend(
        list(shown.values()),
        [style.plain(name) for name in shown],
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        # below the axis' own words, however high the axes are
        bbox_transform=ax.transAxes + ScaledTranslation(0.0, -_BELOW, figure.dpi_scale_trans),
        ncols=min(columns, len(shown)),
        frameon=False,
        fontsize=_SMALL,
    )


def _draw_labels(chart: Chart, ax: Axes) -> None:
    """Words above the marks that have room for them."""
    align = {"right": "left", "center": "center", "left": "right"}
    for mark, shown, side in zip(
        chart.marks, style.labelled(chart), style.sides(chart), strict=True
    ):
        if shown:
            ax.annotate(
                style.plain(mark.text),
                (mark.x, mark.y),
                (0.0, 3.0),
                textcoords="offset points",
                ha=align[side],
                va="bottom",
                fontsize=_SMALL,
                color=style.colour_of(mark),
                bbox={"fc": "white", "ec": "none", "alpha": 0.7, "pad": 0.5},
            )
