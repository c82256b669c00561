"""One period of the contact force, compiled: from sample to sample until the traction repeats."""

from __future__ import annotations

import numpy as np

from upd.hbm.springs.coulomb import LIFT, SLIP, STICK, normal, step
from upd.hbm.springs.interval import INPUTS, OUTPUTS, friction_event, normal_corner
from upd.linalg.compiled import compiled, inlined

#: slider start of the march: given positions, middle of the stuck interval, traction at its upper
#: or lower end along the first tangent
GIVEN, MID, UPPER, LOWER = 0, 1, 2, 3
#: End of a period against its start, in units of the largest friction limit: a hundred roundings
#: per sample of a long period.
PERIODIC = 1e-11


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
def _first_trial(w, N, slope, E, point, T, dT):  # type: ignore[no-untyped-def]
    """Trial traction of sample 0 and its derivative, for the chosen start.

    w (1 + d, n), T (2,), dT (2, 1 + d, size).
    """
    _, k_t, mu, mode, slider = point
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
def _normal_forces(w, k_n, preload, gap, signed, force, weighed, slope):  # type: ignore[no-untyped-def]
    """Normal force of one point at all samples, with its corners where the contact opens or closes.

    Fills signed, force, weighed (n,) and slope (3, n).
    """
    n = len(w)
    for j in range(n):
        signed[j] = preload + k_n * (w[j] - gap)
        force[j], _ = normal(w[j], k_n, preload, gap)
        weighed[j] = force[j]
        slope[0, j], slope[1, j], slope[2, j] = 0.0, 1.0 if force[j] > 0.0 else 0.0, 0.0
    for j in range(n):
        i = j - 1 if j > 0 else n - 1
        if (force[i] > 0.0) != (force[j] > 0.0):
            before, after, before_i, before_j, after_i, after_j = normal_corner(
                signed[i], signed[j]
            )
            weighed[i] += before
            weighed[j] += after
            slope[1, i] += before_i
            slope[2, i] += before_j
            slope[0, j] += after_i
            slope[1, j] += after_j


@compiled
def _first_sample(w, N, E, point, T, dT):  # type: ignore[no-untyped-def]
    """Traction of sample 0 from the chosen start, and its derivative. Returns the state."""
    k_n, _, mu, _, _ = point
    d, size = w.shape[0] - 1, E.shape[1]
    slope = np.where(N > 0.0, k_n, 0.0)
    _first_trial(w, N, slope, E, point, T, dT)
    T[0], T[1], P11, P12, P22, n1, n2, state = step(T[0], T[1], N[0], mu)
    if state == LIFT:
        dT[:] = 0.0
    elif state == SLIP:
        for c in range(1 + d):
            for m in range(size):
                x, y = dT[0, c, m], dT[1, c, m]
                dT[0, c, m], dT[1, c, m] = P11 * x + P12 * y, P12 * x + P22 * y
        for m in range(size):
            dT[0, 0, m] += n1 * mu * slope[0] * E[0, m]
            dT[1, 0, m] += n2 * mu * slope[0] * E[0, m]
    return state


@compiled
def _chained(P, dT, k_n, k_t, E_a, E_b, out):  # type: ignore[no-untyped-def]
    """Derivative of one result of an event by the coefficients of the motion.

    P (INPUTS,) is its derivative by what the event depends on, dT (2, 1 + d, size) that of the
    traction before, out (1 + d, size).
    """
    d, size = out.shape[0] - 1, out.shape[1]
    for c in range(1 + d):
        for m in range(size):
            out[c, m] = P[0] * dT[0, c, m] + P[1] * dT[1, c, m]
    a, b = k_n * P[2], k_n * P[3]
    for m in range(size):
        out[0, m] += a * E_a[m] + b * E_b[m]
    for i in range(d):
        a = k_t * P[4 + i]
        for m in range(size):
            out[1 + i, m] += a * (E_b[m] - E_a[m])


@compiled
def _added(row, more):  # type: ignore[no-untyped-def]
    """Add `more` (n,) to a row in place."""
    for m in range(len(row)):
        row[m] += more[m]


@inlined
def _add_corners(j, same, jacobian, event, own, first):  # type: ignore[no-untyped-def]
    """Add the corners of an event before sample j to it and the one before, `same` to that alone.

    `event` has results, their derivatives and these by the coefficients of the motion, `own` the
    weighed tractions and their tangents, `first` what sample 0 leaves for the last one.
    """
    (out, P, rows_new), (weighed, tangent), (corner, corner_tangent) = event, own, first
    b = j - 1
    for i in range(len(corner)):
        if j == 0:
            corner[i] = out[2 + i]
        else:
            weighed[1 + i, b] += out[2 + i]
        if not same:
            weighed[1 + i, j] += out[4 + i]
        if jacobian and np.any(P[2 + i] != 0.0):
            if j == 0:
                corner_tangent[i] = rows_new[2 + i]
            else:
                _added(tangent[i, b], rows_new[2 + i])
        if jacobian and not same and np.any(P[4 + i] != 0.0):
            _added(tangent[i, j], rows_new[4 + i])


@compiled
def march_point(w, E, law, p, start, jacobian, filled):  # type: ignore[no-untyped-def]
    """March one point until its traction repeats.

    Sliding along one line, a point that slips or opens forgets: where a period comes to the same
    traction as the one before, slipping, the rest of it is the same and is not integrated again. A
    point that sticks or is open through its first period does so through all.

    With law and start of all points, of which this is number p, as in `march_points`. Fills force,
    weighed (1 + d, n), state (n,), slope (3, n), tangent (d, n, (1 + d) size).
    """
    k_n, k_t, mu, preload, gap = law[0][p], law[1][p], law[2][p], law[3][p], law[4][p]
    mode, sliders, most = start
    slider = sliders[p]
    force, weighed, state, slope, tangent = filled
    d, n, size = w.shape[0] - 1, w.shape[1], E.shape[1]
    signed = np.empty(n)
    _normal_forces(w[0], k_n, preload, gap, signed, force[0], weighed[0], slope)
    N = force[0]
    T, dT, D = np.zeros(2), np.zeros((2, 1 + d, size)), np.zeros(2)
    out, P = np.zeros(OUTPUTS), np.zeros((OUTPUTS, INPUTS))
    new = np.zeros((OUTPUTS, 1 + d, size))
    rows_T, rows_new = dT.reshape(2, (1 + d) * size), new.reshape(OUTPUTS, (1 + d) * size)
    tolerance = PERIODIC * mu * N.max()
    last1, last2 = np.inf, np.inf
    # the corner before the first sample is shared with the last one, which comes at the end
    corner, corner_tangent = np.zeros(d), np.zeros((d, (1 + d) * size))
    own = (weighed, tangent)
    for period in range(most):
        same, slider_stays = False, period == 0
        for j in range(n):
            b, event, before, traction = j - 1 if j > 0 else n - 1, False, state[j], 0.0
            if d == 1:
                traction = force[1, j]
            if j == 0:
                corner[:] = 0.0
                corner_tangent[:] = 0.0
            if j == 0 and period == 0:
                state[0] = _first_sample(w, N, E, (k_n, k_t, mu, mode, slider), T, dT)
            elif N[j] <= 0.0 and N[b] <= 0.0:
                state[j] = LIFT
            else:
                for i in range(d):
                    D[i] = k_t * (w[1 + i, j] - w[1 + i, b])
                t1, t2, limit = T[0] + D[0], T[1] + D[1], mu * N[j]
                closed = N[j] > 0.0 and N[b] > 0.0
                sticks = abs(t1) <= limit if d == 1 else np.hypot(t1, t2) <= limit
                if closed and sticks:
                    T[0], T[1], state[j] = t1, t2, STICK
                    if jacobian:
                        for i in range(d):
                            for m in range(size):
                                dT[i, 1 + i, m] += k_t * (E[j, m] - E[b, m])
                elif closed and d == 1 and T[0] == np.sign(t1) * (mu * N[b]):
                    T[0], state[j] = np.sign(t1) * limit, SLIP
                    if jacobian:
                        dT[0, 1] = 0.0
                        for m in range(size):
                            dT[0, 0, m] = np.sign(t1) * mu * k_n * E[j, m]
                else:
                    event = True
                    slipped = state[b] == SLIP
                    passed = (T[0], T[1], signed[b], signed[j], D[0], D[1])
                    state[j] = friction_event(passed, mu, slipped, d == 2, jacobian, out, P)
                    T[0], T[1] = out[0], out[1]
                    if jacobian:
                        for c in range(OUTPUTS):
                            if c % 2 < d and (c < 2 or np.any(P[c] != 0.0)):
                                _chained(P[c], dT, k_n, k_t, E[b], E[j], new[c])
                        dT[:d] = new[:d]
            if not same:
                for i in range(d):
                    force[1 + i, j] = T[i]
                    weighed[1 + i, j] = T[i]
                    if jacobian:
                        tangent[i, j] = rows_T[i]
            if event:
                _add_corners(j, same, jacobian, (out, P, rows_new), own, (corner, corner_tangent))
            if same:
                break
            # never slipped, closed or opened
            slider_stays = slider_stays and state[j] == state[0] and state[j] != SLIP
            forgets = d == 1 and period > 0 and state[j] != STICK
            same = forgets and state[j] == before and T[0] == traction
        if slider_stays or (same and j < n - 1):
            finished = True
        else:
            finished = (
                period > 0 and abs(T[0] - last1) <= tolerance and abs(T[1] - last2) <= tolerance
            )
        if finished or period == most - 1:
            for i in range(d):
                weighed[1 + i, n - 1] += corner[i]
                if jacobian:
                    _added(tangent[i, n - 1], corner_tangent[i])
            return finished, period + 1
        last1, last2 = T[0], T[1]
    return False, most


@compiled
def march_points(  # type: ignore[no-untyped-def]
    w, E, law, start, jacobian, filled, periodic, periods
):
    """March every point by itself until its traction repeats, through `most` periods at most.

    Parameters
    ----------
    w : (n_point, 1 + d, n) ndarray
        Relative displacements [mm].
    E : (n, size) ndarray
        Synthesis matrix of the samples.
    law : tuple of (n_point,) ndarray
        k_n, k_t, mu, preload and gap of the points.
    start : tuple
        Start of the sliders: GIVEN, MID, UPPER or LOWER; their positions (n_point, 2) where they
        are given [mm]; most periods.
    jacobian : bool
        Whether the derivative is wanted.
    filled : tuple of ndarray
        Filled with force, weighed, state, slope and tangent of `upd.hbm.springs.points.March`;
        the tangent is not touched without the derivative.
    periodic, periods : ndarray
        Filled likewise.
    """
    force, weighed, state, slope, tangent = filled
    for p in range(w.shape[0]):
        block = tangent[p] if jacobian else tangent[0]
        own = (force[p], weighed[p], state[p], slope[p], block)
        periodic[p], periods[p] = march_point(w[p], E, law, p, start, jacobian, own)
