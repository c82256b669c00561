"""A static state either gives the stuck response at a small force, or the run says that it does not
preload the contact.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from rigs import LINES, stuck_motion

from upd.analyses.forced import checks
from upd.analyses.forced.curves import linear_of
from upd.analyses.forced.measures import accelerance
from upd.analyses.forced.model import Model, make_model, preloaded, respond
from upd.analyses.forced.plan import ForcedPlan, make_plan
from upd.analyses.forced.solve import ForcedSolution
from upd.analyses.forced.statics import face_laws, static_state
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import InputError
from upd.progress import Stages
from upd.results import Check
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

RIG: dict[str, Any] = LINES | {
    "contact.rule": "gauss",
    "contact.rows": 3,
    "contact.columns": 2,
    "contact.directions": "one",
    "mesh.element": "hex8i",
    "reduction.modes": 4,
    "balance.harmonics": 3,
}
#: F_C/F_E at which nothing but the static state moves the answer
TINY = 1e6
#: rig -> N and T of both faces in balance with F_C = 350 N, half of friction used
FORCES = {"symmetric": 0.3, "asymmetric": 0.1}
STATES: dict[str, Any] = {
    "seated": "seated",
    "frictionless": "frictionless",
    "opposing": "opposing",
    "reversed": "reversed",
    "a little": {"left": 0.05, "right": 0.05},
    "one at its limit": {"left": 0.6, "right": 0.1},
    "both against each other": {"left": 0.6, "right": -0.6},
    "forces": "forces",
}


@cache
def rig(arrangement: str) -> tuple[ForcedPlan, Bodies, Model]:
    plan = make_plan(load_scene(f"{arrangement}-response", RIG))
    bodies = make_bodies(plan)
    laws = face_laws(plan.scene.stiffnesses["thesis"], Stages())
    return plan, bodies, make_model(plan, bodies, laws)


def in_state(arrangement: str, name: str) -> Model:
    """The rig's model in a static state."""
    plan, bodies, model = rig(arrangement)
    choice = STATES[name]
    if choice == "forces":
        ratio = FORCES[arrangement]
        of = static_state(plan, bodies, {"left": ratio, "right": ratio})
        choice = {
            side: {"N": float(N), "T": float(T)}
            for side, N, T in zip(SIDES, of.N, of.T, strict=True)
        }
    return preloaded(model, static_state(plan, bodies, choice))


def far_from_stuck(plan: ForcedPlan, model: Model) -> float:
    """Largest difference from the stuck curve about its peaks, over its height there."""
    force = plan.scene.damper.centrifugal / TINY
    linear = linear_of(plan, model)
    worst = 0.0
    for peak in linear.stuck_peaks["right"]:
        f = peak.frequency * np.array([0.995, 1.0, 1.005])
        found = respond(plan, model, force, f)
        if not found.arrived:
            return float("inf")
        at = [int(np.argmin(np.abs(found.frequency - one))) for one in f]
        H = np.abs(accelerance(found, model.row("right"), force))[at]
        stuck = [abs(_stuck(plan, model, one)) for one in f]
        worst = max(worst, float(np.abs(H / stuck - 1.0).max()))
    return worst


def _stuck(plan: ForcedPlan, model: Model, f: float) -> complex:
    """Accelerance with all points closed and sticking, by the whole matrices."""
    (motion,) = stuck_motion(model, np.array([f]))
    return complex(-1e-3 * (2.0 * np.pi * f) ** 2 * (model.row("right") @ motion))


def preload_of(plan: ForcedPlan, model: Model) -> Check:
    solution = ForcedSolution(plan, models={"thesis": model})
    (check,) = (c for c in checks.check_solution(solution) if c.name == "preloaded contact")
    return check


@pytest.mark.parametrize("arrangement", ["symmetric", "asymmetric"])
@pytest.mark.parametrize("name", STATES)
def test_a_small_force_finds_the_stuck_response_or_is_warned_of(
    arrangement: str, name: str
) -> None:
    plan = rig(arrangement)[0]
    try:
        model = in_state(arrangement, name)
    except InputError:
        pytest.skip("no such state on this rig")
    check = preload_of(plan, model)
    off = far_from_stuck(plan, model)
    assert off < 1e-6 or not check.passed, f"{off:g} from the stuck response"


def test_states_that_do_not_preload_the_contact_are_told() -> None:
    """The pads hang on the right face; the wedge slid all the way."""
    plan = rig("asymmetric")[0]
    for name in ("seated", "opposing"):
        check = preload_of(plan, in_state("asymmetric", name))
        assert not check.passed
        assert "the left face carries nothing before vibration" in check.remedy
    plan = rig("symmetric")[0]
    for name in ("opposing", "one at its limit"):
        check = preload_of(plan, in_state("symmetric", name))
        assert not check.passed
        assert "every point of a face carries mu N before vibration" in check.remedy


@pytest.mark.parametrize("arrangement", ["symmetric", "asymmetric"])
def test_the_default_state_preloads_both_faces(arrangement: str) -> None:
    plan, _, model = rig(arrangement)
    assert model.state is not None and model.state.name == "frictionless"
    assert preload_of(plan, model).passed
    assert far_from_stuck(plan, model) < 1e-6
