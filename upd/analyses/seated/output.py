"""What a seated damper leaves behind: histories, fields of both faces, the states, meshes.

Fields are on the lattices of the whole contact, mirror images included: x along the damper from its
middle, y up the slope from the patch's lower edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from upd.analyses.seated.interface import Array
from upd.analyses.seated.lattice import lattice, lines
from upd.analyses.seated.results import platform_force
from upd.analyses.seated.solve import (
    AGAIN,
    LOWERED,
    RAISED,
    WAYS,
    Phase,
    SeatedSolution,
)
from upd.contact.coulomb_conditions import OPEN, STICK
from upd.mesh import IntArray, Mesh
from upd.results import ArrayGroup, variable
from upd.scene.forced_contact import SIDES, Side

Variables = dict[str, Any]
#: what the groups of result.nc hold, their attribute ``content``
HISTORY, FACE, MOVED = "seating", "face", "moved"
#: the phases that are one history
SEATING = (RAISED, LOWERED, AGAIN)
_STATES = "open stick slip"
#: parts of the state after a way of loading
_STATE: dict[str, tuple[str, str]] = {
    "force": ("contact_node component", "N"),
    "slip": ("contact_node tangent", "mm"),
    "gap": ("contact_node", "mm"),
    "motion": ("motion", "mm"),
    "step": ("contact_node tangent", "mm"),
    "load": ("motion", "N"),
}


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
        loading), "seated faces" and "seated state" (of the nodes of both faces, left ones first).
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
    out["faces"] = _nodes(solution)
    for phase in solution.phases.values():
        if phase.name in (*SEATING, *WAYS):
            out[f"state {phase.name}"] = _state(phase)
    return out


def _nodes(solution: SeatedSolution) -> ArrayGroup:
    """The nodes of both faces."""
    of, node = solution.interface, "contact_node"
    axes = "normal into the blade, along the damper, up the slope"
    return ArrayGroup(
        {
            "position": variable("contact_node axis", of.position, "mm"),
            "face": variable(node, of.face, flag_meanings="left right"),
            "area": variable(node, of.area, "mm2"),
            "gap": variable(node, solution.gap, "mm", "gap before any load"),
            "frame": variable("side component axis", of.frame, "", axes),
            "copies": variable("", of.copies, "", "models that make the whole"),
        },
        content="seated faces",
    )


def _state(phase: Phase) -> ArrayGroup:
    """Forces, slip, gap and motion after a way of loading, in the layout of `Interface`."""
    found = phase.found
    variables: Variables = {
        name: variable(dims, getattr(found.history, name), unit)
        for name, (dims, unit) in _STATE.items()
    }
    variables["state"] = variable("contact_node", found.state[-1], flag_meanings=_STATES)
    variables["centrifugal"] = variable("", float(phase.centrifugal[-1]), "N")
    variables["friction"] = variable("", phase.friction, "1")
    return ArrayGroup(variables, content="seated state", case=phase.case)


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
        "state": variable(place, patch.field(found.state[-1]), flag_meanings=_STATES),
    }
    for j, name in ((0, "along"), (1, "up")):
        odd = j == 0
        shear = patch.field(force[:, 1 + j], extensive=True, odd=odd)
        out[f"traction_{name}"] = variable(place, shear / area, "MPa")
        out[f"slip_{name}"] = variable(place, patch.field(slip[:, j], odd=odd), "mm")
    return out


@dataclass(frozen=True)
class FacePatch:
    """One connected part of a face: a pad, or the whole of it.

    Attributes
    ----------
    name
        "pad 1" and so on; "" where the face is one.
    x, y
        Lattice lines, mm.
    at : (len(x), len(y)) array of int
        Node of the interface at each place.
    doubled : (len(x),) array of bool
        Lines on the mirror plane of a half, whose nodes carry half of the force.
    flipped : (len(x),) array of bool
        Lines of the mirror image.
    """

    side: Side
    name: str
    x: Array
    y: Array
    at: IntArray
    doubled: NDArray[np.bool_]
    flipped: NDArray[np.bool_]

    def field(self, values: Array, *, extensive: bool = False, odd: bool = False) -> Array:
        """(len(x), len(y)) of a field of the interface's nodes (n,).

        ``extensive``: forces and areas; ``odd``: the mirror image has the opposite.
        """
        out = np.asarray(values, float)[self.at]
        if extensive:
            out = np.where(self.doubled[:, None], 2.0 * out, out)
        return np.asarray(np.where(self.flipped[:, None], -out, out) if odd else out)


def face_patches(solution: SeatedSolution) -> list[FacePatch]:
    """The parts of both faces, left first, along the damper."""
    assert solution.bodies is not None
    out: list[FacePatch] = []
    first = 0
    for side in SIDES:
        mesh = solution.bodies.blades[side].mesh
        patch = lattice(mesh)
        local = mesh.points[patch.nodes] @ patch.frame.T
        up = local[:, 2] - local[:, 2].min()
        found = []
        for nodes in _parts(mesh, patch.nodes):
            found += _whole(side, nodes + first, local[nodes, 1], up[nodes], solution)
        found.sort(key=lambda one: float(one.x[0]))
        if len(found) > 1:
            found = [
                FacePatch(side, f"pad {k + 1}", p.x, p.y, p.at, p.doubled, p.flipped)
                for k, p in enumerate(found)
            ]
        out += found
        first += len(patch.nodes)
    return out


def _parts(mesh: Mesh, nodes: IntArray) -> list[IntArray]:
    """Places in `nodes` of each connected part of the patch."""
    faces = np.searchsorted(nodes, mesh.faces["patch"][:, :4])
    ends = np.concatenate([faces[:, [k, (k + 1) % 4]] for k in range(4)])
    n = len(nodes)
    graph = coo_array((np.ones(len(ends)), ends.T), shape=(n, n))
    count, part = connected_components(graph, directed=False)
    return [np.flatnonzero(part == k) for k in range(count)]


def _whole(
    side: Side, nodes: IntArray, along: Array, up: Array, solution: SeatedSolution
) -> list[FacePatch]:
    """A part with its mirror image: one where it lies on the plane, two else."""
    i, j = lines(along), lines(up)
    at = np.empty((int(i.max()) + 1, int(j.max()) + 1), np.int64)
    at[i, j] = nodes
    x, y = np.empty(len(at)), np.empty(at.shape[1])
    x[i], y[j] = along, up
    no = np.zeros(len(x), bool)
    if solution.interface.copies == 1:
        return [FacePatch(side, "", x, y, at, no, no)]
    if x[0] == 0.0:
        # the line on the plane once
        mirrored = np.concatenate((at[:0:-1], at))
        place = np.concatenate((-x[:0:-1], x))
        return [FacePatch(side, "", place, y, mirrored, place == 0.0, place < 0.0)]
    return [
        FacePatch(side, "", -x[::-1], y, at[::-1], no, ~no),
        FacePatch(side, "", x, y, at, no, no),
    ]


def write_files(solution: SeatedSolution, folder: Path) -> None:
    """Meshes of both blades and the damper."""
    if solution.bodies is None:
        return
    # meshio is slow to import: only when files are wanted.
    from upd.mesh.export import write_mesh

    meshes = {str(side): solution.bodies.blades[side].mesh for side in SIDES}
    write_mesh(meshes | {"damper": solution.bodies.damper_mesh}, folder / "mesh.vtu")
