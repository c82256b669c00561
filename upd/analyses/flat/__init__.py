"""A damper's flat face on its platform.

Pressure, opening, stick and slip, contact stiffness, and the contact points of a dynamic model.
"""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis
from upd.analyses.contact import effects
from upd.analyses.contact.bodies import needs
from upd.analyses.contact.effects import CompanionSolver
from upd.analyses.contact.results import pick
from upd.analyses.contact.varied import (
    FLAT_GOVERNING,
    coarsened,
    make_wanted,
    mesh_problem,
    plan_with_estimates,
)
from upd.analyses.flat import charts, checks, output, results
from upd.analyses.flat.solve import note_moved, solve_companion, solve_plan
from upd.vary import errors
from upd.vary.wanted import plan_wanted

PROBLEM = mesh_problem(solve_plan, results.make_results)
WANTED = make_wanted(PROBLEM, FLAT_GOVERNING)
_AGAIN = CompanionSolver(solve_companion, results.make_results, note_moved)
ANALYSIS = Analysis(
    name="flat",
    headline_names=results.HEADLINE,
    input_checks=("Dundurs beta",),
    make_plan=partial(plan_wanted, WANTED, partial(plan_with_estimates, PROBLEM)),
    needs=needs,
    solve=partial(effects.solve, WANTED, _AGAIN),
    make_results=results.make_results,
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=partial(pick, names=results.HEADLINE),
    estimate=partial(errors.estimate, PROBLEM),
    verdict_names=("max_pressure",),
    coarsened=coarsened,
)

__all__ = ["ANALYSIS"]
