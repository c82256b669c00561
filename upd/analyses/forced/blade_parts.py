"""Contact points on a blade's patch, and the blade reduced to what these and its probes see.

Points are nodes of the patch's lattice, means over groups of them, or Gauss points.

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

Half meshes y >= 0 move evenly about their mid-plane, and a contact point stands for itself and its
mirror image: it halves the unknowns. Rig, excitation and accelerometers are their own mirror
images, so the answer may be taken even: normal and slope displacements of a pair are equal, those
along y opposite. Motions that are odd about the plane, the damper's drift along y among them, are
left out; friction in gross slip would not hold such a drift.

References
----------
.. [1] C. Bernardi, Y. Maday, A. T. Patera, Domain decomposition by the mortar element method, NATO
   ASI C 384 (1993): tractions and motions of non-matching sides by projection.
.. [2] K. L. Johnson, Contact Mechanics (1985), 2.2 and 3.2: displacement under line and point
   loads.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from upd.analyses.forced.plan import ForcedPlan, excitation_of
from upd.analyses.seated.bodies import Bodies, is_half, lattice, patch_frame
from upd.errors import InputError
from upd.fem.surface import face_moments
from upd.linalg.parallel import in_parallel
from upd.mesh import FloatArray, IntArray, Mesh
from upd.reduction import attachment_modes, craig_bampton
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS, SIDES, Side


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
        Gauss points along the damper in each part of the face; 0 for points of another rule.
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
    # in whole numbers: group k holds k / n <= line / (count - 1) <= (k + 1) / n
    n = int(choice)
    place = np.arange(count) * n - np.arange(n)[:, None] * (count - 1)
    on = (place >= 0) & (place <= count - 1)
    return np.asarray(on / on.sum(axis=0))


def lattice_points(
    mesh: Mesh, rows: Any, columns: Any, side: str, equal: bool = False
) -> FacePoints:
    """Points at the chosen rows and columns of the patch's lattice, or means over groups of them.

    Of a half y >= 0 the lines are those of the whole face: a point there stands for its mirror
    image too, a mean across the plane for itself.

    Parameters
    ----------
    rows, columns
        Choice of lines, see `line_groups`.
    equal
        They share the face by the number of their nodes; by tributary area otherwise.

    Raises
    ------
    InputError
        When the lattice has fewer lines, and for columns of a half that are not their own mirror
        images.
    """
    found, half = lattice(mesh), is_half(mesh)
    up = line_groups(rows, found.n_row, f"contact.rows, {side} face")
    where = f"contact.columns, {side} face"
    on_plane = np.isin(found.nodes, mesh.nodes["plane_y"] if half else ())
    if half:
        along, own = _folded(columns, found.n_column, bool(on_plane.any()), where)
    else:
        along, own = line_groups(columns, found.n_column, where), False
    size = np.ones(len(found.nodes)) if equal else found.area * np.where(on_plane, 2.0, 1.0)
    share = (up[:, None, found.row] * along[None, :, found.column] * size).reshape(
        len(up) * len(along), -1
    )
    total = share.sum(axis=1)
    used = np.flatnonzero(share.any(axis=0))
    values, nodes = share[:, used] / total[:, None], found.nodes[used]
    if len(used) == len(share) and np.count_nonzero(share) == len(share):
        # every point is a node: in the order of the points
        nodes, values = found.nodes[share.argmax(axis=1)], np.eye(len(share))
    lines = np.column_stack(np.divmod(np.arange(len(share)), len(along)))
    position = values @ mesh.points[nodes]
    if own:
        position[lines[:, 1] == 0, 1] = 0.0
        total[lines[:, 1] == 0] *= 0.5
    return FacePoints(position, found.frame, total / total.sum(), nodes, values, lines)


def _folded(choice: Any, count: int, on_plane: bool, where: str) -> tuple[FloatArray, bool]:
    """Share of each column of a half in the groups of the whole face that are kept, y >= 0, and
    whether the first of these is its own mirror image.
    """
    share = line_groups(choice, 2 * count - on_plane, where)
    if not np.array_equal(share, share[::-1, ::-1]):
        raise InputError(
            f"{where}: {choice!r} is not its own mirror image about y = 0; to fix it: "
            'mesh.symmetry = "full"'
        )
    images = share[:, :count][:, ::-1].copy()
    if on_plane:
        # its own image
        images[:, 0] = 0.0
    n = len(share)
    return (share[:, -count:] + images)[n // 2 :], n % 2 == 1


_HALF = float(np.finfo(float).eps) ** 0.5


def lagrange(at: FloatArray, x: FloatArray) -> FloatArray:
    """(n, ...) values at x (...) of Lagrange's polynomials on the points at (n,)."""
    out = np.ones((len(at), *np.shape(x)))
    for k, own in enumerate(at):
        for other in np.delete(at, k):
            out[k] *= (x - other) / (own - other)
    return out


def fewer_rows(face: FacePoints, rows: int) -> FloatArray:
    """(m, n) displacements of fewer rows of Gauss points from those of a face, exactly.

    l_i of m < n points has a degree below n, so l_i = sum_j l_i(x_j) l_j of n points, and
    u_i = sum_j l_i(x_j) (w_j / w_i) u_j.
    """
    n = int(face.line[:, 0].max()) + 1
    (fine, w_fine), (coarse, w_coarse) = map(np.polynomial.legendre.leggauss, (n, rows))
    up = lagrange(coarse, fine) * w_fine / w_coarse[:, None]
    parts = face.n_point // (n * face.per_part)
    return np.kron(np.eye(parts), np.kron(up, np.eye(face.per_part)))


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
    row, column = np.divmod(np.arange(rows * count), count)
    line = [np.column_stack([row, column + k * count]) for k in range(len(parts))]
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
    (up, w_up), (along, w_along) = map(np.polynomial.legendre.leggauss, (rows, columns))

    def polynomials(x: FloatArray) -> FloatArray:
        y, z = (2.0 * (x @ frame[k] - low[k]) / (high[k] - low[k]) - 1.0 for k in (1, 2))
        both = lagrange(up, z)[:, None] * lagrange(along, y)[None, :]
        return np.asarray(both.reshape(rows * columns, *both.shape[2:]))

    found = face_moments(points, faces, polynomials, max(rows, columns) - 1)
    wanted = np.outer(w_up, w_along).ravel() / 4.0 * np.prod((high - low)[1:])
    weight = found.sum(axis=1)
    if np.abs(weight - wanted).max() > _HALF * wanted.max():
        raise InputError(
            f"contact.rule: the {side} patch has parts that are no rectangles along the damper; "
            'use contact.rule = "lines"'
        )
    return weight, found


# -- a blade on its points -------------------------------------------------------------------------


#: modes of the whole blade beside the ones kept, of those that points off the nodes are put on
_BESIDE = 6


@dataclass(frozen=True)
class BladePart:
    """A reduced blade, whole.

    Attributes
    ----------
    K, M
        (r, r) in N/mm and t.
    rows
        (m, 3, r) displacement of the contact points in the frame of the face.
    probes
        (n_probe, r) displacement along x of the probes.
    n_modes
        Of the lowest to keep where the coordinates are changed.
    """

    K: FloatArray
    M: FloatArray
    rows: FloatArray
    probes: FloatArray
    n_modes: int


def reduced_blades(
    plan: ForcedPlan, bodies: Bodies
) -> tuple[Mapping[Side, FacePoints], list[BladePart]]:
    """Points of both faces, each blade on what its points and probes see."""
    faces, contact = dict[Side, FacePoints](), plan.scene.contact
    for side in SIDES:
        mesh, (rows, columns) = bodies.blades[side].mesh, contact.lines(side)
        faces[side] = (
            gauss_points(mesh, rows, columns, side)
            if contact.rule == GAUSS
            else lattice_points(mesh, rows, columns, side, contact.share == "equal")
        )
    parts = in_parallel(
        [partial(_reduced, plan.scene, bodies, side, faces[side]) for side in SIDES], plan.workers
    )
    return faces, parts


def _reduced(scene: ForcedScene, bodies: Bodies, side: Side, face: FacePoints) -> BladePart:
    """One blade on what its points and probes see: its accelerometer, and where it is excited the
    node of its force.

    A half blade has half of the energy, and its points stand for themselves and their mirror
    images: K and M of the whole are twice its own.
    """
    excited = side in excitation_of(scene.excitation).blades
    names = ("accelerometer", "force") if excited else ("accelerometer",)
    twice = 1.0 + bodies.half
    if scene.contact.rule == GAUSS:
        part = _attached(scene, bodies, side, names)
    else:
        part = _nodal(scene, bodies, side, face, names)
    part = replace(part, K=twice * part.K, M=twice * part.M)
    return part if face.at_nodes else ritz(part)


def _nodal(
    scene: ForcedScene, bodies: Bodies, side: Side, face: FacePoints, names: tuple[str, ...]
) -> BladePart:
    """By Craig-Bampton on the nodes of the points and the probes' x.

    Kept in the bodies, as several stiffnesses share their points.
    """
    count = scene.reduction.modes
    blade = bodies.blades[side]
    probes = [blade.probe(name) for name in names]
    dofs = (3 * face.nodes[:, None] + np.arange(3)).ravel()
    moves = np.isin(dofs, blade.free)
    places = np.searchsorted(blade.free, dofs[moves])
    boundary = np.unique(np.concatenate([places, probes]))
    key = (side, boundary.tobytes())
    if key not in bodies.reduced or bodies.reduced[key].n_modes < count:
        bodies.reduced[key] = craig_bampton(
            blade.K,
            blade.M,
            boundary,
            n_modes=count,
            rows=boundary,
            solver=scene.solver.name,
        )
    model = bodies.reduced[key].truncated(count)
    nodal = np.zeros((len(dofs), len(model.K)))
    nodal[moves] = model.at(places)
    at_points = np.einsum("mk,kcr->mcr", face.values, nodal.reshape(len(face.nodes), 3, -1))
    if bodies.half:
        at_points[face.position[:, 1] == 0.0, 1] = 0.0
    rows = np.einsum("fc,mcr->mfr", face.frame, at_points)
    seen = model.at(np.array(probes))
    return BladePart(model.K, model.M, rows, seen, max(model.n_modes, 1) + _BESIDE)


def _attached(scene: ForcedScene, bodies: Bodies, side: Side, names: tuple[str, ...]) -> BladePart:
    """By its lowest modes and the static shapes of its points' and probes' forces.

    Fewer points are means of those that a body was reduced to before: where models with more points
    follow, for error estimates, to twice the rows at once.
    """
    blade, most = bodies.blades[side], max(scene.reduction.modes, 1) + _BESIDE
    rows, columns = scene.contact.lines(side)
    known_keys = (key for key, one in bodies.attached.items() if len(one.frequency) >= most)
    key = next(
        (k for k in known_keys if k[0] == side and k[1] >= rows and k[2] == columns),
        (side, 2 * rows if scene.estimates else rows, columns),
    )
    many = gauss_points(blade.mesh, key[1], columns, side)
    if key not in bodies.attached or len(bodies.attached[key].frequency) < most:
        # displacements of the points in the face's frame, then of the probes, by the free dofs
        whole = np.zeros((many.n_point, 3, blade.mesh.n_node, 3))
        whole[:, :, many.nodes] = np.einsum("mk,fc->mfkc", many.values, many.frame)
        probes = np.zeros((len(names), len(blade.free)))
        probes[range(len(names)), [blade.probe(name) for name in names]] = 1.0
        loads = np.vstack([whole.reshape(3 * many.n_point, -1)[:, blade.free], probes])
        found = attachment_modes(blade.K, blade.M, loads, most, solver=scene.solver.name)
        bodies.attached[key] = found
    known = bodies.attached[key]
    seen, probes = np.split(known.rows, [3 * many.n_point])
    seen = np.einsum("mn,ncr->mcr", fewer_rows(many, rows), seen.reshape(many.n_point, 3, -1))
    return BladePart(known.K, known.M, seen, probes, most)


def ritz(model: BladePart) -> BladePart:
    """The blade on what points and probes see: their static shapes (attachment modes) and the
    lowest modes.

    Points between nodes hang on nearly all nodes of the patch; the shapes K^-1 B' keep their static
    compliance exactly. Source: R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics,
    ch. 17.
    """
    rows, probes = model.rows, model.probes
    few = min(len(model.K), model.n_modes)
    modes = eigh(model.K, model.M, subset_by_index=[0, few - 1])[1]
    B = np.vstack([rows.reshape(-1, len(model.K)), probes])
    B = B[np.linalg.norm(B, axis=1) > np.finfo(float).eps ** 0.5 * np.linalg.norm(B, axis=1).max()]
    static = np.linalg.solve(model.K, B.T)
    # The modes stay as they are; of the static shapes what they lack, orthonormal in M, shapes that
    # repeat others left out.
    static -= modes @ (modes.T @ model.M @ static)
    static /= np.sqrt(np.einsum("ij,ik,kj->j", static, model.M, static))
    values, V = np.linalg.eigh(static.T @ model.M @ static)
    keep = values > len(values) * np.finfo(float).eps ** 0.75 * values[-1]
    rest = static @ (V[:, keep] / np.sqrt(values[keep]))
    T = np.hstack([modes, rest - modes @ (modes.T @ model.M @ rest)])
    K, M = (0.5 * (A + A.T) for A in (T.T @ model.K @ T, T.T @ model.M @ T))
    return BladePart(K, M, rows @ T, probes @ T, model.n_modes)
