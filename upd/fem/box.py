"""Structured mesh of a box, for checks and benchmarks.

Numbered on its own lattice: `skfem.MeshHex.init_tensor` serves 8 nodes only, and `skfem.MeshHex2`
numbers middle nodes after corners and takes ten times as long (27 000 hexahedra: 1.0 s).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError
from upd.fem.elements import VTK_NODES, match_nodes
from upd.fem.surface import FACE_NODES
from upd.mesh import FACE_SIZE, FloatArray, IntArray, Mesh


def box_mesh(x: ArrayLike, y: ArrayLike, z: ArrayLike, n_node: int = 8) -> Mesh:
    """Mesh of a box: hexahedra between planes across x, y and z.

    Parameters
    ----------
    x, y, z : (n,) array_like
        Positions of the planes in mm, increasing.
    n_node : {8, 20, 27}, default 8
        Nodes per hexahedron.

    Returns
    -------
    Mesh
        Nodes numbered with z fastest and x slowest. Faces and node sets of the six sides are named
        x0, x1, y0, y1, z0, z1 (0 the low side); faces turn outwards.

    Raises
    ------
    InputError
        For another `n_node`, or planes that do not increase.

    Examples
    --------
    >>> from upd.fem import box_mesh
    >>> mesh = box_mesh([0, 1, 2], [0, 1], [0, 1])
    >>> mesh.n_node, mesh.n_hex
    (12, 2)
    >>> mesh.nodes["x0"].tolist()
    [0, 1, 2, 3]
    >>> mesh.faces["z1"].tolist()
    [[1, 5, 7, 3], [5, 9, 11, 7]]
    """
    lines = [np.asarray(line, dtype=np.float64) for line in (x, y, z)]
    if n_node not in FACE_SIZE:
        raise InputError(f"a hexahedron has 8, 20 or 27 nodes, not {n_node}.")
    if any(line.ndim != 1 or len(line) < 2 or not (np.diff(line) > 0).all() for line in lines):
        raise InputError("box_mesh needs at least two increasing planes in each direction.")
    steps = 1 if n_node == 8 else 2
    if steps == 2:
        lines = [np.insert(x, np.arange(1, len(x)), (x[1:] + x[:-1]) / 2.0) for x in lines]
    nx, ny, nz = (len(line) for line in lines)
    first = (
        np.arange(nx * ny * nz)
        .reshape(nx, ny, nz)[:-steps:steps, :-steps:steps, :-steps:steps]
        .ravel()
    )
    offsets = np.rint(steps * VTK_NODES[:n_node]).astype(np.int64) @ np.array([ny * nz, nz, 1])
    hexes: IntArray = first[:, None] + offsets
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    used, hexes = np.unique(hexes, return_inverse=True)
    points, hexes = points[used], hexes.reshape(-1, n_node)
    faces = {
        f"{'xyz'[axis]}{side}": _side(points, hexes, axis, side)
        for axis in range(3)
        for side in (0, 1)
    }
    return Mesh(points, hexes, faces, {name: np.unique(face) for name, face in faces.items()})


def _side(points: FloatArray, hexes: IntArray, axis: int, side: int) -> IntArray:
    """Faces on the low (0) or high (1) side along an axis, normals outwards."""
    n_node = hexes.shape[1]
    on_cube = np.full((FACE_SIZE[n_node], 3), float(side))
    across = [(axis + 1) % 3, (axis + 2) % 3]
    on_cube[:, across if side else across[::-1]] = FACE_NODES[: len(on_cube)]
    faces: IntArray = hexes[:, match_nodes(on_cube, VTK_NODES[:n_node])]
    value = points[:, axis].max() if side else points[:, axis].min()
    on_side: IntArray = faces[(points[faces, axis] == value).all(axis=1)]
    return on_side
