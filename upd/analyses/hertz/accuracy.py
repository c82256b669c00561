"""The cheapest mesh that reaches a wanted accuracy, verified by its own error estimate on two
levels.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from upd.analyses.base import refuse_oversize
from upd.analyses.contact.levels import mesh_estimates
from upd.analyses.contact.plan import ContactPlan, refined_growth
from upd.analyses.convergence import estimate_error
from upd.analyses.hertz.plan import auto_patch, make_plan
from upd.analyses.hertz.results import make_results
from upd.analyses.hertz.solution import Estimates, HertzSolution
from upd.analyses.hertz.solve import solve_plan
from upd.errors import ConvergenceError, InputError
from upd.mesh import recipes
from upd.progress import Stages
from upd.reference import contact_modulus, hertz_sphere
from upd.results import Estimates as Parts
from upd.results import Result
from upd.scene import Scene

log = logging.getLogger(__name__)

Solved = TypeVar("Solved")

#: Numbers the accuracy is asked of: those of the normal contact. The others carry their estimate
#: beside them; a slip annulus thinner than an element converges late and would multiply the cost of
#: every run.
GOVERNING = ("radius_moment", "max_pressure", "mean_pressure", "approach")
#: Nodes along the contact radius of the smallest load, level by level (ratio about sqrt 2).
LEVELS = (3.0, 4.2, 6.0, 8.5, 12.0, 17.0, 24.0)
#: Growth of neighbouring elements (when the scene gives none) on a level with that many nodes along
#: the radius.
_GROWTH, _GROWTH_AT = 1.5, 6.0
#: Order that predicts what half of an error costs, where the levels show none: the lowest the
#: method has.
_LOWEST_ORDER = 1.0
#: Error estimate times nodes along the contact radius, measured on the Hertz scene with one load
#: (0.17 to 0.21 on levels 3 to 5): what to expect of a level before it has run.
_FIRST = 0.2


@dataclass(frozen=True)
class Level(Generic[Solved]):
    """One level that has run.

    Its scene and plan, what was solved, its results, and the seconds it took.
    """

    scene: Scene
    plan: ContactPlan
    solved: Solved
    results: tuple[Result, ...]
    seconds: float


def level_scene(scene: Scene, level: int) -> Scene:
    """``scene`` with patch and divisions for ``level``.

    A patch sized from the largest load, spacing from the smallest.
    """
    if scene.sphere_radius is None:
        raise InputError(
            f"mesh.accuracy: the recipe {scene.recipe!r} has no contact radius to size the "
            "mesh from; give geometry.divisions"
        )
    loads = [F for F in scene.loads.forces if F > 0.0]
    if not loads:
        raise InputError("mesh.accuracy: needs a positive normal load to size the mesh")
    m1, m2 = list(scene.materials.values())[:2]
    E = contact_modulus(m1.E, m1.nu, m2.E, m2.nu)
    radius = hertz_sphere(min(loads), scene.sphere_radius, E).radius
    given = scene.geometry.get("patch", "auto")
    patch = auto_patch(scene, max(loads)) if given == "auto" else float(given)
    divisions = 2 * math.ceil(0.5 * patch / radius * LEVELS[level])
    if scene.mesh.element in ("hex20", "hex27"):
        divisions = 2 * math.ceil(divisions / 4)
    geometry = {**scene.geometry, "patch": patch, "divisions": max(4, divisions)}
    if "growth" in recipes.parameters(scene.recipe).__dataclass_fields__:
        # The far mesh is refined with the patch.
        geometry["growth"] = round(
            refined_growth(
                float(scene.geometry.get("growth", _GROWTH)), _GROWTH_AT / LEVELS[level]
            ),
            4,
        )
    return replace(scene, geometry=geometry, mesh=replace(scene.mesh, accuracy=None))


def plan_to_accuracy(scene: Scene) -> ContactPlan:
    """Derive the plan of a scene, on the predicted mesh when it asks for an accuracy.

    That is the level that first-order convergence from `_FIRST` suggests; `choose` may end one
    level off. Nothing is solved. Raises InputError when parts of the scene do not fit together.
    """
    target = scene.mesh.accuracy
    if target is None:
        return make_plan(scene)
    level = next((k for k, nodes in enumerate(LEVELS) if _FIRST / nodes <= target), len(LEVELS) - 1)
    return replace(make_plan(level_scene(scene, level)), asked=scene)


def solve_to_accuracy(plan: ContactPlan, stages: Stages) -> HertzSolution:
    """Run everything the plan calls for, on the cheapest mesh that reaches its accuracy when the
    scene asks for one.

    The solution then has the estimated errors of its numbers. Errors as for `solve_plan` and
    `choose`.
    """
    if plan.asked is None:
        return solve_plan(plan, stages)

    def solved(plan: ContactPlan) -> tuple[HertzSolution, tuple[Result, ...], float]:
        before = stages.elapsed()
        refuse_oversize(plan)
        with stages(
            "accuracy ladder",
            f"{plan.parameters['divisions']} divisions on {plan.parameters['patch']:.3g} mm",
        ):
            solution = solve_plan(plan, Stages())
        return solution, tuple(make_results(solution)), stages.elapsed() - before

    level, estimates = choose(plan.asked, solved)
    return replace(level.solved, estimates=estimates)


def choose(
    scene: Scene, solve: Callable[[ContactPlan], tuple[Solved, tuple[Result, ...], float]]
) -> tuple[Level[Solved], Estimates]:
    """Find the cheapest level that reaches ``scene.mesh.accuracy``.

    Levels are tried from coarse to fine; each is judged by the orders of convergence that it and
    the levels before it show, number by number (`upd.analyses.convergence.estimate_error`).

    Parameters
    ----------
    solve
        Runs a plan and returns what it solved, its results and its seconds.

    Returns
    -------
    Level, Estimates
        The chosen level, already solved, and its estimated errors.

    Raises
    ------
    ConvergenceError
        When the finest level misses the target.
    """
    target = scene.mesh.accuracy
    assert target is not None
    # No more of a level than its numbers: its factors are the memory of the next.
    known: list[tuple[ContactPlan, tuple[Result, ...]]] = []
    worst = float("inf")
    for k in range(len(LEVELS)):
        here = level_scene(scene, k)
        plan = make_plan(here)
        level = Level(here, plan, *solve(plan))
        if known:
            estimates = estimate(known, level)
            judged = {key: e for key, (e, _) in estimates.items() if key[0] in GOVERNING}
            name, worst = max(judged.items(), key=lambda item: item[1])
            log.info(
                "accuracy: level %d, %s estimated at %.3g, target %.3g",
                k,
                f"{name[0]} {name[1]}",
                worst,
                target,
            )
            if worst <= target:
                return level, estimates
        known.append((plan, level.results))
    failure = ConvergenceError(
        f"mesh.accuracy: the finest level reaches {100 * worst:.2g} % of the wanted "
        f"{100 * target:.2g} %: ask for less, "
        "or give geometry.divisions yourself"
    )
    failure.partial = level.solved
    raise failure


def estimate(
    coarser: Sequence[tuple[ContactPlan, tuple[Result, ...]]], fine: Level[Solved]
) -> Estimates:
    """Estimated error of the fine level's numbers and predicted seconds of a mesh with half of it.

    Parameters
    ----------
    coarser
        Plans and results of the levels before it; a number that one of them does not have is judged
        by the others.
    """
    ladder = (*coarser, (fine.plan, fine.results))
    sizes = [_spacing(plan) for plan, _ in ladder]
    known = [{(r.name, r.case): r.value for r in results} for _, results in ladder]
    costs: dict[float, float] = {}
    out: Estimates = {}
    for key in known[-1]:
        levels = [(h, values[key]) for h, values in zip(sizes, known, strict=True) if key in values]
        if len(levels) < 2 or key[0].startswith("traction_misfit"):
            continue
        found = estimate_error(*zip(*levels, strict=True))
        order = found.order if found.clear else _LOWEST_ORDER
        if order not in costs:
            costs[order] = _half_cost(fine, order)
        out[key] = found.error, costs[order]
    return out


def _spacing(plan: ContactPlan) -> float:
    return float(plan.parameters["patch"]) / float(plan.parameters["divisions"])


def _half_cost(fine: Level[Solved], order: float) -> float:
    """Seconds of the mesh that halves an error of the order.

    Measured seconds times the ratio of predictions.
    """
    finer = 2.0 ** (1.0 / order)
    geometry = {
        **fine.scene.geometry,
        "divisions": 2 * math.ceil(0.5 * finer * int(fine.plan.parameters["divisions"])),
    }
    if "growth" in geometry:
        geometry["growth"] = refined_growth(float(geometry["growth"]), 1.0 / finer)
    return (
        fine.seconds * make_plan(replace(fine.scene, geometry=geometry)).seconds / fine.plan.seconds
    )


def estimate_mesh(solution: HertzSolution, numbers: Sequence[Result], stages: Stages) -> Parts:
    """The error of every number by the mesh, where the scene did not choose it by one."""
    return mesh_estimates(solution.plan, numbers, stages, make_plan, _numbers)


def _numbers(plan: ContactPlan) -> list[Result]:
    return make_results(solve_plan(plan, Stages()))
