"""What `upd fit` does on a terminal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape

from upd.fitting import fit
from upd.progress import Listener
from upd.scene import load_scene


def fit_on_terminal(
    console: Console,
    live: Listener,
    scene: str,
    changes: list[str],
    out: Path | None,
    **asked: Any,
) -> bool:
    """Fit, print the answer and where its files lie; whether the targets were reached.

    Parameters
    ----------
    console
        Of the answer.
    live
        Of the progress.
    scene, changes
        Ready name or file, and its overrides.
    out
        Folder; runs/fit-NAME when None.
    **asked
        As `upd.fit` takes them.
    """
    loaded = load_scene(scene, changes)
    folder = out or Path("runs") / f"fit-{loaded.name}"
    found = fit(loaded, out=folder, progress=live, **asked)
    console.print(escape(str(found)), soft_wrap=True)
    console.print(f"Scene: {escape(str(folder / found.scene.name))}.toml", soft_wrap=True)
    console.print(f"Figure: {escape(str(folder / 'fit.png'))}", soft_wrap=True)
    console.print(f"Report: {escape(str(folder / 'report.html'))}", soft_wrap=True)
    return found.status != "not reached"
