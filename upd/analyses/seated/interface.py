"""The damper between both blades as one contact: every matching node of both faces, no springs.

The blades are condensed on their patches; the damper, which only its contacts hold, deforms by
inertia relief (F_C acts on its mass) and keeps its rigid motions as unknowns beside their
equilibrium. Of a half model, forces of nodes are those of the half; totals are those of the whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, qr

from upd.analyses.base import Plan
from upd.analyses.seated.bodies import Blade, Bodies, is_half, lattice, make_blade, patch_frame
from upd.contact import CoupledContact, coupled_contact
from upd.errors import InputError
from upd.fem import Material
from upd.linalg import factorise
from upd.linalg.least_distance import least_positive
from upd.linalg.parallel import in_parallel
from upd.mesh import IntArray
from upd.reduction import condense
from upd.scene.forced_contact import SIDES

Array = NDArray[np.float64]
#: rigid motions: shifts along x, y, z, turns about them
MOTIONS = 6
#: those that are even about y = 0: shifts along x and z, and the turn about y
EVEN = (0, 2, 4)
_X, _Y, _Z = range(3)


@dataclass(frozen=True)
class Interface:
    """Both faces of the damper as one contact.

    n nodes, those of the left face first; forces and displacements are laid out by component:
    normal (from the damper into the blade), along the damper, up the slope, of all nodes each.

    Attributes
    ----------
    compliance : (3 n, 3 n) ndarray
        Blades and damper together, mm/N.
    columns : (3 n, r) ndarray
        Displacement of the nodes by the damper's shifts and its turns about its centre of mass.
    kept : tuple of int
        Which of the six rigid motions the columns are.
    face : (n,) array of int
        Index into SIDES.
    position : (n, 3) ndarray
        mm.
    area : (n,) ndarray
        Tributary area in the model, mm2.
    frame : (2, 3, 3) ndarray
        Of each face, unit rows: normal, along the damper, up the slope.
    copies : int
        Models that make the whole: 2 of a half.
    damper : (3 n, 3 n) ndarray
        The damper's share of the compliance, mm/N.
    """

    compliance: Array
    columns: Array
    kept: tuple[int, ...]
    face: IntArray
    position: Array
    area: Array
    frame: Array
    copies: int
    damper: Array

    @property
    def n(self) -> int:
        """Nodes of both faces in the model."""
        return len(self.face)

    @property
    def directions(self) -> tuple[int, ...]:
        """Axes along which a blade may be moved: x and z of a half."""
        return tuple(k for k in self.kept if k < 3)

    def seat(
        self,
        friction: float,
        centrifugal: Sequence[float] | Array,
        *,
        gap: Array | None = None,
        moved: Array | None = None,
        after: CoupledContact | None = None,
    ) -> CoupledContact:
        """Raise and lower F_C, and move the right blade.

        Parameters
        ----------
        friction
            Coefficient.
        centrifugal
            (k,) F_C after each step, N.
        gap
            (n,) mm before any load; None: the faces fit.
        moved
            (k, 3) mm, shift of what holds the right blade after each step; None: it stays.
        after
            A seating to go on from, with its friction and gap, beside others that do.

        Returns
        -------
        CoupledContact
            Its `displacement` holds shifts in mm and turns in rad of the damper, the kept ones.

        Raises
        ------
        InputError, ConvergenceError
            As `upd.contact.coupled_contact`.
        """
        if np.ndim(centrifugal) != 1:
            raise InputError("centrifugal: give F_C after each step, in one dimension")
        load = np.zeros((len(centrifugal), len(self.kept)))
        load[:, self.kept.index(_Z)] = np.asarray(centrifugal) / self.copies
        offset = None if moved is None else np.asarray(moved) @ self.shifts(1).T
        if after is not None:
            return after.fork().go_on(load=load, offset=offset)
        return coupled_contact(
            self.compliance,
            np.zeros(self.n) if gap is None else gap,
            friction,
            load=load,
            columns=self.columns,
            offset=offset,
        )

    def shifts(self, side: int) -> Array:
        """(3 n, 3) displacement of the nodes of one face's blade by its shifts along x, y, z."""
        out = np.zeros((3, self.n, 3))
        out[:, self.face == side] = self.frame[side][:, None, :]
        return out.reshape(3 * self.n, 3)

    def face_forces(self, found: CoupledContact) -> Array:
        """(k, 2, 3) N of the whole after each step: per face normal, along the damper, up."""
        totals = self.copies * np.stack(
            [found.force[:, self.face == k].sum(axis=1) for k in range(len(SIDES))], axis=1
        )
        if self.copies > 1:
            # odd: the other half has the opposite
            totals[:, :, 1] = 0.0
        return np.asarray(totals)

    def motions(self, found: CoupledContact) -> Array:
        """(k, 6) mm and rad: shifts and turns of the damper after each step."""
        out = np.zeros((len(found.displacement), MOTIONS))
        out[:, list(self.kept)] = found.displacement
        return out

    def worn_gap(self, centrifugal: float) -> Array:
        """(n,) mm: gap of faces worn in under F_C, which then press as evenly as they can.

        Of all normal forces that hold the damper without friction these have the least sum of
        squares over areas. Closed everywhere under them, h = B s - C f: open most where the bodies
        give way least.

        Raises
        ------
        InputError
            Where pressure alone cannot.
        """
        normal, load = self.columns[: self.n], np.zeros(len(self.kept))
        load[self.kept.index(_Z)] = 1.0 / self.copies
        A = normal.T * np.sqrt(self.area)
        size = np.linalg.norm(A, axis=1)
        eps = np.sqrt(np.finfo(float).eps)
        used = size > eps * np.where(np.array(self.kept) < 3, size[0], size.max())
        x = least_positive(A[used] / size[used, None], load[used] / size[used])
        force = np.zeros(self.n) if x is None else np.sqrt(self.area) * x
        misfit = np.abs(normal.T @ force - load)[used] / size[used]
        if misfit.max() > eps * (load[used] / size[used]).max():
            raise InputError(
                "contact.fit: pressure on both faces cannot hold this damper against F_C without "
                'friction; set contact.fit = "new"'
            )
        w = self.compliance[: self.n, : self.n] @ (centrifugal * force)
        return np.asarray(w.max() - w)

    # -- stuck stiffness ---------------------------------------------------------------------------

    def leg_stiffness(self, closed: NDArray[np.bool_]) -> Array:
        """Force on the left blade's platform by shifts of the right one, all closed nodes stuck.

        With G the compliance of the closed nodes, B the damper's rigid motions and U the shifts of
        the right blade, S = [B U]' G^-1 [B U]: K = S_UU - S_UB S_BB^-1 S_BU, the damper free.

        Parameters
        ----------
        closed
            (n,) nodes in contact.

        Returns
        -------
        Array
            (d, d) N/mm of the whole, d the `directions`; 0 where a face is open.
        """
        if any(not closed[self.face == k].any() for k in range(len(SIDES))):
            return np.zeros((len(self.directions),) * 2)
        S = self._stuck(closed, np.hstack([self.columns, self.shifts(1)[:, list(self.directions)]]))
        r = len(self.kept)
        K = S[r:, r:] - S[r:, :r] @ np.linalg.solve(S[:r, :r], S[:r, r:])
        return np.asarray(self.copies * 0.5 * (K + K.T))

    def _stuck(self, closed: NDArray[np.bool_], X: Array) -> Array:
        """X' G^-1 X of motions (3 n, k), G the compliance of the closed nodes."""
        on = np.tile(closed, 3)
        factor = cho_factor(self.compliance[np.ix_(on, on)], lower=True)
        return np.asarray(X[on].T @ cho_solve(factor, X[on]))

    def face_stiffness(self, side: int, closed: NDArray[np.bool_]) -> Array:
        """(normal, along, up) N/mm of one face of the whole, its closed nodes stuck.

        Force by a shift of the damper's mass against what holds the blade, the other shifts and
        all turns held; 0 where nothing touches. Along the damper nan of a half, whose plane y = 0
        holds it.
        """
        mine = closed & (self.face == side)
        if not mine.any():
            return np.array([0.0, np.nan if self.copies > 1 else 0.0, 0.0])
        S = self._stuck(mine, np.repeat(np.eye(3), self.n, axis=0))
        out = self.copies * np.diagonal(S).copy()
        if self.copies > 1:
            out[1] = np.nan
        return np.asarray(out)


def make_interface(
    plan: Plan[Any], bodies: Bodies, held: str = "bases", like: Interface | None = None
) -> Interface:
    """The contact of both faces from a rig's bodies, of elements whose faces have four nodes.

    Parameters
    ----------
    held
        "bases": blades elastic down to the clamped faces of their bases; "platforms": held where
        the platforms' sides join the blades.
    """
    blades = [bodies.blades[side] for side in SIDES]
    patches = [lattice(blade.mesh) for blade in blades]
    nodes = [patch.nodes for patch in patches]
    face = np.repeat(np.arange(len(SIDES)), [len(one) for one in nodes])
    n = len(face)
    C = np.zeros((3, n, 3, n))
    found = in_parallel(
        [
            partial(_blade_compliance, blade, one, plan.scene.solver.name, held)
            for blade, one in zip(blades, nodes, strict=True)
        ],
        plan.workers,
    )
    for k, part in enumerate(found):
        on = np.flatnonzero(face == k)
        C[:, on[:, None], :, on[None, :]] += part.transpose(1, 3, 0, 2)
    own, columns = (
        damper_compliance(plan, bodies, nodes) if like is None else (like.damper, like.columns)
    )
    total = C.reshape(3 * n, 3 * n) + own
    position = np.vstack([b.mesh.points[one] for b, one in zip(blades, nodes, strict=True)])
    half = is_half(bodies.damper_mesh)
    if half:
        _free_of_plane(total, position[:, _Y])
    return Interface(
        0.5 * (total + total.T),
        columns,
        EVEN if half else tuple(range(MOTIONS)),
        face,
        position,
        np.concatenate([patch.area for patch in patches]),
        np.stack([patch.frame for patch in patches]),
        2 if half else 1,
        own,
    )


def _free_of_plane(C: Array, y: Array) -> None:
    """Nodes on the mirror plane do not move across it: any compliance leaves no force there."""
    n = len(y)
    held = n + np.flatnonzero(y == 0.0)
    C[held], C[:, held] = 0.0, 0.0
    C[held, held] = np.diagonal(C)[n : 2 * n].max()


def _blade_compliance(blade: Blade, nodes: IntArray, solver: str, held: str) -> Array:
    """(m, 3, m, 3) compliance at the patch's nodes in its frame."""
    kept = (3 * nodes[:, None] + np.arange(3)).ravel()
    K, free = blade.K, blade.free
    if held == "platforms":
        stem = (3 * blade.mesh.nodes["stem"][:, None] + np.arange(3)).ravel()
        free = np.setdiff1d(free, stem)
        K = K.submatrix(np.searchsorted(blade.free, free))
    moves = np.isin(kept, free)
    C = np.zeros((len(kept), len(kept)))
    C[np.ix_(moves, moves)] = condense(
        K, np.searchsorted(free, kept[moves]), solver=solver, keep_factor=False
    ).compliance()
    frame, m = patch_frame(blade.mesh), len(nodes)
    return np.asarray(np.einsum("fc,icjd,gd->figj", frame, C.reshape(m, 3, m, 3), frame))


def damper_compliance(
    plan: Plan[Any], bodies: Bodies, nodes: Sequence[IntArray]
) -> tuple[Array, Array]:
    """Elastic compliance (3 n, 3 n) of the free damper at its nodes, its rigid columns (3 n, r).

    G = B P' K^+ P B' with P = 1 - M R (R'M R)^-1 R': contact forces are held by the mass's inertia
    (or F_C, which acts on it), and the displacement has no rigid part. With as many dofs held as
    there are rigid motions, K^+ becomes K_h^-1, and with Y = K_h^-1 M R, J = (R'M R)^-1

        G = B K_h^-1 B' - (B Y) J (B R)' - (B R) J (B Y)' + B R J (R'M Y) J (B R)'.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., 17.5.
    """
    mesh, m, solver = bodies.damper_mesh, plan.scene.material, plan.scene.solver.name
    material = Material(m.E, m.nu, plan.scene.damper.density or m.density)
    (body,) = make_blade("damper", mesh, material, plan.scene.mesh.element)
    K, M, moves = body.K, body.M, body.free
    whole = _rigid(mesh.points - bodies.damper.centre)
    if is_half(mesh):
        whole = whole[:, list(EVEN)]
    R = whole[moves]
    there = np.concatenate(_damper_nodes(bodies, nodes))
    contact = (3 * there[:, None] + np.arange(3)).ravel()
    # Dofs that hold it: of those off the contact the ones its rigid motions move most
    # independently.
    others = np.flatnonzero(~np.isin(moves, contact))
    held = others[qr(R[others].T, mode="r", pivoting=True)[1][: R.shape[1]]]
    free = np.setdiff1d(np.arange(len(moves)), held).astype(np.int64)
    K_h, MR = K.submatrix(free), (M @ R)
    Y = factorise(K_h, solver=solver).solve(MR[free])
    on = np.isin(contact, moves)
    at = np.searchsorted(moves[free], contact[on])
    G, BY = np.zeros((len(contact), len(contact))), np.zeros((len(contact), R.shape[1]))
    G[np.ix_(on, on)] = condense(K_h, at, solver=solver, keep_factor=False).compliance()
    BY[on] = Y[at]
    BR, J = whole[contact], np.linalg.inv(R.T @ MR)
    cross = BY @ J @ BR.T
    G += BR @ J @ (MR[free].T @ Y) @ J @ BR.T - cross - cross.T
    # from the axes to the frames of the faces, component by component
    turn = np.repeat(
        np.stack([patch_frame(bodies.blades[side].mesh) for side in SIDES]),
        [len(one) for one in nodes],
        axis=0,
    )
    n = len(there)
    G = np.einsum("nfc,ncmd,mgd->fngm", turn, G.reshape(n, 3, n, 3), turn, optimize=True)
    columns = np.einsum("nfc,ncr->fnr", turn, BR.reshape(n, 3, -1))
    return G.reshape(3 * n, 3 * n), columns.reshape(3 * n, -1)


def _rigid(arms: Array) -> Array:
    """(3 n_node, 6) shifts, and turns theta x arm about the centre."""
    turns = [np.cross(axis, arms).ravel() for axis in np.eye(3)]
    return np.column_stack([np.tile(np.eye(3), (len(arms), 1)), *turns])


def _damper_nodes(bodies: Bodies, nodes: Sequence[IntArray]) -> list[IntArray]:
    """The damper's node at every node of both patches."""
    found = []
    for side, mine in zip(SIDES, nodes, strict=True):
        # the k-th nodes of both patches lie on each other
        patch, there = (
            bodies.blades[side].mesh.nodes["patch"],
            bodies.damper_mesh.nodes[f"{side}_patch"],
        )
        order = np.argsort(patch)
        found.append(there[order[np.searchsorted(patch[order], mine)]])
    return found
