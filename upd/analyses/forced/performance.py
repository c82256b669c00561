"""Performance curve: peak accelerance of the right blade and its frequency against F_C/F_E, each
peak followed by itself.
"""

from __future__ import annotations

import numpy as np

from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import (
    Branch,
    ForcedCurve,
    Performance,
    tell_stuck_peaks,
)
from upd.hbm.coulomb import LIFT
from upd.hbm.peaks import performance_curve


def follow_peaks(
    plan: ForcedPlan, model: Model, curve: ForcedCurve, stuck: Array, free_peak: float
) -> Performance:
    """Follow every stuck peak from the highest F_C/F_E to the lowest.

    Parameters
    ----------
    curve
        Any solved curve of the model: its harmonic balance is scaled.
    stuck
        (2, n): Hz and stuck accelerance of the right blade in (m/s2)/N.
    free_peak
        Highest accelerance of the right blade without the damper, (m/s2)/N.
    """
    peaks = tell_stuck_peaks(model, *stuck)
    found = tuple(
        _branch(plan, model, curve, peak, f"peak {peak.number}" if len(peaks) > 1 else "peak")
        for peak in peaks
    )
    return Performance(found, free_peak, float(stuck[1].max()))


def _branch(
    plan: ForcedPlan, model: Model, curve: ForcedCurve, peak: ModePeak, name: str
) -> Branch:
    choice = plan.scene.performance
    ratio = np.geomspace(choice.highest, choice.lowest, choice.points)
    # With every gap closed at rest a factor on F_E is its inverse on F_C.
    found = performance_curve(
        curve.answer.balance, model.row("right"), curve.ratio / ratio, peak.frequency
    )
    height = (
        1e-3 * (2 * np.pi * found.frequency) ** 2 * found.amplitude / (curve.force * found.factor)
    )
    lift = found.state[..., LIFT].mean(axis=1)
    ratios, frequency, height, lift = (
        part[::-1] for part in (curve.ratio / found.factor, found.frequency, height, lift)
    )
    message = "" if found.status == "complete" else found.message
    return Branch(name, ratios, frequency, height, lift, not message, message, peak.mode)
