"""`upd.fit`: inputs of a forced response that give wanted numbers, and what these leave unknown."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from upd.errors import InputError, UpdError
from upd.fitting.charts import FIGURE, fit_charts
from upd.fitting.found import FittedInputs
from upd.fitting.parameters import fitted_scene, read_parameters
from upd.fitting.responses import LinearResponses
from upd.fitting.solver import (
    Profile,
    Residuals,
    answers,
    knowledge,
    profile,
    search,
    status_of,
)
from upd.fitting.targets import read_targets
from upd.fitting.words import headline, lines, plain_numbers
from upd.plot.chart import Chart
from upd.progress import Listener, Stages, silent
from upd.report.answer_folder import answer_html, write_answer
from upd.scene import AnyScene, ForcedScene
from upd.scene.forced import FORCED
from upd.scene.read import as_scene
from upd.scene.written import scene_as_run

Array = NDArray[np.float64]
#: starts where evaluations take milliseconds, and where they make new bodies
_STARTS, _FEW = 8, 2
#: points of the curves of the targets over each parameter
_CURVE = 41
S = TypeVar("S")
T = TypeVar("T")


@dataclass(frozen=True, repr=False)
class Fit(FittedInputs):
    """What `upd.fit` found, in words, numbers and one figure.

    Attributes
    ----------
    folder : Path, optional
        Where its files lie; None when nothing was written.
    """

    folder: Path | None = None

    @property
    def verdict(self) -> str:
        """One sentence."""
        return headline(self)

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

    def as_dict(self) -> dict[str, Any]:
        """What stands in fit.json: numbers with their units; what is not known is null."""
        return plain_numbers(self)

    def write(self, out: str | Path) -> Fit:
        """Write fit.json, fit.png and the scene with the fitted values; the same with that folder.

        Parameters
        ----------
        out
            The folder, made where there is none.

        Raises
        ------
        InputError
            When it cannot be written.
        """
        toml = f"# {self.verdict}\n{scene_as_run(self.scene)}"
        texts = {f"{self.scene.name}.toml": toml}
        folder = write_answer(out, FIGURE, self.as_dict(), self.charts, texts)
        return replace(self, folder=folder)

    def __str__(self) -> str:
        return "\n".join(lines(self))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return answer_html(str(self), self.charts)


def fit(
    scene: AnyScene | str | Path | Mapping[str, Any],
    to: str | Mapping[str, str] | Sequence[str],
    vary: str | Sequence[str],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    starts: int | None = None,
    out: str | Path | None = None,
    progress: Listener = silent,
) -> Fit:
    """Find inputs of a forced response that give wanted numbers of its linear limits, and say what
    these numbers leave unknown.

    Parameters
    ----------
    scene
        A loaded scene, a ready name, a .toml path or a mapping: a forced response on contact
        points.
    to
        "stuck_in_phase=377 Hz +- 0.5 Hz,stuck_out_of_phase=440 Hz +- 0.5 Hz", or a mapping name ->
        quantity. Half-widths for all or for none: without, differences count relative to the
        targets.
    vary
        Inputs: "path", "path=low:high" with quantities or factors (x0.1:x10) as bounds;
        "path+path" moves several by one factor. Without bounds: stiffnesses by a factor of 100 each
        way, others of 2.
    overrides
        "path=value" texts, or a mapping path -> value.
    starts
        Of the search; without, 8 where only contact stiffnesses move, else 2.
    out
        Folder that gets fit.json, fit.png and NAME-fitted.toml; None writes nothing.
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
        lambda: read_targets(to), lambda: read_parameters(loaded, varied)
    )
    responses = LinearResponses(loaded, targets, parameters)
    residuals = Residuals(responses)
    stages = Stages(progress)
    with stages("blades", "mesh, assembly and reduction"):
        # a target that is not there is told before anything is sought
        responses.at(np.zeros(len(parameters)))
    count = starts or (_STARTS if responses.cheap else _FEW)
    with stages("fit", f"{len(targets)} targets, {len(parameters)} parameters, {count} starts"):
        done = search(residuals, count, lambda text: progress("fit", text, None))
        found = answers(residuals, done)
        best = found[0]
        known = knowledge(residuals, best)
        status = status_of(residuals, known, found)
    profiles: tuple[Profile, ...] = ()
    curves: tuple[Array, ...] = ()
    if responses.cheap:
        spread = status == "family" or residuals.known
        with stages("profiles", "sets of parameters that fit as well"):
            if spread and status != "not reached":
                everyone = range(len(parameters))
                profiles = tuple(profile(residuals, known, best, k) for k in everyone)
            curves = tuple(_curve(residuals, best, k) for k in range(len(parameters)))
    numbers, slopes = responses.at(best)
    solved = responses.evaluations
    result = Fit(
        loaded,
        responses.stiffness,
        targets,
        parameters,
        status,
        found,
        numbers,
        slopes,
        known,
        profiles,
        curves,
        done,
        responses.directions(best),
        tuple(responses.exact),
        solved,
        time.perf_counter() - begin,
    )
    return result if out is None else result.write(out)


def _together(first: Callable[[], S], second: Callable[[], T]) -> tuple[S, T]:
    """What two readers give; what is wrong with either is told at once."""
    told: list[str] = []
    out: list[Any] = []
    for read in (first, second):
        try:
            out.append(read())
        except InputError as error:
            told.append(str(error))
    if told:
        raise InputError("\n".join(told))
    return out[0], out[1]


def _curve(residuals: Residuals, best: Array, k: int) -> Array:
    """The numbers while one parameter moves from bound to bound; nan where one is not there."""
    rows = []
    for place in np.linspace(residuals.low[k], residuals.high[k], _CURVE):
        z = best.copy()
        z[k] = place
        try:
            numbers = residuals.responses.at(z)[0]
        except UpdError:
            numbers = np.full(len(residuals.target), np.nan)
        rows.append([place, *numbers])
    return np.array(rows)
