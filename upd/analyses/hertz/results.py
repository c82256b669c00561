"""HertzSolution -> the flat list of numbers, each beside its closed form and the thesis's printed value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.analyses.hertz.solve import Cycle, HertzSolution, NormalCase, TangentialCase
from upd.contact.patch import consistent_average
from upd.contact.stiffness import without_body
from upd.reference import THESIS_HERTZ, HertzPoint, hertz_pressure, hertz_sphere, mindlin, tangential_compliance_modulus
from upd.results import Result

UM, UM2 = 1e3, 1e6
_THESIS_UNIT = {"radius": UM, "approach": UM, "area": UM2}
_HERTZ, _MINDLIN = "Hertz", "Cattaneo-Mindlin"

Array = NDArray[np.float64]


#: the numbers that matter, most important first (shell patterns)
HEADLINE = ("max_pressure", "radius_moment", "approach", "K_N_tangent", "K_T_initial", "cycle_energy")


def make_results(solution: HertzSolution) -> list[Result]:
    """All rows of a run, case by case."""
    rows: list[Result] = []
    for case in solution.normal:
        rows += _normal_rows(solution, case)
        rows += _stiffness_rows(solution, case)
        for tangential in (t for t in solution.tangential if t.normal is case):
            rows += _tangential_rows(solution, tangential)
        for cycle in (c for c in solution.cycles if c.normal is case):
            rows += _cycle_rows(solution, cycle)
    return [_with_estimate(row, solution) for row in rows]


def _with_estimate(row: Result, solution: HertzSolution) -> Result:
    """The number with its estimated error, where the mesh was chosen by one."""
    found = solution.estimates.get((row.name, row.case))
    return row if found is None else replace(row, estimated_error=found[0], half_error_cost_s=found[1])


def hertz_of(solution: HertzSolution, load: float) -> HertzPoint[float] | None:
    """Closed form of a normal load, or None when the scene has none."""
    radius = solution.plan.scene.sphere_radius
    return None if radius is None or load <= 0.0 else hertz_sphere(load, radius, solution.modulus)


def shear_compliance(solution: HertzSolution) -> float:
    """C = (2 - nu1)/G1 + (2 - nu2)/G2 in 1/MPa."""
    m1, m2 = (solution.plan.scene.materials[b.name] for b in (solution.model.upper, solution.model.lower))
    return tangential_compliance_modulus(m1.E, m1.nu, m2.E, m2.nu)


def _thesis_error(load: float, name: str, reference: float | None) -> float | None:
    """Error of the thesis's printed value against the exact closed form; only for the thesis's own bodies."""
    printed = THESIS_HERTZ.get(load, {}).get(name)
    return None if printed is None or reference is None else printed * _THESIS_UNIT.get(name, 1.0) / reference - 1.0


def _is_thesis_scene(solution: HertzSolution) -> bool:
    scene = solution.plan.scene
    steel = all(m.E == 2.0e5 and m.nu == 0.3 for m in scene.materials.values())
    return steel and scene.sphere_radius == 5.0 and scene.geometry.get("block") == 10.0


def _of(hertz: HertzPoint[float] | None, name: str, factor: float = 1.0) -> float | None:
    return None if hertz is None else factor * float(getattr(hertz, name))


def _normal_rows(solution: HertzSolution, case: NormalCase) -> list[Result]:
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
    ours = _is_thesis_scene(solution)
    names = {
        "radius_moment": "radius",
        "radius_area": "radius",
        "radius_outermost": "radius",
        "contact_area": "area",
        "contact_area_nodes": "area",
    }
    rows = [
        Result(name, case.label, float(value), unit, reference, _HERTZ if reference else "",
            _thesis_error(case.load, names.get(name, name), reference) if ours else None)
        for name, value, unit, reference in table
    ]  # fmt: skip
    if case.shares:
        finite = sum(s.finite_body for s in case.shares.values())
        phi = {body: s.compression for body, s in case.shares.items()}
        contact = case.approach - finite
        rows += [
            Result("approach_contact", case.label, contact * UM, "um", _of(hertz, "approach", UM), _HERTZ),
            Result("approach_finite_body", case.label, finite * UM, "um"),
            *(Result(f"compression_3a_{body}", case.label, value * UM, "um") for body, value in phi.items()),
            Result("approach_within_3a", case.label, (case.approach - sum(phi.values())) * UM, "um"),
        ]
    return rows


def _stiffness_rows(solution: HertzSolution, case: NormalCase) -> list[Result]:
    scene = solution.plan.scene
    hertz = hertz_of(solution, case.load)
    if not scene.wants("stiffness") or case.load <= 0.0:
        return []
    rows = []
    body = sum(s.finite_body for s in case.shares.values()) / case.load
    secant = case.load / case.approach
    rows.append(Result("K_N_tangent_raw", case.label, case.stiffness, "N/mm", _of(hertz, "tangent_stiffness"), _HERTZ))
    rows.append(Result("K_N_secant_raw", case.label, secant, "N/mm", _of(hertz, "secant_stiffness"), _HERTZ))
    K_N = without_body(case.stiffness, body)
    if case.shares:
        rows.append(Result("K_N_tangent", case.label, K_N, "N/mm", _of(hertz, "tangent_stiffness"), _HERTZ))
        rows.append(Result("K_N_secant", case.label, without_body(secant, body), "N/mm", _of(hertz, "secant_stiffness"), _HERTZ))
    raw = solution.tangential_stiffness.get(case.load)
    if raw is None or hertz is None:
        return rows
    reference = mindlin.initial_tangential_stiffness(hertz.radius, shear_compliance(solution))
    rows.append(Result("K_T_initial_raw", case.label, raw, "N/mm", reference, _MINDLIN))
    shares = solution.tangential_shares.get(case.load)
    if shares:
        K_T = without_body(raw, sum(s.finite_body for s in shares.values()))
        rows.append(Result("K_T_initial", case.label, K_T, "N/mm", reference, _MINDLIN))
        rows.append(Result("K_T_over_K_N", case.label, K_T / K_N, "", reference / hertz.tangent_stiffness, "Mindlin"))
    return rows


def closed_form_traction(solution: HertzSolution, case: TangentialCase) -> Callable[[Array], Array] | None:
    """Cattaneo and Mindlin's traction in MPa over the distance from the centre in mm, or None."""
    hertz = hertz_of(solution, case.normal.load)
    if hertz is None or case.load <= 0.0:
        return None
    mu, N = solution.plan.scene.contact.friction, case.normal.load
    c = float(mindlin.stick_radius(case.load, mu, N, hertz.radius))
    return lambda r: mindlin.traction(r, hertz.radius, c, mu, N)


def _tangential_rows(solution: HertzSolution, case: TangentialCase) -> list[Result]:
    patch = solution.model.patch
    mu, N = solution.plan.scene.contact.friction, case.normal.load
    hertz = hertz_of(solution, N)
    area = patch.area()
    stick = float(np.sqrt(area[case.stick].sum() / np.pi))
    raw = float(np.ravel(case.solution.displacement)[0])
    stiffness = [Result("K_T_tangent_raw", case.label, case.stiffness, "N/mm")]
    if case.load > 0.0:
        stiffness.append(Result("K_T_secant_raw", case.label, case.load / raw, "N/mm"))
    if hertz is None:
        return [
            Result("stick_radius", case.label, stick * UM, "um"),
            Result("tangential_displacement_raw", case.label, raw * UM, "um"),
            *stiffness,
        ]
    C = shear_compliance(solution)
    c = float(mindlin.stick_radius(case.load, mu, N, hertz.radius))
    reference = float(mindlin.displacement(case.load, mu, N, hertz.radius, C)) * UM
    rows = [
        Result("stick_radius", case.label, stick * UM, "um", c * UM, _MINDLIN),
        Result("tangential_displacement_raw", case.label, raw * UM, "um", reference, _MINDLIN),
    ]
    shares = solution.tangential_shares.get(N)
    if shares:
        bodies = case.load * sum(s.finite_body for s in shares.values())
        rows.append(Result("tangential_displacement", case.label, (raw - bodies) * UM, "um", reference, _MINDLIN))
    closed = closed_form_traction(solution, case)
    if closed is not None:
        ours = case.traction[..., 0] if case.traction.ndim == 3 else case.traction
        theirs = consistent_average(patch, closed)
        limit = consistent_average(patch, lambda r: mu * hertz_pressure(r, hertz.radius, hertz.max_pressure))
        misfit = np.sqrt((area * (ours - theirs) ** 2).sum())
        for name, scale in (("traction_misfit_L2", theirs), ("traction_misfit_of_limit_L2", limit)):
            rows.append(Result(name, case.label, float(misfit / np.sqrt((area * scale**2).sum())), "", None, _MINDLIN))
    return rows + stiffness


def _cycle_rows(solution: HertzSolution, cycle: Cycle) -> list[Result]:
    mu, N = solution.plan.scene.contact.friction, cycle.normal.load
    hertz = hertz_of(solution, N)
    reference = None
    if hertz is not None:
        reference = float(mindlin.cycle_energy(cycle.ratio, mu, N, hertz.radius, shear_compliance(solution)))
    return [Result("cycle_energy", cycle.label, cycle.slip_work, "mJ", reference, "Mindlin-Deresiewicz")]
