"""The factored states that suit the samples of a period, compiled."""

from __future__ import annotations

import numpy as np

from upd.hbm.faces.step import OPEN
from upd.linalg.compiled import compiled, inlined


@inlined
def bring_up(c, w, slip, Tt, base, one):  # type: ignore[no-untyped-def]
    """Bring c = -L W w_ref of a base up to the slips that were made since.

    Parameters
    ----------
    c : (B, 3 n) ndarray
        Overwritten.
    w : (B, 2 n) ndarray
        Sums of slips it is for; overwritten by `slip`.
    slip : (2 n,) ndarray
        Sums of slips now.
    Tt, base, one
        As `contact_step`.
    """
    n = base.shape[1]
    for d in range(2 * n):
        moved = slip[d] - w[one, d]
        if moved != 0.0:
            w[one, d] = slip[d]
            if base[one, d % n]:
                # L W of a node that is open in the base
                c[one, n + d] -= moved
            else:
                for e in range(3 * n):
                    c[one, e] -= moved * Tt[one, n + d, e]


@compiled
def begin(bases, gap, slip):  # type: ignore[no-untyped-def]
    """-L W w_ref of each base, anew every period so that its rounding does not add up.

    Parameters
    ----------
    bases : Bases
    gap, slip : (n,), (2 n,) ndarray
        Gap before any load, sums of slips [mm].

    Returns
    -------
    c, w : (B, 3 n), (B, 2 n) ndarray
        And the sums of slips it is for.
    """
    bases_open, bases_Tt, _ = bases
    B, n = bases_open.shape
    c, w = np.zeros((B, 3 * n)), np.empty((B, 2 * n))
    for one in range(B):
        w[one] = slip
        for d in range(3 * n):
            ref = gap[d] if d < n else slip[d - n]
            if ref == 0.0:
                continue
            if bases_open[one, d % n]:
                c[one, d] -= ref
            else:
                for e in range(3 * n):
                    c[one, e] -= ref * bases_Tt[one, d, e]
    return c, w


@compiled
def suit_bases(states, bases, which, pays):  # type: ignore[no-untyped-def]
    """For every sample the base that most of its nodes agree with.

    Parameters
    ----------
    states : (N, n) ndarray of int
        Of the period before.
    bases : (B, n) ndarray of bool
    which : (N,) ndarray of int
        Overwritten.
    pays : float
        Nodes a sample that a new base must spare.

    Returns
    -------
    int
        Sample whose open nodes would make a base that pays, or -1.
    """
    N, n = states.shape
    least, total = np.empty(N, np.int64), 0
    for t in range(N):
        as_before = t > 0
        for i in range(n):
            if as_before and (states[t, i] == OPEN) != (states[t - 1, i] == OPEN):
                as_before = False
        if as_before:
            least[t], which[t] = least[t - 1], which[t - 1]
            total += least[t]
            continue
        least[t] = n + 1
        for one in range(len(bases)):
            off = 0
            for i in range(n):
                off += (states[t, i] == OPEN) != bases[one, i]
            if off < least[t]:
                least[t], which[t] = off, one
        total += least[t]
    if total <= pays * N:
        return -1
    # what each set of open nodes would save as a base
    best, most = -1, pays * N
    for k in range(N):
        new = k == 0
        for i in range(n):
            if not new and (states[k, i] == OPEN) != (states[k - 1, i] == OPEN):
                new = True
        if not new:
            continue
        gain = 0
        for t in range(N):
            off = 0
            for i in range(n):
                if off >= least[t]:
                    break
                off += (states[t, i] == OPEN) != (states[k, i] == OPEN)
            gain += max(least[t] - off, 0)
        if gain > most:
            best, most = k, float(gain)
    return best
