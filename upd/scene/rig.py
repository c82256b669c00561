"""What every scene of the rig asks of mesh and solver."""

from __future__ import annotations

from typing import Any

from upd.scene.base import MeshChoice, SolverChoice
from upd.scene.quantities import UNKNOWN


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
    for name, given in (("mesh.accuracy", mesh.accuracy), ("accuracy", accuracy)):
        if given is not None and given != UNKNOWN:
            problems.append(f"{name}: {of} does not choose its levels itself; raise {instead}")
    if mesh.symmetry == "quarter":
        problems.append('mesh.symmetry: the rig has one mirror plane; use "half", "full" or "auto"')
    if solver.name == "amg":
        problems.append(
            'solver.name: condensations of the blades need a direct solver; use "auto", '
            '"pardiso" or "superlu"'
        )
    return problems
