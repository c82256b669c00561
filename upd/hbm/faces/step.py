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
        (3 n,) dofs, signs and right sides of its rows; (3 n, 3 n) matrix.
    """
    cols, sign, b = np.empty(3 * n, np.int64), np.empty(3 * n), np.empty(3 * n)
    return cols, sign, b, np.empty((3 * n, 3 * n))


@inlined
def row_weights(d, node, law, open_, w, o):  # type: ignore[no-untyped-def]
    """Row of a dof that is not as the base has it: what is zero, or of a slipping node `slip_rows`.

    Parameters
    ----------
    d : int
    node, law : tuple of ndarray
        As in `contact_step`; the iterate.
    open_ : bool
        Whether the base has the node open.
    w, o : (3,) ndarray
        Overwritten: weights of what the base fixes of the node, forces where it is closed, and of
        the node's unknowns.

    Returns
    -------
    float
        Right side.
    """
    f, y, state = node
    mu, rho_n, rho_t = law
    n = len(mu)
    i, a = d % n, d // n
    for e in range(3):
        w[e], o[e] = 0.0, 0.0
    if state[i] != SLIP or a == 0:
        w[a] = 1.0
        return 0.0
    t11, t12, t21, t22, v1, v2, q1, q2 = slip_rows(f, y, i, n, mu[i], rho_n[i], rho_t[i])
    t1, t2, v = (t11, t12, v1) if a == 1 else (t21, t22, v2)
    p, q = (o, w) if open_ else (w, o)
    p[0], p[1], p[2] = -mu[i] * v, -t1, -t2
    p[a] += 1.0
    q[1], q[2] = -rho_t[i] * t1, -rho_t[i] * t2
    return t1 * q1 + t2 * q2


@inlined
def unknown_dofs(base, one, state, cols, sign):  # type: ignore[no-untyped-def]
    """Dofs that are not as the base has them, node by node, and their signs; both overwritten.

    Parameters
    ----------
    base, one
        As in `contact_step`.
    state : (n,) ndarray of int
    cols, sign : (3 n,) ndarray
        Overwritten: the dofs; -1 where the force is the unknown, 1 where the relative motion is.

    Returns
    -------
    int
        How many.
    """
    n, k = len(state), 0
    for i in range(n):
        if state[i] != (OPEN if base[one, i] else STICK):
            # the gap of a node that slips stays closed
            for a in range(1 if state[i] == SLIP and not base[one, i] else 0, 3):
                cols[k] = a * n + i
                sign[k] = -1.0 if base[one, i] else 1.0
                k += 1
    return k


@inlined
def newton_rows(x0, bases, one, law, node, scratch):  # type: ignore[no-untyped-def]
    """The rows of one Newton step of `contact_step`, which has the same parameters.

    Returns
    -------
    int
        Rows, that is unknowns.
    """
    base, Tt = bases
    cols, sign, b, H = scratch
    n = base.shape[1]
    k = unknown_dofs(base, one, node[2], cols, sign)
    w, o = np.empty(3), np.empty(3)
    first = 0
    for r in range(k):
        d = cols[r]
        i = d % n
        if r > 0 and cols[r - 1] % n != i:
            first = r
        b[r] = row_weights(d, node, law, base[one, i], w, o)
        for j in range(k):
            H[r, j] = 0.0
        for e in range(3):
            if w[e] != 0.0:
                b[r] += w[e] * x0[e * n + i]
                # T is symmetric but for the sign of what couples closed and open
                weight = w[e] * sign[r]
                for j in range(k):
                    H[r, j] += weight * sign[j] * Tt[one, e * n + i, cols[j]]
        for e in range(3):
            if o[e] != 0.0:
                H[r, first + e - cols[first] // n] -= o[e]
    return k


@inlined
def split(x, z, base, one, cols, k, f, y):  # type: ignore[no-untyped-def]
    """Forces and relative motions by what the base fixes and the unknowns.

    Parameters
    ----------
    x : (3 n,) ndarray
        What the base fixes; may be f.
    z : (k,) ndarray or longer
        Unknowns of the dofs `cols`.
    base, one
        As in `contact_step`.
    cols : (k,) ndarray of int or longer
    k : int
    f, y : (3 n,) ndarray
        Overwritten.
    """
    n = base.shape[1]
    for d in range(3 * n):
        if base[one, d % n]:
            y[d], f[d] = x[d], 0.0
        else:
            f[d], y[d] = x[d], 0.0
    for r in range(k):
        d = cols[r]
        if base[one, d % n]:
            f[d] = z[r]
        else:
            y[d] = z[r]


@inlined
def without_rounding(f, y, state):  # type: ignore[no-untyped-def]
    """Put what the states say is zero to zero; parameters as in `contact_step`."""
    n = len(state)
    for i in range(n):
        if state[i] == OPEN:
            f[i], f[n + i], f[2 * n + i] = 0.0, 0.0, 0.0
        else:
            y[i] = 0.0
            if state[i] == STICK:
                y[n + i], y[2 * n + i] = 0.0, 0.0


@inlined
def misfit_allowed(x0, base, one):  # type: ignore[no-untyped-def]
    """Rounding of the forces of the closed nodes; parameters as in `contact_step`."""
    n, size = base.shape[1], 0.0
    for d in range(3 * n):
        if not base[one, d % n]:
            size = max(size, abs(x0[d]))
    return SOLVED * size


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
    cols, _, b, H = scratch
    n = len(mu)
    allowed = misfit_allowed(x0, base, one)
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
        put(x0, f, 0)
        add_rows(f, -1.0, b, cols, k, Tt, one)
        split(f, b, base, one, cols, k, f, y)
        worst = judge(f, y, mu, rho_n, rho_t, state)
        if not worst < np.inf:
            return -1
        for d in range(3 * n):
            allowed = max(allowed, SOLVED * abs(f[d]))
        if worst <= allowed:
            without_rounding(f, y, state)
            return used
    return -1
