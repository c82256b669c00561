"""Hermitian problems: a factor, and the lowest modes by shift-invert Lanczos.

The real form [[Re, -Im], [Im, Re]] has every eigenvalue twice and takes three times as long on
solids of 70 000 dofs (93 s against 28 s, factor and modes); so the matrices stay complex.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csr_array, triu
from scipy.sparse.linalg import LinearOperator, eigsh

from upd.errors import ConvergenceError
from upd.linalg.common import FloatArray, Solve, inner_free_error
from upd.linalg.pardiso import hermitian_pardiso
from upd.linalg.schur import factorise
from upd.linalg.select import has_pardiso
from upd.linalg.superlu import symmetric_lu

ComplexArray = NDArray[np.complex128]
#: Up to here the dense eigenproblem is as quick.
_DENSE = 500
#: Largest ||K x - lambda M x|| / ||lambda M x|| of a mode; the eigenvalue's error goes with its
#: square.
RESIDUAL_LIMIT = 1e-5
#: Relative error of an eigenvalue at which Lanczos ends; to rounding it takes a third more solves.
RITZ = 1e-10


class HermitianModes(NamedTuple):
    """Lowest modes of K x = lambda M x.

    Attributes
    ----------
    frequency : (m,) ndarray
        Hz, rising.
    shapes : (n, m) ndarray
        Complex, or real where K and M are; X^H M X = 1.
    """

    frequency: FloatArray
    shapes: NDArray[Any]


def hermitian_factor(K: csr_array) -> Solve:
    """x -> K^-1 x of a Hermitian or real symmetric positive definite matrix.

    Parameters
    ----------
    K : (n, n) csr_array
        Whole, N/mm.

    Returns
    -------
    callable
        Takes (n,) or (n, m).

    Raises
    ------
    ConvergenceError
        When K is not positive definite.
    """
    if not np.iscomplexobj(K):
        return factorise(K).solve
    if has_pardiso():
        upper = csr_array(triu(K, format="csr"))
        upper.sort_indices()
        return hermitian_pardiso(upper)
    lu = symmetric_lu(K)
    if not (lu.U.diagonal().real > 0.0).all():
        raise inner_free_error(None, np.arange(K.shape[0]), "SuperLU")
    return lambda rhs: np.asarray(lu.solve(np.asarray(rhs, dtype=np.complex128)))


def hermitian_modes(K: csr_array, M: csr_array, count: int, solve: Solve) -> HermitianModes:
    """Lowest modes of K x = lambda M x.

    Parameters
    ----------
    K, M : (n, n) csr_array
        Hermitian or real symmetric, N/mm and t.
    count : int
        At most n.
    solve : callable
        x -> K^-1 x.

    Returns
    -------
    HermitianModes

    Raises
    ------
    ConvergenceError
        For a mode beyond `RESIDUAL_LIMIT`.
    """
    n, dtype = K.shape[0], np.result_type(K.dtype, M.dtype)
    if n <= max(_DENSE, 2 * count):
        value, X = eigh(K.toarray(), M.toarray(), subset_by_index=[0, count - 1])
    else:
        start = np.random.default_rng(0).standard_normal(n).astype(dtype)
        inverse = LinearOperator(K.shape, solve, dtype=dtype)
        value, X = eigsh(K, count, M, sigma=0.0, OPinv=inverse, v0=start, tol=RITZ)
        order = np.argsort(value)
        value, X = value[order], X[:, order]
    MX = value * (M @ X)
    residual = float((np.linalg.norm(K @ X - MX, axis=0) / np.linalg.norm(MX, axis=0)).max())
    if not residual <= RESIDUAL_LIMIT:
        raise ConvergenceError(
            f"Hermitian modes: the residual of a mode is {residual:.1e}, {RESIDUAL_LIMIT:.0e} is "
            "the limit: K is nearly singular; hold the body more firmly or lower the speed."
        )
    return HermitianModes(np.sqrt(value) / (2.0 * np.pi), X)
