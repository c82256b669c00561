"""What a run of a contact leaves behind: arrays with their closed forms, contact points of a
dynamic model, meshes with fields.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.results import contact_law
from upd.analyses.contact.solution import (
    ContactSolution,
    LoadPath,
    NormalCase,
    TangentialCase,
)
from upd.contact.patch import Patch
from upd.mesh import recipes
from upd.reference import mindlin
from upd.results import Group, variable

Array = NDArray[np.float64]
Variables = dict[str, Any]
# Points of a closed form: across a contact (its ends are steep), along a curve.
_ACROSS, _ALONG = 801, 201
# How far beyond the contact radius tractions are drawn.
_BEYOND = 1.3


def arrays(solution: ContactSolution) -> dict[str, Group]:
    """Fields of every case and patch with their closed forms; curves, paths and contact points."""
    out: dict[str, Group] = {}
    patches, (x, y) = solution.lattices, solution.corner
    for patch, k in patches.items():
        face: dict[str, str] = {"patch": patch} if len(patches) > 1 else {}
        # Without a lattice every node has its own x and y.
        own = ("x", "y") if k.quads is None else ("node", "node")
        lines = {"x": variable(own[0], k.X - x, "mm"), "y": variable(own[1], k.Y - y, "mm")}
        cases = [("normal", c.case, _normal(solution, k, c)) for c in solution.normal]
        cases += [("tangential", t.case, _tangential(solution, k, t)) for t in solution.tangential]
        for content, case, fields in cases:
            name = case.label + f" {patch}" * bool(face)
            out[name] = Group(lines | fields, content=content, case=case, **face)
    for path in solution.paths:
        content = "cycle" if path.cycle else "path"
        gross = solution.plan.scene.contact.friction * (path.case.load or 0.0)
        limit = {"friction_limit": variable("", gross, "N")}
        variables = {
            "displacement": variable("step", path.displacement, "mm"),
            "tangential_force": variable("step", path.load, "N"),
            **(_deresiewicz(solution, path) if solution.curved else limit),
        }
        out[f"{content} {path.case.label}"] = Group(variables, content=content, case=path.case)
    if solution.curve:
        out["force-approach"] = Group(_curve(solution), content="force-approach")
    return out | _laws(solution)


def _dims(k: Patch) -> str:
    return "x y" if k.quads is None else "node"


def _normal(solution: ContactSolution, k: Patch, case: NormalCase) -> Variables:
    """Fields under a normal load, (n_x, n_y) in MPa, N and mm."""
    on, pressure, XY = case.solution.contact, solution.model.multipliers.pressure, _dims(k)
    out: Variables = {
        "pressure": variable(XY, k.whole(pressure(case.solution.force)), "MPa"),
        "normal_force": variable(XY, k.whole(case.solution.force, extensive=True), "N"),
        "gap": variable(XY, k.whole(case.solution.gap), "mm"),
        "contact": variable(XY, k.whole(on) > 0.0, flag_meanings="open contact"),
    }
    if case.coupled is not None:
        traction = [pressure(c, on) for c in case.coupled.force[-1, :, 1:].T]
        out |= _sheared(k, traction, list(case.coupled.slip[-1].T), case.stick)
    if hertz := solution.hertz_of(case.force):
        out["hertz_radius"] = variable("", hertz.radius, "mm")
        out["hertz_max_pressure"] = variable("", hertz.max_pressure, "MPa")
    return out


def _sheared(
    k: Patch, traction: Sequence[Array], slip: Sequence[Array], stick: NDArray[np.bool_]
) -> Variables:
    """Fields under a tangential load, (n_x, n_y, n_direction) in MPa and mm."""
    XY = _dims(k)
    dims = f"{XY} direction"
    return {
        "traction": variable(dims, np.stack([k.whole(c) for c in traction], -1), "MPa"),
        "slip": variable(dims, np.stack([k.whole(c) for c in slip], -1), "mm"),
        "stick": variable(XY, k.whole(stick) > 0.0, flag_meanings="slip_or_open stick"),
    }


def _tangential(solution: ContactSolution, k: Patch, t: TangentialCase) -> Variables:
    out = _sheared(k, solution.tractions(t), list(t.slip.T), t.stick)
    if t.coupled is not None:
        # which coupled contact moves
        pressure = solution.model.multipliers.pressure(np.maximum(t.pressed, 0.0))
        out["pressure"] = variable(_dims(k), k.whole(pressure), "MPa")
    hertz, c = solution.hertz_of(t.normal.force), solution.stick_radius(t)
    if hertz is not None and c is not None:
        out["hertz_radius"] = variable("", hertz.radius, "mm")
        out["mindlin_stick_radius"] = variable("", c, "mm")
    closed = solution.closed_form_traction(t)
    if hertz is not None and closed is not None:
        x = np.linspace(-_BEYOND * hertz.radius, _BEYOND * hertz.radius, _ACROSS)
        out["mindlin_x"] = variable("mindlin_x", x, "mm")
        out["mindlin_traction"] = variable("mindlin_x", closed(np.abs(x)), "MPa")
    return out


# -- closed forms ----------------------------------------------------------------------------------


def _deresiewicz(solution: ContactSolution, cycle: LoadPath) -> Variables:
    """The closed loop +T* -> -T* -> +T*, and the bodies' share of the displacement."""
    normal = next(case for case in solution.normal if case.force == cycle.case.load)
    out: Variables = {}
    if normal.shear_shares:
        out["finite_body_compliance"] = variable(
            "", normal.finite_body_shear, "mm/N", "shear of the finite, held bodies"
        )
    hertz, ratio = solution.hertz_of(normal.force), cycle.case.ratio
    if hertz is None or ratio is None:
        return out
    mu, C = solution.plan.scene.contact.friction, solution.shear_compliance()
    peak = ratio * mu * normal.force
    T = np.linspace(peak, -peak, _ALONG)
    d = mindlin.unloading(T, peak, mu, normal.force, hertz.radius, C)
    # Reloading is unloading seen from the other side.
    out["mindlin_displacement"] = variable("mindlin_step", np.concatenate([d, -d]), "mm")
    out["mindlin_force"] = variable("mindlin_step", np.concatenate([T, -T]), "N")
    return out


# -- force over approach ---------------------------------------------------------------------------


def _curve(solution: ContactSolution) -> Variables:
    """Force over approach in mm and N."""
    F, d = (np.array(values) for values in zip(*solution.curve, strict=True))
    # It starts where the faces meet.
    d, F = np.insert(d, 0, solution.model.gap.min()), np.insert(F, 0, 0.0)
    out = {"approach": variable("point", d, "mm"), "normal_force": variable("point", F, "N")}
    split = [case for case in solution.normal if case.shares]
    if split:
        # What the bodies add goes with the load.
        bodies = split[-1].finite_body / split[-1].force * F
        out["approach_contact"] = variable("point", d - bodies, "mm")
    force = np.linspace(0.0, float(F[-1]), _ALONG)
    hertz = [h for load in force[1:] if (h := solution.hertz_of(float(load))) is not None]
    if hertz:
        out["hertz_normal_force"] = variable("hertz_point", force, "N")
        closed = np.array([0.0, *(h.approach for h in hertz)])
        out["hertz_approach"] = variable("hertz_point", closed, "mm")
    return out


# -- of flat faces ---------------------------------------------------------------------------------


def _laws(solution: ContactSolution) -> dict[str, Group]:
    """The contact law of every normal load, in contact axes and, where the recipe tells the place,
    in the rig's.
    """
    scene = solution.plan.scene
    out: dict[str, Group] = {}
    for case in solution.normal if scene.wants("contact_law") else ():
        law = contact_law(solution, case)
        if law is not None:
            placed = law.placed(*recipes.placement(scene.recipe, solution.plan.parameters))
            at = law.position[:, :2] - solution.corner
            places = {
                f"report_{axis}": variable("contact_point", at[:, k], "mm")
                for k, axis in enumerate("xy")
            }
            groups: dict[str, Variables] = {
                "contact law": dict(law.to_arrays()) | places,
                "contact law in the rig": dict(placed.to_arrays()),
            }
            for content, variables in groups.items():
                name = f"{content} {case.case.label}"
                out[name] = Group(variables, content=content, case=case.case)
    return out


# -- meshes ----------------------------------------------------------------------------------------


def write_files(solution: ContactSolution, folder: Path) -> None:
    """Write mesh.vtu, and fields.vtu when asked for."""
    # meshio is slow to import: only when files are wanted.
    from upd.mesh.export import write_fields, write_mesh

    model, multipliers = solution.model, solution.model.multipliers
    bodies = (model.upper, model.lower)
    meshes = {b.name: b.mesh for b in bodies}
    write_mesh(meshes, folder / "mesh.vtu")
    cases = {f"{c.force:.6g}N": c for c in solution.normal}
    if not solution.plan.scene.wants("fields") or not cases:
        return
    data: dict[str, dict[str, Array]] = {}
    for body in bodies:
        fields = data[body.name] = {}
        for label, case in cases.items():
            if body.name in case.displacement:
                fields[f"displacement_{label}"] = case.displacement[body.name]
        for label, case in cases.items():
            pressure = np.zeros(body.mesh.n_node)
            pressure[body.contact[multipliers.nodes]] = multipliers.pressure(case.solution.force)
            fields[f"pressure_{label}"] = pressure
    write_fields(folder / "fields.vtu", meshes, data)
