"""Onset of yield under a Hertz contact, by von Mises, without friction.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge 1985, sections 3.4, 6.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from upd.reference._checks import FloatArray, Real, elastic, not_negative, plain, positive
from upd.reference.hertz import hertz_sphere


@dataclass(frozen=True)
class YieldPoint:
    """Where a body under a Hertz contact is stressed most.

    Attributes
    ----------
    ratio
        Largest von Mises stress over the largest pressure p0.
    depth
        Of that place over the contact radius: on the axis, or 0 at the contact's edge.
    """

    ratio: float
    depth: float


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


def hertz_yield_point(nu: float) -> YieldPoint:
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
    YieldPoint

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, eqs (3.43), (3.45) and (6.9): for nu = 0.3 a body
       yields at p0 = 1.60 Y, at the depth 0.48 a.

    Examples
    --------
    >>> from upd.reference import hertz_yield_point
    >>> found = hertz_yield_point(0.3)
    >>> print(f"p0 = {1.0 / found.ratio:.3f} Y at {found.depth:.3f} a")
    p0 = 1.613 Y at 0.481 a
    """
    elastic("hertz_yield_point", 1.0, nu)

    def difference(t: float) -> float:
        radial, axial = hertz_axis_stress(t, 1.0, 1.0, nu)
        return float(radial - axial)

    # s_r - s_z rises from (1 - 2 nu) / 2 to one top and falls to zero from there
    top = minimize_scalar(lambda t: -difference(t), bounds=(0.0, 2.0), method="bounded")
    places = [
        YieldPoint(difference(float(top.x)), float(top.x)),
        YieldPoint(abs(1.0 - 2.0 * nu) / 2.0, 0.0),
        YieldPoint(abs(1.0 - 2.0 * nu) / np.sqrt(3.0), 0.0),
    ]
    return max(places, key=lambda place: place.ratio)


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
    p0 = yield_stress / hertz_yield_point(nu).ratio
    return float((p0 / hertz_sphere(1.0, radius, E_star).max_pressure) ** 3)
