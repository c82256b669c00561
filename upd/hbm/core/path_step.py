"""One step along a path of r(x, p) = 0: past folds, round corners, onto wanted parameter values.

Lengths are measured in units of `scale`, which may follow the solution, so that unknowns of any
size weigh alike.

References
----------
E. L. Allgower and K. Georg, Introduction to Numerical Continuation Methods (2003), ch. 15:
paths of equations that are smooth piece by piece.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from upd.hbm.core.newton import (
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


def begin(
    function: Function,
    x: FloatArray,
    p: float,
    scale: Scale,
    p_scale: float,
    settings: Settings,
    end: float = np.inf,
) -> State:
    """State at a solved point (x, p), towards larger p, or towards an end.

    Parameters
    ----------
    function, scale
        As in `upd.hbm.core.continuation.follow`.
    x : (n,) ndarray
        Unknowns of the point.
    p : float
        Its parameter.
    p_scale : float
        Size of the parameter.
    settings : Settings
    end : float
        Value of the parameter to go to.

    Returns
    -------
    State
    """
    D = scale(x)
    _, J, dp = function(x, p, True)
    direction = 1.0 if end >= p else -1.0
    normal = np.zeros(len(x) + 1)
    normal[-1] = direction
    lu = bordered_factors(J, dp, D, p_scale, normal)
    return State(x, p, lu.tangent(), settings.first_step, direction, lu.sign)


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
        As in `upd.hbm.core.continuation.follow`.
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
    return advance(function, state, np.zeros(0), scale, p_scale, settings)


def advance(
    function: Function, state: State, marks: FloatArray, scale: Scale, p_scale: float, s: Settings
) -> tuple[Solution | None, State]:
    """One accepted step, or None when even the smallest fails.

    Along one piece of the path the determinant keeps its sign but at bifurcations, which the
    tangent passes straight: a step whose determinant has another sign fell on another piece, or
    beyond the kink at which the path turns back, and is shortened.

    Parameters
    ----------
    function, scale
        As in `upd.hbm.core.continuation.follow`.
    state : State
        Where the path stands.
    marks : (k,) ndarray
        Values of the parameter that are hit exactly.
    p_scale : float
        Size of the parameter.
    s : Settings
    """
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
        if hit is not None and length > s.kink_step:
            way = _distance(found.x - state.x, found.p - state.p, D, p_scale)
            # a chord turns by less than the tangents at its ends: beyond, it leads to another pass
            if _ahead(found, state, D, p_scale) < np.cos(s.angle) * way:
                found = found._replace(tangent=None)
        if hit is None and found.tangent is not None:
            found = _on_mark(function, state, found, marks, D, p_scale, s)
        if found.tangent is not None:
            cosine = float(np.clip(found.tangent @ state.tangent, -1, 1))
            angle = float(np.arccos(cosine))
            straight = angle <= s.angle or length <= s.kink_step
            # beyond a fold at a wanted p the sign is that of the opposite direction
            same = found.sign == state.sign or (
                length <= s.bifurcation_step if angle <= s.angle else hit is not None
            )
            if straight and same:
                step = _next_step(
                    max(length, min(h, s.kink_step)) if hit is None else h,
                    angle,
                    found.iterations,
                    s,
                )
                # at a wanted p the border does not tell the side: the path goes straight on, or as
                # the determinant decides
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

    The step's own when none was passed or that one is not found. One that is not between both ends
    of the step along its tangent is of another pass, as where Newton's method crosses a fold: the
    step is none then.
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
    if there.tangent is None:
        return found
    between = 0.0 < _ahead(there, state, D, p_scale) < _ahead(found, state, D, p_scale)
    return there if between else found._replace(tangent=None)


def _ahead(found: Solution, state: State, D: FloatArray, p_scale: float) -> float:
    """How far a solution is from the state along its tangent, scaled."""
    way = np.append((found.x - state.x) / D, (found.p - state.p) / p_scale)
    return float(way @ state.tangent)


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
