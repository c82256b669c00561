"""Schur complement and factor by the solver of one's choice."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError
from upd.linalg.common import (
    Condensation,
    Factor,
    checked_dofs,
    log,
)
from upd.linalg.pardiso import factorise_pardiso, schur_pardiso
from upd.linalg.select import choose
from upd.linalg.superlu import factorise_superlu, schur_superlu
from upd.linalg.symmetric import checked
from upd.linalg.uncoupled import uncoupled


def _direct(n_dof: int, n_kept: int, solver: str) -> str:
    """Name of a direct solver. "auto" never turns to multigrid here, which has no factor."""
    choice = choose(n_dof, n_kept, solver=solver, direct=True)
    log.info("solver %s: %s", choice.name, choice.why)
    return choice.name


def schur_complement(
    K: Any, kept: ArrayLike, *, solver: str = "auto", keep_factor: bool = True
) -> Condensation:
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
    Condensation

    Raises
    ------
    InputError
        For a bad K, bad dofs or a missing solver.
    ConvergenceError
        When a part of the body floats.
    """
    n = int(K.shape[0]) if hasattr(K, "shape") else 0
    if np.size(kept) == n and n > 0:
        A = checked(K)
        found = uncoupled(A, checked_dofs(kept, n))
        assert found is not None
        return found
    name = _direct(n, int(np.size(kept)), solver)
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
