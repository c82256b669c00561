"""What a march remembers from period to period, and when its motion has settled.

See `upd.hbm.faces.periods`, which marches, and `upd.hbm.faces.settle`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.faces.rows import put
from upd.linalg.compiled import compiled

FloatArray = NDArray[np.float64]
#: periods in a window; the largest change of one window is compared with that of the one before:
#: more than a beat of neighbouring harmonics, few against the hundreds that light damping takes
WINDOW = 8
#: states of which a jump is made: what 10 modes take, and one
MOST_STATES = 21
#: places in the counters: sample where the period continues and whether its step was solved
#: elsewhere, whether the past holds a period; periods, jumps kept and taken back; states held for a
#: jump, periods until one may be made and the pause after one that did not pay, whether the last
#: period was a trial, whether it was one that was kept, whether the states of a period before are
#: known; changes in the windows, whether there is a period to change from, outputs seen
(
    SAMPLE,
    GIVEN,
    KNOWN,
    PERIODS,
    ACCEPTED,
    REJECTED,
    HELD,
    WAIT,
    PAUSE,
    TRIAL,
    JUMPED,
    COMPARED,
    CHANGES,
    BEFORE,
    SEEN,
    COUNTERS,
) = range(16)


class Settling(NamedTuple):
    """When a motion has settled.

    Attributes
    ----------
    tolerance : float
        Share of the motion and of the forces that may still change.
    most : int
        Periods.
    jumps : bool
        Whether jumps are tried.
    Q : (h, N) ndarray
        From samples to the harmonics that are excited.
    omega : (m,) ndarray
        rad/s.
    decay : float
        Share of the free blades' slowest motion that a period takes.
    rounding : float
        Of a period, as a share of what it sums.
    pays : float
        Nodes a sample that a new base must spare.
    """

    tolerance: float
    most: int
    jumps: bool
    Q: NDArray[np.complex128]
    omega: FloatArray
    decay: float
    rounding: float
    pays: float


class Memory(NamedTuple):
    """What is remembered from period to period.

    Attributes
    ----------
    after : (MOST_STATES, k) ndarray
        Motions, forces and slips after the periods held for a jump.
    changes : (MOST_STATES, 2 m) ndarray
        What they changed [mm/s].
    back : (k,) ndarray
        Where to go back to when a jump does not pay.
    back_state : (n,) ndarray of int
    parts : (3, n) ndarray of bool
        Which nodes were open, stuck or slipped at some sample of the period before.
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

    after: FloatArray
    changes: FloatArray
    back: FloatArray
    back_state: NDArray[np.int64]
    parts: NDArray[np.bool_]
    moved: FloatArray
    forces: FloatArray
    change: FloatArray
    size: FloatArray
    seen: FloatArray
    harmonic: NDArray[np.complex128]
    remaining: FloatArray


def memory(n: int, m: int, r: int, K: int, h: int) -> Memory:
    """Nothing remembered yet.

    Parameters
    ----------
    n, m, r, K, h : int
        Nodes, modes, rigid motions, outputs and harmonics that are excited.

    Returns
    -------
    Memory
    """
    k = 4 * m + 3 * r + 8 * n
    return Memory(
        np.empty((MOST_STATES, k)),
        np.empty((MOST_STATES, 2 * m)),
        np.empty(k),
        np.empty(n, np.int64),
        np.zeros((3, n), np.bool_),
        np.empty(2 * h * K + K),
        np.empty(3 * n),
        np.zeros((2, 2 * WINDOW)),
        np.zeros(2),
        np.zeros((WINDOW, K)),
        np.zeros((h, K), complex),
        np.full(1, np.inf),
    )


@compiled
def fetch(row, k, part):  # type: ignore[no-untyped-def]
    """What `put` did, undone; the place after it.

    Parameters
    ----------
    row, part : ndarray
        `part` is overwritten.
    k : int

    Returns
    -------
    int
    """
    for j in range(len(part)):
        part[j] = row[k + j]
    return k + len(part)


@compiled
def pack(at, row):  # type: ignore[no-untyped-def]
    """Motions, forces and slips into a row.

    Parameters
    ----------
    at : tuple of ndarray
    row : (k,) ndarray
        Overwritten.
    """
    k = put(at[10], row, 0)
    for part in at[:9]:
        k = put(part, row, k)


@compiled
def unpack(row, at):  # type: ignore[no-untyped-def]
    """What `pack` did, undone.

    Parameters
    ----------
    row : (k,) ndarray
    at : tuple of ndarray
        Overwritten but for the states.
    """
    k = fetch(row, 0, at[10])
    for part in at[:9]:
        k = fetch(row, k, part)
