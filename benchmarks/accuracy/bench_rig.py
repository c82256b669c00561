"""The shipped rig scene.

Frequencies against the thesis, reduction against the full model, seconds of the command.
"""

from __future__ import annotations

import resource
import subprocess
import tempfile
import time
from typing import Any

import upd


def run() -> list[dict[str, Any]]:
    """Rows of the benchmark."""
    result = upd.run("rig", overrides={"want": ["free", "glued", "reduction"]})
    rows: list[dict[str, Any]] = []
    for r in result.rows:
        if r.error is not None and r.name.startswith("f"):
            target = "0.03" if r.name.endswith("_reduced") else "0.5"
            note = f"{r.value:.2f} Hz, {r.source}"
            rows.append(
                {
                    "name": f"track_{r.name}",
                    "case": r.case,
                    "value": 100.0 * r.error,
                    "unit": "%",
                    "target": target,
                    "note": note,
                }
            )
    return [*rows, _command()]


def _command() -> dict[str, Any]:
    """Seconds of the command a user types, start of Python, figures and files included, and its
    peak memory.
    """
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        subprocess.run(["upd", "run", "rig", "--out", folder], check=True, capture_output=True)
        took = time.perf_counter() - begin
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
    return {
        "name": "time_command_rig",
        "case": "upd run rig",
        "value": took,
        "unit": "s",
        "target": 60,
        "note": f"at most {memory:.2g} GB",
    }


if __name__ == "__main__":
    for row in run():
        print(row)
