"""`upd.design`: the statics of a scene's damper, or the best of a range of dampers."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, overload

from upd.analyses import make_plan
from upd.analyses.forced.plan import ForcedPlan, newton_seconds
from upd.errors import InputError
from upd.plot.chart import Chart
from upd.progress import Listener, silent
from upd.report.answer_folder import FigureAnswer
from upd.report.answer_page import answer_page
from upd.results.answer_table import AnswerTable
from upd.scene import AnyScene
from upd.scene.read import as_scene
from upd.scene.written import scene_as_run
from upd.sizing import charts, choice_charts, choice_tables, statics_tables
from upd.sizing.choice import ChosenDamper, Objective
from upd.sizing.choice_search import choose_damper
from upd.sizing.ranges import Ranges, read_ranges
from upd.sizing.ratio_curves import SCAN_STEP
from upd.sizing.rig_peaks import bare
from upd.sizing.statics import DamperStatics, damper_statics

#: Newton steps of a whole curve, and curves of a search beside those of the first scan; rigs of a
#: choice for every other input chosen
_STEPS, _SEARCH, _SHAPES = 600.0, 18, 10


@dataclass(frozen=True, repr=False)
class DamperDesign(FigureAnswer):
    """What `upd.design` found of a damper, in design.png and design.json.

    Attributes
    ----------
    statics : DamperStatics
        Its numbers.
    """

    statics: DamperStatics
    figure = charts.FIGURE

    @property
    def verdict(self) -> str:
        """What the damper does, and the friction below which it carries on both faces."""
        return statics_tables.verdict(self.statics)

    @property
    def tables(self) -> tuple[AnswerTable, ...]:
        """Limits of its friction, and forces of its faces."""
        return statics_tables.tables(self.statics)

    @property
    def notes(self) -> tuple[str, ...]:
        """Angles, friction, F_C and mass."""
        return statics_tables.notes(self.statics)

    @property
    def charts(self) -> list[Chart]:
        """Maps of its angles and friction, and limits of its forces."""
        return charts.statics_charts(self.statics)

    def as_dict(self) -> dict[str, Any]:
        """What stands in design.json: numbers with their units; what has no limit is null."""
        return statics_tables.plain_numbers(self.statics)


@dataclass(frozen=True, repr=False)
class BestDamper(FigureAnswer):
    """What `upd.design(..., minimise=...)` found, in summary.json (also choice.json), choice.png
    and report.html.

    Attributes
    ----------
    found : ChosenDamper
        Its numbers.
    """

    found: ChosenDamper
    figure = choice_charts.FIGURE

    @property
    def verdict(self) -> str:
        """The optimum and its worst peak."""
        return choice_tables.verdict(self.found)

    @property
    def tables(self) -> tuple[AnswerTable, ...]:
        """Both optima, what decides, and how far parameters may move."""
        return choice_tables.tables(self.found)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was asked, what limits the answer, and the cost."""
        return choice_tables.notes(self.found)

    @property
    def charts(self) -> list[Chart]:
        """Worst peaks over F_C, and peaks over F_C/F_E."""
        return choice_charts.choice_charts(self.found)

    def as_dict(self) -> dict[str, Any]:
        """What stands in choice.json: numbers with their units; what is not known is null."""
        return choice_tables.plain_numbers(self.found)

    def texts(self, numbers: Mapping[str, Any], charts: Sequence[Chart]) -> dict[str, str]:
        """The page and the summary."""
        scene, status = self.found.ranges.scene, self.found.best.best.status
        outcome = (status.capitalize(), "passed" if status == "found" else "warning")
        written = (scene_as_run(scene), "The scene that the choice began with.")
        return {
            "report.html": answer_page(self, charts, scene.title or scene.name, outcome, written),
            "summary.json": json.dumps(numbers, indent=1, allow_nan=False) + "\n",
        }


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
        Folder that gets figure, numbers and, of a choice, report.html; None writes nothing.
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
        found: DamperDesign | BestDamper = DamperDesign(damper_statics(loaded))
    else:
        found = BestDamper(choose_damper(read_ranges(loaded, over, for_), minimise, progress))
    return found if out is None else found.write(out)


def predicted(ranges: Ranges) -> str:
    """What a choice will take, in words, before it begins.

    Parameters
    ----------
    ranges
        Of the choice.
    """
    name = next(iter(ranges.scene.stiffnesses))
    scene = bare(ranges.scene, name)
    e = replace(scene.excitation, points=10, centrifugal_to_force=(1e9,), force=())
    plan = make_plan(replace(scene, excitation=e))
    assert isinstance(plan, ForcedPlan)
    press, forces = ranges.pressing, [*ranges.forces, *ranges.nominal_forces]
    wide = max(forces) / min(forces) * (1.0 if press is None else press.high / press.low)
    curves = math.log(wide) / SCAN_STEP + _SEARCH
    shapes = _SHAPES * len(ranges.shapes) if ranges.shapes else 1
    rigs = shapes * (2 ** len(ranges.unsure) + 1 if ranges.unsure else 1)
    one = plan.seconds + curves * _STEPS * newton_seconds(plan)
    return f"about {rigs} rig{'s' * (rigs > 1)} of {curves:.0f} whole curves: {rigs * one:.0f} s"
