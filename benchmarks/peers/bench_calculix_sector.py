"""Side by side with CalculiX (Debian package calculix-ccx): a sector of a bladed disk.

Frequencies of nodal diameters of the recipe's sector, at rest and rotating, on the same exported
mesh. Ours: hex20; CalculiX: C3D20, *CYCLIC SYMMETRY MODEL, *STATIC under CENTRIF, then *FREQUENCY,
PERTURBATION, which has spin softening and the stiffness of the displaced state. We leave the latter
out by default and add it here for the comparison of all digits.
"""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.fem import Material, mass, stiffness
from upd.fem.inertia import centrifugal_load, displaced_stiffness, plane_mass, stress_stiffness
from upd.mesh import Mesh
from upd.mesh.recipes import build_mesh
from upd.reduction.cyclic import CyclicModel, Sector

# The benchmarks are no package: the one beside this file is found by its folder.
sys.path.append(str(Path(__file__).parent))
from bench_calculix import CalculixError, calculix, version

Row = dict[str, Any]
Array = NDArray[np.float64]

STEEL = Material(200e3, 0.3, 7.8e-9)
N, DIAMETERS, COUNT = 24, (0, 1, 4, 12), 3
#: rad/s
SPEED = 1000.0
MESH = {"disk_layers": 4, "shank_layers": 2, "blade_layers": 8, "axial": 3}

_FLOAT = r"[-+]?\d\.\d+E[-+]\d+"
_MODEL = f"""*INCLUDE, INPUT=mesh.inp
*MATERIAL, NAME=STEEL
*DENSITY
{STEEL.rho!r}
*ELASTIC
{STEEL.E!r}, {STEEL.nu!r}
*SOLID SECTION, ELSET=SECTOR, MATERIAL=STEEL
*SURFACE, NAME=LOW, TYPE=NODE
SECTOR_LOW
*SURFACE, NAME=HIGH, TYPE=NODE
SECTOR_HIGH
*TIE, CYCLIC SYMMETRY, NAME=FACES, POSITION TOLERANCE=0.01
LOW, HIGH
*CYCLIC SYMMETRY MODEL, N={N}, NGRAPH={N}, TIE=FACES, ELSET=SECTOR
0., 0., 0., 0., 0., 1.
*BOUNDARY
SECTOR_HELD, 1, 3
"""
_SPIN = f"""*STEP
*STATIC
*DLOAD
SECTOR, CENTRIF, {SPEED**2!r}, 0., 0., 0., 0., 0., 1.
*END STEP
"""
_FREQUENCY = """*STEP{perturbation}
*FREQUENCY
{count}
*SELECT CYCLIC SYMMETRY MODES, NMIN={n}, NMAX={n}
*END STEP
"""


def theirs(mesh: Mesh, n: int, spins: bool) -> Array:
    """Frequencies (COUNT,) in Hz of CalculiX.

    Raises CalculixError when the .dat file does not have them.
    """
    # it prints each twice
    count = 2 * COUNT
    step = _FREQUENCY.format(perturbation=", PERTURBATION" * spins, count=count, n=n)
    # the low face follows the high one, clamped nodes too
    held = {"held": np.setdiff1d(mesh.nodes["clamped"], mesh.nodes["low"])}
    own = replace(mesh, nodes={**mesh.nodes, **held})
    dat, _ = calculix({"sector": own}, "C3D20", _MODEL + _SPIN * spins + step)
    found = re.findall(
        rf"^\s*{n}\s+\d+\s+{_FLOAT}\s+{_FLOAT}\s+({_FLOAT})\s+{_FLOAT}\s*$", dat, re.MULTILINE
    )
    if len(found) < count:
        raise CalculixError(f"the .dat file has {len(found)} frequencies of {count}")
    return np.array(found[:count], dtype=np.float64)[::2]


def compare(mesh: Mesh) -> Iterator[Row]:
    """Rows of every nodal diameter: at rest, rotating, and with the displaced state's stiffness."""
    sector, K, M = Sector.of(mesh, N), stiffness(mesh, STEEL, "hex20"), mass(mesh, STEEL, "hex20")
    rest = CyclicModel.of(sector, K, M)
    u = rest.static(centrifugal_load(mesh, M))
    spin = stress_stiffness(mesh, STEEL, u, "hex20") - plane_mass(M)
    moved = displaced_stiffness(mesh, STEEL, SPEED**2 * u, "hex20") + SPEED**2 * spin
    kinds = (
        ("at rest", rest, 0.0, False, 1e-4),
        (
            f"{SPEED:g} rad/s, displaced state too",
            CyclicModel.of(sector, moved, M),
            0.0,
            True,
            1e-4,
        ),
        (f"{SPEED:g} rad/s", CyclicModel.of(sector, K, M, spin), SPEED, True, 0.05),
    )
    for n in DIAMETERS:
        known = {spins: theirs(mesh, n, spins) for spins in (False, True)}
        for kind, model, speed, spins, target in kinds:
            ours, f = model.modes(n, COUNT, speed).frequency, known[spins]
            off = 100.0 * (ours / f - 1.0)
            shown = "; ".join(f"{a:.4f} / {b:.4f}" for a, b in zip(ours, f, strict=True))
            yield {
                "name": "track_calculix_sector",
                "case": f"nodal diameter {n}, {kind}",
                "value": float(off[np.argmax(np.abs(off))]),
                "unit": "%",
                "target": target,
                "note": f"ours / C3D20: {shown} Hz",
            }


def run() -> Iterator[Row]:
    """Rows of the benchmark; one row that says so when CalculiX is not installed."""
    if shutil.which("ccx") is None:
        note = "ccx is not on the path: apt-get install calculix-ccx"
        yield {"name": "calculix_sector", "case": "skipped", "note": note}
        return
    mesh = build_mesh("sector", {"n_sectors": N, **MESH})[0]["sector"]
    told = f"{3 * mesh.n_node} dofs, the first {COUNT} frequencies of each nodal diameter"
    yield {"name": "calculix_sector", "case": f"version {version()}", "note": told}
    try:
        yield from compare(mesh)
    except CalculixError as error:
        yield {"name": "calculix_sector", "case": "sector", "note": f"failed: {error}"}


if __name__ == "__main__":
    for row in run():
        print(row)
