"""Modal analysis of two blades on their bases.

Modes free and with the damper glued, Craig-Bampton models, linear frequency response.
"""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis, first_numbers, rig_needs
from upd.analyses.modal import output, results, varied
from upd.vary.inputs import coarsened_rig

ANALYSIS = Analysis(
    name="modal",
    headline_names=results.HEADLINE,
    problem=varied.PROBLEM,
    needs=lambda plan, threads: rig_needs(plan, threads, "reduction"),
    check_solution=results.check_solution,
    arrays=output.arrays,
    write_files=output.write_files,
    charts=output.charts,
    headline=partial(first_numbers, names=results.HEADLINE),
    ladders=varied.LADDERS,
    coarsened=lambda plan: coarsened_rig(plan, ("free", "glued", "response")),
)
