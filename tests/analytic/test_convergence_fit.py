"""Rates and extrapolation on sequences whose limit is known."""

import numpy as np
import pytest

from upd.analyses.convergence import change_order, extrapolate, fit_rate, two_level_error
from upd.errors import InputError


@pytest.mark.parametrize("order", [0.8, 1.0, 1.5, 2.0, 3.0])
def test_rate_and_limit_of_a_power_law(order: float) -> None:
    h = np.array([0.4, 0.25, 0.2, 0.1, 0.05])
    q = 3.0 + 0.7 * h**order
    assert fit_rate(h, q - 3.0) == pytest.approx(order, rel=1e-10)
    found = extrapolate(h, q)
    assert found.limit == pytest.approx(3.0, rel=1e-3)
    assert found.order == pytest.approx(order, abs=0.03)


def test_three_meshes_are_richardson() -> None:
    q = {h: 1.0 - 2.0 * h**2 for h in (0.4, 0.2, 0.1)}
    found = extrapolate(list(q), list(q.values()))
    richardson = q[0.1] + (q[0.1] - q[0.2]) / 3.0
    assert found.limit == pytest.approx(richardson, rel=1e-6)


def test_two_level_estimate_bounds_the_error_of_a_first_order_method() -> None:
    coarse, fine = 2.0 + 0.4, 2.0 + 0.4 / np.sqrt(2.0)
    true = abs(fine - 2.0) / fine
    assert two_level_error(coarse, fine, np.sqrt(2.0)) == pytest.approx(true, rel=1e-10)
    # A method that converges faster is judged too strictly, never too kindly.
    assert two_level_error(2.0 + 0.4, 2.0 + 0.2, np.sqrt(2.0)) > 0.2 / 2.2


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
