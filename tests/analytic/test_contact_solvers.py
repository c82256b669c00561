"""Contact solvers against closed forms.

One and two nodes by hand, Hertz, Cattaneo-Mindlin, and every tangent against differences.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.contact import normal_contact, normal_curve, tangential_contact, tangential_path
from upd.reference.half_space import half_space_compliance
from upd.reference.hertz import contact_modulus, hertz_pressure, hertz_sphere, sphere_gap
from upd.reference.mindlin import (
    cycle_energy,
    displacement,
    initial_tangential_stiffness,
    loop,
    stick_radius,
    tangential_compliance_modulus,
)

FloatArray = NDArray[np.float64]

E, NU, R, N, MU = 200e3, 0.3, 5.0, 200.0, 0.5
E_STAR = contact_modulus(E, NU, E, NU)
C_T = tangential_compliance_modulus(E, NU, E, NU)
HERTZ = hertz_sphere(N, R, E_STAR)
A = float(HERTZ.radius)
# Cells per contact radius; not whole numbers, so that no node lies on the contact edge by design.
CELLS = (4.3, 8.3, 16.3)


@dataclass(frozen=True)
class Lattice:
    """A square patch of square cells, 10 % wider than the contact, on two half-spaces of the same
    steel.
    """

    h: float
    n: int
    r: FloatArray

    def compliance(self, component: str) -> FloatArray:
        return 2 * half_space_compliance(self.n, self.n, self.h, self.h, E, NU, component)  # type: ignore[arg-type]


def lattice(cells: float) -> Lattice:
    h = A / cells
    n = 2 * int(np.ceil(1.1 * cells)) + 1
    x = (np.arange(n) - (n - 1) / 2) * h
    X, Y = np.meshgrid(x, x)
    return Lattice(h, n, np.hypot(X, Y).ravel())


def rate(errors: list[float]) -> float:
    """Exponent p of error ~ h^p, fitted over the lattices."""
    return float(-np.polyfit(np.log(CELLS), np.log(np.abs(errors)), 1)[0])


@pytest.fixture(scope="module")
def pressed():  # type: ignore[no-untyped-def]
    return [
        (grid, normal_contact(grid.compliance("normal"), sphere_gap(grid.r, R), load=N))
        for grid in map(lattice, CELLS)
    ]


def test_one_node_is_a_spring() -> None:
    answer = normal_contact([[2e-5]], [0.01], load=100.0)
    assert answer.approach == pytest.approx(0.01 + 2e-3, rel=1e-14)
    assert answer.force[0] == 100.0
    assert answer.stiffness == pytest.approx(5e4, rel=1e-14)
    assert normal_contact([[2e-5]], [0.01], approach=0.012).force[0] == pytest.approx(
        100.0, rel=1e-12
    )


def test_two_nodes_by_hand() -> None:
    # C = [[2, 1], [1, 2]]: alone, node 0 lifts node 1 by 1 per unit force, and closes the gap of 1
    # when d - f = 1 with d = 2 f: f = 1.
    C, h = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([0.0, 1.0])
    low, edge, high = (normal_contact(C, h, load=load) for load in (0.5, 1.0, 3.0))
    assert (
        low.contact.tolist() == [True, False]
        and low.gap == pytest.approx([0, 0.5])
        and low.stiffness == pytest.approx(0.5)
    )
    assert (
        edge.force == pytest.approx([1, 0])
        and edge.gap == pytest.approx([0, 0])
        and edge.approach == pytest.approx(2)
    )
    # Both: f1 - f2 = 1, d = 2 f1 + f2, tangent e'C^-1 e = 2/3.
    assert (
        high.force == pytest.approx([2, 1])
        and high.approach == pytest.approx(5)
        and high.stiffness == pytest.approx(2 / 3)
    )


def test_two_nodes_with_friction_by_hand() -> None:
    # Uncoupled springs of compliance 1, limits 1 and 3: node 0 slips at d = 1, then dT/dd falls
    # from 2 to 1.
    C, s = np.eye(2), np.array([1.0, 3.0])
    path = tangential_path(C, s, displacements=[0.5, 1.5, 2.5, 1.5, 0.5, -0.5])
    assert path.load == pytest.approx([1, 2.5, 3.5, 1.5, -0.5, -1.5])
    assert path.stiffness == pytest.approx([2, 1, 1, 2, 1, 1])
    assert path.slip[:, 0] == pytest.approx([0, 0.5, 1.5, 1.5, 1.5, 0.5])
    assert path.slip_work == pytest.approx([0, 0.5, 1, 0, 0, 1])


def test_a_disk_node_slips_along_its_traction() -> None:
    # One node of compliance 1: pulled to (3, 4) with limit 1 it slips along (0.6, 0.8) by 5 - 1.
    answer = tangential_contact(np.eye(2), [1.0], displacement=[3.0, 4.0])
    assert answer.force == pytest.approx([0.6, 0.8], rel=1e-14)
    assert answer.slip == pytest.approx([2.4, 3.2], rel=1e-14)
    assert answer.slip_work == pytest.approx(4.0, rel=1e-14)
    # The traction only turns: dt = (s / |d|) across the pull, nothing along it.
    n = np.array([0.6, 0.8])
    assert answer.stiffness == pytest.approx((np.eye(2) - np.outer(n, n)) / 5)


def test_hertz_converges(pressed) -> None:  # type: ignore[no-untyped-def]
    approach = [answer.approach / HERTZ.approach - 1 for _, answer in pressed]
    radius = [np.sqrt(2.5 * (answer.force @ grid.r**2) / N) / A - 1 for grid, answer in pressed]
    pressure = [
        np.abs(answer.force - hertz_pressure(grid.r, A, HERTZ.max_pressure) * grid.h**2).sum() / N
        for grid, answer in pressed
    ]
    # The pressure falls to zero like a square root at the edge: in the mean the error goes like
    # h^1.5, at single nodes like h^0.5.
    assert rate(pressure) > 1.2 and pressure[-1] < 5e-3
    assert rate(approach) > 1.5 and abs(approach[-1]) < 3e-4
    assert rate(radius) > 0.8 and abs(radius[-1]) < 1e-3
    for grid, answer in pressed:
        # The edge runs between two nodes: half a cell either way.
        assert np.sqrt(answer.contact.sum() / np.pi) * grid.h == pytest.approx(A, abs=grid.h / 2)
        assert answer.force.max() / grid.h**2 == pytest.approx(HERTZ.max_pressure, rel=4e-3)
        assert answer.stiffness == pytest.approx(2 * A * E_STAR, rel=6e-3)
        assert answer.iterations <= 8 and answer.method == "active set"


def test_cattaneo_mindlin_converges(pressed) -> None:  # type: ignore[no-untyped-def]
    q = 0.8
    T = (
        q
        * MU
        * N
        * np.concatenate(
            (np.linspace(0, 1, 21), np.linspace(1, -1, 41)[1:], np.linspace(-1, 1, 41)[1:])
        )
    )
    exact, energy = loop(T, MU, N, A, C_T), float(cycle_energy(q, MU, N, A, C_T))
    loops, works = [], []
    for grid, answer in pressed:
        c = answer.contact
        path = tangential_path(
            grid.compliance("tangential")[np.ix_(c, c)], MU * answer.force[c], loads=T
        )
        loops.append(np.abs(path.displacement - exact).max() / exact.max())
        works.append(path.slip_work[21:].sum() / energy - 1)
        assert path.loop_area(20) == pytest.approx(path.slip_work[21:].sum(), rel=2e-3)
        stick = np.sqrt(np.sum(path.state[20] == 0) / np.pi) * grid.h
        assert stick == pytest.approx(float(stick_radius(q * MU * N, MU, N, A)), abs=grid.h / 2)
        assert path.stiffness[0] == pytest.approx(
            float(initial_tangential_stiffness(A, C_T)), rel=6e-3
        )
    assert rate(loops) > 1.5 and loops[-1] < 1e-3
    assert rate(works) > 1.5 and abs(works[-1]) < 5e-3


def test_loop_area_is_the_slip_work_as_steps_shrink(pressed) -> None:  # type: ignore[no-untyped-def]
    grid, answer = pressed[0]
    c = answer.contact
    C = grid.compliance("tangential")[np.ix_(c, c)]
    gaps = []
    for steps in (20, 40, 80):
        T = (
            0.8
            * MU
            * N
            * np.concatenate(
                (np.linspace(0, 1, steps + 1), np.cos(np.pi * np.arange(1, 2 * steps + 1) / steps))
            )
        )
        path = tangential_path(C, MU * answer.force[c], loads=T)
        gaps.append(abs(path.loop_area(steps) / path.slip_work[steps + 1 :].sum() - 1))
    # Only the steps in which a node begins to slip differ, each by the square of the step.
    assert gaps[2] < gaps[0] / 4 and gaps[2] < 1e-3


def test_two_directions_at_first_loading_follow_mindlin(pressed) -> None:  # type: ignore[no-untyped-def]
    grid, answer = pressed[1]
    c = np.concatenate((answer.contact, answer.contact))
    C = grid.compliance("both")[np.ix_(c, c)]
    for q in (0.3, 0.6, 0.9):
        step = tangential_contact(C, MU * answer.force[answer.contact], load=[q * MU * N, 0.0])
        d = np.asarray(step.displacement)
        # Mindlin neglects the traction across the load: of second order in nu / (4 - 2 nu), below
        # half a per cent here.
        assert d[0] == pytest.approx(float(displacement(q * MU * N, MU, N, A, C_T)), rel=5e-3)
        assert abs(d[1]) < 1e-12 * d[0]


def test_uncoupled_directions_equal_one_direction() -> None:
    rng = np.random.default_rng(3)
    B = rng.normal(size=(6, 6))
    C, s, o = B @ B.T + 6 * np.eye(6), rng.uniform(0.2, 1, 6), np.zeros((6, 6))
    T = 0.9 * s.sum() * np.array([0.5, 1.0, 0.2, -0.7, -1.0, 0.4])
    one = tangential_path(C, s, loads=T)
    two = tangential_path(np.block([[C, o], [o, C]]), s, loads=np.column_stack((T, 0 * T)))
    assert two.force[:, :6] == pytest.approx(one.force, abs=1e-12)
    assert two.displacement[:, 0] == pytest.approx(one.displacement, rel=1e-11)
    assert two.slip_work == pytest.approx(one.slip_work, abs=1e-11)


def test_zero_limit_nodes_slip_freely() -> None:
    rng = np.random.default_rng(4)
    B = rng.normal(size=(5, 5))
    C, s = B @ B.T + 5 * np.eye(5), np.array([1.0, 0.0, 2.0, 0.0, 1.5])
    answer = tangential_contact(C, s, load=3.0)
    keep = s > 0
    inner = tangential_contact(C[np.ix_(keep, keep)], s[keep], load=3.0)
    assert (
        answer.force[keep] == pytest.approx(inner.force, rel=1e-12)
        and not answer.force[~keep].any()
    )
    assert answer.slip[~keep] == pytest.approx(
        (answer.displacement - C @ answer.force)[~keep], rel=1e-12
    )
    assert not answer.stick[~keep].any() and not answer.slipping[~keep].any()


def test_normal_tangent_is_the_slope_of_the_curve() -> None:
    grid = lattice(4.3)
    C, h = grid.compliance("normal"), sphere_gap(grid.r, R)
    for load in (5.0, 50.0, 200.0):
        at = normal_contact(C, h, load=load)
        step = 1e-6 * at.approach
        low, high = (normal_contact(C, h, approach=at.approach + sign * step) for sign in (-1, 1))
        assert np.array_equal(low.contact, high.contact)
        # With the set held the law is linear: what is left is rounding, n eps / 1e-6.
        assert (high.load - low.load) / (2 * step) == pytest.approx(at.stiffness, rel=1e-7)


@pytest.mark.parametrize("loads", [[0.2], [0.7], [0.7, 0.5], [0.7, -0.3], [0.7, -0.7]])
def test_tangential_tangent_in_one_direction(loads: list[float]) -> None:
    """Full stick, partial slip, stick after reversal, counter-slip, full reversal."""
    rng = np.random.default_rng(5)
    B = rng.normal(size=(8, 8))
    C, s = B @ B.T + 8 * np.eye(8), rng.uniform(0.2, 1, 8)
    path = tangential_path(C, s, loads=np.array(loads) * s.sum())
    start = (
        tangential_path(C, s, loads=np.array(loads[:-1]) * s.sum()).history
        if len(loads) > 1
        else None
    )
    d, step = path.displacement[-1], 1e-7 * abs(path.displacement).max()
    low, high = (
        tangential_contact(C, s, displacement=d + sign * step, history=start) for sign in (-1, 1)
    )
    assert np.array_equal(low.stick, high.stick)
    assert (float(high.load) - float(low.load)) / (2 * step) == pytest.approx(
        path.stiffness[-1], rel=1e-6
    )


@pytest.mark.parametrize("size", [0.05, 1.0, 3.0, 30.0])
@pytest.mark.parametrize("turned", [False, True])
def test_tangential_tangent_in_two_directions(size: float, turned: bool) -> None:
    """Full stick, mostly stick, mostly slip, all slip.

    At first loading and after a load in another direction.
    """
    rng = np.random.default_rng(6)
    B = rng.normal(size=(10, 10))
    C, s = B @ B.T / 10 + np.eye(10), rng.uniform(0.2, 1, 5)
    start = tangential_contact(C, s, displacement=[0.5, -0.8]).history if turned else None
    d = size * np.array([0.8, 0.6])
    at = tangential_contact(C, s, displacement=d, history=start)
    K = np.empty((2, 2))
    step = 1e-6 * max(size, 1.0)
    for j in (0, 1):
        low, high = (
            tangential_contact(C, s, displacement=d + sign * step * np.eye(2)[j], history=start)
            for sign in (-1, 1)
        )
        assert np.array_equal(low.stick, at.stick) and np.array_equal(high.stick, at.stick)
        K[:, j] = (np.asarray(high.load) - np.asarray(low.load)) / (2 * step)
    scale = np.abs(np.linalg.solve(C, np.ones(10))).sum()
    # Central differences: step squared against the curvature, plus rounding over the step.
    assert np.asarray(at.stiffness) == pytest.approx(K, abs=1e-8 * scale)


def test_curve_equals_single_loads() -> None:
    grid = lattice(4.3)
    C, h = grid.compliance("normal"), sphere_gap(grid.r, R)
    loads = np.array([0.0, 1.0, 80.0, 200.0, 20.0])
    for load, answer in zip(loads, normal_curve(C, h, loads), strict=True):
        alone = normal_contact(C, h, load=float(load))
        assert np.array_equal(answer.contact, alone.contact)
        assert answer.force == pytest.approx(alone.force, rel=1e-10, abs=1e-12)
        assert answer.load == pytest.approx(load, rel=1e-13)
