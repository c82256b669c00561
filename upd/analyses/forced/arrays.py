"""What the contact does along the curves of a forced response, and all arrays for result.nc.

Curves, linear limits, contact points, states, energies, loops, peaks over F_C/F_E.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import ForcedCurve, LinearCurves
from upd.analyses.forced.measures import Loop
from upd.analyses.forced.model import Array
from upd.analyses.forced.performance import mode_arrays, performance_arrays
from upd.analyses.forced.plan import excitation_of
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
POINTS, LINEAR, FRICTION = "points", "linear", "friction"
PERFORMANCE, SWEEP, MARCHED = "performance", "sweep", "marched peaks"
MODES = "nonlinear mode"
#: loops kept of a peak
N_LOOPS = 4


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
    found = [one for one in solution.marched if one.sweep.case == curve.case]
    if not found:
        return None
    return Contact(
        [(one.peak.number, one.peak.mode, i) for i, one in enumerate(found)],
        np.array([one.frequency for one in found]),
        np.array([one.period.share for one in found]),
        # of a half model each node stands for its image too
        np.array([one.period.copies * one.period.loss for one in found]),
        np.stack([marched_damper(solution, one) for one in found], axis=1),
        ((one.peak.number, loop) for one in found for loop in marched_loops(one, N_LOOPS)),
    )


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
        contact, peaks = contact_of(solution, curve), _curve_arrays(curve)
        behind = {} if contact is None else _contact_arrays(solution, curve, contact)
        if not curve.way:
            add(FRICTION, curve.case, peaks | behind)
            continue
        add(SWEEP, curve.case, peaks)
        if contact is not None:
            behind["frequency"] = variable("frequency", contact.frequency, "Hz")
            add(MARCHED, curve.case, behind)
    for name, performance in solution.performances.items():
        add(PERFORMANCE, name, performance_arrays(performance))
    for mode in solution.nonlinear_modes:
        add(MODES, mode.case, mode_arrays(mode))
    return out | (measured_arrays(scene.measured) if out else {})


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
        return out | {"stable": variable(on, curve.rising.astype(np.int8), "1", words)}
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
