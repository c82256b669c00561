"""Stepped sine by time march: at every frequency until the motion repeats, the state carried on.

Up and down a list of frequencies the answers need not agree: where friction leaves several steady
motions, each sweep finds the one that its past leads to.

With d the largest change from period to period in a window, and r its ratio per period to that of
the window before, what is still to come is estimated as d / (1 - r), for changes that decay as a
geometric series; and never as more than d times the periods allowed.

A period can be recorded in full. The steps of `upd.hbm.faces.march` carry the damper from s_0 to
s_1 by the forces f_1 alone (WBZ-alpha, beta = 1, gamma = 3/2):

    a = M_D^-1 (p - B' f_1),    s_1 = s_0 + dt s'_0 + dt^2/2 a,
    s'_1 = s'_0 + dt (s''_0 / 4 + 3/4 a),    s''_1 = (s''_0 + a) / 2,

so its motion at every sample follows from the forces recorded there. What a node loses in a step is
the mean of its traction at both ends times its slip, the measure in which the march's energy
closes.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError, InputError
from upd.hbm.faces.march import Fallback, InterfaceMarch, InterfacePeriod
from upd.hbm.faces.state import EPS, ComplexArray, FloatArray, InterfaceModel, InterfaceState
from upd.hbm.faces.step import OPEN, SLIP, STICK

#: periods in a window; the largest change of one window is compared with that of the one before:
#: more than a beat of neighbouring harmonics, few against the hundreds that light damping takes
WINDOW = 8


@dataclass(frozen=True)
class SteppedSine:
    """Steady motions along a list of frequencies, in the order of the sweep.

    Attributes
    ----------
    frequency : (k,) ndarray
        Hz; shorter than asked for where the march stopped.
    amplitude : (k, K) ndarray
        Complex first harmonic of each output, of the last period [mm].
    share : (k, 3) ndarray
        Of nodes and samples that are open, stick, slip.
    settled : (k,) ndarray of bool
        Whether the motion repeats within the tolerance.
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
    points : list of SteadyPoint
        The march at each frequency.
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
    share: FloatArray
    settled: NDArray[np.bool_]
    energy: FloatArray
    seconds: FloatArray
    state: InterfaceState
    status: str
    message: str
    harmonics: ComplexArray
    model: InterfaceModel
    drive: ComplexArray
    samples: int
    points: list[SteadyPoint]


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
        np.array([p.harmonics[0] for p in points]).reshape(k, K),
        np.array([p.last.counts for p in points]).reshape(k, 3),
        np.array([p.settled for p in points], bool),
        np.array([p.last.energy for p in points]).reshape(k, 3),
        np.array([p.seconds for p in points]),
        at,
        status,
        message or (unsettled if missed else "All frequencies settled."),
        np.array([p.harmonics for p in points]).reshape((k, -1, K) if k else (0, 1, K)),
        model,
        np.asarray(drive, complex),
        samples,
        points,
    )


@dataclass(frozen=True)
class RecordedPeriod:
    """A period of N samples of n nodes.

    Attributes
    ----------
    force : (N, 3, n) ndarray
        Normal and two tangents, on the blades, after each step [N].
    slip : (N, 2, n) ndarray
        Accumulated slips after each step [mm].
    state : (N, n) ndarray of int
        0 open, 1 stick, 2 slip.
    motion : (N, r) ndarray
        Rigid motions of the damper [mm, rad].
    loss : (n,) ndarray
        Of each node in the period [N mm].
    copies : int
        Models that make the whole.
    """

    force: FloatArray
    slip: FloatArray
    state: NDArray[np.int64]
    motion: FloatArray
    loss: FloatArray
    copies: int

    @property
    def share(self) -> FloatArray:
        """(n, 3) of the samples that each node sticks, slips, is open."""
        return np.stack([(self.state == one).mean(axis=0) for one in (STICK, SLIP, OPEN)], axis=1)

    @property
    def energy(self) -> float:
        """Friction loss of the whole in the period [N mm]."""
        return self.copies * float(self.loss.sum())


def recorded_period(march: InterfaceMarch, start: InterfaceState) -> RecordedPeriod:
    """March one period and keep all of it.

    Parameters
    ----------
    march : InterfaceMarch
    start : InterfaceState
        Not changed.

    Returns
    -------
    RecordedPeriod

    Raises
    ------
    ConvergenceError
        When a step has no answer that any of the solvers finds.
    """
    n, N, at = march.model.n, march.samples, start.copy()
    march.period(at)
    moved = march.past.move[:, n:].reshape(N, 2, n)
    force = march.past.force.reshape(N, 3, n).copy()
    before = np.concatenate([start.f.reshape(1, 3, n), force[:-1]])
    loss = np.einsum("ktp,ktp->p", 0.5 * (before + force)[:, 1:], moved)
    return RecordedPeriod(
        force,
        start.slip.reshape(2, n) + np.cumsum(moved, axis=0),
        march.past.state.copy(),
        _motion(march.model, march.dt, march.past.force, start),
        loss,
        march.model.copies,
    )


def _motion(
    model: InterfaceModel, dt: float, force: FloatArray, start: InterfaceState
) -> FloatArray:
    pull = np.linalg.solve(model.mass, (model.load - force @ model.columns).T).T
    s, v, a, out = start.s, start.sv, start.sa, []
    for one in pull:
        s = s + dt * v + 0.5 * dt**2 * one
        v = v + dt * (0.25 * a + 0.75 * one)
        a = 0.5 * (a + one)
        out.append(s)
    return np.array(out)


def period_of_sweep(found: SteppedSine, point: int, fallback: Fallback | None) -> RecordedPeriod:
    """The last period at a point of a sweep, integrated again.

    Twice: the steps then start from the samples of a period before, as those of the sweep did, and
    end where these ended to their rounding.

    Parameters
    ----------
    found : SteppedSine
    point : int
        Its number, from 0.
    fallback : callable or None
        As for `InterfaceMarch`.

    Returns
    -------
    RecordedPeriod
    """
    f = float(found.frequency[point])
    march = InterfaceMarch(found.model, f, found.drive, found.samples, fallback)
    start = found.points[point].start
    march.period(start.copy())
    return recorded_period(march, start)


@dataclass(frozen=True)
class SteadyPoint:
    """The march at one frequency, until it repeats.

    Attributes
    ----------
    last : InterfacePeriod
    lowest, highest : (K,) ndarray
        Of the first harmonic's modulus in the last window: where it is not settled, the range in
        which it wanders [mm].
    remaining : float
        Estimate of what still separates it from the steady motion, over the amplitude, or of the
        contact forces, over those, whichever is more.
    settled : bool
        Whether it repeats within the tolerance.
    periods : int
        Periods integrated.
    seconds : float
        Wall time.
    harmonics : (h, K) ndarray of complex
        Of every output, all that are excited.
    start : InterfaceState
        Where the last period began.
    """

    last: InterfacePeriod
    lowest: FloatArray
    highest: FloatArray
    remaining: float
    settled: bool
    periods: int
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
    begin, N = time.perf_counter(), march.samples
    turns = np.outer(march.orders, np.arange(1, N + 1)) / N
    Q = 2.0 / N * np.exp(-2j * np.pi * turns)
    #: of motion and forces: what they were a period ago, and how they changed
    known: tuple[FloatArray, FloatArray] | None = None
    changes: list[list[float]] = []
    seen: list[FloatArray] = []
    remaining = np.inf
    while len(seen) < most_periods and not remaining <= tolerance:
        start = at.copy()
        last = march.period(at)
        out = last.output
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
        last,
        np.min(seen[-WINDOW:], axis=0),
        np.max(seen[-WINDOW:], axis=0),
        remaining,
        remaining <= tolerance,
        len(seen),
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
