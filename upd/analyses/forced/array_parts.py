"""What arrays of a forced response are made of: contents, units, peaks, shares, loops."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.marched_peaks import face_shares
from upd.analyses.forced.measures import PathPeak
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Array
from upd.analyses.forced.solution import ContactPlaces, ForcedSolution
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


def peak_arrays(name: str, peaks: Sequence[PathPeak | ModePeak]) -> Variables:
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
