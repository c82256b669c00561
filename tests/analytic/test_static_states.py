"""The static state of a forced response: balance, closed forms, points, limits, at rest."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rigs import LINES
from scipy.optimize import minimize

from upd.analyses.forced.model import Model, make_model, preloaded, respond
from upd.analyses.forced.plan import ForcedPlan, make_plan
from upd.analyses.forced.statics import (
    BALANCE,
    admissible,
    face_frames,
    face_laws,
    imbalance,
    point_preload,
    static_state,
)
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.contact.rigid_damper import equilibrium
from upd.errors import InputError
from upd.hbm import System, contacts, frequency_response
from upd.hbm.springs.time_integration import steady_state
from upd.progress import Stages
from upd.scene import load_scene

CHEAP: dict[str, Any] = {
    **LINES,
    "contact.stiffness": ["thesis"],
    "mesh.element": "hex8i",
    "contact.rows": 3,
    "contact.columns": 1,
}
F_C = 350.0


@pytest.fixture(scope="module", params=["symmetric", "asymmetric"])
def rig(request: pytest.FixtureRequest) -> tuple[ForcedPlan, Bodies, Model]:
    plan = planned(str(request.param))
    bodies = make_bodies(plan)
    laws = face_laws(plan.scene.stiffnesses["thesis"], Stages())
    return plan, bodies, make_model(plan, bodies, laws)


def planned(rig: str, **contact: Any) -> ForcedPlan:
    changes = {f"contact.{name}": value for name, value in contact.items()}
    return make_plan(load_scene(f"{rig}-response", {**CHEAP, **changes}))


def with_contact(plan: ForcedPlan, **values: Any) -> ForcedPlan:
    return replace(plan, scene=replace(plan.scene, contact=replace(plan.scene.contact, **values)))


def loaded(plan: ForcedPlan, F: float) -> ForcedPlan:
    damper = replace(plan.scene.damper, centrifugal=F)
    return replace(plan, scene=replace(plan.scene, damper=damper))


def test_named_states_are_the_closed_forms(rig: tuple[ForcedPlan, Bodies, Model]) -> None:
    plan, bodies, _ = rig
    symmetric = plan.scene.arrangement == "symmetric"
    angles = (45.0, 45.0) if symmetric else (90.0, 30.0)
    for name in ("frictionless", "opposing", "reversed"):
        if name == "reversed" and not symmetric:
            with pytest.raises(InputError, match=r"reversed.*does not exist here.*jams"):
                static_state(plan, bodies, name)
            continue
        known = equilibrium(*angles, F_C, 0.6, name)
        state = static_state(plan, bodies, name)
        assert pytest.approx([known.normal_left, known.normal_right], abs=1e-9 * F_C) == state.N
        assert pytest.approx([known.tangential_left, known.tangential_right], abs=1e-9 * F_C) == (
            state.T
        )
        assert imbalance(face_frames(bodies), F_C, state.N, state.T) < BALANCE
    # on the flatter face alone the friction is that of the slope: 350 cos 30, 350 sin 30 deg
    if not symmetric:
        state = static_state(plan, bodies, "opposing")
        assert state.empty == ["left"]
        assert (state.N[1], state.T[1]) == pytest.approx((303.10889, 175.0))


def test_seated_faces_slip_as_friction_lets_them(rig: tuple[ForcedPlan, Bodies, Model]) -> None:
    """Both slide up: N and T of a rigid damper with friction fully against F_C, but a few nodes."""
    plan, bodies, _ = rig
    state, rigid = (static_state(plan, bodies, name) for name in ("seated", "opposing"))
    assert pytest.approx(rigid.N, abs=1e-5 * F_C) == state.N
    assert pytest.approx(rigid.T, abs=1e-5 * F_C) == state.T
    assert imbalance(face_frames(bodies), F_C, state.N, state.T) < BALANCE


def test_without_friction_there_is_one_state(rig: tuple[ForcedPlan, Bodies, Model]) -> None:
    plan, bodies, _ = rig
    smooth = static_state(plan, bodies, "frictionless")
    for mu in (0.0, 1e-4):
        for state in admissible(with_contact(plan, friction=mu), bodies, Stages()):
            assert pytest.approx(smooth.N, abs=2.0 * mu * F_C + 1e-9 * F_C) == state.N
            assert np.abs(state.T).max() <= 1.0 * mu * F_C * 2.0 + 1e-9 * F_C


def test_forces_scale_with_the_load(rig: tuple[ForcedPlan, Bodies, Model]) -> None:
    """Each from a coupled contact of its own."""
    plan, bodies, _ = rig
    found = [static_state(loaded(plan, F), bodies, "seated") for F in (F_C, 10.0 * F_C)]
    assert pytest.approx(10.0 * found[0].N, abs=1e-9 * F_C) == found[1].N
    assert pytest.approx(10.0 * found[0].T, abs=1e-9 * F_C) == found[1].T


def test_given_ratios_and_forces() -> None:
    plan = planned("symmetric", static={"left": 0.2, "right": 0.1})
    bodies = make_bodies(plan)
    state = static_state(plan, bodies)
    assert pytest.approx([0.2, 0.1]) == state.ratio
    assert imbalance(face_frames(bodies), F_C, state.N, state.T) < BALANCE
    forces = {
        side: {"N": float(N), "T": float(T)}
        for side, N, T in zip(("left", "right"), state.N, state.T, strict=True)
    }
    again = static_state(with_contact(plan, static=forces), bodies)
    assert pytest.approx(state.N) == again.N
    forces["left"]["N"] *= 1.0 + 1e-7
    with pytest.raises(InputError, match=r"contact\.static.*not in balance with F_C.*ratios"):
        static_state(with_contact(plan, static=forces), bodies)
    with pytest.raises(InputError, match="beyond friction"):
        static_state(with_contact(plan, static={"left": 0.7, "right": 0.7}), bodies)
    pulls = planned("asymmetric", static={"left": 0.6, "right": 0.6})
    with pytest.raises(InputError, match="would have to pull"):
        static_state(pulls, make_bodies(pulls))


def static_error(model: Model) -> float:
    """Largest misfit of the points' static forces and moments on the damper against F_C, relative
    to it (moments by the damper's arms).
    """
    force = np.column_stack([model.contacts.law.preload, model.traction])
    rows = model.damper_rows[:, : force.shape[1]]
    total = np.einsum("pdr,pd->r", rows, force)
    rotation = np.array(model.damper.kept) >= 3
    arm = np.sqrt(float((rows[:, :, rotation] ** 2).sum(axis=(1, 2)).max()))
    size = float(np.linalg.norm(model.damper.force))
    return float(np.abs((total - model.damper.force) / np.where(rotation, arm, 1.0)).max() / size)


def test_points_hold_the_damper_in_every_state(rig: tuple[ForcedPlan, Bodies, Model]) -> None:
    """Forces and moments to 1e-9, totals of the faces, every point within friction."""
    plan, bodies, model = rig
    seen = 0
    for state in admissible(plan, bodies, Stages()):
        made = preloaded(model, state)
        N, T = made.contacts.law.preload, made.traction[:, -1]
        assert static_error(made) < BALANCE
        assert (N >= 0.0).all()
        assert (np.abs(T) <= 0.6 * N + BALANCE * F_C).all()
        for k in range(2):
            on = made.face == k
            assert N[on].sum() == pytest.approx(state.N[k], abs=1e-9 * F_C)
            assert T[on].sum() == pytest.approx(state.T[k], abs=1e-9 * F_C)
        seen += bool(T.any())
    assert seen >= 2


def test_points_press_as_evenly_as_balance_lets_them(
    rig: tuple[ForcedPlan, Bodies, Model],
) -> None:
    """Against a general minimiser, where some points must be empty."""
    plan, bodies, model = rig
    state = static_state(plan, bodies, "frictionless")
    normals = model.damper_rows[:, 0].copy()
    # the load moved to one side, as far as the outer points only hold it
    force = model.damper.force.copy()
    force[-1] = 0.9 * np.abs(normals[:, -1]).max() * state.N.min()
    weight = np.concatenate([model.faces[side].weight for side in ("left", "right")])
    N, _ = point_preload(normals, model.damper_rows[:, -1], model.face, weight, state, force)
    assert (N >= 0.0).all()
    assert N.min() <= 1e-12 * F_C
    found = minimize(
        lambda x: float((x**2 / weight).sum() / F_C**2),
        np.full(len(N), F_C / len(N)),
        jac=lambda x: 2.0 * x / weight / F_C**2,
        bounds=[(0.0, None)] * len(N),
        constraints={
            "type": "eq",
            "fun": lambda x: normals.T @ x - force,
            "jac": lambda _: normals.T,
        },
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert found.success
    assert pytest.approx(found.x, abs=1e-4 * F_C) == N


def test_the_state_stays_where_no_force_moves_it(rig: tuple[ForcedPlan, Bodies, Model]) -> None:
    plan, bodies, model = rig
    for state in admissible(plan, bodies, Stages()):
        made = preloaded(model, state)
        answer = respond(plan, made, 1e-9 * F_C, np.array([350.0, 351.0]), harmonics=(0, 1))
        b = answer.balance.unexcited()
        residual, _, _ = b.linearised(np.zeros(b.size), 2.0 * np.pi * 350.0, jacobian=False)
        at_rest = b.force(np.zeros(b.size))[:, :, 0]
        assert pytest.approx(made.contacts.law.preload, abs=1e-12 * F_C) == at_rest[:, 0]
        assert pytest.approx(made.traction, abs=1e-9 * F_C) == at_rest[:, 1:]
        n = len(b.Psi) * b.harmonics.size
        # motion against what F_C would cause, forces against F_C
        assert np.abs(residual[:n]).max() < 1e-9 * np.abs(b.G0).max() * F_C
        rows = np.abs(b.Psi[:, b.modal.rigid]).max()
        assert np.abs(residual[n:]).max() < 1e-9 * F_C * rows


def oscillator(mu_N: float, T_0: float, F: float, f: float, **options: Any) -> Any:
    """m = k = 1 with a Jenkins element that carries T_0 at rest, held there by a static force."""
    jenkins = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=mu_N)
    return frequency_response(
        System(
            ([[1.0]], [[0.02]], [[1.0]]), jenkins, static_force=[T_0], slider=[[-T_0]], **options
        ),
        harmonic_force=[F],
        frequencies=[f],
    )


def test_stuck_around_the_static_traction_is_linear() -> None:
    """It sticks while T_0 and the vibration together stay below mu N."""
    f, F = 0.1, 0.3
    amplitude = F / abs(2.0 - (2 * np.pi * f) ** 2 + 0.02j * 2 * np.pi * f)
    held = oscillator(1.0 + 1e-6, 1.0 - amplitude, F, f)
    assert held.linear.all()
    assert held.amplitude([1.0])[0] == pytest.approx(amplitude)
    assert held.contact_force[0, 0, 1, 0] == pytest.approx(1.0 - amplitude)
    assert held.contact_displacement[0, 0, 1, 0] == pytest.approx(0.0, abs=1e-12)
    beyond = oscillator(1.0, 1.0 - 0.5 * amplitude, F, f, harmonics=(0, 1, 2, 3), samples=4096)
    assert not beyond.linear.any()
    # it slips once, then sticks about a traction that leaves room: mu N - k_t A
    assert beyond.contact_force[0, 0, 1, 0] == pytest.approx(1.0 - amplitude, rel=1e-6)
    march = steady_state(beyond.balance, f, 0.0 * beyond.x[0], steps=2048, tolerance=1e-9)
    assert march.status == "periodic"
    assert march.amplitude(np.array([1.0])) == pytest.approx(amplitude, rel=1e-4)


def test_sliders_of_another_number_of_points_are_refused() -> None:
    with pytest.raises(InputError, match=r"slider has shape.*every tangent, \(1, 1\)"):
        frequency_response(
            System(
                ([[1.0]], [[0.02]], [[1.0]]),
                contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=1.0),
                slider=[[0.0, 0.0]],
            ),
            harmonic_force=[0.3],
            frequencies=[0.1],
        )


def test_peak_with_static_traction_by_time_march() -> None:
    """From rest in the static state, load put on at once, points slip and lift off: marched to the
    period, without the harmonic answer. Under other loads the transient leaves other mean tractions
    and peaks up to 1.2 % lower.
    """
    plan = planned("asymmetric", static={"left": 0.2, "right": 0.3})
    laws = face_laws(plan.scene.stiffnesses["thesis"], Stages())
    model = make_model(plan, make_bodies(plan), laws)
    row = model.row("right")
    grid = np.linspace(388.0, 400.0, 19)
    answer = respond(plan, model, F_C / 1200.0, grid, harmonics=range(8))
    assert answer.status == "complete"
    amplitude = answer.amplitude(row)
    top = int(np.argmax(amplitude * answer.frequency**2))
    assert answer.state[top, :, 1].max() > 0.1 and answer.state[top, :, 2].max() > 0.1
    rest = np.zeros(answer.balance.size)
    march = steady_state(
        answer.balance, float(answer.frequency[top]), rest, steps=512, tolerance=1e-5
    )
    assert march.status == "periodic"
    assert march.amplitude(row) == pytest.approx(amplitude[top], rel=3e-3)
