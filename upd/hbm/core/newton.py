"""Newton's method for r(x, p) = 0 in the plane across a direction: the corrector of a path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

FloatArray = NDArray[np.float64]


class BorderedFactors(Protocol):
    """What solves with [[J, r_p], [normal]] in scaled unknowns."""

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
    """A Jacobian J that knows its structure, where a matrix (n, n) would be large."""

    @property
    def finite(self) -> bool:
        """Whether all its entries are."""

    def bordered(self, border: Border) -> BorderedFactors:
        """Factors of [[J, r_p], [normal]]."""


class Border(NamedTuple):
    """What makes a Jacobian J the matrix [[J, r_p], [normal]] of a plane, in scaled unknowns.

    Attributes
    ----------
    dp : (n,) ndarray
        Derivative of the residual by the parameter.
    D : (n,) ndarray
        Sizes of the unknowns.
    p_scale : float
        Size of the parameter.
    normal : (n + 1,) ndarray
        Across the plane, in scaled coordinates.
    """

    dp: FloatArray
    D: FloatArray
    p_scale: float
    normal: FloatArray

    @property
    def sizes(self) -> FloatArray:
        """Sizes of the unknowns, that of the parameter last (n + 1,)."""
        return np.append(self.D, self.p_scale)


#: (x, p, with Jacobian) -> residual (n,), Jacobian (n, n) or None, derivative by p (n,)
Function = Callable[
    [FloatArray, float, bool], tuple[FloatArray, FloatArray | StructuredJacobian | None, FloatArray]
]

Scale = Callable[[FloatArray], FloatArray]

EPS = float(np.finfo(float).eps)

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
    sign : float
        Sign of the bordered determinant.
    """

    x: FloatArray
    p: float
    tangent: FloatArray | None
    iterations: int
    sign: float = 0.0


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
    """

    function: Function
    scale: Scale
    p_scale: float = 1.0
    settings: Settings = Settings()

    def solve(self, x: FloatArray, p: float) -> Solution:
        """Newton at a fixed parameter from a guess."""
        normal = np.zeros(len(x) + 1)
        normal[-1] = 1.0
        return correct(self, x, p, self.scale(x), normal)


def finite_jacobian(J: FloatArray | StructuredJacobian | None) -> bool:
    """Whether there is a Jacobian, all of whose entries are finite.

    Parameters
    ----------
    J : (n, n) ndarray, StructuredJacobian or None

    Returns
    -------
    bool
    """
    if J is None:
        return False
    return bool(np.isfinite(J).all()) if isinstance(J, np.ndarray) else J.finite


def bordered_factors(J: FloatArray | StructuredJacobian | None, border: Border) -> BorderedFactors:
    """LU of [[J, r_p], [normal]] in scaled unknowns and equations.

    Parameters
    ----------
    J : (n, n) ndarray or StructuredJacobian
    border : Border

    Returns
    -------
    BorderedFactors
    """
    assert J is not None
    return Factors(J, border) if isinstance(J, np.ndarray) else J.bordered(border)


class Factors:
    """LU of [[J, r_p], [normal]] of a matrix J (n, n), equations divided by their largest entries.

    Attributes
    ----------
    singular : bool
        Whether a pivot is zero.
    sign : float
        Sign of the determinant, up to a factor that never changes on a path.
    ratio : float
        Smallest over largest pivot.
    """

    singular: bool
    sign: float
    ratio: float
    D: FloatArray

    def __init__(self, J: FloatArray, border: Border) -> None:
        n, self.D = len(J), border.D
        A = np.empty((n + 1, n + 1), order="F")
        np.multiply(J, border.D, out=A[:n, :n])
        A[:n, n] = border.dp * border.p_scale
        rows = np.abs(A[:n]).max(axis=1)
        rows[rows == 0] = 1.0
        A[:n] /= rows[:, None]
        A[n] = border.normal
        self._factorise(A, rows)

    def _factorise(self, A: FloatArray, rows: FloatArray) -> None:
        """Parameters: the matrix, overwritten, and what its equations were divided by."""
        self.rows = rows
        self.lu, self.piv, info = lapack.dgetrf(A, overwrite_a=True)
        diagonal = np.diagonal(self.lu)
        size = np.abs(diagonal)
        self.singular = info != 0 or not np.isfinite(size).all()
        if self.singular:
            self.sign, self.ratio = 0.0, EPS
            return
        swaps = int(np.count_nonzero(self.piv != np.arange(len(size))))
        negative = int(np.count_nonzero(diagonal < 0.0))
        self.sign = 1.0 if (swaps + negative) % 2 == 0 else -1.0
        self.ratio = max(float(size.min() / size.max()), EPS)

    def _condensed(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled unknowns of the factored equations."""
        right = np.empty(len(self.rows) + 1)
        np.divide(r, self.rows, out=right[:-1])
        right[-1] = last
        return np.asarray(lapack.dgetrs(self.lu, self.piv, right, overwrite_b=True)[0])

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        return self._condensed(r, last)

    def tangent(self) -> FloatArray:
        """Unit vector along the path, on the side the border points to."""
        t = self.solve(np.zeros(len(self.D)), 1.0)
        return np.asarray(t / np.linalg.norm(t))


def correct(
    problem: PathProblem, guess: FloatArray, p_guess: float, D: FloatArray, normal: FloatArray
) -> Solution:
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
    Solution
        Its tangent is None when not found.

    References
    ----------
    P. Deuflhard, Newton Methods for Nonlinear Problems (2004), 3.3.
    """
    function, _, p_scale, s = problem
    x, p = guess.copy(), p_guess
    for count in range(1, s.iterations + 1):
        r, J, dp = function(x, p, True)
        if not finite_jacobian(J):
            break
        lu = bordered_factors(J, Border(dp, D, p_scale, normal))
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
                x, p = x_new + rest[:-1] * D, p_new + float(rest[-1]) * p_scale
                return Solution(x, p, lu.tangent(), count + 1, lu.sign)
            shrinks = float(np.linalg.norm(rest)) / float(np.linalg.norm(correction))
            if factor == 1 and shrinks <= CHORD:
                x, p, correction = x_new, p_new, rest
            elif shrinks <= 1 - factor / 4:
                break
            else:
                factor /= 2
        else:
            return Solution(x, p, None, count)
        x, p = x_new, p_new
    return Solution(x, p, None, s.iterations)


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
