"""Rounds until an accuracy is reached: on a made-up analysis, and on toys of rig and response."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from rigs import LINES

import upd
from upd.analyses import make_plan
from upd.analyses.base import CHOSEN_BY_ACCURACY, Plan
from upd.errors import ConvergenceError, InputError
from upd.progress import Stages
from upd.results import Case, ErrorPart, Estimates, Result
from upd.results.quantities import Quantity
from upd.scene import load_scene
from upd.vary.variation import LevelChoice, Problem
from upd.vary.wanted import LevelSearch, require_named, shares_of, solve_wanted

pytestmark = pytest.mark.estimated

CASE = Case()
EFFECT = CHOSEN_BY_ACCURACY[0]
SIZES = (1.0, 0.5, 0.25, 0.125)


@dataclass(frozen=True)
class MadeUpSolver:
    memory: float | None = None


@dataclass(frozen=True)
class MadeUpScene:
    """A number with the errors of two sources, each of second order; ``lost``: without a bound."""

    mesh: int = 0
    modes: int = 0
    want: tuple[str, ...] = ("number", "more")
    accuracy: Any = None
    lost: str = ""
    worse: float = 1.0
    solver: MadeUpSolver = field(default_factory=MadeUpSolver)
    estimates: bool = True

    @property
    def wanted_accuracy(self) -> Any:
        return self.accuracy


@dataclass(frozen=True)
class MadeUpSolution:
    plan: Plan[Any]


def _plan(scene: MadeUpScene) -> Plan[Any]:
    seconds = 8.0**scene.mesh * (1.0 + 0.1 * scene.modes)
    return Plan(scene, {}, "full", (), {}, {}, seconds, 1e6 * seconds, 1)


def _errors(scene: MadeUpScene) -> dict[str, float]:
    more = scene.worse if "more" in scene.want else 1.0
    return {
        "mesh": 0.2 * SIZES[scene.mesh] ** 2 * more,
        "modes": math.nan if scene.lost else 0.002 * SIZES[scene.modes] ** 2,
    }


class MadeUp:
    """Rounds of the made-up analysis, and the scenes that were solved."""

    def __init__(self) -> None:
        self.solved: list[MadeUpScene] = []
        levels = (1, 2, 4, 8)
        self.problem = Problem(
            _plan,
            self._solve,
            lambda solution: [Result("number", CASE, 1.0, "N")],
            corrected=lambda solution, numbers, found: self._estimate(solution, numbers),
            choices=lambda scene: [
                LevelChoice(
                    "mesh", "mesh", "{}", levels, lambda _, n: (("mesh", levels.index(n)),)
                ),
                LevelChoice(
                    "modes", "modes", "{}", levels, lambda _, n: (("modes", levels.index(n)),)
                ),
            ],
            governing=lambda scene: {"number": "number"},
            varies_lowest=True,
            trial=lambda scene: replace(scene, want=("number",)),
        )

    def _solve(self, plan: Plan[Any], stages: Stages) -> MadeUpSolution:
        self.solved.append(plan.scene)
        return MadeUpSolution(plan)

    @staticmethod
    def _estimate(solution: Any, numbers: Sequence[Result]) -> Estimates:
        errors = _errors(solution.plan.scene)
        return {("number", CASE): tuple(ErrorPart(s, e, "") for s, e in errors.items())}

    def run(self, scene: MadeUpScene) -> tuple[Any, Estimates | None]:
        plan = replace(_plan(replace(scene, accuracy=None)), asked=scene)
        return solve_wanted(self.problem, plan, Stages())


def test_the_cheapest_levels_are_solved_whole_and_say_what_was_not_needed() -> None:
    made = MadeUp()
    solution, found = made.run(MadeUpScene(accuracy=0.02))
    # 0.2 / 16 + 0.002 <= 0.02: the mesh twice finer twice over, the modes as they are
    assert [(s.mesh, s.modes, s.want) for s in made.solved] == [
        (0, 0, ("number",)),
        (1, 0, ("number",)),
        (2, 0, ("number",)),
        (2, 0, ("number", "more")),
    ]
    assert found is not None
    assert sum(p.error for p in found["number", CASE]) <= 0.02
    (effect,) = (e for e in solution.plan.effects if e.name == EFFECT)
    assert "mesh 4, modes 1; rounds: " in effect.why
    assert solution.plan.scene.accuracy is None


def test_a_wanted_number_that_a_run_withholds_is_not_reached() -> None:
    """Its error has no parts; the others are brought to theirs, and the run says what it lacks."""
    made = MadeUp()
    lost = Quantity("number_2", "N").withheld(CASE, "no steady motion")
    made.problem = replace(
        made.problem,
        governing=lambda scene: {"all": "number*"},
        make_results=lambda solution: [Result("number", CASE, 1.0, "N"), lost],
    )
    with pytest.raises(ConvergenceError, match="number_2 : no steady motion") as error:
        made.run(MadeUpScene(accuracy={"all": 0.02}))
    assert "reached are number" in str(error.value)
    assert made.solved[-1].mesh == 2
    unwanted = replace(made.problem, governing=lambda scene: {"all": "number"})
    made.problem = unwanted
    assert made.run(MadeUpScene(accuracy={"all": 0.02}))[1] is not None


class WithAScatteringNumber(MadeUp):
    """Beside the number another, in which modes leave the same on every level."""

    def __init__(self) -> None:
        super().__init__()
        numbers = [Result(name, CASE, 1.0, "N") for name in ("number", "scattering")]
        self.problem = replace(
            self.problem,
            governing=lambda scene: {"all": "*"},
            make_results=lambda solution: numbers,
        )

    @staticmethod
    def _estimate(solution: Any, numbers: Sequence[Result]) -> Estimates:
        parts = MadeUp._estimate(solution, numbers)["number", CASE]
        lost = (*parts[:1], replace(parts[1], error=0.05))
        return {("number", CASE): parts, ("scattering", CASE): lost}


def test_a_number_out_of_reach_is_given_up_and_the_others_are_reached() -> None:
    made = WithAScatteringNumber()
    with pytest.raises(ConvergenceError) as failed:
        made.run(MadeUpScene(accuracy=0.004))
    told = str(failed.value)
    assert "scattering: most of it by modes, 13 times its accuracy" in told
    assert "reached are number; rounds: mesh " in told
    # 0.2 / 64 by the mesh, which the number out of reach had raised with the modes
    (parts,) = (failed.value.estimates["number", CASE],)
    assert sum(p.error for p in parts) <= 0.004
    last = failed.value.partial.plan.scene
    assert (last.mesh, last.modes, last.want) == (3, 3, ("number",))
    assert made.solved[-1] == last


class WithANumberThatSettles(WithAScatteringNumber):
    """The other number no longer scatters on the finest mesh."""

    @staticmethod
    def _estimate(solution: Any, numbers: Sequence[Result]) -> Estimates:
        parts = MadeUp._estimate(solution, numbers)["number", CASE]
        # 1/64 of it is too much as well
        lost = (*parts[:1], replace(parts[1], error=0.5))
        settled = solution.plan.scene.mesh == 3
        return {("number", CASE): parts, ("scattering", CASE): parts if settled else lost}


def test_what_is_raised_for_others_may_bring_a_number_within_reach() -> None:
    """It is given up by what it is in the last round, not in an early one."""
    made = WithANumberThatSettles()
    solution, found = made.run(MadeUpScene(accuracy=0.004, want=("number",)))
    assert solution.plan.scene.mesh == 3
    assert found is not None
    assert all(sum(p.error for p in parts) <= 0.004 for parts in found.values())


def test_numbers_alone_are_not_solved_twice() -> None:
    made = MadeUp()
    made.run(MadeUpScene(accuracy={"number": 0.5}, want=("number",)))
    assert [(s.mesh, s.modes) for s in made.solved] == [(0, 0)]


def test_a_scene_without_an_accuracy_runs_as_it_is() -> None:
    made = MadeUp()
    plan = _plan(MadeUpScene())
    assert solve_wanted(made.problem, plan, Stages()) == (MadeUpSolution(plan), None)


@pytest.mark.parametrize(
    ("scene", "why"),
    [
        (MadeUpScene(accuracy=1e-4), "number: most of it by mesh"),
        (MadeUpScene(accuracy=0.02, lost="yes"), "no estimate of what modes leave"),
        (MadeUpScene(accuracy=0.02, solver=MadeUpSolver(2e7)), "number: most of it by"),
        (MadeUpScene(accuracy=0.02, worse=3.0), "the whole run misses what its numbers alone"),
    ],
    ids=["too fine", "lost", "memory", "whole run"],
)
def test_a_miss_keeps_the_last_round_and_its_errors(scene: MadeUpScene, why: str) -> None:
    with pytest.raises(ConvergenceError, match=why) as told:
        MadeUp().run(scene)
    assert isinstance(told.value.partial, MadeUpSolution)
    assert ("number", CASE) in told.value.estimates
    assert "ask for less" in str(told.value)


def test_a_name_that_no_number_has_is_refused_in_the_first_round() -> None:
    made = MadeUp()
    with pytest.raises(InputError, match="peak: this run has no number of that name; it has numb"):
        made.run(MadeUpScene(accuracy={"peak": 0.1}))
    assert len(made.solved) == 1


@pytest.mark.parametrize("seed", range(20))
def test_rounds_raise_one_source_at_a_time_until_all_is_reached(seed: int) -> None:
    """Errors that fall by any power: levels only rise, and no source that leaves less than an even
    part of the accuracy is raised while one leaves more.
    """
    rng = np.random.default_rng(seed)
    power = rng.uniform(0.5, 3.0, 2)
    first = 0.02 * 10.0 ** rng.uniform(-1.0, 1.0, 2)

    def errors(scene: MadeUpScene) -> dict[str, float]:
        sizes = SIZES[scene.mesh], SIZES[scene.modes]
        found = (float(e * h**p) for e, h, p in zip(first, sizes, power, strict=True))
        return dict(zip(("mesh", "modes"), found, strict=True))

    made = MadeUp()
    made.problem = replace(
        made.problem,
        corrected=lambda solution, numbers, found: {
            ("number", CASE): tuple(
                ErrorPart(s, e, "") for s, e in errors(solution.plan.scene).items()
            )
        },
    )
    asked = MadeUpScene(accuracy=0.02, want=("number",))
    try:
        made.run(asked)
    except ConvergenceError:
        left = errors(made.solved[-1])
        last = made.solved[-1]
        assert sum(e for s, e in left.items() if getattr(last, s) == len(SIZES) - 1) > 0.02
    for before, after in pairwise(made.solved):
        raised = [s for s in ("mesh", "modes") if getattr(after, s) > getattr(before, s)]
        assert len(raised) == 1
        assert after.mesh + after.modes == before.mesh + before.modes + 1
        others = [e for s, e in errors(before).items() if getattr(before, s) < len(SIZES) - 1]
        assert errors(before)[raised[0]] >= min(0.5 * 0.02, max(others))
        assert sum(errors(before).values()) > 0.02


def test_the_source_that_leaves_most_for_its_seconds_is_raised() -> None:
    search = LevelSearch(MadeUp().problem, MadeUpScene(accuracy=0.02))
    key = ("number", CASE)
    # a finer mesh takes 7 s more, more modes 0.1 s
    assert search.raised((0, 0), {key: {"mesh": 5.0, "modes": 1.0}}) == (0, 1)
    assert search.raised((0, 0), {key: {"mesh": 5.0, "modes": 0.4}}) == (1, 0)
    assert search.raised((0, 0), {key: {"mesh": 0.5, "modes": 0.5}}) is None
    # what is on its highest level is too much, or is not known
    assert search.raised((3, 0), {key: {"mesh": 5.0, "modes": 1.0}}) is None
    assert search.raised((3, 0), {key: {"mesh": 0.6, "modes": 0.5}}) == (3, 1)
    assert search.raised((0, 0), {key: {"time": 0.9, "modes": 0.2}}) == (0, 1)
    assert search.raised((0, 0), {key: {"time": 1.1, "modes": 0.2}}) is None
    assert search.raised((0, 0), {key: {"mesh": math.nan, "modes": 9.0}}) is None
    # without any bound the first source, which another level shows
    assert search.raised((0, 0), None) == (1, 0)


def test_shares_are_errors_over_what_is_wanted_of_the_number() -> None:
    found = shares_of(
        {
            ("peak_1_frequency", CASE): (
                ErrorPart("mesh", 0.004, ""),
                ErrorPart("mesh", 0.002, ""),
            ),
            ("peak_1_accelerance", CASE): (ErrorPart("modes", 0.05, ""),),
            ("static_N", CASE): (ErrorPart("mesh", 0.5, ""),),
        },
        {"peak_?_frequency": 0.002, "peak_?_accelerance": 0.05},
    )
    assert found == {
        ("peak_1_frequency", CASE): {"mesh": pytest.approx(3.0)},
        ("peak_1_accelerance", CASE): {"modes": pytest.approx(1.0)},
    }


def test_names_that_no_number_has_are_refused() -> None:
    numbers = [Result("K_N", CASE, 1.0, "N/mm")]
    require_named({"K_*": 0.01}, numbers)
    with pytest.raises(InputError, match=r"accuracy: K_X, K_Y: this run has no number .* K_N"):
        require_named({"K_X": 0.01, "K_Y": 0.01, "K_N": 0.1}, numbers)


#: a response that takes seconds: at this F_C/F_E every point sticks
STUCK: dict[str, Any] = {
    **LINES,
    "want": ["response"],
    "mesh.element": "hex8i",
    "contact.stiffness": ["thesis"],
    "contact.rule": "gauss",
    "contact.rows": 3,
    "contact.columns": 2,
    "contact.static": "frictionless",
    "balance.method": "balance",
    "excitation.start": "440 Hz",
    "excitation.stop": "500 Hz",
    "excitation.points": 30,
    "excitation.centrifugal_to_force": [2e6],
    "left_out.solve": "no",
}


def test_a_response_chooses_its_levels() -> None:
    """Fewer modes and harmonics than the scene has do, where all sticks; an effect says so."""
    asked = STUCK | {"accuracy": {"peak_frequency": "6 %"}}
    plan = make_plan(load_scene("symmetric-response", asked))
    assert any(e.name == EFFECT for e in plan.effects)
    found = upd.run("symmetric-response", overrides=asked)
    peak = next(r for r in found.results if r.name == "peak_2_frequency" and not r.case.kind)
    assert peak.estimated_error is not None
    assert peak.estimated_error <= 0.06
    (effect,) = (e for e in found.effects if e["name"] == EFFECT)
    assert "harmonics to 1" in effect["why"]
    assert "modes kept 5 a blade" in effect["why"]


def test_a_rig_chooses_its_levels() -> None:
    asked = {
        "want": ["free"],
        "mesh.element": "hex8i",
        "modes.arrangements": ["symmetric"],
        "modes.below": "400 Hz",
        "left_out.solve": "no",
        "accuracy": "6 %",
    }
    found = upd.run("rig", overrides=asked)
    rows = [r for r in found.results if r.name in ("f1_free", "f2_free")]
    assert rows
    assert all(r.estimated_error is not None and r.estimated_error <= 0.06 for r in rows)
    (effect,) = (e for e in found.effects if e["name"] == EFFECT)
    assert "elements along an edge x" in effect["why"]


def test_whole_faces_say_that_they_do_not_choose() -> None:
    with pytest.raises(InputError, match=r"accuracy: .* does not choose its levels itself; raise"):
        load_scene(
            "symmetric-response",
            {"accuracy": "1 %", "contact.model": "interface", "mesh.element": "hex8i"},
        )
