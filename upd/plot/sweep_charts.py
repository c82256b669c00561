"""Charts of a sweep: curves over one parameter, filled maps over two, small multiples over more."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from upd.labels import file_name, unit_label
from upd.plot.chart import Array, Axis, Chart, Map, Trace
from upd.results.quantities import number_label, number_title

#: charts on one sheet, and sheets, at most: more is no figure any more
MOST_PANELS, MOST_SHEETS = 24, 24
#: curves in one chart beside a map: of more one loses track
_CURVES = 8
_SIZE = (5.0, 3.9)
#: figure of all numbers over up to two parameters
_FIGURE = "sweep"
#: figure of what a sample makes of all numbers
SAMPLE_FIGURE = "sample"
#: relative spread up to which a number is the same everywhere
_SAME = 1e-9


class Varied(Protocol):
    """A parameter of the grid.

    Path in the scene, unit, its values, and as numbers (None when they are words).
    """

    @property
    def path(self) -> str: ...

    @property
    def unit(self) -> str: ...

    @property
    def values(self) -> tuple[Any, ...]: ...

    @property
    def numbers(self) -> tuple[float, ...] | None: ...


class FollowedNumber(Protocol):
    """A number followed over the grid.

    Name, case, unit and values (n_point,), nan where there is none.
    """

    @property
    def name(self) -> str: ...

    @property
    def case(self) -> str: ...

    @property
    def unit(self) -> str: ...

    @property
    def values(self) -> Array: ...


@dataclass(frozen=True)
class Followed:
    """A followed number as data.

    Name, case, unit and values (n_point,), the last parameter of the grid fastest.
    """

    name: str
    case: str
    unit: str
    values: Array


def sweep_charts(parameters: Sequence[Varied], numbers: Sequence[FollowedNumber]) -> list[Chart]:
    """Charts of all followed numbers over what varies.

    Parameters
    ----------
    parameters
        All parameters of the grid.
    numbers
        What is followed; those that nothing changes come last, those without any value are left
        out.

    Returns
    -------
    list of Chart
        Over one parameter a curve per number. Over two with numbers a filled map, and curves beside
        it for the page; with words a curve per word. Over more, for each number a sheet
        ``sweep-<number>`` of maps or curves on one scale, one for each combination of the others.
        Failed points are gaps in curves and crosses on maps.
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
    if len(varied) > 2:
        return [
            chart
            for number, grid in grids[:MOST_SHEETS]
            for chart in _multiples(varied, number, grid)
        ]
    return _plain_charts(varied, grids)


def is_constant(values: Array) -> bool:
    """Whether the points have one value, up to rounding."""
    known = np.asarray(values, float)[np.isfinite(values)]
    return not known.size or float(np.ptp(known)) <= _SAME * float(np.abs(known).max())


def _plain_charts(
    varied: Sequence[Varied], grids: Sequence[tuple[FollowedNumber, Array]]
) -> list[Chart]:
    """Charts over one or two parameters."""
    if len(varied) == 1:
        return [_curves(varied[0], None, number, grid) for number, grid in grids]
    maps: list[Chart] = []
    if all(p.numbers is not None for p in varied):
        maps = [_map(varied[0], varied[1], number, grid) for number, grid in grids]
    # Along x what has numbers, and more of them.
    x = max(reversed(varied), key=lambda p: (p.numbers is not None, len(p.values)))
    other = varied[1] if x is varied[0] else varied[0]
    if maps and len(other.values) > _CURVES:
        return maps
    curves = [
        _curves(x, other, number, np.moveaxis(grid, varied.index(x), -1), sheet=not maps)
        for number, grid in grids
    ]
    return maps + curves


def _multiples(varied: Sequence[Varied], number: FollowedNumber, grid: Array) -> list[Chart]:
    """One chart per combination of what is not drawn along x and y, all on one scale of values."""
    longest = sorted((p for p in varied if p.numbers is not None), key=lambda p: -len(p.values))
    inside = (
        longest[:2]
        if len(longest) > 1
        else [*longest[:1], *(p for p in varied if p not in longest)][:1]
    )
    outside = [p for p in varied if p not in inside]
    moved = np.moveaxis(grid, [varied.index(p) for p in [*outside, *inside]], range(grid.ndim))
    limits = float(np.nanmin(grid)), float(np.nanmax(grid))
    every = itertools.product(*(range(len(p.values)) for p in outside))
    charts = []
    for index in itertools.islice(every, MOST_PANELS):
        values = ", ".join(
            f"{short(p)} = {p.values[k]}" for p, k in zip(outside, index, strict=True)
        )
        place = _Place(values, limits, sheet_name(number.name, number.case), 3)
        if len(inside) == 2:
            charts.append(_map(inside[0], inside[1], number, moved[index], place))
        else:
            charts.append(_curves(inside[0], None, number, moved[index], place))
    return charts


def figure_names(followed: Iterable[tuple[str, str]]) -> set[str]:
    """Names, without ending, that the figures of a sweep may have.

    Parameters
    ----------
    followed
        Name and case of every followed number.
    """
    return {_FIGURE, SAMPLE_FIGURE, *(sheet_name(name, case) for name, case in followed)}


def sheet_name(name: str, case: str) -> str:
    """Name of the sheet of a number over more than two parameters, without ending."""
    return f"{_FIGURE}-" + file_name(f"{name} ({case})" if case else name)


class _Place(NamedTuple):
    """Where a chart stands: the values of what is not drawn in it, the ends of its numbers that it
    shares with others, its sheet, and charts side by side there.
    """

    values: str = ""
    limits: tuple[float, float] | None = None
    figure: str = _FIGURE
    columns: int = 2

    def chart(self, number: FollowedNumber, x: Axis, y: Axis, **more: Any) -> Chart:
        """A chart there. Small multiples of one number share its title and are chosen by what
        differs.
        """
        title, case = number_label(number.name), number.case
        if self.values:
            title, case = number_title(number.name, number.case), self.values
        shared: dict[str, Any] = {"figure": self.figure, "columns": self.columns, "size": _SIZE}
        return Chart(title, x, y, case=case, **shared, **more)


_ALONE = _Place()


def _curves(
    x: Varied,
    other: Varied | None,
    number: FollowedNumber,
    values: Array,
    place: _Place = _ALONE,
    *,
    sheet: bool = True,
) -> Chart:
    """Values over one parameter, one curve per value of ``other``."""
    along = (
        np.arange(len(x.values), dtype=float) if x.numbers is None else np.array(x.numbers, float)
    )
    order = np.argsort(along, kind="stable")
    curves = np.atleast_2d(values)[:, order]
    # Ends without a value would only stretch the axis; gaps between values stay.
    solved = np.flatnonzero(np.isfinite(curves).any(axis=0))
    span = (
        slice(solved[0], solved[-1] + 1) if x.numbers is not None and solved.size else slice(None)
    )
    labels = (
        [number_title(number.name, number.case)]
        if other is None
        else [f"{short(other)} {_value(other, k)}" for k in range(len(other.values))]
    )
    style: Any = "points" if x.numbers is None else "both"
    drawn = [
        (k, label, y[span])
        for k, (label, y) in enumerate(zip(labels, curves, strict=True))
        if np.isfinite(y).any()
    ]
    traces = tuple(Trace(label, along[order][span], y, style, k) for k, label, y in drawn)
    y_axis = _ordinate(number, place.limits)
    chart = place.chart(number, _abscissa(x), y_axis, traces=traces, sheet=sheet)
    # The map of the same number has the title itself.
    return chart if sheet else replace(chart, title=f"{chart.title} over {short(x)}")


def _map(
    x: Varied, y: Varied, number: FollowedNumber, values: Array, place: _Place = _ALONE
) -> Chart:
    """Filled map over two parameters: values (n_x, n_y)."""
    X, Y = np.array(x.numbers, float), np.array(y.numbers, float)
    i, j = np.argsort(X, kind="stable"), np.argsort(Y, kind="stable")
    low, high = place.limits or (float(np.nanmin(values)), float(np.nanmax(values)))
    same = high - low <= _SAME * max(abs(low), abs(high))
    scale = Axis(number_label(number.name), unit_label(number.unit))
    m = Map(
        X[i], Y[j], values[np.ix_(i, j)], scale, low=low, top=low if same else high, contours=True
    )
    chart = place.chart(number, _abscissa(x), _abscissa(y), maps=(m,))
    if not same:
        return chart
    everywhere = f"{low:.5g} {unit_label(number.unit)}".rstrip() + " everywhere"
    return replace(chart, case=", ".join(filter(None, (chart.case, everywhere))))


def short(parameter: Varied) -> str:
    """Last word of a parameter's path."""
    return parameter.path.rpartition(".")[2].replace("_", " ")


def _value(parameter: Varied, k: int) -> str:
    """A value in figures with its unit, or the word."""
    if parameter.numbers is None:
        return str(parameter.values[k])
    return f"{parameter.numbers[k]:.6g} {unit_label(parameter.unit)}".rstrip()


def _abscissa(parameter: Varied) -> Axis:
    if parameter.numbers is not None:
        return Axis(short(parameter), unit_label(parameter.unit))
    return Axis(
        short(parameter),
        low=-0.5,
        high=len(parameter.values) - 0.5,
        ticks=tuple(enumerate(map(str, parameter.values))),
    )


def _ordinate(number: FollowedNumber, limits: tuple[float, float] | None) -> Axis:
    """The number with its unit, between the same ends in all charts that share ``limits``."""
    low, high = limits or (0.0, 0.0)
    room = 0.05 * (high - low)
    ends = (low - room, high + room) if room > 0.0 else (None, None)
    return Axis(number_label(number.name), unit_label(number.unit), low=ends[0], high=ends[1])
