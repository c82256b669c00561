"""Time march of blades, elastic damper and whole faces: what it must give in closed form, against
the whole matrices, and against a march of its own kind with springs, explicit in time.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

import upd.hbm.faces.march as module
from upd.analyses import make_plan
from upd.analyses.forced.interface_model import (
    by_coulomb,
    make_interface_model,
    worn_start,
)
from upd.analyses.seated.bodies import Bodies, lattice, make_bodies
from upd.analyses.seated.interface import Interface, make_interface
from upd.errors import ConvergenceError, InputError
from upd.fem import Material, mass, stiffness
from upd.hbm.faces.march import InterfaceMarch, modal_step, resolved
from upd.hbm.faces.period import march_steps
from upd.hbm.faces.state import InterfaceModel, InterfaceState, resting
from upd.hbm.faces.step import OPEN, SLIP, STICK, contact_scratch, contact_step, judge
from upd.hbm.faces.sweep import settle, stepped_sine
from upd.linalg import modes
from upd.linalg.compiled import compiled
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

F_C, MU, DAMPING = 350.0, 0.6, 0.005
LEFT, RIGHT = 0, 1


@cache
def rig() -> tuple[Any, Bodies, Interface]:
    """Half of the rig with the wedge, 3 x 3 nodes a face."""
    changes = ["mesh.symmetry=half", "geometry.patch_along_y=4", "geometry.patch_along_slope=2"]
    plan: Any = make_plan(load_scene("symmetric-seated", changes))
    bodies = make_bodies(plan)
    return plan, bodies, make_interface(plan, bodies)


def made(mu: float = MU, **changes: Any) -> InterfaceModel:
    usual: dict[str, Any] = {"friction": mu, "centrifugal": F_C, "damping": DAMPING}
    return make_interface_model(*rig(), **(usual | changes))


@cache
def worn(traction: float = 0.0) -> tuple[InterfaceModel, InterfaceState]:
    return worn_start(made(), rig()[2], F_C, traction)


# -- the step --------------------------------------------------------------------------------------


def test_modes_step_exactly_under_a_constant_force() -> None:
    """From rest q = (1 - exp(-z w t) (cos wd t + z w / wd sin wd t)) / w^2, and the ring-down."""
    w, z, dt = np.array([300.0]), np.array([0.1]), 2e-3
    step = modal_step(w, z, dt, 1.0)[:, 0]
    a, wd = z[0] * w[0], w[0] * np.sqrt(1 - z[0] ** 2)
    fade, c, s = np.exp(-a * dt), np.cos(wd * dt), np.sin(wd * dt)
    assert step[:2] == pytest.approx([fade * (c + a / wd * s), fade * s / wd], rel=1e-12)
    assert step[2] + step[3] == pytest.approx((1 - step[0]) / w[0] ** 2, rel=1e-9)
    assert step[6] + step[7] == pytest.approx(step[1], rel=1e-12)
    assert step[4] == pytest.approx(-(w[0] ** 2) * step[1], rel=1e-12)


def test_modes_step_exactly_through_the_harmonic_of_the_drive() -> None:
    """The steady answer of 16 steps a period is that of the differential equation."""
    w, z, drive = np.array([300.0]), np.array([0.01]), 290.0
    dt = 2 * np.pi / drive / 16
    step = modal_step(w, z, dt, drive * dt / np.sin(drive * dt))[:, 0]
    turn = np.exp(1j * drive * dt)
    A, b = step[[0, 1, 4, 5]].reshape(2, 2), step[[2, 6]] + step[[3, 7]] * turn
    q = np.linalg.solve(turn * np.eye(2) - A, b)[0]
    assert abs(q * (w[0] ** 2 - drive**2 + 2j * z[0] * w[0] * drive) - 1.0) < 1e-3


def test_modes_that_steps_do_not_resolve_follow() -> None:
    """With 3 steps to 0.3 of one in its period a mode stands still under a constant force, follows
    a slow one with the inertia it has, to the square of the step, and rings out; one that swings as
    often as steps are made does not take their images for the excitation.
    """
    w, dt = np.array([2.0, 3.0, 2.0 * np.pi, 20.0]), 1.0
    z = np.full(4, 0.005)
    assert not resolved(w, dt).any()
    step = modal_step(w, z, dt, 7.0)
    A = step[[0, 1, 4, 5]].T.reshape(-1, 2, 2)
    still = np.array([w**-2.0, np.zeros(4)]).T
    moved = np.einsum("mij,mj->mi", A, still) + (step[[2, 6]] + step[[3, 7]]).T
    assert moved == pytest.approx(still, abs=1e-12)
    assert (np.abs(np.linalg.eigvals(A)).max(axis=1) < [0.5, 0.25, 0.06, 0.006]).all()
    off = []
    for x in (0.2, 0.1):
        turn = np.exp(1j * x * dt)
        b = (step[[2, 6]] + turn * step[[3, 7]]).T
        q = np.linalg.solve(turn * np.eye(2) - A, b[:, :, None])[:, 0, 0]
        lacks = q * (w**2 - x**2 + 2j * z * w * x) - 1.0
        assert (np.abs(lacks) < x**2).all()
        off.append(np.abs(lacks))
    assert (off[0] / off[1] > 3.5).all()


def by_base(march: InterfaceMarch) -> np.ndarray:
    """From forces of everything stuck and closed to what the base gives."""
    O, L = np.tile(march.bases.open[0], 3), np.eye(3 * march.model.n)
    if O.any():
        S = np.linalg.inv(march.W[np.ix_(O, O)])
        L[np.ix_(~O, O)], L[np.ix_(O, O)] = -march.W[np.ix_(~O, O)] @ S, S
    return L


def test_steps_against_the_solver_of_coupled_contact() -> None:
    """1000 random samples in all states, from random bases and starts: the same forces."""
    model, _ = worn()
    march = InterfaceMarch(model, 450.0, [1.0], 128)
    rng, n = np.random.default_rng(3), model.n
    found, work = np.zeros(3, int), contact_scratch(n)
    node = f, y, state = np.zeros(3 * n), np.zeros(3 * n), np.ones(n, np.int64)
    for sample in range(1000):
        # near forces within friction, beyond it, and pulling, in shares that differ by sample
        pressed = rng.uniform(-1.0, 1.0, n) + rng.uniform(-1.0, 1.0)
        angle, share = rng.uniform(0.0, 2 * np.pi, n), rng.uniform(0.0, 1.5) * MU * pressed
        t = share * np.array([np.cos(angle), np.sin(angle)])
        b = march.A @ np.concatenate([pressed, *t])
        march.rebase(rng.random(n) < rng.choice([0.0, 0.3, 0.9]))
        x0 = by_base(march) @ march.W @ b
        laws = (model.friction, march.rho_n, march.rho_t)
        step = (x0, (march.bases.open, march.bases.Tt), 0, laws, node)
        used = contact_step(*step, True, work)
        if used < 0:
            used = contact_step(*step, False, work)
        want = by_coulomb(march.A, model.friction, b)
        assert used >= 0 and want is not None, f"sample {sample}"
        size = np.abs(want[0]).max()
        np.testing.assert_allclose(f, want[0], rtol=0.0, atol=1e-8 * size)
        np.testing.assert_allclose(b - y, march.A @ f, rtol=0.0, atol=1e-10 * np.abs(b).max())
        found += np.bincount(state, minlength=3)
    assert (found > 0.1 * found.sum()).all(), found


def test_misfit_of_what_is_no_answer() -> None:
    one, state = np.ones(1), np.zeros(1, np.int64)
    f, y = np.array([10.0, 5.0, 0.0]), np.zeros(3)
    assert judge(f, y, 0.6 * one, one, one, state) == 0.0 and state[0] == STICK
    assert judge(f, y, 0.3 * one, one, one, state) == pytest.approx(2.0) and state[0] == SLIP
    # slip against the traction
    assert judge(f, np.array([0.0, -1.0, 0.0]), 0.5 * one, one, one, state) == pytest.approx(1.0)
    assert judge(f, np.array([-11.0, 0.0, 0.0]), one, one, one, state) == 10.0 and state[0] == OPEN


# -- states that are known -------------------------------------------------------------------------


@pytest.mark.parametrize("traction", [0.0, 0.3, 0.6, "seated"])
def test_nothing_moves_without_excitation(traction: float | str) -> None:
    if traction == "seated":
        model, found = made(), rig()[2].seat(MU, F_C * np.linspace(0.1, 1.0, 10))
        last = found.history
        start = resting(model, last.force, last.slip, last.gap, last.motion)
    else:
        model, start = worn(float(traction))
    march, at = InterfaceMarch(model, 300.0, [0.0], 64, by_coulomb), start.copy()
    for _ in range(20):
        period = march.period(at)
    scale = np.abs(start.f).max()
    np.testing.assert_allclose(at.f, start.f, rtol=0.0, atol=1e-9 * scale)
    np.testing.assert_allclose(at.q, start.q, rtol=0.0, atol=1e-9 * np.abs(start.q).max())
    assert np.ptp(period.output, axis=0).max() < 1e-12
    total = model.columns.T @ at.f
    np.testing.assert_allclose(total, model.load, atol=1e-9 * F_C * 10.0)


def test_worn_faces_hold_the_traction_asked_for() -> None:
    of = rig()[2]
    for traction in (0.0, 0.3, 0.6):
        _, start = worn(traction)
        f = start.f.reshape(3, of.n)
        per_face = of.copies * f[:, of.face == LEFT].sum(axis=1)
        # N (cos 45 + T/N sin 45) on each of both faces
        assert per_face[0] == pytest.approx(F_C / np.sqrt(2.0) / (1.0 + traction), rel=1e-9)
        assert per_face[2] == pytest.approx(traction * per_face[0], rel=1e-9)
        assert (start.state == STICK).all()
    with pytest.raises(InputError, match=r"T/N 0\.7"):
        worn_start(made(), of, F_C, 0.7)


def glued(frequencies: np.ndarray) -> np.ndarray:
    """Accelerances-to-be of both blades with the damper glued on: whole matrices of all bodies."""
    plan, bodies, _ = rig()
    meshes = [bodies.blades[side].mesh for side in SIDES] + [bodies.damper_mesh]
    material = Material(*(getattr(plan.scene.material, k) for k in ("E", "nu", "density")))
    number = [
        np.arange(mesh.n_node) + sum(m.n_node for m in meshes[:k]) for k, mesh in enumerate(meshes)
    ]
    held = [number[k][meshes[k].nodes["clamped"]] for k in (0, 1)]
    for k, side in enumerate(SIDES):
        there = dict(zip(meshes[k].nodes["patch"], meshes[2].nodes[f"{side}_patch"], strict=True))
        nodes = lattice(meshes[k]).nodes
        number[2][[there[node] for node in nodes]] = number[k][nodes]
    total = 3 * sum(mesh.n_node for mesh in meshes)
    K, M = sparse.csr_array((total, total)), sparse.csr_array((total, total))
    for mesh, names in zip(meshes, number, strict=True):
        dofs = (3 * names[:, None] + np.arange(3)).ravel()
        S = sparse.csr_array((np.ones(len(dofs)), (dofs, np.arange(len(dofs)))), (total, len(dofs)))
        K += S @ stiffness(mesh, material, plan.scene.mesh.element) @ S.T
        M += S @ mass(mesh, material) @ S.T
    across = np.concatenate(
        [3 * names[mesh.nodes["plane_y"]] + 1 for mesh, names in zip(meshes, number, strict=True)]
    )
    clamped = np.concatenate([(3 * h[:, None] + np.arange(3)).ravel() for h in held])
    used = np.unique(
        np.concatenate([(3 * names[:, None] + np.arange(3)).ravel() for names in number])
    )
    free = np.setdiff1d(used, np.concatenate([across, clamped]))
    K, M = (sparse.csc_array(X[free][:, free]) for X in (K, M))
    at = [
        int(np.searchsorted(free, 3 * number[k][meshes[k].nodes[name][0]]))
        for k, name in ((0, "accelerometer"), (1, "accelerometer"), (1, "force"))
    ]
    # modal damping of the blades: C = sum 2 z w (M phi) (M phi)'
    P = []
    for k, side in enumerate(SIDES):
        blade = bodies.blades[side]
        found = modes(blade.K, blade.M, count=5)
        mine = 3 * number[k][blade.free // 3] + blade.free % 3
        one = np.zeros((total, 5))
        one[mine] = (blade.M @ found.shapes) * np.sqrt(
            2.0 * DAMPING * 2.0 * np.pi * found.frequency
        )
        P.append(one[free])
    R = np.hstack(P)
    load = np.zeros(len(free))
    load[at[2]] = 0.5
    out = []
    for w in 2.0 * np.pi * frequencies:
        lu = splu(K - w**2 * M)
        x, Y = lu.solve(load), lu.solve(R)
        inner = np.linalg.solve(np.eye(R.shape[1]) / (1j * w) + R.T @ Y, R.T @ x)
        out.append((x - Y @ inner)[at])
    return np.array(out)


def test_stuck_is_glued_by_whole_matrices() -> None:
    """Worn faces under a force too small to slip: peak of both blades to 0.1 %, its place to
    0.01 %; and the march to 0.1 % of that linear answer.
    """
    model, start = worn()
    f = np.linspace(452.0, 454.5, 11)
    mine, want = np.abs(model.linear_response(f, [1.0], stuck=True)), np.abs(glued(f))
    for side in (LEFT, RIGHT):
        tops = []
        for H in (mine[:, side], want[:, side]):
            i = int(H.argmax())
            c = np.polyfit(f[i - 2 : i + 3] - f[i], H[i - 2 : i + 3], 2)
            tops.append((f[i] - c[1] / (2 * c[0]), c[2] - c[1] ** 2 / (4 * c[0])))
        assert tops[0][0] == pytest.approx(tops[1][0], rel=1e-4)
        assert tops[0][1] == pytest.approx(tops[1][1], rel=1e-3)
    force = 1e-3
    found = stepped_sine(model, [400.0, 453.0], [-1j * force], start, tolerance=3e-4)
    assert found.status == "settled" and (found.share[:, STICK] == 1.0).all()
    linear = model.linear_response([400.0, 453.0], [-1j * force], stuck=True)
    np.testing.assert_allclose(np.abs(found.amplitude), np.abs(linear), rtol=1e-3)


def test_free_without_centrifugal_force() -> None:
    """A damper that nothing presses is knocked off; the blades swing as without it."""
    model, start = worn_start(made(centrifugal=1e-6), rig()[2], 1e-6)
    f = np.array([290.0, 305.0])
    found = stepped_sine(model, f, [-1j], start, tolerance=3e-4, fallback=by_coulomb)
    free = model.linear_response(f, [-1j], stuck=False)
    assert found.status == "settled"
    np.testing.assert_allclose(found.amplitude[:, RIGHT], free[:, RIGHT], rtol=1e-3)


# -- what holds for any state ----------------------------------------------------------------------


def slipping(samples: int = 128, tolerance: float = 1e-3) -> Any:
    """F_C/F_E 600 near the stuck peak: nodes slip and lift off."""
    model, start = worn()
    return stepped_sine(
        model,
        [453.0],
        [-1j * F_C / 600.0],
        start,
        samples=samples,
        tolerance=tolerance,
        fallback=by_coulomb,
    )


def test_all_loads_scaled_scale_the_answer() -> None:
    one, scale = slipping(), 7.0
    model, start = worn_start(made(centrifugal=scale * F_C), rig()[2], scale * F_C)
    many = stepped_sine(model, [453.0], [-1j * scale * F_C / 600.0], start)
    assert one.share[0, SLIP] > 0.05 and one.share[0, OPEN] > 0.0
    np.testing.assert_allclose(many.amplitude, scale * one.amplitude, rtol=1e-6)
    np.testing.assert_allclose(many.energy, scale**2 * one.energy, rtol=1e-5)


def test_energy_closes() -> None:
    """Work of the excitation = damping + friction; the misfit falls with the square of the step."""
    off = []
    for samples in (64, 128, 256):
        one = slipping(samples, 1e-5)
        assert one.status == "settled"
        into, damped, rubbed = one.energy[0]
        assert rubbed > 0.1 * into
        off.append(abs(into - damped - rubbed) / into)
    assert off[1] < 1e-3
    assert off[0] / off[2] > 2.0 ** (2 * 1.5), off


def test_half_the_step_is_second_order() -> None:
    """From rest, everything stuck: the motion of 6 periods against many times smaller steps."""
    model, start = worn()
    model, found = with_modes_as_outputs(model), []
    for N in (32, 64, 128, 2048):
        march, at = InterfaceMarch(model, 453.0, [-1j * F_C / 1e5], N, by_coulomb), start.copy()
        periods = [march.period(at) for _ in range(6)]
        found.append(np.concatenate([one.output[N // 32 - 1 :: N // 32] for one in periods]))
    assert periods[-1].counts[STICK] == 1.0
    errors = [
        np.abs(one - found[-1])[:, [0, 5]].max() / np.ptp(found[-1][:, 5]) for one in found[:-1]
    ]
    assert errors[2] < 1e-3
    assert errors[0] / errors[1] > 3.5 and errors[1] / errors[2] > 3.5, errors


@compiled
def explicit_march(  # type: ignore[no-untyped-def]
    steps,
    every,
    dt,
    omega,
    loss,
    Phi,
    B,
    inverse_mass,
    load,
    G,
    k,
    gap,
    mu,
    P,
    E,
    force,
    w,
    out,
    q,
    s,
    e,
    slider,
    rounds,
):
    """Central differences; springs k at every node, their rest relaxed, Coulomb by return.

    The springs' compliance is taken off G: both in series are what there is.
    """
    n, m, r = len(gap), len(q), len(s)
    v, sv, f = np.zeros(m), np.zeros(r), np.zeros(3 * n)
    top = 0.0
    for i in range(3 * n):
        total = 0.0
        for j in range(3 * n):
            total += abs(G[i, j])
        top = max(top, total)
    alpha = 1.0 / (1.0 + k * top)
    for step in range(steps):
        F = force * np.sin(w * dt * step)
        u = B @ s - Phi @ q - E * F
        for _ in range(rounds):
            x = u - e
            for i in range(n):
                f[i] = max(0.0, k * (x[i] - gap[i]))
                t1, t2 = k * (x[n + i] - slider[i]), k * (x[2 * n + i] - slider[n + i])
                size, limit = np.hypot(t1, t2), mu * f[i]
                if size > limit:
                    t1, t2 = t1 * limit / size, t2 * limit / size
                f[n + i], f[2 * n + i] = t1, t2
            e += alpha * (G @ f - e)
        x = u - e
        for i in range(n):
            slider[i], slider[n + i] = x[n + i] - f[n + i] / k, x[2 * n + i] - f[2 * n + i] / k
        v += dt * (Phi.T @ f + P * F - loss * v - omega**2 * q)
        sv += dt * (inverse_mass @ (load - B.T @ f))
        q += dt * v
        s += dt * sv
        if (step + 1) % every == 0:
            out[(step + 1) // every - 1] = q


def test_against_an_explicit_march_with_springs() -> None:
    """From rest into slip and lift-off, the motion of 6 periods: 0.2 % of its range.

    The springs' compliance is taken off that of the faces, so that both have the same; their rest
    relaxes under the forces in `rounds` iterations a step.
    """
    model, start = worn()
    frequency, force, N, fine, periods = 452.0, F_C / 100.0, 128, 16, 6
    march = InterfaceMarch(with_modes_as_outputs(model), frequency, [-1j * force], N)
    at = start.copy()
    pieces = [march.period(at) for _ in range(periods)]
    own = np.concatenate([piece.output for piece in pieces])
    shares = np.mean([piece.counts for piece in pieces], axis=0)
    assert shares[SLIP] > 0.03 and shares[OPEN] > 0.0, shares
    k = 2.0 / np.linalg.eigvalsh(model.compliance)[0]
    G = model.compliance - np.eye(3 * model.n) / k
    out = np.zeros((N * periods, len(start.q)))
    slider = start.slip.copy()
    explicit_march(
        N * periods * fine,
        fine,
        1.0 / (frequency * N * fine),
        model.omega,
        2.0 * model.damping * model.omega,
        model.shapes,
        np.ascontiguousarray(model.columns),
        np.linalg.inv(model.mass),
        model.load,
        np.ascontiguousarray(G),
        k,
        model.gap,
        MU,
        model.places[:, 0],
        model.pushed[:, 0],
        force / model.copies,
        2.0 * np.pi * frequency,
        out,
        start.q.copy(),
        start.s.copy(),
        G @ start.f,
        slider,
        32,
    )
    assert np.abs(own - out)[:, [0, 5]].max() < 2e-3 * np.ptp(out[:, 5])


def with_modes_as_outputs(model: InterfaceModel) -> InterfaceModel:
    """The model with its modes as outputs."""
    m, n, L = len(model.frequency), model.n, model.places.shape[1]
    return replace(
        model, seen_modes=np.eye(m), seen_contact=np.zeros((m, 3 * n)), seen_drive=np.zeros((m, L))
    )


# -- how it is told --------------------------------------------------------------------------------


def test_bases_change_nothing() -> None:
    """The same period from bases that are held and from those that the march chooses itself."""
    model, start = worn()
    outputs = []
    for base in (None, np.zeros(model.n, bool), np.arange(model.n) % 2 == 0):
        march, at = InterfaceMarch(model, 453.0, [-1j * F_C / 100.0], 64), start.copy()
        for _ in range(15):
            if base is not None:
                march.rebase(base)
            period = march.period(at)
        outputs.append(period.output)
        assert (len(march.bases.open) > 2) == (base is None)
    np.testing.assert_allclose(outputs[1], outputs[0], rtol=1e-7)
    np.testing.assert_allclose(outputs[2], outputs[0], rtol=1e-7)


def test_a_march_like_another_changes_nothing() -> None:
    """Bases and starts of the march before: the same motion of the next."""
    model, start = worn()
    first, at = InterfaceMarch(model, 452.0, [-1j * F_C / 100.0], 64), start.copy()
    for _ in range(8):
        first.period(at)
    found = []
    for like in (None, first):
        march, mine = InterfaceMarch(model, 453.0, [-1j * F_C / 100.0], 64, like=like), at.copy()
        found.append([march.period(mine).output for _ in range(3)])
    np.testing.assert_allclose(found[1], found[0], rtol=1e-7)


def test_sweep_where_nothing_slips_is_the_closed_form() -> None:
    """Four frequencies, stuck."""
    model, start = worn()
    f, force = [430.0, 440.0, 446.0, 450.0], 1e-3
    found = stepped_sine(model, f, [-1j * force], start)
    assert found.status == "settled"
    linear = np.abs(model.linear_response(f, [-1j * force], stuck=True))
    np.testing.assert_allclose(np.abs(found.amplitude), linear, rtol=2e-3)


# -- springs: a slider behind them is a node of compliance diag(1/k_n, 1/k_t, 1/k_t) ---------------


def sprung(
    frequency: Any, damping: float, Phi: Any, B: Any, mass: Any, load: Any, mu: float, k: Any
) -> tuple[InterfaceModel, InterfaceState]:
    """Blades of one mode each, which is what is excited and seen; damper rigid, springs k (3,).

    Faces touch without force; under the load the springs give way.
    """
    frequency, Phi, B = np.asarray(frequency, float), np.asarray(Phi, float), np.asarray(B, float)
    m, n = len(frequency), len(Phi) // 3
    G = np.diag(np.repeat(1.0 / np.asarray(k, float), n))
    model = InterfaceModel(
        frequency,
        np.full(m, damping),
        Phi,
        G,
        B,
        np.asarray(mass, float),
        np.asarray(load, float),
        np.zeros(n),
        np.full(n, mu),
        np.eye(m),
        np.zeros((3 * n, m)),
        np.eye(m),
        np.zeros((m, 3 * n)),
        np.zeros((m, m)),
        springs=np.diagonal(G).copy(),
    )
    # the normal forces that balance the load; the damper and the slips follow
    f = np.zeros((3, n))
    f[0] = np.linalg.lstsq(B[:n].T, model.load, rcond=None)[0]
    q = Phi.T @ f.ravel() / model.omega**2
    w = -G @ f.ravel() - Phi @ q
    s = np.linalg.lstsq(B[:n], -w[:n], rcond=None)[0]
    slip = (w + B @ s).reshape(3, n)[1:]
    return model, resting(model, f.T, slip.T, np.zeros(n), s)


def jenkins(mu: float) -> tuple[InterfaceModel, InterfaceState]:
    """A mass of 1 on a spring, 50 Hz, and a slider behind k_t = 4e4 N/mm under 100 N."""
    Phi, B = [[0.0], [1.0], [0.0]], [[1.0], [0.0], [0.0]]
    return sprung([50.0], 0.01, Phi, B, [[1e-2]], [100.0], mu, (1e5, 4e4, 4e4))


def test_springs_that_stick() -> None:
    """x = F / (omega^2 + k - w^2 + 2 i zeta omega w)."""
    model, start = jenkins(1e6)
    f, force = np.array([40.0, 55.0, 60.0]), 300.0
    found = stepped_sine(model, f, [force], start, tolerance=1e-4)
    w, o = 2.0 * np.pi * f, model.omega[0]
    want = force / (o**2 + 4e4 - w**2 + 2j * 0.01 * o * w)
    assert found.status == "settled"
    np.testing.assert_allclose(found.amplitude[:, 0], want, rtol=2e-3)
    linear = model.linear_response(f, [force], stuck=True)[:, 0]
    np.testing.assert_allclose(linear, want, rtol=1e-9)


def test_springs_that_slide_lose_what_a_jenkins_element_does() -> None:
    """4 mu N (X - mu N / k_t) a period at the amplitude X."""
    mu, N, k = 0.3, 100.0, 4e4
    model, start = jenkins(mu)
    found = stepped_sine(model, [50.0, 58.0], [300.0], start, samples=256, tolerance=1e-5)
    march = [InterfaceMarch(model, f, [300.0], 256) for f in found.frequency]
    each = [one.period(p.start.copy()) for one, p in zip(march, found.points, strict=True)]
    X = np.array([0.5 * np.ptp(one.output[:, 0]) for one in each])
    assert found.status == "settled" and X.min() > 3.0 * mu * N / k
    np.testing.assert_allclose(found.energy[:, 2], 4.0 * mu * N * (X - mu * N / k), rtol=2e-3)
    into, damped, rubbed = found.energy.T
    np.testing.assert_allclose(into, damped + rubbed, rtol=2e-3)


@cache
def wedge(k: float) -> tuple[InterfaceModel, InterfaceState]:
    """Two blades of one mode each and a rigid wedge between them, one point a side, 45 degrees.

    The blades swing to and fro, and a little along the edge of the wedge: two directions of slip.
    """
    c = np.sqrt(0.5)
    # of both points: normal into the damper's face, tangent up the slope, tangent along the edge
    Phi = np.zeros((3, 2, 2))
    Phi[:, 0, 0], Phi[:, 1, 1] = (-c, c, 0.5), (c, c, 0.3)
    B = np.zeros((3, 2, 3))
    B[:, 0, 0], B[:, 1, 0] = (-c, c, 0.0), (c, c, 0.0)
    B[:, 0, 1], B[:, 1, 1] = (c, c, 0.0), (c, -c, 0.0)
    B[2, :, 2] = 1.0
    mass, load = np.diag([0.005, 0.005, 0.005]), [0.0, 100.0, 0.0]
    return sprung(
        [50.0, 52.0], 0.01, Phi.reshape(6, 2), B.reshape(6, 3), mass, load, 0.5, (k, k, k)
    )


def test_what_closes_within_a_step_slips_until_it_touches() -> None:
    """A mass lifts off a damper that stands still, and sticks where it lands: of second order."""
    k, drive, f, periods, fine = 4e4, 1000.0, 40.0, 6, 8192
    Phi, B = [[1.0], [0.5], [0.0]], [[1.0], [0.0], [0.0]]
    model, start = sprung([50.0], 0.05, Phi, B, [[1e6]], [100.0], 10.0, (k, k, k))
    w, dt, along = model.omega[0], 1.0 / (f * fine), 0.5
    q, v, slider, wanted = start.q[0], 0.0, start.slip[0], np.empty(fine * periods)
    for i in range(fine * periods):
        # the springs' ends, by the damper at rest
        x, y = start.s[0] - q, -along * q
        normal, traction = k * max(x, 0.0), k * (y - slider)
        if x <= 0.0:
            slider, traction = y, 0.0
        push = drive * np.sin(2.0 * np.pi * i / fine) + normal + along * traction - w**2 * q
        half = 0.5 * dt * 2.0 * 0.05 * w
        v = ((1.0 - half) * v + dt * push) / (1.0 + half)
        q += dt * v
        wanted[i] = q
    off = []
    for N in (32, 128):
        march, at = InterfaceMarch(model, f, [-1j * drive], N), start.copy()
        pieces = [march.period(at) for _ in range(periods)]
        open_ = np.mean([one.counts[0] for one in pieces])
        assert 0.2 < open_ < 0.8
        own = np.concatenate([one.output[:, 0] for one in pieces])
        off.append(np.abs(own - wanted[fine // N - 1 :: fine // N]).max() / np.ptp(wanted))
    assert off[1] < 4e-4
    assert off[0] / off[1] > 4.0**1.5


def test_springs_against_an_explicit_march() -> None:
    """Slip in both tangential directions and lift-off, from rest, 12 periods: 0.2 %."""
    k, frequency, force, N, fine, periods = 3e4, 52.0, 600.0, 256, 64, 12
    model, start = wedge(k)
    march, at = (
        InterfaceMarch(model, frequency, [[-1j * force], [0.0]], N, by_coulomb),
        start.copy(),
    )
    pieces = [march.period(at) for _ in range(periods)]
    own = np.concatenate([one.output for one in pieces])
    assert np.mean([one.counts for one in pieces], axis=0).min() > 0.02
    assert np.abs(start.slip - at.slip).reshape(2, 2).max(axis=1).min() > 1e-3
    out = np.zeros((N * periods, 2))
    explicit_march(
        N * periods * fine,
        fine,
        1.0 / (frequency * N * fine),
        model.omega,
        2.0 * model.damping * model.omega,
        model.shapes,
        np.ascontiguousarray(model.columns),
        np.linalg.inv(model.mass),
        model.load,
        np.zeros((6, 6)),
        k,
        model.gap,
        0.5,
        model.places[:, 0],
        model.pushed[:, 0],
        force,
        2.0 * np.pi * frequency,
        out,
        start.q.copy(),
        start.s.copy(),
        np.zeros(6),
        start.slip.copy(),
        1,
    )
    assert np.abs(own - out).max() < 2e-3 * np.ptp(out)


def test_two_places_with_phases_and_two_harmonics() -> None:
    """Stuck, the motion is the sum of the linear responses to each harmonic at its places."""
    model, start = wedge(3e4)
    drive = np.array([[1.0, 0.4j], [0.6 * np.exp(0.7j), -0.5]])
    point = settle(InterfaceMarch(model, 40.0, drive, 256), start.copy(), 1e-4, 2000)
    assert point.settled and point.last.counts[STICK] == 1.0
    t = 2.0 * np.pi * np.arange(1, 257)[:, None] / 256
    want = np.zeros((256, 2))
    for h in (1, 2):
        X = model.linear_response([40.0 * h], drive[:, h - 1], stuck=True)[0]
        want += (X * np.exp(1j * h * t)).real
        alone = np.abs(X).max()
        assert alone > 0.1 * np.abs(want).max()
    moving = point.last.output - start.q
    assert np.abs(moving - want).max() < 3e-3 * np.abs(want).max()


def copied(one: Any) -> Any:
    if isinstance(one, tuple):
        return tuple(copied(part) for part in one)
    return one.copy() if isinstance(one, np.ndarray) else one


def stuck_at(sample: int, parts: Any, bases: Any, which: Any, *rest: Any) -> int:
    """The steps up to this one, left as they are where it has no answer."""
    march_steps(0, False, parts, bases, which[:sample], *rest)
    # the step beyond on copies: leaves x0 as a step that fails does
    ahead = copied(rest)
    march_steps(sample, False, parts, bases, which[: sample + 1], *ahead)
    rest[-1][0][:] = ahead[-1][0]
    return sample


def test_periods_in_a_row_are_those_one_by_one() -> None:
    """Steps of half a radian and mu = 1.7, some of which the solver behind has to finish."""
    model = replace(made(), friction=np.full(made().n, 1.7))
    model, start = worn_start(model, rig()[2], F_C)
    by_one, at = start.copy(), start.copy()
    march, other = (InterfaceMarch(model, 453.0, [-1j * F_C / 5.0], 16, by_coulomb) for _ in "ab")
    periods = [march.period(by_one) for _ in range(20)]
    found = settle(other, at, 1e-3, 20)
    assert sum(one.fallbacks for one in periods) > 3
    assert len(other.bases.open) == len(march.bases.open) > 2
    np.testing.assert_array_equal(found.last.output, periods[-1].output)
    np.testing.assert_array_equal(found.last.energy, periods[-1].energy)
    np.testing.assert_array_equal(found.last.counts, periods[-1].counts)
    for mine, want in zip(at.arrays(), by_one.arrays(), strict=True):
        np.testing.assert_array_equal(mine, want)


def test_steps_left_unsolved_are_finished_by_the_solver_behind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Newton's method given up at a step: the same period as if it had not been."""
    model, start = worn()
    want_at, at = start.copy(), start.copy()
    march = InterfaceMarch(model, 453.0, [-1j * F_C / 20.0], 32, by_coulomb)
    want = march.period(want_at)
    real, asked = module.march_steps, []

    def giving_up(first: int, given: bool, *rest: Any) -> int:
        asked.append(given)
        return stuck_at(20, *rest) if first == 0 else int(real(first, given, *rest))

    march = InterfaceMarch(model, 453.0, [-1j * F_C / 20.0], 32, by_coulomb)
    march.rebase(np.arange(model.n) % 2 == 0)
    monkeypatch.setattr(module, "march_steps", giving_up)
    found = march.period(at)
    assert asked == [False, True] and found.fallbacks == 1
    np.testing.assert_allclose(
        found.output, want.output, rtol=0.0, atol=1e-9 * np.abs(want.output).max()
    )
    np.testing.assert_allclose(found.energy, want.energy, rtol=1e-6)
    march.fallback = None
    with pytest.raises(ConvergenceError, match=r"453 Hz .* more samples"):
        march.period(start.copy())
    answer = stepped_sine(model, [453.0], [-1j], start)
    assert answer.status == "stopped" and not answer.frequency.size and "453 Hz" in answer.message


def test_too_few_periods_are_told() -> None:
    model, start = worn()
    found = stepped_sine(model, [453.0, 440.0], [-1j], start, most_periods=20)
    assert found.status == "not settled" and not found.settled.any()
    assert "2 of 2" in found.message and all(p.periods == 20 for p in found.points)
    assert all((p.highest > p.lowest).all() for p in found.points)
    march, at = InterfaceMarch(model, 440.0, [0.0], 64), start.copy()
    still = settle(march, at, 1e-3, 100)
    assert still.settled and still.periods < 20


def test_a_state_of_other_faces_is_refused() -> None:
    model, _ = worn()
    last = rig()[2].seat(MU, [F_C]).history
    with pytest.raises(InputError, match="another contact"):
        resting(model, last.force, last.slip, last.gap, last.motion)
    with pytest.raises(InputError, match="positive"):
        stepped_sine(model, [0.0], [1.0], worn()[1])
    with pytest.raises(InputError, match="8 samples"):
        stepped_sine(model, [400.0], [1.0], worn()[1], samples=4)


def test_half_is_whole() -> None:
    """What is even about y = 0 is the same from the whole model."""
    found = []
    for symmetry in ("half", "full"):
        changes = [
            f"mesh.symmetry={symmetry}",
            "geometry.patch_along_y=4",
            "geometry.patch_along_slope=2",
        ]
        plan: Any = make_plan(load_scene("symmetric-seated", changes))
        bodies = make_bodies(plan)
        of = make_interface(plan, bodies)
        n_modes = 2 if symmetry == "half" else 4
        model = make_interface_model(
            plan,
            bodies,
            of,
            friction=MU,
            centrifugal=F_C,
            damping=DAMPING,
            kept_modes=(n_modes, 0.0),
        )
        model, start = worn_start(model, of, F_C)
        found.append(
            (model, start, stepped_sine(model, [453.0], [-1j * F_C / 600.0], start, samples=32))
        )
    half, whole = (one[2] for one in found)
    np.testing.assert_allclose(half.amplitude, whole.amplitude, rtol=1e-2)
