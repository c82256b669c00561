"""MKL PARDISO: Schur complement and recovery from one factorisation.

pypardiso finds the library and calls its 32-bit entry for plain solves only. The entry
`pardiso_64` of the same library is called here instead: its 64-bit integers leave no count to
overflow, for a tenth more memory. Numbers are those of the C manual (iparm from 0) [1]_.

Its analysis for a Schur complement orders the graph of the inner dofs alone. Where that graph has
no edge it orders nothing, and then moves data by the numbers of a permutation it never wrote
(`mkl_pds_permutetips`, MKL 2026.2, any iparm[1], any number of threads). What these numbers are is
chance; mostly they are zeros of fresh memory, hence a crash now and then. Seen with valgrind
(uninitialised heap memory, allocated and read in that function) and with MALLOC_PERTURB_=170: of
1 500 random matrices of 2 to 60 dofs all 611 with a diagonal K_ii crashed in the analysis, none of
the 889 others. Arrays of exact length between inaccessible pages are read and written inside their
bounds only, whatever the dummy right-hand side of the factorisation. So PARDISO never gets a
diagonal K_ii (`uncoupled`): SuperLU does, whose factor of it is itself.

References
----------
.. [1] Intel oneMKL Developer Reference, "oneMKL PARDISO Parameters in Tabular Form".
"""

from __future__ import annotations

import ctypes
import os
import weakref
from collections.abc import Callable
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array, diags_array

from upd.errors import ConvergenceError, InputError
from upd.linalg.common import (
    Condensed,
    Factor,
    FloatArray,
    IntArray,
    Solve,
    checked_dofs,
    checked_vectors,
    inner_free_error,
    is_free,
    log,
    row_blocks,
    softest_motion,
)
from upd.linalg.superlu import schur_superlu
from upd.linalg.symmetric import Matrix, Symmetric, checked, stored, upper_triangle

SPD, SYMMETRIC, HERMITIAN = 2, -2, 4
ANALYSE, FACTORISE, SOLVE, BACKWARD, RELEASE = 11, 22, 33, 333, -1
NOT_POSITIVE = -4
_FAULTS = {
    -1: "inconsistent input",
    -2: "not enough memory; use solver 'amg', a coarser mesh or mirror symmetry",
    -3: "reordering failed",
    -7: "singular diagonal matrix",
    -8: "an integer overflow; use solver 'amg' or a coarser mesh",
    -9: "not enough memory for the out-of-core solver",
}
_KIB = 1024


def _point_to_mkl() -> None:
    """Set the path of MKL's library for pypardiso, which else searches for half a second."""
    if "PYPARDISO_MKL_RT" in os.environ:
        return
    try:
        files = metadata.files("mkl") or []
    except metadata.PackageNotFoundError:
        return
    for file in files:
        if file.name.startswith(("libmkl_rt.so", "mkl_rt.", "libmkl_rt.dylib")):
            os.environ["PYPARDISO_MKL_RT"] = str(Path(str(file.locate())).resolve())
            return


@cache
def load() -> Callable[..., None]:
    """MKL's 64-bit entry to PARDISO. Raises InputError when pypardiso or MKL is not installed."""
    _point_to_mkl()
    try:
        from pypardiso import PyPardisoSolver

        call: Any = PyPardisoSolver().libmkl.pardiso_64
    except (ImportError, AttributeError, OSError) as error:
        raise InputError(
            f'Solver "pardiso" is not installed ({error}): pip install updampers[mkl], or choose '
            '"superlu" or "amg".'
        ) from error
    call.restype = None
    return call  # type: ignore[no-any-return]


def _call(
    handle: IntArray,
    phase: int,
    n: int,
    matrix: tuple[Any, ...],
    perm: IntArray,
    iparm: IntArray,
    vectors: tuple[FloatArray, FloatArray],
    kind: int = SPD,
) -> int:
    """One call of PARDISO with right-hand sides and answers; returns its error code.

    Only the solve phases read right-hand sides and their number. The factorisation takes the Schur
    complement's array for x, and one right-hand side that it does not read.
    """
    error, (rhs, x) = np.zeros(1, np.int64), vectors
    numbers = [np.array([v], np.int64) for v in (1, 1, kind, phase, n)]
    many = phase in (SOLVE, BACKWARD) and x.ndim == 2
    count = np.array([x.shape[1] if many else 1], np.int64)
    quiet = np.zeros(1, np.int64)
    arrays = [handle, *numbers, *matrix, perm, count, iparm, quiet, rhs, x, error]
    load()(*(one.ctypes.data_as(ctypes.c_void_p) for one in arrays))
    return int(error[0])


def _release(handle: IntArray, n: int, iparm: IntArray, kind: int) -> None:
    """Give the memory back; runs when the owner is collected."""
    none, whole = np.zeros(2), np.zeros(1, np.int64)
    _call(handle, RELEASE, n, (none, whole, whole), whole, iparm, (none, none), kind)


class _Pardiso:
    """One symmetric matrix inside PARDISO, every diagonal entry stored, from its analysis to its
    release.
    """

    def __init__(
        self,
        A: Matrix,
        kept: IntArray | None = None,
        *,
        kind: int = SPD,
    ) -> None:
        self.n, self.kind = A.shape[0], kind
        self.handle = np.zeros(64, np.int64)
        # Values, row pointers and columns, from 1, of the upper triangle: two thirds of K; of a
        # `Symmetric` the values are its own.
        if isinstance(A, Symmetric):
            U = A.upper
            data, indptr, columns = U.data, U.indptr.astype(np.int64), U.indices.astype(np.int64)
        else:
            data, indptr, columns = upper_triangle(A)
        columns += 1
        indptr += 1
        self.matrix = data, indptr, columns
        self.perm = np.zeros(self.n, np.int64)
        self.iparm = np.zeros(64, np.int64)
        # Own values; parallel nested dissection; report factor non-zeros. Everything else 0:
        # neither scaling nor matching (needless for an SPD matrix), no refinement (nothing is
        # perturbed), in core, and the classic factorisation, which finds every singular matrix (the
        # two-level one, iparm[23] = 1, gains a tenth here but returned garbage before its error).
        self.iparm[[0, 1, 17]] = 1, 3, -1
        if kept is not None:
            # Schur complement with its factor, for the recovery.
            self.perm[kept] = 1
            self.iparm[35] = 2
        if kind == SYMMETRIC:
            # Pivots below 1e-13 of the norm are perturbed (and counted); 1x1 and 2x2 pivots.
            self.iparm[[9, 20]] = 13, 1
        # Gives the memory back, when called or when nobody holds this any more. Before the first
        # call, so that a failed phase is released as well. At exit the process frees more quickly
        # than MKL.
        self.close = weakref.finalize(self, _release, self.handle, self.n, self.iparm, kind)
        self.close.atexit = False

    def run(self, phase: int, rhs: FloatArray | None = None, x: FloatArray | None = None) -> int:
        """One phase. Returns 0 or NOT_POSITIVE; raises ConvergenceError for any other error."""
        if not self.close.alive:
            raise ConvergenceError("PARDISO: the factor was already released: factorise again.")
        none = np.zeros(2)  # the size of one complex number too
        rhs, x = none if rhs is None else rhs, none if x is None else x
        code = _call(
            self.handle, phase, self.n, self.matrix, self.perm, self.iparm, (rhs, x), self.kind
        )
        if code not in (0, NOT_POSITIVE):
            raise ConvergenceError(
                f"PARDISO stopped in phase {phase} with code {code}: "
                f"{_FAULTS.get(code, 'see its manual')}."
            )
        return code

    def solve(self, rhs: FloatArray, phase: int = SOLVE) -> FloatArray:
        """K^-1 rhs, or another solve phase, for right-hand sides (n,) or (n, m)."""
        b = np.asfortranarray(rhs, dtype=self.matrix[0].dtype)
        x = np.zeros_like(b, order="F")
        if b.size:
            self.run(phase, b, x)
        return x

    def size(self) -> tuple[int, int]:
        """Non-zeros of the factor, and the peak of memory in bytes as in the manual."""
        peak = int(max(self.iparm[14], self.iparm[15] + self.iparm[16]))
        return int(self.iparm[17]), _KIB * peak


def factorise_pardiso(K: Any) -> Factor:
    """Factor of a symmetric positive definite matrix.

    Parameters
    ----------
    K : (n, n) Symmetric, sparse array or array_like
        N/mm.

    Returns
    -------
    Factor

    Raises
    ------
    InputError
        For a matrix that is not a stiffness, or a missing library.
    ConvergenceError
        For a floating body or too little memory.
    """
    A = checked(K)
    solver = _Pardiso(A)
    solver.run(ANALYSE)
    code = solver.run(FACTORISE)
    motion = None if code else softest_motion(A, solver.solve)
    if motion is None or is_free(*motion):
        raise inner_free_error(motion, np.arange(A.shape[0]), "PARDISO")

    def solve(rhs: FloatArray) -> FloatArray:
        return np.ascontiguousarray(solver.solve(checked_vectors(rhs, solver.n, "right-hand side")))

    return Factor(solve, "pardiso", *solver.size())


def hermitian_pardiso(upper: csr_array) -> Solve:
    """x -> A^-1 x of a Hermitian positive definite matrix.

    Parameters
    ----------
    upper : (n, n) csr_array of complex
        Its upper triangle, indices sorted, every diagonal entry stored.

    Raises
    ------
    ConvergenceError
        When it is not positive definite, or memory runs out.
    """
    solver = _Pardiso(Symmetric(upper), kind=HERMITIAN)
    solver.run(ANALYSE)
    if solver.run(FACTORISE):
        raise inner_free_error(None, np.arange(solver.n), "PARDISO")
    return solver.solve


def signed_pardiso(A: Matrix) -> tuple[int, Solve] | None:
    """L D L' of a symmetric matrix with 1x1 and 2x2 pivots, and how many eigenvalues are negative.

    Parameters
    ----------
    A : (n, n) Symmetric or csr_array
        With every diagonal entry stored.

    Returns
    -------
    (int, callable) or None
        Negative eigenvalues (Sylvester's law of inertia), and right-hand sides -> A^-1 rhs. None
        when a pivot was perturbed: its sign is then not the matrix's own.

    Raises
    ------
    ConvergenceError
        When memory runs out.
    """
    solver = _Pardiso(A, kind=SYMMETRIC)
    # A shifted matrix made for this call only ends here.
    del A
    solver.run(ANALYSE)
    solver.run(FACTORISE)
    positive, negative, perturbed = (int(solver.iparm[i]) for i in (21, 22, 13))
    if perturbed or positive + negative != solver.n:
        return None
    return negative, solver.solve


def schur_pardiso(K: Any, kept: ArrayLike, *, keep_factor: bool = True) -> Condensed:
    """Schur complement of a matrix on some dofs, and its recovery, from one factorisation.

    S may be singular (a body that only the kept dofs hold): K_ii must be positive definite.

    Parameters
    ----------
    K : (n, n) Symmetric, sparse array or array_like
        N/mm.
    kept : (k,) array_like of int
        In any order.
    keep_factor : bool, default True
        Hold the factor for `recover`, until the result is collected; otherwise `recover` factorises
        once more when first called.

    Returns
    -------
    Condensed

    Raises
    ------
    InputError
        For a bad K, bad dofs or a missing library.
    ConvergenceError
        When K_ii is singular or memory runs out.
    """
    A = checked(K)
    kept = checked_dofs(kept, A.shape[0])
    if uncoupled(A, kept):
        return schur_superlu(A, kept, keep_factor=keep_factor)
    solver, S = _schur(A, kept)
    nnz, peak = solver.size()
    held: list[_Pardiso] = [solver]
    if not keep_factor:
        held.pop().close()

    def recover(u_kept: FloatArray) -> FloatArray:
        u = checked_vectors(u_kept, len(kept), "displacement of the kept dofs")
        if not held:
            held.append(_schur(A, kept)[0])
        y = np.zeros((A.shape[0], *u.shape[1:]))
        y[kept] = u
        return np.ascontiguousarray(held[0].solve(y, BACKWARD))

    log.info(
        "pardiso: %d dofs onto %d, %d factor non-zeros, %.2f GB",
        A.shape[0],
        len(kept),
        nnz,
        peak / 1e9,
    )
    return Condensed(S, recover, "pardiso", nnz, peak, A.shape[0])


def _schur(A: Matrix, kept: IntArray) -> tuple[_Pardiso, FloatArray]:
    """PARDISO after its factorisation, and S in the order of `kept`.

    PARDISO factorises S too, hence refuses a singular one. A spring on every kept dof makes it
    definite and is subtracted from S exactly afterwards; K_ii and the recovery do not see it. So
    what fails with the spring is a singular K_ii.
    """
    motion = None
    for spring in (0.0, float(A.diagonal()[kept].max())):
        B = A
        if spring:
            held = np.zeros(A.shape[0])
            held[kept] = spring
            D = csr_array(diags_array(held))
            B = Symmetric(A.upper + D) if isinstance(A, Symmetric) else csr_array(A + D)
        solver = _Pardiso(B, kept)
        solver.run(ANALYSE)
        S = np.zeros((len(kept), len(kept)))
        code = solver.run(FACTORISE, None, S)
        motion = None if code else softest_motion(B, solver.solve)
        if motion is not None and not is_free(*motion):
            # S comes back for increasing dofs; some versions fill one triangle only.
            S = np.where(S == 0.0, S.T, S)
            place = np.argsort(np.argsort(kept))
            return solver, S[np.ix_(place, place)] - spring * np.eye(len(kept))
        solver.close()
    raise inner_free_error(motion, np.arange(A.shape[0]), "PARDISO")


def uncoupled(K: Matrix, kept: IntArray) -> bool:
    """Whether inner dofs touch kept dofs only: K_ii is then diagonal.

    Parameters
    ----------
    K : (n, n) Symmetric or csr_array
        As `upd.linalg.symmetric.checked` gives it.
    kept : (k,) array of int
    """
    A = stored(K)
    n = A.shape[0]
    is_inner = np.ones(n, bool)
    is_inner[kept] = False
    for first, last in row_blocks(A):
        part = slice(A.indptr[first], A.indptr[last])
        row = np.repeat(np.arange(first, last), np.diff(A.indptr[first : last + 1]))
        column = A.indices[part]
        if (is_inner[row] & is_inner[column] & (row != column) & (A.data[part] != 0.0)).any():
            return False
    return True
