"""Effects that a curved contact leaves out, solved again on the plan's companion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved
from upd.analyses.contact import left_out as again
from upd.analyses.contact.bodies import prepare_companion
from upd.analyses.contact.coupled import raised
from upd.analyses.contact.left_out import Pressed
from upd.analyses.contact.loading import closed_loop, tangential_compliance
from upd.analyses.contact.plan import ACROSS, ALONG, NORMAL, ContactPlan, unit_vector
from upd.analyses.hertz.accuracy import WANTED
from upd.analyses.hertz.results import make_results
from upd.analyses.hertz.solution import HertzNormalCase, HertzSolution
from upd.analyses.hertz.solve import solve_normal, solve_tangential
from upd.contact.model import ContactModel
from upd.contact.normal import normal_contact
from upd.contact.threads import few_threads
from upd.errors import UpdError
from upd.progress import Stages
from upd.results import Result
from upd.scene.contact import Coupling
from upd.vary.wanted import solve_wanted

Array = NDArray[np.float64]


def solve(plan: ContactPlan, stages: Stages) -> HertzSolution:
    """Run everything the plan calls for, and numbers again with the effects it leaves out.

    Errors as for `solve_wanted`.
    """
    solution: HertzSolution
    solution, estimates = solve_wanted(WANTED, plan, stages)
    solution = replace(solution, estimates=estimates)
    companion = solution.plan.companion
    if companion is None:
        return solution
    cases = [case.case for case in solution.normal if case.load > 0.0]
    try:
        with stages("effects left out", f"{_nodes(companion)} pairs of nodes, whole model"):
            try:
                model = prepare_companion(companion)
                with few_threads(model.gap):
                    solution.left_out = list(solve_again(solution, model))
            except UpdError:
                solution.left_out = again.not_solved(solution.plan, cases)
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def _nodes(companion: ContactPlan) -> int:
    return max(count["contact"] for count in companion.size.values())


def solve_again(solution: HertzSolution, model: ContactModel) -> Iterator[Resolved]:
    """Every number that shows what an effect left out changes, on the companion ``model``."""
    plan = solution.plan

    def press(gap: Array, load: float) -> Pressed:
        if plan.scene.coupled:
            held, mu = np.zeros((len(model.gap), 0)), plan.scene.contact.friction
            state = raised(model, mu, [load], held, gap=gap)[load]
            return Pressed(float(state.motion[0]), state.force[:, 0])
        found = normal_contact(model.compliance(NORMAL), gap, load=load)
        return Pressed(found.approach, found.force)

    for case in solution.normal:
        if case.load > 0.0:
            yield from again.displaced_changes(plan, model, press, case.case, case.load)
    # What is left out beside coupling, coupled contact has.
    if not plan.scene.coupled:
        yield from _sheared(solution, model, press)


def _sheared(
    solution: HertzSolution, model: ContactModel, press: again.Press
) -> Iterator[Resolved]:
    plan = solution.plan
    directions = (ALONG, ACROSS)[: plan.scene.contact.directions]
    mine = _solved(solution, model, directions)
    numbers = make_results(mine)
    yield from again.coupled_changes(
        plan,
        numbers,
        lambda: make_results(_solved(solution, model, (ALONG, ACROSS), coupling="coupled")),
    )
    if again.left_out(plan, again.DIRECTIONS):
        both = make_results(_solved(solution, model, (ALONG, ACROSS)))
        names = ("K_T_initial_raw", "K_T_secant_raw", "cycle_energy")
        found = list(again.changes(again.DIRECTIONS, names, numbers, both))
        yield from found or again.changes(again.DIRECTIONS, ("K_T_tangent_raw",), numbers, both)
    for case in mine.normal:
        if case.load > 0.0 and again.left_out(plan, again.MATERIALS):
            yield from _unlike(mine, case, press, directions, numbers)


def _unlike(
    mine: HertzSolution,
    case: HertzNormalCase,
    press: again.Press,
    directions: tuple[int, ...],
    numbers: list[Result],
) -> Iterator[Resolved]:
    """The tangential loads with the slip of the pressure alone already there."""
    scene, model, unit = mine.plan.scene, mine.model, unit_vector(0.0, directions)
    mu, pressed = scene.contact.friction, press(mine.model.gap, case.load)
    for name in ("K_T_secant_raw", "cycle_energy"):
        for one in (r for r in numbers if r.name == name and r.case.load == case.load):
            assert one.case.ratio is not None
            load = one.case.ratio * mu * case.load
            if name == "K_T_secant_raw":
                value = again.slipped_stiffness(model, directions, pressed, mu, load * unit)
            else:
                loaded = np.flatnonzero(pressed.force > 0.0)
                value = closed_loop(
                    one.case,
                    case.case,
                    tangential_compliance(model, directions, loaded),
                    mu * pressed.force[loaded],
                    peak=load,
                    steps=scene.loads.cycle_steps,
                    unit=unit,
                    copies=1,
                    history=again.pressure_slip(model, directions, pressed.force, loaded),
                ).slip_work
            yield Resolved(again.MATERIALS, name, one.case, one.value, value, one.unit)


def _solved(
    solution: HertzSolution,
    model: ContactModel,
    directions: tuple[int, ...],
    *,
    coupling: Coupling = "uncoupled",
) -> HertzSolution:
    """The run's own solve on the companion, with slip along ``directions``."""
    plan = again.variant(solution.plan, directions, coupling=coupling)
    found = HertzSolution(plan, model, solution.modulus)
    solve_normal(found, Stages())
    if plan.effect("friction"):
        solve_tangential(found, Stages())
    return found
