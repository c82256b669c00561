"""Schur complement and factor by the solver of one's choice, and solvers with a bound of the error.

For K x = b and an answer x with the true residual r = b - K x the error e = K^-1 r has the energy

    |e|_K^2 = r' K^-1 r <= r' M r / lambda_min(M K)

for every symmetric positive definite M. With a factor of K as M the smallest eigenvalue is one but
for rounding; with multigrid it is measured (`upd.linalg.conjugate`). The displacement under a force
at dof i is wrong by at most sqrt(C_ii) |e|_K, and a compliance C = B' K^-1 B sees no more of the
error than |B' e|_{C^-1} <= |e|_K, whatever B is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import ConvergenceError, InputError
from upd.linalg.common import Condensed, Factor, FloatArray, log
from upd.linalg.pardiso import factorise_pardiso, schur_pardiso
from upd.linalg.select import choose
from upd.linalg.superlu import factorise_superlu, schur_superlu
from upd.linalg.symmetric import Matrix


def _direct(n_dof: int, n_kept: int, solver: str) -> str:
    """Name of a direct solver. "auto" never turns to multigrid here, which has no factor."""
    choice = choose(n_dof, n_kept, solver=solver, direct=True)
    log.info("solver %s: %s", choice.name, choice.why)
    return choice.name


def schur_complement(
    K: Any, kept: ArrayLike, *, solver: str = "auto", keep_factor: bool = True
) -> Condensed:
    """Schur complement of a symmetric matrix on some dofs, and the recovery of the others.

    Parameters
    ----------
    K : (n, n) sparse array or array_like
        N/mm; K_ii must be positive definite, S may be singular.
    kept : (k,) array_like of int
        In any order.
    solver : {"auto", "pardiso", "superlu"}
    keep_factor : bool, default True
        Hold the factor for `recover`; otherwise `recover` factorises once more when first called.

    Returns
    -------
    Condensed

    Raises
    ------
    InputError
        For a bad K, bad dofs or a missing solver.
    ConvergenceError
        When a part of the body floats.
    """
    n = int(K.shape[0]) if hasattr(K, "shape") else 0
    # with every dof kept there is nothing to factorise
    everything = np.size(kept) == n and n > 0
    name = "superlu" if everything else _direct(n, int(np.size(kept)), solver)
    run = schur_pardiso if name == "pardiso" else schur_superlu
    return run(K, kept, keep_factor=keep_factor)


def factorise(K: Any, *, solver: str = "auto") -> Factor:
    """Factor of a symmetric positive definite matrix: a function of right-hand sides.

    Parameters
    ----------
    K : (n, n) sparse array or array_like
        N/mm.
    solver : {"auto", "pardiso", "superlu"}

    Returns
    -------
    Factor
        Call it with (n,) or (n, m) for K^-1 rhs.

    Raises
    ------
    InputError
        For a bad K or a missing solver.
    ConvergenceError
        For a floating body.

    Examples
    --------
    >>> import numpy as np
    >>> from upd.linalg import factorise
    >>> solve = factorise(np.array([[2.0, -1.0], [-1.0, 2.0]]), solver="superlu")
    >>> solve(np.array([3.0, 0.0])).round(9).tolist()
    [2.0, 1.0]
    >>> solve.solver
    'superlu'
    """
    if not hasattr(K, "shape") or len(K.shape) != 2:
        raise InputError("factorise needs a square matrix.")
    name = _direct(int(K.shape[0]), 0, solver)
    return factorise_pardiso(K) if name == "pardiso" else factorise_superlu(K)


@dataclass(frozen=True)
class Solved:
    """One answer.

    Attributes
    ----------
    x : (n,) ndarray
        Solution.
    error : float
        Bound of |x - K^-1 b|_K, root of N mm.
    iterations : int
        Products with K.
    """

    x: FloatArray
    error: float
    iterations: int


class DirectSolver:
    """A kept factor of K. Each answer is refined once, which bounds its error.

    Parameters
    ----------
    K : (n, n) Symmetric or csr_array
        Stiffness, N/mm.
    name : {"auto", "pardiso", "superlu"}

    Raises
    ------
    InputError
        For a missing solver.
    ConvergenceError
        For a floating body.
    """

    def __init__(self, K: Matrix, name: str = "auto") -> None:
        self._K = K
        self._factor = factorise(K, solver=name)
        self.name = self._factor.solver

    def many(self, rhs: FloatArray, accuracy: float) -> list[Solved]:
        """K^-1 rhs for the columns of (n, m); raises ConvergenceError where the relative error in
        energy is larger.
        """
        x = self._factor(rhs)
        residual = rhs - self._K @ x
        more = self._factor(residual)
        # Of the answer before its refinement: the refined one is nearer by another factor like it.
        errors = np.sqrt(np.maximum(np.einsum("ij,ij->j", residual, more), 0.0))
        x = x + more
        sizes = np.sqrt(np.maximum(np.einsum("ij,ij->j", rhs, x), 0.0))
        for error, size in zip(errors, sizes, strict=True):
            if not error <= accuracy * size:
                raise ConvergenceError(
                    f"{self.name}: the refined answer has a relative error in energy of "
                    f"{error / size if size else float('nan'):.1e}, {accuracy:.0e} was asked: the "
                    "stiffness is nearly singular. A part of the body floats (hold the distant "
                    "set), elements are distorted, or a stiff part hangs on a much softer one."
                )
        return [Solved(one, float(error), 1) for one, error in zip(x.T, errors, strict=True)]
