"""Equilibrium of a damper between two faces, against hand statics and the thesis's printed
forces.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from upd.contact.rigid_damper import equilibrium, face_forces
from upd.errors import InputError


def residual(left: float, right: float, centrifugal: float, f: object) -> float:
    a, b = math.radians(left), math.radians(right)
    up = (
        f.normal_right * math.cos(b)
        + f.tangential_right * math.sin(b)
        + f.normal_left * math.cos(a)
        + f.tangential_left * math.sin(a)
    )
    side = (
        f.normal_right * math.sin(b)
        - f.tangential_right * math.cos(b)
        - f.normal_left * math.sin(a)
        + f.tangential_left * math.cos(a)
    )
    return max(abs(up - centrifugal), abs(side))


@pytest.mark.parametrize(
    ("state", "force"), [("opposing", 154.68), ("frictionless", 247.49), ("reversed", 618.72)]
)
def test_symmetric_wedge_of_the_thesis(state: str, force: float) -> None:
    found = equilibrium(45.0, 45.0, 350.0, 0.6, state)
    assert found.normal_right == pytest.approx(force, abs=0.01)
    assert found.normal_left == found.normal_right


def test_asymmetric_damper_rests_on_its_padded_face_alone() -> None:
    """F_C cos 30 and F_C sin 30, the thesis's 303 and 175 N; the left face carries nothing."""
    found = equilibrium(90.0, 30.0, 350.0, 0.6, "opposing")
    assert found.normal_right == pytest.approx(350.0 * math.cos(math.pi / 6), rel=1e-12)
    assert found.tangential_right == pytest.approx(350.0 * math.sin(math.pi / 6), rel=1e-12)
    assert found.normal_left == pytest.approx(0.0, abs=1e-12)


def test_a_wedge_that_jams_is_refused_with_the_limit() -> None:
    with pytest.raises(InputError, match=r"jams.*0\.5774"):
        equilibrium(90.0, 30.0, 350.0, 0.6, "reversed")
    with pytest.raises(InputError, match="jams"):
        equilibrium(60.0, 60.0, 350.0, 0.6, "reversed")
    assert residual(60.0, 60.0, 350.0, equilibrium(60.0, 60.0, 350.0, 0.57, "reversed")) < 1e-9


def test_a_wedge_that_lifts_is_refused_with_the_limit() -> None:
    with pytest.raises(InputError, match=r"lifts off its left face.*0\.5774"):
        face_forces(90.0, 30.0, 350.0, 0.6)
    with pytest.raises(InputError, match="right face"):
        face_forces(30.0, 90.0, 350.0, 0.6)


def test_angles_out_of_range_are_told_together() -> None:
    with pytest.raises(InputError, match=r"left face: 0 deg[^\0]*right face: 120 deg"):
        face_forces(0.0, 120.0, 1.0, 0.0)


@given(st.floats(5.0, 90.0), st.floats(5.0, 90.0), st.floats(-0.5, 0.5), st.floats(1e-3, 1e6))
def test_forces_balance_whatever_the_angles(
    left: float, right: float, ratio: float, centrifugal: float
) -> None:
    try:
        found = face_forces(left, right, centrifugal, ratio)
    except InputError as fault:
        a, b, phi = np.radians(left), np.radians(right), np.arctan(ratio)
        jams, pulls = a + b - 2 * phi >= np.pi * (1 - 1e-9), min(a, b) < phi * (1 + 1e-9)
        assert ("jams" in str(fault) and jams) or ("lifts" in str(fault) and pulls)
        return
    assert min(found.normal_left, found.normal_right) >= 0.0
    scale = centrifugal + found.normal_left + found.normal_right
    assert residual(left, right, centrifugal, found) <= 1e-12 * scale
