"""Free vibration of a tuned bladed disk from one sector.

Modes by nodal diameter, Campbell diagram, interference diagram.
"""

from __future__ import annotations

from upd.analyses.base import Analysis, rig_needs
from upd.analyses.bladed_disk import charts, output, plan, solve

ANALYSIS = Analysis(
    name="bladed_disk",
    headline_names=output.HEADLINE,
    input_checks=(),
    make_plan=plan.make_plan,
    needs=rig_needs,
    solve=solve.solve,
    make_results=output.make_results,
    check_solution=output.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=output.headline,
    answer=output.answer,
    estimate=output.estimate,
)

__all__ = ["ANALYSIS"]
