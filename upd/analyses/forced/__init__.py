"""Two blades with a friction damper between them.

Forced response by multi-harmonic balance, free, stuck and nonlinear.
"""

from __future__ import annotations

from upd.analyses.base import Analysis
from upd.analyses.forced import charts, checks, headline, output, plan, results, solve

ANALYSIS = Analysis(
    name="forced",
    headline_names=headline.HEADLINE,
    input_checks=(),
    make_plan=plan.make_plan,
    needs=plan.needs,
    solve=solve.solve,
    make_results=results.make_results,
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=headline.headline,
    verdict_names=("lowest_peak", "reduction_of_free_peak"),
)

__all__ = ["ANALYSIS"]
