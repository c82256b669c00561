"""Plan of a forced response.

What is simulated and left out, how that is checked afterwards, size and cost.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from upd.analyses.base import Needs, Plan
from upd.analyses.cost import NODES, CostModel, arrays_s, calls_s, dense_s
from upd.analyses.forced.effects import effects_of_faces, effects_of_points
from upd.analyses.forced.estimates_cost import estimate_seconds, reduced
from upd.analyses.forced.faces_cost import balance_seconds
from upd.analyses.forced.stiffness import check_sources, plans_to_solve
from upd.cache.sources import key_of
from upd.hbm.fourier import harmonics, sample_count
from upd.hbm.kept_factors import SOLUTIONS, WORTH_KEEPING
from upd.mesh import recipes
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS
from upd.scene.rig import rig_parameters

# Counted and timed on the ready scenes, their elements and harmonics, one thread. A point of a path
# that sticks, per contact point.
_STUCK_S = 1.9e-4
# A Newton step with new factors, and the steps beside it that go on with these: its small calls,
# each contact point, and each of its samples; the products for each entry of the Jacobian, times of
# its LU. About half of the points stick or are open over the whole cycle and are left out of the
# last two.
_STEP_S, _POINT_STEP_S, _SAMPLE_S, _ENTRY_S, _STEP_LU = 4.5e-4, 1.9e-5, 2e-7, 1.7e-8, 0.55
# Of large ones, steps for each new factor, and solutions with the kept ones in a step. Counted on
# F_C/F_E 194 with 64 rows of Gauss points a face, harmonics to 7 (2943 unknowns): 150 factors, 5500
# corrections, 24635 products. Rigs of 64 and 128 points with fewer harmonics take 4 to 5 steps a
# factor and 18 solutions a step (`benchmarks/speed/bench_response.py`).
_STEPS_KEPT, _SOLVED = 10.0, 19.0
# Newton steps of a curve over F_C/F_E: points that begin or end to slip are kinks of the path. Both
# faces of the symmetric damper slip, of the asymmetric one mostly the slope; finer lattices have no
# more kinks. At most so many per frequency asked for, and to begin with.
_KINKS = {"symmetric": 3.3e5, "asymmetric": 1.1e5}
_MOST, _LEAST = 12.0, 800.0
# Of these steps, the share that goes with the frequencies asked for in a unit of the logarithm, and
# how many of them that was counted with (1.3 points of the path for each, 1196 in all).
_ASKED_SHARE, _ASKED = 0.43, 400.0 / math.log(500.0 / 280.0)
# Newton steps of a peak at one ratio of the performance curve, for each of two peaks.
_PEAK, _PEAKS = 50.0, 2
# Curves of a band over the static states and the starts of the sliders.
_CHOICES = 6
# Newton steps of the band in which a peak is followed again.
_BAND = 260.0
# Bands of the run's own unknowns: the peak as it is, four slider starts that often end early, faces
# that fit without load, where the whole sweep may be searched; for each law of a contact the peak
# again as it is and with the softer k_t.
_BANDS, _BANDS_LAW = 1.0 + 3.0 + 3.0, 2.0
# Lines of contact points up the slope of a patch whose rows are all taken, at refine 1.
_ROWS = {"symmetric": 5.0, "asymmetric": 4.0}
# Whole faces: sweeps of each F_C/F_E; frequencies of one for each unit of the logarithm, with those
# beside peaks; time steps at each; of a step the calls, and the time for each dof of the contact;
# dense products and factors of one frequency; matrices of all dofs at a time.
_WAYS, _CLOSER, _MARCHED = 2.0, 130.0, 3.2e4
_AT_ONCE_S, _DOF_S, _FACTORS, _MATRICES = 4e-6, 1.5e-7, 4.0, 10.0
# Sweeps of contact points: F_C/F_E below which some move; periods of a sweep up and one down, where
# faces rattle many of them without settling, and of a performance curve's coarser ones; of a time
# step what it always takes, and what each point does. Other static states of a band.
_MOVING = {"symmetric": 1.0e3, "asymmetric": 3.0e3}
_PERIODS = {"symmetric": 2.0e4, "asymmetric": 4.5e4}
_COARSER, _SPRING_S, _POINT_S = 0.4, 1.2e-6, 4e-8
_STATES = {"symmetric": 2.0, "asymmetric": 1.0}
# F_C/F_E of a performance curve swept beside the optimum.
_BESIDE = 2.0
# Figures, files and page, and those of a curve.
_FILES_S, _CURVE_S = 4.0, 1.0


@dataclass(frozen=True)
class CoarserMesh:
    """A level before that of the run: its counts and growths, its size over that of the run or 0
    where only the meshes tell it, in words.
    """

    counts: Mapping[str, float]
    size: float
    label: str


@dataclass(frozen=True)
class ForcedPlan(Plan[ForcedScene]):
    """Plan of a forced response.

    Attributes
    ----------
    asked
        The scene as asked for, where that leaves the levels to an accuracy.
    coarser
        Meshes that the error of the mesh is estimated with, the finest first; the usual ones when
        empty.
    """

    asked: ForcedScene | None = None
    coarser: tuple[CoarserMesh, ...] = ()


#: time steps in a period of every march where the scene names none
MARCH_SAMPLES = 128
#: every so many F_C/F_E of a performance curve are swept before it is known where the optimum lies
EVERY = 3


def make_plan(scene: ForcedScene) -> ForcedPlan:
    """Derive the plan of ``scene``. Raises InputError when its parts do not fit together."""
    parameters = _parameters(scene)
    whole = scene.contact.model == "interface"
    if not whole:
        check_sources(scene)
    size: dict[str, Mapping[str, int]] = {
        body: dict(count) for body, count in recipes.count(scene.recipe, parameters).items()
    }
    cost, memory, workers = _whole_faces_cost(scene, size) if whole else _cost(scene, size)
    again = 0.0 if whole or not scene.estimates else _estimate_seconds(scene, size, workers)
    return ForcedPlan(
        scene,
        parameters,
        "full" if scene.mesh.symmetry == "full" else "half",
        tuple(effects_of_faces(scene) if whole else effects_of_points(scene)),
        size,
        cost.solver,
        cost.total(workers) + again,
        memory,
        workers,
        estimate_seconds=again,
        files_seconds=_files_seconds(scene),
    )


def _whole_faces_cost(
    scene: ForcedScene, size: Mapping[str, Mapping[str, int]]
) -> tuple[CostModel, float, int]:
    """As `_cost`, of both faces node by node."""
    cost = CostModel(scene)
    for body, count in size.items():
        cost.dynamic_body(count["hexes"], count["nodes"])
        cost.condensed(f"{body}, compliance", count["hexes"], count["nodes"], 3 * count["contact"])
    m = 3.0 * (size["left"]["contact"] + size["right"]["contact"])
    e = scene.excitation
    ways = _WAYS * (scene.balance.method != "balance")
    marched = ways * len(e.centrifugal_to_force) * _CLOSER * math.log(e.stop / e.start)
    cost.seconds += balance_seconds(scene, m)
    cost.seconds += arrays_s(marched * _MARCHED * (_AT_ONCE_S + _DOF_S * m))
    cost.seconds += marched * dense_s(_FACTORS * m**3)
    cost.seconds += _files_seconds(scene)
    cost.kept_bytes += _MATRICES * 8.0 * m**2
    memory, workers = cost.side_by_side(min(2, cost.threads), 2)
    return cost, memory, workers


def _files_seconds(scene: ForcedScene) -> float:
    """Figures, files and page."""
    curves = len(scene.stiffnesses) * len(scene.excitation.centrifugal_to_force)
    whole = scene.contact.model == "interface"
    return calls_s(_FILES_S + _CURVE_S * curves * (not whole))


def _parameters(scene: ForcedScene) -> dict[str, Any]:
    # points on lines pair themselves; what is left out is solved on whole blades
    apart = scene.contact.rule == GAUSS and not scene.left_out.solves
    half = (scene.contact.model == "interface" or apart) and scene.mesh.symmetry != "full"
    return rig_parameters(scene, "half" if half else "full", NODES[scene.mesh.element])


def _cost(
    scene: ForcedScene, size: Mapping[str, Mapping[str, int]]
) -> tuple[CostModel, float, int]:
    """Seconds and solvers, bytes, and blades reduced side by side."""
    cost = CostModel(scene)
    for body in ("left", "right"):
        hexes, nodes = size[body]["hexes"], size[body]["nodes"]
        cost.dynamic_body(hexes, nodes)
        reduced(cost, scene, body, f"{body}, reduction", (hexes, nodes, size[body]["contact"]))
    if scene.left_out.solves:
        # K and M of the elastic damper, once per stiffness
        damper = size["damper"]
        cost.dynamic_body(damper["hexes"], damper["nodes"], len(scene.stiffnesses))
    sources = plans_to_solve(scene)
    cost.seconds += sum(plan.solve_seconds for plan in sources)
    cost.seconds += _path_seconds(scene, size)
    if scene.balance.method != "balance":
        cost.shared += _sweep_seconds(scene, size)
    cost.seconds += _files_seconds(scene)
    memory, workers = cost.side_by_side(min(2, cost.threads), 2)
    return cost, max([memory, *(plan.memory_bytes for plan in sources)]), workers


def _path_seconds(scene: ForcedScene, size: Mapping[str, Mapping[str, int]]) -> float:
    """All curves, the performance curve, and what is left out."""
    asked, e = scene.excitation.points, scene.excitation
    points, step = _points(scene, size), _step_seconds(scene, size)
    stuck = arrays_s(_STUCK_S * points) * asked * len(e.centrifugal_to_force)
    dense = asked / math.log(e.stop / e.start) / _ASKED
    kinks = _KINKS[scene.arrangement] * (1.0 - _ASKED_SHARE + _ASKED_SHARE * dense)
    steps = sum(min(kinks / ratio, _LEAST + _MOST * asked) for ratio in e.centrifugal_to_force)
    seconds = len(scene.stiffnesses) * (stuck + steps * step * (scene.contact.friction > 0.0))
    marched = scene.balance.method != "balance"
    if scene.wants("performance") and not marched:
        seconds += _PEAKS * _PEAK * scene.performance.points * step
    if scene.wants("band") and not marched:
        # every curve again from other states, in fewer points
        seconds += _CHOICES * steps * step * (scene.contact.friction > 0.0)
    if scene.left_out.solves:
        seconds += _again_seconds(scene, size)
    return seconds


def _estimate_seconds(
    scene: ForcedScene, size: Mapping[str, Mapping[str, int]], workers: int
) -> float:
    """Companions that errors are estimated from, and peaks on them."""
    steps = 0.0 if not scene.contact.friction else _step_seconds(scene, size)
    marched = scene.balance.method != "balance" and scene.contact.friction > 0.0
    swept = len(scene.stiffnesses) * _swept_curves(scene) if marched else 0.0
    period = time_steps(scene) * (_SPRING_S + _POINT_S * _points(scene, size))
    return estimate_seconds(scene, size, workers, steps, period, swept)


def _swept_curves(scene: ForcedScene) -> float:
    """F_C/F_E at which points move."""
    limit, moving = _MOVING[scene.arrangement], scene.balance.method == "march"
    return float(sum(moving or ratio < limit for ratio in scene.excitation.centrifugal_to_force))


def _sweep_seconds(scene: ForcedScene, size: Mapping[str, Mapping[str, int]]) -> float:
    """Sweeps up and down of every curve on which points move, from the other static states where a
    band is asked for, and those of the performance curve.
    """
    if not scene.contact.friction:
        return 0.0
    limit = _MOVING[scene.arrangement]
    pairs = len(scene.stiffnesses) * _swept_curves(scene)
    if scene.wants("band"):
        pairs += _STATES[scene.arrangement] * len(scene.excitation.centrifugal_to_force)
    if scene.wants("performance"):
        c = scene.performance
        part = math.log(min(limit, c.highest) / c.lowest) / math.log(c.highest / c.lowest)
        pairs += _COARSER * (max(part, 0.0) * c.points / EVERY + _BESIDE)
    step = arrays_s(_SPRING_S + _POINT_S * _points(scene, size))
    return pairs * _PERIODS[scene.arrangement] * time_steps(scene) * step


def time_steps(scene: ForcedScene) -> int:
    """Steps in a period of every march."""
    given = scene.balance.samples
    return MARCH_SAMPLES if given == "auto" else int(given)


def _balance_samples(scene: ForcedScene) -> int:
    """Samples of a period of the balance."""
    given = scene.balance.samples
    return sample_count(harmonics(range(_highest(scene) + 1)), None if given == "auto" else given)


def _again_seconds(scene: ForcedScene, size: Mapping[str, Mapping[str, int]]) -> float:
    """A peak followed again for every effect left out, each with the unknowns it takes."""
    laws = sum(choice.from_contact for choice in scene.stiffnesses.values())
    others = []
    if scene.mesh.symmetry != "full":
        others.append(replace(scene, mesh=replace(scene.mesh, symmetry="full")))
        if scene.contact.directions != "two" and scene.contact.friction > 0.0:
            others.append(replace(scene, contact=replace(scene.contact, directions="two")))
    steps = (_BANDS + _BANDS_LAW * laws) * _step_seconds(scene, size)
    return _BAND * (steps + sum(_step_seconds(one, size) for one in others))


def _step_seconds(
    scene: ForcedScene, size: Mapping[str, Mapping[str, int]], times: float = 1.0
) -> float:
    """Seconds of a Newton step with its factors, with so many times the contact points."""
    points, n = times * _points(scene, size), times * _unknowns(scene, size)
    factor = dense_s(_STEP_LU * 2.0 / 3.0 * n**3)
    factors = arrays_s(_ENTRY_S * n**2) + factor
    if n > WORTH_KEEPING:
        factors = min(factors, factors / _STEPS_KEPT + _SOLVED * factor * SOLUTIONS / n)
    samples = _SAMPLE_S * _balance_samples(scene)
    return calls_s(_STEP_S + (_POINT_STEP_S + samples) * points) + factors


def _points(scene: ForcedScene, size: Mapping[str, Mapping[str, int]]) -> float:
    """Contact points of both faces."""
    return sum(_point_count(scene, size[side]["contact"], side) for side in ("left", "right"))


def _highest(scene: ForcedScene) -> int:
    """The highest harmonic, of adaptive ones a usual one."""
    return 3 if scene.balance.harmonics == "adaptive" else int(scene.balance.harmonics)


def _unknowns(scene: ForcedScene, size: Mapping[str, Mapping[str, int]]) -> float:
    """Unknowns of a point: coefficients of the motion of the contact points."""
    across = 3 if scene.contact.directions == "two" or scene.mesh.symmetry == "full" else 2
    return across * _points(scene, size) * (2 * _highest(scene) + 1)


def newton_seconds(plan: ForcedPlan) -> float:
    """Of a Newton step of the run, with its factors."""
    return _step_seconds(plan.scene, plan.size)


def points_growth(plan: ForcedPlan) -> float:
    """Of the seconds of a curve with twice the contact points."""
    size = {body: dict(count) for body, count in plan.size.items()}
    return _step_seconds(plan.scene, size, 2.0) / _step_seconds(plan.scene, size)


def _point_count(scene: ForcedScene, nodes: int, side: Any) -> float:
    """Contact points of a face, roughly: a few rows of many columns, and one for itself and its
    mirror image.
    """
    corners = nodes / {8: 1.0, 20: 2.7, 27: 4.0}[NODES[scene.mesh.element]]
    rows = _ROWS[scene.arrangement] * float(scene.geometry.get("refine", 1))
    usual = {"rows": rows, "columns": max(1.0, corners / rows)}
    product = 1.0
    for name, choice in zip(usual, scene.contact.lines(side), strict=True):
        lines = (
            usual[name]
            if choice == "all"
            else float(choice)
            if isinstance(choice, int)
            else float(len(choice))
        )
        if name == "columns" and scene.mesh.symmetry != "full":
            lines = float(int(lines + 1) // 2)
        product *= lines
    return product


def needs(plan: ForcedPlan, threads: int) -> Needs:
    """What a point of a sweep with this plan needs, and may share with others."""
    del threads
    scene = plan.scene
    mesh = {"recipe": scene.recipe, "parameters": dict(plan.parameters)}
    model = mesh | {"mesh": scene.mesh, "material": scene.material, "reduction": scene.reduction}
    return Needs(key_of(model), key_of(mesh))
