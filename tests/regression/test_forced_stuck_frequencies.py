"""Stuck frequencies of the rig with contact springs of printed stiffness, beside an independent
solid model with a rigid damper.

The stiffnesses are those of Tables XI and XII of the thesis (see `upd.reference.printed`). The
frequencies were computed once with another program of our own, solid elements and distributed
springs; nobody has published them, so this is no test of literature.
"""

import pytest
from rigs import LINES

from upd.analyses.forced import measures
from upd.analyses.forced.model import make_model
from upd.analyses.forced.plan import make_plan
from upd.analyses.forced.statics import face_laws
from upd.analyses.seated.bodies import make_bodies
from upd.progress import Stages
from upd.scene import load_scene

#: ready scene -> stuck frequencies in Hz, tips in phase and out of phase: whole faces
INDEPENDENT = {"symmetric-response": (406.3, 450.0), "asymmetric-response": (410.9, 432.8)}
#: how the nodes share a face in this comparison; by area the pads are 1.0 % softer in phase
SHARE = {"symmetric-response": "area", "asymmetric-response": "equal"}


@pytest.mark.full
@pytest.mark.parametrize("name", list(INDEPENDENT))
def test_stuck_frequencies_within_one_per_cent(name: str) -> None:
    settings = LINES | {"contact.columns": 2, "contact.share": SHARE[name]}
    scene = load_scene(name, settings)
    plan = make_plan(scene)
    model = make_model(plan, make_bodies(plan), face_laws(scene.stiffnesses["thesis"], Stages()))
    x = {m.in_phase: m.frequency for m in measures.mode_shapes(model, 1000.0).modes}
    assert (x[True], x[False]) == pytest.approx(INDEPENDENT[name], rel=0.01)
    # grouping the nodes of a row changes none of them: every node still carries its share
    finer = load_scene(name, settings | {"contact.columns": 6})
    again = make_model(
        make_plan(finer), make_bodies(plan), face_laws(finer.stiffnesses["thesis"], Stages())
    )
    y = {m.in_phase: m.frequency for m in measures.mode_shapes(again, 1000.0).modes}
    assert (y[True], y[False]) == pytest.approx((x[True], x[False]), rel=1e-3)
