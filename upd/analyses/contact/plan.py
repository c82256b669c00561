"""Plan of a contact of two bodies: load families, what the recipe is given, sizes, cost."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Effect, Plan
from upd.analyses.cost import NODES, START_BYTES, CostModel, dense_s
from upd.errors import InputError, OwnMeshError, UpdError
from upd.linalg.routes import EACH, FIRST
from upd.mesh import Mesh, recipes
from upd.mesh.checks import require_sets
from upd.mesh.recipe_modules import is_mesh
from upd.scene import Scene

NORMAL, ALONG, ACROSS = 2, 0, 1
#: all three, in the order of a coupled contact
COMPONENTS = (NORMAL, ALONG, ACROSS)
#: effects left out that are solved again with the run's own compliance
OWN_LEVEL = ("tilt of the damper",)


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
    solve_seconds
        Of ``seconds``, those without figures and files.
    otherwise
        Of a companion whose mesh is made by the run only: parameters it takes when the recipe
        cannot be made coarser.
    """

    families: tuple[Family, ...] = ()
    companion: ContactPlan | None = None
    solve_seconds: float = 0.0
    otherwise: Mapping[str, Any] | None = None

    @property
    def mirrors(self) -> tuple[int, ...]:
        """Coordinates whose zero is a mirror plane of the model, from the node sets its load
        families hold.
        """
        return tuple(
            sorted({"xyz".index(name[-1]) for family in self.families for name in family.mirror})
        )


def is_curved(scene: Scene) -> bool:
    """Whether the faces are curved: their contact set depends on the load."""
    return scene.analysis == "curved contact"


def contact_plan(
    scene: Scene,
    symmetry: str,
    families: tuple[Family, ...],
    effects: Sequence[Effect],
    parameters: Mapping[str, Any],
    about: Mapping[str, Mapping[str, int]] | None = None,
) -> ContactPlan:
    """The plan of a contact of two bodies, with its size and cost.

    ``about``: a size that was estimated, for a mesh that is made by the run only.

    Raises InputError when a body lacks its material.
    """
    two_bodies(scene)
    counted = recipes.count(scene.recipe, parameters) if about is None else about
    size = {body: dict(count) for body, count in counted.items()}
    if about is None and recipes.counted_by_mesh(scene.recipe):
        # The mesh is there: what it lacks is reported before anything is written.
        require_contact_sets(scene, recipes.build_mesh(scene.recipe, parameters)[0], families)
    missing = sorted(set(size) - set(scene.materials))
    spare = sorted(set(scene.materials) - set(size))
    if missing or spare:
        raise InputError(
            f"materials: the recipe makes the bodies {', '.join(size)}"
            + (f"; {', '.join(missing)} has no material" if missing else "")
            + (f"; {', '.join(spare)} is not one of them" if spare else "")
        )
    if about is None:
        _require_held(scene, parameters, size)
    cost = CostModel(scene)
    solve = 0.0
    in_the_mean = _in_the_mean(scene, parameters, about)
    for count in size.values():
        cost.contact_body(count["hexes"], count["nodes"])
    # what every task keeps is held at once: an equal share of the memory each
    room = (cost.limit() - cost.kept_bytes) / (len(size) * len(families))
    for body, count in size.items():
        found = []
        for family in families:
            task = (
                f"{body}, {family.label}",
                count["hexes"],
                count["nodes"],
                len(family.components) * count["contact"],
            )
            found.append(
                cost.contact(*task, _products(scene, effects, family), room)
                if _may_learn(scene) and body not in in_the_mean
                else cost.condensed(*task)
            )
        if body in in_the_mean:
            for family in families:
                cost.held_in_mean(f"{body}, {family.label}", count["hexes"], count["nodes"])
        # recovery of the inner dofs: backward only
        solve += 0.5 * max(one.substitution() for one in found)
    add_loads(cost, scene, size, effects, solve)
    # The internal displacement takes the factors of all bodies again.
    inner = any(effect.name == "internal displacement" and effect.on for effect in effects)
    memory, workers = cost.in_a_row(keep=inner)
    seconds, files = cost.total(workers), _files_seconds(scene, size)
    return ContactPlan(
        scene,
        parameters,
        symmetry,
        tuple(effects),
        size,
        cost.solver,
        seconds + files,
        memory,
        workers,
        families,
        solve_seconds=seconds,
        files_seconds=files,
        ways=cost.ways,
    )


def _may_learn(scene: Scene) -> bool:
    """Whether products may serve instead of a condensation."""
    return is_curved(scene) and not scene.coupled


def _products(scene: Scene, effects: Sequence[Effect], family: Family) -> int:
    """Products that a family of loads takes about."""
    on, loads = {e.name for e in effects if e.on}, len(scene.loads.normal)
    cases = 0
    if NORMAL in family.components:
        cases += loads * (3 if scene.wants("stiffness") else 1)
        cases += scene.loads.curve_points if "load curve" in on else 0
    if ALONG in family.components:
        sheared = len(scene.loads.tangential) if scene.wants("tangential") else 0
        cases += loads * (2 + sheared + _CYCLE_CASES * scene.wants("cycle"))
    return FIRST + EACH * max(cases - 1, 0)


# A cycle takes the products of so many loads.
_CYCLE_CASES = 4


def _in_the_mean(
    scene: Scene, parameters: Mapping[str, Any], about: Mapping[str, Any] | None
) -> set[str]:
    """Bodies that a set with weights holds. Of a mesh that only the run makes nothing is known."""
    if about is not None:
        return set()
    chosen = {body: f"distant_{name}" for body, name in scene.contact.distant.items()}
    found = recipes.weighted_sets(scene.recipe, parameters)
    return {body for body, names in found.items() if chosen.get(body, "distant") in names}


def _require_held(scene: Scene, parameters: Mapping[str, Any], bodies: Iterable[str]) -> None:
    """Raise InputError for a body or a node set of contact.distant that is not there."""
    chosen = scene.contact.distant
    if not chosen:
        return
    known = recipes.distant_sets(scene.recipe, parameters)
    problems = []
    for body, name in chosen.items():
        if body not in set(bodies):
            problems.append(
                f"contact.distant.{body}: no such body; the recipe makes {', '.join(bodies)}"
            )
        elif name not in known.get(body, ()):
            there = ", ".join(known.get(body, ()))
            problems.append(
                f"contact.distant.{body}: the mesh has no set {name!r}; "
                + (f"known: {there}" if there else "it has one distant set: leave the line out")
            )
    if problems:
        raise InputError("\n".join(problems))


# Counted and timed on the ready scenes, one thread: a contact set under one load; a tangential
# load; a step of the march along one direction and, with its disks, along two.
_LOAD_S, _TANGENTIAL_S, _STEP_S, _STEP_2_S = 1e-3, 5e-3, 1.5e-4, 1.5e-3
# Figures and page, figures of a flat contact's tangential loads, files of fields per node.
_FILES_S, _FLAT_S, _NODE_S = 2.6, 1.4, 3.5e-5
# Dense factorisations with three directions of a load, of effects left out.
_AGAIN = 20


def add_loads(
    cost: CostModel,
    scene: Scene,
    size: Mapping[str, Mapping[str, int]],
    effects: Sequence[Effect],
    solve: float,
) -> None:
    """Seconds and bytes of all loads.

    Parameters
    ----------
    solve
        Seconds of one displacement inside both bodies.
    """
    on = {e.name for e in effects if e.on}
    nodes, k = sum(c["nodes"] for c in size.values()), max(c["contact"] for c in size.values())
    n_load, ratios = len(scene.loads.normal), len(scene.loads.tangential)
    n_curve = scene.loads.curve_points if "load curve" in on else 0
    # A stiffness is a slope between two more loads.
    forces = n_load * (3 if scene.wants("stiffness") else 1) + n_curve
    cost.seconds += forces * (_LOAD_S + dense_s(k**3 / 6.0))
    if "friction" in on:
        curved = is_curved(scene)
        lines = 1 if curved else len(scene.loads.directions)
        tangential = ratios if scene.wants("tangential") else 0
        cost.seconds += n_load * lines * tangential * (_TANGENTIAL_S + dense_s(3.0 * k**3))
        step = _STEP_2_S if scene.slip_directions == 2 else _STEP_S
        steps = scene.loads.cycle_steps if scene.wants("cycle") else 0
        cost.seconds += n_load * lines * steps * step
        # Four numbers a step and node: traction, also before it is clipped, slip, state. A curved
        # contact's patch reaches to twice its radius at least.
        loaded = np.pi / 16.0 * k if curved else k
        cost.kept_bytes += 32.0 * n_load * steps * scene.slip_directions * loaded
        cost.kept_bytes += 64.0 * n_load * lines * tangential * k
    cost.kept_bytes += 64.0 * forces * k
    if scene.coupled:
        _add_coupled(cost, scene, k, forces, curved=is_curved(scene))
    if "internal displacement" in on:
        inside = n_load * (2 if "friction" in on else 1) + n_curve
        cost.seconds += inside * solve
        cost.kept_bytes += 48.0 * n_load * nodes


# Flops of a load step of coupled contact over the cube of its closed dofs, and over those times
# all; dense matrices of all dofs kept (compliance, factor, inverse, what solves them); steps of
# the curve to gross slip.
_STEP_CUBES, _STEP_SQUARES, _KEPT, _CURVE_STEPS = 1.5, 20.0, 5.0, 26


def _add_coupled(cost: CostModel, scene: Scene, k: int, forces: int, *, curved: bool) -> None:
    """Seconds and bytes of normal and tangential contact at once, for k contact pairs."""
    m = 3.0 * k
    closed = np.pi / 16.0 * m if curved else m
    loads, lines = len(scene.loads.normal), 1 if curved else len(scene.loads.directions)
    # Faces that touch without a load scale: their normal loads are one step.
    steps = 8.0 + 3.0 * forces if curved else 1.0
    steps += loads * lines * _CURVE_STEPS * scene.wants("tangential")
    steps += loads * lines * (1.8 * scene.loads.cycle_steps) * scene.wants("cycle")
    one = _STEP_CUBES * closed**3 + _STEP_SQUARES * m * closed
    cost.seconds += steps * (5e-3 + dense_s(one)) + dense_s(m**3 / 3.0)
    cost.kept_bytes += _KEPT * 8.0 * m**2


def _files_seconds(scene: Scene, size: Mapping[str, Mapping[str, int]]) -> float:
    """Seconds of figures, files and page."""
    flat = 0.0 if is_curved(scene) else _FLAT_S
    nodes = sum(c["nodes"] for c in size.values()) if scene.wants("fields") else 0
    # A table row, a group of arrays and a curve per load.
    loads = len(scene.loads.normal) * (1 + len(scene.loads.tangential))
    return _FILES_S + flat + 5e-3 * loads + _NODE_S * nodes


# Fewest elements along an edge of the contact that a companion is made coarser to, of linear and of
# quadratic elements.
_FEWEST = {8: 8, 20: 4, 27: 4}
#: parameters of a recipe that are numbers of elements
_DIVISIONS = ("divisions", "divisions_long")


def with_companion(plan: ContactPlan, parameters: Mapping[str, Any]) -> ContactPlan:
    """The plan with a companion where an effect left out needs one, and its cost.

    Parameters
    ----------
    parameters
        Of the recipe for the whole model; the companion has half the elements along each edge of
        its contact, where the recipe can be made coarser.
    """
    needed = (e.check and e.word == "no" and e.name not in OWN_LEVEL for e in plan.effects)
    if not plan.scene.left_out.solves or not any(needed):
        return plan
    fewest = _FEWEST[NODES[plan.scene.mesh.element]]
    coarse = dict(parameters)
    for name in _DIVISIONS:
        n = parameters.get(name)
        if isinstance(n, int) and n > fewest:
            coarse[name] = max(fewest, 2 * (n // 4))
    off = ("load curve", "internal displacement")
    effects = [replace(e, on=e.on and e.name not in off) for e in plan.effects]
    family = (Family((NORMAL, ALONG, ACROSS)),)
    # It goes through a cycle only where nothing else is sheared.
    sheared = plan.scene.wants("stiffness") or plan.scene.wants("tangential")
    want = tuple(w for w in plan.scene.want if w != "cycle" or not sheared)
    # What couples the directions is looked up in the whole compliance.
    route = "condensed" if plan.scene.solver.route == "products" else plan.scene.solver.route
    solver = replace(plan.scene.solver, route=route)
    scene = replace(plan.scene, want=want, solver=solver)
    if recipes.counted_by_mesh(scene.recipe):
        # A plan runs a user's recipe once: the run makes the second mesh.
        about = _size_about(plan, coarse)
        companion = contact_plan(scene, "full", family, effects, coarse, about)
        companion = replace(companion, otherwise=parameters)
    else:
        try:
            companion = contact_plan(scene, "full", family, effects, coarse)
        except UpdError:
            # A recipe of the user's own that cannot be coarser.
            companion = contact_plan(scene, "full", family, effects, parameters)
    again = companion.solve_seconds
    k = 3.0 * max(count["contact"] for count in companion.size.values())
    again += len(plan.scene.loads.normal) * _AGAIN * dense_s(k**3)
    return replace(
        plan,
        companion=companion,
        seconds=plan.seconds + again,
        solve_seconds=plan.solve_seconds + again,
        # Both models are there at the same time, the libraries once.
        memory_bytes=plan.memory_bytes + companion.memory_bytes - START_BYTES,
    )


def _size_about(plan: ContactPlan, coarse: Mapping[str, Any]) -> dict[str, dict[str, int]]:
    """Numbers of the whole model with other divisions, from those of the plan's own mesh.

    Element edges along the contact by the geometric mean of its divisions' ratios, into the bodies
    likewise.
    """
    ratios = [
        coarse[name] / plan.parameters[name]
        for name in _DIVISIONS
        if isinstance(plan.parameters.get(name), int) and name in coarse
    ]
    edge = float(np.prod(ratios)) ** (1.0 / len(ratios)) if ratios else 1.0
    powers = {"nodes": 3, "hexes": 3, "contact": 2}
    return {
        body: {
            what: max(1, round(plan.copies * number * edge ** powers.get(what, 3)))
            for what, number in count.items()
        }
        for body, count in plan.size.items()
    }


def require_contact_sets(
    scene: Scene, meshes: Mapping[str, Mesh], families: tuple[Family, ...]
) -> None:
    """Raise OwnMeshError unless the bodies name their contact, what is held, and the mirror planes
    of the loads, and have as many patches as their analysis knows.
    """
    planes = sorted({plane for family in families for plane in family.mirror})
    held = {
        name
        for name in scene.contact.distant
        if f"distant_{scene.contact.distant[name]}" in getattr(meshes.get(name), "nodes", ())
    }
    require_sets(scene.recipe, meshes, ("contact", *planes), ("contact",))
    require_sets(
        scene.recipe,
        {name: mesh for name, mesh in meshes.items() if name not in held},
        ("distant",),
    )
    problems: dict[str, list[str]] = {}
    for name, mesh in meshes.items():
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


def two_bodies(scene: Scene) -> None:
    """Raise InputError unless the scene has two materials, one per body."""
    if len(scene.materials) != 2:
        raise InputError(
            f"materials: a contact has two bodies, {len(scene.materials)} given "
            f"({', '.join(scene.materials)})"
        )


def mesh_parameters(scene: Scene, symmetry: str) -> dict[str, Any]:
    """Parameters for the recipe: those of the scene, the symmetry and the nodes per element."""
    parameters = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    known = recipes.parameters(scene.recipe).__dataclass_fields__
    if "symmetry" in known:
        parameters["symmetry"] = symmetry
    if "element_nodes" in known:
        parameters["element_nodes"] = NODES[scene.mesh.element]
    return parameters


def refined_growth(growth: float, ratio: float) -> float:
    """Growth of a mesh whose spacing is ``ratio`` times that of a mesh with ``growth``, so that the
    far mesh is refined with the patch.

    Sizes grow by the same factor over 1 / ratio as many elements; within what the recipes accept.
    """
    return float(min(1.9, max(1.06, growth**ratio)))


Array = NDArray[np.float64]


def component(direction: float) -> int | None:
    """The component a tangential load runs along, or None for one between the axes."""
    return {0.0: ALONG, 90.0: ACROSS}.get(direction % 180.0)


def axis_of(direction: float) -> int:
    """The component of a direction that runs along an axis."""
    found = component(direction)
    assert found is not None
    return found


def direction_name(direction: float) -> str:
    """x, y or the angle."""
    return {0.0: "x", 90.0: "y"}.get(direction % 360.0, f"{direction:g}deg")


def unit_vector(direction: float, components: Sequence[int]) -> Array:
    """(n_component,) of the unit vector along ``direction`` in degrees."""
    radians = np.radians(direction)
    return np.asarray(np.array([np.cos(radians), np.sin(radians)])[list(components)])
