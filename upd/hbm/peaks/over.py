r"""Peaks of whole response curves over F_C/F_E, solved where they are asked for, and what is read
between them: cubics of their values and slopes, not beyond the values of both ends where the peaks
there are not of one branch.

With every gap closed at rest, static and dynamic loads scaled by c scale the answer by c: peaks per
newton of F_E depend on r = F_C/F_E alone, and one curve serves every pair of forces. With the
factor q on the dynamic loads r is proportional to 1/q, and

    d ln(h/q) / d ln r = 1 - d ln h / d ln q,

from the exact derivative of the peak (`upd.hbm.peaks.sensitivity`).

A peak that is followed from one r to the next may leave the curve that runs from the lowest to the
highest frequency: where a loop of it closes, its solutions continue as a closed curve beside it,
which no sweep of the frequency reaches. Peaks are therefore taken from the whole curve at every r.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicHermiteSpline

from upd.cache.arrays import Journal
from upd.errors import ConvergenceError
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.hbm.peaks.sensitivity import peak_derivatives
from upd.hbm.springs.peak import JUMP_FREQUENCY, climb
from upd.hbm.springs.response import FrequencyResponse

Array = NDArray[np.float64]
#: ln(F_C/F_E): points that are one
SAME = 1e-6
#: ln of heights: how far values and slopes of neighbours of one branch may miss each other
MISS = 0.02
#: step of slopes that are read from a curve
_STEP = 2e-3
#: ln(F_C/F_E) between the whole curves of the first scan, between those of an answer, and how
#: closely a jump is located
SCAN_STEP, ANSWER_STEP, JUMP_STEP = 0.7, 0.5, 0.02
#: how closely heights are known, as logarithms: tops have ripples of a thousandth, by the samples
#: of a period
AGREES = 2e-3
#: ln(F_C/F_E) so near that the slope leads from one point to the other
BESIDE = 1e-3
#: where a curve is sought again that does not go through, as ln(F_C/F_E)
ASIDE = 0.01
#: below the highest peak of a curve beyond which another one does not count, as a logarithm
_FAR = 0.1
#: points of a path on either side of one of its peaks beside which the top is
_TOP = 2


class PeakPoint(NamedTuple):
    """A peak at one F_C/F_E: frequency [Hz], ln of its height per unit of F_E, the derivative of
    that by ln(F_C/F_E), and (n,) by the parameters; nan where they were not found.
    """

    frequency: float
    log_height: float
    slope: float
    by: Array


def _as_list(p: PeakPoint) -> list[Any]:
    return [p.frequency, p.log_height, p.slope, p.by.tolist()]


def _from_list(kept: list[Any]) -> PeakPoint:
    frequency, y, slope, by = kept
    return PeakPoint(frequency, y, slope, np.array(by, float))


#: the peaks of the whole curve at one F_C/F_E, by their names
Peaks = Mapping[str, PeakPoint]


class Deciding(NamedTuple):
    """A solved point that decides a worst peak: ln(F_C/F_E), ln of the height, slope g of the worst
    peak that it decides by ln F_C, derivatives by parameters, frequency [Hz], peak's name, share l
    in the optimum's conditions, ln(F_C/F_E) of its whole curve.
    """

    s: float
    y: float
    slope: float
    by: Array
    frequency: float
    name: str
    share: float = 0.0
    node: float = math.nan


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
        s -> its peaks; empty where the curve has none.
    missed : set of float
        s whose curve was not followed through.
    resumed : int
        Curves of an earlier call.
    """

    def __init__(
        self,
        curve_at: Callable[[float], Peaks | None],
        low: float,
        high: float,
        step: float = SCAN_STEP,
        kept: Journal | None = None,
    ) -> None:
        self.curve_at, self.low, self.high, self._kept = curve_at, low, high, kept
        self.points: dict[float, Peaks] = {}
        self.missed: set[float] = set()
        self._curves: dict[str, Callable[[Array], Array]] = {}
        #: nodes with what is known there, slopes that are not from the nodes beside
        self._peaks: dict[float, Peaks] = {}
        self._curves_of = -1
        for place, known in () if kept is None else kept.lines:
            self._add(place, known and {name: _from_list(p) for name, p in known.items()})
        self.resumed = len(self.points)
        for s in np.linspace(high, low, math.ceil((high - low) / step) + 1):
            self.look(float(s))

    # -- places ------------------------------------------------------------------------------------

    def look(self, s: float, near: float = SAME) -> bool:
        """Solve the whole curve at ln(F_C/F_E) unless one so near is known; whether that is new."""
        if self._is_near(s, near):
            return False
        for at in (s, s + ASIDE, s - ASIDE):
            if not self._is_near(at, SAME):
                found = self.curve_at(at)
                self._add(at, found)
                if self._kept is not None:
                    each = None if found is None else {k: _as_list(p) for k, p in found.items()}
                    self._kept.keep([at, each])
            if any(abs(t - at) <= SAME for t in self.points):
                break
        return True

    def _add(self, s: float, found: Peaks | None) -> None:
        if found is None:
            self.missed.add(s)
        else:
            self.points[s] = found

    def _is_near(self, s: float, near: float) -> bool:
        return any(abs(t - s) <= near for t in (*self.points, *self.missed))

    def look_unless_known(self, s: float, near: float) -> bool:
        """As `look`, unless neighbours tell the peak there."""
        return not self.is_known(s) and self.look(s, near)

    @property
    def failed(self) -> list[float]:
        """ln(F_C/F_E) at which no curve went through, and none next to it either, rising."""
        return sorted(
            s for s in self.missed if not any(abs(t - s) <= 1.5 * ASIDE for t in self.points)
        )

    @property
    def nodes(self) -> list[float]:
        """ln(F_C/F_E) at which the highest peak is known, rising."""
        return sorted(s for s, peaks in self.points.items() if peaks)

    @property
    def holes(self) -> list[tuple[float, float]]:
        """ln(F_C/F_E) between which nothing is known, rising."""
        known = [-math.inf, *self.nodes, math.inf]
        return [(a, b) for a, b in pairwise(known) if any(a < s < b for s in self.failed)]

    @property
    def known_from(self) -> float:
        """ln(F_C/F_E) from which the highest peak is known, but for holes between curves."""
        return max([self.low, *(b for a, b in self.holes if a < self.low)])

    def intervals(self, low: float, high: float) -> list[tuple[float, float]]:
        """Neighbouring nodes between which there is something of a range, rising."""
        return [
            (a, b)
            for a, b in pairwise(self.nodes)
            if a < high - BESIDE and b > low + BESIDE and (a, b) not in self.holes
        ]

    # -- between nodes -----------------------------------------------------------------------------

    def agree(self, a: float, b: float, miss: float = MISS) -> bool:
        """Whether the peaks of neighbouring nodes that count are of one branch: alike in frequency,
        and heights and slopes of a cubic that is nearly a parabola.

        Parameters
        ----------
        a, b
            The nodes.
        miss
            How nearly, as ln of heights.
        """
        self.curves()
        ends = self._peaks[a], self._peaks[b]
        names = {
            name
            for end in ends
            for name, p in end.items()
            if p.log_height >= max(q.log_height for q in end.values()) - _FAR
        }
        return all(
            name in ends[0]
            and name in ends[1]
            and of_one_branch(b - a, ends[0][name], ends[1][name], miss)
            for name in names
        )

    def is_known(self, s: float) -> bool:
        """Whether neighbours of one branch tell the highest peak between them as closely as heights
        are known: their cubic is a parabola to that.
        """
        return any(
            b - a <= ANSWER_STEP and self.agree(a, b, AGREES) for a, b in self.intervals(s, s)
        )

    def may_reach(self, a: float, b: float) -> float:
        """ln of the height that a peak may have between neighbouring nodes, on the tangents; of a
        slope that is not known the steeper of a proportional rise with F_C/F_E and the differences
        of its neighbours.
        """
        self.curves()
        top = -math.inf
        for end, way in ((a, 1.0), (b, -1.0)):
            for name, p in self._peaks[end].items():
                raw = self.points[end].get(name)
                known = raw is not None and not math.isnan(raw.slope)
                rise = max(way * p.slope, 0.0 if known else max(way, 0.0))
                top = max(top, p.log_height + rise * (b - a))
        return top

    def passes(self, a: float, b: float, height: float) -> float:
        """Where a peak may pass a height between neighbouring nodes: where the highest tangent of
        those below it does; nan where none does, and where both ends tell that none does.

        Both ends tell it where they are of one branch without a maximum between: heights there are
        between theirs. With one they tell nothing beyond the tangents: a branch that is lost and a
        lower one that falls from there on may have the values and slopes of a parabola. A slope
        that no neighbour confirms may be that of a ripple: then tangents have at least a
        proportional rise with F_C/F_E.

        Parameters
        ----------
        a, b
            The nodes.
        height
            Its logarithm.
        """
        self.curves()
        # so near each other one branch has hardly a third derivative
        miss = AGREES if b - a <= JUMP_STEP else MISS
        if b - a <= 2.0 * BESIDE or (self.agree(a, b, miss) and not self._may_have_summit(a, b)):
            return math.nan
        top, at = height, math.nan
        for end, way in ((a, 1.0), (b, -1.0)):
            for name, p in self._peaks[end].items():
                rise = way * p.slope
                if way > 0.0 and not self._is_confirmed(name, end):
                    rise = max(rise, 1.0)
                reached = p.log_height + rise * (b - a)
                if p.log_height <= height and reached > top + SAME:
                    top, at = reached, end + way * (height - p.log_height) / rise
        return at if math.isnan(at) else min(max(at, a + BESIDE), b - BESIDE)

    def _may_have_summit(self, a: float, b: float) -> bool:
        """Whether a peak may rise from one node and fall to the next, as slopes are known."""
        ends = self.points[a], self.points[b]
        return any(
            not (ends[0][name].slope <= 0.0 or ends[1][name].slope >= 0.0)
            for name in ends[0].keys() & ends[1].keys()
        )

    def kink(self, a: float, b: float) -> float:
        """ln of the height at which the tangents of neighbouring nodes meet: none between is higher
        where the curve is concave.
        """
        self.curves()
        top = -math.inf
        for name in self._peaks[a].keys() & self._peaks[b].keys():
            p, q = self._peaks[a][name], self._peaks[b][name]
            if p.slope > q.slope:
                d = (q.log_height - p.log_height - q.slope * (b - a)) / (p.slope - q.slope)
                top = max(top, p.log_height + p.slope * min(max(d, 0.0), b - a))
        return top

    def top(self, s: float) -> float:
        """ln of the highest peak at a node."""
        return max(p.log_height for p in self.points[s].values())

    def highest(self, a: float, b: float) -> float:
        """ln of the highest peak that is read between two places."""
        s = np.linspace(a, b, max(2, math.ceil((b - a) / JUMP_STEP) + 1))
        return float(self.read(s).max())

    def read(self, s: Array) -> Array:
        """ln of the highest peak at places (n,); -inf where nothing is known."""
        return np.asarray(np.max([curve(s) for curve in self.curves().values()], axis=0))

    def curves(self) -> dict[str, Callable[[Array], Array]]:
        """Name -> ln height over ln r; -inf where nothing is known."""
        count = len(self.points)
        if self._curves_of != count:
            self._curves, self._curves_of = self._all_curves(), count
        return self._curves

    def _all_curves(self) -> dict[str, Callable[[Array], Array]]:
        nodes = self.nodes
        peaks: dict[float, dict[str, PeakPoint]] = {s: dict(self.points[s]) for s in nodes}
        out = {}
        for name in dict.fromkeys(name for s in nodes for name in peaks[s]):
            here = [s for s in nodes if name in peaks[s]]
            points = with_slopes(here, [peaks[s][name] for s in here])
            for s, p in zip(here, points, strict=True):
                peaks[s][name] = p
            lacking = [s for s in nodes if name not in peaks[s]]
            joined = [
                not any(a < s < b for s in lacking)
                and not any(a >= c and b <= d for c, d in self.holes)
                for a, b in pairwise(here)
            ]
            out[name] = joined_cubics(np.array(here), points, np.array(joined, bool))
        self._peaks.clear()
        self._peaks.update(peaks)
        return out

    # -- what decides ------------------------------------------------------------------------------

    def node(self, s: float, within: float) -> float:
        """The node next to a place, if it is so near; else the place."""
        near = min(self.nodes, key=lambda t: abs(t - s), default=math.inf)
        return near if abs(near - s) <= within else s

    def _beside(self, s: float) -> Deciding | None:
        """The highest peak as it is read beside a whole curve, None where that is not as good as
        solved: nearer than jumps are located, on a tangent that is the curve as closely as heights
        are known, and whose slope that of a neighbour confirms.
        """
        nodes, curves = self.nodes, self.curves()
        at = self.node(s, JUMP_STEP)
        if at not in nodes:
            return None
        name = max(curves, key=lambda one: float(curves[one](np.array(s))))
        y, p = float(curves[name](np.array(s))), self.points[at].get(name)
        if p is None or not abs(y - p.log_height - p.slope * (s - at)) <= AGREES:
            return None
        if not self._is_confirmed(name, at):
            return None
        slope = _slope_of(curves[name], s, nodes[0], nodes[-1])
        return Deciding(
            s, y, p.slope if math.isnan(slope) else slope, p.by, p.frequency, name, node=at
        )

    def _is_confirmed(self, name: str, at: float) -> bool:
        """Whether a neighbour confirms the slope of a peak, known at a node."""
        raw = self.points[at].get(name)
        if raw is None or math.isnan(raw.slope):
            return False
        ends = [
            (b - a, self._peaks[a].get(name), self._peaks[b].get(name))
            for a, b in pairwise(self.nodes)
            if at in (a, b)
        ]
        return any(p and q and of_one_branch(h, p, q, AGREES) for h, p, q in ends)

    def solve(self, s: float) -> Deciding:
        """The highest peak, solved there unless one next to it was.

        Raises
        ------
        ConvergenceError
            Where it is not known.
        """
        read = self._beside(s)
        if read is not None:
            return read
        self.look(s, BESIDE)
        lost = any(abs(t - s) <= BESIDE for t in self.missed)
        at = self.node(s, 1.5 * ASIDE if lost else BESIDE)
        if at not in self.points:
            raise ConvergenceError(
                f"no whole curve was followed at F_C/F_E {math.exp(s):.4g}; to fix it: other ranges"
                " of F_C and F_E"
            )
        peaks = self.points[at]
        name = max(peaks, key=lambda one: peaks[one].log_height)
        p, slope = peaks[name], peaks[name].slope
        if math.isnan(slope):
            slope = _slope_of(self.curves()[name], at, self.nodes[0], self.nodes[-1])
        y = p.log_height + (0.0 if math.isnan(slope) else slope * (s - at))
        return Deciding(s, y, slope, p.by, p.frequency, name, node=at)


def peak_point(
    answer: FrequencyResponse,
    row: ArrayLike,
    seen: tuple[int, float, float],
    changes: Sequence[ParameterChange] = (),
    *,
    unit: float = 1.0,
    harmonic: int | None = None,
    power: float = 2.0,
) -> PeakPoint:
    """The top next to a maximum of |row @ q| w^power along a path, with its derivatives; the
    maximum as it was seen where there is none.

    Parameters
    ----------
    answer
        The whole curve, without gaps at rest.
    row : (n_dof,) array_like
        Weighs the displacements.
    seen
        Number of its point, its frequency [Hz] and its height in units of the point's.
    changes
        One for the logarithm of each parameter, at the same F_C and F_E.
    unit
        Height per w^power mm: 1/F_E, and factors of units.
    harmonic
        Its number; the lowest above 0 by default.
    power
        Of the angular frequency: 2 for accelerations.
    """
    (k, frequency, height), b = seen, answer.balance
    none, at = np.full(len(changes), math.nan), float(answer.frequency[k])
    beside = answer.frequency[max(k - _TOP, 0) : k + _TOP + 1]
    top = climb(b, row, answer.x[k], at, harmonic=harmonic, power=power)
    if not (top.found and beside.min() <= top.frequency <= beside.max()):
        return PeakPoint(frequency, math.log(height), math.nan, none)
    number = int(b.harmonics.dynamic[b.harmonics.place(harmonic)])
    omega = 2.0 * np.pi * number * top.frequency
    y = math.log(unit * omega**power * top.amplitude)
    given = [ParameterChange(dynamic=b.dynamic), *changes]
    try:
        found = peak_derivatives(
            b, row, top.x, top.frequency, given, harmonic=harmonic, power=power
        )
    except ConvergenceError:
        return PeakPoint(top.frequency, y, math.nan, none)
    relative = found.by_height / found.height
    return PeakPoint(top.frequency, y, float(1.0 - relative[0]), relative[1:])


def of_one_branch(h: float, a: PeakPoint, b: PeakPoint, miss: float = MISS) -> bool:
    """Whether points h apart are of one branch.

    A cubic with the values y and the slopes g of its ends has
    y_b - y_a - h (g_a + g_b)/2 = -h^3 y'''/12: none where it is a parabola.
    """
    if abs(b.frequency / a.frequency - 1.0) > JUMP_FREQUENCY:
        return False
    return abs(b.log_height - a.log_height - 0.5 * h * (a.slope + b.slope)) <= miss


def with_slopes(s: Sequence[float], points: Sequence[PeakPoint]) -> list[PeakPoint]:
    """Points of one peak, slopes that are not known by differences to second order."""
    if len(s) < 2:
        return [p._replace(slope=0.0 if math.isnan(p.slope) else p.slope) for p in points]
    y = np.array([p.log_height for p in points])
    read = np.gradient(y, np.array(s), edge_order=2 if len(s) > 2 else 1)
    return [
        p._replace(slope=float(g)) if math.isnan(p.slope) else p
        for p, g in zip(points, read, strict=True)
    ]


def _slope_of(curve: Callable[[Array], Array], s: float, low: float, high: float) -> float:
    """Of a curve at a place between two others; nan at the rim of what is known."""
    ends = np.clip([s - _STEP, s + _STEP], low, high)
    values = curve(ends)
    if not ends[1] > ends[0] or not np.isfinite(values).all():
        return math.nan
    return float((values[1] - values[0]) / (ends[1] - ends[0]))


def joined_cubics(
    x: Array, points: Sequence[PeakPoint], joined: NDArray[np.bool_]
) -> Callable[[Array], Array]:
    """The cubics through values and slopes of one peak; -inf outside and where neighbours are not
    joined.

    Parameters
    ----------
    x
        (n,) ln r.
    points
        n of the peak.
    joined
        (n - 1,).
    """
    v = np.array([p.log_height for p in points])
    if len(x) > 1:
        cubic = CubicHermiteSpline(x, v, [p.slope for p in points])
        ends = zip(pairwise(x), pairwise(points), strict=True)
        one = [of_one_branch(b - a, p, q) for (a, b), (p, q) in ends]
        low = np.where(one, -math.inf, np.minimum(v[:-1], v[1:]))
        high = np.where(one, math.inf, np.maximum(v[:-1], v[1:]))

    def value(at: Array) -> Array:
        at = np.asarray(at, float)
        out = np.full(at.shape, -math.inf)
        for s, y in zip(x, v, strict=True):
            out[np.abs(at - s) <= SAME] = y
        if len(x) > 1:
            k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
            inside = (at >= x[0]) & (at <= x[-1]) & joined[k]
            read = np.clip(cubic(np.clip(at, x[0], x[-1])), low[k], high[k])
            out = np.where(inside, read, out)
        return out

    return value
