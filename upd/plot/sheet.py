"""Sheets of axes with fixed margins, written as PNG whole or not at all."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from upd.cache.files import whole_file

Drawing = Callable[[Axes], Any]

#: inches of one drawing, dots per inch
_SIZE, _DPI = (5.6, 4.4), 130


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


def png(figure: Figure) -> bytes:
    """A figure as PNG."""
    out = io.BytesIO()
    figure.savefig(out, format="png")
    return out.getvalue()


def write_png(figure: Figure, path: Path) -> list[Path]:
    """Write a figure as PNG, whole or not at all; returns its path."""
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png")
    return [path]


def write_sheet(
    path: Path, drawings: Sequence[Drawing], columns: int, size: tuple[float, float] = _SIZE
) -> list[Path]:
    """Write the sheet of ``drawings`` as PNG, whole or not at all.

    Returns its path, or nothing when there is nothing to draw.
    """
    return write_png(draw_sheet(drawings, columns, size), path) if drawings else []
