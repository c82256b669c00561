"""Whole solids against closed forms: beams, a bar, a thick cylinder near incompressibility."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh, splu

from upd.fem import ELEMENTS, Material, box_mesh, mass, stiffness, traction_weights
from upd.mesh import Mesh

STEEL = Material(200e3, 0.3)
#: those that may stand in one row
FULL = tuple(name for name in ELEMENTS if name != "hex20r")


def solve(
    mesh: Mesh, material: Material, element: str, fixed: np.ndarray, force: np.ndarray
) -> np.ndarray:
    """Displacements (n_node, 3) with the marked dofs (n_node, 3) held at zero."""
    free = ~fixed.ravel()
    u = np.zeros(free.size)
    u[free] = splu(stiffness(mesh, material, element)[free][:, free].tocsc()).solve(
        force.ravel()[free]
    )
    return u.reshape(-1, 3)


def nodes_per_hex(element: str) -> int:
    return int(element[3:].rstrip("ir"))


def tip_deflection_ratio(element: str, material: Material, n: tuple[int, int, int]) -> float:
    """Deflection of a 20 x 1 x 1 mm cantilever under an end shear force over Timoshenko's.

    The root holds u_x only and carries the opposite shear traction, so that no section is kept from
    changing its shape.
    """
    length, height, width, F = 20.0, 1.0, 1.0, 1.0
    mesh = box_mesh(
        *(np.linspace(0, size, k + 1) for size, k in zip((length, height, width), n, strict=True)),
        nodes_per_hex(element),
    )
    fixed, force = np.zeros((mesh.n_node, 3), dtype=bool), np.zeros((mesh.n_node, 3))
    root, tip = mesh.nodes["x0"], mesh.nodes["x1"]
    fixed[root, 0] = True
    corner, above = (
        np.flatnonzero((mesh.points == place).all(axis=1)) for place in ([0, 0, 0], [0, height, 0])
    )
    fixed[corner, 1:] = True
    fixed[above, 2] = True
    shear = F / (height * width)
    force[:, 1] = shear * (
        traction_weights(mesh.points, mesh.faces["x1"])
        - traction_weights(mesh.points, mesh.faces["x0"])
    )
    u = solve(mesh, material, element, fixed, force)
    second_moment, kappa = width * height**3 / 12, 10 * (1 + material.nu) / (12 + 11 * material.nu)
    exact = F * length**3 / (3 * material.E * second_moment) + F * length / (
        kappa * material.G * height * width
    )
    return float((u[tip, 1].mean() - u[root, 1].mean()) / exact)


@pytest.mark.parametrize(
    ("element", "n"),
    [("hex8i", (20, 1, 1)), ("hex8i", (20, 2, 2)), ("hex20", (10, 1, 1)), ("hex27", (10, 1, 1))],
)
def test_cantilever_bends_as_a_timoshenko_beam(element: str, n: tuple[int, int, int]) -> None:
    assert tip_deflection_ratio(element, STEEL, n) == pytest.approx(1.0, abs=0.005)


def test_cantilever_of_hex8_locks_in_shear() -> None:
    # A full 2 x 2 x 2 rule bends a cube-shaped element with the parasitic shear of its straight
    # edges: about a third is lost.
    assert tip_deflection_ratio("hex8", STEEL, (20, 1, 1)) < 0.75


@pytest.mark.parametrize(
    ("element", "n"), [("hex8i", (20, 2, 2)), ("hex20", (20, 2, 2)), ("hex27", (20, 2, 2))]
)
def test_nearly_incompressible_cantilever(element: str, n: tuple[int, int, int]) -> None:
    assert tip_deflection_ratio(element, Material(5.0, 0.499), n) == pytest.approx(1.0, abs=0.01)


def thick_cylinder(n: int, n_node: int) -> Mesh:
    """A quarter ring, radii 1 and 2, one element thick."""
    mesh = box_mesh(
        np.linspace(1, 2, n + 1), np.linspace(0, np.pi / 2, 2 * n + 1), [0, 0.1], n_node
    )
    r, theta, z = mesh.points.T
    return mesh.with_points(np.stack([r * np.cos(theta), r * np.sin(theta), z], axis=1))


def bore_displacement_ratio(element: str, nu: float) -> float:
    """Radial displacement of the bore under pressure, plane strain, over Lamé's."""
    material, a, b, p = Material(1e3, nu), 1.0, 2.0, 1.0
    mesh = thick_cylinder(6, nodes_per_hex(element))
    fixed = np.zeros((mesh.n_node, 3), dtype=bool)
    fixed[:, 2] = True
    fixed[mesh.nodes["y0"], 1] = True
    fixed[mesh.nodes["y1"], 0] = True
    radial = mesh.points[:, :2] / np.linalg.norm(mesh.points[:, :2], axis=1)[:, None]
    force = np.zeros((mesh.n_node, 3))
    force[:, :2] = p * traction_weights(mesh.points, mesh.faces["x0"])[:, None] * radial
    u = solve(mesh, material, element, fixed, force)
    bore = mesh.nodes["x0"]
    exact = p * a**2 / (b**2 - a**2) * (1 + nu) / material.E * ((1 - 2 * nu) * a + b**2 / a)
    return float((u[bore, :2] * radial[bore]).sum(axis=1).mean() / exact)


@pytest.mark.parametrize("element", FULL)
def test_thick_cylinder_follows_lame(element: str) -> None:
    assert bore_displacement_ratio(element, 0.3) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("element", "nu"),
    [("hex8i", 0.499), ("hex8i", 0.4999), ("hex20", 0.499), ("hex20r", 0.499), ("hex27", 0.499)],
)
def test_thick_cylinder_near_incompressibility_does_not_lock(element: str, nu: float) -> None:
    assert bore_displacement_ratio(element, nu) == pytest.approx(1.0, abs=0.01)


def test_thick_cylinder_of_hex8_locks_near_incompressibility() -> None:
    assert bore_displacement_ratio("hex8", 0.499) < 0.7
    assert bore_displacement_ratio("hex8", 0.4999) < 0.2


@pytest.mark.parametrize("element", FULL)
@pytest.mark.parametrize("aspect", [1.0, 100.0])
def test_axial_stiffness_of_a_bar_is_EA_over_L(element: str, aspect: float) -> None:
    n, side = 3, 1.0
    length = n * side * aspect
    mesh = box_mesh(np.linspace(0, length, n + 1), [0, side], [0, side], nodes_per_hex(element))
    fixed, force = np.zeros((mesh.n_node, 3), dtype=bool), np.zeros((mesh.n_node, 3))
    for axis, name in enumerate(
        ("x0", "y0", "z0")
    ):  # three symmetry planes leave the lateral strain free
        fixed[mesh.nodes[name], axis] = True
    force[:, 0] = traction_weights(mesh.points, mesh.faces["x1"])
    u = solve(mesh, STEEL, element, fixed, force)
    # Rounding of the factorisation grows with the condition number, about aspect^2.
    np.testing.assert_allclose(u[mesh.nodes["x1"], 0], length / STEEL.E, rtol=1e-13 * aspect**2)
    np.testing.assert_allclose(
        u[mesh.nodes["y1"], 1], -STEEL.nu * side / STEEL.E, rtol=1e-13 * aspect**2
    )


@pytest.mark.parametrize(
    ("element", "n"), [("hex8i", (24, 2, 2)), ("hex20", (12, 1, 1)), ("hex27", (12, 1, 1))]
)
def test_cantilever_frequencies(element: str, n: tuple[int, int, int]) -> None:
    length, side = 30.0, 1.0
    mesh = box_mesh(
        *(np.linspace(0, size, k + 1) for size, k in zip((length, side, side), n, strict=True)),
        nodes_per_hex(element),
    )
    free = np.ones((mesh.n_node, 3), dtype=bool)
    free[mesh.nodes["x0"]] = False
    keep = free.ravel()
    K, M = stiffness(mesh, STEEL, element)[keep][:, keep], mass(mesh, STEEL, element)[keep][:, keep]
    found = np.sqrt(eigsh(K.tocsc(), 2, M.tocsc(), sigma=0.0, return_eigenvectors=False)) / (
        2 * np.pi
    )
    # Euler-Bernoulli, first bending pair of a square section; shear and rotary inertia take 0.1 %
    # at this slenderness.
    exact = (
        1.8751041**2
        / (2 * np.pi)
        * np.sqrt(STEEL.E * side**4 / 12 / (STEEL.rho * side**2 * length**4))
    )
    np.testing.assert_allclose(found, exact, rtol=0.01)
