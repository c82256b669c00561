"""Linear dynamics: frequency response of full and reduced models, peaks, damping."""

from upd.dynamics.peaks import Peaks, find_peaks
from upd.dynamics.response import (
    QUANTITIES,
    LinearResponse,
    ModalSystem,
    frequency_response,
    modal_system,
    peak_response,
    tune_damping,
)

__all__ = [
    "QUANTITIES",
    "LinearResponse",
    "ModalSystem",
    "Peaks",
    "find_peaks",
    "frequency_response",
    "modal_system",
    "peak_response",
    "tune_damping",
]
