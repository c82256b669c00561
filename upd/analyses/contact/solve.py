"""Quasi-static contact of two bodies.

Mesh, stiffness, condensation, every normal load with the force-approach curve, tangential contact.
Arrays in, arrays out.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.bodies import prepare, show_normal
from upd.analyses.contact.faces import measured
from upd.analyses.contact.loading import (
    LOAD_STEP,
    CoupledState,
    as_normal,
    raised,
    slope,
    slope_loads,
    tilt_arms,
)
from upd.analyses.contact.plan import NORMAL, ContactPlan, DamperLoad, normal_loads
from upd.analyses.contact.shares import solve_inside
from upd.analyses.contact.solution import ContactSolution, NormalCase, PressedContact
from upd.analyses.contact.tangential import solve_tangential
from upd.contact.model import Body, ContactModel
from upd.contact.normal import normal_contact, normal_curve
from upd.contact.products import KNOWN, settled
from upd.contact.tilt import tilted_contact
from upd.progress import Stages

Array = NDArray[np.float64]


def solve_plan(
    plan: ContactPlan,
    stages: Stages,
    model: ContactModel | None = None,
    *,
    companion: bool = False,
) -> ContactSolution:
    """Run everything the plan calls for, but for the effects it leaves out.

    An error raised on the way carries what converged so far as ``partial``.

    Parameters
    ----------
    model
        None: the plan's own.
    companion
        Whether it is one: its march to the tangential loads takes few steps.
    """
    solution = ContactSolution(plan, prepare(plan, stages) if model is None else model)
    try:
        solve_normal(solution, stages)
        if plan.effect("friction"):
            solve_tangential(solution, stages, companion=companion)
        if plan.effect("internal displacement"):
            with stages("internal displacement", "back-substitution"):
                solve_inside(solution)
    except BaseException as error:
        error.partial = solution  # type: ignore[attr-defined]
        raise
    return solution


def solve_normal(solution: ContactSolution, stages: Stages) -> None:
    """Every normal load and the force-approach curve."""
    plan = solution.plan
    loads = normal_loads(plan.scene)
    wanted = [load.force for load in loads]
    curve = _curve_loads(plan, max(wanted), solution.curved)
    around = slope_loads(wanted) if _by_slope(solution) else []
    with stages("normal contact", f"{len({*wanted, *curve, *around})} loads"):
        found = press(solution, [*wanted, *curve, *around])
        solution.normal = [_case(solution, load, found) for load in loads]
        solution.curve = [_case(solution, DamperLoad(F), found) for F in curve]
        for body in _bodies_alone(solution):
            alone = press(solution, [*wanted, *around], body)
            for case in solution.normal:
                case.alone[body.name] = alone[case.force]


def _by_slope(solution: ContactSolution) -> bool:
    """Whether stiffnesses are slopes of the curve between loads a little below and above: with a
    curved gap a stiffness at one contact set moves in steps as nodes come into contact.
    """
    scene = solution.plan.scene
    return scene.wants("stiffness") if solution.curved else scene.coupled


def _curve_loads(plan: ContactPlan, largest: float, curved: bool) -> list[float]:
    """Loads in N of the force-approach curve, those of a curved contact evenly spaced in approach
    by Hertz's F ~ d^1.5.
    """
    loads = plan.scene.loads
    top = largest if loads.curve_to is None else loads.curve_to
    if not plan.effect("load curve") or not top > 0.0:
        return []
    n = loads.curve_points
    if curved:
        return [top * s**1.5 for s in np.linspace(0.0, 1.0, n + 1)[1:]]
    return [top * k / n for k in range(1, n + 1)]


def press(
    solution: ContactSolution, forces: Iterable[float], body: Body | None = None
) -> dict[float, PressedContact]:
    """Answers of the forces in N on the whole contact, by force.

    Parameters
    ----------
    body
        Against a rigid counterpart: it adds no compliance, so the contact is solved with the body's
        own alone: f >= 0, h + C_b f - d e >= 0, e'f = F. The forces of the pair would not do: of
        all that carry F over touching faces its own have the least energy f'C_b f, so a stiffness
        F^2 / f'C_b f by any others is too soft. None: both bodies.
    """
    plan, model = solution.plan, solution.model
    distinct = sorted(set(forces))
    if plan.scene.coupled:
        return _sheared_too(solution, distinct, body)
    loads, arms = [F / plan.copies for F in distinct], tilt_arms(plan, model)
    if solution.curved:
        show_normal(model, loads)

    def compliance() -> Array:
        return model.compliance(NORMAL) if body is None else model.body_compliance(body, NORMAL)

    if arms.size:
        found, free = [], (0 not in plan.mirrors, 1 not in plan.mirrors)
        for F in loads:
            t = tilted_contact(compliance(), model.gap, arms, load=F, free=free)
            found.append(PressedContact(t.normal, plan.copies * t.free_stiffness, tilt=t.tilt))
    else:
        answers = settled(
            model,
            (NORMAL,),
            lambda: normal_curve(compliance(), model.gap, loads),
            lambda found: [(np.column_stack([one.force for one in found]), KNOWN)],
        )
        found = [PressedContact(one, plan.copies * one.stiffness) for one in answers]
    out = dict(zip(distinct, found, strict=True))
    for F in distinct if _by_slope(solution) else ():
        ends = [out.get(F * (1.0 + s)) for s in (-LOAD_STEP, LOAD_STEP)]
        if F > 0.0 and ends[0] and ends[1]:
            moved = ends[1].solution.approach - ends[0].solution.approach
            out[F].stiffness = 2.0 * LOAD_STEP * F / moved
    return out


def _sheared_too(
    solution: ContactSolution, forces: Sequence[float], body: Body | None
) -> dict[float, PressedContact]:
    """The same with normal and tangential contact at once, the slope of the curve as the stiffness
    where it is known.
    """
    model, mu = solution.model, solution.plan.scene.contact.friction
    arms = tilt_arms(solution.plan, model)
    states = raised(model, mu, forces, arms, body=body)
    # no load: friction has nothing to hold
    none = partial(normal_contact, model.compliance(NORMAL), model.gap, load=0.0)
    out = {F: PressedContact(none(), 0.0) for F in forces if not F > 0.0}
    for F, state in states.items():
        sloped = all(F * (1.0 + s) in states for s in (-LOAD_STEP, LOAD_STEP))
        free = slope(states, F) if sloped else float("nan")
        held = _held_stiffness(state) if arms.size and sloped and body is None else free
        tilt = state.motion[3:] if arms.size else None
        out[F] = PressedContact(as_normal(state, held), free, state, tilt)
    return out


def _held_stiffness(state: CoupledState) -> float:
    """dF/d approach in N/mm with the tilts held and the states kept, shifts following."""
    return float(1.0 / np.linalg.inv(state.found.stiffness()[:3, :3])[0, 0])


def _bodies_alone(solution: ContactSolution) -> tuple[Body, ...]:
    """Bodies whose stiffness against a rigid counterpart is asked for."""
    scene, model = solution.plan.scene, solution.model
    if solution.curved:
        return ()
    if scene.wants("stiffness"):
        return model.upper, model.lower
    return (model.upper,) if scene.wants("contact_law") and scene.law.bodies == "upper" else ()


def _case(
    solution: ContactSolution, load: DamperLoad, found: dict[float, PressedContact]
) -> NormalCase:
    measures = measured(solution, found[load.force].solution, load.force)
    return NormalCase(**vars(found[load.force]), load=load, measures=measures)
