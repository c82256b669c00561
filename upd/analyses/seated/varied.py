"""What varies in a seated damper: the mesh of its bodies and faces, and the load steps."""

from __future__ import annotations

from upd.analyses.seated.plan import SeatedPlan, make_plan
from upd.analyses.seated.results import make_results
from upd.analyses.seated.solve import solve
from upd.scene import SeatedScene
from upd.vary.solve import MESH, coarser_rigs, refined
from upd.vary.variation import ALONE, Levels, Overrides, Problem, Variation

#: source of error beside the mesh
STEPS = "load steps"


def levels(plan: SeatedPlan) -> Levels:
    """Coarser rigs, faces and bodies alike, and half the load steps."""
    scene = plan.scene
    if not scene.estimates:
        return {}
    half = Variation(STEPS, "half the load steps", _steps(scene, 0.5), 2.0)
    return {MESH: coarser_rigs(PROBLEM, plan), STEPS: [half]}


def _steps(scene: SeatedScene, factor: float) -> Overrides:
    """So many times the load steps; those of a cycle in quarters."""
    return (
        ("seating.steps", max(1, round(factor * scene.seating.steps))),
        ("seating.cycle_steps", 4 * max(1, round(factor * scene.seating.cycle_steps / 4))),
        ("moved.steps", max(1, round(factor * scene.moved.steps))),
    )


def _finer(plan: SeatedPlan, source: str, factor: float) -> Overrides:
    return refined(plan.scene, factor) if source == MESH else _steps(plan.scene, factor)


PROBLEM = Problem(make_plan, solve, make_results, lambda _: ALONE, levels, _finer)
