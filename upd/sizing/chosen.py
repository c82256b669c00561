"""The chosen damper as `upd.design` gives it: words, figure, page, numbers."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from upd.analyses import make_plan
from upd.analyses.forced.plan import ForcedPlan, newton_seconds
from upd.plot.chart import Chart
from upd.progress import Listener, silent
from upd.report.answer_folder import FigureAnswer
from upd.report.answer_page import answer_page
from upd.scene import ForcedScene
from upd.sizing.choice import ChosenDamper, Objective
from upd.sizing.choice_charts import FIGURE, choice_charts
from upd.sizing.choice_page import choice_page
from upd.sizing.choice_search import choose_damper
from upd.sizing.choice_words import headline, lines, plain_numbers
from upd.sizing.ranges import Ranges, read_ranges
from upd.sizing.ratio_curves import SCAN_STEP
from upd.sizing.rig_peaks import bare

#: Newton steps of a whole curve, and curves of a search beside those of the first scan; rigs of a
#: choice for every other input chosen
_STEPS, _SEARCH, _SHAPES = 600.0, 18, 10


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
    figure = FIGURE

    @property
    def verdict(self) -> str:
        """One sentence."""
        return headline(self.found)

    @property
    def charts(self) -> list[Chart]:
        """The charts of its figure."""
        return choice_charts(self.found)

    def as_dict(self) -> dict[str, Any]:
        """What stands in choice.json: numbers with their units; what is not known is null."""
        return plain_numbers(self.found)

    def told(self) -> list[str]:
        """The lines of the answer in words."""
        return lines(self.found)

    def texts(self, numbers: Mapping[str, Any], charts: Sequence[Chart]) -> dict[str, str]:
        """The page and the summary."""
        return {
            "report.html": answer_page(choice_page(self.found), charts),
            "summary.json": json.dumps(numbers, indent=1, allow_nan=False) + "\n",
        }


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


def best_damper(
    scene: ForcedScene,
    minimise: Objective,
    over: str | Sequence[str] | Mapping[str, str],
    for_: str | Sequence[str] | Mapping[str, str],
    progress: Listener = silent,
) -> BestDamper:
    """The damper whose worst peak over ranges is lowest.

    Parameters
    ----------
    scene
        A forced response on contact points.
    minimise
        "peak": the highest accelerance of the right blade within the scene's band, per newton of
        F_E; "acceleration": the highest acceleration.
    over, for_
        "path=low:high" of what is chosen, and of what it has to stand; several in a list, or a
        mapping path -> "low:high".
    progress
        Called at the beginning and the end of every stage.

    Raises
    ------
    InputError
        For bad ranges, and a scene whose peaks are not told over F_C/F_E.
    ConvergenceError
        Where no peak was followed far enough.
    """
    begin = time.perf_counter()
    ranges = read_ranges(scene, over, for_)
    return BestDamper(choose_damper(ranges, minimise, progress, begin=begin))
