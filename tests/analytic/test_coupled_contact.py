"""Normal and tangential contact at once against closed forms, the uncoupled solvers where these are
exact, and an enumeration of all states.
"""

from itertools import product

import numpy as np
import pytest

from upd.contact import coupled_contact, normal_contact, tangential_path
from upd.contact.coulomb_conditions import carries, self_locking
from upd.contact.rigid_damper import equilibrium
from upd.errors import ConvergenceError, InputError
from upd.reference import half_space_compliance

FRICTION = 0.6


def spd(rng: np.random.Generator, m: int, decades: float = 2.0) -> np.ndarray:
    Q = np.linalg.qr(rng.standard_normal((m, m)))[0]
    C = 1e-6 * Q @ np.diag(np.logspace(0.0, -decades, m)) @ Q.T
    return np.asarray(0.5 * (C + C.T))


def sphere(nx: int, half: float = 0.25, R: float = 5.0) -> tuple[np.ndarray, np.ndarray]:
    """Compliance (3n, 3n) and gap of a steel sphere on a steel half-space."""
    d = 2.0 * half / (nx - 1)
    n = nx * nx
    C = np.zeros((3 * n, 3 * n))
    C[:n, :n] = 2.0 * half_space_compliance(nx, nx, d, d, 2e5, 0.3)
    C[n:, n:] = 2.0 * half_space_compliance(nx, nx, d, d, 2e5, 0.3, "both")
    x = np.linspace(-half, half, nx)
    r2 = np.add.outer(x**2, x**2).ravel()
    return C, r2 / (R + np.sqrt(R**2 - r2))


def test_like_half_spaces_are_uncoupled() -> None:
    """Hertz and Mindlin as before, through a full cycle along a slanted direction."""
    C, gap = sphere(11)
    n = len(gap)
    loads = 120.0 * FRICTION * np.outer([0.4, 0.9, 0.0, -0.9, 0.9], [0.8, 0.6])
    found = coupled_contact(
        C, gap, FRICTION, load=[[120.0, 0.0, 0.0], *np.column_stack((np.full(5, 120.0), loads))]
    )
    normal = normal_contact(C[:n, :n], gap, load=120.0)
    path = tangential_path(C[n:, n:], FRICTION * normal.force, loads=loads)
    assert found.status == "converged"
    assert found.fallbacks == 0
    assert not found.self_locking
    np.testing.assert_allclose(found.force[:, :, 0], np.tile(normal.force, (6, 1)), atol=1e-11)
    np.testing.assert_allclose(
        found.force[1:, :, 1:], path.force.reshape(5, 2, n).swapaxes(1, 2), atol=1e-9
    )
    np.testing.assert_allclose(found.displacement[1:, 1:], path.displacement, rtol=1e-9)
    np.testing.assert_allclose(found.slip_work[1:], path.slip_work, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("components", [2, 3])
def test_one_node(components: int) -> None:
    """Stick by its stiffness, slip at mu N, open without force."""
    C = np.diag([1e-5, 2e-5, 2e-5][:components])
    way = np.array([1.0, 1.0] if components == 2 else [1.0, 0.6, 0.8])
    motion = np.outer([0.0, 8e-5, 1e-3, 2e-4, 3e-4], way)
    motion[:, 0] = np.array([2e-4, 2e-4, 2e-4, 2e-4, -1e-4])
    found = coupled_contact(C, [1e-4], 0.5, displacement=motion)
    along = found.force[:, 0, 1:] @ way[1:]
    N = (2e-4 - 1e-4) / 1e-5
    # reversed: down from the slipped place by 8e-4, beyond mu N on the other side
    assert found.force[:4, 0, 0] == pytest.approx(N)
    assert along == pytest.approx([0.0, 4.0, 0.5 * N, -0.5 * N, 0.0])
    assert found.state[:, 0].tolist() == [1, 1, 2, 2, 0]
    assert found.gap[-1, 0] == pytest.approx(2e-4)


def wedge(k_n: float, k_t: float, left: float, right: float) -> tuple[np.ndarray, np.ndarray]:
    """Compliance (4, 4) and columns (4, 2) of a rigid damper on one node per face, free to move up
    and across.
    """
    a, b = np.radians((left, right))
    normal = np.array([[np.cos(a), -np.sin(a)], [np.cos(b), np.sin(b)]])
    along = np.array([[np.sin(a), np.cos(a)], [np.sin(b), -np.cos(b)]])
    return np.diag([1 / k_n, 1 / k_n, 1 / k_t, 1 / k_t]), np.vstack((normal, along))


@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_wedge_pressed_between_two_faces(mu: float) -> None:
    """F_C beyond what sticks: friction opposes it fully; lowered: reversed."""
    C, B = wedge(1e5, 8e4, 45.0, 45.0)
    up, down = np.linspace(10.0, 350.0, 8), [200.0, 100.0, 50.0, 25.0]
    found = coupled_contact(C, [0, 0], mu, load=[[F, 0.0] for F in (*up, *down)], columns=B)
    assert found.status == "converged"
    for k, F in ((7, 350.0), (11, 25.0)):
        want = equilibrium(45.0, 45.0, F, mu, "opposing" if k == 7 else "reversed")
        force = found.force[k]
        assert force[:, 0] == pytest.approx([want.normal_left, want.normal_right])
        assert force[:, 1] == pytest.approx([want.tangential_left, want.tangential_right])
    assert found.self_locking is False


def test_wedge_that_sticks_by_its_stiffnesses() -> None:
    """Steep friction: f_n = k_n u_n, f_t = k_t u_t, and F = 2 (f_n cos a + f_t sin a)."""
    C, B = wedge(1e5, 8e4, 30.0, 30.0)
    found = coupled_contact(C, [0, 0], 1.0, load=[350.0, 0.0], columns=B)
    a = np.radians(30.0)
    s = 350.0 / (2 * (1e5 * np.cos(a) ** 2 + 8e4 * np.sin(a) ** 2))
    assert found.displacement[0] == pytest.approx([s, 0.0], abs=1e-15)
    assert found.force[0, :, 0] == pytest.approx([1e5 * s * np.cos(a)] * 2)
    assert found.force[0, :, 1] == pytest.approx([8e4 * s * np.sin(a)] * 2)


def test_a_wedge_that_holds_itself_is_named() -> None:
    """Faces at 60 deg hold each other when mu > tan 30 deg."""
    limit = np.tan(np.radians(30.0))
    for mu, locks in ((0.99 * limit, False), (1.01 * limit, True)):
        C, B = wedge(1e5, 8e4, 60.0, 60.0)
        found = coupled_contact(C, [0, 0], mu, load=[100.0, 0.0], columns=B)
        assert found.self_locking is locks
        assert ("without any load" in found.message) is locks
        assert self_locking(B, np.full(2, mu)) is locks


def test_loads_that_cannot_be_carried() -> None:
    C = np.diag([1e-5, 1e-5, 2e-5, 2e-5])
    B = np.kron(np.eye(2), np.ones((2, 1)))
    mu = np.full(2, 0.3)
    assert carries(B, mu, np.array([10.0, 2.9]))
    assert not carries(B, mu, np.array([10.0, 3.1]))
    assert not carries(B, mu, np.array([-1.0, 0.0]))
    for load in ([10.0, 3.1], [-1.0, 0.0]):
        with pytest.raises(ConvergenceError, match="cannot be carried"):
            coupled_contact(C, [0.0, 0.0], 0.3, load=[[10.0, 0.0], load])


def states_of_all(
    C: np.ndarray, h: np.ndarray, w0: np.ndarray, mu: float, u: np.ndarray
) -> list[np.ndarray]:
    """Every answer of a contact in two components, by trying all states of all nodes."""
    n, found = len(h), []
    for state in product("osrl", repeat=n):
        A, right = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
        for i, s in enumerate(state):
            t = n + i
            if s == "o":
                A[i, i] = A[t, t] = 1.0
                continue
            A[i], right[i] = C[i], u[0] - h[i]
            if s == "s":
                A[t], right[t] = C[t], u[1] - w0[i]
            else:
                A[t, t], A[t, i] = 1.0, -mu if s == "r" else mu
        try:
            f = np.linalg.solve(A, right)
        except np.linalg.LinAlgError:
            continue
        g = h - u[0] + C[:n] @ f
        dw = u[1] - C[n:] @ f - w0
        if all(
            (s == "o" and g[i] >= 0)
            or (
                s != "o"
                and f[i] >= 0
                and (
                    (s == "s" and abs(f[n + i]) <= mu * f[i])
                    or (s == "r" and dw[i] >= 0)
                    or (s == "l" and dw[i] <= 0)
                )
            )
            for i, s in enumerate(state)
        ):
            found.append(f)
    return found


def test_two_hundred_random_systems_against_all_their_states() -> None:
    rng = np.random.default_rng(3)
    single = 0
    for _ in range(200):
        n, mu = int(rng.integers(1, 5)), float(rng.choice([0.0, 1e-6, 0.3, 0.6, 1.0]))
        C, h = spd(rng, 2 * n), 1e-5 * rng.random(n)
        u = np.array([[1.5e-5, 0.0], [1.5e-5 * rng.random(), 2e-5 * rng.standard_normal()]])
        found = coupled_contact(C, h, mu, displacement=u)
        assert found.status == "converged"
        every = states_of_all(C, h, found.slip[0][:, 0], mu, u[1])
        f = found.force[1].T.ravel()
        size = np.abs(f).max() + 1e-3
        assert min(np.abs(f - one).max() for one in every) < 1e-8 * size
        single += all(np.abs(f - one).max() < 1e-8 * size for one in every)
    assert single > 180


@pytest.mark.parametrize("components", [2, 3])
def test_stiffness_in_every_state(components: int) -> None:
    to = np.array([1.5e-5, 1.2e-5, -0.7e-5][:components])
    for seed in range(50):
        rng = np.random.default_rng(seed)
        C, h = spd(rng, 9 * components), 2e-5 * rng.random(9)
        motions = [np.eye(components)[0] * 1.3e-5, to]
        first = coupled_contact(C, h, 0.4, displacement=motions)
        if set(first.state[-1].tolist()) == {0, 1, 2}:
            break
    else:
        pytest.fail("no system with all three states")
    before = coupled_contact(C, h, 0.4, displacement=motions[0]).history

    def last(x: np.ndarray) -> np.ndarray:
        return coupled_contact(C, h, 0.4, displacement=x, history=before).load[-1]

    again = coupled_contact(C, h, 0.4, displacement=to, history=before)
    np.testing.assert_allclose(again.force[-1], first.force[-1], rtol=1e-8, atol=1e-9)
    K = again.stiffness()
    for k in range(components):
        e = np.eye(components)[k] * 1e-6 * np.abs(to).max()
        slope = (last(to + e) - last(to - e)) / (2e-6 * np.abs(to).max())
        np.testing.assert_allclose(K[:, k], slope, rtol=2e-5, atol=2e-5 * np.abs(K).max())


def coupled_sphere() -> tuple[np.ndarray, np.ndarray]:
    """A sphere whose pressure shears it: the compliance of another basis."""
    C, gap = sphere(7)
    n = len(gap)
    rng = np.random.default_rng(0)
    couple = 0.1 * C[:n, :n] * rng.uniform(-1.0, 1.0, (n, n))
    C[:n, n : 2 * n] = couple
    C[n : 2 * n, :n] = couple.T
    return C, gap


def test_energy() -> None:
    """Work of the load = dissipated + stored, to first order in the steps."""
    C, gap = coupled_sphere()

    def off(k: int) -> float:
        there = np.linspace(0.0, 1.0, k + 1)[1:, None]
        up = np.hstack((120.0 * there, 0.0 * there, 0.0 * there))
        across = np.array([120.0, 60.0, 20.0]) * np.hstack((np.ones_like(there), there, there))
        found = coupled_contact(C, gap, FRICTION, load=np.vstack((up, across)))
        f = found.force[-1].T.ravel()
        stored = 0.5 * f @ C @ f
        return abs(found.work.sum() - found.slip_work.sum() - stored) / stored

    coarse, fine = off(8), off(32)
    assert fine < 1e-2
    assert fine < coarse / 3.0


def test_touching_faces_scale_with_the_load_and_loops_close() -> None:
    C, _ = coupled_sphere()
    n = len(C) // 3
    loads = np.array([[100.0, 20.0, 5.0], [100.0, 45.0, 20.0]])
    one, two = (coupled_contact(C, np.zeros(n), 0.6, load=k * loads) for k in (1.0, 7.0))
    np.testing.assert_allclose(two.force, 7.0 * one.force, rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(two.slip, 7.0 * one.slip, rtol=1e-9, atol=1e-13)
    cycle = [[100.0, T, 0.0] for T in 50.0 * np.sin(np.pi / 6 * np.arange(1, 40))]
    found = coupled_contact(C, np.zeros(n), 0.6, load=cycle)
    assert found.status == "converged"
    last, before = found.force[38], found.force[26]
    np.testing.assert_allclose(last, before, atol=1e-3 * np.abs(last).max())
    assert found.slip_work[27:39].sum() == pytest.approx(found.work[27:39].sum(), rel=5e-3)


def test_frame_may_turn() -> None:
    """Tangential axes turned by 30 deg: the same forces."""
    C, gap = coupled_sphere()
    n = len(gap)
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.kron(np.array([[1, 0, 0], [0, c, s], [0, -s, c]]), np.eye(n))
    load = np.array([[120.0, 0.0, 0.0], [120.0, 40.0, 25.0]])
    one = coupled_contact(C, gap, 0.5, load=load)
    two = coupled_contact(
        turn @ C @ turn.T, gap, 0.5, load=load @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    )
    back = two.force[-1].T.ravel() @ turn
    np.testing.assert_allclose(back, one.force[-1].T.ravel(), atol=1e-9)


def test_bad_input_is_named_at_once() -> None:
    with pytest.raises(InputError) as error:
        coupled_contact(np.eye(4), [0.0], -1.0, load=[1.0, 0.0], displacement=[1.0])
    text = str(error.value)
    assert "4 rows for 1 gaps" in text
    assert "negative" in text
    assert "exactly one" in text
    with pytest.raises(InputError, match=r"load has shape \(3,\)"):
        coupled_contact(np.eye(2), [0.0], 0.1, load=[1.0, 0.0, 0.0])
    with pytest.raises(InputError, match="not independent"):
        coupled_contact(np.eye(2), [0.0], 0.1, load=[1.0, 0.0], columns=[[1.0, 1.0], [0.0, 0.0]])
    history = coupled_contact(np.eye(2), [0.0], 0.1, load=[1.0, 0.0]).history
    with pytest.raises(InputError, match="history of the same contact"):
        coupled_contact(np.eye(3), [0.0], 0.1, load=[1.0, 0.0, 0.0], history=history)
