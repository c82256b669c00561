"""Periods at one frequency until the motion repeats, with jumps ahead, compiled.

See `upd.hbm.faces.settle`, which decides when a motion has settled and where jumps lead to. A
motion is the tuple of `upd.hbm.faces.state.InterfaceState.arrays`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upd.hbm.faces.bases import suit_bases
from upd.hbm.faces.memory import (
    ACCEPTED,
    BEFORE,
    CHANGES,
    COMPARED,
    GIVEN,
    HELD,
    JUMPED,
    KNOWN,
    MOST_STATES,
    PAUSE,
    PERIODS,
    REJECTED,
    SAMPLE,
    SEEN,
    TRIAL,
    WAIT,
    WINDOW,
    pack,
    unpack,
)
from upd.hbm.faces.period import march_steps
from upd.hbm.faces.rows import put
from upd.linalg.compiled import compiled

FloatArray = NDArray[np.float64]
#: periods from which a jump may be made, and after which one that did not pay is tried again
PLAIN = 6
#: singular values below this share of the largest are rounding
RANK = 1e-8
#: share of the last change that the weighted changes may leave for a jump to be made, and that the
#: period after it may change by for the jump to be kept. A jump costs two windows of plain periods,
#: in which light damping alone leaves about a half; one that lands near where it was to lands far
#: below, and one that does not may have left the motion that the past leads to.
LEFT, KEPT = 0.05, 0.3
#: how `march_periods` ends: all is done, a step has no answer, a new base would pay
ENDED, UNSOLVED, NEW_BASE = 0, 1, 2


@compiled
def same_parts(states, parts):  # type: ignore[no-untyped-def]
    """Whether the same nodes were open, stuck and slipped at one time or another as before.

    Parameters
    ----------
    states : (N, n) ndarray of int
        Of a period.
    parts : (3, n) ndarray of bool
        Overwritten.

    Returns
    -------
    bool
    """
    N, n = states.shape
    now, same = np.zeros((3, n), np.bool_), True
    for t in range(N):
        for i in range(n):
            now[states[t, i], i] = True
    for kind in range(3):
        for i in range(n):
            if now[kind, i] != parts[kind, i]:
                same, parts[kind, i] = False, now[kind, i]
    return same


@compiled
def harmonics_of(out, Q, harmonic):  # type: ignore[no-untyped-def]
    """Harmonics of the outputs in a period.

    Parameters
    ----------
    out : (N, K) ndarray
    Q : (h, N) ndarray of complex
        What takes them from the samples.
    harmonic : (h, K) ndarray of complex
        Overwritten.
    """
    N, K = out.shape
    real, imaginary = np.empty(K), np.empty(K)
    for i in range(len(Q)):
        for k in range(K):
            real[k], imaginary[k] = 0.0, 0.0
        for t in range(N):
            a, b = Q[i, t].real, Q[i, t].imag
            for k in range(K):
                real[k] += a * out[t, k]
                imaginary[k] += b * out[t, k]
        for k in range(K):
            harmonic[i, k] = complex(real[k], imaginary[k])


@compiled
def trial_failed(before, at, states, choice, known, count):  # type: ignore[no-untyped-def]
    """Take in a period for the jumps to come.

    Parameters
    ----------
    before, at : tuple of ndarray
        Before and after the period; `at` is put back if it was the trial of a jump that did not
        pay.
    states : (N, n) ndarray of int
        Of the period.
    choice : Settling
    known : Memory
    count : (COUNTERS,) ndarray of int

    Returns
    -------
    bool
        Whether it was such a trial.
    """
    q, v, state, omega = at[0], at[1], at[9], choice[4]
    after, changes, back, back_state, parts = known[:5]
    m = len(q)
    change = np.empty(2 * m)
    for j in range(m):
        # displacements and velocities in the measure of energy
        change[j], change[m + j] = omega[j] * (q[j] - before[0][j]), v[j] - before[1][j]
    same = same_parts(states, parts) and count[COMPARED] == 1
    count[COMPARED], count[JUMPED] = 1, 0
    if count[TRIAL] == 1:
        last = np.linalg.norm(changes[count[HELD] - 1])
        pays = np.linalg.norm(change) <= KEPT * last
        count[HELD], count[TRIAL] = 0, 0
        if not pays:
            unpack(back, at)
            put(back_state, state, 0)
            count[COMPARED] = 0
            count[REJECTED] += 1
            count[WAIT], count[PAUSE] = count[PAUSE], 2 * count[PAUSE]
            return True
        count[ACCEPTED] += 1
        count[JUMPED], count[PAUSE] = 1, PLAIN
    elif not same:
        count[HELD] = 0
    if count[HELD] == MOST_STATES:
        for k in range(1, MOST_STATES):
            put(after[k], after[k - 1], 0)
            put(changes[k], changes[k - 1], 0)
        count[HELD] -= 1
    pack(at, after[count[HELD]])
    put(change, changes[count[HELD]], 0)
    count[HELD] += 1
    count[WAIT] -= 1
    return False


@compiled
def jump(at, choice, known, count):  # type: ignore[no-untyped-def]
    """Jump where it is likely to pay.

    Parameters
    ----------
    at : tuple of ndarray
        Overwritten.
    choice : Settling
    known : Memory
    count : (COUNTERS,) ndarray of int
    """
    q, v, state, held = at[0], at[1], at[9], at[10]
    tolerance, omega, decay = choice[0], choice[4], choice[5]
    after, changes, back, back_state = known[:4]
    number, m = count[HELD], len(q)
    if count[WAIT] > 0 or number < PLAIN:
        return
    last = changes[number - 1]
    moving = 0.0
    for j in range(m):
        moving += (omega[j] * q[j] - held[j] / omega[j]) ** 2 + v[j] ** 2
    if np.linalg.norm(last) <= decay * tolerance * np.sqrt(moving):
        return
    D, b = np.empty((2 * m, number - 1)), np.empty(2 * m)
    for j in range(2 * m):
        b[j] = -last[j]
        for k in range(number - 1):
            D[j, k] = changes[k, j] - last[j]
    c = np.linalg.lstsq(D, b, RANK)[0]
    left = 0.0
    for j in range(2 * m):
        off = last[j]
        for k in range(number - 1):
            off += D[j, k] * c[k]
        left += off * off
    if np.sqrt(left) > LEFT * np.linalg.norm(last):
        return
    pack(at, back)
    put(state, back_state, 0)
    count[TRIAL] = 1
    landed, weight = np.zeros(after.shape[1]), 1.0
    for k in range(number - 1):
        weight -= c[k]
    for k in range(number):
        part = c[k] if k < number - 1 else weight
        for j in range(len(landed)):
            landed[j] += part * after[k, j]
    unpack(landed, at)


@compiled
def take_in(out, at, choice, known, count):  # type: ignore[no-untyped-def]
    """What of the period repeats, and how much is still to come.

    Parameters
    ----------
    out : (N, K) ndarray
        Outputs of the period.
    at : tuple of ndarray
        After it.
    choice : Settling
    known : Memory
    count : (COUNTERS,) ndarray of int
    """
    f, most, rounding = at[6], choice[1], choice[6]
    last_moved, last_forces, changed, size_of, seen, harmonic, remaining = known[5:]
    h, K = harmonic.shape
    N = len(out)
    moved, size, top = np.zeros(2 * h * K + K), 0.0, 0.0
    for i in range(h):
        for k in range(K):
            one = harmonic[i, k]
            moved[2 * (i * K + k)], moved[2 * (i * K + k) + 1] = one.real, one.imag
            size += one.real**2 + one.imag**2
            if i == 0:
                seen[count[SEEN] % WINDOW, k] = np.sqrt(one.real**2 + one.imag**2)
    mean, most_of = np.zeros(K), np.zeros(K)
    for t in range(N):
        for k in range(K):
            mean[k] += out[t, k] / N
            most_of[k] = max(most_of[k], abs(out[t, k]))
    for k in range(K):
        moved[2 * h * K + k], top = mean[k], max(top, most_of[k])
    size_of[0] = np.sqrt(size)
    count[SEEN] += 1
    for kind in range(2):
        now, last = (moved, last_moved) if kind == 0 else (f, last_forces)
        if kind == 1:
            top, size = 0.0, 0.0
            for j in range(len(now)):
                top, size = max(top, abs(now[j])), size + now[j] ** 2
            size_of[1] = np.sqrt(size)
        if count[BEFORE] == 1:
            change = 0.0
            for j in range(len(now)):
                change += (now[j] - last[j]) ** 2
            change = np.sqrt(change)
            for j in range(1, 2 * WINDOW):
                changed[kind, j - 1] = changed[kind, j]
            changed[kind, -1] = change if change > rounding * top else 0.0
        put(now, last, 0)
    count[CHANGES] += count[BEFORE]
    count[BEFORE] = 1
    remaining[0] = np.inf
    if count[CHANGES] >= 2 * WINDOW:
        remaining[0] = max(
            to_come(changed[0], size_of[0], most),
            to_come(changed[1], size_of[1], most),
        )


@compiled
def to_come(change, size, most):  # type: ignore[no-untyped-def]
    """Estimate of the changes that are still to come, over `size`.

    Parameters
    ----------
    change : (2 WINDOW,) ndarray
        The last ones.
    size : float
    most : int
        Periods allowed.

    Returns
    -------
    float
    """
    d0, d1 = 0.0, 0.0
    for j in range(WINDOW):
        d0, d1 = max(d0, change[j]), max(d1, change[WINDOW + j])
    if d1 == 0.0:
        return 0.0
    r = (d1 / d0) ** (1.0 / WINDOW) if d0 > 0.0 else 1.0
    still = d1 * min(1.0 / (1.0 - r) if r < 1.0 else np.inf, float(most))
    return still / size if size > 0.0 else np.inf


@compiled
def march_periods(  # type: ignore[no-untyped-def]
    parts, bases, which, at, before, past, x0, work, out, sums, choice, known, count
):
    """March until the motion has settled, or somebody else has to help.

    Parameters
    ----------
    parts, bases, which, at, past, x0, work, out, sums
        As `upd.hbm.faces.period.march_steps`; the last two of the last period.
    before : tuple of ndarray
        Overwritten by where the last period began.
    choice : Settling
    known : Memory
        Overwritten.
    count : (COUNTERS,) ndarray of int
        Overwritten.

    Returns
    -------
    int
        ENDED, UNSOLVED or NEW_BASE.
    """
    tolerance, most, jumps, Q, pays = choice[0], choice[1], choice[2], choice[3], choice[7]
    states, harmonic, remaining = past[2], known[10], known[11]
    N, start = len(which), np.empty(known[0].shape[1])
    while count[PERIODS] < most and remaining[0] > tolerance:
        if count[GIVEN] == 0:
            pack(at, start)
            unpack(start, before)
            put(at[9], before[9], 0)
            for j in range(len(sums)):
                sums[j] = 0.0
        count[SAMPLE] = march_steps(
            count[SAMPLE],
            N,
            count[GIVEN] == 1,
            parts,
            bases,
            which,
            at,
            count[KNOWN] == 1,
            past,
            x0,
            work,
            out,
            sums,
        )
        if count[SAMPLE] < N:
            count[GIVEN] = 1
            return UNSOLVED
        count[SAMPLE], count[GIVEN], count[KNOWN] = 0, 0, 1
        count[PERIODS] += 1
        harmonics_of(out, Q, harmonic)
        best = suit_bases(states, bases[0], which, pays)
        failed = jumps and trial_failed(before, at, states, choice, known, count)
        if not failed:
            if count[JUMPED] == 1:
                # both windows hold plain periods only
                count[CHANGES], count[BEFORE] = 0, 0
            take_in(out, at, choice, known, count)
            ahead = remaining[0] > tolerance
            if jumps and ahead and count[PERIODS] + 2 * WINDOW < most:
                jump(at, choice, known, count)
        if best >= 0:
            return NEW_BASE
    return ENDED
