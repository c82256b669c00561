"""Pictures of mode shapes.

Projections of the deformed bodies, which no chart of a run folder's arrays could draw.
"""

from __future__ import annotations

from pathlib import Path

from upd.analyses.modal.shapes import whole
from upd.analyses.modal.solve import ModalSolution, ModeSet
from upd.plot.modes import draw_mode
from upd.plot.sheet import Drawing, write_sheet

#: modes drawn of each configuration
_DRAWN = 4
_SIZE = (4.2, 5.2)


def write_pictures(solution: ModalSolution, folder: Path) -> list[Path]:
    """Write modes_free.png and modes_glued.png, the lowest modes of every arrangement.

    Returns their paths.
    """
    made: list[Path] = []
    for kind in ("free", "glued"):
        drawings = [d for s in solution.sets if s.kind == kind for d in mode_drawings(solution, s)]
        made += write_sheet(folder / f"modes_{kind}.png", drawings, _DRAWN, _SIZE)
    return made


def mode_drawings(solution: ModalSolution, found: ModeSet) -> list[Drawing]:
    """One drawing per mode, lowest first."""
    meshes, shapes = whole(solution, found)
    out: list[Drawing] = []
    for k, (mode, shape) in enumerate(shapes[:_DRAWN]):
        who = "" if mode.body.name == "rig" else f", {mode.body.name} blade"
        title = f"{found.arrangement}, {found.kind} {k + 1}{who}\n{mode.frequency:.2f} Hz"
        out.append(lambda ax, s=shape, t=title: draw_mode(meshes, s, ax, title=t))  # type: ignore[misc]
    return out
