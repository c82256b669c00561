"""Plan of a bladed disk: one sector, which nodal diameters are computed, effects, size and cost."""

from __future__ import annotations

from typing import Any

import numpy as np

from upd.analyses.base import Effect, Needs, Plan
from upd.analyses.cost import NODES, CostModel
from upd.cache.sources import key_of
from upd.mesh import recipes
from upd.scene import BladedDiskScene

BladedDiskPlan = Plan[BladedDiskScene]
#: checks of effects left out
CORIOLIS, DISPLACED = "Coriolis force", "initial displacements"
# A Hermitian problem of a nodal diameter over the real one of the sector, by dofs; figures, page.
_COMPLEX, _FILES_S = 2.0, 1.5


def parameters(scene: BladedDiskScene) -> dict[str, Any]:
    """Parameters of the recipe."""
    own = {k: v for k, v in scene.geometry.items() if k != "recipe"}
    return {**own, "element_nodes": NODES[scene.mesh.element]}


def computed(scene: BladedDiskScene) -> tuple[int, ...]:
    """Nodal diameters whose modes are computed, 0 to N/2, denser where the disk moves most."""
    most = scene.n_sectors // 2
    count = min(scene.modes.computed, most + 1)
    places = most * (1.0 - np.cos(np.linspace(0.0, 0.5 * np.pi, count)))
    return tuple(dict.fromkeys(np.rint(places).astype(int).tolist()))


def rotates(scene: BladedDiskScene) -> bool:
    """Whether any output needs the rotating sector."""
    return scene.wants("campbell", "interference") or damped(scene)


def damped(scene: BladedDiskScene) -> bool:
    """Whether the damped response is solved."""
    return scene.wants("response", "performance")


def make_plan(scene: BladedDiskScene) -> BladedDiskPlan:
    """Derive the plan of ``scene``."""
    chosen = parameters(scene)
    size = {body: dict(count) for body, count in recipes.count(scene.recipe, chosen).items()}
    cost = CostModel(scene)
    for body, count in size.items():
        cost.dynamic_body(count["hexes"], count["nodes"], 2.0)
        # the check solves one more, the static state half of one
        times = int(_COMPLEX * (len(computed(scene)) + 1.5))
        reduced = 2 * (scene.response.harmonics + 1) if damped(scene) else 0
        cost.modes(f"{body}, modes", count["hexes"], count["nodes"], times + reduced)
    memory, workers = cost.side_by_side(1, 1)
    return BladedDiskPlan(
        scene,
        chosen,
        "full",
        tuple(_effects(scene)),
        size,
        cost.solver,
        cost.total(workers) + _FILES_S,
        memory,
        workers,
        files_seconds=_FILES_S,
    )


def _effects(scene: BladedDiskScene) -> list[Effect]:
    turns, known = rotates(scene), ", ".join(map(str, computed(scene)))
    unasked = "no output asks for a speed"
    return [
        Effect(
            "cyclic symmetry",
            True,
            f"one of {scene.n_sectors} sectors; nodal diameters {known} computed, the others in "
            "the span of their modes",
        ),
        Effect(
            "centrifugal stiffening",
            turns,
            "stresses at nodal diameter 0, spin softening" if turns else unasked,
            applies=turns,
        ),
        Effect(DISPLACED, False, "small" if turns else unasked, DISPLACED, applies=turns),
        Effect(CORIOLIS, False, "small" if turns else unasked, CORIOLIS, applies=turns),
        Effect("mistuning", False, "all blades are alike", applies=True),
        Effect(
            "friction",
            damped(scene),
            "a rigid wedge in every gap, at the speed of the crossing"
            if damped(scene)
            else "no output asks for the damped response",
            applies=damped(scene),
        ),
    ]


def needs(plan: BladedDiskPlan, threads: int) -> Needs:
    """What a point of a sweep with this plan needs, and may share with others."""
    del threads
    scene = plan.scene
    mesh = {"recipe": scene.recipe, "parameters": dict(plan.parameters)}
    return Needs(key_of(mesh | {"mesh": scene.mesh, "material": scene.material}), key_of(mesh))
