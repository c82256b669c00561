"""Plan of a contact of two bodies, curved or flat: normal loads, mirror planes and load families,
effects simulated and omitted, what the recipe is given and its meshes must name, size and cost.

With it the coarser whole model on which numbers are solved again with effects left out.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Effect, Plan
from upd.analyses.cost import NODES, START_BYTES, CostModel, dense_s, memory_limit
from upd.contact.rigid_damper import FaceForces, equilibrium
from upd.errors import InputError, OwnMeshError, UpdError
from upd.linalg.select import EACH, FIRST
from upd.mesh import Mesh, recipes
from upd.mesh.checks import require_sets
from upd.reference import contact_modulus, hertz_sphere, sphere_gap
from upd.results import Case
from upd.scene import FRICTION_WANTS, Scene, friction_on
from upd.vary.solve import changed
from upd.vary.variation import ALONE

Array = NDArray[np.float64]

NORMAL, ALONG, ACROSS = 2, 0, 1
#: all three, in the order of a coupled contact
COMPONENTS = (NORMAL, ALONG, ACROSS)

TILT, DIRECTIONS, COUPLING = (
    "tilt of the damper",
    "slip in two directions",
    "normal-tangential coupling",
)
#: What to do about an effect that changes a number too much.
REMEDIES = {
    TILT: 'set contact.tilt = "free"; where the load line runs beside the contact, the damper '
    "then tips over: give a contact.load_point inside it, or choose another contact.distant set",
    DIRECTIONS: "set contact.directions = 2",
    COUPLING: 'set contact.coupling = "coupled", or trust the number to this change only',
}


#: Load cases that share supports, hence one condensation per body: components kept at the contact
#: nodes and tied at the distant set (0 along the load, 1 across, 2 normal) -> node set on a mirror
#: plane -> components it holds.
Families = Mapping[tuple[int, ...], Mapping[str, tuple[int, ...]]]


def family_label(components: Iterable[int]) -> str:
    """The components of a family of loads in words."""
    words = {NORMAL: "normal", ALONG: "tangential x", ACROSS: "tangential y"}
    return " + ".join(words[c] for c in components)


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

    families: Families = field(default_factory=dict)
    companion: ContactPlan | None = None

    @property
    def mirrors(self) -> tuple[int, ...]:
        """Coordinates whose zero is a mirror plane of the model, from the node sets its load
        families hold.
        """
        planes = {plane for mirror in self.families.values() for plane in mirror}
        return tuple(sorted("xyz".index(plane[-1]) for plane in planes))

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
        "a damper's face has one mirror plane": asked == "quarter" and not is_curved(scene),
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


def make_families(scene: Scene, symmetry: str) -> Families:
    """Load cases of the scene, by the supports they share."""
    curved, shear = is_curved(scene), set[int]()
    if scene.coupled or friction_on(scene):
        shear = {c for d in scene.loads.directions for c in slip_components(scene, d)}
    if symmetry == "full" or (curved and symmetry == "half"):
        mirror = {"plane_y": (1,)} if symmetry == "half" else {}
        return {(NORMAL, *sorted(shear)): mirror}
    # Loads along y and z are even about x = 0 (the plane holds u_x), a load along x is odd (it
    # keeps u_x alone).
    beside = {"plane_y": (1,)} if symmetry == "quarter" else {}
    even = (NORMAL, ACROSS) if ACROSS in shear else (NORMAL,)
    odd: Families = {(ALONG,): {"plane_x": (1, 2), **beside}} if ALONG in shear else {}
    return {even: {"plane_x": (0,), **beside}, **odd}


# -- effects ---------------------------------------------------------------------------------------

_FROZEN = "normal forces stay frozen under shear: exact for half-spaces of like materials alone"


def make_effects(scene: Scene, symmetry: str, why: str, loaded: bool) -> tuple[Effect, ...]:
    """Effects simulated and omitted.

    Parameters
    ----------
    why
        Of the symmetry.
    loaded
        Whether any normal load presses the bodies: an effect left out then changes a number.
    """
    contact, either, two = scene.contact, Effect.either, scene.slip_directions == 2
    inside = ", ".join(_inside(scene))

    def switched(name: str, on: bool, why: str, switch: str) -> Effect:
        """An effect that a key of the scene switches on."""
        check = name if loaded and not on else ""
        return Effect(name, on, why, check, () if on else (switch,), on or loaded)

    effects = [Effect("unilateral contact", True, "the contact set depends on the load")]
    if not is_curved(scene):
        free = contact.tilt == "free"
        tilt = "no moment about the load line" if free else "its distant set only translates"
        effects.append(switched(TILT, free, tilt, "contact.tilt=free"))
    if friction_on(scene):
        outputs = ", ".join(w for w in scene.want if w in FRICTION_WANTS)
        slip = "asked for, or with the coupling" if two else "each load has one direction"
        effects += [
            Effect("friction", True, f"mu = {contact.friction:g} and the outputs {outputs}"),
            switched(DIRECTIONS, two, slip, "contact.directions=2"),
        ]
    else:
        asked = scene.wants(*FRICTION_WANTS)
        none = "mu = 0: no tangential force can be carried" if asked else "no output asks for it"
        effects.append(either("friction", False, "", none))
    if contact.friction > 0.0:
        how = "asked for" if scene.coupled else _FROZEN
        effects.append(switched(COUPLING, scene.coupled, how, "contact.coupling=coupled"))
    displaced = f"a back-substitution per load for {inside}"
    unasked = "no output asks for it: contact nodes only"
    return (
        *effects,
        either("mirror symmetry", symmetry != "full", why, why),
        either("internal displacement", bool(inside), displaced, unasked),
        either("inertia", False, "", "every output is static: M is not assembled"),
        either("large displacement", False, "", "the approach is small against the bodies"),
    )


def _inside(scene: Scene) -> list[str]:
    """Outputs that ask for displacements inside the bodies."""
    if not is_curved(scene):
        return [w for w in scene.want if w == "fields"]
    wanted = ("fields", "body_compression", "stiffness")
    return [w for w in scene.want if w in wanted or (w == "tangential" and friction_on(scene))]


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
            'geometry: "auto", and an accuracy, size the mesh of a sphere on a plane only; recipe '
            f"{scene.recipe!r} needs lengths and divisions"
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
            'geometry.patch: "auto", or an accuracy, needs a positive normal load to size the '
            "patch; give the patch a length"
        )
    return 2.6 * hertz_radius(scene, load)


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
    known = recipes.sets_of(scene.recipe, parameters, "DISTANT") if chosen else {}
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


def require_contact_sets(scene: Scene, meshes: Mapping[str, Mesh], families: Families) -> None:
    """Raise OwnMeshError unless the bodies name their contact, what is held, and the mirror planes
    of the loads, and have as many patches as their analysis knows.
    """
    planes = sorted({plane for mirror in families.values() for plane in mirror})
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
        return (
            f"the node sets {', '.join(patches)} are {len(patches)} patches, a curved contact has "
            'one; to fix it: write ANALYSIS = "flat contact" into the recipe, or bring the contact '
            "nodes of a mesh file into one plane, when the faces are flat; or name the set "
            "'contact' alone"
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


# -- the plan, its size and cost -------------------------------------------------------------------


def make_plan(scene: Scene) -> ContactPlan:
    """Derive the plan of ``scene``, without the cost of what its errors are estimated with.

    Raises InputError when its parts do not fit together.
    """
    if len(scene.materials) != 2:
        raise InputError(
            f"materials: a contact has two bodies, {len(scene.materials)} given "
            f"({', '.join(scene.materials)})"
        )
    loaded, problems = any(load > 0.0 for load in normal_loads(scene)), []
    flat_friction = friction_on(scene) and not is_curved(scene)
    axes = {component(d) for d in scene.loads.directions}
    if scene.wants("contact_law") and flat_friction and not {ALONG, ACROSS} <= axes:
        problems.append(
            'loads.directions: contact_law needs the stiffness along both axes; give ["x", "y"]'
        )
    oblique = [d for d in scene.loads.directions if component(d) is None]
    if oblique and flat_friction and scene.slip_directions == 1:
        problems.append(
            f"loads.directions: {oblique[0]:g} deg lies between the axes and slips in two "
            "directions: set contact.directions = 2"
        )
    if problems:
        raise InputError("\n".join(problems))
    symmetry, why = choose_symmetry(scene)
    families = make_families(scene, symmetry)
    effects = make_effects(scene, symmetry, why, loaded)
    parameters = recipe_parameters(scene, symmetry)
    return _with_companion(contact_plan(scene, symmetry, families, effects, parameters))


def contact_plan(
    scene: Scene,
    symmetry: str,
    families: Families,
    effects: Sequence[Effect],
    parameters: Mapping[str, Any],
) -> ContactPlan:
    """The plan of a contact of two bodies, with its size and cost.

    Raises InputError when a body lacks its material.
    """
    cost = CostModel(scene, recipes.count(scene.recipe, parameters))
    on = {effect.name for effect in effects if effect.on}
    missing = sorted(set(cost.size) - set(scene.materials))
    spare = sorted(set(scene.materials) - set(cost.size))
    if missing or spare:
        raise InputError(
            f"materials: the recipe makes the bodies {', '.join(cost.size)}"
            + (f"; {', '.join(missing)} has no material" if missing else "")
            + (f"; {', '.join(spare)} is not one of them" if spare else "")
        )
    require_held(scene, parameters, cost.size)
    if recipes.counted_by_mesh(scene.recipe):
        # The mesh is there: what it lacks is reported before anything is written.
        require_contact_sets(scene, recipes.build_mesh(scene.recipe, parameters)[0], families)
    _add_bodies(cost, families, recipes.sets_of(scene.recipe, parameters, "WEIGHTED"))
    _add_loads(cost, scene, on)
    # The internal displacement takes the factors of all bodies again.
    needs = cost.in_a_row(keep="internal displacement" in on)
    # A table row, a group of arrays and a curve per load.
    loads = len(scene.loads.normal) * (1 + len(scene.loads.tangential))
    files = _FILES_S + 5e-3 * loads + _NODE_S * cost.nodes * scene.wants("fields")
    return ContactPlan.of(cost, symmetry, parameters, effects, needs, files, families=families)


def _add_bodies(cost: CostModel, families: Families, weighted: Mapping[str, Sequence[str]]) -> None:
    """Bodies meshed and condensed, or learned from products.

    Parameters
    ----------
    weighted
        Body -> its sets with weights, which hold it in the mean.
    """
    scene: Any = cost.scene
    for count in cost.size.values():
        cost.contact_body(count)
    # what every task keeps is held at once: an equal share of the memory each
    room = (memory_limit(scene) - cost.kept_bytes) / (len(cost.size) * len(families))
    for body, count in cost.size.items():
        chosen = scene.contact.distant.get(body)
        in_mean = ("distant" if chosen is None else f"distant_{chosen}") in weighted.get(body, ())
        for components in families:
            task, n_kept = f"{body}, {family_label(components)}", len(components) * count["contact"]
            if is_curved(scene) and not scene.coupled and not in_mean:
                cost.contact(task, count, n_kept, _products(scene, components), room)
            else:
                cost.condensed(task, count, n_kept)
            if in_mean:
                cost.held_in_mean(task, count)


# A cycle takes the products of so many loads.
_CYCLE_CASES = 4


def _products(scene: Scene, components: Collection[int]) -> int:
    """Products that a family of loads takes about."""
    loads, cases = len(scene.loads.normal), 0
    if NORMAL in components:
        cases += loads * (3 if scene.wants("stiffness") else 1)
        cases += scene.loads.curve_points * scene.wants("curve")
    if ALONG in components:
        sheared = len(scene.loads.tangential) if scene.wants("tangential") else 0
        cases += loads * (2 + sheared + _CYCLE_CASES * scene.wants("cycle"))
    return FIRST + EACH * max(cases - 1, 0)


# Counted and timed on the ready scenes, one thread: a contact set under one load; a tangential
# load; a step of the march along one direction and, with its disks, along two; coupled, a step; a
# displacement inside both bodies, per node.
_LOAD_S, _TANGENTIAL_S, _STEP_S, _COUPLED_S = 1e-3, 5e-3, {1: 1.5e-4, 2: 1.5e-3}, 5e-3
_INSIDE_S = 1.4e-6
# Figures and page, files of fields per node.
_FILES_S, _NODE_S = 3.0, 3.5e-5
# Of coupled contact: flops of a load step over the cube of its closed dofs, and over those times
# all; dense matrices of all dofs kept (compliance, factor, inverse, what solves them); steps of the
# curve to gross slip.
_STEP_CUBES, _STEP_SQUARES, _KEPT, _CURVE_STEPS = 1.5, 20.0, 5.0, 26


def _add_loads(cost: CostModel, scene: Scene, on: Collection[str]) -> None:
    """Seconds and bytes of all loads, with the effects ``on``."""
    nodes, k = cost.nodes, max(count["contact"] for count in cost.size.values())
    curved, n_load = is_curved(scene), len(scene.loads.normal)
    n_curve = scene.loads.curve_points * scene.wants("curve")
    # A stiffness is a slope between two more loads.
    forces = n_load * (3 if scene.wants("stiffness") else 1) + n_curve
    lines = n_load * len(scene.loads.directions) * ("friction" in on)
    ratios = lines * len(scene.loads.tangential) * scene.wants("tangential")
    steps = lines * scene.loads.cycle_steps * scene.wants("cycle")
    # A curved contact's patch reaches to twice its radius at least.
    share = np.pi / 16.0 if curved else 1.0
    cost.seconds += forces * (_LOAD_S + dense_s(k**3 / 6.0))
    cost.seconds += steps * _STEP_S[scene.slip_directions]
    cost.seconds += ratios * (_TANGENTIAL_S + dense_s(3.0 * k**3))
    # Four numbers a step and node: traction, also before it is clipped, slip, state.
    cost.kept_bytes += 32.0 * steps * scene.slip_directions * share * k
    cost.kept_bytes += 64.0 * (forces + ratios) * k
    if scene.coupled:
        m, closed = 3.0 * k, 3.0 * share * k
        # Faces that touch without a load scale: their normal loads are one step.
        coupled = 8.0 + 3.0 * forces if curved else 1.0
        coupled += lines * _CURVE_STEPS * scene.wants("tangential") + 1.8 * steps
        one = _STEP_CUBES * closed**3 + _STEP_SQUARES * m * closed
        cost.seconds += coupled * (_COUPLED_S + dense_s(one)) + dense_s(m**3 / 3.0)
        cost.kept_bytes += _KEPT * 8.0 * m**2
    if "internal displacement" in on:
        cost.seconds += n_load * (1 + ("friction" in on)) * nodes * _INSIDE_S
        cost.kept_bytes += 48.0 * n_load * nodes


# -- the coarser whole model -----------------------------------------------------------------------

#: parameters of a recipe that are numbers of elements
_DIVISIONS = ("divisions", "divisions_long")


def _with_companion(plan: ContactPlan) -> ContactPlan:
    """The plan with a companion where an effect left out needs one, and its cost.

    The companion has half the elements along each edge of its contact, where the recipe can be made
    coarser.
    """
    if not plan.shown:
        return plan
    effects = [replace(e, on=e.on and e.name != "internal displacement") for e in plan.effects]
    # It is sheared as far as the run is, and goes through a cycle only where nothing else is.
    loads, sheared = plan.scene.loads, plan.scene.wants("tangential")
    ratio = max(loads.tangential, default=0.0) if sheared else 0.0
    want = [w for w in ("stiffness", "tangential") if plan.scene.wants(w)]
    if plan.scene.wants("cycle") and "stiffness" not in want and not ratio > 0.0:
        want.append("cycle")
    looked_at = ("want", tuple(want)), ("loads.tangential", (ratio,))
    # What couples the directions is looked up in the whole compliance.
    scene = changed(plan.scene, (*looked_at, ("solver.route", "condensed"), *ALONE))
    whole, coarse = _companion_parameters(scene)
    family: Families = {COMPONENTS: {}}
    try:
        companion = contact_plan(scene, "full", family, effects, whole | coarse)
    except UpdError:
        # A recipe of the user's own that cannot be coarser.
        companion = contact_plan(scene, "full", family, effects, whole)
    return replace(
        plan,
        companion=companion,
        seconds=plan.seconds + companion.solve_seconds,
        # Both models are there at the same time, the libraries once.
        memory_bytes=plan.memory_bytes + companion.memory_bytes - START_BYTES,
    )


def _companion_parameters(scene: Scene) -> tuple[dict[str, Any], dict[str, int]]:
    """Of the whole model at the run's spacing, the patch no larger than the largest load needs; and
    half the elements along each edge of its contact, not fewer than it takes.
    """
    parameters = recipe_parameters(scene, "full")
    if scene.sphere_radius is not None and max(scene.loads.forces) > 0.0:
        patch, needed = float(parameters["patch"]), auto_patch(scene)
        if needed < patch:
            divisions = 2 * round(0.5 * needed / patch * int(parameters["divisions"])) or 2
            parameters |= {"patch": needed, "divisions": divisions}
            if scene.geometry.get("core_depth", "auto") == "auto":
                parameters["core_depth"] = auto_core_depth(scene, needed)
    fewest = 8 if NODES[scene.mesh.element] == 8 else 4
    counts = {name: parameters.get(name) for name in _DIVISIONS}
    coarse = {
        name: max(fewest, 2 * (n // 4))
        for name, n in counts.items()
        if isinstance(n, int) and n > fewest
    }
    return parameters, coarse
