"""Contact points on a blade's patch: lattice nodes by row and column, means over groups of them, or
any points by shape functions; and Gauss points.

Gauss points are contact points by polynomials: mean motions that no mesh changes.

A rigid damper presses a face with stiffness k per area, so the face's energy is
1/2 int k (u - u_D)^2 dA. Tractions are taken from the polynomials of degree n - 1 up the slope, and
as many along the damper; the displacement that does work on them is its projection

    u_i = (1/w_i) int l_i u dA,    l_i(x_j) = delta_ij,    w_i = int l_i dA,

with l_i Lagrange's polynomials of Gauss' points x_i. These are orthogonal, int l_i l_j = w_i
delta_ij, as n points integrate degree 2n - 1 exactly: the projected face is n independent points
x_i, each with the share w_i / A of the face's stiffness, moving by u_i. A motion that is itself
such a polynomial is met exactly: two points of a slope have its stiffness in tilt too, of which n
intervals between lattice lines with tributary areas have 2/n^2 too much.

The integrals run over fixed parts of the face, not over nodes: finer elements change u_i by what
they change of u. The displacement at a node, or the mean over a line of nodes, has no limit there:
a force on a point moves it by 1/h and one on a line by log h of the element size h.

References
----------
.. [1] C. Bernardi, Y. Maday, A. T. Patera, Domain decomposition by the mortar element method, NATO
   ASI C 384 (1993): tractions and motions of non-matching sides by projection.
.. [2] K. L. Johnson, Contact Mechanics (1985), 2.2 and 3.2: displacement under line and point
   loads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skfem import ElementQuad1, ElementQuad2, ElementQuadS2

from upd.analyses.seated.bodies import is_half
from upd.analyses.seated.lattice import lattice, patch_frame
from upd.errors import InputError
from upd.fem.elements import match_nodes
from upd.fem.surface import FACE_NODES, face_moments
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


_HALF = float(np.finfo(float).eps) ** 0.5


@dataclass(frozen=True)
class GaussRule:
    """Gauss' points of an interval from -1 to 1, and Lagrange's polynomials on them.

    Attributes
    ----------
    at, weight
        (n,).
    """

    at: FloatArray
    weight: FloatArray

    @classmethod
    def of(cls, n: int) -> GaussRule:
        """With n points."""
        return cls(*np.polynomial.legendre.leggauss(n))

    def values(self, x: FloatArray) -> FloatArray:
        """(n, ...) of the polynomials at x (...)."""
        out = np.ones((len(self.at), *np.shape(x)))
        for k, own in enumerate(self.at):
            for j, other in enumerate(self.at):
                if j != k:
                    out[k] *= (x - other) / (own - other)
        return out


class FewerPoints(NamedTuple):
    """Fewer Gauss points of a face from all of them.

    Attributes
    ----------
    at
        (m, n) displacements of the fewer from those of all.
    share
        (m, n) forces and stiffnesses.
    line
        (m, 2) row and column.
    per_part
        As of `FacePoints`.
    """

    at: FloatArray
    share: FloatArray
    line: IntArray
    per_part: int


def fewer_points(face: FacePoints, axis: int, m: int) -> FewerPoints:
    """m of the n Gauss points up the slope, or along the damper in each part, exactly.

    l_i of m < n points has a degree below n, so l_i = sum_j l_i(x_j) l_j of n points, and

        u_i = sum_j l_i(x_j) (w_j / w_i) u_j,    f_i = sum_j l_i(x_j) f_j;

    weights go as forces, whose resultant and first moments stay.

    Parameters
    ----------
    face
        Gauss points.
    axis
        0 up the slope, 1 along the damper.
    m
        Points there, fewer than now.
    """
    per_part = face.per_part if axis == 0 else m
    row, (part, column) = face.line[:, 0], np.divmod(face.line[:, 1], face.per_part)
    mine, other = (row, face.line[:, 1]) if axis == 0 else (column, np.stack([row, part], 1))
    n = int(mine.max()) + 1
    fine, coarse = GaussRule.of(n), GaussRule.of(m)
    share = coarse.values(fine.at)
    at = share * fine.weight / coarse.weight[:, None]
    groups = np.unique(other, axis=0)
    out = np.zeros((2, len(groups) * m, face.n_point))
    line = np.zeros((len(groups) * m, 2), np.int64)
    for g, group in enumerate(groups):
        on = np.flatnonzero((other == group) if axis == 0 else (other == group).all(axis=1))
        on, new = on[np.argsort(mine[on])], slice(g * m, (g + 1) * m)
        out[0, new, on], out[1, new, on] = at.T, share.T
        numbers = np.arange(m)
        line[new, 0] = numbers if axis == 0 else group[0]
        line[new, 1] = group if axis == 0 else group[1] * m + numbers
    # as `gauss_points` has them: by part, row, column
    order = np.lexsort((line[:, 1] % per_part, line[:, 0], line[:, 1] // per_part))
    return FewerPoints(out[0, order], out[1, order], line[order], per_part)


def gauss_points(mesh: Mesh, rows: int, columns: int, side: str) -> FacePoints:
    """Points of a patch by polynomials.

    Parameters
    ----------
    mesh
        Of the blade, whole or its half y >= 0.
    rows
        Gauss points up the slope.
    columns
        Along the damper, those of all parts of the whole face together: its pads, and each side of
        the mid-plane.
    side
        Of the face, for errors.

    Returns
    -------
    FacePoints

    Raises
    ------
    InputError
        For a patch whose parts are no rectangles, or columns that its parts cannot have alike.
    """
    frame, faces = patch_frame(mesh), mesh.faces["patch"]
    parts = _parts(mesh.points, faces)
    copies = 2 if is_half(mesh) else 1
    count = columns // (copies * len(parts))
    if not count or count * copies * len(parts) != columns:
        raise InputError(
            f"contact.columns, {side} face: {columns} are not the same number of Gauss points on "
            f"each of its {copies * len(parts)} parts; give a multiple of it"
        )
    nodes = np.unique(faces)
    found = [_rectangle(mesh.points, faces[part], frame, rows, count, side) for part in parts]
    weight = np.concatenate([w for w, _ in found])
    values = np.vstack([v for _, v in found])[:, nodes] / weight[:, None]
    line = [
        np.column_stack(
            [np.repeat(np.arange(rows), count), np.tile(np.arange(count), rows) + k * count]
        )
        for k in range(len(parts))
    ]
    return FacePoints(
        values @ mesh.points[nodes],
        frame,
        weight / weight.sum(),
        nodes,
        values,
        np.vstack(line),
        count,
    )


def _parts(points: FloatArray, faces: IntArray) -> list[IntArray]:
    """Numbers of the faces of each connected part on one side of the mid-plane y = 0, by y; parts
    that the plane cuts through an element stay whole.
    """
    n = len(faces)
    y = points[faces, 1]
    size = float(np.ptp(y)) * _HALF
    where = np.where(y.min(axis=1) >= -size, 1, np.where(y.max(axis=1) <= size, -1, 0))
    if (where == 0).any():
        where = np.zeros(n, int)
    corner = coo_array(
        (np.ones(faces.size), (np.repeat(np.arange(n), faces.shape[1]), faces.ravel())),
        shape=(n, len(points)),
    ).tocsr()
    beside = (corner @ corner.T).tocoo()
    same = where[beside.row] == where[beside.col]
    joined = coo_array((beside.data[same], (beside.row[same], beside.col[same])), shape=(n, n))
    count, label = connected_components(joined, directed=False)
    parts = [np.flatnonzero(label == k) for k in range(count)]
    return sorted(parts, key=lambda part: float(y[part].mean()))


def _rectangle(
    points: FloatArray, faces: IntArray, frame: FloatArray, rows: int, columns: int, side: str
) -> tuple[FloatArray, FloatArray]:
    """w_i (m,) and int l_i phi_a dA (m, n_node) of one part, rows first."""
    local = points[np.unique(faces)] @ frame.T
    low, high = local.min(axis=0), local.max(axis=0)
    up, along = GaussRule.of(rows), GaussRule.of(columns)

    def polynomials(x: FloatArray) -> FloatArray:
        y, z = (2.0 * (x @ frame[k] - low[k]) / (high[k] - low[k]) - 1.0 for k in (1, 2))
        both = up.values(z)[:, None] * along.values(y)[None, :]
        return np.asarray(both.reshape(rows * columns, *both.shape[2:]))

    found = face_moments(points, faces, polynomials, max(rows, columns) - 1)
    wanted = np.outer(up.weight, along.weight).ravel() / 4.0 * np.prod((high - low)[1:])
    weight = found.sum(axis=1)
    if np.abs(weight - wanted).max() > _HALF * wanted.max():
        raise InputError(
            f"contact.rule: the {side} patch has parts that are no rectangles along the damper; "
            'use contact.rule = "lines"'
        )
    return weight, found
