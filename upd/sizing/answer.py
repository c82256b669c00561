"""`upd.design`: the statics of a scene's damper, or the best of a range of dampers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

from upd.errors import InputError
from upd.plot.chart import Chart
from upd.progress import Listener, silent
from upd.report.answer_folder import FigureAnswer
from upd.scene import AnyScene
from upd.scene.read import as_scene
from upd.sizing.charts import FIGURE, statics_charts
from upd.sizing.choice import Objective
from upd.sizing.chosen import BestDamper, best_damper
from upd.sizing.statics import DamperStatics, damper_statics
from upd.sizing.words import headline, lines, plain_numbers


@dataclass(frozen=True, repr=False)
class DamperDesign(FigureAnswer):
    """What `upd.design` found of a damper, in design.png and design.json.

    Attributes
    ----------
    statics : DamperStatics
        Its numbers.
    """

    statics: DamperStatics
    figure = FIGURE

    @property
    def verdict(self) -> str:
        """One sentence."""
        return headline(self.statics)

    @property
    def charts(self) -> list[Chart]:
        """The charts of its figure."""
        return statics_charts(self.statics)

    def as_dict(self) -> dict[str, Any]:
        """What stands in design.json: numbers with their units; what has no limit is null."""
        return plain_numbers(self.statics)

    def told(self) -> list[str]:
        """The lines of the answer in words."""
        return lines(self.statics)


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
        found = best_damper(loaded, minimise, over, for_, progress)
    return found if out is None else found.write(out)
