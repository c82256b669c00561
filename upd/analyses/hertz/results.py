"""HertzSolution -> the flat list of numbers, each beside its closed form and what was printed of
it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.results import (
    UM,
    cycle_energy,
    located_results,
    pick,
    shear_stiffness,
    stick_area,
)
from upd.analyses.contact.solution import HertzNormalCase, HertzSolution, HertzTangentialCase
from upd.analyses.printed import printed_of, with_printed
from upd.contact.patch import consistent_average
from upd.contact.stiffness import without_body
from upd.mesh import recipes
from upd.plot.chart import Entry
from upd.reference import (
    HertzPoint,
    hertz_axial_displacement,
    hertz_pressure,
    hertz_sphere,
    mindlin,
    tangential_compliance_modulus,
)
from upd.results import ErrorPart, Result, with_parts, withheld

UM2 = 1e6
_HERTZ, _MINDLIN = "Hertz", "Cattaneo-Mindlin"
_HERTZ_3A = "Hertz, within 3a"
# Beside numbers that have no reference: where they come from.
_SOLVED = "solved for, without the mesh's error"
_FAR = "fitted along the axis less solved"
# How errors were estimated.
_BETTI = "Betti's theorem: displacements less those of half-spaces and of the bodies' share"

Array = NDArray[np.float64]

# Raw, and with the bulk compliance removed: one mesh's error is in both.
_OF_APPROACH = ("approach", "approach_contact")

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


def headline(results: Sequence[Entry]) -> list[Entry]:
    """The numbers an engineer asks for first, at the largest load."""
    return pick(results, HEADLINE, last=True)


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
            cycle_energy(c, _loop_energy(solution, case), "Mindlin-Deresiewicz")
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
    near, far = (abs(error) * UM / abs(result.value) for error in known)
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


def _of(hertz: HertzPoint[float] | None, name: str, factor: float = 1.0) -> float | None:
    return None if hertz is None else factor * float(getattr(hertz, name))


def _normal(solution: HertzSolution, case: HertzNormalCase) -> list[Result]:
    m, hertz = case.measures, hertz_of(solution, case.load)
    table = [
        ("radius_moment", m.radius_moment * UM, "um", _of(hertz, "radius", UM)),
        ("radius_area", m.radius_area * UM, "um", _of(hertz, "radius", UM)),
        ("radius_outermost", m.radius_outermost * UM, "um", _of(hertz, "radius", UM)),
        ("approach", case.approach * UM, "um", _of(hertz, "approach", UM)),
        ("contact_area", m.area * UM2, "um2", _of(hertz, "area", UM2)),
        ("contact_area_nodes", m.area_nodes * UM2, "um2", _of(hertz, "area", UM2)),
        ("max_pressure", m.max_pressure, "MPa", _of(hertz, "max_pressure")),
        ("mean_pressure", m.mean_pressure, "MPa", _of(hertz, "mean_pressure")),
    ]
    out = [
        Result(name, case.case, float(value), unit, reference, _HERTZ if reference else "")
        for name, value, unit, reference in table
    ]
    if solution.plan.effect("friction"):
        patch = solution.model.patch
        sticks = patch.whole(case.stick.astype(float)) > 0.0
        out.append(stick_area(case.case, float(patch.area()[sticks].sum()) * UM2, "um2"))
    if m.area_resolution is not None:
        out = located_results(out, case.case, m.area_resolution * UM2, "um2")
    return out + _approach_split(case, hertz, sum(beyond_3a(solution, case.load).values()))


def _approach_split(
    case: HertzNormalCase, hertz: HertzPoint[float] | None, beyond: float
) -> list[Result]:
    """The approach less the bodies' share, and within depth 3a; ``beyond`` is what lies beyond it
    in two half-spaces, mm.
    """
    if not case.shares:
        return []
    phi = {body: s.compression for body, s in case.shares.items()}
    far = sum(s.far_mesh for s in case.shares.values())
    within = None if hertz is None else (hertz.approach - beyond) * UM
    return [
        Result(
            "approach_contact",
            case.case,
            (case.approach - case.finite_body) * UM,
            "um",
            _of(hertz, "approach", UM),
            _HERTZ,
        ),
        Result("approach_finite_body", case.case, case.finite_body * UM, "um", None, _SOLVED),
        Result("approach_far_mesh", case.case, far * UM, "um", None, _FAR),
        *(
            Result(f"compression_3a_{body}", case.case, value * UM, "um")
            for body, value in phi.items()
        ),
        Result(
            "approach_within_3a",
            case.case,
            (case.approach - sum(phi.values())) * UM,
            "um",
            within,
            _HERTZ_3A if within else "",
        ),
    ]


def _stiffness(solution: HertzSolution, case: HertzNormalCase) -> list[Result]:
    hertz = hertz_of(solution, case.load)
    if not solution.plan.scene.wants("stiffness") or case.load <= 0.0:
        return []
    body, secant = case.finite_body / case.load, case.load / case.approach
    tangent_of, secant_of = _of(hertz, "tangent_stiffness"), _of(hertz, "secant_stiffness")
    K_N = without_body(case.stiffness, body)
    out = [
        Result("K_N_tangent_raw", case.case, case.stiffness, "N/mm", tangent_of, _HERTZ),
        Result("K_N_secant_raw", case.case, secant, "N/mm", secant_of, _HERTZ),
    ]
    if case.shares:
        out.append(_within_3a(solution, case, hertz))
        out.append(Result("K_N_tangent", case.case, K_N, "N/mm", tangent_of, _HERTZ))
        out.append(
            Result("K_N_secant", case.case, without_body(secant, body), "N/mm", secant_of, _HERTZ)
        )
    if case.shear_stiffness is None or hertz is None:
        return out
    reference = mindlin.initial_tangential_stiffness(hertz.radius, shear_compliance(solution))
    out.append(
        Result("K_T_initial_raw", case.case, case.shear_stiffness, "N/mm", reference, _MINDLIN)
    )
    if case.shear_shares:
        K_T = without_body(case.shear_stiffness, case.finite_body_shear)
        out.append(Result("K_T_initial", case.case, K_T, "N/mm", reference, _MINDLIN))
        out.append(
            Result(
                "K_T_over_K_N",
                case.case,
                K_T / K_N,
                "",
                reference / hertz.tangent_stiffness,
                "Mindlin",
            )
        )
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
        return withheld("K_N_tangent_3a", case.case, "N/mm", f"{reason}; {_finer(solution)}")
    beyond = sum(beyond_3a(solution, case.load).values())
    closed = None if hertz is None else 1.5 * case.load / (hertz.approach - beyond)
    return Result(
        "K_N_tangent_3a",
        case.case,
        1.5 * case.load / within,
        "N/mm",
        closed,
        _HERTZ_3A if closed else "",
    )


def _tangential(solution: HertzSolution, t: HertzTangentialCase, *, misfits: bool) -> list[Result]:
    mu, N, c = solution.plan.scene.contact.friction, t.normal.load, stick_radius(solution, t)
    hertz = hertz_of(solution, N)
    stick = float(np.sqrt(solution.model.patch.area()[t.stick].sum() / np.pi))
    stiffness = [
        stick_area(t.case, float(solution.model.patch.area()[t.stick].sum()) * UM2, "um2"),
        *shear_stiffness(t.case, t.load, t.displacement, t.stiffness),
    ]
    if hertz is None or c is None:
        return [
            Result("stick_radius", t.case, stick * UM, "um"),
            Result("tangential_displacement_raw", t.case, t.displacement * UM, "um"),
            *stiffness,
        ]
    reference = (
        float(mindlin.displacement(t.load, mu, N, hertz.radius, shear_compliance(solution))) * UM
    )
    out = [
        Result("stick_radius", t.case, stick * UM, "um", c * UM, _MINDLIN),
        Result(
            "tangential_displacement_raw", t.case, t.displacement * UM, "um", reference, _MINDLIN
        ),
    ]
    if t.normal.shear_shares:
        bodies = t.load * t.normal.finite_body_shear
        out.append(
            Result(
                "tangential_displacement",
                t.case,
                (t.displacement - bodies) * UM,
                "um",
                reference,
                _MINDLIN,
            )
        )
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
    scales = {"traction_misfit_L2": theirs, "traction_misfit_of_limit_L2": limit}
    sizes = {name: float(np.sqrt((area * scale**2).sum())) for name, scale in scales.items()}
    return [
        Result(name, t.case, float(misfit / size), "", None, _MINDLIN)
        if size > 0.0
        else withheld(name, t.case, "", f"the contact lies between the nodes; {_finer(solution)}")
        for name, size in sizes.items()
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
