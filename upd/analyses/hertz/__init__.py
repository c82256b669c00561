"""A half-sphere or other curved body pressed and sheared on another.

Hertz's and Mindlin's problem.
"""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis
from upd.analyses.contact.bodies import needs
from upd.analyses.contact.levels import coarsened
from upd.analyses.contact.results import pick
from upd.analyses.hertz import accuracy, charts, checks, left_out, output, results

ANALYSIS = Analysis(
    name="hertz",
    headline_names=results.HEADLINE,
    input_checks=(
        "patch rim",
        "Dundurs beta",
        "contact radius against sphere",
        "slope in the contact",
    ),
    make_plan=accuracy.plan_to_accuracy,
    needs=needs,
    solve=left_out.solve,
    make_results=results.make_results,
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=partial(pick, names=results.HEADLINE, last=True),
    estimate=accuracy.estimate,
    coarsened=coarsened,
)

__all__ = ["ANALYSIS"]
