"""What a seated damper leaves behind: histories, fields of both faces, meshes.

Fields are on the lattices of the whole contact, mirror images included: x along the damper from its
middle, y up the slope from the patch's lower edge.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from upd.analyses.seated.plan import AGAIN, LOWERED, RAISED
from upd.analyses.seated.results import platform_force
from upd.analyses.seated.solve import Phase, SeatedSolution
from upd.contact.coulomb_conditions import OPEN, STICK
from upd.contact.patch import Patch, make_patch
from upd.results import Group, variable
from upd.scene.forced_contact import SIDES, Side

Variables = dict[str, Any]
#: what the groups of result.nc hold, their attribute ``content``
HISTORY, FACE, MOVED = "seating", "face", "moved"
#: the phases that are one history
SEATING = (RAISED, LOWERED, AGAIN)
_STATES = "open stick slip"


def arrays(solution: SeatedSolution) -> dict[str, Group]:
    """Arrays for result.nc.

    Returns
    -------
    dict
        Group -> variable -> (dimensions, array, attributes). Contents: "seating" (histories over
        F_C), "moved" (over the blade's shift), "face" (fields on a face's lattice after each way of
        loading).
    """
    out: dict[str, Group] = {}
    for phase in solution.phases.values():
        content = MOVED if phase.moved.any() else HISTORY
        out[f"{content} {phase.name}"] = Group(
            _history(solution, phase), content=content, case=phase.case
        )
    faces = _faces(solution)
    for phase in solution.phases.values():
        for side, part, face in faces:
            name = f"face {side} {part} {phase.name}".replace("  ", " ")
            out[name] = Group(
                _face(solution, face, phase),
                content=FACE,
                case=replace(phase.case, side=side),
                **({"patch": part} if part else {}),
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
        kind, unit = ("u", "mm") if j < 3 else ("r", "rad")
        out[f"damper_{kind}{'xyz'[j % 3]}"] = variable(step, motion[:, j], unit)
    loss = of.copies * np.cumsum(found.friction_loss(phase.before))
    out["friction_loss"] = variable(step, loss, "N mm", "since the first step")
    return out


def _face(solution: SeatedSolution, k: Patch, phase: Phase) -> Variables:
    """Pressure, traction, slip and state on a face's lattice after a phase."""
    of, found, place = solution.interface, phase.found, "x y"
    force, slip = found.force[-1], found.slip[-1]
    area, normal = (k.whole(one, extensive=True) for one in (of.area, force[:, 0]))
    out: Variables = {
        "x": variable("x", k.X, "mm", "along the damper, from its middle"),
        "y": variable("y", k.Y, "mm", "up the slope, from the lower edge"),
        "normal_force": variable(place, normal, "N"),
        "pressure": variable(place, normal / area, "MPa"),
        "gap": variable(place, k.whole(found.gap[-1]), "mm"),
        "state": variable(place, k.whole(found.state[-1]), flag_meanings=_STATES),
    }
    # the mirror image has the opposite along the damper
    image = np.where((k.X < 0.0) & (of.copies > 1), -1.0, 1.0)[:, None]
    for j, name, sign in ((0, "along", image), (1, "up", np.ones_like(image))):
        shear = sign * k.whole(force[:, 1 + j], extensive=True)
        out[f"traction_{name}"] = variable(place, shear / area, "MPa")
        out[f"slip_{name}"] = variable(place, sign * k.whole(slip[:, j]), "mm")
    return out


def _faces(solution: SeatedSolution) -> list[tuple[Side, str, Patch]]:
    """The parts of both faces, left first, along the damper; "pad 1" and so on where they are
    several.
    """
    of, out = solution.interface, []
    half = of.copies > 1
    _, along, up = np.einsum("nc,nfc->fn", of.position, of.frame[of.face])
    for k, side in enumerate(SIDES):
        mine = np.flatnonzero(of.face == k)
        points = np.column_stack([along, up - up[mine].min()])
        found = []
        # parts that hang together by quads of nodes, which are counted by their numbers
        quads = solution.bodies.blades[side].mesh.faces["patch"][:, :4]
        at = np.unique(quads, return_inverse=True)[1].reshape(quads.shape)
        links = coo_array(
            (np.ones(at.size), (np.repeat(at[:, 0], 4), at.ravel())), shape=(len(mine),) * 2
        )
        count, part = connected_components(links, directed=False)
        for nodes in (mine[part == number] for number in range(count)):
            # the line on the plane once
            on_plane = half and bool((along[nodes] == 0.0).any())
            patch = make_patch(points, of.area, (on_plane, False), nodes)
            found += [patch, patch.image()] if half and not on_plane else [patch]
        found.sort(key=lambda one: float(one.X[0]))
        names = [f"pad {i + 1}" for i in range(len(found))] if len(found) > 1 else [""]
        out += [(side, name, one) for name, one in zip(names, found, strict=True)]
    return out


def write_files(solution: SeatedSolution, folder: Path) -> None:
    """Meshes of both blades and the damper."""
    # meshio is slow to import: only when files are wanted.
    from upd.mesh.export import write_mesh

    meshes = {str(side): solution.bodies.blades[side].mesh for side in SIDES}
    write_mesh(meshes | {"damper": solution.bodies.damper_mesh}, folder / "mesh.vtu")
