"""The PNG figures of a run folder, drawn from the charts of its analysis."""

from __future__ import annotations

import logging
import tomllib
from pathlib import Path

from upd.errors import UpdError
from upd.mesh import recipes
from upd.plot.matplotlib import write_sheets
from upd.report.notebook import RunResult, charts

log = logging.getLogger(__name__)

#: names of the figures a run may leave, without their ending
FIGURES = (
    "pressure",
    "pressure_sections",
    "force_approach",
    "over_load",
    "stick_slip",
    "traction",
    "hysteresis",
    "contact_open",
    "surface",
    "force_displacement",
    "contact_law",
    "response",
    "response_harmonics",
    "damping",
    "contact_state",
    "contact_map",
    "damper_motion",
    "damper_period",
    "seating",
    "performance",
    "modes_free",
    "modes_glued",
    "dimensions",
    "error_budget",
)


def write_figures(result: RunResult, folder: Path) -> list[Path]:
    """Draw the charts of a run as PNG, those of one figure on one sheet.

    Figures that lie there already stay. Returns what was written.
    """
    written = write_sheets(charts(result), folder, keep=True)
    return written + write_dimensions(result, folder / "dimensions.png")


def write_dimensions(result: RunResult, path: Path) -> list[Path]:
    """Draw the recipe's sections with their dimensions, unless its meshes cannot be made."""
    recipe = str(tomllib.loads(result.scene_text)["geometry"]["recipe"])
    try:
        meshes, views = recipes.drawing(recipe, result.size["mesh"])
    except UpdError as problem:
        log.info("no drawing of the geometry: %s", problem)
        return []
    # matplotlib takes a while to import
    from upd.plot.drawing import draw_sections
    from upd.plot.sheet import write_png

    return write_png(draw_sections(meshes, views), path)
