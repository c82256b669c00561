"""`upd.design`: the statics of a scene's damper, or the damper whose worst peak over ranges of
excitation and of uncertain inputs is lowest.

F_C is sought by `upd.sizing.worst_peak` on the curves of one rig; what else is chosen makes a new
rig for every value, tried on a grid and then by bounded minimisation between the neighbours of its
best. Several such inputs are moved by turns, the others at the best so far, and along the way that
a turn led (R. Hooke, T. A. Jeeves, J. ACM 8 (1961) 212), until a turn gains nothing; where worst
peaks have a ridge such a search may end on it.

Of inputs over whose ranges peaks count all corners are taken, and the scene's own values.
"""

from __future__ import annotations

import itertools
import logging
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args, overload

import numpy as np
from scipy.optimize import minimize_scalar

from upd.analyses.forced.model import quiet
from upd.analyses.seated.bodies import Bodies
from upd.errors import ConvergenceError, InputError, one_line
from upd.progress import Listener, Stages, silent
from upd.scene import AnyScene, ForcedScene
from upd.scene.ranges import stiffness_of, with_values
from upd.scene.read import as_scene
from upd.sizing.choice import (
    BestDamper,
    Objective,
    Tried,
    best_of,
    curves_of,
    is_along,
    reaches_of,
)
from upd.sizing.ranges import InputRange, Ranges, bare, read_ranges, rig_peaks
from upd.sizing.statics import DamperDesign, damper_statics
from upd.sizing.worst_peak import PeaksOver, WorstPeak, lowest_worst

log = logging.getLogger(__name__)
#: values of what is chosen beside F_C on the first grid; more between the neighbours of the best,
#: and how closely, as a share of the range
GRID, MORE, CLOSE = 5, 8, 0.01
#: turns of several inputs chosen beside F_C at most, and ln of what one has to gain
_TURNS, _GAIN = 4, 2e-3
#: looks at the optimum at most, each with the whole curves that the one before has asked for
_LOOKS = 4
#: inputs with their values, in the units inside
Inputs = tuple[tuple[InputRange, float], ...]


@overload
def design(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
) -> DamperDesign: ...


@overload
def design(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    minimise: Objective,
    over: str | Sequence[str] | Mapping[str, str],
    for_: str | Sequence[str] | Mapping[str, str] = (),
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
    progress: Listener = silent,
) -> BestDamper: ...


def design(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    minimise: Objective | None = None,
    over: str | Sequence[str] | Mapping[str, str] = (),
    for_: str | Sequence[str] | Mapping[str, str] = (),
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
    progress: Listener = silent,
) -> DamperDesign | BestDamper:
    """Tell before any dynamics whether a scene's damper jams, lifts off or tilts, and what its
    faces can carry; or, with ``minimise``, find the damper whose worst resonance peak is lowest.

    Parameters
    ----------
    scene
        A loaded scene, a ready name, a .toml path or a mapping: a forced response or, without
        ``minimise``, a seated damper.
    minimise
        "peak": the highest accelerance of the right blade within the scene's band, in (m/s2) per
        newton of F_E, as runs tell it: all levels of excitation count alike. "acceleration": the
        highest acceleration, in m/s2: the strongest excitation counts most.
    over
        What is chosen, "damper.centrifugal=50:2000", a list of such or a mapping path -> range: one
        input that sets F_C, and others, each of which multiplies the cost.
    for_
        What it has to stand, "excitation.force=0.5:5": F_E, and other inputs, all of whose corners
        count.
    overrides
        "path=value" texts, or a mapping path -> value.
    out
        Folder that gets figure, numbers and report.html; None writes nothing.
    progress
        Called at the beginning and the end of every stage of a choice.

    Raises
    ------
    InputError
        For a bad scene or range, one without a damper between two blades, and a folder that cannot
        be written.
    ConvergenceError
        Where no peak was followed far enough for a choice.
    """
    loaded = as_scene(scene, overrides)
    if minimise is None:
        if over or for_:
            raise InputError('over and for_ belong to a choice: add minimise = "peak"')
        found: DamperDesign | BestDamper = damper_statics(loaded)
    else:
        ranges = read_ranges(loaded, over, for_)
        found = choose_damper(ranges, minimise, progress)
    return found if out is None else found.write(out)


@quiet()
def choose_damper(ranges: Ranges, objective: Objective, progress: Listener) -> BestDamper:
    """The damper whose worst peak over the ranges is lowest.

    Parameters
    ----------
    ranges
        Chosen, and counted over.
    objective
        "peak": the highest accelerance of the right blade, the scene's own convention; then all
        levels of excitation count alike. "acceleration": the highest acceleration.
    progress
        Called at the beginning and the end of every stage.

    Raises
    ------
    InputError
        For a scene whose peaks are not functions of F_C/F_E.
    ConvergenceError
        Where the worst peak is known nowhere.
    """
    begin = time.perf_counter()
    search = _Search(ranges, objective, progress)
    if ranges.shapes:
        search.by_turns()
    else:
        search.at(())
    if not search.tried:
        raise ConvergenceError("; ".join(search.refused))
    for _ in range(_LOOKS):
        # whole curves on the way may show another optimum
        solved, tried = curves_of(search.tried), list[Tried]()
        for one in sorted(search.tried, key=lambda one: one.values):
            robust, nominal = (lowest_worst(worst, *one.ends) for worst in (one.worst, one.plain))
            tried.append(replace(one, best=robust, nominal=nominal))
        best, plain = best_of(tried), min(tried, key=lambda one: one.nominal.log_worst)
        with search.stages("search", "how far the optimum reaches"):
            reaches = reaches_of(best, ranges)
            here = best.plain.solved(best.best.log_centrifugal)
            there = plain.worst.solved(plain.nominal.log_centrifugal)
        if curves_of(search.tried) == solved:
            break
    return BestDamper(
        ranges.scene,
        ranges,
        objective,
        search.stiffness,
        tuple(tried),
        best,
        plain,
        tuple(search.refused),
        time.perf_counter() - begin,
        reaches,
        math.exp(here),
        math.exp(there),
        curves_of(tried),
        sum(rig.resumed for one in tried for _, rig in one.rigs),
    )


def _with(place: tuple[float, ...], k: int, value: float) -> tuple[float, ...]:
    """A place with one of its values changed."""
    return (*place[:k], value, *place[k + 1 :])


class _Search:
    """Rigs that were tried, and how one is."""

    def __init__(self, ranges: Ranges, objective: Objective, progress: Listener) -> None:
        if objective not in get_args(Objective):
            known = ", ".join(get_args(Objective))
            raise InputError(f"minimise: {objective!r} is not known; there are {known}")
        self.ranges, self.progress = ranges, progress
        self.weight = float(objective == "acceleration")
        self.stages = Stages(progress)
        self.stiffness = stiffness_of(
            ranges.scene, [one.path for one in (*ranges.over, *ranges.during)]
        )
        self.scene = bare(ranges.scene, self.stiffness)
        self.bodies: dict[str, Bodies] = {}
        self.tried: list[Tried] = []
        self.refused: list[str] = []

    def at(self, values: tuple[float, ...]) -> float:
        """Try a place of what is chosen beside F_C: ln of its least worst peak, inf where it has
        none.
        """
        shapes = self.ranges.shapes
        for one in self.tried:
            if values and all(map(math.isclose, one.values, values)):
                return one.best.log_worst
        try:
            found = self._tried(values)
        except (InputError, ConvergenceError) as error:
            if not shapes:
                raise
            place = ", ".join(
                f"{of.path} = {of.shown(v)}" for of, v in zip(shapes, values, strict=True)
            )
            self.refused.append(f"{place}: {one_line(error)}")
            log.info("%s", self.refused[-1])
            return math.inf
        self.tried.append(found)
        return found.best.log_worst

    def by_turns(self) -> None:
        """What is chosen beside F_C, one input after the other."""
        shapes = self.ranges.shapes
        place = tuple(min(max(of.nominal, of.low), of.high) for of in shapes)
        for turn in range(_TURNS if len(shapes) > 1 else 1):
            before = best_of(self.tried) if self.tried else None
            for k, shape in enumerate(shapes):
                grid = {*np.linspace(shape.low, shape.high, GRID), place[k]} if turn == 0 else ()
                for value in sorted(grid):
                    self.at(_with(place, k, float(value)))
                if not self.tried:
                    continue
                self._closer(k)
                place = best_of(self.tried).values
            if before is None:
                continue
            if len(shapes) > 1:
                way = zip(shapes, place, before.values, strict=True)
                self.at(tuple(min(max(2.0 * b - a, of.low), of.high) for of, b, a in way))
                place = best_of(self.tried).values
            if before.best.log_worst - best_of(self.tried).best.log_worst <= _GAIN:
                break

    def _closer(self, k: int) -> None:
        """Between the neighbours of the best place so far, one input moved."""
        best, shape = best_of(self.tried).values, self.ranges.shapes[k]
        known = {one.values[k] for one in self.tried if is_along(one.values, best, k)}
        line = sorted(known | {shape.low, shape.high})
        here = line.index(best[k])
        ends = line[max(here - 1, 0)], line[min(here + 1, len(line) - 1)]
        for end in ends:
            self.at(_with(best, k, end))
        if ends[1] > ends[0]:
            minimize_scalar(
                lambda value: self.at(_with(best, k, float(value))),
                bounds=ends,
                method="bounded",
                options={"maxiter": MORE, "xatol": CLOSE * (shape.high - shape.low)},
            )

    def _tried(self, place: tuple[float, ...]) -> Tried:
        r = self.ranges
        chosen = tuple(zip(r.shapes, place, strict=True))
        scene = self._with(chosen)
        press = r.pressing
        F = scene.damper.centrifugal
        ends = (
            (F, F)
            if press is None
            else (press.centrifugal(press.low, scene), press.centrifugal(press.high, scene))
        )
        forces = [*r.forces, *r.nominal_forces]
        window = ends[0] / max(forces), ends[1] / min(forces)
        own = tuple(one.nominal for one in r.unsure)
        corners = itertools.product(*((one.low, one.high) for one in r.unsure))
        rigs = {
            w: self._rig((*chosen, *zip(r.unsure, w, strict=True)), window)
            for w in sorted({*corners, own})
        }
        counted = [
            rig
            for w, rig in rigs.items()
            if all(of.low <= v <= of.high for of, v in zip(r.unsure, w, strict=True))
        ]
        worst = WorstPeak(counted, r.forces, self.weight)
        plain = WorstPeak([rigs[own]], r.nominal_forces, self.weight)
        with self.stages("search", self._words(chosen)):
            best, nominal = (lowest_worst(one, *ends) for one in (worst, plain))
        return Tried(place, tuple(rigs.items()), worst, best, plain, nominal, ends)

    def _rig(self, given: Inputs, window: tuple[float, float]) -> PeaksOver:
        words, scene = self._words(given), self._with(given)

        def report(text: str) -> None:
            self.progress("peaks", f"{words}: {text}", None)

        with self.stages("peaks", words):
            return rig_peaks(scene, window, self.bodies, self.stages, report)

    def _with(self, given: Inputs) -> ForcedScene:
        if not given:
            return self.scene
        values = {of.path: of.text(value) for of, value in given}
        return bare(with_values(self.ranges.scene, values), self.stiffness)

    def _words(self, given: Inputs) -> str:
        texts = (f"{of.path} = {of.text(value)}" for of, value in given)
        return ", ".join([self.ranges.scene.name, *texts])
