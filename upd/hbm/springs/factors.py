"""Newton's equations of the balance, condensed to what moves.

The Jacobian of the balance is I + G df/dw. Where df/dw is a constant stiffness K_s, at points that
stick or are open over the whole cycle, its columns couple the coefficients of one harmonic only:
their unknowns are eliminated harmonic by harmonic, exactly, with A = I + G_ss K_s,

    G' = G_mm - G_ms K_s A^-1 G_sm,   R' = R_m - G_ms K_s A^-1 R_s,

and the factors are those of the points that move. Where the rows Psi of the contacts have a lower
rank than there are rows, w = U y + rest and the factors are those of I + U'G U U'(df/dw)U, so that
they do not grow with the number of points.

Both are the same Newton correction, in the same order, as that of the whole matrix: det A > 0, for
K_s is not negative and every harmonic above 0 gives a conjugate pair, so that the sign of the
determinant is kept too.

References
----------
F. Zhang (ed.), The Schur Complement and Its Applications (2005), ch. 1; W. W. Hager, Updating the
inverse of a matrix, SIAM Review 31 (1989), for the low rank.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from upd.hbm.springs.linearised import Linearised
from upd.hbm.springs.terms import MOVES, STICKS, bordered, by_harmonic

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)


class Factors:
    """LU of the condensed [[J, r_p], [normal]] in scaled unknowns and equations.

    Attributes
    ----------
    singular : bool
        Whether a pivot is zero.
    sign : float
        Sign of the determinant, up to a factor that never changes on a path.
    ratio : float
        Smallest over largest pivot.
    """

    singular: bool
    sign: float
    ratio: float

    def __init__(
        self, J: Linearised, dp: FloatArray, D: FloatArray, p_scale: float, normal: FloatArray
    ) -> None:
        self.J, self.p_scale, self.D, self.normal = J, p_scale, D, normal
        c = len(J.rows.Psi)
        self.c, self.size = c, J.offset + 2 * len(J.w)
        self.n = c * self.size
        self.dp, self.dp_rigid = dp[: self.n].reshape(c, self.size), dp[self.n :]

    def _factorise(
        self,
        real: FloatArray,
        imag: FloatArray,
        G0: FloatArray,
        R: FloatArray,
        below: FloatArray,
        DF: FloatArray,
        D: FloatArray,
        normal: FloatArray,
        q: FloatArray,
        column: FloatArray,
        last: float,
    ) -> None:
        A, self.rows = bordered(
            real,
            imag,
            G0,
            R,
            below,
            DF,
            self.J.offset == 1,
            D,
            self.D[self.n :],
            normal,
            q,
            column,
            last,
        )
        self.lu, self.piv, info = lapack.dgetrf(A.T, overwrite_a=True)
        diagonal = np.diagonal(self.lu)
        size = np.abs(diagonal)
        self.singular = info != 0 or not np.isfinite(size).all()
        if self.singular:
            self.sign, self.ratio = 0.0, EPS
            return
        swaps = int(np.count_nonzero(self.piv != np.arange(len(size))))
        negative = int(np.count_nonzero(diagonal < 0.0))
        self.sign = 1.0 if (swaps + negative) % 2 == 0 else -1.0
        self.ratio = max(float(size.min() / size.max()), EPS)

    def _condensed(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled unknowns of the condensed equations."""
        right = np.empty(len(self.rows) + 1)
        np.divide(r, self.rows, out=right[:-1])
        right[-1] = last
        return np.asarray(lapack.dgetrs(self.lu, self.piv, right, overwrite_b=True)[0])

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        raise NotImplementedError

    def tangent(self) -> FloatArray:
        """Unit vector along the path, on the side the border points to."""
        t = self.solve(np.zeros(len(self.D)), 1.0)
        return np.asarray(t / np.linalg.norm(t))


class EveryPoint(Factors):
    """Every point has its unknowns."""

    def __init__(
        self, J: Linearised, dp: FloatArray, D: FloatArray, p_scale: float, normal: FloatArray
    ) -> None:
        super().__init__(J, dp, D, p_scale, normal)
        real, imag = J.receptance(J.rows.Psi, J.rows.transposed)
        c, size, n = self.c, self.size, self.n
        rigid = len(D) - n
        self._factorise(
            real,
            imag,
            J.G0,
            J.R,
            np.zeros((rigid, rigid)),
            J.DF if len(J.DF) == len(J.state) else J.every_derivative(),
            np.ascontiguousarray(D[:n].reshape(c, size).T),
            self._by_coefficient(normal[:-1]),
            np.zeros((size, c)),
            self._by_coefficient(dp) * p_scale,
            float(normal[-1]),
        )

    def _by_coefficient(self, x: FloatArray) -> FloatArray:
        out = x.copy()
        out[: self.n].reshape(self.size, self.c)[:] = x[: self.n].reshape(self.c, self.size).T
        return out

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        found = self._condensed(self._by_coefficient(r), last)
        out = found.copy()
        out[: self.n].reshape(self.c, self.size)[:] = found[: self.n].reshape(self.size, self.c).T
        return out


class Eliminated(Factors):
    """Points that stick or are open over the whole cycle are eliminated first."""

    def __init__(
        self, J: Linearised, dp: FloatArray, D: FloatArray, p_scale: float, normal: FloatArray
    ) -> None:
        super().__init__(J, dp, D, p_scale, normal)
        c, size, n, static = self.c, self.size, self.n, J.offset == 1
        d1 = J.stiffness.shape[1]
        held = np.repeat(J.state != MOVES, d1)
        s, m = np.flatnonzero(held), np.flatnonzero(~held)
        self.s, self.m = s, m
        K = np.where(J.state[:, None] == STICKS, J.stiffness, 0.0).ravel()[s]
        real, imag = J.receptance(J.rows.Psi, J.rows.transposed)
        G = real + 1j * imag
        one, down, own = np.eye(len(s)), s[:, None], m[:, None]
        # (I + G_ss K)^-1 and with it G_sm
        self.inverse = np.linalg.inv(one + G[:, down, s] * K)
        self.across = self.inverse @ G[:, down, m]
        self.back = np.ascontiguousarray(np.swapaxes(self.across, 1, 2) * K)
        G = G[:, own, m] - self.back @ G[:, down, m]
        rigid_s = J.R[s]
        self.inverse0, self.across0 = np.zeros((len(s), len(s))), np.zeros((len(s), len(m)))
        self.back0, self.pull = np.zeros((len(m), len(s))), np.zeros((J.R.shape[1], len(s)))
        R, below, G0 = J.R[m], np.zeros((J.R.shape[1],) * 2), np.zeros((len(m), len(m)))
        if static:
            self.inverse0 = np.asarray(np.linalg.inv(one + J.G0[down, s] * K))
            self.across0 = self.inverse0 @ J.G0[down, m]
            self.back0 = np.ascontiguousarray(self.across0.T * K)
            self.pull = (rigid_s.T * K) @ self.inverse0
            G0 = J.G0[own, m] - self.back0 @ J.G0[down, m]
            R, below = R - self.back0 @ rigid_s, self.pull @ rigid_s
        self.by_rigid = self.inverse0 @ rigid_s
        scaled = normal[:n].reshape(c, size)
        self.V = scaled[s] / D[:n].reshape(c, size)[s]
        # the border on the held points is one on the forces of the others
        q = np.einsum("ks,ksm->km", J.complex_part(self.V).conj(), self.across)
        by_force = J.real_part(-q.conj(), -(self.V[:, 0] @ self.across0))
        column, share, self.moved_by_p = self._reduced(self.dp, self.dp_rigid)
        border_rigid = normal[n:-1] + D[n:] * (self.V[:, 0] @ self.by_rigid)
        self._factorise(
            np.ascontiguousarray(G.real),
            np.ascontiguousarray(G.imag),
            G0,
            R,
            below,
            J.DF,
            np.ascontiguousarray(D[:n].reshape(c, size)[m].T),
            np.concatenate([scaled[m].T.ravel(), border_rigid]),
            np.ascontiguousarray(by_force.T),
            column * p_scale,
            float(normal[-1]) - p_scale * share,
        )

    def _reduced(self, b: FloatArray, b_rigid: FloatArray) -> tuple[FloatArray, float, FloatArray]:
        """Right-hand side of the condensed equations, and what the held points do to it.

        Their share in the border, and their motion with the others at rest.
        """
        own, static = np.ascontiguousarray(b[self.s]), self.J.offset == 1
        inside = by_harmonic(self.inverse, self.inverse0, static, own)
        top = b[self.m] - by_harmonic(self.back, self.back0, static, own)
        below = b_rigid - self.pull @ own[:, 0]
        return np.concatenate([top.T.ravel(), below]), float((self.V * inside).sum()), inside

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        n, c, size, static = self.n, self.c, self.size, self.J.offset == 1
        right, share, inside = self._reduced(r[:n].reshape(c, size), r[n:])
        found = self._condensed(right, last - share)
        k, D = size * len(self.m), self.D[:n].reshape(c, size)
        out, p = np.empty(len(r) + 1), float(found[-1])
        w = found[:k].reshape(size, len(self.m)).T
        DF, block = self.J.DF, self.J.stiffness.shape[1] * size
        force = np.matmul(
            DF.reshape(len(DF), block, block), (w * D[self.m]).reshape(len(DF), block, 1)
        ).reshape(len(self.m), size)
        held = inside - p * self.p_scale * self.moved_by_p
        held -= by_harmonic(self.across, self.across0, static, force)
        held[:, 0] += self.by_rigid @ (found[k:-1] * self.D[n:])
        whole = out[:n].reshape(c, size)
        whole[self.m] = w
        whole[self.s] = held / D[self.s]
        out[n:] = found[k:]
        return out


class LowRank(Factors):
    """The motion of the rows in a basis of fewer, and what no mode moves beside it."""

    def __init__(
        self,
        J: Linearised,
        dp: FloatArray,
        D: FloatArray,
        p_scale: float,
        normal: FloatArray,
    ) -> None:
        super().__init__(J, dp, D, p_scale, normal)
        basis = J.rows.basis
        assert basis is not None
        c, size, n, r = self.c, self.size, self.n, basis.shape[1]
        self.U, d1 = basis, J.stiffness.shape[1]
        moves = J.state == MOVES
        U = basis.reshape(len(moves), d1, r)
        self.moves = moves
        self.K = np.where(J.state[:, None] == STICKS, J.stiffness, 0.0)
        part = J.DF.transpose(0, 2, 4, 1, 3).reshape(-1, size * size, d1, d1)
        Um = U[moves]
        half = np.matmul(part, Um[:, None])
        # (r, points d1) times (points d1, size size r)
        H = Um.reshape(-1, r).T @ half.transpose(0, 2, 1, 3).reshape(-1, size * size * r)
        H = H.reshape(r, size, size, r)
        held = (basis.T * self.K.ravel()) @ basis
        place = np.arange(size)
        H[:, place, place, :] += held[:, None, :]
        DF = np.ascontiguousarray(H.transpose(0, 1, 3, 2))[None]
        Psi = basis.T @ J.rows.Psi
        real, imag = J.receptance(Psi, np.ascontiguousarray(Psi.T))
        # one size for all coordinates of a coefficient
        unit = D[:n].reshape(c, size).max(axis=0)
        self.unit = np.repeat(unit, r)
        self.border = (normal[:n] / D[:n]).reshape(c, size)
        self.G, self.G0, self.R = real + 1j * imag, basis.T @ J.G0 @ basis, basis.T @ J.R
        rigid = len(D) - n
        column = np.concatenate([(basis.T @ self.dp).T.ravel(), self.dp_rigid])
        self._factorise(
            real,
            imag,
            self.G0,
            self.R,
            np.zeros((rigid, rigid)),
            DF,
            np.repeat(unit[:, None], r, axis=1),
            np.concatenate([(basis.T @ self.border).T.ravel() * self.unit, normal[n:-1]]),
            np.zeros((size, r)),
            column * p_scale,
            float(normal[-1]),
        )

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        n, c, size, U = self.n, self.c, self.size, self.U
        b = r[:n].reshape(c, size)
        inside = U.T @ b
        # no mode moves the rest: it goes at once, and its forces move the rest
        left = b - U @ inside
        f = U.T @ self.J.force(left)
        moved = by_harmonic(self.G, self.G0, self.J.offset == 1, f)
        below = r[n:] - self.R.T @ f[:, 0]
        right = np.concatenate([(inside - moved).T.ravel(), below])
        found = self._condensed(right, last - float((self.border * left).sum()))
        k = size * U.shape[1]
        y = (found[:k] * self.unit).reshape(size, -1).T
        out = np.empty(len(r) + 1)
        out[:n] = (U @ y + left).ravel() / self.D[:n]
        out[n:] = found[k:]
        return out
