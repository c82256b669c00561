r"""Peaks of a response as functions of F_C/F_E, solved where they are asked for.

With every gap closed at rest, static and dynamic loads scaled by s scale the answer by s: peaks per
newton of F_E depend on r = F_C/F_E alone, and one followed curve serves every pair of forces. At a
peak with the factor q on the dynamic loads, r = r_1/q with r_1 that of the problem as given,

    d ln(h/q) / d ln r = 1 - d ln h / d ln q,

from the exact derivative of the followed peak (`upd.hbm.peak_sensitivity`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError
from upd.hbm.balance import Balance
from upd.hbm.checks import sticking_margin
from upd.hbm.parameter_change import ParameterChange
from upd.hbm.peak_sensitivity import peak_derivatives
from upd.hbm.peaks import Peak, climb, follow_to
from upd.hbm.starts import first_point

FloatArray = NDArray[np.float64]
#: where a peak that sticks begins to be followed, beside the F_C/F_E at which it ceases to
BESIDE = 1e-3
#: change of frequency from its neighbours beyond which a peak of a whole curve is another one
NEXT = 0.01
#: difference of ln(F_C/F_E) that is none
ROUNDING = 1e-12
#: F_C/F_E beyond which a peak that never sticks is not asked for, as a factor, and halvings
_FAR, _HALVINGS = 1e9, 60


class PeakStart(NamedTuple):
    """Where a peak begins to be followed: its name, and its frequency [Hz] while points stick."""

    name: str
    frequency: float


class SeenPeak(NamedTuple):
    """A peak of a whole curve: its name, frequency [Hz], and the unknowns of a point near it."""

    name: str
    frequency: float
    x: FloatArray


#: F_C/F_E -> the peaks of the whole curve; None where it was not followed through
Search = Callable[[float], Sequence[SeenPeak] | None]


@dataclass(frozen=True)
class PeakPoint:
    """A followed peak at one F_C/F_E.

    Attributes
    ----------
    log_ratio : float
        ln(F_C/F_E).
    frequency : float
        [Hz]
    log_height : float
        ln of the height per unit of F_E.
    slope : float
        Its derivative by ln(F_C/F_E); nan where it was not found.
    by : (n,) ndarray
        Its derivatives by the parameters; nan where they were not found.
    peak : Peak
        With the unknowns.
    factor : float
        On the dynamic loads.
    """

    log_ratio: float
    frequency: float
    log_height: float
    slope: float
    by: FloatArray
    peak: Peak
    factor: float


@dataclass
class FollowedPeak:
    """One peak over F_C/F_E.

    Attributes
    ----------
    name : str
    sticks_from : float
        ln(F_C/F_E) from which every point sticks at the peak; inf where none does.
    points : dict
        ln(F_C/F_E) -> point.
    absent : set of float
        Where the whole curve has no such peak.
    lost : float
        ln(F_C/F_E) up to which the peak was not reached; -inf where it always was.
    failed : set of float
        Where it was not reached.
    why : str
        Why not.
    """

    name: str
    start: PeakStart
    sticks_from: float
    points: dict[float, PeakPoint] = field(default_factory=dict)
    absent: set[float] = field(default_factory=set)
    lost: float = -math.inf
    failed: set[float] = field(default_factory=set)
    why: str = ""

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """ln(F_C/F_E) between solved points, or from -inf to the first, between which it was not
        reached.
        """
        return self._without(self.failed)

    @property
    def holes(self) -> list[tuple[float, float]]:
        """The same, and where the whole curve has no such peak."""
        return self._without(self.failed | self.absent)

    def _without(self, places: set[float]) -> list[tuple[float, float]]:
        points = [-math.inf, *sorted(self.points)]
        return [(a, b) for a, b in pairwise(points) if any(a < s < b for s in places)]

    def is_absent(self, s: float) -> bool:
        """Whether it is not there, as at a place nearer to its points."""
        if not self.points:
            return False
        low, high = min(self.points), max(self.points)
        return any(s <= t < low or high < t <= s or s == t for t in self.absent)


def _is_next(one: FollowedPeak, s: float, frequency: float) -> bool:
    """Whether a peak may be one of a branch: its frequency is that of the nearest point, or between
    those of both neighbours.
    """
    if not one.points:
        return True
    below = max((t for t in one.points if t < s), default=None)
    above = min((t for t in one.points if t > s), default=None)
    f = [one.points[t].frequency for t in (below, above) if t is not None]
    return min(f) / (1.0 + NEXT) <= frequency <= max(f) * (1.0 + NEXT)


class FollowedPeaks:
    """Peaks of |row @ q| w^power per unit of F_E, over F_C/F_E.

    Parameters
    ----------
    balance : Balance
        Homogeneous: no gaps at rest.
    row : (n_dof,) array_like
        Weighs the displacements.
    ratio : float
        F_C/F_E of the balance as given.
    starts : sequence of PeakStart
        The peaks.
    highest : float
        Largest F_C/F_E that will be asked for: where a peak that never sticks begins.
    unit : float
        Height per w^power mm of the balance as given: 1/F_E, and factors of units.
    harmonic : int, optional
        Its number; the lowest above 0 by default.
    power : float
        Of the angular frequency: 2 for accelerations.
    changes : sequence of ParameterChange
        One for the logarithm of each parameter, at the same F_C and F_E.
    search : callable, optional
        The whole curve, where a peak that never sticks begins and where one cannot be followed.
    told : callable, optional
        Called with a name and F_C/F_E before a peak is followed there.
    kept : callable, optional
        Called after every solved point.
    """

    def __init__(
        self,
        balance: Balance,
        row: ArrayLike,
        ratio: float,
        starts: Sequence[PeakStart],
        *,
        highest: float,
        unit: float = 1.0,
        harmonic: int | None = None,
        power: float = 2.0,
        changes: Sequence[ParameterChange] = (),
        search: Search | None = None,
        told: Callable[[str, float], None] | None = None,
        kept: Callable[[], None] | None = None,
    ) -> None:
        self.balance, self.row, self.ratio = balance, np.asarray(row, float), ratio
        self.unit, self.harmonic, self.power = unit, harmonic, power
        self.changes, self.told, self.kept = tuple(changes), told, kept
        self.highest = math.log(highest)
        self.solved = 0
        #: ln(F_C/F_E) of whole curves -> whether it was followed through
        self.scanned: dict[float, bool] = {}
        self._search = search
        self.peaks = [FollowedPeak(one.name, one, self._sticks_from(one)) for one in starts]
        if search is not None and any(one.sticks_from > self.highest for one in self.peaks):
            # stuck peaks are none of the response: those of the whole curve are
            self.peaks = []

    def at(self, log_ratio: float, wanted: Collection[str] = ()) -> dict[str, PeakPoint]:
        """All peaks that are reached at this ln(F_C/F_E).

        Parameters
        ----------
        log_ratio : float
        wanted : collection of str
            Names of those that are; all when empty.

        Returns
        -------
        dict
            Name -> point.
        """
        found, s = {}, float(log_ratio)
        if not self.peaks:
            self.scan(self.highest)
        for one in [p for p in self.peaks if not wanted or p.name in wanted]:
            near = min(one.points, key=lambda t: abs(t - s), default=s)
            # rounding makes no other place
            point = self._of(one, near if abs(near - s) <= ROUNDING else s)
            if point is not None:
                found[one.name] = point
        return found

    def _of(self, one: FollowedPeak, s: float) -> PeakPoint | None:
        if s in one.points:
            return one.points[s]
        if s <= one.lost or one.is_absent(s) or any(a < s < b for a, b in one.gaps):
            return None
        if not one.points and not self._begin(one):
            return None
        if s >= one.sticks_from:
            # the linear answer: the same per unit of F_E
            return replace(one.points[max(one.points)], log_ratio=s)
        return self._followed(one, s)

    def _begin(self, one: FollowedPeak) -> bool:
        """The first point: where the peak still sticks, or at the highest F_C/F_E."""
        f = one.start.frequency
        s = one.sticks_from + BESIDE if math.isfinite(one.sticks_from) else self.highest
        top = self._climbed(s, f)
        if math.isfinite(one.sticks_from) and (
            top is None or abs(top.frequency / f - 1.0) > BESIDE
        ):
            # what sticks there is not the peak
            one.sticks_from, s = math.inf, self.highest
            top = self._climbed(s, f)
        if top is None or not top.found:
            one.lost, one.why = math.inf, "no solution to begin from" if top is None else top.status
            return False
        self._keep(one, s, top, self._factor(s))
        return True

    def _climbed(self, s: float, f: float) -> Peak | None:
        """The peak uphill from a frequency."""
        b = self._loaded(self._factor(s))
        x = first_point(b, f)
        if x is None:
            return None
        return climb(b, self.row, x, f, harmonic=self.harmonic, power=self.power)

    def _followed(self, one: FollowedPeak, s: float) -> PeakPoint | None:
        if self.told is not None:
            self.told(one.name, math.exp(s))
        near = sorted(one.points.values(), key=lambda p: abs(p.log_ratio - s))[:2]
        path = [(p.factor, p.peak) for p in near[::-1]]
        begun = len(path)
        factor = self._factor(s)
        why = follow_to(
            self.balance, self.row, path, factor, harmonic=self.harmonic, power=self.power
        )
        for reached, peak in path[begun:]:
            self._keep(one, s if reached == factor else self._log_ratio(reached), peak, reached)
        if why and self._search is not None and self.scan(s):
            if s in one.points:
                return one.points[s]
            one.absent.add(s)
            return None
        if why:
            one.failed.add(s)
            one.why = f"{one.name} was not followed to F_C/F_E {math.exp(max(one.failed)):.4g}"
            return None
        return one.points[s]

    def scan(self, s: float) -> bool:
        """Solve the whole curve at one ln(F_C/F_E) and take over peaks that are not known there.

        Returns
        -------
        bool
            Whether it was followed through.
        """
        if s in self.scanned or self._search is None:
            return self.scanned.get(s, False)
        found = self._search(math.exp(s))
        self.scanned[s] = found is not None
        factor = self._factor(s)
        b = self._loaded(factor)
        for name, f, x in found or ():
            top = climb(b, self.row, x, f, harmonic=self.harmonic, power=self.power)
            if top.found:
                self._take_over(name, s, top, factor)
        return found is not None

    def _take_over(self, name: str, s: float, top: Peak, factor: float) -> None:
        """A peak of a whole curve, unless it is one of those known there."""
        known = [(one, one.points[s]) for one in self.peaks if s in one.points]
        stuck = [
            (one, one.points[max(one.points)])
            for one in self.peaks
            if one.points and s >= one.sticks_from
        ]
        if any(abs(p.frequency / top.frequency - 1.0) <= BESIDE for _, p in (*known, *stuck)):
            return
        for other in (name, f"{name}, {top.frequency:.0f} Hz"):
            mine = next((one for one in self.peaks if one.name == other), None)
            if mine is None:
                mine = FollowedPeak(other, PeakStart(other, top.frequency), math.inf)
                self.peaks.append(mine)
            if s not in mine.points and s < mine.sticks_from and _is_next(mine, s, top.frequency):
                break
        else:
            return
        mine.absent.discard(s)
        self._keep(mine, s, top, factor)

    def _keep(self, one: FollowedPeak, s: float, peak: Peak, factor: float) -> PeakPoint:
        """The point of a peak, with its derivatives."""
        self.solved += 1
        omega = 2.0 * np.pi * self._number * peak.frequency
        height = self.unit * omega**self.power * peak.amplitude / factor
        slope, by = self._slopes(peak, factor)
        if s >= one.sticks_from:
            slope = 0.0
        one.points[s] = PeakPoint(s, peak.frequency, math.log(height), slope, by, peak, factor)
        if self.kept is not None:
            self.kept()
        return one.points[s]

    def _slopes(self, peak: Peak, factor: float) -> tuple[float, FloatArray]:
        b = self._loaded(factor)
        changes = [ParameterChange(dynamic=b.dynamic), *self.changes]
        try:
            found = peak_derivatives(
                b,
                self.row,
                peak.x,
                peak.frequency,
                changes,
                harmonic=self.harmonic,
                power=self.power,
            )
        except ConvergenceError:
            return math.nan, np.full(len(self.changes), math.nan)
        relative = found.by_height / found.height
        return float(1.0 - relative[0]), relative[1:]

    @property
    def _number(self) -> int:
        """Of the harmonic that is read."""
        return int(self.balance.harmonics.dynamic[self.balance.harmonics.place(self.harmonic)])

    def _loaded(self, factor: float) -> Balance:
        return self.balance.with_loads(1.0, factor)

    def _factor(self, s: float) -> float:
        return self.ratio / math.exp(s)

    def _log_ratio(self, factor: float) -> float:
        return math.log(self.ratio / factor)

    def _sticks_from(self, start: PeakStart) -> float:
        """ln(F_C/F_E) from which the stuck answer holds at the peak's frequency."""
        omega = 2.0 * np.pi * start.frequency

        def sticks(s: float) -> bool:
            b = self._loaded(self._factor(s))
            return bool(sticking_margin(b, b.stuck(omega)) >= 1.0)

        low, high = self.highest - math.log(_FAR), self.highest + math.log(_FAR)
        if not sticks(high):
            return math.inf
        if sticks(low):
            return low
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if sticks(middle) else (middle, high)
        return high
