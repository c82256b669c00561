"""Integrals of shape functions over the quadrilateral faces of a mesh.

Shape functions are scikit-fem's. Its `FacetBasis` is not used: it wants the hexahedra behind the
faces, inverts their mapping by Newton steps (1600 faces of 4 nodes: 138 ms and 1e-14 off, against
3.5 ms here; of 9 nodes: 2.2 s and 1e-13, against 18 ms), and has no mesh of 20-node hexahedra.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.sparse import coo_array, csr_array
from skfem import ElementQuad1, ElementQuad2, ElementQuadS2

from upd.errors import InputError, MeshError
from upd.fem.elements import gauss, match_nodes
from upd.mesh import FloatArray, IntArray

#: face nodes on the unit square: ring, mid-edges, centre
FACE_NODES: FloatArray = (
    np.array([(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]) / 2.0
)


#: nodes of a face -> its element in scikit-fem, and Gauss points in each direction
_KINDS = {4: (ElementQuad1, 2), 8: (ElementQuadS2, 3), 9: (ElementQuad2, 3)}


@cache
def _tables(n_node: int, n_gauss: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Shape functions of one kind of face, in our node order, at the quadrature points of the unit
    square.

    Returns
    -------
    values : (n_node, n_quad) ndarray
    gradients : (n_node, 2, n_quad) ndarray
    weights : (n_quad,) ndarray
    """
    X, weights = gauss(n_gauss, 2)
    element = _KINDS[n_node][0]()
    local = match_nodes(FACE_NODES[:n_node], np.asarray(element.doflocs))
    pairs = [element.lbasis(X, int(a)) for a in local]
    return (
        np.stack([phi for phi, _ in pairs]),
        np.stack([gradient for _, gradient in pairs]),
        weights,
    )


def traction_weights(points: FloatArray, faces: IntArray) -> FloatArray:
    """Tributary areas int phi_a dA: the nodal forces of a unit traction over the faces.

    They sum to the area. Corners of 8-node faces have negative weights (-1/12 of a flat square), so
    divide nodal forces by these weights only on 4-node faces; otherwise solve with `face_mass`.

    Parameters
    ----------
    points : (n_node, 3) ndarray
        mm.
    faces : (n_face, 4 | 8 | 9) array of int
        Node numbers of quadrilaterals: ring, then mid-edges, then the centre.

    Returns
    -------
    (n_node,) ndarray
        mm2; zero off the faces.

    Raises
    ------
    InputError
        For faces that are not quadrilaterals of this mesh.
    MeshError
        For a face without area.
    """
    values, dA = _areas(points, faces)
    weights = np.zeros(len(points))
    np.add.at(weights, np.ravel(faces), (dA @ values.T).ravel())
    return weights


def face_mass(points: FloatArray, faces: IntArray) -> csr_array:
    """Face mass matrix int phi_a phi_b dA, symmetric.

    Solving face_mass p = f on the faces' nodes turns normal nodal forces f into the pressure p.

    Parameters
    ----------
    points, faces
        As for `traction_weights`.

    Returns
    -------
    (n_node, n_node) csr_array
        mm2; rows of nodes off the faces are empty.

    Raises
    ------
    InputError, MeshError
        As for `traction_weights`.
    """
    values, dA = _areas(points, faces)
    n = values.shape[0]
    entries = dA @ (values[:, None, :] * values[None, :, :]).reshape(n * n, -1).T
    rows, columns = np.repeat(faces, n, axis=1).ravel(), np.tile(faces, (1, n)).ravel()
    return csr_array(
        coo_array((entries.ravel(), (rows, columns)), shape=(len(points), len(points)))
    )


def face_moments(
    points: FloatArray, faces: IntArray, functions: Callable[[FloatArray], FloatArray], degree: int
) -> FloatArray:
    """Integrals int g_i phi_a dA of functions over faces.

    Parameters
    ----------
    points, faces
        As for `traction_weights`.
    functions : callable
        Points (..., 3) -> values (m, ...).
    degree : int
        Of the functions in each direction of a face; those of parallelograms are integrated
        exactly.

    Returns
    -------
    (m, n_node) ndarray
        mm2 times the functions.

    Raises
    ------
    InputError, MeshError
        As for `traction_weights`.
    """
    order = _checked(points, faces).shape[1]
    # n points integrate degree 2 n - 1; shape functions have degree 1 or 2, the area element none
    n_gauss = (degree + (1 if order == 4 else 2)) // 2 + 1
    values, dA = _areas(points, faces, n_gauss)
    at = np.einsum("aq,fad->fqd", values, points[faces])
    parts = np.einsum("mfq,fq,aq->mfa", functions(at), dA, values)
    out = np.zeros((len(parts), len(points)))
    for k, part in enumerate(parts):
        np.add.at(out[k], faces, part)
    return out


def _checked(points: FloatArray, faces: IntArray) -> IntArray:
    faces = np.asarray(faces)
    if faces.ndim != 2 or faces.shape[1] not in _KINDS:
        raise InputError(
            f"faces has shape {faces.shape}: give (n_face, 4 | 8 | 9) node numbers, ring "
            "first, then mid-edges, then the centre."
        )
    if faces.size and not 0 <= faces.min() <= faces.max() < len(points):
        raise InputError(
            f"faces names nodes {faces.min()} to {faces.max()}, the mesh has 0 to "
            f"{len(points) - 1}: take both from one mesh."
        )
    return faces


def _areas(
    points: FloatArray, faces: IntArray, n_gauss: int | None = None
) -> tuple[FloatArray, FloatArray]:
    """Shape function values (n_node, n_quad) and area elements (n_face, n_quad)."""
    faces = _checked(points, faces)
    n_node = faces.shape[1]
    values, gradients, weights = _tables(n_node, n_gauss or _KINDS[n_node][1])
    tangents = np.einsum("fai,ajq->jfqi", points[faces], gradients)
    dA = np.linalg.norm(np.cross(tangents[0], tangents[1]), axis=2) * weights
    flat = np.flatnonzero(
        dA.sum(axis=1) <= np.finfo(float).eps * np.einsum("jfqi,jfqi->f", tangents, tangents)
    )
    if flat.size:
        raise MeshError(
            f"{flat.size} of {len(faces)} faces have no area (first: face {flat[0]}, nodes "
            f"{faces[flat[0]].tolist()}): "
            "list the corners around the ring and keep the nodes apart."
        )
    return values, dA
