"""Modal analysis of two blades on their bases.

Modes free and with the damper glued, Craig-Bampton models, linear frequency response.
"""

from __future__ import annotations

from upd.analyses.base import Analysis
from upd.analyses.input_uncertainty import coarsened_rig
from upd.analyses.modal import accuracy, charts, checks, output, plan, results

ANALYSIS = Analysis(
    name="modal",
    headline_names=results.HEADLINE,
    input_checks=(),
    make_plan=accuracy.plan_to_accuracy,
    needs=plan.needs,
    solve=accuracy.solve_to_accuracy,
    make_results=results.make_results,
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=results.headline,
    estimate=accuracy.estimate,
    coarsened=lambda plan: coarsened_rig(plan, ("free", "glued", "response")),
)

__all__ = ["ANALYSIS"]
