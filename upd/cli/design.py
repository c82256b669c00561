"""`upd design`: the damper before any dynamics, and the one whose worst peak is lowest."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from upd.cli import terminal
from upd.cli.terminal import Live, SetOption
from upd.errors import InputError


def design(
    scene: str,
    *,
    minimise: Literal["peak", "acceleration"] | None = None,
    over: list[str] | None = None,
    for_: Annotated[list[str] | None, Parameter(name="--for")] = None,
    set: SetOption = None,
    out: Path | None = None,
) -> None:
    """Show before any dynamics whether the damper jams, lifts off or tilts, in closed form; with
    --minimise, find the damper whose worst resonance peak is lowest.

    Maps of its angles and friction with the damper marked, and the limits of the forces on both
    faces under F_C: design.png, summary.json and report.html. Of a choice choice.png instead. Kill
    a choice at any moment: called again it continues from the peaks it has.

    Parameters
    ----------
    scene
        Ready name or .toml file of a forced response or a seated damper.
    minimise
        peak: the highest accelerance of the right blade within the scene's band, per newton of F_E;
        acceleration: the highest acceleration.
    over
        What is chosen, path=low:high; may be repeated: one input that sets F_C
        (damper.centrifugal=50:2000; radius or speed where the scene gives them), and others
        (geometry.front_angle=30:60), each of which multiplies the cost.
    for_
        What the damper has to stand, path=low:high; may be repeated: excitation.force=0.5:5, and
        other inputs (contact.friction=0.3:0.7), all of whose corners count.
    out
        Folder; by default runs/design-NAME, or runs/choice-NAME.
    """
    from upd.scene import load_scene
    from upd.sizing import BestDamper, DamperDesign
    from upd.sizing import design as design_damper

    loaded = load_scene(scene, set or [])
    if minimise is None and (over or for_):
        raise InputError("--over and --for belong to a choice: add --minimise peak")
    found: DamperDesign | BestDamper
    if minimise is None:
        found = design_damper(loaded)
    else:
        with Live() as live:
            found = design_damper(
                loaded, minimise=minimise, over=over or [], for_=for_ or [], progress=live
            )
    terminal.console.print(str(found), soft_wrap=True)
    folder = out or Path("runs") / f"{found.figure}-{loaded.name}"
    found.write(folder)
    terminal.console.print(f"Report: {folder / 'report.html'}", soft_wrap=True)
    terminal.console.print(f"Figure: {folder / f'{found.figure}.png'}", soft_wrap=True)
