"""What a run of a curved contact leaves behind.

Arrays with their closed forms, meshes with fields.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from upd.analyses.contact.coupled import CoupledState
from upd.analyses.contact.loading import LoadPath
from upd.analyses.contact.output import (
    XY,
    Variables,
    curve_group,
    lattice,
    normal_fields,
    path_group,
    tangential_fields,
    write_meshes,
)
from upd.analyses.contact.solution import HertzNormalCase, HertzSolution, HertzTangentialCase
from upd.analyses.hertz.results import (
    beyond_3a,
    closed_form_traction,
    hertz_of,
    shear_compliance,
    stick_radius,
)
from upd.labels import file_name
from upd.reference import hertz_pressure, mindlin
from upd.results import ArrayGroup, variable

# Points of a closed form: across a contact (its ends are steep), along a curve.
_ACROSS, _ALONG = 801, 201
# How far beyond the contact radius tractions are drawn.
_BEYOND = 1.3


def sizes(solution: HertzSolution) -> dict[str, int]:
    """Contact pairs of the model and of the whole patch."""
    patch = solution.model.patch
    return {"n_pairs": len(solution.model.gap), "n_pairs_whole_patch": len(patch.X) * len(patch.Y)}


def arrays(solution: HertzSolution) -> dict[str, ArrayGroup]:
    """Fields of every case with their closed forms, on the whole patch."""
    patch = solution.model.patch
    lines = lattice(patch.X, patch.Y)
    out: dict[str, ArrayGroup] = {}
    for case in solution.normal:
        fields = normal_fields(case.pressure, case.force, case.gap, case.force > 0.0)
        if case.state is not None:
            fields |= _sheared_by_pressure(solution, case, case.state)
        variables = lines | fields | _approach_split(case) | _hertz(solution, case)
        out[case.case.label] = ArrayGroup(variables, content="normal", case=case.case)
    for t in solution.tangential:
        variables = lines | tangential_fields(t.traction, t.slip, t.stick) | _cattaneo(solution, t)
        if t.state is not None:
            # which coupled contact moves
            variables["pressure"] = variable(XY, t.pressure, "MPa")
        out[t.case.label] = ArrayGroup(variables, content="tangential", case=t.case)
    for cycle in solution.cycles:
        name, group = path_group(cycle)
        group.update(_deresiewicz(solution, cycle))
        out[name] = group
    if solution.curve:
        out["force-approach"] = _curve(solution)
    return out


def _sheared_by_pressure(
    solution: HertzSolution, case: HertzNormalCase, state: CoupledState
) -> Variables:
    """Traction, slip and stick without a tangential load, where they are solved at once."""
    patch, on = solution.model.patch, case.solution.contact
    pressure = solution.model.multipliers.pressure
    traction = np.stack([patch.whole(pressure(c, on)) for c in state.force[:, 1:].T], -1)
    slip = np.stack([patch.whole(c) for c in state.found.slip[-1].T], -1)
    sticks = patch.whole(state.stick.astype(float)) > 0.0
    return tangential_fields(traction, slip, sticks)


def _approach_split(case: HertzNormalCase) -> Variables:
    """The approach, what the bodies add to it, and what of it lies beyond depth 3a in each."""
    out: Variables = {"approach": variable("", case.approach, "mm")}
    if case.shares:
        out["finite_body"] = variable(
            "", case.finite_body, "mm", "approach of the finite, held bodies"
        )
        for body, share in case.shares.items():
            out[f"compression_{file_name(body)}"] = variable(
                "", share.compression, "mm", "approach beyond depth 3a", body=body
            )
    return out


def _hertz(solution: HertzSolution, case: HertzNormalCase) -> Variables:
    hertz = hertz_of(solution, case.load)
    if hertz is None:
        return {}
    x = np.linspace(-hertz.radius, hertz.radius, _ACROSS)
    return {
        "hertz_radius": variable("", hertz.radius, "mm"),
        "hertz_approach": variable("", hertz.approach, "mm"),
        "hertz_max_pressure": variable("", hertz.max_pressure, "MPa"),
        "hertz_x": variable("hertz_x", x, "mm"),
        "hertz_pressure": variable(
            "hertz_x", hertz_pressure(np.abs(x), hertz.radius, hertz.max_pressure), "MPa"
        ),
    }


def _cattaneo(solution: HertzSolution, t: HertzTangentialCase) -> Variables:
    hertz, c = hertz_of(solution, t.normal.load), stick_radius(solution, t)
    if hertz is None or c is None:
        return {}
    out: Variables = {
        "hertz_radius": variable("", hertz.radius, "mm"),
        "mindlin_stick_radius": variable("", c, "mm"),
    }
    closed = closed_form_traction(solution, t)
    if closed is not None:
        x = np.linspace(-_BEYOND * hertz.radius, _BEYOND * hertz.radius, _ACROSS)
        out["mindlin_x"] = variable("mindlin_x", x, "mm")
        out["mindlin_traction"] = variable("mindlin_x", closed(np.abs(x)), "MPa")
    return out


def _deresiewicz(solution: HertzSolution, cycle: LoadPath) -> Variables:
    """The closed loop +T* -> -T* -> +T*, and the bodies' share of the displacement."""
    normal = next(case for case in solution.normal if case.case == cycle.normal)
    out: Variables = {}
    if normal.shear_shares:
        out["finite_body_compliance"] = variable(
            "", normal.finite_body_shear, "mm/N", "shear of the finite, held bodies"
        )
    hertz, ratio, mu = (
        hertz_of(solution, normal.load),
        cycle.case.ratio,
        solution.plan.scene.contact.friction,
    )
    if hertz is None or ratio is None:
        return out
    peak = ratio * mu * normal.load
    T = np.linspace(peak, -peak, _ALONG)
    d = mindlin.unloading(T, peak, mu, normal.load, hertz.radius, shear_compliance(solution))
    # Reloading is unloading seen from the other side.
    out["mindlin_displacement"] = variable("mindlin_step", np.concatenate([d, -d]), "mm")
    out["mindlin_force"] = variable("mindlin_step", np.concatenate([T, -T]), "N")
    return out


def _curve(solution: HertzSolution) -> ArrayGroup:
    d, F = np.array(solution.curve).T
    group = curve_group(d, F)
    split = [case for case in solution.normal if case.shares]
    if split:
        # What the bodies add goes with the load.
        group["approach_contact"] = variable(
            "point", d - split[-1].finite_body / split[-1].load * F, "mm"
        )
    group.update(_along(solution))
    force = np.linspace(0.0, float(F[-1]), _ALONG)
    hertz = [hertz_of(solution, float(load)) for load in force[1:]]
    if all(h is not None for h in hertz):
        for name, unit in (("area", "mm2"), ("max_pressure", "MPa")):
            closed = np.array([0.0, *(getattr(h, name) for h in hertz if h)])
            group[f"hertz_{name}"] = variable("hertz_point", closed, unit)
        group["hertz_normal_force"] = variable("hertz_point", force, "N")
        group["hertz_approach"] = variable(
            "hertz_point", [0.0, *(h.approach for h in hertz if h)], "mm"
        )
    return group


def _along(solution: HertzSolution) -> Variables:
    """Contact area, largest pressure and each body's compression at the loaded points."""
    points = solution.along
    if not points:
        return {}
    dims = "loaded_point"
    out: Variables = {
        "load": variable(dims, [p.load for p in points], "N"),
        "contact_area": variable(dims, [p.measures.area for p in points], "mm2"),
        "max_pressure": variable(dims, [p.measures.max_pressure for p in points], "MPa"),
        "loaded_approach": variable(dims, [p.approach for p in points], "mm"),
    }
    closed = [beyond_3a(solution, p.load) for p in points]
    for body in points[0].compression:
        name = f"compression_{file_name(body)}"
        beyond = [p.compression[body] for p in points]
        words = "approach beyond depth 3a"
        out[name] = variable(dims, beyond, "mm", words, body=body)
        if all(closed):
            out[f"hertz_{name}"] = variable(dims, [c[body] for c in closed], "mm")
    return out


def write_files(solution: HertzSolution, folder: Path) -> None:
    """The mesh, and the fields when asked for."""
    cases = (
        [(f"{c.load:g}N", c.solution.force, c.displacement) for c in solution.normal]
        if solution.plan.scene.wants("fields")
        else []
    )
    write_meshes(solution.model, folder, cases)
