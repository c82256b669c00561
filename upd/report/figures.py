"""The PNG figures of a run folder, drawn from the charts of its analysis."""

from __future__ import annotations

from pathlib import Path

from upd.plot.matplotlib import write_sheets
from upd.report.notebook import RunResult, charts

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
    "contact_state",
    "contact_map",
    "damper_motion",
    "performance",
    "spread",
    "harmonics",
    "modes_free",
    "modes_glued",
)


def write_figures(result: RunResult, folder: Path) -> list[Path]:
    """Draw the charts of a run as PNG, those of one figure on one sheet.

    Figures that lie there already stay. Returns what was written.
    """
    return write_sheets(charts(result), folder, keep=True)
