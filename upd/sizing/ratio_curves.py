"""Peaks of whole curves over F_C/F_E, and what is read between them: cubics of their values and
slopes, not beyond the values of both ends where the peaks there are not of one branch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from upd.errors import ConvergenceError
from upd.hbm.curve_peaks import CurvePeaks, PeakPoint
from upd.hbm.peaks import JUMP_FREQUENCY

Array = NDArray[np.float64]
#: ln(F_C/F_E): points that are one
SAME = 1e-6
#: ln of heights: how far values and slopes of neighbours of one branch may miss each other
MISS = 0.02
#: step of slopes that are read from a curve
_STEP = 2e-3
#: ln(F_C/F_E) between the whole curves of the first scan, between those of an answer, and how
#: closely a jump is located
SCAN_STEP, TOLD_STEP, JUMP_STEP = 0.7, 0.5, 0.02
#: how closely heights are known, as logarithms: tops have ripples of a thousandth, by the samples
#: of a period
AGREES = 2e-3
#: ln(F_C/F_E) so near that the slope leads from one point to the other
BESIDE = 1e-3
#: where a curve is sought again that does not go through, as ln(F_C/F_E)
ASIDE = 0.01
#: below the highest peak of a curve beyond which another one does not count, as a logarithm
_FAR = 0.1


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


class PeaksOverRatio:
    """Peaks of whole curves over s = ln(F_C/F_E), and what is read between them.

    Parameters
    ----------
    found
        Peaks of the whole curve at one F_C/F_E.
    low, high
        ln(F_C/F_E) that may be asked for.
    step
        ln(F_C/F_E) between the first curves.
    """

    def __init__(
        self,
        found: CurvePeaks,
        low: float,
        high: float,
        step: float = SCAN_STEP,
    ) -> None:
        self.found, self.low, self.high = found, low, high
        self._curves: dict[str, Callable[[Array], Array]] = {}
        #: nodes with what is known there, slopes that are not from the nodes beside
        self._peaks: dict[float, dict[str, PeakPoint]] = {}
        self._curves_of = -1
        for s in np.linspace(high, low, math.ceil((high - low) / step) + 1):
            self.look(float(s))

    # -- places ------------------------------------------------------------------------------------

    def look(self, s: float, near: float = SAME) -> bool:
        """Solve the whole curve at ln(F_C/F_E) unless one so near is known; whether that is new."""
        known = [*self.found.points, *self.found.failed]
        if any(abs(t - s) <= near for t in known):
            return False
        for at in (s, s + ASIDE, s - ASIDE):
            self.found.at(at)
            if at in self.found.points:
                break
        return True

    def look_unless_known(self, s: float, near: float) -> bool:
        """As `look`, unless neighbours tell the peak there."""
        return not self.is_known(s) and self.look(s, near)

    @property
    def failed(self) -> list[float]:
        """ln(F_C/F_E) at which no curve went through, and none next to it either, rising."""
        return sorted(
            s
            for s in self.found.failed
            if not any(abs(t - s) <= 1.5 * ASIDE for t in self.found.points)
        )

    @property
    def nodes(self) -> list[float]:
        """ln(F_C/F_E) at which the highest peak is known, rising."""
        return sorted(s for s, peaks in self.found.points.items() if peaks)

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
        return any(b - a <= TOLD_STEP and self.agree(a, b, AGREES) for a, b in self.intervals(s, s))

    def may_reach(self, a: float, b: float) -> float:
        """ln of the height that a peak may have between neighbouring nodes, on the tangents; of a
        slope that is not known the steeper of a proportional rise with F_C/F_E and the differences
        of its neighbours.
        """
        self.curves()
        top = -math.inf
        for end, way in ((a, 1.0), (b, -1.0)):
            for name, p in self._peaks[end].items():
                raw = self._at(end).get(name)
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
        ends = self._at(a), self._at(b)
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
        return max(p.log_height for p in self._at(s).values())

    def highest(self, a: float, b: float) -> float:
        """ln of the highest peak that is read between two places."""
        s = np.linspace(a, b, max(2, math.ceil((b - a) / JUMP_STEP) + 1))
        return float(np.max([curve(s) for curve in self.curves().values()]))

    def _at(self, s: float) -> dict[str, PeakPoint]:
        """What is known at a node."""
        return self.found.points[s]

    def curves(self) -> dict[str, Callable[[Array], Array]]:
        """Name -> ln height over ln r; -inf where nothing is known."""
        count = len(self.found.points)
        if self._curves_of != count:
            self._curves, self._curves_of = self._all_curves(), count
        return self._curves

    def _all_curves(self) -> dict[str, Callable[[Array], Array]]:
        nodes = self.nodes
        peaks = {s: dict(self._at(s)) for s in nodes}
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
        self._peaks = peaks
        return out

    def distance(self, s: float) -> float:
        """To the next node."""
        return min((abs(t - s) for t in self.nodes), default=math.inf)

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
        y, p = float(curves[name](np.array(s))), self._at(at).get(name)
        if p is None or not abs(y - p.log_height - p.slope * (s - at)) <= AGREES:
            return None
        if not self._is_confirmed(name, at):
            return None
        slope = slope_of(curves[name], s, nodes[0], nodes[-1])
        return Deciding(
            s, y, p.slope if math.isnan(slope) else slope, p.by, p.frequency, name, node=at
        )

    def _is_confirmed(self, name: str, at: float) -> bool:
        """Whether a neighbour confirms the slope of a peak, known at a node."""
        raw = self._at(at).get(name)
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
        lost = any(abs(t - s) <= BESIDE for t in self.found.failed)
        at = self.node(s, 1.5 * ASIDE if lost else BESIDE)
        if at not in self.found.points:
            raise ConvergenceError(
                f"no whole curve was followed at F_C/F_E {math.exp(s):.4g}; to fix it: other ranges"
                " of F_C and F_E"
            )
        peaks = self._at(at)
        name = max(peaks, key=lambda one: peaks[one].log_height)
        p, slope = peaks[name], peaks[name].slope
        if math.isnan(slope):
            slope = slope_of(self.curves()[name], at, self.nodes[0], self.nodes[-1])
        y = p.log_height + (0.0 if math.isnan(slope) else slope * (s - at))
        return Deciding(s, y, slope, p.by, p.frequency, name, node=at)


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
        return [replace(p, slope=0.0 if math.isnan(p.slope) else p.slope) for p in points]
    y = np.array([p.log_height for p in points])
    read = np.gradient(y, np.array(s), edge_order=2 if len(s) > 2 else 1)
    return [
        replace(p, slope=float(g)) if math.isnan(p.slope) else p
        for p, g in zip(points, read, strict=True)
    ]


def slope_of(curve: Callable[[Array], Array], s: float, low: float, high: float) -> float:
    ends = np.clip([s - _STEP, s + _STEP], low, high)
    values = curve(ends)
    if not ends[1] > ends[0] or not np.isfinite(values).all():
        # at the rim of what is known
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
