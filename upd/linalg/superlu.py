"""SuperLU through SciPy: the portable fallback.

Slower than PARDISO by more than ten times on solids.
"""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

from upd.errors import ConvergenceError
from upd.linalg.common import (
    Condensed,
    Factor,
    FloatArray,
    IntArray,
    Solve,
    checked_dofs,
    checked_matrix,
    checked_vectors,
    inner_free_error,
    is_free,
    log,
    softest_motion,
)
from upd.linalg.symmetric import Matrix, whole

#: Bytes of the block of columns of K_ii^-1 K_ib held at a time.
BLOCK_BYTES = 2**27
#: A factor entry: its value and its row number, in L and in U.
_BYTES_PER_NNZ = 2 * (8 + 4)


def _lu(A: csr_array, numbers: IntArray) -> SuperLU:
    """Symmetric-mode factor of A; numbers (n,) are its dofs' numbers for the error.

    Raises ConvergenceError.
    """
    try:
        lu = symmetric_lu(A)
    except MemoryError as error:
        raise ConvergenceError(
            f"SuperLU: not enough memory for {A.shape[0]} dofs: use solver 'pardiso' or 'amg'."
        ) from error
    except RuntimeError as error:
        if not re.search("singular", str(error)):
            raise ConvergenceError(f"SuperLU stopped: {error}.") from error
        raise inner_free_error(None, numbers, "SuperLU") from error
    # Without row exchanges the pivots of a positive definite matrix are positive.
    exchanged = not np.array_equal(lu.perm_r, lu.perm_c)
    motion = softest_motion(A, lu.solve)
    if exchanged or not (lu.U.diagonal() > 0.0).all() or is_free(*motion):
        raise inner_free_error(motion, numbers, "SuperLU")
    return lu


def symmetric_lu(A: csr_array) -> SuperLU:
    """Factor of a real symmetric or Hermitian matrix with the diagonal as pivots.

    Parameters
    ----------
    A : (n, n) csr_array

    Returns
    -------
    SuperLU

    Raises
    ------
    RuntimeError, MemoryError
        As SciPy's.
    """
    C = csc_array(A)
    C.indices, C.indptr = C.indices.astype(np.int32), C.indptr.astype(np.int32)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Minimum degree on A' + A without pivoting keeps the symmetric fill-in: SuperLU Users'
        # Guide, section 2.4.
        return splu(
            C, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )


def signed_superlu(A: Matrix) -> tuple[int, Solve] | None:
    """L D L' of a symmetric matrix without pivoting; the signs of D are those of U's diagonal.

    Nothing bounds the growth of its entries: whoever uses it looks whether it solves.

    Parameters
    ----------
    A : (n, n) Symmetric or csr_array

    Returns
    -------
    (int, callable) or None
        Negative eigenvalues (Sylvester's law of inertia), and right-hand sides -> A^-1 rhs. None
        when rows were exchanged, a pivot vanished, or memory ran out.
    """
    try:
        lu = symmetric_lu(whole(A))
    except (RuntimeError, MemoryError):
        return None
    D = lu.U.diagonal()
    if not np.array_equal(lu.perm_r, lu.perm_c) or not (np.isfinite(D) & (D != 0.0)).all():
        return None
    return int((D < 0.0).sum()), lambda rhs: _solved(lu, rhs)


def factorise_superlu(K: Any) -> Factor:
    """Factor of a symmetric positive definite matrix.

    Parameters
    ----------
    K : (n, n) sparse array or array_like
        N/mm.

    Returns
    -------
    Factor

    Raises
    ------
    InputError
        For a bad K.
    ConvergenceError
        For a floating body or too little memory.
    """
    A = checked_matrix(whole(K))
    lu = _lu(A, np.arange(A.shape[0]))

    def solve(rhs: FloatArray) -> FloatArray:
        return _solved(lu, checked_vectors(rhs, A.shape[0], "right-hand side"))

    return Factor(solve, "superlu", lu.nnz // 2, _BYTES_PER_NNZ * lu.nnz // 2)


def _solved(lu: SuperLU, rhs: FloatArray) -> FloatArray:
    return np.ascontiguousarray(lu.solve(rhs)) if rhs.size else np.zeros_like(rhs)


def schur_superlu(K: Any, kept: ArrayLike, *, keep_factor: bool = True) -> Condensed:
    """Schur complement of a matrix on some dofs, by back-substitution of K_ib in blocks of columns.

    Parameters
    ----------
    K : (n, n) sparse array or array_like
        N/mm.
    kept : (k,) array_like of int
        In any order.
    keep_factor : bool, default True
        Hold the factor of K_ii for `recover`; otherwise `recover` factorises once more when first
        called.

    Returns
    -------
    Condensed

    Raises
    ------
    InputError
        For a bad K or bad dofs.
    ConvergenceError
        When K_ii is singular.
    """
    A = checked_matrix(whole(K))
    n = A.shape[0]
    kept = checked_dofs(kept, n)
    inner = np.setdiff1d(np.arange(n), kept)
    rows = A[inner]
    K_ii, K_ib = csr_array(rows[:, inner]), csc_array(rows[:, kept])
    S = A[kept][:, kept].toarray()
    held: list[SuperLU] = [_lu(K_ii, inner)] if inner.size else []
    nnz = held[0].nnz // 2 if held else 0
    step = max(1, BLOCK_BYTES // (8 * max(1, len(inner))))
    for first in range(0, len(kept) if inner.size else 0, step):
        block = slice(first, first + step)
        S[:, block] -= K_ib.T @ held[0].solve(K_ib[:, block].toarray())
    S = 0.5 * (S + S.T)
    if not keep_factor:
        held.clear()

    def recover(u_kept: FloatArray) -> FloatArray:
        u_b = checked_vectors(u_kept, len(kept), "displacement of the kept dofs")
        u = np.zeros((n, *u_b.shape[1:]))
        u[kept] = u_b
        if inner.size:
            if not held:
                held.append(_lu(K_ii, inner))
            u[inner] = _solved(held[0], -(K_ib @ u_b))
        return u

    peak = _BYTES_PER_NNZ * nnz + 3 * 8 * min(step, len(kept)) * len(inner)
    log.info("superlu: %d dofs onto %d, %d factor non-zeros", n, len(kept), nnz)
    return Condensed(S, recover, "superlu", nnz, peak, n)
