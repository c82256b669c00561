"""Plan of a flat contact.

Normal forces from the damper's equilibrium, the mirror plane, load families, what is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

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
    mesh_parameters,
    two_bodies,
    with_companion,
)
from upd.contact.equilibrium import FaceForces, equilibrium
from upd.errors import InputError
from upd.mesh import recipes
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
        """The force, with as many digits as the scene tells loads apart by."""
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
    _fitting(scene)
    symmetry, why = _symmetry(scene)
    plan = contact_plan(
        scene,
        symmetry,
        _families(scene, symmetry),
        _effects(scene, symmetry, why, loaded),
        mesh_parameters(scene, symmetry),
    )
    return with_companion(plan, mesh_parameters(scene, "full"))


def _fitting(scene: Scene) -> None:
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


def _symmetry(scene: Scene) -> tuple[str, str]:
    asked = scene.mesh.symmetry
    reasons = []
    if scene.coupled:
        reasons.append("normal and tangential contact at once are solved on the full model")
    elif friction_on(scene) and scene.slip_directions == 2:
        reasons.append("slip in two directions is solved on the full model")
    if scene.contact.tilt == "free":
        reasons.append("the damper may tilt about both axes")
    if "symmetry" not in recipes.parameters(scene.recipe).__dataclass_fields__:
        reasons.append("the geometry has no mirror plane")
    if scene.geometry.get("pad_offset", 0.0) != 0.0:
        reasons.append("the pads stand at unequal heights")
    if asked == "half" and reasons:
        raise InputError(f'mesh.symmetry: {"; ".join(reasons)}; use "full" or "auto"')
    if asked != "auto":
        return asked, "asked for in the scene"
    return (
        ("full", "; ".join(reasons))
        if reasons
        else ("half", "geometry and loads share the mirror plane x = 0")
    )


def _families(scene: Scene, symmetry: str) -> tuple[Family, ...]:
    shear: set[int] = {ALONG, ACROSS} if scene.coupled else set()
    if friction_on(scene):
        shear = (
            {ALONG, ACROSS}
            if scene.slip_directions == 2
            else {c for d in scene.loads.directions if (c := component(d)) is not None}
        )
    if symmetry == "full":
        return (Family((NORMAL, *sorted(shear))),)
    # Loads along y and z are even about x = 0 (the plane holds u_x), a load along x is odd (it
    # keeps u_x alone).
    families = [Family((NORMAL, ACROSS) if ACROSS in shear else (NORMAL,), {"plane_x": (0,)})]
    if ALONG in shear:
        families.append(Family((ALONG,), {"plane_x": (1, 2)}))
    return tuple(families)


def _effects(scene: Scene, symmetry: str, why_symmetry: str, loaded: bool) -> list[Effect]:
    mu, friction = scene.contact.friction, friction_on(scene)
    if friction:
        why = (
            f"mu = {mu:g} and the outputs {', '.join(w for w in scene.want if w in FRICTION_WANTS)}"
        )
    else:
        why = (
            "mu = 0: no tangential force can be carried"
            if scene.wants(*FRICTION_WANTS)
            else "no output asks for it"
        )
    out = [
        Effect("unilateral contact", True, "edges may lift off; one linear solve when none does"),
        Effect(TILT, True, "no moment about the load line")
        if scene.contact.tilt == "free"
        else omitted(TILT, "its distant set only translates", "contact.tilt=free", applies=loaded),
        Effect("friction", friction, why, applies=friction),
    ]
    if friction:
        two, cycle = scene.slip_directions == 2, scene.wants("cycle")
        out += [
            Effect(DIRECTIONS, True, TOGETHER if scene.coupled else "asked for")
            if two
            else omitted(
                DIRECTIONS, "loads run along the axes", "contact.directions=2", applies=loaded
            ),
            *coupling_effects(scene, loaded),
            Effect(
                "load history",
                True,
                "a full cycle is asked for" if cycle else "first loading, marched in small steps",
            ),
        ]
    elif mu > 0.0:
        out += coupling_effects(scene, loaded)[:1]
    curve = scene.wants("curve")
    users = ["fields"] if scene.wants("fields") else []
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
            "for " + ", ".join(users) if users else "contact nodes only",
            applies=bool(users),
        ),
        Effect("inertia", False, "every output is static: M is not assembled", applies=False),
        omitted(LARGE, "the approach is small against the patch", applies=loaded),
    ]
