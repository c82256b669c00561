"""Box-constrained contact QP: a primal-dual active set, and behind it a method that provably ends.

    min 1/2 x'C x + h'x - s'B'x,   lower <= x <= upper,

with the rigid motion s given, or with the resultants B'x = p given and s their multipliers. The
residual is

    g = h + C x - B s:   g = 0 at free nodes, g >= 0 where x = lower, g <= 0 where x = upper.

C is symmetric positive definite, so there is one x. Normal contact is lower = 0, upper = inf,
B = e; with free tilt B = [e T] with the arms T; friction in one direction is -mu f <= t <= mu f.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, eigh, lapack, lstsq, null_space, qr, solve_triangular

from upd.errors import ConvergenceError
from upd.linalg.least_distance import least_distance

log = logging.getLogger(__name__)

FloatArray = NDArray[np.float64]
State = NDArray[np.int8]
Method = Literal["active set", "fallback"]

FREE, LOWER, UPPER = 0, -1, 1
EPS = float(np.finfo(float).eps)
#: half of the digits: below this share of the largest resistance a motion counts as not resisted
HALF_THE_DIGITS = float(np.sqrt(EPS))
# Levels of rounding do not underflow below it; no motion or force is as small.
_TINY = float(np.finfo(float).tiny)
# A primal-dual active set that works takes 3 to 10 steps; longer chains are handed over to the
# least distance.
ACTIVE_SET_STEPS = 50
# After the least distance rounding leaves at most a few nodes on the wrong side of a bound.
_LAST_STEPS = 10


@dataclass(frozen=True)
class ForceSolution:
    """Answer of one problem of m forces with r rigid motions, whose forces lie in boxes or disks.

    Attributes
    ----------
    x : (m,) ndarray
        Forces [N].
    residual : (m,) ndarray
        h + C x - B s [mm], of friction minus the slip step; zero where a node is free.
    motion : (r,) ndarray
        s [mm, rad].
    state : (n,) ndarray of int8
        Of each node: 0 free, -1 at the lower bound, +1 at the upper bound or on the rim.
    iterations : int
        Factorisations, and steps of the fallback.
    method : {"active set", "fallback"}
        Method that finished.
    stiffness : (r, r) ndarray
        Resultants of the rates [N/mm].
    unclipped : (m,) ndarray
        Forces before they were brought inside their bounds [N]: for checks.
    rates : (m, r) ndarray
        Change of the forces with the motion, the set held [N/mm].
    """

    x: FloatArray
    residual: FloatArray
    motion: FloatArray
    state: State
    iterations: int
    method: Method
    stiffness: FloatArray
    unclipped: FloatArray
    rates: FloatArray


@dataclass(frozen=True)
class _Box:
    """One problem: h, bounds and either the resultants or the motion (the other is None)."""

    h: FloatArray
    lower: FloatArray
    upper: FloatArray
    load: FloatArray | None
    motion: FloatArray | None


@dataclass(frozen=True)
class _Step:
    """Minimiser over the free nodes of one set, its residual and its motion.

    `tolerance` is the rounding level of the residual.
    """

    x: FloatArray
    residual: FloatArray
    motion: FloatArray
    tolerance: FloatArray


class BoxQP:
    """Solver bound to one compliance matrix.

    It keeps the factor of the last free set, so that neighbouring problems start at once.

    Parameters
    ----------
    compliance : (n, n) ndarray
        Compliance [mm/N], symmetric positive definite: see `upd.contact.checks`.
    rigid : (n, r) ndarray, optional
        B, rigid motions of like size; e alone by default.
    """

    def __init__(self, compliance: FloatArray, rigid: FloatArray | None = None) -> None:
        # Fortran order: LAPACK and BLAS take it as it is.
        self.C = np.asfortranarray(compliance.T)
        self.n = len(self.C)
        self.B = np.ones((self.n, 1)) if rigid is None else rigid
        # Rounding of a sum of n products, and of the handful of operations around it.
        self._rounding = (self.n + 10) * EPS
        diagonal = np.diagonal(self.C)
        # |C_ij| <= sqrt(C_ii C_jj): an upper bound of each row, for the rounding level of C x.
        self._row = np.sqrt(diagonal * diagonal.max(initial=0.0))
        self._key: bytes | None = None
        self._index = np.zeros(0, dtype=np.intp)
        self._factor = np.zeros((0, 0))
        self._unit = np.zeros((0, self.B.shape[1]))
        self._stiffness = np.zeros((self.B.shape[1],) * 2)

    def solve(
        self,
        h: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        *,
        load: FloatArray | float | None = None,
        motion: FloatArray | float | None = None,
        state: State,
    ) -> ForceSolution:
        """Solve one box QP; give either `load` or `motion`.

        Parameters
        ----------
        h : (n,) ndarray
            Linear term [mm].
        lower, upper : (n,) ndarray
            Bounds [N].
        load : (r,) array_like, optional
            Resultants B'x [N, N mm] that forces strictly between the bounds can have.
        motion : (r,) array_like, optional
            s [mm, rad].
        state : (n,) ndarray of int8
            Set to start from: 0 free, -1 at the lower bound, +1 at the upper bound.

        Returns
        -------
        ForceSolution

        Raises
        ------
        ConvergenceError
            When neither method reaches the KKT tolerance.
        """
        box = _Box(
            h,
            lower,
            upper,
            None if load is None else np.atleast_1d(load),
            None if motion is None else np.atleast_1d(motion),
        )
        first = np.zeros(self.B.shape[1])
        step, state, used, reason = self._active_set(box, state, first, ACTIVE_SET_STEPS)
        method: Method = "active set"
        step = self._refined(box, step, state)
        if step is None or not self._solved(box, step, state):
            log.info("primal-dual active set stopped (%s); the least distance takes over", reason)
            method = "fallback"
            state, near = self._least_distance(box)
            step, state, more, reason = self._active_set(box, state, near, _LAST_STEPS)
            used += more
            step = self._refined(box, step, state)
        if step is None or not self._solved(box, step, state):
            raise ConvergenceError(
                f"contact QP with {self.n} nodes: no answer after {used} factorisations "
                f"({reason}). Look for nearly dependent rows in the compliance matrix."
            )
        self._prepare(state == FREE)
        residual = np.where(state == FREE, 0.0, step.residual)
        residual = np.where(
            state == LOWER,
            np.maximum(residual, 0.0),
            np.where(state == UPPER, np.minimum(residual, 0.0), residual),
        )
        x, rates = np.clip(step.x, lower, upper), np.zeros(self.B.shape)
        rates[self._index] = self._unit
        return ForceSolution(
            x, residual, step.motion, state, used, method, self._stiffness, step.x, rates
        )

    # -- linear algebra of one set -----------------------------------------------------------------

    def product(self, x: FloatArray) -> FloatArray:
        """Product C x (n,) [mm] of forces x (n,) [N].

        By the BLAS that also factors: numpy brings a second one, and two thread pools on the same
        cores cost a factor of ten.
        """
        return np.asarray(blas.dgemv(1.0, self.C, x))

    def _resultants(self, x: FloatArray) -> FloatArray:
        return np.array([(column * x).sum() for column in self.B.T])

    def _prepare(self, free: NDArray[np.bool_]) -> None:
        """Factor C_AA of the free set A unless it is the set at hand.

        With it come U = C_AA^-1 B_A and the tangent B_A'U.
        """
        key = free.tobytes()
        if key == self._key:
            return
        index = np.flatnonzero(free)
        self._key, self._index, B = None, index, self.B[index]
        if index.size:
            # Symmetric: the rows of C' are its columns, and the transpose of the block is the
            # Fortran order LAPACK may overwrite.
            factor, info = lapack.dpotrf(
                self.C.T.take(index, 0).take(index, 1).T, lower=1, clean=0, overwrite_a=1
            )
            if info != 0:
                raise ConvergenceError(
                    f"compliance of the {index.size} nodes in the set is not positive "
                    "definite to working precision: "
                    "merge coincident contact nodes or use a compliance of better condition."
                )
            self._factor = factor
        self._unit = lapack.dpotrs(self._factor, B, lower=1)[0] if index.size else B
        self._stiffness = np.array([[(b * u).sum() for u in self._unit.T] for b in B.T])
        self._key = key

    def _motion(self, missing: FloatArray) -> FloatArray:
        """The least motion by which the free set takes up these resultants.

        Nothing moves along a motion that the set does not resist.
        """
        K = self._stiffness
        if len(K) == 1:
            return np.asarray(missing / K[0, 0])
        size, V = eigh(K)
        resisted = size > HALF_THE_DIGITS * size[-1]
        return np.asarray(V[:, resisted] @ ((V.T @ missing)[resisted] / size[resisted]))

    def _corrected(self, box: _Box, x: FloatArray, s: FloatArray, residual: FloatArray) -> _Step:
        """One solve with the factor at hand: no residual at free nodes, and the resultants; with
        the residual that it leaves and its rounding level n eps (|h| + |B||s| + |C||x|).
        """
        index, x, more = self._index, x.copy(), np.zeros(self.B.shape[1])
        if index.size:
            y = np.asarray(lapack.dpotrs(self._factor, residual[index], lower=1)[0])
            if box.load is not None:
                freed = np.array([(b * y).sum() for b in self.B[index].T])
                more = self._motion(box.load - self._resultants(x) + freed)
            x[index] += self._unit @ more - y
        s = s + more
        rigid = np.abs(self.B) @ np.abs(s)
        terms = np.abs(box.h) + rigid + self._row * float(np.abs(x).sum())
        left = box.h + self.product(x) - self.B @ s
        return _Step(x, left, s, np.asarray(self._rounding * terms + _TINY))

    def _refined(self, box: _Box, step: _Step | None, state: State) -> _Step | None:
        """Iterative refinement of a step.

        With resultants given, x is a difference of large terms and loses digits that one more
        solve brings back.
        """
        if step is None or self._solved(box, step, state):
            return step
        self._prepare(state == FREE)
        return self._corrected(box, step.x, step.motion, step.residual)

    def _solved(self, box: _Box, step: _Step, state: State) -> bool:
        """KKT conditions within the rounding level, whatever method finished."""
        # The Cholesky solve and the product each leave an error of this size: allow for both, and
        # for the clipping of x.
        tolerance = 4 * step.tolerance
        slack = tolerance / self._row
        g = step.residual
        kkt = np.where(state == FREE, np.abs(g), np.where(state == LOWER, -g, g)) <= tolerance
        inside = (step.x >= box.lower - slack) & (step.x <= box.upper + slack)
        if box.load is None:
            return bool(np.all(kkt & inside))
        arms = np.abs(self.B).max(axis=0)
        balance = (
            np.abs(self._resultants(step.x) - box.load)
            <= 4 * self._rounding * (np.abs(box.load) + arms * np.abs(step.x).sum()) + _TINY
        )
        return bool(np.all(kkt & inside) and np.all(balance))

    # -- primal-dual active set --------------------------------------------------------------------

    def _active_set(
        self, box: _Box, state: State, near: FloatArray, limit: int
    ) -> tuple[_Step | None, State, int, str]:
        """Primal-dual active set: fast, but may cycle, which the visited sets reveal.

        Each step minimises with the nodes of `state` held at their bounds; motions that the set
        does not resist stay as in `near`.

        References
        ----------
        M. Hintermueller, K. Ito and K. Kunisch, SIAM J. Optim. 13 (2002) 865.
        """
        visited: set[bytes] = set()
        step: _Step | None = None
        for used in range(1, limit + 1):
            visited.add(state.tobytes())
            self._prepare(state == FREE)
            if box.motion is None and not self._index.size:
                if self.B.shape[1] > 1:
                    return None, state, used, "no node is free"
                new = self._last_to_yield(box, state)
            else:
                x = np.where(state == LOWER, box.lower, np.where(state == UPPER, box.upper, 0.0))
                s = near if box.motion is None else box.motion
                left = (box.h + self.product(x) if x.any() else box.h) - self.B @ s
                step = self._corrected(box, x, s, left)
                near, new = step.motion, self._next_state(box, step, state)
                if np.array_equal(new, state):
                    return step, state, used, "converged"
            if new.tobytes() in visited:
                return step, new, used, "a set came back"
            state = new
        return step, state, limit, "step limit"

    def _next_state(self, box: _Box, step: _Step, state: State) -> State:
        """Free nodes beyond a bound are held there.

        Held nodes whose residual has the wrong sign are freed.
        """
        # The rounding level of x: n nodes moved by it stay inside the tolerance of the residual.
        slack = step.tolerance / (self.n * self._row)
        new = state.copy()
        free = state == FREE
        new[free & (step.x <= box.lower + slack)] = LOWER
        new[free & (step.x >= box.upper - slack)] = UPPER
        new[(state == LOWER) & (step.residual < -step.tolerance)] = FREE
        new[(state == UPPER) & (step.residual > step.tolerance)] = FREE
        return new

    def _last_to_yield(self, box: _Box, state: State) -> State:
        """All nodes are held, so the total cannot be met: free those that reached their bound last.

        As many as are needed to take up the difference.
        """
        assert box.load is not None
        x = np.where(state == LOWER, box.lower, box.upper)
        missing = float(box.load[0]) - x.sum()
        q = box.h + self.product(x)
        held, order = (state == UPPER, -q) if missing < 0 else (state == LOWER, q)
        nodes = np.flatnonzero(held)
        nodes = nodes[np.argsort(order[nodes], kind="stable")]
        room = np.cumsum((box.upper - box.lower)[nodes]) / 2
        count = int(np.searchsorted(room, abs(missing))) + 1
        new = state.copy()
        new[nodes[:count]] = FREE
        return new

    # -- least distance ----------------------------------------------------------------------------

    def _least_distance(self, box: _Box) -> tuple[State, FloatArray]:
        """Set and motion of the answer by a least distance, which ends after finitely many steps.

        x = x0 + Z z with B'Z = 0 (all x where the motion is given): |L'x + L^-1 h| with C = L L' is
        least under the bounds. Its multipliers are the residuals.

        References
        ----------
        C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), chapter 23.
        """
        n, r = self.B.shape
        h, x0, Z = box.h, np.zeros(n), np.eye(n)
        if box.motion is not None:
            h = h - self.B @ box.motion
        if box.load is not None:
            x0 = np.asarray(lstsq(self.B.T, box.load, cond=HALF_THE_DIGITS)[0])
            Z = null_space(self.B.T, rcond=HALF_THE_DIGITS)
        if not Z.size:
            return np.full(n, FREE, dtype=np.int8), np.zeros(r)
        self._prepare(np.ones(n, dtype=bool))
        L = np.tril(self._factor)
        N, R = qr(L.T @ Z, mode="economic")
        G = solve_triangular(R, Z.T, trans=1).T
        x1 = x0 - G @ (N.T @ (L.T @ x0 + solve_triangular(L, h, lower=True)))
        below, above = np.isfinite(box.lower), np.isfinite(box.upper)
        rows = np.vstack([G[below], -G[above]])
        right = np.concatenate([(box.lower - x1)[below], (x1 - box.upper)[above]])
        size = float(np.linalg.norm(rows, axis=1).max())
        found = least_distance(rows / size, right)
        if found is None:
            raise ConvergenceError(
                f"contact QP with {n} nodes: no forces inside the bounds have the load {box.load}."
            )
        y, u = found[0] / size, found[1] / size**2
        g, count = np.zeros(n), int(below.sum())
        g[below] += u[:count]
        g[above] -= u[count:]
        # residuals press against the bounds: LOWER where above zero, UPPER where below
        state = -np.sign(g).astype(np.int8)
        if box.motion is not None:
            return state, box.motion
        x = x1 + G @ y
        return state, np.asarray(lstsq(self.B, box.h + self.product(x) - g)[0])
