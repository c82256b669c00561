"""Numbers of curves: peaks, contact states, losses and motions there, what a curve took."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from upd.analyses import printed
from upd.analyses.forced import measures
from upd.analyses.forced.curves import ForcedCurve, PointCurve
from upd.analyses.forced.measures import CurvePeak
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import ForcedSolution, MarchedPeak
from upd.analyses.forced.sweeps import marched_damper, marched_shares
from upd.hbm import FrequencyResponse
from upd.hbm.faces.balance import InterfaceResponse
from upd.reference.printed import Lookup, Printed
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene import ForcedScene
from upd.scene.forced_contact import SIDES, Side

#: name under which measured peaks are printed: which of a run's peaks each is stands nowhere
MEASURED_PEAK = q.FREE_PEAK_FREQUENCY.name
#: by how much lower than the peak a sweep ends that is reported
_LOWER = 0.01


def _more_harmonics(curve: ForcedCurve[Any]) -> Iterator[Result]:
    """Highest points in the harmonics beside the one that is read, which has the numbered peaks."""
    for k, H in curve.more.items() if not curve.empty else ():
        for blade in SIDES[::-1]:
            f, size = curve.frequency, np.abs(H[blade])
            top = max(measures.path_maxima(f, size), key=lambda p: p.height, default=None)
            i = int(size.argmax())
            at, height = (float(f[i]), float(size[i])) if top is None else top[:2]
            yield q.HARMONIC_FREQUENCY.on(blade).of(at, curve.case, n=k)
            yield q.HARMONIC_ACCELERANCE.on(blade).of(height, curve.case, n=k)


def curve_results(solution: ForcedSolution, curve: ForcedCurve[Any]) -> list[Result]:
    """Peaks of both blades, those not reached, the reduction; the contact at the right ones."""
    case = curve.case
    results = [
        q.EXCITATION_FORCE.of(curve.force, case),
        q.PATH_POINTS.of(len(curve.frequency), case),
        q.CURVE_SECONDS.of(curve.seconds, case),
        *(
            one
            for blade in SIDES[::-1]
            for one in peak_results(solution, case, curve.peaks.get(blade, ()), blade)
        ),
        *_not_reached(solution, curve),
        *(r for blade in SIDES[::-1] for r in _reduction(solution, curve, blade)),
        *_folds(curve),
        *_more_harmonics(curve),
    ]
    if isinstance(curve.answer, InterfaceResponse):
        results.append(q.PATH_JUMPS.of(len(curve.answer.jumps), case))
    for peak in curve.peaks.get("right", ()):
        results += _at_peak(solution, curve, peak)
    return results


def _at_peak(solution: ForcedSolution, curve: ForcedCurve[Any], peak: CurvePeak) -> list[Result]:
    """The contact at a peak: of points, of the last period of a sweep, or of the whole contact."""
    at, i = replace(curve.case, peak=peak.number, mode=peak.mode), peak.sample
    if isinstance(curve.answer, FrequencyResponse):
        return _at_point(solution, curve, solution.models[curve.stiffness], at, i)
    marched = [one for one in solution.marched if one.case == at]
    if marched:
        return _at_marched(solution, marched[0])
    lift, stick, slip = curve.answer.share[i]
    return [
        *(one.of(value, at) for one, value in zip(q.SHARES, (stick, slip, lift), strict=True)),
        q.FRICTION_ENERGY.of(curve.answer.energy[i, 2], at),
    ]


def _folds(curve: ForcedCurve[Any]) -> Iterator[Result]:
    """What a slow sweep up reaches where it jumps past the peak of a mode: by the largest of the
    jumps that are nearest to that peak.
    """
    peaks = curve.peaks.get("right", ())
    for peak in peaks:
        jumps = [
            fold
            for fold in curve.folds
            if fold.up
            and fold.before < fold.reached < (1.0 - _LOWER) * peak.height
            and min(peaks, key=lambda one: abs(one.frequency - fold.frequency)) is peak
        ]
        if jumps:
            fold = max(jumps, key=lambda one: one.reached - one.before)
            case = replace(curve.case, mode=peak.mode)
            yield q.SWEEP_UP_FREQUENCY.of(fold.at, case, n=peak.number)
            yield q.SWEEP_UP_ACCELERANCE.of(fold.reached, case, n=peak.number)


def _not_reached(solution: ForcedSolution, curve: ForcedCurve[Any]) -> list[Result]:
    """Peaks of the stuck curve that the curve lacks, where it ended early or has none."""
    e, wanted = solution.plan.scene.excitation, solution.stuck_peaks(curve.stiffness)
    found = {peak.number for peak in curve.peaks.get("right", ())}
    modes = {peak.number: peak.mode for peak in wanted} or {1: ""}
    reason = curve.stopped
    if not reason and not found:
        reason = f"no peak between {e.start:g} and {e.stop:g} Hz: widen excitation.start and stop"
        modes = dict(list(modes.items())[:1])
    # two modes may have grown into one peak: a whole curve shows all there are
    return [
        quantity.withheld(replace(curve.case, mode=mode), reason, n=number)
        for number, mode in modes.items()
        if reason and number not in found
        for quantity in (q.PEAK_FREQUENCY, q.PEAK_ACCELERANCE)
    ]


def _reduction(solution: ForcedSolution, curve: ForcedCurve[Any], blade: Side) -> list[Result]:
    """How far the highest point of a blade's curve is below its free peak."""
    linear = solution.linear.get(curve.stiffness)
    free = linear.free_peaks[blade] if linear else []
    if not free or curve.empty:
        return []
    quantity, case = q.REDUCTION.on(blade), curve.case
    top = max(peak.height for peak in free)
    size = np.abs(curve.accelerance[blade])
    f, peaks = curve.frequency, [peak.height for peak in curve.peaks[blade]]
    reason = f"{curve.stopped}; the highest point may lie beyond" if curve.stopped else ""
    if not reason and f[int(size.argmax())] in (f.min(), f.max()):
        reason = (
            "the highest point is an end of the sweep, so the resonance lies outside: widen "
            "excitation.start and excitation.stop"
        )
    if reason:
        return [quantity.withheld(case, reason)]
    highest = max(peaks) if peaks else float(size.max())
    return [quantity.of(1.0 - highest / top, case)]


def _at_point(
    solution: ForcedSolution, curve: PointCurve, model: Model, at: Case, i: int
) -> list[Result]:
    """Contact state, losses and damper motion at point i of the path."""
    scene, answer = solution.plan.scene, curve.answer
    mean = answer.state[i].mean(axis=0)
    results = [
        *(
            q.STATIC_NORMAL.of(N, replace(at, side=side))
            for side, N in measures.static_normal(answer, model, i).items()
        ),
        *_shares(at, {side: one[i] for side, one in measures.shares(answer, model).items()}),
        q.CONTACT_SLIP.of(mean[1], at),
        q.CONTACT_LIFT.of(mean[2], at),
        *_losses(
            scene,
            at,
            answer.state[i],
            float(answer.energy[i].sum()),
            1e3 * float(measures.power(answer)[i].sum()),
        ),
    ]
    if scene.wants("damper_motion"):
        results += motion_results(at, *measures.damper_motion(answer, model, i))
    return results


def _at_marched(solution: ForcedSolution, one: MarchedPeak) -> list[Result]:
    """Contact state of each face, loss and damper motion at a peak of a sweep."""
    scene, at, energy = solution.plan.scene, one.case, one.period.energy
    results = list(_losses(scene, at, one.period.share, energy, energy * one.frequency))
    if scene.wants("contact_state"):
        results += _shares(at, dict(zip(SIDES, marched_shares(one), strict=True)))
    if scene.wants("damper_motion"):
        results += motion_results(at, *marched_damper(solution, one))
    return results


def _shares(at: Case, shares: Mapping[Side, Array]) -> Iterator[Result]:
    """Shares (3,) of the cycle of each face."""
    for side, share in shares.items():
        for quantity, value in zip(q.SHARES, share, strict=True):
            yield quantity.of(value, replace(at, side=side))


def _losses(
    scene: ForcedScene, at: Case, state: Array, energy: float, power: float
) -> Iterator[Result]:
    """Loss of all points, N mm and mW, and how many of them stick all the time."""
    yield q.FRICTION_ENERGY.of(energy, at)
    if scene.wants("contact_state"):
        # Their mean traction remembers where the sliders began.
        yield q.POINTS_ALWAYS_STUCK.of((state[:, 0] == 1.0).sum(), at)
    if scene.wants("hysteresis"):
        yield q.FRICTION_POWER.of(power, at)


# -- numbers of peaks and of the damper's motion ---------------------------------------------------


def peak_results(
    solution: ForcedSolution, case: Case, peaks: Sequence[CurvePeak], blade: Side
) -> list[Result]:
    """Numbered peaks of a blade; of the right one measured frequencies go to the nearest, each
    once.
    """
    found = printed_of(solution.plan)(MEASURED_PEAK, case.given())
    nearest = (
        {int(np.argmin([abs(peak.frequency - p.value) for peak in peaks])): p for p in found}
        if peaks and blade == "right"
        else {}
    )
    results = []
    for k, peak in enumerate(peaks):
        one, n, mine = nearest.get(k), peak.number, replace(case, mode=peak.mode)
        reference, source = (one.value, one.source) if one is not None else (None, "")
        frequency, height = q.PEAK_FREQUENCY.on(blade), q.PEAK_ACCELERANCE.on(blade)
        results += [
            frequency.of(peak.frequency, mine, reference, source, n=n, exact=False),
            height.of(peak.height, mine, n=n),
        ]
        if not case.kind and blade == "right":
            results.append(q.PEAK_MAC.of(peak.mac, mine, n=n))
    return results


def motion_results(case: Case, static: Array, amplitude: Array) -> list[Result]:
    """Translations and rotations of the damper, (6,) mm and rad each: mean and amplitude."""
    results = []
    both = np.maximum(np.abs(static), np.abs(amplitude))
    # motions that symmetry forbids are rounding
    least = np.repeat([both[:3].max(), both[3:].max()], 3) * np.sqrt(np.finfo(float).eps)
    for shift, turn, values in (
        (q.DAMPER_SHIFT, q.DAMPER_TURN, amplitude),
        (q.SHIFT_STATIC, q.TURN_STATIC, static),
    ):
        results += [
            (shift if k < 3 else turn).of(values[k], case, n="xyz"[k % 3])
            for k in np.flatnonzero(np.abs(values) > least)
        ]
    return results


# -- what was printed and measured -----------------------------------------------------------------


def printed_of(plan: ForcedPlan) -> Lookup:
    """What was printed of the rig, and of the damper in it under the loads of the ready scene."""
    scene, look_up = plan.scene, printed.printed_of(plan.scene)
    ready = printed.ready_scene(scene)
    damped = ready is not None and (
        (scene.damper.centrifugal, scene.damper.density, scene.contact.friction)
        == (ready.damper.centrifugal, ready.damper.density, ready.contact.friction)
    )
    ratios = (None, *(ready.excitation.centrifugal_to_force if damped else ()))

    def under_load(name: str, case: Mapping[str, Any]) -> tuple[Printed, ...]:
        free = case.get("kind") == "free"
        same = damped and case.get("force_ratio") in ratios
        return look_up(name, case) if free or same else ()

    return under_load


def measured_peaks(plan: ForcedPlan) -> tuple[Printed, ...]:
    """Peaks in Hz measured with the damper."""
    return printed_of(plan)(MEASURED_PEAK, {})
