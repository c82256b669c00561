"""Errors of a seated damper's numbers: the nodes of its faces, the mesh of its bodies, load steps,
the contact's solver.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from upd.analyses.companions import (
    Companion,
    Key,
    SolvedLevel,
    level_estimates,
    merged,
    paired_estimates,
    solve_companions,
)
from upd.analyses.seated.checks import ROUNDING
from upd.analyses.seated.levels import (
    MESH,
    NODES,
    STEPS,
    companion_scene,
    companions,
    refined,
    shorter_steps,
    with_lattice,
)
from upd.analyses.seated.plan import SeatedPlan, make_plan, solve_seconds
from upd.analyses.seated.results import make_results
from upd.analyses.seated.solve import SeatedSolution, solve
from upd.errors import InputError
from upd.progress import Stages
from upd.results import ErrorPart, Estimates, Result
from upd.scene import SeatedScene

SOLVER = "contact solver"
_ZERO = "the number is zero: its error is not relative to it"


def plan_with_estimates(scene: SeatedScene) -> SeatedPlan:
    """The plan of ``scene`` with what its companions cost. Raises InputError as `make_plan`."""
    plan = make_plan(scene)
    again = companions(plan).seconds
    return replace(plan, seconds=plan.seconds + again, estimate_seconds=again)


def estimate(solution: SeatedSolution, numbers: Sequence[Result], stages: Stages) -> Estimates:
    """What every source adds to the error of every number.

    A number that is zero, or that a companion has with the other sign, has no error relative to
    it and says so.
    """
    run, before = solution.plan, stages.elapsed()
    plan = replace(run, seconds=run.seconds - run.estimate_seconds, estimate_seconds=0.0)
    chosen, half = companions(plan), partial(_half_cost, plan, before)
    own = {(r.name, r.case): r.value for r in numbers if not r.withheld}
    own_level = SolvedLevel("the run", 1.0, own, before)
    lattices, faults = _solved(chosen.lattices, stages)
    told = [*faults, *filter(None, [chosen.told.get(NODES)])]
    found = [level_estimates(NODES, numbers, lattices, partial(half, NODES), faults=told)]
    levels = list(lattices)
    first = next((one.label for one in chosen.lattices), "")
    base = next((o for o in lattices if o.label == first), None) if first else own_level
    for source in (MESH, STEPS):
        made = [chosen.others[source]] if base and source in chosen.others else []
        other, faults = _solved(made, stages)
        levels += other
        if base and other:
            found.append(paired_estimates(source, numbers, base, other[0], partial(half, source)))
        else:
            why = "; ".join(faults) or chosen.told.get(source, f"{first} was not solved")
            part = ErrorPart(source, float("nan"), f"not estimated: {why}")
            found.append(dict.fromkeys(own, (part,)))
    known = merged(*found, _by_solver(solution, numbers))
    return {key: of_one_sign(own[key], key, levels) or parts for key, parts in known.items()}


def _solved(made: Iterable[Companion], stages: Stages) -> tuple[list[SolvedLevel], list[str]]:
    return solve_companions(made, lambda one: make_results(solve(one, Stages())), stages)


def of_one_sign(
    value: float, key: Key, levels: Iterable[SolvedLevel]
) -> tuple[ErrorPart, ...] | None:
    """Why a number has no error relative to it, where its sign is not the same on all levels."""
    if value == 0.0:
        return (ErrorPart(NODES, float("nan"), _ZERO),)
    other = [o for o in levels if key in o.values and np.sign(o.values[key]) != np.sign(value)]
    if not other:
        return None
    names = ", ".join(f"{one.values[key]:.3g} with {one.label}" for one in other)
    why = f"not estimated: zero or of the other sign on companions ({names})"
    return (ErrorPart(NODES, float("nan"), why),)


def _by_solver(solution: SeatedSolution, numbers: Iterable[Result]) -> Estimates:
    """Of forces, what their balance is held to: a self-check of the run."""
    force = solution.plan.scene.damper.centrifugal
    basis = f"forces balance F_C to {ROUNDING:g} of it, a self-check"
    return {
        (one.name, one.case): (ErrorPart(SOLVER, ROUNDING * force / abs(one.value), basis),)
        for one in numbers
        if one.unit == "N" and one.value and not one.withheld
    }


def _half_cost(plan: SeatedPlan, seconds: float, source: str, order: float) -> float | None:
    """Seconds that half of a source's error adds, the error of an order; ``seconds``: of the run.

    None where the recipe takes no such level.
    """
    scene = companion_scene(plan.scene)
    finer = 2.0 ** (1.0 / order)
    makers: dict[str, Callable[[], SeatedScene]] = {
        NODES: lambda: with_lattice(scene, 1.0 / finer),
        # the nodes of the faces where they are
        MESH: lambda: refined(with_lattice(scene, finer), finer),
        STEPS: lambda: shorter_steps(scene),
    }
    try:
        more = makers[source]()
        return max(0.0, seconds * (solve_seconds(make_plan(more)) / solve_seconds(plan) - 1.0))
    except InputError:
        return None
