"""Peaks of sweeps marched again with one choice changed: with more steps, on another model.

Only at the frequency of the peak, from where its last period began. What the height changes is
read there; what the frequency of the peak changes from the phase, by its slope along the sweep.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from upd.analyses.forced.companions import Companion
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
from upd.scene.forced import SIDES, Side

#: points of a sweep on each side of a peak that tell its slopes
_BESIDE = 2


@dataclass(frozen=True)
class MarchedAgain:
    """Frequency and height of a peak marched again over those of the run; NaN where it ended."""

    frequency: float
    height: float
    settled: bool
    seconds: float


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
        start = found.starts[self.peak.sample].copy()
        return self._marched(found.model, times * found.samples, start, 1.0)

    def on(self, companion: Companion, springs: SpringMarch, ratio: float) -> MarchedAgain:
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
        start = carried_over(
            springs,
            found.starts[self.peak.sample],
            found.model,
            companion.move,
            companion.share,
            drive,
        )
        return self._marched(springs.march, found.samples, start, ratio)

    def _marched(
        self, model: InterfaceModel, samples: int, at: InterfaceState, ratio: float
    ) -> MarchedAgain:
        begin, found, i = time.perf_counter(), self.sweep.found, self.peak.sample
        f = ratio * float(found.frequency[i])
        march = InterfaceMarch(model, f, found.drive, samples, by_coulomb)
        try:
            one = settle(march, at, TOLERANCE, MOST_PERIODS, accelerate=True)
        except ConvergenceError:
            nan = float("nan")
            return MarchedAgain(nan, nan, False, time.perf_counter() - begin)
        blade = SIDES.index(self.side)
        z, run = one.first_harmonic[blade], found.amplitude[i, blade]
        turned = float(np.angle(z / run))
        return MarchedAgain(
            ratio * (1.0 + turned / self.turn_per_share),
            float(ratio**2 * abs(z) / abs(run)),
            one.settled,
            time.perf_counter() - begin,
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
