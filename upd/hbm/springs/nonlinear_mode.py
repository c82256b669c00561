"""Damped nonlinear modes: frequency and damping of a mode over its amplitude.

The motion of a mode is made periodic by taking its damping away (extended periodic motion concept):

    M q'' + (C - xi M) q' + K q + B'f(w) = f_0,   xi = 2 zeta omega,

with the amplitude |q_1|_M = a of the fundamental harmonic given. In mass-normalised modes the term
is xi off the modal damping, so that the condensed balance serves as it is; omega and xi join its
unknowns, amplitude and phase its equations. The path goes over log a by arc length.

References
----------
M. Krack, Nonlinear modal analysis of nonconservative systems: extension of the periodic motion
concept, Computers and Structures 154 (2015) 59.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

from upd.errors import InputError
from upd.hbm.core.continuation import Path, follow
from upd.hbm.core.fourier import to_complex
from upd.hbm.core.newton import PathProblem, Settings
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.checks import measures
from upd.hbm.springs.jacobian import BalanceJacobian, LinearPart, real_part
from upd.hbm.springs.response import System, parabola
from upd.hbm.springs.sweep import FREQUENCY_SHARE, scale_of
from upd.labels import Shown
from upd.linalg.parallel import threads_for

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: halvings of the first amplitude in search of one at which the mode is found
HALVINGS = 40
#: share of the angle between tangents with which a path that stopped is taken up
SHORTER = 0.5
#: points of a forced response for each of the path
FINE = 50
#: peaks from which the best preload is read, and places at which it is sought
SEEN = 200


@dataclass(frozen=True, repr=False)
class NonlinearMode(Shown):
    """Frequency and damping of a mode over its amplitude: n points along the path.

    Attributes
    ----------
    amplitude : (n,) ndarray
        a, the mass norm of the fundamental harmonic [t^(1/2) mm].
    frequency : (n,) ndarray
        [Hz]
    damping : (n,) ndarray
        Damping ratio zeta = xi / (2 omega), that of C included.
    status : {"complete", "stopped", "step limit"}
    message : str
        Where and why the path ended.
    state : (n, n_point, 3) ndarray
        Shares of the cycle in stick, slip, lift-off.
    energy : (n, n_point) ndarray
        Energy lost per cycle [N mm].
    fundamental : (n, m) ndarray of complex
        Modal amplitudes of the fundamental harmonic.
    x : (n, n_unknown) ndarray
        Unknowns of the balance.
    balance : Balance
        The condensed problem, without dynamic loads.
    stuck : (m, m) ndarray
        Modes with all points closed and sticking, on the modes of the balance; rigid ones first.
    stuck_omega : (m,) ndarray
        Their angular frequencies [rad/s].
    number : int
        Column of this mode in `stuck`.
    """

    amplitude: FloatArray
    frequency: FloatArray
    damping: FloatArray
    status: str
    message: str
    state: FloatArray
    energy: FloatArray
    fundamental: ComplexArray
    x: FloatArray
    balance: Balance
    stuck: FloatArray
    stuck_omega: FloatArray
    number: int

    def motion(self, row: ArrayLike) -> FloatArray:
        """Amplitude (n,) [mm] of row @ q in the fundamental harmonic."""
        return np.abs(self.fundamental @ self.balance.modal_row(row))

    @property
    def largest_damping(self) -> tuple[float, float, float]:
        """Damping ratio, amplitude and frequency [Hz] where the damping is largest: the vertex of
        the parabola through the highest point and its neighbours, over log a.
        """
        k, log_a = int(np.argmax(self.damping)), np.log(self.amplitude)
        near = slice(max(k - 1, 0), k + 2)
        at, zeta = parabola(log_a[near], self.damping[near])
        order = np.argsort(log_a[near])
        found = np.interp(at, log_a[near][order], self.frequency[near][order])
        return zeta, float(np.exp(at)), float(found)

    def response(self, force: ArrayLike, row: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Forced response near the resonance, from the mode and the other stuck modes.

        With u = q_1 / a of the mode, (w0^2 - W^2 + 2 i zeta w0 W) A = u'f and |A| = a give both
        frequencies W at which the mode has the amplitude a; the other modes are added as linear.

        Parameters
        ----------
        force : (n_dof,) array_like of complex
            Amplitude of the first harmonic [N].
        row : (n_dof,) array_like
            Weighs the displacements: row @ q.

        Returns
        -------
        frequency : (k,) ndarray
            [Hz], up one side of the resonance and down the other, half way to the next stuck
            frequencies at most.
        motion : (k,) ndarray
            Amplitude of row @ q [mm].
        """
        f = np.asarray(np.asarray(force, complex) @ self.balance.modal.Phi, complex)
        weights = self.balance.modal_row(row)
        log_a = np.log(self.amplitude)
        # length of the path, with the damping over its largest
        relative = self.damping / (float(np.abs(self.damping).max()) or 1.0)
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff([log_a, relative])))])
        fine = np.linspace(0.0, way[-1], FINE * len(way))
        shape = self.fundamental / self.amplitude[:, None]
        data = np.column_stack(
            [log_a, 2.0 * np.pi * self.frequency, self.damping, shape.conj() @ f, shape @ weights]
        )
        data = CubicSpline(way, data)(fine) if len(way) > 1 else data
        log_a, w0, zeta = data[:, :3].real.T
        pushed, seen, a = data[:, 3], data[:, 4], np.exp(log_a)
        middle = w0**2 * (1.0 - 2.0 * zeta**2)
        inside = middle**2 - w0**4 + np.abs(pushed / a) ** 2
        known = inside >= 0.0
        root = np.sqrt(np.where(known, inside, 0.0))
        # half way to the neighbours
        beside, k = [0.0, *self.stuck_omega, np.inf], self.number
        low, high = 0.5 * (beside[k] + beside[k + 1]), 0.5 * (beside[k + 1] + beside[k + 2])
        # up below the resonance, down above it
        at = np.concatenate([np.arange(len(a)), np.arange(len(a))[::-1]])
        W = np.sqrt(np.maximum(middle[at] - np.repeat([1.0, -1.0], len(a)) * root[at], 0.0))
        good = known[at] & (low < W) & (high > W)
        W, at = W[good], at[good]
        A = pushed[at] / (w0[at] ** 2 - W**2 + 2j * zeta[at] * w0[at] * W)
        return W / (2.0 * np.pi), np.abs(seen[at] * A + self._rest(W, f, weights))

    def peak(self, force: ArrayLike, row: ArrayLike) -> tuple[float, float]:
        """Frequency [Hz] and height [mm] of the forced peak; see `response`.

        Raises InputError where the amplitudes of the mode do not reach the peak.
        """
        f, motion = self.response(force, row)
        if not len(motion) or (self._force_at_peak(force) < 1.0).all():
            raise InputError(
                "nonlinear mode: the forced peak lies beyond its amplitudes, "
                f"{self.amplitude[0]:.3g} to {self.amplitude[-1]:.3g}; give others"
            )
        k = int(np.argmax(motion))
        return float(f[k]), float(motion[k])

    def best_preload(
        self, force: ArrayLike, row: ArrayLike, loads: tuple[float, float] = (1.0, 1.0)
    ) -> tuple[float, float]:
        """Factor on all static loads and preloads at which the worst peak is lowest.

        Where every gap is closed at rest, static and dynamic loads scaled by c scale the motion by
        c: the peaks h(f) per unit of load at the preload of this mode tell those at any other,
        h(f/c). Valid as `peak` is; a curve by harmonic balance at the factor confirms it.

        Parameters
        ----------
        force, row : array_like
            As of `response`.
        loads : (float, float)
            Least and largest factor on `force`: the worst of all between counts.

        Returns
        -------
        factor, worst : float
            On static loads and preloads; peak of row @ q per unit of load [mm].

        Raises
        ------
        InputError
            For loads that are not positive and rising, and where the amplitudes of the mode do not
            reach over such a range.
        """
        low, high = loads
        if not 0.0 < low <= high < np.inf:
            raise InputError(f"best_preload: loads {loads} must be above 0 and rising")
        known = self._force_at_peak(force)
        # without damping there is no peak before the first slip
        known = known[known > float(np.finfo(float).eps) * known.max()]
        begin, end = float(known[0]), float(known.max()) * (1.0 - FREQUENCY_SHARE)
        span = np.log(high / low)
        if not 0.0 < begin < end or np.log(end / begin) <= span:
            raise InputError(
                f"best_preload: the mode tells peaks of {begin:.3g} to {end:.3g} times the force, "
                f"a smaller range than that of the loads, {high / low:.3g}; give more amplitudes"
            )
        f = np.geomspace(begin, end, SEEN)
        base = np.asarray(force)
        h = np.log([self.peak(one * base, row)[1] / one for one in f])
        scale = np.geomspace(high / end, low / begin, SEEN)
        window = np.log(low / scale)[:, None] + np.linspace(0.0, span, SEEN)
        worst = np.interp(window, np.log(f), h).max(axis=1)
        k = int(worst.argmin())
        return float(scale[k]), float(np.exp(worst[k]))

    def _force_at_peak(self, force: ArrayLike) -> FloatArray:
        """(n,) factor on the force at which each amplitude is that of the peak."""
        pushed = np.abs(self.fundamental.conj() @ (np.asarray(force) @ self.balance.modal.Phi))
        w0 = 2.0 * np.pi * self.frequency
        return np.asarray(2.0 * self.damping * w0**2 * self.amplitude**2 / pushed)

    def _rest(self, W: FloatArray, f: ComplexArray, weights: FloatArray) -> ComplexArray:
        """The other stuck modes under the force, linear, at W rad/s."""
        b, others = self.balance, np.arange(len(self.stuck)) != self.number
        shapes, values = self.stuck[:, others], self.stuck_omega[others] ** 2
        lost = np.einsum("ij,ji->j", shapes, b.linear.damped(shapes.T.astype(complex)).real)
        gain = (weights @ shapes) * (f @ shapes)
        return np.asarray((gain / (values - W[:, None] ** 2 + 1j * W[:, None] * lost)).sum(axis=1))


def nonlinear_mode(
    system: System, *, mode: int, amplitudes: ArrayLike, settings: Settings | None = None
) -> NonlinearMode:
    """A mode of M q'' + C q' + K q = f_0 - B'f_c over its amplitude.

    Parameters
    ----------
    system : System
        With harmonic 1, and 0 where static loads act. One harmonic does not do under lift-off.
    mode : int
        Number of the mode with all points closed and sticking, 1 the lowest with a frequency.
    amplitudes : (k,) array_like
        Rising, above 0 [t^(1/2) mm]: answered at these and between.
    settings : Settings, optional
        Step control of the continuation.

    Returns
    -------
    NonlinearMode
        A path that stops early is returned with its status.

    Raises
    ------
    InputError
        For bad input, and for a mode that is not found at a small amplitude.

    Examples
    --------
    A mass on a spring with a Jenkins element, x_c = mu N / k_t = 4: the damping is largest near
    twice that amplitude.

    >>> import numpy as np
    >>> from upd.hbm import System, contacts, nonlinear_mode
    >>> jenkins = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=0.25, mu=1.0, preload=1.0)
    >>> system = System(([[1.0]], [[0.0]], [[1.0]]), jenkins, harmonics=(1,))
    >>> mode = nonlinear_mode(system, mode=1, amplitudes=[2.0, 8.0])
    >>> round(float(2 * np.pi * mode.frequency[-1]), 4), round(float(mode.damping[-1]), 4)
    (1.0607, 0.0354)
    """
    a, h = np.asarray(amplitudes, dtype=float).ravel(), system.balanced(range(10))
    problems = []
    if not (len(a) and np.isfinite(a).all() and (a > 0.0).all() and (np.diff(a) > 0.0).all()):
        problems.append("amplitudes must be finite, above 0 and rising")
    if 1 not in h.numbers:
        problems.append(f"harmonics {h.numbers} lack 1, the mode's own")
    if (system.contacts.law.preload < 0.0).any():
        problems.append("a preload is negative")
    if problems:
        raise InputError(f"nonlinear_mode: {'; '.join(problems)}")
    given = replace(system, harmonics=h.numbers)
    b = given.balance("nonlinear_mode", np.ones(1), None, fast_exits=False)
    with threads_for(b.size):
        return _along(b, mode, np.log(a), settings or Settings())


def _along(b: Balance, mode: int, wanted: FloatArray, s: Settings) -> NonlinearMode:
    stuck, omegas_stuck, number = stuck_modes(b, mode)
    shape, omega = stuck[:, number], float(omegas_stuck[number])
    of = ExtendedBalance(b, shape, omega)
    problem = PathProblem(
        of.function, of.scale, settings=s, shown=lambda log_a: f"amplitude {np.exp(log_a):.6g}"
    )
    begin = wanted[0]
    for _ in range(HALVINGS):
        first = problem.solve(of.guess(begin), begin)
        if first is not None:
            break
        begin -= np.log(2.0)
    else:
        raise InputError(
            f"nonlinear_mode: mode {mode} near {omega / (2.0 * np.pi):.6g} Hz is not found at any "
            f"amplitude below {np.exp(wanted[0]):.3g}: do the contacts carry a load at rest?"
        )
    path = _over(problem, first.x, float(begin), wanted)
    # an amplitude below those asked for was only where the path began
    kept = int(np.argmax(np.append(path.p >= wanted[0], True)))
    xs, ps = path.x[kept:], path.p[kept:]
    x, omegas, xi = xs[:, :-2], xs[:, -2], xs[:, -1]
    found = measures(b, omegas / (2.0 * np.pi), x)
    each = zip(xi.tolist(), omegas.tolist(), found.contact_force, strict=True)
    eta = [of.amplitudes(b.linear.shifted(one), F, omega, 1)[0] for one, omega, F in each]
    return NonlinearMode(
        amplitude=np.exp(ps),
        frequency=omegas / (2.0 * np.pi),
        damping=xi / (2.0 * omegas),
        status=path.status,
        message=path.message,
        state=found.state,
        energy=found.energy,
        fundamental=np.array(eta).reshape(len(xs), len(shape)),
        x=x,
        balance=b,
        stuck=stuck,
        stuck_omega=omegas_stuck,
        number=number,
    )


def _over(problem: PathProblem, x: FloatArray, begin: float, wanted: FloatArray) -> Path:
    """The path over log a; one that stops is taken up with shorter steps at the last value wanted
    that it reached: long ones may cross from it to a closed one beside it.
    """
    path = follow(problem, (x, begin), float(wanted[-1]), wanted=wanted)
    reached = wanted[wanted <= path.p.max()]
    if path.status != "stopped" or not len(reached):
        return path
    kept = int(np.argmax(path.p >= reached[-1]))
    s, start = problem.settings, (path.x[kept], float(path.p[kept]))
    shorter = replace(s, angle=SHORTER * s.angle, kink_step=SHORTER**2 * s.kink_step)
    rest = follow(problem._replace(settings=shorter), start, float(wanted[-1]), wanted=wanted)
    return replace(
        rest,
        x=np.concatenate([path.x[:kept], rest.x]),
        p=np.concatenate([path.p[:kept], rest.p]),
        message=f"{path.message}; taken up with shorter steps: {rest.message}",
    )


def stuck_modes(b: Balance, mode: int) -> tuple[FloatArray, FloatArray, int]:
    """Modes with all points sticking, on those of the balance, their omega; which is wanted."""
    values, shapes = eigh(b.stuck_modal_stiffness)
    elastic = np.flatnonzero(values > len(values) * np.finfo(float).eps * values[-1])
    if not 1 <= mode <= len(elastic):
        raise InputError(f"nonlinear_mode: mode {mode} is none; there are 1 to {len(elastic)}")
    return shapes, np.sqrt(np.maximum(values, 0.0)), int(elastic[mode - 1])


class ExtendedBalance:
    """The balance with omega and xi as unknowns, amplitude and phase as equations, over log a."""

    def __init__(self, b: Balance, shape: FloatArray, omega: float) -> None:
        self.b, self.shape, self.omega = b, shape, omega
        self.acting = b.loads, b.u0, b.rigid_load
        self._sizes = scale_of(b)
        self.xi = float(shape @ b.linear.damped(shape[None].astype(complex))[0].real)

    def guess(self, p: float) -> FloatArray:
        """The stuck mode at log a = p, beside the mean motion of points that stick."""
        x, o, c = self.b.stuck(self.omega), self.b.harmonics.offset, len(self.b.Psi)
        W = x[: c * self.b.harmonics.size].reshape(c, -1)
        W[:, o:] = 0.0
        W[:, o] = np.exp(p) * (self.b.Psi @ self.shape)
        return np.concatenate([x, [self.omega, self.xi]])

    def scale(self, X: FloatArray) -> FloatArray:
        """Sizes of the unknowns."""
        unit = FREQUENCY_SHARE * self.omega
        return np.concatenate([self._sizes(X[:-2]), [unit, unit]])

    def amplitudes(
        self, linear: LinearPart, F: FloatArray, omega: float, count: int
    ) -> ComplexArray:
        """Modal amplitudes (count, m) of the lowest harmonics above 0 under contact forces F."""
        f = to_complex(F.reshape(len(linear.G0), -1), self.b.harmonics).T[:count]
        return linear.modal.solve(linear.k[:count] * omega, -linear.pushes(f))

    def function(
        self, X: FloatArray, p: float, jacobian: bool
    ) -> tuple[FloatArray, FloatArray | None, FloatArray]:
        """Residual, Jacobian and derivative by log a, as the continuation takes them."""
        b, omega, a = self.b, float(X[-2]), float(np.exp(p))
        linear, (W, rigid) = b.linear.shifted(float(X[-1])), b.split(X[:-2])
        c, o = len(linear.G0), linear.offset
        F, state, moving = b.contact_terms(X[:-2], jacobian)
        found, by_omega = linear.residual(
            W.reshape(c, -1), rigid, F.reshape(c, -1), omega, self.acting, jacobian
        )
        all_eta = self.amplitudes(linear, F, omega, len(linear.k) if jacobian else 1)
        eta = all_eta[0]
        energy, phase = float((eta.conj() @ eta).real), float((self.shape @ eta).imag) / a
        amplitude = 0.5 * np.log(energy) - p if energy > 0.0 else -np.inf
        residual = np.concatenate([found, [amplitude, phase]])
        by_p = np.zeros(len(residual))
        by_p[-2:] = -1.0, -phase
        if not jacobian:
            return residual, None, by_p
        w, modal, n = linear.k * omega, linear.modal, len(found)
        one = w[:1]
        parts = BalanceJacobian(linear, w, state, b.stuck_stiffness, moving)
        DF, J = parts.every_derivative(), parts.matrix(2)
        J[:n, n] = by_omega
        # xi acts on each harmonic as i k omega eta_k, a force
        moved = linear.moves(modal.solve(w, -1j * w[:, None] * all_eta))
        by_xi = real_part(moved, np.zeros(c), o)
        J[: by_xi.size, n + 1] = by_xi.ravel()
        lost = linear.damped(eta[None])[0]
        pushes = np.array([2.0 * omega * eta - 1j * lost, 1j * omega * eta])
        slopes, by_shift = modal.solve(w[[0, 0]], pushes)
        for row, weights, part in ((n, eta.conj() / energy, 1.0), (n + 1, self.shape / a, -1j)):
            y = part * linear.moves(modal.solve(one, weights[None].astype(complex)))[0]
            V = np.zeros((c, linear.size))
            V[:, o], V[:, o + 1] = -y.real, -y.imag
            J[row, : V.size] = np.einsum("pcs,pcsdt->pdt", V.reshape(DF.shape[:3]), DF).ravel()
            J[row, n] = (part * (weights @ slopes)).real
            J[row, n + 1] = (part * (weights @ by_shift)).real
        return residual, J, by_p
