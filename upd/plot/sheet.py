"""What all figures share: colours, axes of their own when none are given, sheets of axes written as PNG whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

Drawing = Callable[[Axes], Any]

OURS, CLOSED, THESIS = "#1f5fa8", "#444444", "#c0392b"
STICK, SLIP, OPEN = "#2b6cb0", "#f0a35e", "#f4f4f4"


def own_axes(ax: Axes | None) -> Axes:
    """The axes given, or new ones in a figure of their own."""
    if ax is not None:
        return ax
    figure = Figure(figsize=(6, 4.5), layout="constrained")
    FigureCanvasAgg(figure)
    return figure.add_subplot()


def write_sheet(path: Path, drawings: Sequence[Drawing], columns: int, size: tuple[float, float] = (5.6, 4.4)) -> list[Path]:
    """Draw each of ``drawings`` on axes of ``size`` inches, ``columns`` side by side, and write the PNG. Returns its path, or nothing."""
    if not drawings:
        return []
    columns = min(columns, len(drawings))
    rows = -(-len(drawings) // columns)
    w, h = size[0] * columns, size[1] * rows
    figure = Figure(figsize=(w, h))
    FigureCanvasAgg(figure)
    # Fixed margins in inches: matplotlib's own layout engines draw everything twice.
    figure.subplots_adjust(0.75 / w, 0.6 / h, 1.0 - 0.25 / w, 1.0 - 0.4 / h, wspace=1.1 / size[0], hspace=1.1 / size[1])
    for k, draw in enumerate(drawings):
        ax = figure.add_subplot(rows, columns, k + 1)
        draw(ax)
        for name in ("x", "y"):
            if getattr(ax, f"get_{name}scale")() == "linear":
                ax.locator_params(axis=name, nbins=6)
    part = path.with_name(f".{path.name}.part")
    figure.savefig(part, format="png", dpi=130)
    part.replace(path)
    return [path]


def state_legend(ax: Axes) -> Axes:
    """Legend of stick, slip and open nodes under a map."""
    handles = [Patch(color=STICK, label="stick"), Patch(color=SLIP, label="slip")]
    handles.append(Patch(facecolor=OPEN, edgecolor="#999999", label="open"))
    ax.legend(handles=handles, loc="upper right", fontsize=8)
    return ax
