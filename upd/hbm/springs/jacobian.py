"""The Jacobian of the balance in parts, and Newton's equations condensed to what moves.

The Jacobian I + G df/dw couples the harmonics through the forces of points that move, where df/dw
is full. Where df/dw is a constant stiffness K_s, at points that
stick or are open over the whole cycle, its columns couple the coefficients of one harmonic only:
their unknowns are eliminated harmonic by harmonic, exactly, with A = I + G_ss K_s,

    G' = G_mm - G_ms K_s A^-1 G_sm,   R' = R_m - G_ms K_s A^-1 R_s,

and the factors are those of the points that move. Where the rows Psi of the contacts have a lower
rank than there are rows, w = U y + rest and the factors are those of I + U'G U U'(df/dw)U, so that
they do not grow with the number of points.

Both are the same Newton correction, in the same order, as that of the whole matrix: det A > 0, for
K_s is not negative and every harmonic above 0 gives a conjugate pair, so that the sign of the
determinant is kept too.

G is symmetric where all harmonics have the same real rows Psi. Those of a travelling wave are
complex, Psi_k for each harmonic, and G_k = Psi_k D_k^-1 Psi_k^H is not.

References
----------
F. Zhang (ed.), The Schur Complement and Its Applications (2005), ch. 1; W. W. Hager, Updating the
inverse of a matrix, SIAM Review 31 (1989), for the low rank.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.factors import EPS, WORTH_KEEPING, Border, BorderedFactors, Factors, KeptFactors
from upd.hbm.springs.modal import Modal
from upd.hbm.springs.terms import MOVES, STICKS, bordered, by_harmonic, residual_terms

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: operations of the factors that points held must save before they are eliminated: about what the
#: calls of the elimination take
WORTH = 2e6


@dataclass(frozen=True)
class LinearPart:
    """The linear system as the contacts see it: what never changes on a curve.

    Attributes
    ----------
    modal : Modal
        The linear system, or one for each harmonic above 0.
    Psi : (c, m) ndarray, or (n_k, c, m) of complex
        Rows of the contacts on its modes.
    G0 : (c, c) ndarray
        Static compliance [mm/N].
    R : (c, n_rigid) ndarray
        Rigid modes at the rows, none without harmonic 0.
    k : (n_k,) ndarray of float
        Harmonics above 0.
    offset : int
        Coefficients before theirs, 1 with harmonic 0.
    kept : KeptFactors
        The newest large factors of equations with these rows.
    """

    modal: Modal
    Psi: FloatArray
    G0: FloatArray
    R: FloatArray
    k: FloatArray
    offset: int
    kept: KeptFactors = field(default_factory=KeptFactors)

    @cached_property
    def transposed(self) -> FloatArray:
        """Conjugate transpose of the rows, (m, c) or (n_k, m, c)."""
        return np.ascontiguousarray(np.swapaxes(self.Psi.conj(), -1, -2))

    @cached_property
    def damping(self) -> FloatArray:
        """Modal damping (m, m), or one row (1, m) where it is diagonal."""
        return np.ascontiguousarray(np.atleast_2d(self.modal.damping))

    @cached_property
    def basis(self) -> FloatArray | None:
        """Orthonormal basis (c, r) of the columns of real rows where r < c."""
        if not self.symmetric:
            return None
        U, size, _ = np.linalg.svd(self.Psi, full_matrices=False)
        rank = int(np.count_nonzero(size > max(self.Psi.shape) * EPS * size.max(initial=0.0)))
        return np.ascontiguousarray(U[:, :rank]) if 0 < rank < len(self.Psi) else None

    @property
    def size(self) -> int:
        """Coefficients per signal."""
        return self.offset + 2 * len(self.k)

    @property
    def symmetric(self) -> bool:
        """Whether one real Psi serves all harmonics."""
        return self.Psi.ndim == 2

    def shifted(self, xi: float) -> LinearPart:
        """The same system with xi [1/s] off its modal damping, C - xi M."""
        off = xi if self.modal.proportional else xi * np.eye(len(self.modal.eigenvalues))
        return replace(self, modal=replace(self.modal, damping=self.modal.damping - off))

    def pushes(self, f: ComplexArray) -> ComplexArray:
        """Modal forces (n_k, m) of amplitudes (n_k, c) of forces on the rows."""
        if self.symmetric:
            return np.asarray(f @ self.Psi)
        return np.asarray((self.transposed @ f[:, :, None])[..., 0])

    def moves(self, eta: ComplexArray) -> ComplexArray:
        """Motion (n_k, c) of the rows with modal amplitudes (n_k, m)."""
        if self.symmetric:
            return np.asarray(eta @ self.Psi.T)
        return np.asarray((self.Psi @ eta[:, :, None])[..., 0])

    def damped(self, eta: ComplexArray) -> ComplexArray:
        """Modal damping times amplitudes (n_k, m)."""
        c = self.modal.damping
        return np.asarray(c * eta if self.modal.proportional else (c @ eta[:, :, None])[..., 0])

    def residual(
        self,
        W: FloatArray,
        a: FloatArray,
        F: FloatArray,
        omega: float,
        acting: tuple[ComplexArray, FloatArray, FloatArray],
        slopes: bool,
    ) -> tuple[FloatArray, FloatArray]:
        """Residual and its derivative by omega, see `upd.hbm.springs.terms.residual_terms`."""
        if self.symmetric:
            m = self.modal
            linear = m.eigenvalues, m.rigid, self.damping, self.Psi, self.transposed
            found: tuple[FloatArray, FloatArray] = residual_terms(
                W, a, F, self.k, omega, linear, acting, slopes
            )
            return found
        (loads, u0, rigid_load), o, w = acting, self.offset, self.k * omega
        force = np.asarray((F[:, o::2] - 1j * F[:, o + 1 :: 2]).T)
        eta = self.modal.solve(w, loads - self.pushes(force))
        mean = u0 - self.G0 @ F[:, 0] + self.R @ a
        left = W - real_part(self.moves(eta), mean, o)
        below = self.R.T @ F[:, 0] - rigid_load if o else a
        by_omega = np.zeros(W.size + len(a))
        if slopes:
            slope = self.modal.solve(w, 2.0 * w[:, None] * eta - 1j * self.damped(eta))
            moved = self.moves(self.k[:, None] * slope)
            by_omega[: W.size] = -real_part(moved, np.zeros(len(self.G0)), o).ravel()
        return np.concatenate([left.ravel(), below]), by_omega


class BalanceJacobian(NamedTuple):
    """Jacobian of the balance at one answer, as its parts.

    Attributes
    ----------
    of : LinearPart
        The linear system.
    w : (n_k,) ndarray
        Angular frequencies of the harmonics above 0 [rad/s].
    state : (n_point,) ndarray of int8
        Which points move, stick or are open over the whole cycle.
    stiffness : (n_point, 1 + d) ndarray
        Stiffness of sticking points [N/mm].
    DF : (n_moving, 1 + d, size, 1 + d, size) ndarray
        Derivative of the force of points that move [N/mm].
    """

    of: LinearPart
    w: FloatArray
    state: NDArray[np.int8]
    stiffness: FloatArray
    DF: FloatArray

    @property
    def held(self) -> FloatArray:
        """Stiffness (n_point, 1 + d) of points that stick, 0 of the others [N/mm]."""
        return np.where(self.state[:, None] == STICKS, self.stiffness, 0.0)

    @property
    def kind(self) -> tuple[type[LowRank | Eliminated | EveryPoint], int]:
        """The factors with the fewest unknowns, and how many these are without the border."""
        of, moving = self.of, len(self.DF) * self.stiffness.shape[1]
        rigid = of.R.shape[1]
        n, left = (rows * of.size + rigid for rows in (len(of.G0), moving))
        if of.basis is not None and of.basis.shape[1] < moving:
            return LowRank, of.basis.shape[1] * of.size + rigid
        return (Eliminated, left) if 2 * (n**3 - left**3) / 3 > WORTH else (EveryPoint, n)

    def bordered(self, border: Border) -> BorderedFactors:
        """Factors of [[J, r_p], [normal]] in scaled unknowns and equations, the cheapest way.

        Large ones of an earlier point serve (`upd.hbm.core.factors`).
        """
        kind, unknowns = self.kind
        if unknowns < WORTH_KEEPING:
            return kind(self, border)
        return self.of.kept.near(self.product, partial(kind, self), border, unknowns)

    def product(self, x: FloatArray) -> FloatArray:
        """J x of a change (n,) of the unknowns.

        The residual is linear in motion and forces: J x is that of the motion and of its forces
        without loads.
        """
        of, n = self.of, len(self.of.G0) * self.of.size
        X, a = x[:n].reshape(len(of.G0), -1), x[n:]
        modes = of.Psi.shape[-1]
        none = (np.zeros((len(self.w), modes), complex), np.zeros(len(X)), 0.0 * a)
        return of.residual(X, a, self.force(X), float(self.w[0] / of.k[0]), none, False)[0]

    def force(self, X: FloatArray) -> FloatArray:
        """Change of the contact forces (c, size) with a motion (c, size) of the rows [N]."""
        d1, size, DF, moves = self.stiffness.shape[1], X.shape[1], self.DF, self.state == MOVES
        motion = X.reshape(-1, d1, size)
        out = self.held[..., None] * motion
        out[moves] = np.matmul(
            DF.reshape(len(DF), d1 * size, d1 * size), motion[moves].reshape(-1, d1 * size, 1)
        ).reshape(-1, d1, size)
        return np.asarray(out.reshape(-1, size))

    def every_derivative(self) -> FloatArray:
        """Derivatives of the force of all points, (n_point, 1 + d, size, 1 + d, size) [N/mm]."""
        size, d1 = self.of.size, self.stiffness.shape[1]
        out = np.zeros((len(self.state), d1 * size, d1 * size))
        out[self.state == MOVES] = self.DF.reshape(-1, d1 * size, d1 * size)
        place, held = np.arange(d1 * size), self.state == STICKS
        out[np.flatnonzero(held)[:, None], place, place] = np.repeat(
            self.stiffness[held], size, axis=1
        )
        return out.reshape(-1, d1, size, d1, size)

    def matrix(self, more: int = 0) -> FloatArray:
        """The whole matrix (n, n), with `more` empty rows and columns after them."""
        D, of, o = self.every_derivative(), self.of, self.of.offset
        n_point, d1, size = D.shape[:3]
        c, m, D = len(of.G0), len(of.G0) * size, D.reshape(n_point, d1, size, -1)
        real, imag = of.modal.receptance_parts(of.Psi, self.w)
        G = (real + 1j * imag).reshape(-1, c, n_point, d1)
        force = D[:, :, o::2] - 1j * D[:, :, o + 1 :: 2]
        # (harmonic, point, row, column of the point)
        motion = G.transpose(0, 2, 1, 3) @ force.transpose(2, 0, 1, 3)
        n = m + of.R.shape[1]
        J = np.zeros((n + more, n + more))
        top = J[:m, :m].reshape(c, size, n_point, d1 * size)
        top[:, o::2] = motion.real.transpose(2, 0, 1, 3)
        top[:, o + 1 :: 2] = -motion.imag.transpose(2, 0, 1, 3)
        if o:
            G0 = of.G0.reshape(c, n_point, d1).transpose(1, 0, 2)
            top[:, 0] = (G0 @ D[:, :, 0]).transpose(1, 0, 2)
            J[:m:size, m:n] = -of.R
            R = of.R.reshape(n_point, d1, -1)
            J[m:n, :m] = np.einsum("pdr,pdl->rpl", R, D[:, :, 0]).reshape(-1, m)
        J.flat[: m * len(J) : len(J) + 1] += 1.0
        return J


def real_part(X: ComplexArray, static: FloatArray, o: int) -> FloatArray:
    """Coefficients of amplitudes and a mean.

    Parameters
    ----------
    X : (n_k, c) ndarray of complex
        Amplitudes a - i b of the harmonics above 0.
    static : (c,) ndarray
        Mean.
    o : int
        Column of the first cosine.

    Returns
    -------
    (c, size) ndarray
    """
    out = np.empty((X.shape[1], o + 2 * len(X)))
    out[:, o::2], out[:, o + 1 :: 2] = X.real.T, -X.imag.T
    if o:
        out[:, 0] = static
    return out


class CondensedFactors(Factors):
    """LU of the condensed [[J, r_p], [normal]]."""

    def __init__(self, J: BalanceJacobian, border: Border) -> None:
        self.J = J
        dp, self.D, self.p_scale, self.normal = border
        self.c, self.size, self.static = len(J.of.G0), J.of.size, J.of.offset == 1
        self.n = self.c * self.size
        self.dp, self.dp_rigid = dp[: self.n].reshape(self.c, self.size), dp[self.n :]

    def _condense(
        self,
        compliance: tuple[FloatArray, ...],
        DF: FloatArray,
        D: FloatArray,
        border: tuple[FloatArray, FloatArray, FloatArray, float],
    ) -> None:
        """Parameters as of `upd.hbm.springs.terms.bordered`, the receptance as it is."""
        if not self.J.of.symmetric:
            real, imag, *rest = compliance
            turned = (np.ascontiguousarray(np.swapaxes(G, 1, 2)) for G in (real, imag))
            compliance = (*turned, *rest)
        A, rows = bordered(compliance, DF, self.static, D, self.D[self.n :], border)
        self._factorise(A.T, rows)


class EveryPoint(CondensedFactors):
    """Every point has its unknowns."""

    def __init__(self, J: BalanceJacobian, border: Border) -> None:
        super().__init__(J, border)
        c, size, n, of = self.c, self.size, self.n, J.of
        dp, D, p_scale, normal = border
        rigid = len(D) - n
        across, column = self._by_coefficient(normal[:-1]), self._by_coefficient(dp) * p_scale
        self._condense(
            (*of.modal.receptance_parts(of.Psi, J.w), of.G0, of.R, np.zeros((rigid, rigid))),
            J.DF if len(J.DF) == len(J.state) else J.every_derivative(),
            np.ascontiguousarray(D[:n].reshape(c, size).T),
            (across, np.zeros((size, c)), column, float(normal[-1])),
        )

    def _by_coefficient(self, x: FloatArray) -> FloatArray:
        out = x.copy()
        out[: self.n].reshape(self.size, self.c)[:] = x[: self.n].reshape(self.c, self.size).T
        return out

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        found = super().solve(self._by_coefficient(r), last)
        out = found.copy()
        out[: self.n].reshape(self.c, self.size)[:] = found[: self.n].reshape(self.size, self.c).T
        return out


class Eliminated(CondensedFactors):
    """Points that stick or are open over the whole cycle are eliminated first."""

    def __init__(self, J: BalanceJacobian, border: Border) -> None:
        super().__init__(J, border)
        c, size, n, of = self.c, self.size, self.n, J.of
        _, D, p_scale, normal = border
        held = np.repeat(J.state != MOVES, J.stiffness.shape[1])
        s, m = np.flatnonzero(held), np.flatnonzero(~held)
        self.s, self.m = s, m
        K = J.held.ravel()[s]
        real, imag = of.modal.receptance_parts(of.Psi, J.w)
        G = real + 1j * imag
        one, down, own = np.eye(len(s)), s[:, None], m[:, None]
        # (I + G_ss K)^-1 and with it G_sm
        self.inverse = np.linalg.inv(one + G[:, down, s] * K)
        self.across = self.inverse @ G[:, down, m]
        if of.symmetric:
            self.back = np.ascontiguousarray(np.swapaxes(self.across, 1, 2) * K)
        else:
            self.back = (G[:, own, s] * K) @ self.inverse
        G = G[:, own, m] - self.back @ G[:, down, m]
        # without harmonic 0 none of these is read
        rigid_s = of.R[s]
        self.inverse0 = np.asarray(np.linalg.inv(one + of.G0[down, s] * K))
        self.across0 = self.inverse0 @ of.G0[down, m]
        self.back0 = np.ascontiguousarray(self.across0.T * K)
        self.pull = (rigid_s.T * K) @ self.inverse0
        G0 = of.G0[own, m] - self.back0 @ of.G0[down, m]
        R, below = of.R[m] - self.back0 @ rigid_s, self.pull @ rigid_s
        self.by_rigid = self.inverse0 @ rigid_s
        scaled = normal[:n].reshape(c, size)
        self.V = scaled[s] / D[:n].reshape(c, size)[s]
        # the border on the held points is one on the forces of the others
        o = of.offset
        q = np.einsum("sk,ksm->km", self.V[:, o::2] + 1j * self.V[:, o + 1 :: 2], self.across)
        by_force = real_part(-q.conj(), -(self.V[:, 0] @ self.across0), o)
        column, share, self.moved_by_p = self._reduced(self.dp, self.dp_rigid)
        border_rigid = normal[n:-1] + D[n:] * (self.V[:, 0] @ self.by_rigid)
        across = np.concatenate([scaled[m].T.ravel(), border_rigid])
        last = float(normal[-1]) - p_scale * share
        self._condense(
            (np.ascontiguousarray(G.real), np.ascontiguousarray(G.imag), G0, R, below),
            J.DF,
            np.ascontiguousarray(D[:n].reshape(c, size)[m].T),
            (across, np.ascontiguousarray(by_force.T), column * p_scale, last),
        )

    def _reduced(self, b: FloatArray, b_rigid: FloatArray) -> tuple[FloatArray, float, FloatArray]:
        """Right-hand side of the condensed equations, and what the held points do to it.

        Their share in the border, and their motion with the others at rest.
        """
        own, static = np.ascontiguousarray(b[self.s]), self.static
        inside = by_harmonic(self.inverse, self.inverse0, static, own)
        top = b[self.m] - by_harmonic(self.back, self.back0, static, own)
        below = b_rigid - self.pull @ own[:, 0]
        return np.concatenate([top.T.ravel(), below]), float((self.V * inside).sum()), inside

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        n, c, size, static = self.n, self.c, self.size, self.static
        right, share, inside = self._reduced(r[:n].reshape(c, size), r[n:])
        found = super().solve(right, last - share)
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


class LowRank(CondensedFactors):
    """The motion of the rows in a basis of fewer, and what no mode moves beside it."""

    def __init__(self, J: BalanceJacobian, border: Border) -> None:
        super().__init__(J, border)
        _, D, p_scale, normal = border
        basis, of = J.of.basis, J.of
        assert basis is not None
        c, size, n, r = self.c, self.size, self.n, basis.shape[1]
        self.U, d1 = basis, J.stiffness.shape[1]
        moves = J.state == MOVES
        U = basis.reshape(len(moves), d1, r)
        part = J.DF.transpose(0, 2, 4, 1, 3).reshape(-1, size * size, d1, d1)
        Um = U[moves]
        half = np.matmul(part, Um[:, None])
        # (r, points d1) times (points d1, size size r)
        H = Um.reshape(-1, r).T @ half.transpose(0, 2, 1, 3).reshape(-1, size * size * r)
        H = H.reshape(r, size, size, r)
        held = (basis.T * J.held.ravel()) @ basis
        place = np.arange(size)
        H[:, place, place, :] += held[:, None, :]
        DF = np.ascontiguousarray(H.transpose(0, 1, 3, 2))[None]
        real, imag = of.modal.receptance_parts(basis.T @ of.Psi, J.w)
        # one size for all coordinates of a coefficient
        unit = D[:n].reshape(c, size).max(axis=0)
        self.unit = np.repeat(unit, r)
        self.border = (normal[:n] / D[:n]).reshape(c, size)
        self.G, self.G0, self.R = real + 1j * imag, basis.T @ of.G0 @ basis, basis.T @ of.R
        rigid = len(D) - n
        column = np.concatenate([(basis.T @ self.dp).T.ravel(), self.dp_rigid])
        across = np.concatenate([(basis.T @ self.border).T.ravel() * self.unit, normal[n:-1]])
        self._condense(
            (real, imag, self.G0, self.R, np.zeros((rigid, rigid))),
            DF,
            np.repeat(unit[:, None], r, axis=1),
            (across, np.zeros((size, r)), column * p_scale, float(normal[-1])),
        )

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        n, c, size, U = self.n, self.c, self.size, self.U
        b = r[:n].reshape(c, size)
        inside = U.T @ b
        # no mode moves the rest: it goes at once, and its forces move the rest
        left = b - U @ inside
        f = U.T @ self.J.force(left)
        moved = by_harmonic(self.G, self.G0, self.static, f)
        below = r[n:] - self.R.T @ f[:, 0]
        right = np.concatenate([(inside - moved).T.ravel(), below])
        found = super().solve(right, last - float((self.border * left).sum()))
        k = size * U.shape[1]
        y = (found[:k] * self.unit).reshape(size, -1).T
        out = np.empty(len(r) + 1)
        out[:n] = (U @ y + left).ravel() / self.D[:n]
        out[n:] = found[k:]
        return out
