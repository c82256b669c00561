"""What inputs known within limits do to the numbers of a run, to first order.

The scene is solved at both ends of the interval on a cheap companion: half of the relative change
there is that of the run,

    delta q / q = [q(p + delta p) - q(p - delta p)] / [q(p + delta p) + q(p - delta p)].
"""

from __future__ import annotations

import logging
import math
import tomllib
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from upd.errors import UpdError, one_line
from upd.progress import Stages
from upd.results.number import InputPart, InputParts, Result
from upd.scene import load_scene
from upd.scene.quantities import Uncertainty
from upd.scene.toml import put_back
from upd.vary.solve import changed, refinement
from upd.vary.variation import ALONE, Key, Overrides

log = logging.getLogger(__name__)
#: parameters of a recipe that say how fine a mesh is
_LEVELS = ("divisions", "refine")
#: part of a rig's refinement, and the smallest that the ready rig takes
_COARSER, _LEAST = 0.7, 0.5


#: an input known within limits, and the scene with it at both ends of its interval
Ends = tuple[Uncertainty, Any, Any]


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
    main = [one for one in numbers if analysis.is_main(one)]
    out: dict[Key, tuple[InputPart, ...]] = {(one.name, one.case): () for one in main}
    for ends in input_ends(plan.scene):
        of = ends[0]
        try:
            with stages("input uncertainty", f"{of.path}: both ends"):
                found, basis = _solved_at_ends(analysis, plan, main, ends)
        except UpdError as error:
            log.info("%s: not solved at both ends: %s", of.path, error)
            found, basis = {}, f"not solved at both ends ({one_line(error)})"
        for key, parts in out.items():
            lost = bool(found) and key not in found
            how = "this number was not found at both ends" if lost else basis
            part = InputPart(of.path, of.relative, found.get(key, math.nan), how)
            out[key] = (*parts, part)
    return out


def input_ends(scene: Any) -> list[Ends]:
    """Every input known within limits, with the scene at both ends of its interval."""
    data, out = tomllib.loads(scene.text), list[Ends]()
    for one in scene.uncertain.values():
        low, high = (load_scene(put_back(data, one.steps, one.at(end))) for end in (-1.0, 1.0))
        out.append((one, low, high))
    return out


def with_input_cost(analysis: Any, plan: Any) -> Any:
    """The plan with what its scene's inputs known within limits cost."""
    if not plan.scene.uncertain:
        return plan
    ends, seconds = input_ends(plan.scene), 0.0
    # what is refused is not solved either
    with suppress(UpdError):
        cheap = analysis.make_plan(changed(ends[0][1], analysis.coarsened(plan)))
        seconds = cheap.solve_seconds
    seconds *= 2.0 * len(ends)
    return replace(plan, seconds=plan.seconds + seconds, input_seconds=seconds)


def coarsened_rig(plan: Any, wanted: tuple[str, ...], *more: tuple[str, Any]) -> Overrides:
    """What makes scenes of a rig cheap: a coarser mesh, few outputs, nothing solved twice.

    Parameters
    ----------
    wanted
        Outputs that are kept where the run has them; all when none of them is.
    *more
        Overrides.
    """
    want = plan.scene.want
    alone = (("want", tuple(w for w in want if w in wanted) or want), *ALONE, *more)
    coarse = _COARSER * (refinement(plan.scene) or 0.0)
    return (("geometry.refine", coarse), *alone) if coarse >= _LEAST else alone


def _solved_at_ends(
    analysis: Any, plan: Any, numbers: Sequence[Result], ends: Ends
) -> tuple[dict[Key, float], str]:
    """Half of the relative change between both ends of an interval, each solved again, and how."""
    plans = [analysis.make_plan(changed(scene, analysis.coarsened(plan))) for scene in ends[1:]]
    sides = [
        [r for r in analysis.make_results(analysis.solve(each, Stages())) if not r.withheld]
        for each in plans
    ]
    level = ", ".join(
        f"{name} {value:g}"
        for name, value in plans[0].parameters.items()
        if name in _LEVELS and value != plan.parameters.get(name)
    )
    out = {}
    for number in numbers:
        low, high = (_same(number, numbers, side) for side in sides)
        if low is not None and high is not None and low + high != 0.0:
            out[number.name, number.case] = (high - low) / (low + high)
    return out, f"solved again at both ends{f', on {level}' if level else ''}"


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
