"""Free vibration of a tuned bladed disk from one sector.

Modes by nodal diameter, Campbell diagram, interference diagram.
"""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis, first_numbers, rig_needs
from upd.analyses.bladed_disk import charts, output, plan, solve
from upd.vary.variation import Problem

ANALYSIS = Analysis(
    name="bladed_disk",
    headline_names=output.HEADLINE,
    problem=Problem(
        plan.make_plan,
        solve.solve,
        output.make_results,
        corrected=lambda solution, numbers, found: output.estimate(solution, numbers),
    ),
    needs=rig_needs,
    check_solution=output.check_solution,
    arrays=output.arrays,
    write_files=output.write_files,
    charts=charts.charts,
    headline=partial(first_numbers, names=output.HEADLINE),
    ladders=plan.LADDERS,
)
