"""Contact points on the dofs of a linear system: where they act and which law they follow."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.springs.friction import Law
from upd.labels import Shown

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Contacts(Shown):
    """Contact points on the dofs of a system.

    Attributes
    ----------
    rows : (n_point, 1 + d, n_dof) ndarray
        Relative displacement (normal, tangents) [mm] = rows @ q, d = 0, 1 or 2 tangents.
    law : Law
        Stiffnesses, friction, preloads and gaps of the points.
    """

    rows: FloatArray
    law: Law

    @property
    def n_point(self) -> int:
        """Number of contact points."""
        return len(self.rows)

    @property
    def tangents(self) -> int:
        """Tangential directions per point: 0, 1 or 2."""
        return int(self.rows.shape[1]) - 1

    @property
    def B(self) -> FloatArray:
        """All rows as one matrix (n_point (1 + d), n_dof)."""
        return self.rows.reshape(-1, self.rows.shape[2])


def contacts(
    normal: ArrayLike,
    tangents: ArrayLike = (),
    *,
    k_n: ArrayLike,
    k_t: ArrayLike | None = None,
    mu: ArrayLike,
    preload: ArrayLike = 0.0,
    gap: ArrayLike = 0.0,
) -> Contacts:
    """Contact points from rows on the dofs of the system; a number given once holds for all points.

    The normal force is N = max(0, N_0 + k_n (w_n - gap)). With k_n = 0 it is constant: a Jenkins
    element.

    Parameters
    ----------
    normal : (n_point, n_dof) array_like
        row @ q is the closing displacement w_n [mm].
    tangents : (d, n_point, n_dof) array_like
        row @ q are the sliding displacements [mm], d = 0, 1 or 2; (n_point, n_dof) for d = 1.
    k_n : float or (n_point,) array_like
        Normal stiffness [N/mm], >= 0.
    k_t : float or (n_point,) array_like, optional
        Tangential stiffness [N/mm], > 0. Needed where there is friction; without, nothing reads it.
    mu : float or (n_point,) array_like
        Friction coefficient, >= 0.
    preload : float or (n_point,) array_like
        N_0 [N].
    gap : float or (n_point,) array_like
        Gap [mm].

    Returns
    -------
    Contacts

    Raises
    ------
    InputError
        For bad input; all problems are named.

    Examples
    --------
    Two masses that rub against each other under 5 N:

    >>> from upd.hbm import contacts
    >>> points = contacts([[0.0, 0.0]], [[1.0, -1.0]], k_n=0.0, k_t=100.0, mu=0.3, preload=5.0)
    >>> points.n_point, points.tangents
    (1, 1)
    >>> points.B.tolist()
    [[0.0, 0.0], [1.0, -1.0]]
    >>> points.law.k_t.tolist()
    [100.0]
    """
    n = np.atleast_2d(np.asarray(normal, dtype=float))
    t = np.asarray(tangents, dtype=float)
    if t.size == 0:
        t = t.reshape(0, *n.shape)
    elif t.ndim > 2:
        t = t.reshape(-1, *t.shape[-2:])
    else:
        t = np.atleast_2d(t)[None]
    problems = []
    if t.shape[1:] != n.shape or len(t) > 2:
        problems.append(
            f"tangents have shape {t.shape}; give (d, {n.shape[0]}, {n.shape[1]}), d <= 2"
        )
    if k_t is None and len(t) and np.any(np.asarray(mu, dtype=float) > 0):
        problems.append(
            "k_t is missing; to fix it: give the tangential stiffness of the points with friction"
        )
    given = {"k_n": k_n, "k_t": 1.0 if k_t is None else k_t, "mu": mu, "preload": preload}
    given["gap"] = gap
    numbers = {name: _spread(value, len(n), name, problems) for name, value in given.items()}
    problems += [f"{name} must be >= 0" for name in ("k_n", "mu") if np.any(numbers[name] < 0)]
    if np.any(numbers["k_t"] <= 0):
        problems.append("k_t must be above 0; for frictionless points give mu = 0")
    problems += [
        f"{name} is not finite"
        for name, a in [("normal", n), ("tangents", t), *numbers.items()]
        if not np.all(np.isfinite(a))
    ]
    if problems:
        raise InputError("contacts: " + "; ".join(problems))
    rows = np.concatenate([n[:, None, :], np.swapaxes(t, 0, 1)], axis=1)
    return Contacts(np.ascontiguousarray(rows), Law(**numbers))


def _spread(value: ArrayLike, n: int, name: str, problems: list[str]) -> FloatArray:
    array = np.asarray(value, dtype=float)
    if array.shape not in ((), (1,), (n,)):
        problems.append(f"{name} has shape {array.shape}; give one number or {n}")
        return np.ones(n)
    # a copy: arrays that cannot be written are types of their own for compiled code
    return np.broadcast_to(array, (n,)).copy()


def frictionless(points: Contacts) -> Contacts:
    """The same points without their tangents.

    For mu = 0, where they carry no traction.
    """
    return replace(points, rows=np.ascontiguousarray(points.rows[:, :1]))


def stuck_stiffness(points: Contacts) -> FloatArray:
    """Stiffness of closed, sticking points; without friction nothing sticks.

    Parameters
    ----------
    points : Contacts

    Returns
    -------
    (n_point, 1 + d) ndarray
        k_n, then k_t per tangent [N/mm].
    """
    sticking = np.where(points.law.mu > 0, points.law.k_t, 0.0)
    k_t = np.repeat(sticking[:, None], points.tangents, axis=1)
    return np.column_stack([points.law.k_n, k_t])


def stuck_constant(points: Contacts, slider: FloatArray | None = None) -> FloatArray:
    """Force of closed, sticking points at zero displacement.

    Parameters
    ----------
    points : Contacts
    slider : (n_point, 2) ndarray, optional
        Positions of the sliders [mm], zero by default.

    Returns
    -------
    (n_point, 1 + d) ndarray
        N_0 - k_n gap, and the tractions -k_t slider [N].
    """
    out = np.zeros(points.rows.shape[:2])
    out[:, 0] = points.law.preload - points.law.k_n * points.law.gap
    if slider is not None:
        out[:, 1:] = -stuck_stiffness(points)[:, 1:] * slider[:, : points.tangents]
    return out
