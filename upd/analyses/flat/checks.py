"""Self-checks of a flat contact: each number against its limit, with the remedy."""

from __future__ import annotations

import numpy as np

from upd.analyses.contact import checks as common
from upd.analyses.contact import yielding
from upd.analyses.contact.coupled import as_normal, opened_by_shear, shear_nodes
from upd.analyses.contact.effects import checks_of
from upd.analyses.contact.loading import contact_points_of, load_point, tilt_arms
from upd.analyses.contact.plan import NORMAL
from upd.analyses.flat.maps import lattices
from upd.analyses.flat.solution import FlatNormalCase, FlatSolution, FlatTangentialCase
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
    checks += [check for t in solution.tangential for check in _tangential_checks(solution, t)]
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
    model, s = solution.model, case.solution
    carried = solution.plan.copies * float(s.force.sum())
    C, more = model.compliance(NORMAL), []
    turned = np.zeros(len(C))
    if case.state is not None:
        nodes = shear_nodes(model, solution.plan.scene.contact.friction, case.state)
        more = common.tangential_checks(case.case, model, nodes)
        turned = turned - opened_by_shear(model, case.state)
    if case.tilt is None:
        return [
            *common.normal_checks(
                case.case, case.force, s, C, model.gap, carried, case.reaction, turned
            ),
            *more,
        ]
    points = contact_points_of(model)[:, :2]
    arms = points - load_point(solution.plan, model)
    moment = float(np.abs(arms.T @ s.force).max())
    turned = turned + arms @ case.tilt
    return [
        *more,
        *common.normal_checks(
            case.case, case.force, s, C, model.gap, carried, case.reaction, turned
        ),
        Check(
            "moment balance",
            case.case,
            moment / (float(s.force.sum()) * float(np.ptp(points, axis=0).max())),
            1e-8,
            "moment about the load line / (F patch length)",
            "report this",
        ),
    ]


def _tangential_checks(solution: FlatSolution, t: FlatTangentialCase) -> list[Check]:
    checks = common.tangential_checks(t.case, solution.model, t.nodes)
    if t.state is None:
        return checks
    # The normal forces are those under this load.
    model, N = solution.model, t.normal.force
    answer = as_normal(t.state, float("nan"))
    turned = -opened_by_shear(model, t.state)
    if t.state.motion[3:].size:
        turned = turned + tilt_arms(solution.plan, model) @ t.state.motion[3:]
    carried = float(answer.unclipped.sum())
    return [
        *checks,
        *common.normal_checks(
            t.case, N, answer, model.compliance(NORMAL), model.gap, carried, {}, turned
        ),
    ]


def _left_out(solution: FlatSolution) -> list[Check]:
    plan = solution.plan
    checks = checks_of(solution.left_out, plan.scene)
    return checks + _friction_checks(solution) if plan.effect("friction") else checks


def _friction_checks(solution: FlatSolution) -> list[Check]:
    scene = solution.plan.scene
    checks = [] if scene.coupled else [common.coupling_check(scene, solution.model)]
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
    return checks
