"""Curves by time march: stepped sine up and down, and peaks of the balance marched on.

Where friction and lift-off leave several steady motions, a curve by harmonic balance follows one of
them, through folds no experiment can pass. The sweeps tell what a rig would show: rising, the
motion that the past below leads to; falling, the one from above. A march that begins in the
balance's own motion, residual slips included, tells whether that motion is steady.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from upd.analyses.forced.curves import ForcedCurve, SweptCurve, Way
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.interface_model import by_coulomb
from upd.analyses.forced.march_modes import stuck_modes_of
from upd.analyses.forced.march_queue import MarchQueue
from upd.analyses.forced.measures import PEAKS_ABOVE, PathPeak, path_maxima
from upd.analyses.forced.mode_peaks import CANDIDATES, ModePeak, ModeShapes, numbered
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.plan import MARCH_SAMPLES, ForcedPlan, time_steps
from upd.analyses.forced.solution import Confirmation, ForcedSolution
from upd.analyses.forced.spring_march import SpringMarch, spring_march, state_at, state_of
from upd.errors import ConvergenceError
from upd.hbm.balance import Balance
from upd.hbm.interface_march import InterfaceMarch
from upd.hbm.interface_settle import SteadyPoint, settle
from upd.hbm.interface_state import InterfaceModel, InterfaceState
from upd.hbm.refined_sweep import RefinedSweep, Told, refined_sweep
from upd.progress import Stages
from upd.scene.forced_contact import SIDES

log = logging.getLogger(__name__)
#: steps between the frequencies of a sweep before it looks closer, and the smallest, as shares
STEP, LEAST = 0.01, 5e-4
#: what of the sweep is marched beside the stretch on which points move, as a share of the frequency
BESIDE = 0.03
#: how steady a motion has to be
TOLERANCE = 1e-3
#: periods after which a motion is told as not settled: light damping, 0.5 %, leaves 1e-3 of a
#: transient after 220, and a third of the damping after 660
MOST_PERIODS = 700
#: steps in a period of the fastest mode that swings; what swings faster follows statically
LEAST_STEPS = 1
#: modes below so many times the highest frequency of the sweep tell which mode a motion is
SEEN = 8.0


@dataclass(frozen=True)
class SweepJob:
    """Sweeps that wait to be marched.

    Attributes
    ----------
    name, ratio
        Contact and F_C/F_E.
    march
        What is marched.
    frequency
        (k,) Hz, rising.
    start
        Where the sweep up begins.
    choice
        The static state where it is not the run's.
    least
        Smallest step between its frequencies, as a share of them.
    most_periods
        After which a motion is told as not settled.
    """

    name: str
    ratio: float
    march: InterfaceModel
    frequency: Array
    start: InterfaceState
    choice: str = ""
    least: float = LEAST
    most_periods: int = MOST_PERIODS


def sweep_job(solution: ForcedSolution, name: str, ratio: float) -> SweepJob | None:
    """The sweeps of the curves with this contact and F_C/F_E, where points move on them.

    Parameters
    ----------
    solution
        With these curves.
    """
    plan, model, paths = solution.plan, solution.models[name], _paths(solution, name, ratio)
    frequency = stretch(plan, paths)
    if not len(frequency):
        return None
    curve, springs = paths[0], make_springs(plan, model)
    begin = int(np.argmin(np.abs(curve.answer.frequency - frequency[0])))
    start = state_of(springs, model, curve.answer, begin, curve.force)
    return SweepJob(name, ratio, springs.march, frequency, start)


def confirmations(
    solution: ForcedSolution, name: str, ratio: float
) -> list[Callable[[Told], Confirmation]]:
    """Marches on from the peaks of the curves with this contact and F_C/F_E."""
    plan, model = solution.plan, solution.models[name]
    springs, steps = make_springs(plan, model), time_steps(plan.scene)

    def march(curve: ForcedCurve, peak: ModePeak, told: Told) -> Confirmation:
        told(peak.frequency)
        return confirm(springs, model, curve, peak, steps)

    return [
        partial(march, curve, peak)
        for curve in _paths(solution, name, ratio)
        for peak in solution.numbered_peaks(curve)
    ]


def _paths(solution: ForcedSolution, name: str, ratio: float) -> list[ForcedCurve]:
    return [c for c in solution.curves if (c.stiffness, c.ratio) == (name, ratio) and not c.empty]


def whole_faces_jobs(solution: ForcedSolution, name: str) -> list[SweepJob]:
    """Every F_C/F_E of a contact by whole faces, from its static state, over the whole range."""
    e, faces = solution.plan.scene.excitation, solution.faces[name]
    frequency = spread(e.start, e.stop)
    return [
        SweepJob(name, ratio, faces.march, frequency, faces.start)
        for ratio in e.centrifugal_to_force
    ]


def run_sweeps(solution: ForcedSolution, jobs: Sequence[SweepJob], stages: Stages) -> None:
    """March all jobs and add them to the solution."""
    if not jobs:
        return
    count = sum(len(one.frequency) for one in jobs)
    words = f"{len(jobs)} up and down, {2 * count} frequencies and more where it changes"
    with stages("sweeps", words):
        found = march_all(solution.plan, jobs)
    solution.sweeps += [one for pair in found for one in pair]


def march_all(plan: ForcedPlan, jobs: Sequence[SweepJob]) -> list[list[SweptCurve]]:
    """Sweeps up and down of every job."""
    with MarchQueue(max((one.march.n for one in jobs), default=0)) as queue:
        found = [queue.add(partial(both_ways, plan, one)) for one in jobs]
        return [one.result() for one in found]


def both_ways(plan: ForcedPlan, job: SweepJob, told: Told | None = None) -> list[SweptCurve]:
    """The sweep up from a state, and the one down from where that ends.

    Parameters
    ----------
    told
        Called with every frequency before it is marched.
    """
    scene, state, out = plan.scene, job.start, []
    force, excitation = scene.damper.centrifugal / job.ratio, excitation_of(scene.excitation)
    modes = stuck_modes_of(job.march, CANDIDATES * scene.excitation.stop)
    ways: tuple[tuple[Way, Array], ...] = (("up", job.frequency), ("down", job.frequency[::-1]))
    for way, f in ways:
        drive = force * excitation.drive
        steps = time_steps(plan.scene)
        found = march_sweep(job.march, f, drive, state, steps, job.least, job.most_periods, told)
        state = found.state
        k = excitation.lowest
        out.append(swept(job.name, job.ratio, force, way, found, modes, job.choice, k))
    return out


def make_springs(plan: ForcedPlan, model: Model) -> SpringMarch:
    """The model as a march takes it: modes with `LEAST_STEPS` or more in a period swing (those that
    the steps do not resolve implicitly), the rest of the blades follows statically.
    """
    fastest = time_steps(plan.scene) / LEAST_STEPS * plan.scene.excitation.start
    modes = int((model.frequency < fastest).sum())
    seen = int((model.frequency < SEEN * plan.scene.excitation.stop).sum())
    return spring_march(model, model.damping, modes, seen)


def march_sweep(
    march: InterfaceModel,
    frequencies: Array,
    drive: ArrayLike,
    state: InterfaceState,
    samples: int = MARCH_SAMPLES,
    least: float = LEAST,
    most_periods: int = MOST_PERIODS,
    told: Told | None = None,
) -> RefinedSweep:
    """Stepped sine along the frequencies, closer where the blades' tips change.

    Parameters
    ----------
    frequencies
        (k,) Hz.
    drive
        (L,) or (L, H) complex amplitudes at each place, of one place a number [N].
    state
        Where it begins; not changed.
    samples
        Steps in a period.
    least
        Smallest step between frequencies, as a share of them.
    most_periods
        After which a motion is told as not settled.
    told
        Called with every frequency before it is marched.
    """
    return refined_sweep(
        march,
        frequencies,
        np.atleast_1d(drive),
        state,
        watched=range(len(SIDES)),
        least_step=least * float(frequencies.mean()),
        samples=samples,
        tolerance=TOLERANCE,
        most_periods=most_periods,
        fallback=by_coulomb,
        told=told,
    )


def stretch(plan: ForcedPlan, curves: Sequence[ForcedCurve]) -> Array:
    """Where points move, or where no path arrived, and a little beside; rising, Hz.

    Empty where nothing moves.

    Parameters
    ----------
    curves
        Paths of one stiffness and F_C/F_E.
    """
    if not curves:
        return np.zeros(0)
    e = plan.scene.excitation
    moving = np.concatenate(
        [c.answer.frequency[(c.answer.state[:, :, 1:] > 0.0).any(axis=(1, 2))] for c in curves]
    )
    if plan.scene.balance.method == "march":
        moving = np.array([e.start, e.stop])
    elif all(c.stopped for c in curves):
        ends = [c.answer.frequency[-1] for c in curves]
        moving = np.append(moving, ends if len(ends) > 1 else [*ends, e.stop])
    if not len(moving):
        return moving
    low = max(e.start, moving.min() * (1.0 - BESIDE))
    high = min(e.stop, moving.max() * (1.0 + BESIDE))
    return spread(low, high)


def spread(low: float, high: float, step: float = STEP) -> Array:
    """Frequencies in Hz from end to end, evenly on a logarithmic axis, at most ``step`` apart as a
    share of them.
    """
    count = int(np.ceil(np.log(high / low) / step)) + 1
    return np.geomspace(low, high, max(count, 2))


def swept(
    name: str,
    ratio: float,
    force: float,
    way: Way,
    found: RefinedSweep,
    modes: ModeShapes,
    choice: str = "",
    harmonic: int = 1,
) -> SweptCurve:
    """What is read from a sweep, in the harmonic with this number."""
    scale = -((2.0 * np.pi * harmonic * found.frequency) ** 2) * 1e-3 / force
    H = {side: scale * found.amplitude[:, k] for k, side in enumerate(SIDES)}
    peaks = {side: _peaks(found, np.abs(H[side]), modes) for side in SIDES}
    return SweptCurve(name, ratio, force, way, found, H, peaks, choice)


def _peaks(found: RefinedSweep, size: Array, modes: ModeShapes) -> tuple[ModePeak, ...]:
    maxima = sweep_maxima(found.frequency, size, found.jumps)
    at = np.array([one.sample for one in maxima], int)
    return tuple(numbered(modes, maxima, found.amplitude[at, len(SIDES) :]))


def sweep_maxima(frequency: Array, size: Array, jumps: Sequence[int]) -> list[PathPeak]:
    """Local maxima of a sweep; none is read across a jump, and a stretch may be highest where one
    ends it.

    Parameters
    ----------
    frequency, size
        (k,) in the order marched.
    jumps
        Points after which the motion jumped.
    """
    out, begin = [], 0
    for end in (*(i + 1 for i in jumps), len(size)):
        f, a = frequency[begin:end], size[begin:end]
        out += [one._replace(sample=one.sample + begin) for one in path_maxima(f, a, 0.0)]
        for i, inner, jumped in ((0, 1, begin > 0), (len(a) - 1, len(a) - 2, end < len(size))):
            if jumped and (len(a) == 1 or a[i] > a[inner]):
                out.append(PathPeak(float(f[i]), float(a[i]), begin + i))
        begin = end
    return [one for one in out if one.height >= PEAKS_ABOVE * size.max()]


def confirm(
    springs: SpringMarch,
    model: Model,
    curve: ForcedCurve,
    peak: ModePeak,
    samples: int = MARCH_SAMPLES,
) -> Confirmation:
    """March on from the balance's motion at a peak.

    Parameters
    ----------
    springs
        Of the model.
    peak
        Of the curve.
    samples
        Steps in a period.
    """
    a, i = curve.answer, peak.sample
    f, height = float(a.frequency[i]), float(np.abs(curve.accelerance["right"][i]))
    try:
        found = marched_on(springs, model, a.balance, a.x[i], f, curve.force, samples)
    except ConvergenceError as error:
        log.info("%s, peak %d: %s", curve.case, peak.number, error)
        return Confirmation(curve, peak, height, float("nan"), False)
    size = (2.0 * np.pi * model.excitation.lowest * f) ** 2 * 1e-3 / curve.force
    marched = size * abs(found.first_harmonic[SIDES.index("right")])
    return Confirmation(curve, peak, height, float(marched), found.settled)


def marched_on(
    springs: SpringMarch,
    model: Model,
    b: Balance,
    x: Array,
    frequency: float,
    force: float,
    samples: int = MARCH_SAMPLES,
) -> SteadyPoint:
    """March on from a motion of the balance until it settles.

    Parameters
    ----------
    springs
        Of the model.
    b, x
        The problem, and its unknowns there.
    frequency
        Hz.
    force
        F_E, N.
    samples
        Steps in a period.

    Raises
    ------
    ConvergenceError
        When a step finds no answer.
    """
    at = state_at(springs, model, b, x, frequency, force)
    drive = force * model.excitation.drive
    march = InterfaceMarch(springs.march, frequency, drive, samples, by_coulomb)
    return settle(march, at, TOLERANCE, MOST_PERIODS)
