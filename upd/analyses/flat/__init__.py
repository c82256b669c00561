"""A damper's flat face on its platform: pressure, opening, stick and slip, contact stiffness, and the contact points of a dynamic model."""

from __future__ import annotations

from upd.analyses.contact.bodies import needs
from upd.analyses.flat.charts import charts
from upd.analyses.flat.checks import check_solution
from upd.analyses.flat.output import arrays, sizes, write_files
from upd.analyses.flat.plan import make_plan
from upd.analyses.flat.results import HEADLINE, headline, make_results
from upd.analyses.flat.solve import solve

#: Self-checks whose failure is a fault of the input.
USERS_FAULTS = ("Dundurs beta",)

__all__ = [
    "HEADLINE", "USERS_FAULTS", "arrays", "charts", "check_solution", "headline", "make_plan", "make_results", "needs", "sizes", "solve",
    "write_files",
]  # fmt: skip
