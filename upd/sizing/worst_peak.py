r"""The F_C whose worst peak over a range of F_E is lowest.

Peaks h per unit of F_E depend on s = ln r = c - f alone, with c = ln F_C and f = ln F_E (see
`upd.hbm.followed_peaks`). The worst over f_1 <= f <= f_2,

    W(c) = max over s in [c - f_2, c - f_1] of y(s) + k (c - s),   y = ln h,

k = 0 for peaks per newton, 1 for accelerations, is the largest value of one curve in a window that
slides with c: every solved point serves all pairs of forces. Between solved points y is the cubic
of their values and slopes. Its least worst is sought on all of it, the points that decide (ends of
the window, and maxima within) are solved, and that again until they agree with the curve: what is
told are solved points, not the curve between them.

By c a worst peak at an end of the window changes by g = dy/ds, one within by g = k. At the optimum
the deciding points meet 0 = sum_i l_i g_i, l_i >= 0, sum_i l_i = 1, unless F_C is at its bound; by
any parameter p then dW/dp = sum_i l_i dy_i/dp.

References
----------
J. M. Danskin, The Theory of Max-Min (1967); V. F. Demyanov, V. N. Malozemov, Introduction to
Minimax (1974), ch. III.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator
from scipy.optimize import minimize_scalar

from upd.errors import ConvergenceError
from upd.hbm.followed_peaks import FollowedPeaks

Array = NDArray[np.float64]
#: ln(F_C/F_E) between the points of the first scan of peaks that are followed, and of swept ones
FOLLOWED_STEP, SWEPT_STEP = 0.35, 0.5
#: how closely a deciding point agrees with the curve, and F_C with that before, relative
AGREES, STILL = 5e-4, 5e-4
#: the same where sweeps decide: their steps are felt by a hundredth
SWEPT_AGREES, SWEPT_STILL = 1e-2, 2e-2
#: how a peak was found that was not followed
SWEEPS = "sweeps"
#: below the worst within which a point may decide, as a logarithm
_NEAR = 0.02
#: points closer than this are one
_SAME = 1e-6
#: rounds of the search, and points of the curve between solved ones
_ROUNDS, _FINE = 25, 2e-3
#: ln(F_C/F_E) from the ends of the window beyond which a maximum is within it
_INNER = 1e-6
#: below the highest peak on the curves beyond which another one is not solved, as a logarithm
_FAR = 0.1
#: slope of a deciding point that counts as none
_FLAT = 1e-6


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


@dataclass(frozen=True)
class LowestWorst:
    """F_C of the lowest worst peak.

    Attributes
    ----------
    log_centrifugal : float
        ln F_C.
    log_worst : float
        ln of the worst peak there.
    deciding : tuple of Deciding
        What it is the worst of.
    status : str
        "found", "at the lower bound", "at the upper bound"; "at the end of what is known": peaks
        are lost for lower F_C; "bracketed": deciding points and curve did not agree, the lowest
        solved point.
    reached : (float, float)
        ln F_C between which the worst peak is known.
    """

    log_centrifugal: float
    log_worst: float
    deciding: tuple[Deciding, ...]
    status: str
    reached: tuple[float, float]


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
        places = np.linspace(high, low, count)
        for s in places:
            followed.at(float(s))
        # a peak that the others do not lead to
        followed.scan(low)
        for s in places[::-1]:
            followed.at(float(s))
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

    def _known(self, s: float) -> float:
        """The solved place that s is, or s."""
        known = [*self.swept, *(t for one in self.followed.peaks for t in one.points)]
        near = min(known, key=lambda t: abs(t - s), default=s)
        return near if abs(near - s) < _SAME else s

    def _high(self, s: float) -> set[str]:
        """Names of the peaks that may be the highest, by the curves."""
        at = np.array([s])
        heights = {name: float(curve(at)[0]) for name, curve in self.curves().items() if name}
        top = max(heights.values(), default=-math.inf)
        return {name for name, y in heights.items() if y >= top - _FAR}

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
    ends = np.clip([s - _FINE, s + _FINE], low, high)
    values = curve(ends)
    return float((values[1] - values[0]) / (ends[1] - ends[0])) if ends[1] > ends[0] else math.nan


def _between(
    s: Sequence[float], y: Sequence[float], slope: Sequence[float], beyond: bool = False
) -> Callable[[Array], Array]:
    """The cubic through values and slopes, slopes that are not known by those of the monotone one;
    -inf outside, unless it is constant beyond.
    """
    x, v, g = (np.asarray(part, float) for part in (s, y, slope))
    if len(x) == 1:
        curve: Callable[[Array], Array] = lambda at: np.full(np.shape(at), v[0])  # noqa: E731
    else:
        usual = PchipInterpolator(x, v).derivative()(x) if np.isnan(g).any() else g
        curve = CubicHermiteSpline(x, v, np.where(np.isnan(g), usual, g))

    def value(at: Array) -> Array:
        inside = np.asarray(curve(np.clip(at, x[0], x[-1])), float)
        known = (at >= x[0] - _SAME) & ((at <= x[-1] + _SAME) | beyond)
        return np.where(known, inside, -math.inf)

    return value


class WorstPeak:
    """The worst peak over a range of F_E, as a function of F_C.

    Parameters
    ----------
    peaks
        One for every set of the parameters that are neither F_C nor F_E; the worst of all counts.
    forces
        F_E [N], the least and the largest.
    weight
        k: 0 for peaks per newton, 1 for accelerations.
    """

    def __init__(
        self, peaks: Sequence[PeaksOverRatio], forces: tuple[float, float], weight: float = 0.0
    ) -> None:
        self.peaks, self.weight = tuple(peaks), weight
        self.f = (math.log(forces[0]), math.log(forces[1]))

    def known_from(self) -> float:
        """ln F_C from which the worst peak is known."""
        return max(one.known_from for one in self.peaks) + self.f[1]

    def at(self, c: Array) -> Array:
        """ln of the worst peak at ln F_C (n,), on the curves between solved points."""
        c = np.atleast_1d(np.asarray(c, float))
        out = np.full(len(c), -math.inf)
        f = self._forces()
        for one in self.peaks:
            curves = list(one.curves().values())
            for i, at in enumerate(c):
                y = np.max([curve(at - f) for curve in curves], axis=0) + self.weight * f
                out[i] = max(out[i], float(y.max()))
        return out

    def over(self, low: float, high: float) -> tuple[Array, Array]:
        """ln F_C from end to end, evenly, and ln of the worst peaks there, all at once: the largest
        in a window that slides, to its steps.
        """
        if high - low <= _FINE:
            ends = np.array([low, high])
            return ends, self.at(ends)
        step = _FINE / 2.0
        c = low + step * np.arange(math.ceil((high - low) / step) + 1)
        n = round((self.f[1] - self.f[0]) / step)
        s = c[0] - self.f[1] + step * np.arange(len(c) + n)
        out = np.full(len(c), -math.inf)
        for one in self.peaks:
            y = np.max([curve(s) for curve in one.curves().values()], axis=0) - self.weight * s
            window = sliding_window_view(y, n + 1).max(axis=1) if n else y
            out = np.maximum(out, window + self.weight * c)
        inside = c <= high + _SAME
        return np.asarray(c[inside], float), np.asarray(out[inside], float)

    def _forces(self) -> Array:
        """ln F_E of the range, closely."""
        return np.linspace(*self.f, max(2, math.ceil((self.f[1] - self.f[0]) / _FINE) + 1))

    def places(self, c: float) -> list[tuple[int, float]]:
        """Which peaks may decide at ln F_C: number of the set, and ln r; the ends of the window
        near the worst, and the highest within it where it is higher than both.
        """
        f = self._forces()
        worst = float(self.at(np.array([c]))[0])
        found = []
        for k, one in enumerate(self.peaks):
            y = np.max([curve(c - f) for curve in one.curves().values()], axis=0) + self.weight * f
            ends = [0, len(f) - 1] if f[-1] > f[0] else [0]
            found += [(k, float(c - f[i])) for i in ends if y[i] >= worst - _NEAR]
            top = int(y.argmax())
            if y[top] >= worst - _NEAR and y[top] > max(y[0], y[-1]) + 0.5 * AGREES:
                found.append((k, float(c - f[top])))
        return found

    def solved(self, c: float) -> tuple[Deciding, ...]:
        """The deciding points at ln F_C, solved, worst first."""
        out = []
        for k, s in self.places(c):
            point = self.peaks[k].solve(s)
            # a maximum within the window stays where it is
            within = min(abs(c - f - s) for f in self.f) > _INNER
            out.append(point._replace(slope=self.weight) if within else point)
        return tuple(sorted(out, key=lambda p: -self.value(c, p)))

    def scan(self, c: float) -> bool:
        """Look at the whole curves at the deciding places: whether there is a higher peak."""
        higher = False
        for k, s in self.places(c):
            one = self.peaks[k]
            if not one.is_known(s) or s in one.followed.scanned:
                continue
            before = one.solve(s)
            one.followed.scan(before.s)
            higher |= one.solve(before.s).y > before.y + AGREES
        return higher

    def value(self, c: float, point: Deciding) -> float:
        """What a point counts at ln F_C."""
        return point.y + self.weight * (c - point.s)


def lowest_worst(worst: WorstPeak, low: float, high: float) -> LowestWorst:
    """F_C between bounds whose worst peak is lowest.

    Parameters
    ----------
    worst
        Of the peaks.
    low, high
        F_C [N]; the same when it is fixed.

    Raises
    ------
    ConvergenceError
        Where the worst peak is known at no F_C between the bounds.
    """
    ends = math.log(low), math.log(high)
    before, told = math.nan, list[tuple[float, float]]()
    for _ in range(_ROUNDS):
        known = max(ends[0], worst.known_from())
        if known > ends[1] + _SAME:
            whys = [p.why for one in worst.peaks for p in one.followed.peaks if p.why]
            raise ConvergenceError(
                f"the worst peak is known at no F_C between {low:g} and {high:g} N: "
                + "; ".join(dict.fromkeys(whys))
                + '; to fix it: larger F_C, smaller F_E, or balance.method="auto", which sweeps by '
                "time march where peaks are not followed"
            )
        c = _least(worst, known, ends[1])
        guessed = float(worst.at(np.array([c]))[0])
        deciding = worst.solved(c)
        off = abs(worst.value(c, deciding[0]) - float(worst.at(np.array([c]))[0]))
        off = max(off, abs(guessed - worst.value(c, deciding[0])))
        told.append((worst.value(c, deciding[0]), c))
        swept = deciding[0].name == SWEEPS
        near = abs(c - before) <= (SWEPT_STILL if swept else STILL) or c in (known, ends[1])
        if off <= (SWEPT_AGREES if swept else AGREES) and near:
            if worst.scan(c):
                # the whole curve has another peak there
                continue
            status = _status(c, ends, known)
            return LowestWorst(
                c, told[-1][0], _shared(worst, c, deciding), status, (known, ends[1])
            )
        before = c
    y, c = min(told)
    return LowestWorst(c, y, _shared(worst, c, worst.solved(c)), "bracketed", (known, ends[1]))


def _status(c: float, ends: tuple[float, float], known: float) -> str:
    if ends[1] - ends[0] <= _SAME:
        return "found"
    if known > ends[0] + STILL and c - known <= STILL:
        return "at the end of what is known"
    if c - ends[0] <= STILL:
        return "at the lower bound"
    return "at the upper bound" if ends[1] - c <= STILL else "found"


def _least(worst: WorstPeak, low: float, high: float) -> float:
    """ln F_C of the least worst peak on the curves: on a grid, then between its neighbours."""
    if high - low <= _SAME:
        return high
    grid, values = worst.over(low, high)
    i = int(values.argmin())
    a, b = grid[max(i - 1, 0)], min(grid[i] + (grid[1] - grid[0]), high)
    found = minimize_scalar(
        lambda c: float(worst.at(np.array([c]))[0]),
        bounds=(a, b),
        method="bounded",
        options={"xatol": 0.1 * STILL},
    )
    candidates = [(float(found.fun), float(found.x))]
    candidates += [(float(worst.at(np.array([c]))[0]), float(c)) for c in (grid[i], low, high)]
    return min(candidates)[1]


def _shared(worst: WorstPeak, c: float, deciding: Sequence[Deciding]) -> tuple[Deciding, ...]:
    """The deciding points with their shares: of the worst alone, or of the worst rising one and the
    worst falling one whose slopes cancel.
    """
    top = worst.value(c, deciding[0])
    near = [p for p in deciding if top - worst.value(c, p) <= 10.0 * AGREES]
    rising = [p for p in near if p.slope > _FLAT]
    falling = [p for p in near if p.slope < -_FLAT]
    if not (rising and falling):
        return tuple(p._replace(share=float(i == 0)) for i, p in enumerate(near))
    up, down = rising[0], falling[0]
    share = -down.slope / (up.slope - down.slope)
    return up._replace(share=share), down._replace(share=1.0 - share)


def how_far(worst: WorstPeak, found: LowestWorst, growth: float, low: float, high: float) -> Array:
    """F_C [N] between which the worst peak stays below so many times its least, (2,).

    Parameters
    ----------
    worst, found
        The worst peaks, and where they are least.
    growth
        1.05 for 5 %.
    low, high
        F_C within which it is told [N]; nan where the worst peak stays below up to there.
    """
    limit = found.log_worst + math.log(growth)
    out = np.full(2, math.nan)
    for side, end in enumerate((max(math.log(low), worst.known_from()), math.log(high))):
        for again in (True, False):
            grid, values = worst.over(*sorted((found.log_centrifugal, end)))
            beyond = np.flatnonzero(values > limit)
            if not beyond.size:
                break
            c = float(grid[beyond[0 if side else -1]])
            out[side] = math.exp(c)
            if again:
                worst.solved(c)
    return out
