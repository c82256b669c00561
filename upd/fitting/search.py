"""`upd.fit`: inputs of a forced response that give wanted numbers or measured curves: the search
from several starts, with weights that agree with what it finds, and how it ended.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.cache.arrays import Journal
from upd.cache.sources import key_of, source_digest
from upd.errors import ConvergenceError, InputError
from upd.fitting.answer import Fit, Status
from upd.fitting.residuals import (
    KEPT,
    ROUNDING,
    Knowledge,
    Residuals,
    Start,
    as_complex,
    is_bent,
    knowledge,
    misfit_rises,
    profile_ends,
    rank_measurements,
)
from upd.fitting.responses import FitResponses
from upd.fitting.targets import CurveTarget, Targets, VariedInput, read_parameters, read_targets
from upd.measured import MeasuredCurve
from upd.progress import Listener, Stages, silent
from upd.scene import AnyScene, ForcedScene
from upd.scene.forced import FORCED
from upd.scene.ranges import InputProblems
from upd.scene.read import as_scene

Array = NDArray[np.float64]
#: starts where evaluations take milliseconds, where something is followed with friction, and where
#: they make new bodies
_STARTS, _SOME, _FEW = 8, 4, 2
#: rounds in which the weights of curves are renewed, and change of a weight below which they end
_ROUNDS, _SETTLED = 12, 1e-3
#: seconds of a start that is reported when it ends
_LONG_S = 2.0
#: two ends of starts nearer than this in every ln(factor) are one answer
_SAME = 1e-3


def fit(
    scene: AnyScene | str | Path | Mapping[str, Any],
    to: str | Mapping[str, str] | Sequence[str | MeasuredCurve | CurveTarget],
    vary: str | Sequence[str],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    starts: int | None = None,
    out: str | Path | None = None,
    progress: Listener = silent,
) -> Fit:
    """Find inputs of a forced response that give wanted numbers or measured curves, and say what
    these leave unknown.

    Parameters
    ----------
    scene
        A loaded scene, a ready name, a .toml path or a mapping: a forced response on contact
        points.
    to
        "stuck_in_phase=377 Hz +- 0.5 Hz,peak_1_frequency@194=335 Hz +- 1 Hz", files of measured
        curves "stuck=stuck.csv +- 2 %,194=damped.csv", "measured" for all of the scene's; a mapping
        name -> quantity or file, or curves. Half-widths for all numbers or for none: without,
        differences count relative to the targets; of curves without, the noise is estimated.
    vary
        Inputs: "path", "path=low:high" with quantities or factors (x0.1:x10) as bounds;
        "path+path" moves several by one factor. Without bounds: stiffnesses by a factor of 100 each
        way, others of 2.
    overrides
        "path=value" texts, or a mapping path -> value.
    starts
        Of the search; without, 8 where evaluations take milliseconds, 4 where peaks or curves with
        friction are followed, 2 where new blades are made.
    out
        Folder that gets the files; None writes nothing.
    progress
        Called at the beginning and the end of every stage.

    Raises
    ------
    InputError
        For a bad scene, target or parameter, and a folder that cannot be written.
    ConvergenceError
        When every start fails.
    """
    begin = time.perf_counter()
    loaded = as_scene(scene, overrides)
    if getattr(loaded, "analysis", "") != FORCED:
        raise InputError("a fit needs a forced response; the scene is none")
    if starts is not None and starts < 1:
        raise InputError(f"starts: {starts} is no number of starts; give 1 or more")
    varied = [vary] if isinstance(vary, str) else list(vary)
    problems = InputProblems()
    with problems.of():
        targets = read_targets(to, loaded)
    with problems.of():
        parameters = read_parameters(loaded, varied)
    problems.check()
    journal = Journal(f"fit-{_key(loaded, targets, parameters)[:32]}")
    responses = FitResponses(loaded, targets, parameters, journal)
    if journal.lines:
        known = len(journal.lines)
        progress("fit", f"continues from {known} evaluations of an earlier call", 0.0)
    result = _found(responses, starts, progress)
    result = replace(result, seconds=time.perf_counter() - begin)
    if out is not None:
        result = result.write(out)
    journal.done()
    return result


def _found(responses: FitResponses, starts: int | None, progress: Listener) -> Fit:
    """The answer, what is known of it, and what to measure next; the number of starts is by what
    an evaluation costs where it is not given.
    """
    targets, parameters = responses.targets, responses.parameters
    residuals, stages = Residuals(responses), Stages(progress)
    with stages("blades", "mesh, assembly and reduction"):
        # a target that is not there is an error before anything is sought
        responses.at(np.zeros(len(parameters)))
    count = starts or (_FEW if not responses.cheap else _SOME if targets.ratios else _STARTS)
    if responses.dear:
        slow = f"{', '.join(responses.dear)}: every value makes new blades or a new static state"
        progress("fit", slow, 0.0)

    def report(text: str, seconds: float | None) -> None:
        progress("fit", f"{text}, {responses.made} models", seconds)

    sizes = f"{len(residuals.target)} values, {len(parameters)} parameters, {count} starts"
    with stages("fit", sizes):
        done = settled(residuals, search(residuals, count, report))
        found = answers(residuals, done)
        best = found[0]
        known = knowledge(residuals, best)
        status = status_of(residuals, known, found)
    ends, rises = _ends(residuals, known, best, stages)
    with stages("further measurements", "what each would narrow"):
        widest, further = rank_measurements(residuals, best)
    value, slope = responses.at(best)
    m = len(targets.numbers)
    return Fit(
        responses.scene,
        responses.stiffness,
        targets.numbers,
        tuple(
            replace(one, computed=as_complex(one.target, value[part]))
            for one, part in zip(residuals.curves, residuals.parts, strict=True)
        ),
        parameters,
        status,
        found,
        value[:m],
        slope[:m],
        replace(known, rises=rises),
        ends,
        widest,
        further,
        done,
        responses.directions,
        responses.made,
        math.nan,
    )


def _ends(
    residuals: Residuals, known: Knowledge, best: Array, stages: Stages
) -> tuple[Array, Array | None]:
    """Ends of profiles (n, 2), nan where they are not sought, and the rises of the misfit.

    They are sought where they are cheap: of parameters whose misfit is not quadratic within the
    interval of first order, and of all where the targets leave a direction unknown and nothing is
    followed with friction.
    """
    responses, ends = residuals.responses, np.full((len(best), 2), math.nan)
    wanted, rises = list[int](), None
    if known.error is None:
        wanted = [] if responses.targets.ratios or not residuals.met(best) else [*range(len(best))]
    elif residuals.known:
        with stages("intervals", "the misfit at their ends"):
            rises = misfit_rises(residuals, known, best, residuals.low, residuals.high)
        wanted = [k for k, one in enumerate(rises) if is_bent(one, KEPT)]
    if responses.cheap and wanted:
        with stages("intervals", "sets of inputs that fit as well"):
            for k in wanted:
                ends[k] = profile_ends(residuals, known, best, k)
    return ends, rises


def _key(scene: ForcedScene, targets: Targets, parameters: Sequence[VariedInput]) -> str:
    """Of all that values and derivatives depend on."""
    curves = [
        (one.name, one.curve.frequency.tolist(), one.values.tolist()) for one in targets.curves
    ]
    return key_of(
        {
            "scene": scene.text,
            "numbers": [one.name for one in targets.numbers],
            "curves": curves,
            "parameters": [(one.paths, one.values) for one in parameters],
            "sources": source_digest(scene.recipe),
        }
    )


# -- the search ------------------------------------------------------------------------------------


def search(
    residuals: Residuals, count: int, report: Callable[[str, float | None], None]
) -> list[Start]:
    """All starts, the best end first.

    Parameters
    ----------
    residuals
        Of the fit.
    count
        Of starts.
    report
        Called where each begins, and with its seconds where one that took long ends.

    Raises
    ------
    ConvergenceError
        When all fail.
    """
    done = []
    for k, begin in enumerate(residuals.starts(count), 1):
        report(f"start {k} of {count}", None)
        since = time.perf_counter()
        # of curves their magnitudes first, as logarithms, then as they are
        near = residuals.solve(begin, coarse=bool(residuals.parts))
        if residuals.parts and not near.failure:
            near = replace(residuals.solve(residuals.inside(near.end)), begin=begin)
        done.append(near)
        took = time.perf_counter() - since
        if took > _LONG_S:
            end = done[-1].failure or f"misfit {done[-1].misfit:.3g}"
            report(f"start {k} of {count}: {end}", took)
    if not np.isfinite([one.misfit for one in done]).any():
        raise ConvergenceError(f"no start of the fit came to an answer: {done[0].failure}")
    return sorted(done, key=lambda one: one.misfit)


def settled(residuals: Residuals, done: list[Start]) -> list[Start]:
    """The starts again with weights by the best fit, until these agree with it.

    Parameters
    ----------
    residuals
        Of the fit; its weights are renewed.
    done
        Of `search`.

    Returns
    -------
    list of Start
        The best first; those that ended elsewhere with their misfit under the new weights.
    """
    if not residuals.parts:
        return done
    best = done[0]
    for _ in range(_ROUNDS):
        change = residuals.weigh(best.end)
        again = residuals.solve(residuals.inside(best.end))
        if not again.failure:
            best = replace(again, begin=best.begin)
        if change < _SETTLED:
            break
    others = []
    for one in done[1:]:
        if np.isfinite(one.misfit):
            one = replace(one, misfit=float((residuals(one.end) ** 2).sum()))
        others.append(one)
    return sorted([best, *others], key=lambda one: one.misfit)


def answers(residuals: Residuals, done: Sequence[Start]) -> list[Array]:
    """Ends that fit as well as the best and differ from each other, the one nearest to the scene
    first.

    Parameters
    ----------
    residuals
        Of the fit.
    done
        Of `search`.
    """
    best = done[0].misfit
    J = residuals.jacobian(done[0].end) if residuals.known else None

    def apart(a: Array, b: Array) -> bool:
        """Whether two ends differ, and by more than is known."""
        known = J is None or float(((J @ (a - b)) ** 2).sum()) > 1.0
        return bool(np.abs(a - b).max() > _SAME) and known

    more = 1.0 if residuals.known else max(residuals.rounding**2, ROUNDING * best)
    out: list[Array] = []
    for one in done:
        if one.misfit <= best + more and all(apart(one.end, z) for z in out):
            out.append(one.end)
    return sorted(out, key=lambda z: float(np.linalg.norm(z)))


def status_of(residuals: Residuals, known: Knowledge, found: Sequence[Array]) -> Status:
    """How a fit ended.

    Parameters
    ----------
    residuals
        Of the fit.
    known
        At the best answer.
    found
        Of `answers`.
    """
    compromise = len(residuals.target) > len(residuals.low) and not residuals.known
    compromise |= any(one.estimated for one in residuals.curves)
    if not compromise and not residuals.met(found[0]):
        return "not reached"
    if known.unknown.any():
        return "family"
    return "several" if len(found) > 1 else "found"
