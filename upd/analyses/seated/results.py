"""SeatedSolution -> the flat list of numbers, beside the balance of a rigid damper; self-checks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from upd.analyses.base import conditions
from upd.analyses.seated.bodies import RIGID, rigid_balance
from upd.analyses.seated.interface import Array
from upd.analyses.seated.plan import AGAIN, LOWERED, RAISED, SHAKEN, SMOOTH, WAYS
from upd.analyses.seated.solve import Phase, SeatedSolution
from upd.contact.coulomb_conditions import OPEN, SLIP
from upd.results import Case, Check, Result
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
#: rigid damper that slips on both faces, and in which sense friction acts, by phase
_BALANCES = {RAISED: "opposing", LOWERED: "reversed", AGAIN: "opposing", SMOOTH: "frictionless"}


#: to which the conditions of contact and the balance hold, of the largest force or motion
ROUNDING = 1e-9


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
        loss = of.copies * sum(float(one.found.friction_loss(one.before).sum()) for one in loop)
        yield q.SEATING_LOSS.of(loss, Case(name=f"{LOWERED} and {AGAIN}"))
    moved = [p for p in solution.phases.values() if p.moved.any() and p.name not in WAYS]
    for phase in moved:
        last = 4 * solution.plan.scene.moved.steps
        axis = int(np.flatnonzero(phase.moved.any(axis=0))[0])
        cycle = phase.found.friction_loss(phase.before)[-last:]
        yield q.FRICTION_ENERGY.of(of.copies * float(cycle.sum()), phase.case)
        force = platform_force(solution, phase)[-last:, axis]
        way = phase.moved[-last:, axis]
        yield q.MOVED_STIFFNESS.of(np.ptp(force) / np.ptp(way), phase.case)


def platform_force(solution: SeatedSolution, phase: Phase) -> np.ndarray:
    """(k, 3) N along x, y, z with which the right blade presses on the damper."""
    of = solution.interface
    return np.asarray(of.face_forces(phase.found)[:, 1] @ -of.frame[1])


# -- self-checks, from the forces as they are written ----------------------------------------------


#: what is checked of every way of loading
_HOLDS = (
    ("equilibrium", "force and moment left on the damper / (F_C, F_C times its size)"),
    ("Coulomb's cone", "largest |t| - mu n or tension / largest n"),
    ("no penetration", "overlap, or gap under pressure / motion of the damper"),
    (
        "sticking nodes",
        "slip where it sticks, or against its friction / motion of the damper",
    ),
)


def check_solution(solution: SeatedSolution) -> list[Check]:
    """All self-checks."""
    checks = [check for phase in solution.phases.values() for check in _checks(solution, phase)]
    limits = solution.plan.scene.left_out
    return checks + [one.check(limits) for one in solution.omissions]


def _checks(solution: SeatedSolution, phase: Phase) -> list[Check]:
    of, found, mu = solution.interface, phase.found, phase.friction
    normal = found.force[..., 0]
    size = normal.max(axis=1, initial=np.finfo(float).tiny)
    shear = np.linalg.norm(found.force[..., 1:], axis=-1)
    beyond = np.maximum(shear - mu * normal, -normal).max(axis=1)
    gap, step = _kinematics(solution, phase)
    moves = np.abs(found.displacement).max() + np.abs(phase.moved).max()
    reach = float(np.abs(of.columns[: of.n]).max()) * moves
    overlap = np.maximum(-gap, np.where(normal > 0.0, np.abs(gap), 0.0)).max() / reach
    slip = _stick_misfit(found.state, found.force[..., 1:], step) / reach if mu else 0.0
    values = _off_balance(solution, phase), (beyond / size).max(), overlap, slip
    rows = ((name, v, ROUNDING, what) for v, (name, what) in zip(values, _HOLDS, strict=True))
    return conditions(phase.case, "report this scene", *rows)


def _off_balance(solution: SeatedSolution, phase: Phase) -> float:
    """Forces and moments on the damper, from the nodes' places and the faces' frames."""
    of, body = solution.interface, solution.bodies.damper
    F = np.zeros((len(phase.centrifugal), 3))
    F[:, 2] = phase.centrifugal / of.copies
    # into the blades: the damper feels the opposite
    nodal = np.einsum("knf,nfc->knc", phase.found.force, of.frame[of.face])
    arm = of.position - body.centre
    balance = F - nodal.sum(axis=1)
    moment = -np.cross(arm[None], nodal).sum(axis=1)
    kept = [k - 3 for k in of.kept if k >= 3]
    size = np.abs(F[:, 2])
    along = [k for k in of.kept if k < 3]
    return float(
        max(
            (np.abs(balance[:, along]).max(axis=1) / size).max(),
            (np.abs(moment[:, kept]).max(axis=1) / (size * np.abs(arm).max())).max(),
        )
    )


def _kinematics(solution: SeatedSolution, phase: Phase) -> tuple[Array, Array]:
    """Gap (k, n) and slip of each step (k, n, 2) in mm, from forces and motions."""
    of, found, before, n = solution.interface, phase.found, phase.before, solution.interface.n
    # from the state before the first step: of the damper's nodes into the faces and along them
    force = np.concatenate([before.force[None], found.force]).transpose(0, 2, 1)
    w = np.vstack([before.motion, found.displacement]) @ of.columns.T
    w -= force.reshape(len(force), -1) @ of.compliance
    w[1:] -= phase.moved @ of.shifts(1).T
    ways = w[:, n:].reshape(-1, 2, n).transpose(0, 2, 1)
    return solution.gap - w[1:, :n], np.diff(ways, axis=0)


def _stick_misfit(state: np.ndarray, shear: Array, step: Array) -> float:
    """Slip of nodes that stick, and of slipping ones what does not follow their friction, mm."""
    length = np.linalg.norm(step, axis=-1)
    stuck = length[state != OPEN][state[state != OPEN] != SLIP].max(initial=0.0)
    size = np.linalg.norm(shear, axis=-1, keepdims=True)
    way = np.divide(shear, size, out=np.zeros_like(shear), where=size > 0.0)
    follows = np.maximum((step * way).sum(axis=-1), 0.0)
    # Weighed by its share of the largest force: the direction of a force at rounding is rounding.
    share = size[..., 0] / size.max(initial=np.finfo(float).tiny)
    aside = share * np.linalg.norm(step - follows[..., None] * way, axis=-1)
    return float(max(stuck, aside[state == SLIP].max(initial=0.0)))
