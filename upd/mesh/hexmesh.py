"""The mesh of one body: points, hexahedra, named faces and node sets; its outside, which hexahedron
owns a face, and which of two bodies is above.

Immutable; no gmsh, no scikit-fem.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.errors import MeshError, OwnMeshError

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]

#: nodes per hexahedron -> nodes per face
FACE_SIZE = {8: 4, 20: 8, 27: 9}
#: corners of the sides of a hexahedron, seen from outside counter-clockwise; the order is that of
#: S1 ... S6 (Abaqus Analysis User's Guide, "Three-dimensional solid element library")
SIDES = np.array(
    [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
)
#: corners of its edges, in the order of the mid-edge nodes 8, 9 ...
EDGES = np.array(
    [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
)
#: corners of an edge -> its mid-edge node
MIDDLES = {frozenset(map(int, edge)): 8 + k for k, edge in enumerate(EDGES)}
#: centres of the sides
CENTRES = (24, 25, 22, 21, 23, 20)
#: corners of the sides, their mid-edge nodes and centres
SIDE_NODES = np.array(
    [
        [*ring, *(MIDDLES[frozenset((ring[k - 1], ring[k]))] for k in (1, 2, 3, 0)), centre]
        for ring, centre in zip(SIDES.tolist(), CENTRES, strict=True)
    ]
)


@dataclass(frozen=True)
class Mesh:
    """Hexahedral mesh of one body (or of several glued ones).

    Attributes
    ----------
    points
        (n_node, 3) coordinates in mm.
    hexes
        (n_hex, 8 | 20 | 27) node numbers in VTK order (8: bottom ring, top ring; then
        mid-edges; then face centres and the centre).
    faces
        Name -> (n_face, 4 | 8 | 9) node numbers of boundary quadrilaterals, ring first, then
        mid-edges, then the centre.
    nodes
        Name -> ordered node numbers. Bodies that touch have a set of the same name whose k-th
        nodes face each other.
    weights
        Name of a node set -> (n,) weights of its nodes, in its order: the integrals of their shape
        functions over a surface, mm2. What a set with weights holds, it holds in the weighted mean
        and loads evenly, wherever the surface ends in the elements; a set without, node by node.
    """

    points: FloatArray
    hexes: IntArray
    faces: Mapping[str, IntArray] = field(default_factory=dict)
    nodes: Mapping[str, IntArray] = field(default_factory=dict)
    weights: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def n_node(self) -> int:
        return len(self.points)

    @property
    def n_hex(self) -> int:
        return len(self.hexes)

    @property
    def order(self) -> int:
        """Polynomial order of the geometry: 1 for 8-node, 2 for 20- and 27-node hexahedra."""
        return 1 if self.hexes.shape[1] == 8 else 2

    def with_points(self, points: FloatArray) -> Mesh:
        """The same mesh with other coordinates, (n_node, 3) in mm."""
        return replace(self, points=points)


class NamedElements(NamedTuple):
    """Elements of one kind under one name of a mesh file.

    Attributes
    ----------
    name
        "" for elements with a volume that have none.
    dimension
        3 for elements with a volume; of others the nodes are a set.
    kind
        "Hexahedron", or the file's word for another element.
    nodes
        Node numbers; of hexahedra (n_element, 8 | 20 | 27) in VTK order.
    """

    name: str
    dimension: int
    kind: str
    nodes: IntArray


# -- the outside -----------------------------------------------------------------------------------


def boundary_faces(mesh: Mesh) -> IntArray:
    """Nodes of the sides that belong to one hexahedron only, (n, 4 | 8 | 9).

    The ring first, seen from outside counter-clockwise, then mid-edges, then the centre.
    """
    size = FACE_SIZE[mesh.hexes.shape[1]]
    faces = mesh.hexes[:, SIDE_NODES[:, :size]]
    return np.asarray(faces[free_sides(mesh)], dtype=np.int64)


def free_sides(mesh: Mesh) -> NDArray[np.bool_]:
    """Which sides S1 ... S6 of each hexahedron belong to no other, (n_hex, 6)."""
    corners = np.sort(mesh.hexes[:, SIDES].reshape(-1, 4), axis=1)
    order = np.lexsort(corners.T)
    same = (corners[order[1:]] == corners[order[:-1]]).all(axis=1)
    alone = np.ones(len(corners), dtype=bool)
    alone[order[1:][same]] = False
    alone[order[:-1][same]] = False
    return alone.reshape(-1, 6)


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
