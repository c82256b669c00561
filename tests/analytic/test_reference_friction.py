"""Jenkins element and Den Hartog's oscillator against time marches, Fourier sums, optimisation and
printed numbers.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize_scalar

import upd.reference as ref
from upd.errors import InputError

K_T, MU, N = 1e3, 0.5, 20.0
X_C = MU * N / K_T
EPS = np.finfo(float).eps


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.01, 1.7, 10.0])
def test_first_harmonic_and_loop_by_marching(ratio):
    A = ratio * X_C
    n = 4096
    theta = 2 * np.pi * np.arange(-n, 2 * n) / n
    f = ref.jenkins_force(A * np.cos(theta), K_T, MU, N)[2 * n :]
    t = theta[2 * n :]
    a1, b1 = ref.jenkins_harmonic(A, K_T, MU, N)
    # the corners of f cost (2 pi/n)^2 of its slope
    tolerance = (2 * np.pi / n) ** 2 * K_T * A
    if ratio <= 1:
        assert (a1, b1) == pytest.approx((K_T * A, 0.0), rel=4 * EPS, abs=4 * EPS)
    else:
        assert (2 * f @ np.cos(t) / n, 2 * f @ np.sin(t) / n) == pytest.approx(
            (a1, b1), abs=tolerance
        )
        area = -np.sum(f * A * np.sin(t)) * (2 * np.pi / n) * 1.0
        assert ref.jenkins_loop_area(A, K_T, MU, N) == pytest.approx(
            area, abs=2 * np.pi * A * tolerance
        )
    assert ref.jenkins_loop_area(A, K_T, MU, N) == pytest.approx(
        -np.pi * A * b1, rel=20 * EPS, abs=EPS * K_T * A**2
    )


@given(ratio=st.floats(0.0, 1e3), s=st.floats(0.01, 100.0))
@settings(max_examples=50, deadline=None)
def test_scaling_with_the_normal_load(ratio, s):
    one, other = (
        ref.jenkins_harmonic(ratio * X_C, K_T, MU, N),
        ref.jenkins_harmonic(s * ratio * X_C, K_T, MU, s * N),
    )
    # at first slip the angle changes as the root of the amplitude: eps^(1/2) there, but a1 only to
    # eps
    assert np.array(other) / s == pytest.approx(np.array(one), rel=1e-9, abs=1e2 * EPS * MU * N)


def test_first_harmonic_limits():
    a1, b1 = ref.jenkins_harmonic(np.array([0.0, X_C, 1e4 * X_C]), K_T, MU, N)
    assert a1[0] == 0
    assert a1[1] == pytest.approx(K_T * X_C, rel=4 * EPS)
    # pure friction: a1/(mu N) -> 16/(3 pi) sqrt(x_c/A) at large A
    assert a1[2] == pytest.approx(16 / (3 * np.pi) * MU * N * np.sqrt(1e-4), rel=1e-3)
    assert b1[2] == pytest.approx(-4 * MU * N / np.pi, rel=1.01e-4)


def test_peak_balances_friction_and_force():
    F = 5.0
    mu_N = np.array([4.5, 8.0, 50.0])
    A = ref.jenkins_peak(mu_N, F, K_T)
    for limit, amplitude in zip(mu_N, A, strict=True):
        assert -ref.jenkins_harmonic(amplitude, K_T, 1.0, limit)[1] == pytest.approx(
            F, rel=20 * EPS * limit / F
        )


def test_peak_is_the_top_of_the_resonance_curve():
    F, m, k, limit = 5.0, 2e-3, 3e3, 9.0
    top = float(ref.jenkins_peak(limit, F, K_T))
    low, high = ref.jenkins_frequencies(np.array([0.9, 1 - 1e-10]) * top, F, m, k, K_T, 1.0, limit)
    w = ref.jenkins_peak_frequency(limit, F, m, k, K_T)
    assert low[0] < w < high[0]
    # the curve closes as the root of the distance from the top
    assert (low[1], high[1]) == pytest.approx((w, w), rel=1e-4)
    with pytest.raises(InputError, match="jenkins_peak"):
        ref.jenkins_frequencies(1.01 * top, F, m, k, K_T, 1.0, limit)


def test_resonance_curve_solves_the_balance():
    F, m, k, limit = 5.0, 2e-3, 3e3, 9.0
    A = float(ref.jenkins_peak(limit, F, K_T)) * np.array([0.3, 0.6, 0.95])
    a1, b1 = ref.jenkins_harmonic(A, K_T, 1.0, limit)
    for w in ref.jenkins_frequencies(A, F, m, k, K_T, 1.0, limit):
        assert np.hypot((k - m * w**2) * A + a1, b1) == pytest.approx(F, rel=1e3 * EPS)
    stiff = ref.jenkins_frequencies(0.1 * F / (k + K_T), F, m, k, K_T, 1.0, limit)
    assert np.isnan(stiff[0])
    assert stiff[1] == pytest.approx(np.sqrt(11 * (k + K_T) / m), rel=20 * EPS)


def test_optimum_is_the_least_peak():
    F, m, k = 5.0, 2e-3, 3e3
    best, A = ref.jenkins_optimum(F, K_T)
    found = minimize_scalar(
        lambda limit: ref.jenkins_peak(limit, F, K_T),
        bounds=(F, 5 * F),
        method="bounded",
        options={"xatol": 1e-9},
    )
    # flat minimum: half the digits of the place
    assert found.x == pytest.approx(best, rel=10 * np.sqrt(EPS))
    assert found.fun == pytest.approx(A, rel=100 * EPS)
    assert ref.jenkins_peak_frequency(best, F, m, k, K_T) == pytest.approx(
        ref.jenkins_optimum_frequency(m, k, K_T), rel=20 * EPS
    )


@pytest.mark.parametrize(("g", "printed"), [(0.8, 2.626105), (1.3, 1.315348)])
def test_den_hartog_values(g, printed):
    assert ref.den_hartog_amplitude(g, 0.3) == pytest.approx(printed, abs=5e-7)


def half_cycle(x, tau, g, friction):
    """Exact motion with m = k = F = 1 from rest at x, time tau, to the next turning point.

    (x, tau). Force cos(g tau).
    """
    direction = np.sign(np.cos(g * tau) - x)
    assert abs(np.cos(g * tau) - x) > friction, "the mass stops"
    V = 1 / (1 - g**2)
    a = x + direction * friction - V * np.cos(g * tau)
    b = V * g * np.sin(g * tau)

    def velocity(t):
        return -V * g * np.sin(g * (tau + t)) - a * np.sin(t) + b * np.cos(t)

    t = np.linspace(0, 2 * np.pi * max(1, 1 / g), 2000)[1:]
    crossing = int(np.argmax(direction * velocity(t) < 0))
    assert crossing > 0
    end = brentq(velocity, t[crossing - 1], t[crossing], xtol=1e-14)
    return V * np.cos(g * (tau + end)) + a * np.cos(end) + b * np.sin(
        end
    ) - direction * friction, tau + end


@pytest.mark.parametrize(
    ("g", "friction"), [(0.8, 0.3), (1.3, 0.3), (0.6, 0.2), (0.4, 0.1), (0.95, 0.7), (2.0, 0.05)]
)
def test_den_hartog_is_the_steady_motion(g, friction):
    x_0, lag = ref.den_hartog_amplitude(g, friction), ref.den_hartog_phase(g, friction)
    # on the orbit: half a period later, at the opposite point
    x, tau = half_cycle(x_0, lag / g, g, friction)
    assert (x, tau - lag / g) == pytest.approx((-x_0, np.pi / g), rel=1e-9)
    # off the orbit: the motion comes back to it
    x, tau = 1.05 * x_0, lag / g
    for _ in range(600):
        x, tau = half_cycle(x, tau, g, friction)
    assert abs(x) == pytest.approx(x_0, rel=1e-6)


@pytest.mark.parametrize("g", [0.3, 0.45, 0.8, 1.3])
def test_den_hartog_stop_limit_is_sharp(g):
    """Just inside the limit the velocity keeps its sign for half a period.

    Just outside the mass turns or sticks too early.
    """
    V, U = ref.den_hartog_functions(g)
    limit = abs(V) / np.hypot(U, ref.den_hartog_stop_limit(g))
    friction = limit * (1 - 1e-3)
    x_0, lag = ref.den_hartog_amplitude(g, friction), ref.den_hartog_phase(g, friction)
    x, tau = half_cycle(x_0, lag / g, g, friction)
    assert (x, tau - lag / g) == pytest.approx((-x_0, np.pi / g), rel=1e-9)

    friction = limit * (1 + 1e-3)
    with pytest.raises(InputError, match="stops within the cycle"):
        ref.den_hartog_amplitude(g, friction)
    x_0, lag = (
        np.sqrt(V**2 - (friction * U) ** 2),
        np.arctan2(-friction * U / V, np.sqrt(V**2 - (friction * U) ** 2) / V),
    )
    s = np.pi * np.linspace(0, 1, 2001)[1:-1]
    velocity = -V * np.sin(s + lag) + friction / g * np.sin(s / g) - friction * U * np.cos(s / g)
    assert velocity.max() > 0


@given(g=st.floats(0.75, 1.6).filter(lambda g: abs(g - 1) > 0.01), friction=st.floats(0.0, 0.5))
@settings(max_examples=40, deadline=None)
def test_den_hartog_energy(g, friction):
    """Work of the force over half a cycle = friction times the path 2 x_0."""
    x_0, lag = ref.den_hartog_amplitude(g, friction), ref.den_hartog_phase(g, friction)
    V, U = ref.den_hartog_functions(g)
    node, weight = np.polynomial.legendre.leggauss(40)
    s = np.pi * (node + 1) / 2
    x = friction + V * np.cos(s + lag) - friction * np.cos(s / g) - friction * g * U * np.sin(s / g)
    assert x[0] < x_0 * (1 + 1e-9)
    velocity = -V * np.sin(s + lag) + friction / g * np.sin(s / g) - friction * U * np.cos(s / g)
    work = np.pi / 2 * weight @ (np.cos(s + lag) * velocity)
    assert work == pytest.approx(2 * friction * x_0, rel=1e-9, abs=1e3 * EPS * V**2)


def test_den_hartog_without_friction_is_the_linear_answer():
    g = np.array([0.5, 0.9, 1.1, 3.0])
    assert ref.den_hartog_amplitude(g, 0.0) == pytest.approx(np.abs(1 / (1 - g**2)), rel=8 * EPS)


def test_den_hartog_stop_limit():
    g = np.array([0.3, 0.8, 1.3, 4.0])
    S = ref.den_hartog_stop_limit(g)
    assert np.all(S * g**2 >= 1 - 4 * EPS)
    # at low frequency the limit lies inside the half-cycle
    assert S[0] > 1.01 / 0.09
    assert S[0] == ref.den_hartog_stop_limit(0.3)


@pytest.mark.parametrize(
    ("call", "names"),
    [
        (lambda: ref.den_hartog_amplitude(1.0, 0.3), "resonance"),
        (lambda: ref.den_hartog_amplitude(0.8, 0.95), "no steady motion without stops"),
        (lambda: ref.den_hartog_amplitude(1 / 3, 0.1), "no steady motion without stops"),
        (lambda: ref.den_hartog_amplitude(0.3, 0.15), "stops within the cycle"),
        (lambda: ref.den_hartog_amplitude(0.8, -0.1), "friction"),
        (lambda: ref.jenkins_peak(3.0, 5.0, K_T), "pi F/4"),
        (lambda: ref.jenkins_harmonic(-1.0, K_T, MU, N), "amplitude"),
        (lambda: ref.jenkins_harmonic(1.0, 0.0, MU, N), "k_t"),
        (lambda: ref.jenkins_force(np.zeros((2, 2)), K_T, MU, N), "shape"),
    ],
)
def test_refuses(call, names):
    with pytest.raises(InputError, match=names):
        call()
