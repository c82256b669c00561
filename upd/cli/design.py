"""`upd design`: the damper before any dynamics, and the one whose worst peak is lowest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from upd.cli import terminal
from upd.cli.terminal import Live, SetOption, plain
from upd.errors import InputError

RangeOption = Annotated[list[str] | None, Parameter(negative=())]


def design(
    scene: str,
    *,
    minimise: Literal["peak", "acceleration"] | None = None,
    over: RangeOption = None,
    for_: Annotated[list[str] | None, Parameter(name="--for", negative=())] = None,
    grid: int | None = None,
    set: SetOption = None,
    out: Path | None = None,
) -> None:
    """Tell before any dynamics whether the damper jams, lifts off or tilts, in closed form; with
    --minimise, find the damper whose worst resonance peak is lowest.

    Maps of its angles and friction with the damper marked, and the limits of the forces on both
    faces under F_C: design.png and design.json. Of a choice choice.png, choice.json and
    report.html. Kill a choice at any moment: called again it goes on from the peaks it has.

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
    grid
        Points of a grid of runs (upd sweep) that checks a choice.
    out
        Folder; by default runs/design-NAME, or runs/choice-NAME.
    """
    from upd.scene import load_scene

    loaded = load_scene(scene, set or [])
    if minimise is None:
        if over or for_ or grid:
            raise InputError("--over, --for and --grid belong to a choice: add --minimise peak")
        _statics(loaded, out)
    else:
        _choice(loaded, minimise, over or [], for_ or [], grid, out)


def _statics(loaded: Any, out: Path | None) -> None:
    from upd.sizing import design as statics_of

    found = statics_of(loaded)
    terminal.console.print(plain(found), soft_wrap=True)
    folder = out or Path("runs") / f"design-{loaded.name}"
    found.write(folder)
    terminal.console.print(f"Figure: {plain(folder / 'design.png')}")


def _choice(
    loaded: Any,
    minimise: Literal["peak", "acceleration"],
    over: list[str],
    for_: list[str],
    grid: int | None,
    out: Path | None,
) -> None:
    from upd.cli.progress import ProgressLine
    from upd.sizing.chosen import best_damper, predicted
    from upd.sizing.ranges import read_ranges

    folder = out or Path("runs") / f"choice-{loaded.name}"
    terminal.console.print(
        f"Predicted: {predicted(read_ranges(loaded, over, for_))}", soft_wrap=True
    )
    with Live() as live:
        found = best_damper(loaded, minimise, over, for_, live)
    if grid is not None:
        from upd.sizing.choice_grid import check_by_grid

        with ProgressLine(terminal.console) as watch:
            checked = check_by_grid(found.found, grid, folder / "grid", watch=watch)
        found = replace(found, found=replace(found.found, grid=checked))
    terminal.console.print(plain(found), soft_wrap=True)
    found.write(folder)
    terminal.console.print(f"Report: {plain(folder / 'report.html')}", soft_wrap=True)
    terminal.console.print(f"Figure: {plain(folder / 'choice.png')}", soft_wrap=True)
