"""Side by side with CalculiX (Debian package calculix-ccx).

The Hertz scene on the same mesh, at the same approach.

CalculiX solves the contact by a penalty on the faces; here no penetration is left. The penalty is
raised tenfold until the force stops moving, and the limit taken by Richardson in 1/penalty. Its
default kinematics are linear, as here: with *STEP, NLGEOM the same contact is 0.8 % softer. The
block is the master side, because the contact normal is taken from it: vertical.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses import make_plan
from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.plan import NORMAL
from upd.analyses.contact.plan import ContactPlan as Plan
from upd.contact import normal_contact
from upd.contact.model import ContactModel
from upd.errors import UpdError
from upd.mesh import Mesh
from upd.mesh.export import write_mesh
from upd.progress import Stages
from upd.scene import load_scene

Row = dict[str, Any]
Array = NDArray[np.float64]

#: mm; the approach of about 200 N
APPROACH = 0.007
#: our element -> the same shape functions in CalculiX
ELEMENTS = {"hex8": "C3D8", "hex8i": "C3D8I"}
SURFACE = "SURFACE TO SURFACE"
#: MPa/mm; the contact is E*/spacing = 2e6 MPa/mm stiff
LADDER = (1e6, 1e7, 1e8, 1e9, 1e10)
#: enough for the limit: the ladder's later steps move it by a few 1e-5, and ccx needs many more
#: iterations there
LAST_TWO = (1e8, 1e9)
#: element -> penalties
CASES = {"hex8": LADDER, "hex8i": LAST_TWO}
DIVISIONS = 12
TARGET = 0.1
LONGEST_S = 900

_NUMBER = r"[-+]?\d\.\d+E[-+]\d+"
_TRIPLE = rf"\s*({_NUMBER})\s+({_NUMBER})\s+({_NUMBER})"
_CONTACT = """*SURFACE INTERACTION, NAME=HARD
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
{law}
*CONTACT PAIR, INTERACTION=HARD, TYPE={kind}
SPHERE_CONTACT_FACES, BLOCK_CONTACT_FACES
"""


class CalculixError(UpdError):
    """CalculiX did not end, or its answer is not in equilibrium."""


@dataclass(frozen=True)
class Ours:
    """Our answer: whole force in N, nodal forces of the model, seconds from the mesh to the
    forces.
    """

    plan: Plan
    model: ContactModel
    compliance: Array
    nodal: Array
    force: float
    seconds: float


def solve_ours(element: str, divisions: int) -> Ours:
    """Normal contact at the approach with the pipeline of `upd run`."""
    overrides = {
        "want": ["normal"],
        "mesh.symmetry": "quarter",
        "mesh.element": element,
        "geometry.divisions": divisions,
    }
    plan = make_plan(load_scene("hertz", overrides))
    begin = time.perf_counter()
    model = prepare(plan, Stages())
    C = model.compliance(NORMAL)
    result = normal_contact(C, model.gap, approach=APPROACH)
    seconds = time.perf_counter() - begin
    return Ours(plan, model, C, result.force, plan.copies * result.load, seconds)


def deck(ours: Ours, contact: str, load: str, output: str, solver: str = "") -> str:
    """The input file after the mesh.

    Materials, supports as in `free_dofs`, one static step of one increment, by CalculiX's own
    choice of a solver or the one named.
    """
    lines = ["*INCLUDE, INPUT=mesh.inp"]
    for body in (ours.model.upper, ours.model.lower):
        data, name = ours.plan.scene.materials[body.name], body.name.upper()
        lines += [
            f"*MATERIAL, NAME=M_{name}",
            "*ELASTIC",
            f"{data.E!r}, {data.nu!r}",
            f"*SOLID SECTION, ELSET={name}, MATERIAL=M_{name}",
        ]
    lines += [contact.rstrip(), "*BOUNDARY"]
    for name in ("SPHERE", "BLOCK"):
        lines += [f"{name}_PLANE_X, 1, 1", f"{name}_PLANE_Y, 2, 2"]
    lines += ["BLOCK_DISTANT, 1, 3", "SPHERE_DISTANT, 1, 2"]
    # Residuals down to 1e-6 of the mean force instead of half a per cent.
    controls = "*CONTROLS, PARAMETERS=FIELD\n1e-6, 1e-4\n" if contact else ""
    lines += [
        "*STEP, INC=100",
        f"{controls}*STATIC" + (f", SOLVER={solver}" if solver else ""),
        "1., 1.",
        load.rstrip(),
        output.rstrip(),
        "*END STEP",
    ]
    return "\n".join(line for line in lines if line) + "\n"


@dataclass(frozen=True)
class Output:
    """Text of the .dat and .frd files, and seconds from the input file to them."""

    dat: str
    frd: str
    seconds: float


def calculix(meshes: Mapping[str, Mesh], element: str, text: str) -> tuple[str, float]:
    """Text of the .dat file and seconds. Raises CalculixError when the job did not finish."""
    found = run_job(meshes, element, text)
    return found.dat, found.seconds


def run_job(
    meshes: Mapping[str, Mesh],
    element: str,
    text: str,
    threads: int | None = None,
    command: Sequence[str] = ("ccx",),
) -> Output:
    """Everything a job writes, on so many threads or as many as there are processors; by a command
    that ends with the job's name.

    Raises CalculixError when it did not finish.
    """
    with tempfile.TemporaryDirectory(prefix="upd-calculix-") as name:
        folder = Path(name)
        write_mesh(meshes, folder / "mesh.inp", element=element)
        (folder / "job.inp").write_text(text, encoding="ascii")
        environment = {**os.environ, "OMP_NUM_THREADS": str(threads or os.cpu_count() or 1)}
        begin = time.perf_counter()
        try:
            done = subprocess.run(
                [*command, "job"],
                cwd=folder,
                env=environment,
                capture_output=True,
                text=True,
                timeout=LONGEST_S,
            )
        except subprocess.TimeoutExpired:
            raise CalculixError(
                f"ccx did not end within {LONGEST_S} s: take a coarser mesh"
            ) from None
        seconds = time.perf_counter() - begin
        if done.returncode != 0 or "Job finished" not in done.stdout or "*ERROR" in done.stdout:
            said = " ".join(done.stdout.split()[-40:])
            raise CalculixError(
                f"ccx ended with code {done.returncode} before the job was finished: ... {said}"
            )
        dat, frd = (
            (folder / f"job.{ending}").read_text(encoding="ascii") for ending in ("dat", "frd")
        )
        return Output(dat, frd, seconds)


def reactions(dat: str, name: str) -> dict[float, Array]:
    """Total time of each printed increment -> force (3,) in N on a held set."""
    found = re.findall(
        rf"total force \(fx,fy,fz\) for set {name} and time\s+({_NUMBER})\s+{_TRIPLE}", dat
    )
    return {float(row[0]): np.array(row[1:], dtype=np.float64) for row in found}


def reaction(dat: str, name: str) -> float:
    """Vertical force in N on a held set at the end of the step.

    Raises CalculixError when the step did not reach its end.
    """
    found = reactions(dat, name)
    if not found or abs(max(found) - 1.0) > 1e-6:
        raise CalculixError(f"the .dat file has no forces of {name} at the end of the step")
    return float(found[max(found)][2])


def contact_force(dat: str) -> float:
    """Vertical sum in N of the contact forces on the sphere's faces."""
    found = re.findall(rf"total surface force \(fx,fy,fz\).*\n\s*{_TRIPLE}", dat)
    if not found:
        raise CalculixError("the .dat file has no contact forces")
    return float(found[-1][2])


def press(ours: Ours, element: str, penalty: float) -> tuple[float, float, float]:
    """Whole force in N, worst imbalance relative to it (both reactions, and the sum of the contact
    forces), seconds.
    """
    output = "".join(
        f"*NODE PRINT, NSET={name}_DISTANT, TOTALS=ONLY\nRF\n" for name in ("SPHERE", "BLOCK")
    )
    output += "*CONTACT PRINT, SLAVE=SPHERE_CONTACT_FACES, MASTER=BLOCK_CONTACT_FACES\nCF\n"
    load = f"*BOUNDARY\nSPHERE_DISTANT, 3, 3, {-APPROACH!r}\n"
    text = deck(ours, _CONTACT.format(law=f"{penalty:g}", kind=SURFACE), load, output)
    dat, seconds = calculix(_meshes(ours), ELEMENTS[element], text)
    below = reaction(dat, "BLOCK_DISTANT")
    others = (-reaction(dat, "SPHERE_DISTANT"), abs(contact_force(dat)))
    return ours.plan.copies * below, max(abs(o / below - 1.0) for o in others), seconds


def element_share(ours: Ours, element: str) -> float:
    """Relative difference of our force from CalculiX's that its elements alone make at this
    approach; it solves no contact for this.

    Our contact forces f load both bodies in CalculiX: u = (C + dC) f. With the contact set A held,
    dF = -e' C_AA^-1 (dC f)_A.
    """
    lines = ["*CLOAD"]
    meshes = _meshes(ours)
    first = dict(zip(meshes, np.cumsum([0, *(m.n_node for m in meshes.values())]), strict=False))
    for body in (ours.model.upper, ours.model.lower):
        for node, force in zip(
            body.contact + first[body.name] + 1, body.side * ours.nodal, strict=True
        ):
            lines += [f"{node}, 3, {float(force)!r}"] if force != 0.0 else []
    output = "".join(f"*NODE PRINT, NSET={name}_CONTACT\nU\n" for name in ("SPHERE", "BLOCK"))
    dat, _ = calculix(
        meshes,
        ELEMENTS[element],
        deck(ours, "", "*BOUNDARY\nSPHERE_DISTANT, 3, 3\n" + "\n".join(lines), output),
    )
    moved = {
        int(n): float(z) for n, _, _, z in re.findall(rf"^\s*(\d+){_TRIPLE}\s*$", dat, re.MULTILINE)
    }
    relative = np.zeros(len(ours.nodal))
    for body in (ours.model.upper, ours.model.lower):
        relative += body.side * np.array(
            [moved[int(n)] for n in body.contact + first[body.name] + 1]
        )
    A = ours.nodal > 0.0
    more = (relative - ours.compliance @ ours.nodal)[A]
    change = -float(np.linalg.solve(ours.compliance[np.ix_(A, A)], np.ones(A.sum())) @ more)
    return -change / float(ours.nodal.sum())


def _meshes(ours: Ours) -> dict[str, Mesh]:
    return {body.name: body.mesh for body in (ours.model.upper, ours.model.lower)}


def compare(ours: Ours, element: str, penalties: tuple[float, ...], elements: float) -> list[Row]:
    """Rows of one case: the force's difference from CalculiX's limit, with and without the share of
    the elements (in %), and the costs.
    """
    case = f"{element} against {ELEMENTS[element]}, {DIVISIONS} divisions, {SURFACE.lower()}"
    answers = [press(ours, element, penalty) for penalty in penalties]
    forces = [a[0] for a in answers]
    # F(penalty) = limit - c / penalty
    ratio = penalties[-1] / penalties[-2]
    limit = forces[-1] + (forces[-1] - forces[-2]) / (ratio - 1.0)
    steps = ", ".join(
        f"{force:.3f} at {penalty:.0e}" for force, penalty in zip(forces, penalties, strict=True)
    )
    told = f"ours {ours.force:.3f} N, CalculiX {limit:.3f} N in the limit ({steps} MPa/mm)"
    if not 0.0 <= (1.0 - forces[-1] / limit) * 100.0 <= TARGET:
        raise CalculixError(
            f"the force does not settle with the penalty ({steps} MPa/mm): a contact set was missed"
        )
    difference = 100.0 * (ours.force / limit - 1.0)
    took = ", ".join(f"{a[2]:.0f}" for a in answers)
    rows: list[Row] = [
        {
            "name": "track_calculix_force",
            "value": difference,
            "unit": "%",
            "target": TARGET,
            "note": told,
        },
        {
            "name": "track_calculix_contact",
            "value": difference - elements,
            "unit": "%",
            "target": TARGET,
            "note": "less the elements' share",
        },
        {
            "name": "track_calculix_balance",
            "value": max(a[1] for a in answers),
            "target": "1e-6",
            "note": "worst of both reactions and the contact forces",
        },
        {
            "name": "time_calculix",
            "value": sum(a[2] for a in answers),
            "unit": "s",
            "note": f"one run per penalty: {took} s",
        },
        {
            "name": "time_upd",
            "value": ours.seconds,
            "unit": "s",
            "note": "mesh to forces, no penalty",
        },
    ]
    return [{**row, "case": case} for row in rows]


def version() -> str:
    """CalculiX's version, as it tells it."""
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout
    found = re.search(r"Version\s+(\S+)", said)
    return found.group(1) if found else "unknown"


def run() -> list[Row]:
    """Rows of the benchmark; one row that says so when CalculiX is not installed."""
    if shutil.which("ccx") is None:
        return [
            {
                "name": "calculix",
                "case": "skipped",
                "note": "ccx is not on the path: apt-get install calculix-ccx",
            }
        ]
    told = f"hertz, quarter model, approach {1e3 * APPROACH:g} um, whole force"
    rows: list[Row] = [{"name": "calculix", "case": f"version {version()}", "note": told}]
    # imports and compiled kernels, so that the first timing is fair
    solve_ours("hex8", DIVISIONS)
    for element, penalties in CASES.items():
        case = f"{element} against {ELEMENTS[element]}, {DIVISIONS} divisions"
        try:
            ours = solve_ours(element, DIVISIONS)
            elements = 100.0 * element_share(ours, element)
            rows.append(
                {
                    "name": "track_calculix_element",
                    "case": f"{case}, no contact in CalculiX",
                    "value": elements,
                    "unit": "%",
                    "note": "the force's difference that the elements alone make",
                }
            )
            rows += compare(ours, element, penalties, elements)
        except CalculixError as error:
            rows.append({"name": "calculix", "case": case, "note": f"failed: {error}"})
    return rows


if __name__ == "__main__":
    for row in run():
        print(row)
