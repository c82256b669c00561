"""One load case, or the compliance at some dofs, by multigrid: memory like n, for large meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError
from upd.linalg.common import (
    AT_ONCE,
    MAX_ITERATIONS,
    Condensed,
    FloatArray,
    checked_dofs,
    checked_vectors,
    inverse_definite,
    log,
)
from upd.linalg.schur import Solved
from upd.linalg.symmetric import checked

RTOL = 1e-10


def amg_solve(
    K: Any,
    rhs: ArrayLike,
    near_null_space: ArrayLike | None = None,
    *,
    layout: ArrayLike | None = None,
    points: ArrayLike | None = None,
    rtol: float = RTOL,
    max_iterations: int = MAX_ITERATIONS,
) -> Solved:
    """Solve K x = rhs for a symmetric positive definite K.

    Parameters
    ----------
    K : (n, n) sparse array
        Stiffness, N/mm.
    rhs : (n,) array_like
        Forces, N.
    near_null_space : (n, 6) array_like, optional
        Rigid-body modes at the dofs of K; without them several times the iterations.
    layout : (n,) array_like of int, optional
        Number 3 * node + component of each dof of K, -1 for a dof of a rigid set. None: whole nodes
        in order, if n is a multiple of three and the first three modes are the translations of
        whole nodes; else no blocks.
    points : (n_node, 3) array_like, optional
        Positions of the nodes that the layout counts, mm: half the iterations on stretched meshes.
    rtol : float
        Relative error in energy |x - K^-1 b|_K / |x|_K at which to stop, by its bound; see
        `upd.linalg.conjugate`.
    max_iterations : int

    Returns
    -------
    Solved

    Raises
    ------
    InputError
        For bad arguments.
    ConvergenceError
        When `max_iterations` do not reach `rtol`.
    """
    from upd.linalg.multigrid import MultigridSolver  # few runs need it

    A = checked(K)
    b = checked_vectors(rhs, A.shape[0], "right-hand side")
    if b.ndim != 1:
        raise InputError(
            f"amg_solve takes one right-hand side (n,), not {b.shape}: call it once per load case."
        )
    solver = MultigridSolver(
        A, near_null_space, layout=layout, points=points, max_iterations=max_iterations
    )
    (found,) = solver.many(b[:, None], rtol)
    log.info("amg: %d dofs, Converged in %d iterations", A.shape[0], found.iterations)
    return found


def compliance_amg(
    K: Any,
    dofs: ArrayLike,
    near_null_space: ArrayLike | None = None,
    *,
    layout: ArrayLike | None = None,
    points: ArrayLike | None = None,
) -> Condensed:
    """Body condensed by its compliance C = (K^-1)_bb at some dofs, a few columns at a time: k
    solutions, memory of a few. The inverse of C is the Schur complement of K on the dofs.

    Parameters
    ----------
    K : (n, n) sparse array
        Stiffness, N/mm.
    dofs : (k,) array_like of int
        Dofs b of the rows and columns of C.
    near_null_space, layout, points
        As for `amg_solve`.

    Returns
    -------
    Condensed

    Raises
    ------
    InputError, ConvergenceError
        As for `amg_solve`.
    """
    from upd.linalg.multigrid import MultigridSolver

    A = checked(K)
    b = checked_dofs(dofs, A.shape[0])
    solver = MultigridSolver(A, near_null_space, layout=layout, points=points)
    C = np.empty((len(b), len(b)))
    most = 0
    for first in range(0, len(b), AT_ONCE):
        some = b[first : first + AT_ONCE]
        units = np.zeros((A.shape[0], len(some)))
        units[some, np.arange(len(some))] = 1.0
        for j, found in enumerate(solver.many(units, RTOL), start=first):
            C[:, j] = found.x[b]
            most = max(most, found.iterations)
    log.info("amg: %d columns at %d dofs, at most %d iterations each", len(b), A.shape[0], most)

    C = 0.5 * (C + C.T)
    C.flags.writeable = False
    S = inverse_definite(C)

    def recover(u_kept: FloatArray) -> FloatArray:
        force = S @ checked_vectors(u_kept, len(b), "displacement of the kept dofs")
        f = np.zeros((A.shape[0], *force.shape[1:]))
        f[b] = force
        u = [one.x for one in solver.many(f.reshape(len(f), -1), RTOL)]
        return np.asarray(u).T.reshape(f.shape)

    return Condensed(S, recover, "amg", 0, 0, A.shape[0], [C])
