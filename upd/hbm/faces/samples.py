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

from upd.hbm.faces.kept import solve_sample
from upd.hbm.faces.step import contact_scratch, fetch_row, put_row
from upd.linalg.compiled import compiled


@compiled
def given_blades(  # type: ignore[no-untyped-def]
    first, given, known, pushes, step, law, load, s, c, past, x0
):
    """Solve samples from `first` on.

    Parameters
    ----------
    first : int
        Sample to begin with.
    given : bool
        Whether that one was solved elsewhere: its rows of the past hold the answer.
    known : bool
        Whether the past holds a guess of every sample; else each starts from the one before, and
        the first from its own row.
    pushes : (N, 3 n) ndarray
        W (-Phi q - E F) [N].
    step : tuple of ndarray
        (W B)' (r, 3 n) [N/mm], inverse W (3 n, 3 n) of A [N/mm], B (3 n, r), and the square of the
        step over the damper's masses J (r, r).
    law : tuple of three (n,) ndarray
        Friction, weights of displacements against forces [N/mm].
    load : (r,) ndarray
        Static load.
    s : (3, r) ndarray
        Damper's motion, velocity and acceleration in steps; overwritten.
    c : (3 n,) ndarray
        -W w_ref of the first sample; overwritten.
    past : tuple of ndarray
        Forces [N], minus gaps and slips of the step [mm] (N, 3 n), states (N, n), and
        `upd.hbm.faces.kept.kept_inverses`; overwritten.
    x0 : (3 n,) ndarray
        Overwritten.

    Returns
    -------
    int
        Samples solved: N, or the sample without an answer; x0 then holds its forces if all stuck.
    """
    rigid, W, columns, J = step
    F, Y, S, _, _ = past
    N, n, r = len(pushes), len(law[0]), len(load)
    bases, scratch = (np.zeros((1, n), np.bool_), W.reshape(1, 3 * n, 3 * n)), contact_scratch(n)
    f, y, state = np.empty(3 * n), np.empty(3 * n), np.empty(n, np.int64)
    node, before = (f, y, state), (np.empty(3 * n), np.empty(3 * n), np.empty(n, np.int64))
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
            used = solve_sample(j, x0, bases, 0, law, node, before, known, past, scratch)
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
