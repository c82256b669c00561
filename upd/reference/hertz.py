"""Hertz contact of spheres and what goes with it (K. L. Johnson, Contact Mechanics, Cambridge 1985, chapters 3 to 5). Units: mm, N, MPa.

The argument written first may be a float or an array; the others broadcast against it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic

import numpy as np

from upd.reference._checks import FloatArray, Real, elastic, not_negative, plain, positive, require


@dataclass(frozen=True)
class HertzPoint(Generic[Real]):
    """State of a Hertz contact; every field has the shape of the load it was made from.

    radius a (mm), approach d (mm), area pi a^2 (mm2), max_pressure p0 (MPa), mean_pressure 2/3 p0 (MPa),
    secant_stiffness F/d (N/mm), tangent_stiffness dF/dd = 2 a E* (N/mm).
    """

    radius: Real
    approach: Real
    area: Real
    max_pressure: Real
    mean_pressure: Real
    secant_stiffness: Real
    tangent_stiffness: Real


def contact_modulus(E1: float, nu1: float, E2: float, nu2: float) -> float:
    """E* (MPa) from 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; E = inf is a rigid body. InputError if both are. Johnson, section 4.2."""
    compliance = 0.0
    for E, nu in ((E1, nu1), (E2, nu2)):
        if not np.isposinf(E):
            elastic("contact_modulus", E, nu)
            compliance += (1 - nu**2) / E
    require(compliance > 0, "contact_modulus", "both bodies are rigid", "give one of them a finite modulus")
    return 1 / compliance


def effective_radius(R1: float, R2: float = np.inf) -> float:
    """R (mm) from 1/R = 1/R1 + 1/R2; inf is a plane, a negative radius a hollow. InputError if they conform. Johnson, section 4.2."""
    require(R1 != 0 and R2 != 0, "effective_radius", f"a radius is zero (R1 = {R1}, R2 = {R2})", "give the radii of curvature in mm")
    curvature = 1 / R1 + 1 / R2
    require(curvature > 0, "effective_radius", f"1/R1 + 1/R2 = {curvature} is not positive", "Hertz needs surfaces that diverge")
    return 1 / curvature


def hertz_sphere(load: Real, radius: float, E_star: float) -> HertzPoint[Real]:
    """Contact of radius (mm, effective) under the load F >= 0 (N): a = (3 F R / 4 E*)^(1/3), d = a^2/R, p0 = 2 a E*/(pi R).

    Returns a HertzPoint. InputError on a negative load, radius or modulus. Valid for a << R. Johnson, eqs (4.22) to (4.24).
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
    """Load F = 4/3 E* sqrt(R) d^(3/2) (N) that gives the approach d >= 0 (mm): the inverse of `hertz_sphere`. Johnson, eq. (4.23)."""
    not_negative("hertz_load", approach=approach)
    positive("hertz_load", radius=radius, E_star=E_star)
    F: Real = 4 / 3 * E_star * np.sqrt(radius * approach) * approach
    return F


def hertz_pressure(r: Real, a: float, p0: float) -> Real:
    """Pressure p0 sqrt(1 - r^2/a^2) (MPa) at the radius r >= 0 (mm), zero outside the contact radius a (mm). Johnson, eq. (3.39)."""
    not_negative("hertz_pressure", r=r, p0=p0)
    positive("hertz_pressure", a=a)
    p: Real = p0 * np.sqrt(np.maximum((1 - r / a) * (1 + r / a), 0.0))
    return p


def sphere_gap(r: Real, R: float) -> Real:
    """Gap R - sqrt(R^2 - r^2) (mm) between a sphere of radius R (mm) and its tangent plane at the distance r (mm) from the axis.

    Written r^2/(R + sqrt(R^2 - r^2)), which does not cancel near the axis. InputError if r is beyond the sphere.
    """
    positive("sphere_gap", R=R)
    not_negative("sphere_gap", r=r)
    require(np.asarray(r) <= R, "sphere_gap", f"r = {r} is beyond the sphere of radius {R} mm", "keep the potential patch under the sphere")
    gap: Real = r**2 / (R + np.sqrt((R - r) * (R + r)))
    return gap


def hertz_axial_displacement(z: Real, a: float, p0: float, E: float, nu: float) -> Real:
    """Displacement u_z (mm, into the body) of one half-space on the contact axis at the depth z >= 0 (mm) under the Hertz pressure.

    u_z = (1 + nu) p0 a / E [ (1 - nu) atan(a/z) + nu (t - atan t)/t^2 ], t = a/z: the axial line of Boussinesq's solution,
    Johnson, eq. (3.18c), integrated over p0 sqrt(1 - r^2/a^2). At z = 0 it is (1 - nu^2) pi p0 a / (2 E), eq. (3.41a).
    """
    not_negative("hertz_axial_displacement", z=z, p0=p0)
    positive("hertz_axial_displacement", a=a)
    elastic("hertz_axial_displacement", E, nu)
    depth = np.asarray(z, dtype=float) / a
    angle = np.arctan2(1.0, depth)
    u: Real = plain((1 + nu) * p0 * a / E * ((1 - nu) * angle + nu * _arctan_defect(depth, angle)))
    return u


def _arctan_defect(depth: FloatArray, angle: FloatArray) -> FloatArray:
    """(t - atan t)/t^2 with t = 1/depth; by its series at small t, where the difference would cancel."""
    deep = depth > 5
    t = 1 / np.where(deep, depth, np.inf)
    # terms fall by t^2 < 1/25 each: twelve reach machine accuracy
    series = sum((-1) ** k * t ** (2 * k + 1) / (2 * k + 3) for k in range(12))
    return np.asarray(np.where(deep, series, depth - depth**2 * angle))


def hertz_surface_displacement(r: Real, a: float, p0: float, E: float, nu: float) -> Real:
    """Normal displacement u_z (mm) of one half-space surface at the radius r >= 0 (mm), inside and outside the contact radius a (mm).

    Inside (1 - nu^2)/E pi p0 (2 a^2 - r^2)/(4 a), outside with asin(a/r) for pi/2. Johnson, eqs (3.41a) and (3.42a).
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
    """Dundurs' beta: 1/2 [(1-2nu1)/G1 - (1-2nu2)/G2] / [(1-nu1)/G1 + (1-nu2)/G2]; zero means normal and tangential contact are uncoupled.

    Sign as in Johnson, eq. (5.3): positive when body 1 is the more compliant (Dundurs' own sign is the opposite).
    """
    (s1, b1), (s2, b2) = _compliances(E1, nu1), _compliances(E2, nu2)
    return (b1 - b2) / (2 * (s1 + s2))


def dundurs_alpha(E1: float, nu1: float, E2: float, nu2: float) -> float:
    """Dundurs' alpha, plane strain: [(1-nu1)/G1 - (1-nu2)/G2] / [(1-nu1)/G1 + (1-nu2)/G2], in (-1, 1).

    Sign as in Johnson, eq. (5.3a): positive when body 1 is the more compliant (Dundurs' own sign is the opposite).
    """
    (s1, _), (s2, _) = _compliances(E1, nu1), _compliances(E2, nu2)
    return (s1 - s2) / (s1 + s2)


def _compliances(E: float, nu: float) -> tuple[float, float]:
    """(1 - nu)/G and (1 - 2 nu)/G in 1/MPa."""
    elastic("dundurs", E, nu)
    G = E / (2 * (1 + nu))
    return (1 - nu) / G, (1 - 2 * nu) / G


def punch_load(depth: Real, a: float, E_star: float) -> Real:
    """Load F = 2 a E* d (N) of a rigid flat circular punch of radius a (mm) pressed in by d >= 0 (mm). Johnson, eq. (3.36)."""
    not_negative("punch_load", depth=depth)
    positive("punch_load", a=a, E_star=E_star)
    F: Real = 2 * a * E_star * depth
    return F


def punch_pressure(r: Real, a: float, load: float) -> Real:
    """Pressure F / (2 pi a^2 sqrt(1 - r^2/a^2)) (MPa) under the punch, 0 <= r < a (mm); infinite at its edge. Johnson, eq. (3.34)."""
    not_negative("punch_pressure", r=r, load=load)
    positive("punch_pressure", a=a)
    require(np.asarray(r) < a, "punch_pressure", f"r = {r} is not inside the punch of radius {a} mm", "the edge pressure is infinite")
    p: Real = load / (2 * np.pi * a**2 * np.sqrt((1 - r / a) * (1 + r / a)))
    return p
