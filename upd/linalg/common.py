"""What the solvers share: results, checks of arguments, the test for free motions."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lapack
from scipy.sparse import csr_array

from upd.errors import ConvergenceError, InputError
from upd.labels import Shown

log = logging.getLogger("upd.linalg")

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Solve = Callable[[FloatArray], FloatArray]

EPS = float(np.finfo(np.float64).eps)
#: of multigrid
MAX_ITERATIONS = 3000
#: right-hand sides that multigrid holds at once
AT_ONCE = 8
#: Entries of a matrix worked on at a time, some MB.
_BLOCK = 2**18
#: Strips in which a matrix is compared with its transpose; each pass over it costs a little.
_STRIPS = 16
#: Attribute of a matrix that `checked_matrix` made.
_CHECKED = "_upd_checked"


@dataclass(frozen=True, repr=False)
class Condensed(Shown):
    """A body condensed on k kept dofs: loads elsewhere are zero.

    Attributes
    ----------
    S : (k, k) ndarray
        Schur complement K_bb - K_bi K_ii^-1 K_ib in N/mm, exactly symmetric, in the order of the
        kept dofs.
    recover : callable
        u_b (k,) or (k, m) -> u (n,) or (n, m) with u_i = -K_ii^-1 K_ib u_b.
    solver : str
        Name of the solver that ran.
    factor_nnz : int
        Non-zeros of one triangle of the factor (0 with multigrid: not known).
    peak_bytes : int
        Largest memory of the solver, its own count.
    n_dof : int
        n.
    """

    S: FloatArray
    recover: Solve
    solver: str
    factor_nnz: int
    peak_bytes: int
    n_dof: int
    _compliance: list[FloatArray] = field(default_factory=list, repr=False)

    def compliance(self) -> FloatArray:
        """Compliance at the kept dofs; computed once, by Cholesky.

        Returns
        -------
        (k, k) ndarray
            S^-1 in mm/N, exactly symmetric, read-only.

        Raises
        ------
        ConvergenceError
            When S is not positive definite: the body floats.
        """
        if not self._compliance:
            self._compliance.append(inverse_definite(self.S))
        return self._compliance[0]

    def under(self, force: FloatArray) -> FloatArray:
        """Displacements u (n,) of all dofs of K under forces (k,) at the kept ones."""
        return self.recover(self.compliance() @ force)


def inverse_definite(S: FloatArray) -> FloatArray:
    """Inverse of a symmetric positive definite matrix by LAPACK potrf and potri.

    Raises ConvergenceError when it is not definite.
    """
    factor, info = lapack.dpotrf(np.asfortranarray(S), lower=1)
    if info == 0:
        inverse, info = lapack.dpotri(factor, lower=1)
    if info != 0:
        raise ConvergenceError(
            f"The condensed stiffness is not positive definite (row {abs(info) - 1}): the "
            "body floats. To fix it: hold the distant set."
        )
    lower = np.tril(inverse)
    full: FloatArray = lower + np.tril(inverse, -1).T
    full.flags.writeable = False
    return full


@dataclass(frozen=True)
class Factor:
    """A factorised K: call it with right-hand sides (n,) or (n, m) for K^-1 rhs.

    Attributes
    ----------
    solve : callable
        Right-hand sides (n,) or (n, m) -> K^-1 rhs of the same shape.
    solver : str
        Name of the solver that ran.
    factor_nnz : int
        Non-zeros of one triangle of the factor.
    peak_bytes : int
        Largest memory of the solver, its own count.
    """

    solve: Solve
    solver: str
    factor_nnz: int
    peak_bytes: int

    def __call__(self, rhs: FloatArray) -> FloatArray:
        return self.solve(rhs)


def checked_matrix(K: Any) -> csr_array:
    """K as a float64 CSR array with sorted indices.

    Parameters
    ----------
    K : (n, n) sparse array or array_like

    Returns
    -------
    (n, n) csr_array

    Raises
    ------
    InputError
        When K is not square, complex, not finite, not symmetric, or has a diagonal entry <= 0.
    """
    shape = getattr(K, "shape", None)
    if shape is None or len(shape) != 2 or shape[0] != shape[1] or shape[0] == 0:
        raise InputError(
            f"A stiffness is a square matrix, this one has shape {shape}: pass rows and "
            "columns of the same dofs."
        )
    if _CHECKED in getattr(K, "__dict__", {}):
        return K  # type: ignore[no-any-return]
    A = symmetric_csr(K, "stiffness")
    diagonal = A.diagonal()
    if not (diagonal > 0.0).all():
        dof = int(np.argmin(diagonal))
        raise InputError(
            f"Dof {dof} has no positive stiffness (K_dd = {diagonal[dof]:.2e}): it belongs "
            "to no element, or K has the wrong sign. "
            "Take the dof out."
        )
    # A new object on the caller's arrays: the mark is on nothing that he could change the shape of.
    vars(A)[_CHECKED] = True
    return A


def symmetric_csr(K: Any, name: str) -> csr_array:
    """A real symmetric matrix as a float64 CSR array with sorted indices.

    Parameters
    ----------
    K : (n, n) sparse array or array_like
    name : str
        What the message calls it.

    Returns
    -------
    (n, n) csr_array

    Raises
    ------
    InputError
        When it is complex, not finite or not symmetric.
    """
    if np.iscomplexobj(K):
        raise InputError(
            f"The {name} is complex; these solvers are for real symmetric matrices: pass its real "
            "part."
        )
    A = csr_array(K, dtype=np.float64)
    if not A.has_canonical_format:
        # A copy, because summing duplicates in place would change the caller's matrix.
        A = A.copy()
        A.sum_duplicates()
    bad = ~np.isfinite(A.data)
    if bad.any():
        row = int(np.searchsorted(A.indptr, np.argmax(bad), side="right")) - 1
        raise InputError(
            f"The {name} has {bad.sum()} entries that are not finite, the first in row {row}: "
            "check mesh and material."
        )
    # An entry is a sum over at most as many elements as its row has entries, rounded in another
    # order below the diagonal.
    terms = int(np.diff(A.indptr).max())
    size = max(float(A.data.max(initial=0.0)), -float(A.data.min(initial=0.0)))
    largest, row, column = largest_skew(A)
    if largest > 4 * terms * EPS * size:
        raise InputError(
            f"The {name} is not symmetric: its entry ({row}, {column}) and that across the "
            f"diagonal differ by {largest:.2e}, its largest entry is {size:.2e}."
        )
    return A


def largest_skew(A: csr_array) -> tuple[float, int, int]:
    """Largest |A - A'|, its row and its column.

    A strip of rows less the same strip of columns at a time: the whole A' is another A.

    Parameters
    ----------
    A : (n, n) csr_array

    Returns
    -------
    float, int, int
    """
    found = (0.0, 0, 0)
    edges = np.linspace(0, A.shape[0], _STRIPS + 1).astype(int)
    for first, last in pairwise(edges):
        if first == last:
            continue
        skew = csr_array(A[first:last] - A[:, first:last].T)
        skew.data = np.abs(skew.data)
        if skew.nnz and skew.data.max() > found[0]:
            row, column = np.unravel_index(int(skew.argmax()), skew.shape)
            found = (float(skew.data.max()), int(row) + int(first), int(column))
    return found


def submatrix(A: csr_array, dofs: IntArray) -> csr_array:
    """A[dofs][:, dofs] without the rows A[dofs] in between, which are another A.

    Parameters
    ----------
    A : (n, n) csr_array
        With sorted indices.
    dofs : (k,) array of int
        Rising.

    Returns
    -------
    (k, k) csr_array
    """
    rank = np.full(A.shape[1], -1, A.indices.dtype)
    rank[dofs] = np.arange(len(dofs), dtype=A.indices.dtype)
    counts = np.zeros(A.shape[0] + 1, np.int64)
    for first, last in row_blocks(A):
        inside = rank[A.indices[A.indptr[first] : A.indptr[last]]] >= 0
        ends = np.concatenate([[0], np.cumsum(inside)])[
            A.indptr[first : last + 1] - A.indptr[first]
        ]
        counts[first + 1 : last + 1] = np.diff(ends)
    counts[1:][rank < 0] = 0
    indptr = np.cumsum(counts)
    indices = np.empty(int(indptr[-1]), A.indices.dtype)
    data = np.empty(len(indices), A.data.dtype)
    for first, last in row_blocks(A):
        part = slice(A.indptr[first], A.indptr[last])
        column = rank[A.indices[part]]
        row = np.repeat(rank[first:last] >= 0, np.diff(A.indptr[first : last + 1]))
        kept = row & (column >= 0)
        place = slice(indptr[first], indptr[last])
        indices[place], data[place] = column[kept], A.data[part][kept]
    rows = np.concatenate([[0], indptr[1:][rank >= 0]]).astype(A.indptr.dtype)
    return csr_array((data, indices, rows), shape=(len(dofs), len(dofs)))


def checked_dofs(dofs: ArrayLike, n: int, name: str = "kept") -> IntArray:
    """Dof numbers as int64.

    Parameters
    ----------
    dofs : (k,) array_like of int
    n : int
        Number of dofs of the matrix.
    name : str, default "kept"
        What the message calls them.

    Returns
    -------
    (k,) array of int

    Raises
    ------
    InputError
        When there are none, or they are not whole numbers, out of range or duplicated.
    """
    given = np.asarray(dofs)
    if given.ndim != 1 or given.size == 0:
        raise InputError(
            f"The {name} dofs are an array of shape {given.shape}: give at least one, in "
            "one dimension."
        )
    if not np.issubdtype(given.dtype, np.integer):
        raise InputError(
            f"The {name} dofs are {given.dtype}, not whole numbers: give dof numbers, not a mask."
        )
    numbers = given.astype(np.int64)
    if numbers.min() < 0 or numbers.max() >= n:
        raise InputError(
            f"The {name} dofs run from {numbers.min()} to {numbers.max()}; the matrix has "
            f"0 to {n - 1}."
        )
    values, counts = np.unique(numbers, return_counts=True)
    if len(values) != len(numbers):
        raise InputError(
            f"The {name} dof {values[np.argmax(counts > 1)]} is duplicated: name each once."
        )
    return numbers


def checked_vectors(vectors: ArrayLike, n: int, name: str) -> FloatArray:
    """Vectors as float64.

    Parameters
    ----------
    vectors : (n,) or (n, m) array_like
    n : int
    name : str
        What the message calls them.

    Returns
    -------
    (n,) or (n, m) ndarray

    Raises
    ------
    InputError
        For another shape, or entries that are not finite.
    """
    v = np.asarray(vectors, dtype=np.float64)
    if v.ndim not in (1, 2) or v.shape[0] != n:
        raise InputError(f"The {name} has shape {v.shape}: give ({n},) or ({n}, m).")
    if not np.isfinite(v).all():
        raise InputError(f"The {name} has entries that are not finite.")
    return v


def row_blocks(A: csr_array) -> Iterator[tuple[int, int]]:
    """(first, last + 1) of runs of rows with about `_BLOCK` entries, so that work on them is small.

    Parameters
    ----------
    A : (n, m) csr_array

    Yields
    ------
    tuple of int
    """
    first, n = 0, A.shape[0]
    while first < n:
        last = int(np.searchsorted(A.indptr, int(A.indptr[first]) + _BLOCK, side="right")) - 1
        last = min(max(last, first + 1), n)
        yield first, last
        first = last


def is_free(vector: FloatArray, energy: float) -> bool:
    """Whether the relative energy of a motion is rounding.

    A Cholesky factor of n dofs is that of a matrix changed by about sqrt(n) eps.

    Parameters
    ----------
    vector : (n, ...) ndarray
    energy : float
        v'Kv / v'Dv, D the diagonal of K.
    """
    return not energy > 10 * EPS * np.sqrt(len(vector))


def softest_motion(K: Any, solve: Solve, D: FloatArray | None = None) -> tuple[FloatArray, float]:
    """Softest motion of a body, by two steps of inverse iteration with the factor of K.

    Scaled by the diagonal of K, so that stiff parts do not hide soft ones. Enough for a free
    motion, which the inverse amplifies by 1/eps.

    Parameters
    ----------
    K : (n, n) Symmetric, csr_array or ndarray
    solve : callable
        Right-hand side (n,) -> K^-1 rhs.
    D : (n,) ndarray, optional
        Stiffness of the dofs whose rounding K carries; None: its diagonal.

    Returns
    -------
    v : (n,) ndarray
    energy : float
        v'Kv / v'Dv (1 when the dofs move on their own).

    References
    ----------
    .. [1] N. J. Higham, Accuracy and Stability of Numerical Algorithms, ch. 15.
    """
    D = K.diagonal() if D is None else D
    v = np.random.default_rng(0).standard_normal(K.shape[0]) / np.sqrt(D)
    for _ in range(2):
        w = solve(D * v)
        size = float(np.sqrt(w @ (D * w)))
        if not (np.isfinite(size) and size > 0.0):
            return v, 0.0
        v = w / size
    return v, float(v @ (K @ v))


def inner_free_error(
    motion: tuple[FloatArray, float] | None, numbers: IntArray, solver: str
) -> ConvergenceError:
    """The error for a K_ii that cannot be factorised.

    Parameters
    ----------
    motion : (ndarray, float) or None
        From `softest_motion`.
    numbers : (n,) array of int
        Dofs of the motion's entries.
    solver : str
        Name for the message.

    Returns
    -------
    ConvergenceError
    """
    where = ""
    if motion is not None:
        most = int(numbers[np.argmax(np.abs(motion[0]))])
        where = (
            f" Dof {most} moves most in the free motion, whose energy is {motion[1]:.1e} "
            "of its dofs' own."
        )
    return ConvergenceError(
        f"{solver}: with the kept dofs held, the stiffness is singular or not positive "
        f"definite: a part of the body floats.{where} "
        "To fix it: hold the distant set, or keep or fix dofs of the part that floats."
    )
