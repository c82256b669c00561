"""Numbers and curves of a response's linear limits, free and with every point stuck, with their
derivatives by what a fit varies.

Of a curve q = D^-1 F, D = K + i w C - w^2 M, with the adjoint z = D^-1 r of the output r'q

    d(r'q)/dp = -z' dD/dp q.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced.linear_limits import linear_peaks
from upd.analyses.forced.linear_sensitivity import (
    limit_peak,
    linear_system,
    stuck_frequencies,
)
from upd.analyses.forced.measures import CurvePeak
from upd.analyses.forced.mode_peaks import CANDIDATES, tell_stuck_peaks, unmoved
from upd.analyses.forced.model import Model
from upd.analyses.forced.paths import balance_of
from upd.analyses.forced.plan import ForcedPlan, grid
from upd.errors import ConvergenceError
from upd.fitting.targets import PEAK_NUMBERS, STUCK_MODES
from upd.hbm.peaks.parameter_change import ParameterChange
from upd.hbm.peaks.sensitivity import PeakDerivative
from upd.scene.forced_contact import Side

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: mm to m
_M = 1e-3
#: frequencies solved at once
_AT_ONCE = 64


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
    harmonic = model.excitation.lowest
    value, slope = [], []
    for part in np.array_split(frequency, max(1, -(-len(frequency) // _AT_ONCE))):
        w = 2.0 * np.pi * harmonic * part[:, None, None]
        D = K + 1j * w * C - w**2 * M
        right = np.broadcast_to(both, (len(part), *both.shape))
        q, z = np.moveaxis(np.linalg.solve(D, right), 2, 0)
        w = w[:, 0, 0]
        scale = -(w**2) * _M
        value.append(scale * (q @ both[:, 1]))
        each = []
        for dM, dC, dK in made:
            by_K, by_C, by_M = (np.einsum("ki,ki->k", z @ A, q) for A in (dK, dC, dM))
            each.append(-scale * (by_K + 1j * w * by_C - w**2 * by_M))
        slope.append(np.array(each).reshape(len(changes), len(part)).T)
    return np.concatenate(value), np.concatenate(slope)


def _peaks(plan: ForcedPlan, model: Model, stuck: bool, side: Side) -> list[CurvePeak]:
    if not stuck and side not in model.excitation.free_blades:
        return []
    force = plan.scene.damper.centrifugal
    problem = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    found = linear_peaks(problem, model.row(side), force, grid(plan), stuck)
    stop = plan.scene.excitation.stop
    return tell_stuck_peaks(model, found, stop) if stuck else unmoved(found)
