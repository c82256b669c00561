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
"""

from __future__ import annotations

import numpy as np

from upd.hbm.compiled import compiled
from upd.hbm.interface_step import OPEN, STICK, slip_rows

#: state of a node that is asked to come to the verge of slipping
VERGE = 3


@compiled
def law_rows(  # type: ignore[no-untyped-def]
    f, y, state, n, mu, rho_n, rho_t, cols, owner, P, left, H, W
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
    cols : (3 n,) ndarray of int
        Overwritten by the dofs.
    owner : (3 n,) ndarray of int
        Overwritten by the number of each one's node among those that are not held.
    P : (3 n, 3) ndarray
        Overwritten: weights of the node's three forces in each row.
    left : (3 n,) ndarray
        Overwritten: what the row lacks [N].
    H : (3 n, 3 n) ndarray
        Overwritten.
    W : (3 n, 3 n) ndarray

    Returns
    -------
    k, nodes : int
        Rows, and nodes that are not held.
    """
    T, v = np.empty((2, 2)), np.empty(4)
    k, nodes = 0, 0
    for i in range(n):
        if state[i] == STICK:
            continue
        for a in range(0 if state[i] == OPEN else 1, 3):
            cols[k], owner[k] = a * n + i, nodes
            k += 1
        nodes += 1
    left[:k] = 0.0
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
            H[row + 1, row], H[row + 1, row + 1] = -v2 * rho_t[i], v1 * rho_t[i]
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
            for j in range(k):
                total = 0.0
                for e in range(3):
                    total += P[row + a, e] * W[e * n + i, cols[j]]
                H[row + a, j] = total
            for e in range(2):
                H[row + a, row + e] += rho_t[i] * T[a, e]
        row += 2
    return k, nodes


@compiled
def period_derivative(  # type: ignore[no-untyped-def]
    F, Y, S, W, W_moved, Z, M, E, moved, place, columns, J, dJ, load, mu, rho_n, rho_t, forces, D
):
    """Derivative of modal forces and end state by the blades' harmonics, start state and frequency.

    The columns are the h m coefficients, harmonic by harmonic, the 3 r of the damper's state, the
    2 c slips of the nodes that move, the frequency, and what nodes on the verge do: C in all.

    Parameters
    ----------
    F, Y, S
        Answers of all samples, as `upd.hbm.interface_samples.given_blades` leaves them.
    W : (3 n, 3 n) ndarray
        Inverse of A [N/mm].
    W_moved : (3 n, 2 c) ndarray
        Its columns of the tangents that move.
    Z : (3 n, m + r) ndarray
        W (Phi, B).
    M : (m + r, m + r) ndarray
        (Phi, B)' W (Phi, B).
    E : (N, h) ndarray
        Harmonics at the samples.
    moved : (2 c,) ndarray of int
        Dofs of these tangents.
    place : (3 n,) ndarray of int
        Number of each among them, or -1.
    columns, J, load, mu, rho_n, rho_t
        As in `upd.hbm.interface_samples.given_blades`.
    dJ : (r, r) ndarray
        Derivative of J by the frequency.
    forces : (N, m, C) ndarray
        Overwritten: derivative of the modal forces.
    D : (3 r + 2 c, C) ndarray
        Overwritten: derivative of the state after the period.

    Returns
    -------
    bool
        False where a sample's system is singular.
    """
    N, n, r = len(F), len(mu), len(load)
    m, h, C = Z.shape[1] - r, E.shape[1], D.shape[1]
    D[:] = 0.0
    for i in range(len(D)):
        D[i, h * m + i] = 1.0
    slips = D[3 * r :]
    # (Phi, B)' W of the slips so far
    held = np.zeros((m + r, C))
    for i in range(len(moved)):
        for j in range(m + r):
            held[j, h * m + 3 * r + i] = Z[moved[i], j]
    u, db = np.zeros((m + r, C)), np.empty((r, C))
    cols, owner = np.empty(3 * n, np.int64), np.empty(3 * n, np.int64)
    P, H, left = np.empty((3 * n, 3)), np.empty((3 * n, 3 * n)), np.empty(3 * n)
    pull, late = np.empty(r), np.empty(r)
    for j in range(N):
        f = F[j]
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
                u[i, e * m + i] = -E[j, e]
        for i in range(r):
            for e in range(C):
                u[m + i, e] = D[i, e] + D[r + i, e]
            u[m + i, C - 2] += 0.5 * late[i]
        out = np.dot(M, u)
        out -= held
        k, nodes = law_rows(f, Y[j], S[j], n, mu, rho_n, rho_t, cols, owner, P, left, H, W)
        if k > 0:
            Z_rows, W_rows = np.empty((3 * nodes, m + r)), np.empty((3 * nodes, len(moved)))
            Z_cols = np.empty((m + r, k))
            for row in range(k):
                i, o = cols[row] % n, 3 * owner[row]
                for e in range(3):
                    Z_rows[o + e], W_rows[o + e] = Z[e * n + i], W_moved[e * n + i]
                for e in range(m + r):
                    Z_cols[e, row] = Z[cols[row], e]
            pushed = np.dot(Z_rows, u) - np.dot(W_rows, slips)
            rhs = np.empty((k, C))
            for row in range(k):
                o = 3 * owner[row]
                for e in range(C):
                    rhs[row, e] = (
                        P[row, 0] * pushed[o, e]
                        + P[row, 1] * pushed[o + 1, e]
                        + P[row, 2] * pushed[o + 2, e]
                    )
                # P (dF - W dy) = left
                rhs[row, C - 1] -= left[row]
            try:
                dy = np.linalg.solve(H[:k, :k].copy(), rhs)
            except Exception:
                return False
            out -= np.dot(Z_cols, dy)
            for row in range(k):
                if cols[row] < n:
                    Z_cols[:, row] = 0.0
                else:
                    slips[place[cols[row]]] += dy[row]
            held += np.dot(Z_cols, dy)
        forces[j] = out[:m]
        db[:] = -np.dot(J, out[m:])
        for i in range(r):
            db[i, C - 2] += late[i]
            for e in range(C):
                D[i, e] += D[r + i, e] + 0.5 * db[i, e]
                D[r + i, e] += 0.25 * D[2 * r + i, e] + 0.75 * db[i, e]
                D[2 * r + i, e] = 0.5 * (D[2 * r + i, e] + db[i, e])
    return True
