"""Forced responses: for every contact stiffness the reduced model, for every F_C/F_E the curve with
friction; around the peaks what levels, inputs and effects left out change.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from upd.analyses.base import keeping
from upd.analyses.forced.again import (
    MESH,
    Run,
    Variant,
    level_variations,
    make_variant,
    run_curve,
    solve_again,
)
from upd.analyses.forced.curves import linear_of, linear_of_faces
from upd.analyses.forced.inputs import (
    along_changes,
    along_the_damper,
    effects_of,
    elastic_changes,
    few_harmonics,
    input_variants,
)
from upd.analyses.forced.interface_model import INTERFACE, make_springs, make_whole_faces
from upd.analyses.forced.model import Model, make_model, preloaded, quiet
from upd.analyses.forced.peaks import solve_curve
from upd.analyses.forced.performance import (
    RatioPoint,
    further_points,
    harmonics_of,
    mode_over_amplitude,
    peaks_at,
    performance_of,
    ratios_of,
    with_curves,
)
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import ForcedSolution, balance_curve, both_ways, march_peaks
from upd.analyses.forced.statics import admissible, face_laws, same
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import InputError, UpdError, one_line
from upd.hbm.faces.state import InterfaceModel, InterfaceState
from upd.linalg.parallel import threads_for
from upd.linalg.processes import SideProcesses
from upd.progress import Stages
from upd.results import Case
from upd.results import quantities as q
from upd.scene.forced_contact import StiffnessChoice
from upd.vary.solve import changed

log = logging.getLogger(__name__)
#: what a process beside this one imports at once
_MODULES = ("upd.analyses.forced.inputs", "upd.analyses.forced.performance")
#: other starts of the sliders of a band
STARTS = ("mid", "upper", "lower")


def solve(plan: ForcedPlan, stages: Stages) -> ForcedSolution:
    """Run everything the plan calls for.

    An error raised on the way carries what converged so far as ``partial``.
    """
    solution = ForcedSolution(plan)
    with keeping(solution):
        scene = plan.scene
        if scene.contact.model == INTERFACE:
            _whole_faces(solution, stages)
        elif scene.balance.method == "march":
            _models(solution, stages)
            for name, model in solution.models.items():
                springs = make_springs(plan, model)
                _sweep(solution, name, springs.march, springs.at_rest(), stages)
            for work in _mode_work(solution):
                with stages("nonlinear modes", "damping over amplitude"):
                    work.into(work.function(*work.arguments))
        else:
            with SideProcesses(*_MODULES) as beside:
                _balanced_points(solution, beside, stages)
    return solution


def _whole_faces(solution: ForcedSolution, stages: Stages) -> None:
    """Free and stuck curves, and the curves of both faces node by node."""
    plan = solution.plan
    with stages("mesh and assembly", f"both blades and the {plan.scene.arrangement} damper"):
        solution.bodies = make_bodies(plan)
    faces = make_whole_faces(plan, solution.bodies, stages)
    solution.faces[INTERFACE] = faces
    with stages("free and stuck", f"{faces.of.n} nodes"):
        solution.linear[INTERFACE] = linear_of_faces(plan, faces.march)
    if plan.scene.balance.method == "march":
        _sweep(solution, INTERFACE, faces.march, faces.start, stages)
        return
    for ratio in plan.scene.excitation.centrifugal_to_force:
        with stages("friction", f"F_C/F_E {ratio:g}: {faces.of.n} nodes"):
            solution.curves.append(balance_curve(plan, INTERFACE, faces, ratio))


def _sweep(
    solution: ForcedSolution,
    name: str,
    march: InterfaceModel,
    start: InterfaceState,
    stages: Stages,
) -> None:
    """Sweeps up and down at every F_C/F_E, and their peaks."""
    for ratio in solution.plan.scene.excitation.centrifugal_to_force:
        with stages("sweeps", f"{name}, F_C/F_E {ratio:g}: up and down"):
            solution.curves += both_ways(solution.plan, name, ratio, march, start)
    march_peaks(solution, name, stages)


def _models(solution: ForcedSolution, stages: Stages) -> None:
    """Bodies, models and linear limits of every stiffness."""
    plan = solution.plan
    scene = plan.scene
    laws = {name: face_laws(choice, stages) for name, choice in scene.stiffnesses.items()}
    with stages("mesh and assembly", f"both blades and the {scene.arrangement} damper"):
        solution.bodies = make_bodies(plan)
    for name, law in laws.items():
        with stages("reduction", f"{name}: {scene.reduction.modes} modes a blade"):
            solution.models[name] = model = make_model(plan, solution.bodies, law)
        with stages("free and stuck", name), threads_for(len(model.M)):
            solution.linear[name] = linear_of(plan, model)


# -- harmonic balance ------------------------------------------------------------------------------


class _Work(NamedTuple):
    """What a process beside this one may do, and where its result goes.

    Attributes
    ----------
    into
        Takes the result.
    function, arguments
        The job.
    needed
        Whether there is no answer without it.
    """

    into: Callable[[Any], object]
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    needed: bool = False


def _done(beside: SideProcesses, work: Sequence[_Work]) -> None:
    for one, found in zip(work, beside.run([one[1:3] for one in work]), strict=True):
        if not isinstance(found, UpdError):
            one.into(found)
        elif one.needed:
            raise found
        else:
            log.info("%s: %s", one.function.__name__, one_line(found))


def _balanced_points(solution: ForcedSolution, beside: SideProcesses, stages: Stages) -> None:
    _models(solution, stages)
    plan, bodies = solution.plan, solution.bodies
    assert bodies is not None
    scene, names = plan.scene, list(solution.models)
    variants: dict[str, list[Variant]] = {name: [] for name in names}
    points: list[RatioPoint] = []
    work: list[_Work] = []
    for name in names if scene.estimates else ():
        model = solution.models[name]
        for of in level_variations(plan):
            given = with_totals(plan, name, model), name, model
            if of.source != MESH:
                variants[name].append(make_variant(*given, bodies, of))
            else:
                into = variants[name].append
                work.append(_Work(into, make_variant, (*given, None, of), needed=True))
    order = list(scene.excitation.centrifugal_to_force)
    for name, model in solution.models.items():
        # those with most slip first
        for ratio in sorted(order):
            curve = plan, model, solution.linear[name], name, ratio
            work.append(_Work(solution.curves.append, solve_curve, curve, needed=True))
    if scene.wants("performance"):
        highest = harmonics_of(plan)
        for ratio in ratios_of(plan):
            point = plan, solution.models[names[0]], ratio, highest
            work.append(_Work(points.append, peaks_at, point))
    work += _mode_work(solution)
    with stages("friction", f"{len(names) * len(order)} curves, {len(work)} pieces"), quiet():
        _done(beside, work)
    solution.curves.sort(key=lambda c: (names.index(c.stiffness), order.index(c.ratio)))
    with stages("around the peaks", "levels, inputs, effects left out"), quiet():
        _around(solution, variants, points, beside)


def with_totals(plan: ForcedPlan, name: str, model: Model) -> ForcedPlan:
    """The plan with the totals of a contact stiffness in its scene, wherever they come from."""
    totals = StiffnessChoice(left=model.laws["left"], right=model.laws["right"])
    return replace(plan, scene=changed(plan.scene, ((f"stiffness.{name}", totals),)))


def _mode_work(solution: ForcedSolution) -> Iterator[_Work]:
    """Nonlinear modes of every stiffness, where they are wanted."""
    for name, model in (
        solution.models.items() if solution.plan.scene.wants("nonlinear_modes") else ()
    ):
        for in_phase in (True, False):
            mode = solution.plan, model, solution.linear[name], name, in_phase
            yield _Work(solution.nonlinear_modes.append, mode_over_amplitude, mode, needed=True)


def _around(
    solution: ForcedSolution,
    variants: Mapping[str, Sequence[Variant]],
    points: Sequence[RatioPoint],
    beside: SideProcesses,
) -> None:
    """What is solved again around the peaks: once, on the reduced models."""
    plan, bodies, first = solution.plan, solution.bodies, next(iter(solution.models))
    assert bodies is not None
    scene, work = plan.scene, list[_Work]()
    further: list[RatioPoint] = []
    for name, model in solution.models.items():
        mine = tuple(c for c in solution.curves if c.stiffness == name and not c.empty)
        given = with_totals(plan, name, model), name, model, solution.linear[name]
        run = Run(*given, tuple(run_curve(one) for one in mine))
        work += [_Work(solution.levels.append, solve_again, (run, one)) for one in variants[name]]
        if scene.left_out.solves:
            solution.omissions += elastic_changes(run, bodies)
        if name == first:
            if scene.wants("performance"):
                jobs = further_points(plan, model, with_curves(points, mine), points)
                work += [_Work(further.append, *job) for job in jobs]
            if scene.wants("inputs") or scene.left_out.solves:
                work += _at_few_harmonics(solution, run, bodies)
            if scene.wants("band"):
                work += _band(solution, name)
    _done(beside, work)
    if scene.wants("performance"):
        mine = tuple(c for c in solution.curves if c.stiffness == first)
        solution.performances[first] = performance_of(
            solution.linear[first], with_curves(points, mine), further
        )


def _at_few_harmonics(solution: ForcedSolution, run: Run, bodies: Bodies) -> Iterator[_Work]:
    """Inputs, and sliding along the damper, on the curve with the lowest F_C/F_E."""
    scene, few = solution.plan.scene, few_harmonics(run)
    if few is None:
        return
    for variant in input_variants(few, bodies) if scene.wants("inputs") else ():
        yield _Work(
            lambda one: solution.effects.extend(effects_of(few, one)), solve_again, (few, variant)
        )
    if scene.left_out.solves and (along := along_the_damper(few, bodies)):
        yield _Work(
            lambda one: solution.omissions.extend(along_changes(few, one)), solve_again, along
        )


def _band(solution: ForcedSolution, name: str) -> Iterator[_Work]:
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
            point = plan, other, ratio, highest, changes
            yield _Work(partial(_into_band, solution, name, choice), peaks_at, point, needed=True)


def _into_band(solution: ForcedSolution, name: str, choice: str, point: RatioPoint) -> None:
    for peak in (one for one in point.peaks if one.blade == "right"):
        case = Case(stiffness=name, force_ratio=point.ratio, mode=peak.mode, choice=choice)
        solution.band += [
            q.BAND_FREQUENCY.of(peak.frequency, case, n=peak.number),
            q.BAND_ACCELERANCE.of(peak.height, case, n=peak.number),
        ]
