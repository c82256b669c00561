"""The damper's mass, and its centrifugal force from mass, radius and speed.

F_C = m r w^2, with the mass given, or density times the volume that the recipe gives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from upd.errors import InputError
from upd.mesh import recipes
from upd.scene.base import RigBase
from upd.scene.quantities import FROM_SPEED


def damper_mass(scene: Any) -> float | None:
    """Mass of the damper between two blades, t; None where its recipe has no volume of it.

    Parameters
    ----------
    scene
        A forced response or a seated damper as it was loaded.
    """
    density: float = scene.damper.density or scene.material.density
    with suppress(InputError):
        return density * volume_of(scene)
    return None


def with_damper(scene: Any, data: Mapping[str, Any], more: Sequence[str] = ()) -> Any:
    """The scene of a damper between two blades with its density and F_C; `more` is wrong too."""
    damper = scene.damper
    problems = rotation_problems("damper", damper, data.get("damper", {}))
    if damper.mass is not None and damper.density is not None:
        problems.append("damper: mass and density are both given; give one")
    if problems := [*problems, *more]:
        raise InputError(*problems)
    density, centrifugal = damper.density or scene.material.density, damper.centrifugal
    if damper.mass is not None or damper.speed is not None:
        volume = volume_of(scene)
        density = density if damper.mass is None else damper.mass / volume
        if damper.speed is not None and damper.radius is not None:
            centrifugal = density * volume * damper.radius * damper.speed**2
    return replace(scene, damper=replace(damper, density=density, centrifugal=centrifugal))


def rotation_problems(table: str, values: Any, given: Mapping[str, Any]) -> list[str]:
    """What of radius, speed and centrifugal force does not go together."""
    radius, speed, direct = values.radius, values.speed, given.get("centrifugal")
    if (radius is None) != (speed is None):
        missing = "speed" if speed is None else "radius"
        return [f"{table}: F_C = m r w^2 needs radius and speed; add {missing}"]
    if speed is not None and direct not in (None, FROM_SPEED):
        both = f'give one, or centrifugal = "{FROM_SPEED}"'
        return [f"{table}: centrifugal and speed are both given; {both}"]
    if speed is None and direct == FROM_SPEED:
        return [f'{table}.centrifugal: "{FROM_SPEED}" needs radius and speed']
    return []


def volume_of(scene: Any) -> float:
    """Volume of the scene's damper in mm3. Raises InputError where its recipe has none."""
    rig = isinstance(scene, RigBase)
    own = {"arrangement": scene.arrangement} if rig else {}
    given = {k: v for k, v in scene.geometry.items() if k not in ("recipe", "damper")} | own
    try:
        sizes = recipes.damper_sizes(scene.recipe, {k: v for k, v in given.items() if v != "auto"})
    except InputError as error:
        raise InputError(f"geometry: {error}") from None
    if sizes is not None:
        return sizes.volume
    table, remedy = (
        ("damper", "give centrifugal and density, or add damper_sizes(params) to it")
        if rig
        else ("loads", "give loads.mass")
    )
    raise InputError(f"{table}: the recipe {scene.recipe!r} has no volume of the damper; {remedy}")
