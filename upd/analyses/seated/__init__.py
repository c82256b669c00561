"""An elastic damper between two elastic blades, seated by F_C with friction.

Coupled contact on every matching node of both faces: forces, stick and slip, stiffness, hysteresis.
"""

from __future__ import annotations

from functools import partial

from upd.analyses.base import Analysis, first_numbers, rig_needs
from upd.analyses.seated import charts, output, results, varied
from upd.vary.inputs import coarsened_rig

ANALYSIS = Analysis(
    name="seated",
    headline_names=results.HEADLINE,
    problem=varied.PROBLEM,
    needs=lambda plan, threads: rig_needs(plan, threads, "blades"),
    check_solution=results.check_solution,
    arrays=output.arrays,
    sizes=lambda solution: {"n_pairs": solution.interface.n},
    write_files=output.write_files,
    charts=charts.charts,
    headline=partial(first_numbers, names=results.HEADLINE),
    ladders=varied.LADDERS,
    verdict_names=("face_N",),
    coarsened=lambda plan: coarsened_rig(plan, ("seating", "stiffness", "moved")),
)
