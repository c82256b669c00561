"""Time-march cross-check of the harmonic balance.

The same contact law is integrated in time until a period repeats: implicit HHT-alpha in modal
coordinates; each step solves the contact displacements by Newton with the exact tangent of the
law. alpha = 0 is Newmark's average acceleration.

References
----------
H. M. Hilber, T. J. R. Hughes and R. L. Taylor, Earthquake Eng. Struct. Dyn. 5 (1977) 283-292.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.fourier import analysis, to_complex
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.coulomb import normal, step
from upd.labels import Shown
from upd.linalg.compiled import compiled

FloatArray = NDArray[np.float64]
#: Newton steps per time step; the law is piecewise smooth, so a step that needs more is cycling
#: between two states
MOST_NEWTON = 30
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, repr=False)
class SteadyState(Shown):
    """Last period of a time march, n steps.

    Attributes
    ----------
    coefficients : (n_dof, size) ndarray
        Coefficients of all dofs [mm], on the harmonics of the balance.
    displacement, force : (n_point, 1 + d, n) ndarray
        Relative contact displacements [mm] and contact forces [N].
    periods : int
        Periods integrated.
    change : float
        Change of the last period relative to its size.
    status : {"periodic", "period limit", "no convergence"}
    message : str
        One sentence.
    """

    coefficients: FloatArray
    displacement: FloatArray
    force: FloatArray
    periods: int
    change: float
    status: str
    message: str

    def amplitude(self, row: FloatArray, place: int = 0) -> float:
        """Amplitude of a harmonic kept above 0.

        The first columns of the coefficients are [a0, a1, b1] or [a1, b1], with 1 for the lowest.

        Parameters
        ----------
        row : (n_dof,) ndarray
            Weighs the displacements: row @ q.
        place : int
            Of the harmonic among those above 0; the lowest by default.

        Returns
        -------
        float
            Amplitude [mm].
        """
        size = self.coefficients.shape[1]
        o = size % 2 + 2 * place
        a, b = row @ self.coefficients[:, o], row @ self.coefficients[:, o + 1]
        return float(np.hypot(a, b))


@compiled
def _law(w, previous, T, law, f, D, T_new):  # type: ignore[no-untyped-def]
    """Forces f (c,) and tangents D (n_point, d1, d1) at the displacements w (c,).

    From the tractions T before the step.
    """
    k_n, k_t, mu, preload, gap = law
    n_point, d1 = D.shape[0], D.shape[1]
    D[:] = 0.0
    trial = np.zeros(2)
    for p in range(n_point):
        i = p * d1
        f[i], slope = normal(w[i], k_n[p], preload[p], gap[p])
        D[p, 0, 0] = slope
        trial[:] = 0.0
        for j in range(d1 - 1):
            trial[j] = T[p, j] + k_t[p] * (w[i + 1 + j] - previous[i + 1 + j])
        t1, t2, P11, P12, P22, n1, n2, _ = step(trial[0], trial[1], f[i], mu[p])
        T_new[p, 0], T_new[p, 1] = t1, t2
        if d1 > 1:
            f[i + 1] = t1
            D[p, 1, 0], D[p, 1, 1] = mu[p] * slope * n1, k_t[p] * P11
        if d1 > 2:
            f[i + 2] = t2
            D[p, 1, 2], D[p, 2, 1], D[p, 2, 2], D[p, 2, 0] = (
                k_t[p] * P12,
                k_t[p] * P12,
                k_t[p] * P22,
                mu[p] * slope * n2,
            )


@compiled
def _period(state, load, scheme, linear, law, d1, tolerance, out):  # type: ignore[no-untyped-def]
    """March one period in place; load (n + 1, m). Returns whether every step converged."""
    x, v, a, w, f, T = state
    dt, alpha = scheme
    damping, eigenvalues, S, Psi, Gamma = linear
    W, F, X = out
    n, c = load.shape[0] - 1, len(w)
    n_point = c // d1
    beta, gamma = (1 - alpha) ** 2 / 4, 0.5 - alpha
    D, T_new = np.zeros((n_point, d1, d1)), np.zeros((n_point, 2))
    f_new, J = np.zeros(c), np.zeros((c, c))
    for i in range(n):
        outer = (1 + alpha) * load[i + 1] - alpha * load[i]
        x0 = x + dt * v + dt * dt * (0.5 - beta) * a
        v0 = v + dt * (1 - gamma) * a
        right = (
            outer
            - (1 + alpha) * (np.dot(damping, v0) + eigenvalues * x0)
            + alpha * (np.dot(damping, v) + eigenvalues * x)
        )
        right += alpha * np.dot(f, Psi)
        a_free = np.dot(S, right)
        w_free = np.dot(Psi, x0 + beta * dt * dt * a_free)
        new, good = w.copy(), False
        for _ in range(MOST_NEWTON):
            _law(new, w, T, law, f_new, D, T_new)
            r = new - w_free + np.dot(Gamma, f_new)
            if np.abs(r).max() <= tolerance * max(np.abs(w_free).max(), np.abs(new).max()):
                good = True
                break
            for p in range(n_point):
                lo, hi = p * d1, (p + 1) * d1
                J[:, lo:hi] = np.dot(np.ascontiguousarray(Gamma[:, lo:hi]), D[p])
            for j in range(c):
                J[j, j] += 1.0
            new = new - np.linalg.solve(J, r)
        if not good:
            return False
        w[:], f[:], T[:] = new, f_new, T_new
        a_new = a_free - (1 + alpha) * np.dot(S, np.dot(f, Psi))
        x[:] = x0 + beta * dt * dt * a_new
        v[:] = v0 + gamma * dt * a_new
        a[:] = a_new
        j = (i + 1) % n
        W[:, j], F[:, j], X[:, j] = w, f, x
    return True


def steady_state(
    b: Balance,
    frequency: float,
    x: FloatArray,
    *,
    steps: int = 1024,
    most_periods: int = 2000,
    tolerance: float = 1e-6,
    alpha: float = 0.0,
) -> SteadyState:
    """March a system at one frequency until a period repeats.

    The harmonic answer only shortens the way: what repeats is a solution of the time-stepped
    equations.

    Parameters
    ----------
    b : Balance
        The system, its contacts and its loads.
    frequency : float
        [Hz]
    x : (n_unknown,) ndarray
        Unknowns of the harmonic answer to start from.
    steps : int
        Time steps per period.
    most_periods : int
        Limit on the periods.
    tolerance : float
        Change of a period, relative to its size, at which it counts as repeated.
    alpha : float
        -1/3 <= alpha <= 0; numerical damping grows towards -1/3.

    Returns
    -------
    SteadyState

    Examples
    --------
    A march confirms the harmonic balance of an oscillator with a Jenkins element:

    >>> import numpy as np
    >>> from upd.hbm import System, contacts, frequency_response, steady_state
    >>> jenkins = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=0.5)
    >>> system = System(([[1.0]], [[0.02]], [[1.0]]), jenkins, harmonics=(1, 3, 5))
    >>> answer = frequency_response(system, harmonic_force=[0.3], frequencies=[0.18])
    >>> march = steady_state(answer.balance, 0.18, answer.x[0], steps=512)
    >>> march.status
    'periodic'
    >>> bool(abs(march.amplitude(np.array([1.0])) / answer.amplitude([1.0])[0] - 1) < 1e-3)
    True
    """
    b.require_all_sectors("time integration")
    omega = 2 * np.pi * frequency
    dt = 2 * np.pi / omega / steps
    state, load, linear = _initial(b, omega, x), _load(b, steps), _linear(b, dt, float(alpha))
    (c, m), law = b.Psi.shape, b.contacts.law
    W, F, X = np.zeros((c, steps)), np.zeros((c, steps)), np.zeros((m, steps))
    # contact stiffness against that of a step multiplies the rounding of the displacement
    tolerated = 1e4 * EPS * (1 + np.abs(linear[-1]).max() * max(law.k_n.max(), law.k_t.max()))
    d1, out = 1 + b.contacts.tangents, (W, F, X)
    change, status, period, before = np.inf, "period limit", 0, np.zeros_like(X)
    while period < most_periods:
        period += 1
        if not _period(state, load, (dt, float(alpha)), linear, law.arrays, d1, tolerated, out):
            status = "no convergence"
            break
        size = float(np.abs(X - X.mean(axis=1, keepdims=True)).max())
        change = float(np.abs(X - before).max()) / size if size > 0 else 0.0
        if change <= tolerance:
            status = "periodic"
            break
        before = X.copy()
    message = f"{status} after {period} periods of {steps} steps at {frequency:.6g} Hz"
    message += f", last change {change:.1e}"
    shape = (b.contacts.n_point, d1, steps)
    coefficients = b.modal.Phi @ (X @ analysis(b.harmonics, steps).T)
    return SteadyState(
        coefficients, W.reshape(shape), F.reshape(shape), period, change, status, message
    )


def _load(b: Balance, steps: int) -> FloatArray:
    theta = 2 * np.pi * np.arange(steps + 1) / steps
    waves = np.exp(1j * np.outer(theta, b.harmonics.dynamic))
    return np.ascontiguousarray((waves @ b.loads).real + b.static @ b.modal.Phi)


def _linear(b: Balance, dt: float, alpha: float) -> tuple[FloatArray, ...]:
    """Damping, eigenvalues, inverse of a step's matrix, rows, and their compliance in a step."""
    modal, beta, gamma = b.modal, (1 - alpha) ** 2 / 4, 0.5 - alpha
    damping = np.diag(modal.damping) if modal.proportional else modal.damping
    own = gamma * dt * damping + beta * dt**2 * np.diag(modal.eigenvalues)
    S = np.asarray(np.linalg.inv(np.eye(len(own)) + (1 + alpha) * own), float)
    Gamma = np.ascontiguousarray((1 + alpha) * beta * dt**2 * b.Psi @ S @ b.Psi.T)
    return np.ascontiguousarray(damping), modal.eigenvalues, S, b.Psi, Gamma


def _initial(b: Balance, omega: float, x: FloatArray) -> tuple[FloatArray, ...]:
    """Modal displacement, velocity, acceleration, contact displacement, force and tractions.

    At t = 0 of the harmonic answer.
    """
    found, size = b.period(x), b.harmonics.size
    force = found.coefficients(b.Q).reshape(1, -1, size)
    q = b.displacement(np.array([omega]), force, b.split(x)[1][None])[0]
    eta = np.linalg.solve(b.modal.Phi, q)
    k, amplitude = b.harmonics.dynamic, to_complex(eta, b.harmonics)
    mean = eta[:, 0] if b.harmonics.static else np.zeros(len(eta))
    displacement = mean + amplitude.real.sum(axis=1)
    velocity = (1j * omega * k * amplitude).real.sum(axis=1)
    acceleration = (-((omega * k) ** 2) * amplitude).real.sum(axis=1)
    force = np.ascontiguousarray(found.force[:, :, 0])
    T = np.zeros((len(force), 2))
    T[:, : b.contacts.tangents] = force[:, 1:]
    return displacement, velocity, acceleration, b.Psi @ displacement, force.ravel(), T
