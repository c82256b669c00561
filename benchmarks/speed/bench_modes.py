"""Ten modes of the two-blade rig with 300 000 dofs: seconds and memory.

The measurement has a process of its own: its peak memory is then of nothing else. A few minutes on
two cores; without MKL a mesh of 80 000 dofs, because SuperLU's fill-in of the large one does not
fit.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from upd.errors import UpdError
from upd.fem import Material, mass, stiffness
from upd.linalg import Eigenproblem
from upd.linalg.select import has_pardiso
from upd.mesh.recipes import build_mesh

Row = dict[str, Any]

STEEL = Material(200e3, 0.3, 7.8e-9)
COUNT, REFINE = 10, 2
#: s and GB
TARGET_SECONDS, TARGET_GB = 60.0, 6.0
LONGEST_S = 1200


def assembled(element: str) -> tuple[csr_array, csr_array, float]:
    """K and M on the free dofs of the rig with the damper glued, and the seconds of assembly."""
    nodes = 20 if element == "hex20" else 8
    params = {"arrangement": "symmetric", "damper": "glued", "element_nodes": nodes}
    mesh = build_mesh("blade_rig", {**params, "refine": REFINE})[0]["rig"]
    begin = perf_counter()
    free = np.ones((mesh.n_node, 3), dtype=bool)
    free[mesh.nodes["clamped"]] = False
    dofs = np.flatnonzero(free)
    K = csr_array(stiffness(mesh, STEEL, element)[dofs][:, dofs])
    M = csr_array(mass(mesh, STEEL)[dofs][:, dofs])
    return K, M, perf_counter() - begin


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


def child(element: str) -> Row:
    """What a child measures: seconds, peak, dofs."""
    K, M, assembly = assembled(element)
    before = peak_bytes()
    found = Eigenproblem(K, M).modes(count=COUNT)
    return {
        "n": K.shape[0],
        "assembly": assembly,
        "before": before,
        "peak": peak_bytes(),
        "seconds": found.seconds,
        "note": f"{found.solver}, {found.message} {found.shown}",
    }


def measured(element: str) -> Row:
    """`child` in a process of its own. Raises UpdError when it fails."""
    command = [sys.executable, __file__, "--child", element]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        raise UpdError(f"{element} did not end within {LONGEST_S} s") from None
    if done.returncode != 0:
        raise UpdError(
            f"{element} ended with code {done.returncode}: {' '.join(done.stderr.split()[-40:])}"
        )
    answer: Row = json.loads(done.stdout.splitlines()[-1])
    return answer


def run() -> list[Row]:
    """All rows."""
    large = has_pardiso()
    element = "hex20" if large else "hex8i"
    ours = measured(element)
    size = f"{ours['before'] / 1e9:.2f} GB of it before the modes, at the assembly"
    case = f"rig, {element}, refine {REFINE}, {ours['n']} free dofs, {COUNT} modes"
    return [
        {
            "name": "time_modes",
            "case": case,
            "value": ours["seconds"],
            "unit": "s",
            "target": TARGET_SECONDS if large else None,
            "note": ours["note"],
        },
        {
            "name": "memory_modes",
            "case": case,
            "value": ours["peak"] / 1e9,
            "unit": "GB",
            "target": TARGET_GB if large else None,
            "note": f"peak of the process; {size}",
        },
        {
            "name": "time_assembly",
            "case": case,
            "value": ours["assembly"],
            "unit": "s",
            "note": "K and M on the free dofs, not in the time of the modes",
        },
    ]


if __name__ == "__main__":
    if "--child" in sys.argv:
        print(json.dumps(child(sys.argv[-1])))
    else:
        for line in run():
            print(line)
