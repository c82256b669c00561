"""Stresses under loaded rectangles against point loads integrated over them, and their balance."""

from __future__ import annotations

import numpy as np
import pytest

from upd.errors import InputError
from upd.reference import (
    boussinesq_stress,
    cerruti_rectangle_stress,
    cerruti_stress,
    love_rectangle_stress,
    von_mises,
)

A, B, NU = 0.7, 1.3, 0.3
PAIRS = {
    "pressure": (love_rectangle_stress, boussinesq_stress),
    "traction": (cerruti_rectangle_stress, cerruti_stress),
}
#: beside, below and above the lines of the edges
PLACES = [(0.0, 0.0, 0.4), (0.7, 0.2, 0.5), (-0.7, -1.3, 0.3), (1.6, -0.4, 0.6), (-0.3, 2.5, 0.05)]


@pytest.mark.parametrize("load", PAIRS)
@pytest.mark.parametrize("place", PLACES)
def test_rectangle_is_the_integral_of_point_loads(
    load: str, place: tuple[float, float, float]
) -> None:
    closed, point = PAIRS[load]
    nodes, weights = np.polynomial.legendre.leggauss(80)
    X, Y = np.meshgrid(A * nodes, B * nodes, indexing="ij")
    W = A * B * np.outer(weights, weights)
    x, y, z = place
    integral = np.einsum("ij,ijkl->kl", W, point(x - X, y - Y, z, 100.0, NU))
    assert closed(x, y, z, A, B, 100.0, NU) == pytest.approx(integral, rel=1e-9, abs=1e-8)


@pytest.mark.parametrize("load", PAIRS)
def test_stresses_balance(load: str) -> None:
    closed, step = PAIRS[load][0], 1e-4
    place = np.array([0.31, -0.62, 0.45])
    divergence = np.zeros(3)
    for axis in range(3):
        more, less = place.copy(), place.copy()
        more[axis] += step
        less[axis] -= step
        slope = (closed(*more, A, B, 100.0, NU) - closed(*less, A, B, 100.0, NU)) / (2 * step)
        divergence += slope[axis]
    assert np.abs(divergence).max() < 1e-4


def test_surface_carries_the_load_and_nothing_beside_it() -> None:
    inside = love_rectangle_stress(0.2, 0.9, 0.0, A, B, 100.0, NU)
    assert inside[2] == pytest.approx([0.0, 0.0, -100.0])
    assert love_rectangle_stress(0.9, 0.0, 0.0, A, B, 100.0, NU)[2] == pytest.approx([0.0] * 3)
    sheared = cerruti_rectangle_stress(0.2, 0.9, 0.0, A, B, 100.0, NU)
    assert sheared[2] == pytest.approx([-100.0, 0.0, 0.0])
    assert cerruti_rectangle_stress(0.9, 0.0, 0.0, A, B, 100.0, NU)[2] == pytest.approx([0.0] * 3)


def test_far_away_the_rectangle_is_a_point() -> None:
    place = (30.0, -20.0, 25.0)
    for closed, point in PAIRS.values():
        found = closed(*place, A, B, 100.0, NU)
        exact = point(*place, 100.0 * 4.0 * A * B, NU)
        assert found == pytest.approx(exact, rel=2e-2, abs=1e-3 * np.abs(exact).max())


def test_edges_in_the_surface_are_refused() -> None:
    for closed, _ in PAIRS.values():
        with pytest.raises(InputError, match="edges of the rectangle"):
            closed(A, 0.0, 0.0, A, B, 100.0, NU)
        with pytest.raises(InputError, match="z = -1"):
            closed(0.0, 0.0, -1.0, A, B, 100.0, NU)


def test_von_mises_knows_no_pressure_and_counts_shear() -> None:
    assert von_mises(-70.0 * np.eye(3)) == pytest.approx(0.0, abs=1e-12)
    shear = np.zeros((3, 3))
    shear[0, 1] = shear[1, 0] = 10.0
    assert von_mises(shear) == pytest.approx(np.sqrt(3.0) * 10.0)
    assert von_mises(np.diag([300.0, 200.0, 0.0])) == pytest.approx(np.sqrt(7.0) * 100.0)
