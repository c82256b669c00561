"""Two blades on their bases: modes free and with the damper glued, Craig-Bampton models, linear frequency response."""

from __future__ import annotations

from upd.analyses.rig.output import arrays, pairs, write_files
from upd.analyses.rig.plan import make_plan
from upd.analyses.rig.rows import make_rows
from upd.analyses.rig.solve import solve
from upd.analyses.rig.verdict import check_solution

#: Self-checks whose failure is a fault of the input.
USERS_FAULTS = ()
#: Figures a run may leave, without their ending.
FIGURES = ("modes_free", "modes_glued", "response")

__all__ = ["FIGURES", "USERS_FAULTS", "arrays", "check_solution", "make_plan", "make_rows", "pairs", "solve", "write_files"]
