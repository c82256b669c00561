"""Meshes and fields of a contact run as VTU."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upd.contact.model import ContactModel

Array = NDArray[np.float64]


def write_meshes(model: ContactModel, folder: Path, cases: Iterable[tuple[str, Array, Mapping[str, Array]]] = ()) -> None:
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
            pressure[contact] = force / model.multipliers.weights
            fields[f"pressure_{label}"] = pressure
        data[body.name] = fields
    write_fields(folder / "fields.vtu", meshes, data)
