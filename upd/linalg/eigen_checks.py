"""The result of an eigenproblem and its checks: residual, M-orthogonality, rigid motions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from upd.errors import ConvergenceError, InputError
from upd.labels import Shown
from upd.linalg.common import EPS, FloatArray, symmetric_csr
from upd.linalg.lanczos import orthonormal
from upd.linalg.symmetric import Matrix, Symmetric


@dataclass(frozen=True, repr=False)
class Modes(Shown):
    """Natural frequencies and mode shapes, lowest first.

    Attributes
    ----------
    frequency : (m,) ndarray
        Hz; 0 for a rigid motion, one whose energy x'Kx is rounding of the dofs' own (the test of
        the factorisations).
    shapes : (n, m) ndarray
        Mass-normalised, X'MX = 1; t^-1/2. The largest entry of each is positive.
    residual : (m,) ndarray
        ||K x - lambda M x|| / ||lambda M x||; of a rigid motion ||K x|| / ||D x||, D the diagonal
        of K.
    rounding : (m,) ndarray
        What the rounding of K x alone makes of the residual.
    orthogonality : float
        Largest |X'MX - 1|.
    n_rigid : int
        Number of rigid motions.
    status : int
        0: converged. 1: not shown that none was missed. 2: beyond a limit (only with an error).
    message : str
        How it ended.
    solver : str
        Name of the solver that ran.
    sigma : float
        The shift, (rad/s)^2.
    seconds : float
        Wall time.
    shown : str
        How it was shown that none was missed.
    missed : int
        Modes known to be missing, 1 where that is not known.
    """

    frequency: FloatArray
    shapes: FloatArray
    residual: FloatArray
    rounding: FloatArray
    orthogonality: float
    n_rigid: int
    status: int
    message: str
    solver: str
    sigma: float
    seconds: float
    shown: str = "all modes of dense matrices"
    missed: int = 0

    @property
    def eigenvalue(self) -> FloatArray:
        """(m,) lambda = (2 pi f)^2, (rad/s)^2."""
        out: FloatArray = (2.0 * np.pi * self.frequency) ** 2
        return out

    def with_proof(self, shown: str, missed: int) -> Modes:
        """The same, with how it was looked for missing modes, and how many are missing."""
        if not missed:
            return replace(self, shown=shown, missed=0)
        return replace(
            self,
            shown=shown,
            missed=missed,
            status=1,
            message=f"Modes may be missing ({shown}): ask for more modes, or use solver 'dense'.",
        )


def checked_mass(M: Any, n: int) -> Matrix:
    """M as a float64 CSR array, a `Symmetric` as it is.

    Parameters
    ----------
    M : (n, n) sparse array or array_like
        t.
    n : int
        Number of dofs of K.

    Returns
    -------
    (n, n) csr_array or Symmetric

    Raises
    ------
    InputError
        For another shape, complex or infinite entries, a matrix that is not symmetric, a negative
        diagonal, no mass at all.
    """
    if getattr(M, "shape", None) != (n, n):
        raise InputError(
            f"M is {getattr(M, 'shape', None)}, K is {(n, n)}: give both on the same dofs."
        )
    A = M if isinstance(M, Symmetric) else symmetric_csr(M, "mass")
    diagonal = A.diagonal()
    if not diagonal.any() or (diagonal < 0.0).any():
        raise InputError(
            "M has a negative diagonal entry, or no mass at all: give densities above zero."
        )
    return A


def ritz(
    K: Matrix,
    M: Matrix,
    X: FloatArray,
    solver: str,
    sigma: float,
    size: FloatArray | None = None,
) -> Modes:
    """Rayleigh-Ritz: the best modes in the span of some vectors.

    Directions that rounding made dependent leave.

    Parameters
    ----------
    K, M : (n, n) Symmetric or csr_array
    X : (n, m) ndarray
        Any vectors; they need not be M-orthonormal.
    solver : str
        Name for the result.
    sigma : float
        Shift for the result, (rad/s)^2.
    size : (n,) ndarray, optional
        Stiffness of the dofs whose rounding K carries; None: its diagonal.

    Returns
    -------
    Modes

    References
    ----------
    .. [1] B. N. Parlett, The Symmetric Eigenvalue Problem, ch. 11.
    """
    Q, _, _ = orthonormal(X, M @ X)
    # again: the first pass squared the condition
    Q, _, _ = orthonormal(Q, M @ Q)
    KQ = K @ Q
    value, Y = eigh(Q.T @ KQ)
    X = Q @ Y
    # The basis is normalised by its Gram matrix, whose rounding the modes need not inherit.
    X /= np.sqrt(np.einsum("ij,ij->j", X, M @ X))
    top = np.abs(X).argmax(axis=0)
    X *= np.where(X[top, np.arange(X.shape[1])] < 0.0, -1.0, 1.0)
    return _measured(K, M, X, value, solver, sigma, K.diagonal() if size is None else size)


def _measured(
    K: Matrix,
    M: Matrix,
    X: FloatArray,
    value: FloatArray,
    solver: str,
    sigma: float,
    D: FloatArray,
) -> Modes:
    """Modes with their residuals; eigenvalues that are rounding become zero."""
    n = len(D)
    MX = M @ X
    own = np.einsum("ij,i,ij->j", X, D, X)
    rigid = np.abs(value) <= 10 * EPS * np.sqrt(n) * own
    if (value[~rigid] < 0.0).any():
        raise ConvergenceError(
            "K is not positive semi-definite: a motion has the eigenvalue "
            f"{value[~rigid].min():.3g} (rad/s)^2. Check its sign."
        )
    value = np.where(rigid, 0.0, value)
    residual = np.linalg.norm(K @ X - MX * value, axis=0)
    size = np.where(
        rigid, np.linalg.norm(D[:, None] * X, axis=0), value * np.linalg.norm(MX, axis=0)
    )
    rounding = 10 * EPS * np.sqrt(n) * np.linalg.norm(D[:, None] * X, axis=0) / size
    off = _off(X, MX)
    frequency = np.sqrt(value) / (2.0 * np.pi)
    message = "All modes wanted, none missed."
    return Modes(
        frequency,
        X,
        residual / size,
        rounding,
        off,
        int(rigid.sum()),
        0,
        message,
        solver,
        sigma,
        0.0,
    )


def _off(X: FloatArray, MX: FloatArray) -> float:
    """Largest |X'MX - 1|."""
    return float(np.abs(X.T @ MX - np.eye(X.shape[1])).max(initial=0.0))


def finished(
    K: Matrix, M: Matrix, found: Modes, keep: int, residual_limit: float, seconds: float
) -> Modes:
    """The first `keep` modes, checked.

    Parameters
    ----------
    K, M : (n, n) Symmetric or csr_array
    found : Modes
    keep : int
    residual_limit : float
    seconds : float
        Wall time for the result.

    Returns
    -------
    Modes

    Raises
    ------
    ConvergenceError
        With `partial`, when a mode or the orthogonality is beyond its limit.
    """
    part = slice(0, keep)
    residual, rounding = found.residual[part], found.rounding[part]
    n_rigid = min(found.n_rigid, keep)
    out = replace(
        found,
        frequency=found.frequency[part],
        shapes=np.ascontiguousarray(found.shapes[:, part]),
        residual=residual,
        rounding=rounding,
        # Of the modes that are kept: the search space beyond them is not.
        orthogonality=_off(found.shapes[:, part], M @ found.shapes[:, part]),
        n_rigid=n_rigid,
        seconds=seconds,
    )
    missing = keep - len(out.frequency)
    bad = np.flatnonzero(~(residual <= np.maximum(residual_limit, rounding)))
    # Two passes of orthonormalisation leave rounding of the inner products of n terms.
    off = not out.orthogonality <= 10 * EPS * np.sqrt(K.shape[0]) * max(1, keep)
    if not bad.size and not off and not missing:
        return out
    problem = f"their M-orthogonality is {out.orthogonality:.1e}"
    if missing:
        problem = (
            f"only {len(out.frequency)} of {keep} are there: the rank of M is lower than its "
            "dofs with mass"
        )
    elif bad.size:
        j = int(bad[0])
        problem = (
            f"{bad.size} of {keep} did not converge, the first number {j} at "
            f"{out.frequency[j]:.6g} Hz with residual {residual[j]:.1e} "
            f"({residual_limit:.0e} is the limit)"
        )
    error = ConvergenceError(
        f"Modes by {out.solver}: {problem}. Use a direct solver or 'dense', a sigma of the "
        "size of minus the first elastic eigenvalue, or a "
        "larger residual_limit."
    )
    error.partial = replace(out, status=2, message=problem)
    raise error
