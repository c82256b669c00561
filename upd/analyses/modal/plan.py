"""Plan of a rig: which bodies are solved, in which mirror families, effects omitted, size and
cost.
"""

from __future__ import annotations

from typing import Any

from upd.analyses.base import Effect, Plan
from upd.analyses.cost import NODES, CostModel
from upd.errors import InputError
from upd.mesh import recipes
from upd.scene import RigScene

# Measured on one thread: figures and page, and pictures of modes per node.
_FILES_S, _PICTURES_S, _NODE_S = 1.6, 1.4, 2.5e-5


ModalPlan = Plan[RigScene]
#: check of the modes left out: how many times further they are searched for it
MODES_ABOVE, MORE_MODES = "modes above", 2.0


def configurations(scene: RigScene) -> list[tuple[str, str]]:
    """(arrangement, "free" | "glued") of every set of modes that is asked for."""
    kinds = [k for k in ("free", "glued") if scene.wants(k)]
    if scene.wants("reduction", "response") and "free" not in kinds:
        kinds.insert(0, "free")
    return [(a, k) for a in scene.modes.arrangements for k in kinds]


def parameters(scene: RigScene, arrangement: str, kind: str, symmetry: str) -> dict[str, Any]:
    """Parameters of the recipe for one configuration."""
    own = {k: v for k, v in scene.geometry.items() if k not in ("recipe", "arrangement", "damper")}
    chosen = {"arrangement": arrangement, "damper": "glued" if kind == "glued" else "none"}
    return {**own, **chosen, "symmetry": symmetry, "element_nodes": NODES[scene.mesh.element]}


def make_plan(scene: RigScene) -> ModalPlan:
    """Derive the plan of ``scene``. Raises InputError when its parts do not fit together."""
    symmetry = "half" if scene.mesh.symmetry == "auto" else scene.mesh.symmetry
    found = configurations(scene)
    if not found:
        raise InputError('want: asks for no modes, reduction or response; add "free" or "glued"')
    size = {
        f"{body}, {arrangement}": count
        for arrangement, kind in found
        for body, count in recipes.count(
            scene.recipe, parameters(scene, arrangement, kind, symmetry)
        ).items()
    }
    cost, families = CostModel(scene, size), 1 + (symmetry == "half")
    for body, count in cost.size.items():
        cost.dynamic_body(count)
        cost.modes(f"{body}, modes", count, families)
    _add_more(cost, scene, found[0][0])
    needs = cost.side_by_side(cost.threads, families * len(cost.size))
    nodes = cost.nodes if scene.wants("pictures") else 0
    files = _FILES_S + _PICTURES_S * (nodes > 0) + _NODE_S * nodes
    first = parameters(scene, *found[0], symmetry)
    return ModalPlan.of(cost, symmetry, first, _effects(scene, symmetry), needs, files)


def _add_more(cost: CostModel, scene: RigScene, arrangement: str) -> None:
    """Reduction and response, and what the modes left out would change."""
    if scene.wants("reduction"):
        whole = recipes.count(scene.recipe, parameters(scene, arrangement, "free", "full"))
        for body, count in whole.items():
            cost.dynamic_body(count)
            # patch, force and accelerometer
            kept = 3 * (count["contact"] + 2)
            cost.reduction(f"{body}, reduction", count, kept, scene.reduction.count)
    right = cost.size.get(f"right, {arrangement}")
    if scene.wants("response") and right is not None:
        cost.seconds += 0.3
        if scene.left_out.solves:
            cost.modes(f"right, {arrangement}, modes", right)


def _effects(scene: RigScene, symmetry: str) -> list[Effect]:
    """Each with why it is simulated, and why it is not, where the scene does not ask for it."""
    response, unasked, either = scene.wants("response"), "not asked for", Effect.either
    families = "modes even and odd about y = 0, each on half the rig"
    kept = f"{scene.reduction.words} a blade beside patch and probes"
    linear = "free and glued are linear; the damper's contact is the forced response's"
    return [
        either("mirror families", symmetry == "half", families, "asked for in the scene"),
        either("damper", scene.wants("glued"), "glued to both platforms", "no output asks for it"),
        Effect(
            f"modes above {scene.modes.below:g} Hz",
            False,
            "in the response by their static share" if response else unasked,
            MODES_ABOVE if response else "",
            (f"modes.below={MORE_MODES * scene.modes.below:g} Hz",),
            applies=response,
        ),
        either("reduction", scene.wants("reduction"), kept, unasked),
        either("response", response, "modal, from the modes found", unasked),
        either("centrifugal stiffening", False, "", "the rig does not turn"),
        either("friction", False, "", linear),
    ]
