"""Printed numbers: Hertz and Mindlin for a steel sphere of 5 mm, and the tables of the thesis about
it against them.

Closed forms: K. L. Johnson, Contact Mechanics, Cambridge 1985; each test names the equations.
Tables: "Investigation of the dynamic behaviour of underplatform dampers", master's thesis,
Politecnico di Torino. The text at hand names neither author nor year (its experiments are of 2005),
so it is cited by title, school and table.
"""

import numpy as np
import pytest

import upd.reference as ref

E, NU, R = 2e5, 0.3, 5.0
E_STAR = ref.contact_modulus(E, NU, E, NU)
C = ref.tangential_compliance_modulus(E, NU, E, NU)


def half_digit(text):
    """Half a unit of the last printed digit."""
    mantissa, _, exponent = text.partition("e")
    decimals = len(mantissa.partition(".")[2])
    return 0.5 * 10.0 ** (int(exponent or 0) - decimals)


PRINTED = {
    50.0: {
        "radius": "119.494e-3",
        "approach": "2.8558e-3",
        "area": "44.859e-3",
        "max_pressure": "1671.9",
        "mean_pressure": "1114.6",
        "secant_stiffness": "1.751e4",
        "tangent_stiffness": "2.626e4",
    },
    200.0: {
        "radius": "189.686e-3",
        "approach": "7.1961e-3",
        "area": "113.04e-3",
        "max_pressure": "2654.0",
        "mean_pressure": "1769.3",
        "secant_stiffness": "2.779e4",
        "tangent_stiffness": "4.169e4",
    },
}


@pytest.mark.parametrize("load", PRINTED)
@pytest.mark.parametrize("name", PRINTED[50.0])
def test_hertz_values(load, name):
    """K. L. Johnson, Contact Mechanics, 1985, equations (4.22) to (4.24), every printed digit."""
    printed = PRINTED[load][name]
    assert getattr(ref.hertz_sphere(load, R, E_STAR), name) == pytest.approx(
        float(printed), rel=0, abs=half_digit(printed)
    )


def test_moduli():
    """K. L. Johnson, Contact Mechanics, 1985, section 4.2 (E*); steel of the thesis, Table I."""
    assert ref.contact_modulus(E, NU, E, NU) == pytest.approx(109_890.1, abs=0.05)


@pytest.mark.parametrize(
    ("depth", "printed"), [(1, "0.559"), (2, "0.335"), (3, "0.233"), (5, "0.143"), (10, "0.0725")]
)
def test_displacement_left_at_depth(depth, printed):
    """K. L. Johnson, Contact Mechanics, 1985, equation (3.18c) integrated over Hertz's pressure.

    (3.41a) at the surface.
    """
    point = ref.hertz_sphere(50.0, R, E_STAR)
    z = np.array([0.0, depth * point.radius])
    surface, below = ref.hertz_axial_displacement(z, point.radius, point.max_pressure, E, NU)
    assert below / surface == pytest.approx(float(printed), rel=0, abs=half_digit(printed))


@pytest.mark.parametrize(
    ("load", "stiffness", "full_slip"), [(50.0, "21628", "2.081e-3"), (200.0, "34332", "5.243e-3")]
)
def test_mindlin_values(load, stiffness, full_slip):
    """R. D. Mindlin (1949), as in K. L. Johnson, Contact Mechanics, 1985, section 7.2."""
    a = ref.hertz_sphere(load, R, E_STAR).radius
    mu = 0.6
    assert ref.initial_tangential_stiffness(a, C) == pytest.approx(
        float(stiffness), rel=0, abs=half_digit(stiffness)
    )
    assert ref.mindlin_displacement(mu * load, mu, load, a, C) == pytest.approx(
        float(full_slip), rel=0, abs=half_digit(full_slip)
    )
    one_body = ref.tangential_compliance_modulus(E, NU, np.inf, NU)
    assert ref.initial_tangential_stiffness(a, one_body) == pytest.approx(
        2 * float(stiffness), rel=0, abs=2 * half_digit(stiffness)
    )


@pytest.mark.parametrize(
    ("q", "printed"),
    [(0.25, "0.9086"), (0.5, "0.7937"), (0.75, "0.6300"), (0.9, "0.4642"), (0.875, "0.5")],
)
def test_stick_radius(q, printed):
    """R. D. Mindlin (1949), as in K. L. Johnson, Contact Mechanics, 1985, section 7.2.

    c/a = (1 - q)^(1/3).
    """
    assert ref.stick_radius(q * 30.0, 0.6, 50.0, 1.0) == pytest.approx(
        float(printed), rel=0, abs=half_digit(printed)
    )


#: errors of the thesis against the exact closed form, per cent, to the printed digit
EXACT_ERRORS = {
    50.0: {
        "radius": "-2.1",
        "approach": "-4.4",
        "area": "-3.9",
        "max_pressure": "7.7",
        "mean_pressure": "4.1",
    },
    200.0: {
        "radius": "-0.4",
        "approach": "-3.0",
        "area": "0.1",
        "max_pressure": "10.4",
        "mean_pressure": "-0.1",
    },
}


@pytest.mark.parametrize("load", EXACT_ERRORS)
@pytest.mark.parametrize("name", EXACT_ERRORS[50.0])
def test_thesis_errors(load, name):
    """Thesis (Politecnico di Torino), Tables VII and VIII, against K. L. Johnson, Contact
    Mechanics, 1985, equations (4.22) to (4.24).
    """
    printed = EXACT_ERRORS[load][name]
    exact = getattr(ref.hertz_sphere(load, R, E_STAR), name)
    assert 100 * (ref.THESIS_HERTZ[load][name] / exact - 1) == pytest.approx(
        float(printed), rel=0, abs=half_digit(printed)
    )


@pytest.mark.parametrize(("load", "cells"), [(50.0, 69), (200.0, 181)])
def test_thesis_areas_are_whole_cells(load, cells):
    """Thesis (Politecnico di Torino), Tables VII and VIII: areas.

    Exact: K. L. Johnson, Contact Mechanics, 1985, section 4.2.
    """
    area = cells * 0.025**2
    # half a unit of the last printed digit: three digits at 50 N, four at 200 N
    assert ref.THESIS_HERTZ[load]["area"] == pytest.approx(area, abs=5e-5)


@pytest.mark.parametrize(("load", "stiffness"), [(50.0, 2.88e4), (200.0, 4.62e4)])
def test_thesis_stiffness_does_not_follow_from_its_approach(load, stiffness):
    """Thesis (Politecnico di Torino), Tables IX and X; dF/dd = 1.5 F/d by K. L. Johnson, Contact
    Mechanics, 1985, equation (4.23).
    """
    assert 1.5 * load / ref.THESIS_COMPRESSION[load] == pytest.approx(stiffness, abs=50)
    assert ref.THESIS_STIFFNESS[load] > 1.1 * stiffness


def test_thesis_craig_bampton_is_an_upper_bound():
    """Thesis (Politecnico di Torino), Table VI; method of R. R. Craig, M. C. C. Bampton, AIAA J. 6
    (1968) 1313.
    """
    reduced, full = (
        np.array(ref.THESIS_FREQUENCIES[k]) for k in ("craig_bampton_symmetric", "free_symmetric")
    )
    error = reduced / full - 1
    assert np.all(error > 0)
    assert error.max() == pytest.approx(2.6e-4, abs=5e-6)
