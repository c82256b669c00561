"""Peaks of sweeps marched again with one choice changed: with more steps, on another model.

Only at the frequency of the peak, from where its last period began. What the height changes is
read there; what the frequency of the peak changes from the phase, by its slope along the sweep.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from upd.analyses.forced.companions import OtherModel
from upd.analyses.forced.curves import SweptCurve
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.interface_model import by_coulomb
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Array
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.spring_march import SpringMarch, carried_over
from upd.analyses.forced.sweeps import MOST_PERIODS, TOLERANCE
from upd.errors import ConvergenceError
from upd.hbm.interface_march import InterfaceMarch
from upd.hbm.interface_settle import settle
from upd.hbm.interface_state import InterfaceModel, InterfaceState
from upd.hbm.peaks import is_near
from upd.scene.forced_contact import SIDES, Side

#: points of a sweep on each side of a peak that tell its slopes
_BESIDE = 2
#: change of a height at the frequency of the peak above which the motion has left its branch, or
#: the peak stands elsewhere: several times the steps between neighbours of a sweep
_LEFT_BRANCH = 0.25
#: how far before and behind the peak a short sweep goes, its steps as shares of the frequency, the
#: periods after which it goes on, and the share of the highest point below which it has passed it
_REACH, _WALK, _WALK_PERIODS, _PASSED = 0.03, 5e-3, 220, 0.5


@dataclass(frozen=True)
class MarchedAgain:
    """Frequency and height of a peak marched again over those of the run; NaN where the march ended
    or its motion was lost.
    """

    frequency: float
    height: float
    settled: bool
    seconds: float


@dataclass(frozen=True)
class _Again:
    """What is marched, its steps in a period, where it begins at points of the sweep, and the ratio
    of its frequencies to those of the run.
    """

    model: InterfaceModel
    samples: int
    starts: Mapping[int, InterfaceState]
    ratio: float


@dataclass(frozen=True)
class SweptPeakAt:
    """A peak of a sweep that is to be marched again."""

    plan: ForcedPlan
    sweep: SweptCurve
    side: Side
    peak: ModePeak

    def with_steps(self, times: int) -> MarchedAgain:
        """With so many times the steps in a period."""
        found = self.sweep.found
        starts = {i: found.starts[i] for i in (self.first, self.peak.sample)}
        return self._found(_Again(found.model, times * found.samples, starts, 1.0))

    def on(self, companion: OtherModel, springs: SpringMarch, ratio: float) -> MarchedAgain:
        """On another model.

        Parameters
        ----------
        springs
            Its march.
        ratio
            Of its frequencies to those of the run, as far as the linear limits tell.
        """
        found = self.sweep.found
        drive = self.sweep.force * excitation_of(self.plan.scene.excitation).at_start
        move, share = companion.move, companion.share
        starts = {
            i: carried_over(springs, found.starts[i], found.model, move, share, drive)
            for i in (self.first, self.peak.sample)
        }
        return self._found(_Again(springs.march, found.samples, starts, ratio))

    @property
    def first(self) -> int:
        """The point before the peak from which a short sweep begins."""
        found, i = self.sweep.found, self.peak.sample
        low, _ = self._stretch()
        share = np.abs(found.frequency / found.frequency[i] - 1.0)
        return next(k for k in range(low, i + 1) if share[k] <= _REACH)

    def _found(self, again: _Again) -> MarchedAgain:
        """At the frequency of the peak, and where the motion left its branch there, along a short
        sweep over it.
        """
        near = self._marched(again)
        if abs(near.height - 1.0) <= _LEFT_BRANCH:
            return near
        wide = self._walked(again)
        took = near.seconds + wide.seconds
        if is_near(wide.frequency / again.ratio, wide.height):
            return replace(wide, seconds=took)
        # another motion: that of the peak is lost there
        return MarchedAgain(float("nan"), float("nan"), False, took)

    def _walked(self, again: _Again) -> MarchedAgain:
        """The highest point of a short sweep the same way, begun before the peak on its stretch."""
        begin, found, i = time.thread_time(), self.sweep.found, self.peak.sample
        first, ratio = self.first, again.ratio
        way = 1.0 if self.sweep.way == "up" else -1.0
        start = ratio * float(found.frequency[first])
        end = ratio * float(found.frequency[i]) * (1.0 + way * _REACH)
        count = max(int(np.ceil(abs(end / start - 1.0) / _WALK)), 1) + 1
        at, blade = again.starts[first].copy(), SIDES.index(self.side)
        f, size = np.linspace(start, end, count), []
        try:
            for one in f:
                march = InterfaceMarch(again.model, one, found.drive, again.samples, by_coulomb)
                steady = settle(march, at, TOLERANCE, _WALK_PERIODS, accelerate=True)
                size.append(one**2 * abs(steady.first_harmonic[blade]))
                if size[-1] < _PASSED * max(size):
                    break
        except ConvergenceError:
            pass
        took = time.thread_time() - begin
        if not size:
            return MarchedAgain(float("nan"), float("nan"), False, took)
        k, y = int(np.argmax(size)), np.array(size)
        top, height = float(f[k]), float(y[k])
        if 0 < k < len(y) - 1:
            moved, inverse = _vertex(
                f[k - 1 : k + 2] / f[k] - 1.0, (y[k - 1 : k + 2] / y[k]) ** -2.0
            )
            top, height = top * (1.0 + moved), height / float(np.sqrt(max(inverse, 0.5)))
        run = found.frequency[i] ** 2 * abs(found.amplitude[i, blade])
        # heights of both are those of their peaks
        run *= self.peak.height / abs(self.sweep.accelerance[self.side][i])
        return MarchedAgain(top / self.peak.frequency, height / float(run), True, took)

    def _marched(self, again: _Again) -> MarchedAgain:
        begin, found, i = time.thread_time(), self.sweep.found, self.peak.sample
        ratio, at = again.ratio, again.starts[i].copy()
        f = ratio * float(found.frequency[i])
        march = InterfaceMarch(again.model, f, found.drive, again.samples, by_coulomb)
        try:
            one = settle(march, at, TOLERANCE, MOST_PERIODS, accelerate=True)
        except ConvergenceError:
            nan = float("nan")
            return MarchedAgain(nan, nan, False, time.thread_time() - begin)
        blade = SIDES.index(self.side)
        z, run = one.first_harmonic[blade], found.amplitude[i, blade]
        turned = float(np.angle(z / run))
        return MarchedAgain(
            ratio * (1.0 + turned / self.turn_per_share),
            float(ratio**2 * abs(z) / abs(run)),
            one.settled,
            time.thread_time() - begin,
        )

    @property
    def turn_per_share(self) -> float:
        """By how much the phase falls over a relative rise of frequency, along the sweep beside
        the peak, rad.

        Never less than that of a free blade at its resonance, 1 / zeta: stretches between jumps are
        short.
        """
        found, i, blade = self.sweep.found, self.peak.sample, SIDES.index(self.side)
        low, high = self._stretch()
        part = slice(max(low, i - _BESIDE), min(high, i + _BESIDE + 1))
        f, phase = found.frequency[part], np.unwrap(np.angle(found.amplitude[part, blade]))
        if len(f) < 2:
            return 1.0 / self.plan.scene.excitation.damping
        slope = float(np.polyfit(np.log(f / f.mean()), phase, 1)[0])
        return max(abs(slope), 1.0)

    def _stretch(self) -> tuple[int, int]:
        """First point and the one behind the last of the stretch between jumps with the peak."""
        found, i = self.sweep.found, self.peak.sample
        ends = [0, *(k + 1 for k in found.jumps), len(found.frequency)]
        at = int(np.searchsorted(ends, i, side="right"))
        return ends[at - 1], ends[at]

    def interpolation(self) -> tuple[float, float]:
        """What the sweep's steps leave of frequency and height, relative.

        Inside a stretch the difference of two curves through the peak and its neighbours: a
        parabola of the height, and one of its inverse square, which is exact for a single mode.
        Where a jump ends the stretch, half the step to the other side of it, and half of what the
        height changes over the last step before. The tolerance of a steady motion is added.
        """
        found, i = self.sweep.found, self.peak.sample
        low, high = self._stretch()
        size = np.abs(self.sweep.accelerance[self.side])
        f = found.frequency
        if low < i < high - 1:
            x, y = f[i - 1 : i + 2] / f[i] - 1.0, size[i - 1 : i + 2] / size[i]
            (at, top), (other, inverse) = _vertex(x, y), _vertex(x, y**-2.0)
            change = abs(at - other), abs(top - inverse**-0.5)
        else:
            beside = [k for k in (i - 1, i + 1) if 0 <= k < len(size)]
            step = max((abs(f[k] / f[i] - 1.0) for k in beside), default=0.0)
            fall = [abs(size[k] / size[i] - 1.0) for k in beside if low <= k < high]
            change = 0.5 * step, 0.5 * max(fall, default=0.0)
        return float(change[0] + TOLERANCE / self.turn_per_share), float(change[1] + TOLERANCE)


def _vertex(x: Array, y: Array) -> tuple[float, float]:
    """Where the parabola through three points is highest or lowest, and how high."""
    c2, c1, c0 = np.polyfit(x, y, 2)
    at = float(np.clip(-0.5 * c1 / c2, x.min(), x.max())) if c2 else 0.0
    return at, float(c0 + c1 * at + c2 * at**2)
