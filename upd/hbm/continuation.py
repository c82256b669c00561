"""Pseudo-arclength continuation of r(x, p) = 0.

It passes folds, lands on wanted parameter values, and its message says where and why it stops.
Lengths are measured in units of `scale`, which may follow the solution, so that unknowns of any
size weigh alike.

References
----------
H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems (1977);
R. Seydel, Practical Bifurcation and Stability Analysis (2010), ch. 4.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.newton import (
    EPS,
    FloatArray,
    Function,
    Scale,
    Settings,
    Solution,
    bordered_factors,
    correct,
    cross_section,
    finite_jacobian,
)

log = logging.getLogger(__name__)

Status = Literal["complete", "stopped", "step limit"]
#: growth of the solution while p stands still that is taken for one without bound
UNBOUNDED = 10.0
#: how far the corrector may move from the predicted point, in steps: farther away lies another
#: piece of the path
STRAY = 2.0


class State(NamedTuple):
    """Where a path stands: enough to go on.

    Attributes
    ----------
    x : (n,) ndarray
        Unknowns.
    p : float
        Parameter.
    tangent : (n + 1,) ndarray
        In scaled coordinates.
    step : float
        Next step, in scaled arclength.
    direction : float
        Direction of p at the start of the path, +1 or -1.
    sign : float
        Sign of the determinant of the equations bordered by the tangent.
    """

    x: FloatArray
    p: float
    tangent: FloatArray
    step: float
    direction: float
    sign: float


@dataclass(frozen=True)
class Path:
    """Points of a path.

    Attributes
    ----------
    x : (n_step, n) ndarray
        Unknowns.
    p : (n_step,) ndarray
        Parameter.
    iterations : (n_step,) ndarray of int
        Newton iterations.
    state : State
        The last state, from which the path can be continued.
    status : {"complete", "stopped", "step limit"}
    message : str
        Where and why it ended.
    """

    x: FloatArray
    p: FloatArray
    iterations: NDArray[np.int64]
    state: State
    status: Status
    message: str


def begin(
    function: Function, x: FloatArray, p: float, scale: Scale, p_scale: float, settings: Settings
) -> State:
    """State at a solved point (x, p), towards larger p.

    Parameters
    ----------
    function, scale
        As in `solve`.
    x : (n,) ndarray
        Unknowns of the point.
    p : float
        Its parameter.
    p_scale : float
        Size of the parameter.
    settings : Settings

    Returns
    -------
    State
    """
    return _begin(function, x, p, np.inf, scale, p_scale, settings)


def direction_reversed(state: State) -> State:
    """The same point, to be left in the opposite direction."""
    return state._replace(tangent=-state.tangent, sign=-state.sign)


def walk(
    function: Function, state: State, scale: Scale, p_scale: float, settings: Settings
) -> tuple[Solution | None, State]:
    """One step along the path, round corners too.

    Parameters
    ----------
    function, scale
        As in `solve`.
    state : State
        Where the path stands.
    p_scale : float
        Size of the parameter.
    settings : Settings

    Returns
    -------
    solution : Solution or None
        None when even the smallest step fails.
    state : State
        The next state; the same one when the step fails.
    """
    return _advance(function, state, np.zeros(0), scale, p_scale, settings)


def follow(
    function: Function,
    start: State | tuple[FloatArray, float],
    end: float,
    *,
    scale: Scale,
    p_scale: float,
    wanted: FloatArray | None = None,
    turned: float | None = None,
    settings: Settings | None = None,
) -> Path:
    """Path from a solved point to a value of the parameter.

    A failed corrector shortens the step; when that ends, the path so far comes back with status
    "stopped".

    Parameters
    ----------
    function : callable
        (x, p, with Jacobian) -> residual (n,), Jacobian (n, n) or None, derivative by p (n,).
    start : State, or tuple of (n,) ndarray and float
        A solved point (x, p), or the state of an earlier path.
    end : float
        Parameter at which the path is complete.
    scale : callable
        x (n,) -> sizes of the unknowns (n,).
    p_scale : float
        Size of the parameter.
    wanted : (k,) ndarray, optional
        Parameter values that are hit exactly.
    turned : float, optional
        A value on the other side of the start; a path that comes back as far has reversed its
        direction for good and ends there.
    settings : Settings, optional

    Returns
    -------
    Path
    """
    s = settings or Settings()
    state = (
        start
        if isinstance(start, State)
        else _begin(function, start[0], start[1], end, scale, p_scale, s)
    )
    marks = np.unique(np.append(np.asarray([] if wanted is None else wanted, dtype=float), end))
    rest = 0
    xs, ps, counts = [state.x], [state.p], [0]
    while len(ps) < s.most_points:
        if (end - state.p) * state.direction <= 0:
            return _path(
                xs, ps, counts, state, "complete", f"reached p = {end:.9g} in {len(ps)} points"
            )
        found, state = _advance(function, state, marks, scale, p_scale, s)
        if found is None:
            message = (
                f"stopped at p = {state.p:.9g}: no convergence with the smallest step; refine "
                "the samples or change the start"
            )
            log.warning(message)
            return _path(xs, ps, counts, state, "stopped", message)
        rest = len(ps) if abs(found.p - ps[-1]) > 4 * EPS * abs(found.p) else rest
        if rest < len(ps) and np.abs(found.x).max() > UNBOUNDED * np.abs(xs[rest]).max() > 0:
            message = (
                f"stopped at p = {found.p:.9g}: the answer grows without bound there; it needs "
                "damping, or more friction"
            )
            log.warning(message)
            return _path(
                xs[: rest + 1], ps[: rest + 1], counts[: rest + 1], state, "stopped", message
            )
        xs.append(found.x)
        ps.append(found.p)
        counts.append(found.iterations)
        if turned is not None and (turned - state.p) * state.direction > 0:
            message = (
                f"stopped at p = {state.p:.9g}: the path reversed its direction and came back "
                f"past {turned:.9g}"
            )
            log.warning(message)
            return _path(xs, ps, counts, state, "stopped", message)
    return _path(
        xs,
        ps,
        counts,
        state,
        "step limit",
        f"{s.most_points} points used before p = {end:.9g}; it stands at p = {state.p:.9g}",
    )


def _path(
    xs: list[FloatArray],
    ps: list[float],
    counts: list[int],
    state: State,
    status: Status,
    message: str,
) -> Path:
    return Path(
        np.array(xs), np.array(ps), np.array(counts, dtype=np.int64), state, status, message
    )


def _begin(
    function: Function,
    x: FloatArray,
    p: float,
    end: float,
    scale: Scale,
    p_scale: float,
    s: Settings,
) -> State:
    D = scale(x)
    _, J, dp = function(x, p, True)
    direction = 1.0 if end >= p else -1.0
    normal = np.zeros(len(x) + 1)
    normal[-1] = direction
    lu = bordered_factors(J, dp, D, p_scale, normal)
    return State(x, p, lu.tangent(), s.first_step, direction, lu.sign)


def _advance(
    function: Function, state: State, marks: FloatArray, scale: Scale, p_scale: float, s: Settings
) -> tuple[Solution | None, State]:
    """One accepted step, or None when even the smallest fails."""
    h, D = state.step, scale(state.x)
    while h >= s.smallest_step:
        length, hit = _to_mark(state, marks, h, p_scale)
        guess, p = (
            state.x + length * state.tangent[:-1] * D,
            state.p + length * state.tangent[-1] * p_scale,
        )
        normal = state.tangent
        if hit is not None:
            p, normal = hit, np.zeros_like(state.tangent)
            normal[-1] = np.sign(state.tangent[-1])
        found = _near(
            correct(function, guess, p, D, p_scale, normal, s),
            guess,
            p,
            D,
            p_scale,
            STRAY * length,
        )
        if hit is None and found.tangent is not None:
            found = _on_mark(function, state, found, marks, D, p_scale, s)
        if found.tangent is not None:
            cosine = float(np.clip(found.tangent @ state.tangent, -1, 1))
            angle = float(np.arccos(cosine))
            straight = angle <= s.angle or length <= s.kink_step
            # along one piece the determinant keeps its sign, but for bifurcations: elsewhere the
            # step fell on another piece
            same = hit is not None or found.sign == state.sign or length <= s.bifurcation_step
            if straight and same:
                step = _next_step(
                    max(length, min(h, s.kink_step)) if hit is None else h,
                    angle,
                    found.iterations,
                    s,
                )
                # at a wanted p the border does not tell the side: the path goes straight on, or as
                # the determinant says
                side = 1.0 if cosine > np.cos(s.angle) or hit is None else found.sign * state.sign
                return found, State(
                    found.x,
                    found.p,
                    _rescaled(side * found.tangent, D, scale(found.x)),
                    step,
                    state.direction,
                    side * found.sign,
                )
        h = min(h, length) / 2
    return _corner(function, state, D, p_scale, scale, s)


def _corner(
    function: Function, state: State, D: FloatArray, p_scale: float, scale: Scale, s: Settings
) -> tuple[Solution | None, State]:
    """One step round a corner of more than a right angle.

    A path has such corners where the equations are only piecewise smooth. Beyond the kink the
    tangent is that of the other piece, on the side on which the determinant of the equations
    bordered by the tangent keeps its sign: both pieces agree along the kink, hence so do their
    tangents across it.

    References
    ----------
    E. L. Allgower and K. Georg, Introduction to Numerical Continuation Methods (2003), ch. 15.
    """
    reach = 4 * s.smallest_step
    while reach <= s.kink_step:
        _, J, dp = function(
            state.x + reach * state.tangent[:-1] * D,
            state.p + reach * state.tangent[-1] * p_scale,
            True,
        )
        lu = bordered_factors(J, dp, D, p_scale, state.tangent) if finite_jacobian(J) else None
        if lu is not None and not lu.singular:
            tangent = lu.tangent() * (lu.sign * state.sign)
            if tangent @ state.tangent < np.cos(s.angle):
                found = cross_section(
                    function,
                    Solution(state.x, state.p, None, 0, 0.0),
                    D,
                    p_scale,
                    tangent,
                    reach,
                    s,
                )
                found = _near(found, state.x, state.p, D, p_scale, STRAY * reach)
                # a tangent of the other sign runs back on the piece the path came from
                if found.tangent is not None and found.sign == state.sign:
                    moved = _rescaled(found.tangent, D, scale(found.x))
                    return found, State(found.x, found.p, moved, reach, state.direction, found.sign)
        reach *= 4
    return None, state


def _on_mark(
    function: Function,
    state: State,
    found: Solution,
    marks: FloatArray,
    D: FloatArray,
    p_scale: float,
    s: Settings,
) -> Solution:
    """The solution at a wanted p that an arclength step went past.

    The step's own when none was passed or that one is not found.
    """
    lo, hi = sorted((state.p, found.p))
    passed = marks[(marks > lo + 4 * EPS * abs(lo)) & (marks < hi)]
    if not len(passed):
        return found
    mark = float(passed[0] if found.p > state.p else passed[-1])
    share = (mark - state.p) / (found.p - state.p)
    normal = np.zeros_like(state.tangent)
    normal[-1] = np.sign(found.p - state.p)
    guess, most = (
        state.x + share * (found.x - state.x),
        _distance(found.x - state.x, found.p - state.p, D, p_scale),
    )
    there = _near(
        correct(function, guess, mark, D, p_scale, normal, s), guess, mark, D, p_scale, most
    )
    return there if there.tangent is not None else found


def _distance(dx: FloatArray, dp: float, D: FloatArray, p_scale: float) -> float:
    """Scaled length of a difference of points."""
    return float(np.hypot(np.linalg.norm(dx / D), dp / p_scale))


def _near(
    found: Solution, x: FloatArray, p: float, D: FloatArray, p_scale: float, most: float
) -> Solution:
    """The solution, or none when it strays farther than `most` from where it was expected."""
    return (
        found
        if _distance(found.x - x, found.p - p, D, p_scale) <= most
        else found._replace(tangent=None)
    )


def _rescaled(tangent: FloatArray, old: FloatArray, new: FloatArray) -> FloatArray:
    moved = np.append(tangent[:-1] * old / new, tangent[-1])
    return np.asarray(moved / np.linalg.norm(moved))


def _to_mark(
    state: State, marks: FloatArray, h: float, p_scale: float
) -> tuple[float, float | None]:
    """Step length cut at the next wanted p, and that p when it lies within the step."""
    rate = state.tangent[-1] * p_scale
    ahead = marks[(marks - state.p) * np.sign(rate) > 4 * EPS * abs(state.p)] if rate else marks[:0]
    if not len(ahead):
        return h, None
    mark = float(ahead[np.argmin(np.abs(ahead - state.p))])
    length = (mark - state.p) / rate
    return (length, mark) if length <= h else (h, None)


def _next_step(h: float, angle: float, iterations: int, s: Settings) -> float:
    by_angle = s.angle / 2 / max(angle, s.angle / 16)
    by_count = s.wanted_iterations / max(iterations, 1)
    return float(
        np.clip(h * np.clip(min(by_angle, by_count), 0.5, 2.0), 2 * s.smallest_step, s.largest_step)
    )
