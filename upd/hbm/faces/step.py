"""One step of contact by a whole interface, compiled.

All nodes have three components, laid out normal of all, then the two tangents of all. With W the
inverse of the step's compliance A (see `upd.hbm.faces.march`) and F = W (w* - w_ref) the forces
of everything stuck and closed, forces f, gaps g and slips dw of the step are

    f = F - W y,   y = (-g, dw).

A base fixes which nodes are open for the most part of a period, O, and which are closed, C; its
principal pivot swaps f and y of O. What follows from the base of the state, x = (f_C, y_O), follows
from what it takes for zero, (y_C, f_O):

    x = L F - T (y_C, f_O),   S = W_OO^-1,   L = [[1, -W_CO S], [0, S]],
    T = [[W_CC - W_CO S W_OC, -W_CO S], [S W_OC, S]],

and only the dofs of the nodes that slip or are not as the base has them are unknowns: a system of k
rows, not of 3 n. Its rows are those of the semismooth Newton method with the stabilised Jacobian,
as in `upd.contact.coulomb`.

References
----------
S. Hueeber, G. Stadler and B. I. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572.
"""

from __future__ import annotations

import numpy as np

from upd.linalg.compiled import compiled, inlined

OPEN, STICK, SLIP = 0, 1, 2
#: Newton takes 1 to 6 steps from the sample before; a run this long is cycling.
MOST_NEWTON = 40
#: misfit of the conditions over the largest force at which a step is solved
SOLVED = 1e-11
#: rows up to which plain elimination is faster than a call of LAPACK; it only weighs costs
FEW = 24

# Rows of numbers: copied, and summed with weights. No view of a row is made: one costs two atomic
# counts of references, as much as the row itself.


@inlined
def put(part, row, k):  # type: ignore[no-untyped-def]
    """Numbers into a row, from a place on; the place after them.

    Parameters
    ----------
    part, row : ndarray
        `row` is overwritten.
    k : int

    Returns
    -------
    int
    """
    # loops: whole-array assignments take seconds to compile
    for j in range(len(part)):
        row[k + j] = part[j]
    return k + len(part)


@inlined
def put_row(part, rows, k):  # type: ignore[no-untyped-def]
    """Numbers into row k of an array.

    Parameters
    ----------
    part : (j,) ndarray
    rows : (i, j) ndarray
        Overwritten.
    k : int
    """
    for j in range(len(part)):
        rows[k, j] = part[j]


@inlined
def fetch_row(rows, k, part):  # type: ignore[no-untyped-def]
    """What `put_row` did, undone.

    Parameters
    ----------
    rows : (i, j) ndarray
    k : int
    part : (j,) ndarray
        Overwritten.
    """
    for j in range(len(part)):
        part[j] = rows[k, j]


@inlined
def add_rows(x, sign, weights, rows, k, M, one):  # type: ignore[no-untyped-def]
    """Add to x rows of M[one] with weights.

    Parameters
    ----------
    x : (j,) ndarray
        Overwritten.
    sign : float
        Of all weights, 1 or -1.
    weights : (k,) ndarray or longer
    rows : (k,) ndarray of int or longer
        Which rows.
    k : int
    M : (B, i, j) ndarray
    one : int
    """
    # four rows a pass: x is read and written a quarter as often, in the order of one by one
    i = 0
    while i + 4 <= k:
        a, b, c, d = rows[i], rows[i + 1], rows[i + 2], rows[i + 3]
        wa, wb = sign * weights[i], sign * weights[i + 1]
        wc, wd = sign * weights[i + 2], sign * weights[i + 3]
        for j in range(len(x)):
            x[j] = (
                x[j] + wa * M[one, a, j] + wb * M[one, b, j] + wc * M[one, c, j] + wd * M[one, d, j]
            )
        i += 4
    while i < k:
        a, wa = rows[i], sign * weights[i]
        for j in range(len(x)):
            x[j] += wa * M[one, a, j]
        i += 1


@inlined
def gauss(H, b, k):  # type: ignore[no-untyped-def]
    """Solve the leading k rows of H x = b in place, by elimination with row exchanges.

    Large systems are left to LAPACK, whose blocks pay there.

    Parameters
    ----------
    H : (k, k) ndarray
        Destroyed.
    b : (k,) ndarray
        Overwritten by x.
    k : int

    Returns
    -------
    bool
        False where a pivot is zero.
    """
    if k > FEW:
        try:
            b[:k] = np.linalg.solve(H[:k, :k].copy(), b[:k].copy())
        except Exception:
            return False
        return True
    for i in range(k):
        best = i
        for r in range(i + 1, k):
            if abs(H[r, i]) > abs(H[best, i]):
                best = r
        if H[best, i] == 0.0:
            return False
        if best != i:
            for j in range(k):
                H[i, j], H[best, j] = H[best, j], H[i, j]
            b[i], b[best] = b[best], b[i]
        for r in range(i + 1, k):
            factor = H[r, i] / H[i, i]
            if factor != 0.0:
                # whole rows: what lies left of the pivot is not read again, and only a loop that
                # begins at zero is known to need no negative index, and so becomes vectors
                for j in range(k):
                    H[r, j] -= factor * H[i, j]
                b[r] -= factor * b[i]
    for i in range(k - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, k):
            total -= H[i, j] * b[j]
        b[i] = total / H[i, i]
    return True


@inlined
def judge(f, y, mu, rho_n, rho_t, state):  # type: ignore[no-untyped-def]
    """States of all nodes, and the largest misfit of f from its projection, in N.

    Parameters
    ----------
    f, y : (3 n,) ndarray
        Forces [N]; minus gaps, and slips of the step [mm].
    mu, rho_n, rho_t : (n,) ndarray
        Friction; weights of displacements against forces [N/mm], any positive ones.
    state : (n,) ndarray
        Overwritten.

    Returns
    -------
    float
        Misfit.
    """
    n, worst = len(mu), 0.0
    for i in range(n):
        push = f[i] + rho_n[i] * y[i]
        q1, q2 = f[n + i] + rho_t[i] * y[n + i], f[2 * n + i] + rho_t[i] * y[2 * n + i]
        if push <= 0.0:
            state[i] = OPEN
            off = max(abs(f[i]), abs(f[n + i]), abs(f[2 * n + i]))
        else:
            size, limit = np.sqrt(q1 * q1 + q2 * q2), mu[i] * push
            factor = 1.0
            state[i] = STICK
            if size > limit:
                state[i] = SLIP
                factor = limit / size
            off = max(
                abs(f[i] - push), abs(f[n + i] - factor * q1), abs(f[2 * n + i] - factor * q2)
            )
        worst = max(worst, off)
    return worst


@inlined
def slip_rows(f, y, i, n, mu, rho_n, rho_t):  # type: ignore[no-untyped-def]
    """Stabilised rows of a slipping node: (1 - T) f_t - rho T dw - mu v f_n = -T q.

    Parameters
    ----------
    f, y : (3 n,) ndarray
        The iterate.
    i, n : int
        Node, and nodes.
    mu, rho_n, rho_t : float
        Of the node.

    Returns
    -------
    tuple of float
        T row by row, v the direction of q, and q.
    """
    t1, t2 = f[n + i], f[2 * n + i]
    q1, q2 = t1 + rho_t * y[n + i], t2 + rho_t * y[2 * n + i]
    size, size_t = np.sqrt(q1 * q1 + q2 * q2), np.sqrt(t1 * t1 + t2 * t2)
    limit = mu * (f[i] + rho_n * y[i])
    v1, v2 = q1 / size, q2 / size
    e, top = limit / size, max(limit, size_t)
    beta, c1, c2 = 1.0, 0.0, 0.0
    if size_t > 0.0:
        cosine = (t1 * v1 + t2 * v2) / size_t
        short = min(size_t / limit, 1.0) if limit > 0.0 else 0.0
        # damping where traction and slip point apart; none where they agree
        beta = 1.0 / (1.0 - min(cosine, 0.0) * short)
        c1, c2 = beta * t1 / top, beta * t2 / top
    return (
        e * (1.0 - c1 * v1),
        -e * c1 * v2,
        -e * c2 * v1,
        e * (1.0 - c2 * v2),
        v1,
        v2,
        q1,
        q2,
    )


@inlined
def as_the_base_says(x, base, one, mu, allowed):  # type: ignore[no-untyped-def]
    """Whether all nodes stick where they are closed and do not touch where they are open.

    Parameters
    ----------
    x : (3 n,) ndarray
        Forces of the closed nodes [N], minus gaps and slips of the open ones [mm].
    base : (B, n) ndarray of bool
        Which nodes each base has open.
    one : int
        The base.
    mu : (n,) ndarray
        Friction.
    allowed : float
        Misfit that counts as none [N].

    Returns
    -------
    bool
    """
    n = len(mu)
    for i in range(n):
        if base[one, i]:
            if x[i] > 0.0:
                return False
            continue
        limit = mu[i] * max(x[i], 0.0) + allowed
        if x[i] < -allowed or x[n + i] ** 2 + x[2 * n + i] ** 2 > limit * limit:
            return False
    return True


@compiled
def contact_scratch(n):  # type: ignore[no-untyped-def]
    """What `contact_step` works in.

    Parameters
    ----------
    n : int
        Nodes.

    Returns
    -------
    tuple of ndarray
        (3 n,) dofs, signs and right sides of its rows; (3, 3 n) rows of a node; (3 n, 3 n) matrix.
    """
    cols, sign, b = np.empty(3 * n, np.int64), np.empty(3 * n), np.empty(3 * n)
    return cols, sign, b, np.empty((3, 3 * n)), np.empty((3 * n, 3 * n))


@inlined
def newton_rows(x0, bases, one, law, node, scratch):  # type: ignore[no-untyped-def]
    """The rows of one Newton step of `contact_step`, which has the same parameters.

    Returns
    -------
    int
        Rows, that is unknowns.
    """
    base, Tt = bases
    mu, rho_n, rho_t = law
    f, y, state = node
    cols, sign, b, G, H = scratch
    n, k = len(mu), 0
    for i in range(n):
        if state[i] != (OPEN if base[one, i] else STICK):
            # the gap of a node that slips stays closed
            for a in range(1 if state[i] == SLIP and not base[one, i] else 0, 3):
                cols[k] = a * n + i
                sign[k] = -1.0 if base[one, i] else 1.0
                k += 1
    r = 0
    while r < k:
        first = 1 if cols[r] >= n else 0
        i, s = cols[r] - first * n, sign[r]
        # T is symmetric but for the sign of what couples closed and open
        for a in range(3):
            d = a * n + i
            for j in range(k):
                G[a, j] = s * sign[j] * Tt[one, d, cols[j]]
        if state[i] != SLIP:
            # nothing of what the base takes for an unknown: f of an open node, y of a stuck one
            for a in range(3):
                b[r + a] = x0[a * n + i]
                for j in range(k):
                    H[r + a, j] = G[a, j]
            r += 3
            continue
        t11, t12, t21, t22, v1, v2, q1, q2 = slip_rows(f, y, i, n, mu[i], rho_n[i], rho_t[i])
        if first == 0:
            b[r] = x0[i]
            for j in range(k):
                H[r, j] = G[0, j]
        for a in range(2):
            row = r + 1 + a - first
            t1, t2, v = (t11, t12, v1) if a == 0 else (t21, t22, v2)
            p0, p1, p2 = -mu[i] * v, (1.0 if a == 0 else 0.0) - t1, (1.0 if a == 1 else 0.0) - t2
            w0, w1, w2, o0, o1, o2 = p0, p1, p2, 0.0, -rho_t[i] * t1, -rho_t[i] * t2
            if first == 0:
                w0, w1, w2, o0, o1, o2 = o0, o1, o2, w0, w1, w2
            b[row] = t1 * q1 + t2 * q2 + w0 * x0[i]
            b[row] += w1 * x0[n + i]
            b[row] += w2 * x0[2 * n + i]
            for j in range(k):
                H[row, j] = w0 * G[0, j] + w1 * G[1, j] + w2 * G[2, j]
            if first == 0:
                H[row, r] = w0 * G[0, r] - o0 + w1 * G[1, r] + w2 * G[2, r]
            j = r + 1 - first
            H[row, j] = w0 * G[0, j] + w1 * G[1, j] - o1 + w2 * G[2, j]
            H[row, j + 1] -= o2
        r += 3 - first
    return k


@inlined
def contact_step(x0, bases, one, law, node, warm, scratch):  # type: ignore[no-untyped-def]
    """Forces and relative motions of one step.

    Parameters
    ----------
    x0 : (3 n,) ndarray
        L F: forces of the closed nodes [N], minus gaps and slips of the open ones [mm], if all is
        as the base has it.
    bases : tuple of (B, n) ndarray of bool and (B, 3 n, 3 n) ndarray
        Which nodes each base has open, and the transpose of its T, which is symmetric but for the
        sign of what couples closed and open.
    one : int
        The base.
    law : tuple of three (n,) ndarray
        Friction mu, and weights rho_n, rho_t of displacements against forces [N/mm].
    node : tuple of two (3 n,) ndarray and an (n,) ndarray of int
        f, y and states of the step before; overwritten by forces [N], by minus gaps and slips [mm],
        and by the states.
    warm : bool
        Whether to start from the step before.
    scratch : tuple of ndarray
        From `contact_scratch`.

    Returns
    -------
    int
        Newton steps; 0 where all is as the base has it, -1 without an answer (f, y are then none).
    """
    base, Tt = bases
    mu, rho_n, rho_t = law
    f, y, state = node
    cols, sign, b, _, H = scratch
    n = len(mu)
    size = 0.0
    for i in range(n):
        if not base[one, i]:
            size = max(size, abs(x0[i]), abs(x0[n + i]), abs(x0[2 * n + i]))
    allowed = SOLVED * size
    simple = as_the_base_says(x0, base, one, mu, allowed)
    for i in range(n):
        open_ = base[one, i]
        usual = state[i] == (OPEN if open_ else STICK)
        if simple or usual or not warm:
            for a in range(3):
                d = a * n + i
                f[d] = 0.0 if open_ else x0[d]
                y[d] = x0[d] if open_ else 0.0
    if simple:
        for i in range(n):
            state[i] = OPEN if base[one, i] else STICK
        return 0
    judge(f, y, mu, rho_n, rho_t, state)
    for used in range(1, MOST_NEWTON + 1):
        k = newton_rows(x0, bases, one, law, node, scratch)
        if not gauss(H, b, k):
            return -1
        for d in range(3 * n):
            f[d], y[d] = x0[d], 0.0
        add_rows(f, -1.0, b, cols, k, Tt, one)
        for i in range(n):
            if base[one, i]:
                for a in range(3):
                    y[a * n + i], f[a * n + i] = f[a * n + i], 0.0
        for j in range(k):
            if sign[j] < 0.0:
                f[cols[j]] = b[j]
            else:
                y[cols[j]] = b[j]
        worst = judge(f, y, mu, rho_n, rho_t, state)
        if not worst < np.inf:
            return -1
        for d in range(3 * n):
            allowed = max(allowed, SOLVED * abs(f[d]))
        if worst <= allowed:
            for i in range(n):
                if state[i] == OPEN:
                    f[i], f[n + i], f[2 * n + i] = 0.0, 0.0, 0.0
                else:
                    y[i] = 0.0
                    if state[i] == STICK:
                        y[n + i], y[2 * n + i] = 0.0, 0.0
            return used
    return -1
