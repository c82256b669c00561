"""Mode shapes on whole bodies: what half a rig saves is mirrored, evenly or oddly about y = 0."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from upd.analyses.modal.plan import parameters
from upd.analyses.modal.solve import Array, ModalSolution, ModeSet, RigMode
from upd.errors import MeshError
from upd.mesh import IntArray, Mesh, recipes


def whole(
    solution: ModalSolution, found: ModeSet
) -> tuple[dict[str, Mesh], list[tuple[RigMode, dict[str, Array]]]]:
    """Whole bodies, and every mode's displacement on them.

    Returns
    -------
    dict
        Body -> mesh.
    list
        Of every mode, lowest first: the mode, and body -> (n_node, 3) displacement.

    Raises
    ------
    MeshError
        When the half model's nodes are not those of the whole one.
    """
    scene = solution.plan.scene
    meshes, _ = recipes.build_mesh(
        scene.recipe, parameters(scene, found.arrangement, found.kind, "full")
    )
    maps = {m.body.name: _onto(m.body.mesh, meshes[m.body.name]) for m in found.modes if m.family}
    return meshes, [
        (m, {m.body.name: _on_whole(m, meshes[m.body.name], maps)}) for m in found.modes
    ]


def _onto(half: Mesh, mesh: Mesh) -> IntArray:
    """Node of the half model at each node of the whole one, or at its mirror image."""
    mirrored = mesh.points.copy()
    mirrored[:, 1] = np.abs(mirrored[:, 1])
    distance, node = cKDTree(half.points).query(mirrored)
    if float(np.max(distance)) > 1e-9 * float(np.ptp(mesh.points, axis=0).max()):
        raise MeshError(
            "the half model's nodes are not those of the whole one: make the recipe mirror its mesh"
        )
    return np.asarray(node, np.int64)


def _on_whole(mode: RigMode, mesh: Mesh, maps: dict[str, IntArray]) -> Array:
    if not mode.family:
        return mode.shape
    u = mode.shape[maps[mode.body.name]].copy()
    # Even modes: x and z alike on both sides, y opposite; odd modes the other way round.
    signs = np.array([1.0, -1.0, 1.0]) * (1.0 if mode.family == "x" else -1.0)
    other = mesh.points[:, 1] < 0.0
    u[other] *= signs
    return np.asarray(u)
