"""Errors of a rig's numbers: its mesh from coarser rigs, the modes kept from the full model."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from upd.analyses.base import require_memory
from upd.analyses.companions import (
    Companion,
    LevelNumbers,
    level_estimates,
    merged,
    solve_companions,
)
from upd.analyses.modal.plan import ModalPlan, make_plan
from upd.analyses.modal.results import REDUCED, make_results
from upd.analyses.modal.solve import ModalSolution, solve
from upd.errors import InputError
from upd.progress import Stages
from upd.results import ErrorPart, Estimates, Result
from upd.scene import RigScene
from upd.scene.quantities import UNKNOWN

#: sources of error
MESH, KEPT = "mesh", "modes kept"
#: parts of the run's refinement of the companions
COARSER = (0.7, 0.5)
#: elements with nodes between the corners, and the spacing of nodes without these over that with
_QUADRATIC, _BETWEEN = ("hex20", "hex27"), 2.0
#: outputs a companion has, where the run has them: the reduced model has the mesh of the full one
_WANTED = ("free", "glued", "response")
_REDUCED = re.compile(r"f(\d+)_reduced")


def companions(plan: ModalPlan) -> Iterator[Companion]:
    """Companions of the rig's mesh.

    The coarser rigs that the plan names. Else of quadratic elements the linear ones with
    incompatible modes on the same hexahedra, with twice the spacing of nodes: corners and clamped
    edges let the frequencies of both fall with the same order, below the formal one of either. Of
    linear elements coarser rigs; none where the recipe has no refinement, or is as coarse as it can
    be.
    """
    scene = plan.scene
    refine = scene.geometry.get("refine")
    if not scene.estimates or not isinstance(refine, (int, float)):
        return
    hexes = _hexes(plan)
    coarse = replace(
        scene,
        want=tuple(w for w in scene.want if w in _WANTED) or ("free",),
        left_out=replace(scene.left_out, solve="no"),
        accuracy=UNKNOWN,
    )
    for part in plan.coarser:
        one = replace(coarse, geometry={**scene.geometry, "refine": part * refine})
        label = f"geometry.refine = {part * refine:.2g}"
        made = partial(make_plan, one)
        yield Companion(label, 1.0 / part, made, make_plan(one).seconds)
    if plan.coarser:
        return
    if scene.mesh.element in _QUADRATIC:
        linear = replace(coarse, mesh=replace(scene.mesh, element="hex8i"))
        label = "elements hex8i on the same hexahedra"
        yield Companion(label, _BETWEEN, partial(make_plan, linear), make_plan(linear).seconds)
        return
    for part in COARSER:
        one = replace(coarse, geometry={**scene.geometry, "refine": part * refine})
        try:
            found = make_plan(one)
        except InputError:
            # As coarse as it can be.
            continue
        size = (hexes / _hexes(found)) ** (1.0 / 3.0)
        if size > 1.0:
            label = f"geometry.refine = {part * refine:.2g}"
            yield Companion(label, size, partial(make_plan, one), found.seconds)


def plan_with_estimates(scene: RigScene) -> ModalPlan:
    """The plan of ``scene`` with what its companions cost. Raises InputError as `make_plan`."""
    return with_companions(make_plan(scene))


def with_companions(plan: ModalPlan) -> ModalPlan:
    """The plan with what its companions cost."""
    again = sum(one.seconds for one in companions(plan))
    return replace(plan, seconds=plan.seconds + again, estimate_seconds=again)


def _hexes(plan: ModalPlan) -> int:
    return sum(count["hexes"] for count in plan.size.values())


def estimate(solution: ModalSolution, numbers: Sequence[Result], stages: Stages) -> Estimates:
    """The errors of all numbers by the mesh, and of the reduced model by the modes it keeps."""
    plan, before = solution.plan, stages.elapsed()
    made = list(companions(plan))
    levels, faults = solve_companions(
        made, lambda one: LevelNumbers(make_results(solve(one, Stages()))), stages
    )
    if not made:
        faults = ["the rig cannot be meshed coarser: its recipe has no smaller refinement"]
    mesh = level_estimates(MESH, numbers, levels, partial(_half_cost, plan, before), faults=faults)
    # The reduced model stands on the same mesh as the full one.
    of_full = {
        (r.name, r.case): mesh[full.name, full.case]
        for r in numbers
        if r.case == REDUCED and (full := _full(r, numbers)) is not None
    }
    return merged({**mesh, **of_full}, _by_modes(solution, numbers))


def _full(reduced: Result, numbers: Sequence[Result]) -> Result | None:
    """The frequency of the full model that a reduced one stands for."""
    found = _REDUCED.fullmatch(reduced.name)
    if found is None:
        return None
    wanted = f"f{found[1]}_free"
    return next((r for r in numbers if r.name == wanted), None)


def _by_modes(solution: ModalSolution, numbers: Sequence[Result]) -> Estimates:
    """What the modes left out change: known against the full model, or solved again."""
    out = {}
    for one in numbers:
        full = _full(one, numbers) if one.case == REDUCED else None
        if full is not None:
            error = abs(one.value / full.value - 1.0)
            out[one.name, one.case] = (ErrorPart(KEPT, error, "against the full model"),)
        if one.name == "peak_accelerance" and solution.again.peak is not None:
            error = abs(solution.again.peak / one.value - 1.0)
            basis = "solved again with the modes up to twice the limit"
            out[one.name, one.case] = (ErrorPart(KEPT, error, basis),)
    return out


def _half_cost(plan: ModalPlan, seconds: float, order: float) -> float:
    """Seconds that a rig with half of an error of the order adds; ``seconds``: of the run.

    InputError where it does not fit the memory.
    """
    scene = replace(plan.scene, accuracy=UNKNOWN)
    refine = 2.0 ** (1.0 / order) * float(scene.geometry["refine"])
    finer = make_plan(replace(scene, geometry={**scene.geometry, "refine": refine}))
    require_memory(scene, finer.memory_bytes)
    return max(0.0, seconds * (finer.seconds / make_plan(scene).seconds - 1.0))
