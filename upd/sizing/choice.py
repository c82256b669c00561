"""What a choice of damper found: its optimum over the ranges, the nominal one, how both were found,
what moves them, and how far F_C, F_E and other parameters may move until the worst peak has grown
by so much, on whole curves that were solved there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from upd.sizing.ranges import FORCE, TURNING, InputRange, Ranges
from upd.sizing.rig_peaks import RigPeaks
from upd.sizing.worst_peak import SLOPE_STEP, LowestWorst, WorstPeak, reached

Array = NDArray[np.float64]
#: what is minimised: peaks per newton of F_E, accelerations
Objective = Literal["peak", "acceleration"]
UNITS_OF: dict[Objective, str] = {"peak": "(m/s2)/N", "acceleration": "m/s2"}
#: growths of the worst peak up to which parameters may move
GROWTHS = (1.05, 1.10)
#: beyond a range of F_E up to which its ends may move, as ln F_E
REACH = 3.0
#: points between which curves are searched
_FINE = 801
#: share of a value within which it lies at a bound
_AT_BOUND = 5e-4
#: at which bound F_C is
_BOUNDS = {"at the lower bound": "lower", "at the upper bound": "upper"}
#: values below and above, nan where they are not known
Span = tuple[float, float]
_UNKNOWN: Span = (math.nan, math.nan)


@dataclass(frozen=True)
class Tried:
    """One place of what is chosen beside F_C.

    Attributes
    ----------
    values : tuple of float
        In the units inside; empty where nothing else is chosen.
    rigs : tuple of (tuple of float, RigPeaks)
        Values of the uncertain inputs -> their rig.
    worst, best : WorstPeak, LowestWorst
        Worst peaks over all ranges, and where they are least.
    plain, nominal : WorstPeak, LowestWorst
        The same of the scene's own values.
    ends : (float, float)
        F_C [N] between which it is sought.
    """

    values: tuple[float, ...]
    rigs: tuple[tuple[tuple[float, ...], RigPeaks], ...]
    worst: WorstPeak
    best: LowestWorst
    plain: WorstPeak
    nominal: LowestWorst
    ends: tuple[float, float]


def best_of(tried: Iterable[Tried]) -> Tried:
    """The robust optimum."""
    return min(tried, key=lambda one: one.best.log_worst)


def curves_of(tried: Iterable[Tried]) -> int:
    """Whole curves that were solved for them in this call."""
    return sum(rig.curves for one in tried for _, rig in one.rigs)


def nominal_of(tried: Iterable[Tried]) -> Tried:
    """The nominal optimum."""
    return min(tried, key=lambda one: one.nominal.log_worst)


def is_along(values: Sequence[float], others: Sequence[float], k: int) -> bool:
    """Whether values are the same but for one of them.

    Parameters
    ----------
    values, others
        Of the same inputs.
    k
        Number of that one.
    """
    return all(
        math.isclose(a, b) for i, (a, b) in enumerate(zip(values, others, strict=True)) if i != k
    )


@dataclass(frozen=True)
class ChosenDamper:
    """The damper with the lowest worst peak, and what is known beside it.

    Attributes
    ----------
    ranges : Ranges
        As asked for.
    objective : {"peak", "acceleration"}
        What is least.
    stiffness : str
        Name of the contact stiffness.
    tried : tuple of Tried
        All places of what is chosen beside F_C, in their order.
    refused : tuple of str
        Values that were not solved, with the reason.
    seconds : float
        Of this call.
    reaches : mapping
        Name of a parameter -> how far it may move down and up from the robust optimum, for each of
        `GROWTHS`: what sets F_C [N], and the ends of the range of F_E [N].
    robust_at_nominal : float
        Peak of the robust optimum with the scene's own values; nan where it is not known.
    nominal_at_worst : float
        Worst peak of the nominal optimum over all ranges; nan where it is not known.
    """

    ranges: Ranges
    objective: Objective
    stiffness: str
    tried: tuple[Tried, ...]
    refused: tuple[str, ...]
    seconds: float
    reaches: Mapping[str, tuple[Span, ...]]
    robust_at_nominal: float
    nominal_at_worst: float

    @property
    def best(self) -> Tried:
        """The robust optimum."""
        return best_of(self.tried)

    def along(self, k: int) -> list[tuple[float, Tried]]:
        """Values of one of the inputs chosen beside F_C and what was tried there, all others as at
        the robust optimum, rising.

        Parameters
        ----------
        k
            Its number among them.
        """
        found = [(t.values[k], t) for t in self.tried if is_along(t.values, self.best.values, k)]
        return sorted(found, key=lambda pair: pair[0])

    @property
    def plain(self) -> Tried:
        """The nominal optimum."""
        return nominal_of(self.tried)

    @property
    def centrifugal(self) -> float:
        """F_C of the robust optimum [N]."""
        return math.exp(self.best.best.log_centrifugal)

    @property
    def worst(self) -> float:
        """Its worst peak."""
        return math.exp(self.best.best.log_worst)

    @property
    def nominal_centrifugal(self) -> float:
        """F_C of the nominal optimum [N]."""
        return math.exp(self.plain.nominal.log_centrifugal)

    @property
    def nominal_peak(self) -> float:
        """Its peak with the scene's own values."""
        return math.exp(self.plain.nominal.log_worst)

    @property
    def curves(self) -> int:
        """Whole curves that were solved in this call."""
        return curves_of(self.tried)

    @property
    def resumed(self) -> int:
        """Points kept of earlier calls."""
        return sum(rig.peaks.resumed for one in self.tried for _, rig in one.rigs)


# -- how far the optimum reaches -------------------------------------------------------------------


def reaches_of(one: Tried, ranges: Ranges) -> dict[str, tuple[Span, ...]]:
    """How far F_C and the ends of the range of F_E may move from the robust optimum until the worst
    peak has grown, for each of `GROWTHS`; nan where it does not grow so far within what is known.

    Parameters
    ----------
    one
        The optimum.
    ranges
        Chosen, and counted over.
    """
    worst, c, found = one.worst, one.best.log_centrifugal, {}
    limits = [one.best.log_worst + math.log(growth) for growth in GROWTHS]
    if ranges.pressing is not None:
        ends = [math.log(end) for end in one.ends]
        found[ranges.pressing.path] = tuple(
            _span(*(reached(lambda at: (worst, at), c, end, limit) for end in ends))
            for limit in limits
        )
    low, high = worst.f
    for of in ranges.during:
        if of.path == FORCE:
            (first, _), (last, _) = of.force_ends
            lower = [
                reached(lambda at: (worst.with_forces(at, high), c), low, low - REACH, limit)
                for limit in limits
            ]
            upper = [
                reached(lambda at: (worst.with_forces(low, at), c), high, high + REACH, limit)
                for limit in limits
            ]
            found[first] = tuple(_span(end, math.nan) for end in lower)
            found[last] = tuple(_span(math.nan, end) for end in upper)
    return found


def _span(low: float, high: float) -> Span:
    return math.exp(low), math.exp(high)


# -- what moves it ---------------------------------------------------------------------------------


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
    """

    path: str
    value: float
    below: float
    above: float
    within: tuple[tuple[float, float], ...]
    bound: str
    of: InputRange


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
    c, read = best.best.log_centrifugal, best.worst.read
    within = [
        (one.value_at(low, scene), one.value_at(high, scene))
        for low, high in found.reaches[one.path]
    ]
    return Sensitivity(
        one.path,
        one.value_at(found.centrifugal, scene),
        power * (read(c) - read(c - SLOPE_STEP)) / SLOPE_STEP,
        power * (read(c + SLOPE_STEP) - read(c)) / SLOPE_STEP,
        tuple(within),
        _BOUNDS.get(best.best.status, ""),
        one,
    )


def _shape(found: ChosenDamper, one: InputRange, k: int) -> Sensitivity:
    """From the values that were tried, all else as at the optimum."""
    line = found.along(k)
    x = np.array([value for value, _ in line])
    y = np.array([tried.best.log_worst for _, tried in line])
    value = found.best.values[k]
    at_low, at_high = (abs(value - end) <= _AT_BOUND * value for end in (one.low, one.high))
    i = int(np.abs(x - value).argmin())

    def end(way: int, growth: float) -> float:
        grid = np.linspace(value, x[way], _FINE)
        over = np.flatnonzero(PchipInterpolator(x, y)(grid) > y[i] + math.log(growth))
        return float(grid[over[0]]) if over.size else math.nan

    whole = len(x) > 1
    within = tuple((end(0, g), end(-1, g)) if whole else _UNKNOWN for g in GROWTHS)
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
    """Of both ends of the range of F_E, F_C as chosen."""
    worst, c = found.best.worst, found.best.best.log_centrifugal
    out = []
    for k, (name, end) in enumerate(one.force_ends):
        y = []
        for step in (-SLOPE_STEP, 0.0, SLOPE_STEP):
            moved = [f + step * (i == k) for i, f in enumerate(worst.f)]
            y.append(worst.with_forces(*moved).read(c))
        below, above = np.diff(y) / SLOPE_STEP
        out.append(Sensitivity(name, end, below, above, found.reaches[name], "", one))
    return out


def _unsure(found: ChosenDamper, one: InputRange) -> Sensitivity:
    """From the values that were solved, all others as at the worst."""
    best, ranges = found.best, found.ranges
    k = ranges.unsure.index(one)
    c, weight = best.best.log_centrifugal, best.worst.weight
    heights = {w: WorstPeak([rig.peaks], ranges.forces, weight).read(c) for w, rig in best.rigs}
    worst = max(heights, key=lambda w: heights[w])
    line = sorted((w[k], y) for w, y in heights.items() if is_along(w, worst, k))
    values, y = np.array(line).T
    top = int(y.argmax())
    bound = "lower" if top == 0 else "upper" if top == len(values) - 1 else ""
    slopes = _beside(values, y, top)
    name = f"{one.path}, worst"
    return Sensitivity(name, worst[k], *slopes, (_UNKNOWN, _UNKNOWN), bound, one)
