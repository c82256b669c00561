"""Hertz: derivatives, integrals, limits, scaling."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad, quad

import upd.reference as ref
from upd.errors import InputError

E, NU, R = 2e5, 0.3, 5.0
E_STAR = ref.contact_modulus(E, NU, E, NU)
EPS = np.finfo(float).eps
factors = st.floats(0.01, 100.0)


def test_tangent_stiffness_is_the_derivative():
    d = ref.hertz_sphere(50.0, R, E_STAR).approach
    h = d * EPS ** (1 / 3)
    slope = (ref.hertz_load(d + h, R, E_STAR) - ref.hertz_load(d - h, R, E_STAR)) / (2 * h)
    assert ref.hertz_sphere(50.0, R, E_STAR).tangent_stiffness == pytest.approx(
        slope, rel=10 * EPS ** (2 / 3)
    )


@given(load=st.floats(1e-6, 1e6), radius=st.floats(1e-3, 1e3))
@settings(max_examples=50, deadline=None)
def test_load_from_approach_inverts(load, radius):
    point = ref.hertz_sphere(load, radius, E_STAR)
    assert ref.hertz_load(point.approach, radius, E_STAR) == pytest.approx(load, rel=20 * EPS)
    assert load / point.approach == pytest.approx(point.secant_stiffness, rel=20 * EPS)


@given(s=factors, load=st.floats(0.1, 1000.0))
@settings(max_examples=50, deadline=None)
def test_load_scaling(s, load):
    one, other = ref.hertz_sphere(load, R, E_STAR), ref.hertz_sphere(s**3 * load, R, E_STAR)
    powers = {
        "radius": 1,
        "approach": 2,
        "area": 2,
        "max_pressure": 1,
        "mean_pressure": 1,
        "secant_stiffness": 1,
        "tangent_stiffness": 1,
    }
    for name, power in powers.items():
        assert getattr(other, name) == pytest.approx(s**power * getattr(one, name), rel=30 * EPS)


@given(s=factors)
@settings(max_examples=30, deadline=None)
def test_similar_bodies_have_equal_pressure(s):
    one, other = ref.hertz_sphere(50.0, R, E_STAR), ref.hertz_sphere(50.0 * s**2, R * s, E_STAR)
    assert other.max_pressure == pytest.approx(one.max_pressure, rel=30 * EPS)
    assert other.approach == pytest.approx(s * one.approach, rel=30 * EPS)


def test_pressure_integrates_to_the_load():
    point = ref.hertz_sphere(50.0, R, E_STAR)
    force, _ = quad(
        lambda r: 2 * np.pi * r * ref.hertz_pressure(r, point.radius, point.max_pressure),
        0,
        point.radius,
        epsabs=0,
        epsrel=1e-9,
    )
    assert force == pytest.approx(50.0, rel=1e-8)
    assert ref.hertz_pressure(
        np.array([1.0, 2.0]) * point.radius, point.radius, point.max_pressure
    ) == pytest.approx(0.0, abs=0)


def test_axial_displacement_is_the_integral_of_boussinesq():
    a, p0 = 0.12, 1700.0
    for z in (0.03, 0.12, 0.7):

        def ring(r, z=z):
            return (
                2
                * np.pi
                * r
                * ref.hertz_pressure(r, a, p0)
                * float(ref.boussinesq(r, 0.0, z, 1.0, E, NU)[2])
            )

        u, _ = quad(ring, 0, a, epsabs=0, epsrel=1e-9)
        assert ref.hertz_axial_displacement(z, a, p0, E, NU) == pytest.approx(u, rel=1e-8)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_axial_displacement_series_joins_the_closed_form(nu):
    z = 5.0 * np.array([1 - 1e-12, 1 + 1e-12])
    below, above = ref.hertz_axial_displacement(z, 1.0, 1.0, 1.0, nu)
    # the closed form cancels to about eps * (z/a)^2; the points differ by 2e-12
    assert below == pytest.approx(above, rel=1e-11)


def test_axial_displacement_far_away_is_a_point_load():
    a, p0 = 0.12, 1700.0
    z = 1e4 * a
    point = float(ref.boussinesq(0.0, 0.0, z, 2 / 3 * p0 * np.pi * a**2, E, NU)[2])
    assert ref.hertz_axial_displacement(z, a, p0, E, NU) == pytest.approx(point, rel=(a / z) ** 2)


def test_surface_displacements_of_both_bodies_close_the_gap():
    point = ref.hertz_sphere(50.0, R, E_STAR)
    r = np.linspace(0, point.radius, 7)
    both = 2 * ref.hertz_surface_displacement(r, point.radius, point.max_pressure, E, NU)
    assert both + r**2 / (2 * R) == pytest.approx(point.approach, rel=20 * EPS)
    outside = np.linspace(1.01, 3, 5) * point.radius
    both = 2 * ref.hertz_surface_displacement(outside, point.radius, point.max_pressure, E, NU)
    assert np.all(both + outside**2 / (2 * R) > point.approach)


def test_surface_displacement_outside_is_the_integral():
    a, p0, r = 1.0, 1.0, 1.7

    def kernel(t, s):
        return (
            s
            * ref.hertz_pressure(s, a, p0)
            * (1 - NU**2)
            / (np.pi * E)
            / np.sqrt(r**2 + s**2 - 2 * r * s * np.cos(t))
        )

    u, _ = dblquad(kernel, 0, a, 0, 2 * np.pi, epsabs=0, epsrel=1e-5)
    assert ref.hertz_surface_displacement(r, a, p0, E, NU) == pytest.approx(u, rel=1e-5)


def test_axis_and_surface_meet():
    axis, surface = (
        ref.hertz_axial_displacement(0.0, 0.1, 2.0, E, NU),
        ref.hertz_surface_displacement(0.0, 0.1, 2.0, E, NU),
    )
    assert axis == pytest.approx(surface, rel=4 * EPS)


def test_sphere_gap_near_and_far_from_the_axis():
    r = 1e-6
    assert ref.sphere_gap(r, R) == pytest.approx(r**2 / (2 * R), rel=(r / R) ** 2 + 4 * EPS)
    assert ref.sphere_gap(3.0, R) == pytest.approx(1.0, rel=4 * EPS)
    assert ref.sphere_gap(R, R) == pytest.approx(R, rel=4 * EPS)


def test_moduli_and_radii():
    assert ref.contact_modulus(E, NU, np.inf, NU) == pytest.approx(2 * E_STAR, rel=4 * EPS)


@given(
    E1=st.floats(1e3, 1e6), nu1=st.floats(0.0, 0.5), E2=st.floats(1e3, 1e6), nu2=st.floats(0.0, 0.5)
)
@settings(max_examples=50, deadline=None)
def test_dundurs_in_kolosov_form(E1, nu1, E2, nu2):
    """Dundurs' own definition by kappa = 3 - 4 nu, in which body 1 counts positive when it is the
    stiffer.
    """
    G1, G2 = E1 / (2 * (1 + nu1)), E2 / (2 * (1 + nu2))
    k1, k2 = 3 - 4 * nu1, 3 - 4 * nu2
    below = G1 * (k2 + 1) + G2 * (k1 + 1)
    beta = (G1 * (k2 - 1) - G2 * (k1 - 1)) / below
    assert ref.dundurs_beta(E1, nu1, E2, nu2) == pytest.approx(-beta, abs=40 * EPS)
    assert ref.dundurs_beta(E2, nu2, E1, nu1) == pytest.approx(beta, abs=40 * EPS)
    assert ref.dundurs_beta(E1, nu1, E1, nu1) == 0


def test_punch():
    a, load = 2.0, 100.0
    force, _ = quad(
        lambda t: (
            2 * np.pi * a**2 * np.sin(t) * np.cos(t) * ref.punch_pressure(a * np.sin(t), a, load)
        ),
        0,
        np.pi / 2 - 1e-9,
    )
    assert force == pytest.approx(load, rel=1e-8)
    # displacement of the centre under this pressure, 1/r kernel
    depth, _ = quad(
        lambda t: 2 * a * np.cos(t) * ref.punch_pressure(a * np.sin(t), a, load),
        0,
        np.pi / 2 - 1e-9,
    )
    assert ref.punch_load(depth / E_STAR, a, E_STAR) == pytest.approx(load, rel=1e-8)


@pytest.mark.parametrize(
    ("call", "names"),
    [
        (lambda: ref.hertz_sphere(-1.0, R, E_STAR), "load"),
        (lambda: ref.hertz_sphere(np.array([1.0, np.nan]), R, E_STAR), "load"),
        (lambda: ref.hertz_sphere(1.0, 0.0, E_STAR), "radius"),
        (lambda: ref.hertz_load(-1e-3, R, E_STAR), "approach"),
        (lambda: ref.hertz_pressure(-0.1, 1.0, 1.0), "r ="),
        (lambda: ref.sphere_gap(5.1, R), "beyond the sphere"),
        (lambda: ref.hertz_axial_displacement(-0.1, 1.0, 1.0, E, NU), "z ="),
        (lambda: ref.contact_modulus(E, 0.6, E, NU), "Poisson"),
        (lambda: ref.contact_modulus(np.inf, NU, np.inf, NU), "rigid"),
        (lambda: ref.contact_modulus(-np.inf, NU, E, NU), "E ="),
        (lambda: ref.punch_pressure(1.0, 1.0, 1.0), "edge"),
        (lambda: ref.dundurs_beta(0.0, NU, E, NU), "E ="),
    ],
)
def test_refuses(call, names):
    with pytest.raises(InputError, match=names):
        call()
