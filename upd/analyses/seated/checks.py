"""Self-checks of a seated damper, from the forces as they are written."""

from __future__ import annotations

import numpy as np

from upd.analyses.base import conditions
from upd.analyses.seated.interface import Array, Interface
from upd.analyses.seated.solve import Phase, SeatedSolution
from upd.contact.coulomb_conditions import OPEN, SLIP
from upd.results import Check

#: to which the conditions of contact and the balance hold, of the largest force or motion
ROUNDING = 1e-9


def check_solution(solution: SeatedSolution) -> list[Check]:
    """All self-checks."""
    checks = [check for phase in solution.phases.values() for check in _phase(solution, phase)]
    limits = solution.plan.scene.left_out
    return checks + [one.check(limits) for one in solution.omissions]


def _phase(solution: SeatedSolution, phase: Phase) -> list[Check]:
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
    return conditions(
        phase.case,
        "report this scene",
        (
            "equilibrium",
            _off_balance(solution, phase),
            ROUNDING,
            "force and moment left on the damper / (F_C, F_C times its size)",
        ),
        (
            "Coulomb's cone",
            (beyond / size).max(),
            ROUNDING,
            "largest |t| - mu n or tension / largest n",
        ),
        (
            "no penetration",
            overlap,
            ROUNDING,
            "overlap, or gap under pressure / motion of the damper",
        ),
        (
            "sticking nodes",
            slip,
            ROUNDING,
            "slip of sticking nodes, or slip against its friction / motion of the damper",
        ),
    )


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
    of, found, before = solution.interface, phase.found, phase.before
    w = _motion(of, found.force, found.displacement, phase.moved)
    n = of.n
    gap = solution.gap - w[:, :n]
    at = _motion(of, before.force[None], before.motion[None], np.zeros((1, 3)))
    ways = np.vstack((at, w))[:, n:].reshape(-1, 2, n).transpose(0, 2, 1)
    return gap, np.diff(ways, axis=0)


def _motion(of: Interface, force: Array, motion: Array, moved: Array) -> Array:
    """(k, 3 n) mm of the damper's nodes into the blades' faces and along them."""
    f = force.transpose(0, 2, 1).reshape(len(force), -1)
    return np.asarray(motion @ of.columns.T - f @ of.compliance - moved @ of.shifts(1).T)


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
