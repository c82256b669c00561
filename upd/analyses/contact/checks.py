"""Self-checks of a contact: each number against its limit, with the remedy.

One per line of physics the solver must not break: balance, one-sided contact, Coulomb's limit; and
the size of the contact, the onset of yield, the effects left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.bodies import product_checks
from upd.analyses.contact.effects import beta_of, checks_of
from upd.analyses.contact.faces import lattices, rim_nodes
from upd.analyses.contact.loading import (
    LoadPath,
    Sheared,
    as_normal,
    contact_points_of,
    opened_by_shear,
    shear_nodes,
    tangential_compliance,
    tilt_arms,
)
from upd.analyses.contact.plan import NORMAL, ContactPlan, wider_patch
from upd.analyses.contact.solution import ContactSolution, NormalCase, TangentialCase
from upd.analyses.contact.yielding import yield_checks
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact
from upd.mesh import recipes
from upd.results import NO_CASE, Case, Check
from upd.scene import Scene

Array = NDArray[np.float64]
#: fewest node spacings across flat faces
_ACROSS = 4
_EPS, _TINY = float(np.finfo(float).eps), float(np.finfo(float).tiny)


def rounding(n: int) -> float:
    """Rounding level of a sum of n products and the handful of operations around it, that the
    checks allow.

    The contact solvers accept an answer at 4 (n + 10) eps and clip forces by as much; the product
    made again here leaves one more, and two directions double the terms.
    """
    return 20.0 * (n + 10) * _EPS


def normal_checks(
    case: Case,
    load: float,
    answer: NormalContact,
    compliance: Array,
    gap: Array,
    carried: float,
    reaction: Mapping[str, float],
    turned: Array | None = None,
) -> list[Check]:
    """Balance of forces, no tension, no penetration, and no force across a gap.

    Nothing the solver cleaned is used: the gap is made again from the compliance,
    g = h + C f - d e - T theta, and tension looks at the forces before they were clipped
    (K. L. Johnson, Contact Mechanics, 1985, section 5.9, for the conditions).

    Parameters
    ----------
    load
        N on the whole contact.
    compliance
        C (n, n), of both bodies, mm/N.
    gap
        h (n,) mm before the load.
    carried
        Sum of the contact forces on the whole contact, N.
    reaction
        Body -> N on its distant set, where that is known.
    turned
        T theta (n,) mm, what a free tilt adds to the approach.
    """
    f, limit = answer.force, rounding(len(answer.force))
    diagonal = np.diagonal(compliance)
    # |C_ij| <= sqrt(C_ii C_jj)
    row = np.sqrt(diagonal * diagonal.max())
    more = np.zeros(len(f)) if turned is None else turned
    scale = np.abs(gap) + abs(answer.approach) + np.abs(more) + row * float(np.abs(f).sum())
    g = (gap + compliance @ f - answer.approach - more) / scale
    allowed = limit * float((scale / row).max()) / load
    balance = max(abs(r / load - 1.0) for r in (carried, *reaction.values()))
    return [
        Check(
            "reaction",
            case,
            balance,
            1e-8,
            "|reaction of the distant set, or sum of the contact forces - F| / F",
            'the linear solve lost accuracy: try solver.name = "superlu" and report the mesh',
        ),
        Check(
            "no tension",
            case,
            float(max(0.0, -answer.unclipped.min())) / load,
            allowed,
            "largest tensile force / F, before clipping",
            "report this",
        ),
        Check(
            "no penetration",
            case,
            float(max(0.0, -g.min())),
            limit,
            "largest penetration h + C f - d / its terms",
            "report this",
        ),
        Check(
            "no force across a gap",
            case,
            float(np.abs(f) @ np.abs(g)) / float(np.abs(f).sum()),
            limit,
            "sum f |h + C f - d| / F, over its terms",
            "report this",
        ),
    ]


def tangential_checks(case: Case, model: ContactModel, t: Sheared) -> list[Check]:
    """Coulomb's law node by node, and the balance, after one tangential load step.

    The slip is made again from the compliance, dw = d - C t - w_before: none where a node sticks;
    where it slips |t| = mu f and dw = lambda t, lambda >= 0: largest dissipation
    (K. L. Johnson, Contact Mechanics, 1985, section 7.2).
    """
    n, k = len(t.loaded), len(t.components)
    C = tangential_compliance(model, t.components, t.loaded)
    allowed, diagonal = rounding(k * n), np.diagonal(C)
    force = t.force.reshape(k, n)
    row = np.sqrt(diagonal * diagonal.max())
    size = (
        np.repeat(np.abs(t.displacement), n)
        + np.abs(t.before)
        + t.terms
        + row * float(np.abs(t.force).sum())
        + diagonal * np.tile(t.limit, k)
    ).reshape(k, n)
    slip = (np.repeat(t.displacement, n) - C @ t.force - t.before).reshape(k, n)
    length = np.linalg.norm(force, axis=0)
    # Part of the slip that is not along the traction, or runs against it.
    along = np.maximum(0.0, (slip * force).sum(axis=0)) / np.maximum(length**2, _TINY)
    beside = np.abs(slip - along * force) / size
    largest, slips = float(t.limit.max()), ~t.stick
    force_allowed = allowed * float((size / diagonal.reshape(k, n)).max()) / largest
    remedy = "report this case"
    return [
        Check(
            "tangential balance",
            case,
            float(np.abs(force.sum(axis=1) - t.load).max() / t.limit.sum()),
            allowed,
            "|sum of tractions - T| / mu N",
            remedy,
        ),
        Check(
            "Coulomb limit",
            case,
            max(0.0, float((length - t.limit).max()) / largest),
            force_allowed,
            "largest (|t| - mu f) / max(mu f), before projection",
            remedy,
        ),
        Check(
            "slip at the limit",
            case,
            float(np.abs(length - t.limit)[slips].max(initial=0.0)) / largest,
            force_allowed,
            "largest ||t| - mu f| / max(mu f) where nodes slip",
            remedy,
        ),
        Check(
            "stick",
            case,
            float((np.abs(slip) / size)[:, t.stick].max(initial=0.0)),
            allowed,
            "largest slip d - C t / its terms where nodes stick",
            remedy,
        ),
        Check(
            "slip direction",
            case,
            float(beside[:, slips].max(initial=0.0)),
            allowed,
            "slip beside or against the traction / its terms",
            remedy,
        ),
    ]


def pressed_checks(
    plan: ContactPlan, model: ContactModel, case: NormalCase, carried: float, turned: Array
) -> list[Check]:
    """Of a normal load: `normal_checks`, and those of the shear that pressure alone makes.

    Parameters
    ----------
    case
        A normal load of a solution.
    carried
        Sum of the contact forces on the whole contact, N.
    turned
        (n,) mm that a free tilt adds to the approach.
    """
    checks: list[Check] = []
    if case.state is not None:
        nodes = shear_nodes(model, plan.scene.contact.friction, case.state)
        checks = tangential_checks(case.case, model, nodes)
        turned = turned - opened_by_shear(model, case.state)
    C, load = model.compliance(NORMAL), case.force
    return [
        *checks,
        *normal_checks(
            case.case, load, case.solution, C, model.gap, carried, case.reaction, turned
        ),
    ]


def sheared_checks(plan: ContactPlan, model: ContactModel, t: TangentialCase) -> list[Check]:
    """Of a tangential load of a solution: `tangential_checks`, and where the pressure follows the
    shear `normal_checks` of the forces under it.
    """
    checks = tangential_checks(t.case, model, t.nodes)
    if t.state is None:
        return checks
    answer = as_normal(t.state, float("nan"))
    turned = -opened_by_shear(model, t.state)
    if t.state.motion[3:].size:
        turned = turned + tilt_arms(plan, model) @ t.state.motion[3:]
    C, carried = model.compliance(NORMAL), float(answer.unclipped.sum())
    load = t.normal.force
    return [
        *checks,
        *normal_checks(t.case, load, answer, C, model.gap, carried, {}, turned),
    ]


def loop_check(path: LoadPath) -> Check:
    """Area of a cycle's loop against the work of slip."""
    error = abs(path.loop_area / path.slip_work - 1.0) if path.slip_work else path.loop_area
    remedy = "the loop is drawn with too few steps: raise loads.cycle_steps"
    return Check("loop area", path.case, error, 1e-2, "|loop area / slip work - 1|", remedy)


def _left_out_checks(solution: ContactSolution) -> list[Check]:
    """Of the effects left out; they carry the names the plan gives them."""
    plan, scene = solution.plan, solution.plan.scene
    checks = checks_of(solution.left_out, scene)
    if plan.effect("friction") and not scene.coupled:
        checks.append(_coupling_check(scene))
    if scene.mesh.element == "hex8":
        checks.append(_locking_check(solution))
    text, remedy = (
        "sum |df| / 2 F at T = mu N",
        "gross slip would move much of the pressure: trust the first loading only",
    )
    return checks + [
        Check("pressure moved by shear", case, value, 0.5, text, remedy, fatal=False)
        for case, value in solution.moved.items()
    ]


def _coupling_check(scene: Scene) -> Check:
    """How far the materials are from shearing a contact of half-spaces by pressure alone.

    Bodies of finite shape couple the two problems whatever their materials: nearly not at all
    where the contact is small against both, much where it is as large as they are.
    """
    return Check(
        "Dundurs beta",
        NO_CASE,
        beta_of(scene),
        scene.contact.coupling_limit,
        "|beta|: how much pressure shears half-spaces of unlike materials",
        "pressure shears the contact of these materials, which the tangential numbers leave out: "
        'set contact.coupling = "coupled", or raise contact.coupling_limit to accept it',
        fatal=False,
    )


def _locking_check(solution: ContactSolution) -> Check:
    """Volume that eight integration points hold in a nearly incompressible body.

    The ready sphere under 200 N with 24 divisions: hex8's largest pressure is +0.3, 0.7, 1.9, 5.3,
    10, 56, 233 % off Hertz with nu = 0.3, 0.4, 0.45, 0.48, 0.49, 0.499, 0.4999; hex8i's -0.4 to
    -2.1 %. (T. J. R. Hughes, The Finite Element Method, 2000, section 4.3: volumetric locking.)
    """
    scene = solution.plan.scene
    return Check(
        "locking",
        NO_CASE,
        max(one.nu for one in scene.materials.values()),
        0.48,
        "Poisson's ratio of bodies of hex8",
        "hex8 locks where a body is nearly incompressible: pressures are more than about 5 % too "
        'high, and at 0.4999 more than three times the right ones: set mesh.element = "hex8i"',
        fatal=False,
    )


def _missing(plan: ContactPlan, made: set[str]) -> Iterable[Check]:
    """A failed check for every effect left out whose check was not made."""
    for effect in plan.effects if plan.scene.left_out.solves else ():
        if effect.check and effect.word == "no" and effect.check not in made:
            yield Check(
                effect.check,
                NO_CASE,
                1,
                0,
                f"the check of {effect.name} was not made",
                "report this scene",
            )


# -- size and place of the contact -----------------------------------------------------------------


def _rim_check(solution: ContactSolution, case: NormalCase) -> Check:
    """The contact must stay clear of the rim of the potential patch: beyond it nothing stops the
    bodies from overlapping.
    """
    patch = solution.model.patch
    half = 0.5 * min(np.ptp(patch.X), np.ptp(patch.Y))
    # The gap gives the radius of curvature, h = r^2 / 2R at the rim; a flat patch (to rounding of
    # its coordinates) has none.
    gap = patch.whole(solution.model.gap)
    rim = gap[0, len(patch.Y) // 2] if patch.quads is None else gap[patch.rim()].min()
    corner = float(rim - gap.min())
    if corner <= 1e-9 * half:
        return Check("patch rim", case.case, 0, 0, "the contact is flat: its rim belongs to it")
    radius = half**2 / (2.0 * corner)
    needed = 2.6 * float(np.cbrt(0.75 * case.force * radius / solution.modulus))
    return Check(
        "patch rim",
        case.case,
        rim_nodes(solution, case),
        0,
        "rim nodes in contact",
        f"the contact reaches the rim of the {2 * half:.4g} mm patch: "
        + wider_patch(solution.plan.scene, needed),
    )


def _resolution_check(solution: ContactSolution, case: NormalCase) -> Check:
    scene, radius = solution.plan.scene, case.measures.radius_moment
    spacing, width = solution.model.patch.spacing, float(np.ptp(solution.model.patch.X))
    ways = ['geometry.patch to "auto"'] if recipes.has_parameter(scene.recipe, "patch") else []
    if recipes.has_parameter(scene.recipe, "divisions"):
        divisions = int(2 * np.ceil(1.5 * width / max(radius, 0.1 * spacing)))
        ways.append(f"geometry.divisions to {divisions} or more")
    finer = (
        f"set {' or '.join(ways)}"
        if ways
        else f"mesh the contact surface with elements of {radius / 3.0:.3g} mm or less"
    )
    return Check(
        "resolution",
        case.case,
        3.0 * spacing / max(radius, 1e-300),
        1.0,
        "3 h / a (a contact radius, h node spacing)",
        "fewer than 3 nodes along the contact radius, so the numbers of this load are "
        f"rough: {finer}",
        fatal=False,
    )


def _flat_resolution_check(solution: ContactSolution) -> Check:
    """Elements across the narrowest patch of flat faces.

    K_N of the ready wedge, 4.42e6 N/mm in the limit (hex20), is 43 % too high with one hex8i across
    it, 12 % with 2, 8.7 % with 3, 4.8 % with 4 and 2.3 % with 8; with one and two hex20, whose
    nodes lie as near as those of two and four hex8i, it is 0.8 % too high and 0.9 % too low.
    """
    edges: list[tuple[int, str]] = []
    for k in lattices(solution):
        lines = (len(k.Y) - 1, len(k.X) - 1)
        if not k.lattice:
            # of a square of as many elements
            lines = (round(len(k.patch.cells()) ** 0.5),) * 2
        edges += zip(lines, ("divisions", "divisions_long"), strict=True)
    fewest, name = min(edges)
    scene = solution.plan.scene
    # the multipliers of hex20 sit at its corners
    enough = _ACROSS // 2 if scene.mesh.element == "hex20" else _ACROSS
    way = (
        f"set geometry.{name} to {enough} or more"
        if recipes.has_parameter(scene.recipe, name)
        else f"mesh the contact with {enough} elements or more along each edge"
    )
    return Check(
        "resolution",
        NO_CASE,
        enough / fewest,
        1.0,
        f"{enough} / lines of elements across the contact",
        f"the stiffnesses are wrong by more than about 5 %: {way}",
        fatal=False,
    )


def _curved_checks(solution: ContactSolution) -> list[Check]:
    """Of a curved contact as a whole: symmetric, and small against its curvature."""
    plan, scene, checks = solution.plan, solution.plan.scene, []
    lattice = solution.model.patch.quads is None
    mirrored = recipes.has_parameter(scene.recipe, "symmetry")
    if lattice and mirrored and not plan.effect("mirror symmetry"):
        text, remedy = "|f - mirrored f| / max f", "the mesh or the load is not symmetric"
        checks += [
            Check("symmetric pressure", c.case, _asymmetry(solution, c), 1e-6, text, remedy)
            for c in solution.normal
            if c.force > 0.0
        ]
    checks.append(_steepness_check(solution))
    if solution.no_shares:
        text, remedy = solution.no_shares, "use a larger or finer body"
        checks.append(Check("body compression", NO_CASE, 1, 0, text, remedy, fatal=False))
    return checks


def _steepness_check(solution: ContactSolution) -> Check:
    radius = solution.plan.scene.sphere_radius
    if radius is None:
        text = "steepest slope of the gap where the bodies touch"
        remedy = (
            "the contact reaches where the faces are too steep for small-displacement theory: "
            "lower the load"
        )
        return Check("slope in the contact", NO_CASE, _slope(solution), 0.2, text, remedy)
    ratio = max(c.measures.radius_outermost for c in solution.normal) / radius
    text = "outermost contact node / sphere radius"
    remedy = "the contact is too large for small-displacement theory: lower the load"
    return Check("contact radius against sphere", NO_CASE, ratio, 0.2, text, remedy)


def _slope(solution: ContactSolution) -> float:
    """Steepest slope of the undeformed gap at the nodes in contact, over all loads.

    a / R for a sphere.
    """
    patch = solution.model.patch
    steepness = np.hypot(*patch.slopes(solution.model.gap))
    touching = [steepness[patch.whole(c.solution.force) > 0.0] for c in solution.normal]
    return max((float(s.max()) for s in touching if s.size), default=0.0)


def _asymmetry(solution: ContactSolution, case: NormalCase) -> float:
    f = solution.model.patch.whole(case.solution.force, extensive=True)
    return float(max(np.abs(f - f[::-1]).max(), np.abs(f - f[:, ::-1]).max()) / f.max())


def _moment_check(solution: ContactSolution, case: NormalCase, arms: Array) -> Check:
    force, points = case.solution.force, contact_points_of(solution.model)[:, :2]
    moment = float(np.abs(arms.T @ force).max())
    return Check(
        "moment balance",
        case.case,
        moment / (float(force.sum()) * float(np.ptp(points, axis=0).max())),
        1e-8,
        "moment about the load line / (F patch length)",
        "report this",
    )


# -- all of them -----------------------------------------------------------------------------------


def check_solution(solution: ContactSolution) -> list[Check]:
    """All self-checks; the ones that replace a left-out effect carry the name the plan gives
    them.
    """
    checks = [c for case in solution.normal for c in _normal_case_checks(solution, case)]
    checks += [c for t in solution.tangential for c in _tangential_case_checks(solution, t)]
    checks += [loop_check(path) for path in solution.paths if path.cycle]
    checks += yield_checks(solution)
    checks += _left_out_checks(solution)
    checks += _curved_checks(solution) if solution.curved else [_flat_resolution_check(solution)]
    return [*checks, *_missing(solution.plan, {c.name for c in checks})]


def _normal_case_checks(solution: ContactSolution, case: NormalCase) -> list[Check]:
    model, plan, force = solution.model, solution.plan, case.solution.force
    checks = [_rim_check(solution, case)] if solution.curved else []
    if not case.force > 0.0:
        return checks
    if solution.curved:
        checks += product_checks(model, case.case, (NORMAL,), force)
        checks.append(_resolution_check(solution, case))
    arms = tilt_arms(plan, model)
    turned = np.zeros(len(force)) if case.tilt is None else arms @ case.tilt
    checks += pressed_checks(plan, model, case, plan.copies * float(force.sum()), turned)
    return checks if case.tilt is None else [*checks, _moment_check(solution, case, arms)]


def _tangential_case_checks(solution: ContactSolution, t: TangentialCase) -> list[Check]:
    checks = sheared_checks(solution.plan, solution.model, t)
    if not solution.curved:
        return checks
    tractions = np.zeros((len(t.nodes.components), len(solution.model.gap)))
    tractions[:, t.nodes.loaded] = t.nodes.force.reshape(len(tractions), -1)
    products = product_checks(solution.model, t.case, t.nodes.components, tractions.ravel())
    return [*checks, *products]
