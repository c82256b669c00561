"""Displacements inside the bodies, and what they show of a sphere on a plane: what each body adds
to the approach and to the tangential displacement, and the error of its mesh.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from upd.analyses.contact.bodies import pressed
from upd.analyses.contact.faces import lattices
from upd.analyses.contact.plan import ALONG, NORMAL
from upd.analyses.contact.solution import ContactSolution, NormalCase
from upd.contact.bulk import finite_body_share, half_space_mean
from upd.contact.model import Body
from upd.contact.stiffness import BodyShare, axis_half_space, axis_share
from upd.errors import MeshError

Array = NDArray[np.float64]

# Steps of a lattice are equal up to the rounding of a mesher.
_EVEN = 1e-6


def solve_inside(solution: ContactSolution) -> None:
    """Displacements inside the bodies under every normal load, with the shares of both bodies where
    they have an axis.
    """
    sphere = solution.plan.scene.sphere_radius is not None
    for case in solution.normal:
        frictionless = _displaced(solution, case, sphere)
        if sphere and case.force > 0.0:
            _normal_shares(solution, case, frictionless)
            if solution.plan.effect("friction"):
                _shear_shares(solution, case)
    for case in solution.curve if sphere else ():
        nodal = solution.model.nodal(case.solution.force)
        for body in (solution.model.upper, solution.model.lower):
            u = body.side * body.displacement(NORMAL, body.side * nodal)[:, 2]
            axis = body.mesh.nodes["axis"]
            depth = np.abs(body.mesh.points[axis, 2])
            case.compression[body.name] = float(
                np.interp(3.0 * case.measures.radius_moment, depth, u[axis])
            )


def _displaced(solution: ContactSolution, case: NormalCase, sphere: bool) -> dict[str, Array]:
    """Keep the displacements; those without friction, which go with the load, are returned."""
    model, copies = solution.model, solution.plan.copies
    forces = case.solution.force if case.state is None else case.state.force
    case.displacement, case.reaction = pressed(model, forces, copies)
    if case.state is None or not sphere:
        return case.displacement
    return pressed(model, case.solution.force, copies)[0]


def _normal_shares(
    solution: ContactSolution, case: NormalCase, displacement: Mapping[str, Array]
) -> None:
    model, radius = solution.model, case.measures.radius_moment
    (face,) = lattices(solution)
    force = face.field(case.solution.force, extensive=True)
    found = {
        body.name: _share(solution, body, displacement[body.name], force, radius, tangential=False)
        for body in (model.upper, model.lower)
    }
    shares = {name: share for name, share in found.items() if share is not None}
    if len(shares) == len(found):
        case.shares = shares
        case.mesh_error = _mesh_error(solution, case, displacement)


def _mesh_error(
    solution: ContactSolution, case: NormalCase, displacement: Mapping[str, Array]
) -> tuple[float, float] | None:
    """Error of the approach in mm by the mesh near the contact and far from it; None for a lattice
    that is not even.

    The approach is dU/dF of the energy U = min (f' C f / 2 + h' f), so an error dC of the
    compliance moves it by f' dC f / F to first order, whatever it does to the forces. The whole of
    it is the mean displacement of both bodies at the contact minus that of the half-spaces under
    the same pressures and of the finite bodies' share; the far part shows along the axis, and the
    near part is the rest. The near part is counted in full: it goes with (h / a)^2 and a with
    F^(1/3), so that half of it reaches dU/dF.
    """
    model, patch = solution.model, solution.model.patch
    if patch.quads is not None:
        return None
    steps = [np.diff(lines) for lines in (patch.X, patch.Y)]
    if max(float(np.ptp(step) / step.mean()) for step in steps) > _EVEN:
        return None
    nodal = model.nodal(case.solution.force)
    force = patch.whole(case.solution.force, extensive=True)
    whole = far = 0.0
    for body in (model.upper, model.lower):
        u, share = displacement[body.name], case.shares[body.name]
        data = solution.plan.scene.materials[body.name]
        mean = body.side * float(nodal @ u[body.contact, 2]) / float(nodal.sum())
        whole += mean - share.finite_body - half_space_mean(patch, force, data.E, data.nu)
        far += share.far_mesh
    return whole - far, far


def _share(
    solution: ContactSolution,
    body: Body,
    displacement: Array,
    force: Array,
    radius: float,
    *,
    tangential: bool,
) -> BodyShare | None:
    along = displacement[:, ALONG] if tangential else body.side * displacement[:, NORMAL]
    axis = body.mesh.nodes["axis"]
    depth = np.abs(body.mesh.points[axis, 2])
    patch = solution.model.patch
    data = solution.plan.scene.materials[body.name]
    inside = depth > 0.5 * radius
    half_space = np.zeros(len(depth))
    half_space[inside] = axis_half_space(
        depth[inside],
        patch.points(),
        force.ravel(),
        data.E,
        data.nu,
        tangential=tangential,
    )
    try:
        compression, fitted = axis_share(depth, along[axis], half_space, radius)
        finite = finite_body_share(
            body, displacement, force, patch, radius, data.E, data.nu, tangential=tangential
        )
    except MeshError as error:
        # The numbers with the bulk compliance removed are left out, the others stand.
        solution.no_shares = f"{body.name}: {error}"
        return None
    return BodyShare(compression, finite, fitted)


def _shear_shares(solution: ContactSolution, case: NormalCase) -> None:
    """Shear of both bodies per N, from full slip t = mu f: their far field knows the total force
    only.
    """
    model, radius = solution.model, case.measures.radius_moment
    forces = solution.plan.scene.contact.friction * case.solution.force
    whole = model.patch.whole(forces, extensive=True)
    total, nodal = float(whole.sum()), model.nodal(forces)
    shares = {}
    for body in (model.upper, model.lower):
        u = body.displacement(ALONG, nodal)
        share = _share(solution, body, u, whole, radius, tangential=True)
        if share is not None:
            shares[body.name] = share.over(total)
    if len(shares) == 2:
        case.shear_shares = shares
