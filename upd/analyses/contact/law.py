"""Contact points of a dynamic model from a flat contact, and what they are compared with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.faces import lattices
from upd.analyses.contact.loading import contact_points_of
from upd.analyses.contact.plan import NORMAL
from upd.analyses.contact.solution import ContactSolution, NormalCase
from upd.contact.law import ContactLaw, contact_points

Array = NDArray[np.float64]


def contact_law(solution: ContactSolution, case: NormalCase) -> ContactLaw | None:
    """Contact points of a dynamic model, contact axes, from the fields after one normal load.

    None under no load.
    """
    choice, upper = solution.plan.scene.law, solution.model.upper.name
    force, both = case.solution.force, solution.plan.scene.law.bodies == "both"
    if case.force == 0.0 or not force.any():
        return None

    def sheared(direction: float) -> float:
        """Of the model, N/mm."""
        ways = [stuck for d, stuck in case.stuck.items() if d % 180.0 == direction]
        totals = [total if both else of[upper] for total, of in ways]
        return totals[0] / solution.plan.copies if totals else 0.0

    # Shared out like the pressure, which pushes everywhere; stiffness fields may pull at single
    # nodes, which no spring can. The total is that with the tilt held: the tilt is the dynamic
    # body's own.
    share = force / force.sum()
    answer = case if both else case.alone[upper]
    totals = [share * answer.solution.stiffness, share * sheared(0.0), share * sheared(90.0)]
    points, areas, fields, patches = _whole(solution, [force, *totals])
    preload, k_n, k_x, k_y = fields
    return contact_points(
        points,
        areas,
        preload,
        k_n,
        np.column_stack([k_x, k_y]),
        choice.rows,
        choice.columns,
        choice.weight,
        patches,
    )


def tilt_stiffness(solution: ContactSolution, case: NormalCase) -> dict[str, float]:
    """Resistance of the contact to a tilt of the damper, N mm per rad, by the axis its arms run
    along.

    About the centre of stiffness, contact set held. A tilt along x is odd about the mirror plane:
    known on the full model only.
    """
    model = solution.model
    on = np.flatnonzero(case.solution.contact)
    if len(on) < 3:
        return {}
    points = contact_points_of(model)[on]
    B = np.linalg.inv(model.compliance(NORMAL)[np.ix_(on, on)])
    e, out = B.sum(axis=1), {}
    for k, axis in enumerate("xy"):
        if axis == "y" or 0 not in solution.plan.mirrors:
            arm = points[:, k] - float(e @ points[:, k]) / float(e.sum())
            out[axis] = solution.plan.copies * float(arm @ B @ arm)
    return out


def _whole(
    solution: ContactSolution, fields: list[Array]
) -> tuple[Array, Array, list[Array], list[NDArray[np.int64]]]:
    """Points, areas and extensive fields of the whole contact, and the nodes of each patch in
    them.
    """
    faces = lattices(solution)
    points = [k.nodes() for k in faces]
    ends = np.cumsum([X.size for X, _ in points])
    whole = [np.concatenate([k.field(f, extensive=True).ravel() for k in faces]) for f in fields]
    return (
        np.vstack([np.column_stack([X.ravel(), Y.ravel()]) for X, Y in points]),
        np.concatenate([k.area().ravel() for k in faces]),
        whole,
        np.split(np.arange(ends[-1]), ends[:-1]),
    )
