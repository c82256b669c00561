"""Contact with Coulomb friction at points: force and exact discrete Jacobian of a periodic motion.

One point: relative displacement w = (w_n, w_t1, w_t2), w_n > 0 closing;
N = max(0, N_0 + k_n (w_n - gap)); the traction is that of a spring k_t in series with a slider
that holds up to mu N in any direction of the plane. The force opposes closing and sliding. Both
come from one compiled march through the period.

References
----------
Return mapping as in plasticity: J. C. Simo and T. J. R. Hughes, Computational Inelasticity
(1998), 1.4. Friction in three dimensions with variable normal load: C. Siewert et al., J. Eng.
Gas Turbines Power 132 (2010) 082501.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.hbm.compiled import compiled

FloatArray = NDArray[np.float64]
Start = Literal["zero", "static", "mid", "upper", "lower"]

STICK, SLIP, LIFT = 0, 1, 2
#: slider start of the march: given positions, middle of the stuck interval, traction at its upper
#: or lower end along the first tangent
GIVEN, MID, UPPER, LOWER = 0, 1, 2, 3
START_CODE = {"zero": GIVEN, "static": GIVEN, "mid": MID, "upper": UPPER, "lower": LOWER}
#: Friction in one direction forgets its start within one period; in two directions the memory fades
#: geometrically while it slips.
MOST_PERIODS = 40
#: End of a period against its start, in units of the largest friction limit: a hundred roundings
#: per sample of a long period.
PERIODIC = 1e-11


@dataclass(frozen=True)
class Law:
    """Parameters of the contact points.

    The law itself is `normal` and `coulomb` below, shared by harmonic balance and time march. To
    add a law:

    1. write its step beside `coulomb`, with the same arguments and results: the new force, its
       derivative by the trial force (P11, P12, P22), the derivative by the limit (n1, n2) and the
       state (STICK, SLIP, LIFT);
    2. give `Law` the parameters it needs and a number that chooses it, and branch on that number in
       `step`;
    3. add the law to the Jacobian test in tests/property/test_hbm_property.py: it covers every
    state
       by differences.

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

    def tiled(self, n: int) -> Law:
        """The same points n times over."""
        return Law(*(np.tile(getattr(self, f.name), n) for f in fields(self)))


@dataclass(frozen=True)
class March:
    """One period of the contact force, n samples.

    Attributes
    ----------
    force : (n_point, 1 + d, n) ndarray
        Normal force and tractions [N].
    state : (n_point, n) ndarray of int8
        STICK, SLIP or LIFT.
    tangent : (n_point, d, n, (1 + d) size) ndarray or None
        Derivative of the traction by the coefficients of the motion [N/mm].
    periodic : (n_point,) ndarray of bool
        Whether each point came back to its start.
    periods : (n_point,) ndarray of int
        The periods it took.
    """

    force: FloatArray
    state: NDArray[np.int8]
    tangent: FloatArray | None
    periodic: NDArray[np.bool_]
    periods: NDArray[np.int64]


@compiled
def normal(w, k_n, preload, gap):  # type: ignore[no-untyped-def]
    """Normal force of one point.

    Parameters
    ----------
    w : float
        Closing displacement [mm].
    k_n, preload, gap : float
        Parameters of the point [N/mm, N, mm].

    Returns
    -------
    N, slope : float
        Normal force N >= 0 [N] and its derivative by w [N/mm].
    """
    N = preload + k_n * (w - gap)
    if N > 0.0:
        return N, k_n
    return 0.0, 0.0


@compiled
def coulomb(t1, t2, limit):  # type: ignore[no-untyped-def]
    """Traction from the trial traction: radial return onto the circle.

    Parameters
    ----------
    t1, t2 : float
        Trial traction [N].
    limit : float
        mu N [N].

    Returns
    -------
    T1, T2 : float
        Traction [N].
    P11, P12, P22 : float
        Derivative by the trial traction, symmetric.
    n1, n2 : float
        Derivative by the limit.
    state : int
        STICK or SLIP.
    """
    r = np.hypot(t1, t2)
    if r <= limit:
        return t1, t2, 1.0, 0.0, 1.0, 0.0, 0.0, STICK
    n1, n2, c = t1 / r, t2 / r, limit / r
    return limit * n1, limit * n2, c * n2 * n2, -c * n1 * n2, c * n1 * n1, n1, n2, SLIP


@compiled
def step(t1, t2, N, mu):  # type: ignore[no-untyped-def]
    """One step of the law at one point; open contact carries nothing and forgets its slider.

    Parameters
    ----------
    t1, t2 : float
        Trial traction [N].
    N : float
        Normal force [N].
    mu : float
        Friction coefficient.

    Returns
    -------
    T1, T2, P11, P12, P22, n1, n2, state
        As `coulomb` returns them; zeros and LIFT for an open contact.
    """
    if N <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, LIFT
    return coulomb(t1, t2, mu * N)


@compiled
def _interval(w, N, half, sign):  # type: ignore[no-untyped-def]
    """One end of the stuck interval.

    The sample where sign (w - sign half N) is largest while in contact, -1 if always open.
    """
    best, where = -np.inf, -1
    for j in range(len(w)):
        if N[j] > 0.0:
            value = sign * w[j] - half * N[j]
            if value > best:
                best, where = value, j
    return where


@compiled
def _first_trial(w, N, slope, E, k_t, mu, mode, slider, T, dT):  # type: ignore[no-untyped-def]
    """Trial traction of sample 0 and its derivative, for the chosen start.

    w (1 + d, n), T (2,), dT (2, 1 + d, size).
    """
    d = w.shape[0] - 1
    for i in range(d):
        T[i] = k_t * (w[1 + i, 0] - slider[i])
        dT[i, 1 + i, :] = k_t * E[0]
        if mode == MID:
            lower, upper = (
                _interval(w[1 + i], N, mu / k_t, 1.0),
                _interval(w[1 + i], N, mu / k_t, -1.0),
            )
            for end, sign in ((lower, 1.0), (upper, -1.0)):
                if end >= 0:
                    T[i] -= 0.5 * (k_t * w[1 + i, end] - sign * mu * N[end]) - 0.5 * k_t * slider[i]
                    dT[i, 1 + i, :] -= 0.5 * k_t * E[end]
                    dT[i, 0, :] += 0.5 * sign * mu * slope[end] * E[end]
    if mode in (UPPER, LOWER):
        sign = 1.0 if mode == UPPER else -1.0
        T[:] = 0.0
        dT[:] = 0.0
        T[0] = sign * mu * N[0]
        dT[0, 0, :] = sign * mu * slope[0] * E[0]


@compiled
def _march_point(  # type: ignore[no-untyped-def]
    w, E, k_n, k_t, mu, preload, gap, mode, slider, most, jacobian, force, state, tangent
):
    """March one point until its traction repeats.

    Fills force (1 + d, n), state (n,), tangent (d, n, (1 + d) size).
    """
    d, n, size = w.shape[0] - 1, w.shape[1], E.shape[1]
    N, slope = np.empty(n), np.empty(n)
    for j in range(n):
        N[j], slope[j] = normal(w[0, j], k_n, preload, gap)
        force[0, j] = N[j]
    T, dT = np.zeros(2), np.zeros((2, 1 + d, size))
    _first_trial(w, N, slope, E, k_t, mu, mode, slider, T, dT)
    tolerance = PERIODIC * mu * N.max()
    last1, last2 = np.inf, np.inf
    for period in range(most):
        for j in range(n):
            before = j - 1 if j > 0 else n - 1
            if period > 0 or j > 0:
                for i in range(d):
                    T[i] += k_t * (w[1 + i, j] - w[1 + i, before])
            T[0], T[1], P11, P12, P22, n1, n2, state[j] = step(T[0], T[1], N[j], mu)
            for i in range(d):
                force[1 + i, j] = T[i]
            if not jacobian:
                continue
            if period > 0 or j > 0:
                for i in range(d):
                    for m in range(size):
                        dT[i, 1 + i, m] += k_t * (E[j, m] - E[before, m])
            if state[j] == LIFT:
                dT[:] = 0.0
            elif state[j] == SLIP:
                for c in range(1 + d):
                    for m in range(size):
                        x, y = dT[0, c, m], dT[1, c, m]
                        dT[0, c, m], dT[1, c, m] = P11 * x + P12 * y, P12 * x + P22 * y
                for m in range(size):
                    dT[0, 0, m] += n1 * mu * slope[j] * E[j, m]
                    dT[1, 0, m] += n2 * mu * slope[j] * E[j, m]
            for i in range(d):
                for c in range(1 + d):
                    for m in range(size):
                        tangent[i, j, c * size + m] = dT[i, c, m]
        if period > 0 and abs(T[0] - last1) <= tolerance and abs(T[1] - last2) <= tolerance:
            return True, period + 1
        last1, last2 = T[0], T[1]
    return False, most


@compiled
def _march(  # type: ignore[no-untyped-def]
    w,
    E,
    k_n,
    k_t,
    mu,
    preload,
    gap,
    mode,
    slider,
    most,
    jacobian,
    force,
    state,
    tangent,
    periodic,
    periods,
):
    for p in range(w.shape[0]):
        block = tangent[p] if jacobian else tangent[0]
        periodic[p], periods[p] = _march_point(
            w[p],
            E,
            k_n[p],
            k_t[p],
            mu[p],
            preload[p],
            gap[p],
            mode,
            slider[p],
            most,
            jacobian,
            force[p],
            state[p],
            block,
        )


def march(
    law: Law,
    w: FloatArray,
    E: FloatArray,
    *,
    start: Start = "zero",
    slider: FloatArray | None = None,
    jacobian: bool = True,
) -> March:
    """Periodic contact force of all points along a motion.

    Parameters
    ----------
    law : Law
    w : (n_point, 1 + d, n) ndarray
        Relative displacements [mm] at n samples, d = 0, 1 or 2 tangents.
    E : (n, size) ndarray
        Synthesis matrix of the samples, see `upd.hbm.fourier.synthesis`.
    start : {"zero", "static", "mid", "upper", "lower"}
        Position of the sliders before the march: zero, given positions, the middle of the stuck
        interval, or the traction at its upper or lower end along the first tangent.
    slider : (n_point, 2) ndarray, optional
        Slider positions [mm] before the march for start "zero" (not given) and "static".
    jacobian : bool
        Whether the derivative is wanted; it is exact for the discrete march, through all its
        periods.

    Returns
    -------
    March
    """
    n_point, rows, n = w.shape
    size = E.shape[1]
    force, state = np.zeros((n_point, rows, n)), np.zeros((n_point, n), dtype=np.int8)
    tangent = np.zeros((n_point, rows - 1, n, rows * size) if jacobian else (1, 0, 0, 0))
    periodic, periods = np.zeros(n_point, dtype=np.bool_), np.zeros(n_point, dtype=np.int64)
    slider = np.zeros((n_point, 2)) if slider is None else slider
    _march(
        w,
        E,
        law.k_n,
        law.k_t,
        law.mu,
        law.preload,
        law.gap,
        START_CODE[start],
        slider,
        MOST_PERIODS,
        jacobian,
        force,
        state,
        tangent,
        periodic,
        periods,
    )
    return March(force, state, tangent if jacobian else None, periodic, periods)


@dataclass(frozen=True)
class Harmonic:
    """Coefficients of the contact force.

    Attributes
    ----------
    force : (n_point, 1 + d, size) ndarray
        Coefficients [N].
    jacobian : (n_point, 1 + d, size, 1 + d, size) ndarray or None
        Derivative by the coefficients of the motion [N/mm].
    march : March
        The period they were taken from.
    """

    force: FloatArray
    jacobian: FloatArray | None
    march: March


def harmonic_force(
    law: Law,
    X: FloatArray,
    E: FloatArray,
    Q: FloatArray,
    *,
    start: Start = "zero",
    slider: FloatArray | None = None,
    jacobian: bool = True,
) -> Harmonic:
    """Coefficients of the contact force for those of the motion (alternating frequency/time).

    Parameters
    ----------
    law : Law
    X : (n_point, 1 + d, size) ndarray
        Coefficients of the relative displacements [mm].
    E : (n, size) ndarray
        Synthesis matrix of the samples.
    Q : (size, n) ndarray
        Analysis matrix of the samples.
    start, slider, jacobian
        As in `march`.

    Returns
    -------
    Harmonic
    """
    n_point, rows, size = X.shape
    result = march(
        law, np.ascontiguousarray(X @ E.T), E, start=start, slider=slider, jacobian=jacobian
    )
    force = result.force @ Q.T
    if result.tangent is None:
        return Harmonic(force, None, result)
    J = np.zeros((n_point, rows, size, rows, size))
    closed = result.state != LIFT
    J[:, 0, :, 0, :] = law.k_n[:, None, None] * _normal_block(closed, E, Q)
    if rows > 1:
        J[:, 1:] = np.matmul(Q, result.tangent).reshape(n_point, rows - 1, size, rows, size)
    return Harmonic(force, J, result)


def _normal_block(closed: NDArray[np.bool_], E: FloatArray, Q: FloatArray) -> FloatArray:
    """Q diag(closed) E of every point, (n_point, size, size).

    The identity where the contact never opens.
    """
    size = E.shape[1]
    block = np.broadcast_to(np.eye(size), (len(closed), size, size)).copy()
    for p in np.flatnonzero(~closed.all(axis=1)):
        block[p] = (Q * closed[p]) @ E
    return block
