"""A damper's flat face on its platform: pressure, opening, stick and slip, contact stiffness, and the contact points of a dynamic model."""

from __future__ import annotations

from upd.analyses.flat.output import arrays, pairs, write_files
from upd.analyses.flat.plan import make_plan
from upd.analyses.flat.rows import make_rows
from upd.analyses.flat.solve import solve
from upd.analyses.flat.verdict import check_solution

#: Self-checks whose failure is a fault of the input.
USERS_FAULTS = ("Dundurs beta",)
#: Figures a run may leave, without their ending.
FIGURES = ("pressure", "contact_open", "surface", "force_approach", "stick_slip", "force_displacement", "contact_law")

__all__ = ["FIGURES", "USERS_FAULTS", "arrays", "check_solution", "make_plan", "make_rows", "pairs", "solve", "write_files"]
