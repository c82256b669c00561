"""Patch test: a linear displacement field, that is constant stress, is met exactly on any mesh."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import splu

from upd.fem import ELEMENTS, Material, box_mesh, stiffness, traction_weights
from upd.mesh import Mesh
from upd.mesh.hexmesh import EDGES

MATERIAL = Material(70e3, 0.33)
GRADIENT = 1e-3 * np.array([[1.0, 0.4, -0.3], [0.2, -0.7, 0.5], [0.1, 0.6, 0.9]])


def macneal_harder() -> Mesh:
    """The seven-hexahedra cube of R. H. MacNeal and R. L. Harder, Finite Elements Anal.

    Des. 1 (1985) 3, figure 1.
    """
    corners = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
        dtype=float,
    )
    inner = [
        [0.249, 0.342, 0.192],
        [0.826, 0.288, 0.288],
        [0.850, 0.649, 0.263],
        [0.273, 0.750, 0.230],
    ]
    inner += [
        [0.320, 0.186, 0.643],
        [0.677, 0.305, 0.683],
        [0.788, 0.693, 0.644],
        [0.165, 0.745, 0.702],
    ]
    i, o = np.arange(8, 16), np.arange(8)
    shells = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (3, 2, 6, 7), (0, 3, 7, 4), (1, 5, 6, 2)]
    hexes = [i, *(np.concatenate([o[list(face)], i[list(face)]]) for face in shells)]
    return Mesh(np.vstack([corners, inner]), np.array(hexes))


def perturbed(element: str) -> Mesh:
    """A 3 x 3 x 3 cube whose inner nodes are moved at random, mid-nodes too, or with straight edges
    for hex20r: 2 x 2 x 2 points integrate the gradients of curved ones with an error.
    """
    n_node = int(element[3:].rstrip("ir"))
    mesh = box_mesh(*[np.linspace(0, 1, 4)] * 3, n_node)
    inside = ((mesh.points > 0) & (mesh.points < 1)).all(axis=1)
    size = 0.08 if n_node == 8 else 0.03
    shift = np.random.default_rng(3).uniform(-size, size, mesh.points.shape) * inside[:, None]
    points = mesh.points + shift
    if element == "hex20r":
        middle = mesh.hexes[:, 8:]
        points[middle] = points[mesh.hexes[:, EDGES]].mean(axis=2)
    return mesh.with_points(points)


def patch_error(mesh: Mesh, element: str) -> float:
    """Largest error of the inner nodes when the outer ones follow the linear field, relative to the
    field.
    """
    exact = (mesh.points @ GRADIENT.T).ravel()
    inner = np.repeat(((mesh.points > 0) & (mesh.points < 1)).all(axis=1), 3)
    assert inner.any()
    K = stiffness(mesh, MATERIAL, element)
    u = splu(K[inner][:, inner].tocsc()).solve(-K[inner][:, ~inner] @ exact[~inner])
    return float(np.abs(u - exact[inner]).max() / np.abs(exact).max())


@pytest.mark.parametrize("element", ["hex8", "hex8i"])
def test_macneal_harder_patch(element: str) -> None:
    assert patch_error(macneal_harder(), element) < 1e-12


@pytest.mark.parametrize("element", ELEMENTS)
def test_patch_of_randomly_moved_nodes(element: str) -> None:
    assert patch_error(perturbed(element), element) < 1e-12


@pytest.mark.parametrize("element", ELEMENTS)
def test_constant_stress_gives_the_nodal_forces_of_its_traction(element: str) -> None:
    mesh = perturbed(element)
    strain = (GRADIENT + GRADIENT.T) / 2
    stress = 2 * MATERIAL.mu * strain + MATERIAL.lam * np.trace(strain) * np.eye(3)
    force = (stiffness(mesh, MATERIAL, element) @ (mesh.points @ GRADIENT.T).ravel()).reshape(-1, 3)
    expected = np.zeros_like(force)
    for axis in range(3):
        for side in (0, 1):
            weights = traction_weights(mesh.points, mesh.faces[f"{'xyz'[axis]}{side}"])
            expected += np.outer(weights, (2 * side - 1) * stress[:, axis])
    assert np.abs(force - expected).max() <= 1e-12 * np.abs(stress).max()
