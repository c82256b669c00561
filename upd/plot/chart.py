"""A chart as data: what the page draws with plotly, matplotlib draws without it, and a comparison
overlays.

Each analysis has a function ``charts(arrays, summary) -> list[Chart]`` that makes them from the run
folder's content alone:

    arrays     group -> name -> `Variable`, as in result.nc
    summary    summary.json, with the scene file's tables under "scene_file"
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: a number as it stands in summary.json
Entry = Mapping[str, Any]


@dataclass(frozen=True)
class Axis:
    """What an axis shows.

    Attributes
    ----------
    name, unit
        Words and unit.
    log
        Logarithmic.
    low, high
        Ends; where the data end when None.
    ticks
        Positions and words of ticks that are no numbers: choices, cases.
    """

    name: str
    unit: str = ""
    log: bool = False
    low: float | None = None
    high: float | None = None
    ticks: tuple[tuple[float, str], ...] = ()

    @property
    def label(self) -> str:
        """Words with the unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


Style = Literal[
    "line", "dashed", "dotted", "dashdot", "points", "both", "open points", "crosses", "star"
]


@dataclass(frozen=True)
class Trace:
    """One curve: ``x``, ``y`` (n,) in the axes' units; nan breaks the line.

    Curves of the same ``colour`` belong together.

    Attributes
    ----------
    outline
        A line of the drawing (a contact circle, a rim): black, no colour of its own.
    entry
        Name in the legend, one for all curves that share it; the label when empty.
    closed
        A closed form or a linear limit: grey, no colour of its own.
    """

    label: str
    x: Array
    y: Array
    style: Style = "line"
    colour: int = 0
    outline: bool = False
    entry: str = ""
    closed: bool = False


@dataclass(frozen=True)
class Mark:
    """A point with words beside it, a peak for example; ``colour`` is that of its curve."""

    x: float
    y: float
    text: str
    colour: int = 0
    closed: bool = False


@dataclass(frozen=True)
class Band:
    """What lies between ``low`` and ``high`` along one axis (a line where both are the same).

    Measured peaks, a limit, a printed error.
    """

    label: str
    axis: Literal["x", "y"]
    low: float
    high: float
    colour: int = -1
    dashed: bool = False


@dataclass(frozen=True)
class Area:
    """What lies between two curves over ``x`` (n,): ``low``, ``high`` (n,).

    Stacked shares, the band of admissible answers.

    Attributes
    ----------
    state
        Name of the contact state it shows ("stick", "slip", "lift-off"), whose colour it then
        has.
    """

    label: str
    x: Array
    low: Array
    high: Array
    colour: int = 0
    state: str = ""


@dataclass(frozen=True)
class Scatter:
    """Points ``x``, ``y`` (n,) coloured by ``value`` (n,), their area by ``size`` (n,) from 0 to
    1.
    """

    x: Array
    y: Array
    value: Array
    size: Array
    axis: Axis


@dataclass(frozen=True)
class Map:
    """Values ``z`` (n_x, n_y) at the lattice ``x`` (n_x,), ``y`` (n_y,); nan is drawn as nothing.

    Attributes
    ----------
    states
        Names of the values 0, 1, ...: a map of states instead of a field.
    low
        Start of the colour scale.
    top
        Its end; the largest value when None.
    """

    x: Array
    y: Array
    z: Array
    value: Axis
    states: tuple[str, ...] = ()
    top: float | None = None
    low: float | None = 0.0


@dataclass(frozen=True)
class Chart:
    """One figure. Charts of the same ``title`` share a place on the page and are chosen by
    ``case``.

    Attributes
    ----------
    figure
        Name of the PNG file in the run folder, without ending, on whose sheet it stands; none
        when empty.
    sheet
        Whether that sheet shows it at all: of many cases the page shows all, a sheet the
        first ones.
    columns, size
        Charts side by side on the sheet, and inches of each.
    equal
        The same scale along both axes.
    note
        What to see, one sentence.
    detail
        What a drawing shows beside its case though no choice depends on it: the
        frequency of the peak, the damping.
    heading
        Of the place on the page; the title when empty.
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
    marks: tuple[Mark, ...] = ()
    bands: tuple[Band, ...] = ()
    areas: tuple[Area, ...] = ()
    scatters: tuple[Scatter, ...] = ()
    sheet: bool = True
    columns: int = 2
    size: tuple[float, float] = (5.6, 4.4)
    detail: str = ""
    heading: str = ""


#: charts on one sheet at most: more is no figure any more
MOST_PANELS = 24
#: states of a contact point, in the order of the values 0, 1, 2
STATES = ("open", "slip", "stick")
