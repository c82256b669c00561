"""What friction alone decides: self-locking, and loads that nothing carries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

FloatArray = NDArray[np.float64]

#: Sides of the polygons inside Coulomb's disks, for the question whether a contact can hold itself.
_SIDES = 16


def self_locking(columns: FloatArray, friction: FloatArray) -> bool:
    """Whether forces within friction can balance each other without any load.

    Then a state is not unique (residual forces remain after unloading), and a load may jam. By a
    linear programme: the largest sum of normal forces with B'f = 0. Two tangential directions have
    polygons inside Coulomb's disks: friction up to 2 % above the limit may be missed.

    Parameters
    ----------
    columns : (c n, r) ndarray
        B.
    friction : (n,) ndarray

    Returns
    -------
    bool
    """
    G = _pyramids(columns, friction)
    n = len(friction)
    size = np.abs(columns).max(axis=0)
    found = linprog(
        -np.ones(G.shape[1]),
        A_eq=(G / size[:, None]),
        b_eq=np.zeros(len(G)),
        bounds=(0.0, 1.0),
        method="highs",
    )
    most = 0.0 if found.fun is None else -float(found.fun)
    return bool(found.status == 0 and most > np.sqrt(np.finfo(float).eps) * n)


def carries(columns: FloatArray, friction: FloatArray, load: FloatArray) -> bool:
    """Whether some forces within friction balance a load B'f = load.

    Two tangential directions have polygons around Coulomb's disks: what is refused has no answer.

    Parameters
    ----------
    columns : (c n, r) ndarray
    friction : (n,) ndarray
    load : (r,) ndarray
        N.

    Returns
    -------
    bool
    """
    G = _pyramids(columns, friction, around=True)
    size = np.abs(columns).max(axis=0)
    unit = float(np.abs(load).max(initial=0.0)) or 1.0
    found = linprog(
        np.ones(G.shape[1]),
        A_eq=G / size[:, None],
        b_eq=load / size / unit,
        bounds=(0.0, None),
        method="highs",
    )
    return bool(found.status == 0)


def _pyramids(columns: FloatArray, friction: FloatArray, *, around: bool = False) -> FloatArray:
    """(r, edges): B' on the edges of pyramids in or around the cones, unit normal force."""
    n = len(friction)
    parts = columns.reshape(-1, n, columns.shape[1])
    if len(parts) == 2:
        ways = np.array([[1.0], [-1.0]])
    else:
        angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        ways = np.column_stack((np.cos(angle), np.sin(angle)))
        ways /= np.cos(np.pi / _SIDES) if around else 1.0
    edges = [
        (parts[0] + friction[:, None] * np.einsum("d,dnr->nr", way, parts[1:])) for way in ways
    ]
    return np.concatenate(edges).T
