r"""Peaks of a response as functions of F_C/F_E, solved where they are asked for.

With every gap closed at rest, static and dynamic loads scaled by s scale the answer by s: peaks per
newton of F_E depend on r = F_C/F_E alone, and one followed curve serves every pair of forces. At a
peak with the factor q on the dynamic loads, r = r_1/q with r_1 that of the problem as given,

    d ln(h/q) / d ln r = 1 - d ln h / d ln q,

from the exact derivative of the followed peak (`upd.hbm.peak_sensitivity`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
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
#: F_C/F_E beyond which a peak that never sticks is not asked for, as a factor, and halvings
_FAR, _HALVINGS = 1e9, 60


class PeakStart(NamedTuple):
    """Where a peak begins to be followed: its name, and its frequency [Hz] while points stick."""

    name: str
    frequency: float


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
    lost : float
        ln(F_C/F_E) below which the peak was not reached; -inf where it always was.
    why : str
        Why not.
    """

    name: str
    start: PeakStart
    sticks_from: float
    points: dict[float, PeakPoint] = field(default_factory=dict)
    lost: float = -math.inf
    why: str = ""


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
    told : callable, optional
        Called with a name and F_C/F_E before a peak is followed there.
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
        told: Callable[[str, float], None] | None = None,
    ) -> None:
        self.balance, self.row, self.ratio = balance, np.asarray(row, float), ratio
        self.unit, self.harmonic, self.power = unit, harmonic, power
        self.changes, self.told = tuple(changes), told
        self.highest = math.log(highest)
        self.solved = 0
        self.peaks = [FollowedPeak(one.name, one, self._sticks_from(one)) for one in starts]

    def at(self, log_ratio: float) -> dict[str, PeakPoint]:
        """All peaks that are reached at this ln(F_C/F_E).

        Parameters
        ----------
        log_ratio : float

        Returns
        -------
        dict
            Name -> point.
        """
        found = {}
        for one in self.peaks:
            point = self._of(one, float(log_ratio))
            if point is not None:
                found[one.name] = point
        return found

    def _of(self, one: FollowedPeak, s: float) -> PeakPoint | None:
        if s in one.points:
            return one.points[s]
        if s <= one.lost:
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
        if why:
            lowest = min(one.points)
            if s < lowest:
                one.lost = max(one.lost, s)
                one.why = f"{one.name} was followed down to F_C/F_E {math.exp(lowest):.4g}"
            return None
        return one.points[s]

    def _keep(self, one: FollowedPeak, s: float, peak: Peak, factor: float) -> PeakPoint:
        """The point of a peak, with its derivatives."""
        self.solved += 1
        omega = 2.0 * np.pi * self._number * peak.frequency
        height = self.unit * omega**self.power * peak.amplitude / factor
        slope, by = self._slopes(peak, factor)
        if s >= one.sticks_from:
            slope = 0.0
        one.points[s] = PeakPoint(s, peak.frequency, math.log(height), slope, by, peak, factor)
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
