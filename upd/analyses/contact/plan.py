"""What a plan of a contact of two bodies holds: normal loads, mirror planes and load families,
effects simulated and omitted, what the recipe is given, and what its meshes must name.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Effect, Plan
from upd.analyses.cost import NODES
from upd.contact.rigid_damper import FaceForces, equilibrium
from upd.errors import InputError, OwnMeshError
from upd.mesh import Mesh, recipes
from upd.mesh.checks import require_sets
from upd.mesh.recipe_modules import is_mesh
from upd.reference import contact_modulus, dundurs_beta, hertz_sphere, sphere_gap
from upd.results import Case
from upd.scene import FRICTION_WANTS, Scene, friction_on

Array = NDArray[np.float64]

NORMAL, ALONG, ACROSS = 2, 0, 1
#: all three, in the order of a coupled contact
COMPONENTS = (NORMAL, ALONG, ACROSS)

TILT, DIRECTIONS, COUPLING = (
    "tilt of the damper",
    "slip in two directions",
    "normal-tangential coupling",
)
#: why coupled contact slips in two directions
_TOGETHER = "pressure and shear are solved at once"
#: What to do about an effect that changes a number too much.
REMEDIES = {
    TILT: 'set contact.tilt = "free" (with a contact.load_point inside the contact), or choose '
    "another contact.distant set",
    DIRECTIONS: "set contact.directions = 2",
    COUPLING: 'set contact.coupling = "coupled", or trust the number to this change only',
}


@dataclass(frozen=True)
class Family:
    """Load cases that share supports, hence one condensation per body.

    Attributes
    ----------
    components
        Kept at the contact nodes and tied at the distant set (0 along the load, 1 across, 2
        normal).
    mirror
        Node set on a mirror plane -> components it holds.
    """

    components: tuple[int, ...]
    mirror: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Its components in words."""
        return " + ".join(
            {NORMAL: "normal", ALONG: "tangential x", ACROSS: "tangential y"}[c]
            for c in self.components
        )


@dataclass(frozen=True)
class ContactPlan(Plan[Scene]):
    """Plan of a contact of two bodies.

    Attributes
    ----------
    families
        Its load families.
    companion
        A coarser whole model with all directions at once, on which numbers are solved again with
        effects left out.
    """

    families: tuple[Family, ...] = ()
    companion: ContactPlan | None = None

    @property
    def mirrors(self) -> tuple[int, ...]:
        """Coordinates whose zero is a mirror plane of the model, from the node sets its load
        families hold.
        """
        return tuple(
            sorted({"xyz".index(name[-1]) for family in self.families for name in family.mirror})
        )

    @property
    def shown(self) -> tuple[str, ...]:
        """Effects left out whose change of a number the run shows."""
        return tuple(e.check for e in self.effects if e.check and self.scene.left_out.solves)


def is_curved(scene: Scene) -> bool:
    """Whether the faces are curved: their contact set depends on the load."""
    return scene.analysis == "curved contact"


# -- directions of a tangential load, degrees from x -----------------------------------------------


def component(direction: float) -> int | None:
    """The component a tangential load runs along, or None for one between the axes."""
    return {0.0: ALONG, 90.0: ACROSS}.get(direction % 180.0)


def slip_components(scene: Scene, direction: float) -> tuple[int, ...]:
    """Components of a tangential load in a direction."""
    own = component(direction)
    return (ALONG, ACROSS) if scene.slip_directions == 2 or own is None else (own,)


def direction_name(direction: float) -> str:
    """x, y or the angle."""
    return {0.0: "x", 90.0: "y"}.get(direction % 360.0, f"{direction:g}deg")


def normal_loads(scene: Scene) -> dict[float, tuple[str, FaceForces] | None]:
    """The scene's normal loads in N, each with the damper's state and equilibrium it comes from, if
    any. Raises InputError, with all problems, for an equilibrium that jams or lifts.
    """
    loads: dict[float, tuple[str, FaceForces] | None] = {}
    problems = []
    for value in dict.fromkeys(scene.loads.normal):
        if not isinstance(value, str):
            loads.setdefault(float(value), None)
            continue
        try:
            left, right = recipes.inclination(scene.recipe, mesh_parameters(scene, "full"))
            assert scene.loads.centrifugal is not None
            found = equilibrium(left, right, scene.loads.centrifugal, scene.contact.friction, value)
            loads.setdefault(found.normal_right, (value, found))
        except InputError as error:
            problems.append(f"loads.normal: {value!r}: {error}")
    if problems:
        raise InputError("\n".join(problems))
    # Without friction all equilibria are one.
    different: dict[str, float] = {}
    for force in loads:
        different.setdefault(Case(load=force).label, force)
    return {force: loads[force] for force in different.values()}


def choose_symmetry(scene: Scene) -> tuple[str, str]:
    """Part of the model that is solved, and why. Raises InputError for one that does not serve."""
    asked, two = scene.mesh.symmetry, friction_on(scene) and scene.slip_directions == 2
    hindered = {
        "the geometry has no mirror plane": not recipes.has_parameter(scene.recipe, "symmetry"),
        "normal and tangential contact at once are solved on the full model": scene.coupled,
        "slip in two directions is solved on the full model": two and not scene.coupled,
        "the damper may tilt about both axes": scene.contact.tilt == "free",
        "the pads have unequal heights": scene.geometry.get("pad_offset", 0.0) != 0.0,
    }
    reasons = "; ".join(why for why, applies in hindered.items() if applies)
    if asked not in ("auto", "full") and reasons:
        raise InputError(f'mesh.symmetry: {reasons}; use "full" or "auto"')
    if asked != "auto":
        return asked, "asked for in the scene"
    if reasons:
        return "full", reasons
    if is_curved(scene):
        return "quarter", "geometry, load and effects share both mirror planes"
    return "half", "geometry and loads share the mirror plane x = 0"


def make_families(scene: Scene, symmetry: str) -> tuple[Family, ...]:
    """Load cases of the scene, by the supports they share."""
    curved, shear = is_curved(scene), set[int]()
    if scene.coupled or friction_on(scene):
        shear = {c for d in scene.loads.directions for c in slip_components(scene, d)}
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


# -- effects ---------------------------------------------------------------------------------------


def _switched(name: str, on: bool, why: str, switch: str, shows: bool) -> Effect:
    """An effect that a key of the scene switches on; left out, its check ``shows`` something, or it
    does not apply.
    """
    check = name if shows and not on else ""
    return Effect(name, on, why, check, () if on else (switch,), on or shows)


def make_effects(scene: Scene, symmetry: str, why: str, loaded: bool) -> tuple[Effect, ...]:
    """Effects simulated and omitted.

    Parameters
    ----------
    why
        Of the symmetry.
    loaded
        Whether any normal load presses the bodies.
    """
    either, inside = Effect.either, ", ".join(_inside(scene))
    if is_curved(scene):
        tilts = []
        gap = "the gap is curved: the contact set depends on the load"
        small = "the contact is small against the body"
    else:
        free = scene.contact.tilt == "free"
        tilt = "no moment about the load line" if free else "its distant set only translates"
        tilts = [_switched(TILT, free, tilt, "contact.tilt=free", loaded)]
        gap = "edges may lift off; one linear solve when none does"
        small = "the approach is small against the patch"
    displaced = f"a back-substitution per load for {inside}"
    return (
        Effect("unilateral contact", True, gap),
        *tilts,
        *_friction_effects(scene, loaded),
        either("mirror symmetry", symmetry != "full", why, why),
        either(
            "internal displacement",
            bool(inside),
            displaced,
            "no output asks for it: contact nodes only",
        ),
        either("inertia", False, "", "every output is static: M is not assembled"),
        either("large displacement", False, "", small),
    )


def _friction_effects(scene: Scene, loaded: bool) -> list[Effect]:
    curved, mu = is_curved(scene), scene.contact.friction
    coupling = _coupling_effect(scene, loaded)
    if not friction_on(scene):
        asked = scene.wants(*FRICTION_WANTS)
        why = "mu = 0: no tangential force can be carried" if asked else "no output asks for it"
        return [Effect.either("friction", False, "", why), *[coupling] * (mu > 0.0)]
    outputs = ", ".join(w for w in scene.want if w in FRICTION_WANTS)
    two, why = scene.slip_directions == 2, _TOGETHER if scene.coupled else "asked for"
    if not two:
        why = "the load has one direction" if curved else "loads run along the axes"
    # a number of a curved contact that depends on the directions of slip
    depends = (
        (scene.wants("stiffness") and scene.sphere_radius is not None)
        or (scene.wants("tangential") and len(scene.loads.tangential) > 0)
        or scene.wants("cycle")
    )
    shows = loaded and (not curved or depends)
    return [
        Effect("friction", True, f"mu = {mu:g} and the outputs {outputs}"),
        _switched(DIRECTIONS, two, why, "contact.directions=2", shows),
        coupling,
    ]


def _coupling_effect(scene: Scene, loaded: bool) -> Effect:
    """Normal-tangential coupling; unlike materials are coupled by their pressure alone."""
    beta, limit, coupled = beta_of(scene), scene.contact.coupling_limit, scene.coupled
    frozen = "normal forces stay frozen under shear: exact for half-spaces of like materials alone"
    if scene.contact.friction > 0.0 and beta > limit:
        frozen += (
            f"; |beta| = {beta:.3g} is above contact.coupling_limit = {limit:.3g}: set "
            "contact.coupling = coupled"
        )
    how = "asked for" if coupled else frozen
    return _switched(COUPLING, coupled, how, "contact.coupling=coupled", loaded)


def _inside(scene: Scene) -> list[str]:
    """Outputs that ask for displacements inside the bodies."""
    if not is_curved(scene):
        return [w for w in scene.want if w == "fields"]
    wanted = ("fields", "body_compression", "stiffness")
    return [w for w in scene.want if w in wanted or (w == "tangential" and friction_on(scene))]


def beta_of(scene: Scene) -> float:
    """Size of Dundurs' beta of the scene's two materials: how far pressure shears the contact."""
    first, second = list(scene.materials.values())[:2]
    return abs(float(dundurs_beta(first.E, first.nu, second.E, second.nu)))


def largest_ratio(scene: Scene) -> float:
    """Largest T / (mu N) of the tangential loads asked for; zero without any."""
    return max(scene.loads.tangential, default=0.0) if scene.wants("tangential") else 0.0


# -- what the recipe is given ----------------------------------------------------------------------


def mesh_parameters(scene: Scene, symmetry: str) -> dict[str, Any]:
    """Parameters for the recipe: those of the scene, the symmetry and the nodes per element."""
    parameters = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    own = {"symmetry": symmetry, "element_nodes": NODES[scene.mesh.element]}
    return parameters | {k: v for k, v in own.items() if recipes.has_parameter(scene.recipe, k)}


def recipe_parameters(scene: Scene, symmetry: str) -> dict[str, Any]:
    """Parameters for the recipe, with patch and core sized from the load when "auto"."""
    parameters = mesh_parameters(scene, symmetry)
    if parameters.get("patch") == "auto":
        parameters["patch"] = auto_patch(scene)
    if parameters.get("core_depth") == "auto":
        parameters["core_depth"] = auto_core_depth(scene, float(parameters["patch"]))
    return parameters


def hertz_radius(scene: Scene, load: float) -> float:
    """Hertz's radius in mm of a sphere under the load in N."""
    if scene.sphere_radius is None:
        raise InputError(
            'geometry: "auto" sizes are known for a sphere on a plane only; recipe '
            f"{scene.recipe!r} needs lengths"
        )
    m1, m2 = list(scene.materials.values())[:2]
    E = contact_modulus(m1.E, m1.nu, m2.E, m2.nu)
    return float(hertz_sphere(load, scene.sphere_radius, E).radius)


def auto_core_depth(scene: Scene, patch: float) -> float:
    """Depth of the fine core relative to the patch: one contact radius, and deep enough for the
    sphere's curvature.
    """
    radius = hertz_radius(scene, max(scene.loads.forces))
    assert scene.sphere_radius is not None
    # the recipe refuses a patch beyond the sphere
    corner = min(patch / np.sqrt(2.0), scene.sphere_radius)
    curvature = 2.0 * float(sphere_gap(corner, scene.sphere_radius)) / patch
    return float(max(0.15, curvature, min(0.5, radius / patch)))


def auto_patch(scene: Scene) -> float:
    """Edge of the square patch in mm.

    2.6 times the Hertz radius of the largest load, so that the rim stays clear of the contact.
    """
    load = max(scene.loads.forces)
    if not load > 0.0:
        raise InputError(
            'geometry.patch: "auto" needs a positive normal load to size the patch; give '
            "the patch a length"
        )
    return 2.6 * hertz_radius(scene, load)


def wider_patch(scene: Scene, needed: float) -> str:
    """What to do where a contact needs a patch of so many mm."""
    if recipes.has_parameter(scene.recipe, "patch"):
        return f'set geometry.patch to "{needed:.3g} mm" or more, or to "auto"'
    return (
        f"mesh a contact surface of {needed:.3g} mm or more, with all its nodes in the sets "
        "'contact', or lower the load"
    )


def refined_growth(growth: float, ratio: float) -> float:
    """Growth of a mesh whose spacing is ``ratio`` times that of a mesh with ``growth``, so that the
    far mesh is refined with the patch.

    Sizes grow by the same factor over 1 / ratio as many elements; within what the recipes accept.
    """
    return float(min(1.9, max(1.06, growth**ratio)))


# -- what the meshes must name ---------------------------------------------------------------------


def require_held(scene: Scene, parameters: Mapping[str, Any], bodies: Iterable[str]) -> None:
    """Raise InputError for a body or a node set of contact.distant that is not there."""
    chosen, problems = scene.contact.distant, []
    known = recipes.distant_sets(scene.recipe, parameters) if chosen else {}
    for body, name in chosen.items():
        if body not in set(bodies):
            problem = f"no such body; the recipe makes {', '.join(bodies)}"
        elif name not in known.get(body, ()):
            there = ", ".join(known.get(body, ()))
            advice = f"known: {there}" if there else "it has one distant set: leave the line out"
            problem = f"the mesh has no set {name!r}; {advice}"
        else:
            continue
        problems.append(f"contact.distant.{body}: {problem}")
    if problems:
        raise InputError("\n".join(problems))


def require_contact_sets(
    scene: Scene, meshes: Mapping[str, Mesh], families: tuple[Family, ...]
) -> None:
    """Raise OwnMeshError unless the bodies name their contact, what is held, and the mirror planes
    of the loads, and have as many patches as their analysis knows.
    """
    planes = sorted({plane for family in families for plane in family.mirror})
    chosen = scene.contact.distant
    require_sets(scene.recipe, meshes, ("contact", *planes), ("contact",))
    usual = {name: mesh for name, mesh in meshes.items() if name not in chosen}
    require_sets(scene.recipe, usual, ("distant",))
    problems: dict[str, list[str]] = {}
    for name, mesh in meshes.items():
        if name in chosen:
            require_sets(scene.recipe, {name: mesh}, (f"distant_{chosen[name]}",))
        if problem := _patch_problem(scene, mesh):
            problems.setdefault(problem, []).append(name)
    if problems:
        lines = [f"  {', '.join(bodies)}: {problem}" for problem, bodies in problems.items()]
        raise OwnMeshError("\n".join([f"recipe {scene.recipe!r}: patches of the contact", *lines]))


def _patch_problem(scene: Scene, mesh: Mesh) -> str:
    """What is wrong with the node sets contact_..., which are patches of their own, or ""."""
    patches = [name for name in mesh.nodes if name.startswith("contact_")]
    if is_curved(scene) and len(patches) > 1:
        flat = (
            "bring the contact nodes of both bodies into one plane, which makes the contact of a "
            "mesh file flat"
            if is_mesh(scene.recipe)
            else 'write ANALYSIS = "flat contact" into the recipe'
        )
        return (
            f"the node sets {', '.join(patches)} are {len(patches)} patches, a curved contact has "
            f"one; to fix it: {flat} when the faces are flat, or name the set 'contact' alone"
        )
    named = np.concatenate([mesh.nodes[name] for name in patches]) if patches else np.zeros(0, int)
    if patches and not np.array_equal(np.sort(named), np.sort(mesh.nodes["contact"])):
        twice = len(named) - len(np.unique(named))
        missing = len(np.setdiff1d(mesh.nodes["contact"], named))
        strange = len(np.setdiff1d(named, mesh.nodes["contact"]))
        return (
            f"the patches {', '.join(patches)} name {twice} nodes twice, {missing} nodes of "
            f"'contact' not at all, and {strange} that are none of its; to fix it: give every "
            "contact node to one patch"
        )
    return ""
