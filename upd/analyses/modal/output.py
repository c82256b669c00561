"""What a run of a rig leaves behind: modes, responses, reduced models, pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from upd.analyses.modal.plan import parameters
from upd.analyses.modal.solve import Array, ModalSolution, Mode, ModeSet
from upd.errors import MeshError
from upd.matrices import DofMap, Matrices, write_dof_map, write_matrices
from upd.mesh import IntArray, Mesh, recipes


def sizes(solution: ModalSolution) -> dict[str, int]:
    """Modes found."""
    return {"n_modes": sum(len(s.modes) for s in solution.sets)}


def arrays(solution: ModalSolution) -> dict[str, dict[str, Any]]:
    """Frequencies of every configuration and the responses: case -> name -> (dimensions, array, attributes)."""
    out: dict[str, dict[str, Any]] = {}
    for s in solution.sets:
        out[f"modes {s.kind} {s.arrangement}"] = {
            "frequency": (("mode",), np.array([m.frequency for m in s.modes]), {"units": "Hz"}),
            "family": (("mode",), np.array([{"x": 0, "y": 1}.get(m.family, -1) for m in s.modes]), {"flag_meanings": "x y"}),
        }
    if solution.response is not None:
        for name, blades in solution.response.accelerance.items():
            group: dict[str, Any] = {"frequency": (("frequency",), solution.response.frequency, {"units": "Hz"})}
            for blade, H in blades.items():
                parts = np.stack([H.real, H.imag], axis=-1)
                group[f"accelerance_{blade}"] = (("frequency", "part"), parts, {"units": "(m/s2)/N", "part": "real imaginary"})
            out[f"response {name}"] = group
    return out


def whole(solution: ModalSolution, found: ModeSet) -> tuple[dict[str, Mesh], list[tuple[Mode, dict[str, Array]]]]:
    """Whole bodies, and every mode's displacement on them: half models are mirrored, evenly or oddly about y = 0."""
    scene = solution.plan.scene
    meshes, _ = recipes.build_mesh(scene.recipe, parameters(scene, found.arrangement, found.kind, "full"))
    maps = {m.body.name: _onto(m.body.mesh, meshes[m.body.name]) for m in found.modes if m.family}
    return meshes, [(m, {m.body.name: _unfolded(m, meshes[m.body.name], maps)}) for m in found.modes]


def _onto(half: Mesh, mesh: Mesh) -> IntArray:
    """Node of the half model at each node of the whole one, or at its mirror image."""
    folded = mesh.points.copy()
    folded[:, 1] = np.abs(folded[:, 1])
    distance, node = cKDTree(half.points).query(folded)
    if float(np.max(distance)) > 1e-9 * float(np.ptp(mesh.points, axis=0).max()):
        raise MeshError("the half model's nodes are not those of the whole one: make the recipe mirror its mesh")
    return np.asarray(node, np.int64)


def _unfolded(mode: Mode, mesh: Mesh, maps: dict[str, IntArray]) -> Array:
    if not mode.family:
        return mode.shape
    u = mode.shape[maps[mode.body.name]].copy()
    # Even modes: x and z alike on both sides, y opposite; odd modes the other way round.
    signs = np.array([1.0, -1.0, 1.0]) * (1.0 if mode.family == "x" else -1.0)
    other = mesh.points[:, 1] < 0.0
    u[other] *= signs
    return np.asarray(u)


def write_files(solution: ModalSolution, folder: Path) -> None:
    """Reduced models, matrices, figures, meshes with mode shapes."""
    # matplotlib and meshio are slow to import: only when files are wanted.
    from upd.analyses.modal.plots import save_figures
    from upd.mesh.export import write_fields
    from upd.plot.modes import write_frames

    scene = solution.plan.scene
    for r in solution.reductions:
        r.model.save(folder / f"reduced_{r.body.name}.nc")
        if scene.wants("matrices"):
            name = f"reduced_{r.body.name}"
            (folder / "matrices").mkdir(exist_ok=True)
            write_matrices(folder / "matrices", Matrices(csr_array(r.model.K), csr_array(r.model.M)), name=name)
            # The rows after these are modal coordinates.
            write_dof_map(folder / "matrices" / f"{name}.mapping", DofMap.of_dofs(r.free[r.model.boundary]))
    save_figures(solution, folder)
    if not scene.wants("pictures", "animation"):
        return
    for found in solution.sets:
        meshes, shapes = whole(solution, found)
        data: dict[str, dict[str, Array]] = {name: {} for name in meshes}
        for k, (mode, shape) in enumerate(shapes):
            for name, u in shape.items():
                data[name][f"mode_{k + 1:02d}_{mode.frequency:.1f}Hz"] = u
        write_fields(folder / f"modes_{found.kind}_{found.arrangement}.vtu", meshes, data)
        if scene.wants("animation"):
            for k, (mode, shape) in enumerate(shapes):
                for name, u in shape.items():
                    place = folder / f"animation_{found.kind}_{found.arrangement}"
                    place.mkdir(exist_ok=True)
                    write_frames(place, f"mode_{k + 1:02d}_{mode.frequency:.0f}Hz", meshes[name], u)
