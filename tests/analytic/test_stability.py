"""Stability of periodic motions: Duffing's oscillator, a contact that lifts off, friction along two
directions against differences of marched periods, the oscillating stretch of a public benchmark.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq, fsolve

from upd.errors import InputError
from upd.hbm import (
    FrequencyResponse,
    Settings,
    System,
    contacts,
    frequency_response,
    harmonics,
    stability,
)
from upd.hbm.core.fourier import synthesis
from upd.hbm.springs.stability import changes, period_map

FloatArray = NDArray[np.float64]


# -- Duffing's oscillator: q'' + .04 q' + q + .05 q^3 = .2 cos wt ----------------------------------

c, k3, F = 0.04, 0.05, 0.2
H = harmonics((1, 3, 5, 7))
E = synthesis(H, 512)


def duffing(A: float, w: float) -> tuple[FloatArray, float]:
    """Coefficients and angular frequency at the amplitude A of the fundamental."""
    k = H.dynamic.astype(float)

    def off(y: FloatArray) -> FloatArray:
        x, w = y[:-1], y[-1]
        a, b = x[::2], x[1::2]
        cubic = 2.0 / len(E) * E.T @ (k3 * (E @ x) ** 3)
        out = cubic.copy()
        out[::2] += (1 - (k * w) ** 2) * a + c * k * w * b
        out[1::2] += (1 - (k * w) ** 2) * b - c * k * w * a
        out[0] -= F
        return np.append(out, np.hypot(a[0], b[0]) - A)

    start = np.zeros(H.size + 1)
    stiff = 1.0 + 0.75 * k3 * A**2 - w**2
    start[:2], start[-1] = np.array([stiff, c * w]) * A / np.hypot(stiff, c * w), w
    y, _, flag, message = fsolve(off, start, full_output=True, xtol=1e-13)
    assert flag == 1, message
    return y[:-1], float(y[-1])


def multipliers(A: float, w: float, steps: int = 512) -> tuple[NDArray[np.complex128], float]:
    x, w = duffing(A, w)
    q = synthesis(H, steps) @ x
    rest = (np.zeros((steps, *shape)) for shape in ((1, 0), (0, 1), (0, 0)))
    slopes = ((3 * k3 * q**2)[:, None, None], *rest)
    dt = 2 * np.pi / w / steps
    return np.linalg.eigvals(period_map(np.ones(1), np.array([c]), np.ones((1, 1)), slopes, dt)), w


@pytest.mark.parametrize(("w", "A"), [(1.263167, 3.94569), (1.099815, 1.40781)])
def test_a_multiplier_leaves_the_circle_where_the_curve_folds(w: float, A: float) -> None:
    def largest(amplitude: float) -> float:
        return float(np.abs(multipliers(amplitude, w)[0]).max())

    assert duffing(A, w)[1] == pytest.approx(w, abs=1e-6)
    found, _ = multipliers(A, w)
    # the product of the pair is what damping takes in a period
    assert np.prod(found).real == pytest.approx(np.exp(-c * 2 * np.pi / w), rel=2e-5)
    fold = brentq(lambda amplitude: largest(amplitude) - 1.0, 0.998 * A, 1.001 * A)
    assert fold == pytest.approx(A, rel=1e-4)


def test_multipliers_converge_with_the_square_of_the_step() -> None:
    exact = np.sort_complex(multipliers(3.0, 1.2, 4096)[0])
    errors = [np.abs(np.sort_complex(multipliers(3.0, 1.2, n)[0]) - exact).max() for n in (64, 128)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


# -- a contact that lifts off, beside a Jenkins element --------------------------------------------


@pytest.fixture(scope="module")
def softening() -> FrequencyResponse:
    """q'' + .02 q' + 1.1 q + contact + slider = .15 cos wt, the contact preloaded by .5."""
    points = contacts(
        [[1.0], [0.0]],
        [[0.0], [1.0]],
        k_n=[1.0, 0.0],
        k_t=[1.0, 0.1],
        mu=[0.0, 1.0],
        preload=[0.5, 0.02],
    )
    below, above = np.linspace(1.2, 1.36, 40), np.linspace(1.3602, 1.45, 10)
    w = np.concatenate([below, np.linspace(1.36, 1.360098, 12)[1:], above])
    return frequency_response(
        System(
            ([[1.0]], [[0.02]], [[1.1]]),
            points,
            static_force=[0.5],
            harmonics=range(16),
            samples=2048,
        ),
        harmonic_force=[0.15],
        frequencies=w / (2 * np.pi),
        sweep_down=True,
        settings=Settings(largest_step=0.02),
    )


def test_lift_off_loses_stability_at_its_fold(softening: FrequencyResponse) -> None:
    A, w = softening.amplitude([1.0]), 2 * np.pi * softening.frequency
    found = stability(softening)
    fold = int(np.argmax(np.where((A > 0.53) & (A < 0.6), w, 0.0)))
    assert w[fold] == pytest.approx(1.360098, abs=1e-5)
    near = (A > 0.5) & (A < 0.7)
    size = np.array([m.real for m in found.largest])
    order = np.argsort(A[near])
    # of another implementation: amplitude -> the largest multiplier
    for amplitude, known in ((0.5477, 1.0333), (0.5844, 1.1799)):
        got = np.interp(amplitude, A[near][order], size[near][order])
        assert got == pytest.approx(known, abs=1e-3)
    labels = np.array(found.label)
    # the path leaves the unstable part where the step in frequency changes its sign
    unstable = np.flatnonzero((labels == "fold") & near)
    assert abs(unstable.max() - fold) <= 1
    assert (labels[(A < 0.53) & (A > 0.25)] == "stable").all()
    assert set(labels) <= {"stable", "fold", "undecided"}


def test_a_pair_is_complex_before_the_fold(softening: FrequencyResponse) -> None:
    A = softening.amplitude([1.0])
    near = (A > 0.52) & (A < 0.545)
    found = stability(softening, np.flatnonzero(near))
    order = np.argsort(A[near])
    pair = [
        np.interp(0.5373, A[near][order], np.abs(part(found.largest))[order])
        for part in (np.real, np.imag)
    ]
    assert pair == pytest.approx([0.914, 0.073], abs=1e-3)


# -- sliders ---------------------------------------------------------------------------------------


def test_a_slider_that_sticks_is_left_out_and_one_that_slips_forgets() -> None:
    def answered(limit: float) -> Any:
        slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=limit)
        system = System(([[1.0]], [[0.02]], [[1.0]]), slider, harmonics=(1, 3, 5))
        return stability(frequency_response(system, harmonic_force=[0.3], frequencies=[0.18]))

    stuck, slips = answered(100.0), answered(0.2)
    assert len(stuck.multipliers[0]) == 2
    # exp(-c T / 2): that of the linear oscillator
    assert np.abs(stuck.largest[0]) == pytest.approx(np.exp(-0.01 / 0.18), rel=3e-5)
    assert len(slips.multipliers[0]) == 3
    assert np.abs(slips.multipliers[0][-1]) < 1e-9
    assert slips.label == stuck.label == ("stable",)


def test_friction_along_two_directions_is_what_differences_of_marched_periods_give() -> None:
    """The same scheme, written out, marched to a periodic motion; each state moved a little."""
    n, w = 512, 1.3
    rng = np.random.default_rng(5)
    R = rng.normal(size=(3, 3))
    K = np.diag([1.0, 2.0, 3.0]) + 0.1 * (R + R.T)
    values, shapes = np.linalg.eigh(K)
    Psi, zeta = shapes.copy(), np.array([0.05, 0.08, 0.06])
    k_n, k_t, mu, preload = 0.7, 0.9, 0.2, 1.0
    load = shapes.T @ np.array([0.05, 0.3 + 0.2j, 0.5j])
    dt = 2 * np.pi / w / n
    S = np.linalg.inv(np.eye(3) + 0.5 * dt * np.diag(zeta) + 0.25 * dt**2 * np.diag(values))
    Gamma = 0.25 * dt**2 * Psi @ S @ Psi.T

    def law(q: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        N = max(0.0, preload + k_n * q[0])
        trial = k_t * (q[1:] - z)
        r = float(np.hypot(*trial))
        T = trial if r <= mu * N else trial * (mu * N / r)
        return np.array([N, *T]), q[1:] - T / k_t

    def period(state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        x, v, z = state[:3], state[3:6], state[6:]
        pushed = [(load * np.exp(2j * np.pi * j / n)).real for j in range(n + 1)]
        f, _ = law(Psi @ x, z)
        a = pushed[0] - zeta * v - values * x - Psi.T @ f
        ws, fs = np.zeros((3, n)), np.zeros((3, n))
        for j in range(1, n + 1):
            x0, v0 = x + dt * v + 0.25 * dt**2 * a, v + 0.5 * dt * a
            free = S @ (pushed[j] - zeta * v0 - values * x0)
            base = Psi @ (x0 + 0.25 * dt**2 * free)
            q = Psi @ x
            for _ in range(5):
                q = base - Gamma @ law(q, z)[0]
            f, z = law(q, z)
            a = free - S @ (Psi.T @ f)
            x, v = x0 + 0.25 * dt**2 * a, v0 + 0.5 * dt * a
            ws[:, j % n], fs[:, j % n] = q, f
        return np.concatenate([x, v, z]), ws, fs

    state = np.zeros(8)
    for _ in range(40):
        state, ws, fs = period(state)
    points = contacts(
        [[1.0, 0, 0]], [[[0, 1.0, 0]], [[0, 0, 1.0]]], k_n=k_n, k_t=k_t, mu=mu, preload=preload
    )
    given = System((np.eye(3), np.diag(zeta), K), points)
    b = given.balance("stability", np.ones(1), None, fast_exits=True)
    found = period_map(values, zeta, Psi, changes(b, ws[None], fs[None]), dt)
    h = 1e-6
    moved = np.array(
        [(period(state + h * e)[0] - period(state - h * e)[0]) / (2 * h) for e in np.eye(8)]
    ).T
    assert np.sort(np.abs(np.linalg.eigvals(found))) == pytest.approx(
        np.sort(np.abs(np.linalg.eigvals(moved))), abs=1e-4
    )


# -- input -----------------------------------------------------------------------------------------


def test_bad_input_names_every_fault(softening: FrequencyResponse) -> None:
    with pytest.raises(InputError, match=r"points \[100000\].*; 20 steps cannot carry harmonic 15"):
        stability(softening, [100000], steps=20)
