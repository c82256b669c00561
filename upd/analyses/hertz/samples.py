"""Numbers of a solved contact at neighbouring loads: how far they scatter with the place of the
contact's edge between the nodes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.solution import HertzNormalCase, HertzSolution
from upd.analyses.contact.varied import has_neighbours, neighbours, plan_at
from upd.analyses.hertz.results import make_results
from upd.analyses.hertz.solve import solve_normal, solve_tangential
from upd.errors import UpdError
from upd.progress import Stages
from upd.results import Case
from upd.vary.scatter import Samples

FloatArray = NDArray[np.float64]


def sample(solution: HertzSolution) -> Samples:
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
        touching = int(np.count_nonzero(case.force > 0.0))
        for t in neighbours(touching) if case.load > 0.0 else ():
            for name, of, value in _values(solution, case, case.load * float(np.exp(t))):
                key = name, replace(of, load=case.load)
                if key in found:
                    found[key].append((t, value))
    return {key: np.array(rows) for key, rows in found.items()}


def _values(
    solution: HertzSolution, case: HertzNormalCase, load: float
) -> list[tuple[str, Case, float]]:
    """The numbers at a load near the case's; none where it is too large for the patch."""
    near = HertzSolution(plan_at(solution.plan, (load,)), solution.model, solution.modulus)
    try:
        solve_normal(near, Stages())
        (one,) = near.normal
        if _at_rim(one.force):
            return []
        one.shares = {body: s.over(case.load / load) for body, s in case.shares.items()}
        one.shear_shares = case.shear_shares
        if near.plan.effect("friction"):
            solve_tangential(near, Stages())
        return [
            (r.name, r.case, r.value) for r in make_results(near, misfits=False) if not r.withheld
        ]
    except UpdError:
        # The load itself was solved: a neighbour that is not is a sample less.
        return []


def _at_rim(force: FloatArray) -> bool:
    rim = (force[0], force[-1], force[:, 0], force[:, -1])
    return any(bool(np.any(side > 0.0)) for side in rim)
