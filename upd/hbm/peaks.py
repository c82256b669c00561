"""Resonance peaks of the nonlinear answer: located on the path, and followed over the load.

The path is cut by planes across its tangent; on each the corrector finds the solution, and the
slope of the amplitude along the path shows the side of the peak. Folds do not matter, since no
plane stands at a fixed frequency. Compare the peak continuation of M. Krack and J. Gross,
Harmonic Balance for Nonlinear Vibration Problems (2019), ch. 4, which adds the condition as an
equation and needs second derivatives.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from upd.hbm.balance import Balance
from upd.hbm.coulomb import LIFT, SLIP, STICK
from upd.hbm.fourier import to_complex
from upd.hbm.newton import Function, Settings, Solution, cross_section
from upd.hbm.path_step import State, begin, direction_reversed, walk
from upd.hbm.residuals import FREQUENCY_SHARE, over_frequency, scale_of
from upd.hbm.starts import first_point
from upd.linalg.parallel import threads_for

log = logging.getLogger(__name__)

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)
#: first step along the path in search of the other side of a peak, and steps before the search is
#: given up
FIRST_REACH, MOST_STEPS = 0.01, 200
#: position of a peak on the path, in units of its bracket
POSITION = 1e-5
#: halvings of a load step before the curve stops
MOST_HALVINGS = 6
#: change of frequency, and factor on the height per load, beyond which the next peak is another one
JUMP_FREQUENCY, JUMP_HEIGHT = 0.03, 2.0


@dataclass(frozen=True)
class Peak:
    """A local maximum of the amplitude on the path.

    Attributes
    ----------
    frequency : float
        [Hz]
    amplitude : float
        [mm]
    x : (n_unknown,) ndarray
        Unknowns.
    status : str
        "found" or why not.
    """

    frequency: float
    amplitude: float
    x: FloatArray
    status: str

    @property
    def found(self) -> bool:
        """Whether it is a maximum on the path."""
        return self.status == "found"


@dataclass(frozen=True)
class PerformanceCurve:
    """Peak over the size of the load, n points in order of the factors reached.

    Attributes
    ----------
    factor : (n,) ndarray
        On the dynamic loads.
    frequency : (n,) ndarray
        [Hz]
    amplitude : (n,) ndarray
        [mm]; divide by the factor to compare.
    x : (n, n_unknown) ndarray
        Unknowns.
    state : (n, n_point, 3) ndarray
        Shares of the cycle in stick, slip, lift-off.
    status : {"complete", "stopped"}
    message : str
        One sentence.
    """

    factor: FloatArray
    frequency: FloatArray
    amplitude: FloatArray
    x: FloatArray
    state: FloatArray
    status: str
    message: str

    @property
    def optimum(self) -> int:
        """Index of the smallest amplitude per unit load."""
        return int(np.argmin(self.amplitude / self.factor))


@dataclass(frozen=True)
class _Measure:
    """|one harmonic| of row @ q times frequency^power, over the unknowns and the frequency."""

    b: Balance
    modal_row: FloatArray
    place: int
    power: float = 0.0

    def __call__(self, x: FloatArray, frequency: float) -> float:
        return float(self.amplitude(x, frequency) * frequency**self.power)

    def amplitude(self, x: FloatArray, frequency: float) -> float:
        """|row @ q| alone, mm."""
        b, j = self.b, self.place
        F = to_complex(b.force(x).force.reshape(len(b.Psi), -1), b.harmonics)[:, j]
        w = np.array([2 * np.pi * b.harmonics.dynamic[j] * frequency])
        eta = b.modal.solve(w, b.loads[j : j + 1] - F @ b.Psi)[0]
        return float(abs(eta @ self.modal_row))

    def slope(self, x: FloatArray, p: float, direction: FloatArray) -> float:
        """Derivative along a direction (n_unknown + 1,), by central differences."""
        h = EPS ** (1 / 3)
        return float(
            (
                self(x + h * direction[:-1], p + h * direction[-1])
                - self(x - h * direction[:-1], p - h * direction[-1])
            )
            / (2 * h)
        )


def climb(
    b: Balance,
    row: ArrayLike,
    x: FloatArray,
    frequency: float,
    reach: float = FIRST_REACH,
    settings: Settings | None = None,
    harmonic: int | None = None,
    power: float = 0.0,
) -> Peak:
    """The peak of |row @ q| uphill from a solved point.

    Parameters
    ----------
    b : Balance
    row : (n_dof,) array_like
        Weighs the displacements.
    x : (n_unknown,) ndarray
        Unknowns of the point.
    frequency : float
        Frequency of the point [Hz].
    reach : float
        First step, in scaled arclength.
    settings : Settings, optional
        Step control of the continuation.
    harmonic : int, optional
        Number of the harmonic; the lowest above 0 by default.
    power : float
        Of the frequency by which the amplitude is weighed: 2 for the peak of the acceleration.

    Returns
    -------
    Peak
        Its amplitude without that weight.

    Raises
    ------
    InputError
        For a harmonic that is not kept, or a row of another length.
    """
    s, measure = (
        settings or Settings(),
        _Measure(b, b.modal_row(row), b.harmonics.place(harmonic), power),
    )
    function, scale, p_scale = over_frequency(b), scale_of(b), FREQUENCY_SHARE * frequency

    def slope(state: State) -> float:
        return measure.slope(
            state.x,
            state.p,
            np.append(state.tangent[:-1] * scale(state.x), state.tangent[-1] * p_scale),
        )

    def peak(state: State, status: str) -> Peak:
        return Peak(state.p, measure.amplitude(state.x, state.p), state.x, status)

    here = begin(function, x, frequency, scale, p_scale, s)._replace(step=reach)
    here = here if slope(here) >= 0 else direction_reversed(here)
    for _ in range(MOST_STEPS):
        found, there = walk(function, here, scale, p_scale, s)
        if found is None:
            return peak(here, "no convergence along the path")
        if slope(there) > 0:
            here = there
            continue
        length = float(
            np.hypot(
                np.linalg.norm((there.x - here.x) / scale(here.x)), (there.p - here.p) / p_scale
            )
        )
        top = _between(function, measure, here, length, scale(here.x), p_scale, s)
        if top is not None:
            return top
        if length <= POSITION:
            return max(peak(here, "found"), peak(there, "found"), key=lambda found: found.amplitude)
        here = here._replace(step=length / 4)
    return peak(here, f"still rising after {MOST_STEPS} steps")


def _between(
    function: Function,
    measure: _Measure,
    base: State,
    reach: float,
    D: FloatArray,
    p_scale: float,
    s: Settings,
) -> Peak | None:
    """The peak between the base and the plane at `reach`.

    Root of the slope, or its jump where a contact changes state.
    """
    origin = Solution(base.x, base.p, base.tangent, 0, 0.0)
    best = [origin]

    def slope(share: float) -> float:
        found = cross_section(function, origin, D, p_scale, base.tangent, share * reach, s)
        if found.tangent is None:
            raise ArithmeticError
        best[0] = found
        return measure.slope(
            found.x, found.p, np.append(found.tangent[:-1] * D, found.tangent[-1] * p_scale)
        )

    try:
        if slope(0.0) <= 0 or slope(1.0) >= 0:
            return None
        slope(brentq(slope, 0.0, 1.0, xtol=POSITION))
    except ArithmeticError:
        return None
    return Peak(best[0].p, measure.amplitude(best[0].x, best[0].p), best[0].x, "found")


def performance_curve(
    b: Balance,
    row: ArrayLike,
    factors: ArrayLike,
    frequency: float,
    *,
    x: FloatArray | None = None,
    settings: Settings | None = None,
    harmonic: int | None = None,
) -> PerformanceCurve:
    """Peak of |row @ q| over a factor on the dynamic loads: continuation of the peak, no sweeps.

    In homogeneous scenes (no gaps, or gaps that grow with the load) a factor s on the dynamic loads
    is 1/s on the static ones, so this is the curve over F_C/F_E. Between the factors the steps are
    chosen by the curve.

    Parameters
    ----------
    b : Balance
        The problem with the factor 1.
    row : (n_dof,) array_like
        Weighs the displacements.
    factors : (n,) array_like
        Factors on the dynamic loads.
    frequency : float
        A frequency near the first peak [Hz].
    x : (n_unknown,) ndarray, optional
        An answer at the first factor.
    settings : Settings, optional
        Step control of the continuation.
    harmonic : int, optional
        Number of the harmonic; the lowest above 0 by default.

    Returns
    -------
    PerformanceCurve

    Examples
    --------
    The oscillator of `frequency_response`: the peak per unit load is lowest where mu N = pi F/2.

    >>> import numpy as np
    >>> from upd.hbm import contacts, frequency_response, performance_curve
    >>> jenkins = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=np.pi / 2)
    >>> f0 = np.sqrt(1.5) / (2 * np.pi)
    >>> answer = frequency_response(
    ...     [[1.0]], [[0.0]], [[1.0]], jenkins,
    ...     harmonic_force=[1.0], frequencies=[f0], harmonics=(1,), samples=1024,
    ... )
    >>> curve = performance_curve(answer.balance, [1.0], [0.6, 0.8, 1.0, 1.2, 1.5], f0)
    >>> curve.status, float(curve.factor[curve.optimum])
    ('complete', 1.0)
    >>> (curve.amplitude / curve.factor).round(2).tolist()
    [3.74, 3.27, 3.14, 3.27, 4.19]
    >>> [round(np.pi / 2 / (1 - s / 2) / s, 2) for s in (0.6, 0.8, 1.0, 1.2, 1.5)]
    [3.74, 3.27, 3.14, 3.27, 4.19]
    """
    wanted = np.asarray(factors, dtype=float)
    first = b.with_loads(1.0, float(wanted[0]))
    start = first_point(first, frequency, x, settings)
    if start is None:
        return _curve(
            b, [], f"stopped: no solution at {frequency:.6g} Hz with the factor {wanted[0]:.4g}"
        )
    peak = climb(first, row, start, frequency, settings=settings, harmonic=harmonic)
    found, message = [(float(wanted[0]), peak)], ""
    with threads_for(b.size):
        for factor in wanted[1:]:
            message = "" if found[-1][1].found else found.pop()[1].status
            message = message or follow_to(b, row, found, float(factor), settings, harmonic)
            if message:
                break
    if not message and not found[-1][1].found:
        message = found.pop()[1].status
    return _curve(
        b, [pair for pair in found if pair[0] in wanted], message and f"stopped: {message}"
    )


def follow_to(
    b: Balance,
    row: ArrayLike,
    found: list[tuple[float, Peak]],
    factor: float,
    settings: Settings | None = None,
    harmonic: int | None = None,
    power: float = 0.0,
) -> str:
    """Follow a peak to one more factor on the dynamic loads, with smaller steps where needed.

    Parameters
    ----------
    b : Balance
        The problem with the factor 1.
    row : (n_dof,) array_like
        Weighs the displacements.
    found : list of (float, Peak)
        Factors and peaks so far, that to begin from last; those on the way are added, and that of
        the factor where it is reached.
    factor : float
        On the dynamic loads.
    settings, harmonic, power
        As of `climb`.

    Returns
    -------
    str
        Why it was not reached, or "".
    """
    halvings, target = 0, factor
    while found[-1][0] != factor:
        before, peak = found[-1]
        guess, f = _extrapolated(found, target)
        here = b.with_loads(1.0, target)
        reach = FIRST_REACH
        solved = _at(here, guess, f, settings) or _at(
            here, peak.x * target / before if _lifts(b) else peak.x, peak.frequency, settings
        )
        new = None
        if solved is not None:
            new = climb(here, row, solved.x, solved.p, reach, settings, harmonic, power)
        if new is not None and new.found and _next_to(found[-1], (target, new)):
            found.append((target, new))
            target = factor
            continue
        halvings += 1
        if halvings > MOST_HALVINGS:
            return f"no peak beyond the factor {before:.4g}" + (
                f" ({new.status})" if new is not None else ""
            )
        target = float(np.sqrt(before * target)) if before * target > 0 else (before + target) / 2
    return ""


def _next_to(before: tuple[float, Peak], after: tuple[float, Peak]) -> bool:
    """Whether a peak may be the one before with another load.

    Not when frequency or height per load have jumped.
    """
    (p, a), (q, b) = before, after
    return is_near(b.frequency / a.frequency, b.amplitude * p / (a.amplitude * q))


def is_near(frequency: float, height: float) -> bool:
    """Whether a peak may be another one with other data: neither its frequency nor its height has
    jumped.

    Parameters
    ----------
    frequency, height : float
        Over those of the other.
    """
    return abs(frequency - 1.0) <= JUMP_FREQUENCY and 1.0 / JUMP_HEIGHT <= height <= JUMP_HEIGHT


def _lifts(b: Balance) -> bool:
    """Nothing static: the answer itself grows with the factor."""
    return not np.any(b.static) and not np.any(b.contacts.law.preload)


def _at(b: Balance, x: FloatArray, frequency: float, settings: Settings | None) -> Solution | None:
    """A solution near the guess: at its frequency."""
    s, normal = settings or Settings(), np.zeros(len(x) + 1)
    normal[-1] = 1.0
    patient = replace(s, iterations=2 * s.iterations)
    found = cross_section(
        over_frequency(b),
        Solution(x, frequency, None, 0, 0.0),
        scale_of(b)(x),
        1.0,
        normal,
        0.0,
        patient,
    )
    return found if found.tangent is not None else None


def _extrapolated(found: list[tuple[float, Peak]], factor: float) -> tuple[FloatArray, float]:
    """Unknowns and frequency at another factor, on the secant of the last two peaks."""
    p1, b = found[-1]
    if len(found) < 2:
        return b.x, b.frequency
    p0, a = found[-2]
    share = (factor - p1) / (p1 - p0)
    share = float(np.clip(share, -2.0, 2.0))
    return b.x + share * (b.x - a.x), b.frequency + share * (b.frequency - a.frequency)


def _curve(b: Balance, found: list[tuple[float, Peak]], message: str) -> PerformanceCurve:
    n = len(found)
    x = np.array([peak.x for _, peak in found]).reshape(n, b.size)
    state = np.zeros((n, b.contacts.n_point, 3))
    if n:
        marched = b.marched(b.coefficients(x), b.E)
        for code in (STICK, SLIP, LIFT):
            state[..., code] = (marched.state == code).mean(axis=-1)
    factor = np.array([value for value, _ in found])
    f, a = (
        np.array([peak.frequency for _, peak in found]),
        np.array([peak.amplitude for _, peak in found]),
    )
    if message:
        log.warning(message)
    return PerformanceCurve(
        factor,
        f,
        a,
        x,
        state,
        "stopped" if message else "complete",
        message or f"{n} peaks followed",
    )
