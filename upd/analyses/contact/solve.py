"""Quasi-static contact of two bodies.

Mesh, stiffness, condensation, normal contact, tangential contact. Arrays in, arrays out.
"""

from __future__ import annotations

from upd.analyses.contact.bodies import prepare
from upd.analyses.contact.normal import solve_normal
from upd.analyses.contact.plan import ContactPlan
from upd.analyses.contact.shares import solve_inside
from upd.analyses.contact.solution import ContactSolution
from upd.analyses.contact.tangential import solve_tangential
from upd.contact.model import ContactModel
from upd.progress import Stages


def solve_plan(plan: ContactPlan, stages: Stages) -> ContactSolution:
    """Run everything the plan calls for, but for the effects it leaves out.

    An error raised on the way carries what converged so far as ``partial``.
    """
    return solve_on(plan, prepare(plan, stages), stages)


def solve_companion(plan: ContactPlan, model: ContactModel) -> ContactSolution:
    """Every load on the companion."""
    return solve_on(plan, model, Stages(), companion=True)


def solve_on(
    plan: ContactPlan, model: ContactModel, stages: Stages, *, companion: bool = False
) -> ContactSolution:
    """Every load on a contact model."""
    solution = ContactSolution(plan, model)
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
