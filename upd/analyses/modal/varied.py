"""What varies in a rig: its mesh, for the errors of its numbers; the modes kept are judged by the
full model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from upd.analyses.base import require_memory
from upd.analyses.modal.plan import ModalPlan, make_plan
from upd.analyses.modal.results import REDUCED, make_results
from upd.analyses.modal.solve import ModalSolution, solve
from upd.errors import InputError
from upd.results import ErrorPart, Estimates, Result
from upd.results import quantities as q
from upd.results.quantities import quantity_of
from upd.scene import RigScene
from upd.scene.quantities import UNKNOWN
from upd.vary.errors import merged
from upd.vary.solve import varied_plan
from upd.vary.variation import ALONE, Levels, Overrides, Problem, SolvedVariation, Variation

#: sources of error
MESH, KEPT = "mesh", "modes kept"
#: parts of the run's refinement of the companions
COARSER = (0.7, 0.5)
#: elements with nodes between the corners, and the spacing of nodes without these over that with
_QUADRATIC, _BETWEEN = ("hex20", "hex27"), 2.0
#: outputs a companion has, where the run has them: the reduced model has the mesh of the full one
_WANTED = ("free", "glued", "response")
_COARSEST = "the rig cannot be meshed coarser: its recipe has no smaller refinement"


def bare(scene: RigScene) -> Overrides:
    """What takes off a scene what costs and shows no number."""
    return (("want", tuple(w for w in scene.want if w in _WANTED) or ("free",)), *ALONE)


def levels(plan: ModalPlan) -> Levels:
    """Variations of the rig's mesh.

    The coarser rigs that the plan names. Else of quadratic elements the linear ones with
    incompatible modes on the same hexahedra, with twice the spacing of nodes: corners and clamped
    edges let the frequencies of both fall with the same order, below the formal one of either. Of
    linear elements coarser rigs; none where the recipe has no refinement, or is as coarse as it can
    be.
    """
    scene = plan.scene
    refine = scene.geometry.get("refine")
    if not scene.estimates or not isinstance(refine, (int, float)):
        return Levels((), {MESH: _COARSEST})
    if plan.coarser:
        return Levels([_refined(part * refine, 1.0 / part) for part in plan.coarser])
    if scene.mesh.element in _QUADRATIC:
        label = "elements hex8i on the same hexahedra"
        return Levels([Variation(MESH, label, (("mesh.element", "hex8i"),), _BETWEEN)])
    made = []
    for part in COARSER:
        one = _refined(part * refine)
        try:
            coarse = varied_plan(PROBLEM, scene, one)
        except InputError:
            # As coarse as it can be.
            continue
        size = (_hexes(plan) / _hexes(coarse)) ** (1.0 / 3.0)
        if size > 1.0:
            made.append(replace(one, size=size))
    return Levels(made, {MESH: _COARSEST})


def _refined(refine: float, size: float = 1.0) -> Variation:
    label = f"geometry.refine = {refine:.2g}"
    return Variation(MESH, label, (("geometry.refine", refine),), size)


def plan_with_estimates(scene: RigScene) -> ModalPlan:
    """The plan of ``scene`` with what its variations cost. Raises InputError as `make_plan`."""
    return with_variations(make_plan(scene))


def with_variations(plan: ModalPlan) -> ModalPlan:
    """The plan with what its variations cost."""
    again = sum(varied_plan(PROBLEM, plan.scene, one).seconds for one in levels(plan).variations)
    return replace(plan, seconds=plan.seconds + again, estimate_seconds=again)


def _hexes(plan: ModalPlan) -> int:
    return sum(count["hexes"] for count in plan.size.values())


def _corrected(
    solution: ModalSolution,
    run: SolvedVariation,
    solved: Sequence[SolvedVariation],
    found: Estimates,
) -> Estimates:
    """The errors by the mesh, and of the reduced model by the modes it keeps."""
    del solved
    # The reduced model stands on the same mesh as the full one.
    of_full = {
        (r.name, r.case): found[full.name, full.case]
        for r in run.numbers
        if r.case == REDUCED and (full := _full(r, run.numbers)) is not None
    }
    return merged({**found, **of_full}, _by_modes(solution, run.numbers))


def _full(reduced: Result, numbers: Sequence[Result]) -> Result | None:
    """The frequency of the full model that a reduced one stands for."""
    quantity, n = quantity_of(reduced.name)
    wanted = quantity.full.format(n=n)
    return next((r for r in numbers if r.name == wanted), None)


def _by_modes(solution: ModalSolution, numbers: Sequence[Result]) -> Estimates:
    """What the modes left out change: known against the full model, or solved again."""
    out = {}
    for one in numbers:
        full = _full(one, numbers) if one.case == REDUCED else None
        if full is not None:
            error = abs(one.value / full.value - 1.0)
            out[one.name, one.case] = (ErrorPart(KEPT, error, "against the full model"),)
        if one.name == q.FREE_PEAK_ACCELERANCE.name and solution.again.peak is not None:
            error = abs(solution.again.peak / one.value - 1.0)
            basis = "solved again with the modes up to twice the limit"
            out[one.name, one.case] = (ErrorPart(KEPT, error, basis),)
    return out


def _half_cost(plan: ModalPlan, source: str, seconds: float, order: float) -> float:
    """Seconds that a rig with half of an error of the order adds; ``seconds``: of the run.

    InputError where it does not fit the memory.
    """
    del source
    scene = replace(plan.scene, accuracy=UNKNOWN)
    refine = 2.0 ** (1.0 / order) * float(scene.geometry["refine"])
    finer = make_plan(replace(scene, geometry={**scene.geometry, "refine": refine}))
    require_memory(scene, finer.memory_bytes)
    return max(0.0, seconds * (finer.seconds / make_plan(scene).seconds - 1.0))


PROBLEM = Problem(
    make_plan, solve, make_results, bare, (MESH,), levels, _half_cost, corrected=_corrected
)
