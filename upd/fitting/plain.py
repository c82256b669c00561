"""A fit as plain numbers."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from upd.fitting.found import FittedCurve, FittedInputs
from upd.fitting.words import headline, interval, on_bound, outside


def _curve_numbers(one: FittedCurve) -> dict[str, Any]:
    of, noise = one.target.curve, one.noise
    H, computed = of.accelerance, one.computed
    return {
        "name": one.target.name,
        "file": str(of.source),
        "blade": of.blade,
        "state": of.state,
        "centrifugal_to_force": of.force_ratio,
        "unit": "(m/s2)/N",
        "half_width_relative": noise.relative,
        "half_width_constant": noise.constant,
        "half_width_estimated": noise.estimated,
        "off_relative_rms": one.off,
        "residuals_rms_half_widths": noise.rms,
        "correlation_of_neighbours": noise.correlation,
        "frequency_Hz": of.frequency.tolist(),
        "measured_real": np.real(H).tolist(),
        "measured_imaginary": np.imag(H).tolist() if of.is_complex else None,
        "fitted_real": computed.real.tolist(),
        "fitted_imaginary": computed.imag.tolist() if of.is_complex else None,
    }


def plain_numbers(found: FittedInputs) -> dict[str, Any]:
    """All numbers with their units, for JSON."""
    known = found.known
    widths = found.widths
    return {
        "scene": found.source.name,
        "stiffness": found.stiffness,
        "verdict": headline(found),
        "status": found.status,
        "targets": [
            {
                "name": one.name,
                "unit": one.unit,
                "target": one.value,
                "half_width": one.half_width,
                "fitted": float(found.numbers[i]),
                "derivatives_by_ln_factor": found.slopes[i].tolist(),
            }
            for i, one in enumerate(found.targets)
        ],
        "curves": [_curve_numbers(one) for one in found.measured],
        "parameters": [
            {
                "inputs": list(one.paths),
                "unit": one.unit,
                "scene": list(one.values),
                "fitted": [v * math.exp(found.answers[0][k]) for v in one.values],
                "factor": math.exp(found.answers[0][k]),
                "factor_bounds": [one.low, one.high],
                "at_bound": on_bound(found, k),
                "factor_fits_as_well": None
                if (ends := interval(found, k)) is None
                else [math.exp(z) for z in ends],
                "ln_factor_half_width": float(known.error[k])
                if known.error is not None and widths
                else None,
                "exact_derivative": found.exact[k],
            }
            for k, one in enumerate(found.parameters)
        ],
        "answers_factors": [np.exp(z).tolist() for z in found.answers],
        "what_targets_tell": {
            "residual": "half-widths" if widths else "relative to the target",
            "singular_values_bound_to_bound": known.singular.tolist(),
            "directions_ln_factor": known.directions.tolist(),
            "unknown": known.unknown.tolist(),
        },
        "correlation": None if known.correlation is None else known.correlation.tolist(),
        "answers_outside_profiles_factors": [np.exp(z).tolist() for z in outside(found)],
        "profiles": [
            {
                "moved": list(found.parameters[one.parameter].paths),
                "factors": np.exp(one.z).tolist(),
                "ends_at_bounds": list(one.bounded),
            }
            for one in found.profiles
        ],
        "misfit_rises_at_first_order_ends": None
        if found.rises is None
        else [[v if np.isfinite(v) else None for v in row] for row in found.rises.tolist()],
        "further_measurements": [asdict(one) for one in found.further],
        "starts": [
            {
                "begin_factors": np.exp(one.begin).tolist(),
                "end_factors": np.exp(one.end).tolist(),
                "misfit": one.misfit if math.isfinite(one.misfit) else None,
                "evaluations": one.evaluations,
                "failure": one.failure,
            }
            for one in found.starts
        ],
        "models_solved": found.evaluations,
        "seconds": round(found.seconds, 3),
    }
