"""Arrays of curves by harmonic balance, of their linear limits and of peaks over F_C/F_E."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.array_parts import (
    HZ,
    N_LOOPS,
    PER_N,
    Variables,
    amplitude_words,
    complex_array,
    loop_arrays,
    marked_peaks,
    peak_arrays,
    share_array,
)
from upd.analyses.forced.curves import FacesCurve, ForcedCurve, LinearCurves
from upd.analyses.forced.excitation import Excitation, excitation_of
from upd.analyses.forced.performance import Performance
from upd.analyses.forced.solution import ForcedSolution
from upd.scene.forced_contact import SIDES


def linear_arrays(solution: ForcedSolution, linear: LinearCurves) -> Variables:
    """Accelerance of both blades free and stuck, their peaks, the stuck modes, the damping."""
    excited = excitation_of(solution.plan.scene.excitation)
    told = {} if excited.usual else {"excitation": excited.words}
    out: Variables = {"frequency": (("frequency",), linear.frequency, HZ | told)}
    for kind, curves, peaks in (
        ("free", linear.free, linear.free_peaks),
        ("stuck", linear.stuck, linear.stuck_peaks),
    ):
        for side in SIDES:
            out |= {f"accelerance_{kind}_{side}": complex_array(curves[side])}
            out |= peak_arrays(f"{kind}_{side}", peaks[side])
    x = [m for m in linear.modes if m.axis == "x"]
    damping = (
        (),
        np.array(solution.plan.scene.excitation.damping),
        {"units": "1", "long_name": "modal damping ratio"},
    )
    return out | {
        "stuck_mode": (("mode",), np.array([m.frequency for m in x]), HZ),
        "damping": damping,
    }


def friction_arrays(solution: ForcedSolution, curve: ForcedCurve) -> Variables:
    """A path of points: accelerance of both blades, states, losses, motion of the damper, loops."""
    answer, model, scene = curve.answer, solution.models[curve.stiffness], solution.plan.scene
    fp, at = ("frequency", "contact_point"), solution.marked_points(curve)
    out: Variables = {
        "frequency": (
            ("frequency",),
            answer.frequency,
            HZ | {"status": answer.status, "message": answer.message},
        ),
        "excitation_force": ((), np.array(curve.force), {"units": "N"}),
        "stable": (
            ("frequency",),
            curve.rising.astype(np.int8),
            {"units": "1", "long_name": "0 between two folds, where the frequency falls"},
        ),
        **_fold_arrays(curve),
        **{f"accelerance_{side}": complex_array(curve.accelerance[side]) for side in SIDES},
        **{
            f"accelerance_{side}_harmonic_{k}": complex_array(
                measures.accelerance(answer, model.row(side), curve.force, k)
            )
            for k in model.excitation.harmonics[1:]
            for side in SIDES
        },
        "state": (
            (*fp, "state"),
            answer.state,
            {"units": "1", "state": "stick slip lift, shares of the cycle"},
        ),
        "energy": (fp, answer.energy, {"units": "N mm", "long_name": "friction loss per cycle"}),
        "power": (fp, measures.power(answer), {"units": "W"}),
        "truncation": (("frequency",), answer.truncation, {"units": "1"}),
        "highest_harmonic": (("frequency",), answer.highest_harmonic, {"units": "1"}),
        "periodic": (
            ("frequency",),
            answer.periodic.astype(np.int8),
            {"units": "1", "long_name": "whether the contact forces came back to their start"},
        ),
        "aliasing": (("frequency",), answer.aliasing, {"units": "1"}),
        "energy_balance": (("frequency",), answer.energy_balance, {"units": "1"}),
        "damper": (
            ("frequency", "damper_dof", "coefficient"),
            model.damper_dofs(answer.coefficients),
            {"units": "mm, rad", "coefficient": "a0 a1 b1 ..."},
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
        attributes = {"units": "mm, rad", "long_name": amplitude_words(solution)}
        out["damper_amplitude"] = (
            ("frequency", "damper_dof"),
            measures.damper_amplitude(answer, model),
            attributes,
        )
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
    at, folds = ("fold",), curve.folds
    return {
        "fold_frequency": (at, np.array([one.frequency for one in folds]), HZ),
        "fold_up": (at, np.array([one.up for one in folds], np.int8), {"units": "1"}),
        "fold_before": (at, np.array([one.before for one in folds]), PER_N),
        "fold_reached": (at, np.array([one.reached for one in folds]), PER_N),
    }


def faces_friction(
    curve: FacesCurve, at: Sequence[tuple[int, str, int]], excited: Excitation
) -> Variables:
    """A curve of whole faces: accelerance of both blades, states and losses of every node, jumps.

    Parameters
    ----------
    at
        Number, mode and point of its peaks.
    excited
        What of the blades is excited.
    """
    answer, on = curve.answer, ("frequency",)
    nodes, jumped = ("frequency", "contact_point"), np.zeros(len(curve.frequency), np.int8)
    jumped[list(answer.jumps)] = 1
    loss = np.array([one.loss for one in answer.points])
    out: Variables = {
        "frequency": (on, answer.frequency, HZ | {"status": answer.status}),
        "excitation_force": ((), np.array(curve.force), {"units": "N"}),
        **{f"accelerance_{side}": complex_array(curve.accelerance[side]) for side in SIDES},
        **{
            f"accelerance_{side}_harmonic_{k}": complex_array(curve.accelerance_in(k, side))
            for k in excited.harmonics[1:]
            for side in SIDES
        },
        "state": (
            (*nodes, "state"),
            np.array([one.nodes for one in answer.points])[:, :, [1, 2, 0]],
            {"units": "1", "state": "stick slip lift, shares of the cycle"},
        ),
        "energy": (nodes, loss, {"units": "N mm", "long_name": "friction loss per cycle"}),
        "power": (nodes, 1e-3 * loss * answer.frequency[:, None], {"units": "W"}),
        "truncation": (
            on,
            np.array([one.unresolved for one in answer.points]),
            {"units": "1", "long_name": "motion of the faces by harmonics left out, relative"},
        ),
        "jump": (
            on,
            jumped,
            {"units": "1", "long_name": "whether the motion jumps to another after this point"},
        ),
        **marked_peaks(at),
    }
    for side in SIDES:
        out |= peak_arrays(side, curve.peaks[side])
    return out


def performance_arrays(found: Performance) -> Variables:
    """Peaks of both blades over F_C/F_E, nan where a mode has none; the highest, and the limits."""
    points, at = found.known, ("point",)
    ratio = np.array([one.ratio for one in points])
    modes = {(p.blade, p.number): p.mode for one in points for p in one.peaks}
    out: Variables = {
        "ratio": (at, ratio, {"units": "1", "long_name": "F_C/F_E"}),
        "highest_accelerance": (
            at,
            np.array([one.worst.height for one in points if one.worst is not None]),
            PER_N | {"long_name": "highest peak of both blades and all modes"},
        ),
        "free_peak": ((), np.array(found.free), PER_N),
        "stuck_peak": ((), np.array(found.stuck), PER_N),
    }
    for (blade, number), mode in sorted(modes.items()):
        rows = np.full((2, len(points)), np.nan)
        for k, one in enumerate(points):
            for p in one.peaks:
                if (p.blade, p.number) == (blade, number):
                    rows[:, k] = p.frequency, p.height
        about = {"mode": mode, "blade": blade}
        out[f"peak_{number}_frequency_{blade}"] = (at, rows[0], HZ | about)
        out[f"peak_{number}_accelerance_{blade}"] = (at, rows[1], PER_N | about)
    best = found.best
    if best is not None and best.worst is not None:
        out |= {
            "best_ratio": ((), np.array(best.ratio), {"units": "1", "long_name": "F_C/F_E"}),
            "best_accelerance": ((), np.array(best.worst.height), PER_N),
        }
    return out
