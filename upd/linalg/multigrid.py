"""Smoothed aggregation multigrid for stiffnesses of solids: set up by pyamg, cycled here in single
precision.

The block smoother of pyamg 5.4.1 is not used: on the half-sphere of the ready scene its inverses
of diagonal blocks times the blocks were off the identity by 0.8, and M K had eigenvalues of 2 to 4
where a symmetric cycle has none above one. Here the blocks are inverted in double precision.

References
----------
.. [1] P. Vanek, J. Mandel, M. Brezina, Computing 56 (1996) 179 (the rigid-body modes as near null
   space).
.. [2] L. Olson, J. Schroder, R. Tuminaro, SIAM J. Sci. Comput. 33 (2011) 966 (prolongations of
   least energy).
.. [3] A. Abdelfattah et al., Int. J. High Perf. Comput. Appl. 35 (2021) 344, section 5.3 (a
   preconditioner of lower precision inside an iteration of higher).
.. [4] U. Trottenberg, C. Oosterlee, A. Schueller, Multigrid (2001), section 2.4 (cycle index).
"""

from __future__ import annotations

import warnings
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import bsr_array

from upd.errors import ConvergenceError, InputError
from upd.linalg.common import MAX_ITERATIONS, FloatArray, checked_vectors, log
from upd.linalg.conjugate import UNSEEN, conjugate_gradients
from upd.linalg.nodes import STRONG, aggregates, near_neighbours, padded, places, positions
from upd.linalg.parallel import in_parallel
from upd.linalg.schur import Solved
from upd.linalg.select import threads_used
from upd.linalg.smoothers import Smoother, in_order
from upd.linalg.sweeps import Single
from upd.linalg.symmetric import Matrix

#: the coarsest level is factorised densely: below this many blocks, of 6 dofs each, that is free
COARSEST = 100
MOST_LEVELS = 10
#: levels from this one on, counted from 0, are visited twice from the one above. On stretched
#: meshes it has 1 % of the dofs, so that is nearly free; the level before has a fifth
TWICE = 2


#: one level: its smoother, the prolongation P from the next level, in the smoother's order, and its
#: transpose, sparse
Level = tuple[Smoother, Any, Any]


class Hierarchy:
    """A cycle with one forward sweep of block Gauss-Seidel before and a backward one after the
    coarse correction: symmetric, and with variational coarse levels I - M A has no eigenvalue below
    zero but for rounding. Two visits of a level (cycle index 2, [4]_) are 2 M - M A M with
    I - (2 M - M A M) A = (I - M A)^2, which keeps both.
    """

    def __init__(
        self, levels: list[Level], coarsest: FloatArray, real: NDArray[np.bool_], n: int
    ) -> None:
        """Dofs of the coarsest level that are not ``real`` stand for nothing: an aggregate of a few
        dofs does not tell all six modes apart.
        """
        self._levels, self.n, self._real = levels, n, real
        try:
            self._coarsest = cho_factor(coarsest[np.ix_(real, real)], lower=True)
        except np.linalg.LinAlgError as error:
            raise ConvergenceError(
                f"Multigrid: the coarsest level failed ({error}): the body floats, hold "
                "the distant set."
            ) from error
        self.sizes = [*(P.shape[0] for _, P, _ in levels), len(coarsest)]

    def __call__(self, residual: FloatArray) -> FloatArray:
        """M r, with r scaled to one first: single precision has few powers of ten."""
        size = float(np.abs(residual).max()) or 1.0
        out: FloatArray = self.cycle(0, (residual / size).astype(np.float32)).astype(np.float64)
        return size * out

    def cycle(self, depth: int, b: Single) -> Single:
        if depth == len(self._levels):
            x = np.zeros_like(b)
            x[self._real] = cho_solve(self._coarsest, b[self._real].astype(np.float64))
            return x
        smoother = self._levels[depth][0]
        order = smoother.order
        if order is not None:
            b = b[order]
        x = self._visit(depth, b)
        if depth >= TWICE:
            x += self._visit(depth, smoother.residual(b, x))
        if order is None:
            return x
        out = np.empty_like(x)
        out[order] = x
        return out

    def _visit(self, depth: int, b: Single) -> Single:
        """One cycle from zero, in the order of the level's smoother."""
        smoother, P, R = self._levels[depth]
        x, residual = smoother.first(b)
        x += P @ self.cycle(depth + 1, np.ascontiguousarray(R @ residual))
        smoother.last(b, x)
        return x


def hierarchy(A: Any, modes: FloatArray | None, points: FloatArray | None = None) -> Hierarchy:
    """Set up the levels.

    Parameters
    ----------
    A : (n, n) bsr_array
        Whole blocks of nodes, symmetric positive definite, float64.
    modes : (n, m) ndarray or None
        Near null space.
    points : (n / 3, 3) ndarray, optional
        Positions of the nodes, see `upd.linalg.nodes`; without them all neighbours are joined.

    Returns
    -------
    Hierarchy
    """
    import pyamg  # a third of a second, and few runs need it

    with warnings.catch_warnings():
        # pyamg warns of formats that it then converts itself.
        warnings.simplefilter("ignore")
        # Counted on spheres and blocks of 23 000 to 420 000 dofs: prolongations of least energy
        # take a tenth fewer iterations than smoothed ones and half the set-up. Joining near
        # neighbours only takes 32 iterations where joining all took 64, and an eighth more memory.
        # With coarser levels that join all, iterations grew from 26 to 33; with the usual
        # thresholds to 29. On 51 000 to 3 200 000 dofs, nodes left over joined to close ones only
        # and `FAR` of 3.54 for 4 take 19 to 29 iterations in the mean of the block for 23 to 31,
        # levels visited twice 26 for 29 on the largest, cross lines 24, and the usual thresholds
        # from their first level on, not halved once for the level of near neighbours, 21.
        strength: Any = ("symmetric", {"theta": 0.0})
        joined: Any = "standard"
        if points is not None:
            near = near_neighbours(A, points)
            joined = [("predefined", {"AggOp": aggregates(A, near, points)})]
            joined += ["standard"] * (MOST_LEVELS - 1)
            strength = [("predefined", {"C": near})]
            strength += [
                ("symmetric", {"theta": STRONG * 0.5**level}) for level in range(MOST_LEVELS - 1)
            ]
        made = pyamg.smoothed_aggregation_solver(
            A,
            B=modes,
            symmetry="symmetric",
            strength=strength,
            aggregate=joined,
            smooth=("energy", {"krylov": "cg", "maxiter": 4, "degree": 1}),
            presmoother=None,
            postsmoother=None,
            improve_candidates=None,
            max_levels=MOST_LEVELS,
            max_coarse=COARSEST,
            coarse_solver="cholesky",
        )
    *fine, last = made.levels
    levels = []
    for one in fine:
        B = bsr_array(one.A)
        smoother = Smoother(B)
        if smoother.order is None:
            P = one.P.astype(np.float32)
        else:
            P = in_order(bsr_array(one.P), smoother.order[::3] // 3)
        levels.append((smoother, P, P.T.tocsr() if P.format == "csr" else P.T))
        one.A = one.P = one.R = None
    return Hierarchy(levels, last.A.toarray(), np.any(last.B != 0.0, axis=1), A.shape[0])


class MultigridSolver:
    """A stiffness with a multigrid hierarchy, set up once for all right-hand sides.

    Parameters
    ----------
    K : (n, n) Symmetric or csr_array
        Stiffness, N/mm.
    near_null_space : (n, 6) array_like or None
        Rigid-body modes at the dofs of K; without them several times the iterations.
    layout : (n,) array_like of int, optional
        Number 3 * node + component of each dof of K, -1 for a dof of a rigid set; see `amg_solve`.
    points : (n_node, 3) array_like, optional
        Positions of the nodes that the layout counts, mm: half the iterations on stretched meshes.
    max_iterations : int

    Raises
    ------
    InputError
        For bad arguments.
    ConvergenceError
        For a body that floats.
    """

    name = "amg"

    def __init__(
        self,
        K: Matrix,
        near_null_space: ArrayLike | None,
        *,
        layout: ArrayLike | None = None,
        points: ArrayLike | None = None,
        max_iterations: int = MAX_ITERATIONS,
    ) -> None:
        n = K.shape[0]
        self._K = K
        modes = None
        if near_null_space is None:
            log.warning("amg without rigid-body modes: several times the iterations")
        else:
            modes = checked_vectors(near_null_space, n, "near null space")
            if modes.ndim != 2:
                raise InputError(f"The near null space has shape {modes.shape}: give ({n}, 6).")
        self._place, self._n_padded = places(n, layout)
        blocks, B = padded(K, modes, self._place, self._n_padded, whole_blocks=layout is not None)
        at = None if points is None else positions(points, n, layout)
        self.cycle = hierarchy(blocks, B, at)
        self._max_iterations = max_iterations
        self._lowest = UNSEEN
        log.info("multigrid of %d dofs: levels %s", n, self.cycle.sizes)

    def precondition(self, residual: FloatArray) -> FloatArray:
        whole = np.zeros(self._n_padded)
        whole[self._place] = residual
        return self.cycle(whole)[self._place]

    def many(self, rhs: FloatArray, accuracy: float) -> list[Solved]:
        """K^-1 rhs to a relative error in energy for the columns of (n, m), side by side.

        Raises ConvergenceError where it is not reached.
        """
        run = partial(
            conjugate_gradients,
            lambda x: np.asarray(self._K @ x),
            self.precondition,
            accuracy=accuracy,
            max_iterations=self._max_iterations,
            # of all columns the same, so that none depends on which ends first
            lowest=self._lowest,
        )
        made = in_parallel([partial(run, np.ascontiguousarray(b)) for b in rhs.T], threads_used())
        self._lowest = min([self._lowest, *(lowest for _, lowest in made)])
        return [solved for solved, _ in made]
