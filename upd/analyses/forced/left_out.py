"""Effects that a forced response leaves out, solved again with them: sliding along the damper, and
the damper's own elasticity.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import eigh, qr
from scipy.spatial import cKDTree

from upd.analyses.base import Resolved
from upd.analyses.forced.blade_parts import MIRROR_SIGNS
from upd.analyses.forced.linear_limits import stuck_frequency
from upd.analyses.forced.measures import StuckMode, tell_modes
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.plan import ELASTIC, ForcedPlan
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.seated.bodies import Bodies
from upd.fem import Material, mass, rigid_body_modes, stiffness
from upd.hbm.springs.points import stuck_stiffness
from upd.linalg import factorise
from upd.linalg.symmetric import Symmetric
from upd.mesh import IntArray
from upd.results import Case
from upd.scene.forced_contact import SIDES


def elastic_changes(solution: ForcedSolution, name: str) -> list[Resolved]:
    """Stuck frequencies with the damper's elasticity in series with the contact springs."""
    out, model = [], solution.models[name]
    assert solution.bodies is not None
    rigid = solution.linear[name].modes
    elastic = elastic_stuck(solution.plan, solution.bodies, model)
    for in_phase, quantity in ((True, "stuck_in_phase"), (False, "stuck_out_of_phase")):
        before, after = (stuck_frequency(modes, in_phase) for modes in (rigid, elastic))
        if math.isfinite(before):
            remedy = (
                "the rigid damper is too stiff for these springs, unless they hold its elasticity "
                "already: compare with a contact analysis of the damper"
            )
            case = Case(stiffness=name)
            out.append(Resolved(ELASTIC, quantity, case, before, after, "Hz", remedy))
    return out


# -- the elastic damper ----------------------------------------------------------------------------


def elastic_stuck(plan: ForcedPlan, bodies: Bodies, model: Model) -> list[StuckMode]:
    """Stuck modes with the damper's elastic compliance in series with the contact springs.

    The damper floats: its rigid motion keeps its inertia, and its deformation follows
    quasi-statically from self-equilibrated contact forces (inertia relief), G = B P' K^+ P B' with
    P = I - M R (R' M R)^-1 R'. The force of stuck points per rigid relative displacement is then
    (k^-1 + G)^-1 in place of k.

    Returns
    -------
    list of StuckMode
        Up to twice the end of the sweep.

    References
    ----------
    .. [1] R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., 17.5 (inertia
           relief).
    """
    M, _, K, B = model.linear(stuck=False)
    k = stuck_stiffness(model.contacts).ravel()
    G = elastic_compliance(plan, bodies, model)
    # (k^-1 + G)^-1, also where k = 0
    joint = np.linalg.solve(np.eye(len(k)) + k[:, None] * G, np.diag(k))
    values, shapes = eigh(K + B.T @ joint @ B, M)
    return tell_modes(model, values, shapes, 2.0 * plan.scene.excitation.stop)


def elastic_compliance(plan: ForcedPlan, bodies: Bodies, model: Model) -> Array:
    """Elastic compliance of the free damper at its contact rows, mm/N.

    Returns
    -------
    Array
        (n, n), n = n_point (1 + tangents), point by point; symmetric, positive semidefinite.
    """
    mesh, m = bodies.damper_mesh, plan.scene.material
    material = Material(m.E, m.nu, plan.scene.damper.density or m.density)
    K = stiffness(mesh, material, plan.scene.mesh.element)
    M = mass(mesh, material)
    B = _rows(bodies, model, mesh.n_node)
    R = rigid_body_modes(mesh.points)
    MR = M @ R
    inertia = np.linalg.inv(R.T @ MR)
    loads = B.T - MR @ (inertia @ (R.T @ B.T))
    # six dofs that hold it: the ones its rigid motions move most independently
    held = qr(R.T, mode="r", pivoting=True)[1][:6]
    free = np.setdiff1d(np.arange(3 * mesh.n_node), held)
    u = np.zeros_like(loads)
    factor = factorise(
        Symmetric.of(K).submatrix(free.astype(np.int64)), solver=plan.scene.solver.name
    )
    u[free] = factor.solve(loads[free])
    u -= R @ (inertia @ (MR.T @ u))
    G = B @ u
    return np.asarray(0.5 * (G + G.T))


def _rows(bodies: Bodies, model: Model, n_node: int) -> Array:
    """Displacement of the damper's contact points along their normals and tangents.

    (n, 3 n_node) of its nodal displacements; a point that stands for a pair moves as the even part
    of both.
    """
    mesh, out = bodies.damper_mesh, []
    tree = cKDTree(mesh.points)
    components = [0, 1, 2] if model.contacts.tangents == 2 else [0, 2]
    for side in SIDES:
        face, blade = model.faces[side], bodies.blades[side].mesh
        # the k-th nodes of both patches lie on each other
        own = dict(zip(blade.nodes["patch"], mesh.nodes[f"{side}_patch"], strict=True))
        nodes = np.array([own[node] for node in face.nodes])
        rows = _at(face.values, face.frame, nodes, n_node)
        if model.halved:
            image = tree.query(mesh.points[nodes] * np.array([1.0, -1.0, 1.0]))[1]
            mirrored = _at(face.values, face.frame, np.asarray(image), n_node)
            rows = 0.5 * (rows + MIRROR_SIGNS[:, None] * mirrored)
        out.append(rows[:, components])
    joined = np.concatenate(out)
    return np.asarray(joined.reshape(-1, joined.shape[-1]))


def _at(values: Array, frame: Array, nodes: IntArray, n_node: int) -> Array:
    """(m, 3, 3 n_node) rows of points with shape functions ``values`` (m, k) at ``nodes``."""
    rows = np.zeros((len(values), 3, n_node, 3))
    rows[:, :, nodes] = np.einsum("mk,fc->mfkc", values, frame)
    return np.asarray(rows.reshape(len(values), 3, -1))
