"""What varies in a seated damper: for the errors of its numbers the mesh of bodies and faces and
the load steps; in convergence studies meshes of its faces, elements, load steps.

Coarser levels do not show all: a share of a face counts whole nodes, and levels may agree by
chance, so its edges are known to one spacing of nodes. A number below what forces are balanced
to is rounding.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.analyses.seated.plan import PATCH, RAISED, SeatedPlan, make_plan
from upd.analyses.seated.results import ROUNDING, make_results
from upd.analyses.seated.solve import SeatedSolution, solve
from upd.contact.coulomb_conditions import OPEN, SLIP
from upd.mesh import IntArray
from upd.results import Case, ErrorPart, Estimates, Result
from upd.results import quantities as q
from upd.scene import SeatedScene
from upd.scene.forced_contact import SIDES
from upd.vary.ladder import Asked, Ladder, counts, even, whole_levels
from upd.vary.solve import MESH, coarser_rigs, refined
from upd.vary.variation import Key, Levels, Overrides, Problem, Variation, of_geometry

#: source of error beside the mesh
STEPS = "load steps"
_EDGE = "edges of the contact and of its stick are known to one spacing of nodes"
#: rounding of a work, of that of F_C
_OF_WORK = 1e-8
_SHARES = (q.CLOSED_SHARE, q.CONTACT_AREA, q.MEAN_PRESSURE)


def levels(plan: SeatedPlan) -> Levels:
    """Coarser rigs, faces and bodies alike, and half the load steps."""
    half = Variation(STEPS, "half the load steps", _steps(plan.scene, 0.5), 2.0)
    return {MESH: coarser_rigs(PROBLEM, plan), STEPS: [half]}


def _steps(scene: SeatedScene, factor: float) -> Overrides:
    """So many times the load steps; those of a cycle in quarters."""
    return (
        ("seating.steps", max(1, round(factor * scene.seating.steps))),
        ("seating.cycle_steps", 4 * max(1, round(factor * scene.seating.cycle_steps / 4))),
        ("moved.steps", max(1, round(factor * scene.moved.steps))),
    )


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
    # what rounding leaves of a force, a loss or the stiffness of a motion: shares of F_C, of its
    # work along the motion, and of F_C over it
    force, way = solution.plan.scene.damper.centrifugal, solution.plan.scene.moved.amplitude
    lift = np.abs(solution.interface.motions(solution.phases[RAISED].found)[-1, :3]).max()
    rounding = {
        q.FRICTION_ENERGY.name: _OF_WORK * force * way,
        q.SEATING_LOSS.name: _OF_WORK * force * float(lift),
        q.MOVED_STIFFNESS.name: ROUNDING * force / way,
    }
    for one in numbers:
        most = rounding.get(one.name, ROUNDING * force if one.unit == "N" else 0.0)
        if not one.withheld and 0.0 < abs(one.value) <= most:
            why = f"not estimated: zero but for rounding, which may be {most:.2g} {one.unit}"
            out[one.name, one.case] = (ErrorPart(MESH, float("nan"), why),)
    return out


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


PROBLEM = Problem(
    make_plan,
    solve,
    make_results,
    levels=levels,
    finer=lambda plan, source, factor: (
        refined(plan.scene, factor) if source == MESH else _steps(plan.scene, factor)
    ),
    corrected=corrected,
)


# -- convergence studies --------------------------------------------------------------------------

#: numbers a ladder follows beside those the analysis names first
_NUMBERS = ("closed_share", "max_pressure", "damper_u?", "seating_loss")
#: elements up a patch
_SLOPE = (4, 8, 12, 16)
_BASE: Overrides = (("want", ["seating", "stiffness"]), ("left_out.solve", "no"))


def _meshes(scene: SeatedScene, asked: Asked, *, all_elements: bool) -> Iterator[Variation]:
    """Elements up the patch, those along it in proportion."""
    slope, others = PATCH[scene.arrangement]
    usual = int(scene.geometry[slope])
    for element in ("hex8", "hex8i") if all_elements else (scene.mesh.element,):
        for n in whole_levels(asked, 2) or _SLOPE:
            counted = {slope: n} | {key: even(scene.geometry[key] * n / usual) for key in others}
            overrides = (*_BASE, *of_geometry(counted), ("mesh.element", element))
            yield Variation(element, f"{n} elements up the patch", overrides, 1.0 / n)


_STEPS = counts("steps", "{} load steps", "seating.steps", (2, 5, 10, 20, 40), 2, _BASE)
LADDERS: Mapping[str, Ladder] = {
    "mesh": Ladder(partial(_meshes, all_elements=False), _NUMBERS),
    "element": Ladder(partial(_meshes, all_elements=True), _NUMBERS),
    "steps": Ladder(_STEPS, _NUMBERS),
}
