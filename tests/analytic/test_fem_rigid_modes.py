"""Rigid-body modes."""

from __future__ import annotations

import numpy as np
import pytest

from upd.errors import InputError
from upd.fem import ELEMENTS, Material, box_mesh, rigid_body_modes, stiffness

STEEL = Material(200e3, 0.3)
#: those that may stand in one row
FULL = tuple(name for name in ELEMENTS if name != "hex20r")


@pytest.mark.parametrize("element", FULL)
def test_rigid_body_modes_are_orthonormal_and_free_of_energy(element: str) -> None:
    mesh = box_mesh([5, 6, 7.5], [-2, 0], [100, 103], int(element[3:].rstrip("i")))
    modes = rigid_body_modes(mesh.points)
    assert modes.shape == (3 * mesh.n_node, 6)
    np.testing.assert_allclose(modes.T @ modes, np.eye(6), atol=1e-14)
    K = stiffness(mesh, STEEL, element)
    assert np.abs(K @ modes).max() <= 1e-12 * abs(K).max()


@pytest.mark.parametrize(
    "points", [np.zeros((4, 3)), np.outer(np.arange(5.0), [1.0, 2.0, 3.0]), np.eye(3)[:2]]
)
def test_points_on_a_line_have_no_six_modes(points: np.ndarray) -> None:
    with pytest.raises(InputError, match="on one line"):
        rigid_body_modes(points)
