"""What a fit aims at as functions of what it varies, with derivatives.

Derivatives by data that are known in closed form are exact; others are central differences of the
logarithm of the factor.

Of the linear limits, free and with every point stuck, they are exact. Of a curve q = D^-1 F,
D = K + i w C - w^2 M, with the adjoint z = D^-1 r of the output r'q

    d(r'q)/dp = -z' dD/dp q.

With friction every evaluation solves the whole curve over frequency, from its lowest end upwards,
so that a fit does not depend on the way it came. Values are those of the harmonic balance alone;
derivatives by implicit differentiation.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced import measures
from upd.analyses.forced.linear_limits import fine_grid, linear_peaks
from upd.analyses.forced.measures import (
    CANDIDATES,
    CurvePeak,
    numbered_peaks,
    tell_stuck_peaks,
    unmoved,
)
from upd.analyses.forced.model import Model, balance_of, quiet, respond
from upd.analyses.forced.plan import ForcedPlan, grid
from upd.analyses.forced.sensitivity import (
    DataChange,
    limit_peak,
    linear_system,
    stuck_frequencies,
)
from upd.cache.arrays import Journal
from upd.errors import ConvergenceError
from upd.fitting.models import STEP, FittedModel, ModelSource
from upd.fitting.parameters import VariedInput
from upd.fitting.targets import (
    CONTACT_TOTALS,
    PEAK_NUMBERS,
    STUCK_MODES,
    CurveTarget,
    FitTarget,
    Targets,
)
from upd.hbm import FrequencyResponse, climb
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.hbm.peaks.sensitivity import (
    PeakDerivative,
    displacement_derivatives,
    peak_derivatives,
)
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.starts import first_point, newton, place_sliders
from upd.linalg.parallel import threads_for
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, Side

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: which peak: the blade and the number of its mode
PeakKey = tuple[Side, int]
#: both blades' curves: values and changes
Curves = dict[Side, tuple[ComplexArray, ComplexArray]]
#: mm to m
_M = 1e-3
#: relative distance of a frequency asked for from a point of a path that is it
_SAME = 1e-9


def number_of(peak: PeakDerivative, what: str) -> tuple[float, Array]:
    """Frequency or height of a peak, and its changes."""
    if what == "frequency":
        return peak.frequency, peak.by_frequency
    return peak.height, peak.by_height


class LimitNumbers:
    """Numbers of one model's linear limits; what several of them need is found once.

    Parameters
    ----------
    plan, model
        Of the rig.
    changes
        What every known parameter changes.
    """

    def __init__(self, plan: ForcedPlan, model: Model, changes: Sequence[ParameterChange]) -> None:
        self.plan, self.model, self.changes = plan, model, changes
        self._modes: dict[str, tuple[float, Array]] | None = None
        self._peaks: dict[tuple[str, Side], list[CurvePeak]] = {}

    def __call__(self, of: str) -> tuple[float, Array]:
        """A number and its changes.

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
        found = limit_peak(self.model, side, kind == "stuck", peak.frequency, self.changes)
        by = peak.height * found.by_height / found.height
        return number_of(PeakDerivative(peak.frequency, peak.height, by, found.by_frequency), what)

    def _mode(self, of: str) -> tuple[float, Array]:
        below = CANDIDATES * self.plan.scene.excitation.stop
        if self._modes is None:
            self._modes = stuck_frequencies(self.model, below, self.changes)
        if of not in self._modes:
            raise ConvergenceError(
                f"{of}: no such mode below {below:g} Hz, {CANDIDATES:g} times excitation.stop"
            )
        f, change = self._modes[of]
        return f, f * change


def limit_curve(
    model: Model, side: Side, stuck: bool, frequency: Array, changes: Sequence[ParameterChange]
) -> tuple[ComplexArray, ComplexArray]:
    """Accelerance of a blade in a linear limit and its changes.

    Parameters
    ----------
    side
        Of the accelerometer.
    stuck
        With every point stuck; else without the damper.
    frequency
        (k,) Hz.
    changes
        What every known parameter changes.

    Returns
    -------
    value, by_parameter
        (k,) and (k, n), (m/s2)/N.
    """
    system = linear_system(model, stuck)
    made = [system.changed(one, model.contacts.tangents) for one in changes]
    force = np.concatenate([model.force, np.zeros(model.damper.n_dof)])
    both = np.column_stack([force, model.row(side)])
    if not stuck:
        # without contacts the damper is not held: it does not move, and is omitted
        n = model.n
        both, M, C, K = both[:n], model.M, model.C, model.K
        made = [(m[:n, :n], c[:n, :n], k[:n, :n]) for m, c, k in made]
    else:
        M, C, K = system.M, system.C, system.K
    value, slope = [], []
    for f in frequency:
        w = 2.0 * np.pi * model.excitation.lowest * f
        q, z = np.linalg.solve(K + 1j * w * C - w**2 * M, both).T
        scale = -(w**2) * _M
        value.append(scale * (q @ both[:, 1]))
        slope.append([-scale * (z @ (dK + 1j * w * dC - w**2 * dM) @ q) for dM, dC, dK in made])
    return np.array(value), np.array(slope, complex).reshape(len(frequency), len(changes))


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
        self, plan: ForcedPlan, model: Model, changes: Sequence[DataChange]
    ) -> tuple[dict[PeakKey, PeakDerivative | ConvergenceError], Curves]:
        """Peaks, or why they were not found, and the curves of both blades with their changes.

        Parameters
        ----------
        plan, model
            Of the rig.
        changes
            What every known parameter changes.

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
        place = plan.scene.excitation.centrifugal_to_force.index(self.ratio)
        forces = np.array([one.forces[place] for one in changes])
        whole = [
            one.whole(model) + ParameterChange(dynamic=each * b.dynamic)
            for one, each in zip(changes, forces, strict=True)
        ]
        answer = self._solve(plan, model, force)
        points = [self._point(b, answer, float(f)) for f in self.frequencies]
        tops: dict[PeakKey, PeakDerivative | ConvergenceError] = {}
        for key in self.peaks:
            try:
                x, f = self._top(plan, model, b, answer, key)
                row, k = model.row(key[0]), model.excitation.lowest
                one = peak_derivatives(b, row, x, f, whole, harmonic=k, power=2.0)
            except ConvergenceError as error:
                tops[key] = error
                continue
            height = one.height * _M / force
            by = height * (one.by_height / one.height - forces)
            tops[key] = PeakDerivative(f, height, by, one.by_frequency)
        return tops, self._curves(b, model, force, points, whole, forces)

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
    ) -> tuple[Array, float]:
        """Unknowns and Hz of a peak."""
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
        return top.x, top.frequency

    def _curves(
        self,
        b: Balance,
        model: Model,
        force: float,
        points: Sequence[Array],
        whole: Sequence[ParameterChange],
        forces: Array,
    ) -> Curves:
        rows, k = [model.row(side) for side in SIDES], model.excitation.lowest
        value = np.zeros((2, len(points)), complex)
        slope = np.zeros((2, len(points), len(whole)), complex)
        for i, (f, x) in enumerate(zip(self.frequencies, points, strict=True)):
            moved, by = displacement_derivatives(b, rows, x, float(f), whole, harmonic=k)
            scale = -((2.0 * np.pi * k * f) ** 2) * _M / force
            value[:, i] = scale * moved
            slope[:, i] = scale * (by - moved[:, None] * forces)
        return {side: (value[j], slope[j]) for j, side in enumerate(SIDES)}


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
        self.exact, self.cheap = self.source.exact, self.source.cheap
        self.stiffness = self.source.stiffness
        self._journal, self._needed = journal, needed
        self._found: dict[bytes, tuple[Array, Array]] = {}
        for line in () if journal is None else journal.lines:
            z, value, slope = (np.array(one, float) for one in line)
            self._found[z.tobytes()] = value, slope.reshape(len(value), len(z))
        self._kept: tuple[bytes, Array, Array] | None = None
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
        if self._kept is not None and self._kept[0] == key:
            return self._kept[1], self._kept[2]
        found = self._found.get(key)
        if found is None:
            found = self._solved(z)
            if self._journal is not None:
                self._found[key] = found
                self._journal.keep([z.tolist(), *(one.tolist() for one in found)])
        self._kept = (key, *found)
        return found

    def value(self, z: Array) -> Array:
        """(m,) without derivatives."""
        z = np.asarray(z, float)
        return self._evaluate(z, self.source.at(z))[0]

    def _solved(self, z: Array) -> tuple[Array, Array]:
        made = self.source.at(z, changes=True)
        known = [k for k, exact in enumerate(self.exact) if exact]
        value, some = self._evaluate(z, made)
        slope = np.zeros((len(value), len(self.parameters)))
        # of half an interval of STEP each way
        slope[:, known] = some / np.sinh(STEP)
        for k in (k for k, exact in enumerate(self.exact) if not exact):
            step = self.source.steps[k]
            low, high = (self._shifted(z, k, side * step) for side in (-1.0, 1.0))
            slope[:, k] = (high - low) / (2.0 * step)
        return value, slope

    def _shifted(self, z: Array, k: int, shift: float) -> Array:
        moved = z.copy()
        moved[k] += shift
        return self.value(moved)

    def _evaluate(self, z: Array, made: FittedModel) -> tuple[Array, Array]:
        """Values, and what the changes do to them."""
        plan, model, data = made.plan, made.model, made.changes
        changes = [one.whole(model) for one in data]
        parts: list[tuple[Array, Array]] = []
        with threads_for(len(model.M)):
            friction = {one.ratio: one.at(plan, model, data) for one in self.friction}
            limits = LimitNumbers(plan, model, changes)
            for one in self.targets.numbers:
                try:
                    if one.of in CONTACT_TOTALS:
                        v, s = self._total(z, one, data)
                    elif one.ratio is None:
                        v, s = limits(one.of)
                    else:
                        _, side, number, what = PEAK_NUMBERS[one.of]
                        peak = friction[one.ratio][0][side, number]
                        if isinstance(peak, ConvergenceError):
                            raise peak
                        v, s = number_of(peak, what)
                except ConvergenceError:
                    if self._needed:
                        raise
                    v, s = np.nan, np.full(len(changes), np.nan)
                parts.append((np.array([v]), np.asarray(s)[None, :]))
            for curve in self.targets.curves:
                of = curve.curve
                if of.force_ratio is None:
                    H, dH = limit_curve(model, of.blade, of.state == "stuck", of.frequency, changes)
                else:
                    H, dH = friction[of.force_ratio][1][of.blade]
                    at = np.searchsorted(self._frequencies(of.force_ratio), of.frequency)
                    H, dH = H[at], dH[at]
                parts.append(_in_parts(curve, H, dH))
        value, slope = zip(*parts, strict=True)
        return np.concatenate(value), np.concatenate(slope)

    def _frequencies(self, ratio: float) -> Array:
        return next(one.frequencies for one in self.friction if one.ratio == ratio)

    def _total(self, z: Array, one: FitTarget, data: Sequence[DataChange]) -> tuple[float, Array]:
        """A total of the right face, and its changes by known parameters."""
        side, which = CONTACT_TOTALS[one.of]

        def total(place: Array) -> float:
            return float(getattr(self.source.totals(place)[side], which))

        change = []
        known = [k for k, exact in enumerate(self.exact) if exact][: len(data)]
        for k in known:
            step = np.zeros(len(z))
            step[k] = STEP
            change.append(0.5 * (total(z + step) - total(z - step)))
        return total(z), np.array(change)


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


def _in_parts(target: CurveTarget, H: ComplexArray, dH: ComplexArray) -> tuple[Array, Array]:
    """Real and imaginary parts, or magnitudes, with their derivatives."""
    if target.curve.is_complex:
        return np.concatenate([H.real, H.imag]), np.concatenate([dH.real, dH.imag])
    size = np.maximum(np.abs(H), np.finfo(float).tiny)
    return size, np.asarray((H.conj()[:, None] * dH).real / size[:, None])
