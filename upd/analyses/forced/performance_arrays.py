"""Arrays of peaks over F_C/F_E and of peaks followed again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upd.analyses.forced.array_parts import HARMONICS, HZ, PER_N, Variables
from upd.analyses.forced.performance_curve import Branch, Performance
from upd.analyses.forced.solution import PeakAgain


def branch_arrays(branch: Branch) -> Variables:
    """One peak over F_C/F_E."""
    return {
        "ratio": (
            ("point",),
            branch.ratio,
            {"units": "1", "long_name": "F_C/F_E", "message": branch.message},
        ),
        "peak_frequency": (("point",), branch.frequency, HZ),
        "peak_accelerance": (("point",), branch.height, PER_N),
        "peak_accelerance_lower_sweep": (("point",), branch.least, PER_N),
        "lift": (
            ("point",),
            branch.lift,
            {"units": "1", "long_name": "share of points and cycle lifted off"},
        ),
    }


def highest_arrays(performance: Performance) -> Variables:
    """The highest of all peaks over F_C/F_E, its least with frequency and height, and the linear
    limits.
    """
    ratio, frequency, height, low = performance.highest
    out: Variables = {
        "free_peak": ((), np.array(performance.free_peak), PER_N),
        "stuck_peak": ((), np.array(performance.stuck_peak), PER_N),
    }
    if len(ratio):
        out |= {
            "ratio": (("point",), ratio, {"units": "1", "long_name": "F_C/F_E"}),
            "peak_frequency": (("point",), frequency, HZ),
            "peak_accelerance": (("point",), height, PER_N),
            "peak_accelerance_lower_sweep": (("point",), low, PER_N),
        }
    if performance.optimum is not None:
        units = ({"units": "1", "long_name": "F_C/F_E"}, HZ, PER_N)
        names = ("optimum_ratio", "optimum_frequency", "optimum_accelerance")
        out |= {
            name: ((), np.array(value), unit)
            for name, value, unit in zip(names, performance.optimum, units, strict=True)
        }
    return out


def again_arrays(content: str, found: Sequence[PeakAgain]) -> Variables:
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
        "peak_frequency": (("choice",), np.array([one.frequency for one in found]), HZ),
        "peak_accelerance": (("choice",), np.array([one.height for one in found]), PER_N),
        "truncation": (("choice",), np.array([one.truncation for one in found]), {"units": "1"}),
        "seconds": (("choice",), np.array([one.seconds for one in found]), {"units": "s"}),
    }
