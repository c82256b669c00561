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
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

log = logging.getLogger(__name__)

FloatArray = NDArray[np.float64]


class BorderedFactors(Protocol):
    """LU of [[J, r_p], [normal]] in scaled unknowns and equations."""

    @property
    def singular(self) -> bool:
        """Whether a pivot is zero."""

    @property
    def sign(self) -> float:
        """Sign of the determinant, up to a factor that never changes on a path."""

    @property
    def ratio(self) -> float:
        """Smallest over largest pivot."""

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""

    def tangent(self) -> FloatArray:
        """Unit vector along the path, on the side the border points to."""


class StructuredJacobian(Protocol):
    """A Jacobian that knows its structure, where a matrix (n, n) would be large."""

    @property
    def finite(self) -> bool:
        """Whether all its entries are."""

    def bordered(
        self, dp: FloatArray, D: FloatArray, p_scale: float, normal: FloatArray
    ) -> BorderedFactors:
        """Factors of [[J, r_p], [normal]]."""


#: (x, p, with Jacobian) -> residual (n,), Jacobian (n, n) or None, derivative by p (n,)
Function = Callable[
    [FloatArray, float, bool], tuple[FloatArray, FloatArray | StructuredJacobian | None, FloatArray]
]
Scale = Callable[[FloatArray], FloatArray]
Status = Literal["complete", "stopped", "step limit"]
EPS = float(np.finfo(float).eps)
#: worst rounding level at which a point still counts as solved, relative to the solution
ROUNDING = 1e-7
#: growth of the solution while p stands still that is taken for one without bound
UNBOUNDED = 10.0
#: how far the corrector may move from the predicted point, in steps: farther away lies another
#: piece of the path
STRAY = 2.0
#: smallest share of a Newton correction that is tried: below it the corrector gives up and the step
#: is shortened
LEAST_DAMPING = 1 / 64
#: shrinkage of the corrections that spares new factors
CHORD = 0.03


@dataclass(frozen=True)
class Settings:
    """Step control of the continuation.

    Attributes
    ----------
    first_step, largest_step, smallest_step : float
        Steps in scaled arclength (1 = the size of the solution, or of p_scale).
    angle : float
        Largest angle between successive tangents [rad].
    kink_step : float
        Below this step the path may turn at any angle.
    bifurcation_step : float
        Below this step the determinant may change its sign.
    iterations : int
        Most Newton iterations of one corrector.
    wanted_iterations : int
        Newton iterations the step length aims at.
    tolerance : float
        On the scaled Newton step.
    most_points : int
        Most points of a path.
    """

    first_step: float = 0.02
    largest_step: float = 0.5
    smallest_step: float = 1e-7
    angle: float = 0.35
    #: below this step the path may turn at any angle: the kink where a contact begins to slip has
    #: none that shrinks with the step
    kink_step: float = 0.02
    #: below this step the determinant may change its sign: a bifurcation, not a step to another
    #: piece of the path
    bifurcation_step: float = 1e-4
    iterations: int = 12
    wanted_iterations: int = 4
    tolerance: float = 1e-10
    most_points: int = 5000


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


class Solution(NamedTuple):
    """Answer of a corrector.

    Attributes
    ----------
    x : (n,) ndarray
        Unknowns.
    p : float
        Parameter.
    tangent : (n + 1,) ndarray or None
        Scaled tangent, None when the corrector failed.
    iterations : int
        Newton iterations.
    ratio : float
        Smallest over largest pivot.
    sign : float
        Sign of the bordered determinant.
    """

    x: FloatArray
    p: float
    tangent: FloatArray | None
    iterations: int
    ratio: float
    sign: float = 0.0


def solve(
    function: Function, x: FloatArray, p: float, scale: Scale, settings: Settings | None = None
) -> Solution:
    """Newton at a fixed parameter.

    Parameters
    ----------
    function : callable
        (x, p, with Jacobian) -> residual (n,), Jacobian (n, n) or None, derivative by p (n,).
    x : (n,) ndarray
        Initial guess.
    p : float
        Parameter.
    scale : callable
        x (n,) -> sizes of the unknowns (n,).
    settings : Settings, optional

    Returns
    -------
    Solution
    """
    normal = np.zeros(len(x) + 1)
    normal[-1] = 1.0
    return _correct(function, x, p, scale(x), 1.0, normal, settings or Settings())


def cross_section(
    function: Function,
    base: Solution,
    D: FloatArray,
    p_scale: float,
    normal: FloatArray,
    distance: float,
    settings: Settings,
) -> Solution:
    """The solution in the plane across a direction.

    Parameters
    ----------
    function : callable
        As in `solve`.
    base : Solution
        Point the plane is measured from.
    D : (n,) ndarray
        Sizes of the unknowns.
    p_scale : float
        Size of the parameter.
    normal : (n + 1,) ndarray
        Direction across the plane, in scaled coordinates.
    distance : float
        Scaled distance of the plane from the base point.
    settings : Settings

    Returns
    -------
    Solution
        Its tangent is None when not found.
    """
    x, p = base.x + distance * normal[:-1] * D, base.p + distance * float(normal[-1]) * p_scale
    return _correct(function, x, p, D, p_scale, normal, settings)


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
    lu = _factors(J, dp, D, p_scale, normal)
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
            _correct(function, guess, p, D, p_scale, normal, s),
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
        lu = _factors(J, dp, D, p_scale, state.tangent) if _finite(J) else None
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
        _correct(function, guess, mark, D, p_scale, normal, s), guess, mark, D, p_scale, most
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


def _finite(J: FloatArray | StructuredJacobian | None) -> bool:
    if J is None:
        return False
    return bool(np.isfinite(J).all()) if isinstance(J, np.ndarray) else J.finite


def _factors(
    J: FloatArray | StructuredJacobian | None,
    dp: FloatArray,
    D: FloatArray,
    p_scale: float,
    normal: FloatArray,
) -> BorderedFactors:
    assert J is not None
    if isinstance(J, np.ndarray):
        return _Bordered(J, dp, D, p_scale, normal)
    return J.bordered(dp, D, p_scale, normal)


class _Bordered:
    """LU of [[J, r_p], [normal]] in scaled unknowns and equations."""

    def __init__(
        self, J: FloatArray, dp: FloatArray, D: FloatArray, p_scale: float, normal: FloatArray
    ) -> None:
        n = len(D)
        A = np.empty((n + 1, n + 1), order="F")
        np.multiply(J, D, out=A[:n, :n])
        A[:n, n] = dp * p_scale
        self.rows = np.abs(A[:n]).max(axis=1)
        self.rows[self.rows == 0] = 1.0
        A[:n] /= self.rows[:, None]
        A[n] = normal
        self.lu, self.piv, info = lapack.dgetrf(A, overwrite_a=True)
        self.singular = info != 0
        swaps = int(np.count_nonzero(self.piv != np.arange(n + 1)))
        self.sign = float(np.prod(np.sign(np.diagonal(self.lu)))) * (-1.0) ** swaps
        diagonal = np.abs(np.diagonal(self.lu))
        self.ratio = max(float(diagonal.min() / diagonal.max()), EPS)

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        return np.asarray(lapack.dgetrs(self.lu, self.piv, np.append(r / self.rows, last))[0])

    def tangent(self) -> FloatArray:
        """Unit vector along the path, on the side the border points to."""
        t = self.solve(np.zeros(len(self.rows)), 1.0)
        return np.asarray(t / np.linalg.norm(t))


def _correct(
    function: Function,
    guess: FloatArray,
    p_guess: float,
    D: FloatArray,
    p_scale: float,
    normal: FloatArray,
    s: Settings,
) -> Solution:
    """Newton in the plane through the guess, damped so that the next correction shrinks.

    Natural monotonicity: the test needs no scaling of the equations, only the factors at hand,
    which also serve for further corrections as long as these shrink fast.

    References
    ----------
    P. Deuflhard, Newton Methods for Nonlinear Problems (2004), 3.3.
    """
    x, p = guess.copy(), p_guess
    for count in range(1, s.iterations + 1):
        r, J, dp = function(x, p, True)
        if not _finite(J):
            break
        lu = _factors(J, dp, D, p_scale, normal)
        if lu.singular:
            break
        correction, factor = lu.solve(-r, 0.0), 1.0
        if not np.all(np.isfinite(correction)):
            break
        while factor >= LEAST_DAMPING:
            x_new, p_new = (
                x + factor * correction[:-1] * D,
                p + factor * float(correction[-1]) * p_scale,
            )
            r, _, _ = function(x_new, p_new, False)
            rest = lu.solve(-r, 0.0)
            if _solved(rest, correction, lu.ratio, s):
                return Solution(
                    x_new + rest[:-1] * D,
                    p_new + float(rest[-1]) * p_scale,
                    lu.tangent(),
                    count + 1,
                    lu.ratio,
                    lu.sign,
                )
            shrinks = float(np.linalg.norm(rest)) / float(np.linalg.norm(correction))
            if factor == 1 and shrinks <= CHORD:
                x, p, correction = x_new, p_new, rest
            elif shrinks <= 1 - factor / 4:
                break
            else:
                factor /= 2
        else:
            return Solution(x, p, None, count, 0.0)
        x, p = x_new, p_new
    return Solution(x, p, None, s.iterations, 0.0)


def _solved(rest: FloatArray, correction: FloatArray, ratio: float, s: Settings) -> bool:
    """Whether the corrections have come to the tolerance, or to rounding.

    The units of the path may be up to sqrt(n) times the sizes of the n unknowns, which share its
    length; no single one may be off by more than the tolerance of its size. Rounding is that of the
    residual, magnified by the condition of the equations, where the corrections no longer shrink.
    """
    size = float(np.abs(rest).max())
    return size * len(rest) ** 0.5 <= s.tolerance or (
        size <= min(EPS / ratio, ROUNDING) and size > float(np.abs(correction).max()) / 10
    )
