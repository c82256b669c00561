"""Contact points on the dofs of a system, and their law: Coulomb friction.

One point: relative displacement w = (w_n, w_t1, w_t2), w_n > 0 closing;
N = max(0, N_0 + k_n (w_n - gap)); the traction is that of a spring k_t in series with a slider
that holds up to mu N in any direction of the plane. The force opposes closing and sliding. Both
come from one compiled march through the period, exact for a motion that is straight between the
samples: see `upd.hbm.springs.interval` for what happens between them.

References
----------
Return mapping as in plasticity: J. C. Simo and T. J. R. Hughes, Computational Inelasticity
(1998), 1.4. Friction in three dimensions with variable normal load: C. Siewert et al., J. Eng.
Gas Turbines Power 132 (2010) 082501.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.springs.period import GIVEN, LOWER, MID, UPPER, march_points
from upd.labels import Shown

FloatArray = NDArray[np.float64]
Start = Literal["zero", "frictionless", "static", "mid", "upper", "lower"]

START_CODE = {"zero": GIVEN, "static": GIVEN, "mid": MID, "upper": UPPER, "lower": LOWER}
#: Friction in one direction forgets its start within one period; in two directions the memory fades
#: geometrically while it slips.
MOST_PERIODS = 40


@dataclass(frozen=True, repr=False)
class Law(Shown):
    """Parameters of the contact points.

    The law itself is in `upd.hbm.springs.coulomb`, shared by harmonic balance and time
    integration, and its closed form over a straight piece of the motion in
    `upd.hbm.springs.interval`. To add a law:

    1. write its step beside `coulomb`, with the same arguments and results: the new force, its
       derivative by the trial force (P11, P12, P22), the derivative by the limit (n1, n2) and the
       state (STICK, SLIP, LIFT);
    2. write what it does over an interval beside `friction_event`, with the same arguments and
       results;
    3. give `Law` the parameters it needs and a number that chooses it, and branch on that number in
       `step` and in `upd.hbm.springs.period`;
    4. add the law to the tests of the Jacobian in tests/property/test_hbm_property.py and of the
       order in tests/analytic/test_hbm_friction.py.

    Nothing else knows how the force comes about.

    Attributes
    ----------
    k_n, k_t : (n_point,) ndarray
        Normal and tangential stiffness [N/mm].
    mu : (n_point,) ndarray
        Friction coefficient.
    preload : (n_point,) ndarray
        N_0 [N].
    gap : (n_point,) ndarray
        Gap [mm].
    """

    k_n: FloatArray
    k_t: FloatArray
    mu: FloatArray
    preload: FloatArray
    gap: FloatArray

    @cached_property
    def arrays(self) -> tuple[FloatArray, ...]:
        """Its arrays in the order of its fields, as compiled code takes them."""
        return tuple(getattr(self, f.name) for f in fields(self))

    def tiled(self, n: int) -> Law:
        """The same points n times over."""
        return Law(*(np.tile(one, n) for one in self.arrays))


@dataclass(frozen=True)
class March:
    """One period of the contact force, n samples.

    Attributes
    ----------
    force : (n_point, 1 + d, n) ndarray
        Normal force and tractions [N].
    weighed : (n_point, 1 + d, n) ndarray
        The same with the corners between the samples, which its coefficients are taken from [N].
    state : (n_point, n) ndarray of int8
        STICK, SLIP or LIFT.
    periodic : (n_point,) ndarray of bool
        Whether each point came back to its start.
    periods : (n_point,) ndarray of int
        The periods it took.
    """

    force: FloatArray
    weighed: FloatArray
    state: NDArray[np.int8]
    periodic: NDArray[np.bool_]
    periods: NDArray[np.int64]

    def coefficients(self, Q: FloatArray) -> FloatArray:
        """Coefficients of the force.

        Parameters
        ----------
        Q : (size, n) ndarray
            Analysis matrix of the samples, see `upd.hbm.core.fourier.analysis`.

        Returns
        -------
        (..., 1 + d, size) ndarray
            Coefficients [N].
        """
        return self.weighed @ Q.T


def march(
    law: Law,
    w: FloatArray,
    E: FloatArray,
    *,
    start: Start = "zero",
    slider: FloatArray | None = None,
    most: int = MOST_PERIODS,
) -> March:
    """Periodic contact force of all points along a motion.

    Parameters
    ----------
    law : Law
    w : (n_point, 1 + d, n) ndarray
        Relative displacements [mm] at n samples, d = 0, 1 or 2 tangents.
    E : (n, size) ndarray
        Synthesis matrix of the samples, see `upd.hbm.core.fourier.synthesis`.
    start : {"zero", "static", "mid", "upper", "lower"}
        Position of the sliders before the march: zero, given positions, the middle of the stuck
        interval, or the traction at its upper or lower end along the first tangent.
    slider : (n_point, 2) ndarray, optional
        Slider positions [mm] before the march for start "zero" (not given) and "static".
    most : int
        Periods at most.

    Returns
    -------
    March
    """
    n_point, rows, n = w.shape
    force, weighed = np.zeros((n_point, rows, n)), np.zeros((n_point, rows, n))
    state = np.zeros((n_point, n), dtype=np.int8)
    periodic, periods = np.zeros(n_point, dtype=np.bool_), np.zeros(n_point, dtype=np.int64)
    begin = (START_CODE[start], np.zeros((n_point, 2)) if slider is None else slider, most)
    slope, tangent = np.zeros((n_point, 3, n)), np.zeros((1, 0, 0, 0))
    filled = (force, weighed, state, slope, tangent)
    march_points(w, E, law.arrays, begin, False, filled, periodic, periods)
    return March(force, weighed, state, periodic, periods)


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
    t = t.reshape(-1, *np.atleast_2d(t).shape[-2:]) if t.size else t.reshape(0, *n.shape)
    problems = []
    if t.shape[1:] != n.shape or len(t) > 2:
        problems.append(
            f"tangents have shape {t.shape}; give (d, {n.shape[0]}, {n.shape[1]}), d <= 2"
        )
    if k_t is None and len(t) and np.any(np.asarray(mu, dtype=float) > 0):
        problems.append(
            "k_t is missing; to fix it: give the tangential stiffness of the points with friction"
        )
    values = (k_n, 1.0 if k_t is None else k_t, mu, preload, gap)
    given = zip(("k_n", "k_t", "mu", "preload", "gap"), values, strict=True)
    numbers = {name: _spread(value, len(n), name, problems) for name, value in given}
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
