"""What a choice of damper found: its optimum over the ranges, the nominal one, how both were found,
what moves them, and how far F_C, F_E and other parameters may move until the worst peak has grown
by so much, on whole curves that were solved there and up to there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from upd.hbm.peaks.over import SAME
from upd.sizing.ranges import FORCE, TURNING, InputRange, Ranges
from upd.sizing.rig_peaks import RigPeaks
from upd.sizing.worst_peak import FINE, ROUNDS, STILL, LowestWorst, WorstPeak

Array = NDArray[np.float64]
#: what is minimised: peaks per newton of F_E, accelerations
Objective = Literal["peak", "acceleration"]
UNITS_OF: dict[Objective, str] = {"peak": "(m/s2)/N", "acceleration": "m/s2"}
#: growths of the worst peak up to which parameters may move
GROWTHS = (1.05, 1.10)
#: ln(F_C/F_E) between an end and the whole curve that it comes from
STILL_AT = 5e-3
#: points between which curves are searched
_FINE = 801
#: at which bound F_C is
_BOUNDS = {"at the lower bound": "lower", "at the upper bound": "upper"}


@dataclass(frozen=True)
class Reach:
    """Up to where the worst peak stays below some growth.

    Attributes
    ----------
    end : float
        In N; nan where it does up to the end of what was asked, and where it is not known.
    why : str
        Why it is not known; "" where it is.
    """

    end: float
    why: str = ""


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
        `GROWTHS`: what sets F_C, and the ends of the range of F_E.
    robust_at_nominal : float
        Peak of the robust optimum with the scene's own values; nan where it is not known.
    nominal_at_worst : float
        Worst peak of the nominal optimum over all ranges; nan where it is not known.
    settled : (bool, bool)
        Whether both are known to the step of a jump; else they are the highest of whole curves,
        with jumps between that may hide a higher one.
    """

    ranges: Ranges
    objective: Objective
    stiffness: str
    tried: tuple[Tried, ...]
    refused: tuple[str, ...]
    seconds: float
    reaches: Mapping[str, tuple[tuple[Reach, Reach], ...]]
    robust_at_nominal: float
    nominal_at_worst: float
    settled: tuple[bool, bool]

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
        return sum(rig.curves for one in self.tried for _, rig in one.rigs)

    @property
    def resumed(self) -> int:
        """Points kept of earlier calls."""
        return sum(rig.peaks.resumed for one in self.tried for _, rig in one.rigs)

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """F_C/F_E of the optimum between which no whole curve with peaks is known."""
        c, f = self.best.best.log_centrifugal, self.best.worst.f
        out = []
        for low, high in (pair for one in self.best.worst.peaks for pair in one.holes):
            ends = max(low, c - f[1]), min(high, c - f[0])
            if ends[0] < ends[1]:
                out.append((math.exp(ends[0]), math.exp(ends[1])))
        return list(dict.fromkeys(out))


# -- how far the optimum reaches -------------------------------------------------------------------


def how_far(worst: WorstPeak, found: LowestWorst, growth: float, bound: float) -> Reach:
    """F_C up to which the worst peak stays below so many times its least, on whole curves.

    Parameters
    ----------
    worst, found
        The worst peaks, and where they are least.
    growth
        1.05 for 5 %.
    bound
        F_C [N] up to which it is sought, on either side.
    """
    c, way = found.log_centrifugal, math.copysign(1.0, math.log(bound) - found.log_centrifugal)
    end = max(math.log(bound), worst.known_from())

    def read() -> tuple[Array, Array]:
        grid, values = worst.over(*sorted((c, end)))
        return (grid, values) if way > 0.0 else (grid[::-1], values[::-1])

    def settle(at: float, limit: float) -> bool | None:
        ends = (c, at) if way > 0.0 else (at, c)
        return _settled(worst, ends, limit, None)

    def solve(at: float) -> bool:
        return worst.look(at, STILL_AT)

    return _reached(found.log_worst + math.log(growth), read, solve, settle, end)


def how_far_force(
    worst: WorstPeak, found: LowestWorst, growth: float, way: float, bound: float
) -> Reach:
    """F_E up to which a range of it may be widened at the optimum's F_C.

    Parameters
    ----------
    worst, found, growth
        As of `how_far`.
    way
        -1.0 for the lower end of the range, 1.0 for the upper one.
    bound
        F_E [N] up to which it is sought.
    """
    c, begin = found.log_centrifugal, worst.f[0 if way < 0.0 else 1]
    # between the F_C/F_E that are known
    s = (min(one.nodes[-1] for one in worst.peaks), max(one.known_from for one in worst.peaks))
    end = max(math.log(bound), c - s[0]) if way < 0.0 else min(math.log(bound), c - s[1])
    if (end - begin) * way <= SAME:
        return Reach(math.nan)

    def read() -> tuple[Array, Array]:
        f = np.linspace(begin, end, max(2, math.ceil(abs(end - begin) / FINE) + 1))
        return f, worst.single(c, f)

    def solve(at: float) -> bool:
        solved = [one.look_unless_known(c - at, STILL_AT) for one in worst.peaks]
        return any(solved)

    def settle(at: float, limit: float) -> bool | None:
        # F_C whose windows cover these F_C/F_E
        ends = (c, c + begin - at) if way < 0.0 else (c + begin - at, c)
        return _settled(worst, ends, limit, max(at, worst.f[1]))

    return _reached(found.log_worst + math.log(growth), read, solve, settle, end)


def _settled(
    worst: WorstPeak, ends: tuple[float, float], limit: float, most: float | None
) -> bool | None:
    """Solve a whole curve that decides whether worst peaks between two ln F_C pass a limit: whether
    one was; None where one is not known.
    """
    if not worst.is_whole(ends):
        return None
    return worst.settle(ends, limit, most, math.inf) or worst.clear(ends, limit, most)


def _reached(
    limit: float,
    read: Callable[[], tuple[Array, Array]],
    solve: Callable[[float], bool],
    settle: Callable[[float, float], bool | None],
    end: float,
) -> Reach:
    """The first place beyond a limit, whole curves solved there and up to there until it stays.

    Parameters
    ----------
    limit
        ln of the worst peak.
    read
        Places from the optimum on, and ln of the worst peaks that are read there.
    solve
        The whole curves that decide a place: whether any is new.
    settle
        Whole curves up to a place: whether any is new, None where one is not known.
    end
        The last place.
    """
    for _ in range(ROUNDS):
        at = beyond(*read(), limit)
        while new := settle(end if math.isnan(at) else at, limit):
            at = beyond(*read(), limit)
        if new is None:
            return Reach(math.nan, "no whole curve was followed through on the way")
        if math.isnan(at) or not solve(at):
            return Reach(math.exp(at))
    return Reach(math.nan, f"whole curves and what is read between differ after {ROUNDS} of them")


def beyond(places: Array, values: Array, limit: float) -> float:
    """The first place beyond a limit; nan where there is none."""
    over = np.flatnonzero(values > limit)
    return float(places[over[0]]) if over.size else math.nan


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
