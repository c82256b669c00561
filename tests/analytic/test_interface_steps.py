"""Corrections of the balance by whole faces by factors of another point."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from upd.hbm.core.factors import Border, Factors
from upd.hbm.faces.corrector import PlaneSteps

FloatArray = NDArray[np.float64]
U = 12


def problem(changed: int) -> tuple[FloatArray, FloatArray, FloatArray, Any]:
    """A matrix (U, U + 1) of linear equations, their right side and a plane; factors of a matrix
    that differs by this rank, with another plane and other units."""
    rng = np.random.default_rng(7)
    J = rng.normal(size=(U, U + 1)) + 4.0 * np.eye(U, U + 1)
    near = J + rng.normal(size=(U, changed)) @ rng.normal(size=(changed, U + 1)) * 0.3
    D = rng.uniform(0.5, 2.0, U)
    border = Border(near[:, -1], D, 1.0, rng.normal(size=U + 1))
    known = SimpleNamespace(factors=Factors(near[:, :-1], border), D=D)
    return J, rng.normal(size=U), rng.normal(size=U + 1), known


def solved(J: FloatArray, b: FloatArray, steps: PlaneSteps, D: FloatArray, count: int) -> Any:
    """Residuals after each step of J x = b, and the steps."""
    x, left, taken = np.zeros(U + 1), [], []
    for _ in range(count):
        step = steps.next(J @ x - b)
        x = x + step * np.append(D, 1.0)
        left.append(float(np.linalg.norm(J @ x - b)))
        taken.append(step)
    return left, taken


@pytest.mark.parametrize("changed", [0, 1, 2])
def test_linear_equations_end_after_twice_the_rank_of_what_is_off(changed: int) -> None:
    """D. M. Gay, SIAM J. Numer. Anal. 16 (1979) 623: 2 r steps and one; a chord never ends."""
    J, b, normal, known = problem(changed)
    D = np.linspace(1.0, 3.0, U)
    left, taken = solved(J, b, PlaneSteps(known, normal, D, True), D, 2 * changed + 1)
    assert left[-1] < 1e-9 * np.linalg.norm(b)
    assert all(one > 1e-4 * np.linalg.norm(b) for one in left[:-2]), left
    for step in taken:
        assert abs(normal @ step) < 1e-9 * np.linalg.norm(normal) * np.linalg.norm(step)


def test_without_updates_the_same_steps_do_not_end() -> None:
    J, b, normal, known = problem(2)
    D = np.linspace(1.0, 3.0, U)
    x = np.zeros(U + 1)
    for _ in range(5):
        x = x + PlaneSteps(known, normal, D, True).next(J @ x - b) * np.append(D, 1.0)
    assert np.linalg.norm(J @ x - b) > 1e-3 * np.linalg.norm(b)


def test_a_step_of_newton_s_stays_in_the_plane() -> None:
    """Whatever the factors leave of the border: a frequency that is asked for is met exactly."""
    _, b, _, known = problem(0)
    across = np.eye(1, U + 1, U)[0]
    step = PlaneSteps(known, across, np.ones(U), False).next(-b)
    assert np.linalg.norm(step) > 0.0 and step[-1] == 0.0
