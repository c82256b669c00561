"""Measured responses: read from files, compared with computed ones, damping fitted to them."""

from __future__ import annotations

from upd.measured.compare import MeasuredPeak, frac, noisy_peaks
from upd.measured.curve import MeasuredCurve
from upd.measured.damping import DampingFit, fit_damping
from upd.measured.read import read_measured

__all__ = [
    "DampingFit",
    "MeasuredCurve",
    "MeasuredPeak",
    "fit_damping",
    "frac",
    "noisy_peaks",
    "read_measured",
]
