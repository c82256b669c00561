"""Forces of a rigid damper on its two faces, and what friction lets them be, by angles alone.

Left and right face are inclined by a and b to the horizontal and rise towards each other, F_C acts
upwards, T is up the slope on the blade, positive when it opposes F_C. Where both contacts mobilise
the same share t = T/N = tan(phi) of friction, the resultant of each face is turned by phi, and

    N_right = F_C cos(phi) sin(a - phi) / sin(a + b - 2 phi),
    N_left  = F_C cos(phi) sin(b - phi) / sin(a + b - 2 phi),    T = t N,

from the balance of vertical and horizontal forces. With a = b it is the thesis's (7.1),
F_C = 2 N (cos a + t sin a).

In general the resultant of a face leans by

    alpha = a - atan(T/N) (left, to the left),    beta = b - atan(T/N) (right, to the right)

off the vertical, and two forces balance F_C only if

    R_left = F_C sin(beta) / sin(alpha + beta) >= 0,
    R_right = F_C sin(alpha) / sin(alpha + beta) >= 0

with |T/N| <= mu = tan(phi) on each face by itself. Hence, in closed form:

- A face can stay empty when the other holds the damper alone, its resultant upright (alpha = 0 or
  beta = 0): the right one when phi >= a, the left one when phi >= b. A blade that moves away then
  lifts off the damper.
- The damper jams when both resultants can lie on one line, alpha + beta = 180 deg, without any
  F_C: phi >= 90 deg - (a + b)/2. Blades that approach are then held, with forces without limit.
- Else all forces are bounded. The forces on the left blade are a convex set in the plane, where the
  cone of the left face meets the cone of the right one turned over at F_C; N and T are linear in
  them, so that their limits lie at its corners: both resultants at the rims of their cones, or one
  face empty.

While both faces touch, blades that move against each other by w slide, with n and u the normals
and slopes and the right one moving,

    s_left = w . n_right / sin(a + b),    s_right = -w . n_left / sin(a + b)

up the slopes: both up as they part, both down as they approach, one up and one down when one of
them rises (the motion of blades in phase). Friction then is at its limit against the sliding.

Each force applied somewhere on its face, the moment about the centre of mass G, through which F_C
acts, must vanish too. With f the force on the left blade, forces at the middles c of the faces have
the moment M = -(c_left x f) - (c_right x (F_C e_z - f)); moving a force up its slope by s changes
that by -s N on the left and +s N on the right. With faces of half length h it can be brought to
nothing when

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
C. Gastaldi, M. M. Gola, "Pre-optimization of asymmetrical underplatform dampers", J. Eng. Gas
Turbines Power 139 (2017) 012504; "Criteria for best performance of pre-optimized solid dampers",
Proc. ASME Turbo Expo (2018): which questions to ask before any dynamics. The equations are derived
here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError

Array = NDArray[np.float64]
#: roundings of a sine of an angle of up to 180 deg, above which a force that pulls is no rounding
_ROUNDING = 4.0 * math.ulp(math.pi)
#: roundings of a sum of angles up to 180 deg
_DEGREES = 4.0 * math.ulp(180.0)
#: roundings of a sum of a few terms
_ROUNDINGS = 16.0 * np.finfo(float).eps


@dataclass(frozen=True)
class FrictionLimits:
    """Friction coefficients from which a rigid damper between two faces misbehaves.

    Attributes
    ----------
    jams : float
        From here friction alone can hold the damper, F_C or not.
    left_lifts, right_lifts : float
        From here the left, the right face can stay empty; infinite where never.
    """

    jams: float
    left_lifts: float
    right_lifts: float

    @property
    def lowest(self) -> float:
        """Below it both faces always carry, and all forces are bounded."""
        return min(self.jams, self.left_lifts, self.right_lifts)


@dataclass(frozen=True)
class Sliding:
    """A motion of the right blade against the left one, both faces touching.

    Attributes
    ----------
    name : str
        In words.
    across, up : float
        Direction of the right blade's motion.
    left, right : int
        Sign of T/N of each face: 1 where the damper slides up.
    """

    name: str
    across: float
    up: float
    left: int
    right: int

    def lengths(self, left: float, right: float) -> tuple[float, float]:
        """How far each face slides up its slope per unit of that motion, nan between two upright
        faces, which slide by any length.

        Parameters
        ----------
        left, right : float
            Inclinations to the horizontal [deg].
        """
        a, b = math.radians(left), math.radians(right)
        if left + right >= 180.0:
            return math.nan, math.nan
        closing = math.sin(a + b)
        return (
            (self.across * math.sin(b) + self.up * _cosine(right)) / closing,
            (self.across * math.sin(a) - self.up * _cosine(left)) / closing,
        )


#: motions of blades out of phase (along x) and in phase (one platform up against the other)
SLIDINGS = (
    Sliding("platforms part", 1.0, 0.0, 1, 1),
    Sliding("platforms approach", -1.0, 0.0, -1, -1),
    Sliding("right platform rises", 0.0, 1.0, 1, -1),
    Sliding("left platform rises", 0.0, -1.0, -1, 1),
)


def lifted(left: float, right: float, friction: float, motion: Sliding) -> tuple[str, ...]:
    """Faces that such a motion lets lift off: the damper need not slide up the other one.

    Parameters
    ----------
    left, right : float
        Inclinations to the horizontal [deg].
    friction : float
        Friction coefficient.
    motion : Sliding
        Of the right blade.

    Returns
    -------
    tuple of {"left", "right"}
    """
    phi = math.degrees(math.atan(friction))
    out = []
    if motion.right > 0 and phi >= right - _DEGREES:
        out.append("left")
    if motion.left > 0 and phi >= left - _DEGREES:
        out.append("right")
    return tuple(out)


def jams(left: ArrayLike, right: ArrayLike, friction: ArrayLike) -> NDArray[np.bool_]:
    """Whether friction alone can hold a damper, F_C or not.

    Parameters
    ----------
    left, right : array_like
        Inclinations to the horizontal [deg].
    friction : array_like
        Friction coefficient; all three broadcast together.
    """
    phi = np.degrees(np.arctan(friction))
    return np.asarray(np.add(left, right) + 2.0 * phi >= 180.0 - _DEGREES)


def friction_limits(left: float, right: float) -> FrictionLimits:
    """Friction coefficients from which the damper jams, or a face can stay empty.

    Parameters
    ----------
    left, right : float
        Inclinations to the horizontal [deg], above 0 and at most 90.

    Raises
    ------
    InputError
        When an angle is out of range.
    """
    checked_angles(left, right)
    return FrictionLimits(
        math.tan(math.radians(90.0 - (left + right) / 2.0)), _tangent(right), _tangent(left)
    )


def checked_angles(left: float, right: float) -> None:
    """Raise InputError for inclinations that no damper between two platforms has."""
    problems = [
        f"inclination of the {side} face: {angle:g} deg is outside (0, 90]"
        for side, angle in (("left", left), ("right", right))
        if not 0.0 < angle <= 90.0
    ]
    if problems:
        raise InputError("\n".join(problems))


def _cosine(angle: float) -> float:
    """cos of an inclination, 0 at 90 deg."""
    return math.sin(math.radians(90.0 - angle))


def _tangent(angle: float) -> float:
    """tan of an inclination, infinite at 90 deg."""
    return math.inf if angle == 90.0 else math.tan(math.radians(angle))


def forces(
    left: ArrayLike, right: ArrayLike, ratio_left: ArrayLike, ratio_right: ArrayLike
) -> tuple[Array, Array]:
    """Normal forces over F_C of given mobilised ratios T/N.

    Parameters
    ----------
    left, right : array_like
        Inclinations to the horizontal [deg].
    ratio_left, ratio_right : array_like
        T/N of each face; all four broadcast together.

    Returns
    -------
    left, right : ndarray
        N / F_C of each face, nan where no forces that press balance F_C: a face would have to pull,
        or both resultants lie on one line.
    """
    phi_left, phi_right = np.arctan(ratio_left), np.arctan(ratio_right)
    alpha, beta = np.radians(left) - phi_left, np.radians(right) - phi_right
    with np.errstate(divide="ignore", invalid="ignore"):
        both = np.sin(alpha + beta)
        N_left = np.cos(phi_left) * np.sin(beta) / both
        N_right = np.cos(phi_right) * np.sin(alpha) / both
    # what pulls by rounding alone is empty
    slack = _ROUNDING / np.abs(both)
    holds = (N_left >= -slack) & (N_right >= -slack) & (np.abs(both) > _ROUNDING)
    return (
        np.where(holds, np.maximum(N_left, 0.0), np.nan),
        np.where(holds, np.maximum(N_right, 0.0), np.nan),
    )


@dataclass(frozen=True)
class FaceForces:
    """Forces on both faces.

    Attributes
    ----------
    ratio : float
        Mobilised ratio T/N, positive when friction opposes the centrifugal force.
    normal_left, tangential_left : float
        Normal and tangential force on the left face [N].
    normal_right, tangential_right : float
        Normal and tangential force on the right face [N].
    """

    ratio: float
    normal_left: float
    tangential_left: float
    normal_right: float
    tangential_right: float


def face_forces(left: float, right: float, centrifugal: float, ratio: float) -> FaceForces:
    """Forces on two inclined faces at a mobilised ratio T/N.

    Parameters
    ----------
    left, right : float
        Inclinations to the horizontal [deg], above 0 and at most 90.
    centrifugal : float
        Centrifugal force F_C [N].
    ratio : float
        Mobilised ratio T/N on both faces.

    Returns
    -------
    FaceForces

    Raises
    ------
    InputError
        When an angle is out of range, when a face would have to pull (the damper lifts off it), or
        when friction alone holds the damper however large the forces (it jams).
    """
    checked_angles(left, right)
    a, b, phi = math.radians(left), math.radians(right), math.atan(ratio)
    if a + b - 2.0 * phi >= math.pi * (1.0 - 1e-12):
        limit = math.tan(math.pi / 2 - (a + b) / 2)
        raise InputError(
            f"the damper jams: with faces at {left:g} and {right:g} deg and T/N = "
            f"{ratio:.4g} friction alone holds it, "
            f"whatever the normal force; lower the friction below {limit:.4g} or the angles"
        )
    # Both sines vanish together when both resultants are vertical: each face then carries half.
    together = math.sin(a + b - 2.0 * phi)
    sines = (math.sin(b - phi), math.sin(a - phi))
    shares = [sine / together for sine in sines] if together else [0.5, 0.5]
    if min(shares) < -4.0 * math.ulp(1.0):
        side = "left" if shares[0] < shares[1] else "right"
        raise InputError(
            f"the damper lifts off its {side} face: with faces at {left:g} and {right:g} deg and "
            f"T/N = {ratio:.4g} that face would have to pull; T/N can be at most "
            f"{largest_ratio(left, right):.4g}"
        )
    normal = [centrifugal * math.cos(phi) * max(0.0, share) for share in shares]
    return FaceForces(ratio, normal[0], ratio * normal[0], normal[1], ratio * normal[1])


def largest_ratio(left: float, right: float) -> float:
    """Mobilised ratio T/N at which the flatter face alone carries the damper.

    Parameters
    ----------
    left, right : float
        Inclinations to the horizontal [deg].

    Returns
    -------
    float
        Tangent of the smaller inclination; infinite for equal faces.
    """
    return math.inf if left == right else math.tan(math.radians(min(left, right)))


def equilibrium(
    left: float, right: float, centrifugal: float, friction: float, state: str
) -> FaceForces:
    """Forces of a named state at the friction coefficient.

    Parameters
    ----------
    left, right : float
        Inclinations to the horizontal [deg].
    centrifugal : float
        Centrifugal force F_C [N].
    friction : float
        Friction coefficient mu.
    state : {"opposing", "frictionless", "reversed"}
        "opposing": friction opposes the centrifugal force fully, or as far as both faces stay in
        contact: the smallest normal forces. "frictionless": T = 0. "reversed": friction holds the
        damper back against withdrawal, T = -mu N: the largest normal forces.

    Returns
    -------
    FaceForces

    Raises
    ------
    InputError
        When the damper jams.
    """
    ratio = {
        "opposing": min(friction, largest_ratio(left, right)),
        "frictionless": 0.0,
        "reversed": -friction,
    }[state]
    return face_forces(left, right, centrifugal, ratio)


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
    finite = cone[:, 2] > _ROUNDINGS * np.abs(cone).max(axis=1)
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
