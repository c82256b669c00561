"""Blade-damper-blade benchmark with six dofs.

Two wedge contacts with variable normal load and lift-off.

Source: N. N. Balaji, E. Ferhatoglu, codes of the paper "Vibration Response Variability in
Friction-Damped Systems: Quantification of the Influence of Contact and Traction Uncertainties",
repository nonuniq (2025), script a_hbfresp.m: its masses, springs, wedge, loads and range of
frequencies. The linear frequencies and the amplitudes with 15 harmonics are those of that script's
equations, from an independent implementation. Units SI (the solver only needs consistent ones).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upd.hbm import Contacts, FrequencyResponse, System, contacts, frequency_response, stability
from upd.hbm.springs.modal import modal
from upd.hbm.springs.time_integration import steady_state

M = np.diag([1.0, 1, 1, 1, 0.1, 0.1])
C = np.diag([20.0] * 4 + [0, 0])
Y2 = np.eye(6)[3]
CHECKS = {150.0: 2.7919e-5, 160.0: 2.0006e-4, 165.0: 1.5215e-4, 200.0: 3.2477e-5}


def stiffness() -> np.ndarray:
    K = np.diag([3e5] * 4 + [0, 0])
    for i, j, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
        K[np.ix_([i, j], [i, j])] += k * np.array([[1, -1], [-1, 1]])
    return K


def wedge() -> Contacts:
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    normal = [[s, -c, 0, 0, -s, c], [0, 0, -s, -c, s, c]]
    tangent = [[[-c, -s, 0, 0, c, s], [0, 0, -c, s, c, -s]]]
    return contacts(normal, tangent, k_n=3e5, k_t=3e5, mu=0.5)


def response(frequencies: Any, points: Contacts | None = None, **options: Any) -> FrequencyResponse:
    return frequency_response(
        System(
            (M, C, stiffness()),
            wedge() if points is None else points,
            static_force=[0, 0, 0, 0, 0, 120.0],
            **options,
        ),
        harmonic_force=-1j * np.array([0, -20, 5, 0, 0, 0]),
        frequencies=frequencies,
    )


@pytest.fixture(scope="module")
def curve() -> FrequencyResponse:
    grid = np.unique(
        np.concatenate([np.linspace(145, 235, 91), np.linspace(162, 164, 41), list(CHECKS)])
    )
    # the top is flat, 1e-4 over 0.1 Hz: 256 samples hold its place
    return response(grid, harmonics=range(16), samples=256)


def test_linear_frequencies() -> None:
    K, B = stiffness(), wedge().B
    free, stuck = modal(M, C, K), modal(M, C, K + 3e5 * B.T @ B)
    np.testing.assert_allclose(
        free.frequencies[1:5], [87.17275, 150.98764, 207.51266, 241.37042], rtol=1e-7
    )
    np.testing.assert_allclose(
        stuck.frequencies,
        [84.97105, 161.98103, 225.07908, 256.62963, 399.94984, 555.08743],
        rtol=1e-7,
    )
    assert free.rigid.tolist() == [True] + [False] * 5


def test_peak_with_lift_off(curve: FrequencyResponse) -> None:
    frequency, peak = curve.peak(Y2)
    assert curve.status == "complete"
    assert peak == pytest.approx(2.2733e-4, rel=1e-3)
    assert frequency == pytest.approx(162.96, abs=0.05)
    top = int(np.argmax(curve.amplitude(Y2)))
    assert curve.state[top, 0, 2] > 0.1
    assert curve.state[top, 1, 2] == 0.0


@pytest.mark.parametrize("frequency", [150.0, 165.0, 200.0])
def test_points(curve: FrequencyResponse, frequency: float) -> None:
    at = int(np.argmin(np.abs(curve.frequency - frequency)))
    assert curve.frequency[at] == pytest.approx(frequency, rel=1e-12)
    assert curve.amplitude(Y2)[at] == pytest.approx(CHECKS[frequency], rel=1e-4)


def test_160_hz_lies_in_the_spread_of_slider_starts() -> None:
    # point 2 sticks over the whole cycle at 160 Hz, so the answer is a band; the printed one is its
    # upper edge
    grid = np.array([145.0, 155, 160])
    answers = [
        response(grid, harmonics=range(16), samples=256, start=s).amplitude(Y2)[-1]
        for s in ("zero", "lower")
    ]
    assert answers[0] < CHECKS[160.0]
    assert answers[1] == pytest.approx(CHECKS[160.0], rel=2e-3)
    assert answers[1] / answers[0] - 1 < 5e-3


def test_energy_balance(curve: FrequencyResponse) -> None:
    assert np.abs(curve.energy_balance).max() < 1e-9
    assert curve.energy.min() > -1e-12 * curve.energy.max()
    assert curve.aliasing.max() < 1e-2


@pytest.mark.parametrize("frequency", [160.0, 162.96, 165.0])
def test_time_march(frequency: float) -> None:
    answer = response([150.0, frequency], harmonics=range(16), samples=256)
    marched = steady_state(answer.balance, frequency, answer.x[-1], steps=512)
    assert marched.status == "periodic"
    assert marched.amplitude(Y2) == pytest.approx(answer.amplitude(Y2)[-1], rel=5e-3)


def test_path_without_friction_arrives_through_every_fold() -> None:
    # only lift-off is left: with the state of whole samples the path had corners there, turned
    # round at them, and used its 5000 points going to and fro
    slick = replace(wedge(), law=replace(wedge().law, mu=np.zeros(2)))
    answer = response(np.linspace(145, 235, 46), points=slick, harmonics=range(6))
    assert answer.status == "complete", answer.message
    assert answer.frequency[-1] == 235.0
    assert len(answer.frequency) < 1000
    assert np.all(answer.state[..., 2].max(axis=0) > 0.3), "both contacts open"
    assert (np.diff(answer.frequency) < 0).any()
    assert np.abs(answer.energy_balance).max() < 1e-6
    last = int(np.flatnonzero(np.isclose(answer.frequency, 201.0))[-1])
    assert answer.state[last, :, 2].min() > 0.1
    marched = steady_state(answer.balance, 201.0, answer.x[last], steps=512)
    assert marched.status == "periodic"
    # harmonics above the fifth move the contacts by up to 2 % there
    assert marched.amplitude(Y2) == pytest.approx(answer.amplitude(Y2)[last], rel=2e-2)


def test_the_printed_curve_has_a_stretch_that_oscillates_and_its_peak_is_stable(
    curve: FrequencyResponse,
) -> None:
    peak = int(np.argmax(curve.amplitude(Y2)))
    beside = np.flatnonzero(np.abs(curve.frequency - 224.5) < 4.0)
    assert stability(curve, [peak]).label == ("stable",)
    assert set(stability(curve, beside).label) == {"oscillating"}
    # one slider lies at its limit there: time integration decides, and a small deviation grows in
    # it by 1.0203 in a period
    point = stability(response([159.77], harmonics=range(16), samples=256), steps=1024)
    assert point.label == ("undecided",)
    assert np.abs(point.largest[0]) == pytest.approx(1.0203, abs=2e-3)


def test_five_times_the_load_folds() -> None:
    path = frequency_response(
        System(
            (M, C, stiffness()), wedge(), static_force=[0, 0, 0, 0, 0, 120.0], harmonics=range(10)
        ),
        harmonic_force=-5j * np.array([0, -20, 5, 0, 0, 0]),
        frequencies=np.linspace(140.0, 156.0, 81),
    )
    y2, f = path.amplitude(Y2), path.frequency
    turns = np.flatnonzero(np.diff(np.sign(np.diff(f)))) + 1
    fold = turns[np.argmin(np.abs(f[turns] - 151.795))]
    assert f[fold] == pytest.approx(151.795, abs=0.01)
    # the nearest solved point: the curve is vertical there
    assert y2[fold] == pytest.approx(2.397e-4, rel=2e-2)
    labels = stability(path, [fold - 4, fold + 4]).label
    assert set(labels) == {"stable", "fold"}
