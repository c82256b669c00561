"""Coarser and finer contact points of a model, and what moves from one set to another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial import cKDTree

from upd.analyses.forced.gauss_points import fewer_points
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.points import FacePoints
from upd.analyses.seated.lattice import lines
from upd.hbm import Contacts
from upd.hbm.friction import Law
from upd.mesh import IntArray
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, Side

Axis = Literal["rows", "columns"]


class Merged(NamedTuple):
    """A model with fewer points: ratio of the spacings; (m, n) motion of its points from that of
    all, and their shares of these.
    """

    model: Model
    size: float
    move: Array
    share: Array


def merged(model: Model, axis: Axis, *, groups: bool) -> Merged | None:
    """The model with about half the rows, or columns, of its points.

    Lines of groups of nodes are merged in pairs, as groups of twice the size have them. Of lines of
    nodes every second stays, or as many at even distances: a point moves as the line there, and has
    the stiffness and the static forces that tributary areas give it, by linear shape functions.
    Totals of a face stay either way.

    Parameters
    ----------
    groups
        Whether its lines stand for groups.

    Returns
    -------
    Merged or None
        None where no face has so many lines.
    """
    at, share, size = _fewer(model, axis, groups)
    m, n = share.shape
    if m == n or size is None:
        return None
    face = model.face[share.argmax(axis=1)]
    faces = {}
    for k, side in enumerate(SIDES):
        own = model.faces[side]
        one, part = (w[np.ix_(face == k, model.face == k)] for w in (at, share))
        faces[side] = _merged_face(own, one, part, own.line[part.argmax(axis=1)])
    return Merged(_joined(model, at, share, face, faces), size, at, share)


def fewer_gauss(model: Model, factor: float) -> Merged | None:
    """The model with so many times its Gauss points up the slope.

    Returns
    -------
    Merged or None
        None where no face has so few.
    """
    found, sizes = [], []
    for side in SIDES:
        own = model.faces[side]
        n = int(own.line[:, 0].max()) + 1
        # one point up a slope would not resist tilt
        m = max(round(factor * n), 2)
        if m < n:
            sizes.append(n / m)
        found.append(fewer_points(own, 0, min(m, n)))
    if not sizes:
        return None
    at, share = (block_diag(*(getattr(one, name) for one in found)) for name in ("at", "share"))
    face = np.repeat(range(len(SIDES)), [len(one.line) for one in found])
    # all points of the left face come first
    faces = {
        side: replace(_merged_face(own, one.at, one.share, one.line), per_part=one.per_part)
        for side, one in zip(SIDES, found, strict=True)
        for own in (model.faces[side],)
    }
    return Merged(_joined(model, at, share, face, faces), float(np.mean(sizes)), at, share)


def _joined(
    model: Model, at: Array, share: Array, face: IntArray, faces: Mapping[Side, FacePoints]
) -> Model:
    law = model.contacts.law

    def rows(of: Array) -> Array:
        return np.ascontiguousarray(np.einsum("gp,pdn->gdn", at, of))

    summed = Law(
        k_n=share @ law.k_n,
        k_t=share @ law.k_t,
        mu=at @ law.mu,
        preload=share @ law.preload,
        gap=at @ law.gap,
    )
    made, traction = Contacts(rows(model.contacts.rows), summed), share @ model.traction
    static = np.einsum("pdn,pd->n", made.rows, np.column_stack([summed.preload, traction]))
    return replace(
        model,
        contacts=made,
        damper_rows=rows(model.damper_rows),
        faces=faces,
        face=face,
        static=static if model.state is not None else model.static,
        traction=traction,
    )


def _merged_face(face: FacePoints, at: Array, share: Array, line: IntArray) -> FacePoints:
    return FacePoints(
        at @ face.position,
        face.frame,
        share @ face.weight,
        face.nodes,
        at @ face.values,
        line,
    )


def _mean(pick: Array, weight: Array) -> Array:
    total = pick * (weight if weight.any() else np.ones(len(weight)))
    return np.asarray(total / total.sum(axis=1, keepdims=True))


def _fewer(model: Model, axis: Axis, groups: bool) -> tuple[Array, Array, float | None]:
    """(m, n) motion of the points that are left from that of all, and their shares of these; the
    ratio of the spacings, None where no face has so many lines.
    """
    at, share, sizes = [], [], []
    for side in SIDES:
        face = model.faces[side]
        local = face.position @ face.frame.T
        along = np.abs(local[:, 1]) if model.halved else local[:, 1]
        row, column = _lines(local[:, 2], local), _lines(along, local)
        mine, other = (row, column) if axis == "rows" else (column, row)
        place = local[:, 2] if axis == "rows" else along
        count = int(mine.max()) + 1
        x = np.array([place[mine == k].mean() for k in range(count)])
        mirrored = axis == "columns" and model.halved
        few, part, size = _pairs(x, mirrored=mirrored) if groups else _every_second(x)
        if size is not None:
            sizes.append(size)
        for k in range(int(other.max()) + 1):
            on = np.flatnonzero(other == k)
            line = np.zeros((count, len(mine)))
            line[mine[on], on] = 1.0
            weights = part @ line
            at.append(_pad(side, model, (_mean(weights, face.weight) if groups else few @ line)))
            share.append(_pad(side, model, weights))
    return np.vstack(at), np.vstack(share), float(np.mean(sizes)) if sizes else None


def _lines(x: Array, local: Array) -> IntArray:
    """Number of the line of each point; lines closer than half of the digits of the face are
    one.
    """
    size = float(np.ptp(local, axis=0).max())
    # two ends of known distance: points of a single line have none of their own
    return lines(np.concatenate([x, [x.min() - size, x.max() + size]]))[: len(x)] - 1


def _pad(side: Side, model: Model, block: Array) -> Array:
    """Columns of one face among those of all points."""
    out = np.zeros((len(block), len(model.face)))
    out[:, model.face == SIDES.index(side)] = block
    return out


def _pairs(x: Array, *, mirrored: bool) -> tuple[Array, Array, float | None]:
    """Lines in pairs; those off the middle y = 0 stand for their mirror images too."""
    n = len(x)
    m = -(-n // 2)
    part = np.zeros((m, n))
    part[np.arange(n) // 2, np.arange(n)] = 1.0
    if m == n:
        return part, part, None
    middle = mirrored and bool(np.isclose(x[0], 0.0))
    counts = [2 * c - middle for c in (n, m)] if mirrored else [n, m]
    return part, part, counts[0] / counts[1]


def _every_second(x: Array) -> tuple[Array, Array, float | None]:
    """Lines at even distances, half of the intervals rounded up; linear shape functions."""
    n = len(x)
    m = n // 2 + 1
    if m >= n:
        return np.eye(n), np.eye(n), None
    s = np.interp(np.linspace(0.0, n - 1.0, m), np.arange(n), x)
    # where a line that is left lies among all, and all among those that are left
    at = np.array([np.interp(s, x, one) for one in np.eye(n)]).T
    part = np.array([np.interp(x, s, one) for one in np.eye(m)])
    return at, part, (n - 1) / (m - 1)


def finer_columns(scene: ForcedScene) -> ForcedScene | None:
    """The scene with twice the groups of columns, or Gauss points along the damper, where it names
    a number of them.
    """
    contact, changes = scene.contact, dict[str, Any]()
    if isinstance(contact.columns, int):
        changes["columns"] = 2 * contact.columns
    for side in SIDES:
        own = getattr(contact, side)
        if isinstance(own.columns, int):
            changes[side] = replace(own, columns=2 * own.columns)
    return replace(scene, contact=replace(contact, **changes)) if changes else None


def transfer(base: Model, other: Model) -> tuple[Array, Array]:
    """(n, n_base) displacements and forces of a model's points from those of another one's.

    Points nearest to each other on the same face: of merged points the mean motion and the sum of
    the forces, of split ones the same motion and a part of the force by their stiffness.
    """
    n, m = base.contacts.n_point, other.contacts.n_point
    if n == m:
        return np.eye(n), np.eye(n)
    fine, coarse = (base, other) if n > m else (other, base)
    where = _nearest(fine, coarse)
    k = fine.contacts.law.k_n
    pick = np.zeros((min(n, m), max(n, m)))
    pick[where, np.arange(len(where))] = 1.0
    part = _mean(pick, k)
    return (part, pick) if n > m else (pick.T, part.T)


def _nearest(fine: Model, coarse: Model) -> IntArray:
    """(n_fine,) the nearest point of the coarse model on the same face."""
    out = np.zeros(fine.contacts.n_point, np.int64)
    for k in range(len(SIDES)):
        on, at = np.flatnonzero(fine.face == k), np.flatnonzero(coarse.face == k)
        out[on] = at[cKDTree(coarse.position[at]).query(fine.position[on])[1]]
    return out
