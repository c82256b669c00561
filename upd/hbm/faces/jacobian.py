r"""Derivative of one period of contact and damper, by recursion through its samples, compiled.

With db the change of w* - w_ref at a sample, the forces and the gaps and slips y of the dofs R that
are not held change by (see `upd.hbm.faces.step`; P, Q the rows of the laws at its answer)

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

from upd.hbm.faces.step import OPEN, STICK, row_weights
from upd.linalg.compiled import compiled
from upd.linalg.compiled_lu import factor_columns, invert_columns, solve_columns

#: state of a node that is asked to come to the verge of slipping
VERGE = 3


@compiled
def law_rows(node, law, on, nodes, rows, H, W):  # type: ignore[no-untyped-def]
    """Dofs that are not held, the rows of their laws, and the matrix P W_R - Q.

    Parameters
    ----------
    node : tuple of two (3 n,) ndarray and an (n,) ndarray of int
        Answer f, y of a sample, and states.
    law : tuple of three (n,) ndarray
        Friction, weights of displacements against forces.
    on : (n,) ndarray of int
        The nodes that are not held, in the order of the rows.
    nodes : int
        How many.
    rows : tuple of ndarray
        Overwritten: dofs (k,), the node of each, weights P (k, 3) of the node's three forces in
        each row, what the row lacks (k,) [N], and -Q (k, 2) of each row, by the node's two slips.
    H : (k, k) ndarray or larger
        Overwritten.
    W : (3 n, 3 n) ndarray

    Returns
    -------
    int
        Rows k.
    """
    f, _, state = node
    mu, _, rho_t = law
    cols, owner, P, left, keep = rows
    n, k = len(state), 0
    for o in range(nodes):
        i = on[o]
        for a in range(0 if state[i] == OPEN else 1, 3):
            cols[k], owner[k] = a * n + i, i
            k += 1
    left[:k] = 0.0
    w, slips = np.empty(3), np.empty(3)
    for row in range(k):
        i, first = owner[row], row
        while first > 0 and owner[first - 1] == i:
            first -= 1
        if state[i] == VERGE:
            size = np.sqrt(f[n + i] ** 2 + f[2 * n + i] ** 2)
            v1, v2 = f[n + i] / size, f[2 * n + i] / size
            if row == first:
                left[row] = mu[i] * f[i] - size
                w[0], w[1], w[2], slips[1], slips[2] = -mu[i], v1, v2, 0.0, 0.0
            else:
                # no slip across v; of the size of the other row
                w[:] = 0.0
                slips[1], slips[2] = v2 * rho_t[i], -v1 * rho_t[i]
        else:
            row_weights(cols[row], node, law, False, w, slips)
        P[row], keep[row, 0], keep[row, 1] = w, -slips[1], -slips[2]
        for j in range(k):
            d = cols[j]
            H[row, j] = w[0] * W[i, d] + (w[1] * W[n + i, d] + w[2] * W[2 * n + i, d])
        if state[i] != OPEN:
            H[row, first] += keep[row, 0]
            H[row, first + 1] += keep[row, 1]
    return k


@compiled
def factor_period(  # type: ignore[no-untyped-def]
    first_sample, last_sample, samples, W, Z, law, rows
):
    """Rows of samples, and the factors of their matrices.

    Parameters
    ----------
    first_sample, last_sample : int
        From the first on, up to the one before the last.
    samples : tuple of ndarray
        Answers F, Y of all samples, as `upd.hbm.faces.kept.given_blades` leaves them, and states
        with the verges.
    W : (3 n, 3 n) ndarray
        Inverse of A [N/mm]; symmetric.
    Z : (3 n, m + r) ndarray
        W (Phi, B).
    law : tuple of three (n,) ndarray
        Friction, weights of displacements against forces.
    rows : tuple of ndarray
        at, square (N + 1,): first row of each sample among all K, and first entry of its matrix
        among all. Overwritten are cols, owner (K,), P (K, 3), left (K,), keep (K, 2) as in
        `law_rows`; PZ, Z_rows (K, m + r): P Z, and Z in the rows of the dofs; factors: LU of
        P W_R - Q of each sample, column by column, one after the other; pivots (K,): rows that
        were exchanged.

    Returns
    -------
    bool
        False where a sample's system is singular.
    """
    F, Y, S = samples
    at, square, cols, owner, P, left, keep, PZ, Z_rows, factors, pivots = rows
    n, wide = S.shape[1], Z.shape[1]
    most = 0
    for j in range(first_sample, last_sample):
        most = max(most, at[j + 1] - at[j])
    H = np.empty((most, most))
    on = np.empty(n, np.int64)
    for j in range(first_sample, last_sample):
        a, b = at[j], at[j + 1]
        k = b - a
        if k == 0:
            continue
        count = 0
        for i in range(n):
            if S[j, i] != STICK:
                on[count] = i
                count += 1
        own = (cols[a:b], owner[a:b], P[a:b], left[a:b], keep[a:b])
        law_rows((F[j], Y[j], S[j]), law, on, count, own, H, W)
        for row in range(a, b):
            i = owner[row]
            for e in range(wide):
                Z_rows[row, e] = Z[cols[row], e]
                PZ[row, e] = 0.0
            for c in range(3):
                if P[row, c] != 0.0:
                    for e in range(wide):
                        PZ[row, e] += P[row, c] * Z[c * n + i, e]
        first = square[j]
        for e in range(k):
            for row in range(k):
                factors[first + e * k + row] = H[row, e]
        if not factor_columns(factors[first : first + k * k], pivots[a:b]):
            return False
    return True


@compiled
def invert_period(  # type: ignore[no-untyped-def]
    first_sample, last_sample, at, square, factors, pivots
):
    """Factors of samples overwritten by inverses, column by column; parameters as above.

    Returns
    -------
    bool
        False where one is singular.
    """
    for j in range(first_sample, last_sample):
        a, b = at[j], at[j + 1]
        if b > a and not invert_columns(factors[square[j] : square[j + 1]], pivots[a:b]):
            return False
    return True


@compiled
def march_directions(  # type: ignore[no-untyped-def]
    S, step, nodes, rows, inverted, change, ends, forces
):
    """March directions through the period: what they do to modal forces and end state.

    Parameters
    ----------
    S, rows
        States and rows, as in `factor_period`.
    step : tuple of ndarray
        W, Z as in `factor_period`, M = (Phi, B)' W (Phi, B), J as in
        `upd.hbm.faces.kept.given_blades`, and dJ (p - B' f) of the samples (N, r).
    nodes : tuple of ndarray
        Tangents of the nodes that move (2 c,), first ones, then second ones, and the number (3 n,)
        of each dof among them, or -1.
    inverted : bool
        Whether the factors have been overwritten by inverses, which many directions share.
    change : tuple of ndarray
        In each of C directions: changes of the blades' modes at the samples (N, m, C) and of the
        frequency (C,) [rad/s]; share (C,) of what nodes on the verge do by themselves.
    ends : tuple of ndarray
        Changes of the damper's state (3 r, C), and of the slips (2 c, C) of the nodes that move;
        overwritten by those after the period.
    forces : (N, m, C) ndarray
        Overwritten: changes of the modal forces.
    """
    W, Z, M, J, late = step
    moved, place = nodes
    at = rows[0]
    motion, faster, verge = change
    R, slips = ends
    N, n, C = len(S), S.shape[1], len(faster)
    r, m, wide = len(J), motion.shape[1], Z.shape[1]
    most = 0
    for j in range(N):
        most = max(most, at[j + 1] - at[j])
    work = np.empty((most, C)), np.empty((most, C)), np.empty((wide, C))
    u, db, out = np.empty((wide, C)), np.empty((r, C)), np.empty((wide, C))
    # (Phi, B)' W of the slips of nodes that are held, and W of them in the rows of the others
    held, V = np.zeros((wide, C)), np.empty((3 * n, C))
    for i in range(len(moved)):
        for e in range(wide):
            for c in range(C):
                held[e, c] += Z[moved[i], e] * slips[i, c]
    on = np.zeros(n, np.bool_)
    for j in range(N):
        for i in range(m):
            for c in range(C):
                u[i, c] = -motion[j, i, c]
        for i in range(r):
            for c in range(C):
                u[m + i, c] = R[i, c] + R[r + i, c] + 0.5 * late[j, i] * faster[c]
        _change_stretches(S[j], W, Z, nodes, slips, held, V, on)
        np.dot(M, u, out)
        for e in range(wide):
            for c in range(C):
                out[e, c] -= held[e, c]
        if at[j + 1] > at[j]:
            _move_nodes(j, rows, inverted, place, u, (slips, V, verge), work, out)
        for i in range(m):
            for c in range(C):
                forces[j, i, c] = out[i, c]
        for i in range(r):
            for c in range(C):
                db[i, c] = late[j, i] * faster[c]
            for e in range(r):
                for c in range(C):
                    db[i, c] -= J[i, e] * out[m + e, c]
        for i in range(r):
            for c in range(C):
                R[i, c] += R[r + i, c] + 0.5 * db[i, c]
                R[r + i, c] += 0.25 * R[2 * r + i, c] + 0.75 * db[i, c]
                R[2 * r + i, c] = 0.5 * (R[2 * r + i, c] + db[i, c])


@compiled
def _move_nodes(j, rows, inverted, place, u, change, work, out):  # type: ignore[no-untyped-def]
    """Slips of the nodes that are not held at sample j, and what they take from `out`.

    Parameters
    ----------
    j, rows, inverted, place
        As in `march_directions`.
    u : (m + r, C) ndarray
        Changes of modes and damper.
    change : tuple of ndarray
        Slips, overwritten, V as in `_change_stretches`, and shares of the verges.
    work : tuple of ndarray
        Scratch.
    out : (m + r, C) ndarray
        (Phi, B)' times the changes of the forces; updated.
    """
    at, square, cols, owner, P, left, keep, PZ, Z_rows, factors, pivots = rows
    slips, V, verge = change
    a, b = at[j], at[j + 1]
    k, n, C = b - a, len(V) // 3, len(verge)
    rhs, z, part = work[0][:k], work[1][:k], work[2]
    np.dot(PZ[a:b], u, rhs)
    for row in range(k):
        i = owner[a + row]
        for d in range(3):
            weight, other = P[a + row, d], d * n + i
            if weight != 0.0:
                for c in range(C):
                    rhs[row, c] -= weight * V[other, c]
        for d in range(2):
            weight, other = keep[a + row, d], place[(1 + d) * n + i]
            if weight != 0.0:
                for c in range(C):
                    rhs[row, c] += weight * slips[other, c]
        # P (dF - W dy) = left
        weight = left[a + row]
        if weight != 0.0:
            for c in range(C):
                rhs[row, c] -= weight * verge[c]
    matrix = factors[square[j] : square[j + 1]]
    if inverted:
        np.dot(matrix.reshape(k, k).T, rhs, z)
    else:
        z[:] = rhs
        solve_columns(matrix, pivots[a:b], z)
    np.dot(Z_rows[a:b].T, z, part)
    for e in range(len(out)):
        for c in range(C):
            out[e, c] -= part[e, c]
    for row in range(k):
        if cols[a + row] >= n:
            other = place[cols[a + row]]
            for c in range(C):
                slips[other, c] = z[row, c]


@compiled
def _change_stretches(state, W, Z, nodes, slips, held, V, on):  # type: ignore[no-untyped-def]
    """Let stretches of motion begin and end.

    Parameters
    ----------
    state : (n,) ndarray of int
        At the sample.
    W, Z, nodes
        As in `march_directions`.
    slips : (2 c, C) ndarray
        Of the nodes that move in the period.
    held : (m + r, C) ndarray
        (Phi, B)' W of the slips of nodes that are held; updated.
    V : (3 n, C) ndarray
        W of them, in the rows of the nodes that are not; updated.
    on : (n,) ndarray of bool
        Whether a node was not held at the sample before; overwritten.
    """
    moved, place = nodes
    n, C, wide = len(state), slips.shape[1], Z.shape[1]
    changed, begun, going = 0, 0, 0
    for i in range(n):
        moves = state[i] != STICK
        if moves != on[i]:
            changed += 1
            begun += moves
        elif moves:
            going += 1
    if changed == 0:
        return
    # what nodes that change take from the slips of held ones, or add to them
    part, who, a = np.empty((2 * changed, C)), np.empty(2 * changed, np.int64), 0
    for i in range(n):
        if (state[i] != STICK) != on[i]:
            sign = 1.0 if state[i] == STICK else -1.0
            for d in (n + i, 2 * n + i):
                for c in range(C):
                    part[a, c] = sign * slips[place[d], c]
                for e in range(wide):
                    for c in range(C):
                        held[e, c] += Z[d, e] * part[a, c]
                who[a] = d
                a += 1
    if going > 0:
        rows, W_part = np.empty(3 * going, np.int64), np.empty((3 * going, 2 * changed))
        row = 0
        for i in range(n):
            if on[i] and state[i] != STICK:
                for d in (i, n + i, 2 * n + i):
                    for a in range(2 * changed):
                        W_part[row, a] = W[d, who[a]]
                    rows[row] = d
                    row += 1
        more = np.dot(W_part, part)
        for row in range(3 * going):
            for c in range(C):
                V[rows[row], c] += more[row, c]
    if begun > 0:
        rows, W_part = np.empty(3 * begun, np.int64), np.zeros((3 * begun, len(moved)))
        row = 0
        for i in range(n):
            if not on[i] and state[i] != STICK:
                for d in (i, n + i, 2 * n + i):
                    for a in range(len(moved)):
                        if state[moved[a] % n] == STICK:
                            W_part[row, a] = W[d, moved[a]]
                    rows[row] = d
                    row += 1
        more = np.dot(W_part, slips)
        for row in range(3 * begun):
            for c in range(C):
                V[rows[row], c] = more[row, c]
    for i in range(n):
        on[i] = state[i] != STICK
