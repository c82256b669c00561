"""Newton's correction from a factor of other states: a border for the nodes that changed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, lu_factor, lu_solve

from upd.contact.checks import EPS
from upd.contact.coulomb_conditions import NewtonRows
from upd.contact.coupled_systems import ClosedSystem
from upd.linalg.gmres import gmres

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


#: A Newton step from a kept factor is solved to this share of what its rows leave ...
_INEXACT = 1e-3
#: ... in this many products with C and the factor at most: more cost as much as a new factor.
_KRYLOV = 8

Correction = tuple[FloatArray, FloatArray]


@dataclass
class Bordered:
    """Newton steps of other rows with the factor of `base`.

    With the base's system M x = r, x = (f of its closed dofs, s), a set R of its rows that others
    take the place of, and u the forces of nodes that closed since,

        M x + E z + A u = r,   L x + D u = l,

    E the unit columns of R, whose rows z leaves free, A the columns of u, and L, D, l the new rows
    of R and of u. The border S = (L X - (0, D)), X = M^-1 (E, A), has as many rows as changed. The
    columns of X by E are kept: few are new from one iterate to the next. Nodes that slip still but
    another way are left to a few steps of GMRES that this preconditions [1]_.

    References
    ----------
    .. [1] Y. Saad, SIAM J. Sci. Comput. 14 (1993) 461: flexible GMRES.
    """

    base: ClosedSystem

    def __post_init__(self) -> None:
        of, base = self.base.of, self.base
        self.rows = base.rows
        self._place = np.full((of.c, of.n), -1)
        self._place[:, base.nodes] = np.arange(base.q).reshape(of.c, -1)
        #: compliance (q, q) of the closed dofs, beside which no others have forces
        self._block = of.C.take(base.dofs, axis=0).take(base.dofs, axis=1)
        self._known: dict[int, FloatArray] = {}
        self._last: tuple[NewtonRows, _Border] | None = None

    def changed(self, rows: NewtonRows) -> int:
        """How many forces and rows other rows change: the size of their border."""
        was_open, is_open = self.rows.is_open, rows.is_open
        moved = (self.rows.relaxed != rows.relaxed).any(axis=1)
        return self.base.of.c * int((was_open ^ is_open).sum()) + (
            self.base.of.c - self.base.of.first
        ) * int((moved & ~was_open & ~is_open).sum())

    def step(
        self, rows: NewtonRows, left: FloatArray, missing: FloatArray | None, rho: FloatArray
    ) -> Correction | None:
        """df (m,) and ds (r,), with P df + Q (C df - B ds) = left and B'df = missing.

        None where too many states differ, or the directions of slip do too much: where it is as
        dear as a factor of their own.

        Parameters
        ----------
        left : (n, c) ndarray
            What the rows leave.
        missing : (r,) ndarray, optional
            Load; None: the motion is given.
        rho : (n, c) ndarray
            Weight of displacements against forces [N/mm].
        """
        of, base = self.base.of, self.base
        border = self._border(rows)
        if border is None:
            return None
        weight = np.where(rows.relaxed, 1.0, rho)
        none = np.zeros(0)
        size = base.scale if missing is not None else none
        mine, others, G = base.dofs, border.dofs, border.across

        def product(x: FloatArray) -> FloatArray:
            df, ds = np.split(x, [len(of.C)])
            y = -of.B @ ds
            y[mine] += self._block @ df[mine]
            if len(others):
                y[mine] += G[:, : base.q].T @ df[others]
                y[others] += G @ np.concatenate((df[mine], df[others]))
            y = y.reshape(of.c, of.n)
            out = np.einsum("nij,jn->ni", rows.P, df.reshape(of.c, of.n))
            out += np.einsum("nij,jn->ni", rows.Q, y)
            return np.concatenate(
                ((weight * out).ravel(), none if missing is None else of.B.T @ df / size)
            )

        def near(v: FloatArray) -> FloatArray:
            rest = v[: left.size].reshape(left.shape) / weight
            return np.concatenate(
                self._solved(border, rest, None if missing is None else v[left.size :] * size)
            )

        r = np.concatenate(((weight * left).ravel(), none if missing is None else missing / size))
        found = gmres(product, r, _INEXACT, _KRYLOV, near)
        df, ds = np.split(found.x, [len(of.C)])
        return (df, ds) if found.reached else None

    def _border(self, rows: NewtonRows) -> _Border | None:
        """The border of other rows; None where it is as dear as a factor, or singular."""
        if self._last is not None and self._last[0].same_states(rows):
            return self._last[1]
        of, q = self.base.of, self.base.q
        was_open, is_open = self.rows.is_open, rows.is_open
        moved = (self.rows.relaxed != rows.relaxed).any(axis=1) & ~was_open
        # Which rows of which nodes are new: all of those that opened or closed, the tangential ones
        # of those that stick or slip.
        new = np.zeros((of.c, of.n), bool)
        new[of.first :, moved] = True
        new[: of.first, moved & is_open] = True
        joined = np.flatnonzero(was_open & ~is_open)
        R = self._place[new]
        k = len(R) + of.c * len(joined)
        if 3 * (k * q**2 + q * k**2) + k**3 > q**3:
            return None
        j, node = np.nonzero(new)
        j = np.concatenate((j, np.repeat(np.arange(of.c), len(joined))))
        node = np.concatenate((node, np.tile(joined, of.c)))
        dofs = (np.arange(of.c)[:, None] * of.n + joined).ravel()
        across = of.C.take(dofs, axis=0).take(np.concatenate((self.base.dofs, dofs)), axis=1)
        X = self._columns(R, dofs, across)
        L, D = self._new_rows(rows, j, node, dofs)
        S = L @ X
        S[:, len(R) :] -= D
        size = np.abs(S).max(axis=1, initial=0.0)
        if not (np.isfinite(size).all() and (size > 0.0).all()):
            return None
        S /= size[:, None]
        lu = None
        if k:
            norm = float(np.abs(S).sum(axis=0).max())
            lu = lu_factor(S, check_finite=False, overwrite_a=True)
            reciprocal, _ = lapack.dgecon(lu[0], norm)
            if not reciprocal > k * EPS:
                return None
        border = _Border(j, node, dofs, across, len(R), L, X, size, lu)
        self._last = rows, border
        return border

    def _solved(self, border: _Border, left: FloatArray, missing: FloatArray | None) -> Correction:
        """df and ds with the base's directions of slip."""
        of, base = self.base.of, self.base
        right = left.T.ravel()[base.dofs]
        if missing is not None:
            right = np.concatenate((right, missing / base.scale))
        x = base.solved(right)
        df = np.zeros(len(of.C))
        if border.lu is not None:
            off = (border.L @ x - left[border.node, border.j]) / border.size
            z = lu_solve(border.lu, off, check_finite=False)
            x -= border.X @ z
            df[border.dofs] = z[border.rows :]
        df[base.dofs] = x[: base.q]
        return df, x[base.q :] * base.unit if base.by_load else np.zeros(of.B.shape[1])

    def _columns(self, R: IntArray, dofs: IntArray, across: FloatArray) -> FloatArray:
        """X: M^-1 of the unit columns R, and of the columns of `dofs`."""
        of, base, q = self.base.of, self.base, self.base.q
        fresh = [i for i in R.tolist() if i not in self._known]
        right = np.zeros((q + len(base.unit), len(fresh) + len(dofs)), order="F")
        right[fresh, np.arange(len(fresh))] = 1.0
        if len(dofs):
            right[:q, len(fresh) :] = base.turned(across[:, :q].T.copy())
            if base.by_load:
                right[q:, len(fresh) :] = (of.B[dofs] / base.scale).T
        found = base.solved(right)
        self._known.update(zip(fresh, found.T[: len(fresh)], strict=True))
        X = np.empty((len(found), len(R) + len(dofs)), order="F")
        for at, i in enumerate(R.tolist()):
            X[:, at] = self._known[i]
        X[:, len(R) :] = found[:, len(fresh) :]
        return X

    def _new_rows(
        self, rows: NewtonRows, j: IntArray, node: IntArray, dofs: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """L and D: rows j of nodes, by the base's unknowns and by the forces of `dofs`."""
        of, base, q = self.base.of, self.base, self.base.q
        P, Q = rows.P[node, j], rows.Q[node, j]
        L = np.zeros((len(j), q + len(base.unit)))
        D = np.zeros((len(j), len(dofs)))
        at = np.full(len(of.C), -1)
        at[dofs] = np.arange(len(dofs))
        for i in range(of.c):
            dof = i * of.n + node
            on = np.flatnonzero(Q[:, i])
            if on.size:
                C = of.C.take(dof[on], axis=0)
                L[on, :q] += Q[on, i, None] * C.take(base.dofs, axis=1)
                D[on] += Q[on, i, None] * C.take(dofs, axis=1)
                if base.by_load:
                    L[on, q:] -= Q[on, i, None] * of.B[dof[on]] * base.unit
            place = self._place[i, node]
            old = np.flatnonzero(place >= 0)
            L[old, place[old]] += P[old, i]
            added = np.flatnonzero(at[dof] >= 0)
            D[added, at[dof[added]]] += P[added, i]
        return L, D


@dataclass(frozen=True)
class _Border:
    """New rows j of nodes, the forces `dofs` of nodes that closed with their compliance across to
    the base's and their own; L, X and S, factored."""

    j: IntArray
    node: IntArray
    dofs: IntArray
    across: FloatArray
    rows: int
    L: FloatArray
    X: FloatArray
    size: FloatArray
    lu: tuple[FloatArray, NDArray[np.signedinteger[Any]]] | None
