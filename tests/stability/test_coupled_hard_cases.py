"""Coupled contact where solvers stumble: no friction, a lot of it, wedges that hold themselves,
noise, stiffness contrast, faces that open and close, wrong starts; every answer by the laws
themselves.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upd.contact import CoupledContact, coupled_contact, normal_contact
from upd.contact.coulomb import Coulomb
from upd.contact.coulomb_conditions import AskedStep, Iterate
from upd.contact.coupled import CoupledHistory
from upd.contact.rigid_damper import face_forces
from upd.errors import ConvergenceError, InputError
from upd.reference import half_space_compliance

LOADS = np.array([[60.0, 0.0, 0.0], [60.0, 8.0, 3.0], [60.0, -8.0, 3.0], [30.0, 0.0, 0.0]])


def lattice(nx: int = 6, ny: int = 5, nu: float = 0.3) -> np.ndarray:
    return half_space_compliance(nx, ny, 0.1, 0.1, 2e5, nu, "all")


def laws(
    C: np.ndarray,
    h: np.ndarray,
    mu: float,
    found: CoupledContact,
    B: np.ndarray | None = None,
    asked: Any = None,
    offset: Any = 0.0,
) -> float:
    """Worst misfit of equilibrium, Signorini and Coulomb over all steps, each by its own size."""
    n = len(h)
    B = np.kron(np.eye(len(C) // n), np.ones((n, 1))) if B is None else B
    worst, before = 0.0, np.zeros((n, len(C) // n - 1))
    offset = np.broadcast_to(offset, (len(found.force), len(C)))
    for k in range(len(found.force)):
        f, s = found.force[k], found.displacement[k]
        w = (B @ s - C @ f.T.ravel() - offset[k]).reshape(-1, n).T
        g, size = h - w[:, 0], np.abs(f).max() + 1e-30
        length = np.abs(h).max() + np.abs(B @ s).max() + np.abs(C).max() * size
        tangential = np.linalg.norm(f[:, 1:], axis=1)
        dw = w[:, 1:] - before
        before = w[:, 1:]
        ways = (dw * f[:, 1:]).sum(axis=1) - np.linalg.norm(dw, axis=1) * tangential
        sticks = tangential < mu * f[:, 0] * (1.0 - 1e-6)
        worst = max(
            worst,
            np.abs(B.T @ f.T.ravel() - np.asarray(asked)[k]).max() / size
            if asked is not None
            else 0.0,
            -g.min() / length,
            -f[:, 0].min() / size,
            np.abs(f[:, 0] * g).max() / (size * length),
            (tangential - mu * f[:, 0]).max() / size,
            np.abs(ways).max() / (size * length),
            np.abs(dw[sticks & (f[:, 0] > 0.0)]).max(initial=0.0) / length,
        )
    return float(worst)


@pytest.mark.parametrize("mu", [0.0, 1e-6, 0.3, 2.0])
@pytest.mark.parametrize("gaps", ["touching", "curved", "noise"])
def test_friction_and_gaps(mu: float, gaps: str) -> None:
    C = lattice()
    n = len(C) // 3
    rng = np.random.default_rng(0)
    x = np.linspace(-1.0, 1.0, n)
    h = {"touching": np.zeros(n), "curved": 2e-3 * x**2, "noise": 1e-3 * rng.random(n)}[gaps]
    loads = LOADS * np.array([1.0, mu, mu])
    found = coupled_contact(C, h, mu, load=loads) if mu else None
    asked = loads if mu else None
    if found is None:
        # without friction only the approach is held: shifts are given
        push = normal_contact(C[:n, :n], h, load=60.0).approach
        moved = coupled_contact(C, h, 0.0, displacement=[[push, 1e-4, 0.0], [push, -1e-4, 1e-4]])
        assert np.abs(moved.force[:, :, 1:]).max() < 1e-12 * moved.force.max()
        found = moved
    assert found.status == "converged"
    assert laws(C, h, mu, found, asked=asked) < 1e-9
    for column in (0, 1):
        spoiled = found.force.copy()
        spoiled[-1, :, column] *= 1.0 + 1e-4
        if np.abs(found.force[-1, :, column]).max() > 1e-3:
            assert laws(C, h, mu, replace(found, force=spoiled)) > 1e-9


@pytest.mark.parametrize("shape", [(1, 1), (7, 1), (1, 4)])
def test_one_node_and_one_row(shape: tuple[int, int]) -> None:
    C = lattice(*shape)
    n = len(C) // 3
    found = coupled_contact(C, np.zeros(n), 0.4, load=LOADS * np.array([1.0, 0.4, 0.4]))
    asked = LOADS * np.array([1.0, 0.4, 0.4])
    assert laws(C, np.zeros(n), 0.4, found, asked=asked) < 1e-9


def test_edge_lifts_off_and_closes_again() -> None:
    """A tilting moment opens one side; its removal gives the state before, up to trapped slip."""
    C = lattice(8, 4)
    n = len(C) // 3
    x = np.tile(np.arange(8) - 3.5, 4)
    B = np.zeros((3 * n, 4))
    B[:n, 0], B[n : 2 * n, 1], B[2 * n :, 2], B[:n, 3] = 1.0, 1.0, 1.0, x
    loads = [[100.0, 0, 0, M] for M in (0.0, 120.0, 250.0, 0.0, -250.0, 0.0)]
    found = coupled_contact(C, np.zeros(n), 0.5, load=loads, columns=B)
    assert (found.state[2] == 0).any()
    assert not (found.state[3] == 0).any()
    assert laws(C, np.zeros(n), 0.5, found, B, loads) < 1e-9


@pytest.mark.parametrize("contrast", [1e-6, 1.0, 1e6])
def test_stiff_and_soft_bodies(contrast: float) -> None:
    C = lattice() + contrast * half_space_compliance(6, 5, 0.1, 0.1, 2e5, 0.45, "all")
    n = len(C) // 3
    h = 1e-3 * max(contrast, 1.0) * np.linspace(-1.0, 1.0, n) ** 2
    found = coupled_contact(C, h, 0.4, load=LOADS * np.array([1.0, 0.4, 0.4]))
    assert found.status == "converged"
    assert laws(C, h, 0.4, found, asked=LOADS * np.array([1.0, 0.4, 0.4])) < 1e-9


def faces(angle: float, n: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """Two elastic faces of a rigid wedge, n nodes each, moving up, across and turning."""
    a, rng = np.radians(angle), np.random.default_rng(0)
    along = np.linspace(-1.0, 1.0, n)
    B = np.zeros((4 * n, 3))
    for k, side in enumerate((-1.0, 1.0)):
        rows = slice(k * n, (k + 1) * n)
        x = side * (5.0 + along * np.cos(a))
        y = -along * np.sin(a)
        normal = np.array([side * np.sin(a), np.cos(a)])
        tangent = np.array([-side * np.cos(a), np.sin(a)])
        moved = np.array([[np.zeros(n), np.ones(n)], [np.ones(n), np.zeros(n)], [-y, x]])
        for j in range(3):
            B[rows, j] = normal @ moved[j]
            B[2 * n + k * n : 2 * n + (k + 1) * n, j] = tangent @ moved[j]
    distance = np.abs(along[:, None] - along[None, :])
    face = 1e-6 / (0.3 + distance)
    C = np.kron(np.eye(4), face) + np.diag(1e-8 * rng.random(4 * n))
    couple = 0.2 * np.kron(np.eye(2), face)
    C[: 2 * n, 2 * n :] += couple
    C[2 * n :, : 2 * n] += couple
    return C, B


@pytest.mark.parametrize("part", [0.5, 0.99, 1.01, 1.5])
@pytest.mark.parametrize("angle", [45.0, 60.0])
def test_wedge_about_the_limit_where_it_holds_itself(part: float, angle: float) -> None:
    """F_C up, down to a tenth, up again, below and above mu = tan(90 - angle)."""
    C, B = faces(angle)
    mu = part * np.tan(np.radians(90.0 - angle))
    loads = [[F, 0.0, 0.0] for F in (10.0, 100.0, 200.0, 60.0, 20.0, 200.0)]
    found = coupled_contact(C, np.zeros(18), mu, load=loads, columns=B)
    assert found.status == "converged"
    assert laws(C, np.zeros(18), mu, found, B, loads) < 1e-9
    assert found.self_locking == (part > 1.0)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("friction", [0.1, 0.6])
@pytest.mark.parametrize("angle", [30.0, 45.0])
def test_wedge_that_slides_far(angle: float, friction: float, way: float) -> None:
    """The right face moves off by a hundred thousand times what the bodies deform: both faces slide
    the same way, and friction opposes it.
    """
    C, B = faces(angle)
    found = coupled_contact(C, np.zeros(18), friction, load=[10.0, 0.0, 0.0], columns=B)
    moved = way * np.where(np.arange(36) % 18 < 9, 0.0, B[:, 1])
    found = found.go_on(load=[10.0, 0.0, 0.0], offset=[moved, 0.0 * moved])
    assert found.status == "converged"
    for k, sign in enumerate((way, -way)):
        # the wedge follows the parting faces up, and is pressed down where they close
        N = face_forces(angle, angle, 10.0, sign * friction).normal_left
        assert found.force[k, :9, 0].sum() == pytest.approx(N, rel=1e-7)
        assert found.force[k, 9:, 0].sum() == pytest.approx(N, rel=1e-7)


def wedge(
    angle: float, shape: tuple[int, int], out: float, soft: float
) -> tuple[np.ndarray, np.ndarray]:
    """Two faces of a rigid wedge with all six motions, `out` mm off its middle, on elastic halves
    whose supports give way `soft` times as much.
    """
    nx, ny = shape
    m, a, own = nx * ny, np.radians(angle), lattice(nx, ny)
    u = 0.1 * (np.arange(m) % nx - (nx - 1) / 2)
    v = 0.1 * (np.arange(m) // nx - (ny - 1) / 2)
    B, C = np.zeros((3, 2, m, 6)), np.zeros((3, 2, m, 3, 2, m))
    for k, side in enumerate((-1.0, 1.0)):
        normal = np.array([side * np.sin(a), 0.0, np.cos(a)])
        along, up = np.array([0.0, 1.0, 0.0]), np.array([-side * np.cos(a), 0.0, np.sin(a)])
        at = np.array([side * out, 0.0, 0.0]) + np.outer(v, along) + np.outer(u, up)
        for j, axis in enumerate(np.eye(3)):
            for c, way in enumerate((normal, along, up)):
                B[c, k, :, j], B[c, k, :, 3 + j] = axis @ way, np.cross(axis, at) @ way
        C[:, k, :, :, k] = own.reshape(3, m, 3, m)
    C = C.reshape(6 * m, 6 * m)
    for k in range(2):
        held = np.zeros_like(B)
        held[:, k] = B[:, k]
        R = held.reshape(6 * m, 6) * np.array([1.0, 1.0, 1.0, 0.05, 0.05, 0.05])
        C = C + soft * np.abs(own).max() * R @ R.T
    return C, B.reshape(6 * m, 6)


@pytest.mark.parametrize(
    ("angle", "friction", "shape", "out", "soft", "way"),
    [
        (30.0, 0.6, (3, 3), 3.0, 30.0, [0.7, 0.0, 0.0]),
        (45.0, 0.6, (5, 2), 1.0, 300.0, [1.6e-3, 0.0, 0.0]),
        (60.0, 0.6, (4, 3), 3.0, 30.0, [1.1e-3, 0.0, -4e-4]),
        (30.0, 0.9, (4, 2), 0.3, 1.0, [4e-3, 0.0, -6e-3]),
        (30.0, 0.6, (4, 2), 1.0, 0.0, [-4e-3, 0.0, 8e-3]),
    ],
)
def test_wedge_on_soft_blades_that_slides_far(
    angle: float, friction: float, shape: tuple[int, int], out: float, soft: float, way: list[float]
) -> None:
    """The damper tips onto few nodes as it slides: Newton with all of the friction opens too many
    at once, and friction has to rise.
    """
    C, B = wedge(angle, shape, out, soft)
    n = len(C) // 3
    load = 3 * [[0.0, 0.0, 10.0, 0.0, 0.0, 0.0]]
    moved = np.where(np.arange(3 * n) % n < n // 2, 0.0, B[:, :3] @ np.array(way))
    offset = [0.0 * moved, moved, 0.0 * moved]
    found = coupled_contact(C, np.zeros(n), friction, load=load, columns=B, offset=offset)
    assert found.status == "converged"
    assert laws(C, np.zeros(n), friction, found, B, load, offset) < 1e-9


def test_withdrawn_wedge_that_jams() -> None:
    """Beyond the limit it stays between the faces without load, and forces remain."""
    C, B = faces(60.0)
    mu = 1.5 * np.tan(np.radians(30.0))
    found = coupled_contact(C, np.zeros(18), mu, load=[[200.0, 0, 0], [0.0, 0, 0]], columns=B)
    assert found.status == "converged"
    assert found.force[1, :, 0].sum() > 1.0
    assert np.abs(found.load[1]).max() < 1e-9 * found.force.max()
    loose = faces(60.0)
    with pytest.raises(ConvergenceError, match="cannot be carried"):
        coupled_contact(loose[0], np.zeros(18), 0.1, load=[[200.0, 0, 0], [-5.0, 0, 0]], columns=B)


def test_wrong_starts_find_the_same_answer() -> None:
    C = lattice()
    n = len(C) // 3
    h = 1e-3 * np.linspace(-1.0, 1.0, n) ** 2
    right = coupled_contact(C, h, 0.4, load=[60.0, 10.0, 5.0])
    rng = np.random.default_rng(1)
    for scale in (1.0, 1e6, 1e-9):
        noise = CoupledHistory(
            scale * rng.standard_normal((n, 3)),
            np.zeros((n, 2)),
            1e-3 * rng.standard_normal(n),
            np.zeros(3),
            1e-3 * scale * rng.standard_normal((n, 2)),
            np.zeros(3),
        )
        found = coupled_contact(C, h, 0.4, load=[60.0, 10.0, 5.0], history=noise)
        np.testing.assert_allclose(found.force, right.force, atol=1e-9 * right.force.max())


def test_fallback_alone_finds_the_answer() -> None:
    """Newton forbidden to start from anything but what the cone iteration gives it."""
    C, B = faces(45.0)
    mu = np.full(18, 0.5)
    solver = Coulomb(C, B, mu)
    for load in ([100.0, 5.0, 0.0], [100.0, -20.0, 10.0]):
        step = {"load": np.array(load), "motion": None}
        newton = solver.solve(np.zeros(36), load=np.array(load))

        alone = solver.fall_back(AskedStep(np.zeros(36), **step))
        assert alone.converged
        np.testing.assert_allclose(alone.at.f, newton.at.f, atol=1e-8 * newton.at.f.max())


def test_spoiled_answer_is_no_answer() -> None:
    """A force, a state, a slip: the misfit sees each."""
    C, B = faces(45.0)
    solver = Coulomb(C, B, np.full(18, 0.5))

    step = AskedStep(np.zeros(36), np.array([100.0, 20.0, 0.0]), None)
    found = solver.solve(step.b, load=step.load)
    assert solver.judged(step, found.at, 1).converged
    f, s = found.at.f, found.at.s
    for spoiled in (
        Iterate(f * (1.0 + 1e-6), s, found.at.y),
        Iterate(f + 1e-6 * f.max() * np.eye(36)[20], s, found.at.y),
        Iterate(f, s * (1.0 + 1e-6), found.at.y),
        Iterate(np.where(np.arange(36) == 3, -f, f), s, found.at.y),
    ):
        assert not solver.judged(step, spoiled, 1).converged


@pytest.mark.parametrize("shape", [(2, 1), (4, 4), (6, 5)])
@pytest.mark.parametrize("before", [False, True])
@pytest.mark.parametrize("curved", [False, True])
def test_what_cannot_be_carried_is_never_converged(
    shape: tuple[int, int], before: bool, curved: bool
) -> None:
    """Lift-off and gross slip of coupled compliances, also after a load that is carried."""
    C = lattice(*shape)
    n = len(C) // 3
    h = 1e-3 * np.linspace(-1.0, 1.0, n) ** 2 * curved
    for load in ([-5.0, 0.0, 0.0], [60.0, 25.0, 0.0], [0.0, 5.0, 0.0], [-1.0, 1.0, 0.0]):
        path = [[60.0, 0.0, 0.0], load] if before else [load]
        with pytest.raises(ConvergenceError, match="cannot be carried"):
            coupled_contact(C, h, 0.4, load=path)


@pytest.mark.parametrize("seed", [5, 10, 13])
@pytest.mark.parametrize("below", [1e-6, 1e-9])
def test_just_below_what_friction_holds(seed: int, below: float) -> None:
    """Slips of thousands of times the elastic shift leave Newton's systems regular, but for the
    size of a column.
    """
    rng = np.random.default_rng(seed)
    C = half_space_compliance(*rng.integers(4, 9, 2), 0.1, 0.15, 2e5, 0.3, "all")
    n, mu, angle = len(C) // 3, rng.uniform(0.1, 0.8), rng.uniform(0.0, 6.0)
    h = 1e-3 * np.linspace(-1.0, 1.0, n) ** 2
    T = (1.0 - below) * 60.0 * mu
    loads = [[60.0, 0.0, 0.0], [60.0, T * np.cos(angle), T * np.sin(angle)]]
    found = coupled_contact(C, h, mu, load=loads)
    assert laws(C, h, mu, found, asked=loads) < 1e-9


@pytest.mark.parametrize("curved", [False, True])
def test_unloaded_and_loaded_again(curved: bool) -> None:
    """Nothing is left of a contact without load, and the next load is carried again."""
    C = lattice()
    n = len(C) // 3
    h = 1e-3 * np.linspace(-1.0, 1.0, n) ** 2 * curved
    loads = [[60.0, 15.0, 5.0], [0.0, 0.0, 0.0], [60.0, 15.0, 5.0]]
    found = coupled_contact(C, h, 0.4, load=loads)
    assert found.status == "converged"
    assert np.abs(found.force[1]).max() < 1e-9
    assert (found.gap[1] >= -1e-12).all()
    assert laws(C, h, 0.4, found, asked=loads) < 1e-9


def test_histories_of_others_are_refused() -> None:
    C = lattice(2, 1)
    found = coupled_contact(C, [0.0, 0.0], 0.4, load=[1.0, 0.0, 0.0])
    wrong: list[tuple[Any, str]] = [
        (found, "history is a CoupledContact"),
        (replace(found.history, slip=np.zeros((3, 2))), "slip has shape"),
        (replace(found.history, gap=np.array([np.nan, 0.0])), "gap holds 1 values that are NaN"),
    ]
    for history, says in wrong:
        with pytest.raises(InputError, match=says):
            coupled_contact(C, [0.0, 0.0], 0.4, load=[1.0, 0.0, 0.0], history=history)


@pytest.mark.parametrize("mu", [0.0, 0.1])
@pytest.mark.parametrize("seed", [1, 5, 9, 16, 23, 35])
def test_body_held_by_fewer_nodes_than_motions(seed: int, mu: float) -> None:
    """Loads that a few frictionless nodes carry, at which Newton's systems are singular."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 12))
    Q = np.linalg.qr(rng.standard_normal((2 * n, 2 * n)))[0]
    C = 1e-6 * Q @ np.diag(np.logspace(0.0, -rng.uniform(0.5, 4.0), 2 * n)) @ Q.T
    C = 0.5 * (C + C.T)
    r = int(rng.integers(2, 5))
    B = rng.standard_normal((2 * n, r))
    B[:n, 0] = np.abs(B[:n, 0]) + 0.2
    h = 1e-5 * rng.random(n) * (rng.random() < 0.6)
    f = np.zeros((3, 2 * n))
    f[:, :n] = 10.0 * rng.random((3, n)) * (rng.random((3, n)) < 0.7)
    loads = f @ B
    found = coupled_contact(C, h, mu, load=loads, columns=B)
    assert found.status == "converged"
    assert laws(C, h, mu, found, B, loads) < 1e-9


@pytest.mark.parametrize("components", [2, 3])
def test_frictionless_contact_always_ends(components: int) -> None:
    """A load that pressures can balance has one answer, whatever the bodies; Newton alone loses
    more than a third of these.
    """
    for seed in range(75):
        r = np.random.default_rng(seed)
        n = int(r.integers(2, 9))
        m = components * n
        A = r.standard_normal((m, m + 2))
        B = r.standard_normal((m, int(r.integers(1, min(m, 4) + 1))))
        f = np.zeros(m)
        f[:n] = np.abs(r.standard_normal(n)) * (r.random(n) < 0.6)
        f[0] += not f.any()
        gap = np.abs(r.standard_normal(n)) * (r.random(n) < 0.5)
        found = coupled_contact(A @ A.T / m, gap, 0.0, load=B.T @ f, columns=B)
        assert found.residual[-1] < 1e-9
        w = B @ found.displacement[-1] - A @ (A.T @ found.force[-1].T.ravel()) / m
        size = np.abs(w).max() + gap.max()
        assert (gap - w[:n]).min() > -1e-9 * size
        assert np.abs(found.force[-1, :, 0] * (gap - w[:n])).max() < 1e-9 * size * f.max()
