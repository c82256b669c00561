"""The outside of a mesh: its faces, which hexahedron owns one, and which of two bodies is above."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from upd.errors import MeshError, OwnMeshError
from upd.mesh.hexmesh import FACE_SIZE, SIDE_NODES, SIDES, FloatArray, IntArray, Mesh


def boundary_quads(mesh: Mesh) -> IntArray:
    """Corner nodes of the sides that belong to one hexahedron only, (n, 4), seen from outside
    counter-clockwise.
    """
    return boundary_faces(mesh)[:, :4]


def boundary_faces(mesh: Mesh) -> IntArray:
    """All nodes of the sides that belong to one hexahedron only, (n, 4 | 8 | 9).

    The ring first, seen from outside counter-clockwise, then mid-edges, then the centre.
    """
    size = FACE_SIZE[mesh.hexes.shape[1]]
    faces = mesh.hexes[:, SIDE_NODES[:, :size]].reshape(-1, size)
    return np.asarray(faces[_alone(faces[:, :4])], dtype=np.int64)


def _alone(quads: IntArray) -> NDArray[np.bool_]:
    """Which quadrilaterals (n, 4) have their corners to themselves."""
    corners = np.sort(quads, axis=1)
    order = np.lexsort(corners.T)
    same = (corners[order[1:]] == corners[order[:-1]]).all(axis=1)
    alone = np.ones(len(quads), dtype=bool)
    alone[order[1:][same]] = False
    alone[order[:-1][same]] = False
    return alone


def owners(mesh: Mesh, faces: IntArray, place: str) -> IntArray:
    """Hexahedron and side (0 ... 5 for S1 ... S6) of each boundary quadrilateral, (n_face, 2).

    Raises MeshError, which names the `place`, for a face that is no side of a hexahedron.
    """
    corners = np.sort(faces[:, :4], axis=1)
    # only hexahedra with a corner on the faces can own one
    touched = np.zeros(mesh.n_node, dtype=bool)
    touched[corners] = True
    near = np.flatnonzero(np.count_nonzero(touched[mesh.hexes[:, :8]], axis=1) >= 4)
    sides = np.sort(mesh.hexes[near][:, SIDES], axis=2)
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
    reach elsewhere does not count. Raises MeshError unless there are two bodies, one of each kind.
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
        found = "; ".join(
            f"those of {name} look {'up' if z > 0.0 else 'down' if z < 0.0 else 'sideways'}"
            for name, z in height.items()
        )
        raise OwnMeshError(
            f'the faces "contact" do not look at each other along z: {found}; to fix it: move '
            "or turn the bodies, in a mesh file in the program that writes it, until the contact "
            "plane is z = 0, one body above it and the other below; the sets 'contact' hold the "
            "nodes of these two surfaces only"
        )
    return upper, lower
