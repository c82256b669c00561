"""What a seated damper leaves behind: histories, fields of both faces, the states, meshes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses.seated.faces import FacePatch, face_patches
from upd.analyses.seated.results import platform_force
from upd.analyses.seated.solve import (
    AGAIN,
    LOWERED,
    RAISED,
    WAYS,
    Phase,
    SeatedSolution,
)
from upd.analyses.seated.state import faces_group, state_group, state_name
from upd.contact.coulomb_conditions import OPEN, STICK
from upd.results import ArrayGroup, variable
from upd.scene.forced_contact import SIDES

Variables = dict[str, Any]
#: what the groups of result.nc hold, their attribute ``content``
HISTORY, FACE, MOVED = "seating", "face", "moved"
#: the phases that are one history
SEATING = (RAISED, LOWERED, AGAIN)


def sizes(solution: SeatedSolution) -> dict[str, int]:
    """Nodes of both faces in the model."""
    return {"n_pairs": 0 if solution.of is None else solution.of.n}


def arrays(solution: SeatedSolution) -> dict[str, ArrayGroup]:
    """Arrays for result.nc.

    Returns
    -------
    dict
        Group -> variable -> (dimensions, array, attributes). Contents: "seating" (histories over
        F_C), "moved" (over the blade's shift), "face" (fields on a face's lattice after each way of
        loading), "seated faces" and "seated state" (what a forced response starts from).
    """
    if solution.of is None or solution.gap is None:
        return {}
    out: dict[str, ArrayGroup] = {}
    for phase in solution.phases.values():
        content = MOVED if phase.moved.any() else HISTORY
        out[f"{content} {phase.name}"] = ArrayGroup(
            _history(solution, phase), content=content, case=phase.case
        )
    patches = face_patches(solution)
    for phase in solution.phases.values():
        for patch in patches:
            name = f"face {patch.side} {patch.name} {phase.name}".replace("  ", " ")
            out[name] = ArrayGroup(
                _face(solution, patch, phase),
                content=FACE,
                case=replace(phase.case, side=patch.side),
                **({"patch": patch.name} if patch.name else {}),
            )
    out["faces"] = faces_group(solution.of, solution.gap)
    for phase in solution.phases.values():
        if phase.name in (*SEATING, *WAYS):
            out[state_name(phase.name)] = state_group(
                phase.found.history,
                phase.found.state[-1],
                phase.case,
                centrifugal=float(phase.centrifugal[-1]),
                mu=phase.friction,
            )
    return out


def _history(solution: SeatedSolution, phase: Phase) -> Variables:
    """Forces, motions, shares and loss after each load step."""
    of, found, step = solution.interface, phase.found, "load_step"
    forces, motion = of.face_forces(found), of.motions(found)
    out: Variables = {"centrifugal": variable(step, phase.centrifugal, "N")}
    if phase.moved.any():
        axis = int(np.flatnonzero(phase.moved.any(axis=0))[0])
        out["shift"] = variable(step, phase.moved[:, axis], "mm", f"along {'xyz'[axis]}")
        out["platform_force"] = variable(step, platform_force(solution, phase)[:, axis], "N")
    for k, side in enumerate(SIDES):
        mine = of.face == k
        area = of.area[mine] / of.area[mine].sum()
        out |= {
            f"normal_{side}": variable(step, forces[:, k, 0], "N"),
            f"along_{side}": variable(step, forces[:, k, 1], "N"),
            f"tangential_{side}": variable(step, forces[:, k, 2], "N"),
            f"closed_{side}": variable(step, (found.state[:, mine] != OPEN) @ area, "1"),
            f"stick_{side}": variable(step, (found.state[:, mine] == STICK) @ area, "1"),
        }
    for j in of.kept:
        axis_name = "xyz"[j % 3]
        out |= (
            {f"damper_u{axis_name}": variable(step, motion[:, j], "mm")}
            if j < 3
            else {f"damper_r{axis_name}": variable(step, motion[:, j], "rad")}
        )
    loss = of.copies * np.cumsum(phase.friction_loss)
    out["friction_loss"] = variable(step, loss, "N mm", "since the first step")
    return out


def _face(solution: SeatedSolution, patch: FacePatch, phase: Phase) -> Variables:
    """Pressure, traction, slip and state on a face's lattice after a phase."""
    of, found, place = solution.interface, phase.found, "x y"
    force, slip = found.force[-1], found.slip[-1]
    area = patch.field(of.area, extensive=True)
    normal = patch.field(force[:, 0], extensive=True)
    out: Variables = {
        "x": variable("x", patch.x, "mm", "along the damper, from its middle"),
        "y": variable("y", patch.y, "mm", "up the slope, from the lower edge"),
        "normal_force": variable(place, normal, "N"),
        "pressure": variable(place, normal / area, "MPa"),
        "gap": variable(place, patch.field(found.gap[-1]), "mm"),
        "state": variable(place, patch.field(found.state[-1]), flag_meanings="open stick slip"),
    }
    for j, name in ((0, "along"), (1, "up")):
        odd = j == 0
        shear = patch.field(force[:, 1 + j], extensive=True, odd=odd)
        out[f"traction_{name}"] = variable(place, shear / area, "MPa")
        out[f"slip_{name}"] = variable(place, patch.field(slip[:, j], odd=odd), "mm")
    return out


def write_files(solution: SeatedSolution, folder: Path) -> None:
    """Meshes of both blades and the damper."""
    if solution.bodies is None:
        return
    # meshio is slow to import: only when files are wanted.
    from upd.mesh.export import write_mesh

    meshes = {str(side): solution.bodies.blades[side].mesh for side in SIDES}
    write_mesh(meshes | {"damper": solution.bodies.damper_mesh}, folder / "mesh.vtu")
