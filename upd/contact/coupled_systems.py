"""Newton's linear systems of coupled contact.

Two ways lead to the same iterate. Everything stuck: the factor of C. Otherwise the equations of the
closed dofs alone, dense.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, lu_solve

from upd.contact.checks import EPS
from upd.contact.coulomb_conditions import AskedStep, CoulombConditions, NewtonRows

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

NOT_CARRIED = "nothing touches and carries the load"
#: A product of a matrix with a vector waits for memory and costs so much more, for weighing only.
_PASS = 10.0
#: Refinements behind the factor of C; each gains the digits that its condition leaves.
_REFINED = 2


Solved = tuple[FloatArray, FloatArray, FloatArray]


@dataclass
class Stuck:
    """Everything sticks: y = 0."""

    of: CoulombConditions
    rows: NewtonRows
    by_load: bool

    def solve(self, rhs: FloatArray, target: AskedStep) -> Solved:
        of = self.of
        if target.load is None:
            assert target.motion is not None
            f = of.solved(target.b + of.B @ target.motion)
            return f, target.motion, np.zeros_like(f)
        V, A = of.carried
        # W b: what C^-1 b leaves of the load is taken back.
        first = of.solved(target.b)
        f = np.asarray(first + V @ (target.load - of.B.T @ first))
        return f, A @ target.load - V.T @ target.b, np.zeros_like(f)

    def refined(self, rhs: FloatArray, target: AskedStep) -> Solved:
        of, (f, s, y) = self.of, self.solve(rhs, target)
        for _ in range(_REFINED):
            there = of.C @ f - of.B @ s - target.b
            missing = None if target.load is None else target.load - of.B.T @ f
            still = np.zeros_like(s) if target.load is None else None
            df, ds, _ = self.solve(rhs, AskedStep(-there, missing, still))
            f, s = f + df, s + ds
        return f, s, y


class ClosedSystem:
    """The forces of the closed dofs and the rigid motion, dense: the open forces are zero."""

    def __init__(self, of: CoulombConditions, rows: NewtonRows, by_load: bool) -> None:
        self.of, self.rows, self.by_load = of, rows, by_load
        nodes = np.flatnonzero(~rows.is_open)
        self.nodes, r = nodes, of.B.shape[1] if by_load else 0
        self.dofs = (np.arange(of.c)[:, None] * of.n + nodes).ravel()
        q = self.q = len(self.dofs)
        #: whether another factor costs more than a product with all of C
        self.dear = q**3 / 3.0 > _PASS * len(of.C) ** 2
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
        slips = np.flatnonzero(rows.relaxed[nodes, -1])
        place = [j * len(nodes) + slips for j in range(of.c)]
        self.P, self.Q = rows.P[nodes[slips]], rows.Q[nodes[slips]]
        self.place, self.slips = place, slips
        if slips.size:
            M[:q] = self.turned(M[:q])
            for j in range(of.first, of.c):
                for i in range(of.c):
                    M[place[j], place[i]] += self.P[:, j, i]
        self.size = np.maximum(M.max(axis=1, initial=0.0), -M.min(axis=1, initial=0.0))
        if not (self.size > 0.0).all():
            raise np.linalg.LinAlgError(NOT_CARRIED)
        M /= self.size[:, None]
        if by_load and of.near_limit:
            # No slip row resists a shift by much there: by powers of two, exactly.
            width = np.abs(M[:, q:]).max(axis=0)
            if not (width > len(M) * EPS).all():
                raise np.linalg.LinAlgError(NOT_CARRIED)
            more = np.exp2(-np.floor(np.log2(width)))
            M[:, q:] *= more
            self.unit = self.unit * more
        norm = float(np.abs(M).sum(axis=1).max(initial=0.0))
        self.lu: tuple[FloatArray, IntArray] | None = None
        if q:
            lu, pivots, info = lapack.dgetrf(M.T, overwrite_a=True)
            if info != 0:
                raise np.linalg.LinAlgError("the states leave no unique answer")
            self.lu = lu, pivots
            # Closed nodes that leave a motion free make a singular matrix, but for rounding.
            reciprocal, _ = lapack.dgecon(lu, norm)
            if reciprocal <= len(M) * EPS:
                raise np.linalg.LinAlgError(NOT_CARRIED)

    def turned(self, right: FloatArray) -> FloatArray:
        """Q of the closed rows (q,) or (q, columns), in place."""
        old = [right[at] for at in self.place]
        for j in range(self.of.first, self.of.c):
            row = np.zeros_like(old[j])
            for i in range(self.of.c):
                if self.Q[:, j, i].any():
                    row += (self.Q[:, j, i] * old[i].T).T
            right[self.place[j]] = row
        return right

    def solved(self, right: FloatArray) -> FloatArray:
        """Forces of the closed dofs, and the motion over `unit`, for their rows and the load over
        `scale`; one column or many.
        """
        if self.lu is None:
            return right
        return lu_solve(self.lu, (right.T / self.size).T, trans=1, check_finite=False)

    def solve(self, rhs: FloatArray, target: AskedStep) -> Solved:
        f, s = self._step(self._asked(rhs, target), target)
        return f, s, self._misfit(f, s, target)

    def _misfit(self, f: FloatArray, s: FloatArray, target: AskedStep) -> FloatArray:
        """y (m,), or columns of it, from forces and motion."""
        C, dofs = self.of.C, self.dofs
        # One product with all of C is cheaper than a copy of its closed columns.
        Cf = C @ f if f.ndim == 1 else C.take(dofs, axis=0).T @ f[dofs]
        return np.asarray(Cf - self.of.B @ s - target.b)

    def refined(self, rhs: FloatArray, target: AskedStep) -> Solved:
        f, s, y = self.solve(rhs, target)
        # What the rows leave, by the unprocessed y; one step gains all digits there are.
        left = self._asked(rhs, AskedStep(-y, None, np.zeros(self.of.B.shape[1])))
        for j in range(self.of.first, self.of.c):
            left[self.place[j]] -= sum(
                self.P[:, j, i] * f[self.dofs][self.place[i]] for i in range(self.of.c)
            )
        none = np.zeros_like(s)
        missing = None if target.load is None else target.load - self.of.B.T @ f
        df, ds = self._step(left, AskedStep(target.b, missing, none if missing is None else None))
        f, s = f + df, (s + ds if self.by_load else s)
        return f, s, self._misfit(f, s, target)

    def _asked(self, rhs: FloatArray, target: AskedStep) -> FloatArray:
        """Right-hand sides (q,) of the closed rows: Q (b + B s) + rhs."""
        known = target.b if target.motion is None else target.b + self.of.B @ target.motion
        right = self.turned(known[self.dofs])
        for j in range(self.of.first, self.of.c):
            right[self.place[j]] += rhs[j * self.of.n + self.nodes[self.slips]]
        return right

    def _step(self, right: FloatArray, target: AskedStep) -> tuple[FloatArray, FloatArray]:
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


#: Newton's rows, factored; `solve` gives f, s and y for rhs (m,) or (m, columns), `refined` the
#: same for one column, to rounding
NewtonSystem = Stuck | ClosedSystem
