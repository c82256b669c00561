"""The Jacobian of the balance, and the cheapest way to solve with it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.kept_factors import WORTH_KEEPING
from upd.hbm.core.newton import BorderedFactors
from upd.hbm.springs.factors import Eliminated, EveryPoint, Factors, LowRank
from upd.hbm.springs.linearised import Linearised

FloatArray = NDArray[np.float64]

#: operations of the factors that points held must save before they are eliminated: about what the
#: calls of the elimination take
WORTH = 2e6


class BalanceJacobian(Linearised):
    """What `upd.hbm.core.newton.StructuredJacobian` asks of the balance's."""

    def bordered(
        self, dp: FloatArray, D: FloatArray, p_scale: float, normal: FloatArray
    ) -> BorderedFactors:
        """Factors of [[J, r_p], [normal]] in scaled unknowns and equations.

        Large ones, of an earlier point, serve for later ones (`upd.hbm.core.kept_factors`).

        Parameters
        ----------
        dp : (n,) ndarray
            Derivative of the residual by the parameter.
        D : (n,) ndarray
            Sizes of the unknowns.
        p_scale : float
            Size of the parameter.
        normal : (n + 1,) ndarray
            Border, of the scaled unknowns.

        Returns
        -------
        BorderedFactors
        """
        matrix = _Matrix(self, dp, D, p_scale, normal)
        unknowns = matrix.unknowns
        if unknowns < WORTH_KEEPING:
            return matrix.factored()
        return self.rows.kept.near(matrix, unknowns)


class _Matrix(NamedTuple):
    """[[J, r_p], [normal]] in scaled unknowns, not factored yet."""

    J: Linearised
    dp: FloatArray
    D: FloatArray
    p_scale: float
    normal: FloatArray

    @property
    def sizes(self) -> FloatArray:
        return np.append(self.D, self.p_scale)

    @property
    def kind(self) -> type[Factors]:
        """The factors with the fewest unknowns."""
        J = self.J
        basis, d1, moving = J.rows.basis, J.stiffness.shape[1], len(J.DF)
        if basis is not None and basis.shape[1] < moving * d1:
            return LowRank
        n = len(self.D)
        left = n - (len(J.state) - moving) * d1 * (J.offset + 2 * len(J.w))
        return Eliminated if 2 * (n**3 - left**3) / 3 > WORTH else EveryPoint

    @property
    def unknowns(self) -> int:
        """Rows of its factors, without the border."""
        J, size = self.J, self.J.offset + 2 * len(self.J.w)
        rigid = len(self.D) - len(J.rows.Psi) * size
        if self.kind is LowRank:
            assert J.rows.basis is not None
            return int(J.rows.basis.shape[1]) * size + rigid
        if self.kind is Eliminated:
            return len(J.DF) * int(J.stiffness.shape[1]) * size + rigid
        return len(self.D)

    def factored(self) -> Factors:
        """Its factors."""
        return self.kind(self.J, self.dp, self.D, self.p_scale, self.normal)

    def product(self, z: FloatArray) -> FloatArray:
        """What scaled unknowns z (n + 1,) give: the equations (n,) and the border."""
        x, p, c = z[:-1] * self.D, float(z[-1]) * self.p_scale, len(self.J.rows.Psi)
        n = c * (self.J.offset + 2 * len(self.J.w))
        out = np.empty(len(z))
        out[:-1] = self.J.product(x[:n].reshape(c, -1), x[n:]) + self.dp * p
        out[-1] = self.normal @ z
        return out
