"""Shape of hexahedra: scaled Jacobian and edge ratio."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from upd.mesh import FloatArray, Mesh
from upd.mesh.hexmesh import EDGES, MIDDLES

# corner -> its neighbours along the three edges, right-handed (Verdict, hex scaled Jacobian)
_NEIGHBOURS = np.array(
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]]
)
# middle node between each corner and its three neighbours
_MIDDLES = np.array(
    [[MIDDLES[frozenset((k, other))] for other in r] for k, r in enumerate(_NEIGHBOURS.tolist())]
)
# opposite faces, for the axes through the centre
_FACES = (((1, 2, 6, 5), (0, 3, 7, 4)), ((2, 3, 7, 6), (1, 0, 4, 5)), ((4, 5, 6, 7), (0, 1, 2, 3)))


@dataclass(frozen=True)
class Quality:
    """Shape of a mesh's hexahedra.

    Attributes
    ----------
    min, mean
        Scaled Jacobian; 1 for a brick, <= 0 for an inverted element.
    worst
        Number of the element with the smallest one.
    n_negative
        Elements with a scaled Jacobian <= 0.
    aspect
        Largest ratio of longest to shortest edge in one element.
    longest
        Number of the element with that ratio.
    """

    min: float
    mean: float
    worst: int
    n_negative: int
    aspect: float
    longest: int


def _determinant(axes: FloatArray) -> FloatArray:
    """Determinant of (..., 3, 3) unit row vectors; 0 where a row has no length."""
    length = np.linalg.norm(axes, axis=-1, keepdims=True)
    unit = np.divide(axes, length, out=np.zeros_like(axes), where=length > 0.0)
    determinant: FloatArray = np.einsum(
        "...i,...i->...", unit[..., 0, :], np.cross(unit[..., 1, :], unit[..., 2, :])
    )
    return determinant


def scaled_jacobian(mesh: Mesh) -> FloatArray:
    """Scaled Jacobian of every hexahedron, (n_hex,).

    Least determinant of the unit edge vectors over the 8 corners and of the unit principal axes at
    the centre (Verdict Library Reference Manual, SAND2007-1751, 6.16). Edges of 20- and 27-node
    elements are taken where they leave the corner, so that a bent edge counts.
    """
    corner = mesh.points[mesh.hexes[:, :8]]
    edges = corner[:, _NEIGHBOURS] - corner[:, :, None, :]
    if mesh.order == 2:
        # tangent of the quadratic edge at the corner a: 4 x_middle - x_b - 3 x_a
        edges = 4.0 * (mesh.points[mesh.hexes[:, _MIDDLES]] - corner[:, :, None, :]) - edges
    centre = np.stack(
        [corner[:, high].sum(axis=1) - corner[:, low].sum(axis=1) for high, low in _FACES], axis=1
    )
    least: FloatArray = np.minimum(_determinant(edges).min(axis=1), _determinant(centre))
    return least


def edge_ratio(mesh: Mesh) -> FloatArray:
    """Longest over shortest edge (between corners) of every hexahedron, (n_hex,)."""
    corner = mesh.points[mesh.hexes[:, :8]]
    length = np.linalg.norm(corner[:, EDGES[:, 1]] - corner[:, EDGES[:, 0]], axis=2)
    shortest = length.min(axis=1)
    ratio: FloatArray = np.divide(
        length.max(axis=1), shortest, out=np.full(len(length), np.inf), where=shortest > 0.0
    )
    return ratio


def quality(mesh: Mesh) -> Quality:
    """Least and mean scaled Jacobian, the worst element, how many are inverted, and the largest
    edge ratio.
    """
    jacobian, ratio = scaled_jacobian(mesh), edge_ratio(mesh)
    worst, longest = int(jacobian.argmin()), int(ratio.argmax())
    return Quality(
        min=float(jacobian[worst]),
        mean=float(jacobian.mean()),
        worst=worst,
        n_negative=int(np.count_nonzero(jacobian <= 0.0)),
        aspect=float(ratio[longest]),
        longest=longest,
    )


def centre_of(mesh: Mesh, element: int) -> FloatArray:
    """Mean of the corners of one hexahedron, (3,) in mm."""
    centre: FloatArray = mesh.points[mesh.hexes[element, :8]].mean(axis=0)
    return centre
