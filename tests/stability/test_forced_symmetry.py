"""Half the rig against the whole rig, with friction and points off the mirror plane.

A point of the half carries the stiffness of itself and its image; half the model must answer as the
whole one does where points slip and lift off.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from rigs import LINES

from upd.analyses.forced import measures
from upd.analyses.forced.model import Model, make_model, respond
from upd.analyses.forced.plan import ForcedPlan, make_plan
from upd.analyses.forced.statics import face_laws
from upd.analyses.seated.bodies import make_bodies
from upd.hbm import FrequencyResponse
from upd.progress import Stages
from upd.scene import load_scene

#: frequencies at which faces open, and at which they slide
BANDS = {
    "symmetric-response": np.linspace(300.0, 330.0, 4),
    "asymmetric-response": np.linspace(395.0, 410.0, 3),
}
OPENS = "symmetric-response"
RATIO = 60.0
CHEAP = {
    **LINES,
    "mesh.element": "hex8i",
    "contact.stiffness": ["thesis"],
    "contact.columns": 2,
    "contact.directions": "two",
    "contact.friction": 0.2,
    # many: those of the half are even, those of the whole blades both
    "reduction.modes": 120,
    "balance.harmonics": 1,
}


@cache
def _model(name: str, symmetry: str) -> tuple[ForcedPlan, Model]:
    rows = {"contact.rows": [1, 2]} if name == OPENS else {}
    scene = load_scene(name, CHEAP | rows | {"mesh.symmetry": symmetry})
    plan = make_plan(scene)
    laws = face_laws(scene.stiffnesses["thesis"], Stages())
    return plan, make_model(plan, make_bodies(plan), laws)


@cache
def _answer(name: str, symmetry: str) -> FrequencyResponse:
    plan, model = _model(name, symmetry)
    return respond(plan, model, plan.scene.damper.centrifugal / RATIO, BANDS[name])


@pytest.mark.parametrize("name", list(BANDS))
def test_a_pair_has_the_stiffness_of_both_and_its_own_place(name: str) -> None:
    (_, half), (_, whole) = _model(name, "half"), _model(name, "full")
    assert half.damper.kept == (0, 2, 4)
    assert whole.damper.n_dof == 6
    assert 2 * half.contacts.n_point == whole.contacts.n_point
    assert np.abs(half.position[:, 1]).min() > 1.0, "every point lies off the plane"
    for k in (0, 1):
        for field in ("k_n", "k_t", "preload"):
            one, both = (
                float(getattr(m.contacts.law, field)[m.face == k].sum()) for m in (half, whole)
            )
            assert one == pytest.approx(both, rel=1e-9)
    stuck = [
        {m.number: m.frequency for m in measures.mode_shapes(model, 600.0).modes}
        for model in (half, whole)
    ]
    for key in (1, 2):
        assert stuck[0][key] == pytest.approx(stuck[1][key], rel=1e-6)


@pytest.mark.parametrize("name", list(BANDS))
def test_half_the_rig_answers_as_the_whole_with_slip_and_lift_off(name: str) -> None:
    half, whole = _answer(name, "half"), _answer(name, "full")
    assert half.arrived
    assert whole.arrived
    at = [np.argmin(np.abs(a.frequency[:, None] - BANDS[name]), axis=0) for a in (half, whole)]
    slip, lift = (whole.state[at[1], :, k].max() for k in (1, 2))
    assert lift > 0.1 if name == OPENS else slip > 0.1
    for side in ("left", "right"):
        u = [
            a.amplitude(_model(name, symmetry)[1].row(side))[i]  # type: ignore[arg-type]
            for a, symmetry, i in zip((half, whole), ("half", "full"), at, strict=True)
        ]
        # the same equations: what differs is rounding, magnified by what the contacts do with it
        np.testing.assert_allclose(u[0], u[1], rtol=1e-6)
    losses = [a.energy[i].sum(axis=1) for a, i in zip((half, whole), at, strict=True)]
    np.testing.assert_allclose(losses[0], losses[1], rtol=1e-4, atol=1e-6 * losses[1].max())
