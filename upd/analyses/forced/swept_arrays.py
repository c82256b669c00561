"""Arrays of sweeps by time march and of what the contact does at their peaks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upd.analyses.forced.array_parts import (
    HZ,
    N_LOOPS,
    PER_N,
    Variables,
    amplitude_words,
    complex_array,
    loop_arrays,
    peak_arrays,
    shares_by_face,
)
from upd.analyses.forced.curves import SweptCurve
from upd.analyses.forced.excitation import Excitation
from upd.analyses.forced.marched_peaks import marched_damper, marched_loops
from upd.analyses.forced.solution import ForcedSolution, MarchedPeak
from upd.scene.forced_contact import SIDES


def swept_arrays(one: SweptCurve, excited: Excitation) -> Variables:
    """Accelerance of both blades along a sweep, its states, losses and cost."""
    found, at = one.found, ("frequency",)
    scale = (2.0 * np.pi * excited.lowest * found.frequency) ** 2 * 1e-3 / one.force
    out: Variables = {
        "frequency": (at, found.frequency, HZ | {"status": found.status}),
        "excitation_force": ((), np.array(one.force), {"units": "N"}),
        **{f"accelerance_{side}": complex_array(one.accelerance[side]) for side in SIDES},
        **{
            f"accelerance_{side}_harmonic_{k}": complex_array(one.accelerance_in(k, j, b))
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
    scene, at, fp = solution.plan.scene, ("frequency",), ("frequency", "contact_point")
    f = np.array([one.frequency for one in found])
    # of a half model each node stands for its image too
    copies = np.array([one.period.copies for one in found])[:, None]
    energy = copies * np.array([one.period.loss for one in found])
    out: Variables = {
        "frequency": (at, f, HZ),
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
