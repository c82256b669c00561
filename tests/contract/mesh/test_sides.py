"""Where faces look, and which of two bodies lies above the contact."""

from __future__ import annotations

import numpy as np
import pytest

from geometry.blocks import REFERENCE
from upd.errors import MeshError
from upd.mesh import FloatArray, IntArray, Mesh
from upd.mesh.hexmesh import outward_area, upper_and_lower

CUBE = (REFERENCE[:8] + 1.0) / 2.0


def bricks(corners: list[tuple[float, float, float]], contact: IntArray) -> Mesh:
    """Unit cubes at ``corners``; ``contact`` names nodes of the first one."""
    points = np.vstack([CUBE + corner for corner in corners])
    hexes = np.arange(len(points)).reshape(-1, 8)
    return Mesh(points, hexes, {"contact": contact[None, :]}, {"contact": contact})


#: a body below z = 0 with a tower beside the contact, and a small one above
TOWER = bricks(
    [(0.0, 0.0, -1.0), (2.0, 0.0, 0.0), (2.0, 0.0, 1.0), (2.0, 0.0, 2.0)], np.arange(4, 8)
)
SMALL = bricks([(0.0, 0.0, 0.0)], np.arange(4))


@pytest.mark.parametrize("names", [("tower", "small"), ("small", "tower")])
def test_a_higher_node_beside_the_contact_makes_no_upper_body(names: tuple[str, str]) -> None:
    meshes = {"tower": TOWER, "small": SMALL}
    assert TOWER.points[:, 2].max() > SMALL.points[:, 2].max()
    assert upper_and_lower({name: meshes[name] for name in names}) == ("small", "tower")


@pytest.mark.parametrize("turned", [[0, 1, 2, 3], [3, 2, 1, 0]])
def test_a_face_looks_out_of_its_body_whatever_way_round(turned: list[int]) -> None:
    one = bricks([(0.0, 0.0, 0.0)], np.array(turned))
    found: FloatArray = outward_area(one, one.faces["contact"], "one")
    assert found == pytest.approx([0.0, 0.0, -1.0])


def test_two_bodies_on_the_same_side_are_told() -> None:
    with pytest.raises(
        MeshError, match=r"those of b look down; to fix it: move or turn the bodies"
    ):
        upper_and_lower({"a": SMALL, "b": SMALL})
    with pytest.raises(MeshError, match="a contact needs two"):
        upper_and_lower({"a": SMALL})


def test_a_face_inside_the_body_is_told() -> None:
    inner = Mesh(SMALL.points, SMALL.hexes, {"contact": np.array([[0, 1, 6, 7]])})
    with pytest.raises(MeshError, match="b contact: face 0 is no side of a hexahedron"):
        upper_and_lower({"a": TOWER, "b": inner})
