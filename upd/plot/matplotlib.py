"""Charts drawn by matplotlib.

On axes, on the PNG sheets of a run folder, and as pictures for pages read without script.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from upd.cache.files import whole_file
from upd.plot.chart import Array, Axis, Chart
from upd.plot.labels import with_room
from upd.plot.style import (
    coordinates,
    is_log,
    legend_names,
    log_ticks,
    log_view,
    tick_text,
    title_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: charts on one sheet at most: more is no figure any more
MOST_PANELS = 24
#: dots per inch of a run folder's sheets, and of a page's pictures
_DPI, _PAGE_DPI = 130, 110
#: size in points of a title's letters, on two lines and on one axis, the least to which they
#: shrink, and of ticks
_TITLE, _TWO_LINES, _LEAST, _TICKS = 11.0, 10.0, 6.5, 9.0
#: inches a title may reach over its axes on both sides together: what the sheet's right margin
#: leaves
_OVER = 0.45
#: inches beside, and above and below, a wide map on its panel: labels, title and colour bar
_BESIDE, _ABOVE = 1.05, 2.0
#: width in points of a text in letters of a size in points
Width = Callable[[str, float], float]


def draw(chart: Chart, ax: Axes | None = None) -> Axes:
    """Draw a chart on matplotlib axes, or on new ones.

    Parameters
    ----------
    chart
        What to draw.
    ax
        Where; axes in a figure of their own when None.

    Returns
    -------
    Axes
        The axes drawn on.
    """
    # matplotlib is slow to import: only when something is drawn.
    from upd.plot import matplotlib_around as around
    from upd.plot import matplotlib_parts as parts
    from upd.plot.sheet import own_axes

    ax, chart = own_axes(ax), with_room(chart)
    _grid(chart, ax)
    parts.draw_maps(chart, ax)
    for area in chart.areas:
        parts.draw_area(area, ax)
    for band in chart.bands:
        parts.draw_band(band, ax)
    for trace in chart.traces:
        parts.draw_trace(trace, ax)
    parts.draw_bars(chart, ax)
    for pies in chart.pies:
        parts.draw_pies(pies, ax)
    parts.draw_scatters(chart, ax)
    _axis(chart, chart.x, "x", ax)
    _axis(chart, chart.y, "y", ax)
    parts.fit_bar_texts(chart, ax)
    parts.draw_marks(chart.marks, ax)
    if chart.equal:
        ax.set_aspect("equal")
    around.draw_legend(chart, legend_names(chart), ax)
    _titles(chart, ax)
    around.draw_labels(chart, ax)
    return ax


def chart_png(charts: Sequence[Chart]) -> bytes:
    """A sheet of ``charts`` as PNG for a page, at most `MOST_PANELS`."""
    out = io.BytesIO()
    _sheet(charts, _PAGE_DPI).savefig(out, format="png")
    return out.getvalue()


def write_sheet(charts: Sequence[Chart], path: Path) -> list[Path]:
    """Write the charts of one figure as one PNG, whole or not at all.

    Parameters
    ----------
    charts
        Those that stand on a sheet (`Chart.sheet`) are drawn, at most `MOST_PANELS`, with the
        columns and the size of the first.
    path
        PNG file.

    Returns
    -------
    list of Path
        ``path``, or nothing when no chart stands on the sheet.
    """
    shown = [chart for chart in charts if chart.sheet]
    if not shown:
        return []
    figure = _sheet(shown, _DPI)
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png")
    return [path]


def write_sheets(charts: Iterable[Chart], folder: Path, *, keep: bool = False) -> list[Path]:
    """Write the charts of every figure (`Chart.figure`) as ``<figure>.png`` into ``folder``.

    Parameters
    ----------
    charts
        Those without a figure are left out.
    keep
        Leave files that are there already as they are.

    Returns
    -------
    list of Path
        The files written.
    """
    sheets: dict[str, list[Chart]] = {}
    for chart in charts:
        if chart.figure:
            sheets.setdefault(chart.figure, []).append(chart)
    files = {folder / f"{name}.png": group for name, group in sheets.items()}
    return [
        made
        for path, group in files.items()
        if not (keep and path.exists())
        for made in write_sheet(group, path)
    ]


def _sheet(charts: Sequence[Chart], dpi: int) -> Figure:
    from upd.plot.matplotlib_parts import is_wide, proportion
    from upd.plot.sheet import draw_sheet

    first = charts[0]
    wide, tall = first.size
    if all(is_wide(chart) for chart in charts):
        # Wide maps leave no empty place above each other.
        tall = min(tall, max(proportion(chart) for chart in charts) * (wide - _BESIDE) + _ABOVE)
    return draw_sheet(
        [partial(draw, chart) for chart in charts[:MOST_PANELS]],
        first.columns,
        (wide, tall),
        dpi,
        # only legends need a room that nobody knows before
        fixed=not any(
            legend_names(one) or any(m.states for m in one.maps) for one in charts[:MOST_PANELS]
        ),
    )


def _grid(chart: Chart, ax: Axes) -> None:
    ax.tick_params(labelsize=_TICKS)
    if not (chart.maps or chart.bars):
        ax.grid(visible=True, which="major", color="#dddddd", lw=0.6)
        ax.set_axisbelow(True)


def _axis(chart: Chart, axis: Axis, name: Literal["x", "y"], ax: Axes) -> None:
    """Scale, ticks and ends of one axis."""
    from matplotlib.ticker import ScalarFormatter

    which = ax.xaxis if name == "x" else ax.yaxis
    values = coordinates(chart, name)
    limits = getattr(ax, f"set_{name}lim")
    if is_log(axis, values):
        _log_axis(name, log_view(axis, values), ax)
    elif isinstance(which.get_major_formatter(), ScalarFormatter):
        # Numbers as they are, without an offset in a corner.
        ax.ticklabel_format(axis=name, useOffset=False)
    if name == "x" and any(area.state for area in chart.areas):
        ax.margins(x=0.0)
    if axis.ticks:
        which.set_ticks(
            [at for at, _ in axis.ticks], labels=[_plain(text) for _, text in axis.ticks]
        )
    if axis.low is not None or axis.high is not None:
        # matplotlib would take the free end from the view of this moment: let it be that of all
        # data.
        ax.autoscale_view()
        limits(axis.low, axis.high)


def _log_axis(name: Literal["x", "y"], values: Array, ax: Axes) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

    getattr(ax, f"set_{name}scale")("log", nonpositive="mask")
    which = ax.xaxis if name == "x" else ax.yaxis
    which.set_minor_formatter(NullFormatter())
    ax.grid(visible=True, which="minor", axis=name, color="#eeeeee", lw=0.4)
    which.set_major_locator(FixedLocator(log_ticks(values)))
    which.set_major_formatter(FuncFormatter(lambda value, _: tick_text(value)))


def _titles(chart: Chart, ax: Axes) -> None:
    """Title and names of the axes, small enough for their place."""
    figure, box = ax.figure.get_figure(root=True), ax.get_position(original=True)
    assert figure is not None
    # Axes of one scale are lower than their place.
    ax.apply_aspect()
    box_height = ax.get_position().height
    points = 72.0 / figure.dpi

    def width(text: str, size: float) -> float:
        # The title itself measures: letters on pixels differ by a tenth from their outlines.
        ax.title.set(text=_plain(text), fontsize=size)
        return float(ax.title.get_window_extent().width) * points

    wide, tall = (
        72.0 * figure.get_figwidth() * box.width,
        72.0 * figure.get_figheight() * box_height,
    )
    ax.set_xlabel(_plain(chart.x.label), fontsize=shrunk(chart.x.label, wide, width))
    ax.set_ylabel(_plain(chart.y.label), fontsize=shrunk(chart.y.label, tall + 36.0, width))
    text, size = fitted(*title_of(chart), wide + 72.0 * _OVER, width)
    # Its height given, matplotlib does not look for one: that costs a quarter of all drawing.
    ax.set_title(_plain(text), fontsize=size, y=1.0)


def fitted(title: str, case: str, room: float, width: Width) -> tuple[str, float]:
    """The title with its case on one or two lines, and the size of its letters in points, so that
    no line is wider than ``room`` points.

    ``width`` tells how wide a text is in letters of a size. What does not fit in the smallest
    letters is cut.
    """
    title, case = title.strip(), case.strip()
    whole = f"{title}: {case}" if case and title else title or case
    if width(whole, _TITLE) <= room:
        return whole, _TITLE
    halves = textwrap.wrap(whole, max(len(whole) // 2 + 8, 12), max_lines=2, placeholder=" …") or [
        whole
    ]
    # The case has its own line unless it, or the title, is much the longer.
    own = [title, case] if case and title else halves
    lines = own if all(width(line, _TWO_LINES) <= room for line in own) else halves
    size = min(shrunk(line, room, width) for line in lines)
    return "\n".join(_cut(line, size, room, width) for line in lines), size


def _cut(line: str, size: float, room: float, width: Width) -> str:
    while (found := width(line, size)) > room and len(line) > 2:
        line = line[: min(int(len(line) * room / found), len(line) - 2)] + "…"
    return line


def shrunk(text: str, room: float, width: Width) -> float:
    """Size of letters in points with which a line is no wider than ``room`` points, if that can be
    read.
    """
    size = _TWO_LINES
    while size > _LEAST and width(text, size) > room:
        size -= 0.5
    return size


def _plain(text: str) -> str:
    """Text matplotlib does not take for mathematics."""
    return text.replace("$", r"\$")
