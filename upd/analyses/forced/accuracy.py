"""Levels of a forced response that reach a wanted accuracy at the least cost.

Mesh off the contact, modes kept, contact points, harmonics, samples or steps of a period, points of
the sweep: rounds solve the peaks, estimate what every source leaves in them, and raise what pays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from upd.analyses import accuracy_rounds
from upd.analyses.accuracy_rounds import AT_BEST, Rounds, Setting, mesh_falls
from upd.analyses.forced.companions import MESH, MODES, POINTS
from upd.analyses.forced.estimates import estimate
from upd.analyses.forced.levels import HARMONICS, PATH, SAMPLES, STEPS
from upd.analyses.forced.mesh_counts import OFF_CONTACT, RECIPE, on_contact, times
from upd.analyses.forced.plan import CoarserMesh, ForcedPlan, make_plan, time_steps
from upd.analyses.forced.results import make_results
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.solve import solve
from upd.analyses.levels_choice import Knob, Levels
from upd.hbm.fourier import harmonics, sample_count
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.forced import SIDES

#: names of accuracies -> numbers they are asked of
ASKED = {"peak_frequency": "peak_?_frequency", "peak": "peak_?_accelerance"}
#: times the elements off the contact, the contact points, the samples and the points of a sweep
_FINER, _MORE_POINTS, _MORE_SAMPLES, _MORE_STEPS = (1, 2, 3, 4), (1, 2, 4), (1, 2, 4, 8), (1, 2, 4)
_MODES = (5, 10, 20, 40)
_HARMONICS = (1, 3, 5, 7, 9, 11, 13)


def settings_of(scene: ForcedScene) -> list[Setting]:
    """What may be chosen of a scene, by source.

    The scene's own numbers of elements, points and frequencies are the lowest levels; numbers of
    modes and harmonics may fall below its own.
    """
    found = [
        _setting((MODES,), "modes kept", _MODES, _with_modes, "{} a blade"),
        _setting((HARMONICS,), "harmonics", _HARMONICS, _with_harmonics, "to {}"),
        _setting((SAMPLES, STEPS), "samples and steps", _MORE_SAMPLES, _with_samples, "x {}"),
        _setting((PATH,), "points of the sweep", _MORE_STEPS, _with_steps, "x {}"),
    ]
    if _raisable(scene):
        found.insert(0, _setting((POINTS,), "contact points", _MORE_POINTS, _with_points, "x {}"))
    if scene.recipe == RECIPE:
        knob = Knob(
            (MESH,),
            "mesh",
            tuple(f"x {n}" for n in _FINER),
            mesh_falls(_FINER),
        )
        found.insert(0, Setting(knob, lambda one, k: _with_mesh(one, _FINER[k])))
    return found


def _setting(
    sources: tuple[str, ...],
    name: str,
    levels: tuple[int, ...],
    made: Callable[[ForcedScene, int], ForcedScene],
    words: str,
) -> Setting:
    labels = tuple(words.format(n) for n in levels)
    falls = tuple((levels[0] / n) ** AT_BEST for n in levels)
    return Setting(Knob(sources, name, labels, falls), lambda one, k: made(one, levels[k]))


def _raisable(scene: ForcedScene) -> bool:
    """Whether more contact points can be made of the scene's: not of lines that it names."""
    lines = [one for side in SIDES for one in scene.contact.lines(side)]
    return bool(on_contact(scene)) and all(one == "all" or isinstance(one, int) for one in lines)


def _with_mesh(scene: ForcedScene, factor: int) -> ForcedScene:
    if factor == 1:
        return scene
    return replace(scene, geometry={**scene.geometry, **times(scene, OFF_CONTACT, factor)})


def _with_points(scene: ForcedScene, factor: int) -> ForcedScene:
    if factor == 1:
        return scene

    def more(lines: Any) -> Any:
        return factor * lines if isinstance(lines, int) else lines

    contact = scene.contact
    own = {
        side: replace(face, rows=more(face.rows), columns=more(face.columns))
        for side in SIDES
        for face in (getattr(contact, side),)
    }
    contact = replace(contact, rows=more(contact.rows), columns=more(contact.columns), **own)
    geometry = {**scene.geometry, **times(scene, on_contact(scene), factor)}
    return replace(scene, contact=contact, geometry=geometry)


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


def _with_steps(scene: ForcedScene, factor: int) -> ForcedScene:
    points = factor * (scene.excitation.points - 1) + 1
    return replace(scene, excitation=replace(scene.excitation, points=points))


def _coarser(
    asked: ForcedScene, settings: Sequence[Setting], levels: Levels
) -> tuple[CoarserMesh, ...]:
    """Meshes of the levels before, the finest first."""
    place = next((k for k, s in enumerate(settings) if s.knob.sources == (MESH,)), None)
    if place is None or levels[place] == 0:
        return ()
    own, scene = _FINER[levels[place]], replace(asked, accuracy=None)
    return tuple(
        CoarserMesh(times(scene, OFF_CONTACT, n), own / n, f"{n} x the elements off the contact")
        for n in reversed(_FINER[: levels[place]])
    )


def _planned(
    asked: ForcedScene, settings: Sequence[Setting], levels: Levels, scene: ForcedScene
) -> ForcedPlan:
    return replace(make_plan(scene), coarser=_coarser(asked, settings, levels))


def _trial(scene: ForcedScene) -> ForcedScene:
    return replace(scene, want=("response",), left_out=replace(scene.left_out, solve="no"))


ROUNDS = Rounds(settings_of, ASKED, _trial, _planned, solve, make_results, estimate)


def plan_to_accuracy(scene: ForcedScene) -> ForcedPlan:
    """The plan of a scene, as `upd.analyses.accuracy_rounds.plan_to_accuracy`."""
    plan: ForcedPlan = accuracy_rounds.plan_to_accuracy(ROUNDS, scene, make_plan)
    return plan


def solve_to_accuracy(plan: ForcedPlan, stages: Stages) -> ForcedSolution:
    """Run the plan, as `upd.analyses.accuracy_rounds.solve_to_accuracy`."""
    solution: ForcedSolution = accuracy_rounds.solve_to_accuracy(ROUNDS, plan, stages)[0]
    return solution
