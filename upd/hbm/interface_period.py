"""The steps of a period of `upd.hbm.interface_march`, compiled."""

from __future__ import annotations

import numpy as np

from upd.hbm.compiled import compiled
from upd.hbm.interface_step import contact_step


@compiled
def say(weights, c, Z, x0):  # type: ignore[no-untyped-def]
    """What a base says of the state, c + weights Z.

    Parameters
    ----------
    weights : (k,) ndarray
    c : (3 n,) ndarray
    Z : (k, 3 n) ndarray
    x0 : (3 n,) ndarray
        Overwritten.
    """
    size = len(c)
    for d in range(size):
        x0[d] = c[d]
    for j in range(len(weights)):
        weight = weights[j]
        for d in range(size):
            x0[d] += weight * Z[j, d]


@compiled
def bring_up(c, w, slip, Tt, base):  # type: ignore[no-untyped-def]
    """Bring c = -L W w_ref of a base up to the slips that were made since.

    Parameters
    ----------
    c : (3 n,) ndarray
        Overwritten.
    w : (2 n,) ndarray
        Sums of slips it is for; overwritten by `slip`.
    slip : (2 n,) ndarray
        Sums of slips now.
    Tt, base
        As `contact_step`.
    """
    n = len(base)
    for d in range(2 * n):
        moved = slip[d] - w[d]
        if moved != 0.0:
            w[d] = slip[d]
            if base[d % n]:
                # L W of a node that is open in the base
                c[n + d] -= moved
            else:
                row = Tt[n + d]
                for e in range(3 * n):
                    c[e] -= moved * row[e]


@compiled
def march_steps(  # type: ignore[no-untyped-def]
    first,
    last,
    given,
    dt,
    drive,
    blades,
    taken,
    inverse_mass,
    load,
    Z,
    Tt,
    bases,
    which,
    mu,
    rho_n,
    rho_t,
    loss,
    places,
    bias,
    seen_modes,
    seen_drive,
    q,
    v,
    p,
    s,
    sv,
    sa,
    f,
    y,
    slip,
    state,
    c,
    w,
    known,
    forces,
    moves,
    states,
    x0,
    work,
    out,
    newton,
    energy,
):
    """March samples first + 1 to last of a period.

    Parameters
    ----------
    first, last : int
        Samples.
    given : bool
        Whether the first step was solved elsewhere: x0 (its forces), y and state hold its answer.
    dt : float
        Step [s].
    drive : (N + 1, L) ndarray
        Excitation at the samples [N].
    blades : (8, m) ndarray
        Step of each mode: q by q, v, and by its force before and after; v by the same.
    taken : (3 n, m + r + K + L) ndarray
        What contact forces do to modes, rigid motions, outputs and places of excitation.
    inverse_mass, load : (r, r) and (r,) ndarray
        Of the damper.
    Z : (B, r + m + L, 3 n) ndarray
        What each base says by predicted rigid motions, modes and excitation.
    Tt : (B, 3 n, 3 n) ndarray
        As `contact_step`, of each base.
    bases : (B, n) ndarray of bool
        Which nodes each has open.
    which : (N,) ndarray of int
        The base to use at each sample.
    mu, rho_n, rho_t
        As `contact_step`.
    loss : (m,) ndarray
        2 zeta omega.
    places : (m, L) ndarray
        Modes at the places of excitation.
    bias : (m,) ndarray
        Constant added to the modal forces [N].
    seen_modes, seen_drive : (K, m), (K, L) ndarray
        What the outputs are made of.
    q, v, p : (m,) ndarray
        Modes, their velocities and forces; overwritten.
    s, sv, sa : (r,) ndarray
        Damper's motion, velocity and acceleration; overwritten.
    f, y, slip, state : ndarray
        Forces (3 n,), last relative motions (3 n,), sums of slips (2 n,) and states (n,);
        overwritten.
    c, w : (B, 3 n), (B, 2 n) ndarray
        -L W w_ref of each base, and the sums of slips it is for; overwritten.
    known : bool
        Whether forces, moves and states hold a period: its samples are then what the steps start
        from.
    forces, moves, states : (N, 3 n), (N, 3 n), (N, n) ndarray
        Forces, relative motions and states of every sample; overwritten.
    x0, work : ndarray
        Scratch (3 n,) and (3 n, 3 n); x0 is what the base said of the last step.
    out : (N, K) ndarray
        Outputs, overwritten from `first` on.
    newton : (1,) ndarray of int
        Newton steps; added to.
    energy : (3,) ndarray
        Work of the excitation, lost by damping and by friction [N mm]; added to.

    Returns
    -------
    int
        Where it ended: `last`, or the sample before a step without an answer.
    """
    n, m, r, L = len(mu), len(q), len(s), drive.shape[1]
    K = out.shape[1]
    zq, p1, told = np.empty(m), np.empty(m), np.empty(r + m + L)
    back, felt = np.zeros(m + r + K + L), np.zeros(L)
    before, pull = np.empty(3 * n), np.empty(r)
    slid, was = np.empty(3 * n), np.empty(n, np.int64)
    for d in range(3 * n):
        for place in range(L):
            felt[place] += f[d] * taken[d, m + r + K + place]
    for step in range(first, last):
        for j in range(m):
            zq[j] = blades[0, j] * q[j] + blades[1, j] * v[j] + blades[2, j] * p[j]
            zq[j] += (blades[2, j] + blades[3, j]) * bias[j]
            p1[j] = 0.0
            for place in range(L):
                p1[j] += places[j, place] * drive[step + 1, place]
            zq[j] += blades[3, j] * p1[j]
            told[r + j] = zq[j]
        for j in range(r):
            told[j] = s[j] + dt * sv[j]
            for i in range(r):
                told[j] += 0.5 * dt * dt * inverse_mass[j, i] * load[i]
        for place in range(L):
            told[r + m + place] = drive[step + 1, place]
        before[:] = f
        if given and step == first:
            f[:] = x0
            used = 0
        else:
            one = which[step]
            bring_up(c[one], w[one], slip, Tt[one], bases[one])
            say(told, c[one], Z[one], x0)
            if known:
                slid[:], was[:] = y, state
                f[:], y[:], state[:] = forces[step], moves[step], states[step]
            used = contact_step(x0, Tt[one], bases[one], mu, rho_n, rho_t, f, y, state, True, work)
            if used < 0 and known:
                f[:], y[:], state[:] = before, slid, was
                used = contact_step(
                    x0, Tt[one], bases[one], mu, rho_n, rho_t, f, y, state, True, work
                )
            if used < 0:
                used = contact_step(
                    x0, Tt[one], bases[one], mu, rho_n, rho_t, f, y, state, False, work
                )
            if used < 0:
                f[:] = before
                return step
        back[:] = 0.0
        for d in range(3 * n):
            if f[d] != 0.0:
                for j in range(m + r + K + L):
                    back[j] += f[d] * taken[d, j]
        for place in range(L):
            mean, moved = 0.5 * (drive[step, place] + drive[step + 1, place]), 0.0
            for j in range(m):
                moved += places[j, place] * (zq[j] + blades[3, j] * back[j] - q[j])
            moved += back[m + r + K + place] - felt[place]
            felt[place] = back[m + r + K + place]
            energy[0] += mean * moved
        for j in range(m):
            p1[j] += back[j]
            old_q, old_v = q[j], v[j]
            q[j] = zq[j] + blades[3, j] * back[j]
            v[j] = blades[4, j] * old_q + blades[5, j] * old_v
            v[j] += blades[6, j] * (p[j] + bias[j]) + blades[7, j] * (p1[j] + bias[j])
            p[j] = p1[j]
            energy[1] += 0.5 * dt * loss[j] * (old_v * old_v + v[j] * v[j])
        for j in range(r):
            pull[j] = load[j] - back[m + j]
        for j in range(r):
            total = 0.0
            for i in range(r):
                total += inverse_mass[j, i] * pull[i]
            s[j] += dt * sv[j] + 0.5 * dt * dt * total
            sv[j] += dt * (0.25 * sa[j] + 0.75 * total)
            sa[j] = 0.5 * (sa[j] + total)
        for d in range(n, 3 * n):
            if y[d] != 0.0:
                slip[d - n] += y[d]
                energy[2] += 0.5 * (before[d] + f[d]) * y[d]
        newton[0] += used
        forces[step], moves[step], states[step] = f, y, state
        for one in range(K):
            total = back[m + r + one]
            for j in range(m):
                total += seen_modes[one, j] * q[j]
            for place in range(L):
                total += seen_drive[one, place] * drive[step + 1, place]
            out[step, one] = total
    return last
