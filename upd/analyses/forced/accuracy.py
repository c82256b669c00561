"""Levels of a forced response that reach a wanted accuracy at the least cost.

Mesh, modes kept, contact points, harmonics, samples of a period: rounds solve the peaks, estimate
what every source leaves in them, and raise what pays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

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
    of_geometry,
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
from upd.vary.solve import changed
from upd.vary.variation import Overrides, SolvedVariation
from upd.vary.wanted import LevelChoice, Wanted, plan_wanted, solve_wanted

#: names of accuracies -> numbers they are asked of
ASKED = {"peak_frequency": "peak_?_frequency", "peak": "peak_?_accelerance"}
#: times the elements of the coarsest graded mesh; the first level is the scene's own mesh
_FINER = (1, 1.5, 2, 2.5, 3)
#: times the samples
_MORE_SAMPLES = (1, 2, 4, 8)
#: Gauss points up the slope in place of the scene's lines, which are the first level, and those
#: along the damper
_GAUSS, _COLUMNS = (0, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64), 2
_MODES = (5, 10, 20, 40)
_HARMONICS = (1, 3, 5, 7, 9, 11, 13)


def choices(scene: ForcedScene) -> list[LevelChoice]:
    """What may be chosen of a scene, by source.

    The scene's own mesh and contact points are the lowest levels, finer meshes are graded
    (`mesh_counts.graded`); numbers of modes and harmonics may fall below its own. Gauss points
    stand for a face whatever its mesh, so that both errors fall, each by its own choice.
    """
    found = [
        _choice(MODES, "modes kept", _MODES, _modes, "{} a blade"),
        _choice(HARMONICS, "harmonics", _HARMONICS, _highest, "to {}"),
        _choice(SAMPLES, "samples", _MORE_SAMPLES, _samples, "x {}"),
    ]
    if scene.recipe == RECIPE:
        found.insert(0, _choice(MESH, "mesh", _FINER, _mesh, "graded x {:g}", own=True))
    if _raisable(scene):
        # before the mesh, which it decides the counts of
        words = "{} Gauss points up the slope"
        found.insert(0, _choice(POINTS, "contact points", _GAUSS, _points, words, own=True))
    return found


def _choice(
    source: str,
    name: str,
    levels: Sequence[float],
    overrides: Callable[[ForcedScene, Any], Overrides],
    words: str,
    *,
    own: bool = False,
) -> LevelChoice:
    """Levels as overrides of the scene; ``own``: the first is the scene's."""
    labels = [words.format(n) for n in levels]
    if own:
        labels[0] = "of the scene"

    def at(scene: ForcedScene, k: int) -> ForcedScene:
        given: ForcedScene = changed(scene, overrides(scene, levels[k]))
        return scene if own and k == 0 else given

    return LevelChoice(source, name, labels, at)


def _raisable(scene: ForcedScene) -> bool:
    """Whether Gauss points can stand for the scene's: not for lines that it names."""
    return (
        scene.contact.rule != GAUSS
        and scene.contact.share == "area"
        and not lines_named(scene.contact)
    )


def _mesh(scene: ForcedScene, factor: float) -> Overrides:
    return of_geometry(graded(scene, factor))


def _points(scene: ForcedScene, rows: int) -> Overrides:
    del scene
    return with_gauss(rows, _COLUMNS)


def _modes(scene: ForcedScene, count: int) -> Overrides:
    del scene
    return (("reduction.modes", count),)


def _highest(scene: ForcedScene, harmonic: int) -> Overrides:
    del scene
    return (("balance.harmonics", harmonic),)


def _samples(scene: ForcedScene, factor: int) -> Overrides:
    if factor == 1:
        return ()
    needed = sample_count(harmonics(scene.harmonic_numbers))
    return (("balance.samples", factor * max(needed, time_steps(scene))),)


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
