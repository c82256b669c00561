"""A fit as plain numbers, for fit.json and summary.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from upd.cache.sources import versions
from upd.fitting.fitted_inputs import FittedCurve, FittedInputs
from upd.fitting.tables import interval, on_bound, verdict


def _curve(one: FittedCurve) -> dict[str, Any]:
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


def _input(found: FittedInputs, k: int) -> dict[str, Any]:
    one, ends, error = found.parameters[k], interval(found, k), found.known.error
    factor = math.exp(found.answers[0][k])
    return {
        "inputs": list(one.paths),
        "unit": one.unit,
        "scene": list(one.values),
        "fitted": [value * factor for value in one.values],
        "factor": factor,
        "factor_bounds": [one.low, one.high],
        "at_bound": on_bound(found, k),
        "factor_fits_as_well": None if ends is None else [math.exp(z) for z in ends],
        "ln_factor_half_width": None if error is None or not found.widths else float(error[k]),
        "exact_derivative": found.exact[k],
    }


def plain_numbers(found: FittedInputs) -> dict[str, Any]:
    """All numbers with their units."""
    known = found.known
    return {
        "scene": found.source.name,
        "stiffness": found.stiffness,
        "verdict": verdict(found),
        "status": found.status,
        "targets": [
            {
                "name": one.name,
                "unit": one.unit,
                "target": one.value,
                "half_width": one.half_width,
                "fitted": float(number),
                "derivatives_by_ln_factor": slope.tolist(),
            }
            for one, number, slope in zip(found.targets, found.numbers, found.slopes, strict=True)
        ],
        "curves": [_curve(one) for one in found.measured],
        "parameters": [_input(found, k) for k in range(len(found.parameters))],
        "answers_factors": [np.exp(z).tolist() for z in found.answers],
        "what_targets_tell": {
            "residual": "half-widths" if found.widths else "relative to the target",
            "singular_values_bound_to_bound": known.singular.tolist(),
            "directions_ln_factor": known.directions.tolist(),
            "unknown": known.unknown.tolist(),
        },
        "correlation": None if known.correlation is None else known.correlation.tolist(),
        "profiles": [
            {
                "moved": list(found.parameters[one.parameter].paths),
                "factors": np.exp(one.z).tolist(),
                "ends_at_bounds": list(one.bounded),
            }
            for one in found.profiles
        ],
        "misfit_rises_at_first_order_ends": None
        if known.rises is None
        else [[_finite(rise) for rise in row] for row in known.rises.tolist()],
        "further_measurements": [asdict(one) for one in found.further],
        "starts": [
            {
                "begin_factors": np.exp(one.begin).tolist(),
                "end_factors": np.exp(one.end).tolist(),
                "misfit": _finite(one.misfit),
                "evaluations": one.evaluations,
                "failure": one.failure,
            }
            for one in found.starts
        ],
        "models_solved": found.evaluations,
        "seconds": round(found.seconds, 3),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def summary(found: FittedInputs, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """What stands in summary.json: fitted inputs and numbers as results, checks, cost.

    Parameters
    ----------
    found : FittedInputs
        Of the fit.
    numbers : dict
        Of fit.json.
    """
    results = []
    for one in numbers["parameters"]:
        low, high = one["factor_fits_as_well"] or (None, None)
        for path, value, fitted in zip(one["inputs"], one["scene"], one["fitted"], strict=True):
            ends = {"low": low and value * low, "high": high and value * high}
            results.append({"name": path, "value": fitted, "unit": one["unit"], **ends})
    for one in numbers["targets"]:
        same = {"name": one["name"], "unit": one["unit"], "reference": one["target"]}
        results.append({**same, "value": one["fitted"]})
    checks: list[dict[str, Any]] = [
        {"name": "targets met", "passed": found.status != "not reached"},
        *(
            {
                "name": f"independent errors, {one.target.name}",
                "passed": one.noise.white,
                "value": one.noise.correlation,
                "limit": one.noise.limit,
            }
            for one in found.measured
        ),
    ]
    return {
        "analysis": "fit",
        "scene": found.source.name,
        "title": found.source.title,
        "status": found.status,
        "verdict": verdict(found),
        "results": results,
        "checks": checks,
        "further_measurements": numbers["further_measurements"],
        "cost": {"total_s": numbers["seconds"], "models": found.evaluations},
        "versions": versions(),
    }
