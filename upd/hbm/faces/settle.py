"""The march at one frequency until the motion repeats, and jumps ahead that spare periods.

With d the largest change from period to period in a window, and r its ratio per period to that of
the window before, what is still to come is estimated as d / (1 - r), for changes that decay as a
geometric series; and never as more than d times the periods allowed.

Jumps are a reduced rank extrapolation of the blades' motion. With u_i the state before a period and
r_i the change of the modes' displacements (times their frequencies) and velocities over it, the
weights c, sum c = 1, that make sum c_i r_i least tell the fixed point of a linear map: the sum of
c_i times the states after those periods. Motions, forces and slips are summed alike.

Where several steady motions exist the jump must not leave the one that the past leads to. Only
periods in a row in which the same nodes are open, stick and slip at one time or another are summed,
and a jump is tried out by one period: if that still changes by more than a part of what the period
before the jump did, the map is not linear enough, the state goes back to what it was, and so many
more periods are integrated plainly, twice as many each time. What a jump changed is not taken for
decay: both windows hold plain periods only. Changes from which all that can be left is less than
the tolerance are left to decay.

References
----------
A. Sidi, Vector Extrapolation Methods with Applications, SIAM 2017, chapter 2.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from upd.hbm.faces.march import PAYS, InterfaceMarch, InterfacePeriod
from upd.hbm.faces.memory import (
    ACCEPTED,
    COUNTERS,
    KNOWN,
    PAUSE,
    PERIODS,
    REJECTED,
    SAMPLE,
    SEEN,
    WINDOW,
    Settling,
    memory,
)
from upd.hbm.faces.periods import (
    NEW_BASE,
    PLAIN,
    UNSOLVED,
    march_periods,
)
from upd.hbm.faces.state import EPS, ComplexArray, FloatArray, InterfaceState


@dataclass(frozen=True)
class SteadyPoint:
    """The march at one frequency, until it repeats.

    ``first_harmonic`` (K,) is the lowest harmonic that is excited, of every output, ``harmonics``
    (h, K) all those excited, ``start`` where the last period began.
    """

    last: InterfacePeriod
    first_harmonic: ComplexArray
    lowest: FloatArray
    highest: FloatArray
    remaining: float
    settled: bool
    periods: int
    fallbacks: int
    accepted: int
    rejected: int
    seconds: float
    harmonics: ComplexArray
    start: InterfaceState


def settle(
    march: InterfaceMarch,
    at: InterfaceState,
    tolerance: float,
    most_periods: int,
    *,
    accelerate: bool = False,
) -> SteadyPoint:
    """March at one frequency until the outputs, their mean and the harmonics that are excited, and
    the contact forces at the end of the period settle.

    See the module for the estimate of what is still to come.

    Parameters
    ----------
    march : InterfaceMarch
    at : InterfaceState
        Overwritten.
    tolerance : float
        Of the estimate, over the amplitude and over the forces.
    most_periods : int
    accelerate : bool
        Whether to jump ahead where the periods tell where they lead to.

    Returns
    -------
    SteadyPoint
    """
    begin = time.perf_counter()
    N, model = march.samples, march.model
    turns = np.outer(march.orders, np.arange(1, N + 1)) / N
    # least decay of the free blades in a period
    damping = model.damping * model.frequency / march.frequency
    choice = Settling(
        float(tolerance),
        int(most_periods),
        accelerate,
        np.asarray(2.0 / N * np.exp(-2j * np.pi * turns)),
        model.omega,
        -float(np.expm1(-2.0 * np.pi * damping.min())),
        N * EPS,
        PAYS,
    )
    K = len(model.seen_modes)
    known = memory(model.n, len(model.omega), len(model.load), K, len(march.orders))
    count = np.zeros(COUNTERS, np.int64)
    count[KNOWN], count[PAUSE] = march.known, PLAIN
    before, out, sums, fallbacks = at.copy(), np.zeros((N, K)), np.zeros(4), 0
    while True:
        ended = march_periods(
            tuple(march.steps),
            tuple(march.bases),
            march.which,
            at.arrays(),
            before.arrays(),
            tuple(march.past),
            march.x0,
            march.work,
            out,
            sums,
            tuple(choice),
            tuple(known),
            count,
        )
        if ended == UNSOLVED:
            march.finish_step(int(count[SAMPLE]), at)
            fallbacks += 1
        elif ended == NEW_BASE:
            march.suit()
        else:
            break
    march.known = True
    seen = known.seen[: min(int(count[SEEN]), WINDOW)]
    return SteadyPoint(
        march.period_of(out, sums, fallbacks),
        known.harmonic[0],
        np.min(seen, axis=0),
        np.max(seen, axis=0),
        float(known.remaining[0]),
        bool(known.remaining[0] <= tolerance),
        int(count[PERIODS]),
        fallbacks,
        int(count[ACCEPTED]),
        int(count[REJECTED]),
        time.perf_counter() - begin,
        known.harmonic,
        before,
    )
