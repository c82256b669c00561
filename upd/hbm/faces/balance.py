"""The response over frequency: blades in frequency, contact by whole faces and damper in time.

The equations are those of `upd.hbm.faces.equations`. The walk goes by arc length over all unknowns,
with a corrector of its own, `upd.hbm.faces.corrector`: what sticks has a memory, so that the curve
depends on the way along it, and every sample of every node puts a kink into it. A node's slips are
taken among the unknowns from the first time it moves; nodes that never move keep the slips of the
start, so that up and down the frequencies the curve need not be the same. Where it folds, or no
step leads on, a motion whose frequency changes on must jump; the walk then marches in time at the
next frequency, as a sweep would, and continues from the motion found there.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import ConvergenceError, InputError
from upd.hbm.core.newton import Settings
from upd.hbm.faces.corrector import InterfaceCorrector, InterfacePlace
from upd.hbm.faces.equations import ContactPeriod, InterfaceEquations
from upd.hbm.faces.march import Fallback, InterfaceMarch
from upd.hbm.faces.state import EPS, ComplexArray, FloatArray, InterfaceModel, InterfaceState
from upd.hbm.faces.step import OPEN, SLIP, STICK
from upd.hbm.faces.sweep import settle
from upd.hbm.springs.sweep import FREQUENCY_SHARE
from upd.linalg.parallel import SideBySide
from upd.linalg.select import threads_used

#: of the Newton corrections over the sizes of the unknowns; the samples are solved to 1e-11 of the
#: forces
TOLERANCE = 1e-6
#: steps, over the size of the solution, below which none is tried: a jump is shorter than many
SHORTEST = 5e-4
#: shortest step of the load on the way from rest to the first frequency's answer
LEAST_LOAD = 1.0 / 64.0
#: tolerances to which a motion is integrated before the balance is tried on it
MARCHED = (1e-2, 1e-3)
MOST_PERIODS = 2000
#: difference of the blades' motions, relative, up to which balance and march are the same motion
SAME = 0.1
#: distance, over the size of the solution, from which a fold is not approached further: what its
#: top may be off
NEAR_FOLD = 0.005
#: share of a step beyond a fold that the next one may have at most, so that the approach ends
TURNED = 0.95
#: share of a step without an answer that is tried next; it weighs costs
FAILED = 0.25
#: how far the corrector may move from the predicted point, in steps
STRAY = 0.5


@dataclass(frozen=True)
class InterfaceResponse:
    """Periodic motions along a curve, in its order.

    Attributes
    ----------
    frequency : (k,) ndarray
        Hz, of the points solved: those asked for and others between.
    amplitude : (k, H + 1, K) ndarray
        Complex harmonics 0 to H of each output [mm].
    share : (k, 3) ndarray
        Of nodes and samples that are open, stick, slip.
    energy : (k, 3) ndarray
        In a period, of the whole: work of the excitation, lost by damping, lost by friction
        [N mm]. The last is that of the samples' slips under the mean of the forces at the steps'
        ends, so that they close with the square of the step.
    points : list of InterfacePoint
        The solutions.
    seconds : float
        Wall time.
    jumps : tuple of int
        Numbers of the points after which the motion jumped.
    missed : tuple of float
        Hz, of those asked for at which no periodic motion was found.
    status : {"complete", "stopped", "step limit"}
    message : str
        One sentence.
    equations : InterfaceEquations
        What was solved.
    """

    frequency: FloatArray
    amplitude: ComplexArray
    share: FloatArray
    energy: FloatArray
    points: list[InterfacePoint]
    seconds: float
    jumps: tuple[int, ...]
    missed: tuple[float, ...]
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
        one = self.points[i]
        w = 2.0 * np.pi * one.frequency
        return self.equations.state(self.equations.march_from(one.q, one.rigid, one.slip, w))


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
    workers: int | None = None,
) -> InterfaceResponse:
    """Follow the curve from the first to the last frequency, through all of them.

    At the first one the load is raised from rest; from a start that moves it is integrated in time.
    Where the curve folds the motion jumps, to what a march from there ends in.

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
        As for `upd.hbm.faces.march.InterfaceMarch`.
    workers : int, optional
        Threads; by default all that libraries may use. The answer is the same with any number.

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
    steps = np.diff(f.ravel())
    in_order = (steps > 0.0).all() or (steps < 0.0).all()
    if f.ndim != 1 or not f.size or not (f > 0.0).all() or not in_order:
        raise InputError(
            "interface balance: frequencies must be a rising or falling list of positive numbers, "
            "in Hz"
        )
    s = settings or replace(Settings(), tolerance=TOLERANCE, smallest_step=SHORTEST)
    with SideBySide(threads_used() if workers is None else workers) as beside:
        equations = InterfaceEquations(model, drive, start, harmonics, samples, fallback)
        equations.beside = beside
        curve = InterfaceCurve(equations, drive, s, float(np.mean(f)))
        status, message = curve.follow(f)
    points, outputs = curve.places, len(model.seen_modes)
    return InterfaceResponse(
        np.array([one.frequency for one in points]),
        np.array([one.amplitude for one in points]).reshape(-1, harmonics + 1, outputs),
        np.array([one.share for one in points]).reshape(-1, 3),
        np.array([one.energy for one in points]).reshape(-1, 3),
        points,
        time.perf_counter() - clock,
        tuple(curve.broken),
        tuple(curve.missed),
        status,
        message,
        equations,
    )


class InterfacePoint(NamedTuple):
    """A point of the curve.

    Attributes
    ----------
    frequency : float
        Hz.
    q : (2 H + 1, m) ndarray
        Coefficients of the blades' modes.
    rigid : (3, r) ndarray
        Damper's motion, velocity and acceleration before the period, time in steps.
    slip : (2 n,) ndarray
        Slips before the period [mm].
    amplitude : (H + 1, K) ndarray
        Complex harmonics 0 to H of the outputs [mm].
    share : (3,) ndarray
        Of nodes and samples that are open, stick, slip.
    energy : (3,) ndarray
        In a period, of the whole: work of the excitation, lost by damping, by friction [N mm].
    nodes : (n, 3) ndarray
        Shares of the period in which each node is open, sticks, slips.
    loss : (n,) ndarray
        By friction at each node in a period, of the whole [N mm].
    unresolved : float
        Motion of the faces by blades' harmonics above H over that by those up to H.
    """

    frequency: float
    q: FloatArray
    rigid: FloatArray
    slip: FloatArray
    amplitude: ComplexArray
    share: FloatArray
    energy: FloatArray
    nodes: FloatArray
    loss: FloatArray
    unresolved: float


def read_point(e: InterfaceEquations, period: ContactPeriod, frequency: float) -> InterfacePoint:
    """Read a point from its period; a period is large and is not kept.

    Parameters
    ----------
    e : InterfaceEquations
    period : ContactPeriod
        That of the unknowns.
    frequency : float
        Hz.

    Returns
    -------
    InterfacePoint
    """
    nodes = np.array([(period.state == code).mean(axis=0) for code in (OPEN, STICK, SLIP)]).T
    loss = _rubbed(e, period)
    return InterfacePoint(
        frequency,
        period.q,
        period.rigid_before,
        period.slip_before,
        _outputs(e, period),
        nodes.mean(axis=0),
        np.append(_energy(e, period), loss.sum()),
        nodes,
        loss,
        _unresolved(e, period),
    )


def _unresolved(e: InterfaceEquations, period: ContactPeriod) -> float:
    """What the contact forces' harmonics above H would move the faces by the blades' modes."""
    model, q, w = e.model, period.q, period.w
    modal = 2.0 / e.samples * np.fft.rfft(period.modal, axis=0)[e.highest + 1 :]
    kw = w * np.arange(e.highest + 1, e.highest + 1 + len(modal))[:, None]
    resistance = model.omega**2 - kw**2 + 2j * model.damping * model.omega * kw
    moved = float(np.linalg.norm(model.shapes @ q[1:].T))
    if moved == 0.0:
        return 0.0
    return float(np.linalg.norm(model.shapes @ (modal / resistance).T)) / moved


def _rubbed(e: InterfaceEquations, period: ContactPeriod) -> FloatArray:
    """Lost by friction at each node, of the whole [N mm]."""
    mean = 0.5 * (period.force + np.roll(period.force, 1, axis=0))
    lost = (mean * period.relative).sum(axis=0).reshape(3, -1)[1:].sum(axis=0)
    return np.asarray(e.model.copies * lost)


def _outputs(e: InterfaceEquations, period: ContactPeriod) -> ComplexArray:
    """(H + 1, K) harmonics of the outputs."""
    model = e.model
    real = period.q @ model.seen_modes.T + e.Q @ (period.force @ model.seen_contact.T)
    real = real + e.drive @ model.seen_drive.T
    out = np.zeros((e.highest + 1, real.shape[1]), complex)
    out[0] = real[0]
    out[1:] = real[1::2] - 1j * real[2::2]
    return out


def _energy(e: InterfaceEquations, period: ContactPeriod) -> FloatArray:
    """Work of the excitation and lost by damping, of the whole [N mm]."""
    model, q, w, share = e.model, period.q, period.w, 2.0 * np.pi / e.samples
    F, rate = e.E @ e.drive, e.E @ e.turned(e.drive, e.order)
    v = e.E @ e.turned(q, e.order)
    # the places also move with the contact forces: F d(E'f) = d(F E'f) - E'f dF
    into = share * (np.sum(F * (v @ model.places)) - np.sum(rate * (period.force @ model.pushed)))
    damped = share * w * float(np.sum(2.0 * model.damping * model.omega * v**2))
    return np.asarray(model.copies * np.array([into, damped]))


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
        self.corrector = InterfaceCorrector(equations, settings, self.p_scale)
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
        missed, first = self.missed, float(f[0])
        # a start that moves is integrated in time
        at = None if self.equations.start.v.any() else self._raised(first)
        at = at or self._jump(first)
        if at is None:
            missed.append(first)
        else:
            at = self._entered(at, way)
        while at is None or (f[-1] - at.p) * way > 0.0:
            if len(self.places) >= self.settings.most_points:
                return "step limit", (
                    f"{len(self.places)} points used before {f[-1]:.9g} Hz{self._told(missed)}"
                )
            if at is not None:
                found = self._advance(at, f)
                if found is not None and float(found.tangent[-1]) * way > 0.0:
                    at = found
                    self.places.append(self._kept(at))
                    continue
                if found is not None:
                    before, after = float(at.tangent[-1]), float(found.tangent[-1])
                    fold = self.length * before / (before - after)
                    if fold > NEAR_FOLD:
                        at = replace(at, step=min(fold - 0.5 * NEAR_FOLD, TURNED * self.length))
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
            at = self._entered(at, way)
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
        e = self.equations
        period = e.march(at.x, 2.0 * np.pi * at.p)
        self.moving = e.state(period)
        return read_point(e, period, at.p)

    def _told(self, missed: list[float]) -> str:
        """Where it jumped, and where nothing was found."""
        lists = [
            (self.jumps, "after a jump, found by time march, at"),
            (missed, "no periodic motion found at"),
        ]
        parts = [f"; {words} {', '.join(f'{p:.6g}' for p in at)} Hz" for at, words in lists if at]
        return "".join(parts)

    def _jump(self, f: float) -> InterfacePlace | None:
        """March in time from the last point until the balance finds that motion.

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
                settled = settle(march, self.moving, tolerance, MOST_PERIODS).settled
                moving = self.moving.copy()
                q = e.Q @ march.period(moving).output
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
        """Newton's method at a frequency."""
        return self.corrector.correct(
            x, f, self.corrector.across(1.0, x), self.corrector.scale(x), self.equations.split(x)[2]
        )

    def _entered(self, at: InterfacePlace, way: float) -> InterfacePlace:
        """A place kept, with its tangent in the direction of travel, and the first step."""
        self.places.append(self._kept(at))
        tangent = at.tangent * np.sign(at.tangent[-1]) * way
        return replace(at, tangent=tangent, step=self.settings.first_step)

    def _advance(self, at: InterfacePlace, marks: FloatArray) -> InterfacePlace | None:
        """One step; None when even the smallest fails.

        There is a kink wherever a sample of a node changes its state, and what sticks has a memory,
        so that neither turns of the tangent nor the sign of the determinant tell pieces of the
        curve apart. A step is good where the corrector ends near the point it started from.
        """
        s, h, at = self.settings, at.step, self.corrector.widened(at)
        past = self.equations.split(at.x)[2]
        while h >= s.smallest_step:
            D = self.corrector.scale(at.x)
            normal, length, rate = at.tangent, h, float(at.tangent[-1]) * self.p_scale
            ahead = marks[(marks - at.p) * np.sign(rate) > 4 * EPS * at.p]
            mark = float(ahead[np.abs(ahead - at.p).argmin()]) if len(ahead) else np.inf
            hit = abs(mark - at.p) <= h * abs(rate)
            if hit:
                length, normal = (mark - at.p) / rate, self.corrector.across(rate, at.x)
            x = at.x + length * at.tangent[:-1] * D
            p = mark if hit else at.p + length * rate
            found = self.corrector.correct(x, p, normal, D, past, at.known)
            at = self.corrector.widened(at)
            if found is not None:
                D = self.corrector.scale(at.x)
                x = at.x + length * at.tangent[:-1] * D
                off = np.append((found.x - x) / D, (found.p - p) / self.p_scale)
                stray = float(np.linalg.norm(off)) / length
                if stray <= STRAY and not hit and (found.p - mark) * rate > 0.0:
                    # the corrector has passed a frequency that is asked for
                    x = at.x + (mark - at.p) / (found.p - at.p) * (found.x - at.x)
                    normal = self.corrector.across(rate, at.x)
                    found = self.corrector.correct(x, mark, normal, D, past, found.known)
                    at = self.corrector.widened(at)
                if found is not None and stray <= STRAY:
                    D = self.corrector.scale(at.x)
                    self.length = length
                    tangent = np.append(
                        found.tangent[:-1] * D / self.corrector.scale(found.x), found.tangent[-1]
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
            # states that change to and fro ahead of a fold do so at half of the step as well
            h = (FAILED if found is None else 0.5) * min(h, length)
        return None

    def _raised(self, f: float) -> InterfacePlace | None:
        """The answer by raising the load from rest, as long as Newton's method takes the steps."""
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
