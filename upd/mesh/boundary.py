"""The outside of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
    return np.asarray(quads[_alone(quads)], dtype=np.int64)


# mid-edge nodes of a hexahedron between two corners, and centres of its sides (VTK's order)
_EDGES = {
    **{frozenset((k, (k + 1) % 4)): 8 + k for k in range(4)},
    **{frozenset((4 + k, 4 + (k + 1) % 4)): 12 + k for k in range(4)},
    **{frozenset((k, 4 + k)): 16 + k for k in range(4)},
}
_CENTRES = dict(
    zip(
        map(
            frozenset,
            ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 1, 2, 3), (4, 5, 6, 7)),
        ),
        range(20, 26),
        strict=True,
    )
)


def boundary_faces(mesh: Mesh) -> IntArray:
    """All nodes of the sides that belong to one hexahedron only, (n, 4 | 8 | 9).

    The ring first, seen from outside counter-clockwise, then mid-edges, then the centre.
    """
    size = mesh.hexes.shape[1]
    table = []
    for ring in _SIDES.tolist():
        row = list(ring)
        if size > 8:
            row += [_EDGES[frozenset((ring[k], ring[(k + 1) % 4]))] for k in range(4)]
        if size > 20:
            row.append(_CENTRES[frozenset(ring)])
        table.append(row)
    faces = mesh.hexes[:, np.array(table)].reshape(-1, len(table[0]))
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
