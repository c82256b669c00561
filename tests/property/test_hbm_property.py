"""Properties of the harmonic balance.

Exact Jacobians in every contact state, homogeneity, energy.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.whole_balance import evaluate, harmonic_force
from upd.hbm import System, contacts, frequency_response, harmonics
from upd.hbm.core.fourier import analysis, embed, synthesis
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.coulomb import LIFT, SLIP, STICK
from upd.hbm.springs.modal import modal
from upd.hbm.springs.points import Start

# Central differences: error h^2 from curvature of the radial return, eps/h from rounding; best h =
# eps^(1/3), error about eps^(2/3).
STEP = float(np.finfo(float).eps) ** (1 / 3)
TOLERANCE = 1e3 * STEP**2


def system(
    seed: int, n: int = 5, points: int = 2, tangents: int = 2
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    R = rng.normal(size=(n, n))
    # one rigid mode
    K = R[:, 1:] @ R[:, 1:].T
    M = np.eye(n) + 0.1 * np.diag(rng.uniform(size=n))
    return M, 0.05 * (K + M), K, rng.normal(size=(points, 1 + tangents, n))


@pytest.mark.parametrize("tangents", [0, 1, 2])
@pytest.mark.parametrize("start", ["zero", "mid", "upper", "lower"])
@pytest.mark.parametrize(
    ("preload", "mu", "states"),
    [(1e3, 1.0, {STICK}), (1.0, 0.05, {SLIP}), (1.0, 0.6, {STICK, SLIP, LIFT})],
)
def test_force_jacobian(
    tangents: int, start: Start, preload: float, mu: float, states: set[int]
) -> None:
    h = harmonics(range(4))
    E, Q = synthesis(h, 64), analysis(h, 64)
    rng = np.random.default_rng(tangents)
    law = contacts(
        np.ones((3, 1)),
        np.ones((tangents, 3, 1)),
        k_n=1.3,
        k_t=[0.7, 2.0, 5.0],
        mu=mu,
        preload=preload,
    ).law
    X = rng.normal(size=(3, 1 + tangents, h.size))
    found = harmonic_force(law, X, E, Q, start=start)
    if tangents:
        assert states <= set(np.unique(found.march.state).tolist())
    for index in np.ndindex(X.shape):
        d = np.zeros_like(X)
        d[index] = STEP
        up, down = (harmonic_force(law, X + s * d, E, Q, start=start).force for s in (1, -1))
        difference = ((up - down) / (2 * STEP))[index[0]]
        np.testing.assert_allclose(
            found.jacobian[index[0]][..., index[1], index[2]], difference, atol=TOLERANCE * 10
        )


@pytest.mark.parametrize("tangents", [1, 2])
def test_force_jacobian_while_events_pass_the_samples(tangents: int) -> None:
    # Along a line through motions whose contacts open, close and slip, the change of the force is
    # the integral of its derivative: the differences add up to the order of the step, as long as
    # the force has no jump and the derivative is right on both sides of every event.
    h = harmonics(range(4))
    E, Q = synthesis(h, 32), analysis(h, 32)
    rng = np.random.default_rng(7)
    law = contacts(
        np.ones((6, 1)), np.ones((tangents, 6, 1)), k_n=1.3, k_t=2.0, mu=0.5, preload=0.5
    ).law
    X, d = rng.normal(size=(2, 6, 1 + tangents, h.size))
    states, errors = [], []
    for steps in (200, 400):
        F, slope = [], []
        for s in np.linspace(0.0, 0.5, steps + 1):
            found = harmonic_force(law, X + s * d, E, Q)
            assert found.march.periodic.all()
            states.append(found.march.state)
            F.append(found.force)
            slope.append(np.einsum("pirjs,pjs->pir", found.jacobian, d))
        area = (np.array(slope[1:]) + np.array(slope[:-1])) * 0.25 / steps
        change = np.diff(F, axis=0)
        errors.append(np.abs(change - area).sum() / np.abs(change).sum())
    assert {STICK, SLIP, LIFT} <= set(np.unique(states))
    assert sum(np.any(a != b) for a, b in pairwise(states)) > 50
    assert errors[0] < 1e-3
    assert errors[1] < 0.7 * errors[0]


def test_normal_force_is_smooth_where_its_zero_is_at_a_sample() -> None:
    # N = k_n max(0, cos + c): with c = 0 it vanishes at the samples n/4 and 3n/4
    h = harmonics(range(3))
    E, Q = synthesis(h, 32), analysis(h, 32)
    law = contacts([[1.0]], k_n=1.0, k_t=1.0, mu=0.0).law
    X = np.zeros((1, 1, h.size))
    X[0, 0, 1] = 1.0
    d = np.zeros_like(X)
    d[0, 0, 0] = STEP
    left, here, right = (harmonic_force(law, X + s * d, E, Q) for s in (-1, 0, 1))
    for other in (left, right):
        np.testing.assert_allclose(other.jacobian, here.jacobian, atol=10 * STEP)
    np.testing.assert_allclose(
        here.jacobian[0, 0, :, 0, 0],
        (right.force - left.force)[0, 0] / (2 * STEP),
        atol=STEP,
    )


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    omega=st.floats(0.2, 3.0),
    tangents=st.integers(1, 2),
    static=st.booleans(),
)
def test_balance_jacobian(seed: int, omega: float, tangents: int, static: bool) -> None:
    M, C, K, rows = system(seed, tangents=tangents)
    h = harmonics((0, 1, 3) if static else (1, 2))
    points = contacts(
        rows[:, 0], np.swapaxes(rows[:, 1:], 0, 1), k_n=1.0, k_t=1.5, mu=0.4, preload=0.7
    )
    rng = np.random.default_rng(seed)
    b = Balance(modal(M, C, K), points, h, 64, rng.normal(size=5), rng.normal(size=(2, 5)) + 0j)
    x = rng.normal(size=b.size)
    e = evaluate(b, x, omega)
    direction = rng.normal(size=b.size)
    direction /= np.linalg.norm(direction)
    up, down = (b.linearised(x + s * STEP * direction, omega, False)[0] for s in (1, -1))
    size = np.abs(e.jacobian).max()
    np.testing.assert_allclose(
        e.jacobian @ direction, (up - down) / (2 * STEP), atol=TOLERANCE * size
    )
    up, down = (b.linearised(x, omega + s * STEP, False)[0] for s in (1, -1))
    scale = np.abs(e.by_frequency).max() + np.abs(e.residual).max()
    np.testing.assert_allclose(
        e.by_frequency, (up - down) / (2 * STEP), atol=1e3 * TOLERANCE * scale
    )


@pytest.mark.parametrize("proportional", [True, False])
def test_receptance_is_the_inverse_of_the_dynamic_stiffness(proportional: bool) -> None:
    M, C, K, rows = system(3)
    C = C if proportional else C + np.diag([1.0, 0, 0, 0, 0])
    m = modal(M, C, K)
    assert m.proportional is proportional
    Psi, w = rows.reshape(6, 5) @ m.Phi, np.array([0.3, 1.7])
    G, u = m.receptance(Psi, w, np.ones((2, 5)) @ m.Phi + 0j)
    np.testing.assert_allclose(np.array(m.receptance_parts(Psi, w)), [G.real, G.imag], rtol=1e-12)
    for i, omega in enumerate(w):
        H = np.linalg.inv(K + 1j * omega * C - omega**2 * M)
        np.testing.assert_allclose(
            G[i], rows.reshape(6, 5) @ H @ rows.reshape(6, 5).T, atol=1e-11 * np.abs(H).max()
        )
        np.testing.assert_allclose(
            u[i], rows.reshape(6, 5) @ H @ np.ones(5), atol=1e-11 * np.abs(H).max()
        )


@settings(max_examples=10, deadline=None)
@given(exponent=st.floats(-6, 6))
def test_loads_times_s_give_the_answer_times_s(exponent: float) -> None:
    M, C, K, points = wedge_pair()
    s = 10.0**exponent
    grid = np.linspace(0.10, 0.22, 13)
    one, other = (
        frequency_response(
            System((M, C, K), points, static_force=f * np.array([0, 0, 2.0])),
            harmonic_force=f * np.array([1.0, 0.3, 0]),
            frequencies=grid,
        )
        for f in (1.0, s)
    )
    assert one.status == other.status == "complete"
    row = np.array([1.0, 0, 0])
    at = [np.argmin(np.abs(a.frequency[:, None] - grid), axis=0) for a in (one, other)]
    np.testing.assert_allclose(
        other.amplitude(row)[at[1]], s * one.amplitude(row)[at[0]], rtol=1e-9
    )
    assert np.abs(other.energy_balance).max() < 1e-9


def wedge_pair() -> tuple[np.ndarray, np.ndarray, np.ndarray, object]:
    """Two blades in x, a damper in z between 45 degree faces, one tangent each."""
    c = np.sqrt(0.5)
    M, K = np.diag([1.0, 1.0, 0.05]), np.diag([1.0, 1.1, 0.0])
    points = contacts([[c, 0, c], [0, -c, c]], [[[c, 0, -c], [0, c, c]]], k_n=3.0, k_t=2.0, mu=0.5)
    return M, 0.1 * K + 0.02 * np.diag([1.0, 1.0, 0.0]), K, points


def test_embedding_keeps_the_signal() -> None:
    old, new = harmonics((0, 1, 3)), harmonics((0, 1, 2, 3, 5))
    X = np.random.default_rng(0).normal(size=(2, old.size))
    np.testing.assert_allclose(
        embed(X, old, new) @ synthesis(new, 32).T, X @ synthesis(old, 32).T, atol=1e-14
    )
