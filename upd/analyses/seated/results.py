"""SeatedSolution -> the flat list of numbers, beside the balance of a rigid damper."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from upd.analyses.seated.lattice import rigid_balance
from upd.analyses.seated.solve import (
    AGAIN,
    LOWERED,
    RAISED,
    SHAKEN,
    SMOOTH,
    WAYS,
    Phase,
    SeatedSolution,
)
from upd.contact.coulomb_conditions import OPEN, SLIP
from upd.plot.chart import Entry
from upd.results import Case, Result
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
_FACE = ("face_K_N", "face_K_T_along", "face_K_T")
_LEG = ("leg_K_N", "leg_K_T_along", "leg_K_T")
UM, URAD = 1e3, 1e6
#: rigid damper that slips on both faces, and in which sense friction acts, by phase
_BALANCES = {RAISED: "opposing", LOWERED: "reversed", AGAIN: "opposing", SMOOTH: "frictionless"}
_SAID = {
    "opposing": "rigid damper, full friction against F_C",
    "reversed": "rigid damper, full friction along F_C",
    "frictionless": "rigid damper without friction",
}


def headline(results: Sequence[Entry]) -> list[Entry]:
    """Forces of both faces when F_C is raised, their band, stiffness between the platforms, loss of
    the first motion.
    """
    first: dict[str, tuple[str, str]] = {}
    for entry in results:
        # nothing touches on a face that F_C empties
        if entry["value"] or entry["name"] not in (*_FACE, *_LEG):
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
        for name, value, letter in (("face_N", normal, "normal"), ("face_T", up, "tangential")):
            reference = None if known is None else getattr(known, f"{letter}_{side}")
            yield Result(
                name,
                case,
                float(value),
                "N",
                reference,
                _SAID[mode] if mode else "",
                exact=mode == "frictionless",
            )
        if solution.interface.copies == 1:
            yield Result("face_T_along", case, float(along), "N")


def _band(solution: SeatedSolution) -> Iterator[Result]:
    """Between which the ways of loading leave the forces under F_C."""
    ways = [name for name in (*WAYS, SMOOTH) if name in solution.phases]
    if len(ways) < 3:
        return
    for k, side in enumerate(SIDES):
        case = Case(name="ways of loading", side=side)
        for j, letter in ((0, "N"), (2, "T")):
            found = [float(solution.forces(name)[k, j]) for name in ways]
            yield Result(f"lowest_face_{letter}", case, min(found), "N")
            yield Result(f"highest_face_{letter}", case, max(found), "N")


def _contact(solution: SeatedSolution) -> Iterator[Result]:
    """Shares of the faces that touch and slip, and pressure, with F_C raised."""
    of, found = solution.interface, solution.phases[RAISED].found
    state, pressure = found.state[-1], found.force[-1, :, 0] / of.area
    for k, side in enumerate(SIDES):
        mine, case = of.face == k, Case(name=RAISED, side=side)
        whole = float(of.area[mine].sum())
        closed, slips = (float(of.area[mine & on].sum()) for on in (state != OPEN, state == SLIP))
        yield Result("closed_share", case, 100.0 * closed / whole, "%")
        yield Result("slip_share", case, 100.0 * slips / closed if closed else 0.0, "%")
        yield Result("contact_area", case, of.copies * closed, "mm2")
        yield Result("max_pressure", case, float(pressure[mine].max()), "MPa")
        if closed:
            mean = float(solution.forces(RAISED)[k, 0]) / (of.copies * closed)
            yield Result("mean_pressure", case, mean, "MPa")


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
            for name, value in zip(_FACE, held.face_stiffness(k, closed), strict=True):
                if np.isfinite(value):
                    yield Result(name, case, float(value), "N/mm")
        contacts = {HELD: held} if of is held else {HELD: held, Case(name="bases held"): of}
        for one, contact in contacts.items():
            K = contact.leg_stiffness(closed)
            for j, axis in enumerate(contact.directions):
                case = replace(one, choice=choice)
                yield Result(_LEG[axis], case, float(K[j, j]), "N/mm")


def _damper(solution: SeatedSolution) -> Iterator[Result]:
    """Mass of the damper, and its shift and turn as F_C is raised."""
    of = solution.interface
    case = Case(name=RAISED)
    assert solution.bodies is not None
    yield Result("damper_mass", case, 1e6 * of.copies * solution.bodies.damper.mass, "g")
    motion = of.motions(solution.phases[RAISED].found)[-1]
    for k in of.kept:
        axis = "xyz"[k % 3]
        yield (
            Result(f"damper_u{axis}", case, UM * float(motion[k]), "um")
            if k < 3
            else Result(f"damper_r{axis}", case, URAD * float(motion[k]), "urad")
        )


def _losses(solution: SeatedSolution) -> Iterator[Result]:
    """Friction loss of the seating's loop and of the last cycle of each motion."""
    of = solution.interface
    loop = [solution.phases[name] for name in (LOWERED, AGAIN)]
    loss = of.copies * sum(float(one.friction_loss.sum()) for one in loop)
    yield Result("seating_loss", Case(name=f"{LOWERED} and {AGAIN}"), loss, "N mm")
    for phase in _moved(solution):
        last = 4 * solution.plan.scene.moved.steps
        axis = int(np.flatnonzero(phase.moved.any(axis=0))[0])
        cycle = phase.friction_loss[-last:]
        yield Result("friction_energy", phase.case, of.copies * float(cycle.sum()), "N mm")
        force = platform_force(solution, phase)[-last:, axis]
        way = phase.moved[-last:, axis]
        yield Result("moved_stiffness", phase.case, float(np.ptp(force) / np.ptp(way)), "N/mm")


def _moved(solution: SeatedSolution) -> list[Phase]:
    return [p for p in solution.phases.values() if p.moved.any() and p.name not in WAYS]


def platform_force(solution: SeatedSolution, phase: Phase) -> np.ndarray:
    """(k, 3) N along x, y, z with which the right blade presses on the damper."""
    of = solution.interface
    return np.asarray(of.face_forces(phase.found)[:, 1] @ -of.frame[1])
