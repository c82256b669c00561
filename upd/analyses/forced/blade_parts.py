"""A blade reduced to what its contact points and its probes see.

Of rigs that are symmetric about the mid-plane y = 0 to even motion, in which a contact point and
its mirror image move as one: it halves the unknowns. Rig, excitation and accelerometers are their
own mirror images, so the answer may be taken even: normal and slope displacements of a pair are
equal, those along y opposite. Motions that are odd about the plane, the damper's drift along y
among them, are left out; friction in gross slip would not hold such a drift at all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.spatial import cKDTree

from upd.analyses.forced.points import FacePoints, fewer_points, gauss_points
from upd.analyses.seated.bodies import Blade, Bodies
from upd.reduction import attachment_modes, craig_bampton
from upd.scene.forced_contact import Side

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
#: damper dofs that are even about y = 0: ux, uz and the rotation about y
EVEN_DOFS = (0, 2, 4)
#: signs of the mirror image's displacement: normal, along the damper, up the slope
MIRROR_SIGNS = np.array([1.0, -1.0, 1.0])
_HALF = float(np.finfo(float).eps) ** 0.5
#: share of odd motion below which a mode counts as even, above one minus which as odd
PARITY = 1e-4


@dataclass(frozen=True)
class MirrorPairs:
    """Points (m,) kept of a face, y >= 0, and their mirror images (m,), themselves on the plane."""

    point: IntArray
    image: IntArray

    def even(self, rows: FloatArray) -> FloatArray:
        """Rows (n, 3, r) of all points -> (m, 3, r) even part of the displacement of the points
        kept.
        """
        return np.asarray(0.5 * (rows[self.point] + MIRROR_SIGNS[:, None] * rows[self.image]))

    def odd(self, rows: FloatArray) -> FloatArray:
        """The odd part."""
        return np.asarray(0.5 * (rows[self.point] - MIRROR_SIGNS[:, None] * rows[self.image]))

    def total(self, values: FloatArray) -> FloatArray:
        """Values (n,) of all points -> (m,) of each pair together, a point on the plane by
        itself.
        """
        return np.asarray(
            values[self.point] + np.where(self.image != self.point, values[self.image], 0.0)
        )

    def face(self, face: FacePoints) -> FacePoints:
        """The points kept, with the weight of their pairs."""
        position = face.position[self.point].copy()
        position[self.image == self.point, 1] = 0.0
        return FacePoints(
            position,
            face.frame,
            self.total(face.weight),
            face.nodes,
            face.values[self.point],
            face.line[self.point],
            face.per_part,
        )


def mirror_pairs(face: FacePoints) -> MirrorPairs | None:
    """The pairs of a face's points, None unless every point has its mirror image with the same
    share of the stiffness.
    """
    x = face.position
    size = float(np.ptp(x, axis=0).max())
    distance, image = cKDTree(x).query(x * np.array([1.0, -1.0, 1.0]))
    image = np.asarray(image, np.int64)
    alike = np.abs(face.weight - face.weight[image]) <= _HALF * face.weight.max()
    if (
        (distance > _HALF * size).any()
        or not alike.all()
        or not np.array_equal(image[image], np.arange(len(x)))
    ):
        return None
    kept = np.flatnonzero((image == np.arange(len(x))) | (x[:, 1] > 0.0))
    return MirrorPairs(kept, image[kept])


def even_modes(rows: FloatArray, pairs: MirrorPairs, shapes: FloatArray) -> FloatArray | None:
    """Of mode shapes those that are even about y = 0 at the contact points.

    Parameters
    ----------
    rows
        (n, 3, r) displacement of all points of the coordinates.
    shapes
        (r, k) modes.

    Returns
    -------
    FloatArray or None
        (r, j) even modes; None when a mode is neither even nor odd: its pair of equal frequencies
        is mixed.
    """
    even, odd = (
        np.linalg.norm(part.reshape(-1, part.shape[-1]) @ shapes, axis=0)
        for part in (pairs.even(rows), pairs.odd(rows))
    )
    share = odd / np.maximum(np.hypot(even, odd), np.finfo(float).tiny)
    if ((share > PARITY) & (share < np.sqrt(1.0 - PARITY**2))).any():
        return None
    return np.asarray(shapes[:, share <= PARITY])


Array = NDArray[np.float64]
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

    K: Array
    M: Array
    rows: Array
    probes: Array
    n_modes: int


def nodal_part(
    bodies: Bodies,
    side: Side,
    face: FacePoints,
    names: tuple[str, ...],
    count: int,
    solver: str,
) -> BladePart:
    """By Craig-Bampton on the nodes of the points and the probes' x.

    Kept in the bodies, as several stiffnesses share their points.

    Parameters
    ----------
    face
        Its points.
    names
        Of the probes.
    count
        Modes kept.
    solver
        As in the scene.
    """
    blade = bodies.blades[side]
    probes = [blade.probe(name) for name in names]
    boundary = np.unique(np.concatenate([blade.dofs(face.nodes), probes]))
    key = (side, boundary.tobytes())
    if key not in bodies.reduced or bodies.reduced[key].n_modes < count:
        bodies.reduced[key] = craig_bampton(
            blade.K,
            blade.M,
            boundary,
            n_modes=count,
            rows=boundary,
            solver=solver,
        )
    model = bodies.reduced[key].truncated(count)
    nodal = model.at(blade.dofs(face.nodes)).reshape(len(face.nodes), 3, -1)
    at_points = np.einsum("mk,kcr->mcr", face.values, nodal)
    seen = model.at(np.array(probes))
    rows = np.einsum("fc,mcr->mfr", face.frame, at_points)
    return BladePart(model.K, model.M, rows, seen, max(model.n_modes, 1) + _BESIDE)


def attached_part(
    bodies: Bodies,
    side: Side,
    lines: tuple[int, int],
    names: tuple[str, ...],
    count: int,
    again: bool,
    solver: str,
) -> BladePart:
    """By its lowest modes and the static shapes of its points' and probes' forces.

    A half blade has half of the energy, and its points stand for themselves and their mirror
    images: K and M of the whole are twice its own. Fewer points are a part of those that a body was
    reduced to before (`gauss_points.fewer_points`): where models with more points follow, to twice
    the rows at once.

    Parameters
    ----------
    lines
        Gauss points up the slope and along the damper. Others as of `nodal_part`.
    again
        Whether models with more points follow.
    """
    blade, most = bodies.blades[side], max(count, 1) + _BESIDE
    rows, columns = lines
    known_keys = (key for key, one in bodies.attached.items() if len(one.frequency) >= most)
    key = next(
        (k for k in known_keys if k[0] == side and k[1] >= rows and k[2] in (columns, 2 * columns)),
        (side, 2 * rows if again else rows, columns),
    )
    face = gauss_points(blade.mesh, *key[1:], side)
    if key not in bodies.attached or len(bodies.attached[key].frequency) < most:
        loads = _loads(blade, face, names)
        found = attachment_modes(blade.K, blade.M, loads, most, solver=solver)
        bodies.attached[key] = found
    known = bodies.attached[key]
    twice = 2.0 if bodies.half else 1.0
    seen, probes = np.split(known.rows, [3 * face.n_point])
    seen = seen.reshape(face.n_point, 3, -1)
    for axis, wanted, now in (
        (0, rows, key[1]),
        (1, face.per_part * columns // key[2], face.per_part),
    ):
        if wanted < now:
            fewer = fewer_points(face, axis, wanted)
            seen = np.einsum("mn,ncr->mcr", fewer.at, seen)
            face = replace(
                face,
                position=fewer.at @ face.position,
                weight=fewer.share @ face.weight,
                values=fewer.at @ face.values,
                line=fewer.line,
                per_part=fewer.per_part,
            )
    return BladePart(twice * known.K, twice * known.M, seen, probes, most)


def _loads(blade: Blade, face: FacePoints, names: tuple[str, ...]) -> Array:
    """(3 m + n_probe, n_free) displacements of the points in the face's frame, then of the probes,
    of the blade's free dofs.
    """
    whole = np.zeros((face.n_point, 3, blade.mesh.n_node, 3))
    whole[:, :, face.nodes] = np.einsum("mk,fc->mfkc", face.values, face.frame)
    out = np.zeros((3 * face.n_point + len(names), len(blade.free)))
    out[: 3 * face.n_point] = whole.reshape(3 * face.n_point, -1)[:, blade.free]
    out[range(3 * face.n_point, len(out)), [blade.probe(name) for name in names]] = 1.0
    return out


def ritz(
    model: BladePart, pairs: MirrorPairs | None = None
) -> tuple[Array, Array, Array, Array] | None:
    """K, M, contact rows and probe rows on what points and probes see: their static shapes
    (attachment modes) and the lowest modes.

    Points between nodes hang on nearly all nodes of the patch; the shapes K^-1 B' keep their static
    compliance exactly. With mirror pairs, only what is even about y = 0 is kept; None when a mode
    is neither even nor odd. Source: R. R. Craig, A. J. Kurdila, Fundamentals of Structural
    Dynamics, ch. 17.
    """
    rows, probes = model.rows, model.probes
    _, modes = eigh(model.K, model.M, subset_by_index=[0, min(len(model.K), model.n_modes) - 1])
    if pairs is not None:
        even = even_modes(rows, pairs, modes)
        if even is None:
            return None
        modes, rows = even, pairs.even(rows)
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
    K = T.T @ model.K @ T
    return symmetric(K), symmetric(T.T @ model.M @ T), rows @ T, probes @ T


def symmetric(A: Array) -> Array:
    """Its symmetric part."""
    return np.asarray(0.5 * (A + A.T))
