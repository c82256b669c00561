"""ForcedSolution -> the flat list of numbers, beside the peaks printed in the thesis."""

from __future__ import annotations

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.model import SIDES, Array, Model
from upd.analyses.forced.performance import Performance
from upd.analyses.forced.solve import Case, ForcedSolution, Linear, Local
from upd.reference import THESIS_FREQUENCIES
from upd.results import Result

_FREE = (THESIS_FREQUENCIES["experiment_free"][0], "thesis, Table II")
#: arrangement -> measured peaks with the damper in Hz and their table; of the symmetric one only the second is printed
_WITH_DAMPER = {
    "symmetric": (THESIS_FREQUENCIES["experiment_symmetric"], "thesis, Table II"),
    "asymmetric": (THESIS_FREQUENCIES["experiment_asymmetric"], "thesis, Table III"),
}
_DAMPER = ("x", "y", "z")


def measured_peaks(arrangement: str) -> tuple[float, ...]:
    """Peaks in Hz measured with the damper, as printed in the thesis; none for another arrangement."""
    return _WITH_DAMPER.get(arrangement, ((), ""))[0]


#: the numbers that matter, most important first (shell patterns)
HEADLINE = ("peak_?_frequency", "peak_?_accelerance", "reduction_of_free_peak", "friction_energy", "optimum_ratio")


def make_results(solution: ForcedSolution) -> list[Result]:
    """All rows of a run."""
    rows: list[Result] = []
    for name, model in solution.models.items():
        rows += _model_rows(name, model)
        if name in solution.linear:
            rows += _linear_rows(name, solution.linear[name])
    for case in solution.cases:
        rows += _case_rows(solution, case)
    for case, f, height, steady in solution.marches:
        marched = steady.amplitude(solution.models[case.stiffness].row("right"))
        value = 1e-3 * (2 * np.pi * f) ** 2 * marched / case.force
        rows.append(Result("time_march_accelerance", f"{case.label}, {f:g} Hz", value, "(m/s2)/N", height, "harmonic balance", exact=False))
    for name, spread in solution.spreads.items():
        rows += _spread_rows(name, spread)
    for name, found in solution.harmonics.items():
        rows += _harmonics_rows(name, found)
    for name, curve in solution.performances.items():
        rows += _performance_rows(name, curve)
    return rows


def _model_rows(name: str, model: Model) -> list[Result]:
    rows = [
        Result("damper_mass", name, 1e6 * model.damper.mass, "g"),
        Result("contact_points", name, float(model.contacts.n_point), ""),
    ]
    for k, side in enumerate(SIDES):
        on = model.face == k
        law = model.contacts.law
        rows += [Result("face_K_N", f"{name}, {side}", float(law.k_n[on].sum()), "N/mm")]
        rows += [Result("face_K_T", f"{name}, {side}", float(law.k_t[on].sum()), "N/mm")]
    return rows


def _linear_rows(name: str, linear: Linear) -> list[Result]:
    rows = []
    phase = {True: "in_phase", False: "out_of_phase"}
    for in_phase in (True, False):
        found = next((m for m in linear.modes if m.axis == "x" and m.in_phase == in_phase), None)
        if found is not None:
            rows.append(Result(f"stuck_{phase[in_phase]}", name, found.frequency, "Hz"))
    rows += _peaks(f"{name}, free", linear.frequency, np.abs(linear.free["right"]), (_FREE[0],), _FREE[1])
    return rows + _peaks(f"{name}, stuck", linear.frequency, np.abs(linear.stuck["right"]), (), "")


def _peaks(case: str, frequency: Array, magnitude: Array, printed: tuple[float, ...], table: str) -> list[Result]:
    """Peaks of the right blade; printed frequencies go to the nearest of them, each once."""
    peaks = measures.path_peaks(frequency, magnitude)
    nearest = {int(np.argmin([abs(peak.frequency - p) for peak in peaks])): p for p in printed} if peaks else {}
    rows = []
    for k, (f, height, _) in enumerate(peaks):
        reference = nearest.get(k)
        rows.append(Result(f"peak_{k + 1}_frequency", case, f, "Hz", reference, table if reference else "", exact=False))
        rows.append(Result(f"peak_{k + 1}_accelerance", case, height, "(m/s2)/N"))
    return rows


def _case_rows(solution: ForcedSolution, case: Case) -> list[Result]:
    answer, model = case.answer, solution.models[case.stiffness]
    rows = [
        Result("excitation_force", case.label, case.force, "N"),
        Result("path_points", case.label, float(len(answer.frequency)), ""),
        Result("curve_seconds", case.label, case.seconds, "s"),
    ]
    if case.empty:
        return rows
    printed, table = _WITH_DAMPER.get(solution.plan.scene.arrangement, ((), ""))
    rows += _peaks(case.label, answer.frequency, np.abs(case.accelerance["right"]), printed, table)
    linear = solution.linear[case.stiffness]
    free = measures.path_peaks(linear.frequency, np.abs(linear.free["right"]))
    # only where the sweep holds the free peak
    if free:
        left = float(np.abs(case.accelerance["right"]).max()) / max(peak.height for peak in free)
        rows.append(Result("reduction_of_free_peak", case.label, 100.0 * (1.0 - left), "%"))
    for label, i in measures.at_peaks(answer, case.accelerance["right"]):
        rows += _at_point(solution, case, model, f"{case.label}, {label}", i)
    return rows


def _at_point(solution: ForcedSolution, case: Case, model: Model, at: str, i: int) -> list[Result]:
    """Contact state, losses and damper motion at point i of the path."""
    scene, answer, rows = solution.plan.scene, case.answer, []
    for side, N in measures.static_normal(answer, model, i).items():
        rows.append(Result("static_normal", f"{at}, {side}", N, "N"))
    if scene.wants("contact_state"):
        for side, share in measures.shares(answer, model).items():
            for name, value in zip(("stick", "slip", "lift"), share[i], strict=True):
                rows.append(Result(f"share_{name}", f"{at}, {side}", 100.0 * float(value), "%"))
        # Their mean traction remembers where the sliders began.
        stuck = int((answer.state[i, :, 0] == 1.0).sum())
        rows.append(Result("points_always_stuck", at, float(stuck), ""))
    if scene.wants("hysteresis"):
        rows.append(Result("friction_energy", at, float(answer.energy[i].sum()), "N mm"))
        rows.append(Result("friction_power", at, 1e3 * float(measures.power(answer)[i].sum()), "mW"))
    if scene.wants("damper_motion"):
        rows += _motion_rows(at, *measures.damper_motion(answer, model, i))
    return rows


def _motion_rows(case: str, static: Array, amplitude: Array) -> list[Result]:
    rows, names = [], [f"damper_{kind}{axis}" for kind in "ur" for axis in _DAMPER]
    both = np.maximum(np.abs(static), np.abs(amplitude))
    # motions that symmetry forbids are rounding
    least = np.repeat([both[:3].max(), both[3:].max()], 3) * np.sqrt(np.finfo(float).eps)
    for part, values in (("", amplitude), ("_static", static)):
        shown = np.flatnonzero(np.abs(values) > least)
        rows += [Result(f"{names[k]}{part}", case, 1e3 * float(values[k]), "um" if k < 3 else "mrad") for k in shown]
    return rows


def _spread_rows(name: str, found: list[Local]) -> list[Result]:
    good = [one for one in found if np.isfinite(one.height)]
    rows = [Result("spread_peak", f"{name}, {one.choice}", one.height, "(m/s2)/N") for one in good]
    rows += [Result("spread_starts_not_solved", name, float(len(found) - len(good)), "")]
    if len(good) > 1:
        heights = np.array([one.height for one in good])
        rows.append(Result("spread_of_peak", name, 100.0 * float(np.ptp(heights) / heights.mean()), "%"))
        rows.append(Result("spread_of_peak_frequency", name, float(np.ptp([one.frequency for one in good])), "Hz"))
    return rows


def _harmonics_rows(name: str, found: list[Local]) -> list[Result]:
    best = next((one for one in reversed(found) if np.isfinite(one.height)), None)
    rows = []
    for one in found:
        case = f"{name}, {one.choice} harmonic{'s' * (one.choice != '1')}"
        if best is not None and np.isfinite(one.height):
            source = f"{best.choice} harmonics"
            rows.append(Result("harmonics_peak", case, one.height, "(m/s2)/N", best.height, source, exact=False))
            rows.append(Result("harmonics_frequency", case, one.frequency, "Hz", best.frequency, source, exact=False))
        rows.append(Result("harmonics_truncation", case, 100.0 * one.truncation, "%"))
        rows.append(Result("harmonics_seconds", case, one.seconds, "s"))
    return rows


def _performance_rows(name: str, curve: Performance) -> list[Result]:
    case, ratios = f"{name}, performance", curve.highest[0]
    rows = (
        [Result("lowest_ratio_reached", case, float(ratios[0]), ""), Result("highest_ratio_reached", case, float(ratios[-1]), "")]
        if len(ratios)
        else []
    )
    for branch in (b for b in curve.branches if len(b.ratio)):
        k = int(branch.height.argmin())
        at = f"{case}, {branch.name}"
        rows.append(Result("lowest_peak", at, float(branch.height[k]), "(m/s2)/N"))
        rows.append(Result("lowest_peak_at_ratio", at, float(branch.ratio[k]), ""))
        rows.append(Result("lowest_peak_of_free", at, 100.0 * float(branch.height[k]) / curve.free_peak, "%"))
    if curve.optimum is None:
        return rows
    ratio, frequency, height = curve.optimum
    rows += [Result("optimum_ratio", case, ratio, ""), Result("optimum_peak", case, height, "(m/s2)/N")]
    rows += [Result("optimum_frequency", case, frequency, "Hz")]
    return [*rows, Result("optimum_reduction", case, 100.0 * (1.0 - height / curve.free_peak), "%")]
