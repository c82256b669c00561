r"""The worst peak over a range of F_E, as a function of F_C, and the F_C at which it is lowest.

With every gap closed at rest, static and dynamic loads scaled by c scale the answer by c: peaks h
per newton of F_E depend on s = ln(F_C/F_E) alone, and a whole curve at one s serves every pair of
forces. The worst over f_1 <= f = ln F_E <= f_2 at c = ln F_C,

    W(c) = max over s in [c - f_2, c - f_1] of y(s) + k (c - s),   y = ln h,

k = 0 for peaks per newton, 1 for accelerations, is the largest value of one curve in a window that
slides with c. Between whole curves every peak is read from a spline. Whole curves are solved on a
first grid, and then where the optimum is decided, until none is new: at the ends of its window of
F_C/F_E, at the maximum within, and between neighbours too far apart there.

A peak that is followed from one s to the next may leave the curve that runs from the lowest to the
highest frequency. Peaks are therefore taken from the whole curve at every s.

References
----------
J. M. Danskin, The Theory of Max-Min (1967).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from upd.cache.arrays import Journal
from upd.errors import ConvergenceError

Array = NDArray[np.float64]
#: ln(F_C/F_E) between the whole curves of the first grid, between those of an optimum, beside what
#: decides it, and so near that they are one: a peak changes by no more than that
FIRST_STEP, ANSWER_STEP, BRANCH_STEP, CLOSE = 0.5, 0.25, 0.05, 0.01
#: ln F_C and ln(F_C/F_E) between places that are read
FINE = 2e-3
#: below the worst within which a place may decide, as a logarithm
NEAR = 0.02
#: rounds of curves that are asked for at most
ROUNDS = 25
#: slopes d ln W / d ln F_C are differences over such a step
SLOPE_STEP = 0.02

#: name -> frequency [Hz] and ln of the height per unit of F_E, of the peaks of one whole curve
Peaks = Mapping[str, tuple[float, float]]


class PeaksOver:
    """Peaks of whole curves over s = ln(F_C/F_E), and what is read between them.

    Parameters
    ----------
    curve_at
        s -> the peaks of the whole curve there; None where it was not followed through.
    low, high
        s that may be asked for.
    step
        s between the first curves.
    kept
        Keeps them, for a search that is begun again.

    Attributes
    ----------
    points : dict
        s -> its peaks; None where the curve was not followed through.
    resumed : int
        Curves of an earlier call.
    """

    def __init__(
        self,
        curve_at: Callable[[float], Peaks | None],
        low: float,
        high: float,
        step: float = FIRST_STEP,
        kept: Journal | None = None,
    ) -> None:
        self._curve_at, self._kept = curve_at, kept
        self.points: dict[float, Peaks | None] = dict(kept.lines if kept else [])
        self.resumed = len(self.points)
        for s in np.linspace(high, low, math.ceil((high - low) / step) + 1):
            self.look(float(s))

    def look(self, s: float) -> bool:
        """Solve the whole curve at s unless one so near is known; whether that is new."""
        if any(abs(t - s) <= CLOSE for t in self.points):
            return False
        self.points[s] = found = self._curve_at(s)
        if self._kept is not None:
            self._kept.keep([s, found])
        return True

    @property
    def solved(self) -> int:
        """Curves of this call."""
        return len(self.points) - self.resumed

    @property
    def missed(self) -> list[tuple[float, float]]:
        """Between which s nothing is known, for a curve between was not followed through."""
        s = sorted(self.points)
        around = zip([-math.inf, *s], s, [*s[1:], math.inf], strict=False)
        return [(a, c) for a, b, c in around if not self.points[b]]

    def read(self, s: Array) -> Array:
        """ln of the highest peak at places (n,); nan where it is not known."""
        nodes = sorted(t for t, peaks in self.points.items() if peaks)
        tops = np.array([max(y for _, y in (self.points[t] or {}).values()) for t in nodes])
        if not nodes:
            return np.full(len(s), math.nan)
        out = np.interp(s, nodes, tops, left=math.nan, right=math.nan)
        splines = [spline(s) for _, spline in self.curves()]
        highest = np.fmax.reduce(splines) if splines else np.full(len(s), math.nan)
        out = np.where(np.isnan(highest), out, highest)
        for a, b in self.missed:
            out[(s > a) & (s < b)] = math.nan
        return np.asarray(out)

    def curves(self) -> list[tuple[str, Akima1DInterpolator]]:
        """Name and spline over s of every peak, along neighbouring whole curves that have it."""
        nodes = sorted((s, peaks or {}) for s, peaks in self.points.items())
        out = []
        for name in dict.fromkeys(name for _, peaks in nodes for name in peaks):
            heights = [(s, peaks[name][1]) if name in peaks else None for s, peaks in nodes]
            for known, run in groupby(heights, bool):
                x, y = np.array([*run] if known else [(0.0, 0.0)], float).T
                if len(x) > 1:
                    out.append((name, Akima1DInterpolator(x, y, method="makima")))
        return out


#: a place that decides a worst peak: s = ln(F_C/F_E) and ln of the height per unit of F_E there,
#: name and frequency [Hz] of the peak
Deciding = tuple[float, float, str, float]


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
        self, peaks: Sequence[PeaksOver], forces: tuple[float, float], weight: float = 0.0
    ) -> None:
        self.peaks, self.weight = tuple(peaks), weight
        self.f = (math.log(forces[0]), math.log(forces[1]))

    @property
    def missed(self) -> str:
        """F_C/F_E at which no whole curve with peaks was found, rising; "" without."""
        lost = {s for one in self.peaks for s, peaks in one.points.items() if not peaks}
        return ", ".join(f"{math.exp(s):.4g}" for s in sorted(lost))

    def with_forces(self, low: float, high: float) -> WorstPeak:
        """The same over another range of ln F_E."""
        return WorstPeak(self.peaks, (math.exp(low), math.exp(high)), self.weight)

    def over(self, low: float, high: float) -> tuple[Array, Array]:
        """ln F_C from end to end, evenly, and ln of the worst peaks there, the largest in a window
        that slides; nan where they are not known.
        """
        c = np.linspace(low, high, math.ceil((high - low) / FINE) + 1)
        step = (high - low) / (len(c) - 1) if len(c) > 1 else FINE
        # places within windows lie anywhere, their ends are exact
        n = math.floor((self.f[1] - self.f[0]) / step)
        inside = self._counted(c[0] - self.f[1] + step * np.arange(len(c) + n))
        y = sliding_window_view(inside, n + 1).max(axis=1)
        for f in self.f:
            y = np.maximum(y, self._counted(c - f))
        return np.asarray(c), np.asarray(y + self.weight * c)

    def _counted(self, s: Array) -> Array:
        """y - k s of the highest peak of all."""
        return np.asarray(np.max([one.read(s) for one in self.peaks], axis=0) - self.weight * s)

    def read(self, c: float) -> float:
        """ln of the worst peak at ln F_C; nan where it is not known."""
        return float(self._counted(self._window(c)).max()) + self.weight * c

    def _window(self, c: float) -> Array:
        """ln(F_C/F_E) at ln F_C, closely."""
        n = math.ceil((self.f[1] - self.f[0]) / FINE) + 1
        return np.linspace(c - self.f[1], c - self.f[0], n)

    def deciding(self, c: float) -> list[tuple[PeaksOver, Deciding]]:
        """What may decide at ln F_C, worst first: the ends of the window near the worst, and the
        highest within.
        """
        s = self._window(c)
        worst, found = self.read(c) - self.weight * c, []
        for one in self.peaks:
            y = one.read(s)
            counted = y - self.weight * s
            for k in {0, len(s) - 1, int(np.nanargmax(counted))}:
                if counted[k] >= worst - NEAR:
                    place = float(s[k])
                    # the highest peak of the nearest whole curve
                    told = [t for t, peaks in one.points.items() if peaks]
                    peaks = one.points[min(told, key=lambda t: abs(t - place))] or {}
                    name = max(peaks, key=lambda peak: peaks[peak][1])
                    at = place, float(y[k]), name, peaks[name][0]
                    found.append((float(counted[k]), one, at))
        return [pair for _, *pair in sorted(found, key=lambda p: -p[0])]  # type: ignore[misc]

    def solve(self, c: float) -> bool:
        """Solve the whole curves that decide at ln F_C, and between those of its window that are
        too far apart, the more so beside what decides: a branch may end there. Whether any was new.
        """
        deciding = self.deciding(c)
        new = [one.look(s) for one, (s, *_) in deciding]
        low, high = c - self.f[1], c - self.f[0]
        for one in self.peaks:
            places = [s for of, (s, *_) in deciding if of is one]
            for a, b in pairwise(sorted(one.points)):
                beside = any(a - CLOSE <= s <= b + CLOSE for s in places)
                step = BRANCH_STEP if beside else ANSWER_STEP
                if b - a > step * (1.0 + CLOSE) and a < high - CLOSE and b > low + CLOSE:
                    new.append(one.look(0.5 * (a + b)))
        return any(new)

    def solved(self, c: float) -> float:
        """ln of the worst peak at ln F_C, whole curves solved for it; nan where it is not known."""
        for _ in range(ROUNDS):
            if math.isnan(self.read(c)) or not self.solve(c):
                break
        return self.read(c)


# -- the lowest worst peak -------------------------------------------------------------------------


@dataclass(frozen=True)
class LowestWorst:
    """F_C of the lowest worst peak.

    Attributes
    ----------
    log_centrifugal, log_worst : float
        ln F_C, and ln of the worst peak there.
    deciding : tuple of Deciding
        What it is the worst of.
    status : str
        "found", "at the lower bound", "at the upper bound"; "beside what is not known": a curve
        there was not followed through.
    """

    log_centrifugal: float
    log_worst: float
    deciding: tuple[Deciding, ...]
    status: str


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
    for _ in range(ROUNDS):
        grid, values = worst.over(math.log(low), math.log(high))
        if not np.isfinite(values).any():
            raise ConvergenceError(
                f"the worst peak is known at no F_C between {low:g} and {high:g} N: whole curves "
                f"were not followed through at F_C/F_E {worst.missed}; to fix it: larger F_C, or "
                "smaller F_E"
            )
        i = int(np.nanargmin(values))
        c = float(grid[i])
        if not worst.solve(c):
            break
    deciding = tuple(at for _, at in worst.deciding(c))
    last = len(values) - 1
    status = {0: "at the lower bound", last: "at the upper bound"}.get(i, "found")
    if last == 0:
        status = "found"
    elif np.isnan(values[max(i - 1, 0) : i + 2]).any():
        status = "beside what is not known"
    return LowestWorst(c, worst.read(c), deciding, status)


def reached(
    at: Callable[[float], tuple[WorstPeak, float]], begin: float, end: float, limit: float
) -> float:
    """The first place from an optimum on at which the worst peak passes a limit, whole curves
    solved there; nan where it does not, and where it is not known.

    Parameters
    ----------
    at
        Place -> the worst peaks and ln F_C there.
    begin, end
        Places between which it is sought.
    limit
        ln of the worst peak.
    """
    places = np.linspace(begin, end, max(2, math.ceil(abs(end - begin) / CLOSE) + 1))
    for _ in range(ROUNDS):
        values = np.array([worst.read(c) for worst, c in map(at, places)])
        beyond = np.flatnonzero(~(values <= limit))
        if not len(beyond) or math.isnan(values[beyond[0]]):
            return math.nan
        k = beyond[0]
        if k == 0:
            return begin
        place = float(np.interp(limit, values[k - 1 : k + 1], places[k - 1 : k + 1]))
        worst, c = at(place)
        if not worst.solve(c):
            break
    return place
