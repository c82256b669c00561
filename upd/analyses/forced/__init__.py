"""Two blades with a friction damper between them: forced response by multi-harmonic balance, free, stuck and nonlinear."""

from __future__ import annotations

from upd.analyses.forced.charts import charts
from upd.analyses.forced.checks import check_solution
from upd.analyses.forced.output import arrays, sizes, write_files
from upd.analyses.forced.plan import make_plan, needs
from upd.analyses.forced.results import HEADLINE, headline, make_results
from upd.analyses.forced.solve import solve

#: Self-checks whose failure is a fault of the input.
USERS_FAULTS = ()

__all__ = [
    "HEADLINE", "USERS_FAULTS", "arrays", "charts", "check_solution", "headline", "make_plan", "make_results", "needs", "sizes", "solve",
    "write_files",
]  # fmt: skip
