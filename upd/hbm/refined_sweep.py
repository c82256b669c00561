"""Stepped sine that looks closer where the answer changes fast: at resonances, and where it jumps.

Between two frequencies of the list whose answers differ by much, the march goes back to the state
of the first and takes half the step, and again, until they differ by little or the step is the
smallest. What still differs there has jumped: a steady motion ended between the two frequencies.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError, InputError
from upd.hbm.interface_march import Fallback, InterfaceMarch
from upd.hbm.interface_memory import WINDOW
from upd.hbm.interface_settle import SteadyPoint, settle
from upd.hbm.interface_state import ComplexArray, FloatArray, InterfaceModel, InterfaceState

#: change of an output between neighbours, over its largest of the sweep, above which a step is
#: halved: near the top of a resonance its height between them is then known to about a hundredth
CHANGE = 0.15
#: periods of which the range of a motion that does not settle is told, and those from look to look:
#: as many as a look has the range of
WATCHED, LOOK = 320, WINDOW
#: what a sweep says of itself
SETTLED = "All frequencies settled."
#: Called with the frequency in Hz before it is marched.
Told = Callable[[float], None]


@dataclass(frozen=True)
class RefinedSweep:
    """Steady motions of a sweep in the order of its frequencies.

    Attributes
    ----------
    frequency : (k,) ndarray
        Hz.
    amplitude : (k, K) ndarray
        Complex amplitude of each output in the lowest harmonic that is excited [mm].
    lowest, highest : (k, K) ndarray
        Of its modulus in the last periods: apart where the motion is not settled [mm].
    share : (k, 3) ndarray
        Of nodes and samples that are open, stick, slip.
    settled : (k,) ndarray of bool
    periods, fallbacks : (k,) ndarray of int
        Periods marched; steps that the solver behind Newton's had to finish.
    energy : (k, 3) ndarray
        In the last period: work of the excitation, lost by damping, lost by friction [N mm].
    jumps : tuple of int
        Numbers of the points after which the motion jumped to another.
    state : InterfaceState
        At the end.
    seconds : float
    status : {"settled", "not settled", "stopped"}
    message : str
        One sentence.
    harmonics : (k, h, K) ndarray
        As `amplitude`, in all harmonics that are excited.
    model : InterfaceModel
        What was marched.
    drive : (L,) or (L, H) ndarray
        Its excitation, as `refined_sweep` takes it [N].
    samples : int
        Steps in a period.
    starts : tuple of InterfaceState
        Where the last period at each point began; see `upd.hbm.interface_record`.
    """

    frequency: FloatArray
    amplitude: ComplexArray
    lowest: FloatArray
    highest: FloatArray
    share: FloatArray
    settled: NDArray[np.bool_]
    periods: NDArray[np.int64]
    fallbacks: NDArray[np.int64]
    energy: FloatArray
    jumps: tuple[int, ...]
    state: InterfaceState
    seconds: float
    status: str
    message: str
    harmonics: ComplexArray
    model: InterfaceModel
    drive: ComplexArray
    samples: int
    starts: tuple[InterfaceState, ...]


@dataclass
class _SteadyAt:
    frequency: float
    found: SteadyPoint
    state: InterfaceState


def refined_sweep(
    model: InterfaceModel,
    frequencies: ArrayLike,
    drive: ArrayLike,
    start: InterfaceState,
    *,
    watched: ArrayLike,
    least_step: float,
    samples: int = 128,
    tolerance: float = 1e-3,
    most_periods: int = 2000,
    accelerate: bool = True,
    fallback: Fallback | None = None,
    told: Told | None = None,
) -> RefinedSweep:
    """Sweep over the frequencies in the order given, closer where outputs change.

    Parameters
    ----------
    model : InterfaceModel
    frequencies : (k,) array_like
        Hz, rising or falling.
    drive : (L,) or (L, H) array_like
        As `upd.hbm.interface_sweep.stepped_sine`.
    start : InterfaceState
        Not changed.
    watched : (n,) array_like of int
        Outputs that decide where to look closer.
    least_step : float
        Smallest step [Hz].
    samples, tolerance, most_periods, accelerate, fallback
        As `upd.hbm.interface_sweep.stepped_sine`.
    told : callable, optional
        Called with every frequency before it is marched.

    Returns
    -------
    RefinedSweep

    Raises
    ------
    InputError
        For frequencies that neither rise nor fall, or a step that is not positive.
    """
    f = np.asarray(frequencies, float)
    if f.ndim != 1 or not len(f) or not (f > 0.0).all() or len(set(np.sign(np.diff(f)))) > 1:
        raise InputError("sweep: frequencies must be positive and rise, or fall, in Hz")
    if not least_step > 0.0:
        raise InputError(f"sweep: the smallest step must be positive; got {least_step:g} Hz")
    begin, out, message = time.perf_counter(), np.asarray(watched, int), ""
    at, points = start.copy(), []

    def march(frequency: float, state: InterfaceState) -> _SteadyAt:
        if told is not None:
            told(frequency)
        one = InterfaceMarch(model, frequency, drive, samples, fallback)
        found = settle(one, state, tolerance, most_periods, accelerate=accelerate)
        return _SteadyAt(frequency, found, state.copy())

    def size(point: _SteadyAt) -> FloatArray:
        return np.asarray(np.abs(point.found.first_harmonic[out]))

    try:
        for one in f:
            points.append(march(float(one), at))
        top = np.max([size(p) for p in points], axis=0)
        i = 0
        while i < len(points) - 1:
            a, b = points[i], points[i + 1]
            change = np.abs(b.found.first_harmonic[out] - a.found.first_harmonic[out])
            step = b.frequency - a.frequency
            if (change <= CHANGE * top).all() or abs(step) < 2.0 * least_step:
                i += 1
                continue
            points.insert(i + 1, march(a.frequency + 0.5 * step, a.state.copy()))
            top = np.maximum(top, size(points[i + 1]))
    except ConvergenceError as error:
        message = str(error)
    took = time.perf_counter() - begin
    return _collected(model, drive, samples, points, at, out, least_step, took, message)


def _collected(
    model: InterfaceModel,
    drive: ArrayLike,
    samples: int,
    points: list[_SteadyAt],
    at: InterfaceState,
    out: NDArray[np.int64],
    least_step: float,
    seconds: float,
    message: str,
) -> RefinedSweep:
    k, K = len(points), len(model.seen_modes)
    found = [p.found for p in points]
    z = np.array([p.first_harmonic for p in found]).reshape(k, K)
    f = np.array([p.frequency for p in points])
    settled = np.array([p.settled for p in found], bool)
    missed = int((~settled).sum())
    status = "stopped" if message else "not settled" if missed else "settled"
    told = f"{missed} of {k} frequencies did not settle"
    return RefinedSweep(
        f,
        z,
        np.array([p.lowest for p in found]).reshape(k, K),
        np.array([p.highest for p in found]).reshape(k, K),
        np.array([p.last.counts for p in found]).reshape(k, 3),
        settled,
        np.array([p.periods for p in found], np.int64),
        np.array([p.fallbacks for p in found], np.int64),
        np.array([p.last.energy for p in found]).reshape(k, 3),
        _jumps(f, z[:, out], least_step),
        at,
        seconds,
        status,
        message or (told if missed else SETTLED),
        np.array([p.harmonics for p in found]).reshape(k, -1 if k else 0, K),
        model,
        np.asarray(drive, complex),
        samples,
        tuple(p.start for p in found),
    )


def _jumps(f: FloatArray, z: ComplexArray, least_step: float) -> tuple[int, ...]:
    """Points after which the outputs z change over the smallest steps."""
    k = len(f)
    if k < 2:
        return ()
    far = np.abs(np.diff(z, axis=0)) > CHANGE * np.abs(z).max(axis=0)
    near = np.abs(np.diff(f)) < 2.0 * least_step
    found_at = np.flatnonzero(far.any(axis=1) & near)
    # a fast change over several of the smallest steps is one
    return tuple(int(i) for i in found_at[np.diff(found_at, append=k) > 1])


def march_on(
    sweep: RefinedSweep,
    at: int,
    *,
    watched: ArrayLike,
    least_step: float,
    tolerance: float = 1e-3,
    most_periods: int = 2000,
    accelerate: bool = True,
    fallback: Fallback | None = None,
) -> RefinedSweep:
    """A sweep with one of its points marched on until its motion repeats.

    A motion that a sweep leaves unsettled may be one that dies out slowly, as beside a fold, and
    ends somewhere else. One that does not settle then either is told by its last period, and by the
    range of its lowest harmonic over `WATCHED` periods more.

    Parameters
    ----------
    sweep : RefinedSweep
    at : int
        Number of the point.
    watched, least_step
        As `refined_sweep` had them.
    tolerance, most_periods, accelerate, fallback
        As `upd.hbm.interface_sweep.stepped_sine`.

    Returns
    -------
    RefinedSweep
        The same where the march stops.
    """
    begin = time.perf_counter()
    march = InterfaceMarch(
        sweep.model, float(sweep.frequency[at]), sweep.drive, sweep.samples, fallback
    )
    state = sweep.starts[at].copy()
    low, high = list[FloatArray](), list[FloatArray]()
    try:
        one = settle(march, state, tolerance, most_periods, accelerate=accelerate)
        periods, fallbacks = one.periods, one.fallbacks
        while not one.settled and len(low) < WATCHED // LOOK:
            one = settle(march, state, tolerance, LOOK)
            periods, fallbacks = periods + one.periods, fallbacks + one.fallbacks
            low.append(one.lowest)
            high.append(one.highest)
    except ConvergenceError:
        return sweep
    values = {
        "amplitude": one.first_harmonic,
        "lowest": np.min(low, axis=0) if not one.settled else one.lowest,
        "highest": np.max(high, axis=0) if not one.settled else one.highest,
        "share": one.last.counts,
        "settled": one.settled,
        "periods": sweep.periods[at] + periods,
        "fallbacks": sweep.fallbacks[at] + fallbacks,
        "energy": one.last.energy,
        "harmonics": one.harmonics,
    }
    changed = {name: getattr(sweep, name).copy() for name in values}
    for name, value in values.items():
        changed[name][at] = value
    missed = int((~changed["settled"]).sum())
    told = f"{missed} of {len(sweep.frequency)} frequencies did not settle" if missed else SETTLED
    starts = (*sweep.starts[:at], one.start, *sweep.starts[at + 1 :])
    jumps = _jumps(sweep.frequency, changed["amplitude"][:, np.asarray(watched, int)], least_step)
    stopped = sweep.status == "stopped"
    return replace(
        sweep,
        **changed,
        starts=starts,
        jumps=jumps,
        seconds=sweep.seconds + time.perf_counter() - begin,
        status=sweep.status if stopped else "not settled" if missed else "settled",
        message=sweep.message if stopped else told,
    )
