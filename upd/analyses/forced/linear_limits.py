"""Linear limits of a model: free and with every point stuck."""

from __future__ import annotations

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import LinearCurves
from upd.analyses.forced.linear_peaks import finer, linear_modes, linear_peaks
from upd.analyses.forced.mode_peaks import CANDIDATES
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.paths import grid
from upd.analyses.forced.plan import ForcedPlan
from upd.scene.forced_contact import SIDES


def linear_limits_of(
    plan: ForcedPlan, model: Model, answer: measures.Balanced, force: float
) -> LinearCurves:
    """Free and stuck curves, peaks and modes.

    Parameters
    ----------
    answer
        Any of the model, with ``force``: its problem counts.
    """
    f = _frequencies(plan, answer)
    rows = {side: model.row(side) for side in SIDES}
    moving = {False: model.excitation.free_blades, True: SIDES}
    free, stuck = (
        {
            side: measures.linear_accelerance(answer, rows[side], force, f, all_stuck)
            if side in moving[all_stuck]
            else np.zeros(len(f), complex)
            for side in SIDES
        }
        for all_stuck in (False, True)
    )
    free_peaks, stuck_peaks = (
        {
            side: linear_peaks(answer, rows[side], force, f, all_stuck)
            if side in moving[all_stuck]
            else []
            for side in SIDES
        }
        for all_stuck in (False, True)
    )
    modes = measures.stuck_modes(model, CANDIDATES * plan.scene.excitation.stop)
    return LinearCurves(f, free, stuck, modes, free_peaks, stuck_peaks)


def _frequencies(plan: ForcedPlan, answer: measures.Balanced) -> Array:
    """The sweep's, and finer ones around every free and stuck mode: a drawn curve has its tops."""
    f, k = grid(plan), measures.read_harmonic(answer)
    for stuck in (False, True):
        modes, width = linear_modes(answer.balance, stuck)
        f = finer(f, modes / k, width / k)
    return f
