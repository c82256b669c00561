"""Forced response against closed forms.

Oscillator on a Jenkins element, Den Hartog, linear limits, a rigid damper in its wedge.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from upd.hbm import (
    FrequencyResponse,
    Settings,
    System,
    contact_rows,
    contacts,
    frequency_response,
    rigid_damper,
)
from upd.hbm.springs.checks import loop_area
from upd.hbm.springs.response import parabola
from upd.reference import den_hartog_amplitude
from upd.reference.friction import (
    jenkins_optimum,
    jenkins_optimum_frequency,
    jenkins_peak,
    jenkins_peak_frequency,
)

K, K_T, F = 1.0, 0.6, 0.2
HZ = 1 / (2 * np.pi)


def oscillator(
    limit: float,
    w: np.ndarray,
    *,
    k_t: float = K_T,
    c: float = 0.0,
    load: float = F,
    fast_exits: bool = True,
    **options: Any,
) -> FrequencyResponse:
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=k_t, mu=1.0, preload=limit)
    given: dict[str, Any] = {"harmonics": (1,), "samples": 1024} | options
    return frequency_response(
        System(([[1.0]], [[c]], [[K]]), slider, **given),
        harmonic_force=[load],
        frequencies=w * HZ,
        fast_exits=fast_exits,
    )


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.6])
def test_jenkins_resonance(factor: float) -> None:
    limit = factor * np.pi * F / 2
    A, w = jenkins_peak(limit, F, K_T), jenkins_peak_frequency(limit, F, 1.0, K, K_T)
    answer = oscillator(limit, np.linspace(0.9 * w, 1.1 * w, 401))
    frequency, peak = answer.peak([1.0])
    assert answer.status == "complete"
    assert peak == pytest.approx(A, rel=1e-3)
    assert frequency / HZ == pytest.approx(w, rel=1e-3)


def test_best_friction_limit() -> None:
    best, A = jenkins_optimum(F, K_T)
    w = jenkins_optimum_frequency(1.0, K, K_T)
    limits = best * np.array([0.95, 1.0, 1.05])
    peaks = np.array(
        [oscillator(limit, np.linspace(0.9 * w, 1.1 * w, 201)).peak([1.0])[1] for limit in limits]
    )
    where, least = parabola(limits, -peaks)
    assert -least == pytest.approx(A, rel=1e-3)
    assert where == pytest.approx(best, rel=1e-2)


@pytest.mark.parametrize(("g", "amplitude"), [(0.8, 2.626105), (1.3, 1.315348)])
def test_den_hartog(g: float, amplitude: float) -> None:
    # the force turns over a phase of sqrt(4 mu N/(k_t x_0)): 1e6 times the spring leaves a lag
    # below 1e-3; the square wave of the force makes the error fall as one over the harmonics: 0.28
    # % with 15, 0.14 % with 31, 0.08 % with 63
    answer = oscillator(
        0.3, np.array([g]), k_t=1e6, load=1.0, harmonics=range(1, 64, 2), samples=8192
    )
    x = answer.balance.E @ answer.coefficients[0, 0]
    assert amplitude == pytest.approx(den_hartog_amplitude(g, 0.3), rel=1e-6)
    assert x.max() == pytest.approx(amplitude, rel=1e-3)


def test_no_friction_is_the_free_curve_and_much_is_the_stuck_one() -> None:
    w = np.linspace(0.5, 2.0, 61)
    for limit, name in ((1e-12, "free"), (1e12, "stuck")):
        answer = oscillator(limit, w, c=0.02)
        exact = 1 / np.abs(
            K
            + (K_T if name == "stuck" else 0.0)
            - (answer.frequency / HZ) ** 2
            + 0.02j * answer.frequency / HZ
        )
        np.testing.assert_allclose(answer.amplitude([1.0]), F * exact, rtol=1e-8)
        np.testing.assert_allclose(getattr(answer, name)([1.0]), F * exact, rtol=1e-12)
    assert answer.linear.all()


def test_exits_change_nothing() -> None:
    w = np.linspace(0.6, 1.6, 41)
    quick, slow = (oscillator(0.25, w, c=0.05, fast_exits=fast) for fast in (True, False))
    assert quick.linear.any()
    assert not quick.linear.all()
    at = [np.argmin(np.abs(a.frequency[:, None] - w * HZ), axis=0) for a in (quick, slow)]
    np.testing.assert_allclose(
        quick.amplitude([1.0])[at[0]], slow.amplitude([1.0])[at[1]], rtol=1e-8
    )


def wedge(angle: float, CF: float, mu: float, load: float) -> FrequencyResponse:
    """A prism on eight points in a symmetric wedge of two masses on springs.

    Faces at `angle` to the vertical pull z.

    Two rows per face: on one row the normals of both faces meet in a line, about which nothing but
    friction holds the prism.
    """
    c, s = np.cos(angle), np.sin(angle)
    slope = [
        [0.0, y, 0.0] + h * np.array([side * c, 0.0, -s])
        for side in (-1.0, 1.0)
        for y in (-1.0, 1.0)
        for h in (-0.5, 0.5)
    ]
    positions = np.array(slope) + np.repeat([[-1.0, 0, 0], [1.0, 0, 0]], 4, axis=0)
    # normals of the damper towards each blade, tangents up the slope and along y
    frames = np.array(
        [[[sign * s, 0, c], [sign * c, 0, -s], [0, 1, 0]] for sign in np.repeat([-1, 1], 4)],
        dtype=float,
    )
    damper = rigid_damper(0.02, [0.01, 0.01, 0.01], [0.0, 0.0, 0.0], [0.0, 0.0, CF])
    blade = np.zeros((8, 3, 6))
    for p, side in enumerate(np.repeat([0, 1], 4)):
        blade[p, :, 3 * side : 3 * side + 3] = -frames[p]
    points = contacts(blade[:, 0], np.swapaxes(blade[:, 1:], 0, 1), k_n=50.0, k_t=40.0, mu=mu)
    force = np.zeros(6)
    force[0], force[3] = load, -load
    return frequency_response(
        System(
            (np.eye(6), 0.02 * np.eye(6), np.eye(6)),
            points,
            damper=damper,
            damper_rows=contact_rows(damper, positions, frames),
            samples=256,
        ),
        harmonic_force=force,
        frequencies=[0.3, 0.31],
        settings=Settings(tolerance=1e-15),
    )


def test_frictionless_wedge_carries_the_centrifugal_force() -> None:
    # balance along z: eight normal forces N cos(angle) = CF
    answer = wedge(np.pi / 4, 10.0, 0.0, 1e-3)
    assert answer.status == "complete"
    np.testing.assert_allclose(
        answer.contact_force[:, :, 0, 0], 10.0 / (8 * np.cos(np.pi / 4)), rtol=1e-9
    )


def test_damper_is_in_equilibrium_with_friction() -> None:
    answer = wedge(np.pi / 4, 10.0, 0.4, 0.5)
    b = answer.balance
    held = np.einsum("pri,nprk->nik", b.contacts.rows, answer.contact_force)[:, 6:]
    np.testing.assert_allclose(
        held[..., 0], np.broadcast_to([0, 0, 10.0, 0, 0, 0], held.shape[:2]), atol=1e-9 * 10
    )
    inertia = np.einsum("ij,njk->nik", np.diag([0.02] * 3 + [0.01] * 3), answer.coefficients[:, 6:])
    w2 = (2 * np.pi * answer.frequency) ** 2
    np.testing.assert_allclose(held[..., 1:], w2[:, None, None] * inertia[..., 1:], atol=1e-9 * 10)
    # every point sticks; of work and viscous loss the residual R of the solved balance leaves
    # pi F R at most, and R is rounding
    for i, x in enumerate(answer.x):
        w = 2 * np.pi * float(answer.frequency[i])
        R = b.linearised(x, w, False)[0]
        assert np.abs(R).max() < 1e-12 * np.abs(x).max()
        left = np.pi * np.linalg.norm(answer.contact_force[i]) * np.linalg.norm(R)
        viscous = np.pi * w * 0.02 * np.sum(answer.coefficients[i, :6, 1:] ** 2)
        assert abs(answer.energy_balance[i]) < left / (2 * viscous)
    # That bound takes every part of R along the velocity. Rounding has no such order: a load that
    # works two thousand times the loss, with R of 1e-12, leaves some 1e-9.
    assert np.abs(answer.energy_balance).max() < 1e-8


@pytest.mark.parametrize("fast_exits", [True, False])
@pytest.mark.parametrize("harmonics", [(0, 1), range(6)])
def test_points_that_always_stick_lose_nothing(harmonics: range, fast_exits: bool) -> None:
    """Not the rounding of f dw either: a loss of -3e-17 N mm is no number to print."""
    rng = np.random.default_rng(3)
    A = rng.normal(size=(4, 4))
    stiff = A @ A.T + 3.0 * np.eye(4)
    points = contacts(
        0.3 * np.eye(2, 4), [np.eye(2, 4, 1)], k_n=2.0, k_t=1.0, mu=0.5, preload=[60.0, 90.0]
    )
    answer = frequency_response(
        System(
            (np.eye(4), 0.02 * stiff, stiff),
            points,
            static_force=points.rows[:, 0].T @ points.law.preload,
            harmonics=harmonics,
        ),
        harmonic_force=[1.0, 0.5, 0.0, 0.2],
        frequencies=np.linspace(0.1, 0.6, 12),
        fast_exits=fast_exits,
    )
    assert answer.state[..., 0].min() == 1.0
    assert np.all(answer.energy == 0.0)


def test_a_thin_loop_keeps_its_area() -> None:
    """F = k w turned by a loss angle of 1e-10: pi k w^2 sin, far below w k w but above rounding."""
    angle, k, w = 1e-10, 3.0, np.array([0.2, 0.5])
    W = np.array([0.1, *w]).reshape(1, 1, 1, 3)
    F = k * np.array([0.1, w[0] - angle * w[1], w[1] + angle * w[0]]).reshape(1, 1, 1, 3)
    area = loop_area(F, W, 1, np.array([1]), 128)
    assert area[0, 0] == pytest.approx(-np.pi * k * angle * (w @ w), rel=1e-4)
    # the same angle of rounding's size is none
    F = k * np.array([0.1, w[0] - 1e-16 * w[1], w[1] * (1 + 2.3e-16)]).reshape(1, 1, 1, 3)
    assert loop_area(F, W, 1, np.array([1]), 128)[0, 0] == 0.0
