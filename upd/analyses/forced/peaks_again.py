"""Peaks of a path found again with one choice changed, by climbing from the run's own.

Newton's method takes the answer of the run beside its peak into the changed problem, and the peak
of the acceleration is climbed to along its path: a few dozen steps, where a band around the peak
takes hundreds. The band is followed where Newton's method does not get there.

Where points slip or open one after another, the top of a peak is flat, with maxima side by side,
some closer than the points of the path. Climbs therefore begin from the very top of the run, with a
first step shorter than their distance: the same maximum is compared where a change moves it less.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import NamedTuple

import numpy as np

from upd.analyses.forced.companions import AXES, OtherModel
from upd.analyses.forced.curves import ForcedCurve
from upd.analyses.forced.measures import accelerance, path_maxima
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.paths import (
    BAND,
    BAND_POINTS,
    balance_like,
    balance_of,
    balance_with,
    respond,
)
from upd.analyses.forced.plan import ForcedPlan
from upd.errors import ConvergenceError, one_line
from upd.hbm import climb
from upd.hbm.balance import Balance
from upd.hbm.peaks import FIRST_REACH, is_near
from upd.hbm.starts import newton
from upd.scene.forced_contact import Side

log = logging.getLogger(__name__)
#: first step of a climb from where the peak is expected, over the usual one: 5e-5 of the frequency
_CLOSE = 0.1
#: times that a top is climbed from again with short steps, while that leads higher
_AGAIN = 4
#: tops whose frequencies differ by less are told as one
_SAME = 1e-5
#: points of the path beside the peak from which it is tried, as shares of its height
_FROM = (1.0, 0.9, 0.8, 0.7)


@dataclass(frozen=True)
class ClimbedPeak:
    """A peak of the acceleration of a blade: Hz, (m/s2)/N, unknowns of the balance; NaN where it
    was not found.
    """

    frequency: float
    height: float
    seconds: float
    x: Array | None = None

    @property
    def found(self) -> bool:
        """Whether it was."""
        return bool(np.isfinite(self.height))


_NONE = ClimbedPeak(float("nan"), float("nan"), 0.0)


class ClimbStart(NamedTuple):
    """Where a climb begins, and from where on what it finds is another peak.

    Attributes
    ----------
    x, frequency
        Unknowns; Hz.
    about
        Where the peak is expected, Hz.
    step
        The first one, over the usual one.
    unless
        Height of a peak that makes it needless, (m/s2)/N.
    """

    x: Array
    frequency: float
    about: float
    step: float = 1.0
    unless: float = 0.0


@dataclass(frozen=True)
class PathPeakAt:
    """A peak of a path that is to be found again.

    Attributes
    ----------
    plan, model
        Of the run.
    curve, side, peak
        Where it is.
    """

    plan: ForcedPlan
    model: Model
    curve: ForcedCurve
    side: Side
    peak: ModePeak

    @property
    def slips(self) -> bool:
        """Whether a point slips or opens there."""
        return bool((self.curve.answer.state[self.peak.sample, :, 1:] > 0.0).any())

    @property
    def highest(self) -> int:
        """Its highest harmonic."""
        return int(self.curve.answer.highest_harmonic[self.peak.sample])

    @cached_property
    def maxima(self) -> list[int]:
        """Points of the path at the peak, and at other maxima about it (`maxima_about`)."""
        size = np.abs(self.curve.accelerance[self.side])
        found = maxima_about(self.curve.answer.frequency, size, self.peak.sample)
        return [i for i in found if i not in self.curve.left_points]

    @cached_property
    def top(self) -> ClimbedPeak:
        """With nothing changed, between the points of the path: the highest of what is climbed to
        from the peak's own point and from those beside it, and from there with short steps.
        """
        b, found = self.curve.answer.balance, self._side_by_side
        best = max(found, key=lambda one: one.height if one.found else 0.0)
        for _ in range(_AGAIN):
            if best.x is None:
                break
            start = ClimbStart(best.x, best.frequency, self.peak.frequency, _CLOSE)
            higher = self._climbed_from(b, self.model, start)
            if not higher or not higher[0].height > best.height:
                break
            best = higher[0]
        return replace(best, seconds=found[0].seconds)

    @cached_property
    def _side_by_side(self) -> list[ClimbedPeak]:
        """What is climbed to from the peak's own point; from the points beside it where it is no
        lower than the own point.
        """
        b, i = self.curve.answer.balance, self.peak.sample
        size, f = np.abs(self.curve.accelerance[self.side]), self.curve.answer.frequency
        found = [self._climbed(b, self.model, self._starts(b))]
        for beside in (i - 1, i + 1):
            if 0 <= beside < len(size):
                start = ClimbStart(
                    self.curve.answer.x[beside], float(f[beside]), self.peak.frequency
                )
                climbed = self._climbed_from(b, self.model, start)
                found += [one for one in climbed if one.height >= size[i]]
        return found

    def between_points(self, attribute: str) -> tuple[float, str]:
        """What the points of the path, and maxima side by side between them, leave in a number of
        the peak, over the number, and how that is known.

        Parameters
        ----------
        attribute
            Of a peak: frequency or height.
        """
        if not self.top.found:
            return math.nan, "not estimated: the peak was not climbed to"
        beside = [one for one in self._side_by_side if one.found]
        tops, mine = [self.top, *beside], getattr(self.peak, attribute)
        left = max(abs(mine / getattr(one, attribute) - 1.0) for one in tops)
        low, high = (least(one.frequency for one in tops) for least in (min, max))
        why = "against the peak on the path itself, between its points"
        if high - low > _SAME * high:
            why += f"; maxima side by side at {low:.6g} to {high:.6g} Hz"
        return left, why

    def with_harmonics(self, highest: int) -> ClimbedPeak:
        """With these harmonics."""
        old = self.curve.answer.balance
        b = balance_with(self.plan, self.model, self.curve.force, old, highest)
        starts = (one._replace(x=b.embedded(one.x, old)) for one in self._all_starts(old))
        return self._climbed(b, self.model, chain(starts, self._band(b, self.model)))

    def with_samples(self, times: int) -> ClimbedPeak:
        """With so many times the samples."""
        old = self.curve.answer.balance
        samples = times * old.samples
        b = balance_like(
            self.plan, self.model, self.curve.force, old, old.harmonics.numbers, samples
        )
        starts = chain(self._all_starts(old), self._band(b, self.model))
        return self._climbed(b, self.model, starts)

    def on(self, companion: OtherModel, ratio: float) -> ClimbedPeak:
        """On another model; on other rows of contact points the highest of all maxima about it.

        Where points slip or open one after another, a path has maxima beside each other, of which a
        run tells the highest. Those of other rows lie elsewhere: the one that is climbed to from
        the run's peak need not be their highest.

        Parameters
        ----------
        ratio
            Of its frequencies to those of the run, as far as the linear limits tell.
        """
        old = self.curve.answer.balance
        b = balance_of(
            self.plan, companion.model, self.curve.force, old.harmonics.numbers, old.samples
        )
        everywhere = companion.ladder == AXES[0]
        # from where the linear limits expect the peak; points that slip may leave it where it was
        starts = (
            one._replace(x=_carried(b, old, one.x, companion.move), frequency=one.frequency * times)
            for times in dict.fromkeys((ratio, 1.0))
            for one in self._all_starts(old, everywhere)
        )
        return self._climbed(
            b, companion.model, chain(starts, self._band(b, companion.model, ratio))
        )

    def _all_starts(self, b: Balance, everywhere: bool = False) -> Iterator[ClimbStart]:
        """The top; other maxima about it, the highest first, while what is climbed to is lower than
        they were, or all of them; points of the path beside the peak.
        """
        answer, size = self.curve.answer, np.abs(self.curve.accelerance[self.side])
        if self.top.x is not None:
            yield ClimbStart(self.top.x, self.top.frequency, self.peak.frequency, _CLOSE, math.inf)
        for i in self.maxima[1:]:
            f, unless = float(answer.frequency[i]), math.inf if everywhere else float(size[i])
            yield ClimbStart(answer.x[i], f, self.peak.frequency, unless=unless)
        yield from self._starts(b)

    def _starts(self, b: Balance) -> Iterator[ClimbStart]:
        """Points of the path at the peak and beside it, on both sides, until it falls too low."""
        answer, top = self.curve.answer, self.peak.sample
        size = np.abs(self.curve.accelerance[self.side])
        seen = set()
        for share in _FROM:
            for step in (1, -1):
                i = top
                while 0 <= i + step < len(size) and size[i] > share * size[top]:
                    i += step
                if i not in seen:
                    seen.add(i)
                    yield ClimbStart(answer.x[i], float(answer.frequency[i]), self.peak.frequency)

    def _band(self, b: Balance, model: Model, ratio: float = 1.0) -> Iterator[ClimbStart]:
        """Peaks of a path along a band about where the peak is expected, the highest first; then of
        one three times as wide.
        """
        f = ratio * self.peak.frequency
        for times in (1, 3):
            half = times * BAND
            band = np.linspace((1.0 - half) * f, (1.0 + half) * f, times * BAND_POINTS)
            try:
                found = respond(
                    self.plan,
                    model,
                    self.curve.force,
                    band,
                    harmonics=b.harmonics.numbers,
                    samples=b.samples,
                )
            except ConvergenceError as error:
                log.info("band about %.6g Hz not followed: %s", f, one_line(error))
                continue
            size = np.abs(accelerance(found, model.row(self.side), self.curve.force))
            for peak in sorted(path_maxima(found.frequency, size), key=lambda one: -one.height):
                yield ClimbStart(found.x[peak.sample], float(found.frequency[peak.sample]), f)

    def _climbed(self, b: Balance, model: Model, starts: Iterator[ClimbStart]) -> ClimbedPeak:
        """The highest peak that is climbed to from the starts that are to be tried."""
        begin, top = time.thread_time(), _NONE
        for start in starts:
            if top.height >= start.unless:
                break
            found = self._climbed_from(b, model, start)
            top = max([top, *found], key=lambda one: one.height if one.found else 0.0)
        return replace(top, seconds=time.thread_time() - begin)

    def _climbed_from(self, b: Balance, model: Model, start: ClimbStart) -> list[ClimbedPeak]:
        """The peak uphill from there; empty without one."""
        f = start.frequency
        x = newton(b, start.x, f)
        if x is None:
            return []
        k = model.excitation.lowest
        row, reach = model.row(self.side), start.step * FIRST_REACH
        top = climb(b, row, x, f, reach, harmonic=k, power=2)
        omega = 2.0 * np.pi * k * top.frequency
        height = 1e-3 * omega**2 * top.amplitude / self.curve.force
        if not top.found or not is_near(top.frequency / start.about, height / self.peak.height):
            return []
        return [ClimbedPeak(top.frequency, float(height), 0.0, top.x)]


def maxima_about(frequency: Array, height: Array, top: int) -> list[int]:
    """Points of a path at a maximum, and at others about it that are nearly as high, the highest
    first.

    Parameters
    ----------
    frequency, height
        (n,) along the path, Hz and (m/s2)/N.
    top
        Point of the maximum.
    """
    others = [
        one.sample
        for one in path_maxima(frequency, height)
        if one.sample != top
        and height[one.sample] > _FROM[-1] * height[top]
        and is_near(frequency[one.sample] / frequency[top], height[one.sample] / height[top])
    ]
    return [top, *sorted(others, key=lambda i: -height[i])]


def _carried(b: Balance, old: Balance, x: Array, move: Array) -> Array:
    """Unknowns of an answer on another model: the same motion of its points, the rigid motion that
    goes with it.
    """
    W, _ = old.split(x)
    moved = np.einsum("pq,qdk->pdk", move, W)
    flat = np.concatenate([moved.ravel(), np.zeros(b.rigid)])
    if not b.rigid:
        return flat
    F = b.force(flat).force.reshape(len(b.Psi), -1)
    rows = b.Psi[:, b.modal.rigid]
    mean = moved.reshape(len(b.Psi), -1)[:, 0] + b.G0 @ F[:, 0] - b.u0
    a = np.linalg.lstsq(rows, mean, rcond=None)[0]
    return np.concatenate([moved.ravel(), a])
