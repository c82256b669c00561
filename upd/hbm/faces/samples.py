"""One period of contact and damper under given motion of the blades, compiled.

The damper's step is that of `upd.hbm.faces.march`, WBZ-alpha with full damping at infinite
frequency, with time counted in steps: from s, u = dt s' and a = dt^2 s'' (the method's), with
J = dt^2 M_D^-1 and the forces f of the step's end,

    b = J (p - B' f),   s_1 = s + u + b/2,   u_1 = u + a/4 + 3 b/4,   a_1 = (a + b)/2,

so that J alone depends on the step. The modes being given, they add no compliance to the step:

    w_1 = B (s + u + J p/2) - Phi q_1 - E F_1 - A f_1,   A = G + B J B'/2.

See `upd.hbm.faces.step` for the contact problem of a step.
"""

from __future__ import annotations

import numpy as np

from upd.hbm.faces.kept import kept_step
from upd.hbm.faces.step import contact_scratch, contact_step
from upd.linalg.compiled import compiled


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
    kept,
    inverses,
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
    kept, inverses
        As of `upd.hbm.faces.kept.kept_inverses`; overwritten.
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
            if known:
                used = kept_step(
                    j,
                    x0,
                    only,
                    one_base,
                    0,
                    mu,
                    rho_n,
                    rho_t,
                    f,
                    y,
                    state,
                    kept,
                    inverses,
                    work,
                    *scratch,
                )
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
