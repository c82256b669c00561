"""Modal analysis of two blades on their bases.

Modes free and with the damper glued, Craig-Bampton models, linear frequency response.
"""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis, rig_needs
from upd.analyses.modal import charts, output, results, varied
from upd.vary import errors
from upd.vary.inputs import coarsened_rig
from upd.vary.wanted import plan_wanted

ANALYSIS = Analysis(
    name="modal",
    headline_names=results.HEADLINE,
    input_checks=(),
    make_plan=partial(plan_wanted, varied.WANTED, varied.WANTED.make_plan),
    needs=partial(rig_needs, "reduction"),
    solve=varied.solve_levels,
    make_results=results.make_results,
    check_solution=results.check_solution,
    arrays=output.arrays,
    sizes=output.sizes,
    write_files=output.write_files,
    charts=charts.charts,
    headline=results.headline,
    estimate=partial(errors.estimate, varied.PROBLEM),
    coarsened=lambda plan: coarsened_rig(plan, ("free", "glued", "response")),
)

__all__ = ["ANALYSIS"]
