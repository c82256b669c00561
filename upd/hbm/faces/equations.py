r"""Equations of the balance of blades in frequency with contact and damper in time.

Unknowns are the harmonics 0 to H of the blades' modes q(t), coefficients as in
`upd.hbm.core.fourier`, the damper's state and the slips before the period. Under q(t) one period of
contact and damper is integrated (`upd.hbm.faces.kept`): this gives the forces f at N samples and
the state after it:

    (omega^2 - (k w)^2 + 2 i zeta omega k w) q_k = (Phi' f)_k + P F_k,      state after = before.

The slips of nodes that stick all the period are no unknowns of it: they stay as they are, and the
answer depends on them as that of a march depends on its past.

Between the samples the blades move by their harmonics, so there is no time step in them; the damper
has the march's. The forces' coefficients are sums over the samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_solve

from upd.errors import ConvergenceError, InputError
from upd.hbm.core.fourier import analysis, harmonics, synthesis
from upd.hbm.faces.kept import given_blades, kept_inverses
from upd.hbm.faces.march import Fallback
from upd.hbm.faces.state import FloatArray, InterfaceModel, InterfaceState, factored, in_columns
from upd.hbm.faces.step import STICK, judge
from upd.linalg.parallel import SideBySide

IntArray = NDArray[np.int64]


@dataclass
class ContactPeriod:
    """Contact and damper over one period under given motion of the blades.

    Attributes
    ----------
    force, relative : (N, 3 n) ndarray
        Contact forces [N]; minus gaps, and slips of each step [mm].
    state : (N, n) ndarray of int
        0 open, 1 stick, 2 slip.
    modal : (N, m) ndarray
        Modal forces of the contact.
    rigid : (3, r) ndarray
        Damper's motion, velocity and acceleration after the period, time in steps.
    slip : (2 n,) ndarray
        Slips after it [mm].
    q : (h, m) ndarray
        Coefficients of the blades' modes it is given.
    rigid_before, slip_before : (3, r), (2 n,) ndarray
        As `rigid` and `slip`, before the period.
    w : float
        rad/s.
    """

    force: FloatArray
    relative: FloatArray
    state: IntArray
    modal: FloatArray
    rigid: FloatArray
    slip: FloatArray
    q: FloatArray
    rigid_before: FloatArray
    slip_before: FloatArray
    w: float

    @property
    def moving(self) -> NDArray[np.bool_]:
        """(n,) whether a node slips or is open in the period."""
        return np.asarray((self.state != STICK).any(axis=0))


@dataclass(frozen=True)
class Step:
    """What all samples of a frequency share.

    Attributes
    ----------
    J, dJ : (r, r) ndarray
        dt^2 M_D^-1, and its derivative by the frequency in rad/s.
    W : (3 n, 3 n) ndarray
        Inverse of the step's compliance [N/mm].
    Z : (3 n, m + r + L) ndarray
        W (Phi, B, E).
    rho_n, rho_t : (n,) ndarray
        Weights of displacements against forces [N/mm].
    """

    J: FloatArray
    dJ: FloatArray
    W: FloatArray
    Z: FloatArray
    rho_n: FloatArray
    rho_t: FloatArray


class InterfaceEquations:
    """The balance at any frequency.

    The unknowns x are the (2 H + 1) m coefficients harmonic by harmonic, the damper's 3 r, and the
    slips of the nodes that may move, first tangents, then second ones.

    Parameters
    ----------
    model : InterfaceModel
    drive : (L,) or (L, K) array_like
        Complex amplitudes on the whole at each place, of the first or of harmonics 1 to K [N].
    start : InterfaceState
        Whose slips the nodes have that never move.
    highest : int
        Harmonics H of the blades.
    samples : int
    fallback : callable, optional
        Solves a sample where Newton's method cycles, as in `upd.hbm.faces.march`.

    Raises
    ------
    InputError
        For harmonics that the samples cannot carry, or a drive of more harmonics.
    ConvergenceError
        When the compliance of the faces is not positive definite.
    """

    def __init__(
        self,
        model: InterfaceModel,
        drive: ArrayLike,
        start: InterfaceState,
        highest: int,
        samples: int,
        fallback: Fallback | None = None,
    ) -> None:
        amplitude = in_columns(drive)
        if highest < 1 or samples <= 2 * highest:
            raise InputError(
                f"interface balance: {samples} samples cannot carry {highest} harmonics; take one "
                "harmonic or more, and more than twice as many samples"
            )
        if amplitude.shape[1] > highest:
            raise InputError(
                f"interface balance: the excitation has {amplitude.shape[1]} harmonics, the blades "
                f"{highest}; take as many for the blades"
            )
        self.model, self.samples, self.highest, self.fallback = model, samples, highest, fallback
        self.start = start
        #: what is independent runs on its threads
        self.beside = SideBySide()
        basis = harmonics(range(highest + 1))
        #: samples are at the ends of the steps
        self.E = np.roll(synthesis(basis, samples), -1, axis=0)
        self.Q = np.roll(analysis(basis, samples), -1, axis=1)
        #: coefficients of the excitation (h, L)
        self.drive = np.zeros((basis.size, len(amplitude)))
        top = 1 + 2 * amplitude.shape[1]
        self.drive[1:top:2] = amplitude.real.T / model.copies
        self.drive[2:top:2] = -amplitude.imag.T / model.copies
        #: harmonic of each coefficient, and the column of its partner with the sign of d/d theta
        self.order = np.repeat(np.arange(highest + 1), 2)[1:]
        self.mobile = np.zeros(model.n, bool)
        self.slip = start.slip.copy()
        #: guess of every sample
        self.known: ContactPeriod | None = None
        #: inverses of the samples' matrices, and for which states
        self.kept = kept_inverses(samples, model.n)
        self._at: tuple[FloatArray, float] | None = None
        self._step: tuple[float, Step] | None = None
        factor = factored(model.compliance, "interface balance: the compliance of the faces")
        self.inverse = cho_solve(factor, np.eye(3 * model.n))
        self.moves = np.hstack([model.shapes, model.columns, model.pushed])
        self.by_moves = cho_solve(factor, self.moves)
        m, r = len(model.frequency), len(model.load)
        self.rigid = slice(m, m + r)
        self.damper = model.columns.T @ self.by_moves

    @property
    def shape(self) -> tuple[int, int]:
        """(2 H + 1, m)."""
        return 2 * self.highest + 1, len(self.model.frequency)

    @property
    def tangents(self) -> IntArray:
        """Dofs of the slips among the unknowns."""
        on = np.flatnonzero(self.mobile)
        return np.asarray(np.concatenate([self.model.n + on, 2 * self.model.n + on]))

    def let_move(self, more: NDArray[np.bool_]) -> IntArray:
        """Take more nodes' slips among the unknowns, with the values they have.

        Parameters
        ----------
        more : (n,) ndarray of bool

        Returns
        -------
        (u,) ndarray of int
            Where the unknowns so far stand among the new ones.
        """
        before = self.mobile
        self.mobile = before | more
        return self.places_of(before)

    @property
    def others(self) -> int:
        """Unknowns that are no slips."""
        h, m = self.shape
        return h * m + 3 * len(self.model.load)

    def places_of(self, mobile: NDArray[np.bool_]) -> IntArray:
        """Where the unknowns stood with fewer nodes that may move.

        Parameters
        ----------
        mobile : (n,) ndarray of bool

        Returns
        -------
        (u,) ndarray of int
            Their places among the unknowns.
        """
        on, n = np.flatnonzero(mobile), self.model.n
        before = np.concatenate([n + on, 2 * n + on])
        slips = self.others + np.searchsorted(self.tangents, before)
        return np.concatenate([np.arange(self.others), slips])

    def widened(self, values: FloatArray, rows: IntArray, more: float | None = None) -> FloatArray:
        """Values of the unknowns so far among those with more nodes that may move.

        Parameters
        ----------
        values : (u,) ndarray
        rows : (u,) ndarray of int
            Their places.
        more : float, optional
            Of the others; by itself the slips they have.

        Returns
        -------
        ndarray
        """
        out = np.empty(self.others + len(self.tangents))
        out[self.others :] = self.slip[self.tangents - self.model.n] if more is None else more
        out[rows] = values
        return out

    def joined(self, q: FloatArray, rigid: FloatArray, slip: FloatArray) -> FloatArray:
        """Unknowns of coefficients (h, m), the damper's state (3, r) and all slips (2 n,)."""
        return np.concatenate([q.ravel(), rigid.ravel(), slip[self.tangents - self.model.n]])

    def split(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Coefficients (h, m), the damper's state (3, r), and all slips (2 n,), of the unknowns."""
        h, m = self.shape
        r = len(self.model.load)
        slip = self.slip.copy()
        slip[self.tangents - self.model.n] = x[h * m + 3 * r :]
        return x[: h * m].reshape(h, m), x[h * m : h * m + 3 * r].reshape(3, r), slip

    def turned(self, q: FloatArray, by: FloatArray | IntArray) -> FloatArray:
        """Coefficients (h, ...) of the derivative by the angle, each harmonic k times its `by`.

        With by = k that is the derivative; a cos + b sin becomes b cos - a sin.

        Parameters
        ----------
        q : (h, ...) ndarray
        by : (h,) ndarray

        Returns
        -------
        ndarray
        """
        out = np.zeros_like(q)
        out[1::2], out[2::2] = q[2::2], -q[1::2]
        return np.asarray(out * np.asarray(by).reshape(-1, *[1] * (q.ndim - 1)))

    def forget(self) -> None:
        """Take the period of the last unknowns for another, as after a change of the drive."""
        self._at = None

    def step(self, w: float) -> Step:
        """What the samples share at a frequency.

        W = (G + B J B'/2)^-1 of the inverse of G, r rows at a time (Woodbury):
        W = G^-1 - G^-1 B (2 J^-1 + B' G^-1 B)^-1 B' G^-1.

        Parameters
        ----------
        w : float
            rad/s.

        Returns
        -------
        Step
        """
        if self._step is not None and self._step[0] == w:
            return self._step[1]
        model = self.model
        dt = 2.0 * np.pi / (w * self.samples)
        J = np.asarray(dt**2 * np.linalg.inv(model.mass), float)
        by_rigid = self.by_moves[:, self.rigid]
        core = 2.0 / dt**2 * model.mass + self.damper[:, self.rigid]
        core = np.asarray(np.linalg.inv(0.5 * (core + core.T)), float)
        W = self.inverse - (by_rigid @ core) @ by_rigid.T
        Z = self.by_moves - by_rigid @ (core @ self.damper)
        half = 0.5 * np.einsum("di,ij,dj->d", model.columns, J, model.columns)
        diagonal = (np.diagonal(model.compliance) + half).reshape(3, model.n)
        made = Step(
            J,
            -2.0 / w * J,
            W,
            np.ascontiguousarray(Z),
            1.0 / diagonal[0],
            2.0 / (diagonal[1] + diagonal[2]),
        )
        self._step = (w, made)
        return made

    def march(self, x: FloatArray, w: float) -> ContactPeriod:
        """Contact and damper over one period from the state among the unknowns.

        Parameters
        ----------
        x : (u,) ndarray
            Unknowns.
        w : float
            rad/s.

        Returns
        -------
        ContactPeriod

        Raises
        ------
        ConvergenceError
            When a sample has no answer that any of the solvers finds.
        """
        if self._at is not None and self._at[1] == w and np.array_equal(self._at[0], x):
            assert self.known is not None
            return self.known
        found = self.march_from(*self.split(x), w)
        self.known, self._at = found, (x.copy(), w)
        return found

    def march_from(
        self, q: FloatArray, rigid: FloatArray, slip: FloatArray, w: float
    ) -> ContactPeriod:
        """The same from coefficients (h, m), the damper's state (3, r) and all slips (2 n,)."""
        model, n, N = self.model, self.model.n, self.samples
        step = self.step(w)
        m, r = len(model.frequency), len(model.load)
        motion = np.hstack([q, self.drive])
        carried = np.delete(step.Z, range(m, m + r), axis=1)
        pushes = np.ascontiguousarray(-(self.E @ motion) @ carried.T)
        c = -(step.W @ np.concatenate([model.gap, slip]))
        known = self.known
        if known is None:
            F, Y = np.tile(self.start.f, (N, 1)), np.zeros((N, 3 * n))
            S = np.tile(self.start.state, (N, 1))
        else:
            F, Y, S = known.force.copy(), known.relative.copy(), known.state.copy()
        end, x0 = rigid.copy(), np.zeros(3 * n)
        done, given = 0, False
        rigid_rows = np.ascontiguousarray(step.Z[:, m : m + r].T)
        parts = (rigid_rows, step.W, model.columns, step.J)
        law, past = (model.friction, step.rho_n, step.rho_t), (F, Y, S, *self.kept)
        while True:
            done = given_blades(
                done, given, known is not None, pushes, parts, law, model.load, end, c, past, x0
            )
            if done == N:
                break
            given = True
            self._by_the_slow_way(x0, step, w, F[done], Y[done], S[done])
        after = slip + Y[:, n:].sum(axis=0)
        modal = F @ model.shapes
        return ContactPeriod(F, Y, S, modal, end, after, q, rigid, slip, w)

    def stiffness(self, w: float) -> tuple[FloatArray, FloatArray]:
        """Of each coefficient and mode at w rad/s: by itself, and by its turned partner (h, m)."""
        kw, model = self.order[:, None] * w, self.model
        return model.omega**2 - kw**2, 2.0 * model.damping * model.omega * kw

    def misfit(self, period: ContactPeriod) -> FloatArray:
        """What the balance of the blades lacks, (h, m) modal forces."""
        alpha, beta = self.stiffness(period.w)
        q = period.q
        pushed = self.Q @ period.modal + self.drive @ self.model.places.T
        return np.asarray(alpha * q + beta * self.turned(q, np.ones(len(q))) - pushed)

    def state(self, period: ContactPeriod) -> InterfaceState:
        """The state of a march at the beginning of a periodic motion's period."""
        q, rigid, w = period.q, period.rigid_before, period.w
        dt = 2.0 * np.pi / (w * self.samples)
        # the last sample is the beginning
        row = self.E[-1]
        return InterfaceState(
            row @ q,
            w * row @ self.turned(q, self.order),
            period.modal[-1] + self.model.places @ (row @ self.drive),
            rigid[0].copy(),
            rigid[1] / dt,
            rigid[2] / dt**2,
            period.force[-1].copy(),
            period.relative[-1].copy(),
            period.slip_before.copy(),
            period.state[-1].copy(),
            self.start.held.copy(),
        )

    def _by_the_slow_way(
        self, x0: FloatArray, step: Step, w: float, f: FloatArray, y: FloatArray, state: IntArray
    ) -> None:
        """A sample that Newton's method did not solve: f, y and state overwritten."""
        model, found = self.model, None
        A = model.compliance + 0.5 * model.columns @ step.J @ model.columns.T
        if self.fallback is not None:
            found = self.fallback(A, model.friction, A @ x0)
        if found is None:
            raise ConvergenceError(
                f"interface balance: a sample at {w / (2.0 * np.pi):g} Hz has no answer that "
                "Newton's method or the solver behind it finds: take more samples a period, or "
                "less friction"
            )
        f[:], y[:] = found
        judge(f, y, model.friction, step.rho_n, step.rho_t, state)
