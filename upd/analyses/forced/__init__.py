"""Two blades with a friction damper between them: forced response by multi-harmonic balance, free, stuck and nonlinear."""

from __future__ import annotations

from upd.analyses.forced.output import arrays, pairs, write_files
from upd.analyses.forced.plan import make_plan
from upd.analyses.forced.rows import make_rows
from upd.analyses.forced.solve import solve
from upd.analyses.forced.verdict import check_solution

#: Self-checks whose failure is a fault of the input.
USERS_FAULTS = ()
#: Figures a run may leave, without their ending.
FIGURES = ("response", "contact_state", "contact_map", "hysteresis", "damper_motion", "performance", "spread", "harmonics")

__all__ = ["FIGURES", "USERS_FAULTS", "arrays", "check_solution", "make_plan", "make_rows", "pairs", "solve", "write_files"]
