"""Damped nonlinear modes: the Jenkins element in closed form and by shooting, a public benchmark by
shooting, forced peaks against harmonic balance, the Jacobian by differences.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

import upd.hbm.springs.nonlinear_mode as nonlinear_modes
from upd.errors import InputError
from upd.hbm import (
    NonlinearMode,
    Path,
    PathProblem,
    System,
    contacts,
    frequency_response,
    nonlinear_mode,
)
from upd.hbm.springs.coulomb import LIFT, SLIP, STICK
from upd.hbm.springs.nonlinear_mode import ExtendedBalance, stuck_modes
from upd.reference.friction import jenkins_peak

FloatArray = NDArray[np.float64]
JENKINS: dict[str, Any] = {"k_n": 0.0, "k_t": 0.25, "mu": 1.0, "preload": 1.0}
X_C = 4.0
#: a/x_c -> omega, zeta by shooting of m = k = 1 (9 harmonics agree with it to 3e-7)
EXACT = {
    2.0: (1.0607723, 0.0353544),
    5.0: (1.0175799, 0.0246503),
    10.0: (1.0064451, 0.0141610),
    20.0: (1.0023186, 0.0075299),
    50.0: (1.0005931, 0.0031164),
}


def jenkins(amplitudes: Any, **options: Any) -> NonlinearMode:
    points = contacts([[0.0]], [[1.0]], **JENKINS)
    return nonlinear_mode(
        System(([[1.0]], [[0.0]], [[1.0]]), points, **options), mode=1, amplitudes=amplitudes
    )


def at(mode: NonlinearMode, amplitude: float) -> tuple[float, float]:
    """omega and zeta at an amplitude that was asked for."""
    k = int(np.argmin(np.abs(mode.amplitude / amplitude - 1.0)))
    assert mode.amplitude[k] == pytest.approx(amplitude, rel=1e-9)
    return float(2 * np.pi * mode.frequency[k]), float(mode.damping[k])


def test_one_harmonic_is_the_closed_form() -> None:
    """a1 = (k_t A/pi)(th - sin(2 th)/2), b1 = (4 mu N/pi)(1 - x_c/A), th = acos(1 - 2 x_c/A)."""
    ratios = np.array([1.2, 2.0, 5.0, 20.0])
    mode = jenkins(ratios * X_C, harmonics=(1,), samples=2**15)
    assert mode.status == "complete"
    for A in ratios * X_C:
        th = np.arccos(1 - 2 * X_C / A)
        stiffness = 1 + 0.25 / np.pi * (th - np.sin(2 * th) / 2)
        omega = np.sqrt(stiffness)
        zeta = 4 / np.pi * (1 - X_C / A) / A / (2 * omega**2)
        found = at(mode, A)
        assert found == pytest.approx((omega, zeta), rel=1e-7)


def test_nine_harmonics_are_what_shooting_finds() -> None:
    mode = jenkins(np.array([*EXACT]) * X_C, samples=2048)
    for ratio, exact in EXACT.items():
        omega, zeta = at(mode, ratio * X_C)
        assert omega == pytest.approx(exact[0], rel=1e-6)
        assert zeta == pytest.approx(exact[1], abs=1e-6)


def test_the_largest_damping() -> None:
    mode = jenkins(X_C * np.geomspace(2.0, 2.4, 9), samples=2048)
    zeta, amplitude, _ = mode.largest_damping
    assert zeta == pytest.approx(0.0355589, rel=1e-5)
    assert amplitude / X_C == pytest.approx(2.1636, rel=5e-3)


def test_below_first_slip_it_is_the_stuck_mode() -> None:
    mode = jenkins([0.1, 1.0, 3.9])
    np.testing.assert_allclose(2 * np.pi * mode.frequency, np.sqrt(1.25), rtol=1e-12)
    assert np.abs(mode.damping).max() < 1e-12
    assert (mode.state[:, 0, 0] == 1.0).all()


def test_viscous_damping_adds() -> None:
    points = contacts([[0.0]], [[1.0]], **JENKINS)
    mode = nonlinear_mode(
        System(([[1.0]], [[0.02]], [[1.0]]), points, harmonics=(1, 3)),
        mode=1,
        amplitudes=[0.5, 1.0],
    )
    np.testing.assert_allclose(mode.damping * 2 * (2 * np.pi * mode.frequency), 0.02, rtol=1e-9)


# -- the public blade-damper-blade benchmark -------------------------------------------------------

M = np.diag([1.0, 1, 1, 1, 0.1, 0.1])
C = np.diag([20.0] * 4 + [0, 0])
STATIC = [0, 0, 0, 0, 0, 120.0]
FORCE = -1j * np.array([0, -20, 5, 0, 0, 0])
Y2 = np.eye(6)[3]
#: mode, start of the sliders -> log10 a -> Hz, damping in per cent, by shooting
BENCHMARK = {
    (3, "zero"): {-4.0: (222.9916, 2.1716), -3.8: (212.9318, 4.6632), -3.6: (207.1169, 4.1153)},
    (3, "upper"): {-4.0: (224.9565, 0.9067), -3.8: (216.4494, 4.2933), -3.6: (208.6737, 4.4326)},
    (2, "zero"): {-3.5: (161.9810, 0.9681), -3.3: (160.6857, 1.9013), -3.2: (157.9843, 2.0170)},
}


def benchmark(mode: int, amplitudes: Any, **options: Any) -> NonlinearMode:
    """After N. N. Balaji, repository nonuniq: see tests/literature/test_hbm_blade_damper_blade."""
    K = np.diag([3e5] * 4 + [0, 0])
    for i, j, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
        K[np.ix_([i, j], [i, j])] += k * np.array([[1, -1], [-1, 1]])
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    normal = [[s, -c, 0, 0, -s, c], [0, 0, -s, -c, s, c]]
    tangent = [[[-c, -s, 0, 0, c, s], [0, 0, -c, s, c, -s]]]
    points = contacts(normal, tangent, k_n=3e5, k_t=3e5, mu=0.5)
    given: dict[str, Any] = {"static_force": STATIC, "harmonics": range(10)} | options
    return nonlinear_mode(System((M, C, K), points, **given), mode=mode, amplitudes=amplitudes)


@pytest.mark.parametrize(("mode", "start"), [*BENCHMARK])
def test_benchmark_is_what_shooting_finds(mode: int, start: str) -> None:
    known = BENCHMARK[mode, start]
    found = benchmark(mode, 10.0 ** np.array([*known]), start=start)
    for log_a, (hertz, per_cent) in known.items():
        omega, zeta = at(found, 10.0**log_a)
        assert omega / (2 * np.pi) == pytest.approx(hertz, abs=0.01)
        assert 100 * zeta == pytest.approx(per_cent, abs=2e-3)


def test_forced_peaks_from_the_mode_and_the_linear_rest() -> None:
    """Heights of harmonic balance at a quarter, half and all of the load: .06, .25, .71 % off."""
    mode = benchmark(3, [1e-6, 1e-5, 10**-3.4])
    assert mode.largest_damping[0] == pytest.approx(0.046802, rel=1e-3)
    known = {
        0.25: (4.3205e-5, 224.009, 0.0006),
        0.5: (4.9856e-5, 222.024, 0.0025),
        1.0: (6.0821e-5, 217.855, 0.0071),
    }
    for load, (height, hertz, off) in known.items():
        f, found = mode.peak(load * FORCE, Y2)
        assert found == pytest.approx(height, rel=off + 1e-4)
        assert f == pytest.approx(hertz, rel=1e-3)
    with pytest.raises(InputError, match="beyond its amplitudes"):
        benchmark(3, [1e-6, 1e-5]).peak(FORCE, Y2)


def test_best_preload_of_the_benchmark_is_that_of_curves() -> None:
    """Peaks of whole curves at .3 to 1 times the static load: least at .41, 3.98e-5 m."""
    mode = benchmark(3, np.geomspace(1e-6, 10**-3.4, 40))
    factor, worst = mode.best_preload(FORCE, Y2)
    assert factor == pytest.approx(0.41, rel=0.05)
    assert worst == pytest.approx(3.98e-5, rel=0.05)


def test_a_path_that_stops_is_taken_up_with_shorter_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    amplitudes = X_C * np.geomspace(0.5, 50.0, 9)
    whole, steps, follow = jenkins(amplitudes), [], nonlinear_modes.follow

    def closed(problem: PathProblem, *args: Any, **options: Any) -> Path:
        path = follow(problem, *args, **options)
        steps.append(problem.settings.angle)
        if len(steps) > 1:
            return path
        # beyond the fifth amplitude, as where it crosses to a closed path
        end = int(np.argmax(path.p > np.log(amplitudes[4]))) + 1
        return replace(path, x=path.x[:end], p=path.p[:end], status="stopped", message="closed")

    monkeypatch.setattr(nonlinear_modes, "follow", closed)
    found = jenkins(amplitudes)
    assert found.status == "complete" and found.message.startswith("closed; taken up")
    assert steps == [0.35, 0.175] and len(found.amplitude) > len(whole.amplitude)
    assert (np.diff(found.amplitude) > 0.0).all()
    for a in amplitudes:
        assert at(found, a) == pytest.approx(at(whole, a), rel=1e-9)


def test_amplitude_turns_back_under_lift_off() -> None:
    """Past 10^-3.203 the contacts open and the amplitude falls: arc length passes the turn."""
    mode = benchmark(3, [1e-4, 10**-3.2])
    assert mode.status == "complete"
    assert (np.diff(mode.amplitude) < 0.0).any()
    assert mode.state[-1, :, 2].min() > 0.5


@pytest.mark.parametrize(
    ("amplitude", "states"),
    [(0.5, {STICK}), (1.6, {STICK, SLIP}), (3.0, {STICK, SLIP, LIFT}), (12.0, {STICK, SLIP, LIFT})],
)
@pytest.mark.parametrize("proportional", [True, False])
def test_jacobian_by_differences(amplitude: float, states: set[int], proportional: bool) -> None:
    """In stick, slip and with lift-off."""
    one = np.diag([1.0, 2.0])
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    damping = 0.01 * K if proportional else np.diag([0.01, 0.05])
    points = contacts(
        [[0.0, 0.0], [0.5, 0.2]],
        [[[1.0, 0.0], [0.3, -0.4]]],
        k_n=[0.0, 0.2],
        k_t=0.25,
        mu=1.0,
        preload=[1.0, 0.3],
    )
    static = np.array([0.1, 0.05])
    given = System((one, damping, K), points, static, harmonics=range(4), samples=256)
    b = given.balance("nonlinear_mode", np.ones(1), None, fast_exits=False)
    stuck, omegas, number = stuck_modes(b, 1)
    extended = ExtendedBalance(b, stuck[:, number], float(omegas[number]))
    p, rng, h = np.log(amplitude), np.random.default_rng(0), 1e-6
    X = extended.guess(p)
    X[:-2] += 0.1 * amplitude * rng.standard_normal(len(X) - 2)
    X[-1] = 0.03
    assert set(b.period(X[:-2]).state.ravel()) == states
    _, J, by_p = extended.function(X, p, True)
    assert J is not None

    def difference(step: FloatArray, dp: float = 0.0) -> FloatArray:
        up, down = (extended.function(X + s * step, p + s * dp, False)[0] for s in (h, -h))
        return (up - down) / (2 * h)

    found = np.array([difference(e) for e in np.eye(len(X))]).T
    np.testing.assert_allclose(J, found, atol=1e-7 * np.abs(J).max())
    np.testing.assert_allclose(by_p, difference(np.zeros(len(X)), 1.0), atol=1e-8)


def test_ten_lines_at_most_show_a_mode() -> None:
    lines = repr(jenkins([1.0, 8.0])).splitlines()
    assert len(lines) <= 10
    assert "damping" in lines[0]


def test_energy_of_the_friction_is_that_of_the_damping() -> None:
    """What friction takes in a period is 2 pi zeta omega^2 a^2 where nothing else damps."""
    mode = jenkins(X_C * np.array([1.5, 3.0]), samples=2048)
    omega = 2 * np.pi * mode.frequency
    # all of it in the fundamental: the others carry no extra damping but their own xi k omega
    lost = 2 * np.pi * mode.damping * omega**2 * mode.amplitude**2
    assert mode.energy[:, 0] == pytest.approx(lost, rel=2e-3, abs=1e-6)


def test_peak_of_one_degree_of_freedom_is_that_of_harmonic_balance() -> None:
    force = 0.8
    mode = jenkins(X_C * np.geomspace(1.01, 30.0, 20), harmonics=(1,), samples=2048)
    points = contacts([[0.0]], [[1.0]], **JENKINS)
    omega = np.linspace(0.953, 1.151, 100)
    system = System(([[1.0]], [[0.0]], [[1.0]]), points, harmonics=(1,), samples=2048)
    answer = frequency_response(system, harmonic_force=[force], frequencies=omega / (2 * np.pi))
    # the mode's damping force grows with the frequency, that of friction does not
    assert mode.peak([force], [1.0])[1] == pytest.approx(answer.peak([1.0])[1], rel=5e-3)


def test_best_preload_is_the_closed_form() -> None:
    """Jenkins, one harmonic: A = (mu N/k_t) / (1 - pi F/(4 mu N)), least at mu N = pi F/2 with
    A = pi F/k_t; over a range of loads where the peaks of its ends are alike.
    """
    k_t, loads = 0.3, (0.6, 1.1)
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=k_t, mu=1.0, preload=1.0)
    mode = nonlinear_mode(
        System(([[1.0]], [[0.0]], [[1.0]]), slider, harmonics=(1,), samples=2048),
        mode=1,
        amplitudes=np.geomspace(1.0, 80.0, 60),
    )
    factor, worst = mode.best_preload([0.7], [1.0])
    assert worst == pytest.approx(0.7 * np.pi / k_t, rel=1e-3)
    # flat there
    assert factor == pytest.approx(0.35 * np.pi, rel=2e-2)
    exact = minimize_scalar(
        lambda N: max(jenkins_peak(N, F, k_t) / F for F in loads), bounds=(1, 4), method="bounded"
    )
    factor, worst = mode.best_preload([1.0], [1.0], loads)
    assert (factor, worst) == pytest.approx((exact.x, exact.fun), rel=1e-2)
    with pytest.raises(InputError, match="must be above 0 and rising"):
        mode.best_preload([1.0], [1.0], (1.1, 0.6))
    with pytest.raises(InputError, match="give more amplitudes"):
        mode.best_preload([1.0], [1.0], (0.01, 100.0))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"amplitudes": [0.0, 1.0]}, "amplitudes must be"),
        ({"amplitudes": [2.0, 1.0]}, "rising"),
        ({"harmonics": (0, 2)}, "lack 1"),
        ({"harmonics": (1, 3), "static_force": [1.0]}, "would have no effect"),
        ({"slider": [0.1, 0.2]}, "every point along every tangent"),
        ({"static_force": [1.0, 2.0]}, "static_force has shape"),
        ({"damper_rows": np.zeros((1, 2, 6))}, "come together"),
        ({"mode": 0}, "mode 0 is none; there are 1 to 1"),
        ({"mode": 2}, "mode 2 is none; there are 1 to 1"),
        ({"preload": -1.0}, "preload"),
    ],
)
def test_faults(change: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {"mode": 1, "amplitudes": [1.0, 2.0]} | change
    with pytest.raises(InputError, match=words):
        law = JENKINS | {name: given.pop(name) for name in ("preload",) if name in given}
        points = contacts([[0.0]], [[1.0]], **law)
        names = ("harmonics", "static_force", "slider", "damper_rows")
        own = {name: given.pop(name) for name in names if name in given}
        nonlinear_mode(System(([[1.0]], [[0.0]], [[1.0]]), points, **own), **given)
