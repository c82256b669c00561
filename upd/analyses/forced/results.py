"""ForcedSolution -> the flat list of numbers, beside the peaks that were measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from upd.analyses import measured
from upd.analyses.forced import measures
from upd.analyses.forced.curve_results import (
    balanced_results,
    curve_results,
    peak_results,
    swept_results,
)
from upd.analyses.forced.curves import FrictionCurve, LinearCurves, WholeFaces
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.inputs import InputEffect
from upd.analyses.forced.linear_limits import linear_curves
from upd.analyses.forced.mode_peaks import unmoved
from upd.analyses.forced.model import Array, ComplexArray, Model
from upd.analyses.forced.paths import balance_of
from upd.analyses.forced.performance import Performance
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.statics import StaticState
from upd.analyses.measured import FREE, STUCK, Computed
from upd.measured.compare import on_path
from upd.measured.curve import LEAST_POINTS
from upd.results import Case, Result, withheld
from upd.scene.forced_contact import SIDES, Side
from upd.scene.measured import MeasuredChoice

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
    for sweep in solution.sweeps:
        results += swept_results(solution, sweep)
    results += _band_results(solution)
    for name, performance in solution.performances.items():
        results += _performance_results(name, performance)
    for name, effects in solution.effects.items():
        results += _input_results(solution, name, effects)
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


def _band_results(solution: ForcedSolution) -> list[Result]:
    """Peaks of the right blade from other static states and slider starts."""
    return [
        Result(f"band_peak_{p.number}_{kind}", case, value, unit)
        for one in solution.band
        for p in one.point.peaks
        if p.blade == "right"
        for case in (
            Case(
                stiffness=one.stiffness,
                force_ratio=one.point.ratio,
                mode=p.mode,
                choice=one.choice,
            ),
        )
        for kind, value, unit in (
            ("frequency", p.frequency, "Hz"),
            ("accelerance", p.height, "(m/s2)/N"),
        )
    ]


def _linear_results(solution: ForcedSolution, name: str, linear: LinearCurves) -> list[Result]:
    results, case = [], Case(stiffness=name)
    phase = {True: "in_phase", False: "out_of_phase"}
    for in_phase in (True, False):
        found = next((m for m in linear.modes if m.axis == "x" and m.in_phase == in_phase), None)
        if found is not None:
            results.append(Result(f"stuck_{phase[in_phase]}", case, found.frequency, "Hz"))
    # Without a damper a blade that is not excited, on a base of its own, stays at rest.
    for blade in SIDES[::-1]:
        for kind, peaks in (
            ("free", unmoved(linear.free_peaks[blade])),
            ("stuck", solution.stuck_peaks(name, blade)),
        ):
            results += peak_results(solution, replace(case, kind=kind), peaks, blade)
    return results


def _performance_results(name: str, found: Performance) -> list[Result]:
    """F_C/F_E reached, the best one with its highest peak, and what a factor 2 costs."""
    case, known = Case(stiffness=name, name="performance"), found.known
    results = []
    if known:
        results = [
            Result("lowest_ratio_reached", case, known[0].ratio, ""),
            Result("highest_ratio_reached", case, known[-1].ratio, ""),
        ]
    best, twice = found.best, found.factor_two()
    names = (
        ("best_ratio", ""),
        ("best_peak", "(m/s2)/N"),
        ("best_frequency", "Hz"),
        ("best_reduction", "%"),
        ("half_of_best_ratio", "%"),
        ("twice_the_best_ratio", "%"),
    )
    if best is None or best.worst is None or twice is None:
        reason = "no curve has a peak: widen excitation.start and stop"
        return results + [withheld(number, case, unit, reason) for number, unit in names]
    results.append(Result("best_inside", case, float(found.inside), ""))
    worst = best.worst
    at = replace(case, mode=worst.mode, blade=worst.blade)
    values = (
        best.ratio,
        worst.height,
        worst.frequency,
        100.0 * (1.0 - worst.height / found.free),
        *(100.0 * (one - 1.0) for one in twice),
    )
    return results + [
        Result(number, at, value, unit)
        for (number, unit), value in zip(names, values, strict=True)
        if np.isfinite(value)
    ]


def _input_results(
    solution: ForcedSolution, name: str, effects: Sequence[InputEffect]
) -> list[Result]:
    """Change of a peak by each end of each input."""
    curves = [c for c in solution.curves if c.stiffness == name and not c.empty]
    if not curves:
        return []
    ratio, out = min(c.ratio for c in curves), []
    for one in effects:
        case = Case(
            stiffness=name, force_ratio=ratio, mode=one.mode, choice=f"{one.name}: {one.label}"
        )
        for kind, value in (("frequency", one.frequency), ("accelerance", one.height)):
            number = f"peak_{one.number}_{kind}_change"
            # without such a peak near there is no change to tell
            if np.isfinite(value):
                out.append(Result(number, case, 100.0 * value, "%"))
    return out


def measured_results(solution: ForcedSolution) -> list[Result]:
    """Every measured curve beside the computed ones of its blade and state."""
    scene = solution.plan.scene
    return measured.measured_results(
        scene.measured,
        lambda choice: list(_computed(solution, choice)),
        lambda choice: _nothing(solution, choice),
        scene.excitation.damping,
    )


def _nothing(solution: ForcedSolution, choice: MeasuredChoice) -> str:
    """Why nothing stands beside a measured curve."""
    if choice.state is not None:
        return (
            f"the {choice.blade} blade is at rest without the damper"
            if choice.state == FREE
            else "the run has no stuck curve"
        )
    ratios = ", ".join(f"{r:g}" for r in solution.plan.scene.excitation.centrifugal_to_force)
    return (
        f"the run has no curve at F_C/F_E {choice.centrifugal_to_force:g}, it has {ratios}; add it "
        "to excitation.centrifugal_to_force"
    )


def _computed(solution: ForcedSolution, choice: MeasuredChoice) -> Iterator[Computed]:
    """The computed curves of the blade and state of a measured one."""
    side, scene = choice.blade, solution.plan.scene
    if choice.state is not None:
        stuck = choice.state == STUCK
        if not stuck and side not in excitation_of(scene.excitation).free_blades:
            return
        for name, linear in solution.linear.items():
            told = solution.stuck_peaks(name, side) if stuck else unmoved(linear.free_peaks[side])
            case = Case(stiffness=name, kind=choice.state, blade=side)
            band = (scene.excitation.start, scene.excitation.stop)
            yield Computed(case, band, _linear_at(solution, name, side, stuck), told)
        return
    curves: list[FrictionCurve] = [*solution.curves, *solution.balanced, *solution.sweeps]
    # as the labels of curves tell them apart
    wanted = f"{choice.centrifugal_to_force:.6g}"
    for c in curves:
        if f"{c.ratio:.6g}" == wanted and len(c.frequency) >= LEAST_POINTS:
            yield _with_friction(c, side)


def _linear_at(
    solution: ForcedSolution, name: str, side: Side, stuck: bool
) -> Callable[[Array], ComplexArray]:
    """Accelerance of a blade free or stuck, exact at any frequency."""
    if name in solution.faces:
        excitation = excitation_of(solution.plan.scene.excitation)
        march = solution.faces[name].march
        return lambda f: np.asarray(linear_curves(march, f, excitation, stuck=stuck)[0][side])
    model, plan = solution.models[name], solution.plan
    force = plan.scene.damper.centrifugal
    numbers = (0, *model.excitation.harmonics)
    problem, row = measures.Unsolved(balance_of(plan, model, force, numbers)), model.row(side)
    return lambda f: measures.linear_accelerance(problem, row, force, f, stuck)


def _with_friction(c: FrictionCurve, side: Side) -> Computed:
    """A curve with friction, between its points by straight lines."""
    f, H = c.frequency, c.accelerance[side]
    way = slice(None) if f[-1] > f[0] else slice(None, None, -1)
    f, H = f[way], H[way]
    peaks = c.peaks.get(side, ())
    return Computed(
        replace(c.case, blade=side),
        (float(f.min()), float(f.max())),
        lambda at: on_path(at, f, H),
        list(peaks),
    )
