"""Solve a scene again with one thing changed."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

from upd.errors import UpdError, one_line
from upd.progress import Stages
from upd.results import Result
from upd.vary.scatter import Samples
from upd.vary.variation import RUN, Overrides, Problem, SolvedVariation, Variation

log = logging.getLogger(__name__)


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


def solve(
    problem: Problem,
    scene: Any,
    run: SolvedVariation,
    variations: Sequence[Variation],
    stages: Stages,
) -> list[SolvedVariation]:
    """Solve the variations of a scene, one after the other; a fault becomes its reason.

    Parameters
    ----------
    run
        The scene itself, solved.
    variations
        Bases before what is compared with them.
    """
    done = {RUN: run}
    for one in variations:
        base = None if one.base is None else done[one.base]
        if base is not None and base.reason:
            done[one] = SolvedVariation(one, reason=f"{base.variation.label} was not solved")
            continue
        begin = perf_counter()
        try:
            with stages("error estimates", one.label):
                numbers, samples = _numbers(problem, scene, one)
        except UpdError as error:
            log.info("variation with %s not solved: %s", one.label, error)
            done[one] = SolvedVariation(one, reason=f"{one.label}: {one_line(error)}")
            continue
        done[one] = SolvedVariation(one, numbers, perf_counter() - begin, samples, base)
    return list(done.values())[1:]


def _numbers(
    problem: Problem, scene: Any, variation: Variation
) -> tuple[Sequence[Result], Samples]:
    """Of a variation; its solution is released: its factors are the memory of the next."""
    solution = problem.solve(varied_plan(problem, scene, variation), Stages())
    samples = {} if problem.sample is None else problem.sample(solution)
    return problem.make_results(solution), samples
