"""Damping from measured free curves: synthetic ones of the small rig, with noise that is a part of
the value, 20 seeds each, 0.05 Hz from point to point.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

import upd

SCENE = Path(upd.__file__).parent / "scenes" / "examples" / "damped_response.toml"
ZETA, STEP, SEEDS = 0.004, 0.05, 20
LOW, HIGH = 310.0, 390.0


def run() -> list[dict[str, Any]]:
    """Rows of the benchmark: worst of all seeds."""
    found = upd.run(
        SCENE,
        overrides={
            "excitation.damping": ZETA,
            "excitation.start": f"{LOW} Hz",
            "excitation.stop": f"{HIGH} Hz",
            "excitation.points": round((HIGH - LOW) / STEP) + 1,
            "excitation.centrifugal_to_force": [1000.0],
            "want": ["response"],
            "left_out.solve": "no",
            "accuracy": "unknown",
        },
    )
    linear = found.arrays["linear own"]
    f, H = linear["frequency"][1], linear["accelerance_free_right"][1] @ [1.0, 1j]
    exact = upd.fit_damping(upd.measured.MeasuredCurve(f, H))
    rows = [
        {
            "name": "damping_without_noise",
            "case": "free right blade",
            "value": 100.0 * abs(exact.zeta[0] / ZETA - 1.0),
            "unit": "%",
            "target": 0.01,
            "note": f"of {100.0 * ZETA:g} %; what modes outside the band leave",
        }
    ]
    for noise in (0.004, 0.02):
        for phase in (True, False):
            rows += _rows(f, H, noise, float(exact.frequency[0]), phase=phase)
    return rows


def _rows(f: Any, H: Any, noise: float, f0: float, *, phase: bool) -> list[dict[str, Any]]:
    begin, fits = time.perf_counter(), []
    for seed in range(SEEDS):
        e = noise * np.random.default_rng(seed).standard_normal((2, len(f)))
        size = np.abs(H)
        values = H + size * (e[0] + 1j * e[1]) if phase else size * (1.0 + e[0])
        fits.append(upd.fit_damping(upd.measured.MeasuredCurve(f, values)))
    seconds = (time.perf_counter() - begin) / SEEDS
    case = f"{100.0 * noise:g} % noise, {'complex' if phase else 'magnitudes'}, {SEEDS} seeds"
    off = np.array([fit.zeta[0] / ZETA - 1.0 for fit in fits])
    error = np.mean([fit.zeta_error[0] for fit in fits]) / ZETA
    hertz = np.array([fit.frequency[0] - f0 for fit in fits])
    return [
        {
            "name": "damping_worst",
            "case": case,
            "value": float(100.0 * np.abs(off).max()),
            "unit": "%",
            "target": 1,
            "note": f"standard deviation {100.0 * off.std():.2g} %, standard error that fits print "
            f"{100.0 * error:.2g} %; {seconds:.2g} s a fit",
        },
        {
            "name": "frequency_worst",
            "case": case,
            "value": float(np.abs(hertz).max()),
            "unit": "Hz",
            "target": 0.01,
        },
    ]


if __name__ == "__main__":
    for row in run():
        print(row)
