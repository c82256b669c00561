"""What every scene of the rig asks of mesh and solver."""

from __future__ import annotations

from upd.scene.base import MeshChoice, SolverChoice


def rig_problems(mesh: MeshChoice, solver: SolverChoice, *, of: str, instead: str) -> list[str]:
    """What of mesh and solver does not fit the rig.

    Parameters
    ----------
    of
        What a target accuracy has no meaning for.
    instead
        What to raise for it.
    """
    problems = []
    if mesh.accuracy is not None:
        problems.append(f"mesh.accuracy: has no meaning for {of}; raise {instead}")
    if mesh.symmetry == "quarter":
        problems.append('mesh.symmetry: the rig has one mirror plane; use "half", "full" or "auto"')
    if solver.name == "amg":
        problems.append(
            'solver.name: condensations of the blades need a direct solver; use "auto", '
            '"pardiso" or "superlu"'
        )
    return problems
