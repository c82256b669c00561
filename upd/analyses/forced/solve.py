"""Forced responses: for every contact stiffness the reduced model, for every F_C/F_E the curve with
friction; around the peaks what levels, inputs and effects left out change.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from upd.analyses.forced.curves import ForcedCurve
from upd.analyses.forced.inputs import INPUTS, few_harmonics, input_effects
from upd.analyses.forced.left_out import along_changes, elastic_changes, with_along
from upd.analyses.forced.levels import (
    COARSER,
    HARMONICS,
    MORE_HARMONICS,
    SAMPLES,
    Laws,
    MadeModel,
    balance_level,
    coarse_model,
    model_level,
    other_models,
)
from upd.analyses.forced.model import Model, make_model, preloaded
from upd.analyses.forced.paths import quiet
from upd.analyses.forced.peaks import solve_curve
from upd.analyses.forced.peaks_again import FoundPeaks, linear_of
from upd.analyses.forced.performance import (
    RatioPoint,
    further_points,
    harmonics_of,
    peaks_at,
    performance_of,
    ratios_of,
    with_curves,
)
from upd.analyses.forced.plan import ForcedPlan, grid
from upd.analyses.forced.solution import BandPoint, ForcedSolution, TimeMarch
from upd.analyses.forced.spring_march import make_springs
from upd.analyses.forced.statics import StaticState, admissible, same, static_state
from upd.analyses.forced.stiffness import face_laws
from upd.analyses.forced.sweeps import both_ways, march_peaks
from upd.analyses.forced.whole_faces import INTERFACE, linear_limits, make_whole_faces, solve_faces
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import InputError, UpdError, one_line
from upd.hbm.march import steady_state
from upd.linalg.parallel import threads_for
from upd.linalg.processes import Job, SideProcesses
from upd.progress import Stages

log = logging.getLogger(__name__)
#: what a process beside this one imports at once
_MODULES = ("upd.analyses.forced.inputs", "upd.analyses.forced.performance")
#: kinds of jobs without which the answer stands
_BESIDE_THE_ANSWER = ("input", "along", "performance")
#: other starts of the sliders of a band
STARTS = ("mid", "upper", "lower")


def solve(plan: ForcedPlan, stages: Stages) -> ForcedSolution:
    """Run everything the plan calls for.

    An error raised on the way carries what converged so far as ``partial``.
    """
    solution = ForcedSolution(plan)
    try:
        scene = plan.scene
        if scene.contact.model == INTERFACE:
            _whole_faces(solution, stages)
        elif scene.balance.method == "march":
            _swept_points(solution, stages)
        else:
            with SideProcesses(*_MODULES) as beside:
                _balanced_points(solution, beside, stages)
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def _whole_faces(solution: ForcedSolution, stages: Stages) -> None:
    """Free and stuck curves, and the curves of both faces node by node."""
    plan = solution.plan
    with stages("mesh and assembly", f"both blades and the {plan.scene.arrangement} damper"):
        solution.bodies = make_bodies(plan)
    faces = make_whole_faces(plan, solution.bodies, stages)
    solution.faces[INTERFACE] = faces
    with stages("free and stuck", f"{faces.of.n} nodes"):
        solution.linear[INTERFACE] = linear_limits(plan, faces, grid(plan))
    solve_faces(solution, INTERFACE, stages)
    march_peaks(solution, stages)


def _models(solution: ForcedSolution, stages: Stages) -> Mapping[str, Laws]:
    """Bodies, models and linear limits of every stiffness; laws of their faces."""
    plan = solution.plan
    scene = plan.scene
    laws = {name: face_laws(choice, stages) for name, choice in scene.stiffnesses.items()}
    with stages("mesh and assembly", f"both blades and the {scene.arrangement} damper"):
        solution.bodies = make_bodies(plan)
    for name, law in laws.items():
        with stages("reduction", f"{name}: {scene.reduction.modes} modes a blade"):
            state = _static(plan, solution.bodies, stages)
            solution.models[name] = model = make_model(plan, solution.bodies, law, state)
        with stages("free and stuck", name), threads_for(len(model.M)):
            solution.linear[name] = linear_of(plan, model)
    return laws


def _static(plan: ForcedPlan, bodies: Bodies, stages: Stages) -> StaticState | None:
    """The scene's static state, where the faces fit under it."""
    if not plan.scene.contact.loaded:
        return None
    return static_state(plan, bodies, stages=stages)


def _swept_points(solution: ForcedSolution, stages: Stages) -> None:
    """Sweeps up and down of contact points."""
    _models(solution, stages)
    plan = solution.plan
    for name, model in solution.models.items():
        springs = make_springs(plan, model)
        for ratio in plan.scene.excitation.centrifugal_to_force:
            with stages("sweeps", f"{name}, F_C/F_E {ratio:g}: up and down"):
                start = springs.at_rest()
                solution.sweeps += both_ways(plan, name, ratio, springs.march, start)
    march_peaks(solution, stages)


# -- harmonic balance ------------------------------------------------------------------------------


def _balanced_points(solution: ForcedSolution, beside: SideProcesses, stages: Stages) -> None:
    laws = _models(solution, stages)
    plan, bodies = solution.plan, solution.bodies
    assert bodies is not None
    scene, first = plan.scene, next(iter(laws))
    made: dict[str, list[MadeModel]] = {name: [] for name in laws}
    jobs: list[Job] = []
    if scene.estimates:
        for name in laws:
            model = solution.models[name]
            jobs += [(coarse_model, (plan, model, laws[name], factor)) for factor in COARSER]
            made[name] += other_models(plan, model, bodies, laws[name])
    meshes, jobs = len(jobs), jobs + _curve_jobs(solution)
    curves = len(jobs) - meshes
    if scene.wants("performance"):
        model, highest = solution.models[first], harmonics_of(plan)
        jobs += [(peaks_at, (plan, model, r, highest)) for r in ratios_of(plan)]
    with stages("friction", f"{curves} curves, {len(jobs) - meshes - curves} F_C/F_E"), quiet():
        found = beside.run(jobs)
    for name in laws if scene.estimates else ():
        made[name] += _checked(found[: len(COARSER)])
        found = found[len(COARSER) :]
    solution.curves += _checked(found[:curves])
    points: list[RatioPoint] = [p for p in found[curves:] if not isinstance(p, UpdError)]
    with stages("around the peaks", "levels, inputs, effects left out"), quiet():
        _around(solution, laws, made, points, beside)
    curve = next((c for c in solution.curves if not c.empty), None)
    for f in scene.balance.time_march if curve is not None else ():
        assert curve is not None
        with stages("time march", f"{curve.case}, {f:g} Hz"):
            solution.marches += _march(curve, f)


def _curve_jobs(solution: ForcedSolution) -> list[Job]:
    """The curves, those with most slip first."""
    ratios = sorted(solution.plan.scene.excitation.centrifugal_to_force)
    return [
        (solve_curve, (solution.plan, model, solution.linear[name], name, ratio))
        for name, model in solution.models.items()
        for ratio in ratios
    ]


def _checked(found: Sequence[Any]) -> list[Any]:
    for one in found:
        if isinstance(one, UpdError):
            raise one
    return list(found)


def _around(
    solution: ForcedSolution,
    laws: Mapping[str, Laws],
    made: Mapping[str, Sequence[MadeModel]],
    points: Sequence[RatioPoint],
    beside: SideProcesses,
) -> None:
    """What is solved again around the peaks: once, on the reduced models."""
    plan, bodies, first = solution.plan, solution.bodies, next(iter(laws))
    assert bodies is not None
    scene, jobs, into = plan.scene, list[Job](), list[tuple[str, str]]()
    order = list(scene.excitation.centrifugal_to_force)
    solution.curves.sort(key=lambda c: (list(laws).index(c.stiffness), order.index(c.ratio)))

    def add(kind: str, name: str, *job: Any) -> None:
        jobs.append((job[0], job[1:]))
        into.append((kind, name))

    along: Model | None = None
    further: list[RatioPoint] = []
    for name, model in solution.models.items():
        mine = tuple(c for c in solution.curves if c.stiffness == name and not c.empty)
        peaks = FoundPeaks(plan, model, solution.linear[name], mine)
        solution.searched[name], bare = peaks, peaks.bare
        if scene.estimates:
            for one in made[name]:
                add("level", name, model_level, bare, one)
            for more in MORE_HARMONICS:
                add("level", name, balance_level, bare, HARMONICS, more, 1)
            add("level", name, balance_level, bare, SAMPLES, 0, 2)
        asked = scene.wants("inputs") or scene.left_out.solves
        tops = few_harmonics(peaks) if name == first and asked else {}
        if name == first and scene.wants("performance"):
            for function, given in further_points(plan, model, with_curves(points, mine), points):
                add("performance", name, function, *given)
        if name == first and scene.wants("inputs"):
            for one_input in INPUTS:
                add("input", name, input_effects, bare, tops, one_input.name)
        if name == first and scene.wants("band"):
            for job in _band_jobs(solution, name):
                add("band", job[0], *job[1:])
        if scene.left_out.solves:
            solution.omissions += elastic_changes(solution, name)
            along = with_along(solution, name, laws[name]) if name == first else None
            if along is not None:
                add("along", name, along_changes, bare, tops, along)
    found = beside.run(jobs)
    for place, one in zip(into, found, strict=True):
        if isinstance(one, UpdError) and place[0] in _BESIDE_THE_ANSWER:
            # beside the answer: it stands without
            log.info("%s of %s: %s", *place, one_line(one))
    kept = [k for k, (kind, _) in enumerate(into) if kind not in _BESIDE_THE_ANSWER]
    _checked([found[k] for k in kept])
    for (kind, name), one in zip(into, found, strict=True):
        if isinstance(one, UpdError):
            continue
        if kind == "level":
            solution.levels.setdefault(name, []).append(one)
        elif kind == "input":
            solution.effects.setdefault(name, []).extend(one)
        elif kind == "performance":
            further.append(one)
        elif kind == "band":
            solution.band.append(BandPoint(first, name, one))
        else:
            solution.omissions += one
    if scene.wants("performance"):
        mine = tuple(c for c in solution.curves if c.stiffness == first)
        solution.performances[first] = performance_of(
            plan, solution.linear[first], with_curves(points, mine), further
        )


def _band_jobs(solution: ForcedSolution, name: str) -> Iterator[tuple[Any, ...]]:
    """Curves from every other named static state, and other starts of the sliders."""
    plan, model, bodies = solution.plan, solution.models[name], solution.bodies
    assert bodies is not None
    scene, highest = plan.scene, harmonics_of(plan)
    choices: list[tuple[str, Model, dict[str, Any]]] = []
    if model.state is not None:
        for state in admissible(plan, bodies, Stages()):
            if not same(state, model.state, scene.damper.centrifugal):
                try:
                    choices.append((f"static {state.name}", preloaded(model, state), {}))
                except InputError as error:
                    log.info("static state %s: %s", state.name, one_line(error))
    choices += [(f"start {s}", model, {"start": s}) for s in STARTS if s != scene.balance.slider]
    for ratio in scene.excitation.centrifugal_to_force:
        for choice, other, changes in choices:
            yield choice, peaks_at, plan, other, ratio, highest, changes


def _march(curve: ForcedCurve, f: float) -> list[TimeMarch]:
    """Time integration from the answer at f, when the path reached it."""
    a = curve.answer
    i = int(np.argmin(np.abs(a.frequency - f)))
    if abs(a.frequency[i] - f) > np.sqrt(np.finfo(float).eps) * f:
        return []
    height = float(abs(curve.accelerance["right"][i]))
    return [TimeMarch(curve, f, height, steady_state(a.balance, f, a.x[i]))]
