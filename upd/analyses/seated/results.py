"""SeatedSolution -> the flat list of numbers, beside the balance of a rigid damper."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from upd.analyses.seated.bodies import RIGID, rigid_balance
from upd.analyses.seated.plan import AGAIN, LOWERED, RAISED, SHAKEN, SMOOTH, WAYS
from upd.analyses.seated.solve import Phase, SeatedSolution
from upd.contact.coulomb_conditions import OPEN, SLIP
from upd.plot.chart import Entry
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene.forced_contact import SIDES

#: the numbers that matter, most important first (shell patterns): terminal, page, notebook, tables
#: of sweeps
HEADLINE = (
    "face_N",
    "face_T",
    "lowest_face_N",
    "highest_face_N",
    "leg_K_N",
    "leg_K_T",
    "face_K_N",
    "friction_energy",
)
#: platforms are held: what stiffnesses belong to
HELD = Case(name="platforms held")
#: by the axis along which a platform is moved: away from the other, along the damper, up
_FACE = (q.FACE_K_N, q.FACE_K_T_ALONG, q.FACE_K_T)
_LEG = (q.LEG_K_N, q.LEG_K_T_ALONG, q.LEG_K_T)
_STIFFNESSES = {one.name for one in (*_FACE, *_LEG)}
#: rigid damper that slips on both faces, and in which sense friction acts, by phase
_BALANCES = {RAISED: "opposing", LOWERED: "reversed", AGAIN: "opposing", SMOOTH: "frictionless"}


def headline(results: Sequence[Entry]) -> list[Entry]:
    """Forces of both faces when F_C is raised, their band, stiffness between the platforms, loss of
    the first motion.
    """
    first: dict[str, tuple[str, str]] = {}
    for entry in results:
        # nothing touches on a face that F_C empties
        if entry["value"] or entry["name"] not in _STIFFNESSES:
            first.setdefault(entry["name"], _group(entry))
    mine = [
        entry
        for entry in results
        if entry["name"] in HEADLINE and _group(entry) == first.get(entry["name"])
    ]
    order = list(dict.fromkeys(entry["case"] for entry in mine))
    rank = {name: HEADLINE.index(name) for name in first if name in HEADLINE}
    least = {case: min(rank[e["name"]] for e in mine if e["case"] == case) for case in order}
    return sorted(mine, key=lambda e: (least[e["case"]], order.index(e["case"]), rank[e["name"]]))


def _group(entry: Entry) -> tuple[str, str]:
    """What the faces share of a number's case."""
    fields = entry["case_fields"]
    return fields.get("name", ""), fields.get("choice", "")


def make_results(solution: SeatedSolution) -> list[Result]:
    """All numbers of a run."""
    return [
        *(one for phase in solution.phases.values() for one in _forces(solution, phase)),
        *_band(solution),
        *_contact(solution),
        *_stiffness(solution),
        *_damper(solution),
        *_losses(solution),
    ]


def _forces(solution: SeatedSolution, phase: Phase) -> Iterator[Result]:
    """Forces of both faces after a phase."""
    if phase.moved.any() and phase.name not in WAYS:
        return
    mode = _BALANCES.get(phase.name, "")
    F, mu = float(phase.centrifugal[-1]), solution.plan.scene.contact.friction
    known = rigid_balance(solution.interface.frame, F, mu, mode) if mode else None
    left, right = solution.forces(RAISED)[:, 0]
    # a face that F_C empties stands behind
    for k in (0, 1) if 2.0 * left > right else (1, 0):
        side = SIDES[k]
        case = replace(phase.case, side=side)
        normal, along, up = solution.forces(phase.name)[k]
        for quantity, value, way in ((q.FACE_N, normal, "normal"), (q.FACE_T, up, "tangential")):
            reference = None if known is None else getattr(known, f"{way}_{side}")
            source, exact = RIGID.get(mode, ""), mode == "frictionless"
            yield quantity.of(value, case, reference, source, exact=exact)
        if solution.interface.copies == 1:
            yield q.FACE_T_ALONG.of(along, case)


def _band(solution: SeatedSolution) -> Iterator[Result]:
    """Between which the ways of loading leave the forces under F_C."""
    ways = [name for name in (*WAYS, SMOOTH) if name in solution.phases]
    if len(ways) < 3:
        return
    for k, side in enumerate(SIDES):
        case = Case(name="ways of loading", side=side)
        for j, lowest, highest in (
            (0, q.LOWEST_FACE_N, q.HIGHEST_FACE_N),
            (2, q.LOWEST_FACE_T, q.HIGHEST_FACE_T),
        ):
            found = [float(solution.forces(name)[k, j]) for name in ways]
            yield lowest.of(min(found), case)
            yield highest.of(max(found), case)


def _contact(solution: SeatedSolution) -> Iterator[Result]:
    """Shares of the faces that touch and slip, and pressure, with F_C raised."""
    of, found = solution.interface, solution.phases[RAISED].found
    state, pressure = found.state[-1], found.force[-1, :, 0] / of.area
    for k, side in enumerate(SIDES):
        mine, case = of.face == k, Case(name=RAISED, side=side)
        whole = float(of.area[mine].sum())
        closed, slips = (float(of.area[mine & on].sum()) for on in (state != OPEN, state == SLIP))
        yield q.CLOSED_SHARE.of(100.0 * closed / whole, case)
        yield q.SLIP_SHARE.of(100.0 * slips / closed if closed else 0.0, case)
        yield q.CONTACT_AREA.of(of.copies * closed, case)
        yield q.MAX_PRESSURE.of(pressure[mine].max(), case)
        if closed:
            mean = float(solution.forces(RAISED)[k, 0]) / (of.copies * closed)
            yield q.MEAN_PRESSURE.of(mean, case)


def _stiffness(solution: SeatedSolution) -> Iterator[Result]:
    """Stuck stiffness of each face and between the platforms: of the nodes that touch after a way
    of loading, and of all; 0 where nothing touches.
    """
    of, held = solution.interface, solution.platforms
    if held is None:
        return
    stuck = {
        name: solution.phases[name].found.state[-1] != OPEN
        for name in (RAISED, SHAKEN)
        if name in solution.phases
    }
    stuck["whole faces"] = np.ones(of.n, bool)
    for choice, closed in stuck.items():
        for k, side in enumerate(SIDES):
            case = replace(HELD, choice=choice, side=side)
            for quantity, value in zip(_FACE, held.face_stiffness(k, closed), strict=True):
                if np.isfinite(value):
                    yield quantity.of(value, case)
        contacts = {HELD: held} if of is held else {HELD: held, Case(name="bases held"): of}
        for one, contact in contacts.items():
            K = contact.leg_stiffness(closed)
            for j, axis in enumerate(contact.directions):
                case = replace(one, choice=choice)
                yield _LEG[axis].of(K[j, j], case)


def _damper(solution: SeatedSolution) -> Iterator[Result]:
    """Mass of the damper, and its shift and turn as F_C is raised."""
    of = solution.interface
    case = Case(name=RAISED)
    yield q.DAMPER_MASS.of(of.copies * solution.bodies.damper.mass, case)
    motion = of.motions(solution.phases[RAISED].found)[-1]
    for k in of.kept:
        quantity = q.DAMPER_SHIFT if k < 3 else q.DAMPER_TURN.in_unit("urad")
        yield quantity.of(motion[k], case, n="xyz"[k % 3])


def _losses(solution: SeatedSolution) -> Iterator[Result]:
    """Friction loss of the seating's loop and of the last cycle of each motion."""
    of = solution.interface
    loop = [one for name, one in solution.phases.items() if name in (LOWERED, AGAIN)]
    if len(loop) == 2:
        loss = of.copies * sum(float(one.friction_loss.sum()) for one in loop)
        yield q.SEATING_LOSS.of(loss, Case(name=f"{LOWERED} and {AGAIN}"))
    moved = [p for p in solution.phases.values() if p.moved.any() and p.name not in WAYS]
    for phase in moved:
        last = 4 * solution.plan.scene.moved.steps
        axis = int(np.flatnonzero(phase.moved.any(axis=0))[0])
        cycle = phase.friction_loss[-last:]
        yield q.FRICTION_ENERGY.of(of.copies * float(cycle.sum()), phase.case)
        force = platform_force(solution, phase)[-last:, axis]
        way = phase.moved[-last:, axis]
        yield q.MOVED_STIFFNESS.of(np.ptp(force) / np.ptp(way), phase.case)


def platform_force(solution: SeatedSolution, phase: Phase) -> np.ndarray:
    """(k, 3) N along x, y, z with which the right blade presses on the damper."""
    of = solution.interface
    return np.asarray(of.face_forces(phase.found)[:, 1] @ -of.frame[1])
