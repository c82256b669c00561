"""Measured curves beside the computed ones of any analysis: numbers, checks, arrays, figures."""

from upd.analyses.measured.compare import (
    FREE,
    STUCK,
    Computed,
    accelerance_array,
    fit_checks,
    measured_arrays,
    measured_results,
)

__all__ = [
    "FREE",
    "STUCK",
    "Computed",
    "accelerance_array",
    "fit_checks",
    "measured_arrays",
    "measured_results",
]
