"""One period of contact and damper under given motion of the blades, compiled.

The damper's step is that of `upd.hbm.interface_march`, WBZ-alpha with full damping at infinite
frequency, with time counted in steps: from s, u = dt s' and a = dt^2 s'' (the method's), with
J = dt^2 M_D^-1 and the forces f of the step's end,

    b = J (p - B' f),   s_1 = s + u + b/2,   u_1 = u + a/4 + 3 b/4,   a_1 = (a + b)/2,

so that J alone depends on the step. The modes being given, they add no compliance to the step:

    w_1 = B (s + u + J p/2) - Phi q_1 - E F_1 - A f_1,   A = G + B J B'/2.

See `upd.hbm.interface_step` for the contact problem of a step.
"""

from __future__ import annotations

import numpy as np

from upd.hbm.interface_step import OPEN, SLIP, SOLVED, STICK, contact_scratch, contact_step, judge
from upd.linalg.compiled import compiled

#: a chord step must take at least this share of the misfit away; it only weighs costs
CONTRACTS = 0.75
#: chord steps cost a Newton step of many rows together; it only weighs costs
MOST_CHORDS = 8


@compiled
def chord_steps(  # type: ignore[no-untyped-def]
    x0, W, mu, rho_n, rho_t, f, y, state, usual, cols, inverse, f_new, y_new, states
):
    """Solve a sample with the inverse of another's matrix, where all nodes are in its states.

    The rows are those of `upd.hbm.interface_jacobian.law_rows`; what is left of the laws tells how
    far each step leads, so that the answer is as exact as that of `contact_step`.

    Parameters
    ----------
    x0 : (3 n,) ndarray
        Forces if everything sticks [N].
    W : (3 n, 3 n) ndarray
        Inverse of A [N/mm]; symmetric.
    mu, rho_n, rho_t : (n,) ndarray
        Friction, weights of displacements against forces.
    f, y, state : ndarray
        Guess; overwritten by the answer, if there is one.
    usual : (n,) ndarray of int
        States for which the inverse is.
    cols : (k,) ndarray of int
        Dofs of its rows, the dofs of a node one after the other.
    inverse : (k, k) ndarray
    f_new, y_new, states : ndarray
        Scratch as f, y, state.

    Returns
    -------
    bool
        Whether the sample is solved.
    """
    n, k = len(mu), len(cols)
    for i in range(n):
        if state[i] != usual[i]:
            return False
    f_new[:], y_new[:] = x0, 0.0
    for row in range(k):
        d = cols[row]
        y_new[d] = y[d]
        weight, row_of = y[d], W[d]
        for e in range(3 * n):
            f_new[e] -= weight * row_of[e]
    left, before, allowed = np.empty(k), np.inf, 0.0
    for d in range(3 * n):
        allowed = max(allowed, SOLVED * abs(x0[d]))
    for _ in range(MOST_CHORDS):
        for d in range(3 * n):
            allowed = max(allowed, SOLVED * abs(f_new[d]))
        worst = judge(f_new, y_new, mu, rho_n, rho_t, states)
        for i in range(n):
            if states[i] != usual[i]:
                return False
        if worst <= allowed:
            for i in range(n):
                for d in (i, n + i, 2 * n + i):
                    f[d], y[d] = f_new[d], y_new[d]
                    if state[i] == OPEN:
                        f[d] = 0.0
                    elif state[i] == STICK or d == i:
                        y[d] = 0.0
            return True
        if not worst <= (1.0 - CONTRACTS) * before:
            return False
        before = worst
        for row in range(k):
            d = cols[row]
            i = d % n
            left[row] = f_new[d]
            if usual[i] == SLIP:
                q1 = f_new[n + i] + rho_t[i] * y_new[n + i]
                q2 = f_new[2 * n + i] + rho_t[i] * y_new[2 * n + i]
                q = q1 if d == n + i else q2
                left[row] -= mu[i] * f_new[i] * q / np.sqrt(q1 * q1 + q2 * q2)
        change = np.dot(inverse, left)
        for row in range(k):
            y_new[cols[row]] += change[row]
            weight, row_of = change[row], W[cols[row]]
            for e in range(3 * n):
                f_new[e] -= weight * row_of[e]
    return False


@compiled
def given_blades(  # type: ignore[no-untyped-def]
    first,
    given,
    known,
    pushes,
    rigid,
    W,
    columns,
    J,
    load,
    mu,
    rho_n,
    rho_t,
    s,
    c,
    F,
    Y,
    S,
    usual,
    at,
    square,
    cols,
    inverse,
    x0,
    work,
):
    """Solve samples from `first` on.

    Parameters
    ----------
    first : int
        Sample to begin with.
    given : bool
        Whether that one was solved elsewhere: its rows of F, Y and S hold the answer.
    known : bool
        Whether F, Y and S hold a guess of every sample; else each starts from the one before, and
        the first from its own row.
    pushes : (N, 3 n) ndarray
        W (-Phi q - E F) [N].
    rigid : (r, 3 n) ndarray
        (W B)' [N/mm].
    W : (3 n, 3 n) ndarray
        Inverse of A [N/mm].
    columns : (3 n, r) ndarray
        B.
    J, load : (r, r), (r,) ndarray
        Square of the step over the damper's masses; static load.
    mu, rho_n, rho_t : (n,) ndarray
        Friction, weights of displacements against forces [N/mm].
    s : (3, r) ndarray
        Damper's motion, velocity and acceleration in steps; overwritten.
    c : (3 n,) ndarray
        -W w_ref of the first sample; overwritten.
    F, Y : (N, 3 n) ndarray
        Forces [N]; minus gaps, and slips of the step [mm]; overwritten.
    S : (N, n) ndarray of int
        States; overwritten.
    usual : (N or 0, n) ndarray of int
        States of the samples whose inverses are known, if they are.
    at, square, cols, inverse
        Of them, as in `upd.hbm.interface_jacobian.factor_period`.
    x0, work : ndarray
        Scratch (3 n,), (3 n, 3 n).

    Returns
    -------
    int
        Samples solved: N, or the sample without an answer; x0 then holds its forces if all stuck.
    """
    N, n, r = len(pushes), len(mu), len(load)
    one_base, only = np.zeros((1, n), np.bool_), W.reshape(1, 3 * n, 3 * n)
    scratch = contact_scratch(n)
    z, b, pull = np.empty(r), np.empty(r), np.empty(r)
    f_new, y_new, states = np.empty(3 * n), np.empty(3 * n), np.empty(n, np.int64)
    for j in range(first, N):
        f, y, state = F[j], Y[j], S[j]
        for i in range(r):
            z[i] = s[0, i] + s[1, i]
            for e in range(r):
                z[i] += 0.5 * J[i, e] * load[e]
        if not (given and j == first):
            x0[:] = pushes[j] + c
            for i in range(r):
                for d in range(3 * n):
                    x0[d] += z[i] * rigid[i, d]
            used = -1
            if known and len(usual) > 0 and at[j + 1] > at[j]:
                k = at[j + 1] - at[j]
                if chord_steps(
                    x0,
                    W,
                    mu,
                    rho_n,
                    rho_t,
                    f,
                    y,
                    state,
                    usual[j],
                    cols[at[j] : at[j + 1]],
                    inverse[square[j] : square[j + 1]].reshape(k, k),
                    f_new,
                    y_new,
                    states,
                ):
                    used = 0
            # from the sample's own guess, from the sample before, from nothing
            for start in range(3):
                if used >= 0 or (start == 0 and not (known or j == 0)) or (start == 1 and j == 0):
                    continue
                if start == 1:
                    f[:], y[:], state[:] = F[j - 1], Y[j - 1], S[j - 1]
                used = contact_step(
                    x0, only, one_base, 0, mu, rho_n, rho_t, f, y, state, start < 2, work, *scratch
                )
            if used < 0:
                return j
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
