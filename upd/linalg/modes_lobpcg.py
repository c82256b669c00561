"""LOBPCG with multigrid as preconditioner: modes of meshes too large to factor, memory like n.

Source: A. V. Knyazev, SIAM J. Sci. Comput. 23 (2001) 517; P. Arbenz et al., Int. J. Numer. Meth. Engng 64 (2005) 204 (multigrid, solids).
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, lobpcg

from upd.errors import ConvergenceError, InputError
from upd.linalg.amg import _set_up
from upd.linalg.common import EPS, FloatArray, checked_vectors, log
from upd.linalg.modes_checks import Modes, ritz

#: Iterations between two looks at the residuals, and how many looks.
_ROUND, _ROUNDS = 25, 20
#: A round must reduce the worst residual by this factor; after so many that did not, it has stalled.
_PROGRESS, _STALLS = 0.7, 4
#: Relative residual to reach; the frequencies are then good to its square.
_TARGET = 1e-7


def lobpcg_modes(K: csr_array, M: csr_array, count: int, near_null_space: ArrayLike | None, layout: ArrayLike | None) -> Modes:
    """At least `count` lowest modes; K and M as checked by `modes`.

    Rigid motions in the near null space (those without energy) are exact modes: the iteration runs M-orthogonally to them, and multigrid
    is built on K plus a little M so that its coarsest level is not singular.
    Raises InputError for a massless dof (the iteration works in the M norm) and for more modes than a fifth of the dofs.
    """
    n = K.shape[0]
    block = count + max(4, count // 3)
    if 5 * block >= n:
        raise InputError(f"LOBPCG: {count} modes are too many for {n} dofs: use solver 'dense'.")
    if not (M.diagonal() > 0.0).all():
        raise InputError("LOBPCG needs mass on every dof: condense massless dofs, or use a direct solver.")
    B = None if near_null_space is None else checked_vectors(near_null_space, n, "near null space").reshape(n, -1)
    rigid = _rigid(K, M, B)
    A = K if rigid.shape[1] == 0 else csr_array(K + _shift(K, M) * M)
    prepared = _set_up(A, B, layout)
    precondition: Any = LinearOperator(K.shape, matvec=prepared._cycle, matmat=lambda R: _columns(prepared._cycle, R), dtype=np.float64)
    X = _start(M, rigid, block, precondition)
    found = ritz(K, M, np.hstack([rigid, X]), "lobpcg", 0.0)
    best, stalls = np.inf, 0
    for _ in range(_ROUNDS):
        X = _iterate(K, M, X, rigid, precondition, _tolerance(M, found, count))
        found = ritz(K, M, np.hstack([rigid, X]), "lobpcg", 0.0)
        worst = float((found.residual / np.maximum(1.0, found.rounding / _TARGET))[:count].max())
        log.info("lobpcg: residual %.1e", worst)
        stalls = stalls + 1 if worst > _PROGRESS * best else 0
        if worst <= _TARGET or stalls == _STALLS:
            break
        best = min(best, worst)
        X = found.shapes[:, found.n_rigid :] if rigid.shape[1] == found.n_rigid else found.shapes[:, rigid.shape[1] :]
    return replace(found, message=f"Converged in a block with {block - count} vectors to spare; not searched for missed modes.")


def _columns(cycle: Any, R: FloatArray) -> FloatArray:
    return np.stack([cycle(column) for column in R.T], axis=1)


def _rigid(K: csr_array, M: csr_array, B: FloatArray | None) -> FloatArray:
    """(n, r) motions in the near null space that cost no energy."""
    if B is None:
        return np.zeros((K.shape[0], 0))
    found = ritz(K, M, B, "lobpcg", 0.0)
    return found.shapes[:, : found.n_rigid]


def _shift(K: csr_array, M: csr_array) -> float:
    return float(K.diagonal().sum() / M.diagonal().sum() * float(K.shape[0]) ** (-2.0 / 3.0))


def _start(M: csr_array, rigid: FloatArray, block: int, precondition: Any) -> FloatArray:
    """Random loads, smoothed by one multigrid cycle."""
    X: FloatArray = precondition @ (M @ np.random.default_rng(0).standard_normal((M.shape[0], block)))
    for _ in range(2):
        X -= rigid @ (rigid.T @ (M @ X))
    return X


def _tolerance(M: csr_array, found: Modes, count: int) -> float:
    """Absolute residual, as scipy wants it, that makes every relative one good enough."""
    elastic = slice(found.n_rigid, max(count, found.n_rigid + 1))
    size = found.eigenvalue[elastic] * np.linalg.norm(M @ found.shapes[:, elastic], axis=0)
    return 0.5 * _TARGET * float(size.min()) if size.size else EPS


def _iterate(K: csr_array, M: csr_array, X: FloatArray, rigid: FloatArray, precondition: Any, tolerance: float) -> FloatArray:
    """One round. scipy warns of what the residuals tell anyway."""
    Y = rigid if rigid.shape[1] else None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _, found = lobpcg(K, X, B=M, M=precondition, Y=Y, tol=tolerance, maxiter=_ROUND, largest=False)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise ConvergenceError(f"LOBPCG lost its basis ({error}): give the rigid-body modes, or use a direct solver.") from error
    return np.asarray(found, dtype=np.float64)
