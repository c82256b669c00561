"""Coarser and finer contact points of a model, and what moves from one set to another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from scipy.spatial import cKDTree

from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.points import FacePoints
from upd.analyses.seated.lattice import lines
from upd.hbm import Contacts
from upd.hbm.friction import Law
from upd.mesh import IntArray
from upd.scene import ForcedScene
from upd.scene.forced import SIDES

Axis = Literal["rows", "columns"]


def merged(model: Model, axis: Axis) -> tuple[float, Model] | None:
    """The model with neighbouring rows, or columns, of its points in pairs.

    A pair takes the mean motion of its points, weighted by their stiffness, and the sum of their
    stiffness and static forces: totals of a face stay.

    Returns
    -------
    float, Model or None
        Ratio of the spacings, and the model; None where no face has two lines.
    """
    group, size = _groups(model, axis)
    n, m = len(group), int(group.max()) + 1
    if m == n:
        return None
    law, pick = model.contacts.law, np.zeros((m, n))
    pick[group, np.arange(n)] = 1.0
    normal, tangent = _mean(pick, law.k_n), _mean(pick, law.k_t)
    along = np.stack([normal, *[tangent] * model.contacts.tangents])

    def rows(of: Array) -> Array:
        return np.ascontiguousarray(np.einsum("dgp,pdn->gdn", along, of))

    summed = Law(
        k_n=pick @ law.k_n,
        k_t=pick @ law.k_t,
        mu=normal @ law.mu,
        preload=pick @ law.preload,
        gap=normal @ law.gap,
    )
    made, traction = Contacts(rows(model.contacts.rows), summed), pick @ model.traction
    first = np.array([int(np.flatnonzero(group == g)[0]) for g in range(m)])
    faces = {}
    for k, side in enumerate(SIDES):
        mine = pick[np.ix_(model.face[first] == k, model.face == k)]
        faces[side] = _merged_face(model.faces[side], mine)
    static = np.einsum("pdn,pd->n", made.rows, np.column_stack([summed.preload, traction]))
    changed = replace(
        model,
        contacts=made,
        damper_rows=rows(model.damper_rows),
        faces=faces,
        face=model.face[first],
        static=static if model.state is not None else model.static,
        traction=traction,
    )
    return size, changed


def _merged_face(face: FacePoints, pick: Array) -> FacePoints:
    part = _mean(pick, face.weight)
    first = pick.argmax(axis=1)
    return FacePoints(
        part @ face.position,
        face.frame,
        pick @ face.weight,
        face.nodes,
        part @ face.values,
        face.line[first],
    )


def _mean(pick: Array, weight: Array) -> Array:
    weight = np.where(weight.any(), weight, 1.0) * np.ones(len(weight))
    total = pick * weight
    return np.asarray(total / total.sum(axis=1, keepdims=True))


def _groups(model: Model, axis: Axis) -> tuple[IntArray, float]:
    """(n_point,) number of the group of each point, and the mean ratio of the lines of faces with
    more than one to those after.
    """
    keys, sizes = [], []
    for k, side in enumerate(SIDES):
        face = model.faces[side]
        local = face.position @ face.frame.T
        row, column = lines(local[:, 2]), lines(np.abs(local[:, 1]))
        if not model.halved:
            column = lines(local[:, 1])
        merging, other = (row, column) if axis == "rows" else (column, row)
        count = int(merging.max()) + 1
        fewer = -(-count // 2)
        if count > 1:
            lattice = [count, fewer]
            if axis == "columns" and model.halved:
                # each off the middle stands for itself and its mirror image
                lattice = [2 * c - bool(np.isclose(local[:, 1], 0.0).any()) for c in lattice]
            sizes.append(lattice[0] / lattice[1])
        pair = merging // 2
        keys += [(k, int(a), int(b)) for a, b in zip(pair, other, strict=True)]
    number = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    return np.array([number[key] for key in keys]), float(np.mean(sizes)) if sizes else 1.0


def finer_columns(scene: ForcedScene) -> ForcedScene | None:
    """The scene with twice the groups of columns, where it names a number of them."""
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
