"""`upd.design`: the statics of a scene's damper in words, numbers and one figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from upd.plot.chart import Chart
from upd.report.answer_folder import answer_html, write_answer
from upd.scene import AnyScene
from upd.scene.read import as_scene
from upd.sizing.charts import FIGURE, statics_charts
from upd.sizing.statics import DamperStatics, damper_statics
from upd.sizing.words import headline, lines, plain_numbers


@dataclass(frozen=True)
class DamperDesign:
    """What `upd.design` found of a damper.

    Attributes
    ----------
    statics : DamperStatics
        Its numbers.
    folder : Path, optional
        Where design.png and design.json lie; None when nothing was written.
    """

    statics: DamperStatics
    folder: Path | None = None

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

    def write(self, out: str | Path) -> DamperDesign:
        """Write design.png and design.json into a folder; the same with that folder.

        Parameters
        ----------
        out
            The folder, made where there is none.

        Raises
        ------
        InputError
            When it cannot be written.
        """
        folder = write_answer(out, FIGURE, self.as_dict(), self.charts)
        return replace(self, folder=folder)

    def __str__(self) -> str:
        return "\n".join(lines(self.statics))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return answer_html(str(self), self.charts)


def design(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
) -> DamperDesign:
    """Tell before any dynamics whether a scene's damper jams, lifts off or tilts, and what its
    faces can carry.

    Parameters
    ----------
    scene
        A loaded scene, a ready name, a .toml path or a mapping: a forced response or a seated
        damper.
    overrides
        "path=value" texts, or a mapping path -> value.
    out
        Folder that gets design.png and design.json; None writes nothing.

    Raises
    ------
    InputError
        For a bad scene, one without a damper between two blades, and a folder that cannot be
        written.
    """
    found = DamperDesign(damper_statics(as_scene(scene, overrides)))
    return found if out is None else found.write(out)
