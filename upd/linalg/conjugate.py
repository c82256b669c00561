"""Conjugate gradients, for one right-hand side or several at once, that stop at an error in energy,
with the bound they stop at.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh, eigh_tridiagonal

from upd.errors import ConvergenceError
from upd.linalg.common import FloatArray

#: Iterations after which r' M r must have come down to a quarter, or the smallest Ritz value to
#: half.
STALL = 300
# Iterations between looks at the Ritz values.
_LOOK = 5
# Of a block, as long as none is known.
_LOOK_BLOCK = 10
#: a product with M in single precision distinguishes directions whose squares differ by this share
_SINGLE = float(np.finfo(np.float32).eps)


class LowestRitz(NamedTuple):
    """The smallest eigenvalue of M K as an iteration has seen it.

    Attributes
    ----------
    value : float
        Ritz value, from above.
    below : float
        It minus the norm of its residual: an eigenvalue lies between this and twice as far above.
    """

    value: float
    below: float


#: before any iteration
UNSEEN = LowestRitz(np.inf, np.inf)


class Iterated(NamedTuple):
    """Answers of preconditioned conjugate gradients.

    Attributes
    ----------
    x : (n,) or (n, m) ndarray
    error : float or (m,) ndarray
        Bound of |x - K^-1 b|_K, from the true residual.
    iterations : int
        Steps, of the whole block.
    lowest : LowestRitz
        Of this iteration and those before.
    """

    x: FloatArray
    error: FloatArray
    iterations: int
    lowest: LowestRitz


def conjugate_gradients(
    product: Callable[[FloatArray], FloatArray],
    precondition: Callable[[FloatArray], FloatArray],
    rhs: FloatArray,
    *,
    accuracy: float,
    max_iterations: int,
    lowest: LowestRitz = UNSEEN,
) -> Iterated:
    """Solve K x = b until the bound of the relative error in energy is small enough.

    With M symmetric positive definite and r = b - K x, |x - K^-1 b|_K^2 = r' K^-1 r <= r' M r /
    lambda_min(M K). The smallest eigenvalue is the smallest Ritz value of the iteration itself,
    which comes down to it while the residual still has a part along that eigenvector, or of an
    iteration before with the same M that came lower, less the norm of its residual: that much it
    may still come down. r' M r is at hand in every step. Where the recurrence reports convergence,
    r is formed again and the iteration continues from there if it is not.

    Parameters
    ----------
    product, precondition : callable
        x -> K x and r -> M r.
    rhs : (n,) ndarray
        b.
    accuracy : float
        Of |x - K^-1 b|_K over |x|_K.
    max_iterations : int
    lowest : LowestRitz
        Known so far.

    Returns
    -------
    Iterated

    Raises
    ------
    ConvergenceError
        When K or M is not positive definite, when it makes no progress over `STALL` iterations, or
        after `max_iterations`.

    References
    ----------
    .. [1] Z. Strakos, P. Tichy, On error estimation in the conjugate gradient method, ETNA 13
       (2002) 56.
    .. [2] Y. Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., section 6.7 (Ritz values
       from the coefficients) and 6.6 (the norm of its residual).
    .. [3] B. N. Parlett, The Symmetric Eigenvalue Problem, theorem 4.5.1 (an eigenvalue within it).
    """
    x, r = np.zeros(len(rhs)), rhs.copy()
    count, before = 0, np.inf
    while True:
        z = precondition(r)
        rz = float(r @ z)
        error, size = bound(rz, lowest), np.sqrt(max(float(x @ rhs), 0.0))
        if error <= accuracy * size:
            return Iterated(x, np.asarray(error), count, lowest)
        if count and not error < 0.5 * before:
            raise stopped(count, error, size, accuracy, "rounding holds the residual")
        before = float(error) if count else np.inf
        best, at_best, best_at = np.inf, lowest.value, count
        p, steps, ratios = z.copy(), [], []
        while True:
            Kp = product(p)
            curvature = float(p @ Kp)
            if not (curvature > 0.0 and rz > 0.0 and np.isfinite(curvature)):
                raise stopped(
                    count, error, size, accuracy, "the stiffness is not positive definite"
                )
            alpha = rz / curvature
            x += alpha * p
            r -= alpha * Kp
            z = precondition(r)
            new = float(r @ z)
            steps.append(alpha)
            ratios.append(new / rz)
            count += 1
            may_end = bound(new, lowest) <= accuracy * size
            if may_end or count % _LOOK == 0 or new == 0.0 or count >= max_iterations:
                found = _lowest_ritz(steps, ratios)
                if found.value <= lowest.value:
                    lowest = found
                held = np.sqrt(max(new, 0.0))
                error, size = bound(new, lowest), np.sqrt(max(float(x @ rhs), 0.0))
                if error <= accuracy * size:
                    break
                # A smaller eigenvalue that shows is progress too.
                if held <= 0.5 * best or lowest.value <= 0.5 * at_best:
                    best, at_best, best_at = min(held, best), lowest.value, count
                if count - best_at >= STALL or count >= max_iterations:
                    raise stopped(count, error, size, accuracy, "it stalls")
            p *= new / rz
            p += z
            rz = new
        r = rhs - product(x)


def bound(rz: float, lowest: LowestRitz) -> float:
    """Bound of the error in energy from r' M r; infinite as long as no eigenvalue is known.

    Parameters
    ----------
    rz : float
        r' M r.
    lowest : LowestRitz

    Returns
    -------
    float
    """
    if not 0.0 < lowest.below < np.inf:
        return 0.0 if rz == 0.0 else np.inf
    return float(np.sqrt(max(rz, 0.0) / lowest.below))


def _lowest_ritz(steps: list[float], ratios: list[float]) -> LowestRitz:
    """Smallest eigenvalue of the Lanczos matrix of the coefficients."""
    a, b = np.array(steps), np.array(ratios)
    diagonal = 1.0 / a
    diagonal[1:] += b[:-1] / a[:-1]
    beside = np.sqrt(np.maximum(b, 0.0)) / a
    values, vectors = eigh_tridiagonal(diagonal, beside[:-1], select="i", select_range=(0, 0))
    value = float(values[0])
    return LowestRitz(value, value - float(beside[-1] * abs(vectors[-1, 0])))


def stopped(count: int, error: float, size: float, accuracy: float, why: str) -> ConvergenceError:
    """What to raise where an iteration ends without its answer.

    Parameters
    ----------
    count : int
        Iterations.
    error, size, accuracy : float
        Bound of the error in energy, energy of the answer, and what was asked of their ratio.
    why : str

    Returns
    -------
    ConvergenceError
    """
    reached = error / size if size > 0.0 else float("inf")
    return ConvergenceError(
        f"Multigrid: conjugate gradients stopped after {count} iterations with a relative error "
        f"in energy of {reached:.1e}, {accuracy:.0e} was asked: {why}. "
        "A part of the body floats (hold the distant set) or hangs on a much softer one, hexahedra "
        "are stretched, or nu is near one half: use a direct solver (solver.name = "
        '"pardiso"), a mesh with smaller aspect ratios, or more iterations; and give the '
        "rigid-body modes as near null space."
    )


def block_conjugate_gradients(
    product: Callable[[FloatArray], FloatArray],
    precondition: Callable[[FloatArray], FloatArray],
    rhs: FloatArray,
    *,
    accuracy: float,
    max_iterations: int,
    lowest: LowestRitz = UNSEEN,
) -> Iterated:
    """Solve K X = B until the bounds of the relative errors in energy are small enough.

    The blocks of O'Leary in the form of Dubrulle: residuals are held as R = Q C with Q' M Q = I,
    so that columns that converge at different times, or nearly depend on each other, do no harm. In
    a step

        D = P' K P,  X += P D^-1 C,  R~ = Q - K P D^-1,  R~ = Q+ S with Q+' M Q+ = I,
        P+ = M Q+ + P S',  C+ = S C.

    Directions that no column needs any more are left out, and those that rounding cannot tell
    apart.

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
        Known so far.

    Returns
    -------
    Iterated

    Raises
    ------
    ConvergenceError
        As for `conjugate_gradients`.

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
            return Iterated(X, all_errors, 0, lowest)
        part = block_conjugate_gradients(
            product,
            precondition,
            rhs[:, loaded],
            accuracy=accuracy,
            max_iterations=max_iterations,
            lowest=lowest,
        )
        X[:, loaded], all_errors[loaded] = part.x, part.error
        return Iterated(X, all_errors, part.iterations, part.lowest)
    X, R = np.zeros(rhs.shape), rhs.copy()
    count, before = 0, np.inf
    while True:
        Z = precondition(R)
        G = R.T @ Z
        errors = np.array([bound(float(v), lowest) for v in np.diagonal(G)])
        sizes = np.sqrt(np.maximum(np.einsum("ij,ij->j", X, rhs), 0.0))
        if (errors <= accuracy * sizes).all():
            return Iterated(X, errors, count, lowest)
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
            if over or count % _LOOK_BLOCK == 0 or (errors <= accuracy * sizes).all():
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
