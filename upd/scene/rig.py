"""What every scene of the rig asks of mesh and solver."""

from __future__ import annotations

from typing import Any

from upd.scene.base import MeshChoice, SolverChoice
from upd.scene.quantities import UNKNOWN


def rig_parameters(scene: Any, symmetry: str, element_nodes: int) -> dict[str, Any]:
    """Parameters that the recipe of a rig is given for the damper free between both blades.

    Parameters
    ----------
    scene
        A forced response or a seated damper.
    symmetry, element_nodes
        As the recipe names them.
    """
    return {
        **{k: v for k, v in scene.geometry.items() if k not in ("recipe", "damper")},
        "arrangement": scene.arrangement,
        "damper": "free",
        "symmetry": symmetry,
        "element_nodes": element_nodes,
    }


def rig_problems(
    mesh: MeshChoice, solver: SolverChoice, accuracy: Any, *, of: str, instead: str
) -> list[str]:
    """What of mesh, solver and accuracy does not fit the rig.

    Parameters
    ----------
    accuracy
        The scene's.
    of
        What a target accuracy has no meaning for.
    instead
        What to raise for it.
    """
    problems = []
    if accuracy is not None and accuracy != UNKNOWN:
        problems.append(f"accuracy: {of} does not choose its levels itself; raise {instead}")
    if mesh.symmetry == "quarter":
        problems.append('mesh.symmetry: the rig has one mirror plane; use "half", "full" or "auto"')
    if solver.name == "amg":
        problems.append(
            'solver.name: condensations of the blades need a direct solver; use "auto", '
            '"pardiso" or "superlu"'
        )
    return problems
