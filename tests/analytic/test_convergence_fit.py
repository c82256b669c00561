"""Rates and extrapolation on sequences whose limit is known."""

import numpy as np
import pytest

from upd.errors import InputError
from upd.vary.orders import (
    change_order,
    estimate_error,
    extrapolate,
    fit_rate,
    observed_order,
    two_level_error,
)


@pytest.mark.parametrize("order", [0.8, 1.0, 1.5, 2.0, 3.0])
def test_rate_and_limit_of_a_power_law(order: float) -> None:
    h = np.array([0.4, 0.25, 0.2, 0.1, 0.05])
    q = 3.0 + 0.7 * h**order
    assert fit_rate(h, q - 3.0) == pytest.approx(order, rel=1e-10)
    limit, found = extrapolate(h, q)
    assert limit == pytest.approx(3.0, rel=1e-3)
    assert found == pytest.approx(order, abs=0.03)


def test_three_meshes_are_richardson() -> None:
    q = {h: 1.0 - 2.0 * h**2 for h in (0.4, 0.2, 0.1)}
    found = extrapolate(list(q), list(q.values()))
    richardson = q[0.1] + (q[0.1] - q[0.2]) / 3.0
    assert found[0] == pytest.approx(richardson, rel=1e-6)


def test_richardson_error_of_two_levels() -> None:
    coarse, fine = 2.0 + 0.4, 2.0 + 0.4 / np.sqrt(2.0)
    true = abs(fine - 2.0) / fine
    assert two_level_error(coarse, fine, np.sqrt(2.0)) == pytest.approx(true, rel=1e-10)


@pytest.mark.parametrize("order", [0.7, 1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("ratio", [np.sqrt(2.0), 1.5, 2.0])
@pytest.mark.parametrize("n", [2, 3, 4, 6])
def test_estimate_bounds_the_error_of_a_power_law(order: float, ratio: float, n: int) -> None:
    h = ratio ** -np.arange(float(n))
    q = 3.0 - 0.4 * h**order
    true = abs(q[-1] / 3.0 - 1.0) * 3.0 / abs(q[-1])
    found = estimate_error(h, q)
    assert found.error >= true
    if n == 3 and order <= 2.0:
        assert found.error == pytest.approx(3.0 * true, rel=1e-9)
    if n >= 4 and order <= 2.0:
        assert found.error == pytest.approx(1.25 * true, rel=1e-9)
    if n >= 3:
        assert found.order == pytest.approx(order, rel=1e-9)
        # The order of the levels does not matter.
        assert estimate_error(h[::-1], q[::-1]) == found


def test_estimate_of_two_levels_is_three_times_first_order() -> None:
    """Data of order 1, finest level 1.7 % off: an order of 1.5 assumed says 0.92 %."""
    limit, fine = 1.0, 1.017
    coarse = limit + 0.017 * np.sqrt(2.0)
    found = estimate_error([np.sqrt(2.0), 1.0], [coarse, fine])
    assert found.error == pytest.approx(3.0 * 0.017 / fine, rel=1e-9)
    assert np.isnan(found.order)


def test_scatter_is_no_clear_order_and_counts_in_full() -> None:
    found = estimate_error([1.0, 0.7, 0.5], [1.02, 0.99, 1.0])
    assert found.basis.startswith("no clear order")
    assert found.error == pytest.approx(3.0 * 0.03)
    growing = estimate_error([1.0, 0.5, 0.25], [1.0, 1.01, 1.04])
    assert growing.basis.startswith("no clear order")
    assert growing.error == pytest.approx(3.0 * 0.04 / 1.04)


def test_a_difference_small_by_chance_is_not_believed() -> None:
    """Levels -1.16, -0.20, -0.16 % off: their last difference alone would say 0.05 %."""
    found = estimate_error([1.0, 0.8, 0.57], [0.9884, 0.9980, 0.9984])
    assert found.error > 0.0016


def test_no_estimate_of_one_level_and_of_sizes_that_are_none() -> None:
    assert np.isnan(estimate_error([0.1], [1.0]).error)
    for sizes in ([0.1, 0.1], [0.1, -0.2], [0.1, 0.2, 0.3]):
        with pytest.raises(InputError):
            estimate_error(sizes, [1.0, 2.0])


@pytest.mark.parametrize("order", [-0.6, 0.3, 1.0, 2.7])
def test_observed_order_of_any_ratios(order: float) -> None:
    h = np.array([1.0, 0.8, 0.3])
    assert observed_order(h, 2.0 + h**order) == pytest.approx(order, rel=1e-9)
    assert np.isnan(observed_order(h, [1.0, 2.0, 1.5]))


def test_bad_input() -> None:
    with pytest.raises(InputError, match="three meshes"):
        extrapolate([0.1, 0.2], [1.0, 2.0])
    with pytest.raises(InputError, match="coarser"):
        two_level_error(1.0, 1.0, 0.5)
    assert np.isnan(fit_rate([0.1, 0.2], [0.0, 1.0]))


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0, -0.23, -0.6])
def test_change_shows_a_limit_or_its_absence(order: float) -> None:
    """No limit is given: a singular pressure, h^-s, shows as a negative order."""
    h = np.geomspace(1.0, 0.1, 6)
    offset = 3.0 if order > 0 else 0.0
    assert change_order(h, offset + 0.7 * h**order) == pytest.approx(order, rel=1e-10)


def test_change_of_a_logarithm_is_zero_and_of_scatter_nan() -> None:
    h = np.geomspace(1.0, 0.1, 6)
    assert change_order(h, 2.0 - np.log(h)) == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(change_order(h, [1.0, 1.1, 1.0, 1.1, 1.0, 1.1]))
    assert np.isnan(change_order(h[:2], [1.0, 2.0]))
