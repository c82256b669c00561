"""Misfits at the ends of first-order intervals: 1 where the model is linear, else what it is."""

from __future__ import annotations

import numpy as np
import pytest

from upd.errors import ConvergenceError, InputError, UpdError
from upd.fitting.residuals import Knowledge, misfit_rises

A = np.array([[2.0, 0.3], [-1.0, 1.5], [0.4, 0.8]])
FAR = np.full(2, 10.0)


def known(J: np.ndarray) -> Knowledge:
    covariance = np.linalg.inv(J.T @ J)
    error = np.sqrt(np.diag(covariance))
    none = np.zeros(2)
    return Knowledge(none, J, none > 1.0, covariance / np.outer(error, error), error)


def test_linear_models_rise_by_one() -> None:
    z = np.array([0.2, -0.1])
    left = np.array([1.0, 2.0, 3.0])
    # a rest at a right angle to the columns, as at a least misfit
    rest = left - A @ np.linalg.lstsq(A, left, rcond=None)[0]
    found = misfit_rises(lambda at: A @ (at - z) + rest, known(A), z, z - FAR, z + FAR)
    assert found == pytest.approx(np.ones((2, 2)), rel=1e-10)


def test_a_slope_that_changes_beside_the_answer() -> None:
    """Twice as steep above: four times the rise there, as a slip that begins makes it."""
    z = np.zeros(2)

    def residuals(at: np.ndarray) -> np.ndarray:
        return A @ np.where(at > 0.0, [2.0, 1.0] * at, at)

    one = known(A)
    found = misfit_rises(residuals, one, z, -FAR, FAR)
    step = one.correlation[0] * one.error if one.correlation is not None else z
    exact = np.sum((A @ (step * [2.0, 1.0])) ** 2)
    assert found[0] == pytest.approx([1.0, exact], rel=1e-10)
    assert exact > 2.0


def test_nothing_is_told_beyond_a_bound() -> None:
    z = np.zeros(2)
    found = misfit_rises(lambda at: A @ at, known(A), z, -1e-6 * FAR, FAR)
    assert np.isnan(found[:, 0]).all()


@pytest.mark.parametrize("kind", [ConvergenceError, InputError])
def test_nothing_is_told_where_the_scene_refuses_an_end(kind: type[UpdError]) -> None:
    def residuals(at: np.ndarray) -> np.ndarray:
        if at[0] > 0.0:
            raise kind("not there")
        return A @ at

    found = misfit_rises(residuals, known(A), np.zeros(2), -FAR, FAR)
    # the second parameter's ends move the first one along
    assert found[0, 0] == pytest.approx(1.0)
    assert np.isnan(found[0, 1])
    assert np.isnan(found[1]).sum() == 1
