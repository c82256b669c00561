"""A chart as data: what the page draws with plotly, matplotlib draws without it, and a comparison overlays.

Each analysis package may have a module ``charts`` with two functions, both from the run folder's content alone:

    charts(arrays, summary) -> list[Chart]
    headline(rows) -> list[dict]     the 5 to 8 rows of summary["results"] an engineer asks for, most important first

arrays  : group -> name -> `Variable`, as they stand in result.nc.
summary : summary.json, with the scene file's tables under "scene_file".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Variable:
    """A variable of result.nc: data with the names of its dimensions, its unit ("" when it has none) and its other attributes."""

    data: NDArray[Any]
    dims: tuple[str, ...]
    units: str
    attributes: Mapping[str, Any]


Group = Mapping[str, Variable]
Arrays = Mapping[str, Group]


@dataclass(frozen=True)
class Axis:
    """What an axis shows: words, unit, whether it is logarithmic."""

    name: str
    unit: str = ""
    log: bool = False

    @property
    def label(self) -> str:
        """Words with the unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


@dataclass(frozen=True)
class Trace:
    """One curve: ``x``, ``y`` (n,) in the axes' units; nan breaks the line. Curves of the same ``colour`` belong together.

    outline : a line of the drawing (a contact circle, a rim): black, no colour of its own.
    entry   : name in the legend, one for all curves that share it; the label when empty.
    """

    label: str
    x: Array
    y: Array
    style: Literal["line", "dashed", "dotted", "points", "both"] = "line"
    colour: int = 0
    outline: bool = False
    entry: str = ""


@dataclass(frozen=True)
class Map:
    """Values ``z`` (n_x, n_y) at the lattice ``x`` (n_x,), ``y`` (n_y,); nan is drawn as nothing.

    states : names of the values 0, 1, ...: a map of states instead of a field.
    top    : end of the colour scale; the largest value when None.
    """

    x: Array
    y: Array
    z: Array
    value: Axis
    states: tuple[str, ...] = ()
    top: float | None = None


@dataclass(frozen=True)
class Chart:
    """One figure. Charts of the same ``title`` share a place on the page and are chosen by ``case``.

    figure : name of the PNG file in the run folder, without ending, that shows the same; the page draws its own when there is none.
    equal  : the same scale along both axes.
    note   : what to see, one sentence.
    """

    title: str
    x: Axis
    y: Axis
    traces: tuple[Trace, ...] = ()
    maps: tuple[Map, ...] = ()
    case: str = ""
    figure: str = ""
    equal: bool = False
    note: str = ""


class Charts(Protocol):
    """The module ``charts`` of an analysis package."""

    def charts(self, arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
        """All charts of a run."""

    def headline(self, rows: list[Row]) -> list[Row]:
        """The 5 to 8 numbers an engineer asks for."""


#: states of a contact point, in the order of the values 0, 1, 2
STATES = ("open", "slip", "stick")


def picked(rows: list[Row], names: tuple[str, ...], *, last: bool = False) -> list[Row]:
    """The first (or last) row of each of ``names``, in their order; names without a row are left out."""
    out = []
    for name in names:
        found = [r for r in rows if r["name"] == name]
        if found:
            out.append(found[-1 if last else 0])
    return out


def value_of(summary: Mapping[str, Any], name: str, case: str, key: str = "value") -> float | None:
    """``key`` ("value", "reference", ...) of the row ``name`` of ``case``, or None."""
    for row in summary["results"]:
        if row["name"] == name and row["case"] == case:
            found = row.get(key)
            return None if found is None else float(found)
    return None


def label_of(group: str) -> str:
    """The case a group of result.nc stands for: netCDF allows no slash in a name."""
    return group.replace(" per ", "/")
