"""Strips of exact width on a lattice of faces, as weights of its nodes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from upd.mesh import FloatArray, IntArray, Mesh

#: nodes of a face on [-1, 1]^2: ring, mid-edges, centre
_PLACES = np.array(
    [(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)], dtype=np.float64
)


def band_weights(
    mesh: Mesh, faces: IntArray, centre: float, width: float
) -> tuple[IntArray, FloatArray]:
    """Nodes of the two strips within half a width of abs(x) = centre, and their weights.

    Parameters
    ----------
    mesh : Mesh
    faces : (n, 4 | 8 | 9) array of int
        As for `strip_weights`.
    centre, width : float
        mm.

    Returns
    -------
    nodes, weights
        As of `strip_weights`.
    """
    low, high = centre - width / 2.0, centre + width / 2.0
    return strip_weights(mesh, faces, [(-high, -low), (low, high)])


def strip_weights(
    mesh: Mesh, faces: IntArray, strips: Iterable[tuple[float, float]]
) -> tuple[IntArray, FloatArray]:
    """Nodes of strips lower <= x <= upper of a plane side, and their weights int phi dA.

    Faces that a strip ends in are integrated up to its edge, so the weights sum to the area of the
    strips, sum(w x) to the integral of x over them, whatever the lattice. Gauss points in the part
    of each face that lies in the strip: exact for shape functions of second order.

    Parameters
    ----------
    mesh : Mesh
    faces : (n, 4 | 8 | 9) array of int
        Rectangles with sides along x, as extrusion along x makes them.
    strips : iterable of (lower, upper)
        mm; where two overlap, both count.

    Returns
    -------
    nodes : (m,) array of int
        Rising; those with a weight.
    weights : (m,) ndarray
        mm2.
    """
    corners = mesh.points[faces[:, :4]]
    weights = np.zeros(mesh.n_node)
    # the ring starts along x in some faces, across it in others
    turned = corners[:, 0, 0] == corners[:, 1, 0]
    start = corners[:, 0, 0]
    length = np.where(turned, corners[:, 3, 0], corners[:, 1, 0]) - start
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]), axis=1
    )
    # a strip that ends on a line of the lattice ends there, whatever the rounding of the line
    rounding = 8.0 * np.finfo(float).eps * np.abs(corners[:, :, 0]).max()
    gauss, share = np.polynomial.legendre.leggauss(3)
    for lower, upper in strips:
        ends = np.sort(2.0 * (np.array([[lower], [upper]]) - start) / length - 1.0, axis=0)
        low, high = np.clip(ends, -1.0, 1.0)
        for face in np.flatnonzero((high - low) * np.abs(length) > 2.0 * rounding):
            half = (high[face] - low[face]) / 2.0
            along, across = np.meshgrid(low[face] + half * (1.0 + gauss), gauss, indexing="ij")
            s, t = (across, along) if turned[face] else (along, across)
            values = _shapes(s.ravel(), t.ravel(), faces.shape[1])
            weights[faces[face]] += (
                area[face] / 4.0 * half * (values @ np.outer(share, share).ravel())
            )
    nodes = np.flatnonzero(weights)
    return nodes, weights[nodes]


def _shapes(s: FloatArray, t: FloatArray, n_node: int) -> FloatArray:
    """Shape functions of a face, (n_node, n_point): bilinear, serendipity, biquadratic."""
    a, b = _PLACES[:n_node, :1], _PLACES[:n_node, 1:]
    linear: FloatArray = (1.0 + a * s) * (1.0 + b * t)
    if n_node == 4:
        return linear / 4.0
    if n_node == 9:
        return _quadratic(a, s) * _quadratic(b, t)
    corner = linear * (a * s + b * t - 1.0) / 4.0
    middle = np.where(a == 0.0, 1.0 - s**2, 1.0 - t**2) * linear / 2.0
    found: FloatArray = np.where(a * b != 0.0, corner, middle)
    return found


def _quadratic(node: FloatArray, s: FloatArray) -> FloatArray:
    """Lagrange's function of a node at -1, 0 or 1."""
    found: FloatArray = np.where(node == 0.0, 1.0 - s**2, s * (s + node) / 2.0)
    return found
