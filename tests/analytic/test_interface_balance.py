"""Balance of the blades in frequency with damper and whole faces in time: against the time march of
the same system, linear answers, differences, and what holds for any periodic motion.
"""

from functools import cache
from threading import get_ident
from typing import Any

import numpy as np
import pytest

import upd.hbm.core.factors as core_factors
import upd.hbm.faces.balance as balance
import upd.hbm.faces.corrector as corrector
import upd.hbm.faces.equations as module
import upd.hbm.faces.newton as linear
from upd.analyses import make_plan
from upd.analyses.forced.interface_model import by_coulomb, make_interface_model, worn_start
from upd.analyses.seated.bodies import make_bodies
from upd.analyses.seated.interface import Interface, make_interface
from upd.errors import ConvergenceError, InputError
from upd.hbm.core.newton import Settings, across
from upd.hbm.faces.balance import InterfaceResponse, interface_response
from upd.hbm.faces.equations import InterfaceEquations
from upd.hbm.faces.newton import InterfaceEvaluation
from upd.hbm.faces.state import InterfaceModel, InterfaceState
from upd.hbm.faces.step import OPEN, SLIP, STICK
from upd.hbm.faces.sweep import stepped_sine
from upd.scene import load_scene

F_C, MU, DAMPING = 350.0, 0.6, 0.005
LEFT, RIGHT = 0, 1


def evaluate(
    e: InterfaceEquations, x: np.ndarray, w: float, past: np.ndarray | None = None
) -> InterfaceEvaluation:
    return InterfaceEvaluation(e, x, e.march(x, w), past)


@cache
def worn(load: float = F_C) -> tuple[InterfaceModel, InterfaceState]:
    """Half of the rig with the wedge, 3 x 3 nodes a face, worn in under the load."""
    changes = ["mesh.symmetry=half", "geometry.patch_along_y=4", "geometry.patch_along_slope=2"]
    plan: Any = make_plan(load_scene("symmetric-seated", changes))
    bodies = make_bodies(plan)
    of: Interface = make_interface(plan, bodies)
    model = make_interface_model(plan, bodies, of, friction=MU, centrifugal=load, damping=DAMPING)
    return worn_start(model, of, load)


def response(frequencies: Any, force: float, **options: Any) -> InterfaceResponse:
    model, start = worn()
    return interface_response(
        model, frequencies, [-1j * force], start, **({"fallback": by_coulomb} | options)
    )


@cache
def beyond_a_fold() -> InterfaceResponse:
    """Nodes in all states, many of them slipping to and fro."""
    return response([436.0, 444.0, 447.0], F_C / 300.0, samples=64)


def at_a_motion() -> tuple[InterfaceEquations, np.ndarray, float]:
    """Equations and unknowns at its end, and the frequency in rad/s."""
    found = beyond_a_fold()
    assert found.arrived and (found.share[-1] > 0.1).all(), found.message
    model, start = worn()
    e = InterfaceEquations(model, [-1j * F_C / 300.0], start, 3, 64, by_coulomb)
    e.slip, one = found.points[-1].slip.copy(), found.points[-1]
    e.let_move(e.march_from(one.q, one.rigid, one.slip, 2.0 * np.pi * 447.0).moving)
    return e, e.joined(one.q, one.rigid, one.slip), 2.0 * np.pi * 447.0


# -- Newton's method -------------------------------------------------------------------------------


def test_derivative_against_differences() -> None:
    """Away from the answer, by each kind of unknown and by the frequency, in all states."""
    e, x, w = at_a_motion()
    rng = np.random.default_rng(1)
    (h, m), r = e.shape, len(e.model.load)
    q, rigid, slip = e.split(x)
    e.let_move(~e.mobile)
    x = e.joined(q, rigid, slip)
    face = np.abs(e.model.shapes @ q[1:].T).max()
    size = np.concatenate(
        [
            np.full(h * m, np.abs(q[1:]).max()),
            np.tile(face / np.abs(e.model.columns).max(axis=0), 3),
            np.full(len(e.tangents), face),
        ]
    )
    x = x + 1e-2 * size * rng.normal(size=len(x))
    found = evaluate(e, x, w)
    assert {OPEN, STICK, SLIP} == set(found.period.state.ravel())
    blocks = [slice(0, h * m), slice(h * m, h * m + 3 * r), slice(h * m + 3 * r, None), None]
    checked = 0
    for block in blocks:
        for _ in range(4):
            d, dw = np.zeros(len(x)), 0.0
            if block is None:
                dw = 1e-6 * w
            else:
                d[block] = 1e-6 * (size * rng.normal(size=len(x)))[block]
            # nodes that never move have no slip of their own in the equations
            still = ~np.tile(found.period.moving, 2)
            d[h * m + 3 * r :][still] = 0.0
            up, down = evaluate(e, x + d, w + dw), evaluate(e, x - d, w - dw)
            if (up.period.state != down.period.state).any():
                continue
            want = 0.5 * (up.residual - down.residual)
            have = found.derivative @ np.append(d, dw)
            for part in (slice(0, h * m), slice(h * m, None)):
                # differences, and the samples' misfit of 1e-11 of their forces
                noise = 1e-11 * np.abs(e.Q @ found.period.modal).max() if part.start == 0 else 0.0
                noise = noise or 1e-11 * np.abs(x[part]).max()
                allowed = 1e-4 * np.abs(want[part]).max() + e.samples * noise
                np.testing.assert_allclose(have[part], want[part], rtol=0.0, atol=allowed)
            checked += 1
    assert checked >= 8


def test_one_direction_is_that_of_the_derivative() -> None:
    """By factors of the samples, and by their inverses, which the derivative leaves."""
    e, x, w = at_a_motion()
    q, rigid, slip = e.split(x)
    e.let_move(~e.mobile)
    x = e.joined(q, rigid, slip)
    found, d, dw = evaluate(e, x, w, e.start.slip), 1e-3 * x, 1e-3 * w
    assert not found.linear.inverted
    by_factors = found.in_direction(d, dw)
    want = found.derivative @ np.append(d, dw)
    assert found.linear.inverted
    for have in (by_factors, found.in_direction(d, dw)):
        np.testing.assert_allclose(have, want, rtol=0.0, atol=1e-9 * np.abs(want).max())


def test_curve_by_few_directions_is_that_by_derivatives(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same answers to the corrections' tolerance, from fewer derivatives."""
    formed, found, frequencies = [], [], [436.0, 440.0, 444.0, 446.0]
    factored = linear.InterfaceEvaluation.factored
    for many in (10**6, 1):
        count: list[int] = []

        def told(one: Any, border: Any, count: list[int] = count) -> Any:
            count.append(1)
            return factored(one, border)

        monkeypatch.setattr(linear.InterfaceEvaluation, "factored", told)
        monkeypatch.setattr(corrector, "MANY", many)
        # factors of so few unknowns are quick; here they are to be kept all the same
        monkeypatch.setattr(core_factors, "SOLUTIONS", 4.0)
        found.append(response(frequencies, F_C / 300.0, samples=64))
        formed.append(len(count))
    assert formed[1] < 0.7 * formed[0], formed
    at = [[int(np.flatnonzero(one.frequency == f)[0]) for f in frequencies] for one in found]
    have, want = found[1].amplitude[at[1]], found[0].amplitude[at[0]]
    assert (found[0].share[-1, SLIP] > 0.0).all()
    np.testing.assert_allclose(have, want, rtol=0.0, atol=1e-5 * np.abs(want[:, 1]).max())


@pytest.mark.parametrize(("near", "taken"), [(True, 2), (False, 3)])
def test_steps_that_grow_near_a_known_point_end(
    monkeypatch: pytest.MonkeyPatch, near: bool, taken: int
) -> None:
    """A shorter step is tried instead; where there is none to be tried, one may grow."""
    e, x, w = at_a_motion()
    monkeypatch.setattr(corrector, "MANY", 1)
    sizes: list[float] = []

    def grown(_: Any, residual: np.ndarray) -> np.ndarray:
        sizes.append(1e-9 * 2.0 ** len(sizes))
        return np.eye(1, len(residual) + 1, 0)[0] * sizes[-1]

    monkeypatch.setattr(corrector.PlaneSteps, "next", grown)
    of = corrector.InterfaceCorrector(e, Settings(tolerance=1e-12), 1.0)
    known = of.factors_at(evaluate(e, x, w), across(x, 1.0), of.scale(x))
    assert known is not None
    start = (x, w / (2.0 * np.pi), across(x, 1.0), of.scale(x), e.split(x)[2])
    assert of.correct(*start, known if near else None) is None
    assert len(sizes) == taken


def test_newton_is_quadratic() -> None:
    """From a motion disturbed: each correction is of the order of the square of the one before."""
    e, x, w = at_a_motion()
    h, m = e.shape

    def corrected(x: np.ndarray) -> np.ndarray:
        found = evaluate(e, x, w)
        return x - np.linalg.solve(found.derivative[:, :-1], found.residual)

    for _ in range(3):
        x = corrected(x)
    amplitude = np.abs(x[m : h * m]).max()
    disturbed, rng, off = x.copy(), np.random.default_rng(2), []
    disturbed[m : h * m] += 1e-5 * amplitude * rng.normal(size=(h - 1) * m)
    for _ in range(4):
        off.append(np.abs(disturbed - x)[m : h * m].max() / amplitude)
        disturbed = corrected(disturbed)
    assert off[0] > 1e-5 and off[1] < 1e-3 * off[0] and off[2] < 1e-10, off


def test_nodes_that_slip_for_good_end_on_the_verge() -> None:
    """Those that stick away from where they started carry all the friction they can at a sample."""
    found = response(np.arange(440.0, 452.0), F_C / 600.0, samples=64)
    e, one = found.equations, found.points[-1]
    period = e.march_from(one.q, one.rigid, one.slip, 2.0 * np.pi * one.frequency)
    n = e.model.n
    slid = np.abs(one.slip - e.start.slip).reshape(2, n).max(axis=0)
    settled = (slid > 1e-3 * slid.max()) & ((period.state == SLIP).sum(axis=0) <= 1)
    assert settled.any()
    f = period.force.reshape(-1, 3, n)[:, :, settled]
    margin = MU * f[:, 0] - np.hypot(f[:, 1], f[:, 2])
    assert (margin.min(axis=0) < 1e-3 * (MU * f[:, 0]).max(axis=0)).all()


def test_the_way_on_is_that_of_the_answer() -> None:
    """Where all sticks the first point is solved from rest with one set of factors; the direction
    of the curve there is not that of rest, so a wrong one would not lead on without a jump.
    """
    found = response([434.0, 435.0, 436.0], F_C / 5000.0, samples=64)
    assert found.message.startswith("reached 436 Hz")
    assert "jump" not in found.message
    assert (found.share[:, STICK] > 0.999).all()


def test_a_node_out_of_the_equations_comes_in() -> None:
    """Nodes that move without their slips among the unknowns: the correction takes these in."""
    e, x, w = at_a_motion()
    q, rigid, slip = e.split(x)
    e.mobile = np.zeros_like(e.mobile)
    x = e.joined(q, rigid, slip)
    assert e.march(x, w).moving.any()
    of = corrector.InterfaceCorrector(e, Settings(tolerance=1e-6), 1.0)
    found = of.correct(x, w / (2.0 * np.pi), across(x, 1.0), of.scale(x), slip)
    assert found is not None and e.mobile.any() and len(found.x) > len(x)


def test_answers_do_not_depend_on_the_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """A curve through slip and lift-off in many pieces: the same digits."""
    monkeypatch.setattr(linear, "FEW", 1)
    found, used = [], set[int]()
    march = linear.march_directions

    def told(*given: Any) -> None:
        used.add(get_ident())
        march(*given)

    monkeypatch.setattr(linear, "march_directions", told)
    for workers in (1, 2):
        used.clear()
        monkeypatch.setattr(balance, "threads_used", lambda count=workers: count)
        found.append(response([436.0, 444.0, 447.0], F_C / 300.0, samples=64))
        assert len(used - {get_ident()}) == (workers if workers > 1 else 0)
    np.testing.assert_array_equal(found[0].frequency, found[1].frequency)
    np.testing.assert_array_equal(found[0].amplitude, found[1].amplitude)
    assert (found[0].share[-1] > 0.1).all(), found[0].share[-1]


# -- answers that are known ------------------------------------------------------------------------


def test_stuck_is_the_linear_answer() -> None:
    """Both harmonics of a small force; what differs is the damper's step, of second order."""
    model, start = worn()
    f, force, off = [300.0, 453.0], np.array([[-1e-3j, 4e-4 + 3e-4j]]), []
    for samples in (32, 64, 128):
        found = interface_response(model, f, force, start, samples=samples)
        assert found.arrived and (found.share[:, STICK] == 1.0).all()
        at = [int(np.abs(found.frequency - one).argmin()) for one in f]
        for k in (1, 2):
            want = model.linear_response(k * np.array(f), force[:, k - 1], stuck=True)
            off.append(np.abs(found.amplitude[at, k] / want - 1.0).max())
    first, second = off[::2], off[1::2]
    assert first[2] < 1e-3 and second[2] < 1e-2
    assert first[0] / first[1] > 3.0 and first[1] / first[2] > 3.0, first


def test_nothing_moves_without_excitation() -> None:
    model, start = worn()
    found = interface_response(model, [300.0, 450.0], [0.0], start, samples=32)
    assert found.arrived and np.abs(found.amplitude[:, 1:]).max() < 1e-12
    assert np.abs(found.energy).max() < 1e-25
    at = found.state_at(-1)
    np.testing.assert_allclose(at.f, start.f, rtol=0.0, atol=1e-9 * np.abs(start.f).max())
    np.testing.assert_array_equal(at.slip, start.slip)


@pytest.mark.parametrize(("ratio", "f"), [(600.0, 451.0), (300.0, 447.0)])
def test_a_march_stays_in_the_motion(ratio: float, f: float) -> None:
    """From the balance's state the march stays."""
    model, _ = worn()
    drive, off = [-1j * F_C / ratio], []
    for harmonics in (3, 5):
        found = response([436.0, 444.0, f], F_C / ratio, harmonics=harmonics, samples=64)
        assert found.arrived and found.share[-1, SLIP] > 0.05
        marched = stepped_sine(
            model, [f], drive, found.state_at(-1), fallback=by_coulomb, samples=64
        )
        assert marched.status == "settled"
        off.append(abs(abs(found.amplitude[-1, 1, RIGHT]) / abs(marched.amplitude[0, RIGHT]) - 1.0))
    assert max(off) < 5e-3, off


def test_all_loads_scaled_scale_the_answer() -> None:
    scale = 7.0
    model, start = worn(scale * F_C)
    f = [440.0, 446.0, 449.0, 451.0]
    one = response(f, F_C / 600.0, samples=64)
    many = interface_response(model, f, [-1j * scale * F_C / 600.0], start, samples=64)
    assert one.share[-1, SLIP] > 0.05
    # solved to a share of the whole motion, its small harmonics too
    size = scale * np.abs(one.amplitude[-1]).max()
    np.testing.assert_allclose(many.amplitude[-1], scale * one.amplitude[-1], atol=1e-6 * size)
    np.testing.assert_allclose(many.energy[-1], scale**2 * one.energy[-1], rtol=1e-4)


def test_energy_closes_with_the_square_of_the_step() -> None:
    off = []
    for samples in (64, 128, 256):
        found = response([440.0, 446.0, 449.0, 451.0], F_C / 600.0, samples=samples)
        into, damped, rubbed = found.energy[-1]
        assert rubbed > 0.05 * into
        off.append(abs(into - damped - rubbed) / into)
    assert off[1] < 1e-3 and off[0] / off[2] > 8.0, off


# -- the walk --------------------------------------------------------------------------------------


def test_curve_up_is_that_of_a_sweep() -> None:
    """Through the peak with slip and lift-off, at every frequency asked for."""
    model, start = worn()
    f = np.array([440.0, 446.0, 449.0, 451.0, 452.0, 453.0, 455.0])
    drive = [-1j * F_C / 600.0]
    found = response(f, F_C / 600.0)
    swept = stepped_sine(model, f, drive, start, fallback=by_coulomb)
    assert found.arrived and swept.status == "settled", found.message
    at = [int(np.flatnonzero(found.frequency == one)[0]) for one in f]
    np.testing.assert_allclose(np.abs(found.amplitude[at, 1]), np.abs(swept.amplitude), rtol=5e-3)
    np.testing.assert_allclose(found.share[at], swept.share, atol=0.02)


def test_a_motion_jumps_at_a_fold() -> None:
    """Beyond it the curve is that of a march from there; found again from a state that moves."""
    model, start = worn()
    f, drive = [440.0, 446.0, 447.0, 448.0], [-1j * F_C / 300.0]
    found = response(f, F_C / 300.0)
    swept = stepped_sine(model, f, drive, start, fallback=by_coulomb)
    assert found.arrived and "jump" in found.message and "447" in found.message
    at = [int(np.flatnonzero(found.frequency == one)[0]) for one in f]
    here, there = np.abs(found.amplitude[at, 1, RIGHT]), np.abs(swept.amplitude[:, RIGHT])
    np.testing.assert_allclose(here, there, rtol=1e-2)
    assert found.share[at[1], OPEN] < 0.02 < 0.1 < found.share[at[2], OPEN]
    again = interface_response(
        model, [448.0], drive, found.state_at(-1), fallback=by_coulomb, harmonics=3
    )
    assert again.arrived
    np.testing.assert_allclose(np.abs(again.amplitude[0, 1, RIGHT]), here[-1], rtol=5e-3)


def copied(one: Any) -> Any:
    if isinstance(one, tuple):
        return tuple(copied(part) for part in one)
    return one.copy() if isinstance(one, np.ndarray) else one


def test_steps_left_unsolved_are_finished_by_the_solver_behind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Newton's method given up at a sample: the same period as if it had not been."""
    e, x, w = at_a_motion()
    want = e.march(x, w)
    real, asked = module.given_blades, []

    def giving_up(first: int, given: bool, pushes: Any, *rest: Any) -> int:
        asked.append((first, given))
        if first == 0:
            real(0, given, pushes[:20], *rest)
            # the sample beyond on copies: leaves x0 as a sample that fails does
            ahead = copied(rest)
            real(20, False, pushes[:21], *ahead)
            rest[-1][-1][:] = ahead[-1][-1]
            return 20
        return int(real(first, given, pushes, *rest))

    monkeypatch.setattr(module, "given_blades", giving_up)
    # another drive: the period is not the one that is known
    e.drive = e.drive.copy()
    found = e.march(x, w)
    assert asked == [(0, False), (20, True)]
    size = np.abs(want.force).max()
    np.testing.assert_allclose(found.force, want.force, rtol=0.0, atol=1e-8 * size)
    e.fallback = None
    e.drive = e.drive.copy()
    with pytest.raises(ConvergenceError, match=r"447 Hz .* more samples"):
        e.march(x, w)


def test_too_few_points_are_told() -> None:
    found = response(
        [440.0, 445.0, 450.0], 1e-3, settings=Settings(most_points=2, tolerance=1e-6), samples=32
    )
    assert found.status == "step limit" and not found.arrived and "2 points" in found.message


def test_what_cannot_be_is_refused() -> None:
    model, start = worn()
    for f in ([], [450.0, 440.0, 445.0], [-1.0]):
        with pytest.raises(InputError, match="frequencies"):
            interface_response(model, f, [1.0], start)
    with pytest.raises(InputError, match="twice as many"):
        interface_response(model, [450.0], [1.0], start, harmonics=20, samples=32)
    with pytest.raises(InputError, match="2 harmonics"):
        interface_response(model, [450.0], [[1.0, 1.0]], start, harmonics=1)
