"""Side by side with CalculiX (Debian package calculix-ccx).

Natural frequencies of the two-blade rig on the same exported mesh.

Ours: hex20, 3 x 3 x 3 Gauss points in K and in M. CalculiX: C3D20, the same shape functions and the
same points, and for information C3D20R, whose K has 2 x 2 x 2 points. CalculiX's times include
reading the input file, ours begin with the mesh in memory.
"""

from __future__ import annotations

import re
import shutil
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from upd.fem import Material, mass, stiffness
from upd.linalg import modes
from upd.mesh import Mesh
from upd.mesh.recipes import build_mesh

# The benchmarks are no package: the one beside this file is found by its folder.
sys.path.append(str(Path(__file__).parent))
from bench_calculix import CalculixError, calculix, version

Row = dict[str, Any]
Array = NDArray[np.float64]

STEEL = Material(200e3, 0.3, 7.8e-9)
#: body -> the recipe's state of the damper in which it exists
CASES = {"right": "none", "rig": "glued"}
SAME, REDUCED = "C3D20", "C3D20R"
#: modes computed by both, and how many of them are compared
COUNT, COMPARED = 6, 4
TARGET = 0.1

_FLOAT = r"[-+]?\d\.\d+E[-+]\d+"
_STEP = """*INCLUDE, INPUT=mesh.inp
*MATERIAL, NAME=STEEL
*DENSITY
{steel.rho!r}
*ELASTIC
{steel.E!r}, {steel.nu!r}
*SOLID SECTION, ELSET={body}, MATERIAL=STEEL
*BOUNDARY
{body}_CLAMPED, 1, 3
*STEP
*FREQUENCY
{count}
*END STEP
"""


@dataclass(frozen=True)
class Answer:
    """Frequencies (COUNT,) in Hz, whole seconds, and words about them."""

    frequency: Array
    seconds: float
    told: str


def solve_ours(mesh: Mesh) -> Answer:
    """Modes of the clamped body: assembly, factorisation, Lanczos."""
    begin = time.perf_counter()
    free = np.ones((mesh.n_node, 3), dtype=bool)
    free[mesh.nodes["clamped"]] = False
    kept = np.flatnonzero(free)
    K, M = (
        csr_array(A[kept][:, kept])
        for A in (stiffness(mesh, STEEL, "hex20"), mass(mesh, STEEL, "hex20"))
    )
    assembled = time.perf_counter() - begin
    found = modes(K, M, count=COUNT)
    seconds = time.perf_counter() - begin
    told = (
        f"assembly {assembled:.2f} s, factorisation and Lanczos {found.seconds:.2f} s "
        f"({found.solver})"
    )
    return Answer(found.frequency, seconds, told)


def solve_calculix(name: str, mesh: Mesh, element: str) -> Answer:
    """The same from CalculiX.

    Raises CalculixError when the .dat file does not have the frequencies.
    """
    text = _STEP.format(body=name.upper(), steel=STEEL, count=COUNT)
    dat, seconds = calculix({name: mesh}, element, text)
    found = re.findall(
        rf"^\s*\d+\s+{_FLOAT}\s+{_FLOAT}\s+({_FLOAT})\s+{_FLOAT}\s*$", dat, re.MULTILINE
    )
    if len(found) < COUNT:
        raise CalculixError(f"the .dat file has {len(found)} frequencies of {COUNT}")
    return Answer(
        np.array(found[:COUNT], dtype=np.float64),
        seconds,
        "input file to frequencies, SPOOLES and ARPACK",
    )


def listed(frequency: Array) -> str:
    """The frequencies compared, in words."""
    return ", ".join(f"{f:.3f}" for f in frequency[:COMPARED])


def compare(name: str, mesh: Mesh) -> list[Row]:
    """Rows of one body: the largest difference of the first frequencies, and the costs."""
    case = f"{name}, hex20, {3 * mesh.n_node} dofs"
    ours = solve_ours(mesh)
    rows: list[Row] = []
    for element, target in ((SAME, TARGET), (REDUCED, None)):
        theirs = solve_calculix(name, mesh, element)
        difference = 100.0 * (ours.frequency / theirs.frequency - 1.0)[:COMPARED]
        told = f"ours {listed(ours.frequency)} Hz, {element} {listed(theirs.frequency)} Hz"
        told += "" if target else "; for information: 8 points instead of 27 in its K"
        worst = float(difference[np.argmax(np.abs(difference))])
        rows.append(
            {
                "name": f"track_calculix_{element.lower()}",
                "value": worst,
                "unit": "%",
                "target": target,
                "note": told,
            }
        )
        rows.append(
            {
                "name": f"time_calculix_{element.lower()}",
                "value": theirs.seconds,
                "unit": "s",
                "note": theirs.told,
            }
        )
    rows.append({"name": "time_upd", "value": ours.seconds, "unit": "s", "note": ours.told})
    rows.append(
        {
            "name": "speedup_modes",
            "value": rows[1]["value"] / ours.seconds,
            "note": f"{SAME} in CalculiX / ours",
        }
    )
    return [{**row, "case": case} for row in rows]


def run() -> list[Row]:
    """Rows of the benchmark; one row that says so when CalculiX is not installed."""
    if shutil.which("ccx") is None:
        return [
            {
                "name": "calculix_modes",
                "case": "skipped",
                "note": "ccx is not on the path: apt-get install calculix-ccx",
            }
        ]
    told = (
        f"two-blade rig, symmetric arrangement, the first {COMPARED} frequencies; both with 3 "
        "x 3 x 3 points in K and M"
    )
    rows: list[Row] = [{"name": "calculix_modes", "case": f"version {version()}", "note": told}]
    for number, (name, damper) in enumerate(CASES.items()):
        mesh = build_mesh("blade_rig", {"arrangement": "symmetric", "damper": damper})[0][name]
        if number == 0:
            solve_ours(mesh)  # imports and the solver's library, so that the first timing is fair
        try:
            rows += compare(name, mesh)
        except CalculixError as error:
            rows.append({"name": "calculix_modes", "case": name, "note": f"failed: {error}"})
    return rows


if __name__ == "__main__":
    for row in run():
        print(row)
