"""Contact points on the dofs of a linear system: where they act and which law they follow."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.friction import Law

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Contacts:
    """n_point contacts: rows (n_point, 1 + d, n_dof) give the relative displacement (normal, tangents) = rows @ q; law has the numbers."""

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
    k_t: ArrayLike,
    mu: ArrayLike,
    preload: ArrayLike = 0.0,
    gap: ArrayLike = 0.0,
) -> Contacts:
    """Contacts from rows on the dofs of the system; a number given once holds for all points.

    normal (n_point, n_dof): row @ q is the closing displacement [mm]; tangents (d, n_point, n_dof), d = 0, 1 or 2, the sliding ones.
    k_n >= 0, k_t > 0 [N/mm], mu >= 0, preload N_0 [N] and gap [mm] enter as N = max(0, N_0 + k_n (w_n - gap)). With k_n = 0 the normal load
    is constant: a Jenkins element. InputError lists all problems at once.
    """
    n = np.atleast_2d(np.asarray(normal, dtype=float))
    t = np.asarray(tangents, dtype=float)
    t = t.reshape(0, *n.shape) if t.size == 0 else t.reshape(-1, *t.shape[-2:]) if t.ndim > 2 else t.reshape(1, *np.atleast_2d(t).shape)
    problems = (
        [] if t.shape[1:] == n.shape and len(t) <= 2 else [f"tangents have shape {t.shape}; give (d, {n.shape[0]}, {n.shape[1]}), d <= 2"]
    )
    numbers = {name: _spread(value, len(n), name, problems) for name, value in _named(k_n, k_t, mu, preload, gap)}
    problems += [f"{name} must be >= 0" for name in ("k_n", "mu") if np.any(numbers[name] < 0)]
    problems += ["k_t must be above 0; for frictionless points give mu = 0"] if np.any(numbers["k_t"] <= 0) else []
    problems += [f"{name} is not finite" for name, a in [("normal", n), ("tangents", t), *numbers.items()] if not np.all(np.isfinite(a))]
    if problems:
        raise InputError("contacts: " + "; ".join(problems))
    rows = np.concatenate([n[:, None, :], np.swapaxes(t, 0, 1)], axis=1)
    return Contacts(np.ascontiguousarray(rows), Law(**numbers))


def _named(k_n: ArrayLike, k_t: ArrayLike, mu: ArrayLike, preload: ArrayLike, gap: ArrayLike) -> list[tuple[str, ArrayLike]]:
    return [("k_n", k_n), ("k_t", k_t), ("mu", mu), ("preload", preload), ("gap", gap)]


def _spread(value: ArrayLike, n: int, name: str, problems: list[str]) -> FloatArray:
    array = np.asarray(value, dtype=float)
    if array.shape not in ((), (1,), (n,)):
        problems.append(f"{name} has shape {array.shape}; give one number or {n}")
        return np.ones(n)
    return np.ascontiguousarray(np.broadcast_to(array, (n,)))


def frictionless(points: Contacts) -> Contacts:
    """The same points without their tangents: for mu = 0, where they carry no traction."""
    return replace(points, rows=np.ascontiguousarray(points.rows[:, :1]))


def stuck_stiffness(points: Contacts) -> FloatArray:
    """Stiffness (n_point, 1 + d) of closed, sticking points: k_n, then k_t per tangent."""
    k_t = np.repeat(points.law.k_t[:, None], points.tangents, axis=1)
    return np.column_stack([points.law.k_n, k_t])


def stuck_constant(points: Contacts) -> FloatArray:
    """Force (n_point, 1 + d) of closed, sticking points at zero displacement: N_0 - k_n gap and no traction."""
    out = np.zeros(points.rows.shape[:2])
    out[:, 0] = points.law.preload - points.law.k_n * points.law.gap
    return out
