"""The load at which a study looks: ``--at``."""

from __future__ import annotations

import math
import tomllib
from typing import Any

from upd.analyses import analysis_of
from upd.errors import InputError
from upd.scene import AnyScene, load_scene
from upd.units import parse_quantity


def scene_at(scene: AnyScene, at: float | str | None) -> AnyScene:
    """The scene at one load.

    Parameters
    ----------
    at
        F_C/F_E of a forced response; the normal force of a contact, or F_C of a seated damper: N
        as a number, or text with a unit. None: the scene as it is.

    Raises
    ------
    InputError
        For what is no such load, a scene without one, and one that does not take it.
    """
    if at is None:
        return scene
    analysis = analysis_of(scene).name
    if analysis == "modal":
        raise InputError(
            f"--at {at}: free vibration has no load to choose; leave it out, or study a forced "
            "response"
        )
    settings = _ratio(scene, at) if analysis == "forced" else _force(analysis, at)
    try:
        changed: AnyScene = load_scene(tomllib.loads(scene.text), settings)
    except InputError as problem:
        raise InputError(f"--at {at}: the scene does not take it: {problem}") from None
    return changed


def _ratio(scene: Any, at: float | str) -> dict[str, Any]:
    try:
        ratio = float(at)
    except ValueError:
        ratio = math.nan
    if not 0.0 < ratio < math.inf:
        raise InputError(
            f"--at {at}: a forced response is studied at one F_C/F_E; write a positive number "
            "without a unit, for example --at 194"
        )
    return {
        "excitation.centrifugal_to_force": [ratio],
        **({"excitation.force": []} if scene.excitation.force else {}),
    }


def _force(analysis: str, at: float | str) -> dict[str, Any]:
    try:
        force = float(at)
    except ValueError:
        try:
            force = float(parse_quantity(at, "force"))
        except InputError:
            force = math.nan
    if not 0.0 < force < math.inf:
        of = "F_C of a seated damper" if analysis == "seated" else "the normal force of a contact"
        raise InputError(
            f'--at {at}: chooses {of}; write a positive force, for example --at "200 N"'
        )
    told = f"{force!r} N"
    return {"damper.centrifugal": told} if analysis == "seated" else {"loads.normal": [told]}
