"""Plan of a contact, curved or flat.

Normal loads, mirror planes, load families, effects omitted, sizes from Hertz's contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from upd.analyses.base import Effect
from upd.analyses.contact.effects import (
    DIRECTIONS,
    LARGE,
    TILT,
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
    component,
    contact_plan,
    is_curved,
    mesh_parameters,
    two_bodies,
    with_companion,
)
from upd.contact.equilibrium import FaceForces, equilibrium
from upd.errors import InputError
from upd.mesh import recipes
from upd.reference import contact_modulus, hertz_sphere, sphere_gap
from upd.results import Case
from upd.scene import FRICTION_WANTS, Scene, friction_on


@dataclass(frozen=True)
class DamperLoad:
    """A normal force in N, and the damper's equilibrium it comes from, if any."""

    force: float
    state: str = ""
    faces: FaceForces | None = None

    @property
    def case(self) -> Case:
        """The force, with as many digits as distinguish the scene's loads."""
        return Case(load=self.force)


def normal_loads(scene: Scene) -> tuple[DamperLoad, ...]:
    """The scene's normal loads in N. Raises InputError, with all problems, for an equilibrium that
    jams or lifts.
    """
    loads, problems = [], []
    for value in dict.fromkeys(scene.loads.normal):
        if not isinstance(value, str):
            loads.append(DamperLoad(float(value)))
            continue
        try:
            parameters = mesh_parameters(scene, "full")
            left, right = recipes.inclination(scene.recipe, parameters)
            assert scene.loads.centrifugal is not None
            found = equilibrium(left, right, scene.loads.centrifugal, scene.contact.friction, value)
            loads.append(DamperLoad(found.normal_right, value, found))
        except InputError as error:
            problems.append(f"loads.normal: {value!r}: {error}")
    if problems:
        raise InputError("\n".join(problems))
    # Without friction all equilibria are one.
    different: dict[str, DamperLoad] = {}
    for load in loads:
        different.setdefault(load.case.label, load)
    return tuple(different.values())


def make_plan(scene: Scene) -> ContactPlan:
    """Derive the plan of ``scene``, without the cost of what its errors are estimated with.

    Raises InputError when its parts do not fit together.
    """
    two_bodies(scene)
    loaded = any(load.force > 0.0 for load in normal_loads(scene))
    if not is_curved(scene):
        _require_fitting(scene)
    symmetry, why = _symmetry(scene)
    plan = contact_plan(
        scene,
        symmetry,
        _families(scene, symmetry),
        _effects(scene, symmetry, why, loaded),
        recipe_parameters(scene, symmetry),
    )
    return with_companion(plan, _companion_parameters(scene))


def _require_fitting(scene: Scene) -> None:
    """Raise InputError for what a flat contact does not take."""
    problems = []
    if scene.mesh.symmetry == "quarter":
        problems.append(
            'mesh.symmetry: a damper\'s face has one mirror plane; use "half", "full" or "auto"'
        )
    axes = {component(d) for d in scene.loads.directions}
    if scene.wants("contact_law") and friction_on(scene) and not {ALONG, ACROSS} <= axes:
        problems.append(
            'loads.directions: contact_law needs the stiffness along both axes; give ["x", "y"]'
        )
    oblique = [d for d in scene.loads.directions if component(d) is None]
    if oblique and friction_on(scene) and scene.slip_directions == 1:
        problems.append(
            f"loads.directions: {oblique[0]:g} deg lies between the axes and slips in two "
            "directions: set contact.directions = 2"
        )
    if problems:
        raise InputError("\n".join(problems))


def has_mirror_planes(scene: Scene) -> bool:
    """Whether the recipe makes bodies that are their own mirror images: about x = 0, and of a
    curved contact about y = 0 too.
    """
    return "symmetry" in recipes.parameters(scene.recipe).__dataclass_fields__


def _symmetry(scene: Scene) -> tuple[str, str]:
    asked, reasons = scene.mesh.symmetry, []
    if not has_mirror_planes(scene):
        reasons.append("the geometry has no mirror plane")
    if scene.coupled:
        reasons.append("normal and tangential contact at once are solved on the full model")
    elif friction_on(scene) and scene.slip_directions == 2:
        reasons.append("slip in two directions is solved on the full model")
    if scene.contact.tilt == "free":
        reasons.append("the damper may tilt about both axes")
    if scene.geometry.get("pad_offset", 0.0) != 0.0:
        reasons.append("the pads have unequal heights")
    if asked not in ("auto", "full") and reasons:
        raise InputError(f'mesh.symmetry: {"; ".join(reasons)}; use "full" or "auto"')
    if asked != "auto":
        return asked, "asked for in the scene"
    if reasons:
        return "full", "; ".join(reasons)
    if is_curved(scene):
        return "quarter", "geometry, load and effects share both mirror planes"
    return "half", "geometry and loads share the mirror plane x = 0"


def _families(scene: Scene, symmetry: str) -> tuple[Family, ...]:
    curved, shear = is_curved(scene), set[int]()
    if scene.coupled or (friction_on(scene) and scene.slip_directions == 2):
        shear = {ALONG, ACROSS}
    elif friction_on(scene):
        directions = (0.0,) if curved else scene.loads.directions
        shear = {c for d in directions if (c := component(d)) is not None}
    if symmetry == "full" or (curved and symmetry == "half"):
        mirror = {"plane_y": (1,)} if symmetry == "half" else {}
        return (Family((NORMAL, *sorted(shear)), mirror),)
    # Loads along y and z are even about x = 0 (the plane holds u_x), a load along x is odd (it
    # keeps u_x alone).
    beside = {"plane_y": (1,)} if symmetry == "quarter" else {}
    even = (NORMAL, ACROSS) if ACROSS in shear else (NORMAL,)
    families = [Family(even, {"plane_x": (0,), **beside})]
    if ALONG in shear:
        families.append(Family((ALONG,), {"plane_x": (1, 2), **beside}))
    return tuple(families)


def recipe_parameters(scene: Scene, symmetry: str) -> dict[str, Any]:
    """Parameters for the recipe, with patch and core sized from the load when "auto"."""
    parameters = mesh_parameters(scene, symmetry)
    if parameters.get("patch") == "auto":
        parameters["patch"] = auto_patch(scene)
    if parameters.get("core_depth") == "auto":
        parameters["core_depth"] = auto_core_depth(scene, float(parameters["patch"]))
    return parameters


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


def _effects(scene: Scene, symmetry: str, why_symmetry: str, loaded: bool) -> list[Effect]:
    curved = is_curved(scene)
    out = [
        Effect(
            "unilateral contact",
            True,
            "the gap is curved: the contact set depends on the load"
            if curved
            else "edges may lift off; one linear solve when none does",
        )
    ]
    if not curved:
        out.append(
            Effect(TILT, True, "no moment about the load line")
            if scene.contact.tilt == "free"
            else omitted(
                TILT, "its distant set only translates", "contact.tilt=free", applies=loaded
            )
        )
    out += _friction_effects(scene, loaded)
    curve, users = scene.wants("curve"), _inside(scene)
    small = (
        "the contact is small against the body"
        if curved
        else "the approach is small against the patch"
    )
    return [
        *out,
        Effect("mirror symmetry", symmetry != "full", why_symmetry, applies=symmetry != "full"),
        Effect(
            "load curve",
            curve,
            f"{scene.loads.curve_points} points asked for" if curve else "single loads only",
            applies=curve,
        ),
        Effect(
            "internal displacement",
            bool(users),
            "a back-substitution per load for " + ", ".join(users)
            if users
            else "no output asks for it: contact nodes only",
            applies=bool(users),
        ),
        Effect("inertia", False, "every output is static: M is not assembled", applies=False),
        omitted(LARGE, small, applies=loaded),
    ]


def _friction_effects(scene: Scene, loaded: bool) -> list[Effect]:
    curved, friction, mu = is_curved(scene), friction_on(scene), scene.contact.friction
    if friction:
        outputs = ", ".join(w for w in scene.want if w in FRICTION_WANTS)
        why = f"mu = {mu:g} and the outputs {outputs}"
    elif scene.wants(*FRICTION_WANTS):
        why = "mu = 0: no tangential force can be carried"
    else:
        why = "no output asks for it"
    out = [Effect("friction", friction, why, applies=friction)]
    if not friction:
        return [*out, *(coupling_effects(scene, loaded)[:1] if mu > 0.0 else ())]
    cycle = scene.wants("cycle")
    stepped = cycle or scene.coupled or not curved
    return [
        *out,
        Effect(DIRECTIONS, True, TOGETHER if scene.coupled else "asked for")
        if scene.slip_directions == 2
        else omitted(
            DIRECTIONS,
            "the load has one direction" if curved else "loads run along the axes",
            "contact.directions=2",
            applies=loaded and (not curved or _slip_shows(scene)),
        ),
        *coupling_effects(scene, loaded),
        Effect(
            "load history",
            stepped,
            "a full cycle is asked for"
            if cycle
            else "first loading, in small steps"
            if stepped
            else "first loading only",
            applies=stepped,
        ),
    ]


def _slip_shows(scene: Scene) -> bool:
    """Whether a number of the run depends on the directions of slip."""
    shear = scene.wants("stiffness") and scene.sphere_radius is not None
    return (
        shear
        or scene.wants("cycle")
        or (scene.wants("tangential") and len(scene.loads.tangential) > 0)
    )


def _inside(scene: Scene) -> list[str]:
    """Outputs that ask for displacements inside the bodies."""
    if not is_curved(scene):
        return [w for w in scene.want if w == "fields"]
    wanted = ("fields", "body_compression", "stiffness")
    return [w for w in scene.want if w in wanted or (w == "tangential" and friction_on(scene))]
