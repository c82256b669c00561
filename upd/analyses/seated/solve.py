"""Seat the damper: F_C raised, lowered and raised again, other ways of loading, a blade moved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import Resolved, keeping
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.analyses.seated.interface import Interface, make_interface
from upd.analyses.seated.plan import (
    OTHER_WAYS,
    RAISED,
    SHAKEN,
    SMOOTH,
    WORN,
    SeatedPlan,
    Way,
    shaken,
    ways,
)
from upd.contact import CoupledContact, CoupledHistory
from upd.linalg.parallel import in_parallel
from upd.progress import Stages
from upd.results import Case
from upd.scene.forced_contact import SIDES

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Phase(Way):
    """A way of loading, solved.

    Attributes
    ----------
    friction
        Coefficient.
    found
        Its answers.
    before
        State it started from.
    """

    friction: float
    found: CoupledContact
    before: CoupledHistory

    @property
    def case(self) -> Case:
        """What its numbers belong to."""
        return Case(name=self.name)


@dataclass
class SeatedSolution:
    """Everything a run found.

    Attributes
    ----------
    bodies, interface
        Meshes and matrices; both faces as one contact.
    gap : (n,) ndarray
        mm, before any load.
    phases
        By name, in the order they were solved.
    platforms
        The contact with the platforms held, for stiffnesses.
    omissions
        Numbers solved again with the effects omitted.
    """

    plan: SeatedPlan
    bodies: Bodies
    interface: Interface
    gap: Array
    phases: dict[str, Phase] = field(default_factory=dict)
    platforms: Interface | None = None
    omissions: list[Resolved] = field(default_factory=list)

    def forces(self, name: str) -> Array:
        """(2, 3) N on the faces after a phase: normal, along the damper, up the slope."""
        return np.asarray(self.interface.face_forces(self.phases[name].found)[-1])


def solve(plan: SeatedPlan, stages: Stages) -> SeatedSolution:
    """Run everything the plan calls for.

    An error after F_C was raised carries what converged so far as ``partial``.
    """
    scene = plan.scene
    with stages("mesh and assembly", f"both blades and the {scene.arrangement} damper"):
        bodies = make_bodies(plan)
    with stages("condensation", "both blades and the damper on the nodes of both faces"):
        of = make_interface(plan, bodies, scene.blades.held)
    worn, F = scene.contact.worn, scene.damper.centrifugal
    gap = worn * of.worn_gap(F) if worn else np.zeros(of.n)
    solution = SeatedSolution(plan, bodies, of, gap)
    first, *others = ways(scene)
    with stages("seating", f"{RAISED}, {scene.seating.steps} load steps"):
        _load(solution, first)
    with keeping(solution):
        names = [way.name for row in others for way in row]
        steps = sum(len(way.centrifugal) for row in others for way in row)
        with stages("seating", f"{', '.join(names)}: {steps} load steps"):
            # each row from the raised state, and so side by side
            in_parallel([partial(_load, solution, row) for row in others], 2)
        # in the order of the report, whichever ended first
        solution.phases = {name: solution.phases[name] for name in (RAISED, *names)}
        if scene.wants("stiffness"):
            with stages("stiffness", "platforms held"):
                solution.platforms = (
                    of
                    if scene.blades.held == "platforms"
                    else make_interface(plan, bodies, "platforms", like=of)
                )
        if scene.left_out.solves:
            solution.omissions = _solve_again(solution, stages)
    return solution


def _load(solution: SeatedSolution, row: Sequence[Way]) -> None:
    """Solve ways of loading, one after the other."""
    of, mu = solution.interface, solution.plan.scene.contact.friction
    for way in row:
        friction = 0.0 if way.name == SMOOTH else mu
        if way.after:
            last = solution.phases[way.after].found
            before, moved = last.history, way.moved if way.moved.any() else None
            found = of.seat(friction, way.centrifugal, moved=moved, after=last)
        else:
            found = of.seat(friction, way.centrifugal, gap=solution.gap)
            none, still = np.zeros((of.n, 3)), np.zeros(len(of.kept))
            before = CoupledHistory(none, none[:, 1:], solution.gap, still, none[:, 1:], still)
        phase = Phase(**vars(way), friction=friction, found=found, before=before)
        solution.phases[way.name] = phase


def _solve_again(solution: SeatedSolution, stages: Stages) -> list[Resolved]:
    """Normal forces of the faces with the effects omitted."""
    scene, of = solution.plan.scene, solution.interface
    without, found = solution.forces(RAISED)[:, 0], list[tuple[str, float, str]]()
    side = int(np.argmax(without))
    if scene.contact.worn < 1.0:
        gap, raised = of.worn_gap(scene.damper.centrifugal), solution.phases[RAISED].centrifugal
        with stages("seating", "on worn faces"):
            worn = of.seat(scene.contact.friction, raised, gap=gap)
        included = float(of.face_forces(worn)[-1, side, 0])
        found.append((WORN, included, 'set contact.fit = "worn"'))
    if not scene.wants("band"):
        if SHAKEN not in solution.phases:
            with stages("seating", SHAKEN):
                _load(solution, [shaken(scene)])
        included = float(solution.forces(SHAKEN)[side, 0])
        del solution.phases[SHAKEN]
        remedy = 'friction leaves the state open: add "band" to want'
        found.append((OTHER_WAYS, included, remedy))
    case, force = Case(name=RAISED, side=SIDES[side]), float(without[side])
    return [
        Resolved(effect, "face_N", case, force, included, "N", remedy)
        for effect, included, remedy in found
    ]
