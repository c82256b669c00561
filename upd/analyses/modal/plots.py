"""Figures of a rig run: mode shapes, and the frequency response; `save_figures` writes the PNG files of a run folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from upd.analyses.modal.output import whole
from upd.analyses.modal.solve import ModalSolution, ModeSet
from upd.plot.modes import draw_mode, draw_response
from upd.plot.sheet import Drawing, own_axes, write_sheet

#: modes drawn of each configuration
_DRAWN = 4


def mode_drawings(solution: ModalSolution, found: ModeSet) -> list[Drawing]:
    """One drawing per mode, lowest first."""
    meshes, shapes = whole(solution, found)
    out: list[Drawing] = []
    for k, (mode, shape) in enumerate(shapes[:_DRAWN]):
        who = "" if mode.body.name == "rig" else f", {mode.body.name} blade"
        title = f"{found.arrangement}, {found.kind} {k + 1}{who}\n{mode.frequency:.2f} Hz"
        out.append(lambda ax, s=shape, t=title: draw_mode(meshes, s, ax, title=t))  # type: ignore[misc]
    return out


def response_figure(solution: ModalSolution, blade: str, ax: Axes | None = None) -> Axes:
    """Accelerance of one blade over frequency, free and glued."""
    response = solution.response
    assert response is not None
    magnitudes = {name: np.abs(blades[blade]) for name, blades in response.accelerance.items() if np.abs(blades[blade]).max() > 0.0}
    peaks = [response.peak] if blade == "right" and response.peak is not None else []
    title = f"{blade} blade, damping {100 * response.damping:.3g} %"
    return draw_response(response.frequency, magnitudes, own_axes(ax), unit="accelerance, (m/s²)/N", title=title, peaks=peaks)


def save_figures(solution: ModalSolution, folder: Path) -> list[Path]:
    """Write the figures the solution has data for as PNG. Returns their paths."""
    made: list[Path] = []
    if solution.plan.scene.wants("pictures"):
        for kind in ("free", "glued"):
            drawings = [d for s in solution.sets if s.kind == kind for d in mode_drawings(solution, s)]
            made += write_sheet(folder / f"modes_{kind}.png", drawings, _DRAWN, (4.2, 5.2))
    if solution.response is not None:
        blades = [b for b in ("right", "left") if any(np.abs(c[b]).max() > 0.0 for c in solution.response.accelerance.values())]
        made += write_sheet(folder / "response.png", [lambda ax, b=b: response_figure(solution, b, ax) for b in blades], 2)  # type: ignore[misc]
    return made
