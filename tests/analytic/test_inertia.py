"""Mass properties and damping against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from upd.errors import InputError, MeshError
from upd.fem import (
    Material,
    box_mesh,
    mass,
    mass_properties,
    modal_damping,
)

STEEL = Material(200e3, 0.3, 7.8e-9)
EPS = np.finfo(float).eps


def prism(n_node=8):
    """Trapezoid 30 and 6 mm wide, 12 mm high, 42.5 mm long in y.

    The section of a symmetric damper, base on z = 0.
    """
    mesh = box_mesh(np.linspace(-1, 1, 4), np.linspace(0, 42.5, 3), np.linspace(0, 12, 3), n_node)
    points = mesh.points.copy()
    points[:, 0] *= 15.0 - points[:, 2]
    return mesh.with_points(points)


@pytest.mark.parametrize("n_node", [8, 20, 27])
def test_box(n_node):
    a, b, c = 3.0, 5.0, 7.0
    mesh = box_mesh(
        np.linspace(0, a, 3), np.linspace(1, 1 + b, 2), np.linspace(-2, c - 2, 4), n_node
    )
    found = mass_properties(mesh, STEEL)
    m = 7.8e-9 * a * b * c
    np.testing.assert_allclose(found.mass, m, rtol=20 * EPS)
    np.testing.assert_allclose(found.volume, a * b * c, rtol=20 * EPS)
    np.testing.assert_allclose(found.centre, [a / 2, 1 + b / 2, c / 2 - 2], rtol=20 * EPS)
    np.testing.assert_allclose(
        found.inertia,
        m / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b]),
        atol=100 * EPS * m * c * c,
    )


@pytest.mark.parametrize("n_node", [8, 20, 27])
def test_trapezoid_prism_of_216_mm2(n_node):
    found = mass_properties(prism(n_node), STEEL)
    base, top, h, length = 30.0, 6.0, 12.0, 42.5
    area = 0.5 * (base + top) * h
    m = 7.8e-9 * area * length
    assert area == 216.0
    assert round(1e6 * found.mass, 1) == 71.6
    np.testing.assert_allclose(found.mass, m, rtol=50 * EPS)
    height = h * (base + 2 * top) / (3 * (base + top))
    np.testing.assert_allclose(found.centre, [0, length / 2, height], atol=100 * EPS * length)
    # Second moments of a symmetric trapezoid about its centroid (W. C. Young, Roark's Formulas for
    # Stress and Strain, app. A).
    across = h**3 * (base**2 + 4 * base * top + top**2) / (36 * (base + top))
    along = h * (base + top) * (base**2 + top**2) / 48
    line, rho = m * length**2 / 12, 7.8e-9 * length
    exact = np.diag([rho * across + line, rho * (across + along), rho * along + line])
    np.testing.assert_allclose(found.inertia, exact, atol=500 * EPS * exact.max())
    # g mm2 -> kg mm2: as published for this damper to four digits.
    np.testing.assert_allclose(1e3 * np.diag(found.inertia), [11.51, 3.525, 13.57], rtol=5e-4)


def test_quadratic_hexahedra_are_integrated_exactly():
    """A box bent by a quadratic map.

    The moments of its image are polynomials, here by a rule of much higher order.
    """
    mesh = box_mesh([0, 1.0], [0, 1.0], [0, 1.0], 27)
    x, w = np.polynomial.legendre.leggauss(12)
    x, w = (x + 1) / 2, w / 2
    X, Y, Z = np.meshgrid(x, x, x, indexing="ij")
    W = np.einsum("i,j,k->ijk", w, w, w)

    def bend(x, y, z):
        return np.stack([x + 0.3 * y * y, y + 0.2 * z * z * x, z + 0.1 * x * x * y * y])

    step = 1e-6
    J = np.stack(
        [
            (bend(*(np.array([X, Y, Z]) + s)) - bend(*(np.array([X, Y, Z]) - s))) / (2 * step)
            for s in step * np.eye(3)[:, :, None, None, None]
        ]
    )
    dV = W * np.linalg.det(np.moveaxis(J, (0, 1), (-1, -2)))
    P = bend(X, Y, Z)
    volume = dV.sum()
    centre = (P * dV).sum(axis=(1, 2, 3)) / volume
    second = np.einsum(
        "iabc,jabc,abc->ij", P - centre[:, None, None, None], P - centre[:, None, None, None], dV
    )
    found = mass_properties(mesh.with_points(bend(*mesh.points.T).T), Material(1.0, 0.0, 2.0))
    # Central differences of a cubic: step^2 and eps / step.
    np.testing.assert_allclose(found.volume, volume, rtol=1e-9)
    np.testing.assert_allclose(found.centre, centre, rtol=1e-9)
    np.testing.assert_allclose(
        found.inertia, 2.0 * (np.trace(second) * np.eye(3) - second), atol=1e-8
    )


def test_turned_moved_and_about_another_point():
    turn, move = (
        Rotation.from_euler("xyz", [0.3, -0.8, 1.1]).as_matrix(),
        np.array([1e3, -2e3, 5e2]),
    )
    mesh = prism()
    here, there = (
        mass_properties(mesh, STEEL),
        mass_properties(mesh.with_points(mesh.points @ turn.T + move), STEEL),
    )
    np.testing.assert_allclose(there.centre, turn @ here.centre + move, rtol=1e-13)
    np.testing.assert_allclose(
        there.inertia, turn @ here.inertia @ turn.T, atol=1e-11 * here.inertia.max()
    )
    moments = np.linalg.eigvalsh(there.inertia)
    np.testing.assert_allclose(moments, np.sort(np.diag(here.inertia)), rtol=1e-11)
    point = np.array([4.0, -3.0, 12.0])
    x = here.centre - point
    np.testing.assert_allclose(
        here.about(point)[0, 0],
        here.inertia[0, 0] + here.mass * (x[1] ** 2 + x[2] ** 2),
        rtol=1e-13,
    )
    np.testing.assert_allclose(
        here.about(point)[0, 1], here.inertia[0, 1] - here.mass * x[0] * x[1], rtol=1e-12
    )
    np.testing.assert_allclose(here.about(here.centre), here.inertia, rtol=1e-15)


def test_two_materials_and_the_mass_matrix():
    mesh = box_mesh(np.linspace(0, 4, 5), [0, 1.0, 2.0], [0, 3.0])
    regions = (mesh.points[mesh.hexes].mean(axis=1)[:, 0] > 2.0).astype(int)
    materials = [STEEL, Material(70e3, 0.3, 2.7e-9)]
    found = mass_properties(mesh, materials, regions)
    light, heavy = 2.7e-9 * 12.0, 7.8e-9 * 12.0
    np.testing.assert_allclose(found.mass, light + heavy, rtol=1e-14)
    np.testing.assert_allclose(
        found.centre[0], (heavy * 1.0 + light * 3.0) / (light + heavy), rtol=1e-14
    )
    ones = np.tile([1.0, 0.0, 0.0], mesh.n_node)
    np.testing.assert_allclose(
        ones @ mass(mesh, materials, regions=regions) @ ones, found.mass, rtol=1e-13
    )


def test_inverted_hexahedra_are_refused():
    mesh = prism()
    with pytest.raises(MeshError, match="inverted"):
        mass_properties(mesh.with_points(mesh.points * [1, 1, -1]), STEEL)


def test_modal_damping_gives_its_ratios():
    K, M = np.diag([1e3, 4e3]), np.diag([2e-3, 1e-3])
    omega = np.sqrt(np.diag(K) / np.diag(M))
    C = modal_damping(M, np.diag(1 / np.sqrt(np.diag(M))), omega / (2 * np.pi), [0.01, 0.02])
    np.testing.assert_allclose(
        C, np.diag(2 * np.array([0.01, 0.02]) * omega * np.diag(M)), atol=1e-18
    )
    with pytest.raises(InputError, match="not negative"):
        modal_damping(M, np.eye(2), omega, -0.1)
    with pytest.raises(InputError, match="do not fit"):
        modal_damping(M, np.eye(2), omega[:1], 0.1)
