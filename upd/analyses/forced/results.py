"""ForcedSolution -> the flat list of numbers, beside what was printed and measured, and all arrays
for result.nc: curves, linear limits, contact points, states, energies, loops, peaks over F_C/F_E.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from upd.analyses import base, measured
from upd.analyses.forced import measures, performance
from upd.analyses.forced.again import limit_results, peak_results
from upd.analyses.forced.curves import (
    ForcedCurve,
    LinearCurves,
    faces_limit,
    point_limit,
    rising,
)
from upd.analyses.forced.measures import Loop
from upd.analyses.forced.model import Array
from upd.analyses.forced.plan import ForcedPlan, excitation_of
from upd.analyses.forced.solve import ContactPlaces, ForcedSolution, marched_damper, marched_loops
from upd.analyses.measured import FREE, STUCK, Computed, CurvePeak, accelerance_array
from upd.analyses.seated.bodies import RIGID
from upd.hbm import FrequencyResponse
from upd.hbm.faces.balance import InterfaceResponse
from upd.measured.compare import on_path
from upd.measured.curve import LEAST_POINTS
from upd.reference.printed import Lookup, Printed
from upd.results import Case, Group, Result, variable
from upd.results import quantities as q
from upd.results.quantities import quantity_of
from upd.scene.forced_contact import SIDES, Side
from upd.scene.measured import MeasuredChoice

Variables = dict[str, Any]
#: what the groups of result.nc hold, their attribute ``content``
POINTS, LINEAR, FRICTION = "points", "linear", "friction"
PERFORMANCE, SWEEP, MARCHED = "performance", "sweep", "marched peaks"
MODES = "nonlinear mode"
#: loops kept of a peak
N_LOOPS = 4


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
    for name, found in solution.performances.items():
        results += performance.performance_results(name, found)
    for mode in solution.nonlinear_modes:
        results += performance.mode_results(*mode)
    scene, beside = solution.plan.scene, (partial(_computed, solution), partial(_nothing, solution))
    results += solution.effects
    return results + measured.measured_results(scene.measured, *beside, scene.excitation.damping)


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
    """The computed curves of the blade and state of a measured one: linear limits, or with friction
    between their points by straight lines.
    """
    side, e, stuck = choice.blade, solution.plan.scene.excitation, choice.state == STUCK
    excitation = excitation_of(e)
    moves = stuck or (choice.state == FREE and side in excitation.free_blades)
    for name, linear in solution.linear.items() if moves else ():
        peaks = (linear.stuck_peaks if stuck else linear.free_peaks)[side]
        case = Case(stiffness=name, kind=choice.state or "", blade=side)
        if name in solution.faces:
            limit = faces_limit(solution.faces[name].march, excitation, e.stop, stuck)
        else:
            limit = point_limit(solution.plan, solution.models[name], stuck)
        yield Computed(case, (e.start, e.stop), partial(limit.accelerance, side), peaks)
    # as the labels of curves tell them apart
    wanted = "" if choice.state else f"{choice.centrifugal_to_force:.6g}"
    for c in solution.curves:
        if f"{c.ratio:.6g}" == wanted and len(c.frequency) >= LEAST_POINTS:
            way = slice(None) if c.frequency[-1] > c.frequency[0] else slice(None, None, -1)
            f, H = c.frequency[way], c.accelerance[side][way]
            band, case = (float(f.min()), float(f.max())), replace(c.case, blade=side)
            read = partial(on_path, frequency=f, values=H)
            yield Computed(case, band, read, c.peaks.get(side, ()))


# -- the contact ----------------------------------------------------------------------------------


class Contact(NamedTuple):
    """What the contact does at n points of a curve, whichever way that was found.

    Attributes
    ----------
    at
        Number, mode and place of the peaks among the points.
    frequency
        (n,) Hz.
    state, energy
        (n, n_point, 3) shares of the cycle in stick, slip and open; (n, n_point) losses in a cycle,
        N mm.
    motion
        (n, 6) of the damper, mean and amplitude, mm and rad; None where it is not kept.
    loops
        Number of a peak, and a loop; read once.
    """

    at: Sequence[tuple[int, str, int]]
    frequency: Array
    state: Array
    energy: Array
    motion: Sequence[Array] | Array | None = None
    loops: Iterable[tuple[int, Loop]] = ()


def contact_of(solution: ForcedSolution, curve: ForcedCurve[Any]) -> Contact | None:
    """At all points of a path, at the peaks of a sweep whose last periods are kept; else None."""
    a, f = curve.answer, curve.frequency
    if isinstance(a, FrequencyResponse):
        at, model = solution.marked_points(curve), solution.models[curve.stiffness]
        motion = measures.damper_motion(a, model)
        loops = ((k, one) for k, _, i in at for one in measures.loops(a, i, N_LOOPS))
        return Contact(at, f, a.state, a.energy, motion, loops)
    if isinstance(a, InterfaceResponse):
        state = np.array([one.nodes for one in a.points])[:, :, [1, 2, 0]]
        loss = np.array([one.loss for one in a.points])
        return Contact(solution.marked_points(curve), f, state, loss)
    peaks = [one for one in curve.peaks["right"] if one.number in curve.periods]
    if not peaks:
        return None
    periods = [curve.periods[one.number] for one in peaks]
    return Contact(
        [(one.number, one.mode, i) for i, one in enumerate(peaks)],
        f[[one.sample for one in peaks]],
        np.array([one.share for one in periods]),
        # of a half model each node stands for its image too
        np.array([one.copies * one.loss for one in periods]),
        np.stack([marched_damper(solution, curve, one) for one in periods], axis=1),
        (
            (one.number, loop)
            for one in peaks
            for loop in marched_loops(solution, curve, curve.periods[one.number], N_LOOPS)
        ),
    )


# -- numbers of curves -----------------------------------------------------------------------------


#: by how much lower than the peak a sweep ends that is reported
_LOWER = 0.01


def _more_harmonics(curve: ForcedCurve[Any]) -> Iterator[Result]:
    """Highest points in the harmonics beside the one that is read, which has the numbered peaks."""
    for k, H in curve.more.items() if not curve.empty else ():
        for blade in SIDES[::-1]:
            f, size = curve.frequency, np.abs(H[blade])
            i = int(size.argmax())
            tops = measures.path_maxima(f, size) or [CurvePeak(float(f[i]), float(size[i]), i)]
            at, height, *_ = max(tops, key=lambda top: top.height)
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
            (end, top)
            for end, top in curve.folds
            if end.height < top.height < (1.0 - _LOWER) * peak.height
            and min(peaks, key=lambda one: abs(one.frequency - end.frequency)) is peak
        ]
        if jumps:
            _, top = max(jumps, key=lambda one: one[1].height - one[0].height)
            case = replace(curve.case, mode=peak.mode)
            yield q.SWEEP_UP_FREQUENCY.of(top.frequency, case, n=peak.number)
            yield q.SWEEP_UP_ACCELERANCE.of(top.height, case, n=peak.number)


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
        for value, source in look_up(q.FREE_PEAK_FREQUENCY.name, case.given()):
            k = min(mine, key=lambda k: abs(out[k].value - value))
            out[k] = replace(out[k], reference=value, source=source, exact=False)
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


# -- arrays ----------------------------------------------------------------------------------------


def arrays(solution: ForcedSolution) -> dict[str, Group]:
    """Arrays for result.nc.

    Returns
    -------
    dict
        Group -> variable -> (dimensions, array, attributes). Contents: "points" and "linear" of
        every stiffness, "friction" of every curve, "sweep" and "marched peaks" of every sweep (the
        latter what the contact does at its peaks), "performance", every "nonlinear mode", and every
        "measured curve".
    """
    scene, found = solution.plan.scene, list[tuple[str, Case, Variables]]()
    for name in (*solution.models, *(solution.faces if scene.wants("contact_state") else ())):
        found.append((POINTS, Case(stiffness=name), _points(solution, name)))
    for name, linear in solution.linear.items():
        found.append((LINEAR, Case(stiffness=name), _linear_arrays(solution, linear)))
    for curve in (c for c in solution.curves if not c.empty):
        contact, peaks = contact_of(solution, curve), _curve_arrays(curve)
        behind = {} if contact is None else _contact_arrays(solution, curve, contact)
        if not curve.way:
            found.append((FRICTION, curve.case, peaks | behind))
            continue
        found.append((SWEEP, curve.case, peaks))
        if contact is not None:
            behind["frequency"] = variable("frequency", contact.frequency, "Hz")
            found.append((MARCHED, curve.case, behind))
    for name, one in solution.performances.items():
        found.append((PERFORMANCE, Case(stiffness=name), performance.performance_arrays(one)))
    for mode in solution.nonlinear_modes:
        found.append((MODES, *mode))
    out = {
        f"{content} {case}": Group(variables, content=content, case=case)
        for content, case, variables in found
    }
    return out | (measured.measured_arrays(scene.measured) if out else {})


def _points(solution: ForcedSolution, name: str) -> Variables:
    """Where contact points or nodes of whole faces lie, in space and in the frames of their faces;
    their stiffness, or areas.
    """
    at, low = "contact_point", "place up the slope, from the lowest point of the face"
    places, model = solution.places(name), solution.models.get(name)
    position = solution.faces[name].of.position if model is None else model.position
    out: Variables = {
        "position": variable(f"{at} component", position, "mm"),
        "face": variable(at, places.face, flag_meanings="left right"),
        "along": variable(at, places.along, "mm", "place along the damper"),
        "up": variable(at, places.up, "mm", low),
    }
    if model is None:
        return out | {"area": variable(at, places.weight, "mm2")}
    law = model.contacts.law
    return out | {"k_n": variable(at, law.k_n, "N/mm"), "k_t": variable(at, law.k_t, "N/mm")}


def _curve_arrays(curve: ForcedCurve[Any]) -> Variables:
    """A curve: accelerance of both blades in every harmonic that is excited, its peaks, and what
    its method alone knows.
    """
    a, on = curve.answer, "frequency"
    out: Variables = {
        "frequency": variable(on, curve.frequency, "Hz", status=a.status, message=a.message),
        "excitation_force": variable("", curve.force, "N"),
    }
    for side in SIDES:
        out[f"accelerance_{side}"] = accelerance_array(curve.accelerance[side])
        for k, H in curve.more.items():
            out[f"accelerance_{side}_harmonic_{k}"] = accelerance_array(H[side])
        if peaks := curve.peaks[side]:
            at, height = f"peak_{side}", [one.height for one in peaks]
            out[f"peak_frequency_{side}"] = variable(at, [one.frequency for one in peaks], "Hz")
            out[f"peak_accelerance_{side}"] = variable(at, height, "(m/s2)/N")
    if isinstance(a, FrequencyResponse):
        words = "0 between two folds, where the frequency falls"
        return out | {"stable": variable(on, rising(curve.frequency).astype(np.int8), "1", words)}
    if isinstance(a, InterfaceResponse):
        jumped = np.zeros(len(curve.frequency), np.int8)
        jumped[list(a.jumps)] = 1
        words = "whether the motion jumps to another after this point"
        return out | {"jump": variable(on, jumped, "1", words)}
    states = "stick slip lift, mean over all points of both faces"
    kinds = "work of the excitation, lost by damping, by friction"
    return out | {
        "share": variable(f"{on} state", a.share[:, [1, 2, 0]], "1", state=states),
        "energy": variable(f"{on} kind", a.energy, "N mm", kind=kinds),
        "settled": variable(on, a.settled.astype(np.int8), "1"),
    }


def _contact_arrays(
    solution: ForcedSolution, curve: ForcedCurve[Any], contact: Contact
) -> Variables:
    """What the contact does at points of a curve, as far as it is wanted."""
    scene, places = solution.plan.scene, solution.places(curve.stiffness)
    on, energy = "frequency contact_point", contact.energy
    states, modes = "stick slip lift, shares of the cycle", [mode for _, mode, _ in contact.at]
    out: Variables = {
        "excitation_force": variable("", curve.force, "N"),
        "state": variable(f"{on} state", contact.state, "1", state=states),
        "energy": variable(on, energy, "N mm", "friction loss per cycle"),
        "power": variable(on, 1e-3 * energy * contact.frequency[:, None], "W"),
        "peak": variable(
            "peak",
            [number for number, *_ in contact.at],
            long_name="number of the peak's mode; 0 is the highest point of a curve without",
            # which mode each is, in the same order
            modes=", ".join(modes),
        ),
        "peak_index": variable(
            "peak", [i for *_, i in contact.at], "", "place of the peak in frequency, from 0"
        ),
    }
    if scene.wants("contact_state"):
        share = measures.face_shares(contact.state, places.face, places.weight)
        words = "stick slip lift, mean over the face by stiffness, or area without springs"
        out["share"] = variable(
            "frequency side state", share, "1", side=" ".join(SIDES), state=words
        )
    if contact.motion is not None and scene.wants("damper_motion"):
        k = excitation_of(scene.excitation).lowest
        words = f"amplitude of {'the first harmonic' if k == 1 else f'harmonic {k}'}"
        out["damper_amplitude"] = variable(
            "frequency damper_dof", contact.motion[1], "mm, rad", words
        )
    loops = list(contact.loops) if scene.wants("hysteresis") else []
    return out | (_loop_arrays(loops, places) if loops else {})


def _loop_arrays(found: Sequence[tuple[int, Loop]], places: ContactPlaces) -> Variables:
    """Hysteresis loops at peaks, each with the number of its peak, and what tells them apart: the
    point's face and place, the loss.
    """
    loops = [one for _, one in found]
    point = np.array([one.point for one in loops])
    return {
        "loop_point": variable("loop", point, "", "contact point of each loop"),
        "loop_displacement": variable("loop sample", [one.displacement for one in loops], "mm"),
        "loop_traction": variable("loop sample", [one.traction for one in loops], "N"),
        "loop_limit": variable("loop sample", [one.limit for one in loops], "N"),
        "loop_peak": variable("loop", [number for number, _ in found], "", "number of the peak"),
        "loop_side": variable("loop", places.face[point], flag_meanings="left right"),
        "loop_along": variable("loop", places.along[point], "mm", "place along the damper"),
        "loop_up": variable("loop", places.up[point], "mm", "place up the slope"),
        "loop_energy": variable("loop", [one.energy for one in loops], "N mm", "loss per cycle"),
    }


def _linear_arrays(solution: ForcedSolution, linear: LinearCurves) -> Variables:
    """Accelerance of both blades free and stuck, the damping."""
    choice = solution.plan.scene.excitation
    excited = excitation_of(choice).words
    out: Variables = {
        "frequency": variable("frequency", linear.frequency, "Hz", excitation=excited),
        "damping": variable("", choice.damping, "1", "modal damping ratio"),
    }
    for kind, curves in (("free", linear.free), ("stuck", linear.stuck)):
        for side in SIDES:
            out[f"accelerance_{kind}_{side}"] = accelerance_array(curves[side])
    return out
