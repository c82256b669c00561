"""The march at one frequency until the motion repeats.

With d the largest change from period to period in a window, and r its ratio per period to that of
the window before, what is still to come is estimated as d / (1 - r), for changes that decay as a
geometric series; and never as more than d times the periods allowed.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from upd.hbm.faces.march import PAYS, InterfaceMarch, InterfacePeriod
from upd.hbm.faces.periods import (
    COUNTERS,
    KNOWN,
    NEW_BASE,
    PERIODS,
    SAMPLE,
    SEEN,
    UNSOLVED,
    WINDOW,
    Settling,
    march_periods,
    memory,
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
    seconds: float
    harmonics: ComplexArray
    start: InterfaceState


def settle(
    march: InterfaceMarch, at: InterfaceState, tolerance: float, most_periods: int
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

    Returns
    -------
    SteadyPoint
    """
    begin = time.perf_counter()
    N, model = march.samples, march.model
    turns = np.outer(march.orders, np.arange(1, N + 1)) / N
    choice = Settling(
        float(tolerance),
        int(most_periods),
        np.asarray(2.0 / N * np.exp(-2j * np.pi * turns)),
        N * EPS,
        PAYS,
    )
    K = len(model.seen_modes)
    known = memory(model.n, K, len(march.orders))
    count = np.zeros(COUNTERS, np.int64)
    count[KNOWN] = march.known
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
        time.perf_counter() - begin,
        known.harmonic,
        before,
    )
