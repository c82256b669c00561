"""A half-sphere or other curved body pressed and sheared on another.

Hertz's and Mindlin's problem.
"""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis
from upd.analyses.contact import effects
from upd.analyses.contact.bodies import needs
from upd.analyses.contact.effects import CompanionSolver
from upd.analyses.contact.results import pick
from upd.analyses.contact.varied import (
    CURVED_GOVERNING,
    coarsened,
    make_wanted,
    mesh_problem,
    plan_with_estimates,
)
from upd.analyses.hertz import charts, checks, output, results
from upd.analyses.hertz.samples import sample
from upd.analyses.hertz.solve import solve_on, solve_plan
from upd.progress import Stages
from upd.vary import errors
from upd.vary.wanted import plan_wanted

PROBLEM = mesh_problem(solve_plan, results.make_results, sample)
WANTED = make_wanted(PROBLEM, CURVED_GOVERNING)
_AGAIN = CompanionSolver(lambda plan, model: solve_on(plan, model, Stages()), results.make_results)
ANALYSIS = Analysis(
    name="hertz",
    headline_names=results.HEADLINE,
    input_checks=(
        "patch rim",
        "Dundurs beta",
        "contact radius against sphere",
        "slope in the contact",
    ),
    make_plan=partial(plan_wanted, WANTED, partial(plan_with_estimates, PROBLEM)),
    needs=needs,
    solve=partial(effects.solve, WANTED, _AGAIN),
    make_results=results.make_results,
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=partial(pick, names=results.HEADLINE, last=True),
    estimate=partial(errors.estimate, PROBLEM),
    coarsened=coarsened,
)

__all__ = ["ANALYSIS"]
