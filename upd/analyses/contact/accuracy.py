"""The cheapest mesh of a contact that reaches a wanted accuracy, proved by the error estimates of
the levels before it.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import partial
from typing import Any, Generic, TypeVar

from upd.analyses.base import CHOSEN_BY_ACCURACY, Effect, refuse_oversize
from upd.analyses.contact.levels import MESH, half_cost, spacing, with_estimates
from upd.analyses.contact.plan import ContactPlan
from upd.analyses.levels_choice import require_named
from upd.errors import ConvergenceError, InputError
from upd.progress import Stages
from upd.results import Estimates, Result
from upd.scene import Scene
from upd.vary import errors
from upd.vary.errors import source_estimates
from upd.vary.variation import Problem, SolvedVariation, Variation

log = logging.getLogger(__name__)

Solved = TypeVar("Solved")
#: plan -> what it solved, its numbers, its seconds
SolveLevel = Callable[[ContactPlan], tuple[Solved, tuple[Result, ...], float]]


@dataclass(frozen=True)
class AccuracyLadder:
    """Meshes of a scene from coarse to fine, and the numbers that an accuracy is asked of.

    Attributes
    ----------
    problem
        How the scene of a level is planned and solved; its errors are those by the levels before.
    scenes
        scene -> the scene of every level, coarse to fine, without its accuracy.
    governing
        Names of the numbers (shell patterns) that one accuracy for all is asked of.
    first
        scene, accuracy -> the level that a plan predicts.
    """

    problem: Problem
    scenes: Callable[[Scene], Sequence[Callable[[], Scene]]]
    governing: tuple[str, ...]
    first: Callable[[Scene, float], int]


@dataclass(frozen=True)
class Level(Generic[Solved]):
    """One level that has run: its plan, what was solved, its numbers, its seconds."""

    plan: ContactPlan
    solved: Solved
    results: tuple[Result, ...]
    seconds: float

    @property
    def divisions(self) -> str:
        """Of its mesh, in words."""
        names = ("divisions_long", "divisions")
        known = [str(self.plan.parameters[n]) for n in names if n in self.plan.parameters]
        return " x ".join(known) + " divisions"


def plan_to_accuracy(ladder: AccuracyLadder, scene: Scene) -> ContactPlan:
    """The plan of a scene, on the predicted mesh when it asks for an accuracy.

    `choose` may end on another level. Nothing is solved. Raises InputError when parts of the scene
    do not fit together.
    """
    wanted, make_plan = scene.wanted_accuracy, ladder.problem.make_plan
    if wanted is None:
        return with_estimates(ladder.problem, make_plan(scene))
    least = min(wanted.values()) if isinstance(wanted, Mapping) else wanted
    levels = ladder.scenes(scene)
    plans: list[ContactPlan] = [
        make_plan(make()) for make in levels[: ladder.first(scene, least) + 1]
    ]
    before = sum(plan.solve_seconds for plan in plans[:-1])
    return replace(
        plans[-1],
        asked=scene,
        seconds=plans[-1].seconds + before,
        solve_seconds=plans[-1].solve_seconds + before,
        estimate_seconds=before,
    )


def solve_to_accuracy(ladder: AccuracyLadder, plan: ContactPlan, stages: Stages) -> Any:
    """Run everything the plan calls for, on the cheapest mesh that reaches its accuracy when the
    scene asks for one.

    The solution then has the estimated errors of its numbers. Errors as for the ladder's solver and
    `choose`.
    """
    if plan.asked is None:
        return ladder.problem.solve(plan, stages)

    def solved(plan: ContactPlan) -> tuple[Any, tuple[Result, ...], float]:
        before = stages.elapsed()
        with stages("accuracy ladder", f"{plan.parameters['divisions']} divisions"):
            solution = ladder.problem.solve(plan, Stages())
        numbers = tuple(ladder.problem.make_results(solution))
        return solution, numbers, stages.elapsed() - before

    level, estimates = choose(ladder, plan.asked, solved)
    chosen = replace(level.plan, asked=plan.asked)
    return replace(level.solved, plan=chosen, estimates=estimates)


def estimate(
    ladder: AccuracyLadder, solution: Any, numbers: Sequence[Result], stages: Stages
) -> Estimates:
    """The error of every number by the mesh: by the levels of the ladder, or by coarser ones."""
    if solution.plan.asked is not None:
        found: Estimates = solution.estimates
        return found
    return errors.estimate(ladder.problem, solution, numbers, stages)


def choose(
    ladder: AccuracyLadder, scene: Scene, solve: SolveLevel[Solved]
) -> tuple[Level[Solved], Estimates]:
    """Find the cheapest level that reaches the scene's accuracy.

    Levels are tried from coarse to fine; each is judged by what it and the levels before it show,
    number by number (`upd.vary.errors.source_estimates`).

    Returns
    -------
    Level, Estimates
        The chosen level, already solved, and its estimated errors.

    Raises
    ------
    InputError
        When the scene names a number that the run does not have.
    ConvergenceError
        When the finest level misses the target; ``partial`` is the finest that was solved.
    """
    wanted = scene.wanted_accuracy
    assert wanted is not None
    known: list[SolvedVariation] = []
    told: list[str] = []
    miss, level = math.inf, None
    estimates: Estimates | None = None
    for make in ladder.scenes(scene):
        plan = ladder.problem.make_plan(make())
        try:
            refuse_oversize(plan)
        except InputError as refused:
            if level is None:
                raise
            raise _missed(str(refused), told, level.solved, estimates) from None
        # No more of a level than its numbers: its factors are the memory of the next.
        level = None
        try:
            level = Level(plan, *solve(plan))
        except InputError as refused:
            if not known:
                raise
            raise _missed(str(refused), told, None, estimates) from None
        if isinstance(wanted, Mapping):
            require_named(wanted, level.results)
        sample = ladder.problem.sample
        samples = {} if sample is None else sample(level.solved)
        own = Variation(MESH, level.divisions, size=_spacing(plan))
        run = SolvedVariation(own, level.results, level.seconds, samples)
        if known:
            estimates = _estimates(known, run, plan)
            name, error, miss = _worst(estimates, wanted, ladder.governing)
            log.info("accuracy: %s, %s estimated at %.3g", level.divisions, name, error)
            told.append(f"{level.divisions}: {name} {100.0 * error:.2g} %")
            if miss <= 1.0:
                chosen = Effect(CHOSEN_BY_ACCURACY[1], True, "; ".join(told))
                effects = (*level.plan.effects, chosen)
                return replace(level, plan=replace(level.plan, effects=effects)), estimates
        known.append(run)
    why = f"the finest level's largest error is {miss:.2g} times the wanted one"
    raise _missed(why, told, None if level is None else level.solved, estimates)


def _missed(
    why: str, told: Sequence[str], solved: Any, estimates: Estimates | None
) -> ConvergenceError:
    """The accuracy is not reached: the last level and what is known of its errors stay."""
    failure = ConvergenceError(
        f"accuracy: {why} ({told[-1] if told else 'one level only'}): ask for less, or give "
        "geometry.divisions yourself"
    )
    failure.partial, failure.estimates = solved, estimates
    return failure


def _spacing(plan: ContactPlan) -> float:
    edge = next((n for n in ("patch", "patch_length", "pad_length") if n in plan.parameters), None)
    return spacing(plan.parameters) * (1.0 if edge is None else float(plan.parameters[edge]))


def _estimates(
    known: Sequence[SolvedVariation], run: SolvedVariation, plan: ContactPlan
) -> Estimates:
    """Errors of a level's numbers by all levels before it, the finest of them first."""
    levels = [
        replace(one, variation=replace(one.variation, size=one.variation.size / run.variation.size))
        for one in reversed(known)
    ]
    return source_estimates(MESH, run, levels, partial(half_cost, plan, MESH, run.seconds))


def _worst(
    estimates: Estimates, wanted: float | Mapping[str, float], governing: Sequence[str]
) -> tuple[str, float, float]:
    """The number farthest from its accuracy, its error, and that over the wanted one."""
    targets = wanted if isinstance(wanted, Mapping) else dict.fromkeys(governing, wanted)
    found = [
        (f"{name} {case.label}".rstrip(), parts[0].error, parts[0].error / target)
        for (name, case), parts in estimates.items()
        for pattern, target in targets.items()
        if fnmatchcase(name, pattern)
    ]
    if not found:
        return "no number", math.inf, math.inf
    return max(found, key=lambda one: one[2] if math.isfinite(one[2]) else math.inf)
