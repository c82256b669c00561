"""What a march remembers from period to period, and when its motion has settled.

See `upd.hbm.faces.periods`, which marches, and `upd.hbm.faces.settle`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
#: periods in a window; the largest change of one window is compared with that of the one before:
#: more than a beat of neighbouring harmonics, few against the hundreds that light damping takes
WINDOW = 8
#: places in the counters: sample where the period continues and whether its step was solved
#: elsewhere, whether the past holds a period; periods; changes in the windows, whether there is a
#: period to change from, outputs seen
SAMPLE, GIVEN, KNOWN, PERIODS, CHANGES, BEFORE, SEEN, COUNTERS = range(8)


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
