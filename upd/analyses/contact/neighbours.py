"""Numbers of a solved contact at neighbouring loads: how far they scatter with the place of the
contact's edge between the nodes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from upd.analyses.contact.faces import rim_nodes
from upd.analyses.contact.normal import solve_normal
from upd.analyses.contact.results import make_results
from upd.analyses.contact.solution import ContactSolution, NormalCase
from upd.analyses.contact.tangential import solve_tangential
from upd.analyses.contact.varied import has_neighbours, neighbours, plan_at
from upd.errors import UpdError
from upd.progress import Stages
from upd.results import Case
from upd.vary.scatter import Samples


def sample(solution: ContactSolution) -> Samples:
    """The numbers of every loaded case at neighbouring loads.

    They move the contact's edge by up to one spacing of the lattice each way, on the same condensed
    bodies. What the finite bodies add to a displacement is taken in proportion to the load: it
    knows the total force only. A load whose contact reaches the rim of the patch is omitted.

    Returns
    -------
    Samples
        Empty where a neighbour is not cheap.
    """
    if not has_neighbours(solution.plan.scene):
        return {}
    found: dict[tuple[str, Case], list[tuple[float, float]]] = {
        (r.name, r.case): [(0.0, r.value)]
        for r in make_results(solution, misfits=False)
        if not r.withheld and r.case.load
    }
    for case in solution.normal:
        touching = int(np.count_nonzero(solution.model.patch.whole(case.solution.force) > 0.0))
        for t in neighbours(touching) if case.force > 0.0 else ():
            for name, of, value in _values(solution, case, case.force * float(np.exp(t))):
                key = name, replace(of, load=case.force)
                if key in found:
                    found[key].append((t, value))
    return {key: np.array(rows) for key, rows in found.items()}


def _values(
    solution: ContactSolution, case: NormalCase, load: float
) -> list[tuple[str, Case, float]]:
    """The numbers at a load near the case's; none where it is too large for the patch."""
    near = ContactSolution(plan_at(solution.plan, (load,)), solution.model)
    try:
        solve_normal(near, Stages())
        (one,) = near.normal
        if rim_nodes(near, one):
            return []
        one.shares = {body: s.over(case.force / load) for body, s in case.shares.items()}
        one.shear_shares = case.shear_shares
        if near.plan.effect("friction"):
            solve_tangential(near, Stages())
        return [
            (r.name, r.case, r.value) for r in make_results(near, misfits=False) if not r.withheld
        ]
    except UpdError:
        # The load itself was solved: a neighbour that is not is a sample less.
        return []
