"""The march at one frequency until the motion repeats.

With d the largest change from period to period in a window, and r its ratio per period to that of
the window before, what is still to come is estimated as d / (1 - r), for changes that decay as a
geometric series; and never as more than d times the periods allowed.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from upd.hbm.faces.march import InterfaceMarch, InterfacePeriod
from upd.hbm.faces.state import EPS, ComplexArray, FloatArray, InterfaceState

#: periods in a window; the largest change of one window is compared with that of the one before:
#: more than a beat of neighbouring harmonics, few against the hundreds that light damping takes
WINDOW = 8


@dataclass(frozen=True)
class SteadyPoint:
    """The march at one frequency, until it repeats.

    ``first_harmonic`` (K,) is the lowest harmonic that is excited, of every output, ``harmonics``
    (h, K) all those excited, ``start`` where the last period began.
    """

    last: InterfacePeriod
    lowest: FloatArray
    highest: FloatArray
    remaining: float
    settled: bool
    periods: int
    fallbacks: int
    seconds: float
    harmonics: ComplexArray
    start: InterfaceState

    @property
    def first_harmonic(self) -> ComplexArray:
        """(K,) of every output, the lowest harmonic that is excited."""
        return np.asarray(self.harmonics[0])


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
    begin, N = time.perf_counter(), march.samples
    turns = np.outer(march.orders, np.arange(1, N + 1)) / N
    Q = 2.0 / N * np.exp(-2j * np.pi * turns)
    #: of motion and forces: what they were a period ago, and how they changed
    known: tuple[FloatArray, FloatArray] | None = None
    changes: list[list[float]] = []
    seen: list[FloatArray] = []
    fallbacks, remaining = 0, np.inf
    out, sums = np.zeros((N, len(march.model.seen_modes))), np.zeros(4)
    while len(seen) < most_periods and not remaining <= tolerance:
        start = at.copy()
        fallbacks += march.advance(at, out, sums)
        harmonics = Q @ out
        seen.append(np.abs(harmonics[0]))
        moved = np.concatenate([harmonics.view(float).ravel(), out.mean(axis=0)])
        now = (moved, at.f.copy())
        if known is not None:
            tops = (np.abs(out).max(), np.abs(at.f).max())
            way = [float(np.linalg.norm(a - b)) for a, b in zip(now, known, strict=True)]
            # a change that is rounding of what is summed in a period is none
            changes.append(
                [d if d > N * EPS * top else 0.0 for d, top in zip(way, tops, strict=True)]
            )
        known = now
        if len(changes) >= 2 * WINDOW:
            sizes = (float(np.linalg.norm(harmonics)), float(np.linalg.norm(at.f)))
            of_each = zip(np.transpose(changes[-2 * WINDOW :]), sizes, strict=True)
            remaining = max(_to_come(change, size, most_periods) for change, size in of_each)
    return SteadyPoint(
        march.period_of(out, sums, fallbacks),
        np.min(seen[-WINDOW:], axis=0),
        np.max(seen[-WINDOW:], axis=0),
        remaining,
        remaining <= tolerance,
        len(seen),
        fallbacks,
        time.perf_counter() - begin,
        harmonics,
        start,
    )


def _to_come(change: FloatArray, size: float, most: int) -> float:
    """Estimate of the changes still to come, over `size`, from the last ones of both windows."""
    d0, d1 = float(change[:WINDOW].max()), float(change[WINDOW:].max())
    if d1 == 0.0:
        return 0.0
    r = (d1 / d0) ** (1.0 / WINDOW) if d0 > 0.0 else 1.0
    still = d1 * min(1.0 / (1.0 - r) if r < 1.0 else np.inf, float(most))
    return still / size if size > 0.0 else np.inf
