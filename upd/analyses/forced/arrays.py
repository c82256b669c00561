"""Arrays of a forced response for result.nc.

Curves, linear limits, contact points, states, energies, loops, peaks over F_C/F_E.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import FacesCurve, ForcedCurve, LinearCurves, PointCurve, SweptCurve
from upd.analyses.forced.measures import CurvePeak
from upd.analyses.forced.model import Array
from upd.analyses.forced.performance import mode_arrays, performance_arrays
from upd.analyses.forced.plan import excitation_of
from upd.analyses.forced.results import MEASURED_PEAK, printed_of
from upd.analyses.forced.solve import (
    ContactPlaces,
    ForcedSolution,
    marched_damper,
    marched_loops,
)
from upd.analyses.measured import accelerance_array, measured_arrays
from upd.hbm import FrequencyResponse
from upd.hbm.faces.balance import InterfaceResponse
from upd.results import Case, Group, variable
from upd.scene.forced_contact import SIDES

Variables = dict[str, Any]
#: what the groups of result.nc hold, their attribute ``content``
POINTS, LINEAR, FRICTION, MEASURED = "points", "linear", "friction", "measured"
PERFORMANCE, SWEEP, MARCHED = "performance", "sweep", "marched peaks"
MODES = "nonlinear mode"
#: loops kept of a peak
N_LOOPS = 4


def arrays(solution: ForcedSolution) -> dict[str, Group]:
    """Arrays for result.nc.

    Returns
    -------
    dict
        Group -> variable -> (dimensions, array, attributes). Contents: "points" and "linear" of
        every stiffness, "friction" of every curve, "sweep" and "marched peaks" of every sweep (the
        latter what the contact does at its peaks), "performance", every "nonlinear mode", the
        "measured" peaks, and every "measured curve".
    """
    out: dict[str, Group] = {}
    scene = solution.plan.scene

    def add(content: str, case: Case | str, variables: Variables) -> None:
        """A group of a case, or of a stiffness."""
        mine = case if isinstance(case, Case) else Case(stiffness=case)
        out[f"{content} {case}"] = Group(variables, content=content, case=mine)

    for name in (*solution.models, *(solution.faces if scene.wants("contact_state") else ())):
        add(POINTS, name, _points(solution, name))
    for name, linear in solution.linear.items():
        add(LINEAR, name, _linear_arrays(solution, linear))
    for curve in (c for c in solution.curves if not c.empty):
        add(SWEEP if curve.way else FRICTION, curve.case, _curve_arrays(solution, curve))
    for sweep in (c for c in solution.curves if c.periods):
        add(MARCHED, sweep.case, marched_arrays(solution, sweep))
    for name, performance in solution.performances.items():
        add(PERFORMANCE, name, performance_arrays(performance))
    for mode in solution.nonlinear_modes:
        add(MODES, mode.case, mode_arrays(mode))
    out |= measured_arrays(scene.measured) if out else {}
    measured = printed_of(solution.plan)(MEASURED_PEAK, {})
    if measured and out:
        source = ", ".join(dict.fromkeys(one.source for one in measured))
        frequency = variable("peak", [one.value for one in measured], "Hz", source=source)
        out["measured peaks"] = Group({"frequency": frequency}, content=MEASURED)
    return out


def _points(solution: ForcedSolution, name: str) -> Variables:
    """Where contact points or nodes of whole faces lie, in space and in the frames of their faces;
    their stiffness and forces at rest, or areas.
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
    return out | {
        "k_n": variable(at, law.k_n, "N/mm"),
        "k_t": variable(at, law.k_t, "N/mm"),
        "static_force": variable(
            f"{at} static_component",
            np.column_stack([law.preload, model.traction]),
            "N",
            "before vibration: normal force, then tractions",
        ),
    }


def _curve_arrays(solution: ForcedSolution, curve: ForcedCurve[Any]) -> Variables:
    """A curve: accelerance of both blades in every harmonic that is excited, its peaks, and what
    its method knows of the contact.
    """
    a = curve.answer
    out: Variables = {
        "frequency": variable(
            "frequency", curve.frequency, "Hz", status=a.status, message=a.message
        ),
        "excitation_force": variable("", curve.force, "N"),
    }
    for side in SIDES:
        out[f"accelerance_{side}"] = accelerance_array(curve.accelerance[side])
        for k, H in curve.more.items():
            out[f"accelerance_{side}_harmonic_{k}"] = accelerance_array(H[side])
        out |= peak_arrays(side, curve.peaks[side])
    if isinstance(a, FrequencyResponse):
        return out | _point_arrays(solution, curve)
    if isinstance(a, InterfaceResponse):
        return out | _faces_arrays(solution, curve)
    return out | _swept_arrays(curve)


def _contact(
    solution: ForcedSolution,
    curve: ForcedCurve[Any],
    at: Sequence[tuple[int, str, int]],
    frequency: Array,
    state: Array,
    energy: Array,
    amplitude: Array | None = None,
    loops: Iterable[tuple[int, float, measures.Loop]] = (),
) -> Variables:
    """What the contact does at points of a curve, as far as it is wanted.

    Parameters
    ----------
    at
        Number, mode and place of the peaks among the points.
    frequency
        (n,) Hz.
    state, energy
        (n, n_point, 3) shares of the cycle; (n, n_point) losses in a cycle, N mm.
    amplitude
        (n, 6) of the damper.
    loops
        Number and frequency of a peak, and a loop.
    """
    scene, places = solution.plan.scene, solution.places(curve.stiffness)
    on = "frequency contact_point"
    out: Variables = {
        "state": variable(f"{on} state", state, "1", state="stick slip lift, shares of the cycle"),
        "energy": variable(on, energy, "N mm", "friction loss per cycle"),
        "power": variable(on, 1e-3 * energy * frequency[:, None], "W"),
        **marked_peaks(at),
    }
    if scene.wants("contact_state"):
        share = measures.face_shares(state, places.face, places.weight)
        words = "stick slip lift, mean over the face by stiffness, or area without springs"
        out["share"] = variable(
            "frequency side state", share, "1", side=" ".join(SIDES), state=words
        )
    if amplitude is not None and scene.wants("damper_motion"):
        k = excitation_of(scene.excitation).lowest
        words = f"amplitude of {'the first harmonic' if k == 1 else f'harmonic {k}'}"
        out["damper_amplitude"] = variable("frequency damper_dof", amplitude, "mm, rad", words)
    return out | (loop_arrays(list(loops), places) if scene.wants("hysteresis") else {})


def peak_arrays(name: str, peaks: Sequence[CurvePeak]) -> Variables:
    """Frequencies and heights of the peaks of a curve, no variables when it has none."""
    if not peaks:
        return {}
    at = f"peak_{name}"
    return {
        f"peak_frequency_{name}": variable(at, [p.frequency for p in peaks], "Hz"),
        f"peak_accelerance_{name}": variable(at, [p.height for p in peaks], "(m/s2)/N"),
    }


def marked_peaks(at: Sequence[tuple[int, str, int]]) -> Variables:
    """Which points of a curve are its peaks."""
    return {
        "peak": variable(
            "peak",
            [number for number, *_ in at],
            long_name="number of the peak's mode; 0 is the highest point of a curve without",
            # which mode each is, in the same order
            modes=", ".join(mode for _, mode, _ in at),
        ),
        "peak_index": variable(
            "peak", [i for *_, i in at], "", "place of the peak in frequency, from 0"
        ),
    }


def loop_arrays(
    found: Sequence[tuple[int, float, measures.Loop]], places: ContactPlaces
) -> Variables:
    """Hysteresis loops at every peak, with what tells them apart.

    The peak, the point's face and place, the loss.

    Parameters
    ----------
    found
        Number and frequency of the peak, and a loop.
    places
        Of all points.
    """
    if not found:
        return {}
    loops = [one for *_, one in found]
    point = np.array([one.point for one in loops])
    return {
        "loop_frequency": variable(
            "loop", [f for _, f, _ in found], "Hz", "the peak each loop belongs to"
        ),
        "loop_point": variable("loop", point, "", "contact point of each loop"),
        "loop_displacement": variable("loop sample", [one.displacement for one in loops], "mm"),
        "loop_traction": variable("loop sample", [one.traction for one in loops], "N"),
        "loop_limit": variable("loop sample", [one.limit for one in loops], "N"),
        "loop_peak": variable("loop", [number for number, *_ in found], "", "number of the peak"),
        "loop_side": variable("loop", places.face[point], flag_meanings="left right"),
        "loop_along": variable("loop", places.along[point], "mm", "place along the damper"),
        "loop_up": variable("loop", places.up[point], "mm", "place up the slope"),
        "loop_energy": variable("loop", [one.energy for one in loops], "N mm", "loss per cycle"),
    }


def _linear_arrays(solution: ForcedSolution, linear: LinearCurves) -> Variables:
    """Accelerance of both blades free and stuck, their peaks, the stuck modes, the damping."""
    excited = excitation_of(solution.plan.scene.excitation)
    told = {} if excited.usual else {"excitation": excited.words}
    out: Variables = {"frequency": variable("frequency", linear.frequency, "Hz", **told)}
    for kind, curves, peaks in (
        ("free", linear.free, linear.free_peaks),
        ("stuck", linear.stuck, linear.stuck_peaks),
    ):
        for side in SIDES:
            out |= {f"accelerance_{kind}_{side}": accelerance_array(curves[side])}
            rising = sorted(peaks[side], key=lambda p: p.frequency)
            out |= peak_arrays(f"{kind}_{side}", rising)
    damping = variable("", solution.plan.scene.excitation.damping, "1", "modal damping ratio")
    return out | {
        "stuck_mode": variable("mode", [m.frequency for m in linear.modes], "Hz"),
        "damping": damping,
    }


def _point_arrays(solution: ForcedSolution, curve: PointCurve) -> Variables:
    """Along a path of points: states, losses, motion of the damper, loops."""
    answer, model = curve.answer, solution.models[curve.stiffness]
    at, f = solution.marked_points(curve), answer.frequency
    loops = (
        (number, float(f[i]), one)
        for number, _, i in at
        for one in measures.loops(answer, i, N_LOOPS)
    )
    amplitude = measures.damper_motion(answer, model)[1]
    return {
        "stable": variable(
            "frequency",
            curve.rising.astype(np.int8),
            "1",
            "0 between two folds, where the frequency falls",
        ),
        **_fold_arrays(curve),
        "damper": variable(
            "frequency damper_dof coefficient",
            model.damper_dofs(answer.coefficients),
            "mm, rad",
            coefficient="a0 a1 b1 ...",
        ),
        **_contact(solution, curve, at, f, answer.state, answer.energy, amplitude, loops),
    }


def _fold_arrays(curve: PointCurve) -> Variables:
    """Where slow sweeps jump, and the heights of the right blade before and after."""
    if not curve.folds:
        return {}
    units = {"frequency": "Hz", "up": "1", "before": "(m/s2)/N", "reached": "(m/s2)/N"}
    return {
        f"fold_{name}": variable("fold", [getattr(one, name) for one in curve.folds], unit)
        for name, unit in units.items()
    }


def _faces_arrays(solution: ForcedSolution, curve: FacesCurve) -> Variables:
    """Along a curve of whole faces: states and losses of every node, jumps."""
    answer, on = curve.answer, "frequency"
    jumped = np.zeros(len(curve.frequency), np.int8)
    jumped[list(answer.jumps)] = 1
    state = np.array([one.nodes for one in answer.points])[:, :, [1, 2, 0]]
    loss = np.array([one.loss for one in answer.points])
    return {
        "jump": variable(on, jumped, "1", "whether the motion jumps to another after this point"),
        **_contact(solution, curve, solution.marked_points(curve), curve.frequency, state, loss),
    }


def _swept_arrays(one: SweptCurve) -> Variables:
    """Along a sweep: states and losses."""
    found = one.answer
    return {
        "share": variable(
            "frequency state",
            found.share[:, [1, 2, 0]],
            "1",
            state="stick slip lift, mean over all points of both faces",
        ),
        "energy": variable(
            "frequency kind",
            found.energy,
            "N mm",
            kind="work of the excitation, lost by damping, by friction",
        ),
        "settled": variable("frequency", found.settled.astype(np.int8), "1"),
    }


def marched_arrays(solution: ForcedSolution, sweep: SweptCurve) -> Variables:
    """States, losses, loops and the damper's motion at peaks of a sweep, in the variables of a path
    by the balance with these points.
    """
    peaks, periods = sweep.peaks["right"], list(sweep.periods.values())
    f = sweep.frequency[[one.sample for one in peaks]]
    loops = (
        (one.number, float(at), loop)
        for one, at, period in zip(peaks, f, periods, strict=True)
        for loop in marched_loops(solution, sweep, period, N_LOOPS)
    )
    return {
        "frequency": variable("frequency", f, "Hz"),
        "excitation_force": variable("", sweep.force, "N"),
        **_contact(
            solution,
            sweep,
            [(one.number, one.mode, i) for i, one in enumerate(peaks)],
            f,
            np.array([one.share for one in periods]),
            # of a half model each node stands for its image too
            np.array([one.copies * one.loss for one in periods]),
            np.array([marched_damper(solution, sweep, one)[1] for one in periods]),
            loops,
        ),
    }
