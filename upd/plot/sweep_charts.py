"""Charts of a sweep: curves over a parameter, one for each value of the others; maps over two.

Of a sample: how often every number came out where, beside its first-order band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from upd.labels import unit_label
from upd.plot.chart import MOST_PANELS, Area, Array, Axis, Band, Chart, Map, Trace
from upd.results import InputPart
from upd.results.quantities import number_label, number_title
from upd.results.sampled import SampledNumber
from upd.units import number_and_unit

#: curves in one chart beside a map: of more one loses track; and at most
_CURVES, _MOST = 8, 24
_SIZE = (5.0, 3.9)
#: figure of all numbers, and of what a sample makes of them
FIGURE, SAMPLE_FIGURE = FIGURES = ("sweep", "sample")
#: relative spread up to which a number is the same everywhere
_SAME = 1e-9


@dataclass(frozen=True)
class Parameter:
    """A parameter of a sweep and its values.

    Attributes
    ----------
    path
        In the scene.
    values
        As the scene takes them.
    wrapped
        The scene's entry is a list; a value stands there alone in it.
    words
        Last words of the path that tell it from the other parameters.
    """

    path: str
    values: tuple[Any, ...]
    wrapped: bool = False
    words: int = 1

    @cached_property
    def _parsed(self) -> tuple[tuple[float, ...] | None, str]:
        found = [one for v in self.values if (one := number_and_unit(str(v))) is not None]
        units = {unit for _, unit in found}
        if len(found) < len(self.values) or len(units) != 1:
            return None, ""
        return tuple(number for number, _ in found), units.pop()

    @property
    def numbers(self) -> tuple[float, ...] | None:
        """The values in their common unit; None when they are words."""
        return self._parsed[0]

    @property
    def unit(self) -> str:
        """Of the numbers; "" of counts, ratios and words."""
        return self._parsed[1]

    @property
    def short(self) -> str:
        """The last words of the path."""
        return " ".join(self.path.split(".")[-self.words :]).replace("_", " ")

    @property
    def header(self) -> str:
        """Path with the unit."""
        return f"{self.path} [{self.unit}]" if self.unit else self.path

    @property
    def column(self) -> tuple[float, ...] | tuple[str, ...]:
        """The values for tables: numbers, or words."""
        return tuple(map(str, self.values)) if self.numbers is None else self.numbers

    def shown(self, k: int) -> str:
        """Value `k` without the unit."""
        return str(self.values[k]) if self.numbers is None else f"{self.numbers[k]:.6g}"

    def with_unit(self, k: int) -> str:
        """Value `k` with the unit, after the last words of the path."""
        return f"{self.short} {self.shown(k)} {unit_label(self.unit)}".rstrip()

    def setting(self, k: int) -> Any:
        """What the scene is given for value `k`."""
        return [self.values[k]] if self.wrapped else self.values[k]


def told_apart(parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """The parameters, each with as many last words of its path as no other has."""
    paths, out = [p.path.split(".") for p in parameters], []
    for parameter, path in zip(parameters, paths, strict=True):
        own = (n for n in range(1, len(path)) if [one[-n:] for one in paths].count(path[-n:]) == 1)
        out.append(replace(parameter, words=next(own, len(path))))
    return tuple(out)


@dataclass(frozen=True)
class Column:
    """One followed number over all points, the last parameter of a grid fastest.

    Attributes
    ----------
    values
        (n,), NaN where there is none.
    missing
        Why there is none; "" where there is one or the point failed.
    inputs
        What inputs known within limits do to it, by the first point that knows any.
    """

    name: str
    case: str
    unit: str
    values: Array
    missing: tuple[str, ...] = ()
    inputs: tuple[InputPart, ...] = ()

    @property
    def title(self) -> str:
        """Name, and the case when there is one."""
        return f"{self.name} ({self.case})" if self.case else self.name

    @property
    def header(self) -> str:
        """Title with the unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title


def sweep_charts(parameters: Sequence[Parameter], numbers: Sequence[Column]) -> list[Chart]:
    """Charts of all followed numbers over what varies.

    Returns
    -------
    list of Chart
        What varies first. Over one parameter a curve each, over more a curve for each combination
        of the others, the first 24; over two with numbers a map before it. Parameters with
        one value are no dimension; no charts when nothing varies. A number without any value is
        left out.
    """
    shape = tuple(len(p.values) for p in parameters)
    varied = [p for p in parameters if len(p.values) > 1]
    grids = [
        (n, np.asarray(n.values, float).reshape(shape).squeeze())
        for n in sorted(numbers, key=lambda one: is_constant(one.values))
        if np.isfinite(n.values).any()
    ]
    if not varied:
        return []
    # Along x what has numbers, and more of them.
    x = max(reversed(varied), key=lambda p: (p.numbers is not None, len(p.values)))
    others = [p for p in varied if p is not x]
    maps: list[Chart] = []
    if len(varied) == 2 and all(p.numbers is not None for p in varied):
        maps = [_map(varied[0], varied[1], number, grid) for number, grid in grids]
        if len(others[0].values) > _CURVES:
            return maps
    return maps + [
        _curves(x, others, number, np.moveaxis(grid, varied.index(x), -1), sheet=not maps)
        for number, grid in grids
    ]


def is_constant(values: Array) -> bool:
    """Whether the points have one value, up to rounding."""
    known = np.asarray(values, float)[np.isfinite(values)]
    return not known.size or float(np.ptp(known)) <= _SAME * float(np.abs(known).max())


def _chart(number: Column, x: Axis, y: Axis, **more: Any) -> Chart:
    """A chart of a number on the sheet of the sweep."""
    shared: dict[str, Any] = {"case": number.case, "figure": FIGURE, "size": _SIZE}
    return Chart(number_label(number.name), x, y, **shared, **more)


def _curves(
    x: Parameter, others: Sequence[Parameter], number: Column, values: Array, *, sheet: bool
) -> Chart:
    """Values over one parameter, one curve per combination of the ``others``."""
    along = (
        np.arange(len(x.values), dtype=float) if x.numbers is None else np.array(x.numbers, float)
    )
    order = np.argsort(along, kind="stable")
    curves = values.reshape(-1, len(along))[:, order]
    # Ends without a value would only stretch the axis; gaps between values stay.
    solved = np.flatnonzero(np.isfinite(curves).any(axis=0))
    span = (
        slice(solved[0], solved[-1] + 1) if x.numbers is not None and solved.size else slice(None)
    )
    labels = [
        ", ".join(p.with_unit(k) for p, k in zip(others, places, strict=True))
        or number_title(number.name, number.case)
        for places in np.ndindex(*(len(p.values) for p in others))
    ]
    style: Any = "points" if x.numbers is None else "both"
    traces = tuple(
        Trace(label, along[order][span], y[span], style, k)
        for k, (label, y) in enumerate(zip(labels[:_MOST], curves, strict=False))
        if np.isfinite(y).any()
    )
    y_axis = Axis(number_label(number.name), unit_label(number.unit))
    chart = _chart(number, _abscissa(x), y_axis, traces=traces, sheet=sheet)
    # The map of the same number has the title itself.
    return chart if sheet else replace(chart, title=f"{chart.title} over {x.short}")


def _map(x: Parameter, y: Parameter, number: Column, values: Array) -> Chart:
    """Map over two parameters: values (n_x, n_y)."""
    X, Y = np.array(x.numbers, float), np.array(y.numbers, float)
    i, j = np.argsort(X, kind="stable"), np.argsort(Y, kind="stable")
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    same = high - low <= _SAME * max(abs(low), abs(high))
    scale = Axis(number_label(number.name), unit_label(number.unit))
    m = Map(X[i], Y[j], values[np.ix_(i, j)], scale, low=low, top=low if same else high)
    chart = _chart(number, _abscissa(x), _abscissa(y), maps=(m,))
    if not same:
        return chart
    everywhere = f"{low:.5g} {unit_label(number.unit)}".rstrip() + " everywhere"
    return replace(chart, case=", ".join(filter(None, (chart.case, everywhere))))


def _abscissa(parameter: Parameter) -> Axis:
    if parameter.numbers is not None:
        return Axis(parameter.short, unit_label(parameter.unit))
    return Axis(
        parameter.short,
        low=-0.5,
        high=len(parameter.values) - 0.5,
        ticks=tuple(enumerate(map(str, parameter.values))),
    )


# -- samples ---------------------------------------------------------------------------------------


def sample_charts(numbers: Sequence[SampledNumber], values: Sequence[Array]) -> list[Chart]:
    """A histogram of every number that the inputs move.

    Parameters
    ----------
    numbers
        What the sample makes of them.
    values
        (1 + n,) of each in its unit, the first with every input at its value; NaN where there is
        none.
    """
    drawn = [(one, v[1:][np.isfinite(v[1:])]) for one, v in zip(numbers, values, strict=True)]
    return [_histogram(one, mine) for one, mine in drawn if len(mine) and np.ptp(mine)][
        :MOST_PANELS
    ]


def _histogram(one: SampledNumber, drawn: Array) -> Chart:
    """Points in bins as wide as Freedman and Diaconis or Sturges have them."""
    counts, edges = np.histogram(drawn, bins="auto")
    x, y = np.repeat(edges, 2), np.concatenate([[0], np.repeat(counts, 2), [0]]).astype(float)
    bands: list[Band] = []
    if one.nominal is not None and one.first_order is not None:
        half = abs(one.nominal) * one.first_order
        bands.append(Band("first order", "x", one.nominal - half, one.nominal + half, colour=1))
    if one.nominal is not None and one.band is not None and one.mean is not None:
        half = abs(one.nominal) * one.band
        bands.append(Band("band of the sample", "x", one.mean - half, one.mean + half, -1, True))
    nominal = []
    if one.nominal is not None:
        line = np.array([one.nominal, one.nominal]), np.array([0.0, float(counts.max())])
        nominal.append(Trace("inputs as given", *line, outline=True))
    return Chart(
        number_label(one.name),
        Axis(number_label(one.name), unit_label(one.unit)),
        Axis("points", low=0.0),
        (Trace("sampled", x, y), *nominal),
        areas=(Area("", x, np.zeros(len(x)), y),),
        bands=tuple(bands),
        case=one.case,
        figure=SAMPLE_FIGURE,
        note=one.verdict,
        size=(5.2, 3.9),
        heading="What the sample makes of every number",
    )
