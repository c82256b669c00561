"""Sheets of axes with fixed margins, written as PNG whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from upd.cache.files import whole_file

Drawing = Callable[[Axes], Any]

_DPI = 130
#: inches around all axes (left, bottom, right, top) and between them: room for labels below and a
#: title of two lines above
_MARGINS, _GAP = (0.8, 0.6, 0.25, 0.5), 1.05


def own_axes(ax: Axes | None) -> Axes:
    """The axes given, or new ones in a figure of their own."""
    if ax is not None:
        return ax
    figure = Figure(figsize=(6, 4.5), layout="constrained")
    FigureCanvasAgg(figure)
    return figure.add_subplot()


def draw_sheet(
    drawings: Sequence[Drawing],
    columns: int,
    size: tuple[float, float] = (5.6, 4.4),
    dpi: int = _DPI,
    *,
    fixed: bool = True,
) -> Figure:
    """A figure of ``dpi`` dots per inch with each of ``drawings`` on axes of ``size`` inches,
    ``columns`` side by side.

    Margins are ``fixed``, or as wide as what stands around the axes: that draws twice.
    """
    columns = min(columns, len(drawings))
    rows = -(-len(drawings) // columns)
    w, h = size[0] * columns, size[1] * rows
    figure = Figure(figsize=(w, h), dpi=dpi, layout=None if fixed else "constrained")
    FigureCanvasAgg(figure)
    left, bottom, right, top = _MARGINS
    wide = (w - left - right - _GAP * (columns - 1)) / columns
    tall = (h - bottom - top - _GAP * (rows - 1)) / rows
    if fixed:
        figure.subplots_adjust(
            *(left / w, bottom / h, 1.0 - right / w, 1.0 - top / h),
            wspace=_GAP / wide,
            hspace=_GAP / tall,
        )
    for k, draw in enumerate(drawings):
        ax = figure.add_subplot(rows, columns, k + 1)
        draw(ax)
        for axis in (ax.xaxis, ax.yaxis):
            # Ticks with words stay all.
            if isinstance(locator := axis.get_major_locator(), MaxNLocator):
                locator.set_params(nbins=6)
    return figure


def write_sheet(
    path: Path, drawings: Sequence[Drawing], columns: int, size: tuple[float, float] = (5.6, 4.4)
) -> list[Path]:
    """Write the sheet of ``drawings`` as PNG, whole or not at all.

    Returns its path, or nothing when there is nothing to draw.
    """
    if not drawings:
        return []
    figure = draw_sheet(drawings, columns, size)
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png")
    return [path]
