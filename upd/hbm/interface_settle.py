"""The march at one frequency until the motion repeats, and jumps ahead that spare periods."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.hbm.interface_march import (
    EPS,
    ComplexArray,
    FloatArray,
    InterfaceMarch,
    InterfacePeriod,
    InterfaceState,
)

#: periods in a window; the largest change of one window is compared with that of the one before:
#: more than a beat of neighbouring harmonics, few against the hundreds that light damping takes
WINDOW = 8
#: periods from which a jump may be made, and after which one that did not pay is tried again
PLAIN = 6
#: states of which a jump is made: what 10 modes take, and one
MOST_STATES = 21
#: singular values below this share of the largest are rounding
RANK = 1e-8
#: share of the last change that the weighted changes may leave for a jump to be made, and that the
#: period after it may change by for the jump to be kept. A jump costs two windows of plain periods,
#: in which light damping alone leaves about a half; one that lands near where it was to lands far
#: below, and one that does not may have left the motion that the past leads to.
LEFT, KEPT = 0.05, 0.3


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


class Jumps:
    """Where periods lead to, by reduced rank extrapolation of the blades' motion.

    With u_i the state before a period and r_i the change of the modes' displacements (times their
    frequencies) and velocities over it, the weights c, sum c = 1, that make sum c_i r_i least tell
    the fixed point of a linear map: the sum of c_i times the states after those periods. Motions,
    forces and slips are summed alike.

    Where several steady motions exist the jump must not leave the one that the past leads to.
    Only periods in a row in which the same nodes are open, stick and slip at one time or another
    are summed, and a jump is tried out by one period: if that still changes by more than a part of
    what the period before the jump did, the map is not linear enough, the state goes back to what
    it was, and so many more periods are marched plainly, twice as many each time.

    Parameters
    ----------
    march : InterfaceMarch
    tolerance : float
        Changes from which all that can be left is less than this share of the motion are left to
        decay.

    Attributes
    ----------
    accepted, rejected : int
        Jumps.
    jumped : bool
        Whether the period taken in last was the trial of a jump that was kept.

    References
    ----------
    A. Sidi, Vector Jumps Methods with Applications, SIAM 2017, chapter 2.
    """

    def __init__(self, march: InterfaceMarch, tolerance: float) -> None:
        self.march, self.omega, self.tolerance = march, march.model.omega, tolerance
        # least decay of the free blades in a period
        damping = march.model.damping * march.model.frequency / march.frequency
        self.decay = -np.expm1(-2.0 * np.pi * float(damping.min()))
        self.after: list[InterfaceState] = []
        self.changes: list[FloatArray] = []
        self.kept: InterfaceState | None = None
        self.parts: NDArray[np.bool_] | None = None
        self.accepted = self.rejected = self.wait = 0
        self.pause, self.jumped = PLAIN, False

    def motion(self, at: InterfaceState) -> FloatArray:
        """(2 m,) displacements and velocities in the measure of energy [mm/s]."""
        return np.concatenate([self.omega * at.q, at.v])

    def failed(self, before: InterfaceState, at: InterfaceState) -> bool:
        """Take in a period; whether it was the trial of a jump that did not pay.

        Parameters
        ----------
        before, at : InterfaceState
            Before and after the period. `at` is put back if it did not.

        Returns
        -------
        bool
        """
        change = self.motion(at) - self.motion(before)
        parts = self.march.parts()
        same = self.parts is not None and bool((parts == self.parts).all())
        self.parts, self.jumped = parts, False
        if self.kept is not None:
            pays = np.linalg.norm(change) <= KEPT * np.linalg.norm(self.changes[-1])
            self.after, self.changes = [], []
            kept, self.kept = self.kept, None
            if not pays:
                at.take(kept)
                self.parts, self.rejected = None, self.rejected + 1
                self.wait, self.pause = self.pause, 2 * self.pause
                return True
            self.accepted, self.jumped, self.pause = self.accepted + 1, True, PLAIN
        elif not same:
            self.after, self.changes = [], []
        self.after.append(at.copy())
        self.changes.append(change)
        del self.after[:-MOST_STATES], self.changes[:-MOST_STATES]
        self.wait -= 1
        return False

    def jump(self, at: InterfaceState) -> None:
        """Jump where it is likely to pay.

        Parameters
        ----------
        at : InterfaceState
            Overwritten.
        """
        if self.wait > 0 or len(self.changes) < PLAIN:
            return
        last = self.changes[-1]
        moving = self.motion(at)
        moving[: len(at.q)] -= at.held / self.omega
        if np.linalg.norm(last) <= self.decay * self.tolerance * np.linalg.norm(moving):
            return
        D = np.array(self.changes[:-1]).T - last[:, None]
        c = np.linalg.lstsq(D, -last, rcond=RANK)[0]
        if np.linalg.norm(last + D @ c) <= LEFT * np.linalg.norm(last):
            self.kept = at.copy()
            at.combine(self.after, np.append(c, 1.0 - c.sum()))


class Changes:
    """What changes from period to period, and how much is still to come.

    Parameters
    ----------
    samples : int
        In a period, for the rounding of what is summed over it.
    most : int
        Periods allowed.
    """

    def __init__(self, samples: int, most: int) -> None:
        self.rounding, self.most = samples * EPS, float(most)
        self.changes: deque[float] = deque(maxlen=2 * WINDOW)
        self.before: NDArray[Any] | None = None

    def add(self, now: NDArray[Any], size: float) -> None:
        """Take in a period.

        Parameters
        ----------
        now : (k,) ndarray
            What is to settle.
        size : float
            Largest number it was made of; what changes by its rounding does not change.
        """
        if self.before is not None:
            change = float(np.linalg.norm(now - self.before))
            self.changes.append(change if change > self.rounding * size else 0.0)
        self.before = now.copy()

    def to_come(self, size: float) -> float:
        """Estimate of the changes that are still to come, over `size`.

        Parameters
        ----------
        size : float

        Returns
        -------
        float
            inf before two windows are full.
        """
        if len(self.changes) < 2 * WINDOW:
            return float("inf")
        d0, d1 = (max(list(self.changes)[k : k + WINDOW]) for k in (0, WINDOW))
        if d1 == 0.0:
            return 0.0
        r = (d1 / d0) ** (1.0 / WINDOW) if d0 > 0.0 else 1.0
        still = d1 * min(1.0 / (1.0 - r) if r < 1.0 else np.inf, self.most)
        return float(still / size) if size > 0.0 else float("inf")


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

    With d the largest change from period to period in a window, and r its ratio per period to that
    of the window before, what is still to come is estimated as d / (1 - r), for changes that
    decay as a geometric series; and never as more than d times the periods allowed. Both windows
    hold plain periods only: what a jump of `Jumps` changed is not taken for decay.

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
    N = march.samples
    turns = np.outer(march.orders, np.arange(1, N + 1)) / N
    Q: ComplexArray = 2.0 / N * np.exp(-2j * np.pi * turns)
    seen: deque[FloatArray] = deque(maxlen=WINDOW)
    motions, forces = Changes(N, most_periods), Changes(N, most_periods)
    ahead = Jumps(march, tolerance) if accelerate else None
    periods, fallbacks, remaining = 0, 0, float("inf")
    while periods < most_periods and remaining > tolerance:
        before = at.copy()
        periods += 1
        period = march.period(at)
        fallbacks += period.fallbacks
        harmonic = np.asarray(Q @ period.output, complex)
        if ahead and ahead.failed(before, at):
            continue
        if ahead and ahead.jumped:
            motions, forces = Changes(N, most_periods), Changes(N, most_periods)
        seen.append(np.abs(harmonic[0]))
        size = float(np.linalg.norm(harmonic))
        moved = np.concatenate([harmonic.ravel(), period.output.mean(axis=0)])
        motions.add(moved, np.abs(period.output).max())
        forces.add(at.f, np.abs(at.f).max())
        remaining = max(motions.to_come(size), forces.to_come(float(np.linalg.norm(at.f))))
        if ahead and remaining > tolerance and periods + 2 * WINDOW < most_periods:
            ahead.jump(at)
    return SteadyPoint(
        period,
        harmonic[0],
        np.min(seen, axis=0),
        np.max(seen, axis=0),
        remaining,
        remaining <= tolerance,
        periods,
        fallbacks,
        ahead.accepted if ahead else 0,
        ahead.rejected if ahead else 0,
        time.perf_counter() - begin,
        harmonic,
        before,
    )
