"""What a run of a flat contact leaves behind: arrays, the contact law, meshes with fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

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
from upd.analyses.contact.solution import FlatNormalCase, FlatSolution, FlatTangentialCase
from upd.analyses.flat.maps import FaceLattice, contact_law, corner, lattices, whole_area
from upd.analyses.flat.results import band_middles, printed_of
from upd.contact.law import ContactLaw
from upd.mesh import recipes
from upd.results import ArrayGroup, Case, variable


def sizes(solution: FlatSolution) -> dict[str, int]:
    """Contact pairs of the model and of all patches, mirror images included."""
    return {
        "n_pairs": len(solution.model.gap),
        "n_pairs_whole_patch": sum(len(k.X) * len(k.Y) for k in lattices(solution)),
    }


def arrays(solution: FlatSolution) -> dict[str, ArrayGroup]:
    """Fields of every case and patch, x and y in report axes; curves, paths and contact points."""
    out: dict[str, ArrayGroup] = {}
    patches = lattices(solution)
    for k in patches:
        face: dict[str, str] = {"patch": k.name} if len(patches) > 1 else {}
        name = f" {k.name}" * bool(face)
        for case in solution.normal:
            variables = _axes(solution, k) | _normal(solution, k, case)
            out[case.case.label + name] = ArrayGroup(
                variables, content="normal", case=case.case, **face
            )
        for t in solution.tangential:
            variables = _axes(solution, k) | _tangential(solution, k, t)
            out[t.case.label + name] = ArrayGroup(
                variables, content="tangential", case=t.case, **face
            )
    for path in solution.paths:
        title, group = path_group(path)
        group["friction_limit"] = variable(
            "", solution.plan.scene.contact.friction * (path.normal.load or 0.0), "N"
        )
        group.update(_printed(solution, f"K_T{path.case.direction}", "_initial_raw", path.case))
        out[title] = group
    if solution.curve:
        out["force-approach"] = _curve(solution)
    return out | _laws(solution)


def _axes(solution: FlatSolution, k: FaceLattice) -> Variables:
    x, y = corner(solution)
    return lattice(k.X - x, k.Y - y)


def _normal(solution: FlatSolution, k: FaceLattice, case: FlatNormalCase) -> Variables:
    force, model = k.field(case.solution.force, extensive=True), solution.model
    out = normal_fields(
        k.field(model.multipliers.pressure(case.solution.force)),
        force,
        k.field(case.solution.gap),
        k.field(case.solution.contact) > 0.0,
    )
    if case.state is not None:
        on, pressure = case.solution.contact, model.multipliers.pressure
        traction = np.stack([k.field(pressure(c, on)) for c in case.state.force[:, 1:].T], -1)
        slip = np.stack([k.field(c) for c in case.state.found.slip[-1].T], -1)
        out |= tangential_fields(traction, slip, k.field(case.stick) > 0.0)
    out["worn_zone_middle"] = variable(
        "worn_zone",
        band_middles(solution),
        "mm",
        "middle of the bands of the damper that the load comes from",
    )
    upper = case.displacement.get(model.upper.name)
    if upper is not None:
        # How far the contact nodes stay behind the distant set.
        u = model.multipliers.spread.T @ upper[model.upper.contact, 2]
        out["surface_displacement"] = variable("x y", k.field(u), "mm", body=model.upper.name)
    return out


def _tangential(solution: FlatSolution, k: FaceLattice, t: FlatTangentialCase) -> Variables:
    loaded, pressure = t.pressed > 0.0, solution.model.multipliers.pressure
    traction = np.stack([k.field(pressure(c, loaded)) for c in t.force.T], -1)
    slip = np.stack([k.field(c) for c in t.slip.T], -1)
    out = tangential_fields(traction, slip, k.field(t.stick) > 0.0)
    if t.state is not None:
        # which coupled contact moves
        out["pressure"] = variable(XY, k.field(pressure(np.maximum(t.pressed, 0.0))), "MPa")
    return out


def _curve(solution: FlatSolution) -> ArrayGroup:
    """Force over approach with the pressure over force, the computed stiffness and the printed
    one.
    """
    pressure = solution.model.multipliers.pressure
    answers = [s for _, s in solution.curve]
    group = curve_group([s.approach for s in answers], [F for F, _ in solution.curve])
    highest = [float(pressure(s.force).max()) for s in answers]
    mean = [F / whole_area(solution, s).area for F, s in solution.curve]
    group["max_pressure"] = variable("point", highest, "MPa")
    group["mean_pressure"] = variable("point", mean, "MPa")
    group["stiffness"] = variable("", solution.normal[0].stiffness, "N/mm")
    group.update(_printed(solution, "K_N", "_tangent_raw", solution.normal[0].case))
    return group


def _printed(solution: FlatSolution, name: str, total: str, case: Case) -> Variables:
    """The printed stiffness of the whole contact, where one is; one printed of a pad goes with all
    of them.
    """
    look_up = printed_of(solution.plan.scene)
    whole, pad = (look_up(name + suffix, case.given()) for suffix in (total, "_per_pad"))
    if whole:
        return {"printed_stiffness": variable("", whole[0].value, "N/mm", source=whole[0].source)}
    if pad:
        n = len(lattices(solution))
        source = f"{pad[0].source}, {n} pads"
        return {"printed_stiffness": variable("", n * pad[0].value, "N/mm", source=source)}
    return {}


def _laws(solution: FlatSolution) -> dict[str, ArrayGroup]:
    """The contact law of every normal load, in contact axes and, where the recipe tells the place,
    in the rig's.
    """
    scene = solution.plan.scene
    if not scene.wants("contact_law"):
        return {}
    out: dict[str, ArrayGroup] = {}
    for case in solution.normal:
        law = contact_law(solution, case)
        if law is not None:
            placed = law.placed(*recipes.placement(scene.recipe, solution.plan.parameters))
            out[f"contact law {case.case.label}"] = _law_group(
                law, "contact law", case.case, _report_places(solution, law)
            )
            out[f"contact law in the rig {case.case.label}"] = _law_group(
                placed, "contact law in the rig", case.case
            )
    return out


def _law_group(
    law: ContactLaw, content: str, case: Case, more: Variables | None = None
) -> ArrayGroup:
    return ArrayGroup({**law.to_arrays(), **(more or {})}, content=content, case=case)


def _report_places(solution: FlatSolution, law: ContactLaw) -> dict[str, Any]:
    """Places of the contact points in report axes, mm."""
    places = law.position[:, :2] - corner(solution)
    return {
        f"report_{axis}": variable("contact_point", places[:, k], "mm")
        for k, axis in enumerate("xy")
    }


def write_files(solution: FlatSolution, folder: Path) -> None:
    """The mesh, and the fields when asked for."""
    cases = (
        [(f"{c.force:.6g}N", c.solution.force, c.displacement) for c in solution.normal]
        if solution.plan.scene.wants("fields")
        else []
    )
    write_meshes(solution.model, folder, cases)
