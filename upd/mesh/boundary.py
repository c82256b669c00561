"""The outside of a mesh."""

from __future__ import annotations

import numpy as np

from upd.mesh.hexmesh import IntArray, Mesh

#: corners of the sides of a hexahedron, seen from outside counter-clockwise
_SIDES = np.array(
    [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
)


def boundary_quads(mesh: Mesh) -> IntArray:
    """Corner nodes of the sides that belong to one hexahedron only, (n, 4), seen from outside
    counter-clockwise.
    """
    quads = mesh.hexes[:, _SIDES].reshape(-1, 4)
    corners = np.sort(quads, axis=1)
    order = np.lexsort(corners.T)
    same = (corners[order[1:]] == corners[order[:-1]]).all(axis=1)
    alone = np.ones(len(quads), dtype=bool)
    alone[order[1:][same]] = False
    alone[order[:-1][same]] = False
    return np.asarray(quads[alone], dtype=np.int64)
