"""The damper between both blades, elastic and with friction: what F_C makes of it.

Every matching node of both faces, Signorini's and Coulomb's conditions, no springs. The blades are
condensed on their patches; the damper, which only its contacts hold, deforms by inertia relief (F_C
acts on its mass) and keeps its six rigid motions as unknowns beside their equilibrium.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.linalg import qr

from upd.analyses.forced.model import SIDES, Array, Blade, Bodies
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.points import lattice, patch_frame
from upd.contact import CoupledContact, CoupledHistory, coupled_contact
from upd.errors import InputError
from upd.fem import Material, mass, stiffness
from upd.linalg import factorise
from upd.linalg.parallel import in_parallel
from upd.linalg.symmetric import Symmetric
from upd.mesh import IntArray, Mesh
from upd.reduction import condense


@dataclass(frozen=True)
class Interface:
    """Both faces of the damper as one contact.

    n nodes, those of the left face first; forces and displacements are laid out by component:
    normal (from the damper into the blade), along the damper, up the slope, of all nodes each.

    Attributes
    ----------
    compliance : (3 n, 3 n) ndarray
        Blades and damper together, mm/N.
    columns : (3 n, 6) ndarray
        Displacement of the nodes by the damper's translations and its rotations about its centre
        of mass.
    face : (n,) array of int
        Index into SIDES.
    position : (n, 3) ndarray
        mm.
    area : (n,) ndarray
        Tributary area, mm2.
    """

    compliance: Array
    columns: Array
    face: IntArray
    position: Array
    area: Array

    @property
    def n(self) -> int:
        """Nodes of both faces."""
        return len(self.face)

    def seat(
        self,
        friction: float,
        centrifugal: Sequence[float],
        *,
        gap: Array | None = None,
        history: CoupledHistory | None = None,
    ) -> CoupledContact:
        """Raise and lower F_C.

        Parameters
        ----------
        friction
            Coefficient.
        centrifugal
            F_C after each step, N.
        gap
            (n,) mm before any load; None: the faces fit.
        history
            Of a seating before.

        Returns
        -------
        CoupledContact
            Its `displacement` holds translations in mm and rotations in rad of the damper.

        Raises
        ------
        InputError, ConvergenceError
            As `upd.contact.coupled_contact`.
        """
        if np.ndim(centrifugal) != 1:
            raise InputError("centrifugal: give F_C after each step, in one dimension")
        load = np.zeros((len(centrifugal), 6))
        load[:, 2] = centrifugal
        none = np.zeros(self.n)
        return coupled_contact(
            self.compliance,
            none if gap is None else gap,
            friction,
            load=load,
            columns=self.columns,
            history=history,
        )

    def face_forces(self, found: CoupledContact) -> Array:
        """(k, 2, 3) N of each step and face: normal, along the damper, up the slope."""
        return np.stack(
            [found.force[:, self.face == k].sum(axis=1) for k in range(len(SIDES))], axis=1
        )


def make_interface(plan: ForcedPlan, bodies: Bodies) -> Interface:
    """The contact of both faces from a rig's bodies.

    Raises
    ------
    InputError
        For elements whose faces have more than four nodes, whose nodal forces are no pressures.
    """
    for side in SIDES:
        if bodies.blades[side].mesh.faces["patch"].shape[1] != 4:
            raise InputError(
                f"mesh.element: the seated damper needs faces of four nodes, not those of "
                f'{plan.scene.mesh.element}; set mesh.element = "hex8i"'
            )
    blades = [bodies.blades[side] for side in SIDES]
    nodes = [lattice(blade.mesh) for blade in blades]
    sizes = [len(one.nodes) for one in nodes]
    n = sum(sizes)
    face = np.repeat(np.arange(len(SIDES)), sizes)
    C = np.zeros((3, n, 3, n))
    found = in_parallel(
        [
            partial(_blade_compliance, blade, one.nodes, plan.scene.solver.name)
            for blade, one in zip(blades, nodes, strict=True)
        ],
        plan.workers,
    )
    for k, part in enumerate(found):
        on = np.flatnonzero(face == k)
        C[:, on[:, None], :, on[None, :]] += part.transpose(1, 3, 0, 2)
    own, columns = _damper(plan, bodies, [one.nodes for one in nodes])
    total = C.reshape(3 * n, 3 * n) + own
    return Interface(
        0.5 * (total + total.T),
        columns,
        face,
        np.vstack([b.mesh.points[one.nodes] for b, one in zip(blades, nodes, strict=True)]),
        np.concatenate([one.area for one in nodes]),
    )


def _blade_compliance(blade: Blade, nodes: IntArray, solver: str) -> Array:
    """(3, m, 3, m) compliance at the patch's nodes in its frame."""
    dofs = blade.dofs(nodes)
    C = condense(blade.K, dofs, solver=solver, keep_factor=False).compliance()
    frame, m = patch_frame(blade.mesh), len(nodes)
    whole = C.reshape(m, 3, m, 3)
    return np.asarray(np.einsum("fc,icjd,gd->figj", frame, whole, frame))


def _damper(plan: ForcedPlan, bodies: Bodies, nodes: Sequence[IntArray]) -> tuple[Array, Array]:
    """Elastic compliance (3 n, 3 n) of the free damper at its nodes, its rigid columns (3 n, 6).

    G = B P' K^+ P B' with P = I - M R (R'M R)^-1 R': contact forces are held by the mass's inertia
    (or F_C, which acts on it), and the displacement has no rigid part.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., 17.5.
    """
    mesh, m = bodies.damper_mesh, plan.scene.material
    material = Material(m.E, m.nu, plan.scene.damper.density or m.density)
    K, M = Symmetric.of(stiffness(mesh, material, plan.scene.mesh.element)), mass(mesh, material)
    B = _damper_rows(bodies, mesh, nodes)
    R = _rigid(mesh.points - bodies.damper.centre)
    MR = M @ R
    inertia = np.linalg.inv(R.T @ MR)
    loads = B.T - MR @ (inertia @ (R.T @ B.T))
    # Six dofs that hold it: the ones its rigid motions move most independently.
    held = qr(R.T, mode="r", pivoting=True)[1][:6]
    free = np.setdiff1d(np.arange(3 * mesh.n_node), held).astype(np.int64)
    u = np.zeros_like(loads)
    u[free] = factorise(K.submatrix(free), solver=plan.scene.solver.name).solve(loads[free])
    u -= R @ (inertia @ (MR.T @ u))
    return np.asarray(B @ u), np.asarray(B @ R)


def _rigid(arms: Array) -> Array:
    """(3 n_node, 6) translations, and rotations theta x arm about the centre."""
    x, y, z = arms.T
    none = np.zeros(len(arms))
    turns = np.array([[none, -z, y], [z, none, -x], [-y, x, none]])
    R = np.zeros((len(arms), 3, 6))
    R[:, :, :3] = np.eye(3)
    R[:, :, 3:] = turns.transpose(2, 1, 0)
    return R.reshape(-1, 6)


def _damper_rows(bodies: Bodies, mesh: Mesh, nodes: Sequence[IntArray]) -> Array:
    """(3 n, 3 n_node) displacements of the damper's nodes in the frames of its faces."""
    parts = []
    for side, mine in zip(SIDES, nodes, strict=True):
        blade = bodies.blades[side].mesh
        # the k-th nodes of both patches lie on each other
        own = dict(zip(blade.nodes["patch"], mesh.nodes[f"{side}_patch"], strict=True))
        there = np.array([own[node] for node in mine])
        rows = np.zeros((3, len(mine), mesh.n_node, 3))
        rows[:, np.arange(len(mine)), there] = patch_frame(blade)[:, None, :]
        parts.append(rows.reshape(3, len(mine), -1))
    return np.concatenate(parts, axis=1).reshape(-1, 3 * mesh.n_node)
