"""Contact points of one model on those of another: their motions by straight lines up the slope."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from upd.analyses.forced.model import Array, Model
from upd.hbm.springs.balance import Balance
from upd.scene.forced_contact import SIDES


def moved_points(base: Model, other: Model) -> Array | None:
    """(n, n_base) displacements of a model's points from those of the run's, on the same faces, by
    straight lines up the slope; None where the points are the same.
    """
    here, there = _up(base), _up(other)
    if here.shape == there.shape and np.allclose(
        here, there, atol=1e-6 * float(np.ptp(here) or 1.0)
    ):
        return None
    out = np.zeros((other.contacts.n_point, base.contacts.n_point))
    for k in range(len(SIDES)):
        mine, new = np.flatnonzero(base.face == k), np.flatnonzero(other.face == k)
        x, s = here[mine], there[new]
        rows = np.unique(np.round(x, 9))
        weight = _straight(rows, s)
        for j, row in enumerate(rows):
            on = mine[np.isclose(x, row, atol=1e-8 * max(np.ptp(x), 1.0))]
            # along the damper the motion hardly changes: the mean of the row's points
            out[np.ix_(new, on)] = weight[:, j : j + 1] / len(on)
    return out


def _up(model: Model) -> Array:
    """(n,) places up the slope from the middle of each face, mm."""
    out = np.zeros(len(model.face))
    for k, side in enumerate(SIDES):
        on, face = model.face == k, model.faces[side]
        local = face.position @ face.frame[2]
        out[on] = local - face.weight @ local
    return out


def carried(b: Balance, old: Balance, x: Array, move: Array | None) -> Array:
    """Unknowns of a motion on another model: the same motion of its points, and the rigid motion
    that goes with it.

    Parameters
    ----------
    move
        As of `moved_points`. A model with both sliding directions does not move along the damper.
    """
    W, rest = old.split(x)
    if b.contacts.tangents > old.contacts.tangents:
        W = np.insert(W, 1, 0.0, axis=1)
    if move is None:
        return np.concatenate([W.ravel(), rest])
    moved = np.einsum("pq,qdk->pdk", move, W)
    flat = np.concatenate([moved.ravel(), np.zeros(b.rigid)])
    if not b.rigid:
        return flat
    F = b.force(flat, False).force.reshape(len(b.Psi), -1)
    rows = b.Psi[:, b.modal.rigid]
    mean = moved.reshape(len(b.Psi), -1)[:, 0] + b.G0 @ F[:, 0] - b.u0
    a = np.linalg.lstsq(rows, mean, rcond=None)[0]
    return np.concatenate([moved.ravel(), a])


def _straight(rows: Array, s: Array) -> Array:
    """(m, n) values at s by straight lines between rows, and beyond their ends.

    Parameters
    ----------
    rows
        (n,) rising.
    s
        (m,).
    """
    if len(rows) == 1:
        return np.ones((len(s), 1))
    k = np.clip(np.searchsorted(rows, s) - 1, 0, len(rows) - 2)
    share = (s - rows[k]) / (rows[k + 1] - rows[k])
    out = np.zeros((len(s), len(rows)))
    out[np.arange(len(s)), k], out[np.arange(len(s)), k + 1] = 1.0 - share, share
    return out


def nearer(model: Model, factor: float) -> Model | None:
    """The model with its points nearer to the middle of each face, up the slope.

    The motion of a point between others is theirs by straight lines: that of a face under a rigid
    damper is nearly one. Stiffness and static forces stay with the points.

    Parameters
    ----------
    factor
        On the places up the slope from the middle of a face, at most 1.

    Returns
    -------
    Model or None
        None where the points are in one row.
    """
    n = model.contacts.n_point
    at = np.zeros((n, n))
    faces = {}
    for k, side in enumerate(SIDES):
        face, on = model.faces[side], np.flatnonzero(model.face == k)
        up = _up(model)[on]
        rows = np.unique(np.round(up, 6))
        if len(rows) < 2:
            return None
        weight = _straight(rows, factor * rows)
        row = np.abs(up[:, None] - rows).argmin(axis=1)
        column = face.position @ face.frame[1]
        mine = np.zeros((len(on), len(on)))
        for i in range(len(on)):
            # the points of every row nearest along the damper
            for j in range(len(rows)):
                there = np.flatnonzero(row == j)
                near = there[np.abs(column[there] - column[i]).argmin()]
                mine[i, near] += weight[row[i], j]
        at[np.ix_(on, on)] = mine
        faces[side] = replace(face, position=mine @ face.position, values=mine @ face.values)

    def rows_of(of: Array) -> Array:
        return np.ascontiguousarray(np.einsum("gp,pdn->gdn", at, of))

    contacts = replace(model.contacts, rows=rows_of(model.contacts.rows))
    return replace(model, contacts=contacts, damper_rows=rows_of(model.damper_rows), faces=faces)
