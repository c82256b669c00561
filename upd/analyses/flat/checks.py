"""Self-checks of a flat contact: each number against its limit, with the remedy."""

from __future__ import annotations

import numpy as np

from upd.analyses.contact import checks as common
from upd.analyses.flat.maps import centre_of_force, lattices
from upd.analyses.flat.solve import (
    FlatNormalCase,
    FlatSolution,
    FlatTangentialCase,
    contact_points_of,
    load_point,
)
from upd.results import NO_CASE, Check


def check_solution(solution: FlatSolution) -> list[Check]:
    """All self-checks; the ones that replace a left-out effect carry the name the plan gives
    them.
    """
    checks = [
        check
        for case in solution.normal
        if case.force > 0.0
        for check in _normal_checks(solution, case)
    ]
    checks += [_coulomb(solution, t) for t in solution.tangential]
    checks += [common.loop_check(path) for path in solution.paths if path.cycle]
    return common.with_missing(solution.plan, [*checks, *_left_out(solution)])


def _normal_checks(solution: FlatSolution, case: FlatNormalCase) -> list[Check]:
    s = case.solution
    carried = solution.plan.copies * float(s.force.sum())
    checks = [
        Check(
            "opening",
            case.case,
            case.n_open,
            len(s.force),
            "open nodes; without any the linear answer is exact",
        ),
        *common.normal_checks(case.case, case.force, s, solution.model.gap, carried, case.reaction),
    ]
    if case.tilted is not None:
        size = float(np.ptp(contact_points_of(solution.model)[:, :2], axis=0).max())
        moment = float(np.abs(case.tilted.moment).max()) / (case.force * size)
        checks.append(
            Check(
                "moment balance",
                case.case,
                moment,
                1e-8,
                "moment about the load line / (F patch length)",
                "report this",
            )
        )
    return checks


def _coulomb(solution: FlatSolution, t: FlatTangentialCase) -> Check:
    return common.coulomb_check(
        t.case,
        np.linalg.norm(t.force, axis=1),
        solution.plan.scene.contact.friction * t.normal.solution.force,
    )


def _left_out(solution: FlatSolution) -> list[Check]:
    plan = solution.plan
    loaded = [case for case in solution.normal if case.force > 0.0]
    checks = []
    if not plan.effect("tilt of the damper"):
        checks += [_held_tilt(solution, case) for case in loaded] or [
            Check("held tilt", NO_CASE, 0, 1.0, "no load, no moment")
        ]
    checks += (
        _friction_checks(solution) if plan.effect("friction") else [common.frictionless_check(plan)]
    )
    checks.append(common.static_check(plan.scene))
    size = min(float(np.ptp(lines)) for k in lattices(solution) for lines in (k.X, k.Y))
    ratio = max((case.solution.approach for case in loaded), default=0.0) / size
    remedy = "too large for small-displacement theory: lower the load"
    return [
        *checks,
        Check(
            "approach against patch",
            NO_CASE,
            ratio,
            1e-2,
            "approach / shorter edge of the patch",
            remedy,
        ),
    ]


def _held_tilt(solution: FlatSolution, case: FlatNormalCase) -> Check:
    """The held tilt takes a moment.

    How far the contact's resultant is from the load line, in halves of the contact's extent.
    """
    away = np.abs(centre_of_force(solution, case) - load_point(solution))
    if 0 in solution.plan.mirrors:
        away[0] = 0.0
    half = 0.5 * np.array(
        [
            max(k.X[-1] for k in lattices(solution)) - min(k.X[0] for k in lattices(solution)),
            max(k.Y[-1] for k in lattices(solution)) - min(k.Y[0] for k in lattices(solution)),
        ]
    )
    return Check(
        "held tilt",
        case.case,
        float((away / half).max()),
        1.0,
        "distance of the resultant from the load line / half the contact",
        "the support takes a large moment: choose another contact.distant set, or set "
        'contact.tilt = "free" with a '
        "contact.load_point inside the contact",
        fatal=False,
    )


def _friction_checks(solution: FlatSolution) -> list[Check]:
    scene = solution.plan.scene
    checks = [common.coupling_check(scene, solution.model)]
    checks += [
        Check(
            "pressure moved by shear",
            case,
            value,
            0.5,
            "sum |df| / 2 F at T = mu N",
            "gross slip would move much of the pressure: trust the first loading only",
            fatal=False,
        )
        for case, value in solution.moved.items()
    ]
    if not solution.moved:
        unseen = sum(case.force > 0.0 for case in solution.normal)
        says, remedy = (
            "loaded cases sheared along x alone, on half the model: not measured",
            'set mesh.symmetry = "full" to measure it',
        )
        checks.append(
            Check("pressure moved by shear", NO_CASE, unseen, 0, says, remedy, fatal=False)
        )
    if solution.plan.effect("slip in two directions"):
        return checks
    limit = scene.contact.transverse_limit
    if not solution.transverse:
        checks.append(Check("transverse motion", NO_CASE, 0, limit, "no load, no motion"))
    return checks + [
        Check(
            "transverse motion",
            case,
            value,
            limit,
            "motion across the load / along it, all stuck",
            "slip across the load is not small: set contact.directions = 2",
            fatal=False,
        )
        for case, value in solution.transverse.items()
    ]
