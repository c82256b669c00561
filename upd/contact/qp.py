"""Box-constrained contact QP: a primal-dual active set, and behind it a method that provably ends.

    min 1/2 x'C x + h'x - d e'x,   lower <= x <= upper,

with the shift d given, or with the total e'x = T given and d its multiplier. The residual is

    g = h + C x - d e:   g = 0 at free nodes, g >= 0 where x = lower, g <= 0 where x = upper.

C is symmetric positive definite, so there is one answer. Normal contact is lower = 0,
upper = inf; friction in one direction is -mu f <= t <= mu f.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from upd.errors import ConvergenceError

log = logging.getLogger(__name__)

FloatArray = NDArray[np.float64]
State = NDArray[np.int8]
Method = Literal["active set", "fallback"]

FREE, LOWER, UPPER = 0, -1, 1
EPS = float(np.finfo(float).eps)
# A primal-dual active set that works takes 3 to 10 steps; longer chains are handed over to the
# monotone method.
ACTIVE_SET_STEPS = 50


@dataclass(frozen=True)
class BoxSolution:
    """Answer of one box QP.

    Attributes
    ----------
    x : (n,) ndarray
        Forces [N].
    residual : (n,) ndarray
        g = h + C x - d e [mm].
    shift : float
        d [mm].
    state : (n,) ndarray of int8
        0 free, -1 at the lower bound, +1 at the upper bound.
    iterations : int
        Factorisations.
    method : {"active set", "fallback"}
        Method that finished.
    stiffness : float
        Tangent e' C_AA^-1 e of the free set A [N/mm].
    unclipped : (n,) ndarray
        Forces before they were clipped to the bounds [N]: for checks.
    rates : (n,) ndarray
        Change of the forces with the shift [N/mm], C_AA^-1 e on A, whose sum is the stiffness.
    """

    x: FloatArray
    residual: FloatArray
    shift: float
    state: State
    iterations: int
    method: Method
    stiffness: float
    unclipped: FloatArray
    rates: FloatArray


@dataclass(frozen=True)
class _Box:
    """One problem: h, bounds and either the total or the shift (the other is None)."""

    h: FloatArray
    lower: FloatArray
    upper: FloatArray
    total: float | None
    shift: float | None


@dataclass(frozen=True)
class _Step:
    """Minimiser over the free nodes of one set, its residual and its shift.

    `tolerance` is the rounding level of the residual.
    """

    x: FloatArray
    residual: FloatArray
    shift: float
    tolerance: FloatArray


class BoxQP:
    """Solver bound to one compliance matrix.

    It keeps the factor of the last free set, so that neighbouring problems start at once.

    Parameters
    ----------
    compliance : (n, n) ndarray
        Compliance [mm/N], symmetric positive definite: see `upd.contact.checks`.
    """

    def __init__(self, compliance: FloatArray) -> None:
        # Fortran order: LAPACK and BLAS take it as it is.
        self.C = np.asfortranarray(compliance.T)
        self.n = len(self.C)
        # Rounding of a sum of n products, and of the handful of operations around it.
        self._rounding = (self.n + 10) * EPS
        diagonal = np.diagonal(self.C)
        # |C_ij| <= sqrt(C_ii C_jj): an upper bound of each row, for the rounding level of C x.
        self._row = np.sqrt(diagonal * diagonal.max(initial=0.0))
        self._key: bytes | None = None
        self._index = np.zeros(0, dtype=np.intp)
        self._factor = np.zeros((0, 0))
        self._unit = np.zeros(0)
        self._stiffness = 0.0

    def solve(
        self,
        h: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        *,
        total: float | None = None,
        shift: float | None = None,
        state: State,
        max_iter: int | None = None,
    ) -> BoxSolution:
        """Solve one box QP; give either `total` or `shift`.

        Parameters
        ----------
        h : (n,) ndarray
            Linear term [mm].
        lower, upper : (n,) ndarray
            Bounds [N].
        total : float, optional
            Sum of x [N], strictly between the sums of the bounds.
        shift : float, optional
            d [mm].
        state : (n,) ndarray of int8
            Set to start from: 0 free, -1 at the lower bound, +1 at the upper bound.
        max_iter : int, optional
            Limit on the factorisations of both methods together.

        Returns
        -------
        BoxSolution

        Raises
        ------
        ConvergenceError
            When neither method reaches the KKT tolerance.
        """
        box = _Box(h, lower, upper, total, shift)
        limit = ACTIVE_SET_STEPS + 20 * (self.n + 10) if max_iter is None else max_iter
        step, state, used, reason = self._active_set(box, state, min(limit, ACTIVE_SET_STEPS))
        method: Method = "active set"
        step = self._refined(box, step, state)
        if step is None or not self._solved(box, step, state):
            log.info(
                "primal-dual active set stopped (%s); the primal active set takes over", reason
            )
            method = "fallback"
            start = np.zeros(self.n) if step is None else step.x
            step, state, more, reason = self._primal(box, start, limit - used)
            used += more
            step = self._refined(box, step, state)
        if step is None or not self._solved(box, step, state):
            raise ConvergenceError(
                f"contact QP with {self.n} nodes: no answer after {used} factorisations "
                f"({reason}). "
                "Raise max_iter, or look for nearly dependent rows in the compliance matrix."
            )
        self._prepare(state == FREE)
        residual = np.where(state == FREE, 0.0, step.residual)
        residual = np.where(
            state == LOWER,
            np.maximum(residual, 0.0),
            np.where(state == UPPER, np.minimum(residual, 0.0), residual),
        )
        x, rates = np.clip(step.x, lower, upper), np.zeros(self.n)
        if self._index.size:
            rates[self._index] = self._unit
        return BoxSolution(
            x, residual, step.shift, state, used, method, self._stiffness, step.x, rates
        )

    # -- linear algebra of one set -----------------------------------------------------------------

    def product(self, x: FloatArray) -> FloatArray:
        """Product C x (n,) [mm] of forces x (n,) [N].

        By the BLAS that also factors: numpy brings a second one, and two thread pools on the same
        cores cost a factor of ten.
        """
        return np.asarray(blas.dgemv(1.0, self.C, x))

    def _prepare(self, free: NDArray[np.bool_]) -> None:
        """Factor C_AA of the free set A unless it is the set at hand.

        With it come u = C_AA^-1 e and the tangent e'u.
        """
        key = free.tobytes()
        if key == self._key:
            return
        index = np.flatnonzero(free)
        self._key, self._index, self._stiffness = None, index, 0.0
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
            self._unit = lapack.dpotrs(factor, np.ones(index.size), lower=1)[0]
            self._stiffness = float(self._unit.sum())
        self._key = key

    def _minimise(self, box: _Box, state: State) -> _Step | None:
        """Minimiser with the nodes of `state` held at their bounds.

        None when a total is asked for and no node is free.
        """
        free = state == FREE
        self._prepare(free)
        x = np.zeros(self.n)
        for side, bound in ((LOWER, box.lower), (UPPER, box.upper)):
            held = state == side
            x[held] = bound[held]
        q = box.h + self.product(x) if x.any() else box.h
        index = self._index
        if index.size:
            y = lapack.dpotrs(self._factor, q[index], lower=1)[0]
            d = (
                box.shift
                if box.total is None
                else (box.total - x.sum() + y.sum()) / self._stiffness
            )
            assert d is not None
            x[index] = d * self._unit - y
        elif box.shift is not None:
            d = box.shift
        else:
            return None
        return _Step(x, box.h + self.product(x) - d, float(d), self._tolerance(box, x, float(d)))

    def _refined(self, box: _Box, step: _Step | None, state: State) -> _Step | None:
        """Iterative refinement of a step.

        With a total given, x is a difference of large terms and loses digits that one more solve
        brings back.
        """
        if step is None or self._solved(box, step, state):
            return step
        self._prepare(state == FREE)
        index = self._index
        if not index.size:
            return step
        x = step.x.copy()
        y = lapack.dpotrs(self._factor, step.residual[index], lower=1)[0]
        more = 0.0 if box.total is None else (box.total - x.sum() + y.sum()) / self._stiffness
        x[index] += more * self._unit - y
        d = step.shift + float(more)
        return _Step(x, box.h + self.product(x) - d, d, self._tolerance(box, x, d))

    def _tolerance(self, box: _Box, x: FloatArray, d: float) -> FloatArray:
        """Rounding level n eps (|h| + |d| + |C||x|) of the residual, node by node."""
        return np.asarray(
            self._rounding * (np.abs(box.h) + abs(d) + self._row * float(np.abs(x).sum()))
        )

    def _bound_tolerance(self, step: _Step) -> FloatArray:
        """Rounding level of x.

        So small that n nodes moved by it stay inside the residual tolerance.
        """
        return np.asarray(step.tolerance / (self.n * self._row))

    def _solved(self, box: _Box, step: _Step, state: State) -> bool:
        """KKT conditions within the rounding level, whatever method finished."""
        # The Cholesky solve and the product each leave an error of this size: allow for both, and
        # for the clipping of x.
        tolerance = 4 * step.tolerance
        slack = 4 * self.n * self._bound_tolerance(step)
        g = step.residual
        kkt = np.where(state == FREE, np.abs(g), np.where(state == LOWER, -g, g)) <= tolerance
        inside = (step.x >= box.lower - slack) & (step.x <= box.upper + slack)
        if box.total is None:
            return bool(np.all(kkt & inside))
        balance = abs(step.x.sum() - box.total) <= 4 * self._rounding * (
            abs(box.total) + np.abs(step.x).sum()
        )
        return bool(np.all(kkt & inside) and balance)

    # -- primal-dual active set --------------------------------------------------------------------

    def _active_set(
        self, box: _Box, state: State, limit: int
    ) -> tuple[_Step | None, State, int, str]:
        """Primal-dual active set: fast, but may cycle, which the visited sets reveal.

        References
        ----------
        M. Hintermueller, K. Ito and K. Kunisch, SIAM J. Optim. 13 (2002) 865.
        """
        visited: set[bytes] = set()
        step: _Step | None = None
        for used in range(1, limit + 1):
            visited.add(state.tobytes())
            now = self._minimise(box, state)
            if now is None:
                new = self._last_to_yield(box, state)
            else:
                step, new = now, self._next_state(box, now, state)
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
        slack = self._bound_tolerance(step)
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
        assert box.total is not None
        x = np.where(state == LOWER, box.lower, box.upper)
        missing = box.total - x.sum()
        q = box.h + self.product(x)
        held, order = (state == UPPER, -q) if missing < 0 else (state == LOWER, q)
        nodes = np.flatnonzero(held)
        nodes = nodes[np.argsort(order[nodes], kind="stable")]
        room = np.cumsum((box.upper - box.lower)[nodes]) / 2
        count = int(np.searchsorted(room, abs(missing))) + 1
        new = state.copy()
        new[nodes[:count]] = FREE
        return new

    # -- primal active set with ratio test ---------------------------------------------------------

    def _primal(
        self, box: _Box, start: FloatArray, limit: int
    ) -> tuple[_Step | None, State, int, str]:
        """Primal active set with a ratio test; monotone.

        Free nodes stay strictly inside, so every step lowers the energy and no set comes back.

        References
        ----------
        C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), chapter 23.
        """
        x = self._feasible(box, start)
        state = np.where(x <= box.lower, LOWER, np.where(x >= box.upper, UPPER, FREE)).astype(
            np.int8
        )
        entering = -1
        skipped = np.zeros(self.n, dtype=bool)
        for used in range(1, limit + 1):
            target = self._minimise(box, state)
            if target is None:
                done = self._leave_vertex(box, x, state)
                if done is not None:
                    return done, state, used, "converged"
                continue
            outside = (state == FREE) & ((target.x < box.lower) | (target.x > box.upper))
            if not outside.any():
                x = target.x
                entering = self._worst(target, state, skipped)
                if entering < 0:
                    return target, state, used, "converged"
                state[entering] = FREE
                continue
            moved = self._ratio_step(box, x, target.x, outside, state)
            if moved:
                skipped[:] = False
            elif entering >= 0 and state[entering] != FREE:
                # Rounding: its residual is below what the solve resolves.
                skipped[entering] = True
        return None, state, limit, "step limit of the primal active set"

    @staticmethod
    def _ratio_step(
        box: _Box, x: FloatArray, target: FloatArray, outside: NDArray[np.bool_], state: State
    ) -> bool:
        """Go towards `target` as far as the bounds allow (x and state change in place).

        False when nothing could move.
        """
        nodes = np.flatnonzero(outside)
        bound = np.where(target[nodes] < box.lower[nodes], box.lower[nodes], box.upper[nodes])
        ratio = (bound - x[nodes]) / (target[nodes] - x[nodes])
        alpha = float(np.clip(ratio.min(), 0.0, 1.0))
        free = state == FREE
        x[free] += alpha * (target[free] - x[free])
        blocking = ratio <= alpha * (1 + EPS)
        hit = nodes[blocking]
        x[hit] = bound[blocking]
        state[hit] = np.where(bound[blocking] == box.lower[hit], LOWER, UPPER)
        return alpha > 0.0

    @staticmethod
    def _worst(step: _Step, state: State, skipped: NDArray[np.bool_]) -> int:
        """Held node whose residual has the wrong sign by most, or -1."""
        wrong = np.where(
            state == LOWER, -step.residual, np.where(state == UPPER, step.residual, 0.0)
        )
        wrong[(wrong <= step.tolerance) | skipped] = 0.0
        worst = int(np.argmax(wrong))
        return worst if wrong[worst] > 0.0 else -1

    def _leave_vertex(self, box: _Box, x: FloatArray, state: State) -> _Step | None:
        """All nodes held, total given: the answer if a shift fits between both sides.

        Otherwise the pair that lowers the energy most is freed.
        """
        q = box.h + self.product(x)
        upper, lower = np.flatnonzero(state == UPPER), np.flatnonzero(state == LOWER)
        i = int(upper[np.argmax(q[upper])]) if upper.size else -1
        j = int(lower[np.argmin(q[lower])]) if lower.size else -1
        d = float(q[[k for k in (i, j) if k >= 0]].mean())
        tolerance = self._tolerance(box, x, d)
        if i < 0 or j < 0 or q[i] <= q[j] + tolerance[i]:
            return _Step(x, q - d, d, tolerance)
        state[[i, j]] = FREE
        return None

    def _feasible(self, box: _Box, start: FloatArray) -> FloatArray:
        """Nearest simple point inside the bounds, with the right total when one is asked for."""
        x = np.clip(start, box.lower, box.upper)
        if box.total is None:
            return x
        missing = box.total - float(x.sum())
        room = box.upper - x
        if missing > 0 and np.all(np.isfinite(room)):
            return np.asarray(x + room * (missing / room.sum()))
        above = x - box.lower
        if above.sum() > 0:
            return np.asarray(box.lower + above * ((box.total - box.lower.sum()) / above.sum()))
        x[int(np.argmin(box.h))] += missing
        return x
