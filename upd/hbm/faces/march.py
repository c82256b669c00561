r"""Time march of two blades with an elastic damper between them, contact by whole faces.

The blades move in a few free-interface modes q; what the others add is static. The damper moves as
a rigid body s about its centre of mass and deforms quasi-statically under its contact forces and
its own inertia (inertia relief). With the forces f of all contact nodes (on the blades, normal and
two tangents each), the modes Phi and the rigid columns B at the nodes,

    q'' + 2 zeta omega q' + omega^2 q = Phi' f + P F(t),        M_D s'' = p - B' f,
    w = B s - G f - Phi q - E F(t),       G = C - Phi Lambda^-1 Phi',

where C is the static compliance of blades and damper, F the excitation, P the modes at its places,
E what the modes left out add there, and p the centrifugal force. The relative motion w follows
Signorini's and Coulomb's laws: gap g = h - w_n >= 0, f_n >= 0, g f_n = 0; |f_t| <= mu f_n, and the
slip dw_t of a step has the direction of f_t and is zero where |f_t| < mu f_n. There are no springs
between the faces, and no parameters but these.

A step of length dt. Between its ends the modes swing exactly, under the mean of the forces at both:
q_1 = q* + b Phi' f_1, q* known. A constant force does the work f (q_1 - q_0), so while nothing
slips or opens, forces do no work on the contact, and no step length feeds energy in (forces that
are straight within the step would: they make the linear-acceleration method, which rattles itself
up on stiff contact). What averaging and holding take from the lowest harmonic of the excitation,
the factor sin(x)/x, x = omega dt, is given back by dividing by it what the modal forces are beyond
those at rest, which is a change of modal mass and keeps that energy balance: static state and that
harmonic are exact. Modes that a step does not resolve are stepped implicitly, see
`upd.hbm.faces.march`, which lets them rest and follow exactly. The damper follows the WBZ-alpha
method with full damping at infinite frequency, 2 s''_1 - s''_0 = M_D^-1 (p - B' f_1), Newmark's
beta = 1 and gamma = 3/2, of second order, which damps the rattling of its mass on the faces that
the step does not resolve: s_1 = s* - dt^2/2 M_D^-1 B' f_1. Together

    w_1 = w* - A f_1,     A = G + Phi b Phi' + dt^2/2 B M_D^-1 B',

a contact problem with a symmetric positive definite compliance and without rigid motions; see
`upd.hbm.faces.step` for how it is solved. A node on a spring of its own that closes within the
step has slipped until it touched: `upd.hbm.faces.period.touch`.

References
----------
.. [1] R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., 17.5, 17.6
       (residual flexibility, inertia relief).
.. [2] W. L. Wood, M. Bossak, O. C. Zienkiewicz, Int. J. Numer. Methods Eng. 15 (1980) 1562.
.. [3] J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993) 371, its optimal WBZ-alpha.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_solve, expm

from upd.errors import ConvergenceError
from upd.hbm.faces.kept import kept_inverses
from upd.hbm.faces.period import Bases, Past, StepParts, march_steps
from upd.hbm.faces.state import FloatArray, InterfaceModel, InterfaceState, factored, in_columns
from upd.hbm.faces.step import OPEN, STICK, judge

#: steps in a period from which a mode is stepped exactly
RESOLVED = 4


def resolved(omega: FloatArray, dt: float) -> NDArray[np.bool_]:
    """Whether modes have `RESOLVED` steps or more in a period.

    Parameters
    ----------
    omega : (m,) ndarray
        rad/s.
    dt : float
        s.

    Returns
    -------
    (m,) ndarray of bool
    """
    return np.asarray(RESOLVED * omega * dt <= 2.0 * np.pi)


def modal_step(omega: FloatArray, damping: FloatArray, dt: float, scale: float) -> FloatArray:
    """A step of oscillators of mass 1, see the module.

    Under the mean of the forces the first of the steady response's harmonics comes out smaller by
    sin(x)/x, x = omega dt.

    Parameters
    ----------
    omega, damping : (m,) ndarray
        rad/s, ratio to critical.
    dt : float
        s.
    scale : float
        Of the forces on the modes that the steps resolve.

    Returns
    -------
    (8, m) ndarray
        q after by q, v, force before and after; v after by the same.
    """
    # x = (q, v dt), force dt^2: time in steps, so that all entries are alike
    a = np.asarray(omega * dt)
    A = np.zeros((len(a), 2, 2))
    A[:, 0, 1] = 1.0
    A[:, 1, 0], A[:, 1, 1] = -(a**2), -2.0 * damping * a
    by = np.where(resolved(omega, dt)[:, None, None], _held(A, scale), _implicit(A))
    units = np.array([[1.0, dt, dt**2, dt**2], [1.0 / dt, 1.0, dt, dt]])
    return np.ascontiguousarray((by * units).transpose(1, 2, 0).reshape(8, -1))


def _held(A: FloatArray, scale: float) -> FloatArray:
    """(m, 2, 4) x after by x, force before and after, exact under the mean of the forces."""
    E = np.zeros((len(A), 3, 3))
    E[:, :2, :2], E[:, 1, 2] = A, 1.0
    E = expm(E)
    half = 0.5 * scale * E[:, :2, 2:]
    return np.concatenate([E[:, :2, :2], half, half], axis=2)


def _implicit(A: FloatArray) -> FloatArray:
    """(m, 2, 4) the same by Lobatto IIIC."""
    one, half = np.eye(2), 0.5 * A
    stages = np.block([[one - half, half], [-half, one - half]])
    right = np.zeros((4, 4))
    right[:2, :2] = right[2:, :2] = one
    right[1, 2:], right[3, 2:] = (0.5, -0.5), (0.5, 0.5)
    return np.asarray(np.linalg.solve(stages, np.broadcast_to(right, stages.shape))[:, 2:])


#: nodes a sample that a new base must spare; making it costs what some thousand nodes do
PAYS = 0.25
#: bases held, and what they may take
MOST_BASES, BASES_BYTES = 8, 2**26
#: Compliance A (3 n, 3 n), friction (n,) and w* - w_ref (3 n,) to forces f and y = (-g, dw) with
#: w_ref + y = w* - A f, or None without an answer.
Fallback = Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray] | None]


def suit_bases(
    states: NDArray[np.int64], bases: NDArray[np.bool_], which: NDArray[np.int64]
) -> int:
    """For every sample the base that most of its nodes agree with.

    Parameters
    ----------
    states : (N, n) ndarray of int
        Of the period before.
    bases : (B, n) ndarray of bool
    which : (N,) ndarray of int
        Overwritten.

    Returns
    -------
    int
        Sample whose open nodes would make a base that pays, or -1.
    """
    open_ = (states == OPEN).astype(float)

    def apart(sets: FloatArray) -> FloatArray:
        """(N, k) nodes in which samples differ from k sets."""
        both = open_ @ sets.T
        return np.asarray(open_.sum(axis=1)[:, None] + sets.sum(axis=1) - 2.0 * both)

    nodes = apart(bases.astype(float))
    which[:], least = nodes.argmin(axis=1), nodes.min(axis=1)
    if least.sum() <= PAYS * len(states):
        return -1
    # what each set of open nodes would save as a base
    gain = np.maximum(least[:, None] - apart(open_), 0.0).sum(axis=0)
    best = int(gain.argmax())
    return best if gain[best] > PAYS * len(states) else -1


@dataclass(frozen=True)
class InterfacePeriod:
    """One period of a march.

    Attributes
    ----------
    output : (N, K) ndarray
        Outputs after each step [mm].
    counts : (3,) ndarray
        Share of open, sticking and slipping nodes, over nodes and samples.
    newton : float
        Newton steps a time step.
    energy : (3,) ndarray
        Work of the excitation, lost by damping, lost by friction, of the whole [N mm].
    fallbacks : int
        Steps that the slow solver had to finish.
    """

    output: FloatArray
    counts: FloatArray
    newton: float
    energy: FloatArray
    fallbacks: int


class InterfaceMarch:
    """The march at one frequency and number of samples: what all its steps share.

    Parameters
    ----------
    model : InterfaceModel
    frequency : float
        Hz.
    drive : (L, H) ndarray
        Complex amplitudes on the whole of harmonics 1 to H at each place [N]:
        F = sum_k Re(drive_k exp(i k 2 pi f t)).
    samples : int
        Steps in a period.
    fallback : callable, optional
        Solves a step where Newton's method cycles; see `Fallback`.
    like : InterfaceMarch, optional
        One at a frequency nearby, of whose last period the steps make use.
    """

    def __init__(
        self,
        model: InterfaceModel,
        frequency: float,
        drive: ArrayLike,
        samples: int,
        fallback: Fallback | None = None,
        like: InterfaceMarch | None = None,
    ) -> None:
        self.fallback = fallback
        self.model, self.frequency, self.samples = model, frequency, samples
        self.dt = 1.0 / (frequency * samples)
        amplitude = in_columns(drive)
        k = np.arange(1, amplitude.shape[1] + 1)
        # the harmonics of the excitation; without any the first is looked at
        self.orders = tuple(int(one) for one in k[np.any(amplitude != 0.0, axis=0)]) or (1,)
        theta = 2.0 * np.pi * np.arange(samples + 1) / samples
        wave = np.exp(1j * theta[:, None] * k) @ amplitude.T
        self.drive = np.ascontiguousarray(wave.real / model.copies)
        # sinc(x / pi) = sin(x) / x
        self.sinc = float(np.sinc(2.0 * self.orders[0] * frequency * self.dt))
        self.blades = modal_step(model.omega, model.damping, self.dt, 1.0 / self.sinc)
        self.inverse_mass = np.asarray(np.linalg.inv(model.mass), float)
        rigid = 0.5 * self.dt**2 * model.columns @ self.inverse_mass @ model.columns.T
        A = model.compliance + (model.shapes * self.blades[3]) @ model.shapes.T + rigid
        self.A = 0.5 * (A + A.T)
        factor = factored(self.A, "interface march: the compliance of the step")
        W = cho_solve(factor, np.eye(3 * model.n))
        self.W = np.ascontiguousarray(0.5 * (W + W.T))
        taken = [model.shapes, model.columns, model.seen_contact.T, model.pushed]
        self.taken = np.ascontiguousarray(np.hstack(taken))
        moves = np.hstack([model.columns, -model.shapes, -model.pushed])
        self.forces_by = np.ascontiguousarray((self.W @ moves).T)
        diagonal = np.diagonal(self.A).reshape(3, model.n)
        self.rho_n = 1.0 / diagonal[0]
        self.rho_t = 2.0 / (diagonal[1] + diagonal[2])
        n, alike = model.n, like is not None and like.samples == samples
        flat = partial(np.ascontiguousarray, dtype=float)
        held = np.where(resolved(model.omega, self.dt), self.sinc - 1.0, 0.0)
        self.steps = StepParts(
            self.dt,
            self.drive,
            self.blades,
            (2.0 * model.damping * model.omega, flat(model.places), held),
            self.taken,
            (flat(self.inverse_mass), flat(model.load)),
            flat(model.gap),
            (flat(model.friction), self.rho_n, self.rho_t),
            (flat(model.seen_modes), flat(model.seen_drive)),
            np.zeros(3 * n) if model.springs is None else flat(model.springs),
        )
        self.x0 = np.zeros(3 * n)
        self.known, self.which = False, np.zeros(samples, np.int64)
        self.bases: Bases
        if like is None or not alike or like.model.n != n:
            self.past = Past(
                np.empty((samples, 3 * n)),
                np.empty((samples, 3 * n)),
                np.zeros((samples, n), int),
                *kept_inverses(samples, n),
            )
            self.rebase(np.zeros(n, bool))
        else:
            self._hold(like.bases.open)
            self.which, self.past, self.known = like.which.copy(), like.past, like.known

    def rebase(self, open_: NDArray[np.bool_]) -> None:
        """Choose which nodes the steps take for open until they find otherwise.

        Any choice gives the same answers; the fewer nodes differ from it, the less they cost.

        Parameters
        ----------
        open_ : (n,) ndarray of bool
        """
        self._hold(open_[None].copy())
        self.which[:] = 0

    def _hold(self, bases: NDArray[np.bool_]) -> None:
        """Take these bases, (B, n)."""
        made = [self._pivoted(one) for one in bases]
        self.bases = Bases(
            bases.copy(), np.array([T for T, _ in made]), np.array([Z for _, Z in made])
        )

    def _pivoted(self, open_: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        """Transpose of T, and Z, of a base."""
        W, O = self.W, np.tile(open_, 3)
        if not open_.any():
            return W, self.forces_by
        o, c = np.flatnonzero(O), np.flatnonzero(~O)
        S = np.linalg.inv(W[np.ix_(o, o)])
        Woc = W[np.ix_(o, c)]
        up = S @ Woc
        Tt, Z = np.empty_like(W), np.empty_like(self.forces_by)
        Tt[np.ix_(c, c)] = W[np.ix_(c, c)] - Woc.T @ up
        # T is symmetric but for the sign of what couples closed and open
        Tt[np.ix_(o, c)], Tt[np.ix_(c, o)], Tt[np.ix_(o, o)] = -up, up.T, S
        Z[:, o] = self.forces_by[:, o] @ S
        Z[:, c] = self.forces_by[:, c] - self.forces_by[:, o] @ up
        return Tt, Z

    def period(self, at: InterfaceState) -> InterfacePeriod:
        """March one period; the state moves on.

        Parameters
        ----------
        at : InterfaceState
            Overwritten.

        Returns
        -------
        InterfacePeriod

        Raises
        ------
        ConvergenceError
            When a step has no answer that any of the solvers finds.
        """
        N, n, past = self.samples, self.model.n, self.past
        out, sums = np.zeros((N, len(self.model.seen_modes))), np.zeros(4)
        parts, motion, filled = tuple(self.steps), at.arrays(), (self.x0, out, sums)
        done, given, fallbacks = 0, False, 0
        while done < N:
            held = tuple(self.bases), self.which, motion, (self.known, *past)
            done = march_steps(done, given, parts, *held, filled)
            given = done < N
            if given:
                self.finish_step(done, at)
                fallbacks += 1
        self.known = True
        # for every sample the base that most of its nodes agree with; a new one where it pays
        best = suit_bases(past.state, self.bases.open, self.which)
        if best >= 0:
            self._add(past.state[best] == OPEN)
            suit_bases(past.state, self.bases.open, self.which)
        counts = np.array([(past.state == kind).sum() for kind in (OPEN, STICK)] + [0], float)
        counts[2] = n * N - counts.sum()
        energy = self.model.copies * sums[:3]
        return InterfacePeriod(out, counts / (n * N), float(sums[3]) / N, energy, fallbacks)

    def _add(self, open_: NDArray[np.bool_]) -> None:
        """Add a base; where there are as many as may be, in place of another if that pays.

        Parameters
        ----------
        open_ : (n,) ndarray of bool
        """
        bases, bytes_each = self.bases, self.W.nbytes
        most = max(2, min(MOST_BASES, BASES_BYTES // bytes_each))
        if len(bases.open) < most:
            Tt, Z = self._pivoted(open_)
            self.bases = Bases(
                np.append(bases.open, open_[None], 0),
                np.append(bases.Tt, Tt[None], 0),
                np.append(bases.Z, Z[None], 0),
            )
            return
        opens = self.past.state == OPEN
        nodes = np.array([(opens != one).sum(axis=1) for one in (*bases.open, open_)])
        with_ = [np.delete(nodes, k, axis=0).min(axis=0).sum() for k in range(len(bases.open))]
        k = int(np.argmin(with_))
        if with_[k] + PAYS * self.samples < nodes[:-1].min(axis=0).sum():
            bases.open[k] = open_
            bases.Tt[k], bases.Z[k] = self._pivoted(open_)

    def finish_step(self, sample: int, at: InterfaceState) -> None:
        """The step that Newton's method did not solve: forces into x0, the rest into `at`.

        Parameters
        ----------
        sample : int
            Before the step.
        at : InterfaceState
            Overwritten.

        Raises
        ------
        ConvergenceError
            When the solver behind has no answer, or there is none.
        """
        x0, base = self.x0, self.bases.open[self.which[sample]]
        found = None
        if self.fallback is not None:
            # x0 = L F undone
            O = np.tile(base, 3)
            F = np.where(O, 0.0, x0) + self.W[:, O] @ x0[O]
            found = self.fallback(self.A, self.model.friction, self.A @ F)
        if found is None:
            raise ConvergenceError(
                f"interface march: a step at {self.frequency:g} Hz has no answer that Newton's "
                "method or the solver behind it finds: take more samples a period, or less friction"
            )
        force, y = found
        x0[:], at.y[:] = force, y
        judge(x0, y, self.model.friction, self.rho_n, self.rho_t, at.state)
