"""Peaks and curves with friction at one F_C/F_E, with their derivatives by what a fit varies.

Every evaluation solves the whole curve over frequency, from its lowest end upwards, so that a fit
does not depend on the way it came. Values are those of the harmonic balance alone; derivatives by
implicit differentiation.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced import measures
from upd.analyses.forced.linear_limits import fine_grid
from upd.analyses.forced.measures import numbered_peaks
from upd.analyses.forced.model import Model, balance_of, quiet, respond
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.sensitivity import DataChange
from upd.errors import ConvergenceError
from upd.hbm import FrequencyResponse, climb
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.hbm.peaks.sensitivity import (
    PeakDerivative,
    displacement_derivatives,
    peak_derivatives,
)
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.starts import first_point, newton, place_sliders
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
