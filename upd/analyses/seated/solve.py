"""Seat the damper: F_C raised, lowered and raised again, other ways of loading, a blade moved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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

    @property
    def friction_loss(self) -> Array:
        """(k,) N mm that friction took in each step of the model."""
        return self.found.friction_loss(self.before)


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
    (raised,), *others = ways(scene)
    with stages("seating", f"{RAISED}, {scene.seating.steps} load steps"):
        _phase(solution, raised)
    with keeping(solution):
        _go_on(solution, others, stages)
        if scene.wants("stiffness"):
            with stages("stiffness", "platforms held"):
                solution.platforms = (
                    of
                    if scene.blades.held == "platforms"
                    else make_interface(plan, bodies, "platforms", like=of)
                )
        if scene.left_out.solves:
            solution.omissions = list(_solve_again(solution, stages))
    return solution


def _go_on(solution: SeatedSolution, rows: Sequence[Sequence[Way]], stages: Stages) -> None:
    """F_C lowered and raised again, and every other way that is asked for: each from the raised
    state, and so side by side.
    """
    names = [way.name for row in rows for way in row]
    steps = sum(len(way.centrifugal) for row in rows for way in row)

    def done(row: Sequence[Way]) -> None:
        for way in row:
            _phase(solution, way)

    with stages("seating", f"{', '.join(names)}: {steps} load steps"):
        in_parallel([partial(done, row) for row in rows], 2)
    # In the order of the report, whichever ended first.
    solution.phases = {name: solution.phases[name] for name in (RAISED, *names)}


def _phase(solution: SeatedSolution, way: Way) -> None:
    """Solve one way of loading."""
    of, friction = solution.interface, solution.plan.scene.contact.friction
    if way.after:
        last = solution.phases[way.after].found
        before, moved = last.history, way.moved if way.moved.any() else None
        found = of.seat(friction, way.centrifugal, moved=moved, after=last)
    else:
        friction = 0.0 if way.name == SMOOTH else friction
        found = of.seat(friction, way.centrifugal, gap=solution.gap)
        none, still = np.zeros((of.n, 3)), np.zeros(len(of.kept))
        before = CoupledHistory(none, none[:, 1:], solution.gap, still, none[:, 1:], still)
    solution.phases[way.name] = Phase(**vars(way), friction=friction, found=found, before=before)


def _solve_again(solution: SeatedSolution, stages: Stages) -> Iterator[Resolved]:
    """Normal forces of the faces with the effects omitted."""
    scene, of = solution.plan.scene, solution.interface
    without = solution.forces(RAISED)[:, 0]
    side = int(np.argmax(without))
    case = Case(name=RAISED, side=SIDES[side])

    def resolved(effect: str, included: float, remedy: str) -> Resolved:
        return Resolved(effect, "face_N", case, float(without[side]), included, "N", remedy)

    if scene.contact.worn < 1.0:
        gap, raised = of.worn_gap(scene.damper.centrifugal), solution.phases[RAISED].centrifugal
        with stages("seating", "on worn faces"):
            found = of.seat(scene.contact.friction, raised, gap=gap)
        included = float(of.face_forces(found)[-1, side, 0])
        yield resolved(WORN, included, 'set contact.fit = "worn"')
    if not scene.wants("band"):
        if SHAKEN not in solution.phases:
            with stages("seating", SHAKEN):
                _phase(solution, shaken(scene))
        included = float(solution.forces(SHAKEN)[side, 0])
        del solution.phases[SHAKEN]
        yield resolved(OTHER_WAYS, included, 'friction leaves the state open: add "band" to want')
