"""Forced responses: for every contact stiffness the reduced model, for every F_C/F_E the curve with
friction; around the peaks what levels, inputs and effects left out change. Contact states, loops
and the damper's motion at peaks of sweeps are read from the last period.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from upd.analyses.base import Resolved, keeping
from upd.analyses.forced import again, curves, inputs, measures, performance
from upd.analyses.forced.curves import ForcedCurve, LinearCurves, SweptCurve
from upd.analyses.forced.interface_model import (
    INTERFACE,
    WholeFaces,
    by_coulomb,
    make_springs,
    make_whole_faces,
)
from upd.analyses.forced.measures import Loop
from upd.analyses.forced.model import Array, Model, make_model, preloaded, quiet
from upd.analyses.forced.peaks import solve_curve
from upd.analyses.forced.performance import Performance, RatioPoint
from upd.analyses.forced.plan import ForcedPlan, excitation_of
from upd.analyses.forced.statics import admissible, face_laws
from upd.analyses.measured import CurvePeak
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import InputError, UpdError, one_line
from upd.hbm.faces.state import InterfaceModel, InterfaceState
from upd.hbm.faces.sweep import RecordedPeriod, period_of_sweep
from upd.linalg.parallel import threads_for
from upd.linalg.processes import SideProcesses
from upd.mesh import IntArray
from upd.progress import Stages
from upd.results import Case, Result
from upd.results import quantities as q
from upd.results.netcdf import Variable
from upd.scene.forced_contact import SIDES, StiffnessChoice
from upd.vary.solve import changed
from upd.vary.variation import SolvedVariation

log = logging.getLogger(__name__)
#: what a process beside this one imports at once
_MODULES = ("upd.analyses.forced.inputs", "upd.analyses.forced.performance")
#: other starts of the sliders of a band
STARTS = ("mid", "upper", "lower")


@dataclass(frozen=True)
class ContactPlaces:
    """Contact points or nodes of both faces: face (n,) as an index into SIDES; place (n,) along the
    damper and up the slope, mm; weight (n,) in means over a face; compliance (n,) of the tangential
    springs, mm/N, 0 without.
    """

    face: IntArray
    along: Array
    up: Array
    weight: Array
    compliance: Array


@dataclass
class ForcedSolution:
    """All that was solved, for results, checks and arrays.

    Dictionaries by the name of the contact stiffness; ``band`` and ``effects`` are numbers of peaks
    from other static states and starts of the sliders, and of their changes by inputs.
    """

    plan: ForcedPlan
    bodies: Bodies | None = None
    models: dict[str, Model] = field(default_factory=dict)
    linear: dict[str, LinearCurves] = field(default_factory=dict)
    curves: list[ForcedCurve[Any]] = field(default_factory=list)
    faces: dict[str, WholeFaces] = field(default_factory=dict)
    band: list[Result] = field(default_factory=list)
    performances: dict[str, Performance] = field(default_factory=dict)
    nonlinear_modes: list[tuple[Case, dict[str, Variable]]] = field(default_factory=list)
    omissions: list[Resolved] = field(default_factory=list)
    levels: list[SolvedVariation] = field(default_factory=list)
    effects: list[Result] = field(default_factory=list)

    def places(self, stiffness: str) -> ContactPlaces:
        """Of the contact points, or of the nodes of whole faces."""
        if stiffness in self.faces:
            of = self.faces[stiffness].of
            place = measures.in_faces(of.position, of.face, of.frame)
            return ContactPlaces(of.face, *place, of.area, np.zeros(of.n))
        model, law = self.models[stiffness], self.models[stiffness].contacts.law
        frames = [model.faces[side].frame for side in SIDES]
        place = measures.in_faces(model.position, model.face, frames)
        springs = np.divide(1.0, law.k_t, out=np.zeros_like(law.k_t), where=law.k_t > 0.0)
        return ContactPlaces(model.face, *place, law.k_n, springs)

    def marked_points(self, curve: ForcedCurve[Any]) -> list[tuple[int, str, int]]:
        """Number, mode and point of the path of the right blade's peaks.

        Number 0 and the highest point of a curve without a peak.
        """
        peaks: Sequence[CurvePeak] = curve.peaks["right"]
        if peaks:
            return [(peak.number, peak.mode, peak.sample) for peak in peaks]
        return [(0, "", int(np.abs(curve.accelerance["right"]).argmax()))]


# -- peaks of sweeps -------------------------------------------------------------------------------


#: outputs that are read from them
WANTS = ("contact_state", "hysteresis", "damper_motion")


def marched_loops(
    solution: ForcedSolution, sweep: SweptCurve, period: RecordedPeriod, count: int
) -> list[Loop]:
    """Loops of the nodes that lose most, as `upd.analyses.forced.measures.loops`.

    The displacement is the slip and what the springs give, f_t / k_t, about its mean: the march
    counts slips from faces that carry nothing.

    Parameters
    ----------
    sweep, period
        The sweep, and its last period at a peak.
    count
        Loops at most.
    """
    force, friction = period.force.transpose(2, 1, 0), sweep.answer.model.friction
    compliance = solution.places(sweep.stiffness).compliance[:, None, None]
    motion = period.slip.transpose(2, 1, 0) + compliance * force[:, 1:]
    motion -= motion.mean(axis=2, keepdims=True)
    return measures.largest_loops(period.loss, motion, force, friction, count)


def marched_damper(
    solution: ForcedSolution, sweep: SweptCurve, period: RecordedPeriod
) -> tuple[Array, Array]:
    """Motion of the damper's six dofs about its rest, as
    `upd.analyses.forced.measures.damper_motion`.

    Returns
    -------
    static, amplitude
        (6,) mean, and amplitude of the lowest harmonic that is excited, mm and rad.
    """
    if (faces := solution.faces.get(sweep.stiffness)) is not None:
        rest, kept = faces.start.s, list(faces.of.kept)
    else:
        # springs count from the static state
        damper = solution.models[sweep.stiffness].damper
        rest, kept = np.zeros(damper.n_dof), list(damper.kept)
    N, k = len(period.motion), excitation_of(solution.plan.scene.excitation).lowest
    motion = np.zeros((N, 6))
    motion[:, kept] = period.motion - rest
    turn = np.exp(-2j * np.pi * k * np.arange(1, N + 1) / N)
    return motion.mean(axis=0), np.abs(2.0 / N * turn @ motion)


# -- the run ---------------------------------------------------------------------------------------


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
            for into, function, arguments, _ in _mode_work(solution):
                with stages("nonlinear modes", "damping over amplitude"):
                    into(function(*arguments))
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
        e = plan.scene.excitation
        given = faces.march, excitation_of(e), e.stop
        limits = (curves.faces_limit(*given, stuck) for stuck in (False, True))
        solution.linear[INTERFACE] = curves.linear_curves(plan, *limits)
    if plan.scene.balance.method == "march":
        _sweep(solution, INTERFACE, faces.march, faces.start, stages)
        return
    for ratio in plan.scene.excitation.centrifugal_to_force:
        with stages("friction", f"F_C/F_E {ratio:g}: {faces.of.n} nodes"):
            solution.curves.append(curves.balance_curve(plan, INTERFACE, faces, ratio))


def _sweep(
    solution: ForcedSolution,
    name: str,
    march: InterfaceModel,
    start: InterfaceState,
    stages: Stages,
) -> None:
    """Sweeps up and down at every F_C/F_E, with the last period at their peaks where it is read."""
    read = any(solution.plan.scene.wants(one) for one in WANTS)
    for ratio in solution.plan.scene.excitation.centrifugal_to_force:
        with stages("sweeps", f"{name}, F_C/F_E {ratio:g}: up and down"):
            for sweep in curves.both_ways(solution.plan, name, ratio, march, start):
                tops = sweep.peaks["right"] if read else ()
                periods = {
                    top.number: period_of_sweep(sweep.answer, top.sample, by_coulomb)
                    for top in tops
                }
                solution.curves.append(replace(sweep, periods=periods))


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
            solution.linear[name] = curves.linear_of(plan, model)


# -- harmonic balance ------------------------------------------------------------------------------


#: what a process beside this one may do: what takes the result, the function and its arguments,
#: whether there is no answer without it
_Work = tuple[Callable[[Any], object], Callable[..., Any], tuple[Any, ...], bool]


def _done(beside: SideProcesses, work: Sequence[_Work]) -> None:
    results = beside.run([(function, arguments) for _, function, arguments, _ in work])
    for (into, function, _, needed), found in zip(work, results, strict=True):
        if not isinstance(found, UpdError):
            into(found)
        elif needed:
            raise found
        else:
            log.info("%s: %s", function.__name__, one_line(found))


def _balanced_points(solution: ForcedSolution, beside: SideProcesses, stages: Stages) -> None:
    _models(solution, stages)
    plan, bodies = solution.plan, solution.bodies
    assert bodies is not None
    scene, names = plan.scene, list(solution.models)
    variants: dict[str, list[again.Variant]] = {name: [] for name in names}
    points: list[RatioPoint] = []
    work: list[_Work] = []
    for name in names if scene.estimates else ():
        model = solution.models[name]
        for of in again.level_variations(plan):
            given = with_totals(plan, name, model), name, model
            if of.source != again.MESH:
                variants[name].append(again.make_variant(*given, bodies, of))
            else:
                into = variants[name].append
                work.append((into, again.make_variant, (*given, None, of), True))
    order = list(scene.excitation.centrifugal_to_force)
    for name, model in solution.models.items():
        # those with most slip first
        for ratio in sorted(order):
            curve = plan, model, solution.linear[name], name, ratio
            work.append((solution.curves.append, solve_curve, curve, True))
    if scene.wants("performance"):
        wanted = scene.performance
        for ratio in np.geomspace(wanted.lowest, wanted.highest, wanted.points).tolist():
            point = plan, solution.models[names[0]], ratio
            work.append((points.append, performance.peaks_at, point, False))
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
            into = solution.nonlinear_modes.append
            yield into, performance.mode_over_amplitude, mode, True


def _around(
    solution: ForcedSolution,
    variants: Mapping[str, Sequence[again.Variant]],
    points: list[RatioPoint],
    beside: SideProcesses,
) -> None:
    """What is solved again around the peaks: once, on the reduced models."""
    plan, bodies, first = solution.plan, solution.bodies, next(iter(solution.models))
    assert bodies is not None
    scene, work, finer = plan.scene, list[_Work](), list[RatioPoint]()
    for name, model in solution.models.items():
        mine = tuple(c for c in solution.curves if c.stiffness == name and not c.empty)
        given = with_totals(plan, name, model), name, model, solution.linear[name]
        run = again.Run(*given, tuple(again.run_curve(one) for one in mine))
        work += [
            (solution.levels.append, again.solve_again, (run, one), False) for one in variants[name]
        ]
        if scene.left_out.solves:
            solution.omissions += inputs.elastic_changes(run, bodies)
        if name == first:
            if scene.wants("performance"):
                curve = partial(performance.performance_of, solution.linear[name], points, mine)
                near = curve().best
                work += [
                    (points.append, performance.peaks_at, (plan, model, ratio), False)
                    for ratio in curve().beside_best()
                ]
                if near is not None and variants[name]:
                    more = replace(plan, scene=changed(scene, again.more_harmonics(scene)[1]))
                    point = more, model, near.ratio
                    work.append((finer.append, performance.peaks_at, point, False))
            if scene.wants("inputs") or scene.left_out.solves:
                work += _at_few_harmonics(solution, run, bodies)
            if scene.wants("band"):
                work += _band(solution, name)
    _done(beside, work)
    if scene.wants("performance"):
        found = curve()
        if near is not None and finer and finer[0].peaks:
            found = replace(found, finer=(near, finer[0]))
        solution.performances[first] = found


def _at_few_harmonics(solution: ForcedSolution, run: again.Run, bodies: Bodies) -> Iterator[_Work]:
    """Inputs, and sliding along the damper, on the curve with the lowest F_C/F_E."""
    scene, few = solution.plan.scene, inputs.few_harmonics(run)
    if few is None:
        return
    for variant in inputs.input_variants(few, bodies) if scene.wants("inputs") else ():
        yield (
            lambda one: solution.effects.extend(inputs.effects_of(few, one)),
            again.solve_again,
            (few, variant),
            False,
        )
    if scene.left_out.solves and (along := inputs.along_the_damper(few, bodies)):
        yield (
            lambda one: solution.omissions.extend(inputs.along_changes(few, one)),
            again.solve_again,
            along,
            False,
        )


def _band(solution: ForcedSolution, name: str) -> Iterator[_Work]:
    """Curves from every other named static state, and other starts of the sliders."""
    plan, model, bodies = solution.plan, solution.models[name], solution.bodies
    assert bodies is not None
    choices: list[tuple[str, Model, str | None]] = []
    for state in admissible(plan, bodies, Stages()) if model.state is not None else ():
        if model.state is None or state.same(model.state):
            continue
        try:
            choices.append((f"static {state.name}", preloaded(model, state), None))
        except InputError as error:
            log.info("static state %s: %s", state.name, one_line(error))
    choices += [(f"start {s}", model, s) for s in STARTS if s != plan.scene.balance.slider]
    for ratio in plan.scene.excitation.centrifugal_to_force:
        for choice, other, start in choices:
            into = partial(_into_band, solution, name, choice)
            point = plan, other, ratio, start
            yield into, performance.peaks_at, point, True


def _into_band(solution: ForcedSolution, name: str, choice: str, point: RatioPoint) -> None:
    for peak in (one for one in point.peaks if one.blade == "right"):
        case = Case(stiffness=name, force_ratio=point.ratio, mode=peak.mode, choice=choice)
        solution.band += [
            q.BAND_FREQUENCY.of(peak.frequency, case, n=peak.number),
            q.BAND_ACCELERANCE.of(peak.height, case, n=peak.number),
        ]
