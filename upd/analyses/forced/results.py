"""ForcedSolution -> the flat list of numbers, beside the peaks that were measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from upd.analyses import measured
from upd.analyses.forced import measures
from upd.analyses.forced.curve_results import curve_results, peak_results
from upd.analyses.forced.curves import ForcedCurve, LinearCurves, WholeFaces
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.inputs import InputEffect
from upd.analyses.forced.linear_limits import linear_curves
from upd.analyses.forced.mode_peaks import unmoved
from upd.analyses.forced.model import Array, ComplexArray, Model
from upd.analyses.forced.paths import balance_of
from upd.analyses.forced.performance import performance_results
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.statics import StaticState
from upd.analyses.measured import FREE, STUCK, Computed
from upd.analyses.seated.results import RIGID
from upd.measured.compare import on_path
from upd.measured.curve import LEAST_POINTS
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene.forced_contact import SIDES, Side
from upd.scene.measured import MeasuredChoice


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
    results += _band_results(solution)
    for name, performance in solution.performances.items():
        results += performance_results(name, performance)
    for effects in solution.effects.values():
        results += _input_results(effects)
    return results + measured_results(solution)


def _model_results(name: str, model: Model) -> list[Result]:
    case, law = Case(stiffness=name), model.contacts.law
    results = [
        q.DAMPER_MASS.of(model.damper.mass, case),
        q.CONTACT_POINTS.of(model.contacts.n_point, case),
    ]
    for k, side in enumerate(SIDES):
        on, face = model.face == k, replace(case, side=side)
        results += [q.FACE_K_N.of(law.k_n[on].sum(), face), q.FACE_K_T.of(law.k_t[on].sum(), face)]
    return results + _static_results(case, model)


def _faces_results(solution: ForcedSolution, name: str, faces: WholeFaces) -> list[Result]:
    """Mass of the damper, nodes, forces at rest."""
    case = Case(stiffness=name)
    assert solution.bodies is not None
    return [
        q.DAMPER_MASS.of(solution.plan.copies * solution.bodies.damper.mass, case),
        q.CONTACT_POINTS.of(faces.of.n, case),
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
        at = replace(case, side=side, choice=state.name)
        for quantity, values, way in ((q.STATIC_N, N, "normal"), (q.STATIC_T, T, "tangential")):
            known = None if state.known is None else getattr(state.known, f"{way}_{side}")
            source = RIGID.get(state.name, "") if known is not None else ""
            exact = state.name != "seated"
            results.append(quantity.of(values[k], at, known, source, exact=exact))
    return results


def _band_results(solution: ForcedSolution) -> list[Result]:
    """Peaks of the right blade from other static states and slider starts."""
    return [
        quantity.of(value, case, n=p.number)
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
        for quantity, value in ((q.BAND_FREQUENCY, p.frequency), (q.BAND_ACCELERANCE, p.height))
    ]


def _linear_results(solution: ForcedSolution, name: str, linear: LinearCurves) -> list[Result]:
    results, case = [], Case(stiffness=name)
    for in_phase, quantity in ((True, q.STUCK_IN_PHASE), (False, q.STUCK_OUT_OF_PHASE)):
        found = next((m for m in linear.modes if m.axis == "x" and m.in_phase == in_phase), None)
        if found is not None:
            results.append(quantity.of(found.frequency, case))
    # Without a damper a blade that is not excited, on a base of its own, stays at rest.
    for blade in SIDES[::-1]:
        for kind, peaks in (
            ("free", unmoved(linear.free_peaks[blade])),
            ("stuck", solution.stuck_peaks(name, blade)),
        ):
            results += peak_results(solution, replace(case, kind=kind), peaks, blade)
    return results


def _input_results(effects: Sequence[InputEffect]) -> list[Result]:
    """Change of a peak by each end of each input."""
    # without such a peak near there is no change to report
    return [
        quantity.of(value, replace(one.case, choice=f"{one.name}: {one.label}"), n=one.number)
        for one in effects
        for quantity, value in (
            (q.FREQUENCY_CHANGE, one.frequency),
            (q.ACCELERANCE_CHANGE, one.height),
        )
        if np.isfinite(value)
    ]


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
    # as the labels of curves tell them apart
    wanted = f"{choice.centrifugal_to_force:.6g}"
    for c in solution.curves:
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
    problem, row = balance_of(plan, model, force, numbers), model.row(side)
    return lambda f: measures.linear_accelerance(problem, row, force, f, stuck)


def _with_friction(c: ForcedCurve[Any], side: Side) -> Computed:
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
