"""What a forced response leaves behind.

Curves, linear limits, contact points, states, energies, loops, peaks followed over F_C/F_E.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.bands import envelope
from upd.analyses.forced.curves import FacesCurve, ForcedCurve, LinearCurves, SweptCurve
from upd.analyses.forced.excitation import Excitation, excitation_of
from upd.analyses.forced.marched_peaks import (
    face_shares,
    faces_places,
    marched_damper,
    marched_loops,
)
from upd.analyses.forced.measures import PathPeak
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.paths import grid
from upd.analyses.forced.performance_curve import Branch, Performance
from upd.analyses.forced.printed import measured_peaks
from upd.analyses.forced.solution import (
    ContactPlaces,
    CurveBand,
    ForcedSolution,
    MarchedPeak,
    PeakAgain,
)
from upd.results import ArrayGroup, Case
from upd.scene.forced import SIDES

Variables = dict[str, Any]
#: what the groups of result.nc hold, their attribute ``content``
POINTS, LINEAR, FRICTION, MEASURED = "points", "linear", "friction", "measured"
PERFORMANCE, HIGHEST, SPREAD, HARMONICS = "performance", "highest peak", "spread", "harmonics"
BAND, SWEEP, MARCHED = "band", "sweep", "marched peaks"
#: loops kept of a peak
N_LOOPS = 4
_HZ, _PER_N = {"units": "Hz"}, {"units": "(m/s2)/N"}


def sizes(solution: ForcedSolution) -> dict[str, int]:
    """Contact points of the first stiffness, or nodes of whole faces."""
    points = [m.contacts.n_point for m in solution.models.values()]
    return {"n_pairs": next(iter(points + [f.of.n for f in solution.faces.values()]), 0)}


def arrays(solution: ForcedSolution) -> dict[str, ArrayGroup]:
    """Arrays for result.nc.

    Returns
    -------
    dict
        Group -> variable -> (dimensions, array, attributes). Contents: "points" and "linear" of
        every stiffness, "friction" of every curve, "sweep" and "marched peaks" of every sweep (the
        latter what the contact does at peaks that are the sweeps'), "performance" of every followed
        peak and the "highest peak" of them, "band" of every curve, "spread", "harmonics", and the
        "measured" peaks.
    """
    out: dict[str, ArrayGroup] = {}
    excited = excitation_of(solution.plan.scene.excitation)
    for name, model in solution.models.items():
        out[f"points {name}"] = ArrayGroup(
            _points(model), content=POINTS, case=Case(stiffness=name)
        )
    for name in solution.faces if solution.plan.scene.wants("contact_state") else ():
        out[f"points {name}"] = ArrayGroup(
            _nodes(solution, name), content=POINTS, case=Case(stiffness=name)
        )
    for name, linear in solution.linear.items():
        out[f"linear {name}"] = ArrayGroup(
            _linear(solution, linear), content=LINEAR, case=Case(stiffness=name)
        )
    for curve in solution.curves:
        if not curve.empty:
            out[f"friction {curve.case}"] = ArrayGroup(
                _friction(solution, curve), content=FRICTION, case=curve.case
            )
    for path in (c for c in solution.balanced if not c.empty):
        whole = faces_friction(path, solution.marked_points(path), excited)
        if solution.plan.scene.wants("contact_state"):
            whole["share"] = _by_face(whole["state"][1], faces_places(solution, path.stiffness))
        out[f"friction {path.case}"] = ArrayGroup(whole, content=FRICTION, case=path.case)
    for one in (s for s in solution.sweeps if len(s.frequency)):
        out[f"sweep {one.case}"] = ArrayGroup(_swept(one, excited), content=SWEEP, case=one.case)
    for one, marched in _by_sweep(solution.marched):
        out[f"{MARCHED} {one.case}"] = ArrayGroup(
            _marched(solution, marched), content=MARCHED, case=one.case
        )
    for name, performance in solution.performances.items():
        case = Case(stiffness=name)
        for branch in performance.branches:
            at = replace(case, branch=branch.name, mode=branch.mode)
            out[f"performance {at}"] = ArrayGroup(_branch(branch), content=PERFORMANCE, case=at)
        out[f"highest peak {name}"] = ArrayGroup(_highest(performance), content=HIGHEST, case=case)
    for band in solution.bands:
        out[f"band {band.curve.case}"] = ArrayGroup(
            _band(solution, band), content=BAND, case=band.curve.case
        )
    for content, followed in ((SPREAD, solution.spreads), (HARMONICS, solution.harmonics)):
        for name, found in followed.items():
            out[f"{content} {name}"] = ArrayGroup(
                _again(content, found), content=content, case=Case(stiffness=name)
            )
    measured = measured_peaks(solution.plan)
    if measured and out:
        source = ", ".join(dict.fromkeys(one.source for one in measured))
        frequency = (
            ("peak",),
            np.array([one.value for one in measured]),
            {**_HZ, "source": source},
        )
        out["measured peaks"] = ArrayGroup({"frequency": frequency}, content=MEASURED)
    return out


def _points(model: Model) -> Variables:
    law, (along, up) = model.contacts.law, measures.place(model)
    return {
        "position": (("contact_point", "component"), model.position, {"units": "mm"}),
        "face": (("contact_point",), model.face, {"flag_meanings": "left right"}),
        "k_n": (("contact_point",), law.k_n, {"units": "N/mm"}),
        "k_t": (("contact_point",), law.k_t, {"units": "N/mm"}),
        "along": (
            ("contact_point",),
            along,
            {"units": "mm", "long_name": "place along the damper"},
        ),
        "up": (
            ("contact_point",),
            up,
            {"units": "mm", "long_name": "place up the slope, from the lowest point of the face"},
        ),
        "static_force": (
            ("contact_point", "static_component"),
            np.column_stack([law.preload, model.traction]),
            {"units": "N", "long_name": "before vibration: normal force, then tractions"},
        ),
    }


def _nodes(solution: ForcedSolution, name: str) -> Variables:
    """Nodes of whole faces, in the variables of contact points without springs."""
    of, places = solution.faces[name].of, faces_places(solution, name)
    mm, at = {"units": "mm"}, ("contact_point",)
    return {
        "position": ((*at, "component"), of.position, mm),
        "face": (at, places.face, {"flag_meanings": "left right"}),
        "along": (at, places.along, mm | {"long_name": "place along the damper"}),
        "up": (
            at,
            places.up,
            mm | {"long_name": "place up the slope, from the lowest point of the face"},
        ),
        "area": (at, places.weight, {"units": "mm2"}),
    }


def _complex(H: Any) -> tuple[tuple[str, str], Any, dict[str, str]]:
    return (
        ("frequency", "part"),
        np.stack([H.real, H.imag], axis=-1),
        {"units": "(m/s2)/N", "part": "real imaginary"},
    )


def _linear(solution: ForcedSolution, linear: LinearCurves) -> Variables:
    excited = excitation_of(solution.plan.scene.excitation)
    told = {} if excited.usual else {"excitation": excited.words}
    out: Variables = {"frequency": (("frequency",), linear.frequency, _HZ | told)}
    for kind, curves, peaks in (
        ("free", linear.free, linear.free_peaks),
        ("stuck", linear.stuck, linear.stuck_peaks),
    ):
        for side in SIDES:
            out |= {f"accelerance_{kind}_{side}": _complex(curves[side])}
            out |= _peaks(f"{kind}_{side}", peaks[side])
    x = [m for m in linear.modes if m.axis == "x"]
    damping = (
        (),
        np.array(solution.plan.scene.excitation.damping),
        {"units": "1", "long_name": "modal damping ratio"},
    )
    return out | {
        "stuck_mode": (("mode",), np.array([m.frequency for m in x]), _HZ),
        "damping": damping,
    }


def _peaks(name: str, peaks: Sequence[PathPeak | ModePeak]) -> Variables:
    """Frequencies and heights of the peaks of a curve, no variables when it has none."""
    if not peaks:
        return {}
    at = (f"peak_{name}",)
    return {
        f"peak_frequency_{name}": (at, np.array([p.frequency for p in peaks]), _HZ),
        f"peak_accelerance_{name}": (at, np.array([p.height for p in peaks]), _PER_N),
    }


def _friction(solution: ForcedSolution, curve: ForcedCurve) -> Variables:
    answer, model, scene = curve.answer, solution.models[curve.stiffness], solution.plan.scene
    fp, at = ("frequency", "contact_point"), solution.marked_points(curve)
    out: Variables = {
        "frequency": (
            ("frequency",),
            answer.frequency,
            _HZ | {"status": answer.status, "message": answer.message},
        ),
        "excitation_force": ((), np.array(curve.force), {"units": "N"}),
        **{f"accelerance_{side}": _complex(curve.accelerance[side]) for side in SIDES},
        **{
            f"accelerance_{side}_harmonic_{k}": _complex(
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
            for key, value in _peaks(side, solution.numbered_peaks(curve, side)).items()
        },
        **_marks(at),
    }
    if scene.wants("contact_state"):
        share = measures.shares(answer, model)
        out["share"] = _share(np.stack([share[side] for side in SIDES], axis=1))
    if scene.wants("damper_motion"):
        attributes = {"units": "mm, rad", "long_name": _amplitude_words(solution)}
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
    return out | _loops(loops, model.face, *measures.place(model))


def _marks(at: Sequence[tuple[int, str, int]]) -> Variables:
    """Which points of a curve are its peaks."""
    return {
        "peak": (
            ("peak",),
            np.array([number for number, *_ in at]),
            {
                "long_name": "number of the peak's mode; 0 is the highest point of a curve without",
                # which mode each is, in the same order: older files have peaks by frequency
                "modes": ", ".join(mode for _, mode, _ in at),
            },
        ),
        "peak_index": (
            ("peak",),
            np.array([i for *_, i in at]),
            {"long_name": "place of the peak in frequency, from 0"},
        ),
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
        "frequency": (on, answer.frequency, _HZ | {"status": answer.status}),
        "excitation_force": ((), np.array(curve.force), {"units": "N"}),
        **{f"accelerance_{side}": _complex(curve.accelerance[side]) for side in SIDES},
        **{
            f"accelerance_{side}_harmonic_{k}": _complex(curve.accelerance_in(k, side))
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
        **_marks(at),
    }
    for side in SIDES:
        out |= _peaks(side, curve.peaks[side])
    return out


def _swept(one: SweptCurve, excited: Excitation) -> Variables:
    """Accelerance of both blades along a sweep, its states, losses, cost and jumps."""
    found, at = one.found, ("frequency",)
    scale = (2.0 * np.pi * excited.lowest * found.frequency) ** 2 * 1e-3 / one.force
    jumped = np.zeros(len(found.frequency), np.int8)
    jumped[list(found.jumps)] = 1
    out: Variables = {
        "frequency": (at, found.frequency, _HZ | {"status": found.status}),
        "excitation_force": ((), np.array(one.force), {"units": "N"}),
        **{f"accelerance_{side}": _complex(one.accelerance[side]) for side in SIDES},
        **{
            f"accelerance_{side}_harmonic_{k}": _complex(one.accelerance_in(k, j, b))
            for j, k in enumerate(excited.harmonics[1:], 1)
            for b, side in enumerate(SIDES)
        },
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
        "jump": (
            at,
            jumped,
            {"units": "1", "long_name": "whether the motion jumps to another after this point"},
        ),
    }
    for k, side in enumerate(SIDES):
        out[f"lowest_{side}"] = (at, scale * found.lowest[:, k], _PER_N)
        out[f"highest_{side}"] = (at, scale * found.highest[:, k], _PER_N)
        out |= _peaks(side, one.peaks[side])
    return out


def _by_sweep(marched: Sequence[MarchedPeak]) -> list[tuple[SweptCurve, list[MarchedPeak]]]:
    """Peaks of every sweep that has some."""
    cases = dict.fromkeys(one.sweep.case for one in marched)
    found = [[one for one in marched if one.sweep.case == case] for case in cases]
    return [(some[0].sweep, some) for some in found]


def _marched(solution: ForcedSolution, found: Sequence[MarchedPeak]) -> Variables:
    """States, losses, loops and the damper's motion at peaks of a sweep, in the variables of a path
    by the balance with these points.
    """
    scene, at, fp = solution.plan.scene, ("frequency",), ("frequency", "contact_point")
    f = np.array([one.frequency for one in found])
    # of a half model each node stands for its image too
    copies = np.array([one.period.copies for one in found])[:, None]
    energy = copies * np.array([one.period.loss for one in found])
    out: Variables = {
        "frequency": (at, f, _HZ),
        "excitation_force": ((), np.array(found[0].sweep.force), {"units": "N"}),
        "state": (
            (*fp, "state"),
            np.array([one.period.share for one in found]),
            {"units": "1", "state": "stick slip lift, shares of the cycle"},
        ),
        "energy": (fp, energy, {"units": "N mm", "long_name": "friction loss per cycle"}),
        "power": (fp, 1e-3 * energy * f[:, None], {"units": "W"}),
        "peak": (
            ("peak",),
            np.array([one.peak.number for one in found]),
            {
                "long_name": "number of the peak's mode",
                "modes": ", ".join(one.peak.mode for one in found),
            },
        ),
        "peak_index": (
            ("peak",),
            np.arange(len(found)),
            {"long_name": "place of the peak in frequency, from 0"},
        ),
    }
    if scene.wants("contact_state"):
        out["share"] = _by_face(out["state"][1], found[0].places)
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
                dofs | {"long_name": _amplitude_words(solution)},
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
    return out | _loops(loops, places.face, places.along, places.up)


def _share(values: Any, mean: str = "stiffness") -> tuple[tuple[str, ...], Any, dict[str, str]]:
    """(frequency, side, state) of the cycle."""
    words = f"stick slip lift, mean over the face by {mean}"
    about = {"units": "1", "side": " ".join(SIDES), "state": words}
    return ("frequency", "side", "state"), values, about


def _by_face(state: Array, places: ContactPlaces) -> tuple[tuple[str, ...], Any, dict[str, str]]:
    """Shares of the cycle of each face from those of its points, (frequency, points, state)."""
    share = np.stack([face_shares(one, places) for one in state])
    return _share(share, "stiffness, or area without springs")


def _amplitude_words(solution: ForcedSolution) -> str:
    k = excitation_of(solution.plan.scene.excitation).lowest
    return f"amplitude of {'the first harmonic' if k == 1 else f'harmonic {k}'}"


def _loops(
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
            _HZ | {"long_name": "the peak each loop belongs to"},
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


def _band(solution: ForcedSolution, band: CurveBand) -> Variables:
    """Lowest and highest of all curves of a band over frequency; peaks of every choice, nan where
    it has none.
    """
    f = grid(solution.plan)
    out: Variables = {"frequency": (("frequency",), f, _HZ)}
    for side in SIDES:
        low, high = envelope(band, f, side)
        out |= {
            f"lowest_{side}": (("frequency",), low, _PER_N),
            f"highest_{side}": (("frequency",), high, _PER_N),
        }
    choices = ", ".join(one.choice for one in band.curves)
    found = [band.peaks(number) for number in band.numbers]
    for name, attribute, unit in (
        ("peak_frequency", "frequency", _HZ),
        ("peak_accelerance", "height", _PER_N),
    ):
        values = [
            [getattr(one.get(c.choice), attribute, np.nan) for c in band.curves] for one in found
        ]
        out[name] = (
            ("peak", "choice"),
            np.array(values, float).reshape(len(found), len(band.curves)),
            unit | {"choices": choices},
        )
    return out | {"peak": (("peak",), np.array(band.numbers, np.int64), {})}


def _branch(branch: Branch) -> Variables:
    return {
        "ratio": (
            ("point",),
            branch.ratio,
            {"units": "1", "long_name": "F_C/F_E", "message": branch.message},
        ),
        "peak_frequency": (("point",), branch.frequency, _HZ),
        "peak_accelerance": (("point",), branch.height, _PER_N),
        "peak_accelerance_lower_sweep": (("point",), branch.least, _PER_N),
        "lift": (
            ("point",),
            branch.lift,
            {"units": "1", "long_name": "share of points and cycle lifted off"},
        ),
    }


def _highest(performance: Performance) -> Variables:
    """The highest of all peaks over F_C/F_E, its least with frequency and height, and the linear
    limits.
    """
    ratio, frequency, height, low = performance.highest
    out: Variables = {
        "free_peak": ((), np.array(performance.free_peak), _PER_N),
        "stuck_peak": ((), np.array(performance.stuck_peak), _PER_N),
    }
    if len(ratio):
        out |= {
            "ratio": (("point",), ratio, {"units": "1", "long_name": "F_C/F_E"}),
            "peak_frequency": (("point",), frequency, _HZ),
            "peak_accelerance": (("point",), height, _PER_N),
            "peak_accelerance_lower_sweep": (("point",), low, _PER_N),
        }
    if performance.optimum is not None:
        units = ({"units": "1", "long_name": "F_C/F_E"}, _HZ, _PER_N)
        names = ("optimum_ratio", "optimum_frequency", "optimum_accelerance")
        out |= {
            name: ((), np.array(value), unit)
            for name, value, unit in zip(names, performance.optimum, units, strict=True)
        }
    return out


def _again(content: str, found: Sequence[PeakAgain]) -> Variables:
    """A peak followed again: NaN where it was not found."""
    choices: Variables = {
        "start": (
            ("choice",),
            np.arange(len(found)),
            {"flag_meanings": " ".join(one.choice for one in found)},
        )
    }
    if content == HARMONICS:
        choices = {
            "highest_harmonic": (("choice",), np.array([int(one.choice) for one in found]), {})
        }
    return choices | {
        "peak_frequency": (("choice",), np.array([one.frequency for one in found]), _HZ),
        "peak_accelerance": (("choice",), np.array([one.height for one in found]), _PER_N),
        "truncation": (("choice",), np.array([one.truncation for one in found]), {"units": "1"}),
        "seconds": (("choice",), np.array([one.seconds for one in found]), {"units": "s"}),
    }


def write_files(solution: ForcedSolution, folder: Path) -> None:
    """Nothing beside the arrays: every figure is drawn from them."""
    del solution, folder
