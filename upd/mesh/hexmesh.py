"""The mesh of one body: points, hexahedra, named faces and node sets.

Immutable; no gmsh, no scikit-fem.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
