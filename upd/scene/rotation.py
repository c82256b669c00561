"""What follows from other keys: the damper's mass, its centrifugal force from mass, radius and
speed, damping from measured curves.

F_C = m r w^2, with the mass given, or density times the volume that the recipe gives. Excitation in
newtons becomes F_C/F_E.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from upd.errors import InputError
from upd.mesh import recipes
from upd.scene.base import Rotation
from upd.scene.contact import Scene
from upd.scene.forced import ForcedScene
from upd.scene.measured import (
    FROM_MEASURED,
    FittedMode,
    fitted_modes,
    main_ratio,
    measured_problems,
)
from upd.scene.modal import ModalScene
from upd.scene.quantities import FROM_FORCE, FROM_SPEED
from upd.scene.seated import SeatedScene

#: body of a contact whose density is the damper's
_DAMPER = "damper"


def damper_mass(scene: Any) -> float | None:
    """Mass of the damper between two blades, t; None where its recipe has no volume of it.

    Parameters
    ----------
    scene
        A forced response or a seated damper as it was loaded.
    """
    volume, problem = _volume(scene)
    return None if problem else (scene.damper.density or scene.material.density) * volume


def _modal(scene: ModalScene, data: Mapping[str, Any]) -> tuple[ModalScene, list[str]]:
    fitted, problems = _fitted(scene, data, "response")
    if not fitted:
        return scene, problems
    return replace(scene, response=replace(scene.response, damping=main_ratio(fitted))), []


def _seated(scene: Any, data: Mapping[str, Any]) -> tuple[Any, list[str]]:
    """The scene of a damper between two blades with its density and F_C."""
    damper = scene.damper
    problems = _problems("damper", damper, data.get("damper", {}))
    if damper.mass is not None and damper.density is not None:
        problems.append("damper: mass and density are both given; give one")
    if problems:
        return scene, problems
    density, centrifugal = damper.density or scene.material.density, damper.centrifugal
    if damper.mass is not None or damper.speed is not None:
        volume, problem = _volume(scene)
        if problem:
            return scene, [problem]
        density = density if damper.mass is None else damper.mass / volume
        if damper.speed is not None and damper.radius is not None:
            centrifugal = density * volume * damper.radius * damper.speed**2
    return replace(scene, damper=replace(damper, density=density, centrifugal=centrifugal)), []


def _forced(scene: ForcedScene, data: Mapping[str, Any]) -> tuple[ForcedScene, list[str]]:
    e = scene.excitation
    changed, problems = _seated(scene, data)
    add = problems.append
    wanted = data.get("excitation", {}).get("centrifugal_to_force")
    if e.force and wanted is not None and wanted != FROM_FORCE:
        add(
            "excitation: force and centrifugal_to_force are both given; give one, or "
            f'centrifugal_to_force = "{FROM_FORCE}"'
        )
    if wanted == FROM_FORCE and not e.force:
        add(f'excitation.centrifugal_to_force: "{FROM_FORCE}" needs excitation.force')
    if 0.0 in e.force:
        add("excitation.force: 0 N excites nothing; give a positive force")
    fitted, more = ((), []) if problems else _fitted(scene, data, "excitation")
    problems += more
    if problems:
        return scene, problems
    if fitted:
        changed, e = replace(changed, fitted=fitted), replace(e, damping=main_ratio(fitted))
    ratios = tuple(changed.damper.centrifugal / force for force in e.force)
    e = replace(e, centrifugal_to_force=ratios or e.centrifugal_to_force)
    return replace(changed, excitation=e), []


def _fitted(
    scene: ModalScene | ForcedScene, data: Mapping[str, Any], table: str
) -> tuple[tuple[FittedMode, ...], list[str]]:
    """Damping from the measured free curves where the table asks for it, and what is wrong."""
    # damaged files are found with the other problems
    if data.get(table, {}).get("damping") != FROM_MEASURED or measured_problems(scene.measured):
        return (), []
    try:
        return fitted_modes(scene.measured, table), []
    except InputError as error:
        return (), [str(error)]


def _contact(scene: Scene, data: Mapping[str, Any]) -> tuple[Scene, list[str]]:
    loads, mass = scene.loads, scene.loads.mass
    problems = _problems("loads", loads, data.get("loads", {}))
    if not problems and loads.speed is None and mass is not None:
        problems = ["loads.mass: counts for F_C = m r w^2 only; add radius and speed"]
    if problems or loads.speed is None or loads.radius is None:
        return scene, problems
    if mass is None:
        material = scene.materials.get(_DAMPER)
        if material is None:
            return scene, ["loads.mass: is missing; give the damper's mass"]
        volume, problem = _volume(scene)
        if problem:
            return scene, [problem]
        mass = material.density * volume
    force = mass * loads.radius * loads.speed**2
    return replace(scene, loads=replace(loads, centrifugal=force)), []


#: class of a scene -> function of it and of its data as they were read: the scene with centrifugal
#: force, density of the damper, force ratios and damping as numbers, and what is wrong with them
DERIVED: Mapping[type[Any], Callable[[Any, Mapping[str, Any]], tuple[Any, list[str]]]] = {
    Scene: _contact,
    ModalScene: _modal,
    ForcedScene: _forced,
    SeatedScene: _seated,
}


def _problems(table: str, values: Rotation, given: Mapping[str, Any]) -> list[str]:
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


def _volume(scene: Any) -> tuple[float, str]:
    """Volume of the scene's damper in mm3, or the problem."""
    contact = isinstance(scene, Scene)
    own = {} if contact else {"arrangement": scene.arrangement}
    given = {k: v for k, v in scene.geometry.items() if k not in ("recipe", "damper")} | own
    try:
        sizes = recipes.damper_sizes(scene.recipe, {k: v for k, v in given.items() if v != "auto"})
    except InputError as error:
        return 0.0, f"geometry: {error}"
    if sizes is not None:
        return sizes.volume, ""
    remedy = (
        "give loads.mass"
        if contact
        else "give centrifugal and density instead, or add damper_sizes(params) to it"
    )
    table = "loads" if contact else "damper"
    return 0.0, f"{table}: the recipe {scene.recipe!r} has no volume of the damper; {remedy}"
