"""Performance curve: peak accelerance of the right blade and its frequency against F_C/F_E, each
peak followed by itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upd.analyses.forced.measures import ComplexArray, PathPeak
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Model
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import (
    Branch,
    ForcedCurve,
    LinearCurves,
    Performance,
    tell_stuck_peaks,
)
from upd.hbm.coulomb import LIFT
from upd.hbm.peaks import performance_curve


def follow_peaks(
    plan: ForcedPlan, model: Model, curve: ForcedCurve, linear: LinearCurves
) -> Performance:
    """Follow every stuck peak from the highest F_C/F_E to the lowest.

    Parameters
    ----------
    curve
        Any solved curve of the model: its harmonic balance is scaled.
    linear
        Of the model: its stuck peaks are where every branch begins.
    """
    told = tell_stuck_peaks(model, linear.stuck_peaks["right"], plan.scene.excitation.stop)
    found = tuple(
        _branch(plan, model, curve, peak, f"peak {peak.number}" if len(told) > 1 else "peak")
        for peak in told
    )
    # the right blade's own, or where it is not excited that of the left one
    free = model.excitation.free_blades[-1]
    return Performance(
        found,
        _highest(linear.free[free], linear.free_peaks[free]),
        _highest(linear.stuck["right"], linear.stuck_peaks["right"]),
    )


def _highest(curve: ComplexArray, peaks: Sequence[PathPeak]) -> float:
    """Of a curve within the sweep, an end of it among them."""
    return max([float(np.abs(curve).max()), *(one.height for one in peaks)])


def _branch(
    plan: ForcedPlan, model: Model, curve: ForcedCurve, peak: ModePeak, name: str
) -> Branch:
    choice = plan.scene.performance
    ratio = np.geomspace(choice.highest, choice.lowest, choice.points)
    k = model.excitation.lowest
    # With every gap closed at rest a factor on F_E is its inverse on F_C.
    found = performance_curve(
        curve.answer.balance,
        model.row("right"),
        curve.ratio / ratio,
        peak.frequency,
        harmonic=k,
    )
    omega = 2 * np.pi * k * found.frequency
    height = 1e-3 * omega**2 * found.amplitude / (curve.force * found.factor)
    lift = found.state[..., LIFT].mean(axis=1)
    ratios, frequency, height, lift = (
        part[::-1] for part in (curve.ratio / found.factor, found.frequency, height, lift)
    )
    message = "" if found.status == "complete" else found.message
    return Branch(name, ratios, frequency, height, lift, not message, message, peak.mode)
