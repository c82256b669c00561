"""A half-sphere or other curved body pressed and sheared on another: Hertz's and Mindlin's problem."""

from __future__ import annotations

from upd.analyses.contact.bodies import needs
from upd.analyses.contact.plan import ContactPlan
from upd.analyses.hertz.accuracy import predicted_plan, solve_to_accuracy
from upd.analyses.hertz.charts import charts
from upd.analyses.hertz.checks import check_solution
from upd.analyses.hertz.output import arrays, sizes, write_files
from upd.analyses.hertz.plan import make_plan as plan_as_given
from upd.analyses.hertz.results import HEADLINE, headline, make_results
from upd.analyses.hertz.solve import HertzSolution, solve_plan
from upd.progress import Stages
from upd.scene import Scene

#: Self-checks whose failure is a fault of the input.
USERS_FAULTS = ("patch rim", "Dundurs beta", "contact radius against sphere", "slope in the contact", "transverse slip")


def make_plan(scene: Scene) -> ContactPlan:
    """Derive the plan of ``scene``, on the predicted mesh when it asks for an accuracy. Raises InputError."""
    return plan_as_given(scene) if scene.mesh.accuracy is None else predicted_plan(scene)


def solve(plan: ContactPlan, stages: Stages) -> HertzSolution:
    """Run everything the plan calls for, on the cheapest mesh that reaches its accuracy when the scene asks for one."""
    return solve_plan(plan, stages) if plan.asked is None else solve_to_accuracy(plan.asked, stages)


__all__ = [
    "HEADLINE", "USERS_FAULTS", "arrays", "charts", "check_solution", "headline", "make_plan", "make_results", "needs", "sizes", "solve",
    "write_files",
]  # fmt: skip
