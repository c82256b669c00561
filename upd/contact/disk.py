"""Disk-constrained friction: semismooth Newton, and behind it a search that provably converges.

    min 1/2 t'C t + h't - d.(sum of t),   |t_i| <= s_i  with t_i = (x_i, y_i),

with the shift d (2,) given, or with the total (2,) given and d its multiplier. The slip step is

    r = d - h - C t:   r_i = 0 where the node sticks, r_i parallel to t_i where it slips.

Vectors are laid out [x_0 .. x_{m-1}, y_0 .. y_{m-1}]; h is the slip before the step.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from upd.contact.qp import EPS, FloatArray, ForceSolution, Method
from upd.errors import ConvergenceError

log = logging.getLogger(__name__)

BoolArray = NDArray[np.bool_]

# Newton takes 4 to 8 steps from a fair start; a run this long is lost, and another start is
# cheaper.
NEWTON_STEPS = 30
# Guard of the fallback: it ends by proof, but the bound is not known beforehand.
SEARCH_STEPS = 20000


@dataclass(frozen=True)
class _Disks:
    """One problem without units: lengths by C_max s_max, forces by s_max."""

    h: FloatArray
    s: FloatArray
    total: FloatArray | None
    shift: FloatArray | None


@dataclass(frozen=True)
class _Iterate:
    t: FloatArray
    slip: FloatArray
    shift: FloatArray
    slipping: BoolArray
    #: tractions before they were brought inside their limits, of an answer
    unclipped: FloatArray | None = None


class DiskQP:
    """Solver bound to one compliance.

    Parameters
    ----------
    compliance : (2 m, 2 m) ndarray
        Compliance [mm/N], symmetric positive definite, layout [x_0 .. x_{m-1}, y_0 .. y_{m-1}].
    """

    def __init__(self, compliance: FloatArray) -> None:
        self.m = len(compliance) // 2
        # Rounding of a sum of 2m products, and of the handful of operations around it; four of them
        # meet in a residual.
        self._rounding = 4 * (2 * self.m + 10) * EPS
        self._largest = float(np.diagonal(compliance).max())
        self.C = np.asfortranarray(compliance.T / self._largest)
        # Weight of a slip against a force in the complementarity function: one over the node's own
        # compliance. Any positive value is exact.
        diagonal = np.diagonal(self.C)
        self._c = 2.0 / (diagonal[: self.m] + diagonal[self.m :])
        self._row = np.sqrt(diagonal)

    def solve(
        self,
        h: FloatArray,
        s: FloatArray,
        *,
        load: FloatArray | None = None,
        motion: FloatArray | None = None,
        force: FloatArray,
        slipping: BoolArray,
    ) -> ForceSolution:
        """Solve one problem; give either `load` or `motion`.

        Parameters
        ----------
        h : (2 m,) ndarray
            Slip before the step [mm].
        s : (m,) ndarray
            Friction limits [N], above zero.
        load : (2,) ndarray, optional
            Sum of the tractions [N], shorter than the sum of `s`.
        motion : (2,) ndarray, optional
            Rigid displacement [mm].
        force : (2 m,) ndarray
            Tractions of the state before [N].
        slipping : (m,) ndarray of bool
            Nodes that slipped in the state before.

        Returns
        -------
        ForceSolution

        Raises
        ------
        ConvergenceError
            When neither Newton nor its fallback reaches the tolerance.
        """
        unit = float(s.max())
        length = unit * self._largest
        disks = _Disks(
            h / length,
            s / unit,
            None if load is None else load / unit,
            None if motion is None else motion / length,
        )
        answer, used, method = self._answer(disks, force / unit, slipping)
        rates = self._rates(disks, answer) / self._largest
        return ForceSolution(
            x=answer.t * unit,
            residual=-answer.slip * length,
            motion=answer.shift * length,
            state=answer.slipping.astype(np.int8),
            iterations=used,
            method=method,
            stiffness=rates.reshape(2, self.m, 2).sum(axis=1),
            unclipped=(answer.t if answer.unclipped is None else answer.unclipped) * unit,
            rates=rates,
        )

    def _answer(
        self, disks: _Disks, force: FloatArray, slipping: BoolArray
    ) -> tuple[_Iterate, int, Method]:
        """Newton from the state before, then from full stick, then the method that cannot fail."""
        starts = [self._rest()]
        if slipping.any():
            starts.insert(
                0,
                _Iterate(
                    self._onto_rim(force, disks.s, slipping),
                    np.zeros(2 * self.m),
                    np.zeros(2),
                    slipping,
                ),
            )
        used = 0
        for start in starts:
            answer, steps = self._newton(disks, start, NEWTON_STEPS)
            used += steps
            if answer is not None:
                return answer, used, "active set"
        log.info("semismooth Newton did not converge in %d steps; the fallback takes over", used)
        answer, steps = (
            self._splitting(disks)
            if disks.total is None
            else self._search_shift(disks, disks.total)
        )
        used += steps
        if answer is None:
            raise ConvergenceError(
                f"friction problem with {self.m} nodes in two directions: no answer after "
                f"{used} steps of Newton and its fallback. "
                "Take smaller load steps, or look for nearly dependent rows in the "
                "compliance matrix."
            )
        return answer, used, "fallback"

    def _rest(self) -> _Iterate:
        """No traction yet, all nodes stick."""
        return _Iterate(
            np.zeros(2 * self.m), np.zeros(2 * self.m), np.zeros(2), np.zeros(self.m, dtype=bool)
        )

    # -- small helpers -----------------------------------------------------------------------------

    def _length(self, v: FloatArray) -> FloatArray:
        return np.asarray(np.hypot(v[: self.m], v[self.m :]))

    @staticmethod
    def _pair(values: NDArray[Any]) -> NDArray[Any]:
        """One value per node, repeated for both directions."""
        return np.concatenate((values, values))

    def _onto_disk(self, v: FloatArray, s: FloatArray) -> FloatArray:
        length = self._length(v)
        factor = np.ones(self.m)
        outside = length > s
        factor[outside] = s[outside] / length[outside]
        return np.asarray(v * self._pair(factor))

    def _onto_rim(self, v: FloatArray, s: FloatArray, nodes: BoolArray) -> FloatArray:
        """Traction of the slipping nodes brought to the length s.

        Also when the limit changed since the last step.
        """
        length = self._length(v)
        factor = np.ones(self.m)
        moved = nodes & (length > 0)
        factor[moved] = s[moved] / length[moved]
        return np.asarray(v * self._pair(factor))

    def _slip(self, disks: _Disks, t: FloatArray, shift: FloatArray) -> FloatArray:
        return np.asarray(self._pair_shift(shift) - disks.h - blas.dgemv(1.0, self.C, t))

    def _pair_shift(self, shift: FloatArray) -> FloatArray:
        return np.repeat(shift, self.m)

    def _solved(self, disks: _Disks, at: _Iterate) -> bool:
        """KKT residual t - P(t + c slip) within its rounding level, and the total met.

        The rounding level is n eps (|t| + c (|h| + |d| + |C||t|)).
        """
        c = self._pair(self._c)
        v = at.t + c * at.slip
        residual = np.abs(at.t - self._onto_disk(v, disks.s))
        size = (
            np.abs(disks.h)
            + np.abs(self._pair_shift(at.shift))
            + self._row * float(np.abs(at.t).sum())
        )
        # The projection shrinks an error of the slip by s / |v|.
        shrink = self._pair(disks.s / np.maximum(self._length(v), disks.s))
        tolerance = self._rounding * (self._pair(disks.s) + c * size * shrink)
        if not np.all(residual <= tolerance):
            return False
        if disks.total is None:
            return True
        return bool(
            np.all(np.abs(self._sums(at.t) - disks.total) <= self._rounding * disks.s.sum())
        )

    def _finish(self, disks: _Disks, at: _Iterate) -> _Iterate | None:
        """Answer with rounding removed: no slip where a node sticks, no traction beyond its limit.

        None if it is no answer.
        """
        t = self._onto_disk(at.t, disks.s)
        slip = self._slip(disks, t, at.shift)
        if not self._solved(disks, _Iterate(t, slip, at.shift, at.slipping)):
            return None
        slipping = self._beyond(disks, t, slip)
        slip[self._pair(~slipping)] = 0.0
        return _Iterate(t, slip, at.shift, slipping, at.t)

    # -- semismooth Newton -------------------------------------------------------------------------

    def _newton(self, disks: _Disks, start: _Iterate, limit: int) -> tuple[_Iterate | None, int]:
        """Newton's method with the stabilised Jacobian.

        References
        ----------
        S. Hueeber, G. Stadler and B. I. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572.
        """
        at, slipping, hold = start, start.slipping, disks.total is not None
        for used in range(1, limit + 1):
            if hold and slipping.all():
                # Rarely the answer (only close to the limit, where tractions fan out), and a poor
                # place to come from: once is refused.
                slipping, hold = self._last_to_slip(disks, at), False
            step = self._newton_step(disks, at, slipping)
            if step is None:
                return None, used
            at, slipping = step, self._beyond(disks, step.t, step.slip)
            answer = self._finish(disks, at)
            if answer is not None:
                return answer, used
        return None, limit

    def _beyond(self, disks: _Disks, t: FloatArray, slip: FloatArray) -> BoolArray:
        return np.asarray(
            self._length(t + self._pair(self._c) * slip) > disks.s * (1 + self._rounding)
        )

    def _last_to_slip(self, disks: _Disks, at: _Iterate) -> BoolArray:
        """Instead of a set that slips everywhere.

        Hold those nodes that slip least, enough to take up what the total leaves.
        """
        assert disks.total is not None
        missing = disks.s.sum() - float(np.hypot(*disks.total))
        order = np.argsort(self._length(at.slip), kind="stable")
        count = int(np.searchsorted(np.cumsum(disks.s[order]), missing)) + 1
        slipping = np.ones(self.m, dtype=bool)
        slipping[order[:count]] = False
        return slipping

    def _newton_step(self, disks: _Disks, at: _Iterate, slipping: BoolArray) -> _Iterate | None:
        """One Newton step; None if singular.

        (I - M) dt - c M dslip = e (t + c slip) - t at slipping nodes, slip + dslip = 0 at sticking
        ones.
        """
        m = self.m
        W, residual = self._stabilised(disks, at, slipping)
        # dslip = dd - C dt + gap between the slip assumed and the slip these tractions cause (only
        # a start has one).
        slip = self._slip(disks, at.t, at.shift)
        assumed = np.where(self._pair(slipping), at.slip, 0.0)
        wx, wy = (slip - assumed).reshape(2, m)
        b = residual + np.concatenate((W[0, 0] * wx + W[0, 1] * wy, W[1, 0] * wx + W[1, 1] * wy))
        A = np.empty((2 * m, 2 * m), order="F")
        nodes = np.arange(m)
        for i in (0, 1):
            A[i * m : (i + 1) * m] = W[i, 0][:, None] * self.C[:m] + W[i, 1][:, None] * self.C[m:]
            for j in (0, 1):
                A[i * m + nodes, j * m + nodes] += slipping * (float(i == j) - W[i, j] / self._c)
        columns = np.column_stack((b, np.concatenate((W[0].T, W[1].T))))
        _, _, x, info = lapack.dgesv(A, columns, overwrite_a=1, overwrite_b=1)
        if info != 0 or not np.all(np.isfinite(x)):
            return None
        if disks.shift is not None:
            more = disks.shift - at.shift
        else:
            assert disks.total is not None
            response = x[:, 1:].reshape(2, m, 2).sum(axis=1)
            try:
                more = np.asarray(
                    np.linalg.solve(response, disks.total - self._sums(at.t + x[:, 0])), dtype=float
                )
            except np.linalg.LinAlgError:
                return None
        t = at.t + x[:, 0] + x[:, 1:] @ more
        shift = at.shift + more
        return _Iterate(t, self._slip(disks, t, shift), shift, slipping)

    def _stabilised(
        self, disks: _Disks, at: _Iterate, slipping: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """c M (2, 2, m) and the residual e (t + c slip) - t (2m,).

        Sticking nodes have M = I and no residual.
        """
        m, s = self.m, disks.s
        t = at.t.reshape(2, m)
        v = t + self._c * at.slip.reshape(2, m)
        size_v, size_t = np.hypot(*v), np.hypot(*t)
        safe_v = np.where(size_v > 0, size_v, 1.0)
        safe_t = np.where(size_t > 0, size_t, 1.0)
        e = s / safe_v
        cosine = (t * v).sum(axis=0) / (safe_t * safe_v)
        # Damping where traction and slip point apart; no damping (beta = 1) where they agree.
        beta = 1.0 / (1.0 - np.minimum(cosine, 0.0) * np.minimum(size_t / s, 1.0))
        F = beta * t[:, None] * v[None] / (np.maximum(s, size_t) * safe_v)
        M = np.where(slipping, e * (np.eye(2)[:, :, None] - F), np.eye(2)[:, :, None])
        residual = np.where(slipping, e * v - t, 0.0)
        return self._c * M, residual.ravel()

    # -- fallback ----------------------------------------------------------------------------------

    def _splitting(
        self, disks: _Disks, start: _Iterate | None = None
    ) -> tuple[_Iterate | None, int]:
        """Given shift: alternating directions, which converge from anywhere; Newton finishes.

        The energy is smooth and strongly convex, so with rho = sqrt(lambda_min lambda_max) the
        error falls by 1 - 1/(1 + sqrt(kappa)) per step: the number of steps has a bound.

        References
        ----------
        S. Boyd et al., Found. Trends ML 3 (2011) 1; P. Giselsson and S. Boyd, IEEE Trans. Autom.
        Control 62 (2017) 532.
        """
        assert disks.shift is not None
        values = np.linalg.eigvalsh(self.C)
        rho = float(np.sqrt(values[0] * values[-1]))
        limit = int(np.ceil((1 + np.sqrt(values[-1] / values[0])) * np.log(self.m / EPS)))
        factor, _ = lapack.dpotrf(self.C + rho * np.eye(2 * self.m), lower=1)
        inverse = lapack.dpotri(factor, lower=1)[0]
        inverse = np.asfortranarray(np.tril(inverse) + np.tril(inverse, -1).T)
        free = self._pair_shift(disks.shift) - disks.h
        at = self._rest() if start is None else start
        z, u = at.t, at.slip / rho
        used, check = 0, 25
        while used < limit:
            for _ in range(min(check, limit - used)):
                v = blas.dgemv(1.0, inverse, rho * (z - u) + free) + u
                z = self._onto_disk(v, disks.s)
                u = v - z
                used += 1
            at = _Iterate(z, rho * u, disks.shift, np.asarray(self._length(v) > disks.s))
            answer, steps = self._newton(disks, at, NEWTON_STEPS)
            used += steps
            if answer is None:
                answer = self._finish(disks, at)
            if answer is not None:
                return answer, used
            check *= 2
        return None, used

    def _search_shift(self, disks: _Disks, total: FloatArray) -> tuple[_Iterate | None, int]:
        """Given total: damped Newton on a convex function of the shift d.

        psi(d) = max over t of (d . sum t - energy) - d . T has the gradient sum t - T. It is
        bounded below because T is shorter than the sum of the limits, so the search ends. Each
        value is a problem with given shift.

        References
        ----------
        J. Nocedal and S. Wright, Numerical Optimization, ch. 3.
        """
        scale = float(disks.s.sum())
        shift = np.asarray(np.linalg.solve(self._tangent(disks, self._rest()), total), dtype=float)
        at, used = self._at_shift(disks, shift, None)
        while at is not None and used < SEARCH_STEPS:
            answer = self._finish(disks, at)
            if answer is None:
                answer, steps = self._newton(disks, at, NEWTON_STEPS)
                used += steps
            if answer is not None:
                return answer, used
            gradient = self._sums(at.t) - total
            K = self._tangent(disks, at)
            K += (
                np.eye(2) * (np.trace(K) + scale) * EPS
                + np.eye(2) * float(np.hypot(*gradient)) / scale
            )
            direction = np.asarray(np.linalg.solve(K, -gradient), dtype=float)
            at, steps = self._line_search(disks, total, at, direction)
            used += steps
        return None, used

    def _line_search(
        self, disks: _Disks, total: FloatArray, at: _Iterate, direction: FloatArray
    ) -> tuple[_Iterate | None, int]:
        """Halve the step until psi falls by a tenth of what its slope promises.

        Or until the gradient halves.
        """
        value, gradient = self._psi(disks, total, at), self._sums(at.t) - total
        slope, used, length = float(gradient @ direction), 0, 1.0
        while length > EPS:
            new, steps = self._at_shift(disks, at.shift + length * direction, at)
            used += steps
            if new is None:
                return None, used
            if self._psi(disks, total, new) <= value + 0.1 * length * slope:
                return new, used
            if np.hypot(*(self._sums(new.t) - total)) <= np.hypot(*gradient) / 2:
                return new, used
            length /= 2
        return None, used

    def _psi(self, disks: _Disks, total: FloatArray, at: _Iterate) -> float:
        # C t = d - h - slip, hence no product.
        Ct = self._pair_shift(at.shift) - disks.h - at.slip
        return float(at.shift @ (self._sums(at.t) - total) - at.t @ (Ct / 2 + disks.h))

    def _sums(self, t: FloatArray) -> FloatArray:
        return np.asarray(t.reshape(2, self.m).sum(axis=1))

    def _at_shift(
        self, disks: _Disks, shift: FloatArray, near: _Iterate | None
    ) -> tuple[_Iterate | None, int]:
        inner = _Disks(disks.h, disks.s, None, shift)
        answer, used = self._newton(inner, self._rest() if near is None else near, NEWTON_STEPS)
        if answer is not None:
            return answer, used
        answer, steps = self._splitting(inner, near)
        return answer, used + steps

    # -- tangent -----------------------------------------------------------------------------------

    def _tangent(self, disks: _Disks, at: _Iterate) -> FloatArray:
        """dT/dd (2, 2)."""
        return np.asarray(self._rates(disks, at).reshape(2, self.m, 2).sum(axis=1), dtype=float)

    def _rates(self, disks: _Disks, at: _Iterate) -> FloatArray:
        """dt/dd (2m, 2): sticking nodes move freely, a slipping traction only turns.

        It turns against |slip|/s on top of the compliance.
        """
        m = self.m
        stick, turn = np.flatnonzero(~at.slipping), np.flatnonzero(at.slipping)
        both = np.concatenate((stick, m + stick))
        k = both.size
        if k + turn.size == 0:
            return np.zeros((2 * m, 2))
        length = self._length(at.t)[turn]
        nx, ny = at.t[turn] / length, at.t[m + turn] / length
        # Columns of C along the free directions, then rows: B'C B with B = [unit vectors of
        # sticking dofs, directions of turning].
        columns = np.concatenate(
            (self.C[:, both], self.C[:, m + turn] * nx - self.C[:, turn] * ny), axis=1
        )
        H = np.concatenate(
            (columns[both], columns[m + turn] * nx[:, None] - columns[turn] * ny[:, None])
        )
        place = k + np.arange(turn.size)
        H[place, place] += self._length(at.slip)[turn] / disks.s[turn]
        rigid = np.zeros((k + turn.size, 2))
        rigid[: stick.size, 0] = rigid[stick.size : k, 1] = 1.0
        rigid[k:] = np.column_stack((-ny, nx))
        _, x, info = lapack.dposv(H.T, rigid, lower=1)
        if info != 0:
            raise ConvergenceError(
                "tangent of the friction problem: the compliance of the sticking nodes is "
                "not positive definite."
            )
        rates = np.zeros((2 * m, 2))
        rates[both] = x[:k]
        rates[turn], rates[m + turn] = -ny[:, None] * x[k:], nx[:, None] * x[k:]
        return rates
