"""Solvers that are set up once and answer one right-hand side at a time, each with a bound of its
error in energy.

For K x = b and an answer x with the true residual r = b - K x the error e = K^-1 r has the energy

    |e|_K^2 = r' K^-1 r <= r' M r / lambda_min(M K)

for every symmetric positive definite M. With a factor of K as M the smallest eigenvalue is one but
for rounding; with multigrid it is measured (`upd.linalg.conjugate`). The displacement under a force
at dof i is wrong by at most sqrt(C_ii) |e|_K, and a compliance C = B' K^-1 B sees no more of the
error than |B' e|_{C^-1} <= |e|_K, whatever B is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from upd.errors import ConvergenceError
from upd.linalg.common import FloatArray
from upd.linalg.schur import factorise
from upd.linalg.symmetric import Matrix


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


class Solver(Protocol):
    """A stiffness ready for right-hand sides.

    Attributes
    ----------
    name : str
    seconds : float
        Of its set-up.
    """

    name: str
    seconds: float

    def __call__(self, rhs: FloatArray, accuracy: float) -> Solved:
        """K^-1 rhs to a relative error in energy.

        Raises ConvergenceError where it is not reached.
        """
        ...

    def many(self, rhs: FloatArray, accuracy: float) -> list[Solved]:
        """The same for the columns of (n, m)."""
        ...


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
        self.seconds = self._factor.seconds

    def __call__(self, rhs: FloatArray, accuracy: float) -> Solved:
        """K^-1 rhs; raises ConvergenceError where the relative error in energy is larger."""
        return self.many(rhs[:, None], accuracy)[0]

    def many(self, rhs: FloatArray, accuracy: float) -> list[Solved]:
        """The same for the columns of (n, m)."""
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
