"""Plan of a contact, curved or flat, with its cost and the coarser whole model of what is solved
again.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from upd.analyses.base import Effect
from upd.analyses.contact import plan as planned
from upd.analyses.contact.plan import ALONG, NORMAL, ContactPlan, Family, is_curved
from upd.analyses.cost import NODES, START_BYTES, CostModel, dense_s, memory_limit
from upd.errors import InputError, UpdError
from upd.linalg.select import EACH, FIRST
from upd.mesh import recipes
from upd.scene import Scene, friction_on
from upd.vary.solve import changed
from upd.vary.variation import ALONE


def make_plan(scene: Scene) -> ContactPlan:
    """Derive the plan of ``scene``, without the cost of what its errors are estimated with.

    Raises InputError when its parts do not fit together.
    """
    if len(scene.materials) != 2:
        raise InputError(
            f"materials: a contact has two bodies, {len(scene.materials)} given "
            f"({', '.join(scene.materials)})"
        )
    loaded = any(load > 0.0 for load in planned.normal_loads(scene))
    if not is_curved(scene):
        _require_fitting(scene)
    symmetry, why = planned.choose_symmetry(scene)
    families = planned.make_families(scene, symmetry)
    effects = planned.make_effects(scene, symmetry, why, loaded)
    parameters = planned.recipe_parameters(scene, symmetry)
    return _with_companion(contact_plan(scene, symmetry, families, effects, parameters))


def _require_fitting(scene: Scene) -> None:
    """Raise InputError for what a flat contact does not take."""
    problems = []
    if scene.mesh.symmetry == "quarter":
        problems.append(
            'mesh.symmetry: a damper\'s face has one mirror plane; use "half", "full" or "auto"'
        )
    axes = {planned.component(d) for d in scene.loads.directions}
    if scene.wants("contact_law") and friction_on(scene) and not {ALONG, planned.ACROSS} <= axes:
        problems.append(
            'loads.directions: contact_law needs the stiffness along both axes; give ["x", "y"]'
        )
    oblique = [d for d in scene.loads.directions if planned.component(d) is None]
    if oblique and friction_on(scene) and scene.slip_directions == 1:
        problems.append(
            f"loads.directions: {oblique[0]:g} deg lies between the axes and slips in two "
            "directions: set contact.directions = 2"
        )
    if problems:
        raise InputError("\n".join(problems))


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
    planned.require_held(scene, parameters, cost.size)
    if recipes.counted_by_mesh(scene.recipe):
        # The mesh is there: what it lacks is reported before anything is written.
        planned.require_contact_sets(
            scene, recipes.build_mesh(scene.recipe, parameters)[0], families
        )
    products = [(family, _products(scene, on, family)) for family in families]
    _add_bodies(cost, scene, products, recipes.weighted_sets(scene.recipe, parameters))
    _add_loads(cost, scene, on)
    # The internal displacement takes the factors of all bodies again.
    needs = cost.in_a_row(keep="internal displacement" in on)
    # A table row, a group of arrays and a curve per load.
    loads = len(scene.loads.normal) * (1 + len(scene.loads.tangential))
    files = _FILES_S + 5e-3 * loads + _NODE_S * cost.nodes * scene.wants("fields")
    return ContactPlan.of(cost, symmetry, parameters, effects, needs, files, families=families)


def _add_bodies(
    cost: CostModel,
    scene: Scene,
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
    for count in cost.size.values():
        cost.contact_body(count)
    # what every task keeps is held at once: an equal share of the memory each
    room = (memory_limit(scene) - cost.kept_bytes) / (len(cost.size) * len(products))
    for body, count in cost.size.items():
        chosen = scene.contact.distant.get(body)
        in_mean = ("distant" if chosen is None else f"distant_{chosen}") in weighted.get(body, ())
        for family, number in products:
            task, n_kept = f"{body}, {family.label}", len(family.components) * count["contact"]
            if is_curved(scene) and not scene.coupled and not in_mean:
                cost.contact(task, count, n_kept, number, room)
            else:
                cost.condensed(task, count, n_kept)
        for family, _ in products if in_mean else ():
            cost.held_in_mean(f"{body}, {family.label}", count)


# A cycle takes the products of so many loads.
_CYCLE_CASES = 4


def _products(scene: Scene, on: Collection[str], family: Family) -> int:
    """Products that a family of loads takes about, with the effects ``on``."""
    loads, cases = len(scene.loads.normal), 0
    if NORMAL in family.components:
        cases += loads * (3 if scene.wants("stiffness") else 1)
        cases += scene.loads.curve_points * scene.wants("curve")
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
    if not plan.shown:
        return plan
    effects = [replace(e, on=e.on and e.name != "internal displacement") for e in plan.effects]
    # It is sheared as far as the run is, and goes through a cycle only where nothing else is.
    ratio = planned.largest_ratio(plan.scene)
    want = [w for w in ("stiffness", "tangential") if plan.scene.wants(w)]
    if plan.scene.wants("cycle") and "stiffness" not in want and not ratio > 0.0:
        want.append("cycle")
    looked_at = ("want", tuple(want)), ("loads.tangential", (ratio,))
    # What couples the directions is looked up in the whole compliance.
    scene = changed(plan.scene, (*looked_at, ("solver.route", "condensed"), *ALONE))
    whole, family = _whole_parameters(scene), (Family(planned.COMPONENTS),)
    try:
        companion = contact_plan(scene, "full", family, effects, whole | _coarse(scene, whole))
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


def _coarse(scene: Scene, whole: Mapping[str, Any]) -> dict[str, int]:
    """Half the elements along each edge of the contact, not fewer than it takes."""
    fewest = _FEWEST[NODES[scene.mesh.element]]
    counts = {name: whole.get(name) for name in _DIVISIONS}
    return {
        name: max(fewest, 2 * (n // 4))
        for name, n in counts.items()
        if isinstance(n, int) and n > fewest
    }


def _whole_parameters(scene: Scene) -> dict[str, Any]:
    """Of the whole model at the run's spacing.

    The patch is no larger than the largest load needs it.
    """
    parameters = planned.recipe_parameters(scene, "full")
    if scene.sphere_radius is not None and max(scene.loads.forces) > 0.0:
        needed = planned.auto_patch(scene)
        if needed < float(parameters["patch"]):
            share = needed / float(parameters["patch"])
            parameters["patch"] = needed
            parameters["divisions"] = 2 * round(0.5 * share * int(parameters["divisions"])) or 2
            if scene.geometry.get("core_depth", "auto") == "auto":
                parameters["core_depth"] = planned.auto_core_depth(scene, needed)
    return parameters
