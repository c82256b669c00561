"""Half the rig against the whole rig, with friction and points off the mirror plane.

A pair of points carries the stiffness of both and moves as one; half the model must answer as the
whole one does where points slip and lift off.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from upd.analyses.forced import measures
from upd.analyses.forced.model import Bodies, Model, make_bodies, make_model
from upd.analyses.forced.plan import ForcedPlan, make_plan
from upd.analyses.forced.solve import respond
from upd.analyses.forced.stiffness import face_laws
from upd.hbm import FrequencyResponse
from upd.progress import Stages
from upd.scene import load_scene

RIGS = ("symmetric-response", "asymmetric-response")
#: F_C/F_E at which points slip and open, and a stretch of frequencies where they do
RATIO, BAND = 40.0, np.linspace(290.0, 320.0, 4)
CHEAP = {
    "mesh.element": "hex8i",
    "contact.stiffness": ["thesis"],
    "contact.columns": 2,
    "contact.directions": "two",
    "reduction.modes": 4,
}


@cache
def _bodies(name: str) -> Bodies:
    return make_bodies(make_plan(load_scene(name, CHEAP)))


@cache
def _model(name: str, symmetry: str) -> tuple[ForcedPlan, Model]:
    scene = load_scene(name, CHEAP | {"mesh.symmetry": symmetry})
    plan = make_plan(scene)
    laws = face_laws(scene.stiffnesses["thesis"], Stages())
    return plan, make_model(plan, _bodies(name), laws)


@cache
def _answer(name: str, symmetry: str) -> FrequencyResponse:
    plan, model = _model(name, symmetry)
    return respond(plan, model, plan.scene.damper.centrifugal / RATIO, BAND)


@pytest.mark.parametrize("name", RIGS)
def test_a_pair_has_the_stiffness_of_both_and_its_own_place(name: str) -> None:
    (_, half), (_, whole) = _model(name, "half"), _model(name, "full")
    assert half.halved
    assert not whole.halved
    assert 2 * half.contacts.n_point == whole.contacts.n_point
    assert np.abs(half.position[:, 1]).min() > 1.0, "every point lies off the plane"
    for k in (0, 1):
        for field in ("k_n", "k_t", "preload"):
            one, both = (
                float(getattr(m.contacts.law, field)[m.face == k].sum()) for m in (half, whole)
            )
            assert one == pytest.approx(both, rel=1e-9)
    stuck = [
        {(m.axis, m.in_phase): m.frequency for m in measures.stuck_modes(model, 600.0)}
        for model in (half, whole)
    ]
    for key in (("x", True), ("x", False)):
        assert stuck[0][key] == pytest.approx(stuck[1][key], rel=1e-6)


@pytest.mark.parametrize("name", RIGS)
def test_half_the_rig_answers_as_the_whole_with_slip_and_lift_off(name: str) -> None:
    half, whole = _answer(name, "half"), _answer(name, "full")
    assert half.status == whole.status == "complete"
    assert whole.state[..., 1].max() > 0.05
    assert whole.state[..., 2].max() > 0.05
    at = [np.argmin(np.abs(a.frequency[:, None] - BAND), axis=0) for a in (half, whole)]
    for side in ("left", "right"):
        u = [
            a.amplitude(_model(name, symmetry)[1].row(side))[i]  # type: ignore[arg-type]
            for a, symmetry, i in zip((half, whole), ("half", "full"), at, strict=True)
        ]
        np.testing.assert_allclose(u[0], u[1], rtol=1e-6)
    losses = [a.energy[i].sum(axis=1) for a, i in zip((half, whole), at, strict=True)]
    np.testing.assert_allclose(losses[0], losses[1], rtol=1e-5)
    # the slope of a pair is that of each of its points, and both move apart along y
    share = [a.state[i].mean(axis=1) for a, i in zip((half, whole), at, strict=True)]
    np.testing.assert_allclose(share[0], share[1], atol=1e-9)
