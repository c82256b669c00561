"""Pseudo-arclength continuation of r(x, p) = 0: past folds, round corners, onto wanted parameters.

Its message gives place and reason of a stop. Lengths are measured in units of `scale`, which may
follow the solution, so that unknowns of any size weigh alike.

References
----------
H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems (1977);
R. Seydel, Practical Bifurcation and Stability Analysis (2010), ch. 4; E. L. Allgower and K. Georg,
Introduction to Numerical Continuation Methods (2003), ch. 15: paths of equations that are smooth
piece by piece.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Literal

import numpy as np

from upd.hbm.core.factors import EPS, Border
from upd.hbm.core.newton import (
    ROUNDING,
    FloatArray,
    PathProblem,
    Settings,
    State,
    across,
    bordered_factors,
    correct,
)
from upd.labels import Shown

log = logging.getLogger(__name__)

Status = Literal["complete", "stopped", "step limit"]
#: growth of the solution while p stands still that is taken for one without bound
UNBOUNDED = 10.0
#: points without a wanted value after which one of the path's own is hit when it comes there again
PROBE = 100
#: how far the corrector may move from the predicted point, in steps: farther away lies another
#: piece of the path
STRAY = 2.0


@dataclass(frozen=True, repr=False)
class Path(Shown):
    """Points of a path.

    Attributes
    ----------
    x : (n_step, n) ndarray
        Unknowns.
    p : (n_step,) ndarray
        Parameter.
    state : State
        The last state, from which the path can be continued.
    status : {"complete", "stopped", "step limit"}
    message : str
        Where and why it ended.
    """

    x: FloatArray
    p: FloatArray
    state: State
    status: Status
    message: str


def follow(
    problem: PathProblem,
    start: State | tuple[FloatArray, float],
    end: float,
    *,
    wanted: FloatArray | None = None,
    turned: float | None = None,
) -> Path:
    """Path from a solved point to a value of the parameter.

    A failed corrector shortens the step; when that ends, the path so far comes back with status
    "stopped". So does one that comes to a solution a second time, at a wanted value or one of its
    own every `PROBE` points: it is closed, or runs back on itself, and does not arrive.

    Parameters
    ----------
    problem : PathProblem
    start : State, or tuple of (n,) ndarray and float
        A solved point (x, p), or the state of an earlier path.
    end : float
        Parameter at which the path is complete.
    wanted : (k,) ndarray, optional
        Parameter values that are hit exactly.
    turned : float, optional
        A value on the other side of the start; a path that comes back as far has reversed its
        direction for good and ends there.

    Returns
    -------
    Path
    """
    most_points, at = problem.settings.most_points, problem.shown
    state = start if isinstance(start, State) else begin(problem, *start, end)
    marks = np.unique(np.append(np.asarray([] if wanted is None else wanted, dtype=float), end))
    rest = latest = 0
    xs, ps = [state.x], [state.p]
    passed: dict[float, list[FloatArray]] = {float(mark): [] for mark in marks}
    why = ""
    while len(ps) < most_points and not why and (end - state.p) * state.direction > 0:
        found = advance(problem, state, marks)
        if found is None:
            why = "no convergence with the smallest step; refine the samples or change the start"
            break
        state = found
        rest = len(ps) if abs(found.p - ps[-1]) > 4 * EPS * abs(found.p) else rest
        if rest < len(ps) and np.abs(found.x).max() > UNBOUNDED * np.abs(xs[rest]).max() > 0:
            xs, ps = xs[: rest + 1], ps[: rest + 1]
            why = "the answer grows without bound there; it needs damping, or more friction"
            break
        left = rest == len(ps)
        if found.p in passed:
            latest = len(ps)
        elif len(ps) - latest >= PROBE:
            marks, latest = np.union1d(marks, found.p), len(ps)
            passed[found.p] = []
        xs.append(found.x)
        ps.append(found.p)
        there = passed.get(found.p, [])
        again = (np.abs((found.x - x) / problem.scale(x)).max() <= ROUNDING for x in there)
        if left and any(again):
            why = (
                "the path came to the same solution a second time; it is closed, or runs back on "
                "itself"
            )
        elif turned is not None and (turned - state.p) * state.direction > 0:
            why = f"the path reversed its direction and came back past {at(turned)}"
        there.append(found.x)
    status: Status = "complete"
    message = f"reached {at(end)} in {len(ps)} points"
    if why:
        status, message = "stopped", f"stopped at {at(state.p)}: {why}"
        log.warning(message)
    elif (end - state.p) * state.direction > 0:
        status = "step limit"
        message = f"{most_points} points used before {at(end)}; it is at {at(state.p)}"
    return Path(np.array(xs), np.array(ps), state, status, message)


def begin(problem: PathProblem, x: FloatArray, p: float, end: float = np.inf) -> State:
    """State at a solved point (x, p), towards larger p, or towards an end.

    Parameters
    ----------
    problem : PathProblem
    x : (n,) ndarray
        Unknowns of the point.
    p : float
        Its parameter.
    end : float
        Value of the parameter to go to.

    Returns
    -------
    State
    """
    _, J, dp = problem.function(x, p, True)
    direction = 1.0 if end >= p else -1.0
    normal = across(x, direction)
    lu = bordered_factors(J, Border(dp, problem.scale(x), problem.p_scale, normal))
    tangent, sign = (normal, 0.0) if lu is None else (lu.tangent(), lu.sign)
    step = problem.settings.first_step
    return State(x, p, tangent, sign, step=step, direction=direction)


def advance(problem: PathProblem, state: State, marks: FloatArray | None = None) -> State | None:
    """One accepted step, round corners too, or None when even the smallest fails.

    Along one piece of the path the determinant keeps its sign but at bifurcations, which the
    tangent passes straight: a step whose determinant has another sign fell on another piece, or
    beyond the kink at which the path turns back, and is shortened.

    Parameters
    ----------
    problem : PathProblem
    state : State
        Where the path stands.
    marks : (k,) ndarray, optional
        Values of the parameter that are hit exactly.

    Returns
    -------
    State or None
        The next one.
    """
    return _PathStep(problem, state).taken(np.zeros(0) if marks is None else marks)


class _PathStep:
    """Steps from a state, in its scaled coordinates."""

    def __init__(self, problem: PathProblem, state: State) -> None:
        self.problem, self.state, self.D = problem, state, problem.scale(state.x)
        self.p_scale, self.s = problem.p_scale, problem.settings

    def taken(self, marks: FloatArray) -> State | None:
        """The first step that is good, of shorter and shorter ones."""
        s, state, h = self.s, self.state, self.state.step
        while h >= s.smallest_step:
            length, hit = self._to_mark(marks, h)
            guess, p = self._along(state.tangent, length)
            normal = state.tangent
            if hit is not None:
                p, normal = hit, across(state.x, state.tangent[-1])
            found = self._corrected(guess, p, normal, STRAY * length)
            if found is not None and hit is not None and length > s.kink_step:
                way = self._distance(found, state.x, state.p)
                # a chord turns by less than the tangents at its ends: beyond, it leads to another
                # pass
                if self._ahead(found) < np.cos(s.angle) * way:
                    found = None
            if hit is None and found is not None:
                found = self._on_mark(found, marks)
            if found is not None:
                cosine = float(np.clip(found.tangent @ state.tangent, -1, 1))
                angle = float(np.arccos(cosine))
                straight = angle <= s.angle or length <= s.kink_step
                # beyond a fold at a wanted p the sign is that of the opposite direction
                same = found.sign == state.sign or (
                    length <= s.bifurcation_step if angle <= s.angle else hit is not None
                )
                if straight and same:
                    tried = max(length, min(h, s.kink_step)) if hit is None else h
                    # at a wanted p the border does not tell the side: the path goes straight on, or
                    # as the determinant decides
                    on = cosine > np.cos(s.angle) or hit is None
                    side = 1.0 if on else found.sign * state.sign
                    return self._moved(found, side, _next_step(tried, angle, found.iterations, s))
            h = min(h, length) / 2
        return self._corner()

    def _corner(self) -> State | None:
        """One step round a corner of more than a right angle.

        A path has such corners where the equations are only piecewise smooth. Beyond the kink the
        tangent is that of the other piece, on the side on which the determinant of the equations
        bordered by the tangent keeps its sign: both pieces agree along the kink, hence so do their
        tangents across it.

        References
        ----------
        E. L. Allgower and K. Georg, Introduction to Numerical Continuation Methods (2003), ch. 15.
        """
        s, state = self.s, self.state
        reach = 4 * s.smallest_step
        while reach <= s.kink_step:
            _, J, dp = self.problem.function(*self._along(state.tangent, reach), True)
            lu = bordered_factors(J, Border(dp, self.D, self.p_scale, state.tangent))
            if lu is not None:
                tangent = lu.tangent() * (lu.sign * state.sign)
                if tangent @ state.tangent < np.cos(s.angle):
                    guess, p = self._along(tangent, reach)
                    found = correct(self.problem, guess, p, self.D, tangent)
                    if (
                        found is not None
                        and self._distance(found, state.x, state.p) <= STRAY * reach
                        # a tangent of the other sign runs back on the piece the path came from
                        and found.sign == state.sign
                    ):
                        return self._moved(found, 1.0, reach)
            reach *= 4
        return None

    def _on_mark(self, found: State, marks: FloatArray) -> State | None:
        """The solution at a wanted p that an arclength step went past.

        The step's own when none was passed or that one is not found. One that is not between both
        ends of the step along its tangent is of another pass, as where Newton's method crosses a
        fold: the step is none then.
        """
        state = self.state
        lo, hi = sorted((state.p, found.p))
        passed = marks[(marks > lo + 4 * EPS * abs(lo)) & (marks < hi)]
        if not len(passed):
            return found
        mark = float(passed[0] if found.p > state.p else passed[-1])
        share = (mark - state.p) / (found.p - state.p)
        guess, most = (
            state.x + share * (found.x - state.x),
            self._distance(found, state.x, state.p),
        )
        there = self._corrected(guess, mark, across(state.x, found.p - state.p), most)
        if there is None:
            return found
        return there if 0.0 < self._ahead(there) < self._ahead(found) else None

    def _corrected(self, x: FloatArray, p: float, normal: FloatArray, most: float) -> State | None:
        """The solution in the plane through a point, or none when it strays farther than `most`."""
        found = correct(self.problem, x, p, self.D, normal)
        return found if found is not None and self._distance(found, x, p) <= most else None

    def _along(self, direction: FloatArray, length: float) -> tuple[FloatArray, float]:
        """The point at a scaled distance from the state."""
        x = self.state.x + length * direction[:-1] * self.D
        return x, self.state.p + length * float(direction[-1]) * self.p_scale

    def _ahead(self, found: State) -> float:
        """How far a solution is from the state along its tangent, scaled."""
        at = self.state
        way = np.append((found.x - at.x) / self.D, (found.p - at.p) / self.p_scale)
        return float(way @ at.tangent)

    def _distance(self, found: State, x: FloatArray, p: float) -> float:
        """Scaled length of the way from a point to a solution."""
        return float(np.hypot(np.linalg.norm((found.x - x) / self.D), (found.p - p) / self.p_scale))

    def _moved(self, found: State, side: float, step: float) -> State:
        """The state at a solution, with its tangent to one side."""
        tangent = side * found.tangent
        tangent[:-1] = tangent[:-1] * self.D / self.problem.scale(found.x)
        tangent /= np.linalg.norm(tangent)
        sign, direction = side * found.sign, self.state.direction
        return found._replace(tangent=tangent, sign=sign, step=step, direction=direction)

    def _to_mark(self, marks: FloatArray, h: float) -> tuple[float, float | None]:
        """Step length cut at the next wanted p, and that p when it lies within the step."""
        at = self.state
        rate = at.tangent[-1] * self.p_scale
        ahead = marks[(marks - at.p) * np.sign(rate) > 4 * EPS * abs(at.p)] if rate else marks[:0]
        if not len(ahead):
            return h, None
        mark = float(ahead[np.argmin(np.abs(ahead - at.p))])
        length = (mark - at.p) / rate
        return (length, mark) if length <= h else (h, None)


def _next_step(h: float, angle: float, iterations: int, s: Settings) -> float:
    by_angle = s.angle / 2 / max(angle, s.angle / 16)
    by_count = s.wanted_iterations / max(iterations, 1)
    return float(
        np.clip(h * np.clip(min(by_angle, by_count), 0.5, 2.0), 2 * s.smallest_step, s.largest_step)
    )
