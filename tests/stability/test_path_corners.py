"""Paths where a step may fall on another piece: kinks that turn back, wiggles narrower than a step,
and paths that are closed.
"""

from __future__ import annotations

import numpy as np
import pytest

from upd.hbm import PathProblem, Settings, follow
from upd.hbm.core.continuation import PROBE
from upd.hbm.core.newton import Function

Parts = tuple[np.ndarray, np.ndarray, np.ndarray]


def ones(x: np.ndarray) -> np.ndarray:
    return np.ones_like(x)


def needle(m: float, condition: float) -> Function:
    """p = x and p = m x for x <= 0, which meet at the origin, and two unknowns that are 0 and
    nearly dependent: next to the kink a point solves the equations to rounding only.
    """

    def function(x: np.ndarray, p: float, jacobian: bool) -> Parts:
        k, d = 0.5 * (1.0 + m), 0.5 * (1.0 - m)
        side = 1.0 if p >= k * x[0] else -1.0
        J = np.array([[d - side * k, 0, 0], [0, 1, 1], [0, 1, 1 + 1 / condition]])
        return J @ x + np.array([side * p, 0, 0]), J, np.array([side, 0, 0])

    return function


@pytest.mark.parametrize("m", [0.1, 0.3])
def test_a_path_that_turns_back_at_a_kink_goes_on_along_the_other_piece(m: float) -> None:
    for begin in np.linspace(-1.0, -0.5, 20):
        path = follow(
            PathProblem(needle(m, 1e9), ones),
            (np.array([begin, 0.0, 0.0]), float(begin)),
            2.0,
            turned=float(begin) - 0.2,
        )
        assert path.x[-1, 0] == pytest.approx(path.p[-1] / m)


def test_a_wanted_value_inside_a_narrow_wiggle_is_not_reached_on_the_way_back() -> None:
    # 20 x with three passes of p = 1, of which the middle one is in line with the path before
    def p_of(x: complex) -> complex:
        wiggle = 0.05 * np.sin((0.05 - x) * np.pi / 0.004)
        return complex(20.0 * x + wiggle * np.exp(-(((x - 0.05) / 0.003) ** 2)))

    def function(x: np.ndarray, p: float, jacobian: bool) -> Parts:
        slope = p_of(x[0] + 1e-20j).imag / 1e-20
        return np.array([p - p_of(x[0]).real]), np.array([[-slope]]), np.array([1.0])

    start = np.array([-0.05]), p_of(-0.05).real
    path = follow(PathProblem(function, ones), start, 2.0, wanted=np.array([1.0]))
    assert path.status == "complete"
    assert abs(path.x[path.p == 1.0] - 0.05).min() > 1e-3, "the middle pass"


@pytest.mark.parametrize("count", [51, 101, 201])
def test_a_wanted_value_beyond_a_fold_is_not_sought_behind_the_step(count: int) -> None:
    # p = 0 has three solutions nearer than a step: Newton's method across the fold finds the first
    k, e = 1.306, 0.01168

    def function(x: np.ndarray, p: float, jacobian: bool) -> Parts:
        J = np.array([[-3.0 * k * (x[0] ** 2 - e)]])
        return np.array([p - k * (x[0] ** 3 - 3.0 * e * x[0])]), J, np.array([1.0])

    end = k * (27.0 - 9.0 * e)
    path = follow(
        PathProblem(function, ones, end),
        (np.array([-3.0]), -end),
        end,
        wanted=np.linspace(-end, end, count),
    )
    assert path.status == "complete"
    assert (np.diff(path.x[:, 0]) > 0.0).all()


def test_a_wanted_value_is_not_reached_on_the_pass_before() -> None:
    # beyond the kink at 0.105 p rises again: the wanted value below is on the pass before, of the
    # same direction
    xs = np.array([-1.0, -0.196, -0.042, 0.023, 0.105, 1.0])
    ps = np.array([-1.0, 0.068, -0.255, 0.259, 0.082, 1.0])
    slopes = np.diff(ps) / np.diff(xs)

    def function(x: np.ndarray, p: float, jacobian: bool) -> Parts:
        i = int(np.clip(np.searchsorted(xs, x[0]) - 1, 0, len(slopes) - 1))
        r = p - ps[i] - slopes[i] * (x[0] - xs[i])
        return np.array([r]), np.array([[-slopes[i]]]), np.array([1.0])

    wanted = np.linspace(-1.0, 1.0, 12)
    path = follow(PathProblem(function, ones), (np.array([-1.0]), -1.0), 1.0, wanted=wanted)
    assert path.status == "complete"
    assert (np.diff(path.x[:, 0]) > -1e-9).all()


def circle(x: np.ndarray, p: float, jacobian: bool) -> Parts:
    return np.array([x[0] ** 2 + p**2 - 1]), np.array([[2 * x[0]]]), np.array([2 * p])


@pytest.mark.parametrize("wanted", [[0.0], [-0.5]])
def test_a_closed_path_ends_after_one_round(wanted: list[float]) -> None:
    """With a wanted value ahead of its begin, and with none: it is where it began at one of its
    own.
    """
    # steps so short that many points have no wanted value: 100 of 157 a round
    settings = Settings(largest_step=0.2 if wanted[0] == 0.0 else 0.04)
    problem = PathProblem(circle, ones, settings=settings)
    path = follow(problem, (np.array([0.75**0.5]), -0.5), 2.0, wanted=np.array(wanted))
    assert path.status == "stopped"
    assert "a second time" in path.message
    angle = np.unwrap(np.arctan2(path.p, path.x[:, 0]))
    # round to the first wanted point, or from one of its own to it again
    more = np.pi / 6 if wanted[0] == 0.0 else abs(angle[PROBE] - angle[0])
    assert abs(angle[-1] - angle[0]) == pytest.approx(2 * np.pi + more)
