"""Effects that a forced response leaves out, solved again with them: sliding along the damper, and
the damper's own elasticity.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from upd.analyses.base import Resolved
from upd.analyses.forced import effects as checks
from upd.analyses.forced.curves import Top
from upd.analyses.forced.elastic_damper import elastic_stuck
from upd.analyses.forced.inputs import few
from upd.analyses.forced.levels import FoundPeaks, found_again
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Model, make_model
from upd.analyses.forced.paths import balance_of
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.stiffness import FaceLaw
from upd.linalg.parallel import threads_for
from upd.results import Case
from upd.scene.forced_contact import Side


class AlongModel(NamedTuple):
    """The model in which friction resists sliding along the damper too."""

    model: Model


def with_along(
    solution: ForcedSolution, name: str, laws: Mapping[Side, FaceLaw]
) -> AlongModel | None:
    """The model with both sliding directions; None where the run has them or nothing rubs."""
    plan, model = solution.plan, solution.models[name]
    scene = plan.scene
    if model.contacts.tangents == 2 or not scene.contact.friction:
        return None
    contact = replace(scene.contact, directions="two")
    plan = replace(plan, scene=replace(scene, contact=contact), workers=1)
    assert solution.bodies is not None
    return AlongModel(make_model(plan, solution.bodies, laws, model.state))


def along_changes(
    peaks: FoundPeaks, tops: Mapping[ModePeak, Top], along: AlongModel
) -> list[Resolved]:
    """Change of the highest peak of the curve with the lowest F_C/F_E, with few harmonics.

    Parameters
    ----------
    tops
        Of that curve, with few harmonics.
    """
    loose = {peak: top for peak, top in tops.items() if top.slips}
    if not loose:
        return []
    curve = min(peaks.curves, key=lambda c: c.ratio)
    peak = max(loose, key=lambda one: loose[one].height)
    top, old = loose[peak], curve.answer.balance
    numbers = few(peaks, old.harmonics.highest)
    one, b = (
        balance_of(peaks.plan, model, curve.force, numbers) for model in (peaks.model, along.model)
    )
    W, rest = one.split(top.x)
    both = np.zeros((W.shape[0], 3, W.shape[2]))
    # normal, along, up the slope
    both[:, [0, 2]] = W
    x = np.concatenate([both.ravel(), rest])
    with threads_for(len(along.model.M)):
        found = found_again(peaks.plan, along.model, curve, "right", peak.number, top, b, x)
    case, remedy = replace(curve.case, mode=peak.mode), 'set contact.directions = "two"'
    return [
        Resolved(checks.ALONG, f"peak_{peak.number}_{kind}", case, before, after, unit, remedy)
        for kind, unit, before, after in (
            ("accelerance", "(m/s2)/N", top.height, found.height),
            ("frequency", "Hz", top.frequency, found.frequency),
        )
    ]


def elastic_changes(solution: ForcedSolution, name: str) -> list[Resolved]:
    """Stuck frequencies with the damper's elasticity in series with the contact springs."""
    out, model = [], solution.models[name]
    assert solution.bodies is not None
    rigid = solution.linear[name].modes
    elastic = elastic_stuck(solution.plan, solution.bodies, model)
    for in_phase, quantity in ((True, "stuck_in_phase"), (False, "stuck_out_of_phase")):
        before, after = (
            next((m.frequency for m in modes if m.axis == "x" and m.in_phase == in_phase), None)
            for modes in (rigid, elastic)
        )
        if before is not None:
            remedy = (
                "the rigid damper is too stiff for these springs, unless they hold its elasticity "
                "already: compare with a contact analysis of the damper"
            )
            new = math.nan if after is None else after
            case = Case(stiffness=name)
            out.append(Resolved(checks.ELASTIC, quantity, case, before, new, "Hz", remedy))
    return out
