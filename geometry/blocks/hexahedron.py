"""Node order of hexahedra, structured blocks of them, and their mirror images. No gmsh here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from upd.errors import MeshError
from upd.mesh import FloatArray, IntArray, Mesh

# VTK order on [-1, 1]^3: 8 corners, 12 edge middles, 6 face centres (-x +x -y +y -z +z), the
# centre.
_CORNERS = (
    (-1, -1, -1),
    (1, -1, -1),
    (1, 1, -1),
    (-1, 1, -1),
    (-1, -1, 1),
    (1, -1, 1),
    (1, 1, 1),
    (-1, 1, 1),
)
_EDGES = (
    (0, 1),
    (1, 2),
    (2, 3),
    (3, 0),
    (4, 5),
    (5, 6),
    (6, 7),
    (7, 4),
    (0, 4),
    (1, 5),
    (2, 6),
    (3, 7),
)
_FACE_CENTRES = ((-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1))
#: corners of the six faces in the order -x +x -y +y -z +z, seen from outside counter-clockwise
_RINGS = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))


def _reference() -> IntArray:
    corners = np.array(_CORNERS)
    middles = [(corners[a] + corners[b]) // 2 for a, b in _EDGES]
    return np.vstack([corners, middles, _FACE_CENTRES, [(0, 0, 0)]]).astype(np.int64)


#: (27, 3) local coordinates of the nodes of a hexahedron in VTK order; the first 8 or 20 rows serve
#: the smaller elements
REFERENCE: IntArray = _reference()


def _local(position: IntArray) -> int:
    return int(np.flatnonzero((position == REFERENCE).all(axis=1))[0])


def _face_nodes() -> IntArray:
    rows = []
    for ring in _RINGS:
        at = REFERENCE[list(ring)]
        middles = [_local((a + b) // 2) for a, b in zip(at, np.roll(at, -1, axis=0), strict=True)]
        rows.append([*ring, *middles, _local(at.sum(axis=0) // 4)])
    return np.array(rows, dtype=np.int64)


#: (6, 9) local node numbers of the faces -x +x -y +y -z +z: outward ring, edge middles, centre
FACE_NODES: IntArray = _face_nodes()

_NODES_PER_FACE = {8: 4, 20: 8, 27: 9}


def local_order(positions: FloatArray) -> IntArray:
    """Permutation p with positions[p] in VTK order.

    Parameters
    ----------
    positions : (8 | 20 | 27, 3) ndarray
        Local node coordinates of another program on [-1, 1]^3.

    Returns
    -------
    (8 | 20 | 27,) array of int

    Raises
    ------
    MeshError
        When the positions are not those of a hexahedron.
    """
    match = np.abs(REFERENCE[: len(positions), None, :] - positions[None, :, :]).max(axis=2)
    order: IntArray = match.argmin(axis=1).astype(np.int64)
    if len(set(order.tolist())) != len(positions) or match.min(axis=1).max() > 0.25:
        raise MeshError(
            f"element with {len(positions)} nodes: local node positions are not those of a "
            "hexahedron; another gmsh version is needed"
        )
    return order


def mirror_order(axis: int, size: int) -> IntArray:
    """Permutation that keeps det J positive when one coordinate changes sign.

    Parameters
    ----------
    axis : {0, 1, 2}
    size : {8, 20, 27}
        Nodes per hexahedron.

    Returns
    -------
    (size,) array of int
    """
    image = REFERENCE[:size].astype(np.float64)
    image[:, axis] *= -1.0
    return local_order(image)


@dataclass(frozen=True)
class Grid:
    """One structured block: node numbers on its lattice.

    Attributes
    ----------
    nodes : (r ni + 1, r nj + 1, r nk + 1) array of int
        r = 1 | 2 is the element order; -1 = no node.
    element_nodes : {8, 20, 27}
    """

    nodes: IntArray
    element_nodes: int

    @property
    def step(self) -> int:
        return 1 if self.element_nodes == 8 else 2

    def hexes(self) -> IntArray:
        """Node numbers of the hexahedra.

        Returns
        -------
        (ni nj nk, element_nodes) array of int
            VTK order, k fastest.
        """
        r = self.step
        offsets = (REFERENCE[: self.element_nodes] + 1) * r // 2
        count = [(n - 1) // r for n in self.nodes.shape]
        at = (
            np.stack(
                np.meshgrid(*[r * np.arange(n) for n in count], indexing="ij"), axis=-1
            ).reshape(-1, 1, 3)
            + offsets
        )
        return self.nodes[at[..., 0], at[..., 1], at[..., 2]]

    def faces(self, axis: int, end: int) -> IntArray:
        """Boundary quadrilaterals of one side.

        Parameters
        ----------
        axis : {0, 1, 2}
        end : {0, 1}
            0 low, 1 high.

        Returns
        -------
        (n, 4 | 8 | 9) array of int
            Outward ring first.
        """
        count = [(n - 1) // self.step for n in self.nodes.shape]
        hexes = np.take(self.hexes().reshape(*count, -1), -end, axis=axis).reshape(
            -1, self.element_nodes
        )
        faces: IntArray = hexes[
            :, FACE_NODES[2 * axis + end, : _NODES_PER_FACE[self.element_nodes]]
        ]
        return faces

    def layer(self, axis: int, end: int) -> IntArray:
        """Node numbers of one side as a two-dimensional lattice; -1 = no node.

        Parameters
        ----------
        axis : {0, 1, 2}
        end : {0, 1}
            0 low, 1 high.

        Returns
        -------
        (n, m) array of int
        """
        side: IntArray = np.take(self.nodes, -end, axis=axis)
        return side


def structured(hexes: IntArray, count: tuple[int, int, int]) -> Grid:
    """Lattice of a transfinite volume from its hexahedra.

    Parameters
    ----------
    hexes : (n, 8 | 20 | 27) array of int
        In VTK order, k fastest.
    count : (3,) tuple of int
        Elements along i, j, k.

    Returns
    -------
    Grid

    Raises
    ------
    MeshError
        When they do not form a lattice.
    """
    size = hexes.shape[1]
    r = 1 if size == 8 else 2
    nodes = np.full([r * n + 1 for n in count], -1, dtype=np.int64)
    offsets = (REFERENCE[:size] + 1) * r // 2
    first = np.stack(
        np.meshgrid(*[r * np.arange(n) for n in count], indexing="ij"), axis=-1
    ).reshape(-1, 1, 3)
    at = first + offsets
    nodes[at[..., 0], at[..., 1], at[..., 2]] = hexes
    grid = Grid(nodes, size)
    # every hexahedron must read back: neighbours share the nodes of their common face
    if not np.array_equal(grid.hexes(), hexes):
        raise MeshError(
            "transfinite volume: the hexahedra do not come in lattice order; install the "
            "pinned gmsh version"
        )
    return grid


def mirrored(mesh: Mesh, axis: int) -> Mesh:
    """Mesh and its mirror image about coordinate `axis` = 0, glued at the nodes of that plane.

    Node sets are united and keep no order; the set plane_x | plane_y of the vanished plane is
    dropped.

    Parameters
    ----------
    mesh : Mesh
        Its nodes on the plane must have exactly 0 there.
    axis : {0, 1, 2}

    Returns
    -------
    Mesh
    """
    twin = np.arange(mesh.n_node)
    off_plane = mesh.points[:, axis] != 0.0
    twin[off_plane] = mesh.n_node + np.arange(np.count_nonzero(off_plane))
    image = mesh.points[off_plane].copy()
    image[:, axis] *= -1.0
    hexes = twin[mesh.hexes][:, mirror_order(axis, mesh.hexes.shape[1])]
    nodes = {name: np.union1d(nodes, twin[nodes]) for name, nodes in mesh.nodes.items()}
    weights = {}  # a node on the plane takes those of both sides
    for name, own in mesh.weights.items():
        both = np.zeros(mesh.n_node + len(image))
        np.add.at(both, mesh.nodes[name], own)
        np.add.at(both, twin[mesh.nodes[name]], own)
        weights[name] = both[nodes[name]]
    dropped = ("plane_x", "plane_y", "plane_z")[axis]
    return Mesh(
        points=np.vstack([mesh.points, image]),
        hexes=np.vstack([mesh.hexes, hexes]),
        faces={
            name: np.vstack([faces, reversed_faces(twin[faces])])
            for name, faces in mesh.faces.items()
        },
        nodes={name: own for name, own in nodes.items() if name != dropped},
        weights={name: own for name, own in weights.items() if name != dropped},
    )


def flipped(mesh: Mesh, axis: int) -> Mesh:
    """The mirror image itself.

    Coordinate `axis` changes sign, det J stays positive, sets keep their order.

    Parameters
    ----------
    mesh : Mesh
    axis : {0, 1, 2}

    Returns
    -------
    Mesh
    """
    points = mesh.points.copy()
    points[:, axis] = 0.0 - points[:, axis]
    return Mesh(
        points=points,
        hexes=mesh.hexes[:, mirror_order(axis, mesh.hexes.shape[1])],
        faces={name: reversed_faces(faces) for name, faces in mesh.faces.items()},
        nodes=dict(mesh.nodes),
        weights=dict(mesh.weights),
    )


def reversed_faces(faces: IntArray) -> IntArray:
    """The same quadrilaterals, (n, 4 | 8 | 9), seen from the other side."""
    return faces[:, [0, 3, 2, 1, 7, 6, 5, 4, 8][: faces.shape[1]]]


def compacted(points: FloatArray, grids: Iterable[Grid]) -> tuple[FloatArray, list[Grid]]:
    """Points that the grids use, numbered without holes, and the grids in these numbers.

    Parameters
    ----------
    points : (n, 3) ndarray
    grids : iterable of Grid

    Returns
    -------
    points : (m, 3) ndarray
    grids : list of Grid
    """
    grids = list(grids)
    used = np.unique(np.concatenate([grid.nodes[grid.nodes >= 0] for grid in grids]))
    number = np.full(len(points) + 1, -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    return points[used], [
        Grid(np.where(grid.nodes >= 0, number[grid.nodes], -1), grid.element_nodes)
        for grid in grids
    ]
