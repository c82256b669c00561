"""`upd.design`: the statics of a scene's damper in words, numbers and one figure."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any

from upd.cache.files import whole_files
from upd.errors import InputError, one_line
from upd.plot.chart import Chart
from upd.plot.matplotlib import chart_png, write_sheet
from upd.plot.png import png_uri
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
        folder = Path(out)
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            with whole_files(folder) as stage:
                text = json.dumps(self.as_dict(), indent=1, allow_nan=False) + "\n"
                (stage / f"{FIGURE}.json").write_text(text, encoding="utf-8")
                write_sheet(self.charts, stage / f"{FIGURE}.png")
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be written ({one_line(error)}); choose another with --out"
            ) from None
        return replace(self, folder=folder)

    def __str__(self) -> str:
        return "\n".join(lines(self.statics))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        told = escape(str(self))
        return f'<pre>{told}</pre><img src="{png_uri(chart_png(self.charts))}">'


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
