"""What inputs known within limits do to the numbers of a run, to first order.

An analysis that knows derivatives gives them. Otherwise the scene is solved at both ends of the
interval on a cheap companion: half of the relative change there is that of the run,

    delta q / q = [q(p + delta p) - q(p - delta p)] / [q(p + delta p) + q(p - delta p)].
"""

from __future__ import annotations

import logging
import math
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

from upd.errors import UpdError, one_line
from upd.mesh import recipes
from upd.progress import Stages
from upd.results import InputPart, InputParts, Result
from upd.scene import load_scene
from upd.scene.quantities import Uncertainty
from upd.scene.toml import put_back
from upd.vary.solve import changed
from upd.vary.variation import ALONE, POWER, Key, Overrides

log = logging.getLogger(__name__)
#: parameters of a recipe that say how fine a mesh is
_LEVELS = ("divisions", "refine")
#: part of a rig's refinement, and the smallest that the ready rig takes
_COARSER, _LEAST = 0.7, 0.5


@dataclass(frozen=True)
class InputEnds:
    """An input known within limits, the scene as its file gives it, and with the input at both ends
    of its interval.
    """

    of: Uncertainty
    given: Any
    low: Any
    high: Any


@dataclass(frozen=True)
class InputChange:
    """Relative change of a number by an input's half-width, with its sign, and how it was found."""

    change: float
    basis: str


#: path of an input -> name and case of a number -> what its half-width does to it
InputChanges = Mapping[str, Mapping[Key, InputChange]]


class InputDerivatives(NamedTuple):
    """What an analysis knows of its numbers' derivatives by inputs.

    Attributes
    ----------
    changes
        solution, its numbers, the ends of the inputs known within limits -> what half an interval
        does to the numbers, of those inputs whose derivatives the analysis knows.
    known
        plan, the ends of the inputs known within limits -> paths of those whose derivatives the
        analysis knows, and seconds that they take.
    """

    changes: Callable[[Any, Sequence[Result], Sequence[InputEnds]], InputChanges]
    known: Callable[[Any, Sequence[InputEnds]], tuple[set[str], float]]


def input_parts(
    analysis: Any, solution: Any, numbers: Sequence[Result], stages: Stages
) -> InputParts:
    """What every input known within limits does to the main numbers of a run.

    Parameters
    ----------
    analysis
        `upd.analyses.base.Analysis` of the scene.
    solution
        With the plan as run.
    numbers
        Of the run.
    stages
        Of the run.

    Returns
    -------
    InputParts
        A part for every input and main number; NaN with its reason where it was not found. Empty
        where the scene knows its inputs exactly.
    """
    plan = solution.plan
    if not plan.scene.uncertain:
        return {}
    ends = input_ends(plan.scene)
    main = [one for one in numbers if is_main(analysis, one)]
    found: dict[str, dict[Key, InputChange]] = {one.of.path: {} for one in ends}
    if analysis.derivatives is not None:
        with stages("input uncertainty", "derivatives"):
            for path, changes in analysis.derivatives.changes(solution, numbers, ends).items():
                found[path] |= changes
    faults: dict[str, str] = {}
    for one in ends:
        path = one.of.path
        if not found[path]:
            try:
                with stages("input uncertainty", f"{path}: both ends"):
                    found[path] = _solved_at_ends(analysis, plan, main, one)
            except UpdError as error:
                log.info("%s: not solved at both ends: %s", path, error)
                faults[path] = f"not solved at both ends ({one_line(error)})"
    return {
        (number.name, number.case): tuple(
            _part(one, found[one.of.path].get((number.name, number.case)), faults) for one in ends
        )
        for number in main
    }


def is_main(analysis: Any, number: Result) -> bool:
    """Whether it is a number an engineer asks for first."""
    return not number.withheld and any(
        fnmatchcase(number.name, pattern) for pattern in analysis.headline_names
    )


def input_ends(scene: Any) -> list[InputEnds]:
    """Every input known within limits, with the scene at both ends of its interval."""
    data = tomllib.loads(scene.text)

    def at(one: Any, shift: float) -> Any:
        return load_scene(put_back(data, one.steps, one.at(shift)))

    given = load_scene(data)
    return [InputEnds(one, given, at(one, -1.0), at(one, 1.0)) for one in scene.uncertain.values()]


def with_input_cost(analysis: Any, plan: Any) -> Any:
    """The plan with what its scene's inputs known within limits cost."""
    if not plan.scene.uncertain:
        return plan
    ends = input_ends(plan.scene)
    known, seconds = (set[str](), 0.0)
    if analysis.derivatives is not None:
        known, seconds = analysis.derivatives.known(plan, ends)
    others = [one for one in ends if one.of.path not in known]
    if others:
        seconds += 2.0 * len(others) * _companion_seconds(analysis, plan, others[0])
    return replace(plan, seconds=plan.seconds + seconds, input_seconds=seconds)


def _companion_seconds(analysis: Any, plan: Any, one: InputEnds) -> float:
    """Of the cheap companion at one end of an interval; all ends cost about the same."""
    scene = changed(one.low, _coarser(analysis, plan))
    own = plan.seconds - plan.estimate_seconds - plan.files_seconds
    if recipes.counted_by_mesh(scene.recipe):
        # a plan runs a user's recipe once: the run makes the coarser mesh
        sizes = [(plan.parameters.get(name), scene.geometry.get(name)) for name in _LEVELS]
        ratios = [b / a for a, b in sizes if _is_number(a) and _is_number(b)]
        return float(own * min(ratios, default=1.0) ** POWER)
    try:
        companion = analysis.make_plan(scene)
    except UpdError:
        # not solved either
        return 0.0
    return float(companion.seconds - companion.files_seconds)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _coarser(analysis: Any, plan: Any) -> Overrides:
    """What makes a scene into its cheap level."""
    return () if analysis.coarsened is None else analysis.coarsened(plan)


def coarsened_rig(plan: Any, wanted: tuple[str, ...], *more: tuple[str, Any]) -> Overrides:
    """What makes scenes of a rig cheap: a coarser mesh, few outputs, nothing solved twice.

    Parameters
    ----------
    wanted
        Outputs that are kept where the run has them; all when none of them is.
    *more
        Overrides.
    """
    refine, want = plan.parameters.get("refine"), plan.scene.want
    kept = tuple(w for w in want if w in wanted) or want
    alone = (("want", kept), *ALONE, *more)
    if isinstance(refine, float) and _COARSER * refine >= _LEAST:
        return (("geometry.refine", _COARSER * refine), *alone)
    return alone


def _part(one: InputEnds, found: InputChange | None, faults: dict[str, str]) -> InputPart:
    path, half = one.of.path, one.of.relative
    if found is None:
        why = faults.get(path, "this number's derivative is not known")
        return InputPart(path, half, math.nan, why)
    return InputPart(path, half, found.change, found.basis)


def _solved_at_ends(
    analysis: Any, plan: Any, numbers: Sequence[Result], one: InputEnds
) -> dict[Key, InputChange]:
    """Half of the change between both ends of an interval, each solved again."""
    coarser = _coarser(analysis, plan)
    plans = [analysis.make_plan(changed(scene, coarser)) for scene in (one.low, one.high)]
    sides = [
        [r for r in analysis.make_results(analysis.solve(each, Stages())) if not r.withheld]
        for each in plans
    ]
    level = ", ".join(
        f"{name} {value:g}"
        for name, value in plans[0].parameters.items()
        if name in _LEVELS and value != plan.parameters.get(name)
    )
    basis = f"solved again at both ends{f', on {level}' if level else ''}"
    out = {}
    for number in numbers:
        low, high = (_same(number, numbers, side) for side in sides)
        if low is not None and high is not None and low + high != 0.0:
            change = (high - low) / (low + high)
            out[number.name, number.case] = InputChange(change, basis)
    return out


def _same(number: Result, numbers: Sequence[Result], others: Sequence[Result]) -> float | None:
    """The number in another run; where its case names the load that changed, by its place."""
    for other in others:
        if other.name == number.name and other.case == number.case:
            return other.value
    count = Counter(one.name for one in numbers), Counter(one.name for one in others)
    if count[0][number.name] != count[1][number.name]:
        return None
    mine = [one for one in numbers if one.name == number.name]
    return [one for one in others if one.name == number.name][mine.index(number)].value
