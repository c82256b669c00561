"""Condensation of a body that a weighted set of nodes holds in the mean.

With R the rigid motions and w the weights, W = diag(w) R, the body under forces f obeys

    K u + W a = f,    W' u = 0:

nothing moves in the mean, and the reaction is the traction over the weighted set that is linear
in position, with which the force and the moments balance: R'f = R'W a. Both parts follow from
any support that holds the rigid motions and no more, K_h u_h = f - W a: balanced forces leave
it without a reaction, whatever its place, and u = u_h - R (W'R)^-1 W'u_h. With P = I - W
(R'W)^-1 R' the compliance is P' K_h^-1 P, symmetric.

References
----------
.. [1] Abaqus Theory Guide, "Distributing coupling elements" (the element RBE3 of NASTRAN): the
   forces on the nodes of the set in proportion to their weights.
.. [2] C. Farhat, F.-X. Roux, Int. J. Numer. Meth. Engng 32 (1991) 1205, section 3: balanced
   loads on a floating body, solved on a statically determinate support.

Examples
--------
A free spring of 1 kN/mm, held in the mean of its two ends, pulled at one: the other half of the
force at the far end balances it, and half of the stretch is seen.

>>> import numpy as np
>>> from upd.reduction import condense_held_in_mean
>>> K = 1e3 * np.array([[1.0, -1.0], [-1.0, 1.0]])
>>> found = condense_held_in_mean(K, [1], [1.0, 1.0], np.ones((2, 1)), solver="superlu")
>>> print(f"{1e3 * found.compliance()[0, 0]:.3f} um/N")
0.250 um/N
>>> print(np.round(found.recover(np.array([1.0])), 9))
[-1.  1.]
"""

from __future__ import annotations

from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import qr

from upd.errors import InputError
from upd.linalg.amg import amg_solve
from upd.linalg.common import (
    EPS,
    Condensed,
    FloatArray,
    IntArray,
    checked_dofs,
    checked_vectors,
    inverse_definite,
)
from upd.linalg.schur import factorise
from upd.linalg.symmetric import checked, submatrix_of
from upd.reduction.guyan import condense


def motions_left(modes: ArrayLike, held: ArrayLike) -> FloatArray:
    """Rigid motions that move no held dof.

    Parameters
    ----------
    modes : (n, m) array_like
        Rigid motions, column by column.
    held : (k,) array_like of int

    Returns
    -------
    (n, p) ndarray
        p <= m orthonormal combinations of them, if they are orthonormal.
    """
    R = np.asarray(modes, dtype=np.float64)
    rows = R[np.asarray(held, dtype=np.int64)]
    if not rows.size:
        return R
    _, size, Vt = np.linalg.svd(rows)
    rank = int(np.sum(size > len(rows) * EPS * size.max(initial=0.0)))
    left: FloatArray = R @ Vt[rank:].T
    return left


class CondenseOptions(TypedDict, total=False):
    """What else `condense` takes."""

    keep_factor: bool
    memory_limit_bytes: float | None


def condense_held_in_mean(
    K: Any,
    kept: ArrayLike,
    weights: ArrayLike,
    motions: ArrayLike,
    *,
    solver: str = "auto",
    layout: ArrayLike | None = None,
    points: ArrayLike | None = None,
    **more: Unpack[CondenseOptions],
) -> Condensed:
    """Condense a body onto some of its dofs, its rigid motions held in a weighted mean.

    Parameters
    ----------
    K : (n, n) Symmetric, sparse array or array_like
        N/mm, free in all of `motions`.
    kept : (k,) array_like of int
    weights : (n,) array_like
        Of the dofs that hold the body: for consistent forces the integrals of their shape functions
        over a surface [mm2].
    motions : (n, m) array_like
        R, all rigid motions that the other supports leave.
    solver, layout, points, more
        As for `condense`: `keep_factor` and `memory_limit_bytes` are more.

    Returns
    -------
    Condensed
        Its displacements satisfy W'u = 0.

    Raises
    ------
    InputError
        For bad arguments, and for weights that leave a motion free.
    ConvergenceError
        When a part of the body floats.
    """
    A = checked(K)
    n = A.shape[0]
    kept = checked_dofs(kept, n)
    R = checked_vectors(motions, n, "rigid motions").reshape(n, -1)
    w = checked_vectors(weights, n, "weights")
    if w.ndim != 1:
        raise InputError(f"weights have the shape {w.shape}: give one per dof, ({n},).")
    W = w[:, None] * R
    mean = R.T @ W
    size = np.linalg.svd(mean, compute_uv=False)
    if not size[-1] > len(R) * EPS * float((np.abs(w)[:, None] * R**2).sum()):
        raise InputError(_LOOSE)  # weights of both signs that cancel
    held = _support(R, np.setdiff1d(np.flatnonzero(w), kept))
    inner = np.setdiff1d(np.arange(n), held)
    K_h, at = submatrix_of(A, inner), np.searchsorted(inner, kept)
    places = None if layout is None else np.asarray(layout)[inner]
    near: dict[str, Any] = {"layout": places, "points": points}
    found = condense(K_h, at, solver=solver, rigid_modes=R[inner], **near, **more)
    X = np.zeros_like(W)
    if found.solver == "amg":
        loads = [amg_solve(K_h, load, R[inner], **near).x for load in W[inner].T]
        X[inner] = np.transpose(loads)
    else:
        X[inner] = factorise(K_h, solver=found.solver)(W[inner])
    C_h = found.compliance()
    T = np.linalg.solve(mean, R[kept].T)
    across = X[kept] @ T
    C = C_h - across - across.T + T.T @ (W.T @ X) @ T
    C = 0.5 * (C + C.T)
    C.flags.writeable = False
    S = inverse_definite(C)

    def recover(u_kept: FloatArray) -> FloatArray:
        force = S @ checked_vectors(u_kept, len(kept), "displacement of the kept dofs")
        u = np.zeros((n, *force.shape[1:]))
        u[inner] = found.recover(C_h @ force)
        u -= X @ (T @ force)
        return np.asarray(u - R @ np.linalg.solve(mean.T, W.T @ u))

    return Condensed(S, recover, found.solver, found.factor_nnz, found.peak_bytes, n, [C])


def _support(R: FloatArray, candidates: IntArray) -> IntArray:
    """As many of the candidates as there are motions, which hold them best: pivoted QR."""
    m = R.shape[1]
    rows = R[candidates]
    _, r, order = qr(rows.T, mode="economic", pivoting=True)
    size = np.abs(np.diagonal(r))
    if len(size) < m or not size[-1] > max(rows.shape) * EPS * size[0]:
        raise InputError(_LOOSE)
    return np.sort(candidates[order[:m]])


_LOOSE = (
    "the weights do not hold the body: its rigid motions have no mean of their own over them. To "
    "fix it: give three nodes or more, not on one line, with positive weights."
)


__all__ = ["condense_held_in_mean", "motions_left"]
