"""Ten modes of the two-blade rig with 300 000 dofs.

Seconds and memory, against one factorisation and scipy's eigsh.

python benchmarks/speed/bench_modes.py            # a few minutes on two cores
python benchmarks/speed/bench_modes.py --quick    # a mesh of 80 000 dofs, without targets

Each measurement has a process of its own: its peak memory is then of nothing else.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh

from upd.errors import UpdError
from upd.fem import Material, mass, stiffness
from upd.linalg import Eigenproblem, factorise
from upd.linalg.inertia import count_modes
from upd.linalg.select import has_pardiso
from upd.mesh.recipes import build_mesh

Row = dict[str, Any]

STEEL = Material(200e3, 0.3, 7.8e-9)
COUNT = 10
#: s and GB
TARGET_SECONDS, TARGET_GB = 60.0, 6.0
LONGEST_S = 1200


@dataclass(frozen=True)
class Case:
    """A mesh of the rig: body, damper, element, refinement."""

    body: str
    damper: str
    element: str
    refine: int


LARGE = Case("rig", "glued", "hex20", 2)
QUICK_LARGE = Case("rig", "glued", "hex8i", 2)


@dataclass(frozen=True)
class Problem:
    """K and M on the free dofs of a clamped body, and the seconds of their assembly."""

    K: csr_array
    M: csr_array
    seconds: float


def assembled(case: Case) -> Problem:
    """The matrices of a case."""
    params = {
        "arrangement": "symmetric",
        "damper": case.damper,
        "element_nodes": 20 if case.element == "hex20" else 8,
    }
    mesh = build_mesh("blade_rig", {**params, "refine": case.refine})[0][case.body]
    begin = perf_counter()
    free = np.ones((mesh.n_node, 3), dtype=bool)
    free[mesh.nodes["clamped"]] = False
    dofs = np.flatnonzero(free)
    K = csr_array(stiffness(mesh, STEEL, case.element)[dofs][:, dofs])
    M = csr_array(mass(mesh, STEEL)[dofs][:, dofs])
    seconds = perf_counter() - begin
    return Problem(K, M, seconds)


def by_modes(problem: Problem) -> Row:
    """Ours with the direct solver, as `upd` chooses it.

    Asked a second time, the factor is there and what is left is Lanczos.
    """
    asked = Eigenproblem(problem.K, problem.M)
    found = asked.modes(count=COUNT)
    peak = peak_bytes()
    lanczos = asked.modes(count=COUNT).seconds
    begin = perf_counter()
    count_modes(asked.K, asked.M, found, COUNT - 2, 0.0, found.solver)
    counting = perf_counter() - begin
    told = f"{found.solver}, {found.message} {found.shown}"
    return {
        "seconds": found.seconds,
        "lanczos": lanczos,
        "counting": counting,
        "peak": peak,
        "frequency": found.frequency.tolist(),
        "told": told,
    }


def by_eigsh(problem: Problem) -> Row:
    """One factorisation, and scipy's Lanczos (ARPACK) with it.

    M in the inner product, one right-hand side at a time.
    """
    begin = perf_counter()
    factor = factorise(problem.K)
    factored = perf_counter()
    n = problem.K.shape[0]
    inverse = LinearOperator((n, n), matvec=factor.solve, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(n)
    value = np.sort(eigsh(problem.K, COUNT, problem.M, sigma=0.0, OPinv=inverse, v0=start)[0])
    frequency = np.sqrt(value) / (2.0 * np.pi)
    told = f"{factor.solver}, {factor.factor_nnz / 1e6:.0f} million factor entries"
    seconds = perf_counter() - begin
    return {
        "seconds": seconds,
        "factorisation": factored - begin,
        "frequency": frequency.tolist(),
        "told": told,
    }


WAYS: dict[str, Callable[[Problem], Row]] = {"modes": by_modes, "eigsh": by_eigsh}


def peak_bytes() -> float:
    """Largest resident memory of this process.

    Linux counts the parent's in ru_maxrss of a child; VmHWM begins with the program.
    """
    status = Path("/proc/self/status")
    if status.exists():
        line = next(
            line
            for line in status.read_text(encoding="ascii").splitlines()
            if line.startswith("VmHWM:")
        )
        return 1024.0 * int(line.split()[1])
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * (
        1 if sys.platform == "darwin" else 1024
    )


def child(way: str, case: Case) -> Row:
    """What a child measures: seconds, peak, frequencies."""
    problem = assembled(case)
    before = peak_bytes()
    found = WAYS[way](problem)
    return {
        "n": problem.K.shape[0],
        "assembly": problem.seconds,
        "before": before,
        "peak": peak_bytes(),
        **found,
    }


def measured(way: str, case: Case) -> Row:
    """`child` in a process of its own. Raises UpdError when it fails."""
    command = [sys.executable, __file__, "--child", json.dumps([way, asdict(case)])]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        raise UpdError(f"{way} did not end within {LONGEST_S} s") from None
    if done.returncode != 0:
        raise UpdError(
            f"{way} ended with code {done.returncode}: {' '.join(done.stderr.split()[-40:])}"
        )
    answer: Row = json.loads(done.stdout.splitlines()[-1])
    return answer


def apart(one: Row, other: Row) -> str:
    """The largest relative difference of two sets of frequencies, in words."""
    a, b = np.array(one["frequency"]), np.array(other["frequency"])
    return f"frequencies agree to {np.abs(a / b - 1.0).max():.0e}"


def named(case: Case, n: int) -> str:
    """The case in the table."""
    return f"{case.body}, {case.element}, refine {case.refine}, {n} free dofs, {COUNT} modes"


def time_modes(case: Case, targets: bool) -> list[Row]:
    """Our modes against one factorisation, and against eigsh with it."""
    ours, peer = measured("modes", case), measured("eigsh", case)
    size = f"{ours['before'] / 1e9:.2f} GB of it before the modes, at the assembly"
    bare, arpack = ours["seconds"] - ours["lanczos"], peer["seconds"] - peer["factorisation"]
    split = (
        f"the factorisation {peer['factorisation']:.1f} s and Lanczos {arpack:.1f} s; "
        f"{apart(ours, peer)}"
    )
    both = f"both with their factorisation; Lanczos alone {ours['lanczos'] / arpack:.2f}"
    rows: list[Row] = [
        {
            "name": "time_modes",
            "value": ours["seconds"],
            "unit": "s",
            "target": TARGET_SECONDS,
            "note": ours["told"],
        },
        {
            "name": "memory_modes",
            "value": ours["peak"] / 1e9,
            "unit": "GB",
            "target": TARGET_GB,
            "note": f"peak of the process; {size}",
        },
        {
            "name": "time_assembly",
            "value": ours["assembly"],
            "unit": "s",
            "note": "K and M on the free dofs, not in the time of the modes",
        },
        {
            "name": "time_factorisation",
            "value": bare,
            "unit": "s",
            "note": f"the modes' own; {peer['told']}",
        },
        {
            "name": "time_modes_vs_factorisation",
            "value": ours["seconds"] / bare,
            "note": f"Lanczos, its checks and the count {ours['lanczos']:.1f} s",
        },
        {
            "name": "time_count_vs_factorisation",
            "value": ours["counting"] / bare,
            "note": f"inertia of L D L' and its checks {ours['counting']:.1f} s, in Lanczos's time",
        },
        {"name": "time_eigsh", "value": peer["seconds"], "unit": "s", "note": split},
        {
            "name": "memory_eigsh",
            "value": peer["peak"] / 1e9,
            "unit": "GB",
            "note": "peak of the process",
        },
        {"name": "time_modes_vs_eigsh", "value": ours["seconds"] / peer["seconds"], "note": both},
    ]
    return [
        {**row, "case": named(case, ours["n"]), "target": row.get("target") if targets else None}
        for row in rows
    ]


def run(quick: bool = False) -> list[Row]:
    """All rows. Without MKL only the quick cases.

    SuperLU's fill-in of the large one does not fit.
    """
    quick = quick or not has_pardiso()
    return time_modes(QUICK_LARGE if quick else LARGE, targets=not quick)


if __name__ == "__main__":
    if "--child" in sys.argv:
        way, fields = json.loads(sys.argv[sys.argv.index("--child") + 1])
        print(json.dumps(child(way, Case(**fields))))
    else:
        for line in run(quick="--quick" in sys.argv):
            print(line)
