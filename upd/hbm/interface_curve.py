"""Walk along the curve of the balance by whole faces, over frequency.

Arc length over all unknowns, with a corrector of its own: what sticks has a memory, so that the
curve depends on the way along it, and every sample of every node puts a kink into it. A node's
slips are taken among the unknowns from the first time it moves. Where the curve folds, or no step
leads on, a motion whose frequency changes on must jump; the walk then marches in time at the next
frequency, as a sweep would, and goes on from the motion found there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError
from upd.hbm.interface_equations import ContactPeriod, InterfaceEquations
from upd.hbm.interface_march import InterfaceMarch
from upd.hbm.interface_newton import (
    InterfaceEvaluation,
    StrangerMovesError,
    evaluate,
    slips_for_good,
)
from upd.hbm.interface_point import InterfacePoint, read_point
from upd.hbm.interface_state import EPS, FloatArray
from upd.hbm.interface_step import SOLVED
from upd.hbm.interface_sweep import settle
from upd.hbm.newton import (
    CHORD,
    BorderedFactors,
    Settings,
    bordered_factors,
    finite_jacobian,
)
from upd.hbm.residuals import FREQUENCY_SHARE

#: shortest step of the load on the way from rest to the first frequency's answer
LEAST_LOAD = 1.0 / 64.0
#: tolerances to which a motion is marched before the balance is tried on it
MARCHED = (1e-2, 1e-3)
MOST_PERIODS = 2000
#: difference of the blades' motions, relative, up to which balance and march are the same motion
SAME = 0.1
#: step, over the size of the solution, with which a fold is approached: what its top may be off
NEAR_FOLD = 0.005
#: how far the corrector may move from the predicted point, in steps
STRAY = 0.5


@dataclass(frozen=True)
class InterfacePlace:
    """Where a curve stands: a solved point, the scaled tangent onwards, and the next step."""

    x: FloatArray
    p: float
    tangent: FloatArray
    step: float
    iterations: int


class InterfaceCurve:
    """A curve on its way."""

    def __init__(
        self,
        equations: InterfaceEquations,
        drive: ArrayLike,
        settings: Settings,
        mean: float,
    ) -> None:
        self.equations, self.settings = equations, settings
        self.p_scale = FREQUENCY_SHARE * mean
        self.places: list[InterfacePoint] = []
        self.jumps: list[float] = []
        #: numbers of the points after which it jumped; frequencies at which nothing was found
        self.broken: list[int] = []
        self.missed: list[float] = []
        self.length = settings.first_step
        model = equations.model
        n, m, L = model.n, len(model.frequency), model.places.shape[1]
        #: the model with its modes as outputs
        self.modes = replace(
            model,
            seen_modes=np.eye(m),
            seen_contact=np.zeros((m, 3 * n)),
            seen_drive=np.zeros((m, L)),
        )
        self.drive = drive
        self.moving = equations.start.copy()

    def follow(self, f: FloatArray) -> tuple[str, str]:
        """Status and message of the walk over the frequencies."""
        way = 1.0 if f[-1] >= f[0] else -1.0
        at = self._first(float(f[0]))
        if at is not None:
            at = self._begin(at, way)
        missed = self.missed
        if at is None:
            missed.append(float(f[0]))
        while at is None or (f[-1] - at.p) * way > 0.0:
            if len(self.places) >= self.settings.most_points:
                return "step limit", (
                    f"{len(self.places)} points used before {f[-1]:.9g} Hz{self._told(missed)}"
                )
            if at is not None:
                try:
                    found = self._advance(at, f)
                except StrangerMovesError as more:
                    at = self._widened(at, more.moving)
                    continue
                if found is not None and float(found.tangent[-1]) * way > 0.0:
                    at = found
                    self.places.append(self._kept(at))
                    continue
                if found is not None and at.step > NEAR_FOLD:
                    at = replace(at, step=0.5 * min(at.step, self.length))
                    continue
            # a fold, or a place from which no step leads on: a motion must jump there
            passed = max([p * way for p in missed] + [one.frequency * way for one in self.places])
            ahead = f[f * way > passed]
            if not len(ahead):
                break
            at = self._jump(float(ahead[0]))
            if at is None:
                missed.append(float(ahead[0]))
                continue
            self.jumps.append(at.p)
            if self.places:
                self.broken.append(len(self.places) - 1)
            self.places.append(self._kept(at))
            at = self._begin(at, way)
        if missed and missed[-1] == f[-1]:
            return "stopped", (
                f"no periodic motion found at {f[-1]:.9g} Hz{self._told(missed)}; march there, or "
                "take more samples"
            )
        return (
            "complete",
            f"reached {f[-1]:.9g} Hz in {len(self.places)} points{self._told(missed)}",
        )

    def _kept(self, at: InterfacePlace) -> InterfacePoint:
        """The point of a place; a jump from there begins with its state."""
        e, w = self.equations, 2.0 * np.pi * at.p
        q, rigid, slip = e.split(at.x)
        period = e.march(at.x, w)
        self.moving = e.state_in(period, q, rigid, slip, w)
        return read_point(e, period, q, rigid, slip, at.p, at.iterations)

    def _told(self, missed: list[float]) -> str:
        """Where it jumped, and where nothing was found."""
        told = [
            (self.jumps, "after a jump, found by time march, at"),
            (missed, "no periodic motion found at"),
        ]
        parts = [f"; {words} {', '.join(f'{p:.6g}' for p in at)} Hz" for at, words in told if at]
        return "".join(parts)

    def _jump(self, f: float) -> InterfacePlace | None:
        """March in time from the last point until the balance finds the motion marched.

        Parameters
        ----------
        f : float
            Hz.

        Returns
        -------
        InterfacePlace or None
            None where the march does not settle, or the balance finds another motion.
        """
        e = self.equations
        march = InterfaceMarch(self.modes, f, self.drive, e.samples, e.fallback)
        for tolerance in MARCHED:
            try:
                settled = settle(
                    march, self.moving, tolerance, MOST_PERIODS, accelerate=True
                ).settled
                marched = self.moving.copy()
                q = e.Q @ march.period(marched).output
            except ConvergenceError:
                return None
            dt, at = march.dt, self.moving
            e.slip = at.slip.copy()
            e.known = None
            rigid = np.array([at.s, dt * at.sv, dt**2 * at.sa])
            x = e.joined(q, rigid, at.slip)
            found = self._at_frequency(x, f)
            if found is not None:
                off = float(np.linalg.norm(e.split(found.x)[0][1:] - q[1:]))
                if off <= SAME * float(np.linalg.norm(q[1:])):
                    return found
            if not settled:
                break
        return None

    def _at_frequency(self, x: FloatArray, f: float) -> InterfacePlace | None:
        """Newton's method at a frequency, with as many unknowns as it takes."""
        e = self.equations
        while True:
            normal = np.zeros(len(x) + 1)
            normal[-1] = 1.0
            try:
                return self._correct(x, f, normal, self.scale(x), e.split(x)[2])
            except StrangerMovesError as more:
                q, rigid, slip = e.split(x)
                e.let_move(more.moving)
                x = e.joined(q, rigid, slip)

    def _begin(self, at: InterfacePlace, way: float) -> InterfacePlace:
        """The place with its tangent in the direction of travel, and the first step."""
        tangent = at.tangent * np.sign(at.tangent[-1]) * way
        return replace(at, tangent=tangent, step=self.settings.first_step)

    def _correct(
        self, x: FloatArray, p: float, normal: FloatArray, D: FloatArray, past: FloatArray
    ) -> InterfacePlace | None:
        """Newton's method in the plane across `normal` through a point; None where it fails.

        The steps are whole ones, and the factors at hand serve for further ones as long as these
        shrink fast: a residual costs a fifth of a derivative. A node that has left the place of its
        past to come to the verge of slipping, and is sent back beyond that place, stays there.

        Parameters
        ----------
        x : (u,) ndarray
            Guess.
        p : float
            Its frequency.
        normal : (u + 1,) ndarray
            In scaled coordinates.
        D : (u,) ndarray
            Units of the unknowns.
        past : (2 n,) ndarray
            Slips at the point before.
        """
        e, s = self.equations, self.settings
        first = len(x) - len(e.tangents)
        before = past[e.tangents - e.model.n].reshape(2, -1)
        count, sizes, factors, of = 0, [np.inf, np.inf], None, None
        while True:
            try:
                found = evaluate(e, x, 2.0 * np.pi * p, past)
            except ConvergenceError:
                return None
            step = None
            if factors is not None and of is not None and found.like(of):
                step = factors.solve(-found.residual, 0.0)
                if not float(np.linalg.norm(step)) <= CHORD * sizes[-1]:
                    step = None
            if step is None:
                factors, of, count = self._factors(found, normal, D), found, count + 1
                if factors is None or count > s.iterations:
                    return None
                step = factors.solve(-found.residual, 0.0)
            sizes.append(float(np.linalg.norm(step)))
            # nodes that change their states to and fro: a shorter step tells them apart
            if not sizes[-1] < sizes[-3]:
                return None
            slip = x[first:].reshape(2, -1)
            x, p = x + step[:-1] * D, p + float(step[-1]) * self.p_scale
            self._stay(x[first:].reshape(2, -1), slip, before, found.period)
            if float(np.abs(step).max()) * len(step) ** 0.5 <= s.tolerance:
                # the way on is that of the answer, not of the point whose factors led to it
                here = factors if of is found else self._factors(found, normal, D)
                if here is None:
                    return None
                return InterfacePlace(x, p, here.tangent(), 0.0, count + 1)

    def _factors(
        self, found: InterfaceEvaluation, normal: FloatArray, D: FloatArray
    ) -> BorderedFactors | None:
        """Of the derivative at a point; None where it has none, or is singular."""
        J = found.jacobian
        if not finite_jacobian(J):
            return None
        factors = bordered_factors(J, 2.0 * np.pi * found.by_w, D, self.p_scale, normal)
        return None if factors.singular else factors

    def _stay(
        self, moved: FloatArray, slip: FloatArray, before: FloatArray, period: ContactPeriod
    ) -> None:
        """Put back nodes that slip for good and are sent back beyond the place of their past.

        Parameters
        ----------
        moved, slip, before : (2, c) ndarray
            Slips of the nodes that may move: now, overwritten; in the period; in the past.
        period : ContactPeriod
        """
        e = self.equations
        after = period.slip[e.tangents - e.model.n].reshape(2, -1)
        way = np.where(slip != before, slip, after) - before
        moving = period.moving[e.mobile]
        for_good = slips_for_good(e, period)[:, e.mobile].any(axis=0) | ~moving
        back = (((moved - before) * way).sum(axis=0) <= 0.0) & for_good
        moved[:, back] = before[:, back]

    def _advance(self, at: InterfacePlace, marks: FloatArray) -> InterfacePlace | None:
        """One step; None when even the smallest fails.

        There is a kink wherever a sample of a node changes its state, and what sticks has a memory,
        so that neither turns of the tangent nor the sign of the determinant tell pieces of the
        curve apart. A step is good where the corrector ends near the point it started from.
        """
        s, D, h = self.settings, self.scale(at.x), at.step
        past = self.equations.split(at.x)[2]
        while h >= s.smallest_step:
            normal, length, rate = at.tangent, h, float(at.tangent[-1]) * self.p_scale
            ahead = marks[(marks - at.p) * np.sign(rate) > 4 * EPS * at.p]
            mark = float(ahead[np.abs(ahead - at.p).argmin()]) if len(ahead) else np.inf
            hit = abs(mark - at.p) <= h * abs(rate)
            if hit:
                length = (mark - at.p) / rate
                normal = np.zeros_like(at.tangent)
                normal[-1] = np.sign(rate)
            x = at.x + length * at.tangent[:-1] * D
            p = mark if hit else at.p + length * rate
            found = self._correct(x, p, normal, D, past)
            if found is not None:
                off = np.append((found.x - x) / D, (found.p - p) / self.p_scale)
                stray = float(np.linalg.norm(off)) / length
                if stray <= STRAY:
                    self.length = length
                    tangent = np.append(
                        found.tangent[:-1] * D / self.scale(found.x), found.tangent[-1]
                    )
                    grow = min(
                        s.wanted_iterations / found.iterations, STRAY / 2.0 / max(stray, EPS)
                    )
                    step = (h if hit else length) * float(np.clip(grow, 0.5, 2.0))
                    return replace(
                        found,
                        tangent=tangent / np.linalg.norm(tangent),
                        step=min(step, s.largest_step),
                    )
            h = 0.5 * min(h, length)
        return None

    def scale(self, x: FloatArray) -> FloatArray:
        """Sizes of the unknowns.

        The largest coefficient of the motion is one, so is the mean displacement. The damper's
        state and the slips are measured by the motion of the faces, and all of either together.

        Parameters
        ----------
        x : (u,) ndarray

        Returns
        -------
        (u,) ndarray
        """
        e = self.equations
        q, rigid, _ = e.split(x)
        still = float(np.abs(q[0]).max(initial=0.0))
        # samples are solved to a share of their forces: a motion smaller than that, as the
        # tolerance magnifies it, is not resolved to its own size
        least = np.abs(e.drive @ e.model.places.T / e.model.omega**2).max()
        least = max(float(least), SOLVED / self.settings.tolerance * still)
        moving = max(float(np.abs(q[1:]).max()), least)
        size = np.full(q.shape, moving)
        size[0] = max(moving, still)
        face = max(float(np.abs(e.model.shapes @ q[1:].T).max()), least * e.largest)
        reach = np.abs(e.model.columns).max(axis=0)
        damper = np.tile(face * rigid.size**0.5 / reach, 3)
        return np.concatenate(
            [
                size.ravel(),
                damper,
                np.full(len(e.tangents), face * (2.0 * e.model.n) ** 0.5),
            ]
        )

    def _widened(self, at: InterfacePlace, moving: NDArray[np.bool_]) -> InterfacePlace:
        """The same place with more unknowns."""
        e = self.equations
        q, rigid, slip = e.split(at.x)
        told = e.let_move(moving)
        x = e.joined(q, rigid, slip)
        tangent = np.zeros(len(x) + 1)
        tangent[told], tangent[-1] = at.tangent[:-1], at.tangent[-1]
        return replace(at, x=x, tangent=tangent)

    def _first(self, f: float) -> InterfacePlace | None:
        """The load raised from rest in steps as long as Newton's method takes them.

        A start that moves is marched in time.
        """
        e = self.equations
        moves = bool(e.start.v.any())
        found = self._jump(f) if moves else self._raised(f) or self._jump(f)
        if found is not None:
            self.places.append(self._kept(found))
        return found

    def _raised(self, f: float) -> InterfacePlace | None:
        """The answer by raising the load from rest."""
        e, load, step, found = self.equations, 0.0, 1.0, None
        q = np.zeros(e.shape)
        q[0] = e.start.q
        rigid = np.zeros((3, len(e.model.load)))
        rigid[0] = e.start.s
        slip, whole = e.slip.copy(), e.drive
        try:
            while load < 1.0:
                trial = min(load + step, 1.0)
                e.drive = trial * whole
                e.forget()
                found = self._at_frequency(e.joined(q, rigid, slip), f)
                if found is None:
                    step = 0.5 * (trial - load)
                    if step < LEAST_LOAD:
                        return None
                    continue
                (q, rigid, slip), load = e.split(found.x), trial
                step *= 2.0 if found.iterations <= self.settings.wanted_iterations else 1.0
        finally:
            e.drive = whole
            e.forget()
        return found
