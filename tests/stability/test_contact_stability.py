"""Degenerate, badly scaled and hostile contact problems.

The exact answer or an error that says what to do.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls

from upd.contact import (
    TangentialHistory,
    normal_contact,
    normal_curve,
    tangential_contact,
    tangential_path,
)
from upd.errors import InputError
from upd.reference.half_space import half_space_compliance

FloatArray = NDArray[np.float64]

# On this compliance the plain primal-dual active set goes round in circles (found by search; an SPD
# matrix that is no M-matrix).
CYCLE_C = np.array([[8.0, -8.0, -8.0], [-8.0, 14.0, 16.0], [-8.0, 16.0, 19.0]])
CYCLE_H = np.array([-3.0, 2.0, 0.0])


def patch(n: int, component: str = "normal") -> FloatArray:
    return half_space_compliance(n, n, 0.025, 0.025, 200e3, 0.3, component)  # type: ignore[arg-type]


def spherical(n: int) -> FloatArray:
    x = (np.arange(n) - (n - 1) / 2) * 0.025
    return np.asarray(np.add.outer(x**2, x**2).ravel() / 10)


def spread_spd(
    seed: int, directions: int = 1
) -> tuple[FloatArray, FloatArray, np.random.Generator]:
    """Compliance of condition 1e4 and limits, of a size drawn from the seed."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    Q, _ = np.linalg.qr(rng.normal(size=(directions * n, directions * n)))
    C = (Q * np.geomspace(1, 1e4, directions * n)) @ Q.T
    return (C + C.T) / 2, rng.uniform(0.1, 1, size=n), rng


# -- normal contact: degenerate answers ------------------------------------------------------------


def test_flat_on_flat_touches_everywhere() -> None:
    C = patch(7)
    answer = normal_contact(C, np.full(49, 0.3), load=10.0)
    expected = np.linalg.solve(C, np.ones(49))
    assert answer.contact.all()
    assert answer.force == pytest.approx(expected * 10 / expected.sum(), rel=1e-11)
    assert answer.approach == pytest.approx(0.3 + 10 / expected.sum(), rel=1e-13)


@pytest.mark.parametrize("load", [1e-9, 1e-3, 1.0, 1e3])
def test_noise_of_1e_12_in_flat_gaps(load: float) -> None:
    noise = 1e-12 * np.random.default_rng(0).uniform(size=49)
    C = patch(7)
    answer = normal_contact(C, 0.3 + noise, load=load)
    # A gap error e changes the forces by at most |C^-1| e.
    flat = normal_contact(C, np.full(49, 0.3), load=load)
    assert (
        np.abs(answer.force - flat.force).max()
        <= np.abs(np.linalg.inv(C)).sum(axis=1).max() * 2e-12
    )
    assert answer.load == pytest.approx(load, rel=1e-12)


def test_a_node_that_just_touches() -> None:
    C, h = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([0.0, 1.0])
    for answer in (normal_contact(C, h, load=1.0), normal_contact(C, h, approach=2.0)):
        assert answer.force == pytest.approx([1.0, 0.0], abs=1e-14) and answer.gap == pytest.approx(
            [0.0, 0.0], abs=1e-14
        )


def test_symmetric_ties_give_a_symmetric_answer() -> None:
    answer = normal_contact(patch(9), spherical(9), load=20.0)
    f = answer.force.reshape(9, 9)
    for turned in (f[::-1], f[:, ::-1], f.T):
        assert np.abs(turned - f).max() <= 1e-12 * f.max()


def test_zero_load_touches_at_the_smallest_gap() -> None:
    answer = normal_contact(patch(3), spherical(3) + 0.1, load=0.0)
    assert answer.status == "no load" and "zero" in answer.message
    assert answer.approach == 0.1 and not answer.force.any() and not answer.contact.any()
    assert answer.gap == pytest.approx(spherical(3), abs=1e-16)


@pytest.mark.parametrize("approach", [-1.0, 0.0, 0.0999, 0.1])
def test_approach_that_reaches_nothing(approach: float) -> None:
    answer = normal_contact(patch(3), spherical(3) + 0.1, approach=approach)
    assert answer.status == "no contact" and not answer.force.any() and answer.stiffness == 0
    assert answer.gap == pytest.approx(spherical(3) + 0.1 - approach)


def test_interference_without_approach_presses() -> None:
    answer = normal_contact([[2.0]], [-1.0], approach=0.0)
    assert answer.force[0] == pytest.approx(0.5) and answer.status == "converged"


@pytest.mark.parametrize("start", ["none", "all", "corner"])
def test_any_start_gives_the_same_answer(start: str) -> None:
    C, h = patch(9), spherical(9)
    best = normal_contact(C, h, load=20.0)
    mask = np.zeros(81, dtype=bool)
    mask[:] = start == "all"
    mask[0] = start != "none"
    answer = normal_contact(C, h, load=20.0, start=mask)
    assert np.array_equal(answer.contact, best.contact)
    assert answer.force == pytest.approx(best.force, rel=1e-10)
    assert normal_contact(C, h, approach=best.approach, start=mask).force == pytest.approx(
        best.force, rel=1e-9
    )


@pytest.mark.parametrize("compliance_unit", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("length_unit", [1e-12, 1.0, 1e12])
def test_units_do_not_matter(compliance_unit: float, length_unit: float) -> None:
    C, h = patch(9), spherical(9)
    base = normal_contact(C, h, load=20.0)
    force_unit = length_unit / compliance_unit
    answer = normal_contact(C * compliance_unit, h * length_unit, load=20.0 * force_unit)
    assert np.array_equal(answer.contact, base.contact)
    assert answer.force / force_unit == pytest.approx(base.force, rel=1e-9)
    assert answer.approach / length_unit == pytest.approx(base.approach, rel=1e-9)
    Ct, s = patch(9, "both"), 0.5 * base.force
    T = 0.7 * s.sum() * np.array([0.8, 0.6])
    two, scaled = (
        tangential_contact(Ct, s, load=T),
        tangential_contact(Ct * compliance_unit, s * force_unit, load=T * force_unit),
    )
    assert np.array_equal(two.stick, scaled.stick)
    assert scaled.force / force_unit == pytest.approx(two.force, rel=1e-9, abs=1e-9 * s.max())
    assert np.asarray(scaled.displacement) / length_unit == pytest.approx(
        two.displacement, rel=1e-9
    )
    one = tangential_contact(
        Ct[:81, :81] * compliance_unit, s * force_unit, load=0.7 * s.sum() * force_unit
    )
    assert float(one.displacement) / length_unit == pytest.approx(
        float(tangential_contact(Ct[:81, :81], s, load=0.7 * s.sum()).displacement), rel=1e-9
    )


def test_stiffness_ratio_of_1e12_between_nodes() -> None:
    C = np.diag([1e-6, 1.0, 1e6])
    answer = normal_contact(C, np.zeros(3), load=1.0)
    assert answer.contact.all()
    assert answer.force / answer.force[0] == pytest.approx([1, 1e-6, 1e-12], rel=1e-9)


def test_large_common_gap_costs_no_digits() -> None:
    C, h = patch(9), spherical(9)
    base, far = normal_contact(C, h, load=20.0), normal_contact(C, h + 1024.0, load=20.0)
    # The gaps themselves are known to eps * 1024 only.
    assert (
        np.abs(far.force - base.force).max()
        <= np.abs(np.linalg.inv(C)).sum(axis=1).max() * 4 * np.finfo(float).eps * 1024
    )


# -- normal contact: cycling -----------------------------------------------------------------------


def test_plain_active_set_cycles_and_the_fallback_answers() -> None:
    active, seen = CYCLE_H < 0, []
    for _ in range(20):
        f = np.zeros(3)
        f[active] = np.linalg.solve(CYCLE_C[np.ix_(active, active)], -CYCLE_H[active])
        g = CYCLE_H + CYCLE_C @ f
        new = np.where(active, f > 0, g < -1e-12)
        if np.array_equal(new, active):
            break
        seen.append(tuple(active))
        active = new
    assert len(seen) == 20 and len(set(seen)) < 8, "this problem must make the plain method cycle"
    answer = normal_contact(CYCLE_C, CYCLE_H, approach=0.0)
    L = np.linalg.cholesky(CYCLE_C)
    assert answer.method == "fallback"
    assert answer.force == pytest.approx(nnls(L.T, np.linalg.solve(L, -CYCLE_H))[0], rel=1e-12)


def test_random_problems_reach_both_methods() -> None:
    methods = {"normal": set(), "friction": set()}  # type: dict[str, set[str]]
    for seed in range(60):
        C, s, rng = spread_spd(seed)
        h = rng.normal(size=s.size)
        answer = normal_contact(C, h, load=float(rng.uniform(0, 10)))
        methods["normal"].add(answer.method)
        step = tangential_contact(C, s, load=0.9 * s.sum())
        methods["friction"].add(step.method)
        slip = step.displacement - C @ step.force
        assert np.all(
            slip[step.slipping] * np.sign(step.force[step.slipping]) >= -1e-10 * np.abs(C).max()
        )
        assert np.all(np.abs(slip[step.stick]) <= 1e-10 * np.abs(C).max())
    assert methods["friction"] == {"active set", "fallback"}
    assert "active set" in methods["normal"]


@pytest.mark.parametrize(
    ("seed", "by_load"), [(458, True), (604, True), (618, True), (2651, False), (2847, False)]
)
def test_disk_problems_newton_alone_loses(seed: int, by_load: bool) -> None:
    C, s, rng = spread_spd(seed, 2)
    pull = rng.normal(size=2)
    if by_load:
        answer = tangential_contact(C, s, load=pull * 0.95 * s.sum() / np.hypot(*pull))
    else:
        answer = tangential_contact(C, s, displacement=pull * 1e3)
    slip = np.repeat(np.asarray(answer.displacement), s.size) - C @ answer.force
    t, w = answer.force.reshape(2, -1), slip.reshape(2, -1)
    v = t + w / np.abs(C).max()
    expected = v * np.minimum(1.0, s / np.hypot(*v))
    assert answer.method == "fallback"
    assert np.abs(t - expected).max() <= 1e-11 * s.max()


@pytest.fixture(scope="module")
def loaded() -> tuple[FloatArray, FloatArray]:
    normal = normal_contact(2 * patch(9), spherical(9), load=20.0)
    c = normal.contact
    return 2 * patch(9, "both")[np.ix_(np.tile(c, 2), np.tile(c, 2))], 0.5 * normal.force[c]


@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-9, 1e-12])
def test_load_just_below_gross_slip(loaded: tuple[FloatArray, FloatArray], short: float) -> None:
    C, s = loaded
    n = s.size
    T = (1 - short) * s.sum()
    one = tangential_contact(C[:n, :n], s, load=-T)
    assert (
        one.status == "converged"
        and one.stick.any()
        and one.force.sum() == pytest.approx(-T, rel=1e-14)
    )
    two = tangential_contact(C, s, load=[0.6 * T, 0.8 * T])
    assert two.status == "converged"
    assert two.force.reshape(2, n).sum(axis=1) == pytest.approx([0.6 * T, 0.8 * T], rel=1e-12)


@pytest.mark.parametrize("factor", [1.0, -1.0, 1.5])
def test_gross_slip_under_load_is_an_error(
    loaded: tuple[FloatArray, FloatArray], factor: float
) -> None:
    C, s = loaded
    T = factor * s.sum()
    with pytest.raises(
        InputError,
        match=r"gross slip: load is .* N .*the sum of mu N over the nodes, is .* N.*Lower the load",
    ):
        tangential_contact(C[: s.size, : s.size], s, load=T)
    with pytest.raises(InputError, match="gross slip"):
        tangential_contact(C, s, load=[0.6 * T, 0.8 * T])
    with pytest.raises(InputError, match=r"gross slip: loads\[1\]"):
        tangential_path(C[: s.size, : s.size], s, loads=[0.1 * T, T, 0.2 * T])


def test_gross_slip_under_displacement_is_an_answer(loaded: tuple[FloatArray, FloatArray]) -> None:
    C, s = loaded
    one = tangential_contact(C[: s.size, : s.size], s, displacement=10.0)
    assert one.status == "gross slip" and "limit" in one.message
    assert (
        np.array_equal(one.force, s) and one.stiffness == 0 and one.load == pytest.approx(s.sum())
    )
    two = tangential_contact(C, s, displacement=[-10.0, 0.0])
    assert two.status == "gross slip" and not two.stick.any()
    assert np.asarray(two.load)[0] == pytest.approx(-s.sum(), rel=1e-6)
    back = tangential_contact(
        C[: s.size, : s.size], s, displacement=10.0 - 1e-6, history=one.history
    )
    assert back.stick.all() and back.slip_work == 0


def test_no_friction() -> None:
    C = patch(3)
    free = tangential_contact(C, np.zeros(9), load=0.0)
    assert free.status == "no friction" and not free.force.any() and free.displacement == 0
    moved = tangential_contact(C, np.zeros(9), displacement=0.5)
    assert moved.slip == pytest.approx(np.full(9, 0.5)) and moved.slip_work == 0
    assert (
        tangential_path(patch(3, "both"), np.zeros(9), loads=np.zeros((2, 2))).status
        == "no friction"
    )
    with pytest.raises(InputError, match="gross slip"):
        tangential_contact(C, np.zeros(9), load=1.0)


def test_zero_load_and_one_node() -> None:
    still = tangential_contact(patch(3), np.ones(9), load=0.0)
    assert still.stick.all() and still.displacement == 0 and not still.force.any()
    one = tangential_contact([[2.0]], [1.0], load=0.5)
    assert one.displacement == pytest.approx(1.0) and one.stiffness == pytest.approx(0.5)


def test_limits_over_fifteen_decades(loaded: tuple[FloatArray, FloatArray]) -> None:
    C, s = loaded
    n = s.size
    spread = s * np.geomspace(1e-15, 1, n)
    T = 0.9 * spread.sum()
    assert tangential_contact(C[:n, :n], spread, load=T).force.sum() == pytest.approx(T, rel=1e-13)
    answer = tangential_contact(C, spread, load=[T, 0.0])
    assert np.all(np.hypot(*answer.force.reshape(2, n)) <= spread * (1 + 1e-14))


def test_twenty_reversals_return_to_the_same_loop(loaded: tuple[FloatArray, FloatArray]) -> None:
    C, s = loaded
    n = s.size
    T = 0.8 * s.sum() * np.tile([1, 0.3, -0.6, -1, -0.3, 0.6], 11)
    one = tangential_path(C[:n, :n], s, loads=T)
    loops = one.displacement[1:61].reshape(10, 6)
    assert np.abs(loops - loops[0]).max() <= 1e-10 * np.abs(loops).max()
    two = tangential_path(C, s, loads=np.column_stack((T, 0 * T))[:60])
    loops = two.displacement[:, 0].reshape(10, 6)
    change = np.abs(np.diff(loops, axis=0)).max(axis=1)
    # The transverse slip settles over the first cycles, each cycle changing less than the one
    # before.
    assert np.all(change[2:] < change[1:-1]) and change[-1] <= 1e-6 * np.abs(loops).max()


@pytest.mark.parametrize("angle", [np.pi / 4, 1.0, np.pi / 2, 3.0])
def test_the_disk_has_no_preferred_direction(
    loaded: tuple[FloatArray, FloatArray], angle: float
) -> None:
    C, s = loaded
    n = s.size
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    Q = np.kron(turn, np.eye(n))
    T = 0.9 * s.sum() * np.array([[0.6, 0], [0.95, 0], [0.2, 0.5], [-0.9, 0.1]])
    straight = tangential_path(C, s, loads=T)
    turned = tangential_path(Q @ C @ Q.T, s, loads=T @ turn.T)
    assert np.abs(turned.force - straight.force @ Q.T).max() <= 1e-10 * s.max()
    assert turned.displacement == pytest.approx(
        straight.displacement @ turn.T, abs=1e-10 * np.abs(straight.displacement).max()
    )
    assert turned.slip_work == pytest.approx(
        straight.slip_work, rel=1e-9, abs=1e-12 * straight.slip_work.max()
    )


def test_step_size_does_not_change_a_monotonic_load(loaded: tuple[FloatArray, FloatArray]) -> None:
    C, s = loaded
    n = s.size
    T = 0.9 * s.sum()
    whole = tangential_contact(C[:n, :n], s, load=T)
    parts = tangential_path(C[:n, :n], s, loads=np.linspace(0, T, 40))
    assert parts.force[-1] == pytest.approx(whole.force, rel=1e-11)
    assert parts.displacement[-1] == pytest.approx(float(whole.displacement), rel=1e-11)


# -- wrong input -----------------------------------------------------------------------------------

EYE, GAP = np.eye(2), np.zeros(2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((EYE, GAP, {}), "exactly one of load and approach"),
        ((EYE, GAP, {"load": 1.0, "approach": 1.0}), "exactly one of load and approach"),
        ((EYE, GAP, {"load": -1.0}), "cannot pull"),
        ((EYE, GAP, {"load": np.nan}), "load holds 1 values that are NaN"),
        ((EYE, GAP, {"approach": np.inf}), "approach holds 1 values that are NaN or infinite"),
        ((EYE * np.nan, GAP, {"load": 1.0}), "compliance holds 4 values that are NaN"),
        ((EYE, GAP * np.nan, {"load": 1.0}), "gap holds 2 values that are NaN"),
        (([[1.0, 0.5], [0.0, 1.0]], GAP, {"load": 1.0}), "not symmetric.*check the dof order"),
        (
            ([[1.0, 2.0], [2.0, 1.0]], GAP, {"load": 1.0}),
            "not positive definite.*breaks down at row 1",
        ),
        (([[1.0, 1.0], [1.0, 1.0]], GAP, {"load": 1.0}), "not positive definite.*merge coincident"),
        (
            ([[1.0, 0.0], [0.0, 0.0]], GAP, {"load": 1.0}),
            "diagonal entries are <= 0, first at row 1",
        ),
        ((-EYE, GAP, {"load": 1.0}), "check the sign"),
        ((np.ones((2, 3)), GAP, {"load": 1.0}), r"shape \(2, 3\): it must be \(n, n\)"),
        ((np.zeros((0, 0)), np.zeros(0), {"load": 1.0}), "n >= 1"),
        ((EYE, np.zeros(3), {"load": 1.0}), r"gap has shape \(3,\): it must be \(2,\)"),
        ((EYE, np.zeros((2, 1)), {"load": 1.0}), r"gap has shape \(2, 1\)"),
        (("stiff", GAP, {"load": 1.0}), "compliance is not an array of numbers"),
        (([[1.0], [1.0, 2.0]], GAP, {"load": 1.0}), "compliance is not an array of numbers"),
        ((EYE, GAP, {"load": 1.0, "start": [1, 0]}), "start must be a bool mask"),
        ((EYE, GAP, {"load": 1.0, "start": [True]}), r"start must be a bool mask of shape \(2,\)"),
        ((EYE, GAP, {"load": [1.0, 2.0]}), r"load has shape \(2,\)"),
    ],
)
def test_normal_input_faults(arguments: tuple[Any, Any, dict[str, Any]], message: str) -> None:
    C, h, options = arguments
    with pytest.raises(InputError, match=message):
        normal_contact(C, h, **options)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((EYE, [1.0, 1.0], {}), "exactly one of load and displacement"),
        (
            (EYE, [1.0, 1.0], {"load": 1.0, "displacement": 1.0}),
            "exactly one of load and displacement",
        ),
        ((EYE, [1.0, -1.0], {"load": 0.5}), "limit is negative at 1 nodes"),
        ((EYE, [1.0, np.nan], {"load": 0.5}), "limit holds 1 values that are NaN"),
        ((EYE, [1.0, 1.0, 1.0], {"load": 0.5}), "2 rows for 3 limits.*x dofs first"),
        ((EYE, [1.0], {"load": 0.5}), r"load has shape \(\): it must be \(2,\)"),
        ((EYE, [1.0, 1.0], {"load": [0.5, 0.5]}), r"load has shape \(2,\): it must be \(\)"),
        ((EYE, [1.0, 1.0], {"displacement": np.nan}), "displacement holds 1 values that are NaN"),
        ((np.array([[1.0, 2.0], [2.0, 1.0]]), [1.0, 1.0], {"load": 0.5}), "not positive definite"),
        (
            (
                EYE,
                [1.0, 1.0],
                {
                    "load": 0.5,
                    "history": TangentialHistory(
                        np.zeros(3), np.zeros(2), np.zeros(2, dtype=np.int8)
                    ),
                },
            ),
            r"history.slip has shape \(3,\)",
        ),
    ],
)
def test_tangential_input_faults(arguments: tuple[Any, Any, dict[str, Any]], message: str) -> None:
    C, s, options = arguments
    with pytest.raises(InputError, match=message):
        tangential_contact(C, s, **options)


def test_all_faults_at_once() -> None:
    with pytest.raises(InputError) as caught:
        normal_contact(np.array([[1.0, np.nan], [0.0, 1.0]]), [0.0, np.inf], load=-1.0)
    for part in ("compliance holds 1", "gap holds 1", "cannot pull"):
        assert part in str(caught.value)


def test_curve_and_path_shapes() -> None:
    assert normal_curve(EYE, GAP, []) == []
    with pytest.raises(InputError, match=r"loads has shape \(2, 2\)"):
        normal_curve(EYE, GAP, np.ones((2, 2)))
    with pytest.raises(InputError, match="cannot pull"):
        normal_curve(EYE, GAP, [1.0, -1.0])
    with pytest.raises(InputError, match=r"loads has shape \(3,\): it must be \(k, 2\)"):
        tangential_path(EYE, [1.0], loads=np.zeros(3))
    empty = tangential_path(EYE, [1.0, 1.0], loads=[])
    assert empty.load.shape == (0,) and empty.status == "converged" and not empty.history.slip.any()


def test_inputs_are_left_alone() -> None:
    C, h, s = patch(5), spherical(5), np.ones(25)
    copies = C.copy(), h.copy(), s.copy()
    normal_contact(C, h, load=5.0)
    tangential_path(C, s, loads=[5.0, 20.0, -20.0])
    assert all(np.array_equal(a, b) for a, b in zip((C, h, s), copies, strict=True))
