"""Errors and seconds of the shipped Hertz scene.

Full model, mirror symmetry, and what each effect left out saves.
"""

from __future__ import annotations

import resource
import subprocess
import tempfile
import time
from typing import Any

import numpy as np

import upd
from upd.report.notebook import RunResult

# name, case prefix -> largest |error| asked for
TARGETS = {
    "max_pressure": 0.006,
    "mean_pressure": 0.02,
    "radius_moment": 0.006,
    "approach": 0.02,
    "tangential_displacement": 0.03,
    "K_T_over_K_N": 0.03,
    "cycle_energy": 0.03,
}


def _errors(result: RunResult, name: str) -> tuple[str, float]:
    worst = max(
        (r for r in result.rows if r.name == name and r.error is not None),
        key=lambda r: abs(r.error or 0.0),
    )
    return worst.case, 100.0 * float(worst.error or 0.0)


def run() -> list[dict[str, Any]]:
    """Rows of the benchmark."""
    upd.run(
        "hertz", overrides=["geometry.divisions=8"]
    )  # imports and caches, so that the first timing is fair
    full = upd.run("hertz", overrides=["mesh.symmetry=full"])
    quarter = upd.run("hertz")
    rows: list[dict[str, Any]] = []
    for name, target in TARGETS.items():
        case, error = _errors(full, name)
        rows.append(
            {
                "name": f"track_error_{name}",
                "case": f"full, {case}",
                "value": error,
                "unit": "%",
                "target": f"{100 * target:g}",
            }
        )
    misfit = max(r.value for r in full.rows if r.name == "traction_misfit_L2")
    rows.append(
        {
            "name": "track_traction_misfit_L2",
            "case": "full, worst load",
            "value": 100 * misfit,
            "unit": "%",
            "target": "5",
        }
    )
    both = {(r.name, r.case): r.value for r in full.rows}
    difference = max(
        abs(r.value / both[r.name, r.case] - 1.0)
        for r in quarter.rows
        if both.get((r.name, r.case))
    )
    rows.append(
        {
            "name": "track_quarter_against_full",
            "case": "worst number",
            "value": difference,
            "unit": "",
            "target": "1e-6",
        }
    )
    rows.append(_command())
    return [*rows, _fine_traction(), *_left_out(full)]


def _command() -> dict[str, Any]:
    """Seconds of the command a user types, start of Python, figures and files included, and its
    peak memory.
    """
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        subprocess.run(["upd", "run", "hertz", "--out", folder], check=True, capture_output=True)
        took = time.perf_counter() - begin
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
    return {
        "name": "time_command_hertz",
        "case": "upd run hertz",
        "value": took,
        "unit": "s",
        "target": 10,
        "note": f"at most {memory:.2g} GB",
    }


def _fine_traction() -> dict[str, Any]:
    """Traction against Cattaneo and Mindlin's where the slip annulus is resolved.

    28 nodes along the contact radius.
    """
    settings = {
        "want": ["tangential"],
        "loads.normal": ["200 N"],
        "geometry.patch": "auto",
        "geometry.divisions": 72,
    }
    misfit = max(
        r.value for r in upd.run("hertz", overrides=settings).rows if r.name == "traction_misfit_L2"
    )
    return {
        "name": "track_traction_misfit_L2",
        "case": "F=200 N, 72 divisions, worst load",
        "value": 100 * misfit,
        "unit": "%",
        "target": "5",
    }


def _left_out(full: RunResult) -> list[dict[str, Any]]:
    """Seconds of the full run over seconds without one effect: what leaving it out saves."""
    whole = float(full.cost["total_s"])
    cases = {
        "mirror symmetry used": [],
        "no friction": ["mesh.symmetry=full", "contact.friction=0"],
        "no internal displacement": [
            "mesh.symmetry=full",
            'want=["normal", "curve", "tangential", "cycle"]',
        ],
        "no load curve": [
            "mesh.symmetry=full",
            'want=["normal", "stiffness", "body_compression", "tangential", "cycle", "fields"]',
        ],
        "normal contact only, with symmetry": ['want=["normal"]'],
        "patch sized from the load": [
            "geometry.patch=auto",
            "geometry.divisions=20",
            "mesh.symmetry=full",
        ],
    }
    rows = []
    for label, overrides in cases.items():
        took = float(np.min([upd.run("hertz", overrides=overrides).cost["total_s"]]))
        rows.append(
            {
                "name": "time_saved",
                "case": label,
                "value": whole / took,
                "unit": "times",
                "note": f"{took:.1f} s instead of {whole:.1f} s",
            }
        )
    # The other way round: an effect switched on.
    two = float(upd.run("hertz", overrides=["contact.directions=2"]).cost["total_s"])
    rows.append(
        {
            "name": "time_added",
            "case": "slip in two directions",
            "value": two / whole,
            "unit": "times",
            "note": f"{two:.1f} s instead of {whole:.1f} s",
        }
    )
    return rows


if __name__ == "__main__":
    for row in run():
        print(row)
