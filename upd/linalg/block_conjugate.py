"""Conjugate gradients for several right-hand sides at once.

The blocks of O'Leary in the form of Dubrulle: residuals are held as R = Q C with Q' M Q = I, so
that columns that converge at different times, or nearly depend on each other, do no harm. In a step

    D = P' K P,  X += P D^-1 C,  R~ = Q - K P D^-1,  R~ = Q+ S with Q+' M Q+ = I,
    P+ = M Q+ + P S',  C+ = S C.

Directions that no column needs any more are left out, and those that rounding cannot tell apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

from upd.linalg.common import FloatArray
from upd.linalg.conjugate import STALL, UNSEEN, LowestRitz, bound, stopped

# Iterations between looks at the Ritz values as long as none is known.
_LOOK = 10
#: a product with M in single precision distinguishes directions whose squares differ by this share
_SINGLE = float(np.finfo(np.float32).eps)


@dataclass(frozen=True)
class BlockSolution:
    """Answers of block conjugate gradients.

    Attributes
    ----------
    x : (n, m) ndarray
    errors : (m,) ndarray
        Bounds of |x - K^-1 b|_K, from the true residuals.
    iterations : int
        Steps of the whole block.
    lowest : LowestRitz
        Of this iteration and those before.
    """

    x: FloatArray
    errors: FloatArray
    iterations: int
    lowest: LowestRitz


def block_conjugate_gradients(
    product: Callable[[FloatArray], FloatArray],
    precondition: Callable[[FloatArray], FloatArray],
    rhs: FloatArray,
    *,
    accuracy: float,
    max_iterations: int,
    lowest: LowestRitz = UNSEEN,
) -> BlockSolution:
    """Solve K X = B until the bounds of the relative errors in energy are small enough.

    Parameters
    ----------
    product, precondition : callable
        X -> K X and R -> M R for (n, k) arrays of up to m columns.
    rhs : (n, m) ndarray
        B.
    accuracy : float
        Of |x - K^-1 b|_K over |x|_K, for every column.
    max_iterations : int
    lowest : LowestRitz
        Known so far; see `upd.linalg.conjugate`.

    Returns
    -------
    BlockSolution

    Raises
    ------
    ConvergenceError
        As for `upd.linalg.conjugate.conjugate_gradients`.

    References
    ----------
    .. [1] D. P. O'Leary, Linear Algebra Appl. 29 (1980) 293.
    .. [2] A. A. Dubrulle, Electron. Trans. Numer. Anal. 12 (2001) 216 (orthonormal residuals).
    .. [3] G. H. Golub, G. Meurant, Matrices, Moments and Quadrature with Applications (2010),
       section 4.5 (the block Lanczos matrix of the coefficients).
    """
    loaded = rhs.any(axis=0)
    if not loaded.all():
        X, all_errors = np.zeros(rhs.shape), np.zeros(rhs.shape[1])
        if not loaded.any():
            return BlockSolution(X, all_errors, 0, lowest)
        part = block_conjugate_gradients(
            product,
            precondition,
            rhs[:, loaded],
            accuracy=accuracy,
            max_iterations=max_iterations,
            lowest=lowest,
        )
        X[:, loaded], all_errors[loaded] = part.x, part.errors
        return BlockSolution(X, all_errors, part.iterations, part.lowest)
    X, R = np.zeros(rhs.shape), rhs.copy()
    count, before = 0, np.inf
    while True:
        Z = precondition(R)
        G = R.T @ Z
        errors = np.array([bound(float(v), lowest) for v in np.diagonal(G)])
        sizes = np.sqrt(np.maximum(np.einsum("ij,ij->j", X, rhs), 0.0))
        if (errors <= accuracy * sizes).all():
            return BlockSolution(X, errors, count, lowest)
        worst = _worst(errors, sizes)
        if count and not errors[worst] < 0.5 * before * sizes[worst]:
            raise stopped(
                count, errors[worst], sizes[worst], accuracy, "rounding holds the residual"
            )
        before = float(errors[worst] / sizes[worst]) if count else np.inf
        # Columns of one size, so that none hides behind the others.
        scale = np.sqrt(np.maximum(np.diagonal(G), 0.0))
        scale[scale == 0.0] = 1.0
        S, inverse = _root(G / scale / scale[:, None])
        Q, P, S = (R / scale) @ inverse, (Z / scale) @ inverse, S * scale
        C = S
        diagonals: list[FloatArray] = []
        offs: list[FloatArray] = []
        best, best_at, left_out = np.inf, count, np.zeros(rhs.shape[1])
        D_before = np.zeros((0, 0))
        while True:
            KP = product(P)
            D = P.T @ KP
            D = 0.5 * (D + D.T)
            diagonals.append(D if not offs else D + S @ D_before @ S.T)
            try:
                factor = cho_factor(D)
            except (np.linalg.LinAlgError, ValueError):
                raise stopped(
                    count,
                    errors[worst],
                    sizes[worst],
                    accuracy,
                    "the stiffness is not positive definite",
                ) from None
            X += P @ cho_solve(factor, C)
            rest = Q - KP @ cho_solve(factor, np.eye(len(D)))
            Z = precondition(rest)
            count += 1
            S, inverse = _root(rest.T @ Z)
            squares = (np.linalg.norm(S @ C, axis=0) + left_out) ** 2
            sizes = np.sqrt(np.maximum(np.einsum("ij,ij->j", X, rhs), 0.0))
            errors = np.array([bound(float(v), lowest) for v in squares])
            over = not len(S) or count >= max_iterations
            if over or count % _LOOK == 0 or (errors <= accuracy * sizes).all():
                found = _lowest(diagonals, offs, S @ D)
                if found.value <= lowest.value:
                    lowest = found
                errors = np.array([bound(float(v), lowest) for v in squares])
                if (errors <= accuracy * sizes).all() or not len(S):
                    break
                worst = _worst(errors, sizes)
                held = float(np.sqrt(squares[worst]) / sizes[worst])
                if held <= 0.5 * best:
                    best, best_at = held, count
                if count - best_at >= STALL or count >= max_iterations:
                    raise stopped(count, errors[worst], sizes[worst], accuracy, "it stalls")
            # Residual of each column against the largest allowed; both in the norm of M.
            if 0.0 < lowest.below < np.inf and (sizes > 0.0).all():
                allowed = accuracy * sizes * np.sqrt(lowest.below)
                U, s, _ = np.linalg.svd((S @ C) / allowed)
                # at most so many directions are left out in all, so half of what is allowed
                needed = np.ones(len(U), bool)
                needed[: len(s)] = s > 0.5 / rhs.shape[1]
                if needed.any() and not needed.all():
                    left_out += np.abs(U[:, ~needed].T @ S @ C).sum(axis=0)
                    S, inverse = U[:, needed].T @ S, inverse @ U[:, needed]
            offs.append(-S @ D)
            D_before = D
            Q = rest @ inverse
            P = Z @ inverse + P @ S.T
            C = S @ C
        R = rhs - product(X)


def _root(G: FloatArray) -> tuple[FloatArray, FloatArray]:
    """S (k, m) with S' S = G, and its inverse from the right (m, k), without what is rounding."""
    values, vectors = np.linalg.eigh(0.5 * (G + G.T))
    on = values > _SINGLE * max(float(values[-1]), 0.0) if values.size else np.zeros(0, bool)
    root = np.sqrt(values[on])
    return root[:, None] * vectors[:, on].T, vectors[:, on] / root


def _worst(errors: FloatArray, sizes: FloatArray) -> int:
    """The column whose relative error is the largest."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return int(np.argmax(np.nan_to_num(errors / sizes, nan=0.0)))


def _lowest(diagonals: list[FloatArray], offs: list[FloatArray], after: FloatArray) -> LowestRitz:
    """Smallest eigenvalue of the block Lanczos matrix, and how far it may still come down."""
    ends = np.cumsum([0, *(len(d) for d in diagonals)])
    H = np.zeros((ends[-1], ends[-1]))
    for k, one in enumerate(diagonals):
        H[ends[k] : ends[k + 1], ends[k] : ends[k + 1]] = one
    for k, off in enumerate(offs):
        H[ends[k + 1] : ends[k + 2], ends[k] : ends[k + 1]] = off
    values, vectors = eigh(H, subset_by_index=[0, 0])
    value, last = float(values[0]), vectors[ends[-2] :, 0]
    return LowestRitz(value, value - float(np.linalg.norm(after @ last)))
