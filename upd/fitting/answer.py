"""`upd.fit`: inputs of a forced response that give wanted numbers or measured curves, and what is
left unknown.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from upd.cache.sources import key_of, source_digest
from upd.errors import InputError, UpdError
from upd.fitting.charts import FIGURE, fit_charts
from upd.fitting.first_order import KEPT, Knowledge, is_bent, knowledge, misfit_rises
from upd.fitting.fitted_inputs import FittedCurve, FittedInputs
from upd.fitting.journal import Journal
from upd.fitting.next_measurement import rank_measurements
from upd.fitting.parameters import VariedInput, fitted_scene, read_parameters
from upd.fitting.profile import Profile, profile
from upd.fitting.residuals import Residuals
from upd.fitting.responses import FitResponses
from upd.fitting.solver import Status, answers, search, settled, status_of
from upd.fitting.tables import notes, tables, verdict
from upd.fitting.targets import CurveTarget, Targets, read_targets
from upd.fitting.weights import as_complex
from upd.measured import MeasuredCurve
from upd.plot.chart import Chart
from upd.progress import Listener, Stages, silent
from upd.report.answer_folder import FigureAnswer
from upd.results.answer_table import AnswerTable
from upd.scene import AnyScene, ForcedScene
from upd.scene.forced import FORCED
from upd.scene.read import as_scene

Array = NDArray[np.float64]
#: starts where evaluations take milliseconds, where something is followed with friction, and where
#: they make new bodies
_STARTS, _SOME, _FEW = 8, 4, 2
#: points of the curves of the targets over each parameter
_CURVE = 41
#: word and kind of every way a fit ends
_OUTCOMES = {
    "found": ("Found", "passed"),
    "several": ("Several", "warning"),
    "family": ("A family", "warning"),
    "not reached": ("Not reached", "failed"),
}
S = TypeVar("S")
T = TypeVar("T")


@dataclass(frozen=True, repr=False)
class Fit(FigureAnswer, FittedInputs):
    """What `upd.fit` found."""

    source: ForcedScene
    figure = FIGURE

    @property
    def outcome(self) -> tuple[str, str]:
        """How the fit ended."""
        return _OUTCOMES[self.status]

    @property
    def verdict(self) -> str:
        """One sentence."""
        return verdict(self)

    def value(self, path: str) -> float:
        """What the first answer has for an input, in the unit inside.

        Raises
        ------
        InputError
            For an input that was not varied.
        """
        for one, z in zip(self.parameters, self.answers[0], strict=True):
            if path in one.paths:
                return float(one.values[one.paths.index(path)] * np.exp(z))
        known = ", ".join(path for one in self.parameters for path in one.paths)
        raise InputError(f"{path}: was not varied; known here: {known}")

    @cached_property
    def scene(self) -> ForcedScene:
        """The scene with the first answer's values."""
        more = {"contact.directions": self.directions} if self.directions else {}
        name = f"{self.source.name}-fitted"
        return fitted_scene(self.source, self.parameters, self.answers[0], name=name, **more)

    @property
    def charts(self) -> list[Chart]:
        """The charts of its figure."""
        return fit_charts(self)

    @property
    def tables(self) -> tuple[AnswerTable, ...]:
        """Inputs with their intervals, targets, and what to measure next."""
        return tables(self)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the targets leave unknown, and the cost."""
        return notes(self)


def fit(
    scene: AnyScene | str | Path | Mapping[str, Any],
    to: str | Mapping[str, str] | Sequence[str | MeasuredCurve | CurveTarget],
    vary: str | Sequence[str],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    starts: int | None = None,
    profiles: bool | None = None,
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
    profiles
        Whether the sets that fit equally well are traced, by some hundred evaluations for each
        parameter; without, where evaluations take milliseconds, and, by some dozen evaluations, for
        parameters whose misfit is not quadratic within the first-order interval, unless evaluations
        make new blades.
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
    targets, parameters = _together(
        lambda: read_targets(to, loaded), lambda: read_parameters(loaded, varied)
    )
    journal = Journal(_key(loaded, targets, parameters))
    responses = FitResponses(loaded, targets, parameters, journal)
    residuals = Residuals(responses)
    stages = Stages(progress)
    if journal.kept:
        progress("fit", f"continues from {journal.kept} evaluations of an earlier call", 0.0)
    with stages("blades", "mesh, assembly and reduction"):
        # a target that is not there is an error before anything is sought
        responses.at(np.zeros(len(parameters)))
    count = starts or (_FEW if not responses.cheap else _SOME if targets.ratios else _STARTS)
    if responses.source.cost:
        progress("fit", responses.source.cost, 0.0)

    def report(text: str, seconds: float | None) -> None:
        progress("fit", f"{text}, {responses.evaluations} models", seconds)

    with stages("fit", f"{targets.count} values, {len(parameters)} parameters, {count} starts"):
        done = settled(residuals, search(residuals, count, report))
        found = answers(residuals, done)
        best = found[0]
        known = knowledge(residuals, best)
        status = status_of(residuals, known, found)
    spread = _spread(residuals, known, best, status, profiles, stages)
    with stages("further measurements", "what each would tell"):
        # profiles of single inputs do not say how far predictions reach
        family = spread.profiles if spread.rises is None else ()
        further = rank_measurements(loaded, targets, parameters, residuals, best, family)
    value, slope = responses.at(best)
    m = len(targets.numbers)
    result = Fit(
        loaded,
        responses.stiffness,
        targets.numbers,
        _fitted_curves(residuals, value),
        parameters,
        status,
        found,
        value[:m],
        slope[:m],
        replace(known, rises=spread.rises),
        spread.profiles,
        spread.curves,
        further,
        done,
        responses.directions(best),
        tuple(responses.exact),
        responses.evaluations,
        time.perf_counter() - begin,
    )
    if out is not None:
        result = result.write(out)
    journal.done()
    return result


class _Spread(NamedTuple):
    """What fits as well as an answer; see `FittedInputs`."""

    profiles: tuple[Profile, ...]
    curves: tuple[Array, ...]
    rises: Array | None


def _spread(
    residuals: Residuals,
    known: Knowledge,
    best: Array,
    status: Status,
    asked: bool | None,
    stages: Stages,
) -> _Spread:
    """Profiles where they are asked for or cheap, and of parameters whose misfit is not quadratic
    within the interval of first order.
    """
    responses = residuals.responses
    each, targets = range(len(best)), responses.targets
    profiles: tuple[Profile, ...] = ()
    curves: tuple[Array, ...] = ()
    if asked or (asked is None and responses.cheap and not targets.ratios):
        with stages("profiles", "sets of parameters that fit as well"):
            if (status == "family" or residuals.known) and status != "not reached":
                profiles = tuple(profile(residuals, known, best, k) for k in each)
            if targets.numbers:
                curves = tuple(_curve(residuals, best, k) for k in each)
    if not residuals.known or profiles or known.error is None:
        return _Spread(profiles, curves, None)
    with stages("intervals", "the misfit at their ends"):
        rises = misfit_rises(residuals, known, best, residuals.low, residuals.high)
    if asked is None and responses.cheap:
        with stages("intervals", "profiles of those that are not of first order"):
            # the end by first order is one step away
            bent = [k for k in each if is_bent(rises[k], KEPT)]
            profiles = tuple(profile(residuals, known, best, k, first=1.0) for k in bent)
    return _Spread(profiles, curves, rises)


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


def _fitted_curves(residuals: Residuals, value: Array) -> tuple[FittedCurve, ...]:
    return tuple(
        FittedCurve(one, noise, as_complex(one, value[part]))
        for one, noise, part in zip(
            residuals.responses.targets.curves, residuals.curves, residuals.parts, strict=True
        )
    )


def _together(first: Callable[[], S], second: Callable[[], T]) -> tuple[S, T]:
    """What two readers give; all errors at once."""
    problems: list[str] = []
    out: list[Any] = []
    for read in (first, second):
        try:
            out.append(read())
        except InputError as error:
            problems.append(str(error))
    if problems:
        raise InputError("\n".join(problems))
    return out[0], out[1]


def _curve(residuals: Residuals, best: Array, k: int) -> Array:
    """The numbers while one parameter moves from bound to bound; nan where one is not there."""
    rows = []
    for place in np.linspace(residuals.low[k], residuals.high[k], _CURVE):
        z = best.copy()
        z[k] = place
        try:
            numbers = residuals.responses.value(z)[: residuals.numbers]
        except UpdError:
            numbers = np.full(residuals.numbers, np.nan)
        rows.append([place, *numbers])
    return np.array(rows)
