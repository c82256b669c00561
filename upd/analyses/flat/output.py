"""What a run of a flat contact leaves behind: arrays, the contact law, figures, meshes with fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses.contact.files import write_meshes
from upd.analyses.flat.maps import Lattice, contact_law, corner, lattices
from upd.analyses.flat.solve import FlatSolution, NormalCase, TangentialCase
from upd.mesh import recipes

Variables = dict[str, Any]


def sizes(solution: FlatSolution) -> dict[str, int]:
    """Contact pairs of the model and of all patches, mirror images included."""
    return {"n_pairs": len(solution.model.gap), "n_pairs_whole_patch": sum(len(k.X) * len(k.Y) for k in lattices(solution))}


def arrays(solution: FlatSolution) -> dict[str, dict[str, Any]]:
    """Fields of every case and patch: case -> name -> (dimensions, array, attributes). x, y in report axes."""
    out: dict[str, dict[str, Any]] = {}
    patches = lattices(solution)
    for k in patches:
        name = f" {k.name}" if len(patches) > 1 else ""
        for case in solution.normal:
            out[case.label + name] = _axes(solution, k) | _normal(solution, k, case)
        for t in solution.tangential:
            out[t.label + name] = _axes(solution, k) | _tangential(k, t)
    for path in solution.paths:
        out[("cycle " if path.cycle else "path ") + path.label] = {
            "displacement": (("step",), path.displacement, {"units": "mm"}),
            "tangential_force": (("step",), path.load, {"units": "N"}),
        }
    if solution.curve:
        out["force-approach"] = {
            "approach": (("point",), np.array([s.approach for _, s in solution.curve]), {"units": "mm"}),
            "normal_force": (("point",), np.array([F for F, _ in solution.curve]), {"units": "N"}),
        }
    return out | _laws(solution)


def _axes(solution: FlatSolution, k: Lattice) -> Variables:
    x, y = corner(solution)
    return {"x": (("x",), k.X - x, {"units": "mm"}), "y": (("y",), k.Y - y, {"units": "mm"})}


def _normal(solution: FlatSolution, k: Lattice, case: NormalCase) -> Variables:
    force = k.field(case.solution.force, extensive=True)
    xy = ("x", "y")
    return {
        "pressure": (xy, force / k.area(), {"units": "MPa"}),
        "normal_force": (xy, force, {"units": "N"}),
        "gap": (xy, k.field(case.solution.gap), {"units": "mm"}),
        "contact": (xy, k.field(case.solution.contact) > 0.0, {"flag_meanings": "open contact"}),
    }


def _tangential(k: Lattice, t: TangentialCase) -> Variables:
    xyd = ("x", "y", "direction")
    force = np.stack([k.field(c, extensive=True) for c in t.force.T], -1)
    return {
        "traction": (xyd, force / k.area()[..., None], {"units": "MPa"}),
        "slip": (xyd, np.stack([k.field(c) for c in t.slip.T], -1), {"units": "mm"}),
        "stick": (("x", "y"), k.field(t.stick) > 0.0, {"flag_meanings": "slip_or_open stick"}),
    }


def _laws(solution: FlatSolution) -> dict[str, dict[str, Any]]:
    """The contact law of every normal load, in contact axes and, where the recipe tells the place, in the rig's."""
    if not solution.plan.scene.wants("contact_law"):
        return {}
    out: dict[str, dict[str, Any]] = {}
    scene = solution.plan.scene
    for case in solution.normal:
        law = contact_law(solution, case)
        if law is not None:
            out[f"contact law {case.label}"] = law.to_arrays()
            placed = law.placed(*recipes.placement(scene.recipe, solution.plan.parameters))
            out[f"contact law in the rig {case.label}"] = placed.to_arrays()
    return out


def write_files(solution: FlatSolution, folder: Path) -> None:
    """Figures, the mesh and the fields into the run folder."""
    # matplotlib is slow to import: only when files are wanted.
    from upd.analyses.flat.plots import save_figures

    save_figures(solution, folder)
    cases = [(f"{c.force:.6g}N", c.solution.force, c.displacement) for c in solution.normal] if solution.plan.scene.wants("fields") else []
    write_meshes(solution.model, folder, cases)
