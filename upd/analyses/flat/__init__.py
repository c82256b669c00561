"""A damper's flat face on its platform.

Pressure, opening, stick and slip, contact stiffness, and the contact points of a dynamic model.
"""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis
from upd.analyses.contact import effects
from upd.analyses.contact.bodies import needs
from upd.analyses.contact.effects import SolvedAgain
from upd.analyses.contact.levels import coarsened, plan_with_estimates
from upd.analyses.contact.results import pick
from upd.analyses.flat import accuracy, charts, checks, output, results
from upd.analyses.flat.solve import note_moved, solve_companion
from upd.vary import errors
from upd.vary.wanted import plan_wanted

_AGAIN = SolvedAgain(solve_companion, results.make_results, note_moved)
ANALYSIS = Analysis(
    name="flat",
    headline_names=results.HEADLINE,
    input_checks=("Dundurs beta",),
    make_plan=partial(plan_wanted, accuracy.WANTED, partial(plan_with_estimates, accuracy.PROBLEM)),
    needs=needs,
    solve=partial(effects.solve, accuracy.WANTED, _AGAIN),
    make_results=results.make_results,
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=partial(pick, names=results.HEADLINE),
    estimate=partial(errors.estimate, accuracy.PROBLEM),
    verdict_names=("max_pressure",),
    coarsened=coarsened,
)

__all__ = ["ANALYSIS"]
