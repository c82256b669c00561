"""A half-sphere or other curved body pressed and sheared on another: Hertz's and Mindlin's problem."""

from __future__ import annotations

from upd.analyses.curved.output import arrays, pairs, write_files
from upd.analyses.curved.plan import make_plan
from upd.analyses.curved.rows import make_rows
from upd.analyses.curved.solve import solve
from upd.analyses.curved.verdict import check_solution

#: Self-checks whose failure is a fault of the input.
USERS_FAULTS = ("patch rim", "Dundurs beta", "contact radius against sphere", "slope in the contact", "transverse slip")
#: Figures a run may leave, without their ending.
FIGURES = ("pressure", "force_approach", "stick_slip", "traction", "hysteresis")

__all__ = ["FIGURES", "USERS_FAULTS", "arrays", "check_solution", "make_plan", "make_rows", "pairs", "solve", "write_files"]
