"""Contact stiffness of both dampers.

Shipped scenes against the thesis, and seconds of the commands.
"""

from __future__ import annotations

import resource
import subprocess
import tempfile
import time
from typing import Any

import upd
from upd.report.notebook import RunResult

_SECONDS = {"symmetric": 30, "asymmetric": 60}


def run() -> list[dict[str, Any]]:
    """Rows of the benchmark."""
    rows: list[dict[str, Any]] = []
    for scene in _SECONDS:
        result = upd.run(scene)
        rows += _against_thesis(scene, result)
        rows.append(_command(scene))
    return rows


def _against_thesis(scene: str, result: RunResult) -> list[dict[str, Any]]:
    first = next(r.case for r in result.rows if r.name == "K_N_secant_raw")
    return [
        {
            "name": f"track_{r.name}",
            "case": f"{scene}, {r.case}",
            "value": r.value,
            "unit": r.unit,
            "target": r.reference,
            "note": f"{100 * (r.error or 0.0):+.1f} % of the {r.source}",
        }
        for r in result.rows
        if r.case == first and r.name in ("K_N_secant_raw", "K_Tx_initial_raw", "K_Ty_initial_raw")
    ]


def _command(scene: str) -> dict[str, Any]:
    """Seconds of the command a user types, start of Python, figures and files included, and its
    peak memory.
    """
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        subprocess.run(["upd", "run", scene, "--out", folder], check=True, capture_output=True)
        took = time.perf_counter() - begin
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
    return {
        "name": f"time_command_{scene}",
        "case": f"upd run {scene}",
        "value": took,
        "unit": "s",
        "target": _SECONDS[scene],
        "note": f"at most {memory:.2g} GB",
    }


if __name__ == "__main__":
    for row in run():
        print(row)
