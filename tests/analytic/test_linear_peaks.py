"""Peaks of the linear limits and widths of a path's against closed forms of one mode."""

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.analyses.forced import measures
from upd.analyses.forced.curves import Limit, finer, linear_modes
from upd.hbm import FrequencyResponse, System, contacts, frequency_response

C, F = 0.004, 3.0
ROW = np.array([1.0])


def limit_of(answer: FrequencyResponse, stuck: bool) -> Limit:
    """One limit of the blade."""
    b = answer.balance

    def moved(f: NDArray[np.float64]) -> NDArray[np.complex128]:
        return b.linear_displacement(2.0 * np.pi * f, stuck, 1)

    return Limit(1, F, *linear_modes(b, stuck), moved, {"right": ROW}, ("right",))


@pytest.mark.parametrize("points", [10, 23, 400])
@pytest.mark.parametrize(("stuck", "stiffness"), [(False, 1.0), (True, 3.0)])
def test_peak_of_one_mode_in_closed_form(points: int, stuck: bool, stiffness: float) -> None:
    # a mass of 1 t on a spring of 1 N/mm with a slider of 2 N/mm
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=2.0, mu=1.0, preload=1e6)
    f0 = np.sqrt(stiffness) / (2.0 * np.pi)
    grid = np.linspace(0.7 * f0, 1.4 * f0, points)
    answer = frequency_response(
        System(([[1.0]], [[C]], [[1.0]]), slider, harmonics=(1,)),
        harmonic_force=[F],
        frequencies=grid,
    )
    zeta = C / (2.0 * np.sqrt(stiffness))
    frequency, width = linear_modes(answer.balance, stuck)
    assert frequency == pytest.approx([f0], rel=1e-12)
    assert width == pytest.approx([2.0 * zeta * f0], rel=1e-12)
    (peak,) = limit_of(answer, stuck).peaks("right", grid)
    # w^2 / |w0^2 - w^2 + 2 i zeta w0 w| is highest at w0 / sqrt(1 - 2 zeta^2)
    assert peak.frequency == pytest.approx(f0 / np.sqrt(1.0 - 2.0 * zeta**2), rel=1e-7)
    exact = 1e-3 / (2.0 * zeta * np.sqrt(1.0 - zeta**2))
    # the search ends at half of the digits of f: (2 x 1.5e-8 f / width)^2 of the height
    assert peak.height == pytest.approx(exact, rel=(3e-8 / (2.0 * zeta)) ** 2)
    assert peak.sample == np.abs(grid - peak.frequency).argmin()


@pytest.mark.parametrize("points", [3, 10, 23, 400])
def test_finer_frequencies_show_the_peak_of_a_path(points: int) -> None:
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=2.0, mu=1.0, preload=1e6)
    f0 = np.sqrt(3.0) / (2.0 * np.pi)
    grid = np.linspace(0.7 * f0, 1.41 * f0, points)
    system = System(([[1.0]], [[C]], [[1.0]]), slider, harmonics=(1,))
    coarse = frequency_response(system, harmonic_force=[F], frequencies=grid)
    f = finer(grid, *linear_modes(coarse.balance, True))
    assert np.isin(grid, f).all() and len(f) <= points + 25
    answer = frequency_response(system, harmonic_force=[F], frequencies=f)
    zeta = C / (2.0 * np.sqrt(3.0))
    exact = 1e-3 / (2.0 * zeta * np.sqrt(1.0 - zeta**2))
    height = np.abs(measures.accelerance(answer, ROW, F))
    (peak,) = measures.path_maxima(answer.frequency, height)
    assert peak.height == pytest.approx(exact, rel=1e-5)
    # fine enough: nothing is added
    assert finer(f, *linear_modes(coarse.balance, True)) == pytest.approx(f)


def test_peak_outside_the_sweep_is_none_of_it() -> None:
    slider = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=2.0, mu=1.0, preload=1e6)
    f0 = 1.0 / (2.0 * np.pi)
    # less than a width beyond the mode: the flank falls over the whole sweep
    grid = np.linspace(f0 * (1.0 + 0.5 * C), 1.4 * f0, 20)
    answer = frequency_response(
        System(([[1.0]], [[C]], [[1.0]]), slider, harmonics=(1,)),
        harmonic_force=[F],
        frequencies=grid,
    )
    assert limit_of(answer, False).peaks("right", grid) == []


def test_a_light_shape_far_above_does_not_turn_modes_across_the_blades() -> None:
    """Modes are told by how far the tips move along x, against the others in reach: a shape of
    hardly any mass at 1 MHz, as finely reduced models have, moves its tip more than any of them.
    """
    frequency = np.array([300.0, 400.0, 310.0, 1e6])
    # tips of both blades, by mode: in phase, out of phase, across, the light one
    tips = np.array([[1.0, 1.0, 1e-6, 0.0], [1.0, -1.0, 1e-6, 1e3]])
    found = measures.modes_of_tips(np.eye(4), frequency, np.eye(4), tips, 1000.0)
    assert [m.words for m in found.modes] == ["in phase", "out of phase"]
    assert np.array_equal(found.shape, np.eye(4)[:, :2])
