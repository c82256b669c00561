"""Solved peaks over F_C/F_E, and the curves between them: cubics of their values and slopes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from upd.errors import ConvergenceError
from upd.hbm.followed_peaks import FollowedPeaks

Array = NDArray[np.float64]
#: ln(F_C/F_E) between the points of the first scan of peaks that are followed, and of swept ones
FOLLOWED_STEP, SWEPT_STEP = 0.35, 0.5
#: how a peak was found that was not followed
SWEEPS = "sweeps"
#: points closer than this are one
SAME = 1e-6
#: below the highest peak on the curves beyond which another one is not solved, as a logarithm
_FAR = 0.1
#: difference of frequencies and heights of branches that are one, and of heights on the curves
_ALIKE, _MET = 1e-4, 1e-6
#: step of slopes that are read from a curve
_STEP = 2e-3


class SweptPeak(NamedTuple):
    """The highest peak where none can be followed: logarithms of its height and of that on the
    lower of two sweeps, frequency [Hz], how it was found.
    """

    log_height: float
    log_low: float
    frequency: float
    how: str


#: ln(F_C/F_E) -> the highest peak there, None where it is not known
Elsewhere = Callable[[float], SweptPeak | None]


class Deciding(NamedTuple):
    """A solved point that decides a worst peak: ln(F_C/F_E), ln of the height, slope g of the worst
    peak that it decides by ln F_C, derivatives by parameters, frequency [Hz], peak's name, share l
    in the optimum's conditions.
    """

    s: float
    y: float
    slope: float
    by: Array
    frequency: float
    name: str
    share: float = 0.0


class PeaksOverRatio:
    """Solved peaks over s = ln(F_C/F_E), and the curves between them.

    Parameters
    ----------
    followed
        Peaks that are followed.
    low, high
        ln(F_C/F_E) that may be asked for.
    elsewhere
        The highest peak where one is lost; None: nothing is known there.
    swept
        Such that are known, by ln(F_C/F_E).
    """

    def __init__(
        self,
        followed: FollowedPeaks,
        low: float,
        high: float,
        elsewhere: Elsewhere | None = None,
        swept: dict[float, SweptPeak] | None = None,
    ) -> None:
        self.followed, self.low, self.high = followed, low, high
        self._elsewhere = elsewhere
        self.swept = {} if swept is None else swept
        self.unknown: list[float] = []
        count = math.ceil((high - low) / FOLLOWED_STEP) + 1
        self._places = np.linspace(high, low, count)
        for s in self._places:
            followed.at(float(s))
        self.join(low)
        if elsewhere is not None:
            for a, b in self.gaps:
                for s in np.linspace(a, b, math.ceil((b - a) / SWEPT_STEP) + 1):
                    self._sweep(float(s))

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """ln(F_C/F_E) between which a peak was not followed, rising."""
        out: list[tuple[float, float]] = []
        for a, b in sorted(pair for one in self.followed.peaks for pair in one.gaps):
            low, high = max(a, self.low), min(b, self.high)
            if low >= high:
                continue
            if out and low <= out[-1][1]:
                out[-1] = out[-1][0], max(high, out[-1][1])
            else:
                out.append((low, high))
        return out

    @property
    def known_from(self) -> float:
        """ln(F_C/F_E) from which the highest peak is known, but for gaps between followed peaks."""
        if self._elsewhere is not None:
            return max([self.low, *self.unknown])
        return max([self.low, *(b for a, b in self.gaps if a <= self.low)])

    def is_known(self, s: float) -> bool:
        """Whether peaks are followed at a place."""
        return not any(a < s < b for a, b in self.gaps)

    def join(self, s: float) -> None:
        """Look at the whole curve, and follow peaks to which the others do not lead from there."""
        before = {one.name for one in self.followed.peaks}
        self.followed.scan(s)
        new = {one.name for one in self.followed.peaks} - before
        if not new:
            return
        below, above = self._places[self._places < s], self._places[self._places > s][::-1]
        for name in new:
            for way in (below, above):
                for t in way:
                    self.followed.at(float(t), {name})
                    if self._leads_on(name, float(t)):
                        break

    def _leads_on(self, name: str, s: float) -> bool:
        """Whether a peak is another branch's there, which goes on alike."""
        at = {one.name: one.points[s] for one in self.followed.peaks if s in one.points}
        mine = at.pop(name, None)
        return mine is not None and any(
            abs(p.frequency / mine.frequency - 1.0) + abs(p.log_height - mine.log_height) < _ALIKE
            for p in at.values()
        )

    def _known(self, s: float) -> float:
        """The solved place that s is, or s."""
        known = [*self.swept, *(t for one in self.followed.peaks for t in one.points)]
        near = min(known, key=lambda t: abs(t - s), default=s)
        return near if abs(near - s) < SAME else s

    def _high(self, s: float) -> set[str]:
        """Names of the peaks that may be the highest, by the curves."""
        at = np.array([s])
        heights = {name: float(curve(at)[0]) for name, curve in self.curves().items() if name}
        top = max(heights.values(), default=-math.inf)
        told: dict[str, float] = {}
        for name, y in heights.items():
            # branches that have met are one
            if y >= top - _FAR and all(abs(y - other) > _MET for other in told.values()):
                told[name] = y
        return set(told)

    def _sweep(self, s: float) -> None:
        if self._elsewhere is None or s in self.swept:
            return
        found = self._elsewhere(s)
        if found is None:
            self.unknown.append(s)
        else:
            self.swept[s] = found

    def curves(self) -> dict[str, Callable[[Array], Array]]:
        """Name -> ln height over ln r; -inf where the curve says nothing."""
        out: dict[str, Callable[[Array], Array]] = {}
        for one in self.followed.peaks:
            points = [one.points[s] for s in sorted(one.points)]
            if points:
                out[one.name] = _between(
                    [p.log_ratio for p in points],
                    [p.log_height for p in points],
                    [p.slope for p in points],
                    beyond=math.isfinite(one.sticks_from),
                    holes=one.holes,
                )
        if self.swept:
            s = sorted(self.swept)
            swept = _between(s, [self.swept[t].log_height for t in s], [math.nan] * len(s))
            out[""] = lambda at: np.where(self._in_gaps(at), swept(at), -math.inf)
        return out

    def _in_gaps(self, at: Array) -> NDArray[np.bool_]:
        inside = np.zeros(np.shape(at), bool)
        for a, b in self.gaps:
            inside |= (at >= a) & (at <= b)
        return inside

    def solve(self, s: float) -> Deciding:
        """The highest peak, solved there unless it was."""
        s = self._known(s)
        if self._elsewhere is not None and not self.is_known(s):
            self._sweep(s)
            near = min(self.swept, key=lambda t: abs(t - s))
            found = self.swept[near]
            slope = _slope(self.curves()[""], near, min(self.swept), max(self.swept))
            none = np.full(len(self.followed.changes), math.nan)
            return Deciding(near, found.log_height, slope, none, found.frequency, found.how)
        # where those that may be highest are not found, the whole curve tells others
        told = self.followed.at(s, self._high(s)) or self.followed.at(s)
        if not told:
            raise ConvergenceError(f"no peak was found at F_C/F_E {math.exp(s):.4g}")
        name = max(told, key=lambda one: told[one].log_height)
        p = told[name]
        slope = p.slope
        if math.isnan(slope):
            slope = _slope(self.curves()[name], s, self.low, self.high)
        return Deciding(s, p.log_height, slope, p.by, p.frequency, name)


def _slope(curve: Callable[[Array], Array], s: float, low: float, high: float) -> float:
    ends = np.clip([s - _STEP, s + _STEP], low, high)
    values = curve(ends)
    if not ends[1] > ends[0] or not np.isfinite(values).all():
        # at the rim of what is known
        return math.nan
    return float((values[1] - values[0]) / (ends[1] - ends[0]))


def _between(
    s: Sequence[float],
    y: Sequence[float],
    slope: Sequence[float],
    beyond: bool = False,
    holes: Sequence[tuple[float, float]] = (),
) -> Callable[[Array], Array]:
    """The cubic through values and slopes, slopes that are not known by those of the monotone one;
    -inf outside, unless it is constant beyond, and in holes.
    """
    x, v, g = (np.asarray(part, float) for part in (s, y, slope))
    if len(x) == 1:
        curve: Callable[[Array], Array] = lambda at: np.full(np.shape(at), v[0])  # noqa: E731
    else:
        usual = PchipInterpolator(x, v).derivative()(x) if np.isnan(g).any() else g
        curve = CubicHermiteSpline(x, v, np.where(np.isnan(g), usual, g))

    def value(at: Array) -> Array:
        inside = np.asarray(curve(np.clip(at, x[0], x[-1])), float)
        known = (at >= x[0] - SAME) & ((at <= x[-1] + SAME) | beyond)
        for a, b in holes:
            known &= ~((at > a + SAME) & (at < b - SAME))
        return np.where(known, inside, -math.inf)

    return value
