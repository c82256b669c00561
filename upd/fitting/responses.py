"""What a fit aims at as functions of what it varies, with derivatives.

Derivatives by data that are known in closed form are exact; others are central differences of the
logarithm of the factor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced.input_uncertainty import DataChange
from upd.cache.journal import Journal
from upd.errors import ConvergenceError
from upd.fitting.friction import CurveWithFriction, PeakKey
from upd.fitting.limits import LimitNumbers, limit_curve, number_of
from upd.fitting.models import STEP, FittedModel, ModelSource
from upd.fitting.parameters import VariedInput
from upd.fitting.targets import (
    CONTACT_TOTALS,
    PEAK_NUMBERS,
    CurveTarget,
    FitTarget,
    Targets,
)
from upd.linalg.parallel import threads_for
from upd.scene import ForcedScene

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


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
