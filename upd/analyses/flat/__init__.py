"""A damper's flat face on its platform.

Pressure, opening, stick and slip, contact stiffness, and the contact points of a dynamic model.
"""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis
from upd.analyses.contact.bodies import needs
from upd.analyses.contact.levels import coarsened
from upd.analyses.contact.results import pick
from upd.analyses.flat import accuracy, charts, checks, left_out, output, results

ANALYSIS = Analysis(
    name="flat",
    headline_names=results.HEADLINE,
    input_checks=("Dundurs beta",),
    make_plan=accuracy.plan_to_accuracy,
    needs=needs,
    solve=left_out.solve,
    make_results=results.make_results,
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=partial(pick, names=results.HEADLINE),
    estimate=accuracy.estimate,
    verdict_names=("max_pressure",),
    coarsened=coarsened,
)

__all__ = ["ANALYSIS"]
