"""A symmetric sparse matrix by its upper triangle: half the memory of the whole one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array, diags_array

from upd.linalg.common import FloatArray, IntArray, checked_matrix, row_blocks, submatrix


@dataclass(frozen=True)
class Symmetric:
    """An exactly symmetric matrix of which only the upper triangle is stored.

    What assembly makes is symmetric to the last bit, so nothing is lost. PARDISO reads the values
    where they stand.

    Attributes
    ----------
    upper : (n, n) csr_array
        Upper triangle with sorted indices, every diagonal entry stored.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import csr_array
    >>> from upd.linalg.symmetric import Symmetric
    >>> K = Symmetric.of(csr_array(np.array([[2.0, -1.0], [-1.0, 2.0]])))
    >>> K.upper.nnz, (K @ np.array([1.0, 0.0])).tolist()
    (3, [2.0, -1.0])
    """

    upper: csr_array

    @classmethod
    def of(cls, A: csr_array) -> Symmetric:
        """The upper triangle of a symmetric (n, n) csr_array whose diagonal is stored."""
        data, indptr, columns = upper_triangle(A, A.indices.dtype)
        return cls(csr_array((data, columns, indptr.astype(A.indptr.dtype)), shape=A.shape))

    @property
    def shape(self) -> tuple[int, int]:
        """(n, n)."""
        n = int(self.upper.shape[0])
        return n, n

    def diagonal(self) -> FloatArray:
        """(n,) diagonal, the first entries of the rows."""
        out: FloatArray = self.upper.data[self.upper.indptr[:-1]]
        return out

    def __matmul__(self, x: FloatArray) -> FloatArray:
        d = self.diagonal()
        out: FloatArray = self.upper @ x
        out += self.upper.T @ x
        out -= (d * x.T).T
        return out

    def submatrix(self, dofs: IntArray) -> Symmetric:
        """Rows and columns of some dofs (k,), rising."""
        return Symmetric(submatrix(self.upper, dofs))


Matrix = csr_array | Symmetric


def checked(K: Any) -> Matrix:
    """A `Symmetric` as it is, anything else as `checked_matrix` gives it.

    Parameters
    ----------
    K : Symmetric, (n, n) sparse array or array_like

    Returns
    -------
    Symmetric or (n, n) csr_array

    Raises
    ------
    InputError
        As for `checked_matrix`.
    """
    return K if isinstance(K, Symmetric) else checked_matrix(K)


def whole(K: Any) -> Any:
    """Both triangles of a `Symmetric`; anything else as it is.

    Parameters
    ----------
    K : Symmetric, (n, n) sparse array or array_like

    Returns
    -------
    (n, n) sparse array or array_like
    """
    if not isinstance(K, Symmetric):
        return K
    lower = K.upper.T.tocsr()
    return csr_array(K.upper + lower - diags_array(K.diagonal()))


def submatrix_of(K: Matrix, dofs: IntArray) -> Matrix:
    """Rows and columns of some dofs, stored as K is.

    Parameters
    ----------
    K : (n, n) Symmetric or csr_array
    dofs : (k,) array of int
        Rising.

    Returns
    -------
    (k, k) Symmetric or csr_array
    """
    return K.submatrix(dofs) if isinstance(K, Symmetric) else submatrix(K, dofs)


def combined(K: Matrix, factor: float, M: Matrix) -> Matrix:
    """K + factor M, by the upper triangle where both are.

    Parameters
    ----------
    K, M : (n, n) Symmetric or csr_array
    factor : float

    Returns
    -------
    (n, n) Symmetric or csr_array
    """
    if isinstance(K, Symmetric) and isinstance(M, Symmetric):
        return Symmetric(csr_array(K.upper + factor * M.upper))
    return csr_array(whole(K) + factor * whole(M))


def stored(K: Matrix) -> csr_array:
    """The entries as stored: those of the upper triangle, or all.

    Parameters
    ----------
    K : (n, n) Symmetric or csr_array

    Returns
    -------
    (n, n) csr_array
    """
    return K.upper if isinstance(K, Symmetric) else K


def upper_triangle(A: csr_array, dtype: Any = np.int64) -> tuple[FloatArray, IntArray, IntArray]:
    """Values, row pointers and columns of the upper triangle.

    Filled some rows at a time; nothing else as large as A is made.

    Parameters
    ----------
    A : (n, n) csr_array
    dtype : dtype
        Of the columns.

    Returns
    -------
    data, indptr, columns : ndarray
    """
    if not A.has_sorted_indices:
        A = A.sorted_indices()
    n = A.shape[0]
    count = np.zeros(n + 1, np.int64)
    for first, last in row_blocks(A):
        row, part = _rows(A, first, last)
        count[first + 1 : last + 1] = np.bincount(
            row[A.indices[part] >= row] - first, minlength=last - first
        )
    indptr = np.cumsum(count)
    data, columns = np.empty(int(indptr[-1])), np.empty(int(indptr[-1]), dtype)
    for first, last in row_blocks(A):
        row, part = _rows(A, first, last)
        upper = A.indices[part] >= row
        place = slice(indptr[first], indptr[last])
        data[place], columns[place] = A.data[part][upper], A.indices[part][upper]
    return data, indptr, columns


def _rows(A: csr_array, first: int, last: int) -> tuple[IntArray, slice]:
    """Row numbers of the entries of some rows, and where these stand."""
    row = np.repeat(np.arange(first, last), np.diff(A.indptr[first : last + 1]))
    return row, slice(A.indptr[first], A.indptr[last])
