"""ForcedSolution -> the flat list of numbers, beside the peaks that were measured."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from upd.analyses import printed
from upd.analyses.forced import measures
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.marched_peaks import marched_damper, marched_shares
from upd.analyses.forced.mode_peaks import ModePeak, unmoved
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.ranges import (
    NO_RANGES,
    PeakRange,
    alike_heights,
    peak_ranges,
    sweeps_of,
)
from upd.analyses.forced.solution import (
    AS_RUN,
    Branch,
    CurveBand,
    FacesCurve,
    ForcedCurve,
    ForcedSolution,
    LinearCurves,
    MarchedPeak,
    PeakAgain,
    Performance,
    SweptCurve,
    WholeFaces,
)
from upd.analyses.forced.statics import StaticState
from upd.plot.chart import Entry
from upd.reference.printed import Lookup, Printed
from upd.results import Case, Result, withheld
from upd.scene.forced import SIDES, Side

#: the numbers that matter, most important first (shell patterns): terminal, page, notebook, tables
#: of sweeps and studies
HEADLINE = (
    "peak_?_frequency",
    "peak_?_accelerance",
    "reduction_of_free_peak",
    "friction_energy",
    "optimum_ratio",
    "stuck_in_phase",
    "stuck_out_of_phase",
    "static_N",
    "static_T",
)
#: numbers of the faces, one for each
_FACES = ("static_N", "static_T")
#: a rigid damper in the same static state; of the seated one, as far as friction can oppose F_C
_SAID = {
    "seated": "rigid damper, full friction against F_C",
    "opposing": "rigid damper, full friction against F_C",
    "reversed": "rigid damper, full friction along F_C",
    "frictionless": "rigid damper without friction",
}
_DAMPER = ("x", "y", "z")
_NOT_ALIKE = "sweeps up and down are not alike"
#: how numbers of the left blade begin
_LEFT = "left_"
#: name under which measured peaks are printed: which of a run's peaks each is stands nowhere
_MEASURED = "peak_frequency"


def headline(results: Sequence[Entry]) -> list[Entry]:
    """Peaks free and of the curve of the lowest F_C/F_E on which something slips, its reduction and
    loss, the optimum, the stuck frequencies, the static forces of both faces.
    """
    slipping = {
        _curve_of(one) for one in results if one["name"] == "share_slip" and (one["value"] or 0) > 0
    }
    first: dict[tuple[str, str, str], Entry] = {}
    # those of a curve on which all sticks stand behind
    for entry in sorted(results, key=lambda one: _stands_behind(one, slipping)):
        kind = entry.get("case_fields", {}).get("kind", "")
        side = entry["case"].rpartition(", ")[2] if entry["name"] in _FACES else ""
        # The peaks of the stuck curve are the stuck frequencies.
        if kind != "stuck":
            first.setdefault((entry["name"], kind, side), entry)
    ranked = [
        (rank, key)
        for key in first
        for rank, one in enumerate(HEADLINE)
        if fnmatchcase(key[0], one)
    ]
    return [
        first[key] for _, key in sorted(ranked, key=lambda pair: (pair[1][1] != "free", pair[0]))
    ]


def _curve_of(entry: Entry) -> tuple[Any, Any]:
    """Stiffness and F_C/F_E of a number; F_C/F_E is None for what belongs to no curve."""
    fields = entry.get("case_fields", {})
    return fields.get("stiffness"), fields.get("force_ratio")


def _stands_behind(entry: Entry, slipping: Collection[tuple[Any, Any]]) -> tuple[bool, float]:
    curve = _curve_of(entry)
    if curve[1] is None:
        return False, 0.0
    return curve not in slipping, float(curve[1])


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
    return printed_of(plan)(_MEASURED, {})


def make_results(solution: ForcedSolution) -> list[Result]:
    """All numbers of a run."""
    results: list[Result] = []
    for name, model in solution.models.items():
        results += _model_results(name, model)
    for name, faces in solution.faces.items():
        results += _faces_results(solution, name, faces)
    for name, linear in solution.linear.items():
        results += _linear_results(solution, name, linear)
    for curve in solution.curves:
        results += _curve_results(solution, curve)
    for one in solution.balanced:
        results += _balanced_results(solution, one)
    for name, ratio in dict.fromkeys((s.stiffness, s.ratio) for s in solution.sweeps):
        results += _swept_results(solution, name, ratio)
    for march in (march for march in solution.marches if march.verifies):
        value = march.accelerance(solution.models[march.curve.stiffness])
        case = replace(march.curve.case, frequency=march.frequency)
        results.append(
            Result(
                "time_march_accelerance",
                case,
                value,
                "(m/s2)/N",
                march.height,
                "harmonic balance",
                exact=False,
            )
        )
    for band in solution.bands:
        results += _band_results(band)
    for name, spread in solution.spreads.items():
        results += _spread_results(name, spread)
    for name, found in solution.harmonics.items():
        results += _harmonics_results(name, found)
    for name, performance in solution.performances.items():
        results += _performance_results(name, performance)
    return results


def _model_results(name: str, model: Model) -> list[Result]:
    case, law = Case(stiffness=name), model.contacts.law
    results = [
        Result("damper_mass", case, 1e6 * model.damper.mass, "g"),
        Result("contact_points", case, float(model.contacts.n_point), ""),
    ]
    for k, side in enumerate(SIDES):
        on, face = model.face == k, replace(case, side=side)
        results += [Result("face_K_N", face, float(law.k_n[on].sum()), "N/mm")]
        results += [Result("face_K_T", face, float(law.k_t[on].sum()), "N/mm")]
    return results + _static_results(case, model)


def _faces_results(solution: ForcedSolution, name: str, faces: WholeFaces) -> list[Result]:
    """Mass of the damper, nodes, forces at rest."""
    case = Case(stiffness=name)
    assert solution.bodies is not None
    return [
        Result("damper_mass", case, 1e6 * solution.bodies.damper.mass, "g"),
        Result("contact_points", case, float(faces.of.n), ""),
        *_static_forces(case, faces.state, faces.state.N, faces.state.T),
    ]


def _static_results(case: Case, model: Model) -> list[Result]:
    """N and T of the faces before vibration, beside those of a rigid damper in that state."""
    if model.state is None:
        return []
    N, T = (
        np.array([values[model.face == k].sum() for k in range(len(SIDES))])
        for values in (model.contacts.law.preload, model.traction[:, -1])
    )
    return _static_forces(case, model.state, N, T)


def _static_forces(case: Case, state: StaticState, N: Array, T: Array) -> list[Result]:
    """Normal and tangential force of each face, (2,) N."""
    results = []
    for k, side in enumerate(SIDES):
        for letter, values in (("N", N), ("T", T)):
            word = {"N": "normal", "T": "tangential"}[letter]
            known = None if state.known is None else getattr(state.known, f"{word}_{side}")
            results.append(
                Result(
                    f"static_{letter}",
                    replace(case, side=side, choice=state.name),
                    float(values[k]),
                    "N",
                    known,
                    _SAID.get(state.name, "") if known is not None else "",
                    exact=state.name != "seated",
                )
            )
    return results


def _band_results(band: CurveBand) -> list[Result]:
    """Between which every peak lies, and what each choice gives."""
    results = []
    for number in band.numbers:
        found = band.peaks(number)
        one = found.get(AS_RUN) or next(iter(found.values()))
        case = replace(band.curve.case, mode=one.mode)
        for kind, unit, values in (
            ("frequency", "Hz", {name: p.frequency for name, p in found.items()}),
            ("accelerance", "(m/s2)/N", {name: p.height for name, p in found.items()}),
        ):
            results += [
                Result(f"{end}_peak_{number}_{kind}", case, of(values.values()), unit)
                for end, of in (("lowest", min), ("highest", max))
            ]
            results += [
                Result(f"band_peak_{number}_{kind}", replace(case, choice=name), value, unit)
                for name, value in values.items()
            ]
    lost = sum(one.curve.stopped for one in band.curves)
    return [
        *results,
        Result("band_curves", band.curve.case, float(len(band.curves)), ""),
        Result("band_curves_not_complete", band.curve.case, float(lost), ""),
    ]


def _linear_results(solution: ForcedSolution, name: str, linear: LinearCurves) -> list[Result]:
    results, case = [], Case(stiffness=name)
    phase = {True: "in_phase", False: "out_of_phase"}
    for in_phase in (True, False):
        found = next((m for m in linear.modes if m.axis == "x" and m.in_phase == in_phase), None)
        if found is not None:
            results.append(Result(f"stuck_{phase[in_phase]}", case, found.frequency, "Hz"))
    for kind, told in (
        ("free", unmoved(linear.free_peaks["right"])),
        ("stuck", solution.stuck_peaks(name)),
    ):
        results += _peaks(solution, replace(case, kind=kind), told)
    # Without a damper a blade that is not excited, on a base of its own, stays at rest.
    results += _left_peaks(replace(case, kind="free"), unmoved(linear.free_peaks["left"]))
    return results + _left_peaks(replace(case, kind="stuck"), solution.stuck_peaks(name, "left"))


def _peaks(
    solution: ForcedSolution,
    case: Case,
    peaks: Sequence[ModePeak],
    ranges: Mapping[int, PeakRange] = NO_RANGES,
) -> list[Result]:
    """Numbered peaks of the right blade; measured frequencies go to the nearest, each once.

    Those that the sweeps tell otherwise are theirs.
    """
    found = printed_of(solution.plan)(_MEASURED, case.given())
    nearest = (
        {int(np.argmin([abs(peak.frequency - p.value) for peak in peaks])): p for p in found}
        if peaks
        else {}
    )
    results = []
    for k, peak in enumerate(peaks):
        one, name, mine = nearest.get(k), f"peak_{peak.number}", replace(case, mode=peak.mode)
        reference, source = (one.value, one.source) if one is not None else (None, "")
        pair = [
            Result(f"{name}_frequency", mine, peak.frequency, "Hz", reference, source, exact=False),
            Result(f"{name}_accelerance", mine, peak.height, "(m/s2)/N"),
        ]
        results += _spread_out(pair, ranges.get(peak.number))
        if not case.kind:
            results.append(Result(f"{name}_mac", mine, peak.mac, ""))
    return results


def _spread_out(pair: Sequence[Result], told: PeakRange | None) -> list[Result]:
    """Frequency and height of a peak with the ends of what the sweeps tell, and why."""
    if told is None or told.agrees:
        return list(pair)
    ends = [told.ends(kind) for kind in ("frequency", "height")]
    if told.single:
        return [replace(one, why=told.why) for one in pair]
    return [
        replace(one, low=low, high=high, why=told.why)
        for one, (low, high) in zip(pair, ends, strict=True)
    ]


def _left_peaks(
    case: Case, peaks: Sequence[ModePeak], ranges: Mapping[int, PeakRange] = NO_RANGES
) -> list[Result]:
    """Numbered peaks of the left blade, which without a force of its own only the damper moves."""
    results = []
    for peak in peaks:
        name, mine = f"left_peak_{peak.number}", replace(case, mode=peak.mode)
        pair = [
            Result(f"{name}_frequency", mine, peak.frequency, "Hz"),
            Result(f"{name}_accelerance", mine, peak.height, "(m/s2)/N"),
        ]
        results += _spread_out(pair, ranges.get(peak.number))
    return results


def _swept_results(solution: ForcedSolution, name: str, ratio: float) -> list[Result]:
    """Peaks that are the sweeps' and not the balance's, and what the sweeps took."""
    sweeps = sweeps_of(solution, name, ratio)
    case, results = Case(stiffness=name, force_ratio=ratio), []
    for blade in SIDES:
        ranges = peak_ranges(solution, name, ratio, blade)
        tops = [one.found[0] for one in ranges.values() if not one.agrees]
        if blade == "right":
            results += _peaks(solution, case, tops, ranges)
            for top in tops:
                results += _at_swept(sweeps, top)
            for marched in solution.marched:
                if (marched.sweep.stiffness, marched.sweep.ratio) == (name, ratio):
                    results += _at_marched(solution, marched)
        else:
            results += _left_peaks(case, tops, ranges)
    if not any((one.stiffness, one.ratio) == (name, ratio) for one in solution.paths):
        results += _not_swept(solution, case, sweeps)
        ended = next((one for one in sweeps if one.stopped), None)
        if ended is None:
            for blade in SIDES[::-1]:
                heights = [_swept_height(one, blade) for one in sweeps]
                results += _reduced(solution, case, heights, blade)
        else:
            reason = f"{ended.where}; the highest point may lie beyond"
            free = solution.linear[name].free_peaks
            results += [
                withheld(_reduction_name(blade), case, "%", reason)
                for blade in SIDES[::-1]
                if free[blade]
            ]
    excited = excitation_of(solution.plan.scene.excitation)
    for one in sweeps:
        for j, k in enumerate(excited.harmonics[1:], 1) if len(one.frequency) else ():
            for b, blade in enumerate(SIDES):
                H = one.accelerance_in(k, j, b)
                results += _highest_in(one.case, one.frequency, np.abs(H), k, blade)
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


def _reduced(
    solution: ForcedSolution, case: Case, heights: Sequence[float], blade: Side
) -> list[Result]:
    """How far the highest point of every sweep is below the blade's free peak."""
    free = solution.linear[case.stiffness].free_peaks[blade]
    if not free or not heights:
        return []
    top = max(peak.height for peak in free)
    left = [100.0 * (1.0 - height / top) for height in heights]
    one = Result(_reduction_name(blade), case, min(left), "%")
    if alike_heights(heights):
        return [one]
    return [replace(one, low=min(left), high=max(left), why=_NOT_ALIKE)]


def _at_swept(sweeps: Sequence[SweptCurve], top: ModePeak) -> list[Result]:
    """States and friction loss of the whole contact at the highest of a peak's ends."""
    one = next(s for s in sweeps if top in s.peaks["right"])
    case = replace(one.case, peak=top.number, mode=top.mode, choice="")
    share = dict(zip(("lift", "stick", "slip"), one.found.share[top.sample], strict=True))
    return [
        *(
            Result(f"share_{name}", case, 100.0 * float(share[name]), "%")
            for name in ("stick", "slip", "lift")
        ),
        Result("friction_energy", case, float(one.found.energy[top.sample, 2]), "N mm"),
    ]


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
        results += _motion_results(at, *marched_damper(solution, one))
    return results


def _curve_results(solution: ForcedSolution, curve: ForcedCurve) -> list[Result]:
    answer, model, case = curve.answer, solution.models[curve.stiffness], curve.case
    results = [
        Result("excitation_force", case, curve.force, "N"),
        Result("path_points", case, float(len(answer.frequency)), ""),
        Result("curve_seconds", case, curve.seconds, "s"),
    ]
    ranges = {side: peak_ranges(solution, curve.stiffness, curve.ratio, side) for side in SIDES}
    mine = {
        side: [
            one
            for one in solution.numbered_peaks(curve, side)
            if one.number not in ranges[side] or ranges[side][one.number].agrees
        ]
        for side in SIDES
    }
    peaks = mine["right"]
    results += _peaks(solution, case, peaks)
    results += _left_peaks(case, mine["left"])
    results += _not_reached(solution, curve, peaks, ranges["right"])
    for blade in SIDES[::-1]:
        results += _reduction(solution, curve, blade)
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
            results += _highest_in(curve.case, curve.frequency, np.abs(H), k, blade)
    return results


def _highest_in(case: Case, f: Array, size: Array, k: int, blade: Side) -> list[Result]:
    """Highest point in harmonic k, of a curve whose harmonic that is read has the numbered
    peaks.
    """
    top = max(measures.path_maxima(f, size), key=lambda p: p.height, default=None)
    i = int(size.argmax())
    at, height = (float(f[i]), float(size[i])) if top is None else top[:2]
    name = f"{_LEFT * (blade == 'left')}harmonic_{k}"
    return [
        Result(f"{name}_frequency", case, at, "Hz"),
        Result(f"{name}_accelerance", case, height, "(m/s2)/N"),
    ]


def _balanced_results(solution: ForcedSolution, curve: FacesCurve) -> list[Result]:
    """Peaks of whole faces by harmonic balance, states and losses there, what the curve took."""
    case = curve.case
    results = [
        Result("excitation_force", case, curve.force, "N"),
        Result("path_points", case, float(len(curve.frequency)), ""),
        Result("path_jumps", case, float(len(curve.answer.jumps)), ""),
        Result("curve_seconds", case, curve.seconds, "s"),
    ]
    ranges = {side: peak_ranges(solution, curve.stiffness, curve.ratio, side) for side in SIDES}
    mine = {
        side: [
            one
            for one in curve.peaks[side]
            if one.number not in ranges[side] or ranges[side][one.number].agrees
        ]
        for side in SIDES
    }
    results += _peaks(solution, case, mine["right"])
    results += _left_peaks(case, mine["left"])
    results += _not_reached(solution, curve, mine["right"], ranges["right"])
    harmonics = excitation_of(solution.plan.scene.excitation).harmonics
    for blade in SIDES[::-1] if not curve.empty else ():
        results += _reduction(solution, curve, blade)
    for k in harmonics[1:] if not curve.empty else ():
        for blade in SIDES[::-1]:
            H = np.abs(curve.accelerance_in(k, blade))
            results += _highest_in(case, curve.frequency, H, k, blade)
    for peak in mine["right"]:
        at, i = replace(case, peak=peak.number, mode=peak.mode), peak.sample
        share = dict(zip(("lift", "stick", "slip"), curve.answer.share[i], strict=True))
        results += [
            *(
                Result(f"share_{name}", at, 100.0 * float(share[name]), "%")
                for name in ("stick", "slip", "lift")
            ),
            Result("friction_energy", at, float(curve.answer.energy[i, 2]), "N mm"),
        ]
    return results


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
    modes = {peak.number: peak.mode for peak in wanted} or ({} if found else {1: ""})
    if curve.stopped:
        # What one path lacks the one from the other end may have, under its own case.
        other = [
            c for c in solution.paths if c.case == replace(curve.case, reversed=not curve.reversed)
        ]
        if curve.reversed:
            return []
        found = found.union(*({one.number for one in solution.numbered_peaks(c)} for c in other))
        reason = f"{curve.where}: {curve.answer.message}"
    elif not found:
        reason = f"no peak between {e.start:g} and {e.stop:g} Hz: widen excitation.start and stop"
        modes = dict(list(modes.items())[:1])
    else:
        reason = (
            f"the whole path from {e.start:g} to {e.stop:g} Hz has no peak in which the blades "
            "move like that"
        )
    return [
        withheld(f"peak_{number}_{kind}", replace(curve.case, mode=mode), unit, reason)
        for number, mode in modes.items()
        if number not in found
        for kind, unit in (("frequency", "Hz"), ("accelerance", "(m/s2)/N"))
    ]


def _reduction(
    solution: ForcedSolution, curve: ForcedCurve | FacesCurve, blade: Side = "right"
) -> list[Result]:
    """Highest point of a blade's curve against its free peak, where the paths reach the whole
    sweep.

    Only where the sweep holds the free peak; a run that broke off may have no free curve yet.
    """
    linear = solution.linear.get(curve.stiffness)
    free = linear.free_peaks[blade] if linear else []
    if not free or curve.reversed:
        return []
    name = _reduction_name(blade)
    top = max(peak.height for peak in free)
    swept = _swept_heights(solution, curve, blade)
    if swept:
        return _reduced(solution, curve.case, swept, blade)
    mine = [
        c for c in solution.paths if replace(c.case, reversed=False) == curve.case and not c.empty
    ]
    if curve.stopped and not _meet(mine):
        reached = " and ".join(c.where for c in mine) or curve.where
        reason = f"{reached}; the highest point may lie between"
        return [withheld(name, curve.case, "%", reason)]
    ends = [c for c in mine if _highest_at_end(c, blade)]
    if ends:
        reason = (
            "the highest point is an end of the sweep, so the resonance lies outside: widen "
            "excitation.start and excitation.stop"
        )
        return [withheld(name, curve.case, "%", reason)]
    value = 100.0 * (1.0 - max(_height(c, blade) for c in mine) / top)
    return [Result(name, curve.case, value, "%")]


def _reduction_name(blade: Side) -> str:
    return f"{_LEFT * (blade == 'left')}reduction_of_free_peak"


def _swept_heights(
    solution: ForcedSolution, curve: ForcedCurve | FacesCurve, blade: Side
) -> list[float]:
    """Highest point of every sweep of a curve, and of the curve beside it; empty where the balance
    tells the same, or where not every sweep came to its end.
    """
    ranges = peak_ranges(solution, curve.stiffness, curve.ratio, blade)
    sweeps = sweeps_of(solution, curve.stiffness, curve.ratio)
    if all(one.agrees for one in ranges.values()) or any(
        s.found.status == "stopped" for s in sweeps
    ):
        return []
    f, out = curve.answer.frequency, []
    for one in sweeps:
        beside = (f < one.found.frequency.min()) | (f > one.found.frequency.max())
        parts = (one.accelerance[blade], curve.accelerance[blade][beside])
        out.append(max(float(np.abs(part).max(initial=0.0)) for part in parts))
    return out


def _highest_at_end(curve: ForcedCurve | FacesCurve, blade: Side) -> bool:
    size, f = np.abs(curve.accelerance[blade]), curve.answer.frequency
    at = f[int(size.argmax())]
    return bool(at in (f.min(), f.max()))


def _height(curve: ForcedCurve | FacesCurve, blade: Side) -> float:
    """Highest of a path, between its points as the free peak is."""
    size = np.abs(curve.accelerance[blade])
    if isinstance(curve, FacesCurve):
        # nothing is read across a jump
        return max([float(size.max()), *(peak.height for peak in curve.peaks[blade])])
    peaks = measures.path_peaks(curve.answer.frequency, size)
    return max([float(size.max()), *(peak.height for peak in peaks)])


def _meet(paths: Sequence[ForcedCurve | FacesCurve]) -> bool:
    """Whether the paths from both ends are one: an end of one lies on the other.

    Ends that pass each other in frequency alone may be on two branches, with the resonance on the
    part between that neither has.
    """
    return any(
        _on(up.answer.frequency[-1], up.accelerance["right"][-1], down)
        or _on(down.answer.frequency[-1], down.accelerance["right"][-1], up)
        for up in paths
        if not up.reversed
        for down in paths
        if down.reversed
    )


def _on(f: float, H: complex, path: ForcedCurve | FacesCurve) -> bool:
    """Whether a point lies between two neighbouring points of a path: frequency, real and
    imaginary part.
    """
    points = np.column_stack(
        [path.answer.frequency, path.accelerance["right"].real, path.accelerance["right"].imag]
    )
    low, high = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
    at = np.array([f, H.real, H.imag])
    return bool(((low <= at) & (at <= high)).all(axis=1).any())


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
        results += _motion_results(at, *measures.damper_motion(answer, model, i))
    return results


def _motion_results(case: Case, static: Array, amplitude: Array) -> list[Result]:
    results, names = [], [f"damper_{kind}{axis}" for kind in "ur" for axis in _DAMPER]
    both = np.maximum(np.abs(static), np.abs(amplitude))
    # motions that symmetry forbids are rounding
    least = np.repeat([both[:3].max(), both[3:].max()], 3) * np.sqrt(np.finfo(float).eps)
    for part, values in (("", amplitude), ("_static", static)):
        shown = np.flatnonzero(np.abs(values) > least)
        results += [
            Result(f"{names[k]}{part}", case, 1e3 * float(values[k]), "um" if k < 3 else "mrad")
            for k in shown
        ]
    return results


def _spread_results(name: str, found: Sequence[PeakAgain]) -> list[Result]:
    good, case = [one for one in found if one.found], Case(stiffness=name)
    results = [
        Result("spread_peak", replace(case, choice=f"start {one.choice}"), one.height, "(m/s2)/N")
        for one in good
    ]
    results += [Result("spread_starts_not_solved", case, float(len(found) - len(good)), "")]
    if len(good) > 1:
        heights = np.array([one.height for one in good])
        results.append(
            Result("spread_of_peak", case, 100.0 * float(np.ptp(heights) / heights.mean()), "%")
        )
        results.append(
            Result(
                "spread_of_peak_frequency",
                case,
                float(np.ptp([one.frequency for one in good])),
                "Hz",
            )
        )
    return results


def _harmonics_results(name: str, found: Sequence[PeakAgain]) -> list[Result]:
    best = next((one for one in reversed(found) if one.found), None)
    results = []
    for one in found:
        case = Case(stiffness=name, choice=f"{one.choice} harmonic{'s' * (one.choice != '1')}")
        if best is not None and one.found:
            source = f"{best.choice} harmonics"
            results.append(
                Result(
                    "harmonics_peak", case, one.height, "(m/s2)/N", best.height, source, exact=False
                )
            )
            results.append(
                Result(
                    "harmonics_frequency",
                    case,
                    one.frequency,
                    "Hz",
                    best.frequency,
                    source,
                    exact=False,
                )
            )
        results.append(Result("harmonics_truncation", case, 100.0 * one.truncation, "%"))
        results.append(Result("harmonics_seconds", case, one.seconds, "s"))
    return results


def _performance_results(name: str, performance: Performance) -> list[Result]:
    case, ratios = Case(stiffness=name, name="performance"), performance.highest[0]
    results = (
        [
            Result("lowest_ratio_reached", case, float(ratios[0]), ""),
            Result("highest_ratio_reached", case, float(ratios[-1]), ""),
        ]
        if len(ratios)
        else []
    )
    for branch in performance.branches:
        results += _lowest_of_branch(
            replace(case, branch=branch.name, mode=branch.mode), branch, performance
        )
    optimum = [
        ("optimum_ratio", ""),
        ("optimum_peak", "(m/s2)/N"),
        ("optimum_frequency", "Hz"),
        ("optimum_reduction", "%"),
    ]
    # Where a peak was lost, what is best beyond is not known.
    stopped = not all(branch.complete for branch in performance.branches)
    if performance.optimum is None or stopped:
        reason = _no_optimum(performance)
        return results + [withheld(number, case, unit, reason) for number, unit in optimum]
    ratio, frequency, height = performance.optimum
    values = (ratio, height, frequency, 100.0 * (1.0 - height / performance.free_peak))
    best = [
        Result(number, case, value, unit)
        for (number, unit), value in zip(optimum, values, strict=True)
    ]
    if not performance.sweeps:
        return results + best
    low, high = performance.optimum_heights
    between = performance.optimum_between
    left = [100.0 * (1.0 - one / performance.free_peak) for one in (high, low)]
    why = "the next F_C/F_E of the curve, and all at which a sweep is as low"
    best[0] = replace(best[0], low=between[0], high=between[1], why=why)
    if not alike_heights([low, high]):
        best[1] = replace(best[1], low=low, high=high, why=_NOT_ALIKE)
        best[3] = replace(best[3], low=left[0], high=left[1], why=_NOT_ALIKE)
    return results + best


def _lowest_of_branch(case: Case, branch: Branch, performance: Performance) -> list[Result]:
    """Lowest height of one peak over F_C/F_E; not the end of a branch that stopped on the way."""
    names = (
        ("lowest_peak", "(m/s2)/N"),
        ("lowest_peak_at_ratio", ""),
        ("lowest_peak_of_free", "%"),
    )
    k = int(branch.height.argmin()) if len(branch.ratio) else 0
    if not len(branch.ratio) or (not branch.complete and k == 0):
        at = f" at F_C/F_E {branch.ratio[0]:.3g}" if len(branch.ratio) else ""
        reason = f"the peak was lost{at} before it was lowest: {branch.message}"
        return [withheld(name, case, unit, reason) for name, unit in names]
    height = float(branch.height[k])
    values = (height, float(branch.ratio[k]), 100.0 * height / performance.free_peak)
    source = "" if branch.complete else f"down to F_C/F_E {branch.ratio[0]:.3g}, where it was lost"
    results = [
        Result(name, case, value, unit, source=source)
        for (name, unit), value in zip(names, values, strict=True)
    ]
    low = float(branch.least[k])
    if alike_heights([low, height]):
        return results
    ends = {
        "lowest_peak": (low, height),
        "lowest_peak_of_free": tuple(100.0 * v / performance.free_peak for v in (low, height)),
    }
    return [
        replace(one, low=ends[one.name][0], high=ends[one.name][1], why=_NOT_ALIKE)
        if one.name in ends
        else one
        for one in results
    ]


def _no_optimum(performance: Performance) -> str:
    ratios = performance.highest[0]
    lost = [
        f"{b.name} was lost"
        + (f" at F_C/F_E {b.ratio[0]:.3g}" if len(b.ratio) else "")
        + f" ({b.message})"
        for b in performance.branches
        if not b.complete
    ]
    if lost or not len(ratios):
        return "; ".join(lost) or "no F_C/F_E that every peak reaches"
    return (
        f"the highest peak is lowest at an end of F_C/F_E {ratios[0]:.3g} to {ratios[-1]:.3g}: "
        "widen performance.lowest and performance.highest"
    )
