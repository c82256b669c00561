"""Random contact problems against independent solvers (NNLS, bounded least squares, SLSQP) and
against the conditions of contact.
"""

from __future__ import annotations

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear, minimize, nnls

from upd.contact import TangentialContact, normal_contact, tangential_contact, tangential_path

FloatArray = NDArray[np.float64]

fast = settings(max_examples=60, deadline=None, derandomize=True)
seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(1, 12)
# Few distinct values: equal gaps, gaps of zero and touching nodes come up often.
coarse = st.sampled_from([0.0, 0.0, 0.25, 0.5, 1.0, -0.5, 1e-12])


def spd(rng: np.random.Generator, n: int) -> FloatArray:
    """Random compliance with condition 1 to 1e4.

    Not an M-matrix, so that plain active sets may cycle.
    """
    Q, _ = np.linalg.qr(rng.normal(size=(n, n)))
    C = (Q * np.geomspace(1, 10 ** rng.uniform(0, 4), n)) @ Q.T
    return np.asarray((C + C.T) / 2)


def nnls_forces(C: FloatArray, b: FloatArray) -> FloatArray:
    """min 1/2 f'Cf - b'f, f >= 0, as min |L'f - L^-1 b|."""
    L = np.linalg.cholesky(C)
    return np.asarray(nnls(L.T, solve_triangular(L, b, lower=True), maxiter=100 * len(b))[0])


def close(x: FloatArray, y: FloatArray, C: FloatArray) -> bool:
    """Equal to what two backward stable methods may differ by.

    n eps cond, with a hundred to spare.
    """
    scale = max(np.abs(x).max(), np.abs(y).max(), np.finfo(float).tiny)
    return bool(
        np.abs(x - y).max() <= 100 * len(C) * np.finfo(float).eps * np.linalg.cond(C) * scale
    )


@fast
@given(seeds, sizes.flatmap(lambda n: arrays(float, n, elements=coarse)), st.floats(-1, 3))
def test_normal_at_approach_equals_nnls(seed: int, h: FloatArray, d: float) -> None:
    C = spd(np.random.default_rng(seed), h.size)
    answer = normal_contact(C, h, approach=d)
    # Forces are compared on the scale of the stuck answer C^-1 (d - h), whose rounding both methods
    # share.
    scale = np.abs(np.linalg.solve(C, d - h)).max()
    limit = 100 * h.size * np.finfo(float).eps * np.linalg.cond(C) * scale
    assert np.abs(answer.force - nnls_forces(C, d - h)).max() <= limit


@fast
@given(seeds, sizes.flatmap(lambda n: arrays(float, n, elements=coarse)), st.floats(1e-3, 1e3))
def test_normal_at_load_meets_the_conditions(seed: int, h: FloatArray, load: float) -> None:
    C = spd(np.random.default_rng(seed), h.size)
    answer = normal_contact(C, h, load=load)
    g = h + C @ answer.force - answer.approach
    level = (
        100
        * h.size
        * np.finfo(float).eps
        * (np.abs(h).max() + abs(answer.approach) + np.abs(C).max() * load)
    )
    assert answer.force.min() >= 0 and answer.gap.min() >= 0
    assert abs(answer.force.sum() - load) <= 100 * h.size * np.finfo(float).eps * load
    assert np.abs(g - answer.gap).max() <= level
    assert np.all(answer.gap[answer.contact] == 0) and np.all(answer.force[~answer.contact] == 0)
    # The same set at the approach found: both modes are one law.
    back = normal_contact(C, h, approach=answer.approach)
    assert abs(back.load - load) <= level * np.abs(np.linalg.inv(C)).sum()


@fast
@given(seeds, st.integers(2, 10), st.floats(0.01, 0.99))
def test_more_load_more_approach(seed: int, n: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    C, h = spd(rng, n), rng.uniform(0, 1, n)
    low, high = normal_contact(C, h, load=share), normal_contact(C, h, load=1.0)
    assert low.approach < high.approach
    # F(d) is convex from zero: the secant stays below the tangent.
    assert (high.load - low.load) / (high.approach - low.approach) >= low.stiffness * (
        1 - 1e-9
    ) or not np.array_equal(low.contact & high.contact, low.contact)


def box_forces(C: FloatArray, b: FloatArray, s: FloatArray) -> FloatArray:
    L = np.linalg.cholesky(C)
    answer = lsq_linear(
        L.T, solve_triangular(L, b, lower=True), bounds=(-s, s), method="bvls", tol=1e-15
    )
    return np.asarray(answer.x)


@fast
@given(seeds, st.integers(1, 10), st.floats(-5, 5))
def test_friction_at_displacement_equals_bounded_least_squares(seed: int, n: int, d: float) -> None:
    rng = np.random.default_rng(seed)
    C, s = spd(rng, n), rng.uniform(0.1, 1, n)
    start = tangential_contact(C, s, displacement=float(rng.normal()))
    answer = tangential_contact(C, s, displacement=d, history=start.history)
    expected = box_forces(C, d - start.slip, s)
    gradient = np.abs(C @ (answer.force - expected)).max()
    # bvls stops on its own optimality measure, hence energies and gradients, not forces, to 1e-7.
    assert gradient <= 1e-7 * (np.abs(C).max() * s.max() + abs(d) + np.abs(start.slip).max())
    check_friction(C, s, start.slip, answer)


@fast
@given(seeds, st.integers(1, 10), st.floats(-1, 1), st.sampled_from([0.3, 0.9, 1 - 1e-9]))
@example(0, 2, 1e-310, 0.3)
@example(0, 2, 2.2e-313, 0.3)
def test_friction_at_load_meets_the_conditions(
    seed: int, n: int, share: float, level: float
) -> None:
    rng = np.random.default_rng(seed)
    C, s = spd(rng, n), rng.uniform(0.1, 1, n)
    start = tangential_contact(C, s, load=share * level * s.sum())
    answer = tangential_contact(C, s, load=-level * s.sum(), history=start.history)
    check_friction(C, s, start.slip, answer)
    assert abs(answer.force.sum() + level * s.sum()) <= 1e-13 * n * s.sum()
    back = tangential_contact(C, s, displacement=answer.displacement, history=start.history)
    assert close(answer.force, back.force, C)


@fast
@given(
    seeds, st.integers(1, 7), st.floats(0, 2 * np.pi), st.sampled_from([0.3, 0.9, 0.999, 1 - 1e-9])
)
def test_disk_friction_meets_the_conditions(seed: int, n: int, angle: float, level: float) -> None:
    rng = np.random.default_rng(seed)
    C, s = spd(rng, 2 * n), rng.uniform(0.1, 1, n)
    first = rng.normal(size=2)
    start = tangential_contact(C, s, load=first * 0.8 * s.sum() / np.hypot(*first))
    T = level * s.sum() * np.array([np.cos(angle), np.sin(angle)])
    answer = tangential_contact(C, s, load=T, history=start.history)
    check_friction(C, s, start.slip, answer)
    assert np.abs(answer.force.reshape(2, n).sum(axis=1) - T).max() <= 1e-12 * s.sum()


@settings(max_examples=15, deadline=None, derandomize=True)
@given(seeds, st.integers(1, 3))
def test_disk_friction_equals_slsqp(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(2 * n, 2 * n))
    C, s, d = B @ B.T + 2 * n * np.eye(2 * n), rng.uniform(0.1, 1, n), rng.normal(size=2) * 10
    answer = tangential_contact(C, s, displacement=d)
    b = np.repeat(d, n)
    disks = {
        "type": "ineq",
        "fun": lambda t: s**2 - t[:n] ** 2 - t[n:] ** 2,
        "jac": lambda t: -2 * np.hstack([np.diag(t[:n]), np.diag(t[n:])]),
    }
    other = minimize(
        lambda t: t @ C @ t / 2 - b @ t,
        np.zeros(2 * n),
        jac=lambda t: C @ t - b,
        constraints=[disks],
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 300},
    )
    ours = answer.force @ C @ answer.force / 2 - b @ answer.force
    # SLSQP holds its constraints to about 1e-9 and stops on the energy, so energies to 1e-8 and
    # forces to its square root.
    assert abs(ours - other.fun) <= 1e-8 * max(1.0, abs(ours))
    assert np.abs(answer.force - other.x).max() <= 1e-4


@fast
@given(seeds, st.integers(1, 8), st.sampled_from([1, 2]))
def test_a_path_is_its_single_steps(seed: int, n: int, directions: int) -> None:
    rng = np.random.default_rng(seed)
    C, s = spd(rng, directions * n), rng.uniform(0.1, 1, n)
    T = rng.uniform(-0.7, 0.7, size=(5, directions)) * s.sum()
    loads = T[:, 0] if directions == 1 else T
    path = tangential_path(C, s, loads=loads)
    at = None
    for k, load in enumerate(loads):
        step = tangential_contact(C, s, load=load, history=at)
        at = step.history
        assert np.array_equal(path.force[k], step.force) and path.slip_work[k] == step.slip_work
        assert step.slip_work >= -1e-14 * abs(path.slip_work).max()
    assert at is not None and np.array_equal(path.history.slip, at.slip)


def check_friction(
    C: FloatArray, s: FloatArray, before: FloatArray, answer: TangentialContact
) -> None:
    """Slip law node by node.

    No slip where it sticks, slip along a traction at the limit where it slips.
    """
    n, k = s.size, len(C) // s.size
    slip = np.repeat(np.asarray(answer.displacement, dtype=float), n) - C @ answer.force
    level = (
        200
        * len(C)
        * np.finfo(float).eps
        * (np.abs(C).max() * s.sum() + np.abs(answer.displacement).max() + np.abs(before).max())
    )
    assert np.abs(slip - answer.slip).max() <= level
    t, step = answer.force.reshape(k, n), (answer.slip - before).reshape(k, n)
    size = np.sqrt((t**2).sum(axis=0))
    assert np.all(answer.stick ^ answer.slipping)
    assert np.all(size <= s * (1 + 1e-14))
    assert np.all(step[:, answer.stick] == 0)
    slides = answer.slipping
    along = (t * step).sum(axis=0)[slides] / s[slides]
    assert np.all(along >= -level)
    assert np.abs(step[:, slides] - t[:, slides] / s[slides] * along).max(initial=0.0) <= 10 * level
    assert np.allclose(size[slides], s[slides], rtol=1e-13 * len(C), atol=0)
