"""The cheapest mesh that reaches a wanted accuracy, verified by its own error estimate on two levels."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from upd.errors import ConvergenceError, InputError
from upd.plan import Plan, auto_patch, make_plan
from upd.reference import contact_modulus, hertz_sphere
from upd.results import Row
from upd.scene import Scene
from upd.study.convergence import two_level_error

log = logging.getLogger("upd.study")

#: (name, case) -> estimated relative error, predicted seconds of half that error.
Estimates = dict[tuple[str, str], tuple[float, float]]

#: Numbers the accuracy is asked of; the others carry their estimate beside them.
GOVERNING = ("radius_moment", "max_pressure", "mean_pressure", "approach", "tangential_displacement_raw", "K_N_tangent_raw")
#: Nodes along the contact radius of the smallest load, level by level (ratio about sqrt 2).
LEVELS = (3.0, 4.2, 6.0, 8.5, 12.0, 17.0, 24.0)
#: Error estimate times nodes along the contact radius, measured on the Hertz scene: what to expect of a level before it has run.
_FIRST = 0.1


@dataclass(frozen=True)
class Level:
    """One level of the ladder: the scene at that mesh, its plan, and its rows and seconds once it has run."""

    scene: Scene
    plan: Plan
    rows: tuple[Row, ...] = ()
    seconds: float = 0.0


def level_scene(scene: Scene, level: int) -> Scene:
    """``scene`` with patch and divisions for ``level``: a patch sized from the largest load, spacing from the smallest."""
    if "radius" not in scene.geometry:
        raise InputError(f"mesh.accuracy: the recipe {scene.recipe!r} has no contact radius to size the mesh from; give geometry.divisions")
    loads = [F for F in scene.loads.normal if F > 0.0]
    if not loads:
        raise InputError("mesh.accuracy: needs a positive normal load to size the mesh")
    m1, m2 = list(scene.materials.values())[:2]
    E = contact_modulus(m1.E, m1.nu, m2.E, m2.nu)
    radius = hertz_sphere(min(loads), float(scene.geometry["radius"]), E).radius
    given = scene.geometry.get("patch", "auto")
    patch = auto_patch(scene, max(loads)) if given == "auto" else float(given)
    divisions = 2 * math.ceil(0.5 * patch / radius * LEVELS[level])
    if scene.mesh.element in ("hex20", "hex27"):
        divisions = 2 * math.ceil(divisions / 4)
    geometry = {**scene.geometry, "patch": patch, "divisions": max(4, divisions)}
    return replace(scene, geometry=geometry, mesh=replace(scene.mesh, accuracy=None))


def predicted_plan(scene: Scene) -> Plan:
    """The plan of the level that first-order convergence from `_FIRST` suggests; `choose` may end one level off. Nothing is solved."""
    target = scene.mesh.accuracy
    assert target is not None
    level = next((k for k, nodes in enumerate(LEVELS) if _FIRST / nodes <= target), len(LEVELS) - 1)
    return make_plan(level_scene(scene, level))


def choose(scene: Scene, solve: Callable[[Plan], tuple[tuple[Row, ...], float]]) -> tuple[Plan, Estimates]:
    """Find the cheapest level that reaches ``scene.mesh.accuracy``.

    solve : runs a plan and returns its rows and seconds (called on light versions of the scene: no curve, no fields).

    Returns the plan of the chosen level and, per (name, case), the estimated relative error and the predicted seconds of half that error.
    Levels are tried from coarse to fine; each level but the first is judged by its difference from the level before
    (`upd.study.convergence.two_level_error`, first order). Raises ConvergenceError when the finest level misses the target.
    """
    target = scene.mesh.accuracy
    assert target is not None
    light = replace(scene, want=tuple(w for w in scene.want if w not in ("curve", "fields", "cycle")))
    coarse: Level | None = None
    worst = float("inf")
    for k in range(len(LEVELS)):
        here = level_scene(light, k)
        plan = make_plan(here)
        rows, seconds = solve(plan)
        fine = Level(here, plan, rows, seconds)
        if coarse is not None:
            estimates = estimate(coarse, fine)
            judged = {key: e for key, (e, _) in estimates.items() if key[0] in GOVERNING}
            name, worst = max(judged.items(), key=lambda item: item[1])
            log.info("accuracy: level %d, %s estimated at %.3g, target %.3g", k, " ".join(name), worst, target)
            if worst <= target:
                return make_plan(level_scene(scene, k)), estimates
        coarse = fine
    raise ConvergenceError(
        f"mesh.accuracy: the finest level reaches {100 * worst:.2g} % of the wanted {100 * target:.2g} %: ask for less, "
        "or give geometry.divisions yourself"
    )


def estimate(coarse: Level, fine: Level) -> Estimates:
    """Estimated error of the fine level and predicted seconds of a mesh with half of it (first order: half the spacing)."""
    ratio = _spacing(coarse.plan) / _spacing(fine.plan)
    before = {(r.name, r.case): r.value for r in coarse.rows}
    half = _half_cost(fine)
    return {
        (r.name, r.case): (two_level_error(before[r.name, r.case], r.value, ratio), half) for r in fine.rows if (r.name, r.case) in before
    }


def _spacing(plan: Plan) -> float:
    return float(plan.parameters["patch"]) / float(plan.parameters["divisions"])


def _half_cost(fine: Level) -> float:
    """Seconds of a mesh with half the spacing: measured seconds times the ratio of predictions."""
    geometry = {**fine.scene.geometry, "divisions": 2 * int(fine.plan.parameters["divisions"])}
    finer = make_plan(replace(fine.scene, geometry=geometry))
    return fine.seconds * finer.seconds / fine.plan.seconds
