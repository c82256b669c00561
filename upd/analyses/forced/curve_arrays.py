"""Arrays of curves by harmonic balance and by sweeps, of linear limits, of peaks over F_C/F_E."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import (
    FacesCurve,
    ForcedCurve,
    FrictionCurve,
    LinearCurves,
    SweptCurve,
)
from upd.analyses.forced.excitation import Excitation, excitation_of
from upd.analyses.forced.measures import CurvePeak
from upd.analyses.forced.model import Array
from upd.analyses.forced.performance import Performance
from upd.analyses.forced.solution import ContactPlaces, ForcedSolution, MarchedPeak
from upd.analyses.forced.sweeps import face_shares, marched_damper, marched_loops
from upd.analyses.measured import accelerance_array
from upd.results import variable
from upd.scene.forced_contact import SIDES

Variables = dict[str, Any]
#: what the groups of result.nc hold, their attribute ``content``
POINTS, LINEAR, FRICTION, MEASURED = "points", "linear", "friction", "measured"
PERFORMANCE, SWEEP, MARCHED = "performance", "sweep", "marched peaks"
#: loops kept of a peak
N_LOOPS = 4


def _accelerances(curve: FrictionCurve) -> Variables:
    """Both blades in every harmonic that is excited."""
    return {f"accelerance_{side}": accelerance_array(curve.accelerance[side]) for side in SIDES} | {
        f"accelerance_{side}_harmonic_{k}": accelerance_array(H[side])
        for k, H in curve.more.items()
        for side in SIDES
    }


def _contact(state: Array, energy: Array, power: Array) -> Variables:
    """States (frequency, point, 3) and losses (frequency, point) of contact points."""
    at = "frequency contact_point"
    return {
        "state": variable(f"{at} state", state, "1", state="stick slip lift, shares of the cycle"),
        "energy": variable(at, energy, "N mm", "friction loss per cycle"),
        "power": variable(at, power, "W"),
    }


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


def share_array(values: Any, mean: str = "stiffness") -> tuple[Any, ...]:
    """(frequency, side, state) of the cycle."""
    words = f"stick slip lift, mean over the face by {mean}"
    return variable("frequency side state", values, "1", side=" ".join(SIDES), state=words)


def shares_by_face(state: Array, places: ContactPlaces) -> tuple[Any, ...]:
    """Shares of the cycle of each face from those of its points, (frequency, points, state)."""
    share = np.stack([face_shares(one, places) for one in state])
    return share_array(share, "stiffness, or area without springs")


def damper_array(solution: ForcedSolution, amplitude: Any) -> tuple[Any, ...]:
    """Amplitudes of the damper along a curve, of the harmonic that is read."""
    k = excitation_of(solution.plan.scene.excitation).lowest
    words = f"amplitude of {'the first harmonic' if k == 1 else f'harmonic {k}'}"
    return variable("frequency damper_dof", amplitude, "mm, rad", words)


def loop_arrays(
    found: Sequence[tuple[int, float, measures.Loop]], face: Any, along: Array, up: Array
) -> Variables:
    """Hysteresis loops at every peak, with what tells them apart.

    The peak, the point's face and place, the loss.

    Parameters
    ----------
    found
        Number and frequency of the peak, and a loop.
    face, along, up
        (n_point,) of all points.
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
        "loop_side": variable("loop", face[point], flag_meanings="left right"),
        "loop_along": variable("loop", along[point], "mm", "place along the damper"),
        "loop_up": variable("loop", up[point], "mm", "place up the slope"),
        "loop_energy": variable("loop", [one.energy for one in loops], "N mm", "loss per cycle"),
    }


def linear_arrays(solution: ForcedSolution, linear: LinearCurves) -> Variables:
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
            out |= peak_arrays(f"{kind}_{side}", peaks[side])
    x = [m for m in linear.modes if m.axis == "x"]
    damping = variable("", solution.plan.scene.excitation.damping, "1", "modal damping ratio")
    return out | {
        "stuck_mode": variable("mode", [m.frequency for m in x], "Hz"),
        "damping": damping,
    }


def friction_arrays(solution: ForcedSolution, curve: ForcedCurve) -> Variables:
    """A path of points: accelerance of both blades, states, losses, motion of the damper, loops."""
    answer, model, scene = curve.answer, solution.models[curve.stiffness], solution.plan.scene
    at = solution.marked_points(curve)
    out: Variables = {
        "frequency": variable(
            "frequency", answer.frequency, "Hz", status=answer.status, message=answer.message
        ),
        "excitation_force": variable("", curve.force, "N"),
        "stable": variable(
            "frequency",
            curve.rising.astype(np.int8),
            "1",
            "0 between two folds, where the frequency falls",
        ),
        **_fold_arrays(curve),
        **_accelerances(curve),
        **_contact(answer.state, answer.energy, measures.power(answer)),
        "truncation": variable("frequency", answer.truncation, "1"),
        "highest_harmonic": variable("frequency", answer.highest_harmonic, "1"),
        "periodic": variable(
            "frequency",
            answer.periodic.astype(np.int8),
            "1",
            "whether the contact forces came back to their start",
        ),
        "aliasing": variable("frequency", answer.aliasing, "1"),
        "energy_balance": variable("frequency", answer.energy_balance, "1"),
        "damper": variable(
            "frequency damper_dof coefficient",
            model.damper_dofs(answer.coefficients),
            "mm, rad",
            coefficient="a0 a1 b1 ...",
        ),
        **{
            key: value
            for side in SIDES
            for key, value in peak_arrays(side, curve.peaks[side]).items()
        },
        **marked_peaks(at),
    }
    if scene.wants("contact_state"):
        share = measures.shares(answer, model)
        out["share"] = share_array(np.stack([share[side] for side in SIDES], axis=1))
    if scene.wants("damper_motion"):
        out["damper_amplitude"] = damper_array(solution, measures.damper_amplitude(answer, model))
    if not scene.wants("hysteresis"):
        return out
    loops = [
        (number, float(answer.frequency[i]), one)
        for number, _, i in at
        for one in measures.loops(answer, i, N_LOOPS)
    ]
    return out | loop_arrays(loops, model.face, *measures.place(model))


def _fold_arrays(curve: ForcedCurve) -> Variables:
    """Where slow sweeps jump, and the heights of the right blade before and after."""
    if not curve.folds:
        return {}
    at, folds = "fold", curve.folds
    return {
        "fold_frequency": variable(at, [one.frequency for one in folds], "Hz"),
        "fold_up": variable(at, np.array([one.up for one in folds], np.int8), "1"),
        "fold_before": variable(at, [one.before for one in folds], "(m/s2)/N"),
        "fold_reached": variable(at, [one.reached for one in folds], "(m/s2)/N"),
    }


def faces_friction(curve: FacesCurve, at: Sequence[tuple[int, str, int]]) -> Variables:
    """A curve of whole faces: accelerance of both blades, states and losses of every node, jumps.

    Parameters
    ----------
    at
        Number, mode and point of its peaks.
    """
    answer, on = curve.answer, "frequency"
    jumped = np.zeros(len(curve.frequency), np.int8)
    jumped[list(answer.jumps)] = 1
    loss = np.array([one.loss for one in answer.points])
    out: Variables = {
        "frequency": variable(on, answer.frequency, "Hz", status=answer.status),
        "excitation_force": variable("", curve.force, "N"),
        **_accelerances(curve),
        **_contact(
            np.array([one.nodes for one in answer.points])[:, :, [1, 2, 0]],
            loss,
            1e-3 * loss * answer.frequency[:, None],
        ),
        "truncation": variable(
            on,
            [one.unresolved for one in answer.points],
            "1",
            "motion of the faces by harmonics left out, relative",
        ),
        "jump": variable(on, jumped, "1", "whether the motion jumps to another after this point"),
        **marked_peaks(at),
    }
    for side in SIDES:
        out |= peak_arrays(side, curve.peaks[side])
    return out


def performance_arrays(found: Performance) -> Variables:
    """Peaks of both blades over F_C/F_E, nan where a mode has none; the highest, and the limits."""
    points, at = found.known, "point"
    ratio = np.array([one.ratio for one in points])
    modes = {(p.blade, p.number): p.mode for one in points for p in one.peaks}
    out: Variables = {
        "ratio": variable(at, ratio, "1", "F_C/F_E"),
        "highest_accelerance": variable(
            at,
            [one.worst.height for one in points if one.worst is not None],
            "(m/s2)/N",
            "highest peak of both blades and all modes",
        ),
        "free_peak": variable("", found.free, "(m/s2)/N"),
        "stuck_peak": variable("", found.stuck, "(m/s2)/N"),
    }
    for (blade, number), mode in sorted(modes.items()):
        rows = np.full((2, len(points)), np.nan)
        for k, one in enumerate(points):
            for p in one.peaks:
                if (p.blade, p.number) == (blade, number):
                    rows[:, k] = p.frequency, p.height
        about = {"mode": mode, "blade": blade}
        out[f"peak_{number}_frequency_{blade}"] = variable(at, rows[0], "Hz", **about)
        out[f"peak_{number}_accelerance_{blade}"] = variable(at, rows[1], "(m/s2)/N", **about)
    best = found.best
    if best is not None and best.worst is not None:
        out |= {
            "best_ratio": variable("", best.ratio, "1", "F_C/F_E"),
            "best_accelerance": variable("", best.worst.height, "(m/s2)/N"),
        }
    return out


def swept_arrays(one: SweptCurve, excited: Excitation) -> Variables:
    """Accelerance of both blades along a sweep, its states, losses and cost."""
    found, at = one.found, "frequency"
    scale = (2.0 * np.pi * excited.lowest * found.frequency) ** 2 * 1e-3 / one.force
    out: Variables = {
        "frequency": variable(at, found.frequency, "Hz", status=found.status),
        "excitation_force": variable("", one.force, "N"),
        **_accelerances(one),
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
        "settled": variable(at, found.settled.astype(np.int8), "1"),
        "periods": variable(at, found.periods, "1"),
    }
    for k, side in enumerate(SIDES):
        out[f"lowest_{side}"] = variable(at, scale * found.lowest[:, k], "(m/s2)/N")
        out[f"highest_{side}"] = variable(at, scale * found.highest[:, k], "(m/s2)/N")
        out |= peak_arrays(side, one.peaks[side])
    return out


def peaks_by_sweep(marched: Sequence[MarchedPeak]) -> list[tuple[SweptCurve, list[MarchedPeak]]]:
    """Peaks of every sweep that has some."""
    cases = dict.fromkeys(one.sweep.case for one in marched)
    found = [[one for one in marched if one.sweep.case == case] for case in cases]
    return [(some[0].sweep, some) for some in found]


def marched_arrays(solution: ForcedSolution, found: Sequence[MarchedPeak]) -> Variables:
    """States, losses, loops and the damper's motion at peaks of a sweep, in the variables of a path
    by the balance with these points.
    """
    scene, at = solution.plan.scene, "frequency"
    f = np.array([one.frequency for one in found])
    # of a half model each node stands for its image too
    copies = np.array([one.period.copies for one in found])[:, None]
    energy = copies * np.array([one.period.loss for one in found])
    out: Variables = {
        "frequency": variable(at, f, "Hz"),
        "excitation_force": variable("", found[0].sweep.force, "N"),
        **_contact(
            np.array([one.period.share for one in found]), energy, 1e-3 * energy * f[:, None]
        ),
        **marked_peaks([(one.peak.number, one.peak.mode, i) for i, one in enumerate(found)]),
    }
    if scene.wants("contact_state"):
        out["share"] = shares_by_face(out["state"][1], found[0].places)
    if scene.wants("damper_motion"):
        both = [marched_damper(solution, one) for one in found]
        motion = [one.motion.T for one in found]
        static, rest = [mean for mean, _ in both], "mean, from the damper at rest"
        along = "over the period, from the damper at rest"
        on = f"{at} damper_dof"
        out |= {
            "damper_motion": variable(f"{on} sample", motion, "mm, rad", along),
            "damper_static": variable(on, static, "mm, rad", rest),
            "damper_amplitude": damper_array(solution, [amplitude for _, amplitude in both]),
        }
    if not scene.wants("hysteresis"):
        return out
    loops = [
        (one.peak.number, one.frequency, loop)
        for one in found
        for loop in marched_loops(one, N_LOOPS)
    ]
    places = found[0].places
    return out | loop_arrays(loops, places.face, places.along, places.up)
