"""Numbers of peaks and of the damper's motion, whichever way a curve was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Array
from upd.analyses.forced.printed import MEASURED_PEAK, printed_of
from upd.analyses.forced.solution import ForcedSolution
from upd.results import Case, Result
from upd.scene.forced_contact import Side

#: how numbers of the left blade begin
LEFT = "left_"
_DAMPER = ("x", "y", "z")


def peak_results(solution: ForcedSolution, case: Case, peaks: Sequence[ModePeak]) -> list[Result]:
    """Numbered peaks of the right blade; measured frequencies go to the nearest, each once."""
    found = printed_of(solution.plan)(MEASURED_PEAK, case.given())
    nearest = (
        {int(np.argmin([abs(peak.frequency - p.value) for peak in peaks])): p for p in found}
        if peaks
        else {}
    )
    results = []
    for k, peak in enumerate(peaks):
        one, name, mine = nearest.get(k), f"peak_{peak.number}", replace(case, mode=peak.mode)
        reference, source = (one.value, one.source) if one is not None else (None, "")
        results += [
            Result(f"{name}_frequency", mine, peak.frequency, "Hz", reference, source, exact=False),
            Result(f"{name}_accelerance", mine, peak.height, "(m/s2)/N"),
        ]
        if not case.kind:
            results.append(Result(f"{name}_mac", mine, peak.mac, ""))
    return results


def left_peak_results(case: Case, peaks: Sequence[ModePeak]) -> list[Result]:
    """Numbered peaks of the left blade, which without a force of its own only the damper moves."""
    results = []
    for peak in peaks:
        name, mine = f"left_peak_{peak.number}", replace(case, mode=peak.mode)
        results += [
            Result(f"{name}_frequency", mine, peak.frequency, "Hz"),
            Result(f"{name}_accelerance", mine, peak.height, "(m/s2)/N"),
        ]
    return results


def reduction_name(blade: Side) -> str:
    """Name of the number that tells how far a blade's highest peak is below its free one."""
    return f"{LEFT * (blade == 'left')}reduction_of_free_peak"


def highest_in_harmonic(case: Case, f: Array, size: Array, k: int, blade: Side) -> list[Result]:
    """Highest point in harmonic k, of a curve whose harmonic that is read has the numbered
    peaks.
    """
    top = max(measures.path_maxima(f, size), key=lambda p: p.height, default=None)
    i = int(size.argmax())
    at, height = (float(f[i]), float(size[i])) if top is None else top[:2]
    name = f"{LEFT * (blade == 'left')}harmonic_{k}"
    return [
        Result(f"{name}_frequency", case, at, "Hz"),
        Result(f"{name}_accelerance", case, height, "(m/s2)/N"),
    ]


def whole_contact_results(case: Case, share: Array, energy: float) -> list[Result]:
    """States and friction loss of the whole contact.

    Parameters
    ----------
    share
        (3,) of lift, stick and slip.
    energy
        N mm a period.
    """
    told = dict(zip(("lift", "stick", "slip"), share, strict=True))
    return [
        *(
            Result(f"share_{name}", case, 100.0 * float(told[name]), "%")
            for name in ("stick", "slip", "lift")
        ),
        Result("friction_energy", case, float(energy), "N mm"),
    ]


def motion_results(case: Case, static: Array, amplitude: Array) -> list[Result]:
    """Translations and rotations of the damper, (6,) mm and rad each: mean and amplitude."""
    results, names = [], [f"damper_{kind}{axis}" for kind in "ur" for axis in _DAMPER]
    both = np.maximum(np.abs(static), np.abs(amplitude))
    # motions that symmetry forbids are rounding
    least = np.repeat([both[:3].max(), both[3:].max()], 3) * np.sqrt(np.finfo(float).eps)
    for part, values in (("", amplitude), ("_static", static)):
        shown = np.flatnonzero(np.abs(values) > least)
        results += [
            Result(f"{names[k]}{part}", case, 1e3 * float(values[k]), "um" if k < 3 else "mrad")
            for k in shown
        ]
    return results
