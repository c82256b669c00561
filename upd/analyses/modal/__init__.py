"""Modal analysis of two blades on their bases: modes free and with the damper glued, Craig-Bampton models, linear frequency response."""

from __future__ import annotations

from upd.analyses.modal.charts import charts
from upd.analyses.modal.checks import check_solution
from upd.analyses.modal.output import arrays, sizes, write_files
from upd.analyses.modal.plan import make_plan, needs
from upd.analyses.modal.results import HEADLINE, headline, make_results
from upd.analyses.modal.solve import solve

#: Self-checks whose failure is a fault of the input.
USERS_FAULTS = ()

__all__ = [
    "HEADLINE", "USERS_FAULTS", "arrays", "charts", "check_solution", "headline", "make_plan", "make_results", "needs", "sizes", "solve",
    "write_files",
]  # fmt: skip
