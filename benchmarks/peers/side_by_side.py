"""Ours and another code on the blade-damper-blade problem, row by row: shared by the benchmarks.

The other code runs in a process of its own, with its own interpreter; it reads the problem as JSON
and writes its curve. Seconds are those of the processor, one thread, the shortest of several runs
after one that compiles: waiting for other work on the machine does not count. The peak of the other
code is its highest point, ours is the one that `peak` climbs to.
"""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from upd.errors import UpdError

# The benchmarks are no package: what they share is found by its folder.
sys.path.append(str(Path(__file__).parents[1]))
import blade_damper_blade as public

HERE = Path(__file__).parent
Row = dict[str, Any]
#: the interpreter of the environment that has the other codes; ours when it is not set
INTERPRETER = "UPD_PEERS"
#: seconds after which another code is stopped
PATIENCE = 900
HARMONICS, SAMPLES, FREQUENCIES, ROUNDS = 5, 256, 300, 3
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
GIVEN = "matrices, loads and start given"


class SideBySideError(UpdError):
    """The other code is there, but gave no curve."""


@dataclass(frozen=True)
class Measured:
    """What one code says: points on the curve, peak in Hz and m, seconds, lines a user writes."""

    points: int
    frequency: float
    peak: float
    seconds: float
    lines: int
    told: str = ""


def interpreter() -> str:
    """The interpreter that runs the other codes: its whole path, links kept as they are."""
    given = os.environ.get(INTERPRETER)
    if not given:
        return sys.executable
    path = str(Path(given).expanduser())
    return str(Path(shutil.which(path) or path).absolute())


def imports(module: str) -> bool:
    """Whether that interpreter exists and finds the module."""
    code = f"import importlib.util as u, sys; sys.exit(u.find_spec({module!r}) is None)"
    try:
        return subprocess.run([interpreter(), "-c", code], capture_output=True).returncode == 0
    except OSError:
        return False


def skipped(name: str, install: str) -> list[Row]:
    """The one row of a code that is not there."""
    return [{"name": name, "case": "skipped", "note": install}]


def problem() -> dict[str, Any]:
    """Everything the other code needs; the start is the linear answer with both contacts stuck.

    Harmonics of the start: rows 0, cos 1, sin 1, cos 2 ... by dofs.
    """
    wedge, K = public.wedge(), public.stiffness()
    normal, tangent = wedge.rows[:, 0], wedge.rows[:, 1]
    k_n, k_t, mu = (float(v[0]) for v in (wedge.law.k_n, wedge.law.k_t, wedge.law.mu))
    springs = K + k_n * normal.T @ normal + k_t * tangent.T @ tangent
    w = 2 * np.pi * public.SWEEP[0]
    q = np.linalg.solve(springs + 1j * w * public.C - w**2 * public.M, public.HARMONIC)
    start = np.zeros((2 * HARMONICS + 1, len(K)))
    start[:3] = np.linalg.solve(springs, public.STATIC), q.real, -q.imag
    arrays = {
        "M": public.M,
        "C": public.C,
        "K": K,
        "normal": normal,
        "tangent": tangent,
        "static": public.STATIC,
        # Re(F exp(i w t)) with F = -i f is f sin(w t)
        "sine": (1j * public.HARMONIC).real,
        "start": start,
    }
    return {
        **{name: array.tolist() for name, array in arrays.items()},
        "k_n": k_n,
        "k_t": k_t,
        "mu": mu,
        "sweep": public.SWEEP,
        "harmonics": HARMONICS,
        "samples": SAMPLES,
        "output": int(np.argmax(public.Y2)),
    }


def code_lines(path: Path, names: tuple[str, ...]) -> int:
    """Lines of code of functions and classes of a file, without blank lines, comments, texts."""
    text = path.read_text(encoding="utf-8")
    kept: set[int] = set()
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name in names:
            first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
            kept |= set(range(first, (node.end_lineno or first) + 1))
            for inner in ast.walk(node):
                if isinstance(inner, ast.Expr) and isinstance(inner.value, ast.Constant):
                    kept -= set(range(inner.lineno, (inner.end_lineno or inner.lineno) + 1))
    lines = text.splitlines()
    return sum(bool(lines[n - 1].split("#")[0].strip()) for n in kept)


def ours() -> Measured:
    """Our curve at as many frequencies."""
    grid = np.linspace(*public.SWEEP, FREQUENCIES)
    seconds = []
    with threadpool_limits(1):
        for _ in range(ROUNDS + 1):
            begin = time.process_time()
            answer = public.response(grid, HARMONICS, SAMPLES)
            seconds.append(time.process_time() - begin)
    lines = code_lines(Path(public.__file__), ("wedge", "response"))
    frequency, peak = answer.peak(public.Y2)
    points = len(answer.frequency)
    return Measured(points, frequency, peak, min(seconds[1:]), lines, answer.status)


def theirs(script: Path, names: tuple[str, ...], *arguments: str) -> Measured:
    """The curve of a script beside this file; `names` is what a user writes of it.

    Raises SideBySideError when it ended without a curve over the whole range.
    """
    found = answer_of(script, problem(), *arguments)
    points = list(zip(found["frequency"], found["amplitude"], strict=True))
    return measured(points, found["seconds"], code_lines(script, names), found["version"])


def answer_of(script: Path, given: Mapping[str, Any], *arguments: str) -> dict[str, Any]:
    """What a script beside this file answers to a problem.

    Raises SideBySideError when it ended without an answer.
    """
    # pyHarm leaves a folder where it runs.
    with tempfile.TemporaryDirectory(prefix="upd-peers-") as folder:
        try:
            done = subprocess.run(
                [interpreter(), str(script), *arguments],
                input=json.dumps(given),
                cwd=folder,
                env={**os.environ, **ONE_THREAD},
                capture_output=True,
                text=True,
                timeout=PATIENCE,
            )
        except subprocess.TimeoutExpired:
            raise SideBySideError(f"{script.name} was stopped after {PATIENCE} s") from None
    if done.returncode != 0:
        raise SideBySideError(f"{script.name} ended with: {' '.join(done.stderr.split())[-300:]}")
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def measured(
    points: list[tuple[float, float]], seconds: float, lines: int, told: str = ""
) -> Measured:
    """What a curve of (Hz, m) says.

    Raises SideBySideError when it does not reach the end of the range.
    """
    f, a = np.array(points).T
    if f[-1] < public.SWEEP[1]:
        raise SideBySideError(f"the curve stopped at {f[-1]:.2f} Hz")
    i = int(np.argmax(a))
    return Measured(len(f), float(f[i]), float(a[i]), seconds, lines, told)


def rows(others: Mapping[str, tuple[Measured, str]], own: Measured) -> Iterator[Row]:
    """Peak, seconds a point and lines of all codes, and how many times longer the others take.

    `others`: name -> what it says, and which lines are counted.
    """
    told_own = f"contacts and call; {GIVEN}"
    for code, (found, told) in {**others, "upd": (own, told_own)}.items():
        apart = 100 * (found.peak / public.PEAK[1] - 1)
        yield {
            "name": "track_peak",
            "case": code,
            "value": f"{1e6 * found.peak:.5g}",
            "unit": "um",
            "target": f"{1e6 * public.PEAK[1]:.5g}",
            "note": f"{'peak' if code == 'upd' else 'highest point'} at {found.frequency:.2f} Hz, "
            f"{apart:+.2f} % from 15 harmonics, which peak at {public.PEAK[0]:.2f} Hz",
        }
        yield {
            "name": "time_point",
            "case": f"{code}, harmonics 0 to {HARMONICS}, {SAMPLES} samples",
            "value": 1e3 * found.seconds / found.points,
            "unit": "ms",
            "note": f"processor, one thread; {found.points} points in {found.seconds:.2f} s"
            + (f"; {found.told}" if found.told else ""),
        }
        yield {"name": "lines_of_a_user", "case": code, "value": found.lines, "note": told}
    for code, (found, _) in others.items():
        ratio = found.seconds / found.points / (own.seconds / own.points)
        yield {"name": "ratio_time_point", "case": f"{code} / upd", "value": ratio, "unit": "times"}
