"""Charts drawn by matplotlib.

On axes, on the PNG sheets of a run folder, and as pictures for pages read without script.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from upd.plot.chart import Array, Axis, Chart
from upd.plot.style import (
    coordinates,
    is_log,
    is_wide,
    log_ticks,
    log_view,
    plain,
    proportion,
    tick_text,
    title_of,
    with_room,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: charts on one sheet at most: more is no figure any more
MOST_PANELS = 24
#: dots per inch of a run folder's sheets, and of a page's pictures
_DPI, _PAGE_DPI = 130, 110
#: points of the letters of titles and ticks, and mean width of a letter as a part of them
_LETTERS, _WIDE = 9.0, 0.56
#: inches a title may reach over its axes on both sides together
_OVER = 0.45
#: inches beside, and above and below, a wide map on its panel: labels, title and colour bar
_BESIDE, _ABOVE = 1.05, 2.0


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
    for pies in chart.pies:
        parts.draw_pies(pies, ax)
    parts.draw_scatters(chart, ax)
    _axis(chart, chart.x, "x", ax)
    _axis(chart, chart.y, "y", ax)
    parts.draw_marks(chart.marks, ax)
    if chart.equal:
        ax.set_aspect("equal")
    parts.draw_legend(chart, ax)
    _titles(chart, ax)
    parts.draw_labels(chart, ax)
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
    from upd.plot.sheet import png

    return png(_sheet(charts, _PAGE_DPI))


def write_sheet(charts: Sequence[Chart], path: Path) -> list[Path]:
    """Write the charts of one figure as one PNG, whole or not at all.

    Parameters
    ----------
    charts
        Those of a sheet (`Chart.sheet`) are drawn, at most `MOST_PANELS`, with the
        columns and the size of the first.
    path
        PNG file.

    Returns
    -------
    list of Path
        ``path``, or nothing when no chart belongs to a sheet.
    """
    from upd.plot.sheet import write_png

    shown = [chart for chart in charts if chart.sheet]
    return write_png(_sheet(shown, _DPI), path) if shown else []


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
    from upd.plot.sheet import draw_sheet

    first = charts[0]
    wide, tall = first.size
    if all(is_wide(chart) for chart in charts):
        # Wide maps leave no empty place above each other.
        tall = min(tall, max(proportion(chart) for chart in charts) * (wide - _BESIDE) + _ABOVE)
    drawings = [partial(draw, chart) for chart in charts[:MOST_PANELS]]
    return draw_sheet(drawings, first.columns, (wide, tall), dpi)


def _grid(chart: Chart, ax: Axes) -> None:
    ax.tick_params(labelsize=_LETTERS)
    if not chart.maps:
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
            [at for at, _ in axis.ticks], labels=[plain(text) for _, text in axis.ticks]
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
    """Title and names of the axes, in lines that their place holds."""
    figure, box = ax.figure.get_figure(root=True), ax.get_position(original=True)
    assert figure is not None
    across = int(72.0 * (figure.get_figwidth() * box.width + _OVER) / (_WIDE * _LETTERS))
    upwards = int(72.0 * (figure.get_figheight() * box.height + _OVER) / (_WIDE * _LETTERS))
    ax.set_xlabel(_lines(chart.x.label, across), fontsize=_LETTERS)
    ax.set_ylabel(_lines(chart.y.label, upwards), fontsize=_LETTERS)
    title, case = title_of(chart)
    whole = f"{title}: {case}" if case else title
    own_lines = case and across < len(whole) and max(len(title), len(case)) <= across
    text = f"{title}\n{case}" if own_lines else whole
    # Its height given, matplotlib does not look for one: that costs a quarter of all drawing.
    ax.set_title(plain(text) if own_lines else _lines(text, across), fontsize=_LETTERS, y=1.0)


def _lines(text: str, letters: int) -> str:
    """A text on at most two lines of so many letters; what does not fit is cut."""
    lines = textwrap.wrap(text, max(letters, 12), max_lines=2, placeholder=" …")
    return plain("\n".join(lines))
