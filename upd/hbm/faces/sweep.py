"""Stepped sine by time march: at every frequency until the motion repeats, the state carried on.

Up and down a list of frequencies the answers need not agree: where friction leaves several steady
motions, each sweep finds the one that its past leads to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError, InputError
from upd.hbm.faces.march import Fallback, InterfaceMarch
from upd.hbm.faces.settle import WINDOW, SteadyPoint, settle
from upd.hbm.faces.state import ComplexArray, FloatArray, InterfaceModel, InterfaceState

__all__ = ["SteadyPoint", "SteppedSine", "settle", "stepped_sine"]


@dataclass(frozen=True)
class SteppedSine:
    """Steady motions along a list of frequencies, in the order of the sweep.

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
        Periods integrated.
    energy : (k, 3) ndarray
        In the last period: work of the excitation, lost by damping, lost by friction [N mm].
    harmonics : (k, h, K) ndarray
        As `amplitude`, in all harmonics that are excited.
    model : InterfaceModel
        What was integrated.
    drive : (L,) or (L, H) ndarray
        Its excitation [N].
    samples : int
        Steps in a period.
    starts : tuple of InterfaceState
        Where the last period at each frequency began; see `upd.hbm.faces.record`.
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
    seconds: FloatArray
    state: InterfaceState
    status: str
    message: str
    harmonics: ComplexArray
    model: InterfaceModel
    drive: ComplexArray
    samples: int
    starts: tuple[InterfaceState, ...]


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
    march: InterfaceMarch | None = None
    for one in f:
        march = InterfaceMarch(model, float(one), drive, samples, fallback, march)
        try:
            points.append(settle(march, at, tolerance, most_periods))
        except ConvergenceError as error:
            message = str(error)
            break
    missed = sum(not p.settled for p in points)
    status = "stopped" if message else "not settled" if missed else "settled"
    unsettled = f"{missed} of {len(points)} frequencies did not settle in {most_periods} periods"
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
        np.array([p.seconds for p in points]),
        at,
        status,
        message or (unsettled if missed else "All frequencies settled."),
        np.array([p.harmonics for p in points]).reshape((k, -1, K) if k else (0, 1, K)),
        model,
        np.asarray(drive, complex),
        samples,
        tuple(p.start for p in points),
    )
