"""The curve over frequency: blades in frequency, contact by whole faces and damper in time.

Arc length follows the curve (`upd.hbm.continuation`) over all unknowns of the equations in
`upd.hbm.interface_equations`. A node's slips are taken among them from the first time it moves; the
nodes that never move keep those of the start, so that the curve has a past as a sweep has one.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import ConvergenceError, InputError
from upd.hbm.continuation import Settings
from upd.hbm.interface_equations import ADDS_UP, ContactPeriod, InterfaceEquations, StrangerMoves
from upd.hbm.interface_march import (
    EPS,
    ComplexArray,
    Fallback,
    FloatArray,
    InterfaceMarch,
    InterfaceModel,
    InterfaceState,
)
from upd.hbm.interface_step import OPEN, SLIP, STICK
from upd.hbm.interface_sweep import settle
from upd.hbm.residuals import FREQUENCY_SHARE

#: of the Newton corrections over the sizes of the unknowns; the samples are solved to 1e-11 of the
#: forces
TOLERANCE = 1e-6
#: tolerances to which a motion is marched before the balance is tried on it
MARCHED = (1e-2, 1e-3)
MOST_PERIODS = 2000
#: difference of the blades' motions, relative, up to which balance and march are the same motion
SAME = 0.1
#: step, over the size of the solution, with which a fold is approached: what its top may be off
NEAR_FOLD = 0.005
#: how far the corrector may move from the predicted point, in steps
STRAY = 0.5
#: shortest step of the load on the way from rest to the first frequency's answer
LEAST_LOAD = 1.0 / 1024.0


@dataclass(frozen=True)
class InterfaceResponse:
    """Periodic motions along a curve, in its order.

    Attributes
    ----------
    frequency : (k,) ndarray
        Hz; at folds it turns round.
    amplitude : (k, H + 1, K) ndarray
        Complex harmonics 0 to H of each output [mm].
    share : (k, 3) ndarray
        Of nodes and samples that are open, stick, slip.
    truncation : (k,) ndarray
        Share of the modal contact forces' variation that harmonics above H hold.
    energy : (k, 3) ndarray
        In a period, of the whole: work of the excitation, lost by damping, lost by friction
        [N mm]. The last is that of the samples' slips under the mean of the forces at the steps'
        ends, so that they close with the square of the step.
    iterations : (k,) ndarray of int
        Newton iterations.
    unknown, slip : list of ndarray
        Coefficients (2 H + 1, m) and the damper's state (3, r) with time in steps; all slips
        (2 n,) [mm].
    seconds : float
        Wall time.
    status : {"complete", "stopped", "step limit"}
    message : str
        One sentence.
    equations : InterfaceEquations
        What was solved.
    """

    frequency: FloatArray
    amplitude: ComplexArray
    share: FloatArray
    truncation: FloatArray
    energy: FloatArray
    iterations: NDArray[np.int64]
    unknown: list[tuple[FloatArray, FloatArray]]
    slip: list[FloatArray]
    seconds: float
    status: str
    message: str
    equations: InterfaceEquations

    @property
    def arrived(self) -> bool:
        """Whether the curve reaches the last frequency."""
        return self.status == "complete"

    def state_at(self, i: int) -> InterfaceState:
        """The state at the beginning of a period, from which a march can start.

        Parameters
        ----------
        i : int
            Point of the curve.

        Returns
        -------
        InterfaceState
        """
        q, rigid = self.unknown[i]
        return self.equations.state(q, rigid, self.slip[i], 2.0 * np.pi * float(self.frequency[i]))


@dataclass
class _Point:
    """A point of the curve, and what is measured on it."""

    frequency: float
    q: FloatArray
    rigid: FloatArray
    slip: FloatArray
    amplitude: ComplexArray
    share: FloatArray
    truncation: float
    energy: FloatArray
    iterations: int


def interface_response(
    model: InterfaceModel,
    frequencies: ArrayLike,
    drive: ArrayLike,
    start: InterfaceState,
    *,
    harmonics: int = 3,
    samples: int = 128,
    settings: Settings | None = None,
    fallback: Fallback | None = None,
) -> InterfaceResponse:
    """Follow the curve from the first to the last frequency, through all of them.

    At the first one the load is raised from rest.

    Parameters
    ----------
    model : InterfaceModel
    frequencies : (k,) array_like
        Hz, rising or falling.
    drive : (L,) or (L, K) array_like
        Complex amplitudes on the whole at each place, of the first or of harmonics 1 to K [N];
        -1j F is F sin(2 pi f t).
    start : InterfaceState
        At rest, or with the slips of an earlier motion.
    harmonics : int
        Harmonics H of the blades' motion.
    samples : int
        In a period.
    settings : Settings, optional
        Step control of the continuation.
    fallback : callable, optional
        As for `upd.hbm.interface_march.InterfaceMarch`.

    Returns
    -------
    InterfaceResponse

    Raises
    ------
    InputError
        For frequencies that are not positive and in order, or harmonics that the samples cannot
        carry.
    """
    clock = time.perf_counter()
    f = np.asarray(frequencies, float)
    if f.ndim != 1 or not f.size or not (f > 0.0).all() or not _in_order(f):
        raise InputError(
            "interface balance: frequencies must be a rising or falling list of positive numbers, "
            "in Hz"
        )
    s = settings or replace(Settings(), tolerance=TOLERANCE)
    equations = InterfaceEquations(model, drive, start, harmonics, samples, fallback)
    curve = _Curve(equations, drive, s, float(np.mean(f)))
    status, message = curve.follow(f)
    points = curve.points
    k, K = len(points), len(model.seen_modes)
    return InterfaceResponse(
        np.array([p.frequency for p in points]),
        np.array([p.amplitude for p in points]).reshape(k, harmonics + 1, K),
        np.array([p.share for p in points]).reshape(k, 3),
        np.array([p.truncation for p in points]),
        np.array([p.energy for p in points]).reshape(k, 3),
        np.array([p.iterations for p in points], int),
        [(p.q, p.rigid) for p in points],
        [p.slip for p in points],
        time.perf_counter() - clock,
        status,
        message,
        equations,
    )


def _in_order(f: FloatArray) -> bool:
    steps = np.diff(f)
    return bool((steps > 0.0).all() or (steps < 0.0).all())


@dataclass(frozen=True)
class _Place:
    """Where a curve stands: a solved point, the scaled tangent onwards, and the next step."""

    x: FloatArray
    p: float
    tangent: FloatArray
    step: float
    iterations: int


class _Curve:
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
        self.points: list[_Point] = []
        self.jumps: list[float] = []
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
        missed = [] if at is not None else [float(f[0])]
        while at is None or (f[-1] - at.p) * way > 0.0:
            if len(self.points) >= self.settings.most_points:
                return "step limit", (
                    f"{len(self.points)} points used before {f[-1]:.9g} Hz{self._told(missed)}"
                )
            if at is not None:
                try:
                    found = self._advance(at, f)
                except StrangerMoves as more:
                    at = self._widened(at, more.moving)
                    continue
                if found is not None and float(found.tangent[-1]) * way > 0.0:
                    at = found
                    self._keep(at.x, at.p, at.iterations)
                    continue
                if found is not None and at.step > NEAR_FOLD:
                    at = replace(at, step=0.5 * min(at.step, self.length))
                    continue
            # a fold, or a place from which no step leads on: a motion must jump there
            passed = max([p * way for p in missed] + [one.frequency * way for one in self.points])
            ahead = f[f * way > passed]
            if not len(ahead):
                break
            at = self._jump(float(ahead[0]))
            if at is None:
                missed.append(float(ahead[0]))
            else:
                self.jumps.append(at.p)
                self._keep(at.x, at.p, at.iterations)
                at = self._begin(at, way)
        if missed and missed[-1] == f[-1]:
            return "stopped", (
                f"no periodic motion found at {f[-1]:.9g} Hz{self._told(missed)}; march there, or "
                "take more samples"
            )
        return (
            "complete",
            f"reached {f[-1]:.9g} Hz in {len(self.points)} points{self._told(missed)}",
        )

    def _told(self, missed: list[float]) -> str:
        """Where it jumped, and where nothing was found."""
        told = [
            (self.jumps, "after a jump, found by time march, at"),
            (missed, "no periodic motion found at"),
        ]
        parts = [f"; {words} {', '.join(f'{p:.6g}' for p in at)} Hz" for at, words in told if at]
        return "".join(parts)

    def _jump(self, f: float) -> _Place | None:
        """March in time from the last point until the balance finds the motion marched.

        Parameters
        ----------
        f : float
            Hz.

        Returns
        -------
        _Place or None
            None where the march does not settle, or the balance finds another motion.
        """
        e = self.equations
        march = InterfaceMarch(self.modes, f, self.drive, e.samples, e.fallback)
        for tolerance in MARCHED:
            try:
                settle(march, self.moving, tolerance, MOST_PERIODS)
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
        return None

    def _at_frequency(self, x: FloatArray, f: float) -> _Place | None:
        """Newton's method at a frequency, with as many unknowns as it takes."""
        e = self.equations
        while True:
            normal = np.zeros(len(x) + 1)
            normal[-1] = 1.0
            try:
                return self._correct(x, f, normal, self.scale(x), e.split(x)[2])
            except StrangerMoves as more:
                q, rigid, slip = e.split(x)
                e.let_move(more.moving)
                x = e.joined(q, rigid, slip)

    def _begin(self, at: _Place, way: float) -> _Place:
        """The place with its tangent in the direction of travel, and the first step."""
        tangent = at.tangent * np.sign(at.tangent[-1]) * way
        return replace(at, tangent=tangent, step=self.settings.first_step)

    def _correct(
        self, x: FloatArray, p: float, normal: FloatArray, D: FloatArray, past: FloatArray
    ) -> _Place | None:
        """Newton's method in the plane across `normal` through a point; None where it fails.

        The steps are whole ones. A node that has left the place of its past to come to the verge of
        slipping, and is sent back beyond that place, stays there.

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
        e, s, u = self.equations, self.settings, len(x)
        first, A = u - len(e.tangents), np.empty((u + 1, u + 1))
        before = past[e.tangents - e.model.n].reshape(2, -1)
        for count in range(1, s.iterations + 1):
            try:
                r, J, by_w, period = e.evaluate(x, 2.0 * np.pi * p, True, past)
            except ConvergenceError:
                return None
            assert J is not None
            np.multiply(J, D, out=A[:u, :u])
            A[:u, u] = 2.0 * np.pi * by_w * self.p_scale
            A[u] = normal
            if not np.isfinite(A).all():
                return None
            rows = np.abs(A[:u]).max(axis=1)
            A[:u] /= rows[:, None]
            right = np.zeros((u + 1, 2))
            right[:u, 0], right[u, 1] = -r / rows, 1.0
            try:
                step, tangent = np.linalg.solve(A, right).T
            except np.linalg.LinAlgError:
                return None
            size = float(np.abs(step).max()) * len(step) ** 0.5
            if not size < np.inf:
                return None
            slip = x[first:].reshape(2, -1)
            x, p = x + step[:-1] * D, p + float(step[-1]) * self.p_scale
            moved = x[first:].reshape(2, -1)
            way = np.where(
                slip != before,
                slip - before,
                period.slip[e.tangents - e.model.n].reshape(2, -1) - before,
            )
            cyclic = self._cyclic(period)[e.mobile]
            back = (((moved - before) * way).sum(axis=0) <= 0.0) & ~cyclic
            moved[:, back] = before[:, back]
            if size <= s.tolerance:
                return _Place(x, p, tangent / np.linalg.norm(tangent), 0.0, count)
        return None

    def _cyclic(self, period: ContactPeriod) -> NDArray[np.bool_]:
        """Nodes whose slips in the period take each other back."""
        n = self.equations.model.n
        dy = period.relative[:, n:].reshape(-1, 2, n)
        net, path = dy.sum(axis=0), np.hypot(dy[:, 0], dy[:, 1]).sum(axis=0)
        return np.asarray((path > 0.0) & (np.hypot(net[0], net[1]) <= ADDS_UP * path))

    def _advance(self, at: _Place, marks: FloatArray) -> _Place | None:
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
        least = np.abs(e.drive @ e.model.places.T / e.model.omega**2).max()
        moving = max(float(np.abs(q[1:]).max()), least)
        size = np.full(q.shape, moving)
        size[0] = max(moving, float(np.abs(q[0]).max()))
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

    def _widened(self, at: _Place, moving: NDArray[np.bool_]) -> _Place:
        """The same place with more unknowns."""
        e = self.equations
        q, rigid, slip = e.split(at.x)
        told = e.let_move(moving)
        x = e.joined(q, rigid, slip)
        tangent = np.zeros(len(x) + 1)
        tangent[told], tangent[-1] = at.tangent[:-1], at.tangent[-1]
        return replace(at, x=x, tangent=tangent)

    def _first(self, f: float) -> _Place | None:
        """The load raised from rest in steps as long as Newton's method takes them.

        A start that moves is marched in time.
        """
        e = self.equations
        if e.start.v.any():
            found = self._jump(f)
        else:
            found = self._raised(f) or self._jump(f)
        if found is not None:
            self._keep(found.x, f, found.iterations)
        return found

    def _raised(self, f: float) -> _Place | None:
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

    def _keep(self, x: FloatArray, f: float, iterations: int) -> None:
        """Measure a point."""
        e = self.equations
        q, rigid, slip = e.split(x)
        period = e.march(x, 2.0 * np.pi * f)
        self.moving = e.state(q, rigid, slip, 2.0 * np.pi * f)
        modal = np.fft.rfft(period.modal, axis=0)[1:]
        whole = float(np.linalg.norm(modal))
        beyond = float(np.linalg.norm(modal[e.highest :]))
        self.points.append(
            _Point(
                f,
                q,
                rigid,
                slip,
                _outputs(e, q, period),
                np.array([(period.state == one).mean() for one in (OPEN, STICK, SLIP)]),
                beyond / whole if whole > 0.0 else 0.0,
                _energy(e, q, period, 2.0 * np.pi * f),
                iterations,
            )
        )


def _outputs(e: InterfaceEquations, q: FloatArray, period: ContactPeriod) -> ComplexArray:
    """(H + 1, K) harmonics of the outputs."""
    model = e.model
    real = q @ model.seen_modes.T + e.Q @ (period.force @ model.seen_contact.T)
    real = real + e.drive @ model.seen_drive.T
    out = np.zeros((e.highest + 1, real.shape[1]), complex)
    out[0] = real[0]
    out[1:] = real[1::2] - 1j * real[2::2]
    return out


def _energy(e: InterfaceEquations, q: FloatArray, period: ContactPeriod, w: float) -> FloatArray:
    """Work of the excitation, lost by damping and by friction, of the whole [N mm]."""
    model, share = e.model, 2.0 * np.pi / e.samples
    F, rate = e.E @ e.drive, e.E @ e.turned(e.drive, e.order)
    v = e.E @ e.turned(q, e.order)
    # the places also move with the contact forces: F d(E'f) = d(F E'f) - E'f dF
    into = share * (np.sum(F * (v @ model.places)) - np.sum(rate * (period.force @ model.pushed)))
    damped = share * w * float(np.sum(2.0 * model.damping * model.omega * v**2))
    mean = 0.5 * (period.force + np.roll(period.force, 1, axis=0))
    rubbed = float(np.sum((mean * period.relative)[:, model.n :]))
    return model.copies * np.array([into, damped, rubbed])
