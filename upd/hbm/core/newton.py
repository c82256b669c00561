"""Newton's method for r(x, p) = 0 in the plane across a direction: the corrector of a path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.factors import EPS, Border, BorderedFactors, Factors, FactorsOf

FloatArray = NDArray[np.float64]


#: a finite matrix (n, n), or what gives the factors of one that would be large, with a border
Jacobian = FloatArray | FactorsOf
#: (x, p, with Jacobian) -> residual (n,), Jacobian or None, derivative by p (n,)
Function = Callable[[FloatArray, float, bool], tuple[FloatArray, Jacobian | None, FloatArray]]

Scale = Callable[[FloatArray], FloatArray]

#: worst rounding level at which a point still counts as solved, relative to the solution
ROUNDING = 1e-7

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
    sign : float
        Sign of the determinant of the equations bordered by the tangent.
    iterations : int
        Newton iterations of the corrector.
    step : float
        Next step, in scaled arclength.
    direction : float
        Direction of p at the start of the path, +1 or -1.
    """

    x: FloatArray
    p: float
    tangent: FloatArray
    sign: float
    iterations: int = 0
    step: float = 0.0
    direction: float = 1.0


class PathProblem(NamedTuple):
    """Equations of a path.

    Attributes
    ----------
    function : callable
        (x, p, with Jacobian) -> residual (n,), Jacobian (n, n) or None, derivative by p (n,).
    scale : callable
        x (n,) -> sizes of the unknowns (n,).
    p_scale : float
        Size of the parameter.
    settings : Settings
    shown : callable
        Value of the parameter -> its name, value and unit for messages.
    """

    function: Function
    scale: Scale
    p_scale: float = 1.0
    settings: Settings = Settings()
    shown: Callable[[float], str] = "p = {:.9g}".format

    def solve(self, x: FloatArray, p: float) -> State | None:
        """Newton at a fixed parameter from a guess."""
        return correct(self, x, p, self.scale(x), across(x, 1.0))


def across(x: FloatArray, rate: float) -> FloatArray:
    """Normal of the plane of one parameter, in scaled coordinates.

    Parameters
    ----------
    x : (n,) ndarray
        Unknowns.
    rate : float
        Its sign is that of the side.

    Returns
    -------
    (n + 1,) ndarray
    """
    normal = np.zeros(len(x) + 1)
    normal[-1] = np.sign(rate)
    return normal


def bordered_factors(J: Jacobian | None, border: Border) -> BorderedFactors | None:
    """LU of [[J, r_p], [normal]] in scaled unknowns and equations.

    Parameters
    ----------
    J : (n, n) ndarray or callable
    border : Border

    Returns
    -------
    BorderedFactors or None
        None without a finite Jacobian, and where the matrix is singular.
    """
    if J is None or (isinstance(J, np.ndarray) and not np.isfinite(J).all()):
        return None
    lu = Factors(J, border) if isinstance(J, np.ndarray) else J(border)
    return None if lu.singular else lu


def correct(
    problem: PathProblem, guess: FloatArray, p_guess: float, D: FloatArray, normal: FloatArray
) -> State | None:
    """Newton in the plane through the guess, damped so that the next correction shrinks.

    Natural monotonicity: the test needs no scaling of the equations, only the factors at hand,
    which also serve for further corrections as long as these shrink fast.

    Parameters
    ----------
    problem : PathProblem
    guess, p_guess : (n,) ndarray, float
        Where it begins.
    D : (n,) ndarray
        Sizes of the unknowns.
    normal : (n + 1,) ndarray
        Direction across the plane, in scaled coordinates.

    Returns
    -------
    State or None
        None when not found.

    References
    ----------
    P. Deuflhard, Newton Methods for Nonlinear Problems (2004), 3.3.
    """
    function, p_scale, s = problem.function, problem.p_scale, problem.settings
    x, p = guess.copy(), p_guess
    for count in range(1, s.iterations + 1):
        r, J, dp = function(x, p, True)
        lu = bordered_factors(J, Border(dp, D, p_scale, normal))
        if lu is None:
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
                x, p = x_new + rest[:-1] * D, p_new + float(rest[-1]) * p_scale
                return State(x, p, lu.tangent(), lu.sign, count + 1)
            shrinks = float(np.linalg.norm(rest)) / float(np.linalg.norm(correction))
            if factor == 1 and shrinks <= CHORD:
                x, p, correction = x_new, p_new, rest
            elif shrinks <= 1 - factor / 4:
                break
            else:
                factor /= 2
        else:
            break
        x, p = x_new, p_new
    return None


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
