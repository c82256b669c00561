"""What varies in a rig: its mesh, for the errors of its numbers; the modes kept are judged by the
full model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from upd.analyses.base import chosen_by_accuracy, refuse_oversize, require_memory
from upd.analyses.modal.plan import ModalPlan, make_plan
from upd.analyses.modal.results import REDUCED, make_results
from upd.analyses.modal.solve import ModalSolution, solve
from upd.errors import InputError
from upd.progress import Stages
from upd.results import ErrorPart, Estimates, Result
from upd.results import quantities as q
from upd.results.quantities import quantity_of
from upd.scene import RigScene
from upd.scene.quantities import UNKNOWN
from upd.vary.errors import estimate, estimate_in_round, merged
from upd.vary.solve import changed, varied_plan
from upd.vary.variation import ALONE, Levels, Overrides, Problem, SolvedVariation, Variation
from upd.vary.wanted import LevelChoice, Wanted, solve_wanted

#: sources of error
MESH, KEPT = "mesh", "modes kept"
#: parts of the run's refinement of the companions
COARSER = (0.7, 0.5)
#: times the elements along an edge, and numbers of modes kept, of an accuracy
_FINER, _MODES = (1, 2, 3), (5, 10, 20, 40)
#: elements with nodes between the corners, and the spacing of nodes without these over that with
_QUADRATIC, _BETWEEN = ("hex20", "hex27"), 2.0
#: outputs a companion has, where the run has them: the reduced model has the mesh of the full one
_WANTED = ("free", "glued", "response")
_COARSEST = "the rig cannot be meshed coarser: its recipe has no smaller refinement"


def bare(scene: RigScene) -> Overrides:
    """Overrides without what costs and shows no number."""
    return (("want", tuple(w for w in scene.want if w in _WANTED) or ("free",)), *ALONE)


def levels(plan: ModalPlan) -> Levels:
    """Variations of the rig's mesh.

    Of quadratic elements the linear ones with incompatible modes on the same hexahedra, with twice
    the spacing of nodes: corners and clamped edges let the frequencies of both fall with the same
    order, below the formal one of either. Of linear elements coarser rigs; none where the recipe
    has no refinement, or is as coarse as it can be.
    """
    scene = plan.scene
    refine = scene.geometry.get("refine")
    if not scene.estimates or not isinstance(refine, (int, float)):
        return Levels((), {MESH: _COARSEST})
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
    plan = make_plan(scene)
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
    # The reduced model has the mesh of the full one.
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
        if one.name == q.FREE_PEAK_ACCELERANCE.name and solution.more_modes is not None:
            error = abs(solution.more_modes / one.value - 1.0)
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


# -- an accuracy that is wanted --------------------------------------------------------------------


def choices(scene: RigScene) -> list[LevelChoice]:
    """What may be chosen of a rig: its refinement from its own up, and the number of modes kept."""
    found = []
    refine, reduction = scene.geometry.get("refine"), scene.reduction
    if isinstance(refine, (int, float)):
        labels = [f"x {n}" for n in _FINER]
        found.append(LevelChoice(MESH, "elements along an edge", labels, _finer))
    if scene.wants("reduction") and reduction.below is None and reduction.error is None:
        labels = [f"{n} a blade" for n in _MODES]
        found.append(LevelChoice(KEPT, "modes kept", labels, _with_modes))
    return found


def _finer(scene: RigScene, level: int) -> RigScene:
    refine = _FINER[level] * float(scene.geometry["refine"])
    return replace(scene, geometry={**scene.geometry, "refine": refine})


def _with_modes(scene: RigScene, level: int) -> RigScene:
    return replace(scene, reduction=replace(scene.reduction, modes=_MODES[level]))


def level_of(plan: ModalPlan) -> Variation:
    refine = float(plan.scene.geometry.get("refine", 1.0))
    return _refined(refine, 1.0 / refine)


def _in_round(
    solution: ModalSolution,
    numbers: Sequence[Result],
    stages: Stages,
    memo: list[SolvedVariation],
) -> Estimates:
    """By the coarser meshes of the rounds before; the usual variations on the coarsest."""
    found = estimate_in_round(PROBLEM, level_of, solution, numbers, stages, memo)
    return estimate(PROBLEM, solution, numbers, stages) if found is None else found


WANTED = Wanted(
    choices,
    {name: name for name in ("f*_free", "f*_glued", "f*_reduced")},
    plan_with_estimates,
    solve,
    make_results,
    _in_round,
    refuse_oversize,
    chosen_by_accuracy,
    lambda scene: changed(scene, (("left_out.solve", "no"),)),
)


def solve_levels(plan: ModalPlan, stages: Stages) -> ModalSolution:
    """Run the plan, on levels that reach an accuracy where its scene asks for one."""
    solution: ModalSolution
    solution, found = solve_wanted(WANTED, plan, stages)
    return replace(solution, estimates=found)
