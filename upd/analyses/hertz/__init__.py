"""A half-sphere or other curved body pressed and sheared on another.

Hertz's and Mindlin's problem.
"""

from __future__ import annotations

from upd.analyses.base import Analysis
from upd.analyses.contact.bodies import needs
from upd.analyses.hertz import accuracy, charts, checks, output, results

ANALYSIS = Analysis(
    name="hertz",
    headline_names=results.HEADLINE,
    input_checks=(
        "patch rim",
        "Dundurs beta",
        "contact radius against sphere",
        "slope in the contact",
        "transverse slip",
    ),
    make_plan=accuracy.plan_to_accuracy,
    needs=needs,
    solve=accuracy.solve_to_accuracy,
    make_results=results.make_results,
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=results.headline,
)

__all__ = ["ANALYSIS"]
