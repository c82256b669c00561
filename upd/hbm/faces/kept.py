"""A step of contact by the inverse that was kept of the same sample a period ago, compiled.

From period to period a sample changes little: most often the same nodes are open, stick and slip,
and slips turn by a little. The rows of `upd.hbm.faces.step.contact_step` are the same then but
for that, and the inverse of their matrix from an earlier period takes most of what the laws lack
away, at k^2 for k rows instead of k^3. The residual of the laws shows how far each of these chord
steps leads, so that the answer is as exact as that of Newton's method. Where nodes have changed
their states, or slips turned too far, the matrix is formed and inverted anew.

`given_blades` solves a period under given motion of the blades. The damper's step is that of
`upd.hbm.faces.march`, WBZ-alpha with full damping at infinite frequency, with time counted in
steps: from s, u = dt s' and a = dt^2 s'' (the method's), with J = dt^2 M_D^-1 and the forces f of
the step's end,

    b = J (p - B' f),   s_1 = s + u + b/2,   u_1 = u + a/4 + 3 b/4,   a_1 = (a + b)/2,

so that J alone depends on the step. The modes being given, they add no compliance to the step:

    w_1 = B (s + u + J p/2) - Phi q_1 - E F_1 - A f_1,   A = G + B J B'/2.

See `upd.hbm.faces.step` for the contact problem of a step.
"""

from __future__ import annotations

import numpy as np

from upd.hbm.faces.step import (
    FEW,
    OPEN,
    SLIP,
    SOLVED,
    STICK,
    add_rows,
    contact_scratch,
    contact_step,
    fetch_row,
    judge,
    misfit_allowed,
    newton_rows,
    put,
    put_row,
    row_weights,
    split,
    unknown_dofs,
    without_rounding,
)
from upd.linalg.compiled import compiled, inlined, joined

#: a chord step must take at least this share of the misfit away; it only weighs costs
CONTRACTS = 0.75
#: inverses formed in a step, and chord steps, after which Newton's method
MOST_FORMED, MOST_CHORDS = 8, 60
#: rows of the largest matrix that is kept: 128 samples of them would take 370 MB
MOST_ROWS = 600


def kept_inverses(samples: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Room for the inverses of a period, none of them known.

    Parameters
    ----------
    samples : int
    n : int
        Nodes.

    Returns
    -------
    states : (N, n) ndarray of int
        State of each node and whether the base has it open, -1 where there is no inverse.
    inverses : (N, k) ndarray
        One after the other, row by row; of no size where elimination is as fast.
    """
    rows = min(3 * n, MOST_ROWS)
    return np.full((samples, n), -1), np.empty((samples, rows**2 if rows > FEW else 0))


@joined
def solve_sample(  # type: ignore[no-untyped-def]
    sample, x0, bases, one, law, nodes, past, scratch
):
    """One step of contact, from whatever is near and leads to an answer.

    Parameters
    ----------
    sample : int
        Of the period.
    x0, bases, one, law, scratch
        As in `upd.hbm.faces.step.contact_step`.
    nodes : tuple
        `node` as there, and the same of the step before.
    past : tuple
        Whether it holds a period; forces and relative motions (N, 3 n) and states (N, n) of the
        samples a period ago, and `kept_inverses` of them.

    Returns
    -------
    int
        Newton steps, or inverses formed; -1 without an answer.
    """
    (node, before), (known, forces, moves, states, kept, inverses) = nodes, past
    used = -1
    # from the sample a period ago, from the step before, from nothing
    for start in range(0 if known else 1, 3):
        if start == 0:
            fetch_row(forces, sample, node[0])
            fetch_row(moves, sample, node[1])
            fetch_row(states, sample, node[2])
            used = kept_step(sample, x0, bases, one, law, node, (kept, inverses), scratch)
        elif start == 1:
            put(before[0], node[0], 0)
            put(before[1], node[1], 0)
            put(before[2], node[2], 0)
        if used < 0:
            used = contact_step(x0, bases, one, law, node, start < 2, scratch)
        if used >= 0:
            break
    return used


@compiled
def kept_step(sample, x0, bases, one, law, node, kept, scratch):  # type: ignore[no-untyped-def]
    """Forces and relative motions of one step.

    Parameters
    ----------
    sample : int
        Of the period.
    x0, bases, one, law, scratch
        As in `contact_step`.
    node : tuple of ndarray
        f, y and states of the sample a period ago; overwritten as in `contact_step` if there is an
        answer.
    kept : tuple of ndarray
        As of `kept_inverses`; overwritten.

    Returns
    -------
    int
        Inverses formed, or -1 without an answer.
    """
    base, Tt = bases
    mu, rho_n, rho_t = law
    f, y, state = node
    suits, inverses = kept
    cols, sign, _, H = scratch
    n = len(mu)
    k = unknown_dofs(base, one, state, cols, sign)
    if k <= FEW or k * k > inverses.shape[1]:
        return -1
    allowed = misfit_allowed(x0, base, one)
    fs, ys, states, x = f.copy(), y.copy(), state.copy(), np.empty(3 * n)
    iterate = (fs, ys, states)
    z, left = np.empty(3 * n), np.empty(3 * n)
    formed, before, turned, started = 0, np.inf, False, False
    same = _suits(suits, sample, base, one, states)
    for _ in range(MOST_CHORDS):
        if not same:
            if turned or not border(sample, bases, one, law, iterate, kept):
                k = newton_rows(x0, bases, one, law, iterate, scratch)
                suits[sample, 0] = -1
                if formed == MOST_FORMED or k <= FEW or k * k > inverses.shape[1]:
                    return -1
                try:
                    made = np.linalg.inv(H[:k, :k].copy())
                except Exception:
                    return -1
                inverses[sample, : k * k] = made.ravel()
                formed += 1
            for i in range(n):
                suits[sample, i] = 2 * states[i] + base[one, i]
            k = unknown_dofs(base, one, states, cols, sign)
            same, started, turned, before = True, False, False, np.inf
        if not started:
            for r in range(k):
                z[r] = fs[cols[r]] if sign[r] < 0.0 else ys[cols[r]]
            x[:] = x0
            add_rows(x, -1.0, z, cols, k, Tt, one)
            split(x, z, base, one, cols, k, fs, ys)
            started = True
        _lacks(x, iterate, mu, rho_t, cols, k, left)
        change = np.dot(inverses[sample, : k * k].reshape(k, k), left[:k])
        for r in range(k):
            z[r] += change[r]
        add_rows(x, -1.0, change, cols, k, Tt, one)
        split(x, z, base, one, cols, k, fs, ys)
        worst = judge(fs, ys, mu, rho_n, rho_t, states)
        if not worst < np.inf:
            suits[sample, 0] = -1
            return -1
        for d in range(3 * n):
            allowed = max(allowed, SOLVED * abs(fs[d]))
        same = _suits(suits, sample, base, one, states)
        if same and worst <= allowed:
            f[:], y[:], state[:] = fs, ys, states
            without_rounding(f, y, state)
            return formed
        if same and not worst <= (1.0 - CONTRACTS) * before:
            same, turned = False, True
        before = worst
    return -1


@inlined
def _suits(suits, sample, base, one, state):  # type: ignore[no-untyped-def]
    """Whether the inverse that is kept is one of these states."""
    same = True
    for i in range(len(state)):
        same = same and suits[sample, i] == 2 * state[i] + base[one, i]
    return same


@compiled
def _lacks(x, node, mu, rho_t, cols, k, left):  # type: ignore[no-untyped-def]
    """What the rows of `newton_rows` lack at an iterate, for its states; `left` is overwritten."""
    f, y, state = node
    n = len(mu)
    for r in range(k):
        d = cols[r]
        i = d % n
        left[r] = x[d]
        if state[i] == SLIP and d >= n:
            q1 = f[n + i] + rho_t[i] * y[n + i]
            q2 = f[2 * n + i] + rho_t[i] * y[2 * n + i]
            q = q1 if d < 2 * n else q2
            left[r] = f[d] - mu[i] * f[i] * q / np.sqrt(q1 * q1 + q2 * q2)


@compiled
def border(sample, bases, one, law, node, kept):  # type: ignore[no-untyped-def]
    """Take the nodes that changed their states into the inverse; other rows stay as they are.

    With M the matrix so far, E its rows that go, C what the rows that stay have of the unknowns
    that come, and R, D the rows that come,

        [M C E; R D 0; E' 0 0],   S = [D - R M^-1 C, -R M^-1 E; -E' M^-1 C, -E' M^-1 E],

    is the matrix without the unknowns that go; as many rows as go and come are to be solved.

    Parameters
    ----------
    sample, bases, one, law, kept
        As in `kept_step`.
    node : tuple of ndarray
        The iterate.

    Returns
    -------
    bool
        False where the base is another one, or so many nodes changed that it would not pay.
    """
    base, Tt = bases
    state = node[2]
    suits, inverses = kept
    n = len(state)
    was, cols = np.empty(3 * n, np.int64), np.empty(3 * n, np.int64)
    # rows that go; rows that stay, where they were and where they are; rows that come
    gone = np.empty(3 * n, np.int64)
    stay, here = np.empty(3 * n, np.int64), np.empty(3 * n, np.int64)
    new = np.empty(3 * n, np.int64)
    k0, k, lost, added, common = 0, 0, 0, 0, 0
    for i in range(n):
        open_ = base[one, i]
        code = suits[sample, i]
        if code < 0 or code % 2 != open_:
            return False
        now = 2 * state[i] + open_
        idle = 2 * (OPEN if open_ else STICK) + open_
        before, after = 0, 0
        if code != idle:
            before = 2 if code == 2 * SLIP else 3
        if now != idle:
            after = 2 if now == 2 * SLIP else 3
        if code == now:
            for e in range(before):
                stay[common], here[common] = k0 + e, k + e
                common += 1
        else:
            for e in range(before):
                gone[lost] = k0 + e
                lost += 1
            for e in range(after):
                new[added] = k + e
                added += 1
        for e in range(before):
            was[k0 + e] = (3 - before + e) * n + i
        for e in range(after):
            cols[k + e] = (3 - after + e) * n + i
        k0, k = k0 + before, k + after
    s = lost + added
    if 2 * s > k0 or k * k > inverses.shape[1] or k <= FEW:
        return False
    B = inverses[sample, : k0 * k0].reshape(k0, k0)
    # what unchanged rows have of new unknowns, and new rows of all
    C, R, D = np.zeros((k0, added)), np.zeros((added, k0)), np.empty((added, added))
    w, o = np.empty(3), np.empty(3)
    for a in range(common):
        d = was[stay[a]]
        i = d % n
        row_weights(d, node, law, base[one, i], w, o)
        for e in range(added):
            C[stay[a], e] = _entry(w, i, cols[new[e]], Tt, base, one)
    for e in range(added):
        d = cols[new[e]]
        i = d % n
        row_weights(d, node, law, base[one, i], w, o)
        for a in range(common):
            R[e, stay[a]] = _entry(w, i, was[stay[a]], Tt, base, one)
        for a in range(added):
            other = cols[new[a]]
            D[e, a] = _entry(w, i, other, Tt, base, one)
            if other % n == i:
                D[e, a] -= o[other // n]
    V, U = np.dot(B, C), np.dot(R, B)
    S = np.empty((s, s))
    S[:added, :added] = D - np.dot(R, V)
    left, right = np.zeros((k, s)), np.zeros((s, k))
    for g in range(lost):
        for e in range(added):
            S[e, added + g] = -U[e, gone[g]]
            S[added + g, e] = -V[gone[g], e]
        for h in range(lost):
            S[added + g, added + h] = -B[gone[g], gone[h]]
        for a in range(common):
            left[here[a], added + g] = -B[stay[a], gone[g]]
            right[added + g, here[a]] = -B[gone[g], stay[a]]
    for e in range(added):
        left[new[e], e], right[e, new[e]] = 1.0, 1.0
        for a in range(common):
            left[here[a], e] = -V[stay[a], e]
            right[e, here[a]] = -U[e, stay[a]]
    try:
        made = np.dot(left, np.linalg.solve(S, right))
    except Exception:
        return False
    for a in range(common):
        for c in range(common):
            made[here[a], here[c]] += B[stay[a], stay[c]]
    inverses[sample, : k * k] = made.ravel()
    return True


@inlined
def _entry(w, i, other, Tt, base, one):  # type: ignore[no-untyped-def]
    """Of a row of node i, at the unknown of a dof."""
    n = base.shape[1]
    total = 0.0
    for e in range(3):
        if w[e] != 0.0:
            total += w[e] * Tt[one, other, e * n + i]
    return total


@compiled
def given_blades(  # type: ignore[no-untyped-def]
    first, given, pushes, step, law, past, at
):
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
    past : tuple
        As in `solve_sample`; overwritten. Where it holds no guess of every sample, each starts from
        the one before, and the first from its own row.
    at : tuple of ndarray
        Overwritten: the damper's motion, velocity and acceleration in steps (3, r), -W w_ref of the
        first sample (3 n,), and x0 (3 n,).

    Returns
    -------
    int
        Samples solved: N, or the sample without an answer; x0 then holds its forces if all stuck.
    """
    (rigid, W, columns, J, load), (s, c, x0) = step, at
    _, F, Y, S, _, _ = past
    N, n, r = len(pushes), len(law[0]), len(load)
    bases, scratch = (np.zeros((1, n), np.bool_), W.reshape(1, 3 * n, 3 * n)), contact_scratch(n)
    f, y, state = np.empty(3 * n), np.empty(3 * n), np.empty(n, np.int64)
    before = (np.empty(3 * n), np.empty(3 * n), np.empty(n, np.int64))
    nodes = ((f, y, state), before)
    z, b, pull = np.empty(r), np.empty(r), np.empty(r)
    for j in range(first, N):
        for i in range(r):
            z[i] = s[0, i] + s[1, i]
            for e in range(r):
                z[i] += 0.5 * J[i, e] * load[e]
        if given and j == first:
            fetch_row(F, j, f)
            fetch_row(Y, j, y)
            fetch_row(S, j, state)
        else:
            x0[:] = pushes[j] + c
            for i in range(r):
                for d in range(3 * n):
                    x0[d] += z[i] * rigid[i, d]
            # the first sample starts from its own row
            fetch_row(F, max(j - 1, 0), before[0])
            fetch_row(Y, max(j - 1, 0), before[1])
            fetch_row(S, max(j - 1, 0), before[2])
            # a bare 0 is a type of its own: all that takes it would be compiled once more
            used = solve_sample(j, x0, bases, np.int64(0), law, nodes, past, scratch)
            if used < 0:
                return j
            put_row(f, F, j)
            put_row(y, Y, j)
            put_row(state, S, j)
        pull[:] = load
        for d in range(3 * n):
            if f[d] != 0.0:
                for i in range(r):
                    pull[i] -= f[d] * columns[d, i]
        for i in range(r):
            b[i] = 0.0
            for e in range(r):
                b[i] += J[i, e] * pull[e]
        for i in range(r):
            s[0, i] += s[1, i] + 0.5 * b[i]
            s[1, i] += 0.25 * s[2, i] + 0.75 * b[i]
            s[2, i] = 0.5 * (s[2, i] + b[i])
        for d in range(n, 3 * n):
            if y[d] != 0.0:
                for e in range(3 * n):
                    c[e] -= y[d] * W[d, e]
    return N
