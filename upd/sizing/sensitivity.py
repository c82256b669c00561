"""What moves the lowest worst peak: derivatives by every parameter, and how far each may go."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from upd.sizing.choice import GROWTHS, ChosenDamper, is_along
from upd.sizing.least_worst import STILL
from upd.sizing.margins import Reach, beyond
from upd.sizing.ranges import FORCE, TURNING, InputRange
from upd.sizing.worst_peak import WorstPeak

Array = NDArray[np.float64]
#: points between which curves are searched
_FINE = 801
#: at which bound F_C is
_BOUNDS = {"at the lower bound": "lower", "at the upper bound": "upper"}


@dataclass(frozen=True)
class Sensitivity:
    """Of the worst peak by one parameter, all others at the optimum.

    Attributes
    ----------
    path : str
        Of the parameter; an end of a range has a word behind it.
    value : float
        At the optimum, in the unit inside.
    below, above : float
        d ln(peak) / d ln(parameter) towards lower and higher values; nan where it is not known.
    within : tuple of (float, float)
        Between which the worst peak grows by less than 5 % and 10 %; nan where it does not within
        what is known.
    bound : str
        "lower" or "upper" where it sits at a bound of its range.
    of : InputRange
        The parameter.
    withheld : tuple of str
        Why ends are withheld.
    """

    path: str
    value: float
    below: float
    above: float
    within: tuple[tuple[float, float], ...]
    bound: str
    of: InputRange
    withheld: tuple[str, ...] = ()


def sensitivities(found: ChosenDamper) -> list[Sensitivity]:
    """Of every parameter chosen or counted over.

    Parameters
    ----------
    found : ChosenDamper
        The optimum.
    """
    out = []
    shapes = found.ranges.shapes
    for one in found.ranges.over:
        out.append(
            _pressing(found, one) if one.only_centrifugal else _shape(found, one, shapes.index(one))
        )
    for one in found.ranges.during:
        out += _forces(found, one) if one.path == FORCE else [_unsure(found, one)]
    return out


def _pressing(found: ChosenDamper, one: InputRange) -> Sensitivity:
    best, scene = found.best, found.ranges.scene
    power = TURNING.get(one.path, 1.0)
    slopes = [p.slope for p in best.best.deciding] or [math.nan]
    reaches = found.reaches[one.path]
    within = [
        (one.value_at(low.end, scene), one.value_at(high.end, scene)) for low, high in reaches
    ]
    return Sensitivity(
        one.path,
        one.value_at(found.centrifugal, scene),
        power * min(slopes),
        power * max(slopes),
        tuple(within),
        _BOUNDS.get(best.best.status, ""),
        one,
        _withheld(reaches),
    )


def _withheld(reaches: Sequence[tuple[Reach, Reach]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(end.why for pair in reaches for end in pair if end.why))


def _shape(found: ChosenDamper, one: InputRange, k: int) -> Sensitivity:
    """From the values that were tried, all else as at the optimum."""
    line = found.along(k)
    x = np.array([value for value, _ in line])
    y = np.array([tried.best.log_worst for _, tried in line])
    value = found.best.values[k]
    at_low, at_high = (abs(value - end) <= STILL * value for end in (one.low, one.high))
    i = int(np.abs(x - value).argmin())

    def end(way: int, growth: float) -> float:
        grid = np.linspace(value, x[way], _FINE)
        return beyond(grid, PchipInterpolator(x, y)(grid), y[i] + math.log(growth))

    whole = len(x) > 1
    within = tuple((end(0, g), end(-1, g)) if whole else (math.nan, math.nan) for g in GROWTHS)
    bound = "lower" if at_low else "upper" if at_high else ""
    return Sensitivity(one.path, value, *_beside(x, y, i), within, bound, one)


def _beside(x: Array, y: Array, i: int) -> tuple[float, float]:
    """Differences dy / d ln x to the neighbours of a place below and above; nan without one."""
    slope = np.diff(y) / np.diff(np.log(x))
    return (
        float(slope[i - 1]) if i > 0 else math.nan,
        float(slope[i]) if i < len(slope) else math.nan,
    )


def _forces(found: ChosenDamper, one: InputRange) -> list[Sensitivity]:
    """Of both ends of the range of F_E: peaks depend on F_C/F_E, so those of the optimum by an end
    of the range are those by F_C with the other sign, times the share of that end.
    """
    best, weight = found.best, found.best.worst.weight
    c = best.best.log_centrifugal
    out = []
    for name, end, _ in one.force_ends:
        f = math.log(end)
        near = [p for p in best.best.deciding if abs(c - p.s - f) < 10.0 * STILL]
        slope = sum(-p.slope * p.share for p in near) + weight * bool(near)
        reaches = found.reaches[name]
        within = tuple((low.end, high.end) for low, high in reaches)
        out.append(Sensitivity(name, end, slope, slope, within, "", one, _withheld(reaches)))
    return out


def _unsure(found: ChosenDamper, one: InputRange) -> Sensitivity:
    """By exact derivatives at the deciding peaks, or else from the values that were solved, all
    others as at the worst.
    """
    best, ranges = found.best, found.ranges
    k = ranges.unsure.index(one)
    c = best.best.log_centrifugal
    known = best.rigs[0][1].known
    place = len(ranges.shapes) + k
    slope = math.nan
    if known[place]:
        j = sum(known[:place])
        slope = float(sum(p.share * p.by[j] for p in best.best.deciding if p.share > 0.0))
    weight = best.worst.weight
    heights = {w: WorstPeak([rig.peaks], ranges.forces, weight).read(c) for w, rig in best.rigs}
    worst = max(heights, key=lambda w: heights[w])
    line = sorted((w[k], y) for w, y in heights.items() if is_along(w, worst, k))
    grid, values = np.array(line).T
    top = int(values.argmax())
    slopes = _beside(grid, values, top) if math.isnan(slope) else (slope, slope)
    none = math.nan, math.nan
    bound = "lower" if top == 0 else "upper" if top == len(grid) - 1 else ""
    return Sensitivity(f"{one.path}, worst", worst[k], *slopes, (none, none), bound, one)
