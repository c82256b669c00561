"""Errors of a run's numbers from cheaper companions: the same scene on coarser levels."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from time import perf_counter
from types import MappingProxyType
from typing import Any, NamedTuple

from upd.analyses.base import Plan
from upd.errors import InputError, UpdError, one_line
from upd.progress import Stages
from upd.results import ErrorPart, Estimates, Result
from upd.results.case import Case
from upd.vary.orders import (
    ASSUMED,
    UNCONFIRMED,
    finer_level_error,
    ladder_error,
    two_level_error,
)
from upd.vary.scatter import Samples, sampled_error

log = logging.getLogger(__name__)

#: element sizes of the companions over those of the run
COARSER = (2.0**0.5, 2.0, 2.0**1.5)
#: numbers that are errors themselves
_ERRORS = ("*misfit*", "*_error", "*_mac", "*_difference")
Key = tuple[str, Case]


@dataclass(frozen=True)
class Companion:
    """A cheaper run that shows an error of the run.

    Attributes
    ----------
    label
        What it is, in words: "8 x 22 divisions".
    size
        Of its level over that of the run, the ratio of element sizes: above 1; below 1 over that of
        the base it refines.
    make_plan
        Makes its plan.
    seconds
        Predicted.
    """

    label: str
    size: float
    make_plan: Callable[[], Plan[Any]]
    seconds: float


class LevelNumbers(NamedTuple):
    """The numbers of a level, and the same at neighbouring loads where it has them."""

    numbers: Sequence[Result]
    samples: Samples = MappingProxyType({})


@dataclass(frozen=True)
class SolvedLevel:
    """Numbers of a level that has run: its size, label and seconds, and the same numbers at
    neighbouring loads.
    """

    label: str
    size: float
    values: dict[Key, float]
    seconds: float
    samples: Samples = field(default_factory=dict)


def solve_companions(
    companions: Iterable[Companion],
    solve: Callable[[Any], LevelNumbers],
    stages: Stages,
) -> tuple[list[SolvedLevel], list[str]]:
    """Run the companions.

    Parameters
    ----------
    solve
        plan -> its numbers.

    Returns
    -------
    list of SolvedLevel, list of str
        What was solved, and why the others were not.
    """
    solved, faults = [], []
    for one in companions:
        begin = perf_counter()
        try:
            with stages("error estimates", one.label):
                numbers, samples = solve(one.make_plan())
        except UpdError as error:
            log.info("companion with %s not solved: %s", one.label, error)
            faults.append(f"{one.label}: {one_line(error)}")
            continue
        values = {(r.name, r.case): r.value for r in numbers if not r.withheld}
        spent = perf_counter() - begin
        solved.append(SolvedLevel(one.label, one.size, values, spent, samples))
    return solved, faults


def level_estimates(
    source: str,
    numbers: Iterable[Result],
    levels: Sequence[SolvedLevel],
    half_cost: Callable[[float], float],
    *,
    faults: Sequence[str] = (),
    samples: Samples = MappingProxyType({}),
) -> Estimates:
    """What one source adds to the errors of a run's numbers.

    Where the run and its companions have a number at neighbouring loads, `sampled_error` tells, and
    `ladder_error` else.

    Parameters
    ----------
    source
        Name of it.
    numbers
        Of the run.
    levels
        Its coarser companions.
    half_cost
        Order of convergence -> seconds that a level with half the error adds. InputError says why
        there is no such level.
    faults
        Why companions are missing: told with numbers that have no estimate for it.
    samples
        Numbers of the run at neighbouring loads.

    Returns
    -------
    Estimates
        A part for every number of the run; NaN with its reason where no companion has the number.
    """
    costs: dict[float, tuple[float | None, str]] = {}
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    spent = math.fsum(level.seconds for level in levels)
    for one in _judged(numbers):
        key = (one.name, one.case)
        known = [level for level in levels if key in level.values]
        if not known:
            why = "; ".join(faults) or "no companion has this number"
            out[key] = (ErrorPart(source, float("nan"), why),)
            continue
        if key in samples and all(key in level.samples for level in known):
            # Far coarser ones follow no law of the spacing yet.
            known = known[: len(COARSER)]
            at_loads = [samples[key], *(level.samples[key] for level in known)]
            found = sampled_error([1.0, *(level.size for level in known)], at_loads)
        else:
            values = [one.value, *(level.values[key] for level in known)]
            found = ladder_error([1.0, *(level.size for level in known)], values)
        if not math.isfinite(found.error):
            why = "the number is zero: its error is not relative to it"
            out[key] = (ErrorPart(source, float("nan"), why),)
            continue
        order = found.order if 0.0 < found.order < math.inf else found.falls
        if order not in costs:
            costs[order] = _half(half_cost, order)
        told = ", ".join(level.label for level in known)
        basis = f"against {told}: {found.basis}"
        cost, why = costs[order]
        out[key] = (ErrorPart(source, found.error, basis, cost, spent, why),)
    return out


def paired_estimates(
    source: str,
    numbers: Iterable[Result],
    base: SolvedLevel,
    other: SolvedLevel,
    half_cost: Callable[[float], float],
) -> Estimates:
    """What one source adds to the errors of a run's numbers, from a base that stands for the run
    and the base with the source refined, or coarser.

    Parameters
    ----------
    source, numbers, half_cost
        As `level_estimates`.
    base
        The run itself, or a cheaper one that has the same error by this source in proportion.
    other
        Its size is over that of the base, below 1 where it is finer.

    Returns
    -------
    Estimates
        A part for every number of the run; NaN with its reason where one of both lacks the number
        or has it zero.
    """
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    cost, lost_why = _half(half_cost, ASSUMED)
    for one in _judged(numbers):
        key = (one.name, one.case)
        lost = next((level for level in (base, other) if not level.values.get(key)), None)
        if lost is not None:
            why = f"{lost.label}: " + ("zero" if key in lost.values else "without this number")
            out[key] = (ErrorPart(source, float("nan"), f"not estimated: {why}"),)
            continue
        ratio, rule = other.values[key] / base.values[key], f"order {ASSUMED:g} assumed"
        if other.size < 1.0:
            error = finer_level_error(ratio, other.size)
            shown = f"change with {other.label}, and what that leaves"
        else:
            error = UNCONFIRMED * two_level_error(ratio, 1.0, other.size, ASSUMED)
            shown = f"against {other.label}"
        basis = f"{shown}: two levels, {rule}, factor {UNCONFIRMED:g}"
        out[key] = (ErrorPart(source, error, basis, cost, other.seconds, lost_why),)
    return out


def _half(half_cost: Callable[[float], float], order: float) -> tuple[float | None, str]:
    """Seconds of half an error, or why there are none."""
    try:
        return half_cost(order), ""
    except InputError as error:
        return None, one_line(error)


def _judged(numbers: Iterable[Result]) -> Iterator[Result]:
    """Those that were reached and are no errors themselves."""
    for one in numbers:
        if not one.withheld and not any(fnmatchcase(one.name, pattern) for pattern in _ERRORS):
            yield one


def merged(*found: Estimates) -> Estimates:
    """The parts of several sources, number by number."""
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    for one in found:
        for key, parts in one.items():
            out[key] = (*out.get(key, ()), *parts)
    return out
