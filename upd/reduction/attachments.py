"""Reduction of a held body to its lowest modes and its displacements under given loads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError
from upd.labels import Shown
from upd.linalg.common import EPS, FloatArray, checked_vectors
from upd.linalg.eigen import Eigenproblem
from upd.linalg.symmetric import checked


@dataclass(frozen=True, repr=False)
class AttachedModel(Shown):
    """A body on modal coordinates, then those of its static shapes.

    Attributes
    ----------
    K, M : (r, r) ndarray
        N/mm and t; M is the unit.
    rows : (k, r) ndarray
        B T: what the loads work on, per unit coordinate.
    frequency : (m,) ndarray
        Hz of the modes, the first coordinates.
    """

    K: FloatArray
    M: FloatArray
    rows: FloatArray
    frequency: FloatArray


def attachment_modes(
    K: Any, M: Any, B: ArrayLike, n_modes: int, *, solver: str = "auto"
) -> AttachedModel:
    """Reduce a held body to its lowest modes Phi and the static shapes X = K^-1 B' of k loads.

    With X_p = X - Phi Lambda^-1 (B Phi)', which the modes lack, Phi' M X_p = 0 and Phi' K X_p = 0:

        X_p' K X_p = B X - (B Phi) Lambda^-1 (B Phi)',    B X_p likewise,

    and X_p' M X_p is brought to the unit. The static compliance B K^-1 B' and the modes are those
    of the body, whatever else the loads' shapes do. Takes n (k + m) doubles, a factor and then, in
    its place, one that counts the modes, k right sides: loads spread over many nodes cost no more
    than those on one.

    Parameters
    ----------
    K, M : (n, n) Symmetric, sparse array or array_like
        N/mm and t, without fixed dofs; K definite.
    B : (k, n) array_like
        Displacements that the loads work on: B' f are the nodal forces.
    n_modes : int
        m, above 0.
    solver : {"auto", "pardiso", "superlu"}

    Returns
    -------
    AttachedModel

    Raises
    ------
    InputError
        For bad arguments or too little memory.
    ConvergenceError
        When the body floats.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed. (2006), ch. 17:
    attachment modes.

    Examples
    --------
    A chain of three masses on springs, clamped at one end, with its lowest mode and a force on its
    tip: 3 springs of 1000 N/mm give way by 3e-3 mm/N.

    >>> import numpy as np
    >>> from upd.reduction import attachment_modes
    >>> K = 1e3 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    >>> found = attachment_modes(K, 1e-3 * np.eye(3), [[0.0, 0.0, 1.0]], 1)
    >>> found.frequency.round(2).tolist()
    [70.83]
    >>> compliance = found.rows @ np.linalg.solve(found.K, found.rows.T)
    >>> compliance.round(12).tolist()
    [[0.003]]
    """
    A = checked(K)
    rows = checked_vectors(np.asarray(B, float).T, A.shape[0], "loads").T
    if n_modes < 1:
        raise InputError(f"n_modes = {n_modes}: give 1 or more")
    problem = Eigenproblem(A, M, sigma=0.0, solver=solver, alone=True)
    X = problem.displacements(rows.T)
    found = problem.modes(count=n_modes)
    value = (2.0 * np.pi * found.frequency) ** 2
    seen = rows @ found.shapes
    X -= found.shapes @ (seen / value).T
    stiffness, mass = rows @ X, X.T @ (checked(M) @ X)
    size = np.sqrt(np.diag(mass))
    scale, V = np.linalg.eigh(0.5 * (mass + mass.T) / np.outer(size, size))
    # shapes that repeat others are left out
    keep = scale > len(scale) * EPS**0.75 * scale[-1]
    T = V[:, keep] / np.sqrt(scale[keep]) / size[:, None]
    n = n_modes + T.shape[1]
    K_r = np.zeros((n, n))
    K_r[range(n_modes), range(n_modes)] = value
    K_r[n_modes:, n_modes:] = T.T @ (0.5 * (stiffness + stiffness.T)) @ T
    return AttachedModel(K_r, np.eye(n), np.hstack([seen, stiffness @ T]), found.frequency)
