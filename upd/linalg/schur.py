"""Schur complement and factor by the solver of one's choice."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError
from upd.linalg.common import Condensation, Factor, checked_dofs, checked_matrix, checked_vectors, log
from upd.linalg.pardiso import factorise_pardiso, schur_pardiso
from upd.linalg.select import choose
from upd.linalg.superlu import factorise_superlu, schur_superlu


def _direct(n_dof: int, n_kept: int, solver: str) -> str:
    """Name of a direct solver. "auto" never turns to multigrid here, which has no factor."""
    choice = choose(n_dof, n_kept, solver=solver, direct=True)
    log.info("solver %s: %s", choice.name, choice.why)
    return choice.name


def schur_complement(K: Any, kept: ArrayLike, *, solver: str = "auto", keep_factor: bool = True) -> Condensation:
    """Schur complement of a symmetric K (n, n) on the dofs `kept` (k,), and the recovery of the others.

    solver : "auto", "pardiso" or "superlu". K_ii must be positive definite; S may be singular.
    Raises InputError for a bad K, bad dofs or a missing solver, ConvergenceError when a part of the body floats.
    """
    n = int(K.shape[0]) if hasattr(K, "shape") else 0
    if np.size(kept) == n and n > 0:
        return _all_kept(K, kept)
    name = _direct(n, int(np.size(kept)), solver)
    run = schur_pardiso if name == "pardiso" else schur_superlu
    return run(K, kept, keep_factor=keep_factor)


def _all_kept(K: Any, kept: ArrayLike) -> Condensation:
    """Nothing to condense: S is K in the order of the kept dofs."""
    A = checked_matrix(K)
    order = checked_dofs(kept, A.shape[0])
    S = A[order][:, order].toarray()

    def recover(u_kept: Any) -> Any:
        u_b = checked_vectors(u_kept, len(order), "displacement of the kept dofs")
        u = np.empty_like(u_b)
        u[order] = u_b
        return u

    return Condensation(0.5 * (S + S.T), recover, "none", 0.0, 0, S.nbytes)


def factorise(K: Any, *, solver: str = "auto") -> Factor:
    """Factor of a symmetric positive definite K (n, n): a function of right-hand sides. solver: "auto", "pardiso" or "superlu".

    Raises InputError for a bad K or a missing solver, ConvergenceError for a floating body.
    """
    if not hasattr(K, "shape") or len(K.shape) != 2:
        raise InputError("factorise needs a square matrix.")
    name = _direct(int(K.shape[0]), 0, solver)
    return factorise_pardiso(K) if name == "pardiso" else factorise_superlu(K)
