"""Errors of a flat contact's numbers, from coarser meshes."""

from __future__ import annotations

from collections.abc import Sequence

from upd.analyses.contact.levels import mesh_estimates
from upd.analyses.contact.plan import ContactPlan
from upd.analyses.flat.plan import make_plan
from upd.analyses.flat.results import make_results
from upd.analyses.flat.solution import FlatSolution
from upd.analyses.flat.solve import solve_plan
from upd.progress import Stages
from upd.results import Estimates, Result


def estimate(solution: FlatSolution, numbers: Sequence[Result], stages: Stages) -> Estimates:
    """The error of every number by the mesh."""
    return mesh_estimates(solution.plan, numbers, stages, make_plan, _numbers)


def _numbers(plan: ContactPlan) -> list[Result]:
    return make_results(solve_plan(plan, Stages()))
