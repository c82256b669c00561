"""Stability of periodic motions: multipliers of the period map, slider positions included.

A small deviation (q, q', z) from the motion, z the positions of the sliders, is carried through one
period by Newmark's average acceleration with the law's own derivatives at every step:

    df = A dw + B dz,   dz' = X dw + Y dz.

The eigenvalues of the map over a period are the multipliers: the motion is unstable where one lies
outside the unit circle. At a fold one leaves through +1; a pair elsewhere, or one through -1, is a
motion that oscillates about the period. A slider that slips forgets where it was: multiplier 0. One
that sticks all period long stays wherever it is: exactly 1, which decides nothing and is left out.

References
----------
A. H. Nayfeh, B. Balachandran, Applied Nonlinear Dynamics (1995), chapter 3; J. C. Simo and
T. J. R. Hughes, Computational Inelasticity (1998), 1.4, for the derivatives of friction.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upd.errors import InputError
from upd.hbm.core.fourier import synthesis
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.coulomb import LIFT, normal, step
from upd.hbm.springs.response import FrequencyResponse
from upd.labels import Shown
from upd.linalg.compiled import compiled
from upd.linalg.parallel import threads_for

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
#: time steps of a period
STEPS = 256
#: below this share a slider does not move, and a traction lies at its limit
SLACK = float(np.finfo(float).eps) ** 0.5
STABLE, FOLD, OSCILLATING, UNDECIDED = "stable", "fold", "oscillating", "undecided"


@dataclass(frozen=True, repr=False)
class Stability(Shown):
    """Stability of k points of a path.

    Attributes
    ----------
    points : (k,) ndarray of int
        Their places on the path.
    frequency : (k,) ndarray
        [Hz]
    label : tuple of {"stable", "fold", "oscillating", "undecided"}
        "fold": a multiplier above +1, as beyond a fold of the curve. "oscillating": one outside the
        unit circle elsewhere. "undecided": one is nearer to +1 than the time steps resolve, or a
        slider lies at its limit without moving; a time integration decides.
    largest : (k,) ndarray of complex
        Multiplier of the largest size.
    multipliers : tuple of k ndarrays of complex
        All of them, by falling size, without those of sliders that stick all period long.
    """

    points: NDArray[np.int64]
    frequency: FloatArray
    label: tuple[str, ...]
    largest: ComplexArray
    multipliers: tuple[ComplexArray, ...]


def stability(
    answer: FrequencyResponse, points: Iterable[int] | None = None, *, steps: int = STEPS
) -> Stability:
    """Label points of a forced response by the multipliers of their period map.

    Parameters
    ----------
    answer : FrequencyResponse
    points : iterable of int, optional
        Places on the path; all by default.
    steps : int
        Time steps of a period.

    Returns
    -------
    Stability

    Raises
    ------
    InputError
        For places that the path does not have, and for too few steps.

    Examples
    --------
    An oscillator that slips is stable:

    >>> from upd.hbm import System, contacts, frequency_response, stability
    >>> jenkins = contacts([[0.0]], [[1.0]], k_n=0.0, k_t=1.0, mu=1.0, preload=0.5)
    >>> system = System(([[1.0]], [[0.02]], [[1.0]]), jenkins, harmonics=(1, 3, 5))
    >>> answer = frequency_response(system, harmonic_force=[0.6], frequencies=[0.18])
    >>> stability(answer).label
    ('stable',)
    """
    n, b = len(answer.frequency), answer.balance
    b.require_all_sectors("stability")
    chosen = np.arange(n) if points is None else np.asarray([*points], dtype=np.int64)
    problems = []
    if ((chosen < -n) | (chosen >= n)).any():
        problems.append(f"points {chosen.tolist()} must lie in 0 to {n - 1}")
    if steps <= 2 * b.harmonics.highest:
        problems.append(f"{steps} steps cannot carry harmonic {b.harmonics.highest}")
    if problems:
        raise InputError(f"stability: {'; '.join(problems)}")
    found = [motion_stability(b, answer.x[k], float(answer.frequency[k]), steps) for k in chosen]
    return Stability(
        chosen % max(n, 1),
        answer.frequency[chosen],
        tuple(label for label, _ in found),
        np.array([m[0] if len(m) else 0.0 for _, m in found], dtype=complex),
        tuple(m for _, m in found),
    )


def motion_stability(
    b: Balance, x: FloatArray, frequency: float, steps: int = STEPS
) -> tuple[str, ComplexArray]:
    """Label and multipliers of one motion, as `Stability` has them.

    Parameters
    ----------
    b : Balance
    x : (n_unknown,) ndarray
        Unknowns of the balance.
    frequency : float
        [Hz]
    steps : int
        Time steps of a period.

    Returns
    -------
    label : str
    multipliers : ndarray of complex
    """
    # one sample of the motion a step
    E = synthesis(b.harmonics, steps)
    W, d, law = b.split(x)[0], b.contacts.tangents, b.contacts.law
    march = b.marched(W[None], E)
    w, force, state = W @ E.T, march.force[0], march.state[0]
    P = period_map(
        b.modal.eigenvalues,
        b.modal.damping,
        b.Psi,
        changes(b, w, force),
        1.0 / (frequency * len(E)),
    )
    rubs = law.mu > 0.0
    z = w[:, 1:] - force[:, 1:] / law.k_t[:, None, None]
    way, size = np.ptp(z, axis=-1).max(axis=1, initial=0.0), np.abs(w).max(axis=(1, 2))
    moves = rubs & ((state == LIFT).any(axis=1) | (way > SLACK * size))
    kept = np.concatenate([np.ones(len(P) - d * len(moves), dtype=bool), np.repeat(moves, d)])
    multipliers = np.linalg.eigvals(P[np.ix_(kept, kept)])
    multipliers = multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
    traction = np.hypot.reduce(force[:, 1:], axis=1, initial=0.0)
    # slipped on the way into the period only, and stays exactly there
    at_limit = (traction >= (1.0 - SLACK) * law.mu[:, None] * force[:, 0]).any(axis=1)
    marginal = bool((at_limit & rubs & ~moves).any())
    return _label(multipliers, (2.0 * np.pi / len(E)) ** 2, marginal), multipliers


def _label(multipliers: ComplexArray, near: float, marginal: bool) -> str:
    """Label of a motion; `near` is what the time steps resolve."""
    real = np.abs(multipliers.imag) <= SLACK * np.abs(multipliers)
    positive = multipliers[real & (multipliers.real > 0.0)].real
    if marginal or (np.abs(positive - 1.0) <= near).any():
        return UNDECIDED
    if (positive > 1.0).any():
        return FOLD
    return OSCILLATING if (np.abs(multipliers) > 1.0 + near).any() else STABLE


#: derivatives of the contact law at n steps of a period, by displacements and by sliders before the
#: step: A (n, c, c) and B (n, c, s) of the forces on c = (1 + d) n_point rows, X (n, s, c) and
#: Y (n, s, s) of the s sliders after it
Changes = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def changes(b: Balance, w: FloatArray, force: FloatArray) -> Changes:
    """Derivatives of the contact law along a motion.

    Parameters
    ----------
    b : Balance
    w, force : (n_point, 1 + d, n) ndarray
        Displacements [mm] and forces [N] at the steps of the period.

    Returns
    -------
    Changes
    """
    n_point, rows, n = w.shape
    c, s, law = n_point * rows, n_point * (rows - 1), b.contacts.law
    A, B = np.zeros((n, c, c)), np.zeros((n, c, s))
    X, Y = np.zeros((n, s, c)), np.zeros((n, s, s))
    k_t = b.stuck_stiffness[:, 1:].max(axis=1, initial=0.0)
    _fill(w, force, law.arrays, k_t, (A, B, X, Y))
    return A, B, X, Y


@compiled
def _closed(here, beside):  # type: ignore[no-untyped-def]
    """Closed share of the half step towards a neighbour; N0 + k w is linear between."""
    if here > 0.0 and beside > 0.0:
        return 1.0
    if here <= 0.0 and beside <= 0.0:
        return 0.0
    turn = min(2.0 * here / (here - beside), 1.0)
    return turn if here > 0.0 else 1.0 - turn


@compiled
def _fill(w, force, law, k_t, changes):  # type: ignore[no-untyped-def]
    """Fill the derivatives; a point without tangential stiffness has sliders that stay."""
    (k_n, _, mu, preload, gap), (A, B, X, Y) = law, changes
    n_point, rows, n = w.shape
    d = rows - 1
    trial, direction, P = np.zeros(2), np.zeros(2), np.zeros((2, 2))
    for p in range(n_point):
        i, s = p * rows, p * d
        for j in range(n):
            before, after = j - 1 if j > 0 else n - 1, j + 1 if j < n - 1 else 0
            N, _ = normal(w[p, 0, j], k_n[p], preload[p], gap[p])
            # events lie between the steps: the share of a step about this one that is closed
            N3 = [preload[p] + k_n[p] * (w[p, 0, a] - gap[p]) for a in (before, j, after)]
            slope = k_n[p] * 0.5 * (_closed(N3[1], N3[0]) + _closed(N3[1], N3[2]))
            A[j, i, i] = slope
            for a in range(d):
                moved = w[p, 1 + a, j] - w[p, 1 + a, before]
                trial[a] = force[p, 1 + a, before] + k_t[p] * moved
            _, _, P[0, 0], P[0, 1], P[1, 1], direction[0], direction[1], _ = step(
                trial[0], trial[1], (1.0 + SLACK) * N, mu[p]
            )
            P[1, 0] = P[0, 1]
            for a in range(d):
                if k_t[p] == 0.0:
                    Y[j, s + a, s + a] = 1.0
                    continue
                A[j, i + 1 + a, i] = mu[p] * slope * direction[a]
                X[j, s + a, i] = -mu[p] * slope * direction[a] / k_t[p]
                X[j, s + a, i + 1 + a] = 1.0
                for e in range(d):
                    A[j, i + 1 + a, i + 1 + e] = k_t[p] * P[a, e]
                    B[j, i + 1 + a, s + e] = -k_t[p] * P[a, e]
                    X[j, s + a, i + 1 + e] -= P[a, e]
                    Y[j, s + a, s + e] = P[a, e]


def period_map(
    eigenvalues: FloatArray, damping: ArrayLike, Psi: FloatArray, of: Changes, dt: float
) -> FloatArray:
    """Map of a deviation over one period.

    Parameters
    ----------
    eigenvalues : (m,) ndarray
        Squares of the angular frequencies of mass-normalised modes.
    damping : (m,) or (m, m) array_like
        Modal damping.
    Psi : (c, m) ndarray
        Rows of the contacts on the modes.
    of : Changes
        At the n steps; the first is the beginning of the period.
    dt : float
        Time step [s].

    Returns
    -------
    (2 m + s, 2 m + s) ndarray
        Of modal displacements, velocities and sliders.
    """
    C, L = np.asarray(damping, dtype=np.float64), eigenvalues[:, None]
    # a column where nothing couples the modes
    if C.ndim == 1:
        C = C[:, None]
        S = np.reciprocal(1.0 + 0.5 * dt * C + 0.25 * dt**2 * L)
    else:
        S = np.linalg.inv(np.eye(len(L)) + 0.5 * dt * C + 0.25 * dt**2 * np.diagflat(L))
    with threads_for(len(Psi)):
        linear = np.ascontiguousarray(Psi), L, np.ascontiguousarray(C), S
        return np.asarray(_map(linear, of, dt))


@compiled
def _times(A, x):  # type: ignore[no-untyped-def]
    """A x of a matrix, or of a diagonal one as its column."""
    return A * x if A.shape[1] == 1 else np.dot(A, x)


@compiled
def _map(linear, changes, dt):  # type: ignore[no-untyped-def]
    """The map, column by column of the deviation; Newmark's average acceleration."""
    (Psi, L, C, S), (A, B, X, Y) = linear, changes
    n, c, s = B.shape
    m = len(L)
    D = np.eye(2 * m + s)
    x, v, z = D[:m].copy(), D[m : 2 * m].copy(), D[2 * m :].copy()
    Pt = np.ascontiguousarray(Psi.T)
    Gamma = 0.25 * dt * dt * np.dot(Psi, _times(S, Pt))
    a = -(_times(C, v) + L * x + np.dot(Pt, np.dot(A[0], np.dot(Psi, x)) + np.dot(B[0], z)))
    for i in range(n):
        j = (i + 1) % n
        x0 = x + dt * v + 0.25 * dt * dt * a
        v0 = v + 0.5 * dt * a
        free = -_times(S, _times(C, v0) + L * x0)
        held = np.dot(B[j], z)
        right = np.dot(Psi, x0 + 0.25 * dt * dt * free) - np.dot(Gamma, held)
        w = np.linalg.solve(np.eye(c) + np.dot(Gamma, A[j]), right)
        a = free - _times(S, np.dot(Pt, np.dot(A[j], w) + held))
        x, v = x0 + 0.25 * dt * dt * a, v0 + 0.5 * dt * a
        z = np.dot(X[j], w) + np.dot(Y[j], z)
    D[:m], D[m : 2 * m], D[2 * m :] = x, v, z
    return D
