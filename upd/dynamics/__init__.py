"""Linear dynamics: frequency response of full and reduced models, peaks, damping."""

from upd.dynamics.peaks import Peaks, find_peaks, modulus
from upd.dynamics.response import (
    QUANTITIES,
    LinearResponse,
    ModalSystem,
    converted,
    frequency_response,
    modal_system,
)
from upd.dynamics.tuning import TunedDamping, peak_response, tune_damping

__all__ = [
    "QUANTITIES",
    "LinearResponse",
    "ModalSystem",
    "Peaks",
    "TunedDamping",
    "converted",
    "find_peaks",
    "frequency_response",
    "modal_system",
    "modulus",
    "peak_response",
    "tune_damping",
]
