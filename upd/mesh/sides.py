"""Which hexahedron owns a boundary face, where faces look, and which of two bodies lies above."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from upd.errors import MeshError, OwnMeshError
from upd.mesh import FloatArray, IntArray, Mesh

# corners of the faces S1 ... S6 (Abaqus Analysis User's Guide, "Three-dimensional solid element
# library")
_SIDES = np.array(
    [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
)


def owners(mesh: Mesh, faces: IntArray, place: str) -> IntArray:
    """Hexahedron and side (0 ... 5 for S1 ... S6) of each boundary quadrilateral, (n_face, 2).

    Raises MeshError, which names the `place`, for a face that is no side of a hexahedron.
    """
    corners = np.sort(faces[:, :4], axis=1)
    # only hexahedra with a corner on the faces can own one
    touched = np.zeros(mesh.n_node, dtype=bool)
    touched[corners] = True
    near = np.flatnonzero(np.count_nonzero(touched[mesh.hexes[:, :8]], axis=1) >= 4)
    sides = np.sort(mesh.hexes[near][:, _SIDES], axis=2)
    owner = {
        tuple(side): (int(near[h]), s)
        for h, row in enumerate(sides.tolist())
        for s, side in enumerate(row)
    }
    found = [owner.get(tuple(face)) for face in corners.tolist()]
    if None in found:
        raise MeshError(
            f"{place}: face {found.index(None)} is no side of a hexahedron; the recipe "
            "must name boundary faces"
        )
    return np.array(found, dtype=np.int64)


def outward_area(mesh: Mesh, faces: IntArray, place: str) -> FloatArray:
    """Sum of the faces' area vectors, (3,) in mm2, out of the body whatever way round they are.

    A face is half the cross product of its diagonals, turned away from the hexahedron that owns it.
    Raises MeshError as `owners` does.
    """
    a, b, c, d = (mesh.points[faces[:, k]] for k in range(4))
    area = np.cross(c - a, d - b) / 2.0
    inside = mesh.points[mesh.hexes[owners(mesh, faces, place)[:, 0], :8]].mean(axis=1)
    outwards = np.einsum("fi,fi->f", area, (a + b + c + d) / 4.0 - inside) > 0.0
    total: FloatArray = np.where(outwards[:, None], area, -area).sum(axis=0)
    return total


def upper_and_lower(meshes: Mapping[str, Mesh]) -> tuple[str, str]:
    """Names of the body above and of the one below the contact plane z = 0.

    The faces "contact" of the upper body look down, those of the lower one up; how high the bodies
    reach elsewhere says nothing. Raises MeshError unless there are two bodies and one of each kind.
    """
    if len(meshes) != 2:
        raise OwnMeshError(
            f"the mesh has the bodies {', '.join(meshes) or 'none'}; a contact needs two; to fix "
            "it: make two, in a mesh file a named volume each (ELSET= in .inp, a physical volume "
            "in gmsh)"
        )
    height = {
        name: float(outward_area(mesh, mesh.faces["contact"], f"{name} contact")[2])
        for name, mesh in meshes.items()
    }
    lower, upper = sorted(height, key=lambda name: -height[name])
    if not height[upper] < 0.0 < height[lower]:
        told = "; ".join(
            f"those of {name} look {'up' if z > 0.0 else 'down' if z < 0.0 else 'sideways'}"
            for name, z in height.items()
        )
        raise OwnMeshError(
            f'the faces "contact" do not look at each other along z: {told}; to fix it: move '
            "or turn the bodies, in a mesh file in the program that writes it, until the contact "
            "plane is z = 0, one body above it and the other below; the sets 'contact' hold the "
            "nodes of these two surfaces only"
        )
    return upper, lower
