"""Peaks of sweeps marched again with one choice changed: with more steps, on another model.

Only at the frequency of the peak, from where its last period began. What the height changes is
read there; what the frequency of the peak changes from the phase, by its slope along the sweep.
Peaks of both blades at one point of a sweep are read from the same march.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import tee

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
from upd.hbm.interface_settle import SteadyPoint, settle
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


class MotionAgain:
    """The motion at a point of a sweep, marched again with one choice changed: there, and as far as
    a reader wants along a short sweep over it.

    Parameters
    ----------
    sweep, sample
        The sweep, and its point.
    model
        What is marched.
    samples
        Its steps in a period.
    starts
        Where it begins at points of the sweep: at ``sample``, and at the one before from which the
        short sweep begins.
    ratio
        Of its frequencies to those of the run.

    Attributes
    ----------
    seconds : float
        Marched so far.
    """

    def __init__(
        self,
        sweep: SweptCurve,
        sample: int,
        model: InterfaceModel,
        samples: int,
        starts: Mapping[int, InterfaceState],
        ratio: float,
    ) -> None:
        self.sweep, self.sample, self.ratio, self.seconds = sweep, sample, ratio, 0.0
        self._model, self._samples, self._starts = model, samples, starts
        self._walk = self._walking()

    @cached_property
    def near(self) -> SteadyPoint | None:
        """At the frequency of the point; None where the march ends."""
        f = self.ratio * float(self.sweep.found.frequency[self.sample])
        return self._settled(f, self._starts[self.sample].copy(), MOST_PERIODS)

    def walk(self) -> Iterator[tuple[float, SteadyPoint]]:
        """Frequency and motion along the short sweep, the same way, until a march ends."""
        self._walk, mine = tee(self._walk)
        return mine

    def _walking(self) -> Iterator[tuple[float, SteadyPoint]]:
        f = self.sweep.found.frequency
        first = min(self._starts)
        way = 1.0 if self.sweep.way == "up" else -1.0
        start = self.ratio * float(f[first])
        end = self.ratio * float(f[self.sample]) * (1.0 + way * _REACH)
        count = max(int(np.ceil(abs(end / start - 1.0) / _WALK)), 1) + 1
        at = self._starts[first].copy()
        for one in np.linspace(start, end, count):
            steady = self._settled(float(one), at, _WALK_PERIODS)
            if steady is None:
                return
            yield float(one), steady

    def _settled(self, f: float, at: InterfaceState, periods: int) -> SteadyPoint | None:
        begin, drive = time.thread_time(), self.sweep.found.drive
        try:
            march = InterfaceMarch(self._model, f, drive, self._samples, by_coulomb)
            return settle(march, at, TOLERANCE, periods, accelerate=True)
        except ConvergenceError:
            return None
        finally:
            self.seconds += time.thread_time() - begin


@dataclass(frozen=True)
class SweptPeakAt:
    """A peak of a sweep that is to be marched again."""

    plan: ForcedPlan
    sweep: SweptCurve
    side: Side
    peak: ModePeak

    def with_steps(self, times: int) -> MotionAgain:
        """With so many times the steps in a period."""
        found = self.sweep.found
        starts = {i: found.starts[i] for i in (self.first, self.peak.sample)}
        return self._again(found.model, times * found.samples, starts, 1.0)

    def on(self, companion: OtherModel, springs: SpringMarch, ratio: float) -> MotionAgain:
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
        return self._again(springs.march, found.samples, starts, ratio)

    def _again(
        self,
        model: InterfaceModel,
        samples: int,
        starts: Mapping[int, InterfaceState],
        ratio: float,
    ) -> MotionAgain:
        return MotionAgain(self.sweep, self.peak.sample, model, samples, starts, ratio)

    @property
    def first(self) -> int:
        """The point before the peak from which a short sweep begins."""
        found, i = self.sweep.found, self.peak.sample
        low, _ = self._stretch()
        share = np.abs(found.frequency / found.frequency[i] - 1.0)
        return next(k for k in range(low, i + 1) if share[k] <= _REACH)

    def read(self, again: MotionAgain) -> MarchedAgain:
        """At the frequency of the peak, and where the motion left its branch there, along a short
        sweep over it.

        Parameters
        ----------
        again
            Of this peak, or of the other blade's at the same point of the sweep.
        """
        near = self._near(again)
        if abs(near.height - 1.0) <= _LEFT_BRANCH:
            return near
        wide = self._walked(again)
        if is_near(wide.frequency / again.ratio, wide.height):
            return wide
        # another motion: that of the peak is lost there
        return MarchedAgain(float("nan"), float("nan"), False, again.seconds)

    def _walked(self, again: MotionAgain) -> MarchedAgain:
        """The highest point of the short sweep."""
        found, i = self.sweep.found, self.peak.sample
        blade = SIDES.index(self.side)
        f, size = list[float](), list[float]()
        for one, steady in again.walk():
            f.append(one)
            size.append(one**2 * abs(steady.first_harmonic[blade]))
            if size[-1] < _PASSED * max(size):
                break
        if not size:
            return MarchedAgain(float("nan"), float("nan"), False, again.seconds)
        k, x, y = int(np.argmax(size)), np.array(f), np.array(size)
        top, height = float(x[k]), float(y[k])
        if 0 < k < len(y) - 1:
            moved, inverse = _vertex(
                x[k - 1 : k + 2] / x[k] - 1.0, (y[k - 1 : k + 2] / y[k]) ** -2.0
            )
            top, height = top * (1.0 + moved), height / float(np.sqrt(max(inverse, 0.5)))
        run = found.frequency[i] ** 2 * abs(found.amplitude[i, blade])
        # heights of both are those of their peaks
        run *= self.peak.height / abs(self.sweep.accelerance[self.side][i])
        return MarchedAgain(top / self.peak.frequency, height / float(run), True, again.seconds)

    def _near(self, again: MotionAgain) -> MarchedAgain:
        one, ratio = again.near, again.ratio
        if one is None:
            return MarchedAgain(float("nan"), float("nan"), False, again.seconds)
        blade = SIDES.index(self.side)
        z, run = one.first_harmonic[blade], self.sweep.found.amplitude[self.peak.sample, blade]
        turned = float(np.angle(z / run))
        return MarchedAgain(
            ratio * (1.0 + turned / self.turn_per_share),
            float(ratio**2 * abs(z) / abs(run)),
            one.settled,
            again.seconds,
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
