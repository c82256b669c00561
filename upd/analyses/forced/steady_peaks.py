"""Maxima of a path by harmonic balance that no steady motion has.

A path runs through motions that are steady and through others that the least disturbance ends; the
balance does not tell them apart. A march that begins in the balance's own motion does: it stays
within the half-power band of what is steady, a little off by the harmonics left out, and leaves
what is not. No test would show such a maximum; the next lower one of the mode is its peak.

A march also leaves a motion that is too far from any for want of harmonics, and the very end of a
peak at a fold. The highest maximum of each mode that a march leaves is therefore climbed to with
more harmonics and marched on from again, and every maximum is left only if motions a little below
it are.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from upd.analyses.forced.curves import ForcedCurve, LeftMaximum
from upd.analyses.forced.effects import MORE_HARMONICS
from upd.analyses.forced.mode_peaks import ModePeak, numbered_peaks
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.paths import balance_with
from upd.analyses.forced.plan import MARCH_SAMPLES, ForcedPlan, time_steps
from upd.analyses.forced.spring_march import SpringMarch
from upd.analyses.forced.sweeps import make_springs, marched_on
from upd.errors import ConvergenceError, one_line
from upd.hbm import climb
from upd.hbm.balance import Balance
from upd.hbm.fourier import to_complex
from upd.hbm.peaks import is_near
from upd.hbm.starts import newton
from upd.linalg.parallel import threads_for
from upd.scene.forced_contact import SIDES, Side

log = logging.getLogger(__name__)
#: of an amplitude at the ends of a resonance's band of half the power
HALF_POWER = math.sqrt(0.5)
#: of a top's height, how far beside it the same motion is looked for
LITTLE = 0.95
#: the same, from where it is climbed to with more harmonics
FROM = (1.0, 0.95, 0.9, 0.8, 0.7)


def with_steady_peaks(plan: ForcedPlan, model: Model, curve: ForcedCurve) -> ForcedCurve:
    """The curve with those of its maxima that a march leaves, down to the first that it does not.

    Parameters
    ----------
    plan, model
        Of the rig.
    curve
        Of the model.
    """
    if curve.empty:
        return curve
    with threads_for(3 * model.contacts.n_point):
        return replace(curve, left=tuple(_Marches(plan, model, curve).left()))


class _Motion(NamedTuple):
    """A motion of the balance: the problem, its unknowns, Hz."""

    b: Balance
    x: Array
    frequency: float


class _Marches:
    """Marches from the maxima of a curve."""

    def __init__(self, plan: ForcedPlan, model: Model, curve: ForcedCurve) -> None:
        self.plan, self.model, self.curve = plan, model, curve
        # peaks that are steady with more harmonics, and all that were looked at with these
        self._kept: set[int] = set()
        self._again: set[int] = set()

    @cached_property
    def springs(self) -> SpringMarch:
        return make_springs(self.plan, self.model)

    def left(self) -> list[LeftMaximum]:
        """Of both blades; every round looks at maxima that none before did."""
        found: list[LeftMaximum] = []
        steady: set[int] = set()
        for blade in reversed(SIDES):
            while True:
                known = steady.union(one.peak.sample for one in found)
                new = [one for one in self._peaks(blade, found) if one.sample not in known]
                if not new:
                    break
                for peak in new:
                    one = self._judged(blade, peak)
                    if one is None:
                        steady.add(peak.sample)
                    else:
                        found.append(one)
        return found

    def _peaks(self, blade: Side, without: list[LeftMaximum]) -> list[ModePeak]:
        curve, stop = self.curve, self.plan.scene.excitation.stop
        samples = {one.peak.sample for one in without}
        size = np.abs(curve.accelerance[blade])
        return numbered_peaks(self.model, curve.answer, size, stop, samples)

    def _judged(self, blade: Side, peak: ModePeak) -> LeftMaximum | None:
        """The maximum, where a march leaves it."""
        if not (self.curve.answer.state[peak.sample, :, 1:] > 0.0).any():
            # stuck everywhere: linear, and damped
            return None
        at_top = self._gone(self._at(peak.sample))
        if at_top is None or peak.number in self._kept:
            return None
        near = self._beside(blade, peak.sample, LITTLE)
        if any(self._gone(self._at(i)) is None for i in near):
            return None
        if peak.number not in self._again:
            self._again.add(peak.number)
            tops = (self._top(blade, peak, times * MORE_HARMONICS) for times in (1, 2))
            if any(self._gone(one) is None for one in tops if one is not None):
                self._kept.add(peak.number)
                return None
        return LeftMaximum(blade, peak, float(at_top[SIDES.index(blade)]))

    def _at(self, i: int) -> _Motion:
        answer = self.curve.answer
        return _Motion(answer.balance, answer.x[i], float(answer.frequency[i]))

    def _beside(self, blade: Side, top: int, share: float) -> Iterator[int]:
        """Points of the path before and after a top, where it has fallen to a share of it."""
        size = np.abs(self.curve.accelerance[blade])
        for step in (-1, 1):
            i = top
            while 0 <= i + step < len(size) and size[i] > share * size[top]:
                i += step
            yield i

    def _top(self, blade: Side, peak: ModePeak, more: int) -> _Motion | None:
        """The top with so many harmonics more, climbed to from the nearest motion beside it that
        has one with these.
        """
        old, model, force = self.curve.answer.balance, self.model, self.curve.force
        b = balance_with(self.plan, model, force, old, old.harmonics.highest + more)
        k, row = model.excitation.lowest, model.row(blade)
        for i in dict.fromkeys(i for one in FROM for i in self._beside(blade, peak.sample, one)):
            f = float(self.curve.frequency[i])
            x = newton(b, b.embedded(self.curve.answer.x[i], old), f)
            if x is not None:
                top = climb(b, row, x, f, harmonic=k, power=2)
                height = 1e-3 * (2.0 * np.pi * k * top.frequency) ** 2 * top.amplitude / force
                near = is_near(top.frequency / peak.frequency, height / peak.height)
                return _Motion(b, top.x, top.frequency) if top.found and near else None
        return None

    def _gone(self, at: _Motion) -> Array | None:
        """Where a march from a motion goes, (m/s2)/N of the blades by SIDES, if not to the same."""
        model, force = self.model, self.curve.force
        try:
            steps = max(time_steps(self.plan.scene), MARCH_SAMPLES)
            found = marched_on(self.springs, model, *at, force, steps)
        except ConvergenceError as error:
            where = f"{self.curve.case}, {at.frequency:.6g} Hz"
            log.info("%s not marched on: %s", where, one_line(error))
            return None
        scale = 1e-3 * (2.0 * np.pi * model.excitation.lowest * at.frequency) ** 2 / force
        marched = scale * np.abs(found.first_harmonic[: len(SIDES)])
        balanced = scale * np.array([self._amplitude(at, side) for side in SIDES])
        ratio = float(np.linalg.norm(marched) / np.linalg.norm(balanced))
        return None if HALF_POWER <= ratio <= 1.0 / HALF_POWER else np.asarray(marched)

    def _amplitude(self, at: _Motion, side: Side) -> float:
        """Of a blade in the lowest harmonic excited, mm."""
        b, j = at.b, at.b.harmonics.place(self.model.excitation.lowest)
        omega = np.array([2.0 * np.pi * at.frequency])
        force = b.force(at.x).force.reshape(1, len(b.Psi), b.harmonics.size)
        moving = to_complex(b.displacement(omega, force, b.split(at.x)[1][None])[0], b.harmonics)
        return float(abs(self.model.row(side) @ moving[:, j]))
