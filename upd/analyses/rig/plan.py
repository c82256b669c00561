"""Plan of a rig: which bodies are solved, in which mirror families, what is left out, size and cost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from upd import recipes
from upd.errors import InputError
from upd.linalg import select
from upd.plan import NODES, AnyPlan, Effect
from upd.scene import RigScene

# Measured on one core at 2.1 GHz: matrices K and M in microseconds per hexahedron; Lanczos over the factorisation.
_ASSEMBLY_US = {"hex8": 20.0, "hex8i": 30.0, "hex20": 200.0, "hex27": 350.0}
_LANCZOS = 1.5
_START_S, _START_BYTES = 4.0, 2.5e8

RigPlan = AnyPlan[RigScene]


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


def make_plan(scene: RigScene) -> RigPlan:
    """Derive the plan of ``scene``. Raises InputError when its parts do not fit together."""
    symmetry = "half" if scene.mesh.symmetry == "auto" else scene.mesh.symmetry
    found = configurations(scene)
    if not found:
        raise InputError('want: asks for no modes, reduction or response; add "free" or "glued"')
    size = _sizes(scene, found, symmetry)
    seconds, memory, solver, workers = _cost(scene, size, symmetry)
    first = parameters(scene, *found[0], symmetry)
    return RigPlan(scene, first, symmetry, (), tuple(_effects(scene, symmetry)), size, solver, seconds, memory, workers)


def _sizes(scene: RigScene, found: list[tuple[str, str]], symmetry: str) -> dict[str, Mapping[str, int]]:
    out: dict[str, Mapping[str, int]] = {}
    for arrangement, kind in found:
        for body, count in recipes.count(scene.recipe, parameters(scene, arrangement, kind, symmetry)).items():
            out[f"{body}, {arrangement}"] = dict(count)
    return out


def _cost(scene: RigScene, size: Mapping[str, Mapping[str, int]], symmetry: str) -> tuple[float, float, dict[str, str], int]:
    families = 2 if symmetry == "half" else 1
    seconds, memory, largest, solver = _START_S, _START_BYTES, 0.0, {}
    for body, count in size.items():
        choice = select.choose(3 * count["nodes"], 0, solver=scene.solver.name, memory_limit_bytes=scene.solver.memory)
        predicted = select.predict(3 * count["nodes"], 0, choice.name)
        seconds += 1e-6 * count["hexes"] * _ASSEMBLY_US[scene.mesh.element] + families * (1.0 + _LANCZOS) * predicted.seconds
        largest = max(largest, predicted.bytes)
        solver[f"{body}, modes"] = f"{choice.name}: {choice.why}"
    workers = select.threads() if all(why.startswith("pardiso") for why in solver.values()) else 1
    return seconds, memory + min(workers, families * len(size)) * largest, solver, workers


def _effects(scene: RigScene, symmetry: str) -> list[Effect]:
    half = symmetry == "half"
    return [
        Effect("mirror families", half, "modes even and odd about y = 0, each on half the rig" if half else "asked for in the scene"),
        Effect("damper", scene.wants("glued"), "glued to both platforms" if scene.wants("glued") else "no output asks for it"),
        Effect(f"modes above {scene.modes.below:g} Hz", False, "not asked for", "band"),
        Effect(
            "reduction",
            scene.wants("reduction"),
            f"{scene.reduction.words} a blade beside patch and probes" if scene.wants("reduction") else "not asked for",
        ),
        Effect("response", scene.wants("response"), "modal, from the modes found" if scene.wants("response") else "not asked for"),
        Effect("centrifugal stiffening", False, "the rig does not turn"),
        Effect("friction", False, "free and glued are linear; the damper's contact is the forced response's"),
    ]
