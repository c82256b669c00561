"""Compliance of a body that is learned from products: one solution with K for every new direction
of force, in place of one for every kept dof.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError
from upd.linalg.common import AT_ONCE, EPS, FloatArray, IntArray, checked_dofs, checked_vectors, log
from upd.linalg.schur import DirectSolver, Solved

if TYPE_CHECKING:
    from upd.linalg.multigrid import MultigridSolver

#: relative error in energy of one product
ACCURACY = 1e-10


class LearnedCompliance:
    """A body seen from k kept dofs, by the compliance it has shown so far.

    Beside the exact compliance C = B' K^-1 B stands an approximate one, C_0, cheap and dense. With
    the forces P, products Y = C P and P' C_0 P = I, the compliance known so far is

        C_m = C_0 - C_0 P P' C_0 + Y (P' Y)^-1 Y',

    the block BFGS formula with C as the Hessian: symmetric positive definite as C and C_0 are,
    equal to C on all forces in the span of P. One more product adds one direction. On a linear
    system with C, to solve with C_m, learn the answer and solve again gives the iterates of
    conjugate gradients preconditioned by C_0, so that the number of products goes with the root of
    the condition of C_0^-1 C; and as every answer that is not exact adds a direction, k products
    are always enough.

    Attributes
    ----------
    n_dof : int
        Dofs of the body.
    products : int
        Solutions with K so far.
    iterations : list of int
        Of each of them.

    References
    ----------
    .. [1] J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed., sections 6.1 and 7.2 (BFGS
       and its relation to conjugate gradients).
    .. [2] R. B. Schnabel, Quasi-Newton methods using multiple secant equations, CU-CS-247-83 (the
       block formula).

    Examples
    --------
    A chain of two springs of 1 kN/mm, started from a wrong compliance, pulled at both dofs:

    >>> import numpy as np
    >>> from upd.linalg.schur import DirectSolver
    >>> from upd.linalg.symmetric import checked
    >>> from upd.reduction.learned import LearnedCompliance
    >>> K = checked(1e3 * np.array([[2.0, -1.0], [-1.0, 1.0]]))
    >>> body = LearnedCompliance(DirectSolver(K, "superlu"), 2, [0, 1], 1e-3 * np.eye(2))
    >>> force = np.array([1.0, 1.0])
    >>> print(body.unknown(force).round(6))
    [1.]
    >>> body.learn(force)
    >>> print(body.unknown(force).round(6), np.round(1e3 * body.compliance() @ force, 6))
    [0.] [2. 3.]
    """

    def __init__(
        self,
        solver: DirectSolver | MultigridSolver,
        n_dof: int,
        kept: ArrayLike,
        start: FloatArray,
        accuracy: float = ACCURACY,
    ) -> None:
        """From a solver of the body.

        Parameters
        ----------
        solver : DirectSolver or MultigridSolver
            Of its stiffness (n, n) without the fixed dofs.
        n_dof : int
            n.
        kept : (k,) array_like of int
        start : (k, k) ndarray
            C_0, mm/N, symmetric positive definite.
        accuracy : float
            Relative error in energy of one product.

        Raises
        ------
        InputError
            For bad dofs or a C_0 of another size.
        """
        self.body_solver, self.start, self.accuracy = solver, start, accuracy
        self.kept: IntArray = checked_dofs(kept, n_dof)
        k = len(self.kept)
        if start.shape != (k, k):
            raise InputError(f"The approximate compliance is {start.shape}: give ({k}, {k}).")
        self.n_dof = n_dof
        self.solver = solver.name
        self._P, self._Z, self._Y = (np.zeros((k, 0)) for _ in range(3))
        self._fields: list[FloatArray] = []
        self.errors: list[float] = []
        self.iterations: list[int] = []
        self._known: FloatArray | None = None

    @property
    def products(self) -> int:
        """Solutions with K so far."""
        return len(self.iterations)

    def compliance(self) -> FloatArray:
        """C_m (k, k), mm/N, exactly symmetric, read-only."""
        if self._known is None:
            C = self.start.copy()
            if self._P.shape[1]:
                values, vectors = np.linalg.eigh(self._gram())
                V = self._Y @ (vectors / np.sqrt(values))
                C += V @ V.T - self._Z @ self._Z.T
                C = 0.5 * (C + C.T)
            C.flags.writeable = False
            self._known = C
        return self._known

    def _gram(self) -> FloatArray:
        """P' C P (m, m), exactly symmetric."""
        G = self._P.T @ self._Y
        return np.asarray(0.5 * (G + G.T))

    def unknown(self, forces: FloatArray) -> FloatArray:
        """Shares (m,) of forces (k, m) at the kept dofs that no product has shown.

        |f - P P' C_0 f| / |f| in the norm of C_0.
        """
        F = forces.reshape(len(self.kept), -1)
        size = self._size(F)
        left = self._size(self._left(F))
        return np.asarray(np.divide(left, size, out=np.zeros_like(size), where=size > 0.0))

    def learn(self, forces: ArrayLike, limits: ArrayLike = 0.0) -> None:
        """Solutions with K for what of forces (k,) or (k, m) is not known.

        Directions are added one by one, each that of the column of which most is unknown for its
        limit, until no share that is unknown is above its limit (m,), or `AT_ONCE` are added.

        Raises ConvergenceError where the solver does not reach the accuracy.
        """
        F = checked_vectors(np.asarray(forces), len(self.kept), "forces at the kept dofs")
        F = F.reshape(len(F), -1)
        sizes = self._size(F)
        F, sizes = F[:, sizes > 0.0], sizes[sizes > 0.0]
        allowed = np.broadcast_to(limits, sizes.shape) * sizes
        allowed = np.maximum(allowed, len(F) * EPS * sizes)
        left, new = self._left(F), np.zeros((len(F), 0))
        while new.shape[1] < AT_ONCE and left.shape[1]:
            over = self._size(left) / allowed
            worst = int(np.argmax(over))
            if not over[worst] > 1.0:
                break
            p = left[:, worst] / self._size(left[:, [worst]])
            new = np.column_stack((new, p))
            # twice is enough, as in `_left`
            for _ in range(2):
                left = left - np.outer(p, (self.start @ p) @ left)
        if not new.shape[1]:
            return
        solved = self._solved(new)
        u = np.column_stack([one.x for one in solved])
        self._P, self._Z, self._Y = (
            np.column_stack((old, v))
            for old, v in ((self._P, new), (self._Z, self.start @ new), (self._Y, u[self.kept]))
        )
        self._fields += list(u.T)
        self.errors += [one.error for one in solved]
        self._known = None

    def _solved(self, P: FloatArray) -> list[Solved]:
        load = np.zeros((self.n_dof, P.shape[1]))
        load[self.kept] = P
        found = self.body_solver.many(load, self.accuracy)
        self.iterations += [one.iterations for one in found]
        log.info(
            "%d products of %d dofs by %s: %d iterations, error in energy %.1e",
            self.products,
            self.n_dof,
            self.solver,
            max(one.iterations for one in found),
            max(one.error for one in found),
        )
        return found

    def under(self, force: FloatArray) -> FloatArray:
        """Displacements u (n,) of all dofs under a force (k,): a sum of those that are known, and
        one more solution for what is not.
        """
        share = self._Z.T @ force
        u = np.zeros(self.n_dof)
        for amount, one in zip(share, self._fields, strict=True):
            u += amount * one
        left = self._left(force[:, None])[:, 0]
        if self.unknown(force).max() > self.accuracy:
            u += self._solved(left[:, None])[0].x
        return u

    def error(self, force: FloatArray) -> float:
        """Bound of the relative error in energy of C_m f for a force (k,).

        |C_m f - C f|_{C^-1} / |f|_C. With f = P c + f', what the products lack is at most sum
        |c_i| e_i (`upd.linalg.schur`), and what was not shown |C f'| + |C_m f'|, both in the norm
        of C^-1 and so of the size of |f'|_C: taken as twice |f'|_{C_0} times the root of the
        largest eigenvalue that C_0^-1 C has shown.
        """
        share = self._Z.T @ force
        inner = float(np.abs(share) @ np.array(self.errors)) if self.errors else 0.0
        stretch = float(np.linalg.eigvalsh(self._gram())[-1]) if self.errors else 1.0
        outer = 2.0 * float(self._size(self._left(force[:, None]))[0]) * np.sqrt(stretch)
        size = float(np.sqrt(force @ (self.compliance() @ force)))
        return (inner + outer) / size if size > 0.0 else 0.0

    def _left(self, F: FloatArray) -> FloatArray:
        """What of the columns of F the span of P lacks; twice is enough."""
        for _ in range(2):
            F = F - self._P @ (self._Z.T @ F)
        return F

    def _size(self, F: FloatArray) -> FloatArray:
        """Norms of the columns of F in C_0."""
        return np.asarray(np.sqrt(np.maximum(np.einsum("ij,ij->j", F, self.start @ F), 0.0)))
