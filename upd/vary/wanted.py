"""Levels of a scene that reach a wanted accuracy: round by round, one source raised by one level.

A round solves the wanted numbers and estimates what every source leaves in them. The source that
leaves most of the number farthest from its accuracy, for the seconds that its next level adds, is
raised, until all numbers are reached; the whole scene is then solved on these levels.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from typing import Any

from upd.errors import ConvergenceError, InputError, one_line
from upd.progress import Stages
from upd.results import ErrorPart, Estimates, Result
from upd.vary.errors import estimate_in_round
from upd.vary.solve import changed, plan_with_estimates
from upd.vary.variation import Key, Problem, SolvedVariation

log = logging.getLogger(__name__)
#: level of every choice, 0 the cheapest
Levels = tuple[int, ...]
#: number -> source -> its error over the accuracy that is wanted of the number
Shares = Mapping[Key, Mapping[str, float]]
#: fewest seconds that a level is taken to add
_LEAST_S = 1e-3


def plan_wanted(problem: Problem, scene: Any) -> Any:
    """The plan of a scene; with the seconds of the rounds before where it asks for an accuracy.

    Raises
    ------
    InputError
        When parts of the scene do not fit together.
    """
    if scene.wanted_accuracy is None:
        return plan_with_estimates(problem, scene)
    search = LevelSearch(problem, scene)
    if problem.predicted:
        known = range(min(problem.predicted, len(search.choices[0].levels)))
        scenes, run = [search.scene((k,)) for k in known], "a run on levels like these"
    else:
        lowest = problem.trial(search.scene(search.lowest))
        scenes, run = [lowest, replace(scene, accuracy=None)], "a run on the scene's own"
    *before, plan = map(search.plan_of, scenes)
    again = sum(one.seconds - one.files_seconds for one in before)
    names = ", ".join(one.name for one in search.choices)
    why = f"rounds from the lowest levels up; predicted is {run}: {names}"
    return replace(
        plan.chosen_by_accuracy(why),
        asked=scene,
        seconds=plan.seconds + again,
        estimate_seconds=plan.estimate_seconds + again,
    )


def solve_wanted(problem: Problem, plan: Any, stages: Stages) -> tuple[Any, Estimates | None]:
    """Run a plan; on levels that are shown to reach the accuracy where its scene asks for one.

    A number is given up where the sources without a higher level, or without one within the memory,
    leave more than its accuracy. The others are still brought to theirs, and the run ends with an
    error that names what it lacks.

    Returns
    -------
    solution, Estimates or None
        With the errors of its numbers where the scene asks for an accuracy.

    Raises
    ------
    InputError
        When the scene names a number that the run does not have.
    ConvergenceError
        When an accuracy is not reached; ``partial`` is the last round, ``estimates`` the errors of
        its numbers.
    """
    if plan.asked is None:
        return problem.solve(plan, stages), None
    search = LevelSearch(problem, plan.asked)
    levels, solution, found = search.lowest, None, None
    while True:
        trial = search.trial(levels)
        try:
            trial.refuse_oversize()
            # its factors are the memory of the next
            solution = None
            with stages("accuracy rounds", search.text(levels)):
                solution, found = search.solved(trial)
        except InputError as refused:
            if not search.rounds:
                raise
            raise search.missed(one_line(refused), solution, found) from None
        shares = None if found is None else shares_of(found, search.accuracies)
        worst = max(shares or {}, key=lambda key: _sum((shares or {})[key]), default=None)
        told = "no bound yet" if not shares or worst is None else _obstacle(worst, shares[worst])
        search.rounds.append(f"{search.text(levels)}: {told}")
        log.info("accuracy: %s", search.rounds[-1])
        raised = search.raised(levels, shares)
        if raised is None:
            break
        levels = raised
    if lack := search.lack(shares or {}):
        raise search.missed(lack, solution, found)
    why = f"{search.text(levels)}; rounds: {' | '.join(search.rounds)}"
    whole = search.planned(levels).chosen_by_accuracy(why)
    if whole.scene != trial.scene:
        solution = None
        solution, found = search.solved(whole)
        if lack := search.lack(shares_of(found, search.accuracies)):
            why = f"the whole run misses what its numbers alone reached: {lack}"
            raise search.missed(why, solution, found)
    return replace(solution, plan=whole), found


class LevelSearch:
    """The levels of one scene that asks for an accuracy.

    Attributes
    ----------
    choices, accuracies
        What may be chosen; names of numbers, as shell patterns -> largest error wanted of them.
    lowest, plan_of
        The cheapest levels; scene on its levels -> plan.
    rounds
        The levels of every round, and the number farthest from its accuracy.
    """

    def __init__(self, problem: Problem, asked: Any) -> None:
        self.problem, self.asked = problem, asked
        self.choices = problem.choices(asked)
        self.lowest: Levels = (0,) * len(self.choices)
        with_variations = partial(plan_with_estimates, problem)
        self.plan_of = with_variations if problem.varies_lowest else problem.make_plan
        given, names = asked.wanted_accuracy, problem.governing(asked)
        self.accuracies: dict[str, float] = (
            {names.get(name, name): error for name, error in given.items()}
            if isinstance(given, Mapping)
            else dict.fromkeys(names.values(), given)
        )
        self.rounds: list[str] = []
        self._memo: list[SolvedVariation] = []
        self._plans: dict[Levels, Any] = {}
        self._withheld: dict[Key, str] = {}

    def scene(self, levels: Levels) -> Any:
        """The scene on these levels, which asks for no accuracy any more."""
        scene = replace(self.asked, accuracy=None)
        for choice, level in zip(self.choices, levels, strict=True):
            scene = changed(scene, choice.at(scene, level))
        return scene

    def planned(self, levels: Levels) -> Any:
        """The plan of the whole run."""
        if levels not in self._plans:
            self._plans[levels] = self.plan_of(self.scene(levels))
        return self._plans[levels]

    def trial(self, levels: Levels) -> Any:
        """The plan of the wanted numbers alone."""
        whole = self.scene(levels)
        alone = self.problem.trial(whole)
        return self.planned(levels) if alone == whole else self.plan_of(alone)

    def solved(self, plan: Any) -> tuple[Any, Any]:
        """A plan's solution, and the errors of its numbers."""
        clock = Stages()
        solution = self.problem.solve(plan, clock)
        numbers = self.problem.make_results(solution)
        if isinstance(self.asked.wanted_accuracy, Mapping):
            require_named(self.accuracies, numbers)
        self._withheld = {
            (one.name, one.case): f"{one.name} {one.case.label}: {one.withheld}"
            for one in numbers
            if one.withheld and any(fnmatchcase(one.name, name) for name in self.accuracies)
        }
        return solution, estimate_in_round(self.problem, solution, numbers, clock, self._memo)

    def raised(self, levels: Levels, shares: Shares | None) -> Levels | None:
        """The levels of the next round; None where all numbers are reached or given up.

        Of the number farthest from its accuracy the source is raised that leaves most for the
        seconds it adds, of those that leave more than an even part of the accuracy; the first one
        where no number has a bound yet.
        """
        if shares is None:
            return self._higher(levels, 0)
        missed = {key: parts for key, parts in shares.items() if 1.0 < _sum(parts) < math.inf}
        for key in sorted(missed, key=lambda key: -_sum(missed[key])):
            parts = missed[key]
            higher = {one.source: self._higher(levels, k) for k, one in enumerate(self.choices)}
            raisable = {s: share for s, share in parts.items() if higher.get(s) is not None}
            if not raisable or _sum(parts) - _sum(raisable) > 1.0:
                continue
            even = min(max(raisable.values()), 1.0 / len(parts))
            now = self.planned(levels).seconds
            gains = {
                one: share / max(self.planned(one).seconds - now, _LEAST_S)
                for source, share in raisable.items()
                if share >= even and (one := higher[source]) is not None
            }
            return max(gains, key=lambda one: gains[one])
        return None

    def _higher(self, levels: Levels, k: int) -> Levels | None:
        """The levels with a choice one higher; None where there is none, or it does not fit."""
        if levels[k] + 1 == len(self.choices[k].levels):
            return None
        higher = (*levels[:k], levels[k] + 1, *levels[k + 1 :])
        try:
            self.planned(higher).refuse_oversize()
        except InputError:
            return None
        return higher

    def text(self, levels: Levels) -> str:
        """The levels in words."""
        pairs = zip(self.choices, levels, strict=True)
        return ", ".join(f"{one.name} {one.labels[k]}" for one, k in pairs)

    def lack(self, shares: Shares) -> str:
        """What is not reached and why, and what is; "" where all is."""
        missed = [_obstacle(key, one) for key, one in shares.items() if not _sum(one) <= 1.0]
        missed += self._withheld.values()
        if not shares:
            missed.append("no number has a bound")
        reached = [_name(key) for key, parts in shares.items() if _sum(parts) <= 1.0]
        if missed and reached:
            missed.append(f"reached are {', '.join(reached)}")
        return "; ".join(missed)

    def missed(self, why: str, solution: Any, found: Any) -> ConvergenceError:
        """The accuracy is not reached: the last round and what is known of its errors stay."""
        rounds = f"; rounds: {' | '.join(self.rounds)}" if self.rounds else ""
        failure = ConvergenceError(
            f"accuracy: no levels within this machine's memory reach it ({why}{rounds}): ask for "
            "less, or give the levels yourself and no accuracy"
        )
        failure.partial, failure.estimates = solution, found
        return failure


def shares_of(
    estimates: Mapping[Key, Sequence[ErrorPart]], accuracies: Mapping[str, float]
) -> dict[Key, dict[str, float]]:
    """Errors of the wanted numbers by source, over what is wanted of them.

    Parameters
    ----------
    estimates
        Parts of the errors of a run's numbers.
    accuracies
        Name of a number, as a shell pattern -> largest relative error; of several patterns the
        first counts.
    """
    out: dict[Key, dict[str, float]] = {}
    for key, parts in estimates.items():
        target = next((w for name, w in accuracies.items() if fnmatchcase(key[0], name)), None)
        if target is not None and parts:
            mine: dict[str, float] = {}
            for part in parts:
                mine[part.source] = mine.get(part.source, 0.0) + part.error / target
            out[key] = mine
    return out


def require_named(wanted: Collection[str], results: Iterable[Result]) -> None:
    """Raise InputError for names (shell patterns) that no number of the run has."""
    names = list(dict.fromkeys(r.name for r in results))
    missing = [n for n in wanted if not any(fnmatchcase(name, n) for name in names)]
    if missing:
        raise InputError(
            f"accuracy: {', '.join(missing)}: this run has no number of that name; it has "
            f"{', '.join(names)}"
        )


def _sum(parts: Mapping[str, float]) -> float:
    """Of a number over its accuracy; inf where a source has no estimate."""
    total = math.fsum(parts.values())
    return total if math.isfinite(total) else math.inf


def _name(key: Key) -> str:
    return f"{key[0]} {key[1].label}".rstrip()


def _obstacle(key: Key, parts: Mapping[str, float]) -> str:
    """What keeps a number from its accuracy."""
    unknown = [source for source, error in parts.items() if not math.isfinite(error)]
    if unknown:
        return f"{_name(key)}: no estimate of what {', '.join(unknown)} leave"
    most = max(parts, key=lambda source: parts[source])
    return f"{_name(key)}: most of it by {most}, {_sum(parts):.2g} times its accuracy"
