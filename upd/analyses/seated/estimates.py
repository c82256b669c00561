"""Errors of a seated damper's numbers: the nodes of its faces, the mesh of its bodies, load steps,
the contact's solver.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import require_memory
from upd.analyses.companions import (
    Companion,
    Key,
    LevelNumbers,
    SolvedLevel,
    level_estimates,
    merged,
    paired_estimates,
    solve_companions,
)
from upd.analyses.seated.checks import ROUNDING, WORK_ROUNDING
from upd.analyses.seated.levels import (
    MESH,
    NODES,
    STEPS,
    companion_scene,
    companions,
    refined,
    shorter_steps,
    with_lattice,
)
from upd.analyses.seated.plan import SeatedPlan, make_plan, solve_seconds
from upd.analyses.seated.results import make_results
from upd.analyses.seated.solve import RAISED, SeatedSolution, solve
from upd.contact.coulomb_conditions import OPEN, SLIP
from upd.mesh import IntArray
from upd.progress import Stages
from upd.results import Case, ErrorPart, Estimates, Result
from upd.scene import SeatedScene
from upd.scene.forced_contact import SIDES

#: source beside those of companions
SOLVER = "contact solver"
_EDGE = "edges of the contact and of its stick are known to one spacing of nodes"
_ZERO = "the number is zero: its error is not relative to it"


def plan_with_estimates(scene: SeatedScene) -> SeatedPlan:
    """The plan of ``scene`` with what its companions cost. Raises InputError as `make_plan`."""
    plan = make_plan(scene)
    again = companions(plan).seconds
    return replace(plan, seconds=plan.seconds + again, estimate_seconds=again)


def estimate(solution: SeatedSolution, numbers: Sequence[Result], stages: Stages) -> Estimates:
    """What every source adds to the error of every number.

    A number that is zero, or that a companion has with the other sign, has no error relative to
    it and says so.
    """
    run, before = solution.plan, stages.elapsed()
    plan = replace(run, seconds=run.seconds - run.estimate_seconds, estimate_seconds=0.0)
    chosen, half = companions(plan), partial(_half_cost, plan, before)
    own = {(r.name, r.case): r.value for r in numbers if not r.withheld}
    own_level = SolvedLevel("the run", 1.0, own, before)
    lattices, faults = _solved(chosen.lattices, stages)
    told = faults if chosen.lattices else [chosen.told.get(NODES, "no coarser lattice")]
    found = [level_estimates(NODES, numbers, lattices, partial(half, NODES), faults=told)]
    levels = list(lattices)
    first = next((one.label for one in chosen.lattices), "")
    base = next((o for o in lattices if o.label == first), None) if first else own_level
    for source in (MESH, STEPS):
        made = [chosen.others[source]] if base and source in chosen.others else []
        other, faults = _solved(made, stages)
        levels += other
        if base and other:
            found.append(paired_estimates(source, numbers, base, other[0], partial(half, source)))
        else:
            why = "; ".join(faults) or chosen.told.get(source, f"{first} was not solved")
            part = ErrorPart(source, float("nan"), f"not estimated: {why}")
            found.append(dict.fromkeys(own, (part,)))
    known = dict(merged(*found, _by_solver(solution, numbers)))
    for key, parts in _by_edges(solution).items():
        known[key] = _larger(known.get(key, ()), parts[0])
    return {
        key: _rounding(parts) or of_one_sign(own[key], key, levels) or parts
        for key, parts in known.items()
    }


def _solved(made: Iterable[Companion], stages: Stages) -> tuple[list[SolvedLevel], list[str]]:
    return solve_companions(
        made, lambda one: LevelNumbers(make_results(solve(one, Stages()))), stages
    )


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
    value: float, key: Key, levels: Iterable[SolvedLevel]
) -> tuple[ErrorPart, ...] | None:
    """Why a number has no error relative to it, where its sign is not the same on all levels."""
    if value == 0.0:
        return (ErrorPart(NODES, float("nan"), _ZERO),)
    other = [o for o in levels if key in o.values and np.sign(o.values[key]) != np.sign(value)]
    if not other:
        return None
    names = ", ".join(f"{one.values[key]:.3g} with {one.label}" for one in other)
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


def _by_edges(solution: SeatedSolution) -> Estimates:
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


def _half_cost(plan: SeatedPlan, seconds: float, source: str, order: float) -> float:
    """Seconds that half of a source's error adds, the error of an order; ``seconds``: of the run.

    InputError where the recipe takes no such level, or the memory does not.
    """
    scene = companion_scene(plan.scene)
    finer = 2.0 ** (1.0 / order)
    makers: dict[str, Callable[[], SeatedScene]] = {
        NODES: lambda: with_lattice(scene, 1.0 / finer),
        # the nodes of the faces where they are
        MESH: lambda: refined(with_lattice(scene, finer), finer),
        STEPS: lambda: shorter_steps(scene),
    }
    more = make_plan(makers[source]())
    require_memory(more.scene, more.memory_bytes)
    return max(0.0, seconds * (solve_seconds(more) / solve_seconds(plan) - 1.0))
