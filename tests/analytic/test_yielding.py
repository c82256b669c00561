"""Onset of yield: closed forms on the axis, and von Mises stresses from any pressure."""

from __future__ import annotations

import numpy as np
import pytest

from upd.contact.subsurface import most_stressed, partial_slip_ratio
from upd.reference import (
    boussinesq_stress,
    contact_modulus,
    hertz_axis_stress,
    hertz_sphere,
    hertz_yield_load,
    hertz_yield_point,
    von_mises,
)


def hertz_pressure(n: int, wide: float = 1.3) -> tuple[np.ndarray, np.ndarray]:
    """Lines and pressure of a contact of radius 1 with p0 = 1, n cells across 2 ``wide``."""
    lines = np.linspace(-wide, wide, n + 1)
    r = np.hypot(*np.meshgrid(lines, lines, indexing="ij"))
    return lines, np.sqrt(np.maximum(0.0, 1.0 - r**2))


def test_axis_stress_is_the_integral_of_point_loads() -> None:
    nodes, weights = np.polynomial.legendre.leggauss(200)
    r = 0.5 * (nodes + 1.0)
    rings = 0.5 * weights * 2.0 * np.pi * r * np.sqrt(1.0 - r**2)
    for z in (0.2, 0.48, 1.5):
        # of a ring, the mean of its x and y stresses is radial and hoop alike
        point = boussinesq_stress(r, 0.0 * r, z + 0.0 * r, 1.0, 0.3)
        radial = float(rings @ (0.5 * (point[:, 0, 0] + point[:, 1, 1])))
        axial = float(rings @ point[:, 2, 2])
        assert hertz_axis_stress(z, 1.0, 1.0, 0.3) == pytest.approx((radial, axial), rel=1e-5)


@pytest.mark.parametrize(("nu", "printed"), [(0.3, 1.60)])
def test_johnson_prints_the_onset(nu: float, printed: float) -> None:
    ratio, depth = hertz_yield_point(nu)
    assert 1.0 / ratio == pytest.approx(printed, rel=0.01)
    assert depth == pytest.approx(0.48, abs=0.005)


def test_yield_load_is_where_the_stress_reaches_the_limit() -> None:
    E_star = contact_modulus(200e3, 0.3, 200e3, 0.3)
    load = hertz_yield_load(1600.0, 0.3, 5.0, E_star)
    p0 = hertz_sphere(load, 5.0, E_star).max_pressure
    assert hertz_yield_point(0.3)[0] * p0 == pytest.approx(1600.0)
    # the ready sphere: p0 = 2654 MPa at 200 N
    assert hertz_yield_point(0.3)[0] * 2654.0 == pytest.approx(1646.0, rel=1e-3)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_convolution_finds_hertz_and_converges(nu: float) -> None:
    exact, errors = hertz_yield_point(nu)[0], []
    for n in (10, 20, 40):
        lines, pressure = hertz_pressure(n)
        found = most_stressed(lines, lines, [pressure], nu)
        errors.append(abs(found.value / exact - 1.0))
    assert errors[2] < 0.005 and errors[1] < 0.015 and errors[0] < 0.05
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2]
    assert found.place[2] == pytest.approx(hertz_yield_point(nu)[1], rel=0.1)
    # three times the change between lattices bounds what is left
    assert found.resolution == pytest.approx(3.0 * errors[2], rel=1.0)


def test_uneven_lattice_gives_the_same() -> None:
    lines, pressure = hertz_pressure(40)
    even = most_stressed(lines, lines, [pressure], 0.3).value
    bent = 1.3 * np.sign(lines) * (np.abs(lines) / 1.3) ** 1.05
    r = np.hypot(*np.meshgrid(bent, bent, indexing="ij"))
    field = np.sqrt(np.maximum(0.0, 1.0 - r**2))
    assert most_stressed(bent, bent, [field], 0.3).value == pytest.approx(even, rel=0.02)


def test_flat_punch_is_not_resolved_and_says_so() -> None:
    lines = np.linspace(-1.3, 1.3, 41)
    r = np.hypot(*np.meshgrid(lines, lines, indexing="ij"))
    inside = r < 1.0
    pressure = np.where(inside, 0.5 / np.sqrt(np.where(inside, 1.0 - r**2, 1.0)), 0.0)
    assert most_stressed(lines, lines, [pressure], 0.3).resolution > 0.1


def sliding_surface(mu: float, nu: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Stresses in the surface of a sliding Hertz contact, a = p0 = 1.

    Hertz's (K. L. Johnson, Contact Mechanics, eq. 3.43) and those of the traction mu p along x,
    linear in x and y inside the circle (G. M. Hamilton and L. E. Goodman, J. Appl. Mech. 33, 1966).
    """
    r = np.hypot(x, y)
    s = np.sqrt(1.0 - r**2)
    b = (1.0 - 2.0 * nu) / 3.0 / r**2 * (1.0 - s**3)
    radial, hoop, cos, sin = b - s, -b - 2.0 * nu * s, x / r, y / r
    out = np.zeros((*r.shape, 3, 3))
    out[..., 0, 0] = radial * cos**2 + hoop * sin**2 - mu * np.pi / 8.0 * (4.0 + nu) * x
    out[..., 1, 1] = radial * sin**2 + hoop * cos**2 - mu * np.pi * 3.0 / 8.0 * nu * x
    out[..., 0, 1] = out[..., 1, 0] = (radial - hoop) * cos * sin - mu * np.pi / 16.0 * (
        2.0 - nu
    ) * y
    out[..., 2, 2] = -s
    out[..., 0, 2] = out[..., 2, 0] = -mu * s
    return out


@pytest.mark.parametrize("mu", [0.4, 0.6])
def test_friction_brings_the_most_stressed_place_to_the_surface(mu: float) -> None:
    lines, pressure = hertz_pressure(40)
    found = most_stressed(lines, lines, [pressure, mu * pressure, 0.0 * pressure], 0.3)
    assert found.place[2] == 0.0
    exact = von_mises(sliding_surface(mu, 0.3, found.place[0], found.place[1]))
    assert found.value == pytest.approx(float(exact), rel=0.02)
    fine = np.linspace(-0.999, 0.999, 400)
    X, Y = np.meshgrid(fine, fine, indexing="ij")
    inside = np.hypot(X, Y) < 0.999
    # at the contact's edge the pressure's slope is unbounded, and cells smooth it
    largest = von_mises(sliding_surface(mu, 0.3, X[inside], Y[inside])).max()
    assert 0.94 * largest < found.value < largest
    turned = most_stressed(lines, lines, [pressure, 0.0 * pressure, mu * pressure], 0.3)
    assert turned.value == pytest.approx(found.value, rel=1e-9)


def test_partial_slip_lies_between_no_friction_and_sliding() -> None:
    none, most = (partial_slip_ratio(0.6, ratio, 0.3) for ratio in (0.0, 0.999))
    assert none == pytest.approx(hertz_yield_point(0.3)[0], rel=0.01)
    lines, pressure = hertz_pressure(40)
    sliding = most_stressed(lines, lines, [pressure, 0.6 * pressure, 0.0 * pressure], 0.3).value
    assert none < most == pytest.approx(sliding, rel=0.02)
