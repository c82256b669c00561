"""`upd.design`: the statics of a scene's damper, or the best of a range of dampers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, overload

from upd.errors import InputError
from upd.progress import Listener, silent
from upd.scene import AnyScene
from upd.scene.read import as_scene
from upd.sizing.choice import Objective
from upd.sizing.choice_answer import BestDamper
from upd.sizing.choice_search import choose_damper
from upd.sizing.ranges import read_ranges
from upd.sizing.statics import damper_statics
from upd.sizing.statics_answer import DamperDesign


@overload
def design(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
) -> DamperDesign: ...


@overload
def design(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    minimise: Objective,
    over: str | Sequence[str] | Mapping[str, str],
    for_: str | Sequence[str] | Mapping[str, str] = (),
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
    progress: Listener = silent,
) -> BestDamper: ...


def design(
    scene: AnyScene | str | Path | Mapping[str, Any],
    *,
    minimise: Objective | None = None,
    over: str | Sequence[str] | Mapping[str, str] = (),
    for_: str | Sequence[str] | Mapping[str, str] = (),
    overrides: Sequence[str] | Mapping[str, Any] = (),
    out: str | Path | None = None,
    progress: Listener = silent,
) -> DamperDesign | BestDamper:
    """Tell before any dynamics whether a scene's damper jams, lifts off or tilts, and what its
    faces can carry; or, with ``minimise``, find the damper whose worst resonance peak is lowest.

    Parameters
    ----------
    scene
        A loaded scene, a ready name, a .toml path or a mapping: a forced response or, without
        ``minimise``, a seated damper.
    minimise
        "peak": the highest accelerance of the right blade within the scene's band, in (m/s2) per
        newton of F_E, as runs tell it: all levels of excitation count alike. "acceleration": the
        highest acceleration, in m/s2: the strongest excitation counts most.
    over
        What is chosen, "damper.centrifugal=50:2000", a list of such or a mapping path -> range: one
        input that sets F_C, and others, each of which multiplies the cost.
    for_
        What it has to stand, "excitation.force=0.5:5": F_E, and other inputs, all of whose corners
        count.
    overrides
        "path=value" texts, or a mapping path -> value.
    out
        Folder that gets figure, numbers and report.html; None writes nothing.
    progress
        Called at the beginning and the end of every stage of a choice.

    Raises
    ------
    InputError
        For a bad scene or range, one without a damper between two blades, and a folder that cannot
        be written.
    ConvergenceError
        Where no peak was followed far enough for a choice.
    """
    loaded = as_scene(scene, overrides)
    if minimise is None:
        if over or for_:
            raise InputError('over and for_ belong to a choice: add minimise = "peak"')
        found: DamperDesign | BestDamper = DamperDesign(loaded, damper_statics(loaded))
    else:
        ranges = read_ranges(loaded, over, for_)
        found = BestDamper(loaded, choose_damper(ranges, minimise, progress))
    return found if out is None else found.write(out)
