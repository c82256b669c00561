"""Side by side with the Octave original of the blade-damper-blade problem (N. Balaji, "nonuniq").

Seconds for one forced response.

Runs when `octave` is installed and UPD_NONUNIQ names the script that computes the curve, in a copy
of the original scripts; their licence and layout are theirs, so nothing of them is kept here.
Otherwise one row says why not, beside the printed time.

UPD_NONUNIQ=~/nonuniq/SCRIPT.m python benchmarks/peers/bench_octave_response.py
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parents[1]))
import blade_damper_blade as public

Row = dict[str, Any]
SCRIPT = "UPD_NONUNIQ"
#: seconds after which the original is stopped
PATIENCE = 600
HARMONICS, SAMPLES = 5, 256


def missing() -> str:
    """Why the original cannot run here, empty when it can."""
    if shutil.which("octave") is None:
        return "octave is not on the path: apt-get install octave"
    given = os.environ.get(SCRIPT)
    if not given:
        return (
            f"{SCRIPT} is not set: let it name the script of the original that computes the curve"
        )
    return "" if Path(given).is_file() else f"{SCRIPT} names {given}, which is no file"


def printed(why: str) -> Row:
    """The printed time of the original."""
    case = f"blade-damper-blade, {public.OCTAVE_POINTS} frequencies, as printed"
    return {
        "name": "time_octave",
        "case": case,
        "value": public.OCTAVE_SECONDS,
        "unit": "s",
        "note": why,
    }


def original(script: Path) -> tuple[float, str]:
    """Seconds of the script in a fresh Octave without windows, its start taken off.

    What went wrong, empty if nothing.
    """
    start = run_octave("1;", script.parent)[0]
    seconds, fault = run_octave(f"run('{script.name}')", script.parent)
    return seconds - start, fault


def run_octave(command: str, folder: Path) -> tuple[float, str]:
    """Seconds of a command in Octave, and the end of its error output when it failed."""
    begin = time.perf_counter()
    try:
        done = subprocess.run(
            ["octave", "--no-gui", "--quiet", "--no-init-file", "--eval", command],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
    except subprocess.TimeoutExpired:
        return float(PATIENCE), f"stopped after {PATIENCE} s"
    return time.perf_counter() - begin, "" if done.returncode == 0 else " ".join(
        done.stderr.split()
    )[-200:]


def ours() -> tuple[float, Row]:
    """The same sweep with as many frequencies, after compilation: the shortest of three."""
    grid = np.linspace(*public.SWEEP, public.OCTAVE_POINTS)
    seconds = []
    for _ in range(4):
        begin = time.perf_counter()
        answer = public.response(grid, HARMONICS, SAMPLES)
        seconds.append(time.perf_counter() - begin)
    frequency, peak = answer.peak(public.Y2)
    case = (
        f"blade-damper-blade, {public.OCTAVE_POINTS} frequencies, harmonics 0 to {HARMONICS}, "
        f"{SAMPLES} samples"
    )
    told = (
        f"{len(answer.frequency)} points, {answer.status}; peak {peak:.4e} m at {frequency:.2f} Hz"
    )
    return min(seconds[1:]), {
        "name": "time_upd",
        "case": case,
        "value": min(seconds[1:]),
        "unit": "s",
        "note": told,
    }


def run() -> list[Row]:
    """Rows of the benchmark; what is skipped says so."""
    best, row = ours()
    why = missing()
    if why:
        return [printed(f"skipped, not measured here: {why}"), row]
    took, fault = original(Path(os.environ[SCRIPT]).expanduser().resolve())
    if fault:
        return [printed(f"failed here: {fault}"), row]
    told = (
        "whole script as found, figures included; its harmonics and samples are those written in it"
    )
    return [
        printed("for comparison"),
        {
            "name": "time_octave",
            "case": "blade-damper-blade, this machine",
            "value": took,
            "unit": "s",
            "note": told,
        },
        row,
        {
            "name": "speedup_octave",
            "case": "original / ours, this machine",
            "value": took / best,
            "unit": "times",
        },
    ]


if __name__ == "__main__":
    for line in run():
        print(line)
