"""Periods at one frequency until the motion repeats, compiled.

See `upd.hbm.faces.settle`, which decides when a motion has settled. A motion is the tuple of
`upd.hbm.faces.state.InterfaceState.arrays`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.faces.bases import suit_bases
from upd.hbm.faces.period import march_steps
from upd.hbm.faces.rows import put
from upd.linalg.compiled import compiled

FloatArray = NDArray[np.float64]
#: periods in a window; the largest change of one window is compared with that of the one before:
#: more than a beat of neighbouring harmonics, few against the hundreds that light damping takes
WINDOW = 8
#: places in the counters: sample where the period continues and whether its step was solved
#: elsewhere, whether the past holds a period; periods; changes in the windows, whether there is a
#: period to change from, outputs seen
SAMPLE, GIVEN, KNOWN, PERIODS, CHANGES, BEFORE, SEEN, COUNTERS = range(8)
#: how `march_periods` ends: all is done, a step has no answer, a new base would pay
ENDED, UNSOLVED, NEW_BASE = 0, 1, 2


class Settling(NamedTuple):
    """When a motion has settled.

    Attributes
    ----------
    tolerance : float
        Share of the motion and of the forces that may still change.
    most : int
        Periods.
    Q : (h, N) ndarray
        From samples to the harmonics that are excited.
    rounding : float
        Of a period, as a share of what it sums.
    pays : float
        Nodes a sample that a new base must spare.
    """

    tolerance: float
    most: int
    Q: NDArray[np.complex128]
    rounding: float
    pays: float


class Memory(NamedTuple):
    """What is remembered from period to period.

    Attributes
    ----------
    moved, forces : (2 h K + K,), (3 n,) ndarray
        What settles, of the period before.
    change : (2, 2 WINDOW) ndarray
        Their last changes, the newest last.
    size : (2,) ndarray
        Of motion and forces.
    seen : (WINDOW, K) ndarray
        Moduli of the lowest harmonic.
    harmonic : (h, K) ndarray
        Of the last period.
    remaining : (1,) ndarray
        What is still to come.
    """

    moved: FloatArray
    forces: FloatArray
    change: FloatArray
    size: FloatArray
    seen: FloatArray
    harmonic: NDArray[np.complex128]
    remaining: FloatArray


def memory(n: int, K: int, h: int) -> Memory:
    """Nothing remembered yet.

    Parameters
    ----------
    n, K, h : int
        Nodes, outputs and harmonics that are excited.

    Returns
    -------
    Memory
    """
    return Memory(
        np.empty(2 * h * K + K),
        np.empty(3 * n),
        np.zeros((2, 2 * WINDOW)),
        np.zeros(2),
        np.zeros((WINDOW, K)),
        np.zeros((h, K), complex),
        np.full(1, np.inf),
    )


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
    f, most, rounding = at[6], choice[1], choice[3]
    last_moved, last_forces, changed, size_of, seen, harmonic, remaining = known
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
    tolerance, most, Q, pays = choice[0], choice[1], choice[2], choice[4]
    states, harmonic, remaining = past[2], known[5], known[6]
    N = len(which)
    while count[PERIODS] < most and remaining[0] > tolerance:
        if count[GIVEN] == 0:
            now, then = at[:9], before[:9]
            for i in range(9):
                put(now[i], then[i], 0)
            put(at[9], before[9], 0)
            put(at[10], before[10], 0)
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
        take_in(out, at, choice, known, count)
        if best >= 0:
            return NEW_BASE
    return ENDED
