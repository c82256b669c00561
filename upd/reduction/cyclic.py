"""Cyclic symmetry: one sector of a bladed disk for each nodal diameter.

Sectors are numbered in the direction of rotation, counter-clockwise about z. Sector 0 ends at its
low face and, 2 pi/N further, at its high face. Sector j moves like sector 0, turned by j 2 pi/N and
with the phase exp(2 pi i n j/N), so the nodes of the high face follow those of the low face [1]_:

    u_high = R u_low exp(2 pi i n/N),    K_n = T^H K T = K_0 + e^(i phi) K_1 + e^(-i phi) K_1'

with real K_0 and K_1. K_n is Hermitian, and real for n = 0 and N/2.

References
----------
.. [1] D. L. Thomas, Int. J. Numer. Meth. Engng 14 (1979) 81.
.. [2] R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csr_array, eye_array, kron
from scipy.spatial import cKDTree

from upd.errors import ConvergenceError, InputError, MeshError
from upd.labels import Shown
from upd.linalg.common import EPS, FloatArray, IntArray, Solve
from upd.linalg.hermitian import ComplexArray, HermitianModes, hermitian_factor, hermitian_modes
from upd.linalg.parallel import in_parallel, threads_for
from upd.mesh import Mesh

#: Largest offset of a node from its partner, relative to the distance of neighbours on the face.
OFFSET_LIMIT = 1e-3
#: Sets that a sector's mesh must have.
SETS = ("low", "high", "clamped")
#: Real or complex, as the nodal diameter has it.
Field = NDArray[Any]


def turn(angle: float) -> FloatArray:
    """(3, 3) rotation about z by an angle in rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


# -- the sector ------------------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class Sector(Shown):
    """The mesh of one of N sectors with its faces paired.

    Attributes
    ----------
    mesh : Mesh
        With the node sets low, high and clamped.
    n_sectors : int
        N.
    low, high : (m,) array of int
        Nodes of the faces; the k-th of `high` is the k-th of `low` turned by 2 pi/N about z.
    offset : float
        Largest distance of a node from its partner, mm.
    """

    mesh: Mesh
    n_sectors: int
    low: IntArray
    high: IntArray
    offset: float

    @classmethod
    def of(cls, mesh: Mesh, n_sectors: int) -> Sector:
        """Pair the faces.

        Raises
        ------
        InputError
            For fewer than two sectors.
        MeshError
            For a mesh that is no sector: sets missing, faces that share a node or do not match
            under rotation by 2 pi/N.
        """
        if n_sectors < 2:
            raise InputError(f"{n_sectors} sectors: give two or more.")
        missing = [name for name in SETS if not len(mesh.nodes.get(name, ()))]
        if missing:
            raise MeshError(
                f"the mesh is no sector: it has no node set {' and no '.join(missing)}. Name the "
                "cyclic faces low and high, the held nodes clamped."
            )
        low, high = mesh.nodes["low"], mesh.nodes["high"]
        if len(low) != len(high) or len(np.intersect1d(low, high)):
            raise MeshError(
                f"the mesh is no sector: low has {len(low)} nodes, high {len(high)}, "
                f"{len(np.intersect1d(low, high))} of them in both. Mesh both faces alike, away "
                "from the axis."
            )
        turned = mesh.points[low] @ turn(2.0 * np.pi / n_sectors).T
        offset, partner = _nearest(turned, mesh.points[high])
        step = np.min(np.asarray(cKDTree(turned).query(turned, k=2)[0])[:, 1])
        if len(np.unique(partner)) < len(low) or offset.max() > OFFSET_LIMIT * step:
            raise MeshError(_mismatch(mesh.points, low, high, n_sectors, float(offset.max())))
        return cls(mesh, n_sectors, low, high[partner], float(offset.max()))

    @cached_property
    def own(self) -> IntArray:
        """(n_own,) nodes whose displacements are unknowns: neither clamped nor on the high face."""
        free = np.ones(self.mesh.n_node, dtype=bool)
        free[self.high] = False
        free[self.mesh.nodes["clamped"]] = False
        return np.flatnonzero(free)

    @cached_property
    def _place(self) -> IntArray:
        """(n_node,) number of a node among the own ones, or -1."""
        place = np.full(self.mesh.n_node, -1)
        place[self.own] = np.arange(len(self.own))
        return place

    @cached_property
    def _maps(self) -> tuple[csr_array, csr_array]:
        """T_0 and T_1 (3 n_node, n) of u = (T_0 + e^(i phi) T_1) x."""
        shape = (self.mesh.n_node, len(self.own))
        free = self._place[self.low] >= 0
        ones = np.ones(len(self.own))
        own = csr_array((ones, (self.own, np.arange(len(self.own)))), shape=shape)
        pairs = (self.high[free], self._place[self.low][free])
        next_one = csr_array((np.ones(int(free.sum())), pairs), shape=shape)
        R = turn(2.0 * np.pi / self.n_sectors)
        return csr_array(kron(own, eye_array(3))), csr_array(kron(next_one, R))

    def matrix(self, K: csr_array) -> CyclicMatrix:
        """K (3 n_node, 3 n_node) of the free sector for every nodal diameter."""
        T0, T1 = self._maps
        K_T1 = K @ T1
        same = csr_array(T0.T @ (K @ T0) + T1.T @ K_T1)
        return CyclicMatrix(same, csr_array(T0.T @ K_T1), self.n_sectors)

    def load(self, f: FloatArray) -> FloatArray:
        """A load (3 n_node,) that is the same on every sector, on the unknowns."""
        T0, T1 = self._maps
        out: FloatArray = T0.T @ f + T1.T @ f
        return out

    def field(self, x: Field, nodal_diameter: int) -> Field:
        """Displacements (3 n_node, ...) of the whole sector from the unknowns (n, ...)."""
        T0, T1 = self._maps
        phase = phase_of(nodal_diameter, self.n_sectors)
        out: Field = T0 @ x + (phase.real if phase.imag == 0.0 else phase) * (T1 @ x)
        return out

    def dofs(self, nodes: IntArray, name: str) -> IntArray:
        """(3 k,) unknowns of nodes (k,).

        Raises InputError for a node without: clamped, or on the high face.
        """
        place = self._place[np.asarray(nodes)]
        if (place < 0).any():
            raise InputError(
                f"{name}: node {np.asarray(nodes)[place < 0][0]} is clamped or on the high face: "
                "choose free nodes away from it."
            )
        out: IntArray = (3 * place[:, None] + np.arange(3)).ravel()
        return out


def _nearest(points: FloatArray, others: FloatArray) -> tuple[FloatArray, IntArray]:
    """(k,) distances of points (k, d) from the nearest of the others, and its numbers."""
    distance, number = cKDTree(others).query(points)
    return np.asarray(distance), np.asarray(number, dtype=np.int64)


def _mismatch(points: FloatArray, low: IntArray, high: IntArray, N: int, offset: float) -> str:
    """The message for faces that do not match, with the number of sectors that would."""
    angles = [np.angle(np.exp(1j * np.arctan2(*points[n, 1::-1].T)).mean()) for n in (low, high)]
    between = float(angles[1] - angles[0])
    hint = "the high face lies clockwise of the low one: exchange the names low and high"
    if between > 0.0:
        hint = (
            f"the faces are {np.degrees(between):.6g} deg apart, {2.0 * np.pi / between:.6g} "
            "sectors make a ring: give that number, or mesh both faces with the same lattice"
        )
    return (
        f"the faces low and high do not match under rotation by 2 pi/{N} about z, the largest "
        f"offset is {offset:.3g} mm; {hint}."
    )


def phase_of(n: int, N: int) -> complex:
    """exp(2 pi i n/N), exactly real for multiples of N/2."""
    if 2 * n % N == 0:
        return complex((-1.0) ** (2 * n // N))
    return complex(np.exp(2j * np.pi * n / N))


class CyclicMatrix(NamedTuple):
    """K_n = same + e^(i phi) following + e^(-i phi) following', phi = 2 pi n/N.

    Attributes
    ----------
    same, following : (n, n) csr_array or ndarray
        Real; `same` is symmetric.
    n_sectors : int
    """

    same: Any
    following: Any
    n_sectors: int

    def at(self, nodal_diameter: int) -> Any:
        """(n, n) K_n, real for n = 0 and N/2."""
        phase = phase_of(nodal_diameter, self.n_sectors)
        real = self.same + phase.real * (self.following + self.following.T)
        if phase.imag == 0.0:
            return real
        return real + 1j * phase.imag * (self.following - self.following.T)

    def projected(self, V: FloatArray) -> CyclicMatrix:
        """V'KV for a real basis V (n, r), dense."""
        return CyclicMatrix(V.T @ (self.same @ V), V.T @ (self.following @ V), self.n_sectors)


# -- modes -----------------------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class CyclicModel(Shown):
    """Stiffness and mass of a sector for every nodal diameter and speed.

    Attributes
    ----------
    sector : Sector
    K, M : CyclicMatrix
        N/mm and t.
    spin : CyclicMatrix or None
        What the stiffness gains at a speed of 1 rad/s, K_sigma - M_P; it grows with the square.
    """

    sector: Sector
    K: CyclicMatrix
    M: CyclicMatrix
    spin: CyclicMatrix | None = None

    @classmethod
    def of(
        cls, sector: Sector, K: csr_array, M: csr_array, spin: csr_array | None = None
    ) -> CyclicModel:
        """From the matrices (3 n_node, 3 n_node) of the free sector."""
        return cls(
            sector,
            sector.matrix(K),
            sector.matrix(M),
            None if spin is None else sector.matrix(spin),
        )

    @property
    def nodal_diameters(self) -> range:
        """All that differ, 0 to N/2."""
        return range(self.sector.n_sectors // 2 + 1)

    def stiffness(self, nodal_diameter: int, speed: float = 0.0) -> csr_array:
        """K_n at a speed in rad/s."""
        K: csr_array = self.K.at(nodal_diameter)
        if speed == 0.0:
            return K
        if self.spin is None:
            raise InputError("the model has no rotation: give the stiffness that it adds.")
        return csr_array(K + speed**2 * self.spin.at(nodal_diameter))

    def factor(self, nodal_diameter: int, speed: float = 0.0) -> Solve:
        """x -> K_n^-1 x.

        Raises
        ------
        ConvergenceError
            When K_n is not positive definite: a speed beyond static stability, a free body.
        """
        try:
            return hermitian_factor(self.stiffness(nodal_diameter, speed))
        except ConvergenceError as error:
            raise ConvergenceError(unstable(nodal_diameter, speed)) from error

    def static(self, load: FloatArray) -> FloatArray:
        """Displacements (3 n_node,) under a load (3 n_node,) that is the same on every sector."""
        x = self.factor(0)(self.sector.load(load))
        return np.asarray(self.sector.field(x, 0), dtype=np.float64)

    def modes(self, nodal_diameter: int, count: int, speed: float = 0.0) -> HermitianModes:
        """Lowest modes of one nodal diameter.

        Parameters
        ----------
        nodal_diameter : int
            0 to N/2.
        count : int
        speed : float
            rad/s.

        Returns
        -------
        HermitianModes
            Shapes on the unknowns; `Sector.field` gives those of the sector.

        Raises
        ------
        ConvergenceError
            Beyond the speed of static stability.
        """
        K, M = self.stiffness(nodal_diameter, speed), self.M.at(nodal_diameter)
        return hermitian_modes(K, M, count, self.factor(nodal_diameter, speed))


def unstable(nodal_diameter: int, speed: float) -> str:
    """The message for a stiffness that is not positive definite."""
    return (
        f"nodal diameter {nodal_diameter}, {speed:.6g} rad/s: the stiffness is not positive "
        "definite. The speed is beyond static stability, or the sector is not held: lower the "
        "speed, or clamp the bore."
    )


@dataclass(frozen=True, repr=False)
class ModeFamily(Shown):
    """Modes of every nodal diameter and speed in the span of a few computed ones.

    The unknowns and K_n, which is a sum of three matrices times functions of n and of the speed,
    are the same for all, so a Galerkin projection on modes of some nodal diameters serves the
    others. Its frequencies are too high, never too low.

    Attributes
    ----------
    K, M : CyclicMatrix
        Projected, dense.
    spin : CyclicMatrix or None
    """

    K: CyclicMatrix
    M: CyclicMatrix
    spin: CyclicMatrix | None

    @classmethod
    def of(
        cls, model: CyclicModel, nodal_diameters: Sequence[int], count: int, workers: int = 1
    ) -> ModeFamily:
        """From modes at rest of some nodal diameters and how the speed begins to change them.

        The change is K_n^-1 (K_sigma - M_P) X, by the same factor, twice.

        Parameters
        ----------
        model : CyclicModel
        nodal_diameters : sequence of int
        count : int
            Modes each.
        workers : int
            Nodal diameters at a time.
        """

        def blocks(n: int) -> list[FloatArray]:
            solve = model.factor(n)
            found = [hermitian_modes(model.stiffness(n), model.M.at(n), count, solve).shapes]
            if model.spin is not None:
                for _ in range(2):
                    found.append(solve(model.spin.at(n) @ found[-1]))
            X = np.hstack(found)
            return [X.real, X.imag] if np.iscomplexobj(X) else [X]

        basis = in_parallel([partial(blocks, n) for n in nodal_diameters], workers)
        X = np.hstack([part for parts in basis for part in parts])
        X /= np.maximum(np.linalg.norm(X, axis=0), np.finfo(float).tiny)
        U, size, _ = np.linalg.svd(X, full_matrices=False)
        # directions that are rounding are left out
        V = U[:, size > 1e4 * EPS * size[0]]
        spin = None if model.spin is None else model.spin.projected(V)
        return cls(model.K.projected(V), model.M.projected(V), spin)

    def frequencies(self, nodal_diameter: int, count: int, speed: float = 0.0) -> FloatArray:
        """(count,) lowest frequencies in Hz.

        Raises
        ------
        ConvergenceError
            Beyond the speed of static stability.
        """
        K, M = self.K.at(nodal_diameter), self.M.at(nodal_diameter)
        if speed != 0.0 and self.spin is not None:
            K = K + speed**2 * self.spin.at(nodal_diameter)
        with threads_for(len(M)):
            value = eigh(K, M, eigvals_only=True, subset_by_index=[0, count - 1])
        if not value[0] > 0.0:
            raise ConvergenceError(unstable(nodal_diameter, speed))
        out: FloatArray = np.sqrt(value) / (2.0 * np.pi)
        return out


def with_coriolis(frequency: FloatArray, U: Field, coriolis: csr_array, speed: float) -> FloatArray:
    """Frequencies of both travelling waves with the Coriolis force, in the span of some modes.

    Parameters
    ----------
    frequency : (m,) ndarray
        Of the modes at this speed without it, Hz.
    U : (3 n_node, m) ndarray
        Their fields over the sector.
    coriolis : (3 n_node, 3 n_node) csr_array
        2 M (e_z x).
    speed : float
        rad/s.

    Returns
    -------
    (2, m) ndarray
        Rising, Hz: of the wave exp(i w t) with the fields' phase, and of that which travels the
        other way.
    """
    m = len(frequency)
    G = 1j * speed * (U.conj().T @ (coriolis @ U))
    w2 = np.diag((2.0 * np.pi * frequency) ** 2)
    # (w2 + w G - w^2) q = 0 as a first-order problem of q and w q
    value = np.linalg.eigvals(np.block([[np.zeros((m, m)), np.eye(m)], [w2, G]])).real
    both = [np.sort(value[value > 0.0]), np.sort(-value[value < 0.0])]
    return np.array(both) / (2.0 * np.pi)


# -- reduction -------------------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class ReducedSector(Shown):
    """One sector on r coordinates for one nodal diameter.

    Axes are those of sector 0. The damper sits between sector 0 and sector 1.

    Attributes
    ----------
    n_sectors, nodal_diameter : int
    K, M, C : (r, r) ndarray of complex
        Hermitian, real for nodal diameters 0 and N/2; N/mm, t, N s/mm.
    B_high : (3 p, r) ndarray
        Displacements x, y, z of the p points of contact_right, on the high end of sector 0.
    B_low : (3 p, r) ndarray
        Those of the points of contact_left on the low end of sector 1, already turned by 2 pi/N,
        without their phase exp(i phi).
    high, low : (p, 3) ndarray
        Positions of these points, mm; the k-th ones face each other across the gap.
    rows : mapping of str to (3 k, r) ndarray
        Displacements of other kept nodes.
    fixed_frequency : (m,) ndarray
        Of the modes with the kept nodes held, Hz.
    frequency, full_frequency : (c,) ndarray
        Lowest frequencies of the reduced and of the full sector, Hz.
    """

    n_sectors: int
    nodal_diameter: int
    K: ComplexArray
    M: ComplexArray
    C: ComplexArray
    B_high: FloatArray
    B_low: FloatArray
    high: FloatArray
    low: FloatArray
    rows: Mapping[str, FloatArray]
    fixed_frequency: FloatArray
    frequency: FloatArray
    full_frequency: FloatArray

    @property
    def frequency_error(self) -> FloatArray:
        """(c,) reduced over full frequency, less one."""
        out: FloatArray = self.frequency / self.full_frequency - 1.0
        return out

    def conjugate(self) -> ReducedSector:
        """The sector for N - n: the wave of n nodal diameters that travels the other way."""
        return replace(
            self,
            nodal_diameter=(self.n_sectors - self.nodal_diameter) % self.n_sectors,
            K=self.K.conj(),
            M=self.M.conj(),
            C=self.C.conj(),
        )


def facing_contacts(sector: Sector) -> tuple[IntArray, IntArray]:
    """Nodes of contact_right, and those of contact_left that face them in the next gap.

    Paired by radius and axial place.

    Raises
    ------
    MeshError
        When a set is missing or the patches do not match.
    """
    sets = [sector.mesh.nodes.get(name, np.empty(0, np.int64)) for name in _CONTACTS]
    if not len(sets[0]) or len(sets[0]) != len(sets[1]):
        raise MeshError(
            f"the damper's contacts contact_right and contact_left have {len(sets[0])} and "
            f"{len(sets[1])} nodes: name two patches with the same lattice."
        )
    places = [
        np.column_stack([np.hypot(x, y), z]) for x, y, z in (sector.mesh.points[n].T for n in sets)
    ]
    offset, partner = _nearest(places[0], places[1])
    extent = float(np.ptp(places[0], axis=0).max())
    if len(np.unique(partner)) < len(partner) or offset.max() > OFFSET_LIMIT * extent:
        raise MeshError(
            "contact_right and contact_left do not match in radius and axial place, the largest "
            f"offset is {offset.max():.3g} mm: give both patches the same lattice."
        )
    return sets[0], sets[1][partner]


_CONTACTS = ("contact_right", "contact_left")
#: Frequencies of a reduced sector that are compared with those of the full one.
_COMPARED = 4


def reduce_sector(
    model: CyclicModel,
    nodal_diameter: int,
    *,
    n_modes: int,
    keep: Mapping[str, IntArray],
    speed: float = 0.0,
    damping: tuple[float, float] = (0.0, 0.0),
    full: FloatArray | None = None,
) -> ReducedSector:
    """Craig-Bampton reduction [2]_ for one nodal diameter.

    The kept nodes are those of both contacts and of `keep`. One factor of the whole K_n serves the
    full modes, the constraint modes and the modes with the kept nodes held: with E the columns of
    the kept dofs, K_n^-1 E (E' K_n^-1 E)^-1 are the constraint modes.

    Parameters
    ----------
    model : CyclicModel
    nodal_diameter : int
        0 to N/2.
    n_modes : int
        Modes with the kept nodes held.
    keep : mapping of str to array of int
        Other kept nodes by name.
    speed : float
        rad/s.
    damping : (alpha, beta)
        C = alpha M + beta K, 1/s and s.
    full : (c,) ndarray, optional
        Lowest frequencies of the full sector, Hz, where they are known; else four are computed.

    Returns
    -------
    ReducedSector

    Raises
    ------
    InputError
        For a kept node that is clamped or on the high face.
    MeshError
        For contact patches that do not match.
    ConvergenceError
        Beyond the speed of static stability.
    """
    sector = model.sector
    right, left = facing_contacts(sector)
    nodes = {"contact_right": right, "contact_left": left, **keep}
    dofs = {name: sector.dofs(one, name) for name, one in nodes.items()}
    b = np.unique(np.concatenate(list(dofs.values())))
    K, M = model.stiffness(nodal_diameter, speed), model.M.at(nodal_diameter)
    solve = model.factor(nodal_diameter, speed)
    if full is None:
        full = hermitian_modes(K, M, _COMPARED, solve).frequency
    Psi, S = _constraint_modes(solve, b, K.shape[0], K.dtype)
    fixed, Phi = _held_modes(K, M, solve, Psi, b, n_modes)
    T = np.hstack([Psi, Phi])
    k, r = len(b), T.shape[1]
    K_r = np.zeros((r, r), dtype=np.complex128)
    K_r[:k, :k] = S
    K_r[range(k, r), range(k, r)] = (2.0 * np.pi * fixed) ** 2
    M_r = (T.conj().T @ (M @ T)).astype(np.complex128)
    M_r = 0.5 * (M_r + M_r.conj().T)
    rows = {name: np.eye(r)[np.searchsorted(b, one)] for name, one in dofs.items()}
    R = turn(2.0 * np.pi / sector.n_sectors)
    value = eigh(K_r, M_r, eigvals_only=True, subset_by_index=[0, len(full) - 1])
    return ReducedSector(
        sector.n_sectors,
        nodal_diameter,
        K_r,
        M_r,
        damping[0] * M_r + damping[1] * K_r,
        rows.pop("contact_right"),
        np.kron(np.eye(len(left)), R) @ rows.pop("contact_left"),
        sector.mesh.points[right],
        sector.mesh.points[left] @ R.T,
        rows,
        fixed,
        np.sqrt(value) / (2.0 * np.pi),
        full,
    )


def _constraint_modes(
    solve: Solve, b: IntArray, n: int, dtype: np.dtype[np.generic]
) -> tuple[Field, Field]:
    """Constraint modes (n, k) of the kept dofs b (k,) and the condensed stiffness (k, k)."""
    E = np.zeros((n, len(b)), dtype=dtype)
    E[b, np.arange(len(b))] = 1.0
    G = solve(E)
    S = np.linalg.inv(G[b])
    S = 0.5 * (S + S.conj().T)
    Psi = G @ S
    Psi[b] = np.eye(len(b))
    return Psi, S


def _held_modes(
    K: csr_array, M: csr_array, solve: Solve, Psi: Field, b: IntArray, count: int
) -> tuple[FloatArray, Field]:
    """Frequencies (m,) and shapes (n, m) of the modes with the dofs b held."""
    inner = np.setdiff1d(np.arange(K.shape[0]), b)

    def held(rhs: Field) -> Field:
        whole = np.zeros((K.shape[0], *rhs.shape[1:]), dtype=K.dtype)
        whole[inner] = rhs
        free = solve(whole)
        return np.asarray(free - Psi @ free[b])[inner]

    K_ii, M_ii = (csr_array(A[inner][:, inner]) for A in (K, M))
    found = hermitian_modes(K_ii, M_ii, count, held)
    shapes = np.zeros((K.shape[0], count), dtype=K.dtype)
    shapes[inner] = found.shapes
    return found.frequency, shapes
