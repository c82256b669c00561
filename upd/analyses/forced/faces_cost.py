"""What a curve of whole faces by harmonic balance takes: harmonics and samples by rule, seconds."""

from __future__ import annotations

from upd.analyses.base import Effect
from upd.analyses.cost import dense_s
from upd.scene import ForcedScene

#: harmonics of the blades and samples in a period where the scene leaves them to the rule: two
#: more harmonics change peaks by up to 0.5 %, twice the samples by 0.05 %
HARMONICS, SAMPLES = 3, 128
# Newton iterations of a curve on which nodes move, counted on the rig at F_C/F_E 600 and 194 with
# 60 and 198 nodes; of one sample the time for each contact dof that moves, a share of all, and the
# flops of its rows, solved for the unknowns.
_ITERATIONS, _DOF_S, _MOVING = 250.0, 2e-6, 0.2


def blade_harmonics(scene: ForcedScene) -> int:
    """The highest of the blades in the balance."""
    asked = scene.balance.harmonics
    if asked == "adaptive":
        return max(HARMONICS, scene.excitation.highest_harmonic)
    return int(asked)


def balance_seconds(scene: ForcedScene, dofs: float) -> float:
    """Seconds of all curves by the balance.

    Parameters
    ----------
    scene
        With whole faces.
    dofs
        Of the contact.
    """
    b, e = scene.balance, scene.excitation
    if b.method == "march" or scene.contact.friction == 0.0:
        return 0.0
    samples = SAMPLES if b.samples == "auto" else int(b.samples)
    rows = _MOVING * dofs
    evaluations = _ITERATIONS * len(e.centrifugal_to_force) * samples
    return evaluations * _DOF_S * rows + dense_s(evaluations * 2.0 * rows**2 * dofs)


def harmonics_effect(scene: ForcedScene) -> Effect:
    """Harmonics of the blades."""
    b = scene.balance
    if b.method == "march":
        return Effect("harmonics", True, "all of them: a time march")
    return Effect(
        "harmonics",
        True,
        f"0 to {blade_harmonics(scene)} of the blades; contact and damper in time",
        "truncation",
    )
