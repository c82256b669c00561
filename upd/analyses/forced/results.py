"""ForcedSolution -> the flat list of numbers, beside the peaks that were measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from upd.analyses.forced.compared import measured_results
from upd.analyses.forced.curve_results import balanced_results, curve_results
from upd.analyses.forced.curves import LinearCurves, WholeFaces
from upd.analyses.forced.mode_peaks import unmoved
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.peak_results import left_peak_results, peak_results
from upd.analyses.forced.performance_results import performance_results
from upd.analyses.forced.solution import AS_RUN, CurveBand, ForcedSolution, PeakAgain
from upd.analyses.forced.statics import StaticState
from upd.analyses.forced.swept_results import swept_results
from upd.results import Case, Result
from upd.scene.forced_contact import SIDES

#: a rigid damper in the same static state; of the seated one, as far as friction can oppose F_C
_SAID = {
    "seated": "rigid damper, full friction against F_C",
    "opposing": "rigid damper, full friction against F_C",
    "reversed": "rigid damper, full friction along F_C",
    "frictionless": "rigid damper without friction",
}


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
        results += curve_results(solution, curve)
    for one in solution.balanced:
        results += balanced_results(solution, one)
    for name, ratio in dict.fromkeys((s.stiffness, s.ratio) for s in solution.sweeps):
        results += swept_results(solution, name, ratio)
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
        results += performance_results(name, performance)
    return results + measured_results(solution)


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
        Result("damper_mass", case, 1e6 * solution.plan.copies * solution.bodies.damper.mass, "g"),
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
        results += peak_results(solution, replace(case, kind=kind), told)
    # Without a damper a blade that is not excited, on a base of its own, stays at rest.
    results += left_peak_results(replace(case, kind="free"), unmoved(linear.free_peaks["left"]))
    return results + left_peak_results(
        replace(case, kind="stuck"), solution.stuck_peaks(name, "left")
    )


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
