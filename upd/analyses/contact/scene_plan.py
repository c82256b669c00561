"""Plan of a contact, curved or flat: effects simulated and omitted, cost, and the coarser whole
model of what is solved again.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
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
    COMPONENTS,
    NORMAL,
    OWN_LEVEL,
    ContactPlan,
    Family,
    auto_core_depth,
    auto_patch,
    choose_symmetry,
    component,
    is_curved,
    make_families,
    normal_loads,
    recipe_parameters,
    require_contact_sets,
    require_held,
)
from upd.analyses.cost import NODES, START_BYTES, CostModel, dense_s
from upd.errors import InputError, UpdError
from upd.linalg.routes import EACH, FIRST
from upd.mesh import recipes
from upd.scene import FRICTION_WANTS, Scene, friction_on


def make_plan(scene: Scene) -> ContactPlan:
    """Derive the plan of ``scene``, without the cost of what its errors are estimated with.

    Raises InputError when its parts do not fit together.
    """
    if len(scene.materials) != 2:
        raise InputError(
            f"materials: a contact has two bodies, {len(scene.materials)} given "
            f"({', '.join(scene.materials)})"
        )
    loaded = any(load.force > 0.0 for load in normal_loads(scene))
    if not is_curved(scene):
        _require_fitting(scene)
    symmetry, why = choose_symmetry(scene)
    families, effects = make_families(scene, symmetry), _effects(scene, symmetry, why, loaded)
    parameters = recipe_parameters(scene, symmetry)
    return _with_companion(contact_plan(scene, symmetry, families, effects, parameters))


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


# -- effects ---------------------------------------------------------------------------------------


def _simulated(name: str, on: bool, why: str) -> Effect:
    """An effect that the scene's question has where it is simulated, and else not."""
    return Effect(name, on, why, applies=on)


def _effects(scene: Scene, symmetry: str, why_symmetry: str, loaded: bool) -> list[Effect]:
    edge = "edges may lift off; one linear solve when none does"
    small, tilt = "the approach is small against the patch", [_tilt_effect(scene, loaded)]
    if is_curved(scene):
        edge = "the gap is curved: the contact set depends on the load"
        small, tilt = "the contact is small against the body", []
    curve, inside = scene.wants("curve"), ", ".join(_inside(scene))
    points = f"{scene.loads.curve_points} points asked for" if curve else "single loads only"
    fields = (
        f"a back-substitution per load for {inside}"
        if inside
        else "no output asks for it: contact nodes only"
    )
    return [
        Effect("unilateral contact", True, edge),
        *tilt,
        *_friction_effects(scene, loaded),
        _simulated("mirror symmetry", symmetry != "full", why_symmetry),
        _simulated("load curve", curve, points),
        _simulated("internal displacement", bool(inside), fields),
        _simulated("inertia", False, "every output is static: M is not assembled"),
        omitted(LARGE, small, applies=loaded),
    ]


def _tilt_effect(scene: Scene, loaded: bool) -> Effect:
    if scene.contact.tilt == "free":
        return Effect(TILT, True, "no moment about the load line")
    return omitted(TILT, "its distant set only translates", "contact.tilt=free", applies=loaded)


def _friction_effects(scene: Scene, loaded: bool) -> list[Effect]:
    curved, mu = is_curved(scene), scene.contact.friction
    if not friction_on(scene):
        asked = scene.wants(*FRICTION_WANTS)
        why = "mu = 0: no tangential force can be carried" if asked else "no output asks for it"
        coupling = coupling_effects(scene, loaded)[:1] if mu > 0.0 else ()
        return [_simulated("friction", False, why), *coupling]
    outputs = ", ".join(w for w in scene.want if w in FRICTION_WANTS)
    stepped, steps = True, "first loading, in small steps"
    if scene.wants("cycle"):
        steps = "a full cycle is asked for"
    elif curved and not scene.coupled:
        stepped, steps = False, "first loading only"
    directions = Effect(DIRECTIONS, True, TOGETHER if scene.coupled else "asked for")
    if scene.slip_directions == 1:
        why = "the load has one direction" if curved else "loads run along the axes"
        shows = loaded and (not curved or _slip_shows(scene))
        directions = omitted(DIRECTIONS, why, "contact.directions=2", applies=shows)
    return [
        _simulated("friction", True, f"mu = {mu:g} and the outputs {outputs}"),
        directions,
        *coupling_effects(scene, loaded),
        _simulated("load history", stepped, steps),
    ]


def _slip_shows(scene: Scene) -> bool:
    """Whether a number of the run depends on the directions of slip."""
    shear = scene.wants("stiffness") and scene.sphere_radius is not None
    loads = scene.wants("tangential") and len(scene.loads.tangential) > 0
    return shear or loads or scene.wants("cycle")


def _inside(scene: Scene) -> list[str]:
    """Outputs that ask for displacements inside the bodies."""
    if not is_curved(scene):
        return [w for w in scene.want if w == "fields"]
    wanted = ("fields", "body_compression", "stiffness")
    return [w for w in scene.want if w in wanted or (w == "tangential" and friction_on(scene))]


# -- size and cost ---------------------------------------------------------------------------------


def contact_plan(
    scene: Scene,
    symmetry: str,
    families: tuple[Family, ...],
    effects: Sequence[Effect],
    parameters: Mapping[str, Any],
) -> ContactPlan:
    """The plan of a contact of two bodies, with its size and cost.

    Raises InputError when a body lacks its material.
    """
    size = {body: dict(n) for body, n in recipes.count(scene.recipe, parameters).items()}
    missing = sorted(set(size) - set(scene.materials))
    spare = sorted(set(scene.materials) - set(size))
    if missing or spare:
        raise InputError(
            f"materials: the recipe makes the bodies {', '.join(size)}"
            + (f"; {', '.join(missing)} has no material" if missing else "")
            + (f"; {', '.join(spare)} is not one of them" if spare else "")
        )
    require_held(scene, parameters, size)
    if recipes.counted_by_mesh(scene.recipe):
        # The mesh is there: what it lacks is reported before anything is written.
        require_contact_sets(scene, recipes.build_mesh(scene.recipe, parameters)[0], families)
    cost, on = CostModel(scene), {effect.name for effect in effects if effect.on}
    products = [(family, _products(scene, on, family)) for family in families]
    _add_bodies(cost, scene, size, products, recipes.weighted_sets(scene.recipe, parameters))
    _add_loads(cost, scene, size, on)
    # The internal displacement takes the factors of all bodies again.
    memory, workers = cost.in_a_row(keep="internal displacement" in on)
    # A table row, a group of arrays and a curve per load.
    loads = len(scene.loads.normal) * (1 + len(scene.loads.tangential))
    nodes = sum(count["nodes"] for count in size.values()) if scene.wants("fields") else 0
    files = _FILES_S + 5e-3 * loads + _NODE_S * nodes
    return ContactPlan(
        scene,
        parameters,
        symmetry,
        tuple(effects),
        size,
        cost.solver,
        cost.total(workers) + files,
        memory,
        workers,
        families,
        files_seconds=files,
        ways=cost.ways,
    )


def _add_bodies(
    cost: CostModel,
    scene: Scene,
    size: Mapping[str, Mapping[str, int]],
    products: Sequence[tuple[Family, int]],
    weighted: Mapping[str, Sequence[str]],
) -> None:
    """Bodies meshed and condensed.

    Parameters
    ----------
    products
        A family of loads, and about how many it takes where they may serve instead of a
        condensation.
    weighted
        Body -> its sets with weights, which hold it in the mean.
    """
    for count in size.values():
        cost.contact_body(count["hexes"], count["nodes"])
    # what every task keeps is held at once: an equal share of the memory each
    room = (cost.limit() - cost.kept_bytes) / (len(size) * len(products))
    for body, count in size.items():
        chosen = scene.contact.distant.get(body)
        in_mean = ("distant" if chosen is None else f"distant_{chosen}") in weighted.get(body, ())
        for family, number in products:
            task = f"{body}, {family.label}", count["hexes"], count["nodes"]
            n_kept = len(family.components) * count["contact"]
            if is_curved(scene) and not scene.coupled and not in_mean:
                cost.contact(*task, n_kept, number, room)
            else:
                cost.condensed(*task, n_kept)
        for family, _ in products if in_mean else ():
            cost.held_in_mean(f"{body}, {family.label}", count["hexes"], count["nodes"])


# A cycle takes the products of so many loads.
_CYCLE_CASES = 4


def _products(scene: Scene, on: Collection[str], family: Family) -> int:
    """Products that a family of loads takes about, with the effects ``on``."""
    loads, cases = len(scene.loads.normal), 0
    if NORMAL in family.components:
        cases += loads * (3 if scene.wants("stiffness") else 1)
        cases += scene.loads.curve_points * ("load curve" in on)
    if ALONG in family.components:
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
# Dense factorisations with three directions of a load, of effects left out.
_AGAIN = 20
# Of coupled contact: flops of a load step over the cube of its closed dofs, and over those times
# all; dense matrices of all dofs kept (compliance, factor, inverse, what solves them); steps of the
# curve to gross slip.
_STEP_CUBES, _STEP_SQUARES, _KEPT, _CURVE_STEPS = 1.5, 20.0, 5.0, 26


def _add_loads(
    cost: CostModel, scene: Scene, size: Mapping[str, Mapping[str, int]], on: Collection[str]
) -> None:
    """Seconds and bytes of all loads, with the effects ``on``."""
    nodes, k = sum(c["nodes"] for c in size.values()), max(c["contact"] for c in size.values())
    curved, n_load = is_curved(scene), len(scene.loads.normal)
    n_curve = scene.loads.curve_points * ("load curve" in on)
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
        cost.seconds += (n_load * (1 + ("friction" in on)) + n_curve) * nodes * _INSIDE_S
        cost.kept_bytes += 48.0 * n_load * nodes


# -- the coarser whole model -----------------------------------------------------------------------

# Fewest elements along an edge of the contact that a companion is made coarser to, of linear and of
# quadratic elements.
_FEWEST = {8: 8, 20: 4, 27: 4}
#: parameters of a recipe that are numbers of elements
_DIVISIONS = ("divisions", "divisions_long")


def _with_companion(plan: ContactPlan) -> ContactPlan:
    """The plan with a companion where an effect left out needs one, and its cost.

    The companion has half the elements along each edge of its contact, where the recipe can be made
    coarser.
    """
    scene = plan.scene
    needed = (e.check and e.word == "no" and e.name not in OWN_LEVEL for e in plan.effects)
    if not scene.left_out.solves or not any(needed):
        return plan
    off = ("load curve", "internal displacement")
    effects = [replace(e, on=e.on and e.name not in off) for e in plan.effects]
    # It goes through a cycle only where nothing else is sheared.
    sheared = scene.wants("stiffness") or scene.wants("tangential")
    want = tuple(w for w in scene.want if w != "cycle" or not sheared)
    # What couples the directions is looked up in the whole compliance.
    route = "condensed" if scene.solver.route == "products" else scene.solver.route
    smaller = replace(scene, want=want, solver=replace(scene.solver, route=route))
    whole, family = _whole_parameters(scene), (Family(COMPONENTS),)
    try:
        companion = contact_plan(smaller, "full", family, effects, _coarse(scene, whole))
    except UpdError:
        # A recipe of the user's own that cannot be coarser.
        companion = contact_plan(smaller, "full", family, effects, whole)
    k = 3.0 * max(count["contact"] for count in companion.size.values())
    again = companion.solve_seconds + len(scene.loads.normal) * _AGAIN * dense_s(k**3)
    return replace(
        plan,
        companion=companion,
        seconds=plan.seconds + again,
        # Both models are there at the same time, the libraries once.
        memory_bytes=plan.memory_bytes + companion.memory_bytes - START_BYTES,
    )


def _coarse(scene: Scene, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Half the elements along each edge of the contact, not fewer than it takes."""
    fewest, coarse = _FEWEST[NODES[scene.mesh.element]], dict(parameters)
    for name in _DIVISIONS:
        n = parameters.get(name)
        if isinstance(n, int) and n > fewest:
            coarse[name] = max(fewest, 2 * (n // 4))
    return coarse


def _whole_parameters(scene: Scene) -> dict[str, Any]:
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
