"""Side by side with CalculiX (Debian package calculix-ccx).

The whole seated wedge: three elastic bodies, two contact pairs with friction, the damper held by
nothing else, F_C raised and lowered again.

Both solve the same meshes with linear kinematics under the same nodal loads: the consistent mass
matrix of the damper times an even upward acceleration. CalculiX's mortar contact has dual shape
functions, so that on matching nodes its gaps and pressures are those of the nodes, as here; its
normal and stick laws are springs (MPa/mm), which are raised tenfold, and the limit is taken by
Richardson in their compliance. Springs to ground, far softer than the bodies, hold the damper until
its contacts do; what they carry is printed. The forces on a face are the reactions at the clamped
nodes of its blade.

From its second increment on CalculiX searches the contact on the displaced nodes. One that has
moved off the edge of the other patch, be it by a nanometre, is lost: the corners bulge out along
the damper, and N and T after unloading then differ by 0.14 and 0.9 %. So the damper in its file is
narrower by a share of NARROWER (0.2 um at each end), and the damper's nodes are the slaves, since
they slide inwards at the edge that is closed. What the displaced positions (some 1e-3 of an
element) change otherwise is left in: under a hundredth of the load the difference of N and T on the
way up is 0.0004 %, under the whole load 0.005 to 0.01 %.

While both faces slip as a whole, a small rotation of the damper about the line where the faces'
normals cross changes no force: what it adds to the slip of one face it takes from the other, and
nothing decides it. So slips are compared in their mean over both faces.

Run as a program with a folder, it draws the slip areas of both into it.

References
----------
S. Sitzmann, K. Willner, B. I. Wohlmuth, A dual Lagrange method for contact problems with
regularized frictional contact conditions, Comput. Methods Appl. Mech. Engrg. 285 (2015) 468.
"""

from __future__ import annotations

import re
import shutil
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses import make_plan
from upd.analyses.seated.bodies import Bodies, lattice, make_bodies, patch_frame
from upd.analyses.seated.interface import Interface, make_interface
from upd.contact import CoupledContact
from upd.fem import Material, mass
from upd.mesh import IntArray, Mesh
from upd.scene import load_scene
from upd.scene.forced_contact import SIDES

# The benchmarks are no package: the one beside this file is found by its folder.
sys.path.append(str(Path(__file__).parent))
from bench_calculix import ELEMENTS, CalculixError, Output, reactions, run_job, version

Row = dict[str, Any]
Array = NDArray[np.float64]

F_C = 350.0
#: F_C over its largest after each increment; two to each step of CalculiX
HISTORY = (0.5, 1.0, 0.75, 0.5)
#: what is compared: words -> index of the increment
STATES = {"raised to 350 N": 1, "lowered to 175 N": 3}
#: MPa/mm of the springs in the contact; an element is E / size = 5e4 MPa/mm stiff
LADDER = (1e6, 1e7)
STIFF = (1e7,)
#: share of the damper's length along y that its mesh lacks in CalculiX
NARROWER = 1e-5
#: N/mm of each soft spring, and how many hold the damper in each direction
SOFT, SOFT_NODES = 1e-3, 9
TARGET, SOFT_TARGET = 0.5, 1e-4
#: share of Coulomb's bound from which a node of CalculiX counts as slipping
SLIPPING = 1.0 - 1e-3

_NUMBER = r"[-+]?\d\.\d+E[-+]\d+"


@dataclass(frozen=True)
class Case:
    """One comparison: element, parameters of the mesh beside the scene's, friction, springs."""

    element: str
    mesh: Mapping[str, int]
    friction: float
    springs: tuple[float, ...]

    @property
    def told(self) -> str:
        """Name of the case."""
        finer = "".join(f", {key} {value}" for key, value in self.mesh.items())
        return f"{self.element} against {ELEMENTS[self.element]}{finer}, friction {self.friction:g}"


FINER = {"patch_along_slope": 8}
CASES = (
    Case("hex8", {}, 0.6, LADDER),
    Case("hex8", {}, 0.3, STIFF),
    Case("hex8", {}, 1.2, STIFF),
    Case("hex8i", {}, 0.6, STIFF),
    Case("hex8", FINER, 0.6, STIFF),
)


@dataclass(frozen=True)
class Ours:
    """Our answer along HISTORY; seconds to the condensed bodies and of the history."""

    plan: Any
    bodies: Bodies
    interface: Interface
    found: CoupledContact
    force: Array
    made: float
    solved: float

    @property
    def meshes(self) -> dict[str, Mesh]:
        """Body -> mesh, in the order of the input file."""
        return {**{s: self.bodies.blades[s].mesh for s in SIDES}, "damper": self.bodies.damper_mesh}

    def pairs(self, side: Any) -> tuple[IntArray, IntArray]:
        """Nodes of the blade and of the damper on a face, in the order of the interface."""
        blade = self.bodies.blades[side].mesh
        own = dict(
            zip(blade.nodes["patch"], self.bodies.damper_mesh.nodes[f"{side}_patch"], strict=True)
        )
        nodes = lattice(blade).nodes
        return nodes, np.array([own[node] for node in nodes])


@dataclass(frozen=True)
class Theirs:
    """CalculiX's answer after each increment.

    Forces (k, 2, 3) N of the faces as ours; pressure (k, n) MPa, slip (k, n, 2) mm and state (k, n)
    at the nodes of the interface; share of F_C that the bodies' supports do not carry; seconds.
    """

    force: Array
    pressure: Array
    slip: Array
    state: Array
    soft: float
    seconds: float


def solve_ours(case: Case) -> Ours:
    """The product's own pipeline."""
    parameters = [f"geometry.{key}={value}" for key, value in case.mesh.items()]
    plan: Any = make_plan(
        load_scene("symmetric-response", [f"mesh.element={case.element}", *parameters])
    )
    begin = time.perf_counter()
    bodies = make_bodies(plan)
    interface = make_interface(plan, bodies)
    made = time.perf_counter()
    found = interface.seat(case.friction, F_C * np.array(HISTORY))
    end = time.perf_counter()
    force = interface.face_forces(found)
    return Ours(plan, bodies, interface, found, force, made - begin, end - made)


def seat_again(ours: Ours, friction: float) -> Ours:
    """The same bodies with another friction."""
    begin = time.perf_counter()
    found = ours.interface.seat(friction, F_C * np.array(HISTORY))
    seconds = time.perf_counter() - begin
    return replace(ours, found=found, force=ours.interface.face_forces(found), solved=seconds)


def deck(ours: Ours, friction: float, spring: float) -> str:
    """The input file after the mesh."""
    m, damper = ours.plan.scene.material, ours.bodies.damper_mesh
    first = sum(ours.bodies.blades[side].mesh.n_node for side in SIDES) + 1
    lines = ["*INCLUDE, INPUT=mesh.inp", "*MATERIAL, NAME=STEEL", "*ELASTIC", f"{m.E!r}, {m.nu!r}"]
    lines += [f"*SOLID SECTION, ELSET={body.upper()}, MATERIAL=STEEL" for body in ours.meshes]
    number = sum(mesh.n_hex for mesh in ours.meshes.values())
    for k in (1, 2, 3):
        lines.append(f"*ELEMENT, TYPE=SPRING1, ELSET=SOFT{k}")
        for node in np.linspace(0, damper.n_node - 1, SOFT_NODES).astype(int):
            number += 1
            lines.append(f"{number}, {first + node}")
        lines += [f"*SPRING, ELSET=SOFT{k}", f"{k}", f"{SOFT:g}"]
    lines += ["*SURFACE INTERACTION, NAME=FACES", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"]
    lines += [f"{spring:g}", "*FRICTION", f"{friction!r}, {spring:g}"]
    for side in SIDES:
        name = side.upper()
        lines.append("*CONTACT PAIR, INTERACTION=FACES, TYPE=MORTAR")
        lines.append(f"DAMPER_{name}_PATCH_FACES, {name}_PATCH_FACES")
    lines += ["*BOUNDARY", *(f"{side.upper()}_CLAMPED, 1, 3" for side in SIDES)]
    M = mass(damper, Material(m.E, m.nu, ours.plan.scene.damper.density or m.density))
    up = M @ np.tile([0.0, 0.0, 1.0], damper.n_node)
    up *= F_C / up[2::3].sum()
    for share in HISTORY[1::2]:
        lines += ["*STEP", "*STATIC, DIRECT", "0.5, 1.", "*CLOAD"]
        # CalculiX reads 20 characters of a number
        lines += [f"{first + n}, 3, {f:.12g}" for n, f in enumerate((share * up[2::3]).tolist())]
        lines += [f"*NODE PRINT, NSET={s.upper()}_CLAMPED, TOTALS=ONLY\nRF" for s in SIDES]
        sets = [f"{s.upper()}_PATCH" for s in SIDES] + [f"DAMPER_{s.upper()}_PATCH" for s in SIDES]
        lines += [f"*NODE PRINT, NSET={name}\nU" for name in sets]
        lines += ["*CONTACT FILE", "CDIS, CSTR", "*END STEP"]
    return "\n".join(lines) + "\n"


def solve_calculix(ours: Ours, case: Case, spring: float) -> Theirs:
    """The same from CalculiX. Raises CalculixError when an increment is missing."""
    damper = ours.bodies.damper_mesh
    narrower = replace(damper, points=damper.points * [1.0, 1.0 - NARROWER, 1.0])
    meshes = {**ours.meshes, "damper": narrower}
    out = run_job(meshes, ELEMENTS[case.element], deck(ours, case.friction, spring))
    total = [reactions(out.dat, f"{side.upper()}_CLAMPED") for side in SIDES]
    if any(len(one) != len(HISTORY) for one in total):
        raise CalculixError("the .dat file has no forces of some increments")
    vectors = np.array([[one[t] for one in total] for t in sorted(total[0])])
    frames = np.array([patch_frame(ours.bodies.blades[side].mesh) for side in SIDES])
    applied = F_C * np.array(HISTORY)[:, None] * [0.0, 0.0, 1.0]
    soft = np.abs(vectors.sum(axis=1) + applied).max() / F_C
    force = -np.einsum("fij,kfj->kfi", frames, vectors)
    return Theirs(force, *_contact(ours, out, case.friction), float(soft), out.seconds)


def _contact(ours: Ours, out: Output, friction: float) -> tuple[Array, Array, Array]:
    """Pressure, slip and state at the nodes of the interface after each increment."""
    moved, stress = _displacements(out.dat), _contact_stress(out.frd)
    if len(moved) != len(HISTORY) or len(stress) != len(HISTORY):
        raise CalculixError("the files have no displacements or contact stresses of an increment")
    first = dict(
        zip(
            ours.meshes, np.cumsum([1, *(m.n_node for m in ours.meshes.values())])[:-1], strict=True
        )
    )
    pressures, slip, state = [], [], []
    for u, s in zip(moved, stress, strict=True):
        parts, states, pressed = [], [], []
        for side in SIDES:
            frame = patch_frame(ours.bodies.blades[side].mesh)
            for a, b in zip(*ours.pairs(side), strict=True):
                at = int(b + first["damper"])
                parts.append(frame[1:] @ (u[at] - u[int(a + first[side])]))
                pressure, shear = s[at][0], float(np.hypot(*s[at][1:]))
                pressed.append(pressure)
                slips = shear >= SLIPPING * friction * pressure
                states.append(0 if pressure <= 0.0 else 2 if slips else 1)
        pressures.append(pressed)
        slip.append(parts)
        state.append(states)
    return np.array(pressures), np.array(slip), np.array(state)


def _displacements(dat: str) -> list[dict[int, Array]]:
    """Node -> displacement (3,) mm after each increment."""
    at: dict[float, dict[int, Array]] = {}
    now: dict[int, Array] | None = None
    for line in dat.splitlines():
        head = re.match(rf"\s*displacements .* and time\s+({_NUMBER})", line)
        if head:
            now = at.setdefault(float(head[1]), {})
        elif re.match(r"\s*total", line):
            now = None
        elif now is not None and line.strip():
            node, *values = line.split()
            now[int(node)] = np.array(values, dtype=np.float64)
    return [at[t] for t in sorted(at)]


def _contact_stress(frd: str) -> list[dict[int, Array]]:
    """Node of the damper's faces -> pressure and two shear stresses (3,) MPa, each increment."""
    found: list[dict[int, Array]] = []
    inside = False
    for line in frd.splitlines():
        if line.startswith(" -4"):
            inside = line.split()[1] == "CONTACT"
            if inside:
                found.append({})
        elif line.startswith(" -3"):
            inside = False
        elif inside and line.startswith(" -1"):
            values = [float(line[13 + 12 * k : 25 + 12 * k]) for k in (3, 4, 5)]
            found[-1][int(line[3:13])] = np.array(values)
    return found


def limit(values: list[Array]) -> Array:
    """Limit of two answers along LADDER, F = limit - c / spring; of one it is the answer."""
    if len(values) == 1:
        return values[0]
    return values[-1] + (values[-1] - values[-2]) / (LADDER[1] / LADDER[0] - 1.0)


def compare(ours: Ours, case: Case) -> Iterator[Row]:
    """Rows of one case."""
    answers = [solve_calculix(ours, case, spring) for spring in case.springs]
    force, last = limit([a.force for a in answers]), answers[-1]
    for told, k in STATES.items():
        for j, letter in ((0, "N"), (2, "T")):
            difference = 100.0 * (ours.force[k, :, j] / force[k, :, j] - 1.0)
            steps = ", ".join(
                f"{a.force[k, 0, j]:.3f} at {spring:.0e}"
                for a, spring in zip(answers, case.springs, strict=True)
            )
            yield {
                "name": f"track_calculix_seated_{letter}",
                "case": f"{case.told}, {told}",
                "value": float(difference[np.abs(difference).argmax()]),
                "unit": "%",
                "target": TARGET,
                "note": f"the worse face; left, right: ours {_both(ours.force[k, :, j])} N, "
                f"CalculiX {_both(force[k, :, j])} N (left {steps} MPa/mm)",
            }
        nodal = last.pressure[k] * ours.interface.area
        apart = np.abs(nodal - ours.found.force[k, :, 0]).max() / ours.found.force[k, :, 0].max()
        yield {
            "name": "track_calculix_seated_nodes",
            "case": f"{case.told}, {told}",
            "value": float(100.0 * apart),
            "unit": "%",
            "note": "largest difference of a node's normal force over the largest force",
        }
        area, mine, his = ours.interface.area, ours.found.state[k], last.state[k]
        yield {
            "name": "track_calculix_seated_states",
            "case": f"{case.told}, {told}",
            "value": int((mine != his).sum()),
            "unit": f"of {len(area)} nodes",
            "note": "open, stick or slip in one and not in the other; stick / slip "
            f"{_areas(mine, area)} mm2, CalculiX {_areas(his, area)} mm2",
        }
    closed = (ours.found.state[1] != 0) & (last.state[1] != 0)
    up = [
        1e3 * np.array([one[1][closed & (ours.interface.face == k), 1].mean() for k in (0, 1)])
        for one in (ours.found.slip, last.slip)
    ]
    yield {
        "name": "track_calculix_seated_slip",
        "case": f"{case.told}, raised to 350 N",
        "value": float(100.0 * (up[0].mean() / up[1].mean() - 1.0)),
        "unit": "%",
        "note": f"mean up both slopes; left, right: ours {_both(up[0])} um, "
        f"CalculiX {_both(up[1])} um",
    }
    yield {
        "name": "track_calculix_seated_soft",
        "case": case.told,
        "value": max(a.soft for a in answers),
        "target": SOFT_TARGET,
        "note": "share of F_C that the reactions lack: soft springs, digits of the file",
    }
    yield {
        "name": "time_calculix",
        "case": case.told,
        "value": last.seconds,
        "unit": "s",
        "note": f"{len(HISTORY)} increments, springs of {case.springs[-1]:.0e} MPa/mm",
    }
    yield {
        "name": "time_upd",
        "case": case.told,
        "value": ours.made + ours.solved,
        "unit": "s",
        "note": f"meshes to condensed bodies {ours.made:.2f} s, history {ours.solved:.3f} s",
    }


def _both(values: Array) -> str:
    return ", ".join(f"{value:.3f}" for value in values)


def _areas(state: Array, area: Array) -> str:
    return " / ".join(f"{area[state == k].sum():.1f}" for k in (1, 2))


def version_row() -> Row:
    """What is compared, and CalculiX's version."""
    told = "symmetric rig, full model, both contact pairs, F_C 350 N; mortar contact"
    return {"name": "calculix_seated", "case": f"version {version()}", "note": told}


def run() -> Iterator[Row]:
    """Rows of the benchmark; one row that says so when CalculiX is not installed."""
    if shutil.which("ccx") is None:
        yield {
            "name": "calculix_seated",
            "case": "skipped",
            "note": "ccx is not on the path: apt-get install calculix-ccx",
        }
        return
    yield version_row()
    solved: dict[tuple[str, str], Ours] = {}
    solve_ours(CASES[0])  # imports and compiled kernels, so that the first timing is fair
    for case in CASES:
        key = (case.element, repr(case.mesh))
        try:
            made = key in solved
            solved[key] = seat_again(solved[key], case.friction) if made else solve_ours(case)
            yield from compare(solved[key], case)
        except CalculixError as error:
            yield {"name": "calculix_seated", "case": case.told, "note": f"failed: {error}"}


def draw(folder: Path, case: Case) -> Path:
    """Both maps of open, sticking and slipping nodes, left and right face, beside each other."""
    from upd.plot.chart import STATES as NAMES
    from upd.plot.chart import Axis, Chart, Map
    from upd.plot.matplotlib import write_sheets

    ours = solve_ours(case)
    theirs = solve_calculix(ours, case, case.springs[-1])
    value = {0: 0.0, 1: 2.0, 2: 1.0}
    charts = []
    for told, k in {"raised": 1, "lowered to 262.5 N": 2, "lowered to 175 N": 3}.items():
        for f, side in enumerate(SIDES):
            grid = lattice(ours.bodies.blades[side].mesh)
            local = ours.interface.position[ours.interface.face == f] @ grid.frame.T
            x, y = np.unique(local[:, 1].round(6)), np.unique(local[:, 2].round(6))
            for who, state in (("ours", ours.found.state[k]), ("CalculiX", theirs.state[k])):
                z = np.zeros((grid.n_column, grid.n_row))
                z[grid.column, grid.row] = [value[s] for s in state[ours.interface.face == f]]
                charts.append(
                    Chart(
                        f"{side} face, {who}",
                        Axis("along the damper", "mm"),
                        Axis("up the slope", "mm"),
                        maps=(Map(x, y - y.min(), z, Axis("state"), NAMES),),
                        case=f"friction {case.friction:g}, {told}",
                        columns=4,
                        equal=True,
                        figure="calculix_seated",
                    )
                )
    folder.mkdir(parents=True, exist_ok=True)
    return write_sheets(charts, folder)[0]


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(draw(Path(sys.argv[1]), Case("hex8", FINER, 1.2, STIFF)))
    else:
        for row in run():
            print(row)
