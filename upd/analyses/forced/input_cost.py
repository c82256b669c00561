"""What the derivatives of a response with respect to its inputs cost."""

from __future__ import annotations

from collections.abc import Sequence

from upd.analyses.base import InputEnds
from upd.analyses.forced.input_data import is_known
from upd.analyses.forced.plan import ForcedPlan, newton_seconds

#: peaks of a curve, of both blades
_PEAKS = 4.0
#: timed on the ready scenes: Newton steps of a peak climbed to and differentiated (15 symmetric, 22
#: asymmetric), and seconds of a seating at one end of an interval
_CLIMB, _SEATING_S = 20.0, 0.2


def known_inputs(plan: ForcedPlan, ends: Sequence[InputEnds]) -> tuple[set[str], float]:
    """Inputs whose derivatives are known, and the seconds that all of them take together.

    Parameters
    ----------
    plan
        Of contact points on springs; whole faces have no such derivatives.
    ends
        Of all inputs known within limits.
    """
    scene = plan.scene
    known = {end.of.path for end in ends if is_known(end)}
    if not known or scene.contact.model == "interface":
        return set(), 0.0
    curves = len(scene.stiffnesses) * len(scene.excitation.centrifugal_to_force)
    rubbed = "contact.friction" in known and scene.contact.static == "seated"
    return known, _PEAKS * _CLIMB * curves * newton_seconds(plan) + 2 * rubbed * _SEATING_S
