"""Hertz contact of spheres and what goes with it: onset of yield by von Mises without friction, how
far unlike bodies stick. Units: mm, N, MPa.

The argument written first may be a float or an array; the others broadcast against it.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge 1985, chapters 3 to 6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Generic

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ellipkm1

from upd.errors import InputError
from upd.reference._checks import FloatArray, Real, elastic, not_negative, plain, positive, require

#: its square is the smallest number
_SMALLEST = 1e-150


@dataclass(frozen=True)
class HertzPoint(Generic[Real]):
    """State of a Hertz contact; every field has the shape of the load it was made from.

    Attributes
    ----------
    radius : float or ndarray
        Contact radius a, mm.
    approach : float or ndarray
        d, mm.
    area : float or ndarray
        pi a^2, mm2.
    max_pressure : float or ndarray
        p0, MPa.
    mean_pressure : float or ndarray
        2/3 p0, MPa.
    secant_stiffness : float or ndarray
        F/d, N/mm.
    tangent_stiffness : float or ndarray
        dF/dd = 2 a E*, N/mm.
    """

    radius: Real
    approach: Real
    area: Real
    max_pressure: Real
    mean_pressure: Real
    secant_stiffness: Real
    tangent_stiffness: Real


def contact_modulus(E1: float, nu1: float, E2: float, nu2: float) -> float:
    """E* from 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Parameters
    ----------
    E1, nu1, E2, nu2 : float
        MPa and Poisson ratios; E = inf is a rigid body.

    Returns
    -------
    float
        MPa.

    Raises
    ------
    InputError
        If both bodies are rigid.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, section 4.2.

    Examples
    --------
    >>> from upd.reference import contact_modulus
    >>> print(f"{contact_modulus(200e3, 0.3, 200e3, 0.3):.2f} MPa")
    109890.11 MPa
    """
    compliance = 0.0
    for E, nu in ((E1, nu1), (E2, nu2)):
        if not np.isposinf(E):
            elastic("contact_modulus", E, nu)
            compliance += (1 - nu**2) / E
    require(
        compliance > 0,
        "contact_modulus",
        "both bodies are rigid",
        "give one of them a finite modulus",
    )
    return 1 / compliance


def hertz_sphere(load: Real, radius: float, E_star: float) -> HertzPoint[Real]:
    """Hertz contact of spheres: a = (3 F R / 4 E*)^(1/3), d = a^2/R, p0 = 2 a E*/(pi R).

    Valid for a << R.

    Parameters
    ----------
    load : float or ndarray
        F >= 0, N.
    radius : float
        Effective radius R, mm.
    E_star : float
        MPa, from `contact_modulus`.

    Returns
    -------
    HertzPoint

    Raises
    ------
    InputError
        For a negative load, radius or modulus.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eqs (4.22) to (4.24).

    Examples
    --------
    A steel sphere of 5 mm on a steel plane under 50 N.

    >>> from upd.reference import contact_modulus, hertz_sphere
    >>> point = hertz_sphere(50.0, radius=5.0, E_star=contact_modulus(200e3, 0.3, 200e3, 0.3))
    >>> print(f"a = {point.radius:.4f} mm, d = {point.approach:.3e} mm")
    a = 0.1195 mm, d = 2.856e-03 mm
    >>> print(f"p0 = {point.max_pressure:.1f} MPa")
    p0 = 1671.9 MPa
    """
    not_negative("hertz_sphere", load=load)
    positive("hertz_sphere", radius=radius, E_star=E_star)
    a = np.cbrt(3 * load * radius / (4 * E_star))
    p0 = 2 * a * E_star / (np.pi * radius)
    return HertzPoint(
        radius=a,
        approach=a**2 / radius,
        area=np.pi * a**2,
        max_pressure=p0,
        mean_pressure=2 * p0 / 3,
        secant_stiffness=4 * E_star * a / 3,
        tangent_stiffness=2 * E_star * a,
    )


def hertz_load(approach: Real, radius: float, E_star: float) -> Real:
    """Load F = 4/3 E* sqrt(R) d^(3/2) that gives an approach: the inverse of `hertz_sphere`.

    Parameters
    ----------
    approach : float or ndarray
        d >= 0, mm.
    radius : float
        Effective radius R, mm.
    E_star : float
        MPa.

    Returns
    -------
    float or ndarray
        N.

    Raises
    ------
    InputError
        For a negative approach, radius or modulus.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (4.23).
    """
    not_negative("hertz_load", approach=approach)
    positive("hertz_load", radius=radius, E_star=E_star)
    F: Real = 4 / 3 * E_star * np.sqrt(radius * approach) * approach
    return F


def hertz_pressure(r: Real, a: float, p0: float) -> Real:
    """Pressure p0 sqrt(1 - r^2/a^2), zero outside the contact radius.

    Parameters
    ----------
    r : float or ndarray
        Radius >= 0, mm.
    a : float
        Contact radius, mm.
    p0 : float
        Largest pressure, MPa.

    Returns
    -------
    float or ndarray
        MPa.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.39).
    """
    not_negative("hertz_pressure", r=r, p0=p0)
    positive("hertz_pressure", a=a)
    p: Real = p0 * np.sqrt(np.maximum((1 - r / a) * (1 + r / a), 0.0))
    return p


def sphere_gap(r: Real, R: float) -> Real:
    """Gap R - sqrt(R^2 - r^2) between a sphere and its tangent plane.

    Written r^2/(R + sqrt(R^2 - r^2)), which does not cancel near the axis.

    Parameters
    ----------
    r : float or ndarray
        Distance from the axis, mm.
    R : float
        mm.

    Returns
    -------
    float or ndarray
        mm.

    Raises
    ------
    InputError
        If r is beyond the sphere.
    """
    positive("sphere_gap", R=R)
    not_negative("sphere_gap", r=r)
    require(
        np.asarray(r) <= R,
        "sphere_gap",
        f"r = {r} is beyond the sphere of radius {R} mm",
        "keep the potential patch under the sphere",
    )
    gap: Real = r**2 / (R + np.sqrt((R - r) * (R + r)))
    return gap


def hertz_axial_displacement(z: Real, a: float, p0: float, E: float, nu: float) -> Real:
    """Displacement u_z of one half-space on the contact axis under the Hertz pressure.

    u_z = (1 + nu) p0 a / E [ (1 - nu) atan(a/z) + nu (t - atan t)/t^2 ], t = a/z: the axial line of
    Boussinesq's solution, eq. (3.18c), integrated over p0 sqrt(1 - r^2/a^2). At z = 0 it is
    (1 - nu^2) pi p0 a / (2 E), eq. (3.41a).

    Parameters
    ----------
    z : float or ndarray
        Depth >= 0, mm.
    a : float
        Contact radius, mm.
    p0 : float
        Largest pressure, MPa.
    E, nu : float
        MPa and Poisson ratio.

    Returns
    -------
    float or ndarray
        mm, into the body.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eqs (3.18c) and (3.41a).
    """
    not_negative("hertz_axial_displacement", z=z, p0=p0)
    positive("hertz_axial_displacement", a=a)
    elastic("hertz_axial_displacement", E, nu)
    depth = np.asarray(z, dtype=float) / a
    angle = np.arctan2(1.0, depth)
    # (t - atan t)/t^2 with t = 1/depth: by its series at small t, where the difference would cancel
    deep = depth > 5
    t = 1 / np.where(deep, depth, np.inf)
    # terms fall by t^2 < 1/25 each: twelve reach machine accuracy
    series = sum((-1) ** k * t ** (2 * k + 1) / (2 * k + 3) for k in range(12))
    defect = np.where(deep, series, depth - depth**2 * angle)
    u: Real = plain((1 + nu) * p0 * a / E * ((1 - nu) * angle + nu * defect))
    return u


def hertz_surface_displacement(r: Real, a: float, p0: float, E: float, nu: float) -> Real:
    """Normal displacement u_z of one half-space's surface, inside and outside the contact.

    Inside (1 - nu^2)/E pi p0 (2 a^2 - r^2)/(4 a), outside with asin(a/r) for pi/2.

    Parameters
    ----------
    r : float or ndarray
        Radius >= 0, mm.
    a : float
        Contact radius, mm.
    p0 : float
        Largest pressure, MPa.
    E, nu : float
        MPa and Poisson ratio.

    Returns
    -------
    float or ndarray
        mm.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eqs (3.41a) and (3.42a).
    """
    not_negative("hertz_surface_displacement", r=r, p0=p0)
    positive("hertz_surface_displacement", a=a)
    elastic("hertz_surface_displacement", E, nu)
    s = np.asarray(r, dtype=float) / a
    outer = np.maximum(s, 1.0)
    profile = (2 - s**2) * np.arcsin(1 / outer) + np.sqrt((outer - 1) * (outer + 1))
    u: Real = plain((1 - nu**2) / E * p0 * a / 2 * profile)
    return u


def dundurs_beta(E1: float, nu1: float, E2: float, nu2: float) -> float:
    """Dundurs' beta: 1/2 [(1-2nu1)/G1 - (1-2nu2)/G2] / [(1-nu1)/G1 + (1-nu2)/G2].

    Zero means normal and tangential contact are uncoupled. Sign as in Johnson: positive when body 1
    is the more compliant (Dundurs' own sign is the opposite).

    Parameters
    ----------
    E1, nu1, E2, nu2 : float
        MPa and Poisson ratios.

    Returns
    -------
    float

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (5.3).
    """
    (s1, b1), (s2, b2) = _compliances(E1, nu1), _compliances(E2, nu2)
    return (b1 - b2) / (2 * (s1 + s2))


def _compliances(E: float, nu: float) -> tuple[float, float]:
    """(1 - nu)/G and (1 - 2 nu)/G in 1/MPa."""
    elastic("dundurs", E, nu)
    G = E / (2 * (1 + nu))
    return (1 - nu) / G, (1 - 2 * nu) / G


def punch_load(depth: Real, a: float, E_star: float) -> Real:
    """Load F = 2 a E* d of a rigid flat circular punch.

    Parameters
    ----------
    depth : float or ndarray
        d >= 0 it is pressed in by, mm.
    a : float
        Its radius, mm.
    E_star : float
        MPa.

    Returns
    -------
    float or ndarray
        N.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.36).
    """
    not_negative("punch_load", depth=depth)
    positive("punch_load", a=a, E_star=E_star)
    F: Real = 2 * a * E_star * depth
    return F


def punch_pressure(r: Real, a: float, load: float) -> Real:
    """Pressure F / (2 pi a^2 sqrt(1 - r^2/a^2)) under a flat punch; infinite at its edge.

    Parameters
    ----------
    r : float or ndarray
        0 <= r < a, mm.
    a : float
        Radius of the punch, mm.
    load : float
        F >= 0, N.

    Returns
    -------
    float or ndarray
        MPa.

    Raises
    ------
    InputError
        At the edge and beyond.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.34).
    """
    not_negative("punch_pressure", r=r, load=load)
    positive("punch_pressure", a=a)
    require(
        np.asarray(r) < a,
        "punch_pressure",
        f"r = {r} is not inside the punch of radius {a} mm",
        "the edge pressure is infinite",
    )
    p: Real = load / (2 * np.pi * a**2 * np.sqrt((1 - r / a) * (1 + r / a)))
    return p


# -- onset of yield --------------------------------------------------------------------------------


def hertz_axis_stress(z: Real, a: float, p0: float, nu: float) -> tuple[Real, Real]:
    """Stresses on the axis of a Hertz contact: s_r = s_theta, and s_z.

    s_r / p0 = -(1 + nu) [1 - (z/a) atan(a/z)] + 1 / (2 (1 + z^2/a^2)),
    s_z / p0 = -1 / (1 + z^2/a^2).

    Parameters
    ----------
    z : float or ndarray
        Depth >= 0, mm.
    a : float
        Contact radius, mm.
    p0 : float
        Largest pressure, MPa.
    nu : float
        Poisson ratio.

    Returns
    -------
    s_r, s_z : float or ndarray
        MPa, tension positive.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (3.45).
    """
    not_negative("hertz_axis_stress", z=z, p0=p0)
    positive("hertz_axis_stress", a=a)
    elastic("hertz_axis_stress", 1.0, nu)
    t = np.asarray(z, dtype=float) / a
    fading = 1.0 / (1.0 + t**2)
    radial: FloatArray = 0.5 * fading - (1.0 + nu) * (1.0 - t * np.arctan2(1.0, t))
    return plain(p0 * radial), plain(-p0 * fading)


def hertz_yield_point(nu: float) -> tuple[float, float]:
    """The most stressed place under a Hertz contact.

    On the axis the von Mises stress is abs(s_r - s_z); at the contact's edge the surface is in pure
    shear, s_r = -s_theta = (1 - 2 nu) p0 / 3, which is sqrt(3) times that and counts for strongly
    negative nu only.

    Parameters
    ----------
    nu : float
        Poisson ratio.

    Returns
    -------
    ratio : float
        Von Mises stress there over the largest pressure.
    depth : float
        Over the contact radius; 0 at the surface.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eqs (3.43), (3.45) and (6.9): for nu = 0.3 a body
       yields at p0 = 1.60 Y, at the depth 0.48 a.

    Examples
    --------
    >>> from upd.reference import hertz_yield_point
    >>> ratio, depth = hertz_yield_point(0.3)
    >>> print(f"p0 = {1.0 / ratio:.3f} Y at {depth:.3f} a")
    p0 = 1.613 Y at 0.481 a
    """
    elastic("hertz_yield_point", 1.0, nu)

    def difference(t: float) -> float:
        radial, axial = hertz_axis_stress(t, 1.0, 1.0, nu)
        return float(radial - axial)

    # s_r - s_z rises from (1 - 2 nu) / 2 to one top and falls to zero from there
    top = minimize_scalar(lambda t: -difference(t), bounds=(0.0, 2.0), method="bounded")
    places = [
        (difference(float(top.x)), float(top.x)),
        (abs(1.0 - 2.0 * nu) / 2.0, 0.0),
        (abs(1.0 - 2.0 * nu) / np.sqrt(3.0), 0.0),
    ]
    return max(places, key=lambda place: place[0])


def hertz_yield_load(yield_stress: float, nu: float, radius: float, E_star: float) -> float:
    """Load in N at which a body under a sphere begins to yield.

    The largest pressure grows with the cube root of the load.

    Parameters
    ----------
    yield_stress : float
        Y of the body, MPa.
    nu : float
        Its Poisson ratio.
    radius : float
        Of the sphere, mm.
    E_star : float
        Contact modulus, MPa.

    Returns
    -------
    float
        N.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eq. (6.10), with the factor of `hertz_yield_point`.

    Examples
    --------
    Hardened bearing steel, 1800 MPa, as a ball of 5 mm radius:

    >>> from upd.reference import contact_modulus, hertz_yield_load
    >>> E_star = contact_modulus(200e3, 0.3, 200e3, 0.3)
    >>> print(f"{hertz_yield_load(1800.0, 0.3, 5.0, E_star):.0f} N")
    262 N
    """
    positive("hertz_yield_load", yield_stress=yield_stress)
    p0 = yield_stress / hertz_yield_point(nu)[0]
    return float((p0 / hertz_sphere(1.0, radius, E_star).max_pressure) ** 3)


# -- Spence's indentation with friction ------------------------------------------------------------


def sticking_part(beta: float, mu: float) -> float:
    """Radius of the sticking disk over the contact radius under a growing normal load.

    With c/a = z and K'(z) = K(sqrt(1 - z^2)), K the complete elliptic integral of the first kind,

        1/(2 z) ln((1 + z)/(1 - z)) = (mu/beta) K'(z),

    the same for a flat punch and a sphere, at every load (printed with beta/mu in places, by which
    no friction would stick everywhere). The shear's own effect on the pressure is neglected, so it
    is exact for small beta only.

    Parameters
    ----------
    beta : float
        Dundurs' second constant, above zero in size.
    mu : float
        Friction, above zero.

    Returns
    -------
    float

    Raises
    ------
    InputError
        For a beta of zero or a friction that is not positive.

    References
    ----------
    .. [1] D. A. Spence, J. Elasticity 5 (1975) 297; K. L. Johnson, Contact Mechanics, section 5.4.

    Examples
    --------
    >>> from upd.reference import sticking_part
    >>> print(f"{sticking_part(0.1, 0.1):.4f}")
    0.9038
    """
    if not abs(beta) > 0.0 or not 0.0 < mu < math.inf:
        raise InputError(
            f"sticking part: beta = {beta:g} and mu = {mu:g}: give a beta that is not zero and a "
            "friction above zero (bodies with beta = 0 stick everywhere under a normal load)."
        )
    ratio = mu / abs(beta)

    def off(w: float) -> float:
        """With z = tanh(w), which a computer can tell from one."""
        z = math.tanh(w)
        return w / z - ratio * float(ellipkm1(z * z))

    # K'(z) tends to ln(4/z) for small z: below the smallest z the disk has no radius.
    if off(_SMALLEST) > 0.0:
        return 0.0
    return math.tanh(
        float(brentq(off, _SMALLEST, 5.0 + math.pi * ratio, xtol=1e-300, maxiter=3000))
    )
