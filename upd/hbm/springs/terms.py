"""Residual of the balance and the parts of its Jacobian in compiled loops.

What `upd.hbm.springs.balance` writes out with whole matrices, made from modal amplitudes: the
residual needs no receptance, w - u + G f = w - Psi D^-1 (p - Psi'f), and the Jacobian

    J = I + G df/dw

is kept as df/dw of the points that move. A point that sticks over the whole cycle, or is open over
the whole cycle, follows its motion by a constant stiffness.
"""

from __future__ import annotations

import numpy as np

from upd.hbm.springs.period import GIVEN, march_point
from upd.linalg.compiled import compiled

#: smallest motion, relative to the mean displacement, that is converged to its own size
SMALL_MOTION = 1e-3
#: what a point does over the whole cycle
MOVES, STICKS, OPEN = 0, 1, 2


@compiled
def _whole_cycle(w, k_n, k_t, mu, preload, gap, mode, slider):  # type: ignore[no-untyped-def]
    """Whether a point sticks or is open at every sample of its motion w (1 + d, n)."""
    d = w.shape[0] - 1
    for j in range(w.shape[1]):
        if preload + k_n * (w[0, j] - gap) > 0.0:
            break
    else:
        return OPEN
    if mode != GIVEN and d > 0:
        return MOVES
    for j in range(w.shape[1]):
        N = preload + k_n * (w[0, j] - gap)
        if N <= 0.0:
            return MOVES
        square = 0.0
        for i in range(d):
            T = k_t * (w[1 + i, j] - slider[i])
            square += T * T
        if square > (mu * N) ** 2:
            return MOVES
    return STICKS


@compiled
def _normal_tangent(slope, E, Q, k_n, rows, out):  # type: ignore[no-untyped-def]
    """Derivative (size, size) of the normal force's coefficients by those of the closing motion.

    `slope` (3, n) as `upd.hbm.springs.points.March` keeps it, rows (n, size) is scratch.
    """
    n, size = E.shape
    always = True
    for j in range(n):
        if slope[1, j] != 1.0 or slope[0, j] != 0.0 or slope[2, j] != 0.0:
            always = False
            break
    if always:
        # the analysis of a synthesis
        for m in range(size):
            out[m, m] = k_n
        return
    for j in range(n):
        b, a = j - 1 if j > 0 else n - 1, j + 1 if j < n - 1 else 0
        for m in range(size):
            rows[j, m] = k_n * (
                slope[0, j] * E[b, m] + slope[1, j] * E[j, m] + slope[2, j] * E[a, m]
            )
    out[:, :] = np.dot(Q, rows)


@compiled
def contact_terms(W, transform, static, law, start, jacobian):  # type: ignore[no-untyped-def]
    """Coefficients of the contact force and their derivative.

    Parameters
    ----------
    W : (n_point, 1 + d, size) ndarray
        Coefficients of the relative displacements [mm].
    transform : tuple of ndarray
        Synthesis matrix (n, size) and its transpose, analysis matrix (size, n) and its transpose.
    static : bool
        Whether harmonic 0 is among the coefficients.
    law, start, jacobian
        As in `upd.hbm.springs.period.march_points`.

    Returns
    -------
    F : (n_point, 1 + d, size) ndarray
        Coefficients [N].
    state : (n_point,) ndarray of int8
        MOVES, STICKS or OPEN.
    DF : (n_moving, 1 + d, size, 1 + d, size) ndarray
        Derivative of those that move, in order; empty unless asked for [N/mm].
    """
    E, Et, Q, Qt = transform
    k_n, k_t, mu, preload, gap = law
    mode, slider, _ = start
    n_point, d1, size = W.shape
    n = len(E)
    F, state = np.zeros((n_point, d1, size)), np.zeros(n_point, np.int8)
    DF = np.zeros((n_point if jacobian else 0, d1, size, d1, size))
    force, weighed = np.empty((d1, n)), np.empty((d1, n))
    marks, slope = np.empty(n, np.int8), np.empty((3, n))
    tangent = np.empty((d1 - 1 if jacobian else 0, n, d1 * size))
    rows = np.empty((n if jacobian else 0, size))
    filled = (force, weighed, marks, slope, tangent)
    moving = 0
    for p in range(n_point):
        w = np.dot(W[p], Et)
        state[p] = _whole_cycle(w, k_n[p], k_t[p], mu[p], preload[p], gap[p], mode, slider[p])
        if state[p] == OPEN:
            continue
        if state[p] == STICKS:
            F[p, 0] = k_n[p] * W[p, 0]
            if static:
                F[p, 0, 0] += preload[p] - k_n[p] * gap[p]
            if mu[p] > 0.0:
                for i in range(1, d1):
                    F[p, i] = k_t[p] * W[p, i]
                    if static:
                        F[p, i, 0] -= k_t[p] * slider[p, i - 1]
            continue
        march_point(w, E, law, p, start, jacobian, filled)
        F[p] = np.dot(weighed, Qt)
        if jacobian:
            block = np.zeros((size, size))
            _normal_tangent(slope, E, Q, k_n[p], rows, block)
            DF[moving, 0, :, 0, :] = block
            for i in range(d1 - 1):
                DF[moving, 1 + i] = np.dot(Q, tangent[i]).reshape(size, d1, size)
        moving += 1
    return F, state, DF[:moving]


@compiled
def _modal_solve(w, right, eigenvalues, damping):  # type: ignore[no-untyped-def]
    """Modal amplitudes (m,) under modal forces; damping (1, m) where it is diagonal, else (m, m).

    Infinite or not a number at an undamped natural frequency.
    """
    m = len(eigenvalues)
    if len(damping) == m and m > 1:
        D = np.zeros((m, m), np.complex128)
        for i in range(m):
            for j in range(m):
                D[i, j] = 1j * w * damping[i, j]
            D[i, i] += eigenvalues[i] - w * w
        return np.linalg.solve(D, right)
    out = np.empty(m, np.complex128)
    for i in range(m):
        x, y = eigenvalues[i] - w * w, w * damping[0, i]
        size = x * x + y * y
        a, b = right[i].real, right[i].imag
        out[i] = complex((a * x + b * y) / size, (b * x - a * y) / size)
    return out


@compiled
def residual_terms(W, a, F, k, omega, linear, acting, slopes):  # type: ignore[no-untyped-def]
    """Residual w - u + G f and the rigid equilibrium, from modal amplitudes.

    Parameters
    ----------
    W, F : (c, size) ndarray
        Coefficients of the relative displacements [mm] and of the contact forces [N].
    a : (n_rigid,) ndarray
        Static amplitudes of the rigid modes.
    k : (n_k,) ndarray of float
        Harmonics above 0.
    omega : float
        Angular frequency [rad/s].
    linear : tuple of ndarray
        Eigenvalues of the modes (m,), and which are rigid; modal damping (m, m), or one row (1, m)
        where it is diagonal; rows Psi (c, m) of the contacts on the modes, and their transpose.
    acting : tuple of ndarray
        Dynamic modal loads (n_k, m), complex; static motion (c,) without contacts; static loads
        (n_rigid,) on the rigid modes.
    slopes : bool
        Whether the derivative is wanted.

    Returns
    -------
    residual : (c size + n_rigid,) ndarray
    by_frequency : (c size + n_rigid,) ndarray
        Its derivative by the angular frequency; zero unless asked for.
    """
    eigenvalues, rigid, damping, Psi, PsiT = linear
    loads, u0, rigid_load = acting
    c, size = W.shape
    m, o, n = len(eigenvalues), size - 2 * len(k), c * size
    static = o == 1
    residual, by_frequency = np.zeros(n + len(a)), np.zeros(n + len(a))
    P = np.dot(PsiT, F)
    H = np.zeros((m, size))
    S = np.zeros((m, size))
    right = np.empty(m, np.complex128)
    for h in range(len(k)):
        x, w = o + 2 * h, k[h] * omega
        for i in range(m):
            right[i] = loads[h, i] - complex(P[i, x], -P[i, x + 1])
        eta = _modal_solve(w, right, eigenvalues, damping)
        for i in range(m):
            H[i, x], H[i, x + 1] = eta[i].real, -eta[i].imag
        if slopes:
            for i in range(m):
                right[i] = 2.0 * w * eta[i]
                if len(damping) == 1 or m == 1:
                    right[i] -= 1j * damping[0, i] * eta[i]
                else:
                    for j in range(m):
                        right[i] -= 1j * damping[i, j] * eta[j]
            slope = _modal_solve(w, right, eigenvalues, damping)
            for i in range(m):
                S[i, x], S[i, x + 1] = k[h] * slope[i].real, -k[h] * slope[i].imag
    if static:
        place = 0
        for i in range(m):
            if rigid[i]:
                H[i, 0] = a[place]
                residual[n + place] = P[i, 0] - rigid_load[place]
                place += 1
            else:
                H[i, 0] = -P[i, 0] / eigenvalues[i]
    top = residual[:n].reshape((c, size))
    top[:] = W - np.dot(Psi, H)
    if static:
        top[:, 0] -= u0
    if slopes:
        by_frequency[:n].reshape((c, size))[:] = -np.dot(Psi, S)
    return residual, by_frequency


@compiled
def receptances(w, eigenvalues, damping, Psi, PsiT):  # type: ignore[no-untyped-def]
    """Psi D^-1 Psi' (n_w, r, r), real and imaginary part, of diagonal damping (m,) [mm/N]."""
    r, m = Psi.shape
    real, imag = np.empty((len(w), r, r)), np.empty((len(w), r, r))
    A, B = np.empty((r, m)), np.empty((r, m))
    for h in range(len(w)):
        for i in range(m):
            x, y = eigenvalues[i] - w[h] * w[h], w[h] * damping[i]
            size = x * x + y * y
            for p in range(r):
                A[p, i], B[p, i] = Psi[p, i] * (x / size), -Psi[p, i] * (y / size)
        real[h], imag[h] = np.dot(A, PsiT), np.dot(B, PsiT)
    return real, imag


@compiled
def bordered(compliance, DF, static, D, D_rigid, border):  # type: ignore[no-untyped-def]
    """Transpose of [[I + G df/dw, -R, r_p], [R'df_0/dw, below, r_p], [border]], scaled.

    Unknowns and equations are ordered by coefficient first, then by row of the contacts. The
    equations are divided by their largest entry.

    Parameters
    ----------
    compliance : tuple of ndarray
        Transposed receptance (n_k, c, c), real and imaginary part [mm/N]; static compliance (c, c);
        rigid modes at the rows (c, n_rigid); stiffness (n_rigid, n_rigid) of the rigid modes
        against points not among the rows [N/mm].
    DF : (n_point, d1, size, d1, size) ndarray
        Derivative of the contact forces, n_point d1 = c [N/mm].
    static : bool
        Whether harmonic 0 is among the coefficients.
    D : (size, c) ndarray
        Sizes of the unknowns.
    D_rigid : (n_rigid,) ndarray
        Sizes of the rigid amplitudes.
    border : tuple
        Border of the scaled unknowns (size c + n_rigid,), its derivative by the contact forces
        (size, c), derivative by the parameter (size c + n_rigid,), scaled, and the last entry.

    Returns
    -------
    A : (n, n) ndarray
    rows : (n - 1,) ndarray
        What the equations were divided by.
    """
    real, imag, G0, R, below = compliance
    normal, q, column, last = border
    n_point, d1, size = DF.shape[0], DF.shape[1], DF.shape[2]
    c, o, rigid = n_point * d1, int(static), len(D_rigid)
    m = c * size
    n = m + rigid + 1
    A = np.zeros((n, n))
    for p in range(n_point):
        for b in range(d1):
            for l in range(size):
                j = p * d1 + b
                col, d = l * c + j, D[l, j]
                across = 0.0
                for e in range(d1):
                    i0 = p * d1 + e
                    if static:
                        f = DF[p, e, 0, b, l]
                        if f != 0.0:
                            across += q[0, i0] * f
                            for i in range(c):
                                A[col, i] += G0[i0, i] * f
                            for i in range(rigid):
                                A[col, m + i] += R[i0, i] * f
                    for h in range(real.shape[0]):
                        x = o + 2 * h
                        f, s = DF[p, e, x, b, l], DF[p, e, x + 1, b, l]
                        if f != 0.0 or s != 0.0:
                            across += q[x, i0] * f + q[x + 1, i0] * s
                            cos, sin = x * c, (x + 1) * c
                            for i in range(c):
                                A[col, cos + i] += real[h, i0, i] * f + imag[h, i0, i] * s
                            for i in range(c):
                                A[col, sin + i] += real[h, i0, i] * s - imag[h, i0, i] * f
                A[col, col] += 1.0
                for i in range(n):
                    A[col, i] *= d
                A[col, n - 1] = normal[col] + d * across
    for e in range(rigid):
        for i in range(c):
            A[m + e, i] = -R[i, e] * D_rigid[e]
        for i in range(rigid):
            A[m + e, m + i] = below[i, e] * D_rigid[e]
        A[m + e, n - 1] = normal[m + e]
    A[n - 1, : n - 1] = column
    A[n - 1, n - 1] = last
    return A, _by_largest(A)


@compiled
def _by_largest(A):  # type: ignore[no-untyped-def]
    """Divide equations, columns of A (n, n) but the last, by their largest entries: what by."""
    n = len(A)
    rows = np.zeros(n - 1)
    for col in range(n):
        for i in range(n - 1):
            rows[i] = max(rows[i], abs(A[col, i]))
    for i in range(n - 1):
        if rows[i] == 0.0:
            rows[i] = 1.0
    for col in range(n):
        for i in range(n - 1):
            A[col, i] /= rows[i]
    return rows


@compiled
def by_harmonic(A, A0, static, X):  # type: ignore[no-untyped-def]
    """One complex matrix for each harmonic above 0 times the amplitudes of a motion.

    Parameters
    ----------
    A : (n_k, r, c) ndarray of complex
    A0 : (r, c) ndarray
        Of harmonic 0.
    static : bool
        Whether harmonic 0 is among the coefficients.
    X : (c, size) ndarray
        Coefficients.

    Returns
    -------
    (r, size) ndarray
        Coefficients.
    """
    out, o = np.zeros((A.shape[1], X.shape[1])), int(static)
    for i in range(A.shape[1]):
        if static:
            for j in range(A.shape[2]):
                out[i, 0] += A0[i, j] * X[j, 0]
        for h in range(A.shape[0]):
            x, cos, sin = o + 2 * h, 0.0, 0.0
            for j in range(A.shape[2]):
                real, imag = A[h, i, j].real, A[h, i, j].imag
                cos += real * X[j, x] + imag * X[j, x + 1]
                sin += real * X[j, x + 1] - imag * X[j, x]
            out[i, x], out[i, x + 1] = cos, sin
    return out


@compiled
def unit_sizes(W, kappa, o, floor, resolved, rigid_rows, rigid):  # type: ignore[no-untyped-def]
    """Sizes of all unknowns, of those of each contact by its share of the energy if `kappa`.

    Parameters
    ----------
    W : (n_point, 1 + d, size) ndarray
        Coefficients of the relative displacements [mm].
    kappa : (n_point,) ndarray, or none
        Stiffness of each contact.
    o : int
        Coefficients before the first cosine.
    floor, resolved : float
        Motion below which nothing matters, and mean displacement that is resolved [mm].
    rigid_rows : float
        Largest motion of a row by a rigid mode.
    rigid : int
        Rigid amplitudes.

    Returns
    -------
    (n_unknown,) ndarray
    """
    n_point, d1, size = W.shape
    each, mean = np.zeros(n_point), 0.0
    for p in range(n_point):
        for i in range(d1):
            for m in range(o):
                mean = max(mean, abs(W[p, i, m]))
            for m in range(o, size):
                each[p] = max(each[p], abs(W[p, i, m]))
    moving = each.max()
    still = max(mean, moving, floor, resolved)
    # a motion far below the mean displacement is measured by its own size as far as the rounding of
    # the mean lets it
    moves = max(moving, SMALL_MOTION * mean, floor)
    energy, most = 0.0, max(moving, floor)
    for p in range(len(kappa)):
        energy += kappa[p] * (max(each[p], floor) / most) ** 2
    D = np.empty(n_point * d1 * size + rigid)
    place = 0
    for p in range(n_point):
        share = np.sqrt(energy / kappa[p]) if len(kappa) > 0 else 1.0
        for _ in range(d1):
            for m in range(size):
                D[place] = share * (still if m < o else moves)
                place += 1
    D[place:] = still / rigid_rows
    return D
