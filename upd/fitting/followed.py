"""Peaks and curves with friction at one F_C/F_E, followed as a fit moves its inputs.

The first time, and where a step is too long, the whole curve is followed over frequency. Otherwise
Newton begins at the solution of the step before, moved by its own derivatives,

    x(z + dz) = x + dx/dz dz,

and a peak is climbed again from there. Values are those of the harmonic balance alone, on one
branch; derivatives by implicit differentiation.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced import measures
from upd.analyses.forced.input_uncertainty import DataChange
from upd.analyses.forced.measures import CurvePeak
from upd.analyses.forced.mode_peaks import numbered_peaks
from upd.analyses.forced.model import Model
from upd.analyses.forced.paths import balance_of, fine_grid, quiet, respond
from upd.analyses.forced.plan import ForcedPlan
from upd.errors import ConvergenceError
from upd.hbm import FrequencyResponse, climb
from upd.hbm.balance import Balance
from upd.hbm.parameter_change import ParameterChange
from upd.hbm.peak_sensitivity import displacement_derivatives, peak_derivatives
from upd.hbm.peaks import is_near
from upd.hbm.starts import first_point, newton, place_sliders
from upd.scene.forced_contact import Side

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: which peak: the blade and the number of its mode
PeakKey = tuple[Side, int]
#: mm to m
_M = 1e-3
#: relative distance of a frequency asked for from a point of a path that is it
_SAME = 1e-9


class _Known(NamedTuple):
    """A solution of an earlier step: parameters, frequency, unknowns, what known parameters move of
    them, and (of a peak) its height.
    """

    z: Array
    frequency: float
    x: Array
    by: Array
    height: float = 0.0


#: points by their numbers, and peaks
FollowedMemory = tuple[dict[int, _Known], dict[PeakKey, _Known]]


@dataclass(frozen=True)
class PeakWithChanges:
    """A peak with friction: Hz, height in (m/s2)/N, and the changes (n,) of both."""

    frequency: float
    height: float
    by_frequency: Array
    by_height: Array


class FollowedCurve:
    """What is followed at one F_C/F_E.

    Parameters
    ----------
    ratio
        F_C/F_E.
    peaks
        Which peaks are.
    frequencies
        (k,) Hz at which both blades' accelerance is, rising; empty without a curve.
    exact
        (n,) which parameters have known changes.
    needed
        Whether every peak has to be there; else those that are not are left out.
    """

    def __init__(
        self,
        ratio: float,
        peaks: Sequence[PeakKey],
        frequencies: Array,
        exact: Sequence[bool],
        *,
        needed: bool = True,
    ) -> None:
        self.ratio, self.peaks, self.frequencies = ratio, tuple(peaks), frequencies
        self._exact, self._needed = np.array(exact, bool), needed
        self._points: dict[int, _Known] = {}
        self._tops: dict[PeakKey, _Known] = {}
        #: times that the whole curve was followed
        self.curves = 0

    def forget(self) -> None:
        """Begin again with the whole curve."""
        self._points.clear()
        self._tops.clear()

    def memory(self) -> FollowedMemory:
        """From where the next step is followed."""
        return dict(self._points), dict(self._tops)

    def restore(self, memory: FollowedMemory) -> None:
        """Follow from there again.

        Parameters
        ----------
        memory
            Of an earlier `memory`.
        """
        self._points, self._tops = dict(memory[0]), dict(memory[1])

    def at(
        self,
        z: Array,
        plan: ForcedPlan,
        model: Model,
        changes: Sequence[DataChange],
        *,
        keep: bool = True,
    ) -> tuple[dict[PeakKey, PeakWithChanges], dict[Side, tuple[ComplexArray, ComplexArray]]]:
        """Peaks, and the curves of both blades with their changes.

        Parameters
        ----------
        z
            (n,) logarithms of the parameters' factors.
        plan, model
            Of the rig there.
        changes
            What every known parameter changes.
        keep
            Whether the next step begins here: not of differences.

        Raises
        ------
        ConvergenceError
            Where a peak or a point of the curve is not found.
        """
        force = plan.scene.damper.centrifugal / self.ratio
        b = balance_of(plan, model, force, _numbers(plan))
        placed = place_sliders(b, plan.scene.excitation.start)
        if placed is None:
            raise ConvergenceError(
                f"F_C/F_E {self.ratio:g}: the static loads alone have no solution; to fix it: "
                'balance.slider = "zero"'
            )
        b = placed
        place = plan.scene.excitation.centrifugal_to_force.index(self.ratio)
        forces = np.array([one.forces[place] for one in changes])
        whole = [
            one.whole(model) + ParameterChange(dynamic=each * b.dynamic)
            for one, each in zip(changes, forces, strict=True)
        ]
        found, missing = self._followed_peaks(b, model, force)
        points = self._followed_points(z, b)
        if missing or points is None:
            self.curves += 1
            found, points = self._cold(plan, model, b, force)
        tops = {}
        for key, (x, f, _) in found.items():
            row, k = model.row(key[0]), model.excitation.lowest
            one = peak_derivatives(b, row, x, f, whole, harmonic=k, power=2.0)
            height = one.height * _M / force
            by = height * (one.by_height / one.height - forces)
            tops[key] = PeakWithChanges(f, height, one.by_frequency, by)
            if keep:
                self._tops[key] = _Known(z.copy(), f, x, np.zeros((len(x), 0)), height)
        return tops, self._curves(z, b, model, force, points, whole, forces, keep)

    def _curves(
        self,
        z: Array,
        b: Balance,
        model: Model,
        force: float,
        points: Sequence[Array],
        whole: Sequence[ParameterChange],
        forces: Array,
        keep: bool,
    ) -> dict[Side, tuple[ComplexArray, ComplexArray]]:
        sides: tuple[Side, Side] = ("left", "right")
        rows, k = [model.row(side) for side in sides], model.excitation.lowest
        value = np.zeros((2, len(points)), complex)
        slope = np.zeros((2, len(points), len(whole)), complex)
        for i, (f, x) in enumerate(zip(self.frequencies, points, strict=True)):
            moved, by, dx = displacement_derivatives(b, rows, x, float(f), whole, harmonic=k)
            scale = -((2.0 * np.pi * k * f) ** 2) * _M / force
            value[:, i] = scale * moved
            slope[:, i] = scale * (by - moved[:, None] * forces)
            if keep:
                self._points[i] = _Known(z.copy(), float(f), x, dx)
        return {side: (value[j], slope[j]) for j, side in enumerate(sides)}

    # -- from the step before ----------------------------------------------------------------------

    def _followed_peaks(
        self, b: Balance, model: Model, force: float
    ) -> tuple[dict[PeakKey, tuple[Array, float, float]], bool]:
        """Unknowns, Hz and amplitude of every peak, and whether one is missing."""
        out: dict[PeakKey, tuple[Array, float, float]] = {}
        for key in self.peaks:
            known = self._tops.get(key)
            x = None if known is None else newton(b, known.x, known.frequency)
            if known is None or x is None:
                return {}, True
            top = _climbed(b, model, key[0], x, known.frequency)
            if top is None:
                return {}, True
            omega = 2.0 * np.pi * model.excitation.lowest * top[1]
            grown = omega**2 * top[2] * _M / force / known.height
            if not is_near(top[1] / known.frequency, grown):
                return {}, True
            out[key] = top
        return out, False

    def _followed_points(self, z: Array, b: Balance) -> list[Array] | None:
        out: list[Array] = []
        for i, f in enumerate(self.frequencies):
            known = self._points.get(i)
            if known is None:
                return None
            step = (z - known.z)[self._exact]
            x = newton(b, known.x + known.by @ step, float(f)) if known.by.size else None
            x = newton(b, known.x, float(f)) if x is None else x
            if x is None:
                return None
            out.append(x)
        return out

    # -- the whole curve ---------------------------------------------------------------------------

    def _cold(
        self, plan: ForcedPlan, model: Model, b: Balance, force: float
    ) -> tuple[dict[PeakKey, tuple[Array, float, float]], list[Array]]:
        """Peaks and points from the curve over frequency, from its lowest end upwards."""
        asked = self.frequencies
        if self.peaks:
            e = plan.scene.excitation
            inside = asked[(asked >= e.start) & (asked <= e.stop)]
            outside = np.setdiff1d(asked, inside)
            over = np.unique(np.concatenate([fine_grid(plan, model, force), inside, outside]))
        else:
            over = np.unique(asked)
        # what the balance leaves out is alike on every curve of a fit
        with quiet() if self.curves > 1 else nullcontext():
            answer = respond(plan, model, force, over)
        points = [self._point(b, answer, float(f)) for f in asked]
        found = {}
        for side in dict.fromkeys(side for side, _ in self.peaks):
            height = np.abs(measures.accelerance(answer, model.row(side), force))
            stop = plan.scene.excitation.stop
            told = {one.number: one for one in numbered_peaks(model, answer, height, stop)}
            for key in (one for one in self.peaks if one[0] == side):
                try:
                    found[key] = self._top(b, model, answer, key, told.get(key[1]))
                except ConvergenceError:
                    if self._needed:
                        raise
        return found, points

    def _point(self, b: Balance, answer: FrequencyResponse, f: float) -> Array:
        here = np.flatnonzero(np.abs(answer.frequency / f - 1.0) <= _SAME)
        x = newton(b, answer.x[here[0]], f) if len(here) else first_point(b, f)
        if x is None:
            raise ConvergenceError(
                f"F_C/F_E {self.ratio:g}: no motion at {f:.6g} Hz ({answer.message})"
            )
        return x

    def _top(
        self,
        b: Balance,
        model: Model,
        answer: FrequencyResponse,
        key: PeakKey,
        peak: CurvePeak | None,
    ) -> tuple[Array, float, float]:
        side, number = key
        name = f"{'left_' * (side == 'left')}peak_{number}@{self.ratio:g}"
        if peak is None:
            raise ConvergenceError(f"{name}: no such peak on the curve ({answer.message})")
        f = float(answer.frequency[peak.sample])
        x = newton(b, answer.x[peak.sample], f)
        top = None if x is None else _climbed(b, model, side, x, f)
        if top is None:
            raise ConvergenceError(f"{name}: the peak at {peak.frequency:.6g} Hz was not climbed")
        return top


def _numbers(plan: ForcedPlan) -> range:
    found = plan.scene.harmonic_numbers
    assert isinstance(found, range)
    return found


def _climbed(
    b: Balance, model: Model, side: Side, x: Array, f: float
) -> tuple[Array, float, float] | None:
    top = climb(b, model.row(side), x, f, harmonic=model.excitation.lowest, power=2.0)
    return (top.x, top.frequency, top.amplitude) if top.found else None
