"""The steps of a period of `upd.hbm.faces.march`, and the bases that suit them, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.faces.kept import solve_sample
from upd.hbm.faces.step import OPEN, add_rows, contact_scratch, fetch_row, put, put_row
from upd.linalg.compiled import compiled, inlined

FloatArray = NDArray[np.float64]


class StepParts(NamedTuple):
    """What all steps at one frequency share.

    n nodes, m modes, r rigid motions, L places of excitation, K outputs, N samples.

    Attributes
    ----------
    dt : float
        Step [s].
    drive : (N + 1, L) ndarray
        Excitation at the samples [N].
    blades : (8, m) ndarray
        Step of each mode: q by q, v, and by its force before and after; v by the same.
    modes : tuple of ndarray
        2 zeta omega (m,), modes at the places of excitation (m, L), and what of the modal forces at
        rest is added to them (m,).
    taken : (3 n, m + r + K + L) ndarray
        What contact forces do to modes, rigid motions, outputs and places of excitation.
    damper : tuple of ndarray
        Inverse mass (r, r) and static load (r,).
    gap : (n,) ndarray
        Gap before any load [mm].
    law : tuple of three (n,) ndarray
        Friction; weights rho_n, rho_t of displacements against forces [N/mm].
    seen : tuple of ndarray
        What the outputs are made of: by modes (K, m), by the excitation (K, L).
    springs : (3 n,) ndarray
        Compliance of each node's own springs, zero without [mm/N].
    """

    dt: float
    drive: FloatArray
    blades: FloatArray
    modes: tuple[FloatArray, FloatArray, FloatArray]
    taken: FloatArray
    damper: tuple[FloatArray, FloatArray]
    gap: FloatArray
    law: tuple[FloatArray, FloatArray, FloatArray]
    seen: tuple[FloatArray, FloatArray]
    springs: FloatArray


class Bases(NamedTuple):
    """Sets of nodes that steps may take for open, B of them.

    Attributes
    ----------
    open : (B, n) ndarray of bool
    Tt : (B, 3 n, 3 n) ndarray
        As `upd.hbm.faces.step.contact_step`, of each.
    Z : (B, r + m + L, 3 n) ndarray
        What each gives by predicted rigid motions, modes and excitation.
    """

    open: NDArray[np.bool_]
    Tt: FloatArray
    Z: FloatArray


class Past(NamedTuple):
    """Forces, relative motions (N, 3 n) and states (N, n) of the samples of a period.

    Attributes
    ----------
    force, move : (N, 3 n) ndarray
    state : (N, n) ndarray of int
    kept, inverses : ndarray
        As of `upd.hbm.faces.kept.kept_inverses`.
    """

    force: FloatArray
    move: FloatArray
    state: NDArray[np.int64]
    kept: NDArray[np.int64]
    inverses: FloatArray


@inlined
def bring_up(c, w, slip, Tt, base, one):  # type: ignore[no-untyped-def]
    """Bring c = -L W w_ref of a base up to the slips that were made since.

    Parameters
    ----------
    c : (B, 3 n) ndarray
        Overwritten.
    w : (B, 2 n) ndarray
        Sums of slips it is for; overwritten by `slip`.
    slip : (2 n,) ndarray
        Sums of slips now.
    Tt, base, one
        As `contact_step`.
    """
    n = base.shape[1]
    for d in range(2 * n):
        moved = slip[d] - w[one, d]
        if moved != 0.0:
            w[one, d] = slip[d]
            if base[one, d % n]:
                # L W of a node that is open in the base
                c[one, n + d] -= moved
            else:
                for e in range(3 * n):
                    c[one, e] -= moved * Tt[one, n + d, e]


@compiled
def begin(bases, gap, slip):  # type: ignore[no-untyped-def]
    """-L W w_ref of each base, anew every period so that its rounding does not add up.

    Parameters
    ----------
    bases : Bases
    gap, slip : (n,), (2 n,) ndarray
        Gap before any load, sums of slips [mm].

    Returns
    -------
    c, w : (B, 3 n), (B, 2 n) ndarray
        And the sums of slips it is for.
    """
    bases_open, bases_Tt, _ = bases
    B, n = bases_open.shape
    c, w = np.zeros((B, 3 * n)), np.empty((B, 2 * n))
    for one in range(B):
        w[one] = slip
        for d in range(3 * n):
            ref = gap[d] if d < n else slip[d - n]
            if ref == 0.0:
                continue
            if bases_open[one, d % n]:
                c[one, d] -= ref
            else:
                for e in range(3 * n):
                    c[one, e] -= ref * bases_Tt[one, d, e]
    return c, w


@inlined
def touch(f, y, state, slid, was, springs, moved):  # type: ignore[no-untyped-def]
    """Let nodes that closed within a step have slipped until they touched.

    The end of a node's spring u = w + f / k, the spring's force f, moves steadily in a step: it
    touches after the share a = g_0 / (g_0 + f_n / k_n) of it, g_0 the gap before. Until then the
    slider goes along, a (u_1 - u_0) with u_1 - u_0 = dw_t + f_t / k_t; afterwards traction and
    pressure grow in one ratio, so that it sticks or slips to the end. The step itself, which has
    the node stick from its beginning, makes the slip too small by an error of the first order in
    the step's length, which lasts as long as the node sticks. What is missing is added to the slip
    that the step leaves behind, so that only the traction at the end of this step is off.

    Parameters
    ----------
    f, y : (3 n,) ndarray
        At the end of the step: forces [N]; minus gaps, and slips of it [mm].
    state : (n,) ndarray of int
    slid, was : ndarray
        y and state before it.
    springs : (3 n,) ndarray
        As in `StepParts`; a node without them does nothing here.
    moved : (3 n,) ndarray
        As y, what the step leaves behind; slips are added to.
    """
    n = len(state)
    for i in range(n):
        if was[i] != OPEN or state[i] == OPEN:
            continue
        depth = springs[i] * f[i]
        if depth <= 0.0:
            continue
        gone = -slid[i] / (depth - slid[i])
        u1, u2 = (
            y[n + i] + springs[n + i] * f[n + i],
            y[2 * n + i] + springs[2 * n + i] * f[2 * n + i],
        )
        way, made = np.sqrt(u1 * u1 + u2 * u2), np.sqrt(y[n + i] ** 2 + y[2 * n + i] ** 2)
        if gone * way > made:
            more = gone - made / way
            moved[n + i] += more * u1
            moved[2 * n + i] += more * u2


@compiled
def march_steps(  # type: ignore[no-untyped-def]
    first, given, parts, bases, which, at, past, filled
):
    """March samples first + 1 to N of a period.

    Parameters
    ----------
    first : int
        Sample before the first step.
    given : bool
        Whether the first step was solved elsewhere: x0 (its forces), y and state hold its answer.
    parts : StepParts
    bases : Bases
    which : (N,) ndarray of int
        The base to use at each sample.
    at : tuple of ndarray
        `upd.hbm.faces.state.InterfaceState.arrays`.
        Overwritten.
    past : tuple
        Whether it holds a period, whose samples are then what the steps start from; `Past`,
        overwritten.
    filled : tuple of ndarray
        (3 n,) what the base gave of the last step, overwritten; (N, K) outputs, overwritten from
        `first` on; (4,) work of the excitation, lost by damping and by friction [N mm], Newton
        steps, added to.

    Returns
    -------
    int
        Where it ended: N, or the sample before a step without an answer.
    """
    dt, drive, blades, modes, taken, damper, gap, law, outputs, springs = parts
    loss, places, held_share = modes
    inverse_mass, load = damper
    seen_modes, seen_drive = outputs
    q, v, p, s, sv, sa, f, y, slip, state, held = at
    bases_open, Tt, Z = bases
    _, forces, moves, states, _, _ = past
    x0, out, sums = filled
    suited = (bases_open, Tt)
    bias = held_share * held
    c, w = begin(bases, gap, slip)
    scratch = contact_scratch(len(gap))
    n, m, r, L = len(gap), len(q), len(s), drive.shape[1]
    K, wide = out.shape[1], taken.shape[1]
    seen, carried, weights = seen_modes.T.copy(), np.empty(3 * n, np.int64), np.empty(3 * n)
    moved, total_of, every = np.empty(3 * n), np.empty(K), np.arange(r + m + L)
    taken_by = taken.reshape(1, 3 * n, wide)
    zq, p1, inputs = np.empty(m), np.empty(m), np.empty(r + m + L)
    back, felt = np.zeros(m + r + K + L), np.zeros(L)
    before, pull = np.empty(3 * n), np.empty(r)
    slid, was = np.empty(3 * n), np.empty(n, np.int64)
    nodes = ((f, y, state), (before, slid, was))
    for d in range(3 * n):
        for place in range(L):
            felt[place] += f[d] * taken[d, m + r + K + place]
    for step in range(first, len(which)):
        for j in range(m):
            zq[j] = blades[0, j] * q[j] + blades[1, j] * v[j] + blades[2, j] * p[j]
            zq[j] += (blades[2, j] + blades[3, j]) * bias[j]
            p1[j] = 0.0
            for place in range(L):
                p1[j] += places[j, place] * drive[step + 1, place]
            zq[j] += blades[3, j] * p1[j]
            inputs[r + j] = zq[j]
        for j in range(r):
            inputs[j] = s[j] + dt * sv[j]
            for i in range(r):
                inputs[j] += 0.5 * dt * dt * inverse_mass[j, i] * load[i]
        for place in range(L):
            inputs[r + m + place] = drive[step + 1, place]
        put(f, before, 0)
        if given and step == first:
            put(x0, f, 0)
            fetch_row(moves, step, slid)
            fetch_row(states, step, was)
            used = 0
        else:
            one = which[step]
            bring_up(c, w, slip, Tt, bases_open, one)
            fetch_row(c, one, x0)
            add_rows(x0, 1.0, inputs, every, len(inputs), Z, one)
            put(y, slid, 0)
            put(state, was, 0)
            used = solve_sample(step, x0, suited, one, law, nodes, past, scratch)
            if used < 0:
                put(before, f, 0)
                # for whoever solves the step, and comes back
                put_row(slid, moves, step)
                put_row(was, states, step)
                return step
        count = 0
        for d in range(3 * n):
            if f[d] != 0.0:
                carried[count], weights[count] = d, f[d]
                count += 1
        for j in range(wide):
            back[j] = 0.0
        add_rows(back, 1.0, weights, carried, count, taken_by, 0)
        lost, rubbed = sums[1], sums[2]
        for place in range(L):
            mean, path = 0.5 * (drive[step, place] + drive[step + 1, place]), 0.0
            for j in range(m):
                path += places[j, place] * (zq[j] + blades[3, j] * back[j] - q[j])
            path += back[m + r + K + place] - felt[place]
            felt[place] = back[m + r + K + place]
            sums[0] += mean * path
        for j in range(m):
            p1[j] += back[j]
            old_q, old_v = q[j], v[j]
            q[j] = zq[j] + blades[3, j] * back[j]
            v[j] = blades[4, j] * old_q + blades[5, j] * old_v
            v[j] += blades[6, j] * (p[j] + bias[j]) + blades[7, j] * (p1[j] + bias[j])
            p[j] = p1[j]
            lost += 0.5 * dt * loss[j] * (old_v * old_v + v[j] * v[j])
        for j in range(r):
            pull[j] = load[j] - back[m + j]
        for j in range(r):
            total = 0.0
            for i in range(r):
                total += inverse_mass[j, i] * pull[i]
            s[j] += dt * sv[j] + 0.5 * dt * dt * total
            sv[j] += dt * (0.25 * sa[j] + 0.75 * total)
            sa[j] = 0.5 * (sa[j] + total)
        put(y, moved, 0)
        touch(f, y, state, slid, was, springs, moved)
        for d in range(n, 3 * n):
            if moved[d] != 0.0:
                slip[d - n] += moved[d]
                rubbed += 0.5 * (before[d] + f[d]) * moved[d]
        sums[1], sums[2] = lost, rubbed
        sums[3] += used
        put_row(f, forces, step)
        put_row(moved, moves, step)
        put_row(state, states, step)
        for one in range(K):
            total_of[one] = back[m + r + one]
        for j in range(m):
            for one in range(K):
                total_of[one] += seen[j, one] * q[j]
        for place in range(L):
            for one in range(K):
                total_of[one] += seen_drive[one, place] * drive[step + 1, place]
        put_row(total_of, out, step)
    return len(which)
