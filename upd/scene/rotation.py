"""What follows from other keys: the damper's mass, its centrifugal force from mass, radius and
speed, damping from measured curves.

F_C = m r w^2, with the mass given, or density times the volume that the recipe tells. Excitation in
newtons becomes F_C/F_E.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from upd.errors import InputError
from upd.mesh import recipes
from upd.scene.contact import Loads, Scene
from upd.scene.forced import DamperChoice, ForcedScene
from upd.scene.measured import (
    FROM_MEASURED,
    FittedMode,
    MeasuredChoice,
    fitted_modes,
    main_ratio,
    measured_problems,
)
from upd.scene.quantities import FROM_FORCE, FROM_SPEED
from upd.scene.seated import SeatedScene

#: body of a contact whose density is the damper's
_DAMPER = "damper"


def turning(scene: Any, data: Mapping[str, Any]) -> tuple[Any, list[str]]:
    """The scene with its centrifugal force, the damper's density and the force ratios as numbers,
    and what is wrong with them.

    Parameters
    ----------
    data
        The scene as it was read: what was given there.
    """
    if isinstance(scene, ForcedScene):
        return _forced(scene, data)
    if isinstance(scene, SeatedScene):
        return _between(scene, data, [])
    if isinstance(scene, Scene):
        return _contact(scene, data)
    fitted, problems = _fitted(scene.measured, data, "response")
    if not fitted:
        return scene, problems
    return replace(scene, response=replace(scene.response, damping=main_ratio(fitted))), []


def damper_mass(scene: Any) -> float | None:
    """Mass of the damper between two blades, t; None where its recipe does not tell its volume.

    Parameters
    ----------
    scene
        A forced response or a seated damper as it was loaded.
    """
    volume, problem = _volume(
        scene.recipe, {**scene.geometry, "arrangement": scene.arrangement}, "damper"
    )
    return None if problem else (scene.damper.density or scene.material.density) * volume


def _between(scene: Any, data: Mapping[str, Any], more: Sequence[str]) -> tuple[Any, list[str]]:
    """The scene of a damper between two blades with its density and F_C; `more` is wrong too."""
    damper = scene.damper
    given = data.get("damper", {})
    problems = _problems("damper", damper, given, "mass" if damper.mass is not None else "")
    if damper.mass is not None and damper.density is not None:
        problems.append("damper: mass and density are both given; give one")
    if problems or more:
        return scene, [*problems, *more]
    geometry = {**scene.geometry, "arrangement": scene.arrangement}
    density, centrifugal = damper.density or scene.material.density, damper.centrifugal
    if damper.mass is not None or damper.speed is not None:
        volume, problem = _volume(scene.recipe, geometry, "damper")
        if problem:
            return scene, [problem]
        density = density if damper.mass is None else damper.mass / volume
        if damper.speed is not None and damper.radius is not None:
            centrifugal = density * volume * damper.radius * damper.speed**2
    return replace(scene, damper=replace(damper, density=density, centrifugal=centrifugal)), []


def _forced(scene: ForcedScene, data: Mapping[str, Any]) -> tuple[ForcedScene, list[str]]:
    e, problems = scene.excitation, []
    wanted = data.get("excitation", {}).get("centrifugal_to_force")
    if e.force and wanted is not None and wanted != FROM_FORCE:
        problems.append(
            "excitation: force and centrifugal_to_force are both given; give one, or "
            f'centrifugal_to_force = "{FROM_FORCE}"'
        )
    if wanted == FROM_FORCE and not e.force:
        problems.append(f'excitation.centrifugal_to_force: "{FROM_FORCE}" needs excitation.force')
    if any(force == 0.0 for force in e.force):
        problems.append("excitation.force: 0 N excites nothing; give a positive force")
    changed, problems = _between(scene, data, problems)
    if problems:
        return scene, problems
    fitted, problems = _fitted(scene.measured, data, "excitation")
    if problems:
        return scene, problems
    if fitted:
        changed, e = replace(changed, fitted=fitted), replace(e, damping=main_ratio(fitted))
    centrifugal = changed.damper.centrifugal
    ratios = tuple(centrifugal / force for force in e.force) or e.centrifugal_to_force
    return replace(changed, excitation=replace(e, centrifugal_to_force=ratios)), []


def _fitted(
    measured: Mapping[str, MeasuredChoice], data: Mapping[str, Any], table: str
) -> tuple[tuple[FittedMode, ...], list[str]]:
    """Damping from the measured free curves where the table asks for it, and what is wrong."""
    # damaged files are told with the other problems
    if data.get(table, {}).get("damping") != FROM_MEASURED or measured_problems(measured):
        return (), []
    try:
        return fitted_modes(measured, table), []
    except InputError as error:
        return (), [str(error)]


def _contact(scene: Scene, data: Mapping[str, Any]) -> tuple[Scene, list[str]]:
    loads = scene.loads
    problems = _problems("loads", loads, data.get("loads", {}), "loads.mass")
    if problems or loads.speed is None or loads.radius is None:
        return scene, problems
    mass = loads.mass
    if mass is None:
        material = scene.materials.get(_DAMPER)
        if material is None:
            return scene, ["loads.mass: is missing; give the damper's mass"]
        volume, problem = _volume(scene.recipe, scene.geometry, "loads")
        if problem:
            return scene, [problem]
        mass = material.density * volume
    force = mass * loads.radius * loads.speed**2
    return replace(scene, loads=replace(loads, centrifugal=force)), []


def _problems(
    table: str, values: DamperChoice | Loads, given: Mapping[str, Any], mass: str
) -> list[str]:
    """What of mass, radius, speed and centrifugal force does not go together."""
    radius, speed = values.radius, values.speed
    if (radius is None) != (speed is None):
        missing = "speed" if speed is None else "radius"
        return [f"{table}: F_C = m r w^2 needs radius and speed; add {missing}"]
    direct = given.get("centrifugal")
    if speed is not None and direct is not None and direct != FROM_SPEED:
        return [
            f"{table}: centrifugal and speed are both given; give one, or "
            f'centrifugal = "{FROM_SPEED}"'
        ]
    if speed is None and direct == FROM_SPEED:
        return [f'{table}.centrifugal: "{FROM_SPEED}" needs radius and speed']
    if speed is None and values.mass is not None and mass == "loads.mass":
        return ["loads.mass: counts for F_C = m r w^2 only; add radius and speed"]
    return []


def _volume(recipe: str, geometry: Mapping[str, Any], table: str) -> tuple[float, str]:
    """Volume of the damper in mm3, or the problem."""
    given = {k: v for k, v in geometry.items() if k not in ("recipe", "damper") and v != "auto"}
    try:
        sizes = recipes.damper_sizes(recipe, given)
    except InputError as error:
        return 0.0, f"geometry: {error}"
    if sizes is None:
        remedy = (
            "give loads.mass"
            if table == "loads"
            else "give centrifugal and density instead, or add damper_sizes(params) to it"
        )
        return 0.0, f"{table}: the recipe {recipe!r} does not tell the damper's volume; {remedy}"
    return sizes.volume, ""
