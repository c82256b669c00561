"""Symmetric reduction: motion even about the mid-plane y = 0, in which a contact point and its
mirror image move as one.

It halves the unknowns. Rig, excitation and accelerometers are their own mirror images, so the
answer may be taken even: normal and slope displacements of a pair are equal, those along y
opposite. Motions that are odd about the plane, the damper's drift along y among them, are left out;
friction in gross slip would not hold such a drift at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from upd.analyses.forced.points import FacePoints

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
#: damper dofs that are even about y = 0: ux, uz and the rotation about y
EVEN_DOFS = (0, 2, 4)
#: signs of the mirror image's displacement: normal, along the damper, up the slope
MIRROR_SIGNS = np.array([1.0, -1.0, 1.0])
_HALF = float(np.finfo(float).eps) ** 0.5
#: share of odd motion below which a mode counts as even, above one minus which as odd
PARITY = 1e-4


@dataclass(frozen=True)
class MirrorPairs:
    """Points (m,) kept of a face, y >= 0, and their mirror images (m,), themselves on the plane."""

    point: IntArray
    image: IntArray

    def even(self, rows: FloatArray) -> FloatArray:
        """Rows (n, 3, r) of all points -> (m, 3, r) even part of the displacement of the points
        kept.
        """
        return np.asarray(0.5 * (rows[self.point] + MIRROR_SIGNS[:, None] * rows[self.image]))

    def odd(self, rows: FloatArray) -> FloatArray:
        """The odd part."""
        return np.asarray(0.5 * (rows[self.point] - MIRROR_SIGNS[:, None] * rows[self.image]))

    def total(self, values: FloatArray) -> FloatArray:
        """Values (n,) of all points -> (m,) of each pair together, a point on the plane by
        itself.
        """
        return np.asarray(
            values[self.point] + np.where(self.image != self.point, values[self.image], 0.0)
        )

    def face(self, face: FacePoints) -> FacePoints:
        """The points kept, with the weight of their pairs."""
        position = face.position[self.point].copy()
        position[self.image == self.point, 1] = 0.0
        return FacePoints(
            position,
            face.frame,
            self.total(face.weight),
            face.nodes,
            face.values[self.point],
            face.line[self.point],
            face.per_part,
        )


def mirror_pairs(face: FacePoints) -> MirrorPairs | None:
    """The pairs of a face's points, None unless every point has its mirror image with the same
    share of the stiffness.
    """
    x = face.position
    size = float(np.ptp(x, axis=0).max())
    distance, image = cKDTree(x).query(x * np.array([1.0, -1.0, 1.0]))
    image = np.asarray(image, np.int64)
    alike = np.abs(face.weight - face.weight[image]) <= _HALF * face.weight.max()
    if (
        (distance > _HALF * size).any()
        or not alike.all()
        or not np.array_equal(image[image], np.arange(len(x)))
    ):
        return None
    kept = np.flatnonzero((image == np.arange(len(x))) | (x[:, 1] > 0.0))
    return MirrorPairs(kept, image[kept])


def even_modes(rows: FloatArray, pairs: MirrorPairs, shapes: FloatArray) -> FloatArray | None:
    """Of mode shapes those that are even about y = 0 at the contact points.

    Parameters
    ----------
    rows
        (n, 3, r) displacement of all points of the coordinates.
    shapes
        (r, k) modes.

    Returns
    -------
    FloatArray or None
        (r, j) even modes; None when a mode is neither even nor odd: its pair of equal frequencies
        is mixed.
    """
    even, odd = (
        np.linalg.norm(part.reshape(-1, part.shape[-1]) @ shapes, axis=0)
        for part in (pairs.even(rows), pairs.odd(rows))
    )
    share = odd / np.maximum(np.hypot(even, odd), np.finfo(float).tiny)
    if ((share > PARITY) & (share < np.sqrt(1.0 - PARITY**2))).any():
        return None
    return np.asarray(shapes[:, share <= PARITY])
