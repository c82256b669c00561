"""Signorini's and Coulomb's conditions together: one step of coupled contact.

Unknown are the forces f of all contact nodes and the rigid motion s of the bodies,

    C f - B s = b + y,   B'f = p   (or s given),

with C the compliance, b = (-gap, -slip before the step) - offset, and y = (g, -dw): the gap left
and the slip made in the step. Per node

    g >= 0, f_n >= 0, g f_n = 0,
    |f_t| <= mu f_n, dw = 0 where it is less, dw = lambda f_t, lambda >= 0, where it is equal.

Semismooth Newton with the stabilised Jacobian [1]_ finds it in a few steps from the state before or
from full stick. Behind it friction rises from nothing, where the forces are those of a box problem
and bodies that slide far are on their way already; then alternating directions on Coulomb's cone
[2]_, from which Newton starts again. Vectors are laid out component by component: normal of all
nodes, then one or two tangential directions. Where the pressing forces f_n are given, there are
these alone; the problem is then convex, and a search for the motion stands behind Newton under a
load.

References
----------
.. [1] S. Hueeber, G. Stadler and B. I. Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572.
.. [2] V. Acary, M. Bremond, O. Huber, in Advanced Topics in Nonsmooth Dynamics (2018), ch. 10: the
   change of variables of De Saxce, u_n + mu |u_t|, which makes the law a complementarity between a
   cone and its dual.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from copy import copy
from dataclasses import replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, lstsq, lu_factor, lu_solve
from scipy.optimize import linprog

from upd.contact.bordered import Bordered
from upd.contact.checks import EPS
from upd.contact.coulomb_conditions import (
    AskedStep,
    CoulombConditions,
    CoupledStep,
    FloatArray,
    Iterate,
    NewtonRows,
)
from upd.contact.coupled_systems import ClosedSystem, NewtonSystem, Stuck
from upd.contact.qp import BoxQP
from upd.errors import ConvergenceError

log = logging.getLogger(__name__)

#: Factors kept for Newton's steps with other states; a cycle of loading comes back to the same few.
KEPT = 4
#: Trials to raise friction from nothing: all that is missing, or half of what failed.
PARTS = 12
#: Newton takes 3 to 10 steps from a fair start; a run this long is lost.
NEWTON_STEPS = 40
#: The fallback has no bound of its own where friction is so large that it need not converge.
FALLBACK_STEPS = 20_000
#: Guard of a search that ends by proof, but not in a number of steps known beforehand.
MOTION_STEPS = 200


class Coulomb(CoulombConditions):
    """Coupled contact solved; made of the same fields."""

    def __post_init__(self) -> None:
        super().__post_init__()
        #: factors kept between iterates
        self._bordered: list[Bordered] = []

    def twin(self) -> Coulomb:
        """The same contact with what is kept between iterates of its own: for another thread."""
        _ = self.carried  # found once for all
        out = copy(self)
        out._bordered = []
        return out

    # -- answers -----------------------------------------------------------------------------------

    def solve(
        self,
        b: FloatArray,
        *,
        load: FloatArray | None = None,
        motion: FloatArray | None = None,
        start: Iterate | None = None,
        turned: bool = False,
        may_fall_back: Callable[[], bool] = lambda: True,
    ) -> CoupledStep:
        """One step, from a state before and from full stick; behind both the fallback.

        Parameters
        ----------
        b : (m,) ndarray
            Minus the gap, minus the slip before the step, both less the offset [mm].
        load, motion : (r,) ndarray
            Exactly one of both [N, mm].
        start : Iterate, optional
            Of the step before.
        turned : bool
            Whether the load turns back in this step: all that is closed then sticks at first, as
            friction does. Where it holds forces without a load, that decides which of several
            answers is found.
        may_fall_back : callable
            Asked before the fallback runs: False where the load is known to have no answer.

        Returns
        -------
        CoupledStep
        """
        step, used = AskedStep(b, load, motion), 0
        best: CoupledStep | None = None
        scaled = self._scaled(step, start)
        if scaled is not None:
            return scaled
        for first in (None,) if start is None else (start, None):
            if used:
                # What the run before kept may be the very thing that failed.
                self._bordered = []
            answer = self._newton(step, first, NEWTON_STEPS, turned)
            used += answer.iterations
            if answer.converged:
                return replace(answer, iterations=used)
            best = answer if best is None or answer.residual < best.residual else best
        self._bordered = []
        if load is not None and not load.any() and self.pressed is None:
            answer = self.judged(step, self._let_go(step, start), used)
            if answer.converged:
                return answer
        if not may_fall_back():
            assert best is not None
            return replace(best, iterations=used)
        log.info("coupled contact: Newton did not converge in %d steps, the fallback runs", used)
        self.near_limit = bool(self.mu.any())
        if self.pressed is None:
            answer = self._with_rising_friction(step, start)
            used += answer.iterations
        if not answer.converged and self.near_limit:
            self._bordered = []
            answer = self._newton(step, None, NEWTON_STEPS)
            used += answer.iterations
        self.near_limit = False
        self._bordered = []
        if answer.converged:
            return replace(answer, iterations=used, method="fallback")
        if self.pressed is not None and load is not None:
            answer = self._by_motion(step)
            used += answer.iterations
        if not answer.converged:
            answer = self.fall_back(step)
            used += answer.iterations
        if not answer.converged and best is not None and best.residual < answer.residual:
            answer = best
        return replace(answer, iterations=used, method="fallback")

    def _newton(
        self, step: AskedStep, start: Iterate | None, limit: int, turned: bool = False
    ) -> CoupledStep:
        at = (
            self.linear_step(step, self.all_stuck())
            if start is None
            else self._moved(step, start, turned)
        )
        best: CoupledStep | None = None
        fine = len(self.C) * EPS
        for used in range(1, limit + 1):
            answer = self.judged(step, at, used)
            if best is not None and best.converged:
                # One step beyond: what the next load step starts from is as good as can be.
                return answer if answer.converged and answer.residual < best.residual else best
            best = answer if best is None or answer.residual < best.residual else best
            if answer.converged:
                best = answer
                if answer.residual <= fine or self.pressed is not None:
                    break
            rows = self.rows_at(at)
            near = self._nearby(step, at, rows)
            if near is not None:
                at = near
                continue
            try:
                at = self.linear_step(step, rows)
            except np.linalg.LinAlgError:
                self._bordered = []
                break
            if not np.isfinite(at.f).all():
                break
        assert best is not None
        return best

    def _let_go(self, step: AskedStep, start: Iterate | None) -> Iterate:
        """No forces under no load: the bodies as near to each other as nothing touches, from where
        they were.
        """
        before = np.zeros(self.B.shape[1]) if start is None else start.s
        normal, f = self.B[: self.n], np.zeros(len(self.C))
        found = linprog(
            -normal.sum(axis=0),
            A_ub=normal,
            b_ub=-step.b[: self.n] - normal @ before,
            bounds=(None, None),
            method="highs",
        )
        step_by = np.asarray(found.x) if found.status == 0 else np.zeros_like(before)
        s = before + step_by
        return Iterate(f, s, -self.B @ s - step.b)

    def _scaled(self, step: AskedStep, start: Iterate | None) -> CoupledStep | None:
        """The forces before, scaled with the load, if they answer: bodies that touch without a load
        under a load that grows in proportion; any under a load that stays, moved together.

        Its residual is judged as that of every answer.
        """
        if start is None or step.load is None or self.pressed is not None:
            return None
        before = self.B.T @ start.f
        size = float(before @ before)
        scale = float(before @ step.load) / size if size > 0.0 else 0.0
        # A motion that no force there is works against has rounding of its own.
        reach = np.abs(self.B.T) @ np.abs(start.f)
        reach += np.abs(start.f).max() * np.abs(self.B).max(axis=0)
        if scale <= 0.0 or (np.abs(scale * before - step.load) > len(self.C) * EPS * reach).any():
            return None
        f = scale * start.f
        there = self.C @ f - step.b
        closed = np.tile(f[: self.n] > 0.0, self.c)
        ways = [scale * start.s]
        if abs(scale - 1.0) <= len(self.C) * EPS:
            ways.append(lstsq(self.B[closed], there[closed])[0])
        for s in ways:
            answer = self.judged(step, Iterate(f, s, there - self.B @ s, True), 0)
            if answer.converged:
                return answer
        return None

    def _moved(self, step: AskedStep, start: Iterate, turned: bool) -> Iterate:
        """The state before as a start: the same rows, solved for the new step; closed ones stick
        where the load turned.
        """
        rows = self.rows_at(start)
        if turned:
            closed = ~rows.is_open
            rows.P[closed], rows.Q[closed] = 0.0, np.eye(self.c)
            rows.rhs[closed], rows.relaxed[closed] = 0.0, False
        s = start.s if step.motion is None else step.motion
        y = self.C @ start.f - self.B @ s - step.b
        near = self._nearby(step, Iterate(start.f, s, y, True), rows)
        if near is not None:
            return near
        try:
            return self.linear_step(step, rows)
        except np.linalg.LinAlgError:
            return self.linear_step(step, self.all_stuck())

    def _nearby(self, step: AskedStep, at: Iterate, rows: NewtonRows) -> Iterate | None:
        """A step of Newton by a kept factor of rows whose states are nearly the same. None where
        none are.
        """
        n, c = self.n, self.c
        near = min(
            (one for one in self._bordered if one.base.by_load == (step.load is not None)),
            key=lambda one: one.changed(rows),
            default=None,
        )
        if near is None:
            return None
        if at.f.reshape(c, n)[:, rows.is_open & near.rows.is_open].any():
            return None
        # what the iterate leaves of the rows, and of the load
        f, y = (v.reshape(c, n) for v in (at.f, self._misfit(step, at)))
        left = rows.rhs - np.einsum("nij,jn->ni", rows.P, f)
        left -= np.einsum("nij,jn->ni", rows.Q, y)
        missing = None if step.load is None else step.load - self.B.T @ at.f
        found = near.step(rows, left, missing, self.rho.T)
        if found is None:
            return None
        f, s = at.f + found[0], at.s + found[1]
        f.reshape(c, n)[:, rows.is_open] = 0.0
        return Iterate(f, s, self.C @ f - self.B @ s - step.b, True)

    # -- linear algebra ----------------------------------------------------------------------------

    def system_of(self, rows: NewtonRows, by_load: bool) -> NewtonSystem:
        """The rows, factored.

        Raises LinAlgError where the states carry no load.
        """
        return (ClosedSystem if rows.relaxed.any() else Stuck)(self, rows, by_load)

    def linear_step(self, step: AskedStep, rows: NewtonRows) -> Iterate:
        """The new iterate: P f + Q (C f - B s - b) = rhs."""
        system = self.system_of(rows, step.load is not None)
        closed = isinstance(system, ClosedSystem)
        if isinstance(system, ClosedSystem) and system.dear:
            self._bordered = [*self._bordered, Bordered(system)][-KEPT:]
        return Iterate(*system.refined(rows.rhs.T.ravel(), step), closed)

    def derivative(self, at: Iterate) -> FloatArray:
        """df/ds (m, r) with the states kept.

        Raises LinAlgError where the states leave no unique answer.
        """
        rows, r = self.rows_at(at), self.B.shape[1]
        zero = np.zeros((len(self.C), r))
        return self.system_of(rows, False).solve(zero, AskedStep(zero, None, np.eye(r)))[0]

    # -- fallback ----------------------------------------------------------------------------------

    def _by_motion(self, step: AskedStep) -> CoupledStep:
        """The load met by a search for the motion, where the pressing forces are given.

        psi(s) = max over f of (B s + b).f - f'C f / 2, less s.p, is convex with the gradient
        B'f - p, and bounded below because p is less than friction holds: damped Newton ends [1]_.
        Each value is a problem with the motion given.

        References
        ----------
        .. [1] J. Nocedal, S. Wright, Numerical Optimization, ch. 3.
        """
        assert step.load is not None and self.pressed is not None
        p, scale = step.load, float((self.mu * self.pressed).sum())

        def psi(at: Iterate) -> float:
            # C f = y + B s + b
            own = at.f @ (0.5 * (at.y + self.B @ at.s - step.b))
            return float(at.s @ (self.B.T @ at.f - p) - own)

        at = self.solve(step.b, motion=self.carried[1] @ p).at
        for used in range(1, MOTION_STEPS + 1):
            missing = p - self.B.T @ at.f
            K = self.B.T @ self.derivative(at)
            more = (np.trace(K) + scale) * EPS + float(np.linalg.norm(missing)) / scale
            way, length = np.linalg.solve(K + more * np.eye(len(K)), missing), 1.0
            while length > EPS:
                new = self.solve(step.b, motion=at.s + length * way, start=at).at
                rest = p - self.B.T @ new.f
                falls = psi(new) <= psi(at) - 0.1 * length * float(missing @ way)
                if falls or np.linalg.norm(rest) <= 0.5 * np.linalg.norm(missing):
                    break
                length *= 0.5
            answer, at = self.judged(step, new, used), new
            if answer.converged or length <= EPS:
                break
        return answer

    def _with_rising_friction(self, step: AskedStep, start: Iterate | None) -> CoupledStep:
        """From the answer without friction, where bodies that slide by far more than they deform
        are on their way already, by Newton with all of the friction, or with a part first.
        """
        mu, risen, more = self.mu, 0.0, 1.0
        self.mu = np.zeros_like(mu)
        answer = near = self._frictionless(step, start)
        used = near.iterations
        for _ in range(PARTS if mu.any() else 0):
            self._bordered = []
            self.mu = (risen + more * (1.0 - risen)) * mu
            answer = self._newton(step, near.at, NEWTON_STEPS)
            used += answer.iterations
            if answer.converged and more == 1.0:
                break
            if answer.converged:
                near, risen, more = answer, risen + more * (1.0 - risen), 1.0
            else:
                more *= 0.5
        self.mu = mu
        return self.judged(step, answer.at, used)

    def _frictionless(self, step: AskedStep, start: Iterate | None) -> CoupledStep:
        """Without friction the forces are the one answer of a box QP, which is proven to end."""
        n, s = self.n, np.zeros(self.B.shape[1]) if start is None else start.s
        # forces and moments differ by a length; what moves no normal stays as it is
        size = np.abs(self.B[:n]).max(axis=0)
        moved = size > 0.0
        none, state = np.zeros(n), np.zeros(n, dtype=np.int8)
        try:
            found = BoxQP(self.C[:n, :n], self.B[:n, moved] / size[moved]).solve(
                -step.b[:n],
                none,
                none + np.inf,
                load=None if step.load is None else step.load[moved] / size[moved],
                motion=None if step.motion is None else step.motion[moved] * size[moved],
                state=state,
            )
        except ConvergenceError:
            # nothing carries the load, or the least squares ran out of steps
            return self.judged(step, self.linear_step(step, self.all_stuck()), 0)
        s = s.copy() if step.motion is None else step.motion
        if step.motion is None:
            s[moved] = found.motion / size[moved]
        forces = np.concatenate((found.x, np.zeros(len(self.C) - n)))
        # Newton removes the rest of rounding, where a motion is not free.
        return self._ended(step, Iterate(forces, s, self.C @ forces - self.B @ s - step.b))

    def _ended(self, step: AskedStep, at: Iterate) -> CoupledStep:
        """An iterate that answers, or where Newton leads from it."""
        answer = self.judged(step, at, 0)
        return answer if answer.converged else self._newton(step, at, NEWTON_STEPS)

    def fall_back(self, step: AskedStep) -> CoupledStep:
        """Alternating directions for f in Coulomb's cone, u + mu |u_t| in its dual; Newton ends.

        With the shift mu |u_t| held, the problem is convex and the iteration converges; the shift
        follows it. There is none where the pressing forces are given.
        """
        size = np.linalg.eigvalsh(self.C)
        sigma = float(size[-1] * np.sqrt(max(size[0] / size[-1], EPS)))
        try:
            factor = cho_factor(self.C + sigma * np.eye(len(self.C)), lower=True)
        except np.linalg.LinAlgError:
            factor = cho_factor(
                self.C + float(np.diagonal(self.C).max()) * np.eye(len(self.C)), lower=True
            )
        CB = cho_solve(factor, self.B)
        rigid = lu_factor(self.B.T @ CB)
        z = np.zeros(len(self.C))
        v = np.zeros(len(self.C))
        s = np.zeros(self.B.shape[1]) if step.motion is None else step.motion
        used, batch, best = 0, 20, None
        while used < FALLBACK_STEPS:
            for _ in range(batch):
                f = cho_solve(factor, sigma * (z - v) + step.b - self._shift(sigma * v))
                if step.load is not None:
                    s = lu_solve(rigid, step.load - self.B.T @ f)
                f = f + CB @ s
                z = self.nearest(f + v)
                v += f - z
            used += batch
            batch = min(2 * batch, FALLBACK_STEPS // 10)
            answer = self._ended(step, Iterate(z, s, -sigma * v - self._shift(sigma * v)))
            used += answer.iterations
            best = answer if best is None or answer.residual < best.residual else best
            if answer.converged:
                break
        assert best is not None
        return replace(best, iterations=used)

    def _shift(self, u: FloatArray) -> FloatArray:
        """De Saxce's change of variables of displacements u (m,): mu |u_t| at the normal ones."""
        out = np.zeros((self.c, self.n))
        if self.pressed is None:
            out[0] = self.mu * np.sqrt((u.reshape(self.c, self.n)[1:] ** 2).sum(axis=0))
        return out.ravel()

    def nearest(self, v: FloatArray) -> FloatArray:
        """Nearest forces with f_n >= 0 and |f_t| <= mu f_n."""
        f = v.reshape(self.c, self.n).copy()
        if self.pressed is not None:
            return np.ravel(f * self._shrink(f, self.mu * self.pressed))
        normal, length = f[0].copy(), np.sqrt((f[1:] ** 2).sum(axis=0))
        inside = length <= self.mu * normal
        away = ~inside & (self.mu * length <= -normal)
        rim = ~inside & ~away
        f[:, away] = 0.0
        onto = (normal + self.mu * length)[rim] / (1.0 + self.mu[rim] ** 2)
        f[0, rim] = onto
        f[1:, rim] *= self.mu[rim] * onto / length[rim]
        return f.ravel()
