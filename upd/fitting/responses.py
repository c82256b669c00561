"""What a fit aims at as functions of what it varies, with derivatives.

Derivatives are differences forward, of the logarithm of each factor. With friction every evaluation
solves the whole curve over frequency, from its lowest end upwards, so that a fit does not depend on
the way it came. Values are those of the harmonic balance alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced import measures
from upd.analyses.forced.curves import fine_grid, linear_peaks
from upd.analyses.forced.measures import (
    CANDIDATES,
    CurvePeak,
    StuckMode,
    numbered_peaks,
    tell_stuck_peaks,
    unmoved,
)
from upd.analyses.forced.model import Model, balance_of, quiet, respond
from upd.analyses.forced.plan import ForcedPlan, grid
from upd.cache.arrays import Journal
from upd.errors import ConvergenceError
from upd.fitting.models import ModelSource
from upd.fitting.parameters import VariedInput
from upd.fitting.targets import (
    CONTACT_TOTALS,
    PEAK_NUMBERS,
    STUCK_MODES,
    CurveTarget,
    Targets,
)
from upd.hbm import FrequencyResponse, climb
from upd.hbm.core.fourier import to_complex
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.sweep import first_point, newton, place_sliders
from upd.linalg.parallel import threads_for
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, Side

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: which peak: the blade and the number of its mode
PeakKey = tuple[Side, int]
#: mm to m
_M = 1e-3
#: difference of both one-sided slopes, over the larger, beyond which a number has none
JUMPS = 0.5
#: relative distance of a frequency asked for from a point of a path that is it
_SAME = 1e-9


class PeakTop(NamedTuple):
    """A peak: Hz, and accelerance in (m/s2)/N."""

    frequency: float
    height: float


def _told(peak: PeakTop | CurvePeak, what: str) -> float:
    """Frequency or height of a peak."""
    return float(peak.frequency if what == "frequency" else peak.height)


class LimitNumbers:
    """Numbers of one model's linear limits; what several of them need is found once.

    Parameters
    ----------
    plan, model
        Of the rig.
    """

    def __init__(self, plan: ForcedPlan, model: Model) -> None:
        self.plan, self.model = plan, model
        self._modes: list[StuckMode] | None = None
        self._peaks: dict[tuple[str, Side], list[CurvePeak]] = {}

    def __call__(self, of: str) -> float:
        """A number.

        Raises
        ------
        ConvergenceError
            Where it is not among the numbers.
        """
        if of in STUCK_MODES:
            return self._mode(of)
        kind, side, number, what = PEAK_NUMBERS[of]
        if (kind, side) not in self._peaks:
            self._peaks[kind, side] = _peaks(self.plan, self.model, kind == "stuck", side)
        peak = next((p for p in self._peaks[kind, side] if p.number == number), None)
        if peak is None:
            e = self.plan.scene.excitation
            raise ConvergenceError(
                f"{of}: no such peak between {e.start:g} and {e.stop:g} Hz, the ends of the sweep"
            )
        return _told(peak, what)

    def curve(self, side: Side, stuck: bool, frequency: Array) -> ComplexArray:
        """Accelerance (k,) of a blade, (m/s2)/N at (k,) Hz."""
        force = self.plan.scene.damper.centrifugal
        b = balance_of(self.plan, self.model, force, (0, *self.model.excitation.harmonics))
        return measures.linear_accelerance(b, self.model.row(side), force, frequency, stuck)

    def _mode(self, of: str) -> float:
        below = CANDIDATES * self.plan.scene.excitation.stop
        if self._modes is None:
            self._modes = measures.stuck_modes(self.model, below)
        for one in self._modes:
            if one.in_phase == (of == "stuck_in_phase"):
                return float(one.frequency)
        raise ConvergenceError(
            f"{of}: no such mode below {below:g} Hz, {CANDIDATES:g} times excitation.stop"
        )


def _peaks(plan: ForcedPlan, model: Model, stuck: bool, side: Side) -> list[CurvePeak]:
    if not stuck and side not in model.excitation.free_blades:
        return []
    force = plan.scene.damper.centrifugal
    problem = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    found = linear_peaks(problem, model.row(side), force, grid(plan), stuck)
    stop = plan.scene.excitation.stop
    return tell_stuck_peaks(model, found, stop) if stuck else unmoved(found)


class CurveWithFriction:
    """What a fit needs at one F_C/F_E.

    Parameters
    ----------
    ratio
        F_C/F_E.
    peaks
        Which peaks.
    frequencies
        (k,) Hz at which both blades' accelerance is, rising; empty without a curve.
    """

    def __init__(self, ratio: float, peaks: Sequence[PeakKey], frequencies: Array) -> None:
        self.ratio, self.peaks, self.frequencies = ratio, tuple(peaks), frequencies
        #: times that the curve was solved
        self.solved = 0

    def at(
        self, plan: ForcedPlan, model: Model
    ) -> tuple[dict[PeakKey, PeakTop | ConvergenceError], dict[Side, ComplexArray]]:
        """Peaks, or why they were not found, and the curves of both blades.

        Raises
        ------
        ConvergenceError
            Where a point of the curve is not found.
        """
        force = plan.scene.damper.centrifugal / self.ratio
        numbers = plan.scene.harmonic_numbers
        assert isinstance(numbers, range)
        b = place_sliders(balance_of(plan, model, force, numbers), plan.scene.excitation.start)
        if b is None:
            raise ConvergenceError(
                f"F_C/F_E {self.ratio:g}: the static loads alone have no solution; to fix it: "
                'balance.slider = "zero"'
            )
        answer = self._solve(plan, model, force)
        tops: dict[PeakKey, PeakTop | ConvergenceError] = {}
        for key in self.peaks:
            try:
                tops[key] = self._top(plan, model, b, answer, key)
            except ConvergenceError as error:
                tops[key] = error
        return tops, self._curves(b, model, force, answer)

    def _solve(self, plan: ForcedPlan, model: Model, force: float) -> FrequencyResponse:
        """The curve over frequency, as fine as its peaks need."""
        over = self.frequencies
        if self.peaks:
            over = np.unique(np.concatenate([fine_grid(plan, model, force), over]))
        self.solved += 1
        # what the balance leaves out is alike on every curve of a fit
        with quiet() if self.solved > 1 else nullcontext():
            return respond(plan, model, force, over)

    def _point(self, b: Balance, answer: FrequencyResponse, f: float) -> Array:
        here = np.flatnonzero(np.abs(answer.frequency / f - 1.0) <= _SAME)
        x = newton(b, answer.x[here[0]], f) if len(here) else first_point(b, f)
        if x is None:
            raise ConvergenceError(
                f"F_C/F_E {self.ratio:g}: no motion at {f:.6g} Hz ({answer.message})"
            )
        return x

    def _top(
        self, plan: ForcedPlan, model: Model, b: Balance, answer: FrequencyResponse, key: PeakKey
    ) -> PeakTop:
        """A peak between the points of the curve."""
        side, number = key
        row, k = model.row(side), model.excitation.lowest
        name = f"{'left_' * (side == 'left')}peak_{number}@{self.ratio:g}"
        force = plan.scene.damper.centrifugal / self.ratio
        height = np.abs(measures.accelerance(answer, row, force))
        peaks = numbered_peaks(model, answer, height, plan.scene.excitation.stop)
        peak = next((one for one in peaks if one.number == number), None)
        if peak is None:
            raise ConvergenceError(f"{name}: no such peak on the curve ({answer.message})")
        f = float(answer.frequency[peak.sample])
        x = newton(b, answer.x[peak.sample], f)
        top = None if x is None else climb(b, row, x, f, harmonic=k, power=2.0)
        if top is None or not top.found:
            raise ConvergenceError(f"{name}: the peak at {peak.frequency:.6g} Hz was not climbed")
        scale = _M * (2.0 * np.pi * k * top.frequency) ** 2 / force
        return PeakTop(top.frequency, float(scale * top.amplitude))

    def _curves(
        self, b: Balance, model: Model, force: float, answer: FrequencyResponse
    ) -> dict[Side, ComplexArray]:
        """Accelerance of both blades at the frequencies."""
        f, k = self.frequencies, model.excitation.lowest
        if not len(f):
            return {side: np.zeros(0, complex) for side in SIDES}
        x = np.array([self._point(b, answer, float(one)) for one in f])
        forces = np.array([b.force(one) for one in x]).reshape(len(f), len(b.Psi), -1)
        rigid = np.array([b.split(one)[1] for one in x])
        q = b.displacement(2.0 * np.pi * f, forces, rigid)
        moving = to_complex(q, b.harmonics)[..., b.harmonics.place(k)]
        return {
            side: measures.accelerance_of(moving @ model.row(side), f, k, force) for side in SIDES
        }


class FitResponses:
    """Targets of a fit as functions of its parameters.

    Parameters
    ----------
    scene
        Of contact points on springs.
    targets, parameters
        Of the fit.
    journal
        Keeps what was found, for a fit that is begun again.
    needed
        Whether every target has to be there; else those that are not are nan.
    like
        Of the same scene: its blades are taken.

    Raises
    ------
    InputError
        As `ModelSource` does.
    """

    def __init__(
        self,
        scene: ForcedScene,
        targets: Targets,
        parameters: Sequence[VariedInput],
        journal: Journal | None = None,
        *,
        needed: bool = True,
        like: FitResponses | None = None,
    ) -> None:
        self.scene, self.targets, self.parameters = scene, targets, tuple(parameters)
        self.source: ModelSource = ModelSource(
            scene, parameters, targets.ratios, None if like is None else like.source
        )
        self.cheap = self.source.cheap
        self.stiffness = self.source.stiffness
        self._journal, self._needed = journal, needed
        self._found: dict[bytes, tuple[Array, Array]] = {}
        for line in () if journal is None else journal.lines:
            z, value, slope = (np.array(one, float) for one in line)
            self._found[z.tobytes()] = value, slope.reshape(len(value), len(z))
        self.friction = [_curve_at(ratio, targets) for ratio in targets.ratios]

    def at(self, z: Array) -> tuple[Array, Array]:
        """The numbers, then the points of the curves, and their derivatives.

        Parameters
        ----------
        z
            (n,) logarithms of the parameters' factors.

        Returns
        -------
        value, slope
            (m,) in the targets' units; (m, n) derivatives by z.

        Raises
        ------
        InputError
            Where the scene refuses the parameters.
        ConvergenceError
            Where a target is not among the numbers, or a curve is not found.
        """
        z = np.asarray(z, float)
        key = z.tobytes()
        if key not in self._found:
            self._found[key] = found = self._solved(z)
            if self._journal is not None:
                self._journal.keep([z.tolist(), *(one.tolist() for one in found)])
        return self._found[key]

    def value(self, z: Array) -> Array:
        """(m,) without derivatives."""
        z = np.asarray(z, float)
        return self._evaluate(z, *self.source.at(z))

    def _solved(self, z: Array) -> tuple[Array, Array]:
        value = self.value(z)
        slope = np.zeros((len(value), len(self.parameters)))
        for k, step in enumerate(self.source.steps):
            slope[:, k] = (self._moved(z, k, step) - value) / step
            if not self._needed:
                below = (value - self._moved(z, k, -step)) / step
                # a number that jumps has no slope
                largest = np.fmax(np.abs(slope[:, k]), np.abs(below))
                jumps = np.abs(slope[:, k] - below) > JUMPS * largest
                slope[jumps, k] = np.nan
        return value, slope

    def _moved(self, z: Array, k: int, step: float) -> Array:
        there = z.copy()
        there[k] += step
        return self.value(there)

    def _evaluate(self, z: Array, plan: ForcedPlan, model: Model) -> Array:
        parts: list[Array] = []
        with threads_for(len(model.M)):
            friction = {one.ratio: one.at(plan, model) for one in self.friction}
            limits = LimitNumbers(plan, model)
            for one in self.targets.numbers:
                try:
                    if one.of in CONTACT_TOTALS:
                        side, which = CONTACT_TOTALS[one.of]
                        v = float(getattr(self.source.totals(z)[side], which))
                    elif one.ratio is None:
                        v = limits(one.of)
                    else:
                        _, side, number, what = PEAK_NUMBERS[one.of]
                        peak = friction[one.ratio][0][side, number]
                        if isinstance(peak, ConvergenceError):
                            raise peak
                        v = _told(peak, what)
                except ConvergenceError:
                    if self._needed:
                        raise
                    v = np.nan
                parts.append(np.array([v]))
            for curve in self.targets.curves:
                of = curve.curve
                if of.force_ratio is None:
                    H = limits.curve(of.blade, of.state == "stuck", of.frequency)
                else:
                    at = np.searchsorted(self._frequencies(of.force_ratio), of.frequency)
                    H = friction[of.force_ratio][1][of.blade][at]
                parts.append(_in_parts(curve, H))
        return np.concatenate(parts)

    def _frequencies(self, ratio: float) -> Array:
        return next(one.frequencies for one in self.friction if one.ratio == ratio)


def _curve_at(ratio: float, targets: Targets) -> CurveWithFriction:
    """What targets need of one F_C/F_E."""
    peaks: dict[PeakKey, None] = {}
    for one in targets.numbers:
        if one.ratio == ratio:
            _, side, number, _ = PEAK_NUMBERS[one.of]
            peaks[side, number] = None
    over = [one.curve.frequency for one in targets.curves if one.curve.force_ratio == ratio]
    frequencies = np.unique(np.concatenate(over)) if over else np.zeros(0)
    return CurveWithFriction(ratio, list(peaks), frequencies)


def _in_parts(target: CurveTarget, H: ComplexArray) -> Array:
    """Real and imaginary parts, or magnitudes."""
    if target.curve.is_complex:
        return np.concatenate([H.real, H.imag])
    return np.maximum(np.abs(H), np.finfo(float).tiny)
