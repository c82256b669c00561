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
from upd.scene.forced_contact import SIDES

Variables = dict[str, Any]
#: what the groups of result.nc hold, their attribute ``content``
POINTS, LINEAR, FRICTION, MEASURED = "points", "linear", "friction", "measured"
PERFORMANCE, SWEEP, MARCHED = "performance", "sweep", "marched peaks"
#: loops kept of a peak
N_LOOPS = 4
HZ, PER_N = {"units": "Hz"}, {"units": "(m/s2)/N"}


def complex_array(H: Any) -> tuple[tuple[str, str], Any, dict[str, str]]:
    """Real and imaginary part of an accelerance along a curve."""
    return (
        ("frequency", "part"),
        np.stack([H.real, H.imag], axis=-1),
        {"units": "(m/s2)/N", "part": "real imaginary"},
    )


def _accelerances(curve: FrictionCurve) -> Variables:
    """Both blades in every harmonic that is excited."""
    return {f"accelerance_{side}": complex_array(curve.accelerance[side]) for side in SIDES} | {
        f"accelerance_{side}_harmonic_{k}": complex_array(H[side])
        for k, H in curve.more.items()
        for side in SIDES
    }


def _contact(state: Array, energy: Array, power: Array) -> Variables:
    """States (frequency, point, 3) and losses (frequency, point) of contact points."""
    at = ("frequency", "contact_point")
    return {
        "state": (
            (*at, "state"),
            state,
            {"units": "1", "state": "stick slip lift, shares of the cycle"},
        ),
        "energy": (at, energy, {"units": "N mm", "long_name": "friction loss per cycle"}),
        "power": (at, power, {"units": "W"}),
    }


def peak_arrays(name: str, peaks: Sequence[CurvePeak]) -> Variables:
    """Frequencies and heights of the peaks of a curve, no variables when it has none."""
    if not peaks:
        return {}
    at = (f"peak_{name}",)
    return {
        f"peak_frequency_{name}": (at, np.array([p.frequency for p in peaks]), HZ),
        f"peak_accelerance_{name}": (at, np.array([p.height for p in peaks]), PER_N),
    }


def marked_peaks(at: Sequence[tuple[int, str, int]]) -> Variables:
    """Which points of a curve are its peaks."""
    return {
        "peak": (
            ("peak",),
            np.array([number for number, *_ in at]),
            {
                "long_name": "number of the peak's mode; 0 is the highest point of a curve without",
                # which mode each is, in the same order
                "modes": ", ".join(mode for _, mode, _ in at),
            },
        ),
        "peak_index": (
            ("peak",),
            np.array([i for *_, i in at]),
            {"long_name": "place of the peak in frequency, from 0"},
        ),
    }


def share_array(
    values: Any, mean: str = "stiffness"
) -> tuple[tuple[str, ...], Any, dict[str, str]]:
    """(frequency, side, state) of the cycle."""
    words = f"stick slip lift, mean over the face by {mean}"
    about = {"units": "1", "side": " ".join(SIDES), "state": words}
    return ("frequency", "side", "state"), values, about


def shares_by_face(
    state: Array, places: ContactPlaces
) -> tuple[tuple[str, ...], Any, dict[str, str]]:
    """Shares of the cycle of each face from those of its points, (frequency, points, state)."""
    share = np.stack([face_shares(one, places) for one in state])
    return share_array(share, "stiffness, or area without springs")


def amplitude_words(solution: ForcedSolution) -> str:
    """Which harmonic the damper's amplitudes are of."""
    k = excitation_of(solution.plan.scene.excitation).lowest
    return f"amplitude of {'the first harmonic' if k == 1 else f'harmonic {k}'}"


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
        "loop_frequency": (
            ("loop",),
            np.array([f for _, f, _ in found]),
            HZ | {"long_name": "the peak each loop belongs to"},
        ),
        "loop_point": (("loop",), point, {"long_name": "contact point of each loop"}),
        "loop_displacement": (
            ("loop", "sample"),
            np.array([one.displacement for one in loops]),
            {"units": "mm"},
        ),
        "loop_traction": (
            ("loop", "sample"),
            np.array([one.traction for one in loops]),
            {"units": "N"},
        ),
        "loop_limit": (("loop", "sample"), np.array([one.limit for one in loops]), {"units": "N"}),
        "loop_peak": (
            ("loop",),
            np.array([number for number, *_ in found]),
            {"long_name": "number of the peak"},
        ),
        "loop_side": (("loop",), face[point], {"flag_meanings": "left right"}),
        "loop_along": (
            ("loop",),
            along[point],
            {"units": "mm", "long_name": "place along the damper"},
        ),
        "loop_up": (("loop",), up[point], {"units": "mm", "long_name": "place up the slope"}),
        "loop_energy": (
            ("loop",),
            np.array([one.energy for one in loops]),
            {"units": "N mm", "long_name": "loss per cycle"},
        ),
    }


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
    at = solution.marked_points(curve)
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
        **_accelerances(curve),
        **_contact(answer.state, answer.energy, measures.power(answer)),
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


def faces_friction(curve: FacesCurve, at: Sequence[tuple[int, str, int]]) -> Variables:
    """A curve of whole faces: accelerance of both blades, states and losses of every node, jumps.

    Parameters
    ----------
    at
        Number, mode and point of its peaks.
    """
    answer, on = curve.answer, ("frequency",)
    jumped = np.zeros(len(curve.frequency), np.int8)
    jumped[list(answer.jumps)] = 1
    loss = np.array([one.loss for one in answer.points])
    out: Variables = {
        "frequency": (on, answer.frequency, HZ | {"status": answer.status}),
        "excitation_force": ((), np.array(curve.force), {"units": "N"}),
        **_accelerances(curve),
        **_contact(
            np.array([one.nodes for one in answer.points])[:, :, [1, 2, 0]],
            loss,
            1e-3 * loss * answer.frequency[:, None],
        ),
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


def swept_arrays(one: SweptCurve, excited: Excitation) -> Variables:
    """Accelerance of both blades along a sweep, its states, losses and cost."""
    found, at = one.found, ("frequency",)
    scale = (2.0 * np.pi * excited.lowest * found.frequency) ** 2 * 1e-3 / one.force
    out: Variables = {
        "frequency": (at, found.frequency, HZ | {"status": found.status}),
        "excitation_force": ((), np.array(one.force), {"units": "N"}),
        **_accelerances(one),
        "share": (
            ("frequency", "state"),
            found.share[:, [1, 2, 0]],
            {"units": "1", "state": "stick slip lift, mean over all points of both faces"},
        ),
        "energy": (
            ("frequency", "kind"),
            found.energy,
            {"units": "N mm", "kind": "work of the excitation, lost by damping, by friction"},
        ),
        "settled": (at, found.settled.astype(np.int8), {"units": "1"}),
        "periods": (at, found.periods, {"units": "1"}),
    }
    for k, side in enumerate(SIDES):
        out[f"lowest_{side}"] = (at, scale * found.lowest[:, k], PER_N)
        out[f"highest_{side}"] = (at, scale * found.highest[:, k], PER_N)
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
    scene, at = solution.plan.scene, ("frequency",)
    f = np.array([one.frequency for one in found])
    # of a half model each node stands for its image too
    copies = np.array([one.period.copies for one in found])[:, None]
    energy = copies * np.array([one.period.loss for one in found])
    out: Variables = {
        "frequency": (at, f, HZ),
        "excitation_force": ((), np.array(found[0].sweep.force), {"units": "N"}),
        **_contact(
            np.array([one.period.share for one in found]), energy, 1e-3 * energy * f[:, None]
        ),
        **marked_peaks([(one.peak.number, one.peak.mode, i) for i, one in enumerate(found)]),
    }
    if scene.wants("contact_state"):
        out["share"] = shares_by_face(out["state"][1], found[0].places)
    if scene.wants("damper_motion"):
        both = [marched_damper(solution, one) for one in found]
        dofs = {"units": "mm, rad"}
        out |= {
            "damper_motion": (
                ("frequency", "damper_dof", "sample"),
                np.array([one.motion.T for one in found]),
                dofs | {"long_name": "over the period, from the damper at rest"},
            ),
            "damper_static": (
                ("frequency", "damper_dof"),
                np.array([static for static, _ in both]),
                dofs | {"long_name": "mean, from the damper at rest"},
            ),
            "damper_amplitude": (
                ("frequency", "damper_dof"),
                np.array([amplitude for _, amplitude in both]),
                dofs | {"long_name": amplitude_words(solution)},
            ),
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
