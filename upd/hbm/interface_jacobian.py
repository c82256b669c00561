r"""Derivative of one period of contact and damper, by recursion through its samples, compiled.

With db the change of w* - w_ref at a sample, the forces and the gaps and slips y of the dofs R that
are not held change by (see `upd.hbm.interface_step`; P, Q the rows of the laws at its answer)

    df = W db - W_R dy,    (P W_R - Q) dy = P W db,

k rows for the k dofs of R. A node that sticks all the period may be asked to come to the verge of
slipping at its sample of least margin l = mu f_n - |f_t|: there v df_t - mu df_n = l by a slip
along v = f_t / |f_t|, and what that does by itself is a column of its own. What db is made of: dq
of the blades, ds + du of the damper, the slips summed so far of the nodes that move in the period,
and for the frequency B dJ (p - B' f)/2. Only the modal forces and the damper's resultants are
wanted of df, so that a sample at which everything sticks costs no more than these.

Nodes move in stretches. With z the slips summed so far of the nodes of R, and the gaps of the open
ones, and those of the other nodes s_O, which only change where a stretch begins or ends,

    (P W_R - Q) z = P (W db - W_O s_O) - Q z before,

so that a sample costs the solution of k rows, and W_O s_O is carried along.
"""

from __future__ import annotations

import numpy as np

from upd.hbm.compiled import compiled
from upd.hbm.interface_step import OPEN, STICK, slip_rows

#: state of a node that is asked to come to the verge of slipping
VERGE = 3


@compiled
def law_rows(  # type: ignore[no-untyped-def]
    f, y, state, n, mu, rho_n, rho_t, on, nodes, cols, owner, P, left, keep, H, W
):
    """Dofs that are not held, the rows of their laws, and the matrix P W_R - Q.

    Parameters
    ----------
    f, y : (3 n,) ndarray
        Answer of a sample.
    state : (n,) ndarray of int
    n : int
    mu, rho_n, rho_t : (n,) ndarray
        Friction, weights of displacements against forces.
    on : (n,) ndarray of int
        The nodes that are not held, in the order of the rows.
    nodes : int
        How many.
    cols : (3 n,) ndarray of int
        Overwritten by the dofs.
    owner : (3 n,) ndarray of int
        Overwritten by the number of each one's node among those that are not held.
    P : (3 n, 3) ndarray
        Overwritten: weights of the node's three forces in each row.
    left : (3 n,) ndarray
        Overwritten: what the row lacks [N].
    keep : (3 n, 2) ndarray
        Overwritten: -Q of each row, by the node's two slips.
    H : (3 n, 3 n) ndarray
        Overwritten.
    W : (3 n, 3 n) ndarray

    Returns
    -------
    int
        Rows k.
    """
    T, v = np.empty((2, 2)), np.empty(4)
    k = 0
    for o in range(nodes):
        i = on[o]
        for a in range(0 if state[i] == OPEN else 1, 3):
            cols[k], owner[k] = a * n + i, o
            k += 1
    left[:k] = 0.0
    keep[:k] = 0.0
    row = 0
    while row < k:
        i = cols[row] % n
        if state[i] == VERGE:
            size = np.sqrt(f[n + i] ** 2 + f[2 * n + i] ** 2)
            v1, v2 = f[n + i] / size, f[2 * n + i] / size
            left[row] = mu[i] * f[i] - size
            P[row, 0], P[row, 1], P[row, 2] = -mu[i], v1, v2
            P[row + 1] = 0.0
            for j in range(k):
                H[row, j] = -mu[i] * W[i, cols[j]]
                H[row, j] += v1 * W[n + i, cols[j]] + v2 * W[2 * n + i, cols[j]]
                H[row + 1, j] = 0.0
            # no slip across v; of the size of the other row
            keep[row + 1, 0], keep[row + 1, 1] = -v2 * rho_t[i], v1 * rho_t[i]
            H[row + 1, row], H[row + 1, row + 1] = keep[row + 1]
            row += 2
            continue
        if state[i] == OPEN:
            for a in range(3):
                P[row + a] = 0.0
                P[row + a, a] = 1.0
                for j in range(k):
                    H[row + a, j] = W[cols[row + a], cols[j]]
            row += 3
            continue
        slip_rows(f, y, i, n, mu[i], rho_n[i], rho_t[i], T, v)
        for a in range(2):
            P[row + a, 0] = -mu[i] * v[a]
            for e in range(2):
                P[row + a, 1 + e] = (1.0 if a == e else 0.0) - T[a, e]
                keep[row + a, e] = rho_t[i] * T[a, e]
            for j in range(k):
                total = 0.0
                for e in range(3):
                    total += P[row + a, e] * W[e * n + i, cols[j]]
                H[row + a, j] = total
            for e in range(2):
                H[row + a, row + e] += keep[row + a, e]
        row += 2
    return k


@compiled
def period_derivative(  # type: ignore[no-untyped-def]
    F, Y, S, W, Z, M, E, moved, place, columns, J, dJ, load, mu, rho_n, rho_t, forces, D
):
    """Derivative of modal forces and end state by the blades' harmonics, start state and frequency.

    The columns are the h m coefficients, harmonic by harmonic, the 3 r of the damper's state, the
    2 c slips of the nodes that move, the frequency, and what nodes on the verge do: C in all.

    Parameters
    ----------
    F, Y, S
        Answers of all samples, as `upd.hbm.interface_samples.given_blades` leaves them.
    W : (3 n, 3 n) ndarray
        Inverse of A [N/mm]; symmetric.
    Z : (3 n, m + r) ndarray
        W (Phi, B).
    M : (m + r, m + r) ndarray
        (Phi, B)' W (Phi, B).
    E : (N, h) ndarray
        Harmonics at the samples.
    moved : (2 c,) ndarray of int
        Dofs of these tangents, first tangents, then second ones.
    place : (3 n,) ndarray of int
        Number of each among them, or -1.
    columns, J, load, mu, rho_n, rho_t
        As in `upd.hbm.interface_samples.given_blades`.
    dJ : (r, r) ndarray
        Derivative of J by the frequency.
    forces : (N, C, m) ndarray
        Overwritten: derivative of the modal forces.
    D : (C, 3 r + 2 c) ndarray
        Overwritten: derivative of the state after the period.

    Returns
    -------
    bool
        False where a sample's system is singular.
    """
    N, n, r = len(F), len(mu), len(load)
    m, h, C = Z.shape[1] - r, E.shape[1], len(D)
    begin = h * m + 3 * r
    R = np.zeros((C, 3 * r))
    for i in range(3 * r):
        R[h * m + i, i] = 1.0
    slips = np.zeros((C, len(moved)))
    # (Phi, B)' W of the slips of nodes that are held
    held = np.zeros((C, m + r))
    for i in range(len(moved)):
        slips[begin + i, i] = 1.0
        held[begin + i] = Z[moved[i]]
    u, db = np.zeros((C, m + r)), np.empty((C, r))
    cols, owner = np.empty(3 * n, np.int64), np.empty(3 * n, np.int64)
    P, H, left = np.empty((3 * n, 3)), np.empty((3 * n, 3 * n)), np.empty(3 * n)
    keep = np.empty((3 * n, 2))
    pull, late = np.empty(r), np.empty(r)
    on, before = np.empty(n, np.int64), np.full(n, -1)
    # nodes whose slip is that of the start; those that moved and are held again
    fresh, again = np.ones(n, np.bool_), np.zeros(n, np.bool_)
    count = 0
    # W of the slips of held nodes, three rows of each that is not
    V = np.empty((C, 0))
    for j in range(N):
        f, state = F[j], S[j]
        pull[:] = load
        for d in range(3 * n):
            if f[d] != 0.0:
                for i in range(r):
                    pull[i] -= f[d] * columns[d, i]
        for i in range(r):
            late[i] = 0.0
            for e in range(r):
                late[i] += dJ[i, e] * pull[e]
        for i in range(m):
            for e in range(h):
                u[e * m + i, i] = -E[j, e]
        for e in range(C):
            for i in range(r):
                u[e, m + i] = R[e, i] + R[e, r + i]
        for i in range(r):
            u[C - 2, m + i] += 0.5 * late[i]
        V, count = _change_stretches(
            state, W, Z, moved, place, begin, slips, held, V, on, count, before, fresh, again
        )
        out = np.dot(u, M)
        out -= held
        k = law_rows(
            f, Y[j], state, n, mu, rho_n, rho_t, on, count, cols, owner, P, left, keep, H, W
        )
        if k > 0:
            PZ, Z_rows = np.zeros((m + r, k)), np.empty((k, m + r))
            for row in range(k):
                i = on[owner[row]]
                Z_rows[row] = Z[cols[row]]
                for a in range(3):
                    if P[row, a] != 0.0:
                        for e in range(m + r):
                            PZ[e, row] += P[row, a] * Z[a * n + i, e]
            rhs = np.dot(u, PZ)
            for e in range(C):
                for row in range(k):
                    o = 3 * owner[row]
                    rhs[e, row] -= (
                        P[row, 0] * V[e, o] + P[row, 1] * V[e, o + 1] + P[row, 2] * V[e, o + 2]
                    )
            for row in range(k):
                if keep[row, 0] != 0.0 or keep[row, 1] != 0.0:
                    i = on[owner[row]]
                    one, two = place[n + i], place[2 * n + i]
                    for e in range(C):
                        rhs[e, row] += keep[row, 0] * slips[e, one] + keep[row, 1] * slips[e, two]
                # P (dF - W dy) = left
                rhs[C - 1, row] -= left[row]
            try:
                z = np.linalg.solve(H[:k, :k].copy(), rhs.T).T
            except Exception:
                return False
            out -= np.dot(np.ascontiguousarray(z), Z_rows)
            for e in range(C):
                for row in range(k):
                    if cols[row] >= n:
                        slips[e, place[cols[row]]] = z[e, row]
        forces[j] = out[:, :m]
        for e in range(C):
            for i in range(r):
                db[e, i] = 0.0
                for a in range(r):
                    db[e, i] -= J[i, a] * out[e, m + a]
        for i in range(r):
            db[C - 2, i] += late[i]
        for e in range(C):
            for i in range(r):
                R[e, i] += R[e, r + i] + 0.5 * db[e, i]
                R[e, r + i] += 0.25 * R[e, 2 * r + i] + 0.75 * db[e, i]
                R[e, 2 * r + i] = 0.5 * (R[e, 2 * r + i] + db[e, i])
    D[:, : 3 * r] = R
    D[:, 3 * r :] = slips
    return True


@compiled
def _change_stretches(  # type: ignore[no-untyped-def]
    state, W, Z, moved, place, begin, slips, held, V, on, count, before, fresh, again
):
    """Let stretches of motion begin and end.

    Parameters
    ----------
    state : (n,) ndarray of int
        At the sample.
    W, Z, moved, place
        As in `period_derivative`.
    begin : int
        Column of the first slip.
    slips : (C, 2 c) ndarray
        Of the nodes that move in the period.
    held : (C, m + r) ndarray
        (Phi, B)' W of the slips of nodes that are held; updated.
    V : (C, 3 count) ndarray
        W of them, in the rows of the nodes of the sample before.
    on : (n,) ndarray of int
        Nodes of the sample before; overwritten.
    count : int
        How many.
    before : (n,) ndarray of int
        Number of each among them, or -1; overwritten.
    fresh, again : (n,) ndarray of bool
        Nodes that did not move so far; nodes that did and are held; updated.

    Returns
    -------
    V : (C, 3 count) ndarray
        In the rows of the nodes of this sample.
    count : int
    """
    n, C = len(state), len(slips)
    changed = 0
    for i in range(n):
        if (state[i] != STICK) != (before[i] >= 0):
            changed += 1
    if changed == 0:
        return V, count
    # what nodes that change take from the slips of held ones, or add to them
    part, who, a = np.empty((C, 2 * changed)), np.empty(2 * changed, np.int64), 0
    for i in range(n):
        if (state[i] != STICK) != (before[i] >= 0):
            sign = 1.0 if state[i] == STICK else -1.0
            for d in (n + i, 2 * n + i):
                for e in range(C):
                    part[e, a] = sign * slips[e, place[d]]
                who[a] = d
                a += 1
    Z_part = np.empty((len(who), Z.shape[1]))
    for a in range(len(who)):
        Z_part[a] = Z[who[a]]
    held += np.dot(part, Z_part)
    was, old = before.copy(), V
    new = 0
    for i in range(n):
        before[i] = -1
        if state[i] != STICK:
            on[new], before[i] = i, new
            new += 1
    # rows of nodes that go on
    V, W_part = np.empty((C, 3 * new)), np.empty((len(who), 3 * new))
    for a in range(len(who)):
        for o in range(new):
            for e in range(3):
                W_part[a, 3 * o + e] = W[who[a], e * n + on[o]] if was[on[o]] >= 0 else 0.0
    np.dot(part, W_part, V)
    for e in range(C):
        for o in range(new):
            place_before = 3 * was[on[o]]
            if place_before >= 0:
                for a in range(3):
                    V[e, 3 * o + a] += old[e, place_before + a]
    for i in range(n):
        if (state[i] != STICK) != (was[i] >= 0):
            fresh[i], again[i] = False, state[i] == STICK
    # rows of nodes that begin
    begun, moves = 0, 0
    for o in range(new):
        if was[on[o]] < 0:
            begun += 1
    for d in moved:
        if again[d % n]:
            moves += 1
    if begun > 0:
        W_part, part = np.empty((moves, 3 * begun)), np.empty((C, moves))
        a = 0
        for d in moved:
            if again[d % n]:
                for e in range(C):
                    part[e, a] = slips[e, place[d]]
                b = 0
                for o in range(new):
                    if was[on[o]] < 0:
                        for e in range(3):
                            W_part[a, b + e] = W[d, e * n + on[o]]
                        b += 3
                a += 1
        rows = np.dot(part, W_part)
        b = 0
        for o in range(new):
            if was[on[o]] < 0:
                V[:, 3 * o : 3 * o + 3] = rows[:, b : b + 3]
                b += 3
                for d in moved:
                    if fresh[d % n]:
                        for e in range(3):
                            V[begin + place[d], 3 * o + e] += W[d, e * n + on[o]]
    return V, new
