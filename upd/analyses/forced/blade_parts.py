"""A blade reduced to what its contact points and its probes see."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from upd.analyses.forced.gauss_points import fewer_points, gauss_points
from upd.analyses.forced.points import FacePoints
from upd.analyses.forced.symmetry import MirrorPairs, even_modes
from upd.analyses.seated.bodies import Blade, Bodies
from upd.reduction import attachment_modes, craig_bampton
from upd.scene.forced_contact import Side

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
