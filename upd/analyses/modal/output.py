"""What a modal analysis leaves behind.

Modes, responses, reduced models, pictures of the mode shapes.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from upd.analyses.measured import accelerance_array, measured_arrays
from upd.analyses.modal.results import REDUCED, reduced_frequencies
from upd.analyses.modal.solve import Array, ModalSolution, ModeSet, RigMode, RigResponse
from upd.matrices import DofMap, Matrices, write_dof_map, write_matrices
from upd.mesh import Mesh
from upd.plot.matplotlib import Drawing, draw_sheet, write_png
from upd.plot.pictures import draw_mode
from upd.results import Case, Group, variable

#: modes drawn of each configuration
_DRAWN = 4
_SIZE = (4.2, 5.2)
#: the mirror image of a half: its name, and its coordinates over those of the half
_IMAGE, _MIRRORED = ", mirrored", np.array([1.0, -1.0, 1.0])
#: nodes of a hexahedron in VTK order, turned inside out
_TURNED = [1, 0, 3, 2, 5, 4, 7, 6, 8, 11, 10, 9, 12, 15, 14, 13, 17, 16, 19, 18]
_TURNED += [21, 20, 22, 23, 24, 25, 26]


#: what the groups of result.nc hold, their attribute ``content``
MODES, RESPONSE, REDUCTION = "modes", "response", "reduction"


def sizes(solution: ModalSolution) -> dict[str, int]:
    """Modes found."""
    return {"n_modes": sum(len(s.modes) for s in solution.sets)}


def arrays(solution: ModalSolution) -> dict[str, Group]:
    """Frequencies of every configuration, responses, and frequencies of the reduced blades.

    Returns
    -------
    dict
        Group -> variable -> (dimensions, array, attributes). Contents: "modes", "response",
        "reduction".
    """
    out = {f"modes {found.kind} {found.arrangement}": _modes(found) for found in solution.sets}
    if solution.response is not None:
        out |= {
            f"response {kind}": _response(solution.response, kind)
            for kind in solution.response.accelerance
        }
        out |= measured_arrays(solution.plan.scene.measured)
    if solution.reductions:
        full, reduced = np.array(reduced_frequencies(solution.reductions)).T
        variables = {
            "frequency": variable("mode", reduced, "Hz"),
            "full": variable("mode", full, "Hz", source="full model"),
        }
        out["reduction"] = Group(variables, content=REDUCTION, case=REDUCED)
    return out


def _modes(found: ModeSet) -> Group:
    variables: dict[str, Any] = {
        "frequency": variable("mode", [m.frequency for m in found.modes], "Hz"),
        "family": variable(
            "mode",
            [{"x": 0, "y": 1}.get(m.body.family, -1) for m in found.modes],
            flag_meanings="x y",
        ),
    }
    return Group(variables, content=MODES, case=found.case)


def _response(response: RigResponse, kind: str) -> Group:
    """Accelerance of both blades, modal damping, and the marked peak of the free right blade."""
    group: dict[str, Any] = {"frequency": variable("frequency", response.frequency, "Hz")}
    for blade, H in response.accelerance[kind].items():
        group[f"accelerance_{blade}"] = accelerance_array(H)
    group["damping"] = variable("", response.damping, "1", "modal damping ratio")
    if kind == "free" and response.peak is not None:
        at, height = response.peak
        group["peak_frequency_right"] = variable("peak_right", [at], "Hz")
        group["peak_accelerance_right"] = variable("peak_right", [height], "(m/s2)/N")
    return Group(group, content=RESPONSE, case=Case(kind=kind, arrangement=response.arrangement))


def write_files(solution: ModalSolution, folder: Path) -> None:
    """Reduced models, matrices, pictures of modes, meshes with mode shapes."""
    scene = solution.plan.scene
    for r in solution.reductions:
        r.model.save(folder / f"reduced_{r.body.name}.nc")
        if scene.wants("matrices"):
            name = f"reduced_{r.body.name}"
            (folder / "matrices").mkdir(exist_ok=True)
            write_matrices(
                folder / "matrices", Matrices(csr_array(r.model.K), csr_array(r.model.M)), name=name
            )
            # The rows after these are modal coordinates.
            write_dof_map(
                folder / "matrices" / f"{name}.mapping",
                DofMap.of_dofs(r.body.free[r.model.boundary]),
            )
    if scene.wants("pictures"):
        _write_shapes(solution, folder)


def _write_shapes(solution: ModalSolution, folder: Path) -> None:
    """Meshes with the mode shapes of every configuration; pictures of the lowest ones in
    modes_free.png and modes_glued.png.
    """
    # meshio is slow to import: only when files are wanted.
    from upd.mesh.export import write_fields

    drawings: dict[str, list[Drawing]] = {}
    for found in solution.sets:
        meshes, shapes = shapes_of(found)
        data: dict[str, dict[str, Array]] = {name: {} for name in meshes}
        for k, (mode, shape) in enumerate(shapes, 1):
            for name, u in shape.items():
                data[name][f"mode_{k:02d}_{mode.frequency:.1f}Hz"] = u
            if k <= _DRAWN:
                who = "" if mode.body.name == "rig" else f", {mode.body.name} blade"
                title = f"{found.arrangement}, {found.kind} {k}{who}\n{mode.frequency:.2f} Hz"
                picture = partial(draw_mode, meshes, shape, title=title)
                drawings.setdefault(found.kind, []).append(picture)
        write_fields(folder / f"modes_{found.kind}_{found.arrangement}.vtu", meshes, data)
    for kind, mine in drawings.items():
        write_png(draw_sheet(mine, _DRAWN, _SIZE), folder / f"modes_{kind}.png")


def shapes_of(found: ModeSet) -> tuple[dict[str, Mesh], list[tuple[RigMode, dict[str, Array]]]]:
    """Bodies, halves with their mirror images about y = 0, and every mode's displacement on them.

    Returns
    -------
    dict
        Body -> mesh.
    list
        Of every mode, lowest first: the mode, and body -> (n_node, 3) displacement.
    """
    meshes: dict[str, Mesh] = {}
    for body, _ in found.found:
        meshes[body.name] = body.mesh
        if body.family:
            points, hexes = body.mesh.points * _MIRRORED, body.mesh.hexes
            turned = hexes[:, _TURNED[: hexes.shape[1]]]
            meshes[body.name + _IMAGE] = replace(body.mesh, points=points, hexes=turned)
    shapes = []
    for mode in found.modes:
        shape, name = {mode.body.name: mode.shape}, mode.body.name + _IMAGE
        if mode.body.family:
            # even modes: x and z alike on both sides, y opposite; odd modes the other way round
            shape[name] = mode.shape * _MIRRORED * (1.0 if mode.body.family == "x" else -1.0)
        shapes.append((mode, shape))
    return meshes, shapes
