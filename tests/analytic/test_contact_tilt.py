"""Contact with free tilt against statics by hand, the plate on springs, the glued answer, and its
own optimality conditions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.contact import normal_contact, qp
from upd.contact.tilt import TiltedContact, tilted_contact
from upd.errors import InputError
from upd.reference.half_space import half_space_compliance

FloatArray = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
E, NU, F = 200e3, 0.3, 300.0


def lattice(nx: int, ny: int, h: float = 0.5) -> tuple[FloatArray, FloatArray]:
    """Compliance of two half-spaces on nx by ny nodes, and the nodes' places (n, 2) about their
    centre.
    """
    place = np.arange(nx * ny)
    X = np.column_stack([place % nx, place // nx]) * h
    return 2 * half_space_compliance(nx, ny, h, h, E, NU), X - X.mean(axis=0)


def assert_solved(
    answer: TiltedContact,
    C: FloatArray,
    h: FloatArray,
    arms: FloatArray,
    load: float,
    moment: FloatArray | float = 0.0,
) -> None:
    """f >= 0, g >= 0, f.g = 0, e'f = F, T'f = M, to rounding of the products they are sums of."""
    f = answer.normal.force
    g = h + C @ f - answer.normal.approach - arms @ answer.tilt
    size = (
        np.abs(h).max()
        + np.abs(C).max() * load
        + abs(answer.normal.approach)
        + np.abs(arms).max() * np.abs(answer.tilt).max()
    )
    # The tilt is known as well as the moment is balanced: a thousand times rounding.
    noise = 1e3 * len(h) * EPS
    assert (f >= 0).all()
    assert g.min() >= -noise * size
    assert np.abs(g[f > 0]).max() <= noise * size
    assert np.allclose(answer.normal.gap, np.maximum(g, 0.0), rtol=0, atol=noise * size)
    assert f.sum() == pytest.approx(load, rel=noise)
    assert np.abs(arms.T @ f - moment).max() <= noise * (
        np.abs(arms).max() * load + np.abs(moment).max()
    )
    assert np.array_equal(answer.moment, arms.T @ f - moment)


# -- statics by hand -------------------------------------------------------------------------------


def test_three_nodes_carry_what_statics_says() -> None:
    """Barycentric forces, and the plane through the three deformed surfaces."""
    C = np.diag([1e-6, 2e-6, 4e-6]) + 5e-7
    h = np.array([0.0, 2e-6, 1e-6])
    arms = np.array([[-1.0, -1.0], [2.0, -1.0], [-1.0, 3.0]])
    answer = tilted_contact(C, h, arms, load=12.0)
    f = np.linalg.solve(np.vstack([np.ones(3), arms.T]), [12.0, 0.0, 0.0])
    plane = np.linalg.solve(np.column_stack([np.ones(3), arms]), h + C @ f)
    assert np.allclose(answer.normal.force, f, rtol=1e-13)
    assert np.allclose([answer.normal.approach, *answer.tilt], plane, rtol=1e-12)
    assert answer.status == "converged"


def test_two_nodes_share_by_the_lever_rule() -> None:
    """Two nodes so much higher than all others that nothing else touches.

    The load stands between them.
    """
    C, X = lattice(5, 5)
    h = np.full(25, 1.0)
    a, b = 6, 18
    h[[a, b]] = 0.0
    point = 0.3 * X[a] + 0.7 * X[b]
    answer = tilted_contact(C, h, X - point, load=F)
    assert np.allclose(answer.normal.force[[a, b]], [0.3 * F, 0.7 * F], rtol=1e-12)
    assert answer.normal.contact.sum() == 2 and answer.status == "tilt not unique"
    assert_solved(answer, C, h, X - point, F)
    # Nothing resists a tilt about the line of the two.
    assert np.linalg.matrix_rank(answer.stiffness, tol=1e-9 * np.linalg.norm(answer.stiffness)) == 2


def test_one_node_under_the_load() -> None:
    C, X = lattice(5, 5)
    h = np.full(25, 1.0)
    h[12] = 0.0
    answer = tilted_contact(C, h, X, load=F)
    assert answer.normal.force[12] == pytest.approx(F, rel=1e-13)
    assert answer.normal.contact.sum() == 1
    assert answer.normal.approach == pytest.approx(C[12, 12] * F, rel=1e-14)
    assert answer.status == "tilt not unique" and "one line" in answer.message
    assert answer.free_stiffness == pytest.approx(1 / C[12, 12], rel=1e-12)


def test_load_over_a_corner() -> None:
    """The corner carries all.

    The least tilt that opens the others lets two of them just touch or is zero.
    """
    C, X = lattice(6, 4)
    corner = 23
    answer = tilted_contact(C, np.zeros(24), X - X[corner], load=F)
    assert (
        np.array_equal(answer.normal.contact, np.arange(24) == corner)
        and answer.normal.force[corner] == F
    )
    assert_solved(answer, C, np.zeros(24), X - X[corner], F)
    others = np.delete(answer.normal.gap, corner)
    # A smaller tilt in the same direction closes a gap, and the nodes that touch span the tilt:
    # least distance.
    scale = C[corner, corner] * F
    touching = np.flatnonzero(others <= 1e-9 * scale)
    assert 1 <= touching.size <= 2
    assert (
        C[:, corner] * F - C[corner, corner] * F - (X - X[corner]) @ (0.999 * answer.tilt)
    ).min() < -1e-6 * scale


def test_load_over_an_edge() -> None:
    """Only the edge carries, as a row of nodes with a tilt along it.

    Across it the next node just touches.
    """
    C, X = lattice(6, 4)
    edge = np.flatnonzero(X[:, 1] == X[:, 1].max())
    point = np.array([0.2, X[:, 1].max()])
    answer = tilted_contact(C, np.zeros(24), X - point, load=F)
    assert_solved(answer, C, np.zeros(24), X - point, F)
    assert set(np.flatnonzero(answer.normal.contact)) <= set(edge.tolist())
    assert answer.status == "tilt not unique" and answer.tilt[1] > 0.0
    A = C[np.ix_(edge, edge)]
    b = np.column_stack([np.ones(6), X[edge, 0] - point[0]])
    glued = np.linalg.solve(
        np.block([[A, -b], [b.T, np.zeros((2, 2))]]), np.r_[np.zeros(6), F, 0.0]
    )
    assert (glued[:6] > 0).all()
    assert np.allclose(answer.normal.force[edge], glued[:6], rtol=1e-10)
    assert answer.tilt[0] == pytest.approx(glued[7], rel=1e-10)
    inner = np.delete(answer.normal.gap, edge)
    assert inner.min() <= 1e-12 * answer.normal.approach < inner.max()
    # The same as the limit of loads just inside the edge.
    near = tilted_contact(C, np.zeros(24), X - point * [1.0, 1.0 - 1e-9], load=F)
    assert np.allclose(near.normal.force, answer.normal.force, atol=1e-6 * F)
    assert near.tilt == pytest.approx(answer.tilt, rel=1e-6) and near.status == "converged"


# -- plate on springs ------------------------------------------------------------------------------


def springs(n: int, length: float, k: float) -> tuple[FloatArray, FloatArray]:
    """Two rows of n springs along x, k N/mm in all: compliance and places."""
    x = (np.arange(n) + 0.5) / n * length - length / 2
    X = np.column_stack([np.tile(x, 2), np.repeat([-1.0, 1.0], n)])
    return np.eye(2 * n) * 2 * n / k, X


@pytest.mark.parametrize("eccentricity", [0.1, 0.2, 0.3, 0.4])
def test_plate_on_springs_lifts_off_beyond_the_core(eccentricity: float) -> None:
    """Kern of a rectangle: up to L/6 all of it presses, p = F/A (1 + 12 e x / L^2).

    Beyond, 3 (L/2 - e) of it, and p_max is double F/c.

    Midpoint springs are second order away from the edge of contact and first order at it: errors
    O(1/n).
    """
    length, k, n = 10.0, 1e6, 400
    C, X = springs(n, length, k)
    e = eccentricity * length
    answer = tilted_contact(C, np.zeros(2 * n), X - [e, 0.0], load=F)
    slope, edge = answer.tilt[0], answer.normal.approach + answer.tilt[0] * (length / 2 - e)
    contact = min(length, 3 * (length / 2 - e))
    exact = 12 * e * F / (k * length**2) if contact == length else 2 * F / k * length / contact**2
    at_edge = F / k * (1 + 6 * e / length) if contact == length else 2 * F / k * length / contact
    assert slope == pytest.approx(exact, rel=3 / n)
    assert edge == pytest.approx(at_edge, rel=3 / n)
    assert answer.normal.contact.sum() / (2 * n) * length == pytest.approx(
        contact, abs=2 * length / n
    )
    assert abs(answer.tilt[1]) <= 1e-12 * slope


# -- against the glued answer, the inner solver and the second method ------------------------------


def test_nothing_opens_is_the_glued_answer() -> None:
    """Small eccentricity: one linear solve with three multipliers, to rounding times the condition
    of the compliance.
    """
    C, X = lattice(9, 7)
    arms = X - [0.1, -0.05]
    answer = tilted_contact(C, np.zeros(63), arms, load=F)
    B = np.column_stack([np.ones(63), arms])
    exact = np.linalg.solve(
        np.block([[C, -B], [B.T, np.zeros((3, 3))]]), np.r_[np.zeros(63), F, 0.0, 0.0]
    )
    assert answer.normal.contact.all() and answer.normal.iterations == 1
    noise = np.linalg.cond(C) * 63 * EPS
    assert np.allclose(answer.normal.force, exact[:63], rtol=noise)
    assert np.allclose([answer.normal.approach, *answer.tilt], exact[63:], rtol=noise)
    assert np.allclose(
        answer.stiffness,
        B.T @ np.linalg.solve(C, B),
        rtol=0,
        atol=noise * np.abs(answer.stiffness).max(),
    )


def test_at_the_tilt_found_it_is_plain_contact() -> None:
    C, X = lattice(13, 9)
    h = np.random.default_rng(3).random(117) * 2e-4
    answer = tilted_contact(C, h, X - [1.5, 0.5], load=F)
    plain = normal_contact(C, h - (X - [1.5, 0.5]) @ answer.tilt, load=F)
    assert np.allclose(plain.force, answer.normal.force, rtol=0, atol=1e-11 * F)
    assert np.array_equal(plain.contact, answer.normal.contact)
    assert plain.approach == pytest.approx(answer.normal.approach, rel=1e-12)
    assert plain.stiffness == pytest.approx(answer.normal.stiffness, rel=1e-12)


def random_problem(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Random compliance, gaps and arms; the load inside the hull, now and then just inside."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 30))
    A = rng.standard_normal((n, n))
    C = A @ A.T + 10.0 ** rng.uniform(-2, 1) * np.eye(n)
    X = rng.standard_normal((n, 2))
    share = rng.dirichlet(np.full(n, 10.0 ** rng.uniform(-2, 0)))
    return C, rng.uniform(0, 10.0 ** rng.uniform(-1, 3), n), X - share @ X


@pytest.mark.parametrize("seed", range(60))
def test_both_methods_meet_the_conditions_and_agree(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer of the active set and that of the least distance problem.

    Forces are unique even when the tilt is not.
    """
    C, h, arms = random_problem(seed)
    newton = tilted_contact(C, h, arms, load=F)
    monkeypatch.setattr(qp, "ACTIVE_SET_STEPS", 0)
    other = tilted_contact(C, h, arms, load=F)
    assert_solved(newton, C, h, arms, F)
    assert newton.normal.iterations <= 15
    assert np.allclose(newton.normal.force, other.normal.force, rtol=0, atol=1e-8 * F)
    if newton.status == "converged":
        assert np.allclose(
            newton.tilt, other.tilt, rtol=1e-6, atol=1e-8 * np.abs(C).max() * F / np.abs(arms).max()
        )


def test_the_second_method_is_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(qp, "ACTIVE_SET_STEPS", 0)
    C, X = lattice(13, 9)
    answer = tilted_contact(C, np.zeros(117), X - [2.0, 1.0], load=F)
    assert answer.normal.method == "fallback" and answer.status == "converged"
    assert_solved(answer, C, np.zeros(117), X - [2.0, 1.0], F)


@pytest.mark.parametrize("point", [(0.3, 0.1), (2.0, 1.2), (2.8, -1.7)])
def test_stiffness_is_the_slope_of_load_and_moment(point: tuple[float, float]) -> None:
    """Differences of the answer at neighbouring loads with the same contact set.

    Exact in a piecewise linear problem.
    """
    C, X = lattice(13, 9)
    h = 1e-5 * np.abs(X[:, 0] - 0.2) + 1e-5 * np.abs(X[:, 1] + 0.3)
    arms = X - point
    base = tilted_contact(C, h, arms, load=F)
    for change in 1e-5 * F * np.diag([1.0, 0.5, 0.5]):
        moved = tilted_contact(C, h, arms, load=F + change[0], moment=change[1:])
        assert np.array_equal(moved.normal.contact, base.normal.contact)
        step = np.r_[moved.normal.approach - base.normal.approach, moved.tilt - base.tilt]
        assert np.allclose(base.stiffness @ step, change, rtol=0, atol=1e-5 * np.abs(change).max())
    pushed = tilted_contact(C, h, arms, load=F * (1 + 1e-5))
    assert base.free_stiffness == pytest.approx(
        1e-5 * F / (pushed.normal.approach - base.normal.approach), rel=1e-5
    )
    assert base.free_stiffness < base.normal.stiffness


# -- what must not matter --------------------------------------------------------------------------


def test_a_moment_is_a_shifted_load() -> None:
    """Arms from another point with the moment F times the shift: same forces and tilt.

    The approach is that of the other point.
    """
    C, X = lattice(11, 8)
    h = np.random.default_rng(5).random(88) * 1e-4
    point = np.array([1.2, 0.7])
    a = tilted_contact(C, h, X - point, load=F)
    b = tilted_contact(C, h, X, load=F, moment=F * point)
    assert np.allclose(a.normal.force, b.normal.force, rtol=0, atol=1e-12 * F)
    assert np.allclose(a.tilt, b.tilt, rtol=1e-11)
    assert b.normal.approach + b.tilt @ point == pytest.approx(a.normal.approach, rel=1e-11)
    assert_solved(b, C, h, X, F, F * point)


@pytest.mark.parametrize("unit", [1e-9, 1e6])
def test_units_do_not_matter(unit: float) -> None:
    C, X = lattice(11, 8)
    h = 1e-4 * np.random.default_rng(6).random(88)
    arms = X - [1.5, 1.0]
    a = tilted_contact(C, h, arms, load=F)
    b = tilted_contact(unit * C, unit * h, arms, load=F)
    c = tilted_contact(C / unit, h, unit * arms, load=unit * F)
    assert np.allclose(b.normal.force, a.normal.force, rtol=0, atol=1e-11 * F)
    assert np.allclose(b.tilt, unit * a.tilt, rtol=1e-10)
    assert np.allclose(c.normal.force, unit * a.normal.force, rtol=0, atol=1e-11 * unit * F)
    assert np.allclose(c.tilt, a.tilt / unit, rtol=1e-10)


def test_a_turned_patch_a_common_gap_and_any_start() -> None:
    C, X = lattice(11, 8)
    h = 1e-4 * np.random.default_rng(7).random(88)
    arms = X - [1.5, 1.0]
    a = tilted_contact(C, h, arms, load=F)
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    turned = tilted_contact(C, h, arms @ turn.T, load=F)
    assert np.allclose(turned.tilt, turn @ a.tilt, rtol=1e-10)
    higher = tilted_contact(C, h + 0.25, arms, load=F)
    # The gaps themselves carry eps 0.25 mm of rounding, felt through the stiffest node.
    assert np.allclose(
        higher.normal.force,
        a.normal.force,
        rtol=0,
        atol=10 * EPS * 0.25 * np.linalg.norm(np.linalg.inv(C), 2),
    )
    assert higher.normal.approach == pytest.approx(0.25 + a.normal.approach, abs=1e-14)
    for start in (
        a.normal.contact,
        ~a.normal.contact,
        np.arange(88) == 3,
        np.zeros(88, dtype=bool),
    ):
        again = tilted_contact(C, h, arms, load=F, start=start)
        assert np.allclose(again.normal.force, a.normal.force, rtol=0, atol=1e-11 * F)
        assert np.array_equal(again.normal.contact, a.normal.contact)


@pytest.mark.parametrize("point", [(0.0, 0.0), (4.0, 1.5), (7.6, 2.6)])
def test_a_handful_of_steps_on_a_real_patch(point: tuple[float, float]) -> None:
    """35 by 13 nodes: at most a dozen factorisations."""
    C, X = lattice(35, 13)
    answer = tilted_contact(C, np.zeros(455), X - point, load=F)
    assert_solved(answer, C, np.zeros(455), X - point, F)
    assert answer.normal.iterations <= 12 and answer.normal.method == "active set"


# -- input -----------------------------------------------------------------------------------------


def test_no_load() -> None:
    C, X = lattice(4, 4)
    h = np.linspace(1.0, 2.0, 16)
    answer = tilted_contact(C, h, X, load=0.0)
    assert answer.status == "no load" and not answer.normal.force.any() and not answer.tilt.any()
    assert answer.normal.approach == 1.0 and np.array_equal(answer.normal.gap, h - 1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"arms": "outside"},
            r"arms \(0, 0\) mm, 0.25 mm outside the nodes, beyond their side from .* tips "
            r"over. Move the load line",
        ),
        ({"arms": "line"}, "lie on one line"),
        ({"arms": np.zeros((16, 3))}, r"arms has shape \(16, 3\)"),
        ({"load": -1.0}, "load is -1 N"),
        ({"load": 0.0, "moment": (1.0, 0.0)}, "under no load"),
        ({"moment": (1.0, 0.0, 0.0)}, r"moment has shape \(3,\)"),
        ({"moment": (0.0, 1e4)}, "tips over"),
        ({"start": np.zeros(16)}, "start must be a bool mask"),
        ({"gap": np.full(16, np.nan)}, "gap holds 16 values"),
        ({"compliance": -np.eye(16)}, "not positive definite"),
    ],
)
def test_input_faults(change: dict[str, Any], message: str) -> None:
    C, X = lattice(4, 4)
    arguments: dict[str, Any] = {
        "compliance": C,
        "gap": np.zeros(16),
        "arms": X,
        "load": F,
    } | change
    if isinstance(arguments["arms"], str):
        arguments["arms"] = (
            X + np.array([1.0, 0.0]) if arguments["arms"] == "outside" else X * [1.0, 0.0]
        )
    with pytest.raises(InputError, match=message):
        tilted_contact(
            arguments.pop("compliance"), arguments.pop("gap"), arguments.pop("arms"), **arguments
        )


def test_all_faults_at_once() -> None:
    C, X = lattice(4, 4)
    with pytest.raises(InputError) as caught:
        tilted_contact(C, np.zeros(3), X[:5], load=-2.0)
    assert all(
        part in str(caught.value) for part in ("gap has shape", "arms has shape", "load is -2")
    )


def _mirrored(m: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Compliance, gap and arms of 2 m nodes that are mirrored about x = 0, m on each side."""
    rng = np.random.default_rng(7)
    half = np.column_stack([rng.uniform(0.2, 2.0, m), rng.uniform(-1.0, 1.0, m)])
    points = np.concatenate([half, half * [-1.0, 1.0]])
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    return 1e-5 / (0.1 + distance), points, half, np.tile(rng.uniform(0.0, 1e-6, m), 2)


@pytest.mark.parametrize("middle", [0.0, 0.5, 0.9])
def test_one_tilt_on_the_half_is_two_on_the_whole(middle: float) -> None:
    """Mirrored about x = 0, the body tilts along y only: the half with that tilt alone has the
    same forces, and half the stiffness.
    """
    C, points, half, gap = _mirrored()
    m, line = len(half), np.array([0.0, middle * points[:, 1].max()])
    whole = tilted_contact(C, gap, points - line, load=20.0)
    one = tilted_contact(C[:m, :m] + C[:m, m:], gap[:m], half - line, load=10.0, free=(False, True))
    assert one.tilt[0] == 0.0
    assert one.tilt[1] == pytest.approx(whole.tilt[1], rel=1e-8)
    assert one.normal.force == pytest.approx(whole.normal.force[:m], rel=1e-7, abs=1e-9)
    assert 2.0 * one.free_stiffness == pytest.approx(whole.free_stiffness, rel=1e-8)
    held = tilted_contact(
        C[:m, :m] + C[:m, m:], gap[:m], half - line, load=10.0, free=(False, False)
    )
    plain = normal_contact(C[:m, :m] + C[:m, m:], gap[:m], load=10.0)
    assert held.normal.force == pytest.approx(plain.force, rel=1e-10)
    assert held.free_stiffness == pytest.approx(plain.stiffness, rel=1e-10)


def test_one_tilt_over_the_end_of_the_nodes_and_beyond() -> None:
    C, _, half, gap = _mirrored()
    m = len(half)
    C, gap, end = C[:m, :m] + C[:m, m:], gap[:m], half[:, 1].max()
    last = int(np.argmax(half[:, 1]))
    over = tilted_contact(C, gap, half - [0.0, end], load=10.0, free=(False, True))
    assert over.normal.force[last] == pytest.approx(10.0)
    assert over.normal.force.sum() == pytest.approx(10.0)
    assert over.normal.gap.min() >= 0.0
    with pytest.raises(InputError, match="tips over"):
        tilted_contact(C, gap, half - [0.0, 1.01 * end], load=10.0, free=(False, True))


@pytest.mark.parametrize("seed", [0, 1, 5, 17])
def test_rough_faces_are_solved_by_the_active_set_alone(seed: int) -> None:
    # a wrong motion makes it cycle, and the fallback hides it
    rng = np.random.default_rng(seed)
    C, arms = lattice(8, 8)
    h = rng.uniform(0, 10.0 ** rng.uniform(-4, -1), len(arms))
    answer = tilted_contact(C, h, arms=arms, load=F)
    assert_solved(answer, C, h, arms, F)
    assert answer.normal.method == "active set" and 2 <= answer.normal.iterations <= 12
