"""A period in time, compiled: blades and damper of `upd.hbm.faces.march`, or the damper alone.

`march_steps` takes the steps of a march. `given_blades` solves a
period under given motion of the blades. The damper's step is the same, WBZ-alpha with full damping
at infinite frequency, there with time counted in steps: from s, u = dt s' and a = dt^2 s'' (the
method's), with J = dt^2 M_D^-1 and the forces f of the step's end,

    b = J (p - B' f),   s_1 = s + u + b/2,   u_1 = u + a/4 + 3 b/4,   a_1 = (a + b)/2,

so that J alone depends on the step. The modes being given, they add no compliance to the step:

    w_1 = B (s + u + J p/2) - Phi q_1 - E F_1 - A f_1,   A = G + B J B'/2.

See `upd.hbm.faces.step` for the contact problem of a step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.faces.step import (
    OPEN,
    add_rows,
    contact_scratch,
    fetch_row,
    put,
    put_row,
    solve_sample,
)
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
    """

    force: FloatArray
    move: FloatArray
    state: NDArray[np.int64]


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
    bases : tuple of ndarray
        As of `contact_step`.
    gap, slip : (n,), (2 n,) ndarray
        Gap before any load, sums of slips [mm].

    Returns
    -------
    c, w : (B, 3 n), (B, 2 n) ndarray
        And the sums of slips it is for.
    """
    bases_open, bases_Tt = bases
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


@inlined
def damper_ahead(damper, dt, rigid, out):  # type: ignore[no-untyped-def]
    """The damper after a step without contact forces.

    Parameters
    ----------
    damper : tuple of ndarray
        Inverse mass (r, r) and static load (r,).
    dt : float
        Step.
    rigid : tuple of three (r,) ndarray
        Motion, velocity, and the acceleration of the method.
    out : (r,) ndarray or longer
        Overwritten.
    """
    inverse_mass, load = damper
    s, sv, _ = rigid
    for j in range(len(s)):
        out[j] = s[j] + dt * sv[j]
        for i in range(len(s)):
            out[j] += 0.5 * dt * dt * inverse_mass[j, i] * load[i]


@inlined
def move_damper(damper, dt, rigid, pull):  # type: ignore[no-untyped-def]
    """Move the damper by a step under the forces (r,) at its end; others as `damper_ahead`."""
    inverse_mass, _ = damper
    s, sv, sa = rigid
    for j in range(len(s)):
        total = 0.0
        for i in range(len(s)):
            total += inverse_mass[j, i] * pull[i]
        s[j] += dt * sv[j] + 0.5 * dt * dt * total
        sv[j] += dt * (0.25 * sa[j] + 0.75 * total)
        sa[j] = 0.5 * (sa[j] + total)


@inlined
def _modes_ahead(step, drive, blades, places, modal, ahead):  # type: ignore[no-untyped-def]
    """Modes after a step without contact forces, and the excitation's forces on them.

    With q, v, p of the modes, and ahead: what of their forces is constant, and both results.
    """
    q, v, p = modal
    bias, zq, p1 = ahead
    for j in range(len(q)):
        zq[j] = blades[0, j] * q[j] + blades[1, j] * v[j] + blades[2, j] * p[j]
        zq[j] += (blades[2, j] + blades[3, j]) * bias[j]
        p1[j] = 0.0
        for place in range(drive.shape[1]):
            p1[j] += places[j, place] * drive[step + 1, place]
        zq[j] += blades[3, j] * p1[j]


@inlined
def _move_modes(step, parts, modal, ahead, back, felt, sums):  # type: ignore[no-untyped-def]
    """Move the modes by a step with the contact forces `back` on them.

    Work of the excitation, at places that `felt` (2, L) what contact forces do there now and did
    before, and what damping takes are added to the sums.
    """
    dt, drive, blades, (loss, places, _), _, _, _, _, _, _ = parts
    q, v, p = modal
    bias, zq, p1 = ahead
    for place in range(drive.shape[1]):
        mean, path = 0.5 * (drive[step, place] + drive[step + 1, place]), 0.0
        for j in range(len(q)):
            path += places[j, place] * (zq[j] + blades[3, j] * back[j] - q[j])
        sums[0] += mean * (path + (felt[0, place] - felt[1, place]))
    lost = sums[1]
    for j in range(len(q)):
        p1[j] += back[j]
        old_q, old_v = q[j], v[j]
        q[j] = zq[j] + blades[3, j] * back[j]
        v[j] = blades[4, j] * old_q + blades[5, j] * old_v
        v[j] += blades[6, j] * (p[j] + bias[j]) + blades[7, j] * (p1[j] + bias[j])
        p[j] = p1[j]
        lost += 0.5 * dt * loss[j] * (old_v * old_v + v[j] * v[j])
    sums[1] = lost


@inlined
def _slide(before, f, moved, slip, sums):  # type: ignore[no-untyped-def]
    """Add the slips of a step, and what friction took under the mean forces of both its ends."""
    n, rubbed = len(f) // 3, sums[2]
    for d in range(n, 3 * n):
        if moved[d] != 0.0:
            slip[d - n] += moved[d]
            rubbed += 0.5 * (before[d] + f[d]) * moved[d]
    sums[2] = rubbed


@inlined
def _see(step, drive, seen, q, back, out):  # type: ignore[no-untyped-def]
    """Outputs after a step, of modes, excitation and what contact forces add."""
    modes, by_drive = seen
    for one in range(out.shape[1]):
        total = back[one]
        for j in range(len(q)):
            total += modes[one, j] * q[j]
        for place in range(drive.shape[1]):
            total += by_drive[one, place] * drive[step + 1, place]
        out[step, one] = total


@inlined
def _carry(f, taken, weights, back):  # type: ignore[no-untyped-def]
    """What contact forces do to modes, rigid motions, outputs and places; `back` overwritten.

    With `taken` (1, 3 n, ...) as in `StepParts`, weights and their rows (3 n,) scratch.
    """
    size, carried = weights
    count = 0
    for d in range(len(f)):
        if f[d] != 0.0:
            carried[count], size[count] = d, f[d]
            count += 1
    for j in range(len(back)):
        back[j] = 0.0
    add_rows(back, 1.0, size, carried, count, taken, 0)


@compiled
def march_steps(  # type: ignore[no-untyped-def]
    first, last, given, parts, bases, at, past, filled
):
    """March samples first + 1 to last of a period.

    Parameters
    ----------
    first, last : int
    given : bool
        Whether the first step was solved elsewhere: x0 (its forces), y and state hold its answer.
    parts : StepParts
    bases : tuple of ndarray
        `Bases`, and the one to use at each sample (N,).
    at : tuple of ndarray
        `upd.hbm.faces.state.InterfaceState.arrays`; overwritten.
    past : tuple
        `Past`, overwritten, and whether it holds a period: the steps start from its samples then.
    filled : tuple of ndarray
        Overwritten: x0 (3 n,), what the base gave of the last step; outputs (N, K) from `first`
        on; added to (3,): work of the excitation, lost by damping and by friction [N mm].

    Returns
    -------
    int
        Where it ended: `last`, or the sample before a step without an answer.
    """
    dt, drive, blades, modes, taken, damper, gap, law, seen, springs = parts
    q, v, p, s, sv, sa, f, y, slip, state, held = at
    bases_open, Tt, Z, which = bases
    forces, moves, states, _ = past
    x0, out, sums = filled
    n, m, r, L, K = len(gap), len(q), len(s), drive.shape[1], out.shape[1]
    suited, modal, rigid = (bases_open, Tt), (q, v, p), (s, sv, sa)
    c, w = begin(suited, gap, slip)
    scratch, ahead = contact_scratch(n), (modes[2] * held, np.empty(m), np.empty(m))
    inputs, every, moved = np.empty(r + m + L), np.arange(r + m + L), np.empty(3 * n)
    slid, was, before = np.empty(3 * n), np.empty(n, np.int64), np.empty(3 * n)
    nodes = (f, y, state), (before, slid, was)
    weights, taken = (np.empty(3 * n), np.empty(3 * n, np.int64)), taken.reshape(1, 3 * n, -1)
    back, pull = np.empty(m + r + K + L), np.empty(r)
    _carry(f, taken, weights, back)
    felt = np.empty((2, L))
    felt[0], shown = back[m + r + K :], back[m + r :]
    for step in range(first, last):
        _modes_ahead(step, drive, blades, modes[1], modal, ahead)
        damper_ahead(damper, dt, rigid, inputs)
        put(ahead[1], inputs, r)
        for place in range(L):
            inputs[r + m + place] = drive[step + 1, place]
        put(f, before, 0)
        one = which[step]
        if given and step == first:
            put(x0, f, 0)
            fetch_row(moves, step, slid)
            fetch_row(states, step, was)
        else:
            bring_up(c, w, slip, Tt, bases_open, one)
            fetch_row(c, one, x0)
            add_rows(x0, 1.0, inputs, every, len(inputs), Z, one)
            put(y, slid, 0)
            put(state, was, 0)
            if solve_sample(step, x0, suited, one, law, nodes, past, scratch) < 0:
                put(before, f, 0)
                # for whoever solves the step, and comes back
                put_row(slid, moves, step)
                put_row(was, states, step)
                return step
        _carry(f, taken, weights, back)
        for place in range(L):
            felt[1, place], felt[0, place] = felt[0, place], back[m + r + K + place]
        _move_modes(step, parts, modal, ahead, back, felt, sums)
        for j in range(r):
            pull[j] = damper[1][j] - back[m + j]
        move_damper(damper, dt, rigid, pull)
        put(y, moved, 0)
        touch(f, y, state, slid, was, springs, moved)
        _slide(before, f, moved, slip, sums)
        put_row(f, forces, step)
        put_row(moved, moves, step)
        put_row(state, states, step)
        _see(step, drive, seen, q, shown, out)
    return last


@compiled
def given_blades(first, given, pushes, step, law, state, past):  # type: ignore[no-untyped-def]
    """Solve samples from `first` on.

    Parameters
    ----------
    first : int
        Sample to begin with.
    given : bool
        Whether that one was solved elsewhere: its rows of the past hold the answer.
    pushes : (N, 3 n) ndarray
        W (-Phi q - E F) [N].
    step : tuple of ndarray
        (W B)' (r, 3 n) [N/mm], inverse W (3 n, 3 n) of A [N/mm], B (3 n, r), the square of the
        step over the damper's masses J (r, r), and its static load (r,).
    law : tuple of three (n,) ndarray
        Friction, weights of displacements against forces [N/mm].
    state : tuple of ndarray
        Overwritten: the damper's motion, velocity and acceleration in steps (3, r); -W w_ref
        (3 n,), of the first sample at first; x0 (3 n,).
    past : tuple
        Forces [N], minus gaps and slips of the step [mm] (N, 3 n) and states (N, n), overwritten;
        whether they hold a guess of every sample. Else each starts from the one before, and the
        first from its own row.

    Returns
    -------
    int
        Samples solved: N, or the sample without an answer; x0 then holds its forces if all stuck.
    """
    by_rigid, W, columns, J, load = step
    s, c, x0 = state
    F, Y, S, _ = past
    N, n, r = len(pushes), len(law[0]), len(load)
    bases, scratch = (np.zeros((1, n), np.bool_), W.reshape(1, 3 * n, 3 * n)), contact_scratch(n)
    f, y, now = np.empty(3 * n), np.empty(3 * n), np.empty(n, np.int64)
    before = (np.empty(3 * n), np.empty(3 * n), np.empty(n, np.int64))
    damper, rigid, z, pull = (J, load), (s[0], s[1], s[2]), np.empty(r), np.empty(r)
    for j in range(first, N):
        if given and j == first:
            fetch_row(F, j, f)
            fetch_row(Y, j, y)
            fetch_row(S, j, now)
        else:
            damper_ahead(damper, 1.0, rigid, z)
            x0[:] = pushes[j] + c
            for i in range(r):
                for d in range(3 * n):
                    x0[d] += z[i] * by_rigid[i, d]
            # the first sample starts from its own row
            fetch_row(F, max(j - 1, 0), before[0])
            fetch_row(Y, max(j - 1, 0), before[1])
            fetch_row(S, max(j - 1, 0), before[2])
            # a bare 0 is a type of its own: all that takes it would be compiled once more
            one, nodes = np.int64(0), ((f, y, now), before)
            if solve_sample(j, x0, bases, one, law, nodes, past, scratch) < 0:
                return j
            put_row(f, F, j)
            put_row(y, Y, j)
            put_row(now, S, j)
        pull[:] = load
        for d in range(3 * n):
            if f[d] != 0.0:
                for i in range(r):
                    pull[i] -= f[d] * columns[d, i]
        move_damper(damper, 1.0, rigid, pull)
        for d in range(n, 3 * n):
            if y[d] != 0.0:
                for e in range(3 * n):
                    c[e] -= y[d] * W[d, e]
    return N
