"""A contact that opens has a mean motion: an answer without harmonic 0 says how much it misses."""

import numpy as np
import pytest

from upd.hbm import FrequencyResponse, System, contacts, frequency_response


def opening(harmonics: tuple[int, ...]) -> FrequencyResponse:
    return frequency_response(
        System(
            ([[1.0]], [[0.02]], [[1.0]]),
            contacts([[1.0]], [[0.0]], k_n=2.0, k_t=1.0, mu=0.0, preload=0.05),
            harmonics=harmonics,
        ),
        harmonic_force=[0.3],
        frequencies=np.array([0.16, 0.18]),
    )


@pytest.mark.parametrize("numbers", [(1,), (1, 2, 3)])
def test_a_missing_mean_motion_counts(numbers: tuple[int, ...]) -> None:
    few, all_of_them = opening(numbers), opening(tuple(range(16)))
    right = abs(all_of_them.amplitude([1.0])[-1])
    assert right == pytest.approx(0.83109, rel=1e-4)  # solve_ivp, 300 periods
    assert abs(abs(few.amplitude([1.0])[-1]) / right - 1) > 0.5
    assert few.truncation[-1] > 0.2
    assert "omitted harmonics (0, above" in few.message
    assert all_of_them.truncation[-1] < 1e-3


def test_missing_harmonics_between_count_and_are_named() -> None:
    few = opening((0, 1, 3))
    assert few.truncation[-1] > 0.01
    assert "omitted harmonics (2, above 3)" in few.message


def test_a_mean_force_on_a_body_without_stiffness_moves_it_against_the_contact() -> None:
    """Nothing but the contact, closed, holds it: mean force over k_n, relative to the amplitude."""
    k_n, preload = 2.0, 0.05
    held = frequency_response(
        System(
            ([[1.0]], [[0.02]], [[0.0]]),
            contacts([[1.0]], [[0.0]], k_n=k_n, k_t=1.0, mu=0.0, preload=preload),
            harmonics=(1,),
        ),
        harmonic_force=[0.3],
        frequencies=np.array([0.1, 0.12]),
    )
    amplitude = abs(held.amplitude([1.0])[-1])
    w = amplitude * np.cos(np.linspace(0.0, 2.0 * np.pi, 4096, endpoint=False))
    mean = np.maximum(0.0, preload + k_n * w).mean()
    assert held.truncation[-1] == pytest.approx(mean / k_n / amplitude, rel=1e-3)
