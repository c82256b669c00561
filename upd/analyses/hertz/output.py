"""What a run of a curved contact leaves behind: arrays, figures, meshes with fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from upd.analyses.contact.files import write_meshes
from upd.analyses.hertz.solve import HertzSolution


def sizes(solution: HertzSolution) -> dict[str, int]:
    """Contact pairs of the model and of the whole patch."""
    patch = solution.model.patch
    return {"n_pairs": len(solution.model.gap), "n_pairs_whole_patch": len(patch.X) * len(patch.Y)}


def arrays(solution: HertzSolution) -> dict[str, dict[str, Any]]:
    """Fields of every case: case -> name -> (dimensions, array, attributes)."""
    patch = solution.model.patch
    lattice = {"x": (("x",), patch.X, {"units": "mm"}), "y": (("y",), patch.Y, {"units": "mm"})}
    out: dict[str, dict[str, Any]] = {}
    xy = ("x", "y")
    for case in solution.normal:
        out[case.label] = lattice | {
            "pressure": (xy, case.pressure, {"units": "MPa"}),
            "normal_force": (xy, case.force, {"units": "N"}),
            "gap": (xy, case.gap, {"units": "mm"}),
            "contact": (xy, case.force > 0.0, {"flag_meanings": "open contact"}),
        }
    for t in solution.tangential:
        dims = (*xy, "direction") if t.traction.ndim == 3 else xy
        out[t.label] = lattice | {
            "traction": (dims, t.traction, {"units": "MPa"}),
            "slip": (dims, t.slip, {"units": "mm"}),
            "stick": (xy, t.stick, {"flag_meanings": "slip_or_open stick"}),
        }
    for c in solution.cycles:
        out[f"cycle {c.label}"] = {
            "displacement": (("step",), c.displacement, {"units": "mm"}),
            "tangential_force": (("step",), c.load, {"units": "N"}),
        }
    if solution.curve:
        d, F = np.array(solution.curve).T
        out["force-approach"] = {"approach": (("point",), d, {"units": "mm"}), "normal_force": (("point",), F, {"units": "N"})}
    return out


def write_files(solution: HertzSolution, folder: Path) -> None:
    """Figures, the mesh and the fields into the run folder."""
    # matplotlib is slow to import: only when files are wanted.
    from upd.analyses.hertz.plots import save_figures

    save_figures(solution, folder)
    cases = [(f"{c.load:g}N", c.solution.force, c.displacement) for c in solution.normal] if solution.plan.scene.wants("fields") else []
    write_meshes(solution.model, folder, cases)
