"""One step of contact by a whole interface, and the steps of a march, compiled.

All nodes have three components, laid out normal of all, then the two tangents of all. With W the
inverse of the step's compliance A (see `upd.hbm.interface_march`) and F = W (w* - w_ref) the forces
of everything stuck and closed, the forces are

    f = F - W y,   y = (-g, dw),

with the gaps g and the slips dw of the step. y is zero but at the k dofs that slip or are open, so
a system of k rows is solved, not one of 3 n. Its rows are those of the semismooth Newton method
with the stabilised Jacobian, as in `upd.contact.coulomb`.

References
----------
S. Hueeber, G. Stadler and B. I. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572.
"""

from __future__ import annotations

import numpy as np

from upd.hbm.compiled import compiled

OPEN, STICK, SLIP = 0, 1, 2
#: Newton takes 1 to 6 steps from the sample before; a run this long is cycling.
MOST_NEWTON = 40
#: misfit of the conditions over the largest force at which a step is solved
SOLVED = 1e-11


@compiled
def gauss(H, b, k):  # type: ignore[no-untyped-def]
    """Solve the leading k rows of H x = b in place, by elimination with row exchanges.

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
    for i in range(k):
        best = i
        for r in range(i + 1, k):
            if abs(H[r, i]) > abs(H[best, i]):
                best = r
        if H[best, i] == 0.0:
            return False
        if best != i:
            for j in range(i, k):
                H[i, j], H[best, j] = H[best, j], H[i, j]
            b[i], b[best] = b[best], b[i]
        for r in range(i + 1, k):
            factor = H[r, i] / H[i, i]
            if factor != 0.0:
                for j in range(i + 1, k):
                    H[r, j] -= factor * H[i, j]
                b[r] -= factor * b[i]
    for i in range(k - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, k):
            total -= H[i, j] * b[j]
        b[i] = total / H[i, i]
    return True


@compiled
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


@compiled
def slip_rows(f, y, i, n, mu, rho_n, rho_t, T, v):  # type: ignore[no-untyped-def]
    """Stabilised rows of a slipping node: (1 - T) f_t - rho T dw - mu v f_n = -T q.

    Parameters
    ----------
    f, y : (3 n,) ndarray
        The iterate.
    i, n : int
        Node, and nodes.
    mu, rho_n, rho_t : float
        Of the node.
    T : (2, 2) ndarray
        Overwritten.
    v : (4,) ndarray
        Overwritten: direction of q, then q itself.
    """
    t1, t2 = f[n + i], f[2 * n + i]
    q1, q2 = t1 + rho_t * y[n + i], t2 + rho_t * y[2 * n + i]
    size, size_t = np.sqrt(q1 * q1 + q2 * q2), np.sqrt(t1 * t1 + t2 * t2)
    limit = mu * (f[i] + rho_n * y[i])
    v[0], v[1], v[2], v[3] = q1 / size, q2 / size, q1, q2
    e, top = limit / size, max(limit, size_t)
    beta, c1, c2 = 1.0, 0.0, 0.0
    if size_t > 0.0:
        cosine = (t1 * v[0] + t2 * v[1]) / size_t
        short = min(size_t / limit, 1.0) if limit > 0.0 else 0.0
        # damping where traction and slip point apart; none where they agree
        beta = 1.0 / (1.0 - min(cosine, 0.0) * short)
        c1, c2 = beta * t1 / top, beta * t2 / top
    T[0, 0], T[0, 1] = e * (1.0 - c1 * v[0]), -e * c1 * v[1]
    T[1, 0], T[1, 1] = -e * c2 * v[0], e * (1.0 - c2 * v[1])


@compiled
def contact_step(F, W, mu, rho_n, rho_t, f, y, state, warm, work):  # type: ignore[no-untyped-def]
    """Forces and relative motions of one step.

    Parameters
    ----------
    F : (3 n,) ndarray
        Forces of everything stuck and closed [N].
    W : (3 n, 3 n) ndarray
        Inverse of the compliance, symmetric [N/mm].
    mu, rho_n, rho_t : (n,) ndarray
        Friction, and weights of displacements against forces [N/mm].
    f, y : (3 n,) ndarray
        Of the step before; overwritten by forces [N], and by minus gaps and slips [mm].
    state : (n,) ndarray of int
        Of the step before; overwritten.
    warm : bool
        Whether to start from the step before.
    work : (3 n, 3 n) ndarray
        Scratch.

    Returns
    -------
    int
        Newton steps; 0 where everything sticks, -1 without an answer (f, y are then no answer).
    """
    n = len(mu)
    size = 0.0
    for d in range(3 * n):
        size = max(size, abs(F[d]))
    allowed = SOLVED * size
    stuck = True
    for i in range(n):
        limit = mu[i] * max(F[i], 0.0) + allowed
        if F[i] < -allowed or F[n + i] ** 2 + F[2 * n + i] ** 2 > limit * limit:
            stuck = False
            break
    if stuck:
        f[:] = F
        y[:] = 0.0
        state[:] = STICK
        return 0
    for i in range(n):
        if not warm or state[i] == STICK:
            for d in (i, n + i, 2 * n + i):
                f[d], y[d] = F[d], 0.0
    judge(f, y, mu, rho_n, rho_t, state)
    rows = np.empty(3 * n, np.int64)
    b = np.empty(3 * n)
    T, v = np.empty((2, 2)), np.empty(4)
    for used in range(1, MOST_NEWTON + 1):
        k = 0
        for i in range(n):
            if state[i] == OPEN:
                rows[k], rows[k + 1], rows[k + 2] = i, n + i, 2 * n + i
                k += 3
            elif state[i] == SLIP:
                rows[k], rows[k + 1] = n + i, 2 * n + i
                k += 2
        r = 0
        while r < k:
            i = rows[r] % n
            if state[i] == OPEN:
                for a in range(3):
                    d = rows[r + a]
                    b[r + a] = F[d]
                    for j in range(k):
                        work[r + a, j] = W[d, rows[j]]
                r += 3
                continue
            slip_rows(f, y, i, n, mu[i], rho_n[i], rho_t[i], T, v)
            for a in range(2):
                p1, p2 = (1.0 if a == 0 else 0.0) - T[a, 0], (1.0 if a == 1 else 0.0) - T[a, 1]
                p0 = -mu[i] * v[a]
                b[r + a] = p0 * F[i] + p1 * F[n + i] + p2 * F[2 * n + i]
                b[r + a] += T[a, 0] * v[2] + T[a, 1] * v[3]
                for j in range(k):
                    c = rows[j]
                    work[r + a, j] = p0 * W[i, c] + p1 * W[n + i, c] + p2 * W[2 * n + i, c]
                work[r + a, r] += rho_t[i] * T[a, 0]
                work[r + a, r + 1] += rho_t[i] * T[a, 1]
            r += 2
        if not gauss(work, b, k):
            return -1
        y[:] = 0.0
        f[:] = F
        for j in range(k):
            d = rows[j]
            y[d] = b[j]
            for c in range(3 * n):
                f[c] -= b[j] * W[d, c]
        worst = judge(f, y, mu, rho_n, rho_t, state)
        if worst <= allowed:
            # rounding on the border of two states leaves neither gap nor slip
            for i in range(n):
                if state[i] == STICK or (y[i] == 0.0 and y[n + i] == 0.0 and y[2 * n + i] == 0.0):
                    if state[i] == OPEN:
                        continue
                    state[i] = STICK
                    y[i], y[n + i], y[2 * n + i] = 0.0, 0.0, 0.0
            return used
        if not worst < np.inf:
            return -1
    return -1


@compiled
def march_steps(  # type: ignore[no-untyped-def]
    first,
    last,
    given,
    dt,
    drive,
    blades,
    shapes,
    inverse_mass,
    load,
    Z,
    W,
    mu,
    rho_n,
    rho_t,
    loss,
    places,
    seen_modes,
    seen_contact,
    seen_drive,
    pulled,
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
    F,
    work,
    out,
    counts,
    energy,
    forces,
    states,
):
    """March samples first + 1 to last of a period.

    Parameters
    ----------
    first, last : int
        Samples.
    given : bool
        Whether the first step was solved elsewhere: F, y and state then hold its answer.
    dt : float
        Step [s].
    drive : (N + 1, L) ndarray
        Excitation at the samples [N].
    blades : (8, m) ndarray
        Step of each mode: q by q, v, and by its force before and after; v by the same.
    shapes : (3 n, m + r) ndarray
        Modes and rigid motions at the nodes.
    inverse_mass, load : (r, r) and (r,) ndarray
        Of the damper.
    Z : (r + m + L, 3 n) ndarray
        Forces of everything stuck by predicted rigid motions, modes and excitation.
    W, mu, rho_n, rho_t
        As `contact_step`.
    loss : (m,) ndarray
        2 zeta omega.
    places : (m, L) ndarray
        Modes at the places of excitation.
    seen_modes, seen_contact, seen_drive : (K, m), (K, 3 n), (K, L) ndarray
        What the outputs are made of.
    pulled : (L, 3 n) ndarray
        Residual displacement of the places of excitation by contact forces [mm/N].
    q, v, p : (m,) ndarray
        Modes, their velocities and forces; overwritten.
    s, sv, sa : (r,) ndarray
        Damper's motion, velocity and acceleration; overwritten.
    f, y, slip, state : ndarray
        Forces (3 n,), last relative motions (3 n,), sums of slips (2 n,) and states (n,);
        overwritten.
    c : (3 n,) ndarray
        -W w_ref; overwritten.
    F, work : ndarray
        Scratch (3 n,) and (3 n, 3 n); F are the forces of everything stuck in the last step.
    out : (N, K) ndarray
        Outputs, overwritten from `first` on.
    counts : (4,) ndarray of int
        Open, sticking and slipping nodes, and Newton steps; added to.
    energy : (3,) ndarray
        Work of the excitation, lost by damping and by friction [N mm]; added to.
    forces, states : (N, 3 n), (N, n) ndarray
        Every sample's; empty where they are not wanted.

    Returns
    -------
    int
        Where it ended: `last`, or the sample before a step without an answer.
    """
    n, m, r, L = len(mu), len(q), len(s), drive.shape[1]
    K = out.shape[1]
    zq, zs, p1, back = np.empty(m), np.empty(r), np.empty(m), np.empty(m + r)
    before, pull = np.empty(3 * n), np.empty(r)
    for step in range(first, last):
        for j in range(m):
            zq[j] = blades[0, j] * q[j] + blades[1, j] * v[j] + blades[2, j] * p[j]
            p1[j] = 0.0
            for place in range(L):
                p1[j] += places[j, place] * drive[step + 1, place]
            zq[j] += blades[3, j] * p1[j]
        for j in range(r):
            zs[j] = s[j] + dt * sv[j]
            for i in range(r):
                zs[j] += 0.5 * dt * dt * inverse_mass[j, i] * load[i]
        before[:] = f
        if given and step == first:
            f[:] = F
            used = 0
        else:
            F[:] = c
            for j in range(r):
                F += zs[j] * Z[j]
            for j in range(m):
                F += zq[j] * Z[r + j]
            for place in range(L):
                F += drive[step + 1, place] * Z[r + m + place]
            y_before = y.copy()
            state_before = state.copy()
            used = contact_step(F, W, mu, rho_n, rho_t, f, y, state, True, work)
            if used < 0:
                used = contact_step(F, W, mu, rho_n, rho_t, f, y, state, False, work)
            if used < 0:
                f[:], y[:], state[:] = before, y_before, state_before
                return step
        back[:] = 0.0
        for d in range(3 * n):
            if f[d] != 0.0:
                for j in range(m + r):
                    back[j] += f[d] * shapes[d, j]
        for place in range(L):
            mean, moved = 0.5 * (drive[step, place] + drive[step + 1, place]), 0.0
            for j in range(m):
                moved += places[j, place] * (zq[j] + blades[3, j] * back[j] - q[j])
            for d in range(3 * n):
                moved += pulled[place, d] * (f[d] - before[d])
            energy[0] += mean * moved
        for j in range(m):
            p1[j] += back[j]
            old_q, old_v = q[j], v[j]
            q[j] = zq[j] + blades[3, j] * back[j]
            v[j] = blades[4, j] * old_q + blades[5, j] * old_v
            v[j] += blades[6, j] * p[j] + blades[7, j] * p1[j]
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
                c -= y[d] * W[d]
        for i in range(n):
            counts[state[i]] += 1
        counts[3] += used
        for one in range(K):
            total = 0.0
            for j in range(m):
                total += seen_modes[one, j] * q[j]
            for d in range(3 * n):
                total += seen_contact[one, d] * f[d]
            for place in range(L):
                total += seen_drive[one, place] * drive[step + 1, place]
            out[step, one] = total
        if len(forces) > 0:
            forces[step] = f
            states[step] = state
    return last
