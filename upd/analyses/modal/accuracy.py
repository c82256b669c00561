"""Levels of a rig that reach a wanted accuracy at the least cost: its mesh, the modes kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from upd.analyses import accuracy_rounds
from upd.analyses.accuracy_rounds import AT_BEST, Rounds, Setting, mesh_falls
from upd.analyses.levels_choice import Knob, Levels
from upd.analyses.modal import varied
from upd.analyses.modal.plan import ModalPlan, make_plan
from upd.analyses.modal.results import make_results
from upd.analyses.modal.solve import ModalSolution, solve
from upd.progress import Stages
from upd.results import Estimates, Result
from upd.scene import RigScene
from upd.vary import errors

#: numbers that one accuracy for all is asked of
_GOVERNING = ("f*_free", "f*_glued", "f*_reduced")
#: times the elements along an edge, and numbers of modes kept
_FINER, _MODES = (1, 2, 3), (5, 10, 20, 40)


def settings_of(scene: RigScene) -> list[Setting]:
    """What may be chosen of a rig: its refinement from its own up, and the number of modes kept."""
    found = []
    if isinstance(scene.geometry.get("refine"), (int, float)):
        labels = tuple(f"x {n}" for n in _FINER)
        knob = Knob((varied.MESH,), "elements along an edge", labels, mesh_falls(_FINER))
        found.append(Setting(knob, lambda one, k: _refined(one, _FINER[k])))
    if scene.wants("reduction") and scene.reduction.below is None and scene.reduction.error is None:
        falls = tuple((_MODES[0] / n) ** AT_BEST for n in _MODES)
        knob = Knob((varied.KEPT,), "modes kept", tuple(f"{n} a blade" for n in _MODES), falls)
        found.append(Setting(knob, lambda one, k: _reduced(one, _MODES[k])))
    return found


def _refined(scene: RigScene, times: int) -> RigScene:
    if times == 1:
        return scene
    return replace(
        scene, geometry={**scene.geometry, "refine": times * float(scene.geometry["refine"])}
    )


def _reduced(scene: RigScene, count: int) -> RigScene:
    return replace(scene, reduction=replace(scene.reduction, modes=count))


def _trial(scene: RigScene) -> RigScene:
    return replace(scene, left_out=replace(scene.left_out, solve="no"))


def _planned(
    asked: RigScene, settings: Sequence[Setting], levels: Levels, scene: RigScene
) -> ModalPlan:
    """With the meshes of the levels before, the finest first."""
    place = next((k for k, s in enumerate(settings) if s.knob.sources == (varied.MESH,)), None)
    own = 0 if place is None else levels[place]
    coarser = tuple(_FINER[k] / _FINER[own] for k in reversed(range(own)))
    plan = replace(make_plan(scene), coarser=coarser)
    return varied.with_variations(plan)


ROUNDS = Rounds(
    settings_of,
    {name: name for name in _GOVERNING},
    _trial,
    _planned,
    solve,
    make_results,
    partial(errors.estimate, varied.PROBLEM),
)


def plan_to_accuracy(scene: RigScene) -> ModalPlan:
    """The plan of a scene, as `upd.analyses.accuracy_rounds.plan_to_accuracy`."""
    plan: ModalPlan = accuracy_rounds.plan_to_accuracy(ROUNDS, scene, varied.plan_with_estimates)
    return plan


def solve_to_accuracy(plan: ModalPlan, stages: Stages) -> ModalSolution:
    """Run the plan, as `upd.analyses.accuracy_rounds.solve_to_accuracy`."""
    solution: ModalSolution
    solution, found = accuracy_rounds.solve_to_accuracy(ROUNDS, plan, stages)
    return replace(solution, estimates=found)


def estimate(solution: ModalSolution, numbers: Sequence[Result], stages: Stages) -> Estimates:
    """The errors of all numbers: those of the rounds, where levels were chosen by an accuracy."""
    if solution.estimates is not None:
        return solution.estimates
    return errors.estimate(varied.PROBLEM, solution, numbers, stages)
