"""Resonance peaks of the nonlinear answer, located on the path.

The path is cut by planes across its tangent; on each the corrector finds the solution, and the
slope of the amplitude along the path shows the side of the peak. Folds do not matter, since no
plane lies at a fixed frequency. Compare the peak continuation of M. Krack and J. Gross,
Harmonic Balance for Nonlinear Vibration Problems (2019), ch. 4, which adds the condition as an
equation and needs second derivatives.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from upd.hbm.core.continuation import advance, begin
from upd.hbm.core.fourier import to_complex
from upd.hbm.core.newton import PathProblem, Settings, State, correct
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.sweep import FREQUENCY_SHARE, over_frequency
from upd.labels import Shown

log = logging.getLogger(__name__)

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)
#: first step along the path in search of the other side of a peak, and steps before the search is
#: given up
FIRST_REACH, MOST_STEPS = 0.01, 200
#: position of a peak on the path, in units of its bracket
POSITION = 1e-5
#: change of frequency, and factor on the height per load, beyond which the next peak is another one
JUMP_FREQUENCY, JUMP_HEIGHT = 0.03, 2.0


@dataclass(frozen=True, repr=False)
class Peak(Shown):
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
    modal_row, j = b.modal_row(row, harmonic), b.harmonics.place(harmonic)
    problem = over_frequency(b, FREQUENCY_SHARE * frequency, settings)
    k = int(b.harmonics.dynamic[j])
    modal, Psi = b.part(k)

    def amplitude(x: FloatArray, f: float) -> float:
        F = to_complex(b.force(x).reshape(len(b.Psi), -1), b.harmonics)[:, j]
        eta = modal.solve(np.array([2 * np.pi * k * f]), b.loads[j : j + 1] - F @ Psi.conj())[0]
        return float(abs(eta @ modal_row))

    def slope(at: State, D: FloatArray) -> float:
        """Of the weighed amplitude along the tangent, by central differences."""
        h, dx, dp = EPS ** (1 / 3), at.tangent[:-1] * D, float(at.tangent[-1] * problem.p_scale)
        up, down = (
            amplitude(at.x + d * dx, at.p + d * dp) * (at.p + d * dp) ** power for d in (h, -h)
        )
        return float((up - down) / (2 * h))

    def peak(state: State, status: str) -> Peak:
        return Peak(state.p, amplitude(state.x, state.p), state.x, status)

    here = begin(problem, x, frequency)._replace(step=reach)
    if slope(here, problem.scale(here.x)) < 0:
        # to be left in the opposite direction
        here = here._replace(tangent=-here.tangent, sign=-here.sign)
    for _ in range(MOST_STEPS):
        there = advance(problem, here)
        if there is None:
            return peak(here, "no convergence along the path")
        if slope(there, problem.scale(there.x)) > 0:
            here = there
            continue
        way = np.linalg.norm((there.x - here.x) / problem.scale(here.x))
        length = float(np.hypot(way, (there.p - here.p) / problem.p_scale))
        top = _between(problem, slope, here, length)
        if top is not None:
            return peak(top, "found")
        if length <= POSITION:
            return max(peak(here, "found"), peak(there, "found"), key=lambda found: found.amplitude)
        here = here._replace(step=length / 4)
    return peak(here, f"still rising after {MOST_STEPS} steps")


def _between(
    problem: PathProblem, slope: Callable[[State, FloatArray], float], base: State, reach: float
) -> State | None:
    """The peak between the base and the plane at `reach`.

    Root of the slope, or its jump where a contact changes state.
    """
    D, p_scale = problem.scale(base.x), problem.p_scale
    best = [base]

    def slope_at(share: float) -> float:
        way, along = share * reach, base.tangent
        x, p = base.x + way * along[:-1] * D, base.p + way * float(along[-1]) * p_scale
        found = correct(problem, x, p, D, along)
        if found is None:
            raise ArithmeticError
        best[0] = found
        return slope(found, D)

    try:
        if slope_at(0.0) <= 0 or slope_at(1.0) >= 0:
            return None
        slope_at(brentq(slope_at, 0.0, 1.0, xtol=POSITION))
    except ArithmeticError:
        return None
    return best[0]


def is_near(frequency: float, height: float) -> bool:
    """Whether a peak may be another one with other data: neither its frequency nor its height has
    jumped.

    Parameters
    ----------
    frequency, height : float
        Over those of the other.
    """
    return abs(frequency - 1.0) <= JUMP_FREQUENCY and 1.0 / JUMP_HEIGHT <= height <= JUMP_HEIGHT
