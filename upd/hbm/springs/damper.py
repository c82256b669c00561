"""Rigid damper between the blades.

Up to six dofs at its centre of mass, small rotations, held by its contacts and by what guides it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from upd.errors import InputError
from upd.hbm.springs.points import Contacts
from upd.labels import Shown

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, repr=False)
class RigidDamper(Shown):
    """Rigid body between the blades.

    Dofs (ux, uy, uz, rx, ry, rz): a point at r moves by u + theta x (r - centre).

    Attributes
    ----------
    mass : float
        Mass [t].
    inertia : (3, 3) ndarray
        Inertia about the centre of mass [t mm^2].
    centre : (3,) ndarray
        Centre of mass [mm].
    centrifugal : (3,) ndarray
        Centrifugal force through the centre [N].
    kept : tuple of int
        Dofs it may use: (0, 2, 4) moves in the plane x-z only, as half a damper does that a mirror
        plane across y cuts.
    guide : (6,) tuple of float
        Stiffness [N/mm, N mm] along its dofs of what guides it in the blades' frame, pins or end
        walls. All points that slip forget: then nothing else holds its mean place.
    """

    mass: float
    inertia: FloatArray
    centre: FloatArray
    centrifugal: FloatArray
    kept: tuple[int, ...] = tuple(range(6))
    guide: tuple[float, ...] = (0.0,) * 6

    @property
    def n_dof(self) -> int:
        """Number of dofs it uses."""
        return len(self.kept)

    @property
    def M(self) -> FloatArray:
        """Mass matrix (n_dof, n_dof).

        m on the translations [t], the inertia on the rotations [t mm^2].
        """
        M = np.zeros((6, 6))
        M[:3, :3], M[3:, 3:] = self.mass * np.eye(3), self.inertia
        return M[np.ix_(self.kept, self.kept)]

    @property
    def K(self) -> FloatArray:
        """Stiffness of what guides it (n_dof, n_dof) [N/mm, N mm]."""
        return np.diag(np.asarray(self.guide, dtype=float)[list(self.kept)])

    @property
    def force(self) -> FloatArray:
        """Static force (n_dof,) [N]: the centrifugal force has no moment about the centre."""
        return np.asarray(np.concatenate([self.centrifugal, np.zeros(3)])[list(self.kept)])

    def motion(self, positions: ArrayLike) -> FloatArray:
        """Matrices from the dofs to the displacement of points, u + theta x r.

        Parameters
        ----------
        positions : (n, 3) array_like
            Points [mm].

        Returns
        -------
        (n, 3, n_dof) ndarray
        """
        r = np.atleast_2d(np.asarray(positions, dtype=float)) - self.centre
        out = np.zeros((len(r), 3, 6))
        out[:, :, :3] = np.eye(3)
        x, y, z = r.T
        out[:, 0, 4], out[:, 0, 5] = z, -y
        out[:, 1, 3], out[:, 1, 5] = -z, x
        out[:, 2, 3], out[:, 2, 4] = y, -x
        return out[:, :, list(self.kept)]


def rigid_damper(
    mass: float,
    inertia: ArrayLike,
    centre: ArrayLike,
    centrifugal: ArrayLike,
    kept: Sequence[int] = tuple(range(6)),
    guide: Sequence[float] = (0.0,) * 6,
) -> RigidDamper:
    """Rigid damper.

    Parameters
    ----------
    mass : float
        Mass [t], > 0.
    inertia : (3,) or (3, 3) array_like
        Principal moments, or the whole tensor, about the centre of mass [t mm^2]; symmetric
        positive definite.
    centre : (3,) array_like
        Centre of mass [mm].
    centrifugal : (3,) array_like
        Centrifugal force through the centre [N].
    kept : sequence of int
        Dofs it keeps, rising numbers among 0 to 5 (ux, uy, uz, rx, ry, rz).
    guide : (6,) sequence of float
        Stiffness along its dofs of what guides it [N/mm, N mm].

    Returns
    -------
    RigidDamper

    Raises
    ------
    InputError
        For bad input; all problems are named.

    Examples
    --------
    A damper of 5 g that moves in the plane x-z only, pulled along z by 154 N:

    >>> from upd.hbm import rigid_damper
    >>> damper = rigid_damper(5e-6, [1e-4, 1e-4, 1e-4], [0, 0, 2], [0, 0, 154], kept=(0, 2, 4))
    >>> damper.n_dof
    3
    >>> damper.force.tolist()
    [0.0, 154.0, 0.0]

    One radian about y moves a point 1 mm above the centre by 1 mm along x:

    >>> x, y, z = damper.motion([[0.0, 0.0, 3.0]])[0]
    >>> x.tolist()
    [1.0, 0.0, 1.0]
    """
    I = np.asarray(inertia, dtype=float)
    I = np.diag(I) if I.ndim == 1 else I
    c, F = np.asarray(centre, dtype=float), np.asarray(centrifugal, dtype=float)
    problems = [] if np.isfinite(mass) and mass > 0 else [f"mass = {mass} is not above zero"]
    problems += [
        f"{name} has shape {a.shape}, give (3,)"
        for name, a in (("centre", c), ("centrifugal", F))
        if a.shape != (3,)
    ]
    if I.shape != (3, 3) or not np.allclose(I, I.T, rtol=8 * EPS) or np.linalg.eigvalsh(I)[0] <= 0:
        problems.append("inertia must be (3,) or (3, 3), symmetric and positive definite")
    if not kept or sorted(set(kept)) != list(kept) or not set(kept) <= set(range(6)):
        problems.append(
            f"kept = {tuple(kept)} must be rising numbers among 0 to 5 (ux, uy, uz, rx, ry, rz)"
        )
    if len(guide) != 6 or min(guide) < 0.0:
        problems.append(f"guide = {tuple(guide)} must be six stiffnesses, none negative")
    if problems:
        raise InputError("rigid damper: " + "; ".join(problems))
    held = tuple(float(k) for k in guide)
    return RigidDamper(float(mass), I, c, F, tuple(int(k) for k in kept), held)


def contact_rows(damper: RigidDamper, positions: ArrayLike, frames: ArrayLike) -> FloatArray:
    """Rows of the damper's share of the relative displacement.

    Parameters
    ----------
    damper : RigidDamper
    positions : (n_point, 3) array_like
        Contact points [mm].
    frames : (n_point, 1 + d, 3) array_like
        The normal, from the damper into the blade (the damper's motion along it closes the
        contact), then the tangents; unit vectors.

    Returns
    -------
    (n_point, 1 + d, damper.n_dof) ndarray
    """
    return np.asarray(np.asarray(frames, dtype=float) @ damper.motion(positions))


def attach(
    M: FloatArray,
    C: FloatArray,
    K: FloatArray,
    points: Contacts,
    damper: RigidDamper,
    rows: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, Contacts]:
    """System with the damper's dofs appended.

    Parameters
    ----------
    M, C, K : (n, n) ndarray
        Mass [t], damping [N s/mm] and stiffness [N/mm] of the blades.
    points : Contacts
        Act on the blades alone: their rows are the damper's motion relative to the blades as far as
        the blades cause it, minus (frame @ blade displacement).
    damper : RigidDamper
    rows : (n_point, 1 + d, damper.n_dof) ndarray
        The damper's share of the rows: see `contact_rows`.

    Returns
    -------
    M, C, K : (n + damper.n_dof, n + damper.n_dof) ndarray
    points : Contacts
        On all dofs, the damper's last.
    """
    none = np.zeros((damper.n_dof, damper.n_dof))
    joined = np.concatenate([points.rows, rows], axis=2)
    pairs = (M, damper.M), (C, none), (K, damper.K)
    A = [block_diag(*pair) for pair in pairs]
    return A[0], A[1], A[2], Contacts(np.ascontiguousarray(joined), points.law)
