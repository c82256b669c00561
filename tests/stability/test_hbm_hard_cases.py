"""Harmonic balance where it is hard.

Stiff contacts, gross slip, folds, no damping, few and many samples and harmonics, bad units.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from upd.hbm import (
    Contacts,
    FrequencyResponse,
    PathProblem,
    Settings,
    System,
    contacts,
    follow,
    frequency_response,
)
from upd.hbm.springs.coulomb import SLIP
from upd.hbm.springs.points import Start
from upd.hbm.springs.sweep import from_stuck
from upd.hbm.springs.time_integration import steady_state

HZ = 1 / (2 * np.pi)


def jenkins(limit: float, k_t: float) -> Contacts:
    return contacts([[0.0]], [[1.0]], k_n=0.0, k_t=k_t, mu=1.0, preload=limit)


def oscillator(
    points: Contacts, w: np.ndarray, *, c: float = 0.02, load: float = 1.0, **options: Any
) -> FrequencyResponse:
    names = ("sweep_down", "settings", "fast_exits")
    path = {name: options.pop(name) for name in names if name in options}
    system = System(([[1.0]], [[c]], [[1.0]]), points, **options)
    return frequency_response(system, harmonic_force=[load], frequencies=w * HZ, **path)


@pytest.mark.parametrize("k_t", [1.0, 1e2, 1e4, 1e6])
def test_stiff_contact(k_t: float) -> None:
    answer = oscillator(jenkins(0.5, k_t), np.linspace(0.7, 1.5, 41), harmonics=(1,), samples=512)
    assert answer.status == "complete"
    assert np.abs(answer.energy_balance).max() < 1e-7
    assert answer.energy.min() >= 0


@pytest.mark.parametrize(("limit", "bounded"), [(0.95 * np.pi / 4, False), (1.3 * np.pi / 4, True)])
def test_no_viscous_damping_is_bounded_above_pi_f_over_4(limit: float, bounded: bool) -> None:
    # w = 1 is the resonance of the sliding oscillator, sqrt(2) of the sticking one; k_t = 1
    answer = oscillator(
        jenkins(limit, 1.0),
        np.linspace(1.45, 0.999, 200),
        c=0.0,
        harmonics=(1,),
        samples=512,
        sweep_down=True,
        settings=Settings(most_points=2000),
    )
    top = float(answer.amplitude([1.0]).max())
    exact = limit / (1 - np.pi / 4 / limit)
    if bounded:
        assert top == pytest.approx(exact, rel=5e-3)
    else:
        assert top > 100 * limit


@pytest.mark.parametrize("samples", [32, 128, 1024, 4096])
def test_samples(samples: int) -> None:
    answer = oscillator(
        jenkins(0.8, 1.0), np.linspace(0.9, 1.5, 31), harmonics=(1, 3), samples=samples
    )
    fine = oscillator(jenkins(0.8, 1.0), np.linspace(0.9, 1.5, 31), harmonics=(1, 3), samples=8192)
    assert answer.status == "complete"
    assert answer.peak([1.0])[1] == pytest.approx(
        fine.peak([1.0])[1], rel=max(40 / samples**2, 3e-3)
    )


@pytest.mark.parametrize("highest", [1, 5, 15, 31])
def test_harmonics(highest: int) -> None:
    answer = oscillator(
        jenkins(0.8, 20.0), np.array([0.3, 0.31]), harmonics=range(1, highest + 1, 2)
    )
    assert answer.status == "complete"
    assert np.abs(answer.energy_balance).max() < 1e-8


def test_low_frequency_stick_slip_against_time() -> None:
    answer = oscillator(
        jenkins(0.6, 30.0), np.array([0.25]), harmonics=range(1, 32, 2), samples=2048, c=0.1
    )
    marched = steady_state(answer.balance, 0.25 * HZ, answer.x[0], steps=4096)
    assert marched.status == "periodic"
    assert marched.amplitude(np.ones(1)) == pytest.approx(answer.amplitude([1.0])[0], rel=5e-3)


def gap_oscillator(w: np.ndarray, *, sweep_down: bool = False, **options: Any) -> FrequencyResponse:
    """A mass pressed on a stiff unilateral spring.

    It lifts off near resonance and the peak leans to lower frequencies.
    """
    points = contacts([[1.0]], (), k_n=1.0, k_t=1.0, mu=0.0, preload=1.0)
    return frequency_response(
        System(([[1.0]], [[0.03]], [[0.5]]), points, **options),
        harmonic_force=[0.12],
        frequencies=w * HZ,
        sweep_down=sweep_down,
    )


def test_fold_with_lift_off() -> None:
    up = gap_oscillator(np.linspace(0.8, 1.5, 71), harmonics=range(6))
    assert up.status == "complete"
    assert np.any(np.diff(up.frequency) < 0), "the path turns back at a fold"
    assert up.state[..., 2].max() > 0.1
    down = gap_oscillator(np.linspace(0.8, 1.5, 71), harmonics=range(6), sweep_down=True)
    assert down.peak([1.0])[1] == pytest.approx(up.peak([1.0])[1], rel=1e-2)


def test_contact_that_opens_for_good() -> None:
    points = contacts([[1.0]], [[1.0]], k_n=2.0, k_t=1.0, mu=0.5, gap=1e3)
    answer = oscillator(points, np.linspace(0.8, 1.2, 21), harmonics=(0, 1))
    np.testing.assert_allclose(answer.amplitude([1.0]), answer.free([1.0]), rtol=1e-9)
    assert np.all(answer.state[..., 2] == 1.0)


def test_mu_zero_drops_the_tangents() -> None:
    points = contacts([[1.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=0.0, preload=1.0)
    answer = oscillator(points, np.linspace(0.8, 1.2, 21))
    assert answer.balance.contacts.tangents == 0
    np.testing.assert_allclose(answer.amplitude([1.0]), answer.free([1.0]), rtol=1e-9)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_badly_scaled_units(unit: float) -> None:
    # masses, stiffnesses and forces in another unit of force: the same displacements
    w = np.linspace(0.9, 1.5, 31)
    one = oscillator(jenkins(0.8, 1.0), w)
    points = jenkins(0.8 * unit, unit)
    other = frequency_response(
        System(([[unit]], [[0.02 * unit]], [[unit]]), points),
        harmonic_force=[unit],
        frequencies=w * HZ,
    )
    assert other.peak([1.0])[1] == pytest.approx(one.peak([1.0])[1], rel=1e-8)


def test_a_path_that_cannot_go_on_keeps_what_it_has() -> None:
    answer = oscillator(
        jenkins(0.8, 1.0),
        np.linspace(0.9, 1.5, 31),
        settings=Settings(most_points=5),
        fast_exits=False,
    )
    assert answer.status == "step limit"
    assert len(answer.frequency) == 5
    assert "5 points used" in answer.message


def circle(x: np.ndarray, p: float, jacobian: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.array([x[0] ** 2 + p**2 - 1]), np.array([[2 * x[0]]]), np.array([2 * p])


def test_continuation_passes_both_folds_and_restarts() -> None:
    def scale(x: np.ndarray) -> np.ndarray:
        return np.ones_like(x)

    few, more = (
        PathProblem(circle, scale, settings=Settings(most_points=most, largest_step=0.2))
        for most in (25, 80)
    )
    start = few.solve(np.array([0.9]), -0.5)
    assert start is not None
    first = follow(few, (start.x, -0.5), 2.0)
    assert first.status == "step limit"
    rest = follow(more, first.state, 2.0)
    x, p = np.concatenate([first.x[:, 0], rest.x[:, 0]]), np.concatenate([first.p, rest.p])
    np.testing.assert_allclose(x**2 + p**2, 1.0, atol=1e-9)
    assert x.min() < -0.9
    assert p.max() > 0.9
    assert p.min() < -0.9


@pytest.mark.parametrize("other", [[], [1.0]])
def test_a_contact_cut_into_parts_takes_as_many_points(other: list[float]) -> None:
    # an oscillator on one contact that is cut, or on a stiffer one beside it
    def answer(parts: int) -> FrequencyResponse:
        k_t = np.append(other, np.full(parts, 0.4 / parts))
        limit = np.append(0.3 * np.array(other), np.full(parts, 0.08 / parts))
        row = np.ones((len(k_t), 1))
        points = contacts(0 * row, [row], k_n=0.0, k_t=k_t, mu=1.0, preload=limit)
        grid = np.linspace(0.8, 1.7, 3)
        return oscillator(points, grid, load=0.3, harmonics=(1, 3))

    one = answer(1)
    assert one.state[..., SLIP].max() > 0.1
    for parts in (16, 64):
        cut = answer(parts)
        assert cut.status == "complete"
        assert len(cut.frequency) == pytest.approx(len(one.frequency), rel=0.1)
        assert cut.peak([1.0])[1] == pytest.approx(one.peak([1.0])[1], rel=1e-7)


def test_body_that_nothing_presses_with_unequal_gaps() -> None:
    # a grounded mass between a near and a far stop that it does not reach, and a loose body
    # between two others: neither touches, however different the gaps
    for K in (np.eye(1), np.zeros((1, 1))):
        points = contacts([[1.0], [-1.0]], k_n=5.0, mu=0.0, gap=[3.0, 1e3])
        answer = frequency_response(
            System((np.eye(1), 0.1 * np.eye(1), K), points),
            harmonic_force=[0.1],
            frequencies=np.linspace(0.8, 1.2, 11) * HZ,
        )
        assert answer.linear.all(), answer.message
        assert "free answer" in answer.message
        np.testing.assert_allclose(answer.amplitude([1.0]), answer.free([1.0]), rtol=1e-12)
        assert answer.state[..., 2].min() == 1.0
    touching = contacts([[1.0], [-1.0]], k_n=5.0, mu=0.0, gap=[0.9, 1e3])
    near = oscillator(touching, np.linspace(0.8, 1.2, 11), c=0.1, load=0.1, harmonics=(0, 1))
    assert not near.linear.any()
    assert near.state[..., 2].min() < 1.0


@pytest.mark.parametrize("start", ["zero", "static", "mid", "upper"])
def test_released_from_stuck_is_a_solution_wherever_the_sliders_start(start: Start) -> None:
    # the slider is 0.8 away from rest and holds the mass there; pressed hard enough, it sticks
    points = contacts([[1.0]], [[0.5]], k_n=2.0, k_t=1.0, mu=0.8, preload=1.0)
    b = frequency_response(
        System(([[1.0]], [[0.05]], [[1.0]]), points, static_force=[3.0], harmonics=(0, 1, 2, 3)),
        harmonic_force=[0.2],
        frequencies=[0.2],
    ).balance
    b = b.with_sliders(start, np.array([[0.8, 0.0]]) if start in ("zero", "static") else None)
    for problem in (b, b.pressed(np.array([50.0]))):
        x = from_stuck(problem, 0.2)
        assert x is not None
        residual = problem.linearised(x, 2 * np.pi * 0.2, False)[0]
        assert np.abs(residual).max() < 1e-9 * np.abs(x).max()
