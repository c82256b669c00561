"""Rounds of solving, estimating and raising levels until a scene's accuracy is reached."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from upd.analyses.base import CHOSEN_BY_ACCURACY, Effect, Plan, refuse_oversize
from upd.analyses.levels_choice import (
    Key,
    Knob,
    LevelForecast,
    Levels,
    Round,
    require_named,
    shares_of,
    withheld_of,
)
from upd.errors import ConvergenceError, InputError
from upd.progress import Stages
from upd.results import Estimates, Result
from upd.vary.orders import UNCONFIRMED, estimate_error, two_level_error

#: name of the effect that tells the levels
EFFECT = CHOSEN_BY_ACCURACY[0]
#: order at which an error falls at best: of frequencies with the elements' size at corners, of
#: rules of trapezoids, of functions with kinks
AT_BEST = 2.0


@dataclass(frozen=True)
class Setting:
    """A knob, and what each of its levels makes of a scene."""

    knob: Knob
    at: Callable[[Any, int], Any]


@dataclass(frozen=True)
class Rounds:
    """What an analysis gives to have its levels chosen.

    Attributes
    ----------
    settings
        scene -> what may be chosen of it, by source.
    governing
        Names of accuracies -> numbers they are asked of, as shell patterns; one accuracy for all is
        asked of all of them. Other names stand for themselves.
    trial
        scene -> the scene with nothing but these numbers.
    make_plan
        scene asked for, its settings, levels, scene at the levels -> plan.
    solve
        plan, stages -> solution; a dataclass with its ``plan``.
    make_results
        solution -> numbers.
    estimate
        solution, numbers, stages -> the parts of their errors.
    """

    settings: Callable[[Any], list[Setting]]
    governing: Mapping[str, str]
    trial: Callable[[Any], Any]
    make_plan: Callable[[Any, Sequence[Setting], Levels, Any], Any]
    solve: Callable[[Any, Stages], Any]
    make_results: Callable[[Any], Sequence[Result]]
    estimate: Callable[[Any, Sequence[Result], Stages], Estimates]

    def wanted(self, scene: Any) -> dict[str, float]:
        """Names of numbers, as shell patterns -> largest error wanted of them."""
        wanted = scene.wanted_accuracy
        if not isinstance(wanted, Mapping):
            return dict.fromkeys(self.governing.values(), wanted)
        return {self.governing.get(name, name): error for name, error in wanted.items()}


def mesh_falls(finer: Sequence[float]) -> tuple[float, ...]:
    """Expected bounds of what meshes leave, each by those before it; over that of the first, which
    is told by elements with twice the spacing: of q = 1 + c h^2, c small.

    Parameters
    ----------
    finer
        Times the elements along an edge, rising from 1.
    """

    def q(n: float) -> float:
        return float(1.0 + 1e-3 / n**AT_BEST)

    first = UNCONFIRMED * two_level_error(q(0.5), q(1.0), 2.0)
    known = [(1.0 / n, q(n)) for n in finer]
    others = [
        estimate_error(*zip(*known[: k + 1], strict=True)).error for k in range(1, len(known))
    ]
    return (1.0, *(one / first for one in others))


class Chooser:
    """The levels of one scene that asks for an accuracy.

    Attributes
    ----------
    settings, forecast, wanted
        What may be chosen, what it is expected to leave, and what is wanted.
    planned
        Levels -> plan of the whole run.
    """

    def __init__(self, rounds: Rounds, asked: Any) -> None:
        self.rounds, self.asked = rounds, asked
        self.settings = rounds.settings(asked)
        self.forecast = LevelForecast([one.knob for one in self.settings])
        self.wanted = rounds.wanted(asked)
        self.planned = cache(lambda levels: self.plan(levels, self.scene(levels)))

    @property
    def lowest(self) -> Levels:
        """The cheapest levels."""
        return (0,) * len(self.settings)

    def scene(self, levels: Levels) -> Any:
        """The scene at these levels, which asks for no accuracy any more."""
        scene = replace(self.asked, accuracy=None)
        for setting, level in zip(self.settings, levels, strict=True):
            scene = setting.at(scene, level)
        return scene

    def plan(self, levels: Levels, scene: Any) -> Any:
        """The plan of a scene at these levels."""
        return self.rounds.make_plan(self.asked, self.settings, levels, scene)

    def trial(self, levels: Levels) -> Any:
        """The plan of the wanted numbers alone."""
        return self.plan(levels, self.rounds.trial(self.scene(levels)))

    def seconds(self, levels: Levels) -> float:
        """Predicted of a whole run; inf where it does not fit the memory."""
        plan = self.planned(levels)
        try:
            refuse_oversize(plan)
        except InputError:
            return math.inf
        return float(plan.seconds)

    def out_of_reach(self, now: Round) -> dict[Key, str]:
        """Numbers that are not reached, and that no levels are expected to reach were each of them
        wanted alone -> how far from it, and what keeps them there.
        """
        out = {}
        for key, parts in now.shares.items():
            alone = Round(now.levels, {key: parts})
            if alone.miss[0] > 1.0 and self.forecast.cheapest(alone, self.seconds) is None:
                why = f"{self.forecast.obstacle(alone)}, {_times(alone.miss[0])}"
                out[key] = why
        return out

    def words(self, levels: Levels) -> str:
        """What stands above the lowest levels, in words."""
        raised = [
            f"{one.knob.name} {one.knob.labels[k]}"
            for one, k in zip(self.settings, levels, strict=True)
            if k
        ]
        return ", ".join(raised) or "all at their lowest"

    def saving(self, now: Round, told: Sequence[str]) -> str:
        """The levels, what was not needed, and what the same level for all would cost."""
        chosen, alike = self.seconds(now.levels), self.forecast.alike(now)
        raised, spared = (
            [
                f"{one.knob.name} {one.knob.labels[k]}"
                for one, k in zip(self.settings, now.levels, strict=True)
                if bool(k) == above
            ]
            for above in (True, False)
        )
        words = [f"raised: {', '.join(raised) or 'nothing'}"]
        if spared:
            words.append(f"not needed above: {', '.join(spared)}")
        if alike is not None:
            seconds, level = self.seconds(alike), f"one level for all, number {max(alike) + 1}"
            words.append(
                f"{level}, would take {seconds / chosen:.2g} times the seconds (predicted)"
                if math.isfinite(seconds)
                else f"{level}, would not fit the memory"
            )
        return "; ".join((*words, f"rounds: {' | '.join(told)}"))


def plan_to_accuracy(rounds: Rounds, scene: Any, usual: Callable[[Any], Any]) -> Any:
    """The plan of a scene; where it asks for an accuracy that of its own levels, with the seconds
    of one round on the lowest.

    Parameters
    ----------
    usual
        scene -> plan of a scene that asks for none.

    Raises
    ------
    InputError
        When parts of the scene do not fit together.
    """
    if scene.wanted_accuracy is None:
        return usual(scene)
    chooser = Chooser(rounds, scene)
    first: Plan[Any] = chooser.trial(chooser.lowest)
    plan = usual(replace(scene, accuracy=None))
    why = (
        "rounds from the lowest levels up; predicted is a run on the scene's own: "
        f"{', '.join(one.knob.name for one in chooser.settings)}"
    )
    return replace(
        plan,
        asked=scene,
        effects=(*plan.effects, Effect(EFFECT, True, why)),
        seconds=plan.seconds + first.seconds,
        estimate_seconds=plan.estimate_seconds + first.seconds,
    )


def solve_to_accuracy(rounds: Rounds, plan: Any, stages: Stages) -> tuple[Any, Estimates | None]:
    """Run everything the plan calls for; where its scene asks for an accuracy, on the cheapest
    levels that are shown to reach it.

    A number that no levels are expected to reach is given up, after one level more of what keeps it
    there where that has not fallen as expected; the others are still brought to theirs, and the run
    ends with an error that names what it lacks.

    Returns
    -------
    solution, Estimates or None
        The errors of its numbers where the scene asks for an accuracy.

    Raises
    ------
    InputError
        When the scene names a number that the run does not have.
    ConvergenceError
        When no levels are expected to reach the accuracy of a number; ``partial`` is the last
        round, with the wanted numbers alone, ``estimates`` their errors.
    """
    if plan.asked is None:
        return rounds.solve(plan, stages), None
    chooser = Chooser(rounds, plan.asked)
    levels, before, told = chooser.lowest, None, list[str]()
    while True:
        trial = chooser.trial(levels)
        refuse_oversize(trial)
        with stages("accuracy rounds", chooser.words(levels)):
            solution, found, now = _solved(chooser, levels, trial, Stages())
        if before is not None:
            chooser.forecast.learn(before, now)
        before = now
        # anew each round: what was raised for others may have brought them within reach
        far = chooser.out_of_reach(now)
        left = now.without(far)
        told.append(_worst(chooser, now))
        missed = bool(left.shares) and left.miss[0] > 1.0
        raised = chooser.forecast.cheapest(left, chooser.seconds) if missed else None
        more = chooser.forecast.one_more(now, far, raised or levels, chooser.seconds)
        if more is None and raised is None:
            break
        levels = more or raised or levels
        # its factors are the memory of the next
        del solution
    lost = {**far, **now.withheld}
    if lost or missed or not left.shares:
        raise _missed(_lack(chooser, lost, left, told), solution, found)
    whole = chooser.planned(levels)
    effect = Effect(EFFECT, True, chooser.saving(now, told))
    whole = replace(whole, effects=(*whole.effects, effect))
    if whole.scene == trial.scene:
        return replace(solution, plan=whole), found
    del solution
    solution, found, now = _solved(chooser, levels, whole, stages)
    if now.miss[0] > 1.0 or now.withheld:
        miss = "; ".join(now.withheld.values()) or _times(now.miss[0])
        why = f"the whole run misses what its numbers alone reached: {miss}"
        raise _missed(why, solution, found)
    return solution, found


def _worst(chooser: Chooser, now: Round) -> str:
    """The levels of a round, and the number farthest from its accuracy."""
    miss, worst = now.miss
    name = _name(worst) if worst is not None else "no number"
    return f"{chooser.words(now.levels)}: {name} {_times(miss)}"


def _name(key: Key) -> str:
    return f"{key[0]} {key[1].label}".rstrip()


def _lack(chooser: Chooser, given_up: Mapping[Key, str], left: Round, told: Sequence[str]) -> str:
    """What is not reached and why; what is, and what that took."""
    none = "no levels within this machine's memory are expected to reach"
    if not given_up:
        why = chooser.forecast.obstacle(left) if left.shares else "no number has a bound"
        return f"{none} it ({why}; {told[-1]})"
    lost = "; ".join(given_up.values())
    if not left.shares or left.miss[0] > 1.0:
        return f"{none} it ({lost}; {told[-1]})"
    reached = ", ".join(_name(key) for key in left.shares)
    # No cost of one level for all: the rounds were raised for what is given up, too.
    levels, rounds = chooser.words(left.levels), " | ".join(told)
    return f"{none} {lost}; reached are {reached}, with {levels}; rounds: {rounds}"


def _solved(
    chooser: Chooser, levels: Levels, plan: Any, stages: Stages
) -> tuple[Any, Estimates, Round]:
    rounds = chooser.rounds
    solution = rounds.solve(plan, stages)
    numbers = rounds.make_results(solution)
    if isinstance(chooser.asked.wanted_accuracy, Mapping):
        require_named(chooser.wanted, numbers)
    found = rounds.estimate(solution, numbers, Stages())
    absent = withheld_of(numbers, chooser.wanted)
    return solution, found, Round(levels, shares_of(found, chooser.wanted), absent)


def _times(miss: float) -> str:
    return f"{miss:.2g} times its accuracy" if math.isfinite(miss) else "without a bound"


def _missed(why: str, solution: Any, found: Estimates) -> ConvergenceError:
    failure = ConvergenceError(
        f"accuracy: {why}: ask for less, or give the levels yourself and no accuracy"
    )
    failure.partial, failure.estimates = solution, found
    return failure
