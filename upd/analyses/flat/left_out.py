"""Effects that a flat contact leaves out, solved again.

The tilt with the run's own compliance, the others on the plan's companion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved
from upd.analyses.contact import left_out as again
from upd.analyses.contact.bodies import prepare_companion
from upd.analyses.contact.coupled import raised, slope, slope_loads
from upd.analyses.contact.left_out import Pressed
from upd.analyses.contact.loading import closed_loop, tangential_compliance
from upd.analyses.contact.plan import (
    ACROSS,
    ALONG,
    NORMAL,
    ContactPlan,
    direction_name,
    unit_vector,
)
from upd.analyses.flat.accuracy import WANTED
from upd.analyses.flat.results import make_results
from upd.analyses.flat.solution import FlatNormalCase, FlatSolution, StuckContact
from upd.analyses.flat.solve import (
    PATH_SHARES,
    components_of,
    contact_points_of,
    load_point,
    moved_by_shear,
    solve_normal,
    solve_tangential,
    tilt_arms,
)
from upd.contact.model import ContactModel
from upd.contact.normal import normal_contact
from upd.contact.threads import few_threads
from upd.contact.tilt import tilted_contact
from upd.errors import InputError, UpdError
from upd.progress import Stages
from upd.results import Result
from upd.scene.contact import Coupling
from upd.vary.wanted import solve_wanted

Array = NDArray[np.float64]


def solve(plan: ContactPlan, stages: Stages) -> FlatSolution:
    """Run everything the plan calls for, and numbers again with the effects it leaves out.

    An error raised on the way carries what converged so far as ``partial``.
    """
    solution: FlatSolution
    solution, estimates = solve_wanted(WANTED, plan, stages)
    solution = replace(solution, estimates=estimates)
    plan = solution.plan
    companion = plan.companion
    cases = [case.case for case in solution.normal if case.force > 0.0]
    try:
        with stages("effects left out", "the tilt; the others on a coarser whole model"):
            if again.left_out(plan, again.TILT):
                solution.left_out += [
                    _tilted(solution, case) for case in solution.normal if case.force > 0.0
                ]
            if companion is not None:
                try:
                    model = prepare_companion(companion)
                    with few_threads(model.gap):
                        solution.left_out += list(solve_again(solution, model))
                except UpdError:
                    solution.left_out += again.not_solved(plan, cases)
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def _tilted(solution: FlatSolution, case: FlatNormalCase) -> Resolved:
    """The run's own contact with a free tilt: rotations of the upper body as a whole beside its
    condensed compliance.

    A half model is its own mirror image, which leaves the tilt along the plane. A body that tips
    over has neither stiffness nor approach: 0 N/mm, or NaN.
    """
    plan, model = solution.plan, solution.model
    stiff = plan.scene.wants("stiffness")
    quantity, unit = ("K_N_tangent_raw", "N/mm") if stiff else ("approach", "um")
    without = case.stiffness if stiff else 1e3 * case.solution.approach
    remedy, arms = "", contact_points_of(model)[:, :2] - load_point(solution)
    try:
        found = tilted_contact(
            model.compliance(NORMAL),
            model.gap,
            arms,
            load=case.force / plan.copies,
            start=case.solution.contact,
            free=(0 not in plan.mirrors, 1 not in plan.mirrors),
        )
        included = plan.copies * found.free_stiffness if stiff else 1e3 * found.normal.approach
        if case.state is not None:
            # It does not tip over; with friction again.
            states = raised(model, plan.scene.contact.friction, slope_loads([case.force]), arms)
            approach = 1e3 * float(states[case.force].motion[0])
            included = slope(states, case.force) if stiff else approach
    except InputError:
        included, remedy = 0.0 if stiff else float("nan"), again.TIPS
    except UpdError:
        included = float("nan")
    return Resolved(again.TILT, quantity, case.case, without, included, unit, remedy)


def solve_again(solution: FlatSolution, model: ContactModel) -> Iterator[Resolved]:
    """Every number that shows what an effect left out changes, on the companion ``model``.

    What shear would move of the pressure is measured on it as well.
    """
    plan = solution.plan
    assert plan.companion is not None
    arms = tilt_arms(FlatSolution(again.variant(plan, (ALONG, ACROSS)), model))

    def press(gap: Array, load: float) -> Pressed:
        if plan.scene.coupled:
            state = raised(model, plan.scene.contact.friction, [load], arms, gap=gap)[load]
            return Pressed(float(state.motion[0]), state.force[:, 0])
        C = model.compliance(NORMAL)
        found = (
            tilted_contact(C, gap, arms, load=load).normal
            if arms.size
            else normal_contact(C, gap, load=load)
        )
        return Pressed(found.approach, found.force)

    for case in solution.normal:
        if case.force > 0.0:
            yield from again.displaced_changes(plan, model, press, case.case, case.force)
    # What is left out beside coupling, coupled contact has.
    if not plan.scene.coupled:
        yield from _sheared(solution, model)


def _sheared(solution: FlatSolution, model: ContactModel) -> Iterator[Resolved]:
    plan = solution.plan
    mine = _solved(solution, model, plan.scene.contact.directions)
    numbers = make_results(mine)
    yield from again.coupled_changes(
        plan, numbers, lambda: make_results(_solved(solution, model, 2, coupling="coupled"))
    )
    if again.left_out(plan, again.DIRECTIONS):
        both = make_results(_solved(solution, model, 2))
        names = [f"K_T{direction_name(d)}_initial_raw" for d in plan.scene.loads.directions]
        names += ["K_T_secant_raw", "cycle_energy"]
        found = list(again.changes(again.DIRECTIONS, names, numbers, both))
        yield from found or again.changes(again.DIRECTIONS, ("K_T_tangent_raw",), numbers, both)
    for stuck in mine.stuck:
        case = next(c for c in mine.normal if c.case == stuck.normal)
        solution.moved[stuck.case] = moved_by_shear(mine, case, stuck)
        if again.left_out(plan, again.MATERIALS):
            yield from _unlike(mine, case, stuck, numbers)


def _unlike(
    mine: FlatSolution, case: FlatNormalCase, stuck: StuckContact, numbers: list[Result]
) -> Iterator[Resolved]:
    """The tangential loads with the slip of the pressure alone already there."""
    scene, model = mine.plan.scene, mine.model
    components = components_of(scene, stuck.direction)
    unit, mu = unit_vector(stuck.direction, components), scene.contact.friction
    s = case.solution
    pressed = Pressed(s.approach, s.force)
    for t in (t for t in mine.tangential if t.normal is case and t.direction == stuck.direction):
        for one in (r for r in numbers if r.name == "K_T_secant_raw" and r.case == t.case):
            K = again.slipped_stiffness(model, components, pressed, mu, t.load * unit)
            yield Resolved(again.MATERIALS, one.name, one.case, one.value, K, one.unit)
    loaded = np.flatnonzero(s.force > 0.0)
    for one in (r for r in numbers if r.name == "cycle_energy" and r.case == stuck.case):
        loop = closed_loop(
            stuck.case,
            case.case,
            tangential_compliance(model, components, loaded),
            mu * s.force[loaded],
            peak=scene.loads.cycle_amplitude * mu * case.force,
            steps=scene.loads.cycle_steps,
            unit=unit,
            copies=1,
            history=again.pressure_slip(model, components, s.force, loaded),
        )
        yield Resolved(again.MATERIALS, one.name, one.case, one.value, loop.slip_work, one.unit)


def _solved(
    solution: FlatSolution,
    model: ContactModel,
    directions: int,
    *,
    coupling: Coupling = "uncoupled",
) -> FlatSolution:
    """The run's own solve on the companion, with slip in one direction or two.

    The march to the largest load takes four steps: exact along one direction; along two the slip
    turns a little from step to step. Coupled, which nodes stick goes with the steps: the run's.
    """
    plan = again.variant(solution.plan, (ALONG, ACROSS)[:directions], coupling=coupling)
    found = FlatSolution(plan, model)
    solve_normal(found, Stages())
    if plan.effect("friction"):
        ratio = again.largest_ratio(plan.scene)
        few = ratio * np.array([0.25, 0.5, 0.75])
        steps = PATH_SHARES[ratio > PATH_SHARES] if plan.scene.coupled else few
        solve_tangential(found, Stages(), steps)
    return found
