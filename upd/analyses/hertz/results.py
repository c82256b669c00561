"""HertzSolution -> the flat list of numbers, each beside its closed form and what was printed of
it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.results import LOCATED, shear_stiffness
from upd.analyses.contact.solution import HertzNormalCase, HertzSolution, HertzTangentialCase
from upd.analyses.printed import printed_of, with_printed
from upd.contact.patch import consistent_average
from upd.contact.stiffness import without_body
from upd.mesh import recipes
from upd.reference import (
    HertzPoint,
    hertz_axial_displacement,
    hertz_pressure,
    hertz_sphere,
    mindlin,
    tangential_compliance_modulus,
)
from upd.results import ErrorPart, Result, with_parts
from upd.results import quantities as q
from upd.results.quantity import Quantity

_HERTZ, _MINDLIN = "Hertz", "Cattaneo-Mindlin"
_HERTZ_3A = "Hertz, within 3a"
# How errors were estimated.
_BETTI = "Betti's theorem: displacements less those of half-spaces and of the bodies' share"

Array = NDArray[np.float64]

# Raw, and with the bulk compliance removed: one mesh's error is in both.
_OF_APPROACH = (q.APPROACH.name, q.APPROACH_CONTACT.name)

#: the numbers that matter, most important first
HEADLINE = (
    "max_pressure",
    "radius_moment",
    "approach_contact",
    "K_N_tangent",
    "K_T_initial",
    "tangential_displacement",
    "stick_radius",
    "cycle_energy",
    "approach",
    "mean_pressure",
)


def make_results(solution: HertzSolution, *, misfits: bool = True) -> list[Result]:
    """All numbers of a run, case by case; without the ``misfits`` of tractions from their closed
    form where these would cost more than the contact.
    """
    out: list[Result] = []
    for case in solution.normal:
        out += _normal(solution, case)
        out += _stiffness(solution, case)
        out += [
            r
            for t in solution.tangential
            if t.normal is case
            for r in _tangential(solution, t, misfits=misfits)
        ]
        out += [
            q.CYCLE_ENERGY.of(
                c.slip_work, c.case, _loop_energy(solution, case), "Mindlin-Deresiewicz"
            )
            for c in solution.cycles
            if c.normal == case.case
        ]
    return [
        _with_estimate(result, solution)
        for result in with_printed(out, printed_of(solution.plan.scene))
    ]


def _with_estimate(result: Result, solution: HertzSolution) -> Result:
    """The number with its estimated error where one mesh shows it: the approach."""
    if result.name not in _OF_APPROACH:
        return result
    known = next(c.mesh_error for c in solution.normal if c.case == result.case)
    if known is None:
        return result
    near, far = (abs(error) * q.APPROACH.scale / abs(result.value) for error in known)
    parts = (
        ErrorPart("mesh at the contact", near, _BETTI),
        ErrorPart("mesh far away", far, _BETTI),
    )
    return with_parts(result, parts)


def hertz_of(solution: HertzSolution, load: float) -> HertzPoint[float] | None:
    """Closed form of a normal load in N, or None when the scene has none."""
    radius = solution.plan.scene.sphere_radius
    return None if radius is None or load <= 0.0 else hertz_sphere(load, radius, solution.modulus)


def shear_compliance(solution: HertzSolution) -> float:
    """C = (2 - nu1)/G1 + (2 - nu2)/G2 in 1/MPa."""
    m1, m2 = (
        solution.plan.scene.materials[b.name] for b in (solution.model.upper, solution.model.lower)
    )
    return tangential_compliance_modulus(m1.E, m1.nu, m2.E, m2.nu)


def stick_radius(solution: HertzSolution, case: HertzTangentialCase) -> float | None:
    """Cattaneo and Mindlin's radius of the stick zone in mm, or None when the scene has no closed
    form.
    """
    hertz = hertz_of(solution, case.normal.load)
    mu = solution.plan.scene.contact.friction
    return (
        None
        if hertz is None
        else float(mindlin.stick_radius(case.load, mu, case.normal.load, hertz.radius))
    )


def closed_form_traction(
    solution: HertzSolution, case: HertzTangentialCase
) -> Callable[[Array], Array] | None:
    """Cattaneo and Mindlin's traction in MPa over the distance from the centre in mm, or None."""
    hertz, c = hertz_of(solution, case.normal.load), stick_radius(solution, case)
    if hertz is None or c is None or case.load <= 0.0:
        return None
    mu, N = solution.plan.scene.contact.friction, case.normal.load
    return lambda r: mindlin.traction(r, hertz.radius, c, mu, N)


def _of(hertz: HertzPoint[float] | None, name: str) -> float | None:
    return None if hertz is None else float(getattr(hertz, name))


def _normal(solution: HertzSolution, case: HertzNormalCase) -> list[Result]:
    m, hertz, at = case.measures, hertz_of(solution, case.load), case.case
    table = [
        (q.RADIUS_MOMENT, m.radius_moment, "radius"),
        (q.RADIUS_AREA, m.radius_area, "radius"),
        (q.RADIUS_OUTERMOST, m.radius_outermost, "radius"),
        (q.APPROACH, case.approach, "approach"),
        (_in_um2(q.CONTACT_AREA), m.area, "area"),
        (_in_um2(q.CONTACT_AREA_NODES), m.area_nodes, "area"),
        (q.MAX_PRESSURE, m.max_pressure, "max_pressure"),
        (q.MEAN_PRESSURE, m.mean_pressure, "mean_pressure"),
    ]
    located = LOCATED if m.area_resolution is not None else {}
    out = [
        quantity.of(value, at, closed, _HERTZ)
        if (closed := _of(hertz, name)) is not None
        else quantity.of(value, at, source=located.get(quantity.name, ""))
        for quantity, value, name in table
    ]
    if solution.plan.effect("friction"):
        patch = solution.model.patch
        sticks = patch.whole(case.stick.astype(float)) > 0.0
        out.append(_in_um2(q.STICK_AREA).of(patch.area()[sticks].sum(), at))
    if m.area_resolution is not None:
        out.append(_in_um2(q.CONTACT_AREA_RESOLUTION).of(m.area_resolution, at))
    return out + _approach_split(case, hertz, sum(beyond_3a(solution, case.load).values()))


def _in_um2(area: Quantity) -> Quantity:
    return area.in_unit("um2")


def _approach_split(
    case: HertzNormalCase, hertz: HertzPoint[float] | None, beyond: float
) -> list[Result]:
    """The approach less the bodies' share, and within depth 3a; ``beyond`` is what lies beyond it
    in two half-spaces, mm.
    """
    if not case.shares:
        return []
    at, phi = case.case, {body: s.compression for body, s in case.shares.items()}
    far = sum(s.far_mesh for s in case.shares.values())
    whole = _of(hertz, "approach")
    within = None if hertz is None else hertz.approach - beyond
    left = case.approach - sum(phi.values())
    return [
        q.APPROACH_CONTACT.of(case.approach - case.finite_body, at, whole, _HERTZ),
        q.APPROACH_FINITE_BODY.of(case.finite_body, at),
        q.APPROACH_FAR_MESH.of(far, at),
        *(q.COMPRESSION_3A.of(value, at, n=body) for body, value in phi.items()),
        q.APPROACH_WITHIN_3A.of(left, at, within, _HERTZ_3A if within else ""),
    ]


def _stiffness(solution: HertzSolution, case: HertzNormalCase) -> list[Result]:
    hertz, at = hertz_of(solution, case.load), case.case
    if not solution.plan.scene.wants("stiffness") or case.load <= 0.0:
        return []
    # a gap that is left at the apex is the lattice's, an overlap is the file's
    touch = min(0.0, solution.model.first_touch)
    body, secant = case.finite_body / case.load, case.load / (case.approach - touch)
    tangent_of, secant_of = _of(hertz, "tangent_stiffness"), _of(hertz, "secant_stiffness")
    K_N = without_body(case.stiffness, body)
    out = [
        q.K_N_TANGENT_RAW.of(case.stiffness, at, tangent_of, _HERTZ),
        q.K_N_SECANT_RAW.of(secant, at, secant_of, _HERTZ),
    ]
    if case.shares:
        K_N_secant = without_body(secant, body)
        out += [
            _within_3a(solution, case, hertz),
            q.K_N_TANGENT.of(K_N, at, tangent_of, _HERTZ),
            q.K_N_SECANT.of(K_N_secant, at, secant_of, _HERTZ),
        ]
    if case.shear_stiffness is None or hertz is None:
        return out
    closed = mindlin.initial_tangential_stiffness(hertz.radius, shear_compliance(solution))
    out.append(q.K_T_INITIAL_RAW.of(case.shear_stiffness, at, closed, _MINDLIN))
    if case.shear_shares:
        K_T = without_body(case.shear_stiffness, case.finite_body_shear)
        ratio = closed / hertz.tangent_stiffness
        out += [
            q.K_T_INITIAL.of(K_T, at, closed, _MINDLIN),
            q.K_T_OVER_K_N.of(K_T / K_N, at, ratio, "Mindlin"),
        ]
    return out


def beyond_3a(solution: HertzSolution, load: float) -> dict[str, float]:
    """Displacement of each half-space at depth 3a under a normal load in N: body -> mm, empty
    without a closed form.
    """
    hertz, model = hertz_of(solution, load), solution.model
    if hertz is None:
        return {}
    out = {}
    for name in (model.upper.name, model.lower.name):
        data = solution.plan.scene.materials[name]
        a, p0 = hertz.radius, hertz.max_pressure
        out[name] = float(hertz_axial_displacement(3.0 * a, a, p0, data.E, data.nu))
    return out


def _finer(solution: HertzSolution) -> str:
    if recipes.has_parameter(solution.plan.scene.recipe, "patch"):
        return 'size the patch from the load (geometry.patch = "auto") or take a finer mesh'
    return "mesh the contact surface finer"


def _within_3a(
    solution: HertzSolution, case: HertzNormalCase, hertz: HertzPoint[float] | None
) -> Result:
    """Tangent stiffness of the approach within 3a, 1.5 F / d as F goes with d^1.5: what the thesis
    takes for the contact's (its section 6.5).

    23 % of a half-space's displacement lies beyond 3a, so it is 30 % above K_N by Hertz itself.
    """
    within = case.approach - sum(s.compression for s in case.shares.values())
    # The rounding of a sum of three: nothing of the approach is left within 3a.
    if within <= 4.0 * np.finfo(float).eps * case.approach:
        reason = "the depth 3a lies within the first element under the contact"
        return q.K_N_TANGENT_3A.withheld(case.case, f"{reason}; {_finer(solution)}")
    beyond = sum(beyond_3a(solution, case.load).values())
    closed = None if hertz is None else 1.5 * case.load / (hertz.approach - beyond)
    source = _HERTZ_3A if closed else ""
    return q.K_N_TANGENT_3A.of(1.5 * case.load / within, case.case, closed, source)


def _tangential(solution: HertzSolution, t: HertzTangentialCase, *, misfits: bool) -> list[Result]:
    mu, N, c = solution.plan.scene.contact.friction, t.normal.load, stick_radius(solution, t)
    hertz, area = hertz_of(solution, N), float(solution.model.patch.area()[t.stick].sum())
    stick = float(np.sqrt(area / np.pi))
    stiffness = [
        _in_um2(q.STICK_AREA).of(area, t.case),
        *shear_stiffness(t.case, t.load, t.displacement, t.stiffness),
    ]
    if hertz is None or c is None:
        return [
            q.STICK_RADIUS.of(stick, t.case),
            q.SHEAR_RAW.of(t.displacement, t.case),
            *stiffness,
        ]
    closed = float(mindlin.displacement(t.load, mu, N, hertz.radius, shear_compliance(solution)))
    out = [
        q.STICK_RADIUS.of(stick, t.case, c, _MINDLIN),
        q.SHEAR_RAW.of(t.displacement, t.case, closed, _MINDLIN),
    ]
    if t.normal.shear_shares:
        bodies = t.load * t.normal.finite_body_shear
        out.append(q.SHEAR.of(t.displacement - bodies, t.case, closed, _MINDLIN))
    return out + (_misfits(solution, t, hertz) if misfits else []) + stiffness


def _misfits(
    solution: HertzSolution, t: HertzTangentialCase, hertz: HertzPoint[float]
) -> list[Result]:
    """Root mean square difference of the traction from the closed form, over that of the closed
    form and over that of mu p.
    """
    closed = closed_form_traction(solution, t)
    if closed is None:
        return []
    patch, mu = solution.model.patch, solution.plan.scene.contact.friction
    area, theirs = patch.area(), consistent_average(patch, closed)
    limit = consistent_average(
        patch, lambda r: mu * hertz_pressure(r, hertz.radius, hertz.max_pressure)
    )
    misfit = np.sqrt((area * (t.traction_along - theirs) ** 2).sum())
    lost = f"the contact lies between the nodes; {_finer(solution)}"
    return [
        quantity.of(misfit / size, t.case, source=_MINDLIN)
        if (size := float(np.sqrt((area * scale**2).sum()))) > 0.0
        else quantity.withheld(t.case, lost)
        for quantity, scale in ((q.MISFIT, theirs), (q.MISFIT_OF_LIMIT, limit))
    ]


def _loop_energy(solution: HertzSolution, case: HertzNormalCase) -> float | None:
    """Mindlin and Deresiewicz's energy of a cycle, N mm, or None."""
    hertz, scene = hertz_of(solution, case.load), solution.plan.scene
    if hertz is None:
        return None
    return float(
        mindlin.cycle_energy(
            scene.loads.cycle_amplitude,
            scene.contact.friction,
            case.load,
            hertz.radius,
            shear_compliance(solution),
        )
    )
