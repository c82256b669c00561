"""`upd design`: the damper before any dynamics, and the one that makes peaks lowest."""

from __future__ import annotations

from pathlib import Path

import upd.cli.app as shell
from upd.cli.app import SetOption, _plain


def design(scene: str, *, set: SetOption = None, out: Path | None = None) -> None:
    """Tell before any dynamics whether the damper jams, lifts off or tilts, in closed form.

    Maps of its angles and friction with the damper marked, and the limits of the forces on both
    faces under F_C: design.png and design.json.

    Parameters
    ----------
    scene
        Ready name or .toml file of a forced response or a seated damper.
    out
        Folder; by default runs/design-NAME.
    """
    from upd.scene import load_scene
    from upd.sizing import design as statics_of

    loaded = load_scene(scene, set or [])
    found = statics_of(loaded)
    shell.console.print(_plain(found), soft_wrap=True)
    folder = out or Path("runs") / f"design-{loaded.name}"
    found.write(folder)
    shell.console.print(f"Figure: {_plain(folder / 'design.png')}")
