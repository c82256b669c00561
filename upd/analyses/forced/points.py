"""Contact points on a blade's patch: nodes of its lattice, means over groups of them, Gauss points.

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

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from upd.analyses.seated.bodies import is_half, lattice, patch_frame
from upd.errors import InputError
from upd.fem.surface import face_moments
from upd.mesh import FloatArray, IntArray, Mesh


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
