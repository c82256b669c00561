"""Plan of a seated damper: ways of loading, what is simulated and left out, size and cost."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Effect, Plan
from upd.analyses.cost import NODES, CostModel, dense_s
from upd.labels import number
from upd.mesh import recipes
from upd.scene import SeatedScene
from upd.scene.base import rig_parameters
from upd.scene.forced_contact import SIDES
from upd.scene.rotation import damper_mass
from upd.units import UNITS

SeatedPlan = Plan[SeatedScene]
Array = NDArray[np.float64]

RAISED, LOWERED, AGAIN = "raised", "lowered", "raised again"
OVER, SHAKEN, SMOOTH = "over-pressed", "vibrated in", "frictionless"
#: ways to F_C that differ by friction
WAYS = (RAISED, AGAIN, OVER, SHAKEN)

#: arrangement -> elements up a patch, and those that go with them, along it first
PATCH = {
    "symmetric": ("patch_along_slope", ("patch_along_y",)),
    "asymmetric": ("pad_along_slope", ("pad_along_y", "face_along_z")),
}

#: checks of effects omitted; each solves the faces' forces again with it
WORN = "worn faces"
OTHER_WAYS = "other ways of loading"

# Counted on the ready scenes, one thread, within a factor of two. A load step: Newton steps, each
# passes over the matrix of all dofs, and new factors of the share of dofs that is closed; of a
# call, checks and factors of all.
_CHECKS, _NEWTON_PASSES, _FACTORS, _CLOSED = 8.0 / 3.0, 330.0, 0.8, 0.5
_STEP_S = 2e-3
# Matrices of all dofs at a time.
_MATRICES = 14.0
# Figures, files and page.
_FILES_S = 6.0


# -- ways of loading -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """A way of loading, k steps.

    Attributes
    ----------
    name
        What is done.
    centrifugal : (k,) ndarray
        F_C after each step, N.
    after
        The way whose state it starts from; "": nothing pressed.
    moved : (k, 3) ndarray
        Shift of what holds the right blade after each step, mm; (1, 3) zeros where it stays.
    """

    name: str
    centrifugal: Array
    after: str = RAISED
    moved: Array = field(default_factory=lambda: np.zeros((1, 3)))


def ways(scene: SeatedScene) -> list[list[Way]]:
    """F_C raised, and all that is asked for beside it, row by row: every row after the first starts
    from the raised state.
    """
    F, s = scene.damper.centrifugal, scene.seating
    raised = F * np.arange(1, s.steps + 1) / s.steps
    lowered, back = _legs(s.steps, 1.0, s.lowest), _legs(s.steps, s.lowest, 1.0)
    rows = [[Way(RAISED, raised, "")]]
    rows.append([Way(LOWERED, F * lowered), Way(AGAIN, F * back, LOWERED)])
    if scene.wants("band"):
        rows.append([Way(OVER, F * _legs(s.steps, 1.0, s.over, 1.0))])
        rows.append([shaken(scene)])
        rows.append([Way(SMOOTH, np.array([F]), "")])
    m = scene.moved
    # out to the amplitude, then whole cycles, in even steps
    out, cycle = _legs(m.steps, 0.0, 1.0), _legs(2 * m.steps, *[1.0, -1.0] * m.cycles, 1.0)
    for axis in m.directions if scene.wants("moved") else ():
        way = m.amplitude * np.concatenate([out, cycle])
        moved = np.outer(way, np.arange(3) == "xyz".index(axis))
        rows.append([Way(f"moved along {axis}", np.full(len(moved), F), moved=moved)])
    return rows


def _legs(steps: int, *ends: float) -> Array:
    """From each end to the next in even steps."""
    return np.concatenate([np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(ends)])


def shaken(scene: SeatedScene) -> Way:
    """The right blade vibrates along x under F_C; its amplitude dies away evenly to nothing."""
    s = scene.seating
    t = np.arange(1, s.cycle_steps * s.cycles + 1) / s.cycle_steps
    moved = np.zeros((len(t), 3))
    moved[:, 0] = s.shake * (1.0 - t / s.cycles) * np.sin(2.0 * np.pi * t)
    moved[-1] = 0.0
    return Way(SHAKEN, np.full(len(t), scene.damper.centrifugal), moved=moved)


# -- the plan --------------------------------------------------------------------------------------


def make_plan(scene: SeatedScene) -> SeatedPlan:
    """Derive the plan of ``scene``. Raises InputError when its parts do not fit together."""
    symmetry = "full" if scene.whole else "half"
    parameters = rig_parameters(scene, symmetry, NODES[scene.mesh.element])
    cost = CostModel(scene, recipes.count(scene.recipe, parameters))
    _add_contact(cost, scene)
    needs = cost.side_by_side(min(2, cost.threads), 2)
    return SeatedPlan.of(cost, symmetry, parameters, _effects(scene, symmetry), needs, _FILES_S)


def _add_contact(cost: CostModel, scene: SeatedScene) -> None:
    """Bodies condensed onto their faces, and the load steps of these."""
    twice = scene.wants("stiffness") and scene.blades.held == "bases"
    for body, count in cost.size.items():
        cost.dynamic_body(count)
        # the damper's is the same on platforms held
        for _ in range(2 if twice and body != "damper" else 1):
            cost.condensed(f"{body}, compliance", count, 3 * count["contact"])
    m = 3.0 * sum(cost.size[side]["contact"] for side in SIDES)
    calls = 1 + sum(map(len, ways(scene)))
    step = _FACTORS * 2.0 / 3.0 * (_CLOSED * m) ** 3 + _NEWTON_PASSES * m**2
    cost.seconds += dense_s(calls * _CHECKS * m**3)
    steps = sum(len(way.centrifugal) for row in ways(scene) for way in row)
    if scene.left_out.solves:
        steps += scene.seating.steps * (scene.contact.worn < 1.0)
        steps += 0 if scene.wants("band") else len(shaken(scene).centrifugal)
    cost.seconds += steps * (_STEP_S + dense_s(step))
    cost.kept_bytes += _MATRICES * 8.0 * m**2


def _effects(scene: SeatedScene, symmetry: str) -> list[Effect]:
    either, unworn, band = Effect.either, scene.contact.worn < 1.0, scene.wants("band")
    return [
        friction_effect(scene),
        Effect("normal and tangential coupling", True, "solved together, along the load's path"),
        Effect("lift-off", True, "every node may open"),
        Effect("damper elasticity", True, "free body; F_C acts on its mass"),
        *centrifugal_effects(scene),
        Effect("damper's rigid motion", True, "shifts and turns follow from its balance"),
        either(
            "blades' elasticity",
            scene.blades.held == "bases",
            "down to the clamped faces of the bases",
            "held where the platforms' sides join the blades",
            applies=True,
        ),
        either(
            "motion odd about y = 0",
            symmetry != "half",
            "the full model is solved",
            "load and bodies are even about it",
        ),
        worn_effect(
            scene,
            check=WORN if unworn else "",
            switch=("contact.fit=worn",) if unworn else (),
            applies=True,
        ),
        either(
            OTHER_WAYS,
            band,
            "over-pressed, vibrated in, frictionless",
            "F_C is raised from nothing, once",
            check="" if band else OTHER_WAYS,
            applies=scene.contact.friction > 0.0,
        ),
        Effect("inertia", False, "quasi-static", applies=False),
    ]


def friction_effect(scene: Any, how: str = ", both directions, every node of both faces") -> Effect:
    """Coulomb friction of a forced response or a seated damper."""
    mu = scene.contact.friction
    return Effect.either("friction", mu > 0.0, f"Coulomb, mu = {mu:g}{how}", "mu = 0")


def worn_effect(scene: Any, **more: Any) -> Effect:
    """How faces fit each other node by node, of a forced response or a seated damper."""
    worn = scene.contact.worn
    why, off = f"worn in under F_C to {100.0 * worn:g} %", "flat faces that fit without load"
    return Effect.either(WORN, worn > 0.0, why, off, **more)


def centrifugal_words(scene: Any, mass: float | None) -> str:
    """F_C, where it comes from, and the damper's mass.

    Parameters
    ----------
    scene
        A forced response or a seated damper.
    mass
        Of the damper, t; None where it is not known.
    """
    damper = scene.damper
    force, grams = number(damper.centrifugal, "N"), "" if mass is None else number(1e6 * mass, "g")
    if damper.speed is None or damper.radius is None:
        return f"{force}, damper {grams}" if grams else force
    rpm = damper.speed / UNITS["speed"]["rpm"]
    return f"{force} = m r w^2: damper {grams}, {damper.radius:.6g} mm, {rpm:.6g} rpm"


def centrifugal_effects(scene: Any) -> list[Effect]:
    """F_C and the damper's mass, and that nothing else of the rotation counts.

    Parameters
    ----------
    scene
        A forced response or a seated damper.
    """
    pulled = "the rig does not turn: wires pull the damper with F_C"
    turns = "F_C on the damper alone: the blades are those at rest"
    return [
        Effect("centrifugal force", True, centrifugal_words(scene, damper_mass(scene))),
        Effect("rotation", False, pulled if scene.damper.speed is None else turns, applies=False),
    ]
