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
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import bsr_array, bsr_matrix, csr_array, csr_matrix

from upd.errors import ConvergenceError, InputError
from upd.linalg.block_conjugate import block_conjugate_gradients
from upd.linalg.blocks import (
    WIDTH,
    Single,
    count_blocks,
    fill_blocks,
    first_sweep_3,
    residual_3,
    residual_3_many,
    sweep,
    sweep_3,
    sweep_3_many,
    sweep_many,
    symmetric_product,
    symmetric_product_many,
)
from upd.linalg.common import EPS, FloatArray, IntArray, checked_vectors, log
from upd.linalg.conjugate import UNSEEN, conjugate_gradients
from upd.linalg.solvers import Solved
from upd.linalg.strength import near_neighbours
from upd.linalg.symmetric import Matrix, Symmetric, submatrix_of, whole

#: the coarsest level is factorised densely: below this many blocks, of 6 dofs each, that is free
COARSEST = 100
MAX_ITERATIONS = 3000


@dataclass(frozen=True)
class AggregationLevel:
    """One level of the hierarchy.

    Attributes
    ----------
    A : (n, n) bsr_array
        Operator, single precision.
    inverse : (n / b, b, b) ndarray
        Inverses of its diagonal blocks.
    P, R : sparse array
        Prolongation from the next level and its transpose.
    """

    A: bsr_array
    inverse: Single
    P: Any
    R: Any


class Hierarchy:
    """A V-cycle with one forward sweep of block Gauss-Seidel before and a backward one after the
    coarse correction: symmetric, and with variational coarse levels I - M A has no eigenvalue below
    zero but for rounding.
    """

    def __init__(
        self, levels: list[AggregationLevel], coarsest: FloatArray, told: NDArray[np.bool_], n: int
    ) -> None:
        """Dofs of the coarsest level that are not ``told`` stand for nothing: an aggregate of a few
        dofs does not tell all six modes apart.
        """
        self._levels, self.n, self._told = levels, n, told
        try:
            self._coarsest = cho_factor(coarsest[np.ix_(told, told)], lower=True)
        except np.linalg.LinAlgError as error:
            raise ConvergenceError(
                f"Multigrid: the coarsest level failed ({error}): the body floats, hold "
                "the distant set."
            ) from error
        self.sizes = [*(level.A.shape[0] for level in levels), len(coarsest)]

    @property
    def nbytes(self) -> int:
        """Memory of the levels."""
        return sum(
            part.nbytes
            for level in self._levels
            for M in (level.A, level.P, level.R)
            for part in (M.data, M.indices, M.indptr)
        ) + sum(level.inverse.nbytes for level in self._levels)

    def many(self, residuals: FloatArray) -> FloatArray:
        """M R for up to `WIDTH` residuals (n, k)."""
        k = residuals.shape[1]
        sizes = np.abs(residuals).max(axis=0)
        sizes[sizes == 0.0] = 1.0
        scaled = np.zeros((self.n, WIDTH), np.float32)
        scaled[:, :k] = residuals / sizes
        out: FloatArray = self._cycle_many(0, scaled)[:, :k].astype(np.float64) * sizes
        return out

    def _cycle_many(self, depth: int, b: Single) -> Single:
        x = np.zeros_like(b)
        if depth == len(self._levels):
            x[self._told] = cho_solve(self._coarsest, b[self._told].astype(np.float64))
            return x
        level = self._levels[depth]
        A, of_three = level.A, level.A.blocksize == (3, 3)
        arrays = (A.indptr, A.indices, A.data, level.inverse)
        smooth = sweep_3_many if of_three else sweep_many
        smooth(*arrays, b, x, 1)
        residual = residual_3_many(*arrays[:3], b, x) if of_three else b - A @ x
        x += level.P @ self._cycle_many(depth + 1, np.ascontiguousarray(level.R @ residual))
        smooth(*arrays, b, x, -1)
        return x

    def __call__(self, residual: FloatArray) -> FloatArray:
        """M r. The residual is scaled to one first: single precision has few powers of ten."""
        size = float(np.abs(residual).max())
        if not size > 0.0:
            return np.zeros(self.n)
        out = self._cycle(0, (residual / size).astype(np.float32))
        return out.astype(np.float64) * size

    def _cycle(self, depth: int, b: Single) -> Single:
        if depth == len(self._levels):
            x = np.zeros_like(b)
            x[self._told] = cho_solve(self._coarsest, b[self._told].astype(np.float64))
            return x
        level = self._levels[depth]
        A, x = level.A, np.zeros(len(b), np.float32)
        arrays = (A.indptr, A.indices, A.data, level.inverse)
        if A.blocksize == (3, 3):
            first_sweep_3(*arrays, b, x)
            residual = residual_3(*arrays[:3], x)
        else:
            sweep(*arrays, b, x, 1)
            residual = b - A @ x
        x += level.P @ self._cycle(depth + 1, level.R @ residual)
        if A.blocksize == (3, 3):
            sweep_3(*arrays, b, x, -1)
        else:
            sweep(*arrays, b, x, -1)
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
        Positions of the nodes, see `upd.linalg.strength`; without them all neighbours are joined.

    Returns
    -------
    Hierarchy
    """
    import pyamg  # a third of a second, and few runs need it

    with warnings.catch_warnings():
        # pyamg warns of formats that it then converts itself.
        warnings.simplefilter("ignore")
        # Counted on spheres and blocks of 28 000 to 65 000 dofs: prolongations of least energy take
        # a tenth fewer iterations than smoothed ones and half the set-up; two coarse cycles gain
        # nothing. Joining near neighbours only takes 32 iterations where joining all took 64 (block
        # of 94 000 dofs) and an eighth more memory; on coarser levels it gains nothing.
        everything: Any = ("symmetric", {"theta": 0.0})
        strength = everything
        if points is not None:
            strength = [("predefined", {"C": near_neighbours(A, points)}), everything]
        made = pyamg.smoothed_aggregation_solver(
            A,
            B=modes,
            symmetry="symmetric",
            strength=strength,
            smooth=("energy", {"krylov": "cg", "maxiter": 4, "degree": 1}),
            presmoother=None,
            postsmoother=None,
            improve_candidates=None,
            max_coarse=COARSEST,
            coarse_solver="cholesky",
        )
    *fine, last = made.levels
    levels = []
    for one in fine:
        B = bsr_array(one.A)
        levels.append(
            AggregationLevel(
                bsr_array(
                    (B.data.astype(np.float32), B.indices, B.indptr),
                    shape=B.shape,
                    blocksize=B.blocksize,
                ),
                _inverses(B).astype(np.float32),
                one.P.astype(np.float32),
                one.P.T.astype(np.float32).tocsr()
                if one.P.format == "csr"
                else one.P.T.astype(np.float32),
            )
        )
        one.A = one.P = one.R = None
    return Hierarchy(levels, last.A.toarray(), np.any(last.B != 0.0, axis=1), A.shape[0])


def _inverses(A: bsr_array) -> FloatArray:
    """Inverses of the diagonal blocks (n, b, b).

    A block that is singular belongs to modes that its aggregate does not tell apart: those
    directions, zero to rounding, are left alone.
    """
    b, rows = A.blocksize[0], A.shape[0] // A.blocksize[0]
    row = np.repeat(np.arange(rows), np.diff(A.indptr))
    on = row == A.indices
    blocks = np.zeros((rows, b, b))
    blocks[row[on]] = A.data[on]
    values, vectors = np.linalg.eigh(0.5 * (blocks + blocks.transpose(0, 2, 1)))
    largest = values[:, -1:]
    if not (largest > 0.0).all():
        raise ConvergenceError(
            "Multigrid: a diagonal block of a level is not positive: the body "
            "floats, hold the distant set."
        )
    regular = values > b * EPS * largest * 1e3
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=regular)
    found: FloatArray = (vectors * inverse[:, None, :]) @ vectors.transpose(0, 2, 1)
    return found


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
        begin = perf_counter()
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
        padded, B = _padded(K, modes, self._place, self._n_padded, whole_blocks=layout is not None)
        at = None if points is None else positions(points, n, layout)
        self._cycle = hierarchy(padded, B, at)
        self._max_iterations = max_iterations
        self._lowest = UNSEEN
        self.seconds = perf_counter() - begin
        log.info("multigrid of %d dofs: levels %s", n, self._cycle.sizes)

    @property
    def nbytes(self) -> int:
        """Memory of the hierarchy."""
        return self._cycle.nbytes

    def _product(self, x: FloatArray) -> FloatArray:
        if not isinstance(self._K, Symmetric):
            return np.asarray(self._K @ x)
        U = self._K.upper
        return np.asarray(symmetric_product(U.indptr, U.indices, U.data, x))

    def _precondition(self, residual: FloatArray) -> FloatArray:
        padded = np.zeros(self._n_padded)
        padded[self._place] = residual
        return self._cycle(padded)[self._place]

    def many(self, rhs: FloatArray, accuracy: float) -> list[Solved]:
        """K^-1 rhs for the columns of (n, m), `WIDTH` at a time; raises as for one."""
        found: list[Solved] = []
        for first in range(0, rhs.shape[1], WIDTH):
            B = rhs[:, first : first + WIDTH]
            if B.shape[1] <= WIDTH // 2:
                # a block costs as much as four or five alone, however few it has
                found += [self(np.ascontiguousarray(b), accuracy) for b in B.T]
                continue
            made = block_conjugate_gradients(
                self._products,
                self._precondition_many,
                B,
                accuracy=accuracy,
                max_iterations=self._max_iterations,
                lowest=self._lowest,
            )
            self._lowest = made.lowest
            found += [
                Solved(x, float(error), made.iterations)
                for x, error in zip(made.x.T, made.errors, strict=True)
            ]
        return found

    def _products(self, X: FloatArray) -> FloatArray:
        if not isinstance(self._K, Symmetric):
            return np.asarray(self._K @ X)
        U, k = self._K.upper, X.shape[1]
        wide = np.zeros((len(X), WIDTH))
        wide[:, :k] = X
        return np.asarray(symmetric_product_many(U.indptr, U.indices, U.data, wide)[:, :k])

    def _precondition_many(self, residuals: FloatArray) -> FloatArray:
        padded = np.zeros((self._n_padded, residuals.shape[1]))
        padded[self._place] = residuals
        return self._cycle.many(padded)[self._place]

    def __call__(self, rhs: FloatArray, accuracy: float, start: FloatArray | None = None) -> Solved:
        """K^-1 rhs to a relative error in energy, from ``start``.

        Raises ConvergenceError where it is not reached.
        """
        found = conjugate_gradients(
            self._product,
            self._precondition,
            rhs,
            accuracy=accuracy,
            max_iterations=self._max_iterations,
            lowest=self._lowest,
            start=start,
        )
        self._lowest = found.lowest
        return Solved(found.x, found.error, found.iterations)


def _padded(
    K: Matrix, modes: FloatArray | None, place: IntArray, n_padded: int, *, whole_blocks: bool
) -> tuple[Any, FloatArray | None]:
    """K and its modes on whole blocks of 3 dofs per node.

    Aggregation must join whole nodes, but supports take single dofs out. A missing dof comes back
    as a row of its own with a stiffness of the size of the others and no part in the modes: it
    couples with nothing, so the answer is unchanged and the blocks are whole.
    """
    n = K.shape[0]
    B = None
    if modes is not None:
        B = np.zeros((n_padded, modes.shape[1]))
        B[place] = modes
    if not (n_padded % 3 == 0 and (whole_blocks or whole_nodes(n, modes))):
        return csr_matrix(whole(K)).tobsr(blocksize=(1, 1)), B
    order = np.argsort(place, kind="stable")
    if not np.array_equal(order, np.arange(n)):
        K = submatrix_of(csr_array(whole(K))[order][:, order].tocsr(), np.arange(n))
    U = (K if isinstance(K, Symmetric) else Symmetric.of(csr_array(K))).upper
    rising, nodes = place[order], n_padded // 3
    first = np.searchsorted(rising, 3 * np.arange(nodes + 1))
    pointers = count_blocks(U.indptr, U.indices, rising, first, nodes)
    small = np.int32 if pointers[-1] < np.iinfo(np.int32).max else np.int64
    columns, blocks = np.empty(pointers[-1], small), np.zeros((int(pointers[-1]), 3, 3))
    fill_blocks(U.indptr, U.indices, U.data, rising, first, pointers, columns, blocks)
    missing = np.setdiff1d(np.arange(n_padded), rising)
    on = np.flatnonzero(columns == np.repeat(np.arange(nodes), np.diff(pointers)))
    blocks[on[missing // 3], missing % 3, missing % 3] = float(np.median(K.diagonal()))
    shape = (n_padded, n_padded)
    return bsr_matrix((blocks, columns, pointers.astype(small)), shape=shape), B


def whole_nodes(n: int, B: FloatArray | None) -> bool:
    """Whether the first three modes show three dofs per node in order: each dof then moves in the
    translation of its own component only.

    Parameters
    ----------
    n : int
        Dofs.
    B : (n, m) ndarray or None
        Modes.

    Returns
    -------
    bool
    """
    if n % 3 or B is None or B.shape[1] < 3:
        return False
    T = B[:, :3].reshape(-1, 3, 3)
    off = T[:, ~np.eye(3, dtype=bool)]
    return bool((np.abs(off) <= np.sqrt(EPS) * np.abs(T).max()).all())


def positions(points: ArrayLike, n: int, layout: ArrayLike | None) -> FloatArray:
    """Positions of the blocks that `places` numbers; nan for dofs of rigid sets.

    Parameters
    ----------
    points : (n_node, 3) array_like
        mm.
    n : int
        Dofs.
    layout : (n,) array_like of int or None
        As for `MultigridSolver`.

    Returns
    -------
    (m, 3) ndarray

    Raises
    ------
    InputError
        For points that are not those of the layout.
    """
    at = np.asarray(points, np.float64)
    numbers = np.arange(n) if layout is None else np.asarray(layout)
    nodes = np.unique(numbers[numbers >= 0] // 3)
    if at.ndim != 2 or at.shape[1] != 3 or len(at) <= nodes.max(initial=-1):
        raise InputError(
            f"The points have the shape {at.shape}: give x, y, z of all nodes that the layout "
            f"counts, ({nodes.max(initial=-1) + 1}, 3)."
        )
    found = np.full((places(n, layout)[1] // 3, 3), np.nan)
    found[: len(nodes)] = at[nodes]
    return found


def places(n: int, layout: ArrayLike | None) -> tuple[IntArray, int]:
    """Where each dof goes among whole blocks of three per node, and how many places there are.

    Parameters
    ----------
    n : int
        Dofs.
    layout : (n,) array_like of int or None
        As for `MultigridSolver`.

    Returns
    -------
    (n,) ndarray of int, int

    Raises
    ------
    InputError
        For a layout that is none.
    """
    if layout is None:
        return np.arange(n), n
    numbers = np.asarray(layout)
    if numbers.shape != (n,) or not np.issubdtype(numbers.dtype, np.integer) or numbers.min() < -1:
        raise InputError(
            f"The layout is one whole number 3 * node + component per dof of K ({n}), -1 "
            f"in a rigid set; got {numbers.shape}."
        )
    nodal = numbers >= 0
    if len(np.unique(numbers[nodal])) != nodal.sum():
        raise InputError("The layout has a duplicated dof: number dofs 3 * node + component.")
    nodes = np.unique(numbers[nodal] // 3)
    place = np.empty(n, np.int64)
    place[nodal] = 3 * np.searchsorted(nodes, numbers[nodal] // 3) + numbers[nodal] % 3
    others = int((~nodal).sum())
    place[~nodal] = 3 * len(nodes) + np.arange(others)
    return place, 3 * (len(nodes) + -(-others // 3))
