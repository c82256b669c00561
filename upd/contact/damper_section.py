"""A rigid damper in the plane of its slopes: forces that hold it without tilting it.

With f the force on the left blade and F_C e_z - f that on the right one (see
`upd.contact.rigid_damper`), each applied somewhere on its face, the moment about the centre of mass
G, through which F_C acts, must vanish. Forces at the middles c of the faces have the moment
M = -(c_left x f) - (c_right x (F_C e_z - f)); moving a force up its slope by s changes that by
-s N on the left and +s N on the right. With faces of half length h it can be brought to nothing
when

    |M| <= h_left N_left + h_right N_right,

else the damper tilts: a force would have to act beyond the end of its face. The quotient of both
sides is the eccentricity: how far off the middles, as a part of h, both forces must act at least.
All of this is linear in (f, F_C), as friction is: the admissible forces are a convex cone in three
dimensions, cut out by half-spaces (Sutherland and Hodgman's clipping, in homogeneous coordinates).
Its rays without F_C are forces that friction alone holds: the damper jams.

References
----------
I. E. Sutherland, G. W. Hodgman, "Reentrant polygon clipping", Comm. ACM 17 (1974) 32-42.
V.-D. Nguyen, "Constructing force-closure grasps", Int. J. Robotics Research 7 (1988): two contacts
hold a body when the line between them lies in both friction cones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.contact.rigid_damper import checked_angles, forces

Array = NDArray[np.float64]
#: roundings of a sum of a few terms
_ROUNDINGS = 16.0 * np.finfo(float).eps


@dataclass(frozen=True)
class FaceSection:
    """A contact face in the plane of the slopes.

    Attributes
    ----------
    angle : float
        To the horizontal [deg].
    middle : (float, float)
        Of the contact, x and z from the damper's centre of mass [mm].
    half_length : float
        Half of its extent up the slope [mm].
    """

    angle: float
    middle: tuple[float, float]
    half_length: float


@dataclass(frozen=True)
class DamperSection:
    """A rigid damper between two faces.

    Attributes
    ----------
    left, right : FaceSection
        Its contacts.
    """

    left: FaceSection
    right: FaceSection

    def __post_init__(self) -> None:
        checked_angles(self.left.angle, self.right.angle)

    @property
    def faces(self) -> tuple[FaceSection, FaceSection]:
        """Left, right."""
        return self.left, self.right


@dataclass(frozen=True)
class AdmissibleForces:
    """All forces that hold a damper against F_C without tilting it.

    Attributes
    ----------
    corners : (n, 2, 2) ndarray
        N and T of both faces, left first, over F_C; empty when nothing holds it.
    rays : (m, 2, 2) ndarray
        The same of forces that friction alone holds, of any size: there are some when it jams.
    """

    corners: Array
    rays: Array

    @property
    def jams(self) -> bool:
        """Whether friction alone can hold the damper."""
        return len(self.rays) > 0

    @property
    def limits(self) -> Array:
        """(2, 2, 2): N and T of each face, least and greatest, over F_C; nan when nothing holds
        the damper.
        """
        if not len(self.corners):
            return np.full((2, 2, 2), np.nan)
        out = np.stack([self.corners.min(axis=0), self.corners.max(axis=0)], -1)
        for ray in self.rays:
            grows = np.abs(ray) > _ROUNDINGS * np.abs(ray).max()
            out[..., 0] = np.where(grows & (ray < 0.0), -np.inf, out[..., 0])
            out[..., 1] = np.where(grows & (ray > 0.0), np.inf, out[..., 1])
        return out


def eccentricity(
    damper: DamperSection,
    ratio_left: ArrayLike,
    ratio_right: ArrayLike,
    left: ArrayLike | None = None,
    right: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """How far off the middles of the faces the forces of given ratios T/N must act.

    Parameters
    ----------
    damper : DamperSection
        Its faces.
    ratio_left, ratio_right : array_like
        T/N of each face; all broadcast together.
    left, right : array_like, optional
        Inclinations [deg] to which the faces are turned about their middles; None: their own.

    Returns
    -------
    N : (2, ...) ndarray
        Normal forces over F_C, nan where no forces that press balance F_C.
    eccentricity : ndarray
        As a part of half a face; the damper tilts above 1.
    """
    a, b, t, s = np.broadcast_arrays(
        damper.left.angle if left is None else left,
        damper.right.angle if right is None else right,
        np.asarray(ratio_left, float),
        np.asarray(ratio_right, float),
    )
    N = np.array(forces(a, b, t, s))
    return N, moment_share(damper, np.array([N, np.array([t, s]) * N]), np.array([a, b]))


def moment_share(damper: DamperSection, found: Array, angles: Array | None = None) -> Array:
    """Eccentricity of forces in balance.

    Parameters
    ----------
    damper : DamperSection
        Its faces.
    found : (2, 2, ...) ndarray
        N and T of each face, in any unit.
    angles : (2, ...) ndarray, optional
        Inclinations [deg] to which the faces are turned about their middles; None: their own.
    """
    own = np.array([face.angle for face in damper.faces])
    weight = _moments(
        damper, own.reshape(2, *(1,) * (found.ndim - 2)) if angles is None else angles
    )
    half = np.array([face.half_length for face in damper.faces])
    with np.errstate(invalid="ignore", divide="ignore"):
        moment = np.abs((weight * found).sum(axis=(0, 1)))
        return np.asarray(moment / np.tensordot(half, found[0], 1), float)


def admissible_forces(
    damper: DamperSection, friction: float, *, tilting: bool = True
) -> AdmissibleForces:
    """All forces on both faces that hold the damper against F_C.

    Parameters
    ----------
    damper : DamperSection
        Its faces.
    friction : float
        Friction coefficient.
    tilting : bool
        Whether a damper that would tilt counts as not held.

    Returns
    -------
    AdmissibleForces
    """
    to_faces = _to_faces(damper)
    phi = math.atan(friction)
    alpha = math.radians(damper.left.angle)
    start = np.array(
        [
            [-math.sin(alpha + phi), math.cos(alpha + phi), 0.0],
            [-math.sin(alpha - phi), math.cos(alpha - phi), 0.0],
            [0.0, 0.0, 1.0],
        ]
    )
    normal, slope = to_faces.reshape(2, 2, 3)
    half_spaces = [friction * normal[1] - slope[1], friction * normal[1] + slope[1], normal[1]]
    if tilting:
        weight = _moments(damper, np.array([face.angle for face in damper.faces]))
        moment = np.tensordot(weight, to_faces.reshape(2, 2, 3), 2)
        half = np.array([face.half_length for face in damper.faces])
        room = half @ normal
        size = float(np.abs(room).max())
        half_spaces += [(room - moment) / size, (room + moment) / size]
    cone = start
    for row in half_spaces:
        cone = _clipped(cone, row)
    finite = cone[:, 2] > 0.0
    at_one = cone[finite] / cone[finite, 2:]
    return AdmissibleForces(
        (at_one @ to_faces.T).reshape(-1, 2, 2), (cone[~finite] @ to_faces.T).reshape(-1, 2, 2)
    )


def _to_faces(damper: DamperSection) -> Array:
    """(4, 3) N_left, N_right, T_left, T_right of (f_x, f_z, F_C), f the force on the left blade."""
    a, b = (math.radians(face.angle) for face in damper.faces)
    n_left, u_left = (-math.sin(a), math.cos(a)), (math.cos(a), math.sin(a))
    n_right, u_right = (math.sin(b), math.cos(b)), (-math.cos(b), math.sin(b))
    return np.array(
        [
            [*n_left, 0.0],
            [-n_right[0], -n_right[1], n_right[1]],
            [*u_left, 0.0],
            [-u_right[0], -u_right[1], u_right[1]],
        ]
    )


def _moments(damper: DamperSection, angles: Array) -> Array:
    """(2, 2, ...) moment about the centre of mass of a unit N and T at the middle of each face."""
    out = np.zeros((2, *angles.shape))
    for k, (face, side) in enumerate(zip(damper.faces, (-1.0, 1.0), strict=True)):
        sine, cosine = np.sin(np.radians(angles[k])), np.cos(np.radians(angles[k]))
        x, z = face.middle
        out[0, k] = side * z * sine - x * cosine
        out[1, k] = -side * z * cosine - x * sine
    return out


def _clipped(cone: Array, row: Array) -> Array:
    """Rays (n, 3) around the part of a convex cone where row . ray >= 0."""
    terms = cone * row
    height = terms.sum(axis=1)
    # on the plane but for rounding: stays
    height[np.abs(height) <= _ROUNDINGS * np.abs(terms).sum(axis=1)] = 0.0
    out: list[Array] = []
    for k in range(len(cone)):
        here, there = height[k - 1], height[k]
        if here * there < 0.0:
            ray = abs(there) * cone[k - 1] + abs(here) * cone[k]
            out.append(ray / np.abs(ray).max())
        if there >= 0.0:
            out.append(cone[k])
    return np.array(out).reshape(-1, 3)
