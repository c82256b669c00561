"""Tributary areas and face mass matrices against exact integrals."""

from __future__ import annotations

import numpy as np
import pytest

from upd.errors import InputError, MeshError
from upd.fem import box_mesh, face_mass, traction_weights
from upd.fem.surface import FACE_NODES

SQUARE = np.column_stack([FACE_NODES, np.full(9, 3.0)])
KINDS = (4, 8, 9)


def skewed_side(n_node: int) -> tuple[np.ndarray, np.ndarray]:
    """The top of a box, sheared and tapered in its plane: area 1.5 * 2 * (1 + 0.1)."""
    mesh = box_mesh([0, 0.7, 1.5], [0, 1.3, 2], [0, 1], n_node)
    points = mesh.points.copy()
    points[:, 0] *= 1 + 0.1 * points[:, 1]
    points[:, 1] += 0.2 * mesh.points[:, 0]
    return points, mesh.faces["z1"]


@pytest.mark.parametrize(
    ("n", "expected"),
    [(4, [1 / 4] * 4), (8, [-1 / 12] * 4 + [1 / 3] * 4), (9, [1 / 36] * 4 + [1 / 9] * 4 + [4 / 9])],
)
def test_weights_of_the_unit_square(n: int, expected: list[float]) -> None:
    np.testing.assert_allclose(
        traction_weights(SQUARE, np.arange(n)[None])[:n], expected, atol=1e-15
    )


@pytest.mark.parametrize("n_node", [8, 20, 27])
def test_weights_integrate_linear_fields_over_a_skewed_side(n_node: int) -> None:
    points, faces = skewed_side(n_node)
    w = traction_weights(points, faces)
    # x = s (1 + t / 10), y = t + s / 5 on 0 < s < 1.5, 0 < t < 2: dA = (1 + t/10 - s/50) ds dt
    s, t = (
        np.polynomial.legendre.leggauss(4)[0] * 0.75 + 0.75,
        np.polynomial.legendre.leggauss(4)[0] + 1.0,
    )
    weight = np.outer(
        np.polynomial.legendre.leggauss(4)[1] * 0.75, np.polynomial.legendre.leggauss(4)[1]
    )
    S, T = np.meshgrid(s, t, indexing="ij")
    dA = weight * (1 + T / 10 - S / 50)
    exact = [dA.sum(), (dA * S * (1 + T / 10)).sum(), (dA * (T + S / 5)).sum(), dA.sum()]
    found = [w.sum(), w @ points[:, 0], w @ points[:, 1], w @ points[:, 2]]
    np.testing.assert_allclose(found, exact, rtol=1e-13)
    assert not w[np.setdiff1d(np.arange(len(points)), faces)].any()


@pytest.mark.parametrize("n_node", [8, 20, 27])
def test_face_mass_has_the_weights_as_row_sums_and_turns_forces_into_pressure(n_node: int) -> None:
    points, faces = skewed_side(n_node)
    A = face_mass(points, faces)
    np.testing.assert_allclose(A.sum(axis=1), traction_weights(points, faces), atol=1e-14)
    assert abs(A - A.T).max() <= 1e-16 * len(points)
    on = np.unique(faces)
    pressure = 1.0 + points[on, 0] - 2.0 * points[on, 1]
    block = A[on][:, on].toarray()
    assert np.linalg.eigvalsh(block).min() > 0.0
    np.testing.assert_allclose(np.linalg.solve(block, block @ pressure), pressure, rtol=1e-11)


def test_face_mass_of_the_unit_square_with_four_nodes() -> None:
    expected = np.array([[4, 2, 1, 2], [2, 4, 2, 1], [1, 2, 4, 2], [2, 1, 2, 4]]) / 36
    np.testing.assert_allclose(
        face_mass(SQUARE[:4], np.arange(4)[None]).toarray(), expected, atol=1e-16
    )


@pytest.mark.parametrize(("n_node", "order"), [(8, 2), (20, 4), (27, 4)])
def test_area_of_a_spherical_patch_converges(n_node: int, order: int) -> None:
    """The part of the unit sphere seen through one side of a cube has area 4 pi / 6."""
    sizes, error = (4, 8, 16), []
    for n in sizes:
        line = np.linspace(-1, 1, n + 1)
        mesh = box_mesh(line, line, [0, 1], n_node)
        on_sphere = mesh.points / np.maximum(np.linalg.norm(mesh.points, axis=1), 1e-3)[:, None]
        error.append(abs(traction_weights(on_sphere, mesh.faces["z1"]).sum() - 4 * np.pi / 6))
    assert -np.polyfit(np.log(sizes), np.log(error), 1)[0] > order - 0.15


@pytest.mark.parametrize("faces", [np.arange(6)[None], np.arange(4), np.array([[0, 1, 2, 9]])])
def test_wrong_faces_are_refused(faces: np.ndarray) -> None:
    with pytest.raises(InputError, match="faces"):
        traction_weights(SQUARE, faces)


def test_a_face_without_area_is_named() -> None:
    with pytest.raises(MeshError, match=r"1 of 2 faces have no area \(first: face 1"):
        face_mass(SQUARE, np.array([[0, 1, 2, 3], [0, 4, 1, 4]]))
