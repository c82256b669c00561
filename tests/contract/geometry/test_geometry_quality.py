"""Scaled Jacobian and edge ratio of hexahedra whose values follow from their angles."""

from __future__ import annotations

import numpy as np
import pytest

from geometry.blocks.hexahedron import REFERENCE, flipped, mirrored
from upd.mesh import FloatArray, Mesh
from upd.mesh.checks import edge_ratio, scaled_jacobian

CUBE = REFERENCE[:8].astype(float)
EPS = np.finfo(float).eps


def one_hex(points: FloatArray) -> Mesh:
    return Mesh(points, np.arange(len(points))[None, :])


def test_brick_has_one() -> None:
    mesh = one_hex(CUBE * [1.0, 2.0, 5.0])
    assert scaled_jacobian(mesh) == pytest.approx([1.0], rel=4 * EPS)
    assert edge_ratio(mesh) == pytest.approx([5.0], rel=4 * EPS)


@pytest.mark.parametrize("angle", [80.0, 45.0, 10.0])
def test_sheared_brick_has_the_sine_of_its_angle(angle: float) -> None:
    t = np.radians(angle)
    sheared = CUBE @ np.array([[1.0, 0.0, 0.0], [np.cos(t), np.sin(t), 0.0], [0.0, 0.0, 1.0]])
    assert scaled_jacobian(one_hex(sheared)) == pytest.approx([np.sin(t)], rel=1e-14)


def test_scale_and_turn_do_not_matter() -> None:
    rng = np.random.default_rng(1)
    bent = CUBE + 0.2 * rng.uniform(-1.0, 1.0, CUBE.shape)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    assert scaled_jacobian(one_hex(1e-4 * bent @ turn + 3.0)) == pytest.approx(
        scaled_jacobian(one_hex(bent)), abs=1e-10
    )


def test_inverted_and_collapsed_elements_are_counted() -> None:
    collapsed = CUBE.copy()
    collapsed[1] = collapsed[0]
    points = np.vstack([CUBE, CUBE * [-1.0, 1.0, 1.0] + 5.0, collapsed + 10.0])
    mesh = Mesh(points, np.arange(24).reshape(3, 8))
    found = scaled_jacobian(mesh)
    assert found.min() == pytest.approx(-1.0)
    assert found.argmin() == 1
    assert (found <= 0.0).sum() == 2
    assert edge_ratio(mesh).max() == np.inf


def test_bent_edge_of_a_second_order_element_counts() -> None:
    points = REFERENCE[:20].astype(float)
    assert scaled_jacobian(one_hex(points)) == pytest.approx([1.0], rel=4 * EPS)
    points[8] += [0.0, 0.5, 0.0]  # middle of the edge 0-1: leaves corner 0 at 45 degrees
    assert scaled_jacobian(one_hex(points)) == pytest.approx([np.sqrt(0.5)], rel=1e-14)


@pytest.mark.parametrize("size", [8, 20, 27])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_mirror_images_keep_det_positive_and_glue(size: int, axis: int) -> None:
    corner: FloatArray = (REFERENCE[:size].astype(float) + 1.0) / 2.0
    mesh = Mesh(
        corner, np.arange(size)[None, :], nodes={"plane_x": np.flatnonzero(corner[:, 0] == 0.0)}
    )
    assert scaled_jacobian(flipped(mesh, axis)).min() == pytest.approx(1.0)
    both = mirrored(mesh, axis)
    on_plane = np.count_nonzero(corner[:, axis] == 0.0)
    assert both.n_node == 2 * size - on_plane
    assert scaled_jacobian(both).min() == pytest.approx(1.0)
    assert ("plane_x" in both.nodes) == (axis != 0)
