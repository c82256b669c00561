"""Levels of a forced response that reach a wanted accuracy at the least cost.

Mesh, modes kept, contact points, harmonics, samples of a period: rounds solve the peaks, estimate
what every source leaves in them, and raise what pays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from upd.analyses.base import chosen_by_accuracy, refuse_oversize
from upd.analyses.forced.estimates import estimate
from upd.analyses.forced.levels import (
    HARMONICS,
    MESH,
    MODES,
    POINTS,
    RECIPE,
    SAMPLES,
    graded,
    lines_named,
    with_gauss,
)
from upd.analyses.forced.plan import ForcedPlan, make_plan, time_steps
from upd.analyses.forced.results import make_results
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.solve import solve
from upd.hbm.core.fourier import harmonics, sample_count
from upd.progress import Stages
from upd.results import Estimates, Result
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS
from upd.vary.variation import SolvedVariation
from upd.vary.wanted import LevelChoice, Wanted, plan_wanted, solve_wanted

#: names of accuracies -> numbers they are asked of
ASKED = {"peak_frequency": "peak_?_frequency", "peak": "peak_?_accelerance"}
#: times the elements of the coarsest graded mesh; the first level is the scene's own mesh
_FINER = (1, 1.5, 2, 2.5, 3)
#: times the samples
_MORE_SAMPLES = (1, 2, 4, 8)
#: Gauss points up the slope in place of the scene's lines, and those along the damper
_GAUSS, _COLUMNS = (3, 4, 6, 8, 12, 16, 24, 32, 48, 64), 2
_MODES = (5, 10, 20, 40)
_HARMONICS = (1, 3, 5, 7, 9, 11, 13)


def choices(scene: ForcedScene) -> list[LevelChoice]:
    """What may be chosen of a scene, by source.

    The scene's own mesh and contact points are the lowest levels, finer meshes are graded
    (`mesh_counts.graded`); numbers of modes and harmonics may fall below its own. Gauss points
    stand for a face whatever its mesh, so that both errors fall, each by its own choice.
    """
    found = [
        _choice(MODES, "modes kept", _MODES, _with_modes, "{} a blade"),
        _choice(HARMONICS, "harmonics", _HARMONICS, _with_harmonics, "to {}"),
        _choice(SAMPLES, "samples", _MORE_SAMPLES, _with_samples, "x {}"),
    ]
    if scene.recipe == RECIPE:
        labels = ("of the scene", *(f"graded x {n:g}" for n in _FINER[1:]))
        found.insert(0, LevelChoice(MESH, "mesh", labels, _with_mesh))
    if _raisable(scene):
        # before the mesh, which it decides the counts of
        labels = ("of the scene", *(f"{n} Gauss points up the slope" for n in _GAUSS))
        found.insert(0, LevelChoice(POINTS, "contact points", labels, _with_points))
    return found


def _choice(
    source: str,
    name: str,
    levels: tuple[int, ...],
    made: Callable[[ForcedScene, int], ForcedScene],
    words: str,
) -> LevelChoice:
    labels = [words.format(n) for n in levels]
    return LevelChoice(source, name, labels, lambda one, k: made(one, levels[k]))


def _raisable(scene: ForcedScene) -> bool:
    """Whether Gauss points can stand for the scene's: not for lines that it names."""
    return (
        scene.contact.rule != GAUSS
        and scene.contact.share == "area"
        and not lines_named(scene.contact)
    )


def _with_mesh(scene: ForcedScene, level: int) -> ForcedScene:
    if level == 0:
        return scene
    return replace(scene, geometry={**scene.geometry, **graded(scene, _FINER[level])})


def _with_points(scene: ForcedScene, level: int) -> ForcedScene:
    if level == 0:
        return scene
    return replace(scene, contact=with_gauss(scene.contact, _GAUSS[level - 1], _COLUMNS))


def _with_modes(scene: ForcedScene, count: int) -> ForcedScene:
    return replace(scene, reduction=replace(scene.reduction, modes=count))


def _with_harmonics(scene: ForcedScene, highest: int) -> ForcedScene:
    return replace(scene, balance=replace(scene.balance, harmonics=highest))


def _with_samples(scene: ForcedScene, factor: int) -> ForcedScene:
    if factor == 1:
        return scene
    needed = sample_count(harmonics(range(int(scene.balance.harmonics) + 1)))
    count = factor * max(needed, time_steps(scene))
    return replace(scene, balance=replace(scene.balance, samples=count))


def _trial(scene: ForcedScene) -> ForcedScene:
    return replace(scene, want=("response",), left_out=replace(scene.left_out, solve="no"))


def _estimate(
    solution: ForcedSolution,
    numbers: Sequence[Result],
    stages: Stages,
    memo: list[SolvedVariation],
) -> Estimates:
    """By the levels that the solution has itself."""
    del memo
    return estimate(solution, numbers, stages)


WANTED = Wanted(
    choices,
    ASKED,
    make_plan,
    solve,
    make_results,
    _estimate,
    refuse_oversize,
    chosen_by_accuracy,
    _trial,
)


def plan_to_accuracy(scene: ForcedScene) -> ForcedPlan:
    """The plan of a scene, as `upd.vary.wanted.plan_wanted`."""
    plan: ForcedPlan = plan_wanted(WANTED, make_plan, scene)
    return plan


def solve_to_accuracy(plan: ForcedPlan, stages: Stages) -> ForcedSolution:
    """Run the plan, as `upd.vary.wanted.solve_wanted`."""
    solution: ForcedSolution = solve_wanted(WANTED, plan, stages)[0]
    return solution
