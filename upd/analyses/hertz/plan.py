"""Plan of a curved contact.

Mirror planes, load families, what is left out, sizes from Hertz's contact.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from upd.analyses.base import Effect
from upd.analyses.contact.effects import (
    DIRECTIONS,
    LARGE,
    TOGETHER,
    coupling_effects,
    omitted,
)
from upd.analyses.contact.plan import (
    ACROSS,
    ALONG,
    NORMAL,
    ContactPlan,
    Family,
    contact_plan,
    mesh_parameters,
    two_bodies,
    with_companion,
)
from upd.errors import InputError
from upd.mesh import recipes
from upd.reference import contact_modulus, hertz_sphere, sphere_gap
from upd.scene import FRICTION_WANTS, Scene, friction_on


def make_plan(scene: Scene) -> ContactPlan:
    """Derive the plan of ``scene``, without the cost of what its errors are estimated with.

    Raises InputError when its parts do not fit together.
    """
    two_bodies(scene)
    symmetry, why = _symmetry(scene)
    families = _families(scene, symmetry)
    plan = contact_plan(
        scene,
        symmetry,
        families,
        _effects(scene, symmetry, why),
        recipe_parameters(scene, symmetry),
    )
    return with_companion(plan, _companion_parameters(scene))


def _companion_parameters(scene: Scene) -> dict[str, Any]:
    """Of the whole model at the run's spacing.

    The patch is no larger than the largest load needs it.
    """
    parameters = recipe_parameters(scene, "full")
    if scene.sphere_radius is not None and max(scene.loads.forces) > 0.0:
        needed = auto_patch(scene)
        if needed < float(parameters["patch"]):
            share = needed / float(parameters["patch"])
            parameters["patch"] = needed
            parameters["divisions"] = 2 * round(0.5 * share * int(parameters["divisions"])) or 2
            if scene.geometry.get("core_depth", "auto") == "auto":
                parameters["core_depth"] = auto_core_depth(scene, needed)
    return parameters


def _symmetry(scene: Scene) -> tuple[str, str]:
    asked = scene.mesh.symmetry
    planes = has_mirror_planes(scene)
    two = scene.coupled or (friction_on(scene) and scene.slip_directions == 2)
    which = (
        "normal and tangential contact at once are solved on the full model"
        if scene.coupled
        else "slip in two directions is solved on the full model"
    )
    if asked != "auto":
        if asked != "full" and not planes:
            raise InputError(
                f'mesh.symmetry: the recipe {scene.recipe!r} has no mirror planes; use "full"'
            )
        if asked != "full" and two:
            raise InputError(f'mesh.symmetry: {which}; use "full" or "auto"')
        return asked, "asked for in the scene"
    if not planes:
        return "full", "the geometry has no mirror planes"
    if two:
        return "full", which
    return "quarter", "geometry, load and effects share both mirror planes"


def has_mirror_planes(scene: Scene) -> bool:
    """Whether the recipe makes a body that is its own mirror image about x = 0 and y = 0."""
    return "symmetry" in recipes.parameters(scene.recipe).__dataclass_fields__


def _families(scene: Scene, symmetry: str) -> tuple[Family, ...]:
    tangential: tuple[int, ...] = ()
    if scene.coupled or friction_on(scene):
        tangential = (ALONG, ACROSS) if scene.slip_directions == 2 else (ALONG,)
    if symmetry != "quarter":
        mirror = {"plane_y": (1,)} if symmetry == "half" else {}
        return (Family((NORMAL, *tangential), mirror),)
    families = [Family((NORMAL,), {"plane_x": (0,), "plane_y": (1,)})]
    if tangential:
        # A load along x is odd about x = 0: the plane keeps u_x and holds u_y, u_z.
        families.append(Family(tangential, {"plane_x": (1, 2), "plane_y": (1,)}))
    return tuple(families)


def recipe_parameters(scene: Scene, symmetry: str) -> dict[str, Any]:
    """Parameters for the recipe, with patch and core sized from the load when "auto"."""
    parameters = mesh_parameters(scene, symmetry)
    if parameters.get("patch") == "auto":
        parameters["patch"] = auto_patch(scene)
    if parameters.get("core_depth") == "auto":
        parameters["core_depth"] = auto_core_depth(scene, float(parameters["patch"]))
    return parameters


def _largest_contact(scene: Scene, load: float | None = None) -> float:
    """Hertz's radius in mm of the largest load (or of ``load``)."""
    (m1, m2) = list(scene.materials.values())[:2]
    load = max(scene.loads.forces) if load is None else load
    return float(
        hertz_sphere(load, _sphere(scene), contact_modulus(m1.E, m1.nu, m2.E, m2.nu)).radius
    )


def _sphere(scene: Scene) -> float:
    if scene.sphere_radius is None:
        raise InputError(
            'geometry: "auto" sizes are known for a sphere on a plane only; recipe '
            f"{scene.recipe!r} needs lengths"
        )
    return scene.sphere_radius


def auto_core_depth(scene: Scene, patch: float) -> float:
    """Depth of the fine core relative to the patch: one contact radius, and deep enough for the
    sphere's curvature.
    """
    curvature = 2.0 * float(sphere_gap(patch / np.sqrt(2.0), _sphere(scene))) / patch
    return float(max(0.15, curvature, min(0.5, _largest_contact(scene) / patch)))


def auto_patch(scene: Scene, load: float | None = None) -> float:
    """Edge of the square patch in mm.

    2.6 times the Hertz radius of the largest load, so that the rim stays clear of the contact.
    """
    load = max(scene.loads.forces) if load is None else load
    if not load > 0.0:
        raise InputError(
            'geometry.patch: "auto" needs a positive normal load to size the patch; give '
            "the patch a length"
        )
    return 2.6 * _largest_contact(scene, load)


def wider_patch(scene: Scene, needed: float) -> str:
    """What to do where a contact needs a patch of so many mm."""
    if recipes.has_parameter(scene.recipe, "patch"):
        return f'set geometry.patch to "{needed:.3g} mm" or more, or to "auto"'
    return (
        f"mesh a contact surface of {needed:.3g} mm or more, with all its nodes in the sets "
        "'contact', or lower the load"
    )


def _effects(scene: Scene, symmetry: str, why_symmetry: str) -> tuple[Effect, ...]:
    mu, loads = scene.contact.friction, scene.loads
    friction = friction_on(scene)
    if friction:
        why_friction = (
            f"mu = {mu:g} and the outputs {', '.join(w for w in scene.want if w in FRICTION_WANTS)}"
        )
    elif scene.wants(*FRICTION_WANTS):
        why_friction = "mu = 0: no tangential force can be carried"
    else:
        why_friction = "no output asks for it"
    two = friction and scene.slip_directions == 2
    loaded = max(loads.forces) > 0.0
    out = [
        Effect(
            "unilateral contact", True, "the gap is curved: the contact set depends on the load"
        ),
        Effect("friction", friction, why_friction, applies=friction),
    ]
    if friction:
        out += [
            Effect(DIRECTIONS, True, TOGETHER if scene.coupled else "asked for")
            if two
            else omitted(
                DIRECTIONS,
                "the load has one direction",
                "contact.directions=2",
                applies=loaded and _slip_shows(scene),
            ),
            *coupling_effects(scene, loaded),
            Effect(
                "load history",
                scene.wants("cycle") or scene.coupled,
                "a full cycle is asked for"
                if scene.wants("cycle")
                else "first loading, marched in small steps"
                if scene.coupled
                else "first loading only",
                applies=scene.wants("cycle") or scene.coupled,
            ),
        ]
    elif mu > 0.0:
        out += coupling_effects(scene, loaded)[:1]
    curve, internal = scene.wants("curve"), _internal(scene)
    return (
        *out,
        Effect("mirror symmetry", symmetry != "full", why_symmetry, applies=symmetry != "full"),
        Effect(
            "load curve",
            curve,
            f"{loads.curve_points} points asked for" if curve else "single loads only",
            applies=curve,
        ),
        Effect("internal displacement", *internal, applies=internal[0]),
        Effect("inertia", False, "every output is static: M is not assembled", applies=False),
        omitted(LARGE, "the contact is small against the body", applies=loaded),
    )


def _slip_shows(scene: Scene) -> bool:
    """Whether a number of the run depends on the directions of slip."""
    shear = scene.wants("stiffness") and scene.sphere_radius is not None
    return (
        shear
        or scene.wants("cycle")
        or (scene.wants("tangential") and len(scene.loads.tangential) > 0)
    )


def _internal(scene: Scene) -> tuple[bool, str]:
    wanted = ("fields", "body_compression", "stiffness")
    users = [w for w in scene.want if w in wanted or (w == "tangential" and friction_on(scene))]
    if users:
        return True, "a back-substitution per load for " + ", ".join(users)
    return False, "no output asks for it: contact nodes only"
