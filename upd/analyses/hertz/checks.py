"""Self-checks of a curved contact: each number against its limit, with the remedy.

One per line of physics the solver must not break.
"""

from __future__ import annotations

import numpy as np

from upd.analyses.contact import checks as common
from upd.analyses.contact import yielding
from upd.analyses.contact.plan import NORMAL
from upd.analyses.contact.scene_plan import has_mirror_planes, wider_patch
from upd.analyses.contact.solution import HertzNormalCase, HertzSolution, HertzTangentialCase
from upd.analyses.hertz.products import product_checks
from upd.analyses.hertz.results import closed_form_traction, hertz_of
from upd.mesh import recipes
from upd.results import NO_CASE, Check


def check_solution(solution: HertzSolution) -> list[Check]:
    """All self-checks; the ones that replace a left-out effect carry the name the plan gives
    them.
    """
    checks = [check for case in solution.normal for check in _normal_checks(solution, case)]
    checks += [check for t in solution.tangential for check in _tangential_checks(solution, t)]
    checks += [common.loop_check(cycle) for cycle in solution.cycles]
    checks += _yield_checks(solution)
    checks += _left_out(solution)
    if solution.no_shares:
        checks.append(
            Check(
                "body compression",
                NO_CASE,
                1,
                0,
                solution.no_shares,
                "use a larger or finer body",
                fatal=False,
            )
        )
    return common.with_missing(solution.plan, checks)


def rim_check(solution: HertzSolution, case: HertzNormalCase) -> Check:
    """The contact must stay clear of the rim of the potential patch: beyond it nothing stops the
    bodies from overlapping.
    """
    patch, force = solution.model.patch, case.force
    rim = np.concatenate([force[0], force[-1], force[:, 0], force[:, -1]])
    half = 0.5 * min(np.ptp(patch.X), np.ptp(patch.Y))
    touched = int((rim > 0.0).sum())
    # The gap gives the radius of curvature, h = r^2 / 2R at the rim; a flat patch (to rounding of
    # its coordinates) has none.
    gap = patch.whole(solution.model.gap)
    corner = float(gap[0, len(patch.Y) // 2] - gap.min())
    if corner <= 1e-9 * half:
        return Check("patch rim", case.case, 0, 0, "the contact is flat: its rim belongs to it")
    radius = half**2 / (2.0 * corner)
    needed = 2.6 * float(np.cbrt(0.75 * case.load * radius / solution.modulus))
    return Check(
        "patch rim",
        case.case,
        touched,
        0,
        "rim nodes in contact",
        f"the contact reaches the rim of the {2 * half:.4g} mm patch: "
        + wider_patch(solution.plan.scene, needed),
    )


def _normal_checks(solution: HertzSolution, case: HertzNormalCase) -> list[Check]:
    if not case.load > 0.0:
        return [rim_check(solution, case)]
    spacing = 3.0 * solution.model.patch.spacing / max(case.measures.radius_moment, 1e-300)
    model = solution.model
    return [
        rim_check(solution, case),
        *product_checks(model, case.case, (NORMAL,), case.solution.force),
        *common.pressed_checks(solution.plan, model, case, float(case.force.sum())),
        Check(
            "resolution",
            case.case,
            spacing,
            1.0,
            "3 h / a (a contact radius, h node spacing)",
            "fewer than 3 nodes along the contact radius, so the numbers of this load are "
            f"rough: {_finer(solution, case)}",
            fatal=False,
        ),
    ]


def _tangential_checks(solution: HertzSolution, t: HertzTangentialCase) -> list[Check]:
    tractions = np.zeros((len(t.nodes.components), len(t.normal.solution.force)))
    tractions[:, t.nodes.loaded] = t.nodes.force.reshape(len(tractions), -1)
    return [
        *common.sheared_checks(solution.plan, solution.model, t),
        *product_checks(solution.model, t.case, t.nodes.components, tractions.ravel()),
    ]


def _yield_checks(solution: HertzSolution) -> list[Check]:
    """Whether a body yields, of the bodies whose yield stress is given."""
    scene, model, patch = solution.plan.scene, solution.model, solution.model.patch
    checks = []
    for case in solution.normal:
        hertz = hertz_of(solution, case.load)
        if hertz is not None and scene.sphere_radius is not None:
            checks += yielding.hertz_checks(
                scene, model, case.case, hertz, scene.sphere_radius, solution.modulus
            )
        elif case.load > 0.0:
            face = (patch.X, patch.Y, [case.pressure])
            checks += yielding.half_space_checks(scene, model, case.case, {"": face})
    for t in solution.tangential:
        hertz = hertz_of(solution, t.normal.load)
        if hertz is not None and closed_form_traction(solution, t) is not None:
            checks += yielding.partial_slip_checks(scene, model, t.case, hertz)
            continue
        tractions = np.zeros((2, *t.pressure.shape))
        parts = t.traction.reshape(*t.pressure.shape, -1)
        for k, component in enumerate(t.nodes.components):
            tractions[component] = parts[..., k]
        face = (patch.X, patch.Y, [t.pressure, *tractions])
        checks += yielding.half_space_checks(scene, model, t.case, {"": face})
    return checks


def _finer(solution: HertzSolution, case: HertzNormalCase) -> str:
    recipe = solution.plan.scene.recipe
    ways = ['geometry.patch to "auto"'] if recipes.has_parameter(recipe, "patch") else []
    if recipes.has_parameter(recipe, "divisions"):
        ways.append(f"geometry.divisions to {_divisions(solution, case)} or more")
    if ways:
        return f"set {' or '.join(ways)}"
    spacing = case.measures.radius_moment / 3.0
    return f"mesh the contact surface with elements of {spacing:.3g} mm or less"


def _divisions(solution: HertzSolution, case: HertzNormalCase) -> int:
    patch = solution.model.patch
    width = float(np.ptp(patch.X))
    return int(2 * np.ceil(1.5 * width / max(case.measures.radius_moment, 0.1 * patch.spacing)))


def _left_out(solution: HertzSolution) -> list[Check]:
    plan, scene = solution.plan, solution.plan.scene
    checks = common.left_out_checks(solution)
    if not plan.effect("mirror symmetry") and has_mirror_planes(scene):
        checks += [
            Check(
                "symmetric pressure",
                c.case,
                _asymmetry(c),
                1e-6,
                "|f - mirrored f| / max f",
                "the mesh or the load is not symmetric",
            )
            for c in solution.normal
            if c.load > 0.0
        ]
    if scene.sphere_radius is None:
        remedy = (
            "the contact reaches where the faces are too steep for small-displacement theory: "
            "lower the load"
        )
        text = "steepest slope of the gap where the bodies touch"
        return [
            *checks,
            Check("slope in the contact", NO_CASE, _slope(solution), 0.2, text, remedy),
        ]
    ratio = max(c.measures.radius_outermost for c in solution.normal) / scene.sphere_radius
    remedy = "the contact is too large for small-displacement theory: lower the load"
    return [
        *checks,
        Check(
            "contact radius against sphere",
            NO_CASE,
            ratio,
            0.2,
            "outermost contact node / sphere radius",
            remedy,
        ),
    ]


def _slope(solution: HertzSolution) -> float:
    """Steepest slope of the undeformed gap at the nodes in contact, over all loads.

    a / R for a sphere.
    """
    patch = solution.model.patch
    gap = patch.whole(solution.model.gap)
    steepness = np.hypot(*np.gradient(gap, patch.X, patch.Y))
    touching = [steepness[case.force > 0.0] for case in solution.normal]
    return max((float(s.max()) for s in touching if s.size), default=0.0)


def _asymmetry(case: HertzNormalCase) -> float:
    f = case.force
    return float(max(np.abs(f - f[::-1]).max(), np.abs(f - f[:, ::-1]).max()) / f.max())
