"""Errors of a seated damper's numbers that are known from the run: what the contact's solver and
the edges of the contact leave, and what has no relative error.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.seated.checks import ROUNDING, WORK_ROUNDING
from upd.analyses.seated.solve import RAISED, SeatedSolution
from upd.contact.coulomb_conditions import OPEN, SLIP
from upd.mesh import IntArray
from upd.results import Case, ErrorPart, Estimates, Result
from upd.scene.forced_contact import SIDES
from upd.vary.errors import merged
from upd.vary.variation import Key, SolvedVariation

#: sources of error: the nodes of the faces, and one that no variation shows
NODES, SOLVER = "contact nodes", "contact solver"
_EDGE = "edges of the contact and of its stick are known to one spacing of nodes"
_ZERO = "the number is zero: its error is not relative to it"


def corrected(
    solution: SeatedSolution,
    run: SolvedVariation,
    solved: Sequence[SolvedVariation],
    found: Estimates,
) -> Estimates:
    """The parts by variations with those known from the run.

    A number that is zero, or that a variation has with the other sign, has no error relative to it,
    for that reason.
    """
    known = dict(merged(found, _by_solver(solution, run.numbers)))
    for key, parts in by_edges(solution).items():
        known[key] = _larger(known.get(key, ()), parts[0])
    return {
        key: _rounding(parts) or of_one_sign(run.values[key], key, solved) or parts
        for key, parts in known.items()
    }


def _larger(parts: Sequence[ErrorPart], other: ErrorPart) -> tuple[ErrorPart, ...]:
    """The parts with another of a source in place of its own where that is smaller."""
    return tuple(
        replace(p, error=other.error, basis=other.basis)
        if p.source == other.source and p.known and p.error < other.error
        else p
        for p in parts
    )


def _rounding(parts: Iterable[ErrorPart]) -> tuple[ErrorPart, ...] | None:
    """Why a number has no error, where it is below what self-checks hold it to."""
    lost = next((p for p in parts if p.source == SOLVER and p.error >= 1.0), None)
    if lost is None:
        return None
    return (ErrorPart(SOLVER, float("nan"), f"not estimated: zero but for rounding, {lost.basis}"),)


def of_one_sign(
    value: float, key: Key, levels: Iterable[SolvedVariation]
) -> tuple[ErrorPart, ...] | None:
    """Why a number has no error relative to it, where its sign is not the same on all levels."""
    if value == 0.0:
        return (ErrorPart(NODES, float("nan"), _ZERO),)
    other = [o for o in levels if key in o.values and np.sign(o.values[key]) != np.sign(value)]
    if not other:
        return None
    names = ", ".join(f"{one.values[key]:.3g} with {one.variation.label}" for one in other)
    why = f"not estimated: zero or of the other sign on companions ({names})"
    return (ErrorPart(NODES, float("nan"), why),)


def _by_solver(solution: SeatedSolution, numbers: Iterable[Result]) -> Estimates:
    """Of forces, losses and the stiffness of a motion, what the self-checks hold them to: parts of
    F_C, of its work along the motion, and of F_C over it.
    """
    plan, out = solution.plan.scene, dict[Key, tuple[ErrorPart, ...]]()
    force, way = plan.damper.centrifugal, plan.moved.amplitude
    lift = float(np.abs(solution.interface.motions(solution.phases[RAISED].found)[-1, :3]).max())
    held = {
        "friction_energy": WORK_ROUNDING * force * way,
        "seating_loss": WORK_ROUNDING * force * lift,
        "moved_stiffness": ROUNDING * force / way,
    }
    for one in numbers:
        size = held.get(one.name, ROUNDING * force if one.unit == "N" else 0.0)
        if size and one.value and not one.withheld:
            basis = f"a self-check holds it to {size:.2g} {one.unit}"
            out[one.name, one.case] = (ErrorPart(SOLVER, size / abs(one.value), basis),)
    return out


def by_edges(solution: SeatedSolution) -> Estimates:
    """Of shares of the faces, what a lattice leaves open: their edges are known to one spacing.

    A share counts whole nodes, and levels may agree by chance.
    """
    of, state = solution.interface, solution.phases[RAISED].found.state[-1]
    assert solution.bodies is not None
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    first = 0
    for side in SIDES:
        quads = solution.bodies.blades[side].mesh.faces["patch"][:, :4]
        nodes, quads = np.unique(quads, return_inverse=True)
        here = slice(first, first + len(nodes))
        first = here.stop
        area, closed, slips = of.area[here], state[here] != OPEN, state[here] == SLIP
        if not closed.any():
            continue
        quads = quads.reshape(-1, 4)
        edge = _edge(closed, quads, area)
        case = Case(name=RAISED, side=side)
        part = (ErrorPart(NODES, edge, _EDGE),)
        out |= {(name, case): part for name in ("closed_share", "contact_area", "mean_pressure")}
        if slips.any():
            slip = edge + _edge(slips, quads[closed[quads].all(axis=1)], area)
            out["slip_share", case] = (ErrorPart(NODES, slip, _EDGE),)
    return out


def _edge(inside: NDArray[np.bool_], quads: IntArray, area: NDArray[np.float64]) -> float:
    """Area of the nodes inside that share an element with others outside, over all inside."""
    cut = quads[inside[quads].any(axis=1) & ~inside[quads].all(axis=1)]
    at_edge = np.zeros_like(inside)
    at_edge[cut] = True
    return float(area[at_edge & inside].sum() / area[inside].sum())
