"""The response over frequency: blades in frequency, contact by whole faces and damper in time.

The equations are those of `upd.hbm.faces.equations`, the walk over the frequencies that of
`upd.hbm.faces.curve`. Nodes that never move keep the slips of the start, so that the curve has
a past as a sweep has one, and up and down the frequencies it need not be the same.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.core.newton import Settings
from upd.hbm.faces.curve import InterfaceCurve, InterfacePoint
from upd.hbm.faces.equations import InterfaceEquations
from upd.hbm.faces.march import Fallback
from upd.hbm.faces.state import ComplexArray, FloatArray, InterfaceModel, InterfaceState
from upd.linalg.parallel import SideBySide
from upd.linalg.select import threads_used

#: of the Newton corrections over the sizes of the unknowns; the samples are solved to 1e-11 of the
#: forces
TOLERANCE = 1e-6
#: steps, over the size of the solution, below which none is tried: a jump is shorter than many
SHORTEST = 5e-4


@dataclass(frozen=True)
class InterfaceResponse:
    """Periodic motions along a curve, in its order.

    Attributes
    ----------
    frequency : (k,) ndarray
        Hz, of the points solved: those asked for and others between.
    amplitude : (k, H + 1, K) ndarray
        Complex harmonics 0 to H of each output [mm].
    share : (k, 3) ndarray
        Of nodes and samples that are open, stick, slip.
    truncation : (k,) ndarray
        Share of the modal contact forces' variation that harmonics above H hold.
    energy : (k, 3) ndarray
        In a period, of the whole: work of the excitation, lost by damping, lost by friction
        [N mm]. The last is that of the samples' slips under the mean of the forces at the steps'
        ends, so that they close with the square of the step.
    iterations : (k,) ndarray of int
        Newton iterations.
    points : list of InterfacePoint
        The solutions.
    seconds : float
        Wall time.
    jumps : tuple of int
        Numbers of the points after which the motion jumped.
    missed : tuple of float
        Hz, of those asked for at which no periodic motion was found.
    status : {"complete", "stopped", "step limit"}
    message : str
        One sentence.
    equations : InterfaceEquations
        What was solved.
    """

    frequency: FloatArray
    amplitude: ComplexArray
    share: FloatArray
    truncation: FloatArray
    energy: FloatArray
    iterations: NDArray[np.int64]
    points: list[InterfacePoint]
    seconds: float
    jumps: tuple[int, ...]
    missed: tuple[float, ...]
    status: str
    message: str
    equations: InterfaceEquations

    @property
    def arrived(self) -> bool:
        """Whether the curve reaches the last frequency."""
        return self.status == "complete"

    def state_at(self, i: int) -> InterfaceState:
        """The state at the beginning of a period, from which a march can start.

        Parameters
        ----------
        i : int
            Point of the curve.

        Returns
        -------
        InterfaceState
        """
        one = self.points[i]
        return self.equations.state(one.q, one.rigid, one.slip, 2.0 * np.pi * one.frequency)


def interface_response(
    model: InterfaceModel,
    frequencies: ArrayLike,
    drive: ArrayLike,
    start: InterfaceState,
    *,
    harmonics: int = 3,
    samples: int = 128,
    settings: Settings | None = None,
    fallback: Fallback | None = None,
    workers: int | None = None,
) -> InterfaceResponse:
    """Follow the curve from the first to the last frequency, through all of them.

    At the first one the load is raised from rest; from a start that moves it is integrated in time.
    Where the curve folds the motion jumps, to what a march from there ends in.

    Parameters
    ----------
    model : InterfaceModel
    frequencies : (k,) array_like
        Hz, rising or falling.
    drive : (L,) or (L, K) array_like
        Complex amplitudes on the whole at each place, of the first or of harmonics 1 to K [N];
        -1j F is F sin(2 pi f t).
    start : InterfaceState
        At rest, or with the slips of an earlier motion.
    harmonics : int
        Harmonics H of the blades' motion.
    samples : int
        In a period.
    settings : Settings, optional
        Step control of the continuation.
    fallback : callable, optional
        As for `upd.hbm.faces.march.InterfaceMarch`.
    workers : int, optional
        Threads; by default all that libraries may use. The answer is the same with any number.

    Returns
    -------
    InterfaceResponse

    Raises
    ------
    InputError
        For frequencies that are not positive and in order, or harmonics that the samples cannot
        carry.
    """
    clock = time.perf_counter()
    f = np.asarray(frequencies, float)
    if f.ndim != 1 or not f.size or not (f > 0.0).all() or not _in_order(f):
        raise InputError(
            "interface balance: frequencies must be a rising or falling list of positive numbers, "
            "in Hz"
        )
    s = settings or replace(Settings(), tolerance=TOLERANCE, smallest_step=SHORTEST)
    with SideBySide(threads_used() if workers is None else workers) as beside:
        equations = InterfaceEquations(model, drive, start, harmonics, samples, fallback)
        equations.beside = beside
        curve = InterfaceCurve(equations, drive, s, float(np.mean(f)))
        status, message = curve.follow(f)
    points, outputs = curve.places, len(model.seen_modes)
    return InterfaceResponse(
        np.array([one.frequency for one in points]),
        np.array([one.amplitude for one in points]).reshape(-1, harmonics + 1, outputs),
        np.array([one.share for one in points]).reshape(-1, 3),
        np.array([one.truncation for one in points]),
        np.array([one.energy for one in points]).reshape(-1, 3),
        np.array([one.iterations for one in points], int),
        points,
        time.perf_counter() - clock,
        tuple(curve.broken),
        tuple(curve.missed),
        status,
        message,
        equations,
    )


def _in_order(f: FloatArray) -> bool:
    steps = np.diff(f)
    return bool((steps > 0.0).all() or (steps < 0.0).all())
