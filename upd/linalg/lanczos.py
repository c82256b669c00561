"""Block Lanczos in the M inner product with full orthogonalisation and thick restarts.

Blocks, because a factor read once serves several right-hand sides: eight cost two to three times
as much as one; and because a block of b finds eigenvalues up to b-fold at once.

References
----------
.. [1] G. H. Golub, R. Underwood, in Mathematical Software III (1977) 361.
.. [2] K. Wu, H. Simon, SIAM J. Matrix Anal. Appl. 22 (2000) 602.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from upd.linalg.common import EPS, FloatArray
from upd.linalg.symmetric import Matrix

Operator = Callable[[FloatArray], FloatArray]

#: Right-hand sides of one solution.
BLOCK = 8
#: Blocks after which it counts as failed.
MAX_BLOCKS = 400


@dataclass(frozen=True)
class Krylov:
    """Largest eigenpairs of x -> solve(M x).

    Attributes
    ----------
    theta : (k,) ndarray
        Eigenvalues, falling.
    X : (n, k) ndarray
        Their vectors, M-orthonormal.
    blocks : int
        Blocks used.
    converged : bool
    """

    theta: FloatArray
    X: FloatArray
    blocks: int
    converged: bool


def block_lanczos(
    solve: Operator,
    M: Matrix,
    start: FloatArray,
    count: int,
    tolerance: float,
    max_blocks: int = MAX_BLOCKS,
) -> Krylov:
    """The `count` largest eigenpairs of the M-symmetric operator x -> solve(M x).

    Ends when they converged, when the space is invariant (all there is), or after `max_blocks`
    blocks, not converged.

    Parameters
    ----------
    solve : callable
        (n, b) -> (n, b).
    M : (n, n) Symmetric or csr_array
    start : (n, b) ndarray
        First block.
    count : int
    tolerance : float
        Of |A x - theta x| / theta in the M norm; the eigenvalue's error is its square.
    max_blocks : int

    Returns
    -------
    Krylov
    """
    n, b = start.shape
    room = min(max(3 * count + 3 * b, 6 * b), n)
    V, H = np.zeros((n, room + b), order="F"), np.zeros((room + b, room + b))
    block, M_block, _ = orthonormal(start, M @ start)
    m = 0
    for step in range(1, max_blocks + 1):
        new = slice(m, m + block.shape[1])
        V[:, new] = block
        # Products with M are dear: one after the inverse, one after each pass, and none where
        # columns are only combined.
        U = solve(M_block)
        m = new.stop
        Q = V[:, :m]
        C = np.zeros((m, block.shape[1]))
        MU = M @ U
        size = np.sqrt(np.einsum("ij,ij->j", U, MU))
        # Twice is enough (W. Kahan, in Parlett, 6.9).
        for _ in range(2):
            part = Q.T @ MU
            U -= Q @ part
            C += part
            MU = M @ U
        H[:m, new], H[new, :m] = C, C.T
        H[new, new] = 0.5 * (C[new] + C[new].T)
        block, M_block, B = orthonormal(U, MU, size)
        theta, Y = (a[..., ::-1] for a in eigh(H[:m, :m]))
        k = min(count, m)
        residual = np.linalg.norm(B @ Y[new, :k], axis=0) if block.shape[1] else np.zeros(k)
        done = block.shape[1] == 0 or (
            k == count and bool((residual <= tolerance * theta[:k]).all())
        )
        if done or step == max_blocks:
            return Krylov(theta[:k], Q @ Y[:, :k], step, done)
        if m + block.shape[1] > room:
            keep = min(m, count + b)
            V[:, :keep] = Q @ Y[:, :keep]
            H[:] = 0.0
            H[range(keep), range(keep)] = theta[:keep]
            m = keep
    raise AssertionError("the loop returns")


def orthonormal(
    U: FloatArray, MU: FloatArray, size: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """V with U = V B and V'MV = 1.

    Parameters
    ----------
    U, MU : (n, b) ndarray
        Columns, and their products with M.
    size : (b,) ndarray, optional
        M norms of the columns before what is left of them was made: directions that are rounding
        of it leave.

    Returns
    -------
    V, MV : (n, r) ndarray
    B : (r, b) ndarray
    """
    own = np.sqrt(np.maximum(np.einsum("ij,ij->j", U, MU), 0.0))
    # The rest after cancelling all but eps of a column is noise, not a direction.
    alive = own > (0.0 if size is None else 100 * EPS * np.sqrt(len(U)) * size)
    if not alive.any():
        return U[:, :0], U[:, :0], np.zeros((0, U.shape[1]))
    V, MV = U[:, alive] / own[alive], MU[:, alive] / own[alive]
    value, Y = eigh(V.T @ MV)
    good = value > np.sqrt(EPS) * value[-1]
    # A second time, because the first pass squared the condition.
    T = Y[:, good] / np.sqrt(value[good])
    V, MV = V @ T, MV @ T
    gram = V.T @ MV
    T = np.linalg.inv(np.linalg.cholesky(0.5 * (gram + gram.T))).T
    V, MV = V @ T, MV @ T
    return V, MV, V.T @ MU
