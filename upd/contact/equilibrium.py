"""Forces on the two faces of a damper that centrifugal force presses between two platforms.

Left and right face are inclined by a and b to the horizontal and rise towards each other; F_C
acts upwards. Both contacts mobilise the same share t = T/N = tan(phi) of friction, positive when
friction opposes F_C. The resultant of each face is then turned by phi, and

    N_right = F_C cos(phi) sin(a - phi) / sin(a + b - 2 phi),
    N_left  = F_C cos(phi) sin(b - phi) / sin(a + b - 2 phi),    T = t N,

from the balance of vertical and horizontal forces. With a = b it is the thesis's (7.1),
F_C = 2 N (cos a + t sin a).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from upd.errors import InputError


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
    problems = [
        f"inclination of the {side} face: {a:g} deg is outside (0, 90]"
        for side, a in (("left", left), ("right", right))
        if not 0 < a <= 90
    ]
    if problems:
        raise InputError("\n".join(problems))
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
    shares = (
        (0.5, 0.5)
        if together == 0.0
        else (math.sin(b - phi) / together, math.sin(a - phi) / together)
    )
    for side, share in zip(("left", "right"), shares, strict=True):
        if share < -4.0 * math.ulp(1.0):
            raise InputError(
                f"the damper lifts off its {side} face: with faces at {left:g} and "
                f"{right:g} deg and T/N = {ratio:.4g} "
                f"that face would have to pull; T/N can be at most {largest_ratio(left, right):.4g}"
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
