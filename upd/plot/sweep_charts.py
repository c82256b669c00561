"""Charts of a sweep: curves over a parameter, one for each value of the others; maps over two.

Of a sample: how often every number came out where, beside its first-order band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from upd.labels import unit_label
from upd.plot.chart import MOST_PANELS, Area, Array, Axis, Band, Chart, Map, Trace
from upd.results.quantities import number_label, number_title
from upd.results.sampled import SampledNumber

#: curves in one chart beside a map: of more one loses track; and at most
_CURVES, _MOST = 8, 24
_SIZE = (5.0, 3.9)
#: figure of all numbers, and of what a sample makes of them
FIGURE, SAMPLE_FIGURE = FIGURES = ("sweep", "sample")
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

    Returns
    -------
    list of Chart
        What varies first. Over one parameter a curve each, over more a curve for each combination
        of the others, the first 24; over two with numbers a filled map before it. Parameters with
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


def _chart(number: FollowedNumber, x: Axis, y: Axis, **more: Any) -> Chart:
    """A chart of a number on the sheet of the sweep."""
    shared: dict[str, Any] = {"case": number.case, "figure": FIGURE, "size": _SIZE}
    return Chart(number_label(number.name), x, y, **shared, **more)


def _curves(
    x: Varied, others: Sequence[Varied], number: FollowedNumber, values: Array, *, sheet: bool
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
        ", ".join(f"{short(p)} {_value(p, k)}" for p, k in zip(others, places, strict=True))
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
    return chart if sheet else replace(chart, title=f"{chart.title} over {short(x)}")


def _map(x: Varied, y: Varied, number: FollowedNumber, values: Array) -> Chart:
    """Filled map over two parameters: values (n_x, n_y)."""
    X, Y = np.array(x.numbers, float), np.array(y.numbers, float)
    i, j = np.argsort(X, kind="stable"), np.argsort(Y, kind="stable")
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    same = high - low <= _SAME * max(abs(low), abs(high))
    scale = Axis(number_label(number.name), unit_label(number.unit))
    m = Map(
        X[i], Y[j], values[np.ix_(i, j)], scale, low=low, top=low if same else high, contours=True
    )
    chart = _chart(number, _abscissa(x), _abscissa(y), maps=(m,))
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
