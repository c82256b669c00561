"""What varies in a seated damper: for the errors of its numbers the mesh of bodies and faces and
the load steps; in convergence studies meshes of its faces, elements, load steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from upd.analyses.seated.plan import SeatedPlan, make_plan
from upd.analyses.seated.results import make_results
from upd.analyses.seated.solve import solve
from upd.analyses.seated.varied import corrected
from upd.scene import SeatedScene
from upd.vary.ladder import Asked, Ladder, counts, even, whole_levels
from upd.vary.solve import MESH, coarser_rigs, refined
from upd.vary.variation import Levels, Overrides, Problem, Variation, of_geometry

#: source of error beside the mesh
STEPS = "load steps"


def levels(plan: SeatedPlan) -> Levels:
    """Coarser rigs, faces and bodies alike, and half the load steps."""
    half = Variation(STEPS, "half the load steps", _steps(plan.scene, 0.5), 2.0)
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


PROBLEM = Problem(make_plan, solve, make_results, levels=levels, finer=_finer, corrected=corrected)


# -- convergence studies --------------------------------------------------------------------------

#: numbers a ladder follows beside those the analysis names first
_NUMBERS = ("closed_share", "max_pressure", "damper_u?", "seating_loss")
#: arrangement -> elements up a patch, and those that go with them, along it first
PATCH = {
    "symmetric": ("patch_along_slope", ("patch_along_y",)),
    "asymmetric": ("pad_along_slope", ("pad_along_y", "face_along_z")),
}
#: elements up a patch
_SLOPE = (4, 8, 12, 16)
_BASE: Overrides = (("want", ["seating", "stiffness"]), ("left_out.solve", "no"))


def _meshes(scene: SeatedScene, asked: Asked, *, all_elements: bool) -> Iterator[Variation]:
    """Elements up the patch, those along it in proportion."""
    slope, others = PATCH[scene.arrangement]
    usual = int(scene.geometry[slope])
    for element in ("hex8", "hex8i") if all_elements else (scene.mesh.element,):
        for n in whole_levels(asked, 2) or _SLOPE:
            counted = {slope: n} | {key: even(scene.geometry[key] * n / usual) for key in others}
            overrides = (*_BASE, *of_geometry(counted), ("mesh.element", element))
            yield Variation(element, f"{n} elements up the patch", overrides, 1.0 / n)


_STEPS = counts("steps", "{} load steps", "seating.steps", (2, 5, 10, 20, 40), 2, _BASE)
LADDERS: Mapping[str, Ladder] = {
    "mesh": Ladder(partial(_meshes, all_elements=False), _NUMBERS),
    "element": Ladder(partial(_meshes, all_elements=True), _NUMBERS),
    "steps": Ladder(_STEPS, _NUMBERS),
}
