"""Plan of a rig: which bodies are solved, in which mirror families, effects omitted, size and
cost.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from upd.analyses.base import Effect, Plan
from upd.analyses.cost import NODES, CostModel
from upd.errors import InputError
from upd.mesh import recipes
from upd.scene import RigScene

# Measured on one thread: SuperLU of a blade off resonance, seconds over n^2.3; figures and page,
# and pictures of modes per node.
_DIRECT_S, _DIRECT_POWER = 4.9e-10, 2.3
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
    size = _sizes(scene, found, symmetry)
    cost = CostModel(scene)
    families = 2 if symmetry == "half" else 1
    for body, count in size.items():
        cost.dynamic_body(count["hexes"], count["nodes"])
        cost.modes(f"{body}, modes", count["hexes"], count["nodes"], families)
    _add_more(cost, scene, size, found[0][0])
    memory, workers = cost.side_by_side(cost.threads, families * len(size))
    nodes = sum(count["nodes"] for count in size.values()) if scene.wants("pictures") else 0
    files = _FILES_S + _PICTURES_S * (nodes > 0) + _NODE_S * nodes
    first = parameters(scene, *found[0], symmetry)
    effects = tuple(_effects(scene, symmetry))
    return ModalPlan(
        scene,
        first,
        symmetry,
        effects,
        size,
        cost.solver,
        cost.total(workers) + files,
        memory,
        workers,
        files_seconds=files,
    )


def _add_more(
    cost: CostModel, scene: RigScene, size: Mapping[str, Mapping[str, int]], arrangement: str
) -> None:
    """Reduction and response, and what the modes left out would change."""
    if scene.wants("reduction"):
        whole = recipes.count(scene.recipe, parameters(scene, arrangement, "free", "full"))
        for body, count in whole.items():
            cost.dynamic_body(count["hexes"], count["nodes"])
            # patch, force and accelerometer
            kept = 3 * (count["contact"] + 2)
            hexes, nodes, modes = count["hexes"], count["nodes"], scene.reduction.count
            cost.reduction(f"{body}, reduction", hexes, nodes, kept, modes)
            if scene.wants("response") and body == "right":
                cost.seconds += _direct_seconds(count["nodes"])
    right = size.get(f"right, {arrangement}")
    if scene.wants("response") and right is not None:
        cost.seconds += 0.3 + _direct_seconds(right["nodes"])
        if scene.left_out.solves:
            cost.modes(f"right, {arrangement}, modes", right["hexes"], right["nodes"])


def _direct_seconds(nodes: int) -> float:
    """Two solutions off resonance."""
    return float(2.0 * _DIRECT_S * (3.0 * nodes) ** _DIRECT_POWER)


def _sizes(
    scene: RigScene, found: list[tuple[str, str]], symmetry: str
) -> dict[str, Mapping[str, int]]:
    out: dict[str, Mapping[str, int]] = {}
    for arrangement, kind in found:
        for body, count in recipes.count(
            scene.recipe, parameters(scene, arrangement, kind, symmetry)
        ).items():
            out[f"{body}, {arrangement}"] = dict(count)
    return out


def _effects(scene: RigScene, symmetry: str) -> list[Effect]:
    """Each with why it is simulated, and why it is not, where the scene does not ask for it."""
    response, unasked = scene.wants("response"), "not asked for"
    rows = [
        (
            "mirror families",
            symmetry == "half",
            "modes even and odd about y = 0, each on half the rig",
            "asked for in the scene",
        ),
        ("damper", scene.wants("glued"), "glued to both platforms", "no output asks for it"),
        (
            "reduction",
            scene.wants("reduction"),
            f"{scene.reduction.words} a blade beside patch and probes",
            unasked,
        ),
        ("response", response, "modal, from the modes found", unasked),
        ("centrifugal stiffening", False, "", "the rig does not turn"),
        (
            "friction",
            False,
            "",
            "free and glued are linear; the damper's contact is the forced response's",
        ),
    ]
    effects = [Effect(name, on, why if on else off, applies=on) for name, on, why, off in rows]
    above = Effect(
        f"modes above {scene.modes.below:g} Hz",
        False,
        "in the response by their static share" if response else unasked,
        MODES_ABOVE if response else "",
        (f"modes.below={MORE_MODES * scene.modes.below:g} Hz",),
        applies=response,
    )
    return [*effects[:2], above, *effects[2:]]
