"""What is asked of a seated damper: its analysis."""

from __future__ import annotations

from upd.analyses.base import Analysis, rig_needs
from upd.analyses.seated import charts, checks, output, results, varied
from upd.vary.inputs import coarsened_rig

ANALYSIS = Analysis(
    name="seated",
    headline_names=results.HEADLINE,
    input_checks=(),
    problem=varied.PROBLEM,
    needs=lambda plan, threads: rig_needs(plan, threads, "blades"),
    check_solution=checks.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=results.headline,
    ladders=varied.LADDERS,
    verdict_names=("face_N",),
    coarsened=lambda plan: coarsened_rig(plan, ("seating", "stiffness", "moved")),
)
