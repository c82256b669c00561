"""Stepped sine by time march: at every frequency until the motion repeats, the state carried on.

Up and down a list of frequencies the answers need not agree: where friction leaves several steady
motions, each sweep tells the one that its past leads to.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError, InputError
from upd.hbm.interface_march import (
    EPS,
    ComplexArray,
    Fallback,
    FloatArray,
    InterfaceMarch,
    InterfaceModel,
    InterfacePeriod,
    InterfaceState,
)

#: periods in a window; the largest change of one window is compared with that of the one before:
#: more than a beat of neighbouring harmonics, few against the hundreds that light damping takes
WINDOW = 8


@dataclass(frozen=True)
class SteppedSine:
    """Steady motions along a list of frequencies, in the order marched.

    Attributes
    ----------
    frequency : (k,) ndarray
        Hz; shorter than asked for where the march stopped.
    amplitude : (k, K) ndarray
        Complex first harmonic of each output, of the last period [mm].
    peak : (k, K) ndarray
        Half of what lies between the output's extremes, of the last period [mm].
    lowest, highest : (k, K) ndarray
        Of the first harmonic's modulus in the last window: where it is not settled, the range in
        which it wanders [mm].
    share : (k, 3) ndarray
        Of nodes and samples that are open, stick, slip.
    settled : (k,) ndarray of bool
        Whether the motion repeats within the tolerance.
    remaining : (k,) ndarray
        Estimate of what still separates it from the steady motion, over the amplitude, or of the
        contact forces, over those, whichever is more.
    periods : (k,) ndarray of int
        Periods marched.
    energy : (k, 3) ndarray
        In the last period: work of the excitation, lost by damping, lost by friction [N mm].
    newton : (k,) ndarray
        Newton steps a time step, of the last period.
    fallbacks : (k,) ndarray of int
        Steps that the solver behind Newton's had to finish.
    seconds : (k,) ndarray
        Wall time.
    state : InterfaceState
        At the end.
    status : {"settled", "not settled", "stopped"}
    message : str
        One sentence.
    """

    frequency: FloatArray
    amplitude: ComplexArray
    peak: FloatArray
    lowest: FloatArray
    highest: FloatArray
    share: FloatArray
    settled: NDArray[np.bool_]
    remaining: FloatArray
    periods: NDArray[np.int64]
    energy: FloatArray
    newton: FloatArray
    fallbacks: NDArray[np.int64]
    seconds: FloatArray
    state: InterfaceState
    status: str
    message: str


@dataclass(frozen=True)
class SteadyPoint:
    """The march at one frequency, until it repeats."""

    last: InterfacePeriod
    first_harmonic: ComplexArray
    lowest: FloatArray
    highest: FloatArray
    remaining: float
    settled: bool
    periods: int
    fallbacks: int
    seconds: float


def stepped_sine(
    model: InterfaceModel,
    frequencies: ArrayLike,
    drive: ArrayLike,
    start: InterfaceState,
    *,
    samples: int = 128,
    tolerance: float = 1e-3,
    most_periods: int = 2000,
    fallback: Fallback | None = None,
) -> SteppedSine:
    """Sweep over the frequencies in the order given, each from where the one before ended.

    Parameters
    ----------
    model : InterfaceModel
    frequencies : (k,) array_like
        Hz.
    drive : (L,) or (L, H) array_like
        Complex amplitudes on the whole at each place, of the first or of harmonics 1 to H [N];
        -1j F is F sin(2 pi f t).
    start : InterfaceState
        Not changed.
    samples : int
        Time steps in a period.
    tolerance : float
        Of the steady motion, over its amplitude, and of the contact forces.
    most_periods : int
        At each frequency.
    fallback : callable, optional
        As for `InterfaceMarch`.

    Returns
    -------
    SteppedSine

    Raises
    ------
    InputError
        For frequencies that are not positive, or too few samples.
    """
    f = np.asarray(frequencies, float)
    if f.ndim != 1 or not f.size or not (f > 0.0).all():
        raise InputError("interface march: frequencies must be a list of positive numbers, in Hz")
    if samples < 8 or not tolerance > 0.0 or most_periods < 2 * WINDOW:
        raise InputError(
            "interface march: it takes 8 samples a period or more, a positive tolerance and "
            f"{2 * WINDOW} periods or more; got {samples}, {tolerance:g} and {most_periods}"
        )
    at, points, message = start.copy(), [], ""
    for one in f:
        march = InterfaceMarch(model, float(one), drive, samples, fallback)
        try:
            points.append(settle(march, at, tolerance, most_periods))
        except ConvergenceError as error:
            message = str(error)
            break
    missed = sum(not p.settled for p in points)
    status = "stopped" if message else "not settled" if missed else "settled"
    told = f"{missed} of {len(points)} frequencies did not settle in {most_periods} periods"
    k, K = len(points), len(model.seen_modes)
    return SteppedSine(
        f[:k],
        np.array([p.first_harmonic for p in points]).reshape(k, K),
        np.array([0.5 * np.ptp(p.last.output, axis=0) for p in points]).reshape(k, K),
        np.array([p.lowest for p in points]).reshape(k, K),
        np.array([p.highest for p in points]).reshape(k, K),
        np.array([p.last.counts for p in points]).reshape(k, 3),
        np.array([p.settled for p in points], bool),
        np.array([p.remaining for p in points]),
        np.array([p.periods for p in points], int),
        np.array([p.last.energy for p in points]).reshape(k, 3),
        np.array([p.last.newton for p in points]),
        np.array([p.fallbacks for p in points], int),
        np.array([p.seconds for p in points]),
        at,
        status,
        message or (told if missed else "All frequencies settled."),
    )


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
    march: InterfaceMarch, at: InterfaceState, tolerance: float, most_periods: int
) -> SteadyPoint:
    """March at one frequency until mean and first harmonic of the outputs, and the contact forces
    at the end of the period, settle.

    With d the largest change from period to period in a window, and r its ratio per period to that
    of the window before, what is still to come is estimated as d / (1 - r), for changes that
    decay as a geometric series; and never as more than d times the periods allowed.

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
    N = march.samples
    Q = 2.0 / N * np.exp(-2j * np.pi * np.arange(1, N + 1) / N)
    seen: deque[FloatArray] = deque(maxlen=WINDOW)
    motions, forces = Changes(N, most_periods), Changes(N, most_periods)
    periods, fallbacks, remaining = 0, 0, float("inf")
    while periods < most_periods and remaining > tolerance:
        periods += 1
        period = march.period(at)
        fallbacks += period.fallbacks
        harmonic = Q @ period.output
        seen.append(np.abs(harmonic))
        size = float(np.linalg.norm(harmonic))
        motions.add(
            np.concatenate([harmonic, period.output.mean(axis=0)]), np.abs(period.output).max()
        )
        forces.add(at.f, np.abs(at.f).max())
        remaining = max(motions.to_come(size), forces.to_come(float(np.linalg.norm(at.f))))
    return SteadyPoint(
        period,
        harmonic,
        np.min(seen, axis=0),
        np.max(seen, axis=0),
        remaining,
        remaining <= tolerance,
        periods,
        fallbacks,
        time.perf_counter() - begin,
    )
