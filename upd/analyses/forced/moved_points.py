"""The contact points of a model on another part of its faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from upd.analyses.forced.model import Array, Model
from upd.scene.forced_contact import SIDES


def moved(model: Model, factor: float) -> Model | None:
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
        up = face.position @ face.frame[2]
        up = up - face.weight @ up
        rows = np.unique(np.round(up, 6))
        if len(rows) < 2:
            return None
        weight = straight(rows, factor * rows)
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


def straight(rows: Array, s: Array) -> Array:
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
