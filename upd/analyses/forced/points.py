"""Contact points on a blade's patch: lattice nodes by row and column, means over groups of them, or
any points by shape functions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from skfem import ElementQuad1, ElementQuad2, ElementQuadS2

from upd.analyses.seated.lattice import lattice, patch_frame
from upd.errors import InputError
from upd.fem.elements import match_nodes
from upd.fem.surface import FACE_NODES
from upd.mesh import FloatArray, IntArray, Mesh

_FAMILIES = {4: ElementQuad1, 8: ElementQuadS2, 9: ElementQuad2}
#: Newton steps to find a point in a face, which is nearly a parallelogram
_MOST_STEPS = 20


@dataclass(frozen=True)
class FacePoints:
    """Contact points of one blade's patch.

    Attributes
    ----------
    position
        (m, 3) mm.
    frame
        (3, 3) unit rows: normal from damper into blade, along the damper, up the slope.
    weight
        (m,) share of the face's stiffness, sum 1.
    nodes
        (k,) of the mesh that carry the points.
    values
        (m, k) of their shape functions.
    line
        (m, 2) row and column of points on the lattice, or of Gauss points, -1 for others.
    per_part
        Gauss points along the damper in each part of the face: part k has columns
        k per_part ... (k + 1) per_part - 1; 0 for points of another rule.
    """

    position: FloatArray
    frame: FloatArray
    weight: FloatArray
    nodes: IntArray
    values: FloatArray
    line: IntArray
    per_part: int = 0

    @property
    def n_point(self) -> int:
        """m."""
        return len(self.position)

    @property
    def at_nodes(self) -> bool:
        """Whether every point is a node."""
        return len(self.nodes) == self.n_point and np.array_equal(self.values, np.eye(self.n_point))


def line_groups(choice: Any, count: int, where: str) -> FloatArray:
    """Share of each lattice line in each line of points.

    A line on the border of two groups belongs half to each.

    Parameters
    ----------
    choice
        "all", a list of lines, or a number of groups of neighbouring lines.
    count
        Lattice lines there are.
    where
        Beginning of the message of an error.

    Returns
    -------
    FloatArray
        (n_group, count).

    Raises
    ------
    InputError
        When the lattice has fewer lines.
    """
    lines = np.eye(count)
    if choice == "all":
        return lines
    wanted = [int(v) for v in choice] if isinstance(choice, (tuple, list)) else []
    if (not wanted and choice > count) or (wanted and max(wanted) >= count):
        raise InputError(
            f"{where}: {choice!r} asks for more than the {count} lattice lines there are, "
            f"numbers 0 to {count - 1}"
        )
    if wanted:
        return lines[wanted]
    n, share = int(choice), np.zeros((int(choice), count))
    for line in range(count):
        # in whole numbers: group k holds k / n <= line / (count - 1) <= (k + 1) / n
        place, rest = divmod(line * n, count - 1) if count > 1 else (0, 1)
        on = (
            {min(place, n - 1), max(place - 1, 0)}
            if rest == 0 and 0 < place < n
            else {min(place, n - 1)}
        )
        share[list(on), line] = 1.0 / len(on)
    return share


def lattice_points(
    mesh: Mesh, rows: Any, columns: Any, side: str, equal: bool = False
) -> FacePoints:
    """Points at the chosen rows and columns of the patch's lattice, or means over groups of them.

    Parameters
    ----------
    rows, columns
        Choice of lines, see `line_groups`.
    equal
        They share the face by the number of their nodes; by tributary area otherwise.

    Raises
    ------
    InputError
        When the lattice has fewer lines.
    """
    found = lattice(mesh)
    up = line_groups(rows, found.n_row, f"contact.rows, {side} face")
    along = line_groups(columns, found.n_column, f"contact.columns, {side} face")
    size = np.ones(len(found.nodes)) if equal else found.area
    share = (up[:, None, found.row] * along[None, :, found.column] * size).reshape(
        len(up) * len(along), -1
    )
    total = share.sum(axis=1)
    used = np.flatnonzero(share.any(axis=0))
    values, nodes = share[:, used] / total[:, None], found.nodes[used]
    if len(used) == len(share) and np.count_nonzero(share) == len(share):
        # every point is a node: in the order of the points
        nodes, values = found.nodes[share.argmax(axis=1)], np.eye(len(share))
    lines = np.column_stack(
        [np.repeat(np.arange(len(up)), len(along)), np.tile(np.arange(len(along)), len(up))]
    )
    return FacePoints(
        values @ mesh.points[nodes], found.frame, total / total.sum(), nodes, values, lines
    )


def free_points(mesh: Mesh, position: FloatArray, weight: FloatArray, side: str) -> FacePoints:
    """Points anywhere on the patch, moving by the shape functions of the element face each lies in.

    Parameters
    ----------
    position
        (m, 3) mm.
    weight
        (m,) shares of the face's stiffness, of any sum.

    Raises
    ------
    InputError
        For a point off the patch.
    """
    faces = mesh.faces["patch"]
    inside = shape_functions(faces.shape[1])
    nodes = np.unique(faces)
    values = np.zeros((len(position), len(nodes)))
    for i, x in enumerate(position):
        face, shape = _locate(mesh.points, faces, x, inside)
        if face < 0:
            raise InputError(
                f"contact points: ({', '.join(f'{v:.4g}' for v in x)}) mm is off the "
                f"{side} patch; contact run and rig differ"
            )
        values[i, np.searchsorted(nodes, faces[face])] = shape
    used = np.flatnonzero(np.abs(values).max(axis=0) > np.sqrt(np.finfo(float).eps))
    lines = np.full((len(position), 2), -1, dtype=np.int64)
    return FacePoints(
        position, patch_frame(mesh), weight / weight.sum(), nodes[used], values[:, used], lines
    )


Shape = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def shape_functions(n_node: int) -> Shape:
    """Values (n_node,) and gradients (n_node, 2) at a point (2,) of the unit square, in our node
    order.
    """
    element = _FAMILIES[n_node]()
    local = match_nodes(FACE_NODES[:n_node], np.asarray(element.doflocs))

    def at(s: FloatArray) -> tuple[FloatArray, FloatArray]:
        pairs = [element.lbasis(s[:, None], int(a)) for a in local]
        return np.array([float(v[0]) for v, _ in pairs]), np.array(
            [np.asarray(g)[:, 0] for _, g in pairs]
        )

    return at


def _locate(
    points: FloatArray, faces: IntArray, x: FloatArray, shape: Shape
) -> tuple[int, FloatArray]:
    """Face that holds x and the shape functions there, or -1. Nearest centres first."""
    centres = points[faces[:, :4]].mean(axis=1)
    for face in np.argsort(np.linalg.norm(centres - x, axis=1))[:9]:
        X = points[faces[face]]
        s = np.array([0.5, 0.5])
        for _ in range(_MOST_STEPS):
            value, gradient = shape(s)
            step = np.linalg.lstsq(X.T @ gradient, x - X.T @ value, rcond=None)[0]
            s = s + step
            if np.abs(step).max() < np.sqrt(np.finfo(float).eps):
                break
        value, _ = shape(s)
        size = float(np.ptp(X, axis=0).max())
        # a point of another mesh lies on the face to the digits that turning left, a border belongs
        # to both faces
        near = np.finfo(float).eps ** 0.25
        if (np.abs(s - 0.5) <= 0.5 + near).all() and np.linalg.norm(X.T @ value - x) <= near * size:
            return int(face), value
    return -1, np.zeros(faces.shape[1])
