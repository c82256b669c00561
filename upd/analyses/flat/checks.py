"""Self-checks of a flat contact: each number against its limit, with the remedy."""

from __future__ import annotations

import numpy as np

from upd.analyses.contact import checks as common
from upd.analyses.contact import yielding
from upd.analyses.contact.loading import contact_points_of, load_point
from upd.analyses.contact.solution import FlatNormalCase, FlatSolution
from upd.analyses.flat.maps import lattices
from upd.results import Check


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
    for t in solution.tangential:
        checks += common.sheared_checks(solution.plan, solution.model, t)
    checks += [common.loop_check(path) for path in solution.paths if path.cycle]
    checks += _yield_checks(solution)
    return common.with_missing(solution.plan, [*checks, *_left_out(solution)])


def _yield_checks(solution: FlatSolution) -> list[Check]:
    """Whether a body yields, of the bodies whose yield stress is given; patch by patch."""
    scene, model, pressure = (
        solution.plan.scene,
        solution.model,
        solution.model.multipliers.pressure,
    )
    checks = []
    for case in solution.normal:
        if case.force > 0.0:
            normal = pressure(case.solution.force)
            faces = {k.name: (k.X, k.Y, [k.field(normal)]) for k in lattices(solution)}
            checks += yielding.half_space_checks(scene, model, case.case, faces)
    for t in solution.tangential:
        loaded, normal = t.pressed > 0.0, pressure(np.maximum(t.pressed, 0.0))
        tractions = np.zeros((2, len(normal)))
        for component, force in zip(t.nodes.components, t.force.T, strict=True):
            tractions[component] = pressure(force, loaded)
        faces = {
            k.name: (k.X, k.Y, [k.field(field) for field in (normal, *tractions)])
            for k in lattices(solution)
        }
        checks += yielding.half_space_checks(scene, model, t.case, faces)
    return checks


def _normal_checks(solution: FlatSolution, case: FlatNormalCase) -> list[Check]:
    model, plan, force = solution.model, solution.plan, case.solution.force
    carried = plan.copies * float(force.sum())
    if case.tilt is None:
        return common.pressed_checks(plan, model, case, carried)
    points = contact_points_of(model)[:, :2]
    arms = points - load_point(plan, model)
    moment = float(np.abs(arms.T @ force).max())
    return [
        *common.pressed_checks(plan, model, case, carried, arms @ case.tilt),
        Check(
            "moment balance",
            case.case,
            moment / (float(force.sum()) * float(np.ptp(points, axis=0).max())),
            1e-8,
            "moment about the load line / (F patch length)",
            "report this",
        ),
    ]


def _left_out(solution: FlatSolution) -> list[Check]:
    checks = common.left_out_checks(solution)
    if not solution.plan.effect("friction"):
        return checks
    return checks + [
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
