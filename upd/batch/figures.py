"""Figures of a sweep: curves over one parameter, filled maps over two, small multiples over more."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from upd.batch.grid import GridAxis as Axis
from upd.batch.table import Column
from upd.plot.sheet import Drawing, write_sheet

Array = NDArray[np.float64]

#: Panels on one sheet, and sheets, at most: more is no figure any more.
_PANELS, _SHEETS = 24, 24
_SIZE = (5.0, 3.9)


def draw(folder: Path, axes: Sequence[Axis], columns: Sequence[Column]) -> list[Path]:
    """Write the figures into `folder`; those of an earlier grid are removed. Returns the paths."""
    for old in folder.glob("sweep*.png"):
        old.unlink()
    shape = tuple(len(axis.values) for axis in axes)
    varied = [axis for axis in axes if len(axis.values) > 1]
    grids = [(column, column.values.reshape(shape).squeeze()) for column in columns if np.isfinite(column.values).any()]
    if not varied or not grids:
        return []
    numeric = [axis for axis in varied if axis.numbers is not None]
    if len(varied) == 1:
        return write_sheet(folder / "sweep.png", [partial(_curves, varied[0], None, *grid) for grid in grids[:_PANELS]], 2, _SIZE)
    if len(varied) == 2 and len(numeric) == 2:
        return write_sheet(folder / "sweep.png", [partial(_map, varied[0], varied[1], *grid) for grid in grids[:_PANELS]], 2, _SIZE)
    if len(varied) == 2:
        x, other = (varied[0], varied[1]) if varied[1].numbers is None and varied[0].numbers is not None else (varied[1], varied[0])
        drawings = [partial(_curves, x, other, column, np.moveaxis(grid, varied.index(x), -1)) for column, grid in grids[:_PANELS]]
        return write_sheet(folder / "sweep.png", drawings, 2, _SIZE)
    return [path for column, grid in grids[:_SHEETS] for path in _multiples(folder, varied, numeric, column, grid)]


def _multiples(folder: Path, varied: Sequence[Axis], numeric: Sequence[Axis], column: Column, grid: Array) -> list[Path]:
    """One panel per combination of what is not drawn along x and y, all on one scale of values."""
    longest = sorted(numeric, key=lambda axis: -len(axis.values))
    inside = longest[:2] if len(longest) > 1 else [*longest[:1], *(a for a in varied if a not in longest)][:1]
    outside = [axis for axis in varied if axis not in inside]
    moved = np.moveaxis(grid, [varied.index(axis) for axis in [*outside, *inside]], range(grid.ndim))
    low, high = float(np.nanmin(grid)), float(np.nanmax(grid))
    drawings: list[Drawing] = []
    for index in itertools.islice(itertools.product(*(range(len(axis.values)) for axis in outside)), _PANELS):
        title = f"{_title(column)}\n" + ", ".join(f"{_short(axis)} = {axis.values[k]}" for axis, k in zip(outside, index, strict=True))
        if len(inside) == 2:
            drawings.append(partial(_map, inside[0], inside[1], column, moved[index], limits=(low, high), title=title))
        else:
            drawings.append(partial(_curves, inside[0], None, column, moved[index], title=title, limits=(low, high)))
    return write_sheet(folder / f"sweep-{column.variable}.png", drawings, 3, _SIZE)


def _curves(
    x: Axis, other: Axis | None, column: Column, values: Array, ax: Axes, *, title: str = "", limits: tuple[float, float] | None = None
) -> Axes:
    """Values over one axis; one curve per value of ``other``. Points that failed leave gaps."""
    along = np.arange(len(x.values)) if x.numbers is None else np.array(x.numbers)
    style = "o" if x.numbers is None else "o-"
    for k, one in enumerate(np.atleast_2d(values)):
        ax.plot(along, one, style, ms=4, color=f"C{k % 10}", label="" if other is None else str(other.values[k]))
    if x.numbers is None:
        ax.set_xticks(along, [str(value) for value in x.values])
        ax.margins(x=0.15)
    if limits is not None and limits[0] < limits[1]:
        room = 0.05 * (limits[1] - limits[0])
        ax.set_ylim(limits[0] - room, limits[1] + room)
    if other is not None:
        ax.legend(title=_short(other), fontsize=8)
    # Numbers as they are, without an offset in a corner.
    if np.isfinite(values).any():
        ax.ticklabel_format(axis="y", useOffset=False)
    ax.set_title(title or _title(column), fontsize=10)
    ax.set_xlabel(_label(x))
    ax.set_ylabel(_unit(column))
    ax.grid(alpha=0.3)
    return ax


def _map(x: Axis, y: Axis, column: Column, values: Array, ax: Axes, *, limits: tuple[float, float] | None = None, title: str = "") -> Axes:
    """Filled map over two axes: values (len(x), len(y)), dots at the points, crosses where one failed."""
    X, Y = np.array(x.numbers, float), np.array(y.numbers, float)
    order = np.ix_(np.argsort(X), np.argsort(Y))
    X, Y, Z = np.sort(X), np.sort(Y), np.ma.masked_invalid(values[order])
    low, high = limits or (float(Z.min()), float(Z.max()))
    image: Any
    if np.isfinite(values).all() and low < high:
        image = ax.contourf(X, Y, Z.T, levels=MaxNLocator(12).tick_values(low, high), cmap="viridis")
    else:
        image = ax.pcolormesh(X, Y, Z.T, shading="nearest", cmap="viridis", vmin=low, vmax=high)
    gx, gy = np.meshgrid(X, Y, indexing="ij")
    fine = ~np.ma.getmaskarray(Z)
    ax.plot(gx[fine], gy[fine], "o", color="white", mec="#333333", mew=0.5, ms=3, clip_on=False)
    ax.plot(gx[~fine], gy[~fine], "x", color="#c0392b", ms=6, clip_on=False)
    if low < high:
        bar = ax.figure.colorbar(image, ax=ax)
        bar.ax.ticklabel_format(useOffset=False)
        ax.set_title(title or _title(column), fontsize=10)
    else:
        ax.set_title(f"{title or column.title}\n{low:.5g} {_unit(column)} everywhere", fontsize=10)
    ax.set_xlabel(_label(x))
    ax.set_ylabel(_label(y))
    return ax


def _short(axis: Axis) -> str:
    return axis.path.rpartition(".")[2].replace("_", " ")


def _label(axis: Axis) -> str:
    return f"{_short(axis)}, {axis.unit}" if axis.unit else _short(axis)


def _title(column: Column) -> str:
    return f"{column.title}, {_unit(column)}" if column.unit else column.title


def _unit(column: Column) -> str:
    return re.sub(r"(?<=m)2$", "²", column.unit.replace("um", "µm"))
