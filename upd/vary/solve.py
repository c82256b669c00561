"""Solve a scene again with one thing changed."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from time import perf_counter
from typing import Any

from upd.errors import InputError, UpdError, one_line
from upd.linalg.select import memory_left
from upd.mesh import recipes
from upd.progress import Stages
from upd.results import Result
from upd.vary.orders import Samples
from upd.vary.variation import POWER, RUN, Overrides, Problem, SolvedVariation, Variation

log = logging.getLogger(__name__)
#: source of error of all analyses
MESH = "mesh"
#: parts of a rig's refinement of its coarser levels
REFINED = (0.7, 0.5)


def changed(scene: Any, overrides: Overrides) -> Any:
    """The scene with other values; InputError where it does not take them."""
    for path, value in overrides:
        table, _, name = path.partition(".")
        old, new = getattr(scene, table), {name: value}
        if name:
            value = {**old, **new} if isinstance(old, Mapping) else replace(old, **new)
        scene = replace(scene, **{table: value})
    return scene


def varied_plan(problem: Problem, scene: Any, variation: Variation) -> Any:
    """The plan of the bare scene with what the variation changes. Raises InputError."""
    return problem.make_plan(changed(scene, (*problem.bare(scene), *variation.overrides)))


def predicted_seconds(problem: Problem, plan: Any, variation: Variation) -> float:
    """Of a variation of the plan's scene. Raises InputError where it does not fit the memory."""
    scene = plan.scene
    meshed = any(path.startswith("geometry.") for path, _ in variation.overrides)
    if meshed and recipes.counted_by_mesh(scene.recipe):
        # A plan runs a user's recipe once: the run makes these meshes.
        return float(plan.solve_seconds * variation.size**-POWER)
    level = varied_plan(problem, scene, variation)
    room = scene.solver.memory or memory_left()
    if level.memory_bytes > room:
        raise InputError(f"needs {level.memory_bytes / 1e9:.2g} GB, there are {room / 1e9:.2g}")
    return float(level.solve_seconds)


def plan_with_estimates(problem: Problem, scene: Any) -> Any:
    """The plan of a scene with what its variations cost. Raises InputError as ``make_plan``."""
    plan, again = problem.make_plan(scene), 0.0
    for found in problem.levels(plan).values() if scene.estimates else ():
        for one in () if isinstance(found, str) else found:
            # what is refused is the reason that the run gives
            with suppress(InputError):
                again += predicted_seconds(problem, plan, one)
    estimates = plan.estimate_seconds + again
    return replace(plan, seconds=plan.seconds + again, estimate_seconds=estimates)


def solve(
    problem: Problem, scene: Any, variations: Sequence[Variation] | str, stages: Stages
) -> list[SolvedVariation]:
    """Solve the variations of a scene, one after the other; a fault, or why there are none, becomes
    a reason.
    """
    if isinstance(variations, str):
        return [SolvedVariation(RUN, reason=variations)]
    done = []
    for one in variations:
        begin = perf_counter()
        try:
            with stages("error estimates", one.label):
                numbers, samples = _numbers(problem, scene, one)
        except UpdError as error:
            log.info("variation with %s not solved: %s", one.label, error)
            done.append(SolvedVariation(one, reason=f"{one.label}: {one_line(error)}"))
            continue
        done.append(SolvedVariation(one, numbers, perf_counter() - begin, samples))
    return done


# -- rigs: elements along every edge go with geometry.refine ---------------------------------------


def refinement(scene: Any) -> float | None:
    """Elements along every edge over those of the recipe; None where it has no such number."""
    known = {one.name: one.default for one in fields(recipes.parameters(scene.recipe))}
    refine = scene.geometry.get("refine", known.get("refine"))
    return float(refine) if isinstance(refine, (int, float)) else None


def refined(scene: Any, factor: float) -> Overrides:
    """So many times the elements along every edge."""
    return (("geometry.refine", factor * (refinement(scene) or 1.0)),)


def coarser_rigs(problem: Problem, plan: Any) -> list[Variation] | str:
    """The rig with fewer elements along every edge; why there is none."""
    made: list[Variation] = []
    for part in () if refinement(plan.scene) is None else REFINED:
        overrides = refined(plan.scene, part)
        level = Variation(MESH, f"geometry.refine = {overrides[0][1]:.2g}", overrides)
        try:
            coarse = varied_plan(problem, plan.scene, level)
        except InputError:
            # As coarse as it can be.
            continue
        fine, few = (sum(n["hexes"] for n in one.size.values()) for one in (plan, coarse))
        size = (fine / few) ** (1.0 / 3.0)
        if size > max((one.size for one in made), default=1.0):
            made.append(replace(level, size=size))
    return made or "the rig cannot be meshed coarser: its recipe has no smaller refinement"


def _numbers(
    problem: Problem, scene: Any, variation: Variation
) -> tuple[Sequence[Result], Samples]:
    """Of a variation; its solution is released: its factors are the memory of the next."""
    solution = problem.solve(varied_plan(problem, scene, variation), Stages())
    samples = {} if problem.sample is None else problem.sample(solution)
    return problem.make_results(solution), samples
