"""The same contact on coarser and finer meshes: levels that show what the mesh leaves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from upd.analyses.base import chosen_by_accuracy, refuse_oversize, require_memory
from upd.analyses.contact.neighbours import has_neighbours, neighbours_seconds
from upd.analyses.contact.plan import ContactPlan, contact_plan, is_curved, refined_growth
from upd.mesh import recipes
from upd.progress import Stages
from upd.results import Result
from upd.scene import Scene
from upd.scene.contact import Loads
from upd.vary.errors import estimate_in_round
from upd.vary.scatter import Samples
from upd.vary.solve import varied_plan
from upd.vary.variation import ALONE, COARSER, POWER, Levels, Overrides, Problem, Variation
from upd.vary.wanted import LevelChoice, Wanted

#: fewest divisions of a level
FEWEST = 4
#: source of error
MESH = "mesh"
_COARSEST = "the mesh cannot be made coarser: its recipe has no divisions to lower"
#: outputs that a level need not give: no number of them is estimated, and they cost
_SPARED = ("fields", "curve")
#: power of the divisions that the memory of a level grows with: the entries of a factor by nested
#: dissection, n^(4/3) (A. George, 1973)
MEMORY_POWER = 4.0
#: parameters of a recipe that the load may size
SIZED_BY_LOAD = ("patch", "core_depth")


def level_geometry(
    parameters: Mapping[str, Any], divisions: int, *, step: int = 2
) -> dict[str, Any]:
    """Parameters of the recipe that change with the divisions of its contact.

    Parameters
    ----------
    parameters
        Of the plan.
    divisions
        Of the level, even.
    step
        Of the numbers of elements along the contact: 2 for recipes that take even ones only.

    Returns
    -------
    dict
        "divisions", and "divisions_long" and "growth" of recipes that have them: elements along
        the contact in proportion, the far mesh refined with it.
    """
    usual = int(parameters["divisions"])
    out: dict[str, Any] = {"divisions": divisions}
    if "divisions_long" in parameters:
        long = divisions * int(parameters["divisions_long"]) / (step * usual)
        out["divisions_long"] = step * max(1, round(long))
    if "growth" in parameters:
        out["growth"] = round(refined_growth(float(parameters["growth"]), usual / divisions), 4)
    return out


def coarser_divisions(plan: ContactPlan, ratios: Sequence[float]) -> list[int]:
    """Divisions of the levels about so many times coarser, each different from the others.

    Even ones about the middle of a curved contact. Where the coarsest would have too few, the
    levels stand closer together.
    """
    usual = plan.parameters.get("divisions")
    if not isinstance(usual, int) or usual <= FEWEST:
        return []
    step = 2 if is_curved(plan.scene) else 1
    first, last = min(ratios), min(max(ratios), usual / FEWEST)
    found: list[int] = []
    for ratio in np.geomspace(first, max(first, last), len(ratios)):
        n = max(FEWEST, step * round(usual / ratio / step))
        if n < min((usual, *found)):
            found.append(n)
    return found


def spacing(parameters: Mapping[str, Any]) -> float:
    """Size of the contact's elements, but for a factor of its size: of both directions the
    geometric mean.
    """
    counts = [float(parameters[n]) for n in ("divisions", "divisions_long") if n in parameters]
    return float(np.prod(counts) ** (-1.0 / len(counts)))


def bare(scene: Scene) -> Overrides:
    """What takes off a scene what costs and shows no number; of a cycle no more steps than usual,
    which only its drawing needs.
    """
    steps = min(scene.loads.cycle_steps, Loads.cycle_steps)
    want = tuple(w for w in scene.want if w not in _SPARED) or scene.want
    return (("loads.cycle_steps", steps), ("want", want), *ALONE)


def coarsened(plan: ContactPlan) -> Overrides:
    """What makes scenes into the level with half the divisions of the plan.

    A patch that the load may size follows the contact from one end of an input to the other, so
    that the same nodes touch: a tangent stiffness changes as the contact does, not by whole nodes.
    """
    half = coarser_divisions(plan, (2.0,))
    geometry = level_geometry(plan.parameters, half[0]) if half else {}
    names = SIZED_BY_LOAD if plan.scene.sphere_radius is not None else ()
    sized = {name: "auto" for name in names if name in plan.scene.geometry}
    return (*bare(plan.scene), *_geometry(sized | geometry))


def _geometry(parameters: Mapping[str, Any]) -> Overrides:
    return tuple((f"geometry.{name}", value) for name, value in parameters.items())


def levels(plan: ContactPlan) -> Levels:
    """The coarser meshes that the errors of the plan's numbers are estimated with.

    None where the scene wants none, and for a recipe without divisions.
    """
    scene = plan.scene
    if not scene.estimates:
        return Levels(())
    # Neighbouring loads show on half the divisions what the dearest level would.
    ratios = COARSER[1:] if has_neighbours(scene) else COARSER
    return Levels([_coarser(plan, n) for n in coarser_divisions(plan, ratios)], {MESH: _COARSEST})


def _coarser(plan: ContactPlan, divisions: int) -> Variation:
    geometry = level_geometry(plan.parameters, divisions)
    size = spacing({**plan.parameters, **geometry}) / spacing(plan.parameters)
    label = " x ".join(
        str(geometry[key]) for key in ("divisions_long", "divisions") if key in geometry
    )
    return Variation(MESH, f"{label} divisions", _geometry(geometry), size)


def mesh_problem(
    make_plan: Callable[[Scene], ContactPlan],
    solve: Callable[[ContactPlan, Stages], Any],
    make_results: Callable[[Any], Sequence[Result]],
    sample: Callable[[Any], Samples] | None = None,
) -> Problem:
    """A contact whose mesh varies; of plans, what is solved on them, its numbers, and these at
    neighbouring loads.
    """
    return Problem(make_plan, solve, make_results, bare, (MESH,), levels, half_cost, sample)


def plan_with_estimates(problem: Problem, scene: Scene) -> ContactPlan:
    """The plan of a scene with what its levels cost."""
    plan: ContactPlan = problem.make_plan(scene)
    made = levels(plan).variations
    again = sum(_seconds(problem, plan, one) for one in made)
    again += neighbours_seconds(plan) if made else 0.0
    return replace(
        plan,
        seconds=plan.seconds + again,
        solve_seconds=plan.solve_seconds + again,
        estimate_seconds=again,
    )


def _seconds(problem: Problem, plan: ContactPlan, one: Variation) -> float:
    """Predicted for a level and its neighbouring loads."""
    if recipes.counted_by_mesh(plan.scene.recipe):
        # A plan runs a user's recipe once: the run makes these meshes.
        return plan.solve_seconds * float(one.size**-POWER) + neighbours_seconds(plan)
    level: ContactPlan = varied_plan(problem, plan.scene, one)
    return level.solve_seconds + neighbours_seconds(level)


def wanted(
    problem: Problem,
    choices: Callable[[Scene], Sequence[LevelChoice]],
    governing: Sequence[str],
    first: Callable[[float], int],
) -> Wanted:
    """A contact whose mesh is chosen by an accuracy.

    Parameters
    ----------
    choices
        scene -> its meshes.
    governing
        Names of the numbers (shell patterns) that one accuracy for all is asked of.
    first
        accuracy -> the level that a plan predicts.
    """

    def predicted(scene: Scene) -> list[Scene]:
        asked = scene.wanted_accuracy
        least = min(asked.values()) if isinstance(asked, Mapping) else asked
        assert least is not None
        (choice,) = choices(scene)
        return [choice.at(scene, k) for k in range(min(first(least) + 1, len(choice.labels)))]

    return Wanted(
        choices,
        {name: name for name in governing},
        problem.make_plan,
        problem.solve,
        problem.make_results,
        partial(estimate_in_round, problem, level_of),
        refuse_oversize,
        chosen_by_accuracy,
        predicted=predicted,
    )


def level_of(plan: ContactPlan) -> Variation:
    known = plan.parameters
    counts = (str(known[n]) for n in ("divisions_long", "divisions") if n in known)
    edge = next((n for n in ("patch", "patch_length", "pad_length") if n in known), None)
    size = spacing(known) * (1.0 if edge is None else float(known[edge]))
    return Variation(MESH, " x ".join(counts) + " divisions", size=size)


def half_cost(plan: ContactPlan, source: str, seconds: float, order: float) -> float:
    """Seconds that a mesh with half of an error of the order adds.

    Parameters
    ----------
    seconds
        Measured, of the plan.

    Raises
    ------
    InputError
        When the mesh does not fit the memory.
    """
    del source
    finer = 2.0 ** (1.0 / order)
    if recipes.counted_by_mesh(plan.scene.recipe) or "divisions" not in plan.parameters:
        require_memory(plan.scene, plan.memory_bytes * finer**MEMORY_POWER)
        return seconds * float(finer**POWER - 1.0)
    divisions = 2 * max(1, round(0.5 * finer * int(plan.parameters["divisions"])))
    now, more = (
        contact_plan(plan.scene, plan.symmetry, plan.families, plan.effects, parameters)
        for parameters in (
            plan.parameters,
            {**plan.parameters, **level_geometry(plan.parameters, divisions)},
        )
    )
    require_memory(plan.scene, more.memory_bytes)
    return max(0.0, seconds * (more.solve_seconds / now.solve_seconds - 1.0))
