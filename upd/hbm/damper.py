"""Rigid damper between the blades: six dofs at its centre of mass, small rotations, held by its contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.contacts import Contacts

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class RigidDamper:
    """mass [t], inertia (3, 3) about the centre of mass [t mm^2], centre (3,) [mm], centrifugal force (3,) through the centre [N].

    Dofs (ux, uy, uz, rx, ry, rz): a point at r moves by u + theta x (r - centre).
    """

    mass: float
    inertia: FloatArray
    centre: FloatArray
    centrifugal: FloatArray

    @property
    def M(self) -> FloatArray:
        """Mass matrix (6, 6): m on the translations, the inertia on the rotations."""
        M = np.zeros((6, 6))
        M[:3, :3], M[3:, 3:] = self.mass * np.eye(3), self.inertia
        return M

    @property
    def force(self) -> FloatArray:
        """Static force (6,): the centrifugal force has no moment about the centre."""
        return np.concatenate([self.centrifugal, np.zeros(3)])

    def motion(self, positions: ArrayLike) -> FloatArray:
        """Matrices (n, 3, 6): displacement of the points at positions (n, 3) from the six dofs, u + theta x r."""
        r = np.atleast_2d(np.asarray(positions, dtype=float)) - self.centre
        out = np.zeros((len(r), 3, 6))
        out[:, :, :3] = np.eye(3)
        x, y, z = r.T
        out[:, 0, 4], out[:, 0, 5] = z, -y
        out[:, 1, 3], out[:, 1, 5] = -z, x
        out[:, 2, 3], out[:, 2, 4] = y, -x
        return out


def rigid_damper(mass: float, inertia: ArrayLike, centre: ArrayLike, centrifugal: ArrayLike) -> RigidDamper:
    """Rigid damper; inertia (3,) principal or (3, 3), symmetric positive definite. InputError lists all faults at once."""
    I = np.asarray(inertia, dtype=float)
    I = np.diag(I) if I.ndim == 1 else I
    c, F = np.asarray(centre, dtype=float), np.asarray(centrifugal, dtype=float)
    faults = [] if np.isfinite(mass) and mass > 0 else [f"mass = {mass} is not above zero"]
    faults += [f"{name} has shape {a.shape}, give (3,)" for name, a in (("centre", c), ("centrifugal", F)) if a.shape != (3,)]
    if I.shape != (3, 3) or not np.allclose(I, I.T, rtol=8 * EPS) or np.linalg.eigvalsh(I)[0] <= 0:
        faults.append("inertia must be (3,) or (3, 3), symmetric and positive definite")
    if faults:
        raise InputError("rigid damper: " + "; ".join(faults))
    return RigidDamper(float(mass), I, c, F)


def contact_rows(damper: RigidDamper, positions: ArrayLike, frames: ArrayLike) -> FloatArray:
    """Rows (n_point, 1 + d, 6) of the damper's share of the relative displacement, positions (n_point, 3), frames (n_point, 1 + d, 3).

    Frames hold the normal, from the damper into the blade (the damper's motion along it closes the contact), then the tangents.
    """
    return np.asarray(np.asarray(frames, dtype=float) @ damper.motion(positions))


def attach(
    M: FloatArray, C: FloatArray, K: FloatArray, points: Contacts, damper: RigidDamper, rows: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, Contacts]:
    """System with the damper's six dofs appended. `points` act on the blades alone: their rows are the damper's motion relative to the
    blades as far as the blades cause it, minus (frame @ blade displacement); `rows` (n_point, 1 + d, 6): see `contact_rows`."""
    joined = np.concatenate([points.rows, rows], axis=2)
    return _block(M, damper.M), _block(C, np.zeros((6, 6))), _block(K, np.zeros((6, 6))), Contacts(np.ascontiguousarray(joined), points.law)


def _block(A: FloatArray, D: FloatArray) -> FloatArray:
    n = len(A)
    out = np.zeros((n + 6, n + 6))
    out[:n, :n], out[n:, n:] = A, D
    return out
