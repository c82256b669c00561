"""What coarser levels do not show of the errors of a seated damper's numbers.

A share of a face counts whole nodes, and levels may agree by chance: its edges are known to one
spacing of nodes. A number below what the self-checks hold it to is rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.seated.checks import ROUNDING, WORK_ROUNDING
from upd.analyses.seated.plan import RAISED
from upd.analyses.seated.solve import SeatedSolution
from upd.contact.coulomb_conditions import OPEN, SLIP
from upd.mesh import IntArray
from upd.results import Case, ErrorPart, Estimates, Result
from upd.results import quantities as q
from upd.scene.forced_contact import SIDES
from upd.vary.solve import MESH
from upd.vary.variation import Key

_EDGE = "edges of the contact and of its stick are known to one spacing of nodes"
_SHARES = (q.CLOSED_SHARE, q.CONTACT_AREA, q.MEAN_PRESSURE)


def corrected(solution: SeatedSolution, numbers: Sequence[Result], found: Estimates) -> Estimates:
    """The parts by variations, of shares not below a spacing of nodes; none of what is rounding.

    Parameters
    ----------
    solution, numbers
        Of the run.
    found
        Name and case of a number -> parts of its error.

    Returns
    -------
    Estimates
    """
    out = dict(found)
    for key, error in edges(solution).items():
        out[key] = tuple(
            replace(part, error=error, basis=_EDGE)
            if part.source == MESH and part.known and part.error < error
            else part
            for part in out.get(key, ())
        )
    for one in numbers:
        held = _held(solution, one)
        if not one.withheld and 0.0 < abs(one.value) <= held:
            why = f"not estimated: zero but for rounding, self-checks allow {held:.2g} {one.unit}"
            out[one.name, one.case] = (ErrorPart(MESH, float("nan"), why),)
    return out


def _held(solution: SeatedSolution, one: Result) -> float:
    """What self-checks hold a force, a loss or the stiffness of a motion to: shares of F_C, of its
    work along the motion, and of F_C over it.
    """
    scene = solution.plan.scene
    force, way = scene.damper.centrifugal, scene.moved.amplitude
    lift = np.abs(solution.interface.motions(solution.phases[RAISED].found)[-1, :3]).max()
    held = {
        q.FRICTION_ENERGY.name: WORK_ROUNDING * force * way,
        q.SEATING_LOSS.name: WORK_ROUNDING * force * float(lift),
        q.MOVED_STIFFNESS.name: ROUNDING * force / way,
    }
    return held.get(one.name, ROUNDING * force if one.unit == "N" else 0.0)


def edges(solution: SeatedSolution) -> Mapping[Key, float]:
    """Relative errors of the faces' shares that one spacing of nodes at their edges leaves."""
    of, state = solution.interface, solution.phases[RAISED].found.state[-1]
    out: dict[Key, float] = {}
    for k, side in enumerate(SIDES):
        quads = solution.bodies.blades[side].mesh.faces["patch"][:, :4]
        quads = np.unique(quads, return_inverse=True)[1].reshape(-1, 4)
        here, case = of.face == k, Case(name=RAISED, side=side)
        area, closed, slips = of.area[here], state[here] != OPEN, state[here] == SLIP
        if not closed.any():
            continue
        edge = _edge(closed, quads, area)
        out |= {(one.name, case): edge for one in _SHARES}
        if slips.any():
            slip = _edge(slips, quads[closed[quads].all(axis=1)], area)
            out[q.SLIP_SHARE.name, case] = edge + slip
    return out


def _edge(inside: NDArray[np.bool_], quads: IntArray, area: NDArray[np.float64]) -> float:
    """Area of the nodes inside that share an element with others outside, over all inside."""
    cut = quads[inside[quads].any(axis=1) & ~inside[quads].all(axis=1)]
    at_edge = np.zeros_like(inside)
    at_edge[cut] = True
    return float(area[at_edge & inside].sum() / area[inside].sum())
