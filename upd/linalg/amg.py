"""Conjugate gradients with smoothed aggregation multigrid (pyamg) and rigid-body modes.

Memory like n, for large meshes.

References
----------
.. [1] P. Vanek, J. Mandel, M. Brezina, Computing 56 (1996) 179 (the rigid-body modes as near null
   space).
.. [2] Y. Saad, Iterative Methods for Sparse Linear Systems, ch. 9.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import bsr_matrix, csr_array, csr_matrix, diags_array
from scipy.sparse.linalg import LinearOperator, cg

from upd.errors import ConvergenceError, InputError
from upd.linalg.common import (
    EPS,
    FloatArray,
    IntArray,
    checked_dofs,
    checked_matrix,
    checked_vectors,
    log,
)
from upd.linalg.symmetric import whole

RTOL = 1e-10
MAX_ITERATIONS = 1000
#: The coarsest level is factorised: below this many aggregates that is free.
COARSEST = 100


@dataclass(frozen=True)
class AmgSolution:
    """One answer of conjugate gradients.

    Attributes
    ----------
    x : (n,) ndarray
        Solution.
    iterations : int
        Their number.
    residual : float
        |b - K x| / |b|.
    seconds : float
        Set-up and solution.
    status : int
        0.
    message : str
        How it ended.
    """

    x: FloatArray
    iterations: int
    residual: float
    seconds: float
    status: int
    message: str


@dataclass(frozen=True)
class _AmgSolver:
    """A multigrid hierarchy on padded dofs: place (n,) is where each dof sits among them."""

    K: csr_array
    precondition: Callable[[FloatArray], FloatArray]
    place: IntArray
    n_padded: int
    seconds: float

    def __call__(self, rhs: FloatArray, rtol: float, max_iterations: int) -> AmgSolution:
        begin = perf_counter()
        size = float(np.linalg.norm(rhs))
        if size == 0.0:
            return AmgSolution(np.zeros(len(rhs)), 0, 0.0, 0.0, 0, "The load is zero.")
        count = 0

        def step(_: FloatArray) -> None:
            nonlocal count
            count += 1

        n = len(rhs)
        M: Any = LinearOperator((n, n), matvec=self._cycle, dtype=np.float64)
        try:
            x, _ = cg(self.K, rhs, rtol=rtol, atol=0.0, maxiter=max_iterations, M=M, callback=step)
        except RuntimeError as error:  # SuperLU on the coarsest level
            raise ConvergenceError(
                f"Multigrid: the coarsest level failed ({error}): the body floats, hold "
                "the distant set."
            ) from error
        residual = float(np.linalg.norm(rhs - self.K @ x)) / size
        # The updated residual of CG drifts from the true one by rounding, which eps |K| |x| / |b|
        # bounds.
        reachable = max(
            2.0 * rtol, EPS * float(abs(self.K).sum(axis=1).max()) * float(np.linalg.norm(x)) / size
        )
        if not residual <= reachable:
            raise ConvergenceError(
                f"Multigrid: conjugate gradients stopped after {count} iterations with "
                f"residual {residual:.1e}, {rtol:.0e} was asked. "
                "A part of the body floats (hold the distant set), or hexahedra are "
                "stretched: use a direct solver, a mesh with smaller "
                "aspect ratios, or more iterations; and give the rigid-body modes as near "
                "null space."
            )
        message = f"Converged in {count} iterations to residual {residual:.1e}."
        return AmgSolution(x, count, residual, perf_counter() - begin, 0, message)

    def _cycle(self, residual: FloatArray) -> FloatArray:
        padded = np.zeros(self.n_padded)
        padded[self.place] = np.ravel(residual)
        out: FloatArray = self.precondition(padded)[self.place]
        return out


def amg_solve(
    K: Any,
    rhs: ArrayLike,
    near_null_space: ArrayLike | None = None,
    *,
    layout: ArrayLike | None = None,
    rtol: float = RTOL,
    max_iterations: int = MAX_ITERATIONS,
) -> AmgSolution:
    """Solve K x = rhs for a symmetric positive definite K.

    Parameters
    ----------
    K : (n, n) sparse array
        Stiffness, N/mm.
    rhs : (n,) array_like
        Forces, N.
    near_null_space : (n, 6) array_like, optional
        Rigid-body modes at the dofs of K; without them several times the iterations.
    layout : (n,) array_like of int, optional
        Number 3 * node + component of each dof of K, -1 for a dof of a rigid set. None: whole nodes
        in order, if n is a multiple of three and the first three modes are the translations of
        whole nodes; else no blocks.
    rtol : float
        Relative residual |b - K x| / |b| at which to stop.
    max_iterations : int

    Returns
    -------
    AmgSolution

    Raises
    ------
    InputError
        For bad arguments.
    ConvergenceError
        When `max_iterations` do not reach `rtol`.
    """
    A = checked_matrix(whole(K))
    b = checked_vectors(rhs, A.shape[0], "right-hand side")
    if b.ndim != 1:
        raise InputError(
            f"amg_solve takes one right-hand side (n,), not {b.shape}: call it once per load case."
        )
    solver = _set_up(A, near_null_space, layout)
    found = solver(b, rtol, max_iterations)
    log.info("amg: %d dofs, %s", A.shape[0], found.message)
    return AmgSolution(
        found.x,
        found.iterations,
        found.residual,
        solver.seconds + found.seconds,
        found.status,
        found.message,
    )


@dataclass(frozen=True)
class AmgCompliance:
    """Compliance at some dofs by multigrid.

    Attributes
    ----------
    C : (k, k) ndarray
        mm/N, exactly symmetric.
    iterations : int
        Most for a column.
    seconds : float
    solve : callable
        Forces f_b (k,) at these dofs -> displacements u (n,).
    """

    C: FloatArray
    iterations: int
    seconds: float
    solve: Callable[[FloatArray], FloatArray]


def compliance_amg(
    K: Any,
    dofs: ArrayLike,
    near_null_space: ArrayLike | None = None,
    *,
    layout: ArrayLike | None = None,
    rtol: float = RTOL,
    max_iterations: int = MAX_ITERATIONS,
) -> AmgCompliance:
    """Compliance C = (K^-1)_bb at some dofs, column by column: k solutions, memory of one.

    The inverse of C is the Schur complement of K on the dofs.

    Parameters
    ----------
    K : (n, n) sparse array
        Stiffness, N/mm.
    dofs : (k,) array_like of int
        Dofs b of the rows and columns of C.
    near_null_space, layout, rtol, max_iterations
        As for `amg_solve`.

    Returns
    -------
    AmgCompliance

    Raises
    ------
    InputError, ConvergenceError
        As for `amg_solve`.
    """
    start = perf_counter()
    A = checked_matrix(whole(K))
    b = checked_dofs(dofs, A.shape[0])
    solver = _set_up(A, near_null_space, layout)
    C = np.empty((len(b), len(b)))
    most = 0
    for j, dof in enumerate(b):
        unit = np.zeros(A.shape[0])
        unit[dof] = 1.0
        found = solver(unit, rtol, max_iterations)
        C[:, j] = found.x[b]
        most = max(most, found.iterations)
    log.info("amg: %d columns at %d dofs, at most %d iterations each", len(b), A.shape[0], most)

    def solve(force: FloatArray) -> FloatArray:
        f = np.zeros(A.shape[0])
        f[b] = checked_vectors(force, len(b), "force at the kept dofs")
        return solver(f, rtol, max_iterations).x

    return AmgCompliance(0.5 * (C + C.T), most, perf_counter() - start, solve)


def _set_up(
    A: csr_array, near_null_space: ArrayLike | None, layout: ArrayLike | None
) -> _AmgSolver:
    """Hierarchy on blocks of 3 dofs per node.

    Aggregation must join whole nodes, but supports take single dofs out. A missing dof comes back
    as a row of its own with a stiffness of the size of the others and no part in the modes: it
    couples with nothing, so the answer is unchanged and the blocks are whole.
    """
    start = perf_counter()
    n = A.shape[0]
    B = None if near_null_space is None else checked_vectors(near_null_space, n, "near null space")
    if B is None:
        log.warning("amg without rigid-body modes: several times the iterations")
    elif B.ndim != 2:
        raise InputError(f"The near null space has shape {B.shape}: give ({n}, 6).")
    place, n_padded = _places(n, B, layout)
    block = 3 if n_padded % 3 == 0 and (layout is not None or _whole_nodes(n, B)) else 1
    padded: Any = csr_matrix(A)
    if n_padded > n:
        entries = A.tocoo()
        padded = csr_matrix(
            (entries.data, (place[entries.row], place[entries.col])), shape=(n_padded, n_padded)
        )
        missing = np.full(n_padded, float(np.median(A.diagonal())))
        missing[place] = 0.0
        padded = csr_matrix(padded + diags_array(missing))
    modes = None
    if B is not None:
        modes = np.zeros((n_padded, B.shape[1]))
        modes[place] = B
    if block == 3:
        padded = bsr_matrix(padded, blocksize=(3, 3))
    sweep = ("block_gauss_seidel" if block == 3 else "gauss_seidel", {"sweep": "symmetric"})
    import pyamg  # a third of a second, and few runs need it

    with warnings.catch_warnings():
        # pyamg warns of formats that it then converts itself.
        warnings.simplefilter("ignore")
        # No strength threshold: on a box of aspect 1 to 16 one of 0.02 saved a tenth of 49
        # iterations, 0.05 and more cost some.
        levels = pyamg.smoothed_aggregation_solver(
            padded,
            B=modes,
            symmetry="symmetric",
            strength=("symmetric", {"theta": 0.0}),
            presmoother=sweep,
            postsmoother=sweep,
            improve_candidates=None,
            max_coarse=COARSEST,
            coarse_solver="splu",
        )
    cycle = levels.aspreconditioner(cycle="V")
    return _AmgSolver(A, cycle.matvec, place, n_padded, perf_counter() - start)


def _whole_nodes(n: int, B: FloatArray | None) -> bool:
    """Whether the first three modes show three dofs per node in order.

    Each dof then moves in the translation of its own component only.
    """
    if n % 3 or B is None or B.shape[1] < 3:
        return False
    T = B[:, :3].reshape(-1, 3, 3)
    off = T[:, ~np.eye(3, dtype=bool)]
    return bool((np.abs(off) <= np.sqrt(EPS) * np.abs(T).max()).all())


def _places(n: int, B: FloatArray | None, layout: ArrayLike | None) -> tuple[IntArray, int]:
    """Where each dof goes, and how many places there are."""
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
