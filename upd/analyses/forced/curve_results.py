"""Numbers of curves: by harmonic balance, of points and of whole faces, and of sweeps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import FacesCurve, ForcedCurve, SweptCurve
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.model import Model
from upd.analyses.forced.peak_results import (
    highest_in_harmonic,
    left_peak_results,
    motion_results,
    peak_results,
    reduction_name,
    whole_contact_results,
)
from upd.analyses.forced.solution import ForcedSolution, MarchedPeak
from upd.analyses.forced.sweeps import marched_damper, marched_shares
from upd.results import Case, Result, withheld
from upd.scene.forced_contact import SIDES, Side

#: by how much lower than the peak a sweep ends that is reported
_LOWER = 0.01
AnyCurve = ForcedCurve | FacesCurve | SweptCurve


def curve_results(solution: ForcedSolution, curve: ForcedCurve) -> list[Result]:
    """Peaks of a path of points, states, losses and damper motion there, what the path took."""
    answer, model, case = curve.answer, solution.models[curve.stiffness], curve.case
    results = [*_of_curve(solution, curve), *_folds(curve)]
    for k in model.excitation.harmonics[1:] if not curve.empty else ():
        for blade in SIDES[::-1]:
            H = measures.accelerance(answer, model.row(blade), curve.force, k)
            results += highest_in_harmonic(case, curve.frequency, np.abs(H), k, blade)
    for peak in curve.peaks.get("right", ()):
        at = replace(case, peak=peak.number, mode=peak.mode)
        results += _at_point(solution, curve, model, at, peak.sample)
    return results


def _folds(curve: ForcedCurve) -> Iterator[Result]:
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
            name = f"peak_{peak.number}_sweep_up"
            yield Result(f"{name}_frequency", case, fold.at, "Hz")
            yield Result(f"{name}_accelerance", case, fold.reached, "(m/s2)/N")


def balanced_results(solution: ForcedSolution, curve: FacesCurve) -> list[Result]:
    """Peaks of whole faces by harmonic balance, states and losses there, what the curve took."""
    case = curve.case
    results = [
        *_of_curve(solution, curve),
        Result("path_jumps", case, float(len(curve.answer.jumps)), ""),
    ]
    for k in excitation_of(solution.plan.scene.excitation).harmonics[1:]:
        for blade in SIDES[::-1] if not curve.empty else ():
            H = np.abs(curve.accelerance_in(k, blade))
            results += highest_in_harmonic(case, curve.frequency, H, k, blade)
    for peak in curve.peaks["right"]:
        at, i = replace(case, peak=peak.number, mode=peak.mode), peak.sample
        results += whole_contact_results(at, curve.answer.share[i], curve.answer.energy[i, 2])
    return results


def swept_results(solution: ForcedSolution, sweep: SweptCurve) -> list[Result]:
    """Peaks of a sweep, states and losses there, what the sweep took."""
    case = sweep.case
    results = _of_curve(solution, sweep)
    for j, k in enumerate(excitation_of(solution.plan.scene.excitation).harmonics[1:], 1):
        for b, blade in enumerate(SIDES) if not sweep.empty else ():
            H = np.abs(sweep.accelerance_in(k, j, b))
            results += highest_in_harmonic(case, sweep.frequency, H, k, blade)
    known = {(m.sweep.case, m.peak.number) for m in solution.marched}
    for peak in sweep.peaks["right"]:
        if (case, peak.number) not in known:
            at, i = replace(case, peak=peak.number, mode=peak.mode), peak.sample
            results += whole_contact_results(at, sweep.found.share[i], sweep.found.energy[i, 2])
    for marched in solution.marched:
        if marched.sweep.case == case:
            results += _at_marched(solution, marched)
    return results


def _of_curve(solution: ForcedSolution, curve: AnyCurve) -> list[Result]:
    """What every curve has: its size, peaks of both blades, those not reached, the reduction."""
    case = curve.case
    return [
        Result("excitation_force", case, curve.force, "N"),
        Result("path_points", case, float(len(curve.frequency)), ""),
        Result("curve_seconds", case, curve.seconds, "s"),
        *peak_results(solution, case, list(curve.peaks.get("right", ()))),
        *left_peak_results(case, list(curve.peaks.get("left", ()))),
        *_not_reached(solution, curve),
        *(r for blade in SIDES[::-1] for r in _reduction(solution, curve, blade)),
    ]


def _not_reached(solution: ForcedSolution, curve: AnyCurve) -> list[Result]:
    """Peaks of the stuck curve that the curve lacks, where it ended early or has none."""
    e, wanted = solution.plan.scene.excitation, solution.stuck_peaks(curve.stiffness)
    found = {peak.number for peak in curve.peaks.get("right", ())}
    modes = {peak.number: peak.mode for peak in wanted} or {1: ""}
    if curve.stopped:
        reason = curve.where
    elif not found:
        reason = f"no peak between {e.start:g} and {e.stop:g} Hz: widen excitation.start and stop"
        modes = dict(list(modes.items())[:1])
    else:
        # two modes may have grown into one peak: the curve shows all there are
        return []
    return [
        withheld(f"peak_{number}_{kind}", replace(curve.case, mode=mode), unit, reason)
        for number, mode in modes.items()
        if number not in found
        for kind, unit in (("frequency", "Hz"), ("accelerance", "(m/s2)/N"))
    ]


def _reduction(solution: ForcedSolution, curve: AnyCurve, blade: Side) -> list[Result]:
    """How far the highest point of a blade's curve is below its free peak."""
    linear = solution.linear.get(curve.stiffness)
    free = linear.free_peaks[blade] if linear else []
    if not free or curve.empty:
        return []
    name, case = reduction_name(blade), curve.case
    top = max(peak.height for peak in free)
    size = np.abs(curve.accelerance[blade])
    f, peaks = curve.frequency, [peak.height for peak in curve.peaks[blade]]
    reason = f"{curve.where}; the highest point may lie beyond" if curve.stopped else ""
    if not reason and f[int(size.argmax())] in (f.min(), f.max()):
        reason = (
            "the highest point is an end of the sweep, so the resonance lies outside: widen "
            "excitation.start and excitation.stop"
        )
    if reason:
        return [withheld(name, case, "%", reason)]
    highest = max(peaks) if peaks else float(size.max())
    return [Result(name, case, 100.0 * (1.0 - highest / top), "%")]


def _at_point(
    solution: ForcedSolution, curve: ForcedCurve, model: Model, at: Case, i: int
) -> list[Result]:
    """Contact state, losses and damper motion at point i of the path."""
    scene, answer, results = solution.plan.scene, curve.answer, []
    for side, N in measures.static_normal(answer, model, i).items():
        results.append(Result("static_normal", replace(at, side=side), N, "N"))
    for side, share in measures.shares(answer, model).items():
        for name, value in zip(("stick", "slip", "lift"), share[i], strict=True):
            results.append(
                Result(f"share_{name}", replace(at, side=side), 100.0 * float(value), "%")
            )
    mean = answer.state[i].mean(axis=0)
    results += [
        Result(f"contact_{name}", at, 100.0 * float(value), "%")
        for name, value in zip(("slip", "lift"), mean[1:], strict=True)
    ]
    results.append(Result("friction_energy", at, float(answer.energy[i].sum()), "N mm"))
    if scene.wants("contact_state"):
        # Their mean traction remembers where the sliders began.
        stuck = int((answer.state[i, :, 0] == 1.0).sum())
        results.append(Result("points_always_stuck", at, float(stuck), ""))
    if scene.wants("hysteresis"):
        power = 1e3 * float(measures.power(answer)[i].sum())
        results.append(Result("friction_power", at, power, "mW"))
    if scene.wants("damper_motion"):
        results += motion_results(at, *measures.damper_motion(answer, model, i))
    return results


def _at_marched(solution: ForcedSolution, one: MarchedPeak) -> list[Result]:
    """Contact state of each face, loss and damper motion at a peak of a sweep."""
    scene, at = solution.plan.scene, one.case
    results = [Result("friction_energy", at, one.period.energy, "N mm")]
    if scene.wants("contact_state"):
        for side, share in zip(SIDES, marched_shares(one), strict=True):
            results += [
                Result(f"share_{name}", replace(at, side=side), 100.0 * float(value), "%")
                for name, value in zip(("stick", "slip", "lift"), share, strict=True)
            ]
        stuck = int((one.period.share[:, 0] == 1.0).sum())
        results.append(Result("points_always_stuck", at, float(stuck), ""))
    if scene.wants("hysteresis"):
        # N mm a period to mW
        results.append(Result("friction_power", at, one.period.energy * one.frequency, "mW"))
    if scene.wants("damper_motion"):
        results += motion_results(at, *marched_damper(solution, one))
    return results
