"""Self-checks of a contact: each number against its limit, with the remedy.

One per line of physics the solver must not break: balance, one-sided contact, Coulomb's limit; and
the size of the contact, the onset of yield, the effects left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upd.analyses.base import conditions
from upd.analyses.contact.bodies import product_checks
from upd.analyses.contact.plan import NORMAL, REMEDIES
from upd.analyses.contact.solution import (
    ContactSolution,
    LoadPath,
    NormalCase,
    Sheared,
    TangentialCase,
    as_normal,
    contact_points_of,
    opened_by_shear,
    shear_nodes,
    tangential_compliance,
    tilt_arms,
)
from upd.contact.model import ContactModel
from upd.contact.normal import NormalContact
from upd.contact.subsurface import most_stressed, partial_slip_ratio
from upd.mesh import recipes
from upd.reference import dundurs_beta, hertz_yield_load, hertz_yield_point
from upd.results import NO_CASE, Case, Check
from upd.scene import Scene

Array = NDArray[np.float64]
#: fewest node spacings across flat faces
_ACROSS = 4
#: a check that does not end the run
_warning = partial(Check, fatal=False)
_EPS, _TINY = float(np.finfo(float).eps), float(np.finfo(float).tiny)
_YIELDS = (
    "the body yields before this load, and the contact is then larger and its pressure lower than "
    "computed: lower the load, take a harder material or a larger contact"
)


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
    model: ContactModel,
    carried: float,
    turned: Array,
    reaction: Mapping[str, float] | None = None,
) -> list[Check]:
    """Balance of forces, no tension, no penetration, and no force across a gap.

    Nothing the solver cleaned is used: the gap is made again from the compliance,
    g = h + C f - d e - T theta, and tension looks at the forces before they were clipped
    (K. L. Johnson, Contact Mechanics, 1985, section 5.9, for the conditions).

    Parameters
    ----------
    load
        N on the whole contact.
    carried
        Sum of the contact forces on the whole contact, N.
    turned
        T theta (n,) mm, what a free tilt, or shear, adds to the approach.
    reaction
        Body -> N on its distant set, where that is known.
    """
    f, limit, C = answer.force, rounding(len(answer.force)), model.compliance(NORMAL)
    diagonal = np.diagonal(C)
    # |C_ij| <= sqrt(C_ii C_jj)
    row = np.sqrt(diagonal * diagonal.max())
    scale = np.abs(model.gap) + abs(answer.approach) + np.abs(turned) + row * float(np.abs(f).sum())
    g = (model.gap + C @ f - answer.approach - turned) / scale
    allowed = limit * float((scale / row).max()) / load
    balance = max(abs(r / load - 1.0) for r in (carried, *(reaction or {}).values()))
    tension = float(max(0.0, -answer.unclipped.min())) / load
    across = float(np.abs(f) @ np.abs(g)) / float(np.abs(f).sum())
    rows = (
        ("no tension", tension, allowed, "largest tensile force / F, before clipping"),
        (
            "no penetration",
            max(0.0, -g.min()),
            limit,
            "largest penetration h + C f - d / its terms",
        ),
        ("no force across a gap", across, limit, "sum f |h + C f - d| / F, over its terms"),
    )
    what = "|reaction of the distant set, or sum of the contact forces - F| / F"
    remedy = 'the linear solve lost accuracy: try solver.name = "superlu" and report the mesh'
    return [
        *conditions(case, remedy, ("reaction", balance, 1e-8, what)),
        *conditions(case, "report this", *rows),
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
    bound = allowed * float((size / diagonal.reshape(k, n)).max()) / largest
    left = np.abs(force.sum(axis=1) - t.load).max() / t.limit.sum()
    beyond = (length - t.limit) / largest
    over, short = max(0.0, beyond.max()), np.abs(beyond)[slips].max(initial=0.0)
    stuck = (np.abs(slip) / size)[:, t.stick].max(initial=0.0)
    astray = beside[:, slips].max(initial=0.0)
    return conditions(
        case,
        "report this case",
        ("tangential balance", left, allowed, "|sum of tractions - T| / mu N"),
        ("Coulomb limit", over, bound, "largest (|t| - mu f) / max(mu f), before projection"),
        ("slip at the limit", short, bound, "largest ||t| - mu f| / max(mu f) where nodes slip"),
        ("stick", stuck, allowed, "largest slip d - C t / its terms where nodes stick"),
        ("slip direction", astray, allowed, "slip beside or against the traction / its terms"),
    )


def _loop_check(path: LoadPath) -> Check:
    """Area of a cycle's loop against the work of slip, over the largest of a loop; where nothing
    slips, that work is rounding beside the product of load and displacement.
    """
    elastic = float(np.abs(path.load).max() * np.abs(path.displacement).max())
    size = max(path.most_work, float(np.sqrt(_EPS)) * elastic)
    error = abs(path.loop_area - path.slip_work) / size
    remedy = "the loop is drawn with too few steps: raise loads.cycle_steps"
    return Check("loop area", path.case, error, 1e-2, "|area - slip work| / most slip work", remedy)


def _left_out_checks(solution: ContactSolution) -> Iterator[Check]:
    """Of the effects left out, which carry the names the plan gives them; of what materials do.

    Bodies of finite shape couple normal and tangential contact whatever their materials: nearly
    not at all where the contact is small against both, much where it is as large as they are.

    hex8 holds the volume at eight points (T. J. R. Hughes, The Finite Element Method, 2000, section
    4.3: volumetric locking). The ready sphere under 200 N with 24 divisions: its largest pressure
    is +0.3, 0.7, 1.9, 5.3, 10, 56, 233 % off Hertz with nu = 0.3, 0.4, 0.45, 0.48, 0.49, 0.499,
    0.4999; hex8i's -0.4 to -2.1 %.
    """
    plan, scene = solution.plan, solution.plan.scene
    for one in solution.left_out:
        yield one.check(scene.left_out, REMEDIES[one.effect])
    if plan.effect("friction") and not scene.coupled:
        first, second = list(scene.materials.values())[:2]
        beta = abs(float(dundurs_beta(first.E, first.nu, second.E, second.nu)))
        what = "|beta|: how much pressure shears half-spaces of unlike materials"
        remedy = (
            "pressure shears the contact of these materials, which the tangential numbers leave "
            'out: set contact.coupling = "coupled", or raise contact.coupling_limit to accept it'
        )
        limit = scene.contact.coupling_limit
        yield _warning("Dundurs beta", NO_CASE, beta, limit, what, remedy)
    if scene.mesh.element == "hex8":
        largest = max(one.nu for one in scene.materials.values())
        remedy = (
            "hex8 locks where a body is nearly incompressible: pressures are more than about 5 % "
            "too high, and at 0.4999 more than three times the right ones: set mesh.element = "
            '"hex8i"'
        )
        what = "Poisson's ratio of bodies of hex8"
        yield _warning("locking", NO_CASE, largest, 0.48, what, remedy)


# -- size and place of the contact -----------------------------------------------------------------


def _size_checks(solution: ContactSolution, case: NormalCase) -> Iterator[Check]:
    """A curved contact has enough nodes along its radius, and stays clear of the rim of the
    potential patch: beyond it nothing stops the bodies from overlapping.
    """
    patch, a = solution.model.patch, case.measures.radius_moment
    # The gap gives the radius of curvature, h = r^2 / 2R at the rim; a flat patch (to rounding of
    # its coordinates) has none.
    gap = patch.whole(solution.model.gap).ravel()
    half, corner = 0.5 * min(np.ptp(patch.X), np.ptp(patch.Y)), gap[patch.rim()].min() - gap.min()
    nodes, what, remedy = 0, "the contact is flat: its rim belongs to it", ""
    if corner > 1e-9 * half:
        radius = half**2 / (2.0 * float(corner))
        needed = 2.6 * float(np.cbrt(0.75 * case.force * radius / solution.modulus))
        ways = {"patch": f'"{needed:.3g} mm" or more, or to "auto"'}
        without = f"mesh a contact surface of {needed:.3g} mm or more, or lower the load"
        remedy = f"the contact reaches the rim of the {2 * half:.4g} mm patch: "
        remedy += _to_set(solution.plan.scene, ways, without)
        nodes, what = solution.rim_nodes(case), "rim nodes in contact"
    yield Check("patch rim", case.case, nodes, 0, what, remedy)
    if case.force > 0.0:
        divisions = 2 * np.ceil(1.5 * float(np.ptp(patch.X)) / max(a, 0.1 * patch.spacing))
        ways = {"patch": '"auto"', "divisions": f"{divisions:.0f} or more"}
        without = f"mesh the contact surface with elements of {a / 3.0:.3g} mm or less"
        remedy = "fewer than 3 nodes along the contact radius, so the numbers of this load are "
        remedy += f"rough: {_to_set(solution.plan.scene, ways, without)}"
        size, what = 3.0 * patch.spacing, "3 h / a (a contact radius, h spacing)"
        yield _warning("resolution", case.case, size / max(a, 1e-300), 1.0, what, remedy)


def _to_set(scene: Scene, ways: Mapping[str, str], without: str) -> str:
    """What to set of the recipe's parameters, and ``without`` any of them what to do."""
    known = [
        f"geometry.{name} to {value}"
        for name, value in ways.items()
        if recipes.has_parameter(scene.recipe, name)
    ]
    return f"set {' or '.join(known)}" if known else without


def _flat_resolution_check(solution: ContactSolution) -> Check:
    """Elements across the narrowest patch of flat faces.

    K_N of the ready wedge, 4.42e6 N/mm in the limit (hex20), is 43 % too high with one hex8i across
    it, 12 % with 2, 8.7 % with 3, 4.8 % with 4 and 2.3 % with 8; with one and two hex20, whose
    nodes lie as near as those of two and four hex8i, it is 0.8 % too high and 0.9 % too low.
    """
    edges: list[tuple[int, str]] = []
    for k in solution.lattices.values():
        lines = (len(k.Y) - 1, len(k.X) - 1)
        if k.quads is not None:
            # of a square of as many elements
            lines = (round(len(k.cells()) ** 0.5),) * 2
        edges += zip(lines, ("divisions", "divisions_long"), strict=True)
    fewest, name = min(edges)
    scene = solution.plan.scene
    # the multipliers of hex20 sit at its corners
    enough = _ACROSS // 2 if scene.mesh.element == "hex20" else _ACROSS
    without = f"mesh the contact with {enough} elements or more along each edge"
    way = _to_set(scene, {name: f"{enough} or more"}, without)
    what = f"{enough} / lines of elements across the contact"
    remedy = f"the stiffnesses are wrong by more than about 5 %: {way}"
    return _warning("resolution", NO_CASE, enough / fewest, 1.0, what, remedy)


def _curved_checks(solution: ContactSolution) -> Iterator[Check]:
    """Of a curved contact as a whole: steepest slope of the undeformed gap at the nodes in contact
    over all loads (a / R for a sphere), and whether it was split from its bodies.
    """
    patch = solution.model.patch
    steepness = np.hypot(*patch.slopes(solution.model.gap))
    touching = [steepness[patch.whole(c.solution.force) > 0.0] for c in solution.normal]
    slope = max((float(s.max()) for s in touching if s.size), default=0.0)
    text = "steepest slope of the gap where the bodies touch"
    remedy = (
        "the contact reaches where the faces are too steep for small-displacement theory: lower "
        "the load"
    )
    yield Check("slope in the contact", NO_CASE, slope, 0.2, text, remedy)
    if solution.no_shares:
        remedy = "use a larger or finer body"
        yield _warning("body compression", NO_CASE, 1, 0, solution.no_shares, remedy)


# -- onset of yield --------------------------------------------------------------------------------


def yield_checks(solution: ContactSolution) -> Iterator[Check]:
    """Von Mises stress against the yield stress of the bodies that have one.

    The contact itself stays elastic: the check shows where that ends. Of a sphere by Hertz's
    pressure, under a tangential load with Cattaneo's traction; of other contacts by the computed
    pressure and tractions on half-spaces.
    """
    scene, model = solution.plan.scene, solution.model
    limited = [b for b in (model.upper, model.lower) if scene.materials[b.name].yield_stress]
    pressed = [one for one in solution.normal if one.force > 0.0]
    cases: list[NormalCase | TangentialCase] = [*pressed, *solution.tangential]
    for one in cases if limited else ():
        normal = one.normal if isinstance(one, TangentialCase) else one
        by_hertz = solution.hertz_of(normal.force) is not None
        if isinstance(one, TangentialCase):
            by_hertz = solution.closed_form_traction(one) is not None
        faces = [] if by_hertz else _surface_loads(solution, one)
        for body in limited:
            limit = scene.materials[body.name].yield_stress
            assert limit is not None
            if by_hertz:
                stress, what = _hertz_stress(solution, one.case, normal.force, body.name)
            else:
                # the upper body feels the tractions the other way round
                sign = -1.0 if body is model.upper else 1.0
                stress, what = _half_space_stress(faces, sign, scene.materials[body.name].nu)
            what = f"largest von Mises stress / yield stress of {body.name}, {what}"
            case = replace(one.case, body=body.name)
            yield _warning("onset of yield", case, stress / limit, 1.0, what, _YIELDS)


def _surface_loads(
    solution: ContactSolution, one: NormalCase | TangentialCase
) -> list[tuple[Array, Array, list[Array]]]:
    """Of each patch, lattice lines in mm with pressure and, under a tangential load, tractions on
    the lower body along x and y, MPa.

    Without lattice lines on as many even ones as there are nodes, linear between the nodes and zero
    off the patch.
    """
    pressure, out = solution.model.multipliers.pressure, []
    if isinstance(one, NormalCase):
        fields = [pressure(one.solution.force)]
    else:
        shear = np.zeros((2, len(one.pressed)))
        shear[list(one.nodes.components)] = solution.tractions(one)
        fields = [pressure(np.maximum(one.pressed, 0.0)), *shear]
    for patch in solution.lattices.values():
        x, y, whole = patch.X, patch.Y, [patch.whole(field) for field in fields]
        if patch.quads is not None:
            # slow to import: only where it is called
            from scipy.interpolate import LinearNDInterpolator

            points = patch.points()
            n = int(np.ceil(np.sqrt(len(points))))
            x, y = (np.linspace(v.min(), v.max(), n) for v in points.T)
            between = LinearNDInterpolator(points, np.column_stack(whole), 0.0)
            whole = list(np.moveaxis(between(*np.meshgrid(x, y, indexing="ij")), -1, 0))
        out.append((x, y, whole))
    return out


def _hertz_stress(
    solution: ContactSolution, case: Case, force: float, body: str
) -> tuple[float, str]:
    """MPa in a body of a sphere's contact, and what it is."""
    scene, hertz = solution.plan.scene, solution.hertz_of(force)
    material, radius = scene.materials[body], scene.sphere_radius
    assert hertz is not None and radius is not None and material.yield_stress is not None
    worst, depth = hertz_yield_point(material.nu)
    if case.ratio is None:
        stress = worst * hertz.max_pressure
        begins = hertz_yield_load(material.yield_stress, material.nu, radius, solution.modulus)
        return stress, (
            f"Hertz without friction: {stress:.4g} MPa at depth {depth * hertz.radius:.3g} "
            f"mm; yields from {begins:.4g} N"
        )
    ratio = partial_slip_ratio(scene.contact.friction, case.ratio, material.nu)
    # friction never relieves the most stressed place
    stress = max(ratio, worst) * hertz.max_pressure
    return stress, f"Hertz's pressure and Cattaneo's traction on a half-space: {stress:.4g} MPa"


def _half_space_stress(
    faces: Sequence[tuple[Array, Array, list[Array]]], sign: float, nu: float
) -> tuple[float, str]:
    """MPa in a half-space under the worst patch, with what the lattice leaves open of it.

    Parameters
    ----------
    faces
        `_surface_loads`.
    sign
        Of the tractions on the body.
    """
    found = [
        most_stressed(x, y, [p, *(sign * t for t in shear)], nu) for x, y, (p, *shear) in faces
    ]
    worst = max(found, key=lambda one: one.value)
    sheared = any(len(fields) > 1 for _, _, fields in faces)
    return worst.value * (1.0 + worst.resolution), (
        f"computed pressure{' and friction' if sheared else ', no friction,'} on a half-space: "
        f"{worst.value:.4g} MPa at depth {worst.place[2]:.3g} mm, "
        f"and {100.0 * worst.resolution:.2g} % that the lattice leaves open"
    )


# -- all of them -----------------------------------------------------------------------------------


def check_solution(solution: ContactSolution) -> list[Check]:
    """All self-checks; the ones that replace a left-out effect carry the name the plan gives
    them.
    """
    checks = [c for case in solution.normal for c in _normal(solution, case)]
    checks += [c for t in solution.tangential for c in _tangential(solution, t)]
    checks += [_loop_check(path) for path in solution.paths if path.cycle]
    checks += yield_checks(solution)
    checks += _left_out_checks(solution)
    checks += _curved_checks(solution) if solution.curved else [_flat_resolution_check(solution)]
    return checks


def _normal(solution: ContactSolution, one: NormalCase) -> list[Check]:
    model, plan, force, case = solution.model, solution.plan, one.solution.force, one.case
    checks = list(_size_checks(solution, one)) if solution.curved else []
    if not one.force > 0.0:
        return checks
    if solution.curved:
        checks += product_checks(model, case, (NORMAL,), force)
    arms = tilt_arms(plan, model)
    turned = np.zeros(len(force)) if one.tilt is None else arms @ one.tilt
    if one.coupled is not None:
        nodes = shear_nodes(model, plan.scene.contact.friction, one.coupled)
        checks += tangential_checks(case, model, nodes)
        turned = turned - opened_by_shear(model, one.coupled)
    carried = plan.copies * float(force.sum())
    checks += normal_checks(case, one.force, one.solution, model, carried, turned, one.reaction)
    if one.tilt is None:
        return checks
    length = float(np.ptp(contact_points_of(model)[:, :2], axis=0).max())
    moment = float(np.abs(arms.T @ force).max()) / (float(force.sum()) * length)
    what = "moment about the load line / (F patch length)"
    return [*checks, *conditions(case, "report this", ("moment balance", moment, 1e-8, what))]


def _tangential(solution: ContactSolution, t: TangentialCase) -> list[Check]:
    """Where the pressure follows the shear also of the normal forces under it."""
    plan, model = solution.plan, solution.model
    checks = tangential_checks(t.case, model, t.nodes)
    if t.coupled is not None:
        answer = as_normal(t.coupled, float("nan"))
        turned = tilt_arms(plan, model) @ t.coupled.displacement[-1, 3:]
        turned -= opened_by_shear(model, t.coupled)
        carried = float(answer.unclipped.sum())
        checks += normal_checks(t.case, t.normal.force, answer, model, carried, turned)
    if solution.curved:
        shear = np.zeros((len(t.nodes.components), len(model.gap)))
        shear[:, t.nodes.loaded] = t.nodes.force.reshape(len(shear), -1)
        checks += product_checks(model, t.case, t.nodes.components, shear.ravel())
    return checks
