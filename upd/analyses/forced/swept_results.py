"""Numbers of sweeps by time march."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from upd.analyses.forced.curves import SweptCurve
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.marched_peaks import marched_damper, marched_shares
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.peak_results import (
    highest_in_harmonic,
    left_peak_results,
    motion_results,
    peak_results,
    whole_contact_results,
)
from upd.analyses.forced.ranges import peak_ranges, sweeps_of
from upd.analyses.forced.reduction_results import reduced_results, reduction_name
from upd.analyses.forced.solution import ForcedSolution, MarchedPeak
from upd.results import Case, Result, withheld
from upd.scene.forced_contact import SIDES, Side


def swept_results(solution: ForcedSolution, name: str, ratio: float) -> list[Result]:
    """Peaks that are the sweeps' and not the balance's, and what the sweeps took."""
    sweeps = sweeps_of(solution, name, ratio)
    case, results = Case(stiffness=name, force_ratio=ratio), []
    for blade in SIDES:
        ranges = peak_ranges(solution, name, ratio, blade)
        tops = [one.found[0] for one in ranges.values() if not one.agrees]
        if blade == "right":
            results += peak_results(solution, case, tops, ranges)
            for top in tops:
                results += _at_swept(sweeps, top)
            for marched in solution.marched:
                if (marched.sweep.stiffness, marched.sweep.ratio) == (name, ratio):
                    results += _at_marched(solution, marched)
        else:
            results += left_peak_results(case, tops, ranges)
    if not any((one.stiffness, one.ratio) == (name, ratio) for one in solution.paths):
        results += _not_swept(solution, case, sweeps)
        ended = next((one for one in sweeps if one.stopped), None)
        if ended is None:
            for blade in SIDES[::-1]:
                heights = [_swept_height(one, blade) for one in sweeps]
                results += reduced_results(solution, case, heights, blade)
        else:
            reason = f"{ended.where}; the highest point may lie beyond"
            free = solution.linear[name].free_peaks
            results += [
                withheld(reduction_name(blade), case, "%", reason)
                for blade in SIDES[::-1]
                if free[blade]
            ]
    excited = excitation_of(solution.plan.scene.excitation)
    for one in sweeps:
        for j, k in enumerate(excited.harmonics[1:], 1) if len(one.frequency) else ():
            for b, blade in enumerate(SIDES):
                H = one.accelerance_in(k, j, b)
                results += highest_in_harmonic(one.case, one.frequency, np.abs(H), k, blade)
        count, seconds = len(one.found.frequency), one.found.seconds
        results += [
            Result("sweep_points", one.case, float(count), ""),
            Result("sweep_jumps", one.case, float(len(one.found.jumps)), ""),
            Result("sweep_seconds", one.case, seconds, "s"),
        ]
    return results


def _swept_height(one: SweptCurve, blade: Side) -> float:
    return max(
        [
            float(np.abs(one.accelerance[blade]).max(initial=0.0)),
            *(peak.height for peak in one.peaks[blade]),
        ]
    )


def _not_swept(solution: ForcedSolution, case: Case, sweeps: Sequence[SweptCurve]) -> list[Result]:
    """Peaks of the stuck curve that no sweep has."""
    found = {one.number for s in sweeps for one in s.peaks["right"]}
    wanted = {one.number: one.mode for one in solution.stuck_peaks(case.stiffness)}
    ended = [s for s in sweeps if s.found.status == "stopped"]
    reason = "neither sweep has a peak in which the blades move like that"
    if ended:
        reason = f"the sweep {ended[0].way} ended: {ended[0].found.message}"
    return [
        withheld(f"peak_{number}_{kind}", replace(case, mode=mode), unit, reason)
        for number, mode in wanted.items()
        if number not in found
        for kind, unit in (("frequency", "Hz"), ("accelerance", "(m/s2)/N"))
    ]


def _at_swept(sweeps: Sequence[SweptCurve], top: ModePeak) -> list[Result]:
    """States and friction loss of the whole contact at the highest of a peak's ends."""
    one = next(s for s in sweeps if top in s.peaks["right"])
    case = replace(one.case, peak=top.number, mode=top.mode, choice="")
    return whole_contact_results(case, one.found.share[top.sample], one.found.energy[top.sample, 2])


def _at_marched(solution: ForcedSolution, one: MarchedPeak) -> list[Result]:
    """Contact state of each face, loss and damper motion at a peak of the sweeps."""
    scene, at, results = solution.plan.scene, one.case, []
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
        power = one.period.energy * one.frequency
        results.append(Result("friction_power", at, power, "mW"))
    if scene.wants("damper_motion"):
        results += motion_results(at, *marched_damper(solution, one))
    return results
