"""Newton's linear systems of coupled contact, each solved the cheapest way that its states allow.

Three ways lead to the same iterate. Everything stuck: the factor of C. Few nodes closed: the
equations of the closed dofs alone, dense. Most closed and few of them slipping: a principal pivot
of C^-1 that is kept from one iterate to the next, and a small system for what differs from it.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, lu_solve

from upd.contact.checks import EPS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

NOT_CARRIED = "nothing touches and carries the load"
#: A kept base or factor serves about this many iterates, those of one load step, and a product of a
#: matrix with a vector, which waits for memory, costs so much more; both only weigh costs.
_SERVES, _PASS = 3, 10.0
#: Refinements behind a kept base; each gains the digits that the condition of C leaves.
_REFINED = 2


@dataclass(frozen=True)
class NewtonRows:
    """One Newton system per node: P f + Q (C f - B s - b) = rhs, (n, c, c) and (n, c).

    `relaxed` (n, c) marks the rows that are not simply y = 0.
    """

    P: FloatArray
    Q: FloatArray
    rhs: FloatArray
    relaxed: BoolArray

    @property
    def is_open(self) -> BoolArray:
        """(n,) nodes that are open."""
        return np.asarray((self.P[:, 0, 0] > 0.0) & self.relaxed[:, 0])

    def same_states(self, other: NewtonRows) -> bool:
        """Whether other rows have the same nodes open, stuck and slipping."""
        return np.array_equal(self.relaxed, other.relaxed) and np.array_equal(
            self.is_open, other.is_open
        )


@dataclass(frozen=True)
class Target:
    """b (m,), and load p (r,) or motion s (r,); columns of them for derivatives."""

    b: FloatArray
    load: FloatArray | None
    motion: FloatArray | None


Solved = tuple[FloatArray, FloatArray, FloatArray]


class NewtonSystem(Protocol):
    """Newton's rows, factored."""

    def solve(self, rhs: FloatArray, target: Target) -> Solved:
        """f, s and y for rhs (m,) or (m, columns)."""

    def refined(self, rhs: FloatArray, target: Target) -> Solved:
        """The same for one column, to rounding."""


@dataclass
class CoupledSystems:
    """C, B and what is kept of them.

    Parameters
    ----------
    C : (m, m) ndarray
        Compliance, symmetric positive definite, m = c n.
    B : (m, r) ndarray
        Rigid columns.
    n : int
        Nodes.
    proven : (m, m) ndarray, optional
        L of C = L L' where it is known, what is above its diagonal is not used.
    """

    C: FloatArray
    B: FloatArray
    n: int
    proven: FloatArray | None = None
    _bases: dict[bool, tuple[BoolArray, FloatArray]] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        self.c = len(self.C) // self.n

    def twin(self) -> CoupledSystems:
        """The same matrices and their factors, with kept bases of its own."""
        out = copy(self)
        out._bases = {}
        return out

    def forget(self) -> None:
        """Drop the kept bases: what a run that failed kept may be the very thing that failed."""
        self._bases.clear()

    @cached_property
    def factor(self) -> FloatArray:
        """L of C = L L', (m, m), in its lower triangle."""
        if self.proven is not None:
            return self.proven
        L, info = lapack.dpotrf(self.C.T, lower=1, clean=0)
        if info != 0:
            raise np.linalg.LinAlgError("compliance is not positive definite")
        return np.asarray(L)

    def _solved(self, b: FloatArray) -> FloatArray:
        return np.asarray(lapack.dpotrs(self.factor, b, lower=1)[0])

    @cached_property
    def inverse(self) -> FloatArray:
        """C^-1, (m, m)."""
        inverse, info = lapack.dpotri(self.factor, lower=1)
        if info != 0:
            raise np.linalg.LinAlgError("compliance is not positive definite")
        out: FloatArray = np.tril(inverse) + np.tril(inverse, -1).T
        return out

    @cached_property
    def carried(self) -> tuple[FloatArray, FloatArray]:
        """V (m, r) and A (r, r): everything stuck, under a load p,

        f = W b + V p, s = A p - V'b, with A = (B'C^-1 B)^-1, V = C^-1 B A, W = C^-1 - V A^-1 V'.
        """
        CB = self._solved(self.B)
        A = np.linalg.inv(self.B.T @ CB)
        A = 0.5 * (A + A.T)
        return CB @ A, A

    def _stuck_pivot(self, by_load: bool) -> FloatArray:
        """W, or C^-1 with the motion given: f = W y where everything is closed."""
        if not by_load:
            return self.inverse
        V, _ = self.carried
        return self.inverse - V @ self._solved(self.B).T

    def stuck_forces(self, target: Target) -> FloatArray:
        """Forces with y = 0; one column or many."""
        if target.load is None:
            assert target.motion is not None
            return self._solved(target.b + self.B @ target.motion)
        V, _ = self.carried
        # W b: what C^-1 b leaves of the load is taken back.
        first = self._solved(target.b)
        return np.asarray(first + V @ (target.load - self.B.T @ first))

    def base(self, by_load: bool) -> BoolArray:
        """(m,) open dofs of the kept base."""
        kept = self._bases.get(by_load)
        return np.zeros(len(self.C), bool) if kept is None else kept[0]

    def turned(self, is_open: BoolArray, by_load: bool) -> FloatArray:
        """T (m, m) of z = z0 + T x: x the forces of open dofs and the y of closed ones, z the rest.

        The principal pivot of f = f0 + W y on the open dofs. Kept, because few states change from
        one iterate to the next.
        """
        if by_load not in self._bases or not np.array_equal(self._bases[by_load][0], is_open):
            W = self._stuck_pivot(by_load)
            if is_open.any():
                o, c = np.flatnonzero(is_open), np.flatnonzero(~is_open)
                inner, info = lapack.dpotrf(np.asfortranarray(W[np.ix_(o, o)]), lower=1, clean=1)
                # Open nodes that carried the load leave a singular matrix, but for rounding.
                lost = np.diagonal(inner) ** 2 <= len(o) * EPS * np.diagonal(self.inverse)[o]
                if by_load and lost.any():
                    raise np.linalg.LinAlgError(NOT_CARRIED)
                if info == 0:
                    inner, info = lapack.dpotri(inner, lower=1)
                if info != 0:
                    raise np.linalg.LinAlgError(NOT_CARRIED)
                inner = inner + np.tril(inner, -1).T
                across = inner @ W[np.ix_(o, c)]
                T = np.empty_like(W)
                T[np.ix_(o, o)], T[np.ix_(o, c)] = inner, -across
                T[np.ix_(c, o)] = across.T
                T[np.ix_(c, c)] = W[np.ix_(c, c)] - W[np.ix_(c, o)] @ across
                W = T
            self._bases[by_load] = is_open.copy(), W
        return self._bases[by_load][1]

    def system(self, rows: NewtonRows, by_load: bool) -> NewtonSystem:
        """The cheapest of the ways, by multiplications.

        Raises LinAlgError where the states carry no load.
        """
        is_open = np.tile(rows.is_open, self.c)
        if not rows.relaxed.any():
            return _Stuck(self, by_load)
        m, kept = len(self.C), self.base(by_load)
        o, q = int(is_open.sum()), int((~is_open).sum())
        slips = int(rows.relaxed.sum()) - o
        differ = slips + int((is_open != kept).sum())
        inverse = 0.0 if "inverse" in self.__dict__ else m**3 / 3.0 / _SERVES
        turn = inverse + (o**3 / 2.0 + o**2 * q + o * q**2) / _SERVES
        closed = (q + self.B.shape[1]) ** 3 / 3.0 / _SERVES + 3.0 * _PASS * m**2
        products = 3.0 * (1 + _REFINED) * _PASS * m**2
        by_kept = inverse + differ**3 / 3.0 + products
        by_turn = turn + slips**3 / 3.0 + products
        if closed <= min(by_kept, by_turn):
            return ClosedSystem(self, rows, by_load)
        return _Pivoted(self, rows, kept if by_kept <= by_turn else is_open, by_load)


class _Stuck:
    """Everything sticks: y = 0."""

    def __init__(self, of: CoupledSystems, by_load: bool) -> None:
        self.of, self.by_load = of, by_load

    def solve(self, rhs: FloatArray, target: Target) -> Solved:
        of = self.of
        f = of.stuck_forces(target)
        if target.load is None:
            assert target.motion is not None
            return f, target.motion, np.zeros_like(f)
        V, A = of.carried
        return f, A @ target.load - V.T @ target.b, np.zeros_like(f)

    def refined(self, rhs: FloatArray, target: Target) -> Solved:
        return _refined(self, self.of, np.zeros(len(rhs), bool), rhs, target)


class ClosedSystem:
    """The forces of the closed dofs and the rigid motion, dense: the open forces are zero."""

    def __init__(self, of: CoupledSystems, rows: NewtonRows, by_load: bool) -> None:
        self.of, self.by_load = of, by_load
        nodes = np.flatnonzero(~rows.is_open)
        self.nodes, r = nodes, of.B.shape[1] if by_load else 0
        self.dofs = (np.arange(of.c)[:, None] * of.n + nodes).ravel()
        q = self.q = len(self.dofs)
        if by_load and q < r:
            raise np.linalg.LinAlgError(NOT_CARRIED)
        # By rows, which are what is worked on; LAPACK sees the transpose.
        M = np.empty((q + r, q + r))
        M[:q, :q] = of.C.take(self.dofs, axis=0).take(self.dofs, axis=1)
        #: One column of B and one of C are of one size.
        self.unit = np.ones(r)
        if by_load:
            B = of.B[self.dofs]
            size = np.abs(of.B).max(axis=0)
            self.unit = float(np.diagonal(of.C).max()) / size
            M[:q, q:] = -B * self.unit
            M[q:, :q] = (B / size).T
            M[q:, q:] = 0.0
            self.scale = size
        slips = np.flatnonzero(rows.relaxed[nodes, 1])
        place = [j * len(nodes) + slips for j in range(of.c)]
        self.P, self.Q = rows.P[nodes[slips]], rows.Q[nodes[slips]]
        self.place, self.slips = place, slips
        if slips.size:
            M[:q] = self.turned(M[:q])
            for j in range(1, of.c):
                for i in range(of.c):
                    M[place[j], place[i]] += self.P[:, j, i]
        self.size = np.maximum(M.max(axis=1, initial=0.0), -M.min(axis=1, initial=0.0))
        if not (self.size > 0.0).all():
            raise np.linalg.LinAlgError(NOT_CARRIED)
        M /= self.size[:, None]
        norm = float(np.abs(M).sum(axis=1).max(initial=0.0))
        self.lu = _lu(M.T, overwrite=True) if q else None
        if self.lu is not None:
            # Closed nodes that leave a motion free make a singular matrix, but for rounding.
            reciprocal, _ = lapack.dgecon(self.lu[0], norm)
            if reciprocal <= len(M) * EPS:
                raise np.linalg.LinAlgError(NOT_CARRIED)

    @property
    def dear(self) -> bool:
        """Whether another factor costs more than a product with all of C."""
        return self.q**3 / 3.0 > _PASS * len(self.of.C) ** 2

    def turned(self, right: FloatArray) -> FloatArray:
        """Q of the closed rows (q, columns), in place."""
        old = [right[at] for at in self.place]
        for j in range(1, self.of.c):
            row = np.zeros_like(old[j])
            for i in range(self.of.c):
                if self.Q[:, j, i].any():
                    row += self.Q[:, j, i, None] * old[i]
            right[self.place[j]] = row
        return right

    def solved(self, right: FloatArray) -> FloatArray:
        """Forces of the closed dofs, and the motion over `unit`, for their rows and the load over
        `scale`; one column or many.
        """
        if self.lu is None:
            return right
        return lu_solve(self.lu, (right.T / self.size).T, trans=1, check_finite=False)

    def solve(self, rhs: FloatArray, target: Target) -> Solved:
        f, s = self._step(self._asked(rhs, target), target)
        return f, s, self._misfit(f, s, target)

    def _misfit(self, f: FloatArray, s: FloatArray, target: Target) -> FloatArray:
        """y (m,), or columns of it, from forces and motion."""
        C, dofs = self.of.C, self.dofs
        # One product with all of C is cheaper than a copy of its closed columns.
        Cf = C @ f if f.ndim == 1 else C.take(dofs, axis=0).T @ f[dofs]
        return np.asarray(Cf - self.of.B @ s - target.b)

    def refined(self, rhs: FloatArray, target: Target) -> Solved:
        f, s, y = self.solve(rhs, target)
        # What the rows leave, by the unprocessed y; one step gains all digits there are.
        left = self._asked(rhs, Target(-y, None, np.zeros(self.of.B.shape[1])))
        for j in range(1, self.of.c):
            left[self.place[j]] -= sum(
                self.P[:, j, i] * f[self.dofs][self.place[i]] for i in range(self.of.c)
            )
        none = np.zeros_like(s)
        missing = None if target.load is None else target.load - self.of.B.T @ f
        df, ds = self._step(left, Target(target.b, missing, none if missing is None else None))
        f, s = f + df, (s + ds if self.by_load else s)
        return f, s, self._misfit(f, s, target)

    def _asked(self, rhs: FloatArray, target: Target) -> FloatArray:
        """Right-hand sides (q,) of the closed rows: Q (b + B s) + rhs."""
        known = target.b if target.motion is None else target.b + self.of.B @ target.motion
        right = known[self.dofs]
        old = [right[at].copy() for at in self.place]
        for j in range(1, self.of.c):
            value = sum((self.Q[:, j, i] * old[i].T).T for i in range(self.of.c))
            right[self.place[j]] = value + rhs[j * self.of.n + self.nodes[self.slips]]
        return np.asarray(right)

    def _step(self, right: FloatArray, target: Target) -> tuple[FloatArray, FloatArray]:
        q = self.q
        f = np.zeros((len(self.of.C), *right.shape[1:]))
        if self.by_load:
            assert target.load is not None
            right = np.concatenate((right, (target.load.T / self.scale).T))
        found = self.solved(right)
        f[self.dofs] = found[:q]
        if not self.by_load:
            assert target.motion is not None
            return f, target.motion
        return f, (found[q:].T * self.unit).T


class _Pivoted:
    """Only the rows R that differ from those of the base (open: f = 0, closed: y = 0) are solved
    for: with z = z0 + T x and x = 0 off R, k^3 operations for k of them.
    """

    def __init__(
        self, of: CoupledSystems, rows: NewtonRows, base: BoolArray, by_load: bool
    ) -> None:
        self.of, self.by_load, self.base = of, by_load, base
        is_open = self.is_open = np.tile(rows.is_open, of.c)
        relaxed = rows.relaxed.T.ravel()
        self.T = of.turned(base, by_load)
        self.R = np.flatnonzero((relaxed & ~is_open) | (is_open != base))
        R = self.R
        component, node = np.divmod(R, of.n)
        place = np.full(len(base), -1)
        place[R] = np.arange(len(R))
        H = np.zeros((len(R), len(R)))
        self._parts = []
        for j in range(of.c):
            p, q, dof = rows.P[node, component, j], rows.Q[node, component, j], j * of.n + node
            # z holds y of the base's open dofs and f of the others, x the other of both.
            by_z, by_x = np.where(base[dof], q, p), np.where(base[dof], p, q)
            on = np.flatnonzero(by_z)
            H[on] += by_z[on, None] * self.T[np.ix_(dof[on], R)]
            self._parts.append((on, by_z[on], dof[on]))
            with_x = np.flatnonzero((by_x != 0.0) & (place[dof] >= 0))
            H[with_x, place[dof[with_x]]] += by_x[with_x]
        # Rows of forces and of displacements are many powers of ten apart.
        self._size = np.abs(H).max(axis=1, initial=0.0)
        if not (self._size > 0.0).all():
            raise np.linalg.LinAlgError(NOT_CARRIED)
        self._factor = _lu(H / self._size[:, None]) if len(R) else None

    def solve(self, rhs: FloatArray, target: Target) -> Solved:
        of, R, base = self.of, self.R, self.base
        f0 = of.stuck_forces(target)
        known = np.zeros_like(f0)
        known[base] = f0[base]
        # f0 where closed, less what makes the open forces vanish.
        z = np.where(_column(base, f0), 0.0, f0) - self.T @ known
        x = np.zeros_like(f0)
        if self._factor is not None:
            right = rhs[R].copy()
            for on, factor, dof in self._parts:
                right[on] -= (factor * z[dof].T).T
            x[R] = lu_solve(self._factor, (right.T / self._size).T)
            z = z + self.T[:, R] @ x[R]
        is_base = _column(base, f0)
        f, y = np.where(is_base, x, z), np.where(is_base, z, x)
        if target.load is None:
            assert target.motion is not None
            return f, target.motion, y
        V, A = of.carried
        return f, A @ target.load - V.T @ (target.b + y), y

    def refined(self, rhs: FloatArray, target: Target) -> Solved:
        return _refined(self, self.of, self.is_open, rhs, target)


def _refined(
    system: NewtonSystem, of: CoupledSystems, is_open: BoolArray, rhs: FloatArray, target: Target
) -> Solved:
    """Iterative refinement of an answer that rests on C^-1.

    Everything closed takes forces that are many times those of a few nodes, and their rounding.
    """
    f, s, y = system.solve(rhs, target)
    none = np.zeros_like(rhs)
    for _ in range(_REFINED):
        f[is_open] = 0.0
        there = of.C @ f - of.B @ s - target.b
        y[is_open] = there[is_open]
        missing = None if target.load is None else target.load - of.B.T @ f
        still = np.zeros_like(s) if target.load is None else None
        df, ds, dy = system.solve(none, Target(y - there, missing, still))
        f, y = f + df, y + dy
        s = s if target.load is None else s + ds
    f[is_open] = 0.0
    return f, s, y


def _column(mask: BoolArray, like: FloatArray) -> BoolArray:
    return mask if like.ndim == 1 else mask[:, None]


def _lu(A: FloatArray, *, overwrite: bool = False) -> tuple[FloatArray, IntArray]:
    lu, pivots, info = lapack.dgetrf(A, overwrite_a=overwrite)
    if info != 0:
        raise np.linalg.LinAlgError("the states leave no unique answer")
    return lu, pivots
