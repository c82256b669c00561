"""Ends of profiles where the slope of a residual changes beside the answer, in closed form."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import norm

from upd.fitting.residuals import (
    KEPT,
    SHOWN,
    Knowledge,
    Residuals,
    Start,
    is_bent,
    misfit_rises,
    profile_ends,
)

#: half-widths to first order, and how much steeper the first residual is above 0
HALF, STEEPER = 0.1, 2.5


class _Bent:
    """r = (u, z_1 / HALF - 3 u) with u = z_0 / HALF below 0, STEEPER times that above."""

    known = True

    def __init__(self, high: float) -> None:
        self.low, self.high = np.array([-1.0, -1.0]), np.array([high, 1.0])
        #: sets that were sought
        self.solved = 0

    def __call__(self, z: np.ndarray) -> np.ndarray:
        u = z[0] / HALF * (STEEPER if z[0] > 0.0 else 1.0)
        return np.array([u, z[1] / HALF - 3.0 * u])

    def inside(self, z: np.ndarray) -> np.ndarray:
        return np.clip(z, self.low + 1e-6, self.high - 1e-6)

    def solve(self, begin: np.ndarray, held: int) -> Start:
        free = 1 - held
        z = begin.copy()
        self.solved += 1

        def part(v: np.ndarray) -> np.ndarray:
            z[free] = v[0]
            return self(z)

        found = least_squares(part, begin[free : free + 1])
        z[free] = found.x[0]
        return Start(begin, z, 2.0 * float(found.cost))


def known() -> Knowledge:
    J = np.array([[1.0, 0.0], [-3.0, 1.0]]) / HALF
    covariance = np.linalg.inv(J.T @ J)
    error = np.sqrt(np.diag(covariance))
    none = np.zeros(2)
    return Knowledge(none, J, none > 1.0, covariance / np.outer(error, error), error)


def test_ends_are_where_the_misfit_has_risen_by_one() -> None:
    """With z_1 fitted |r|^2 = u^2: it is 1 at -HALF, and at HALF / STEEPER above."""
    toy = _Bent(1.0)
    residuals, best = cast(Residuals, toy), np.zeros(2)
    rises = misfit_rises(toy, known(), best, toy.low, toy.high)
    assert is_bent(rises[0], SHOWN)
    assert rises[0, 0] == pytest.approx(1.0)
    ends = profile_ends(residuals, known(), best, 0)
    assert ends == pytest.approx((-HALF, HALF / STEEPER), rel=1e-2)
    # none beyond an end
    assert ends[0] >= -HALF and ends[1] <= HALF / STEEPER
    assert toy.solved <= 24


def test_a_profile_ends_at_a_bound() -> None:
    low, high = profile_ends(cast(Residuals, _Bent(0.02)), known(), np.zeros(2), 0)
    assert high == 0.02
    assert low == pytest.approx(-HALF, rel=1e-2)


def test_where_the_misfit_is_quadratic_nothing_is_bent() -> None:
    assert not is_bent(np.array([1.1, 0.9]), SHOWN)
    assert not is_bent(np.array([np.nan, 1.0]), KEPT)
    assert is_bent(np.array([1.0, 0.6]), SHOWN)
    assert is_bent(np.array([np.nan, 1.5]), SHOWN)


def test_an_interval_off_by_a_share_keeps_its_probability_to_half_a_digit() -> None:
    """Both ends off by it: 0.95 becomes 0.945 to first order; to second 2e-4 less."""
    t = norm.ppf(0.975)
    held = norm.cdf(t * (1.0 - KEPT)) - norm.cdf(-t * (1.0 - KEPT))
    assert held == pytest.approx(0.945, abs=3e-4)
    assert is_bent(np.array([1.0, (1.0 + 1.01 * KEPT) ** 2]), KEPT)
    assert not is_bent(np.array([1.0, (1.0 + 0.99 * KEPT) ** 2]), KEPT)
