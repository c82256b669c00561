"""What a modal analysis leaves behind.

Modes, responses, reduced models, pictures of the mode shapes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from upd.analyses.measured import FREE, STUCK, accelerance_array, measured_arrays, measured_traces
from upd.analyses.modal.solve import Array, ModalSolution, ModeSet, RigMode, RigResponse
from upd.matrices import DofMap, Matrices, write_dof_map, write_matrices
from upd.mesh import Mesh
from upd.plot.chart import Axis, Chart, Mark, Trace
from upd.plot.common import frequency_of, magnitude, scalar, with_content
from upd.plot.matplotlib import Drawing, draw_sheet, write_png
from upd.plot.pictures import draw_mode
from upd.results import Arrays, Case, Group, variable

#: modes drawn of each configuration
_DRAWN = 4
_SIZE = (4.2, 5.2)
#: the mirror image of a half: its name, and its coordinates over those of the half
_IMAGE, _MIRRORED = ", mirrored", np.array([1.0, -1.0, 1.0])
#: nodes of a hexahedron in VTK order, turned inside out: corners, edges, faces and middle
_TURNED = [
    *(1, 0, 3, 2, 5, 4, 7, 6),
    *(8, 11, 10, 9, 12, 15, 14, 13, 17, 16, 19, 18),
    *(21, 20, 22, 23, 24, 25, 26),
]


#: what the groups of result.nc hold, their attribute ``content``
MODES, RESPONSE = "modes", "response"


def arrays(solution: ModalSolution) -> dict[str, Group]:
    """Frequencies of every configuration, and responses.

    Returns
    -------
    dict
        Group -> variable -> (dimensions, array, attributes). Contents: "modes", "response".
    """
    out = {}
    for (arrangement, kind), found in solution.sets.items():
        frequencies = variable("mode", [m.frequency for m in found.modes], "Hz")
        modes = Group({"frequency": frequencies}, content=MODES, case=found.case)
        out[f"modes {kind} {arrangement}"] = modes
    if solution.response is not None:
        out |= {
            f"response {kind}": _response(solution.response, kind)
            for kind in solution.response.accelerance
        }
        out |= measured_arrays(solution.plan.scene.measured)
    return out


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


# -- charts, from the run folder's arrays alone ----------------------------------------------------

#: the blade that is excited first
_BLADES = ("right", "left")


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Responses of both blades; a blade that hears nothing has none."""
    del summary
    found = [_blade_chart(arrays, blade) for blade in _BLADES]
    return [chart for chart in found if chart is not None]


def _blade_chart(arrays: Arrays, blade: str) -> Chart | None:
    """Accelerance of one blade, free and glued."""
    name = f"accelerance_{blade}"
    groups = enumerate(with_content(arrays, RESPONSE))
    curves = [(k, g, magnitude(g[name])) for k, g in groups if name in g and g[name].data.any()]
    if not curves:
        return None
    # a glued damper is what a stuck one is to the measured curve
    colours = {STUCK if g.attributes["kind"] == "glued" else FREE: k for k, g, _ in curves}
    # lines lie over the measured points
    traces = measured_traces(arrays, blade, colours) + tuple(
        Trace(g.attributes["kind"], frequency_of(g), np.where(H > 0.0, H, np.nan), colour=k)
        for k, g, H in curves
    )
    marks = [
        Mark(float(f), float(height), f"{f:.2f} Hz\n{height:.3g}", k)
        for k, g, _ in curves
        if f"peak_frequency_{blade}" in g
        for f, height in zip(
            *(g[f"peak_{name}_{blade}"].data for name in ("frequency", "accelerance")), strict=True
        )
    ]
    first = curves[0][1]
    f, damping = frequency_of(first), scalar(first, "damping")
    return Chart(
        "Frequency response",
        Axis("frequency", "Hz", low=float(f[0]), high=float(f[-1])),
        Axis("accelerance", first[name].units.replace("m/s2", "m/s²"), log=True),
        traces,
        case=f"{blade} blade",
        figure="response",
        marks=tuple(marks),
        detail="" if damping is None else f"damping {100.0 * damping:.3g} %",
    )


# -- files -----------------------------------------------------------------------------------------


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
    for (arrangement, kind), found in solution.sets.items():
        meshes, shapes = shapes_of(found)
        data: dict[str, dict[str, Array]] = {name: {} for name in meshes}
        for k, (mode, shape) in enumerate(shapes, 1):
            for name, u in shape.items():
                data[name][f"mode_{k:02d}_{mode.frequency:.1f}Hz"] = u
            if k <= _DRAWN:
                who = "" if mode.body.name == "rig" else f", {mode.body.name} blade"
                title = f"{arrangement}, {kind} {k}{who}\n{mode.frequency:.2f} Hz"
                picture = partial(draw_mode, meshes, shape, title=title)
                drawings.setdefault(kind, []).append(picture)
        write_fields(folder / f"modes_{kind}_{arrangement}.vtu", meshes, data)
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
