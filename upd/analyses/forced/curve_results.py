"""Numbers of curves by harmonic balance, of points and of whole faces."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import FacesCurve, ForcedCurve, LeftMaximum
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Model
from upd.analyses.forced.peak_results import (
    highest_in_harmonic,
    left_peak_results,
    motion_results,
    peak_results,
    whole_contact_results,
)
from upd.analyses.forced.ranges import peak_ranges
from upd.analyses.forced.reduction_results import reduction_results
from upd.analyses.forced.solution import ForcedSolution
from upd.results import Case, Result, withheld
from upd.scene.forced_contact import SIDES


def curve_results(solution: ForcedSolution, curve: ForcedCurve) -> list[Result]:
    """Peaks of a path of points, states, losses and damper motion there, what the path took."""
    answer, model, case = curve.answer, solution.models[curve.stiffness], curve.case
    results = [
        Result("excitation_force", case, curve.force, "N"),
        Result("path_points", case, float(len(answer.frequency)), ""),
        Result("curve_seconds", case, curve.seconds, "s"),
    ]
    peaks, told = _peaks_by_balance(solution, curve)
    results += told
    for blade in SIDES[::-1]:
        results += reduction_results(solution, curve, blade)
    results += _more_harmonics(solution, curve)
    for peak in peaks:
        at = replace(case, peak=peak.number, mode=peak.mode)
        results += _at_point(solution, curve, model, at, peak.sample)
    return results


def _more_harmonics(solution: ForcedSolution, curve: ForcedCurve) -> list[Result]:
    """Highest points of a path in the harmonics that are excited beside the one that is read."""
    model, results = solution.models[curve.stiffness], []
    for k in model.excitation.harmonics[1:] if not curve.empty else ():
        for blade in SIDES[::-1]:
            H = measures.accelerance(curve.answer, model.row(blade), curve.force, k)
            results += highest_in_harmonic(curve.case, curve.frequency, np.abs(H), k, blade)
    return results


def balanced_results(solution: ForcedSolution, curve: FacesCurve) -> list[Result]:
    """Peaks of whole faces by harmonic balance, states and losses there, what the curve took."""
    case = curve.case
    results = [
        Result("excitation_force", case, curve.force, "N"),
        Result("path_points", case, float(len(curve.frequency)), ""),
        Result("path_jumps", case, float(len(curve.answer.jumps)), ""),
        Result("curve_seconds", case, curve.seconds, "s"),
    ]
    peaks, told = _peaks_by_balance(solution, curve)
    results += told
    harmonics = excitation_of(solution.plan.scene.excitation).harmonics
    for blade in SIDES[::-1] if not curve.empty else ():
        results += reduction_results(solution, curve, blade)
    for k in harmonics[1:] if not curve.empty else ():
        for blade in SIDES[::-1]:
            H = np.abs(curve.accelerance_in(k, blade))
            results += highest_in_harmonic(case, curve.frequency, H, k, blade)
    for peak in peaks:
        at, i = replace(case, peak=peak.number, mode=peak.mode), peak.sample
        results += whole_contact_results(at, curve.answer.share[i], curve.answer.energy[i, 2])
    return results


def _peaks_by_balance(
    solution: ForcedSolution, curve: ForcedCurve | FacesCurve
) -> tuple[list[ModePeak], list[Result]]:
    """The right blade's peaks that no sweep tells otherwise; numbers of both blades' peaks, and of
    those that were not reached.
    """
    ranges = {side: peak_ranges(solution, curve.stiffness, curve.ratio, side) for side in SIDES}
    right, left = (
        [
            one
            for one in solution.numbered_peaks(curve, side)
            if one.number not in ranges[side] or ranges[side][one.number].agrees
        ]
        for side in SIDES[::-1]
    )
    return right, [
        *peak_results(solution, curve.case, right),
        *left_peak_results(curve.case, left),
        *_not_reached(solution, curve, right, ranges["right"]),
    ]


def _not_reached(
    solution: ForcedSolution,
    curve: ForcedCurve | FacesCurve,
    peaks: Sequence[ModePeak],
    swept: Collection[int],
) -> list[Result]:
    """The peaks that were asked for and that neither the path nor a sweep has: those of the stuck
    curve.
    """
    e, wanted = solution.plan.scene.excitation, solution.stuck_peaks(curve.stiffness)
    found = {peak.number for peak in peaks}.union(swept)
    left = _left(curve) if isinstance(curve, ForcedCurve) else {}
    modes = {peak.number: peak.mode for peak in (*wanted, *(one.peak for one in left.values()))}
    modes = modes or ({} if found else {1: ""})
    if curve.stopped:
        # What one path lacks the one from the other end may have, under its own case.
        other = [
            c for c in solution.paths if c.case == replace(curve.case, reversed=not curve.reversed)
        ]
        if curve.reversed:
            return []
        found = found.union(*({one.number for one in solution.numbered_peaks(c)} for c in other))
        reason = f"{curve.where}: {curve.answer.message}"
    elif not found and not left:
        reason = f"no peak between {e.start:g} and {e.stop:g} Hz: widen excitation.start and stop"
        modes = dict(list(modes.items())[:1])
    else:
        reason = (
            f"the whole path from {e.start:g} to {e.stop:g} Hz has no peak in which the blades "
            "move like that"
        )
    return [
        withheld(
            f"peak_{number}_{kind}",
            replace(curve.case, mode=mode),
            unit,
            "no steady motion of the balance, or too few harmonics: a march goes from "
            f"{left[number].words}"
            if number in left
            else reason,
        )
        for number, mode in modes.items()
        if number not in found
        for kind, unit in (("frequency", "Hz"), ("accelerance", "(m/s2)/N"))
    ]


def _left(curve: ForcedCurve) -> dict[int, LeftMaximum]:
    """The highest of the right blade's maxima that a march leaves, by the numbers of its peaks."""
    out: dict[int, LeftMaximum] = {}
    for one in curve.left:
        if one.blade == "right":
            out.setdefault(one.peak.number, one)
    return out


def _at_point(
    solution: ForcedSolution, curve: ForcedCurve, model: Model, at: Case, i: int
) -> list[Result]:
    """Contact state, losses and damper motion at point i of the path."""
    scene, answer, results = solution.plan.scene, curve.answer, []
    for side, N in measures.static_normal(answer, model, i).items():
        results.append(Result("static_normal", replace(at, side=side), N, "N"))
    if scene.wants("contact_state"):
        for side, share in measures.shares(answer, model).items():
            for name, value in zip(("stick", "slip", "lift"), share[i], strict=True):
                results.append(
                    Result(f"share_{name}", replace(at, side=side), 100.0 * float(value), "%")
                )
        # Their mean traction remembers where the sliders began.
        stuck = int((answer.state[i, :, 0] == 1.0).sum())
        results.append(Result("points_always_stuck", at, float(stuck), ""))
    if scene.wants("hysteresis"):
        results.append(Result("friction_energy", at, float(answer.energy[i].sum()), "N mm"))
        results.append(
            Result("friction_power", at, 1e3 * float(measures.power(answer)[i].sum()), "mW")
        )
    if scene.wants("damper_motion"):
        results += motion_results(at, *measures.damper_motion(answer, model, i))
    return results
