"""Conjugate gradients that stop at an error in energy, with the bound they stop at.

With M symmetric positive definite and r = b - K x, |x - K^-1 b|_K^2 = r' K^-1 r <= r' M r /
lambda_min(M K). The smallest eigenvalue is the smallest Ritz value of the iteration itself, which
comes down to it while the residual still has a part along that eigenvector, or of an iteration
before with the same M that came lower, less the norm of its residual: that much it may still come
down. r' M r is at hand in every step. Where the recurrence reports convergence, r is formed again
and the iteration continues from there if it is not.

References
----------
.. [1] Z. Strakos, P. Tichy, On error estimation in the conjugate gradient method, ETNA 13 (2002)
   56.
.. [2] Y. Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., section 6.7 (Ritz values from
   the coefficients) and 6.6 (the norm of its residual).
.. [3] B. N. Parlett, The Symmetric Eigenvalue Problem, theorem 4.5.1 (an eigenvalue within it).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh_tridiagonal

from upd.errors import ConvergenceError
from upd.linalg.common import FloatArray
from upd.linalg.schur import Solved

#: Iterations after which r' M r must have come down to a quarter, or the smallest Ritz value to
#: half.
STALL = 300
# Iterations between looks at the Ritz values.
_LOOK = 5


class LowestRitz(NamedTuple):
    """The smallest eigenvalue of M K as an iteration has seen it.

    Attributes
    ----------
    value : float
        Ritz value, from above.
    below : float
        It minus the norm of its residual: an eigenvalue lies between this and twice as far above.
    """

    value: float
    below: float


#: before any iteration
UNSEEN = LowestRitz(np.inf, np.inf)


def conjugate_gradients(
    product: Callable[[FloatArray], FloatArray],
    precondition: Callable[[FloatArray], FloatArray],
    rhs: FloatArray,
    *,
    accuracy: float,
    max_iterations: int,
    lowest: LowestRitz = UNSEEN,
) -> tuple[Solved, LowestRitz]:
    """Solve K x = b until the bound of the relative error in energy is small enough.

    Parameters
    ----------
    product, precondition : callable
        x -> K x and r -> M r.
    rhs : (n,) ndarray
        b.
    accuracy : float
        Of |x - K^-1 b|_K over |x|_K.
    max_iterations : int
    lowest : LowestRitz
        Known so far.

    Returns
    -------
    Solved, LowestRitz
        The answer, and the smallest eigenvalue of this iteration and those before.

    Raises
    ------
    ConvergenceError
        When K or M is not positive definite, when it makes no progress over `STALL` iterations, or
        after `max_iterations`.
    """
    x, r = np.zeros(len(rhs)), rhs.copy()
    count, before = 0, np.inf
    while True:
        z = precondition(r)
        rz = float(r @ z)
        error, size = bound(rz, lowest), np.sqrt(max(float(x @ rhs), 0.0))
        if error <= accuracy * size:
            return Solved(x, error, count), lowest
        if count and not error < 0.5 * before:
            raise stopped(count, error, size, accuracy, "rounding holds the residual")
        before = float(error) if count else np.inf
        best, at_best, best_at = np.inf, lowest.value, count
        p, steps, ratios = z.copy(), [], []
        while True:
            Kp = product(p)
            curvature = float(p @ Kp)
            if not (curvature > 0.0 and rz > 0.0 and np.isfinite(curvature)):
                raise stopped(
                    count, error, size, accuracy, "the stiffness is not positive definite"
                )
            alpha = rz / curvature
            x += alpha * p
            r -= alpha * Kp
            z = precondition(r)
            new = float(r @ z)
            steps.append(alpha)
            ratios.append(new / rz)
            count += 1
            may_end = bound(new, lowest) <= accuracy * size
            if may_end or count % _LOOK == 0 or new == 0.0 or count >= max_iterations:
                found = _lowest_ritz(steps, ratios)
                if found.value <= lowest.value:
                    lowest = found
                held = np.sqrt(max(new, 0.0))
                error, size = bound(new, lowest), np.sqrt(max(float(x @ rhs), 0.0))
                if error <= accuracy * size:
                    break
                # A smaller eigenvalue that shows is progress too.
                if held <= 0.5 * best or lowest.value <= 0.5 * at_best:
                    best, at_best, best_at = min(held, best), lowest.value, count
                if count - best_at >= STALL or count >= max_iterations:
                    raise stopped(count, error, size, accuracy, "it stalls")
            p *= new / rz
            p += z
            rz = new
        r = rhs - product(x)


def bound(rz: float, lowest: LowestRitz) -> float:
    """Bound of the error in energy from r' M r; infinite as long as no eigenvalue is known.

    Parameters
    ----------
    rz : float
        r' M r.
    lowest : LowestRitz

    Returns
    -------
    float
    """
    if not 0.0 < lowest.below < np.inf:
        return 0.0 if rz == 0.0 else np.inf
    return float(np.sqrt(max(rz, 0.0) / lowest.below))


def _lowest_ritz(steps: list[float], ratios: list[float]) -> LowestRitz:
    """Smallest eigenvalue of the Lanczos matrix of the coefficients."""
    a, b = np.array(steps), np.array(ratios)
    diagonal = 1.0 / a
    diagonal[1:] += b[:-1] / a[:-1]
    beside = np.sqrt(np.maximum(b, 0.0)) / a
    values, vectors = eigh_tridiagonal(diagonal, beside[:-1], select="i", select_range=(0, 0))
    value = float(values[0])
    return LowestRitz(value, value - float(beside[-1] * abs(vectors[-1, 0])))


def stopped(count: int, error: float, size: float, accuracy: float, why: str) -> ConvergenceError:
    """What to raise where an iteration ends without its answer.

    Parameters
    ----------
    count : int
        Iterations.
    error, size, accuracy : float
        Bound of the error in energy, energy of the answer, and what was asked of their ratio.
    why : str

    Returns
    -------
    ConvergenceError
    """
    reached = error / size if size > 0.0 else float("inf")
    return ConvergenceError(
        f"Multigrid: conjugate gradients stopped after {count} iterations with a relative error "
        f"in energy of {reached:.1e}, {accuracy:.0e} was asked: {why}. "
        "A part of the body floats (hold the distant set) or hangs on a much softer one, hexahedra "
        "are stretched, or nu is near one half: use a direct solver (solver.name = "
        '"pardiso"), a mesh with smaller aspect ratios, or more iterations; and give the '
        "rigid-body modes as near null space."
    )
