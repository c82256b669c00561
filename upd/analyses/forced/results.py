"""ForcedSolution -> the flat list of numbers, beside what was printed and measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from upd.analyses import base
from upd.analyses.forced import measures
from upd.analyses.forced.again import limit_results, peak_results
from upd.analyses.forced.arrays import Contact, contact_of
from upd.analyses.forced.curves import ForcedCurve, Limit, faces_limit, point_limit
from upd.analyses.forced.measures import CurvePeak
from upd.analyses.forced.model import Array
from upd.analyses.forced.performance import mode_results, performance_results
from upd.analyses.forced.plan import ForcedPlan, excitation_of
from upd.analyses.forced.solve import ForcedSolution
from upd.analyses.measured import FREE, STUCK, Computed, measured_results
from upd.analyses.seated.results import RIGID
from upd.measured.compare import on_path
from upd.measured.curve import LEAST_POINTS
from upd.reference.printed import Lookup, Printed
from upd.results import Case, Result
from upd.results import quantities as q
from upd.results.quantities import quantity_of
from upd.scene.forced_contact import SIDES, Side
from upd.scene.measured import MeasuredChoice


def make_results(solution: ForcedSolution) -> list[Result]:
    """All numbers of a run."""
    results: list[Result] = []
    for name in (*solution.models, *solution.faces):
        results += _contact_results(solution, name)
    for name, linear in solution.linear.items():
        results += limit_results(name, linear)
    for curve in solution.curves:
        results += curve_results(solution, curve)
    results = _with_measured_peaks(solution, results)
    results += solution.band
    for name, performance in solution.performances.items():
        results += performance_results(name, performance)
    for curve_of_mode in solution.nonlinear_modes:
        results += mode_results(curve_of_mode)
    beside = partial(_computed, solution), partial(_nothing, solution)
    damping = solution.plan.scene.excitation.damping
    measured = measured_results(solution.plan.scene.measured, *beside, damping)
    return results + solution.effects + measured


def _contact_results(solution: ForcedSolution, name: str) -> Iterator[Result]:
    """Mass of the damper, points or nodes, stiffness of the faces, forces at rest beside those of a
    rigid damper in that state.
    """
    case, model, bodies = Case(stiffness=name), solution.models.get(name), solution.bodies
    assert bodies is not None
    state = solution.faces[name].state if model is None else model.state
    yield q.DAMPER_MASS.of((2.0 if bodies.half else 1.0) * bodies.damper.mass, case)
    yield q.CONTACT_POINTS.of(len(solution.places(name).face), case)
    if model is not None:
        law = model.contacts.law
        for k, side in enumerate(SIDES):
            on, face = model.face == k, replace(case, side=side)
            yield q.FACE_K_N.of(law.k_n[on].sum(), face)
            yield q.FACE_K_T.of(law.k_t[on].sum(), face)
    if state is None:
        return
    for k, side in enumerate(SIDES):
        at = replace(case, side=side, choice=state.name)
        for of, values, way in (
            (q.STATIC_N, state.N, "normal"),
            (q.STATIC_T, state.T, "tangential"),
        ):
            known = None if state.known is None else getattr(state.known, f"{way}_{side}")
            source = RIGID.get(state.name, "") if known is not None else ""
            yield of.of(values[k], at, known, source, exact=state.name != "seated")


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
            told = (linear.stuck_peaks if stuck else linear.free_peaks)[side]
            case = Case(stiffness=name, kind=choice.state, blade=side)
            band = (scene.excitation.start, scene.excitation.stop)
            read = partial(_limit(solution, name, stuck).accelerance, side)
            yield Computed(case, band, read, told)
        return
    # as the labels of curves tell them apart
    wanted = f"{choice.centrifugal_to_force:.6g}"
    for c in solution.curves:
        if f"{c.ratio:.6g}" == wanted and len(c.frequency) >= LEAST_POINTS:
            yield _with_friction(c, side)


def _limit(solution: ForcedSolution, name: str, stuck: bool) -> Limit:
    """Blades free or stuck, exact at any frequency."""
    plan, e = solution.plan, solution.plan.scene.excitation
    if name in solution.faces:
        return faces_limit(solution.faces[name].march, excitation_of(e), e.stop, stuck)
    return point_limit(plan, solution.models[name], stuck)


def _with_friction(c: ForcedCurve[Any], side: Side) -> Computed:
    """A curve with friction, between its points by straight lines."""
    f, H = c.frequency, c.accelerance[side]
    way = slice(None) if f[-1] > f[0] else slice(None, None, -1)
    f, H, band = f[way], H[way], (float(f.min()), float(f.max()))
    case = replace(c.case, blade=side)
    return Computed(case, band, lambda at: on_path(at, f, H), c.peaks.get(side, ()))


# -- numbers of curves -----------------------------------------------------------------------------


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
            for peak in curve.peaks.get(blade, ())
            for one in peak_results(case, peak, blade)
        ),
        *_not_reached(solution, curve),
        *(r for blade in SIDES[::-1] for r in _reduction(solution, curve, blade)),
        *_folds(curve),
        *_more_harmonics(curve),
    ]
    contact = None if curve.empty else contact_of(solution, curve)
    for peak in curve.peaks.get("right", ()):
        results.append(q.PEAK_MAC.of(peak.mac, replace(case, mode=peak.mode), n=peak.number))
        results += _at_peak(solution, curve, contact, peak)
    return results


def _at_peak(
    solution: ForcedSolution, curve: ForcedCurve[Any], contact: Contact | None, peak: CurvePeak
) -> Iterator[Result]:
    """The contact at a peak, its losses and the damper's motion; of a sweep whose last period is
    not kept the shares and losses of the whole.
    """
    answer, wants = curve.answer, solution.plan.scene.wants
    at = replace(curve.case, peak=peak.number, mode=peak.mode)
    places = {number: k for number, _, k in contact.at} if contact else {}
    if contact is None or peak.number not in places:
        lift, _, slip = answer.share[peak.sample]
        loss = answer.energy[peak.sample, 2]
    else:
        k = places[peak.number]
        slip, lift = contact.state[k, :, 1:].mean(axis=0)
        loss = contact.energy[k].sum()
        if contact.motion is not None and wants("damper_motion"):
            yield from motion_results(at, *(of[k] for of in contact.motion))
    yield q.CONTACT_SLIP.of(slip, at)
    yield q.CONTACT_LIFT.of(lift, at)
    yield q.FRICTION_ENERGY.of(loss, at)


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
    e, linear = solution.plan.scene.excitation, solution.linear.get(curve.stiffness)
    wanted = linear.stuck_peaks["right"] if linear else []
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


# -- numbers of peaks and of the damper's motion ---------------------------------------------------


def _with_measured_peaks(solution: ForcedSolution, results: Sequence[Result]) -> list[Result]:
    """The results with measured frequencies at the nearest peaks of the right blade's curves."""
    out, look_up = list(results), printed_of(solution.plan)
    curves: dict[Case, list[int]] = {}
    for k, one in enumerate(out):
        if not one.withheld and quantity_of(one.name)[0] == q.PEAK_FREQUENCY:
            curves.setdefault(replace(one.case, mode=""), []).append(k)
    for case, mine in curves.items():
        # under this name they are printed: which of a run's peaks each is stands nowhere
        for found in look_up(q.FREE_PEAK_FREQUENCY.name, case.given()):
            k = min(mine, key=lambda k: abs(out[k].value - found.value))
            out[k] = replace(out[k], reference=found.value, source=found.source, exact=False)
    return out


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
    scene, look_up = plan.scene, base.printed_of(plan.scene)
    ready = base.ready_scene(scene)
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
