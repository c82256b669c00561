"""What follows from other keys: the damper's mass, its centrifugal force from mass, radius and
speed, damping from measured curves.

F_C = m r w^2, with the mass given, or density times the volume that the recipe gives. Excitation in
newtons becomes F_C/F_E.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from upd.errors import InputError
from upd.mesh import recipes
from upd.scene.base import Rotation
from upd.scene.bladed_disk import BladedDiskScene
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
    density: float = scene.damper.density or scene.material.density
    with suppress(InputError):
        return density * _volume(scene)
    return None


def _modal(scene: ModalScene, data: Mapping[str, Any]) -> ModalScene:
    fitted = _fitted(scene, data, "response")
    if not fitted:
        return scene
    return replace(scene, response=replace(scene.response, damping=main_ratio(fitted)))


def _seated(scene: Any, data: Mapping[str, Any], more: Sequence[str] = ()) -> Any:
    """The scene of a damper between two blades with its density and F_C; `more` is wrong too."""
    damper = scene.damper
    problems = _problems("damper", damper, data.get("damper", {}))
    if damper.mass is not None and damper.density is not None:
        problems.append("damper: mass and density are both given; give one")
    _refuse([*problems, *more])
    density, centrifugal = damper.density or scene.material.density, damper.centrifugal
    if damper.mass is not None or damper.speed is not None:
        volume = _volume(scene)
        density = density if damper.mass is None else damper.mass / volume
        if damper.speed is not None and damper.radius is not None:
            centrifugal = density * volume * damper.radius * damper.speed**2
    return replace(scene, damper=replace(damper, density=density, centrifugal=centrifugal))


def _forced(scene: ForcedScene, data: Mapping[str, Any]) -> ForcedScene:
    e, problems = scene.excitation, []
    wanted = data.get("excitation", {}).get("centrifugal_to_force")
    if e.force and wanted not in (None, FROM_FORCE):
        problems.append(
            "excitation: force and centrifugal_to_force are both given; give one, or "
            f'centrifugal_to_force = "{FROM_FORCE}"'
        )
    if wanted == FROM_FORCE and not e.force:
        problems.append(f'excitation.centrifugal_to_force: "{FROM_FORCE}" needs excitation.force')
    if 0.0 in e.force:
        problems.append("excitation.force: 0 N excites nothing; give a positive force")
    changed: ForcedScene = _seated(scene, data, problems)
    fitted = _fitted(scene, data, "excitation")
    if fitted:
        changed, e = replace(changed, fitted=fitted), replace(e, damping=main_ratio(fitted))
    ratios = tuple(changed.damper.centrifugal / force for force in e.force)
    e = replace(e, centrifugal_to_force=ratios or e.centrifugal_to_force)
    return replace(changed, excitation=e)


def _fitted(
    scene: ModalScene | ForcedScene, data: Mapping[str, Any], table: str
) -> tuple[FittedMode, ...]:
    """Damping from the measured free curves where the table asks for it."""
    asked = data.get(table, {}).get("damping") == FROM_MEASURED
    # damaged files are found with the other problems
    fine = asked and not any(measured_problems(scene.measured))
    return fitted_modes(scene.measured, table) if fine else ()


def _contact(scene: Scene, data: Mapping[str, Any]) -> Scene:
    loads, mass = scene.loads, scene.loads.mass
    problems = _problems("loads", loads, data.get("loads", {}))
    if not problems and loads.speed is None and mass is not None:
        problems = ["loads.mass: counts for F_C = m r w^2 only; add radius and speed"]
    _refuse(problems)
    if loads.speed is None or loads.radius is None:
        return scene
    if mass is None:
        material = scene.materials.get(_DAMPER)
        if material is None:
            raise InputError("loads.mass: is missing; give the damper's mass")
        mass = material.density * _volume(scene)
    force = mass * loads.radius * loads.speed**2
    return replace(scene, loads=replace(loads, centrifugal=force))


#: class of a scene -> function of it and of its data as they were read: the scene with centrifugal
#: force, density of the damper, force ratios and damping as numbers. Raises InputError whose
#: arguments are the problems.
DERIVED: Mapping[type[Any], Callable[[Any, Mapping[str, Any]], Any]] = {
    Scene: _contact,
    ModalScene: _modal,
    ForcedScene: _forced,
    SeatedScene: _seated,
    BladedDiskScene: lambda scene, data: scene,
}


def _refuse(problems: Sequence[str]) -> None:
    if problems:
        raise InputError(*problems)


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


def _volume(scene: Any) -> float:
    """Volume of the scene's damper in mm3. Raises InputError where its recipe has none."""
    contact = isinstance(scene, Scene)
    own = {} if contact else {"arrangement": scene.arrangement}
    given = {k: v for k, v in scene.geometry.items() if k not in ("recipe", "damper")} | own
    try:
        sizes = recipes.damper_sizes(scene.recipe, {k: v for k, v in given.items() if v != "auto"})
    except InputError as error:
        raise InputError(f"geometry: {error}") from None
    if sizes is not None:
        return sizes.volume
    table, remedy = (
        ("loads", "give loads.mass")
        if contact
        else ("damper", "give centrifugal and density, or add damper_sizes(params) to it")
    )
    raise InputError(f"{table}: the recipe {scene.recipe!r} has no volume of the damper; {remedy}")
