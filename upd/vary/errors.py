"""Errors of a run's numbers from variations of its scene: coarser levels."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

from upd.errors import InputError, one_line
from upd.progress import Stages
from upd.results import ErrorPart, Estimates, Result
from upd.results.quantities import quantity_of
from upd.vary.orders import ErrorEstimate, ladder_error, sampled_error
from upd.vary.solve import predicted_seconds, solve
from upd.vary.variation import COARSER, RUN, Key, Problem, SolvedVariation, Variation

_LACKING = "no companion has this number"
_ZERO = "the number is zero: its error is not relative to it"
_SIGNLESS = "not estimated: zero or of the other sign on other levels"


def estimate(
    problem: Problem, solution: Any, numbers: Sequence[Result], stages: Stages
) -> Estimates:
    """What every source adds to the errors of a run's numbers.

    Parameters
    ----------
    solution, numbers
        Of the run, with its plan.
    stages
        Of the run.

    Returns
    -------
    Estimates
        Those of the rounds where these chose the run's levels.
    """
    known: Estimates | None = getattr(solution, "estimates", None)
    if known is not None:
        return known
    plan, run = solution.plan, SolvedVariation(RUN, numbers, stages.elapsed())
    solved = {
        source: solve(problem, plan.scene, found, stages)
        for source, found in problem.levels(plan).items()
    }
    if any(one.numbers for levels in solved.values() for one in levels) and problem.sample:
        with stages("error estimates", "neighbouring loads"):
            run = replace(run, samples=problem.sample(solution))
    parts = list[Estimates]()
    for source, levels in solved.items():
        half = cache(partial(half_cost, problem, plan, source, run.seconds))
        parts.append(source_estimates(source, run, levels, half))
    return problem.corrected(solution, numbers, merged(*parts))


def estimate_in_round(
    problem: Problem,
    solution: Any,
    numbers: Sequence[Result],
    stages: Stages,
    memo: list[SolvedVariation],
) -> Estimates | None:
    """What the mesh adds to the errors of a round's numbers, by the coarser ones of earlier rounds.

    Parameters
    ----------
    solution, numbers, stages
        Of the round.
    memo
        The levels of earlier rounds, coarse to fine; this one is added.

    Returns
    -------
    Estimates or None
        None where only another level shows them.
    """
    level, seconds = problem.level_of(solution.plan), stages.elapsed()
    samples = {} if problem.sample is None else problem.sample(solution)
    run = SolvedVariation(level, numbers, seconds, samples)
    coarser = [
        replace(one, variation=replace(one.variation, size=one.variation.size / level.size))
        for one in reversed(memo)
        if one.variation.size > level.size
    ]
    if all(one.variation.size != level.size for one in memo):
        memo.append(run)
    if not coarser:
        return estimate(problem, solution, numbers, stages) if problem.varies_lowest else None
    half = cache(partial(half_cost, problem, solution.plan, level.source, seconds))
    found = source_estimates(level.source, run, coarser, half)
    return problem.corrected(solution, numbers, found)


def source_estimates(
    source: str,
    run: SolvedVariation,
    levels: Sequence[SolvedVariation],
    half: Callable[[float], tuple[float | None, str]],
) -> Estimates:
    """What one source adds to the errors of a run's numbers.

    Parameters
    ----------
    source
        Name of it.
    levels
        Its variations, the finest of coarser ones first; or why there are none.
    half
        Order of convergence -> seconds that a level with half the error adds, or None and why there
        is no such level.

    Returns
    -------
    Estimates
        A part for every number of the run; NaN with its reason where no variation has the number.
    """
    known = [one for one in levels if not one.reason]
    faults = "; ".join(one.reason for one in levels if one.reason)
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    for number in run.numbers:
        key = number.name, number.case
        # an error itself has none
        if number.withheld or quantity_of(number.name)[0].is_error:
            continue
        found = bound(key, run, known)
        if math.isfinite(found.error):
            cost, why = half(found.order if 0.0 < found.order < math.inf else found.falls)
            part = ErrorPart(source, found.error, found.basis, cost, why)
        else:
            part = ErrorPart(source, math.nan, found.basis or faults or _LACKING)
        out[key] = (part,)
    return out


def bound(key: Key, run: SolvedVariation, levels: Sequence[SolvedVariation]) -> ErrorEstimate:
    """Bound of a number's error by what the levels of one source are.

    Where the run and its levels have the number at neighbouring loads it is `sampled_error`,
    `ladder_error` else.

    Returns
    -------
    ErrorEstimate
        Its error is NaN, with the reason, where the number is zero or has no sign; without one
        where no level has it.
    """
    known = [one for one in levels if key in one.values]
    if not known:
        return ErrorEstimate(math.nan, math.nan, "")
    own = run.values[key]
    if any(one.values[key] * own <= 0.0 for one in known):
        return ErrorEstimate(math.nan, math.nan, _SIGNLESS if own else _ZERO)
    if key in run.samples and all(key in one.samples for one in known):
        # Far coarser ones follow no law of the spacing yet.
        known = known[: len(COARSER)]
        at_loads = [run.samples[key], *(one.samples[key] for one in known)]
        found = sampled_error([1.0, *(one.variation.size for one in known)], at_loads)
    else:
        values = [own, *(one.values[key] for one in known)]
        found = ladder_error([1.0, *(one.variation.size for one in known)], values)
    labels = ", ".join(one.variation.label for one in known)
    return replace(found, basis=f"against {labels}: {found.basis}")


def half_cost(
    problem: Problem, plan: Any, source: str, seconds: float, order: float
) -> tuple[float | None, str]:
    """Seconds that half of an error of the order adds to such a run, or why there are none."""
    factor = 2.0 ** (1.0 / order)
    try:
        finer = Variation(source, "", problem.finer(plan, source, factor), 1.0 / factor)
        own = predicted_seconds(problem, plan, RUN)
        return max(0.0, seconds * (predicted_seconds(problem, plan, finer) / own - 1.0)), ""
    except InputError as error:
        return None, one_line(error)


def merged(*found: Estimates) -> Estimates:
    """The parts of several sources, number by number."""
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    for one in found:
        for key, parts in one.items():
            out[key] = (*out.get(key, ()), *parts)
    return out
