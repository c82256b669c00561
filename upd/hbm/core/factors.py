"""Factors of bordered Jacobians; corrections of large equations from those of an earlier point.

From one iterate to the next few points change what they do and the frequency moves little, so that
the factors P of an earlier bordered Jacobian are nearly those of the present one, M: P^-1 M is the
identity but for a few directions, and GMRES on

    P^-1 M z = P^-1 r

takes a few products with M and solutions with P in place of new factors, whose work grows with the
cube of the unknowns. What it leaves is measured as Newton's corrections are, in scaled unknowns, so
that no scaling of the equations enters.

The determinant of M has the sign of that of P where P^-1 M has no negative eigenvalue, or an even
number of them. Eigenvalues off 1 are what GMRES finds first, as Ritz values: where a real one of
them is not positive, M is factored.

References
----------
Y. Saad, Iterative Methods for Sparse Linear Systems (2003), 6.5 and 9.3; P. Deuflhard, Newton
Methods for Nonlinear Problems (2004), 2.1.5; D. A. Knoll and D. E. Keyes, J. Comput. Phys. 193
(2004) 357, for preconditioners that are kept.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from upd.linalg.gmres import gmres

FloatArray = NDArray[np.float64]

EPS = float(np.finfo(float).eps)

#: what a correction leaves of the equations, in scaled unknowns: well below the shrinkage of
#: corrections that spares a new Jacobian (`upd.hbm.core.newton.CHORD`), so that no more are needed
LEFT = 1e-3
#: the same of a tangent: paths go by its angles
LEFT_OF_TANGENT = 1e-10
#: unknowns below which factors take some hundredths of a second at most, and are taken anew
WORTH_KEEPING = 1000
#: a factorisation of n unknowns takes the time of n over this many solutions: 2 n^3 / 3 operations
#: from the processor's cache against n^2 numbers from memory. Measured on one core: n / 4 at 1000
#: unknowns, n / 13 at 2000, n / 18 at 3000, n / 21 at 4000, n / 23 at 6000; it weighs costs only,
#: and below 4000 factors are renewed somewhat early.
SOLUTIONS = 24.0


class Border(NamedTuple):
    """What makes a Jacobian J the matrix [[J, r_p], [normal]] of a plane, in scaled unknowns.

    Attributes
    ----------
    dp : (n,) ndarray
        Derivative of the residual by the parameter.
    D : (n,) ndarray
        Sizes of the unknowns.
    p_scale : float
        Size of the parameter.
    normal : (n + 1,) ndarray
        Across the plane, in scaled coordinates.
    """

    dp: FloatArray
    D: FloatArray
    p_scale: float
    normal: FloatArray

    @property
    def sizes(self) -> FloatArray:
        """Sizes of the unknowns, that of the parameter last (n + 1,)."""
        return np.append(self.D, self.p_scale)


class Factors:
    """LU of [[J, r_p], [normal]] of a matrix J (n, n), equations divided by their largest entries.

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
    D: FloatArray

    def __init__(self, J: FloatArray, border: Border) -> None:
        n, self.D = len(J), border.D
        A = np.empty((n + 1, n + 1), order="F")
        np.multiply(J, border.D, out=A[:n, :n])
        A[:n, n] = border.dp * border.p_scale
        rows = np.abs(A[:n]).max(axis=1)
        rows[rows == 0] = 1.0
        A[:n] /= rows[:, None]
        A[n] = border.normal
        self._factorise(A, rows)

    def _factorise(self, A: FloatArray, rows: FloatArray) -> None:
        """Parameters: the matrix, overwritten, and what its equations were divided by."""
        self.rows = rows
        self.lu, self.piv, info = lapack.dgetrf(A, overwrite_a=True)
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

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        right = np.empty(len(self.rows) + 1)
        np.divide(r, self.rows, out=right[:-1])
        right[-1] = last
        return np.asarray(lapack.dgetrs(self.lu, self.piv, right, overwrite_b=True)[0])

    def tangent(self) -> FloatArray:
        """Unit vector along the path, on the side the border points to."""
        t = self.solve(np.zeros(len(self.D)), 1.0)
        return np.asarray(t / np.linalg.norm(t))


class KeptFactors:
    """The newest factors of a path, and what solutions from them have taken.

    Factors are taken anew as soon as corrections from them cost more than they did on average with
    the factors themselves: from then on waiting longer would cost more.
    """

    def __init__(self) -> None:
        self.factors: BorderedFactors | None = None
        self.sizes = np.zeros(0)
        self.spent, self._uses, self.newest = 0.0, 0, 0.0

    def near(
        self, product: Product, factored: FactorsOf, border: Border, unknowns: int
    ) -> BorderedFactors:
        """Factors of a matrix, or what solves with it from those that are kept.

        Parameters
        ----------
        product : callable
            J x of a change x (n,) of the unknowns.
        factored : callable
            Factors of [[J, r_p], [normal]] for a border.
        border : Border
        unknowns : int
            Rows of its factors.

        Returns
        -------
        BorderedFactors
        """
        same = len(self.sizes) == len(border.normal)
        dear = self.newest * max(self._uses, 1) > self.spent
        if not same or self.factors is None or self.factors.singular or dear:
            return self.renewed(factored, border, unknowns)
        self._uses, self.newest = self._uses + 1, 0.0
        return _Near(self, product, factored, border, unknowns)

    def renewed(self, factored: FactorsOf, border: Border, unknowns: int) -> BorderedFactors:
        """Factors of the matrix, kept from now on; parameters as of `near`."""
        self.factors, self.sizes = factored(border), border.sizes
        self.spent, self._uses, self.newest = unknowns / SOLUTIONS, 1, 0.0
        return self.factors

    def forget(self) -> None:
        """Let the factors go: the next ones are new."""
        self.factors, self.sizes = None, np.zeros(0)

    def __reduce__(self) -> tuple[type[KeptFactors], tuple[()]]:
        # files and other processes do without them
        return KeptFactors, ()

    def note(self, solutions: int) -> None:
        """Count solutions that a correction took."""
        self.spent += solutions
        self.newest += solutions


class _Near:
    """Solutions with a matrix from the factors of another; its own where these are too far."""

    singular = False

    def __init__(
        self,
        kept: KeptFactors,
        product: Product,
        factored: FactorsOf,
        border: Border,
        unknowns: int,
    ) -> None:
        assert kept.factors is not None
        self._kept, self._product, self._factored = kept, product, factored
        self._border, self._unknowns = border, unknowns
        # unknowns of the factors are scaled by sizes of their own
        self._factors, self._rescaled = kept.factors, kept.sizes / border.sizes
        self._own: BorderedFactors | None = None
        self._right = True

    @property
    def sign(self) -> float:
        """Sign of the determinant, up to a factor that never changes on a path."""
        return self._factors.sign if self._own is None and self._right else self._renew().sign

    @property
    def ratio(self) -> float:
        """Smallest over largest pivot, of the factors in use."""
        return (self._own or self._factors).ratio

    def _renew(self) -> BorderedFactors:
        if self._own is None:
            self._own = self._kept.renewed(self._factored, self._border, self._unknowns)
        return self._own

    def _from_factors(self, b: FloatArray) -> FloatArray:
        return self._factors.solve(b[:-1], float(b[-1])) * self._rescaled

    def _preconditioned(self, z: FloatArray) -> FloatArray:
        """P^-1 M z of scaled unknowns z (n + 1,)."""
        dp, D, p_scale, normal = self._border
        top = self._product(z[:-1] * D) + dp * (z[-1] * p_scale)
        return self._from_factors(np.append(top, normal @ z))

    def _found(self, b: FloatArray, left: float) -> FloatArray:
        if self._own is None:
            most = int(self._unknowns / SOLUTIONS / 2)
            found = gmres(self._preconditioned, self._from_factors(b), left, most)
            self._kept.note(found.products + 1)
            # of a pair neither changes the sign
            real = found.ritz.real[found.ritz.imag == 0.0]
            self._right = self._right and bool((real > 0.0).all())
            if found.reached:
                return found.x
        return self._renew().solve(b[:-1], float(b[-1]))

    def solve(self, r: FloatArray, last: float) -> FloatArray:
        """Scaled correction for the residual r (n,) and the right-hand side of the border."""
        return self._found(np.append(r, last), LEFT)

    def tangent(self) -> FloatArray:
        """Unit vector along the path, on the side the border points to."""
        t = self._found(np.append(np.zeros(len(self._rescaled) - 1), 1.0), LEFT_OF_TANGENT)
        return np.asarray(t / np.linalg.norm(t))


#: what solves with [[J, r_p], [normal]] in scaled unknowns
BorderedFactors = Factors | _Near
#: J x of a change x (n,) of the unknowns
Product = Callable[[FloatArray], FloatArray]
#: factors of [[J, r_p], [normal]] of a Jacobian J for a border
FactorsOf = Callable[[Border], BorderedFactors]
