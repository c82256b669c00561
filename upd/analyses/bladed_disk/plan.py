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
# Figures, page.
_FILES_S = 1.5
# Bytes of the complex problem of a nodal diameter over those of the real sector: of its modes,
# with its reduction (recorded: 3.4 at 3000 dofs, 3.6 to 3.9 at 54 000).
_COMPLEX, _REDUCED = 2.0, 4.0
# A damped curve, in seconds of one thread (recorded: 4 to 10), at so many unknowns.
_CURVE_S, _UNKNOWNS = 6.0, 756.0


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
        # the check solves one more; of the harmonics, some share a nodal diameter
        most = min(scene.response.harmonics + 1, scene.n_sectors // 2 + 1)
        times = len(computed(scene)) + 1 + most * damped(scene)
        cost.modes(f"{body}, modes", count["hexes"], count["nodes"], times)
        cost.shared += _curves_s(scene, count["contact"])
    cost.jobs = [(_REDUCED if damped(scene) else _COMPLEX) * one for one in cost.jobs]
    memory, workers = cost.side_by_side(cost.threads, len(computed(scene)))
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


def _curves_s(scene: BladedDiskScene, contact: int) -> float:
    """Seconds of the damped curves, of one thread."""
    curves = 1.5 * damped(scene) + len(scene.response.ratios) * scene.wants("performance")
    unknowns = 6 * contact * (2 * scene.response.harmonics + 1)
    return float(curves * _CURVE_S * (unknowns / _UNKNOWNS) ** 1.5)


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
