"""Condensation of a matrix whose inner dofs are coupled to kept ones only: no factor."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array

from upd.linalg.common import Condensation, FloatArray, IntArray, checked_vectors, row_blocks
from upd.linalg.symmetric import Matrix, stored, whole


def uncoupled(K: Matrix, kept: IntArray) -> Condensation | None:
    """Condensation of a matrix whose inner dofs touch kept dofs only, if it is one.

    K_ii is then diagonal, D, and S = K_bb - K_bi D^-1 K_ib needs no factor; without any inner dof S
    is K_bb.

    Parameters
    ----------
    K : (n, n) Symmetric or csr_array
        As `upd.linalg.symmetric.checked` gives it.
    kept : (k,) array of int

    Returns
    -------
    Condensation or None
        None when two inner dofs are coupled.
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
            return None
    A = whole(K)
    inner = np.flatnonzero(is_inner)
    K_ib, D = csr_array(A[inner][:, kept]), A.diagonal()[inner]
    S = A[kept][:, kept].toarray() - (K_ib.T @ diags_array(1.0 / D) @ K_ib).toarray()

    def recover(u_kept: FloatArray) -> FloatArray:
        u_b = checked_vectors(u_kept, len(kept), "displacement of the kept dofs")
        u = np.zeros((n, *u_b.shape[1:]))
        u[kept] = u_b
        u[inner] = -((K_ib @ u_b).T / D).T
        return u

    return Condensation(0.5 * (S + S.T), recover, "none", 0.0, 0, S.nbytes)
