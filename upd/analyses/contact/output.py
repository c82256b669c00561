"""What every contact of two bodies leaves: arrays in result.nc, meshes and fields as VTU."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.loading import LoadPath
from upd.contact.model import ContactModel
from upd.results import ArrayGroup, variable

Array = NDArray[np.float64]
Variables = dict[str, Any]
XY = "x y"


def lattice(x: Array, y: Array) -> Variables:
    """Lattice lines in mm."""
    return {"x": variable("x", x, "mm"), "y": variable("y", y, "mm")}


def normal_fields(
    pressure: Array, force: Array, gap: Array, closed: NDArray[np.bool_]
) -> Variables:
    """Fields under a normal load, (n_x, n_y) in MPa, N and mm."""
    return {
        "pressure": variable(XY, pressure, "MPa"),
        "normal_force": variable(XY, force, "N"),
        "gap": variable(XY, gap, "mm"),
        "contact": variable(XY, closed, flag_meanings="open contact"),
    }


def tangential_fields(traction: Array, slip: Array, stick: NDArray[np.bool_]) -> Variables:
    """Fields under a tangential load, (n_x, n_y) or (n_x, n_y, n_direction) in MPa and mm."""
    dims = f"{XY} direction" if traction.ndim == 3 else XY
    return {
        "traction": variable(dims, traction, "MPa"),
        "slip": variable(dims, slip, "mm"),
        "stick": variable(XY, stick, flag_meanings="slip_or_open stick"),
    }


def path_group(path: LoadPath) -> tuple[str, ArrayGroup]:
    """Name and variables of a tangential path."""
    content = "cycle" if path.cycle else "path"
    variables = {
        "displacement": variable("step", path.displacement, "mm"),
        "tangential_force": variable("step", path.load, "N"),
    }
    return f"{content} {path.case.label}", ArrayGroup(variables, content=content, case=path.case)


def curve_group(approach: Iterable[float], force: Iterable[float]) -> ArrayGroup:
    """The force-approach curve in mm and N."""
    variables = {
        "approach": variable("point", list(approach), "mm"),
        "normal_force": variable("point", list(force), "N"),
    }
    return ArrayGroup(variables, content="force-approach")


def write_meshes(
    model: ContactModel, folder: Path, cases: Iterable[tuple[str, Array, Mapping[str, Array]]] = ()
) -> None:
    """Write mesh.vtu, and fields.vtu when there are ``cases``.

    Parameters
    ----------
    cases
        Label, force (n,) in N at the contact points, and body -> displacement (n_node, 3) in mm.
    """
    # meshio is slow to import: only when files are wanted.
    from upd.mesh.export import write_fields, write_mesh

    bodies = (model.upper, model.lower)
    meshes = {b.name: b.mesh for b in bodies}
    write_mesh(meshes, folder / "mesh.vtu")
    found = list(cases)
    if not found:
        return
    data = {}
    for body in bodies:
        fields = {f"displacement_{label}": u[body.name] for label, _, u in found if body.name in u}
        contact = body.contact[model.multipliers.nodes]
        for label, force, _ in found:
            pressure = np.zeros(body.mesh.n_node)
            pressure[contact] = model.multipliers.pressure(force)
            fields[f"pressure_{label}"] = pressure
        data[body.name] = fields
    write_fields(folder / "fields.vtu", meshes, data)
