"""Two blades with a friction damper between them.

Forced response by multi-harmonic balance, free, stuck and nonlinear.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from upd.analyses.base import Analysis, rig_needs
from upd.analyses.forced import answer, checks, results, varied
from upd.analyses.forced.solve import ForcedSolution
from upd.linalg.parallel import threads_for
from upd.vary.inputs import coarsened_rig


def _on_one_thread(make: Callable[[ForcedSolution], Any], solution: ForcedSolution) -> Any:
    """Read a solution with small matrices on one thread, where more would wait for each other."""
    orders = [len(one.M) for one in solution.models.values()]
    orders += [3 * one.of.n for one in solution.faces.values()]
    with threads_for(max(orders, default=0)):
        return make(solution)


def _sizes(solution: ForcedSolution) -> dict[str, int]:
    """Contact points of the first stiffness, or nodes of whole faces."""
    counts = [m.contacts.n_point for m in solution.models.values()]
    return {"n_pairs": next(iter(counts + [f.of.n for f in solution.faces.values()]), 0)}


ANALYSIS = Analysis(
    name="forced",
    headline_names=answer.MAIN,
    problem=replace(varied.PROBLEM, make_results=partial(_on_one_thread, results.make_results)),
    needs=lambda plan, threads: rig_needs(plan, threads, "reduction"),
    check_solution=partial(_on_one_thread, checks.check_solution),
    arrays=partial(_on_one_thread, results.arrays),
    sizes=_sizes,
    charts=answer.charts,
    headline=answer.headline,
    ladders=varied.LADDERS,
    answer=answer.answer,
    verdict_names=("best_peak", "reduction_of_free_peak"),
    coarsened=lambda plan: coarsened_rig(plan, ("response",), ("balance.method", "balance")),
)
