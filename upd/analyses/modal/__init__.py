"""Modal analysis of two blades on their bases.

Modes free and with the damper glued, Craig-Bampton models, linear frequency response.
"""

from __future__ import annotations

from upd.analyses.base import Analysis
from upd.analyses.coarser_rig import coarsened_rig
from upd.analyses.modal import charts, checks, estimates, output, plan, results, solve

ANALYSIS = Analysis(
    name="modal",
    headline_names=results.HEADLINE,
    input_checks=(),
    make_plan=estimates.plan_with_estimates,
    needs=plan.needs,
    solve=solve.solve,
    make_results=results.make_results,
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=results.headline,
    estimate=estimates.estimate,
    coarsened=lambda plan: coarsened_rig(plan, ("free", "glued", "response")),
)

__all__ = ["ANALYSIS"]
