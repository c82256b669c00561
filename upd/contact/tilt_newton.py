"""The tilt that minimises psi of `upd.contact.tilt`: Newton's method, ended by a least distance."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, lapack, qr, solve_triangular
from scipy.optimize import nnls

from upd.contact.checks import EPS
from upd.contact.qp import FREE, LOWER, BoxQP, BoxSolution, FloatArray, Method, State
from upd.errors import ConvergenceError

log = logging.getLogger(__name__)

#: a Newton iteration that works takes 2 to 8 steps
NEWTON_STEPS = 40
_SEARCH_STEPS = 60
#: half of the digits: below this share of the full resistance a tilt counts as not resisted, and
#: rounding may end the iteration
HALF_THE_DIGITS = float(np.sqrt(EPS))


def least_distance_and_multipliers(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """min |y| with G y >= w for rows = [G'; w']: y and the multipliers.

    It ends after finitely many exchanges.

    Parameters
    ----------
    rows : (k + 1, m) ndarray

    Returns
    -------
    y : (k,) ndarray
    multipliers : (m,) ndarray

    Raises
    ------
    ConvergenceError
        When the least squares behind it run out of exchanges.
    """
    unit = np.zeros(len(rows))
    unit[-1] = 1.0
    try:
        u = nnls(rows, unit, maxiter=30 * (rows.shape[1] + 10))[0]
    except RuntimeError as problem:
        raise ConvergenceError(
            f"contact with tilt: the least distance problem found no answer ({problem})."
        ) from None
    r = rows @ u - unit
    return -r[:-1] / r[-1], -u / r[-1]


@dataclass(frozen=True)
class _Point:
    """One tilt: the contact there, r = T'f and psi with the rounding level of psi."""

    theta: FloatArray
    answer: BoxSolution
    r: FloatArray
    psi: float
    noise: float


class TiltMinimiser:
    """Minimiser of psi for k tilts, the load F and no moment.

    The load point is strictly inside the hull of T (n, k).
    """

    def __init__(self, C: FloatArray, h: FloatArray, T: FloatArray, F: float) -> None:
        self.C, self.h, self.T, self.F = C, h, T, F
        self.n, self.k = T.shape
        self.qp = BoxQP(C)
        self.lower, self.upper = np.zeros(self.n), np.full(self.n, np.inf)
        self.scale = np.abs(T).max(axis=0) * F
        self.used = 0

    def minimise(self, mask: NDArray[np.bool_]) -> tuple[_Point, int, int, Method]:
        """Best tilt, Newton steps, factorisations and the method that finished."""
        state: State = (
            np.where(mask, FREE, LOWER).astype(np.int8)
            if mask.any()
            else np.full(self.n, FREE, dtype=np.int8)
        )
        at, method = self._at(self._first(state), state), "active set"
        steps, done = 0, self._balanced(at)
        full = self._hessian(np.ones(self.n, dtype=bool)) if not done else np.zeros(0)
        while not done and steps < NEWTON_STEPS:
            new = self._step(at, full)
            steps += 1
            if new is None:
                break
            stalled = self._size(new) > self._size(at) / 2
            at = (
                min(at, new, key=self._size)
                if stalled and self._size(at) <= HALF_THE_DIGITS
                else new
            )
            done = self._balanced(at) or (stalled and self._size(at) <= HALF_THE_DIGITS)
        if not done:
            log.info(
                "Newton's method for the tilt stopped after %d steps; the least distance "
                "problem takes over",
                steps,
            )
            at, method = self._fallback(), "fallback"
        return (
            at,
            steps,
            self.used,
            "fallback" if method == "fallback" or at.answer.method == "fallback" else "active set",
        )

    def _at(self, theta: FloatArray, state: State) -> _Point:
        q = self.h - self.T @ theta
        answer = self.qp.solve(q, self.lower, self.upper, total=self.F, state=state)
        self.used += answer.iterations
        f = answer.x
        psi = -(answer.shift * self.F + float(q @ f)) / 2
        noise = (self.n + 10) * EPS * (abs(answer.shift) * self.F + float(np.abs(q) @ f))
        return _Point(theta, answer, self.T.T @ f, psi, noise)

    def _size(self, at: _Point) -> float:
        return float(np.max(np.abs(at.r) / self.scale, initial=0.0))

    def _balanced(self, at: _Point) -> bool:
        return bool(self._size(at) <= 4 * (self.n + 10) * EPS)

    def _first(self, state: State) -> FloatArray:
        """Tilt of the bodies glued on the guessed set: exact when nothing opens.

        Zero when the set resists no tilt.
        """
        free = state == FREE
        E = np.column_stack([np.ones(self.n), self.T])[free]
        if not self.k or np.linalg.matrix_rank(E - E.mean(axis=0)) < self.k:
            return np.zeros(self.k)
        BE = self._held(free, E)
        b = np.zeros(self.k + 1)
        b[0] = self.F
        return np.asarray(np.linalg.solve(E.T @ BE, b + BE.T @ self.h[free])[1:])

    def _held(self, free: NDArray[np.bool_], E: FloatArray) -> FloatArray:
        """C_AA^-1 E."""
        index = np.flatnonzero(free)
        _, X, info = lapack.dposv(self.C[np.ix_(index, index)].T, E, lower=1)
        if info != 0:
            raise ConvergenceError(
                f"compliance of the {index.size} nodes in the set is not positive definite "
                "to working precision."
            )
        return np.asarray(X)

    def _hessian(self, free: NDArray[np.bool_]) -> FloatArray:
        E = np.column_stack([np.ones(int(free.sum())), self.T[free]])
        K = E.T @ self._held(free, E)
        return np.asarray(K[1:, 1:] - np.outer(K[1:, 0], K[0, 1:]) / K[0, 0])

    def _step(self, at: _Point, full: FloatArray) -> _Point | None:
        """Newton step.

        Along tilts that the set does not resist, the resistance of all nodes stands in.
        """
        H = self._hessian(at.answer.state == FREE)
        share, V = eigh((H + H.T) / 2, (full + full.T) / 2)
        share = np.where(share > HALF_THE_DIGITS, share, 1.0)
        return self._search(at, -V @ ((V.T @ at.r) / share))

    def _search(self, at: _Point, p: FloatArray) -> _Point | None:
        """Point on the line where psi has dropped and its slope has halved.

        None when rounding leaves none.
        """
        slope = float(at.r @ p)
        low, high, slope_low, slope_high, alpha = 0.0, np.inf, slope, np.inf, 1.0
        near = at
        for _ in range(_SEARCH_STEPS):
            new = self._at(at.theta + alpha * p, near.answer.state)
            now = float(new.r @ p)
            dropped = new.psi <= at.psi + at.noise + new.noise
            if (abs(now) <= -slope / 2 and dropped) or self._balanced(new):
                return new
            if now < 0:
                low, slope_low, near = alpha, now, new
            else:
                high, slope_high = alpha, now
            # Regula falsi, kept off the ends so that the bracket shrinks.
            inside = float(np.clip(slope_low / (slope_low - slope_high), 0.1, 0.9))
            alpha = 2 * low if np.isinf(high) else low + (high - low) * inside
        return None

    def _fallback(self) -> _Point:
        """Least distance form of the whole problem.

        f = f0 + Z z with E'Z = 0, |R z - c| least under f >= 0.
        """
        E = np.column_stack([np.ones(self.n), self.T / self.scale * self.F])
        b = np.zeros(self.k + 1)
        b[0] = self.F
        Q, R = qr(E)
        f0, Z = (
            Q[:, : self.k + 1] @ solve_triangular(R[: self.k + 1], b, trans=1),
            Q[:, self.k + 1 :],
        )
        L = np.linalg.cholesky(self.C)
        N, R = qr(L.T @ Z, mode="economic")
        c = -N.T @ (L.T @ f0 + solve_triangular(L, self.h, lower=True))
        G = solve_triangular(R, Z.T, trans=1, lower=False).T
        w = -(f0 + G @ c)
        size, unit = float(np.linalg.norm(G, axis=1).max()), float(np.abs(w).max())
        y, u = least_distance_and_multipliers(np.vstack([G.T / size, w / unit]))
        f = np.maximum(G @ (y * unit / size) - w, 0.0)
        g = u * unit / size**2
        theta = np.linalg.lstsq(E, self.C @ f + self.h - g, rcond=None)[0][1:] / self.scale * self.F
        state: State = np.where(f > 0, FREE, LOWER).astype(np.int8)
        at = self._at(theta, state)
        if self._size(at) > HALF_THE_DIGITS:
            raise ConvergenceError(
                f"contact with tilt of {self.n} nodes: {self._size(at):.1e} of the moment "
                "stays unbalanced after the last method. "
                "Look for nearly dependent rows in the compliance matrix."
            )
        return at
