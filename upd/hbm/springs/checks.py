"""What an answer left out, measured afterwards: sticking proven, truncation and aliasing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from upd.hbm.core.fourier import analysis, harmonics, synthesis, to_complex
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.coulomb import LIFT, SLIP, STICK
from upd.hbm.springs.points import MOST_PERIODS, March

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)
#: answers integrated at a time
PORTION = 64


def stuck_points(b: Balance, omega: FloatArray) -> NDArray[np.bool_]:
    """Frequencies where the linear stuck answer solves the balance exactly.

    It does where it keeps |T| <= mu N and N > 0 at every sample.

    Parameters
    ----------
    b : Balance
    omega : (n,) ndarray
        Angular frequencies [rad/s].

    Returns
    -------
    (n,) ndarray of bool
    """
    k, constant = b.stuck_stiffness, b.stuck_constant
    # the friction cone is convex: a mean force outside it puts a sample outside at every frequency
    mean = (
        b.split(b.stuck(float(omega[0])))[0][..., 0] * k + constant
        if b.harmonics.static
        else constant
    )
    held = b.contacts.law.mu * mean[:, 0]
    if np.any(np.hypot.reduce(mean[:, 1:], axis=1) > held + 1e3 * EPS * np.abs(held)):
        return np.zeros(len(omega), dtype=bool)
    each = (_stuck_forces(b, b.stuck(float(w))) for w in omega)
    mu = b.contacts.law.mu[:, None]
    return np.array([np.all(N > 0) and np.all(mu * N >= T) for N, T in each], dtype=bool)


def sticking_preload(b: Balance, x: FloatArray) -> FloatArray:
    """Preload to add for the stuck answer to be exact, with the static loads that balance it.

    Parameters
    ----------
    b : Balance
    x : (n_unknown,) ndarray
        Unknowns of the stuck answer.

    Returns
    -------
    (n_point,) ndarray
        Preload [N]. Zero when the answer is exact already; infinite where a point without friction
        carries a traction.
    """
    N, T = _stuck_forces(b, x)
    mu = b.contacts.law.mu[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        needed = np.where(T > 0, T / mu, 0.0) - N
    most = needed.max(axis=1)
    # the edge of the cone is on it: a share of the force makes the start clear of it
    return np.where(most > 0, most + EPS**0.5 * (np.abs(N).max(axis=1) + most), 0.0)


def separated(b: Balance, omega: FloatArray) -> FloatArray | None:
    """Unknowns of the free answer, bodies that nothing presses moved out of the way.

    Every point stays open when R a + t <= gap - N_0/k_n - max w for some rigid amplitudes a and a
    clearance t above rounding; the largest t comes from a linear programme of n_point rows.

    Parameters
    ----------
    b : Balance
    omega : (n,) ndarray
        Angular frequencies [rad/s].

    Returns
    -------
    (n, n_unknown) ndarray or None
        None where contacts must close.
    """
    law = b.contacts.law
    if np.any(law.k_n == 0) or np.any(b.rigid_load) or not b.harmonics.static:
        return None
    rows = b.Psi[:: 1 + b.contacts.tangents][:, b.modal.rigid]
    out = np.array([b.free(float(w)) for w in omega])
    motion = b.coefficients(out)[:, :, 0] @ b.E.T
    room = law.gap - law.preload / law.k_n - motion.max(axis=(0, 2))
    size = float(np.abs(room).max())
    # on the edge rounding would close it
    least = 1e3 * EPS * max(size, float(np.abs(motion).max()), float(np.abs(law.gap).max()))
    a = np.zeros(rows.shape[1])
    if rows.shape[1]:
        # not farther than the rooms are wide: a loose body may be moved without end
        found = linprog(
            np.append(a, -1.0),
            np.column_stack([rows, np.ones(len(rows))]),
            room,
            bounds=[*[(None, None)] * len(a), (None, size)],
        )
        if found.status != 0 or found.x is None or found.x[-1] < least:
            return None
        a = np.asarray(found.x[:-1], dtype=float)
    elif room.min() < least:
        return None
    n, step = len(b.Psi), b.harmonics.size
    out[:, : n * step : step] += b.Psi[:, b.modal.rigid] @ a
    out[:, n * step :] += a
    return out


def _stuck_forces(b: Balance, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normal force and size of the traction (n_point, n) over the cycle of the stuck answer."""
    motion = b.split(x)[0] @ b.E.T
    force = b.stuck_stiffness[..., None] * motion + b.stuck_constant[..., None]
    return force[:, 0], np.sqrt((force[:, 1:] ** 2).sum(axis=1))


def truncation(
    b: Balance, frequency: FloatArray, x: FloatArray, marched: March | None = None
) -> FloatArray:
    """Largest contact motion that the harmonics left out of the force would cause, relative.

    Parameters
    ----------
    b : Balance
    frequency : (n,) ndarray
        [Hz]
    x : (n, n_unknown) ndarray
        Answers.
    marched : March, optional
        Their contact forces at the samples of the problem, where they are known.

    Returns
    -------
    (n,) ndarray
        Relative to the contact motion.
    """
    kept = b.harmonics
    # from 0 up to twice the highest plus three
    rest = harmonics(k for k in range(2 * kept.highest + 4) if k not in kept.numbers)
    enough = b.samples > 2 * rest.highest
    Q = analysis(rest, b.samples if enough else 4 * rest.highest)
    E = b.E if enough else synthesis(b.harmonics, Q.shape[1])
    stiffness, out = b.stuck_stiffness.ravel(), np.zeros(len(x))
    known = marched if enough else None
    for part in portions(len(x)) if known is None else [slice(0, len(x))]:
        W = b.coefficients(x[part])
        force = (b.marched(W, E) if known is None else known).coefficients(Q)
        F = to_complex(force.reshape(len(W), len(b.Psi), -1), rest)
        most = np.zeros(len(W))
        for i, k in enumerate(rest.dynamic):
            try:
                modal, Psi = b.part(int(k))
            except KeyError:  # the modes of its nodal diameter are not given
                continue
            w = 2 * np.pi * k * frequency[part]
            eta = modal.solve(w, F[:, :, i] @ Psi.conj())
            # the force of the motion added would bring most of it back: springs in series with the
            # structure
            motion = np.abs(eta @ Psi.T) / (1 + modal.drive_point(Psi, w) * stiffness)
            most = np.maximum(most, motion.max(axis=1))
        size = np.abs(to_complex(W, b.harmonics)).max(axis=(1, 2, 3))
        if rest.static:
            mean = force.reshape(len(W), len(b.Psi), -1)[..., 0]
            most = np.maximum(most, _mean_motion(b, mean).max(axis=1))
        out[part] = most / np.where(size > 0, size, np.inf)
    return out


def _mean_motion(b: Balance, force: FloatArray) -> FloatArray:
    """Contact motion (n, r) [mm] that mean contact forces (n, r) cause on closed contacts.

    From (Lambda + Psi'k Psi) eta = Psi'f. Motions without any stiffness take the least stiffness
    that rounding leaves.
    """
    values, vectors = np.linalg.eigh(b.stuck_modal_stiffness)
    values = np.maximum(values, len(values) * EPS * values[-1])
    return np.asarray(np.abs((force @ b.Psi @ vectors / values) @ (b.Psi @ vectors).T))


def aliasing(b: Balance, x: FloatArray, force: FloatArray) -> FloatArray:
    """Largest change of the contact force with twice the samples, relative.

    Parameters
    ----------
    b : Balance
    x : (n, n_unknown) ndarray
        Answers.
    force : (n, n_point, 1 + d, size) ndarray
        Coefficients of their contact forces [N].

    Returns
    -------
    (n,) ndarray
        Change of the coefficients, relative to the largest of them.
    """
    E, Q = (of(b.harmonics, 2 * b.samples) for of in (synthesis, analysis))
    parts = [
        _change(b.marched(b.coefficients(x[part]), E).coefficients(Q), force[part])
        for part in portions(len(x))
    ]
    return np.concatenate([np.zeros(0), *parts])


def _change(force: FloatArray, known: FloatArray) -> FloatArray:
    """(n,) largest change of coefficients (n, n_point, 1 + d, size), over the largest of them."""
    size = np.abs(known).max(axis=(1, 2, 3))
    return np.asarray(np.abs(force - known).max(axis=(1, 2, 3)) / np.where(size > 0, size, np.inf))


def creep(b: Balance, x: FloatArray) -> FloatArray:
    """Change of the contact force in as many periods again, relative: where points slip in two
    directions, the traction across the slip settles over many periods.

    Parameters
    ----------
    b : Balance
    x : (n, n_unknown) ndarray
        Answers.

    Returns
    -------
    (n,) ndarray
        Change of the coefficients, relative to the largest of them.
    """
    parts = []
    for W in (b.coefficients(x[part]) for part in portions(len(x))):
        few, more = (b.marched(W, b.E, k * MOST_PERIODS).coefficients(b.Q) for k in (1, 2))
        parts.append(_change(few, more))
    return np.concatenate([np.zeros(0), *parts])


def portions(n: int) -> list[slice]:
    """Portions of many answers that keep the arrays of their marches small."""
    return [slice(i, i + PORTION) for i in range(0, n, PORTION)]


@dataclass(frozen=True)
class Measures:
    """What is measured on n solved points.

    Attributes
    ----------
    contact_displacement, contact_force : (n, n_point, 1 + d, size) ndarray
        Coefficients of the relative displacements [mm] and of the contact forces [N].
    state : (n, n_point, 3) ndarray
        Shares of the cycle in stick, slip, lift-off.
    energy : (n, n_point) ndarray
        Energy lost per cycle [N mm].
    periodic : (n,) ndarray of bool
        Whether the contact forces of every point came back to their start.
    truncation, aliasing : (n,) ndarray
        What harmonics left out and twice the samples would change, relative.
    """

    contact_displacement: FloatArray
    contact_force: FloatArray
    state: FloatArray
    energy: FloatArray
    periodic: NDArray[np.bool_]
    truncation: FloatArray
    aliasing: FloatArray


def measures(b: Balance, f: FloatArray, x: FloatArray) -> Measures:
    """What is measured on solved points.

    Parameters
    ----------
    b : Balance
    f : (n,) ndarray
        Frequencies [Hz].
    x : (n, n_unknown) ndarray
        Answers.

    Returns
    -------
    Measures
    """
    n_point = b.contacts.n_point
    W = b.coefficients(x)
    F, state = np.empty_like(W), np.empty((len(f), n_point, 3))
    periodic, left_out = np.empty(len(f), dtype=bool), np.empty(len(f))
    for part in portions(len(x)):
        found = b.marched(W[part], b.E)
        F[part] = found.coefficients(b.Q)
        periodic[part] = found.periodic.reshape(-1, n_point).all(axis=1)
        left_out[part] = truncation(b, f[part], x[part], found)
        for code in (STICK, SLIP, LIFT):
            state[part, :, code] = (found.state == code).mean(axis=-1)
    energy = loop_area(F, W, b.harmonics.offset, b.harmonics.dynamic, b.samples)
    return Measures(W, F, state, energy, periodic, left_out, aliasing(b, x, F))


def loop_area(
    F: FloatArray, W: FloatArray, offset: int, k: NDArray[np.int64], samples: int
) -> FloatArray:
    """Area of the loops of force over displacement, harmonic by harmonic,
    pi sum k (a_F b_W - b_F a_W); zero where it is rounding.

    A loop without area is a difference of equal products. Each coefficient of the force is a sum
    over the samples of a force no larger than sum |F|, so that the terms of the area add up to no
    more than pi sum k |F| |W|; their rounding is that times eps times the number of samples.

    Parameters
    ----------
    F, W : (n, n_point, 1 + d, size) ndarray
        Coefficients of the forces [N] and of the relative displacements [mm].
    offset : int
        Coefficients before those of the first of the harmonics `k`.
    k : (h,) ndarray
        Numbers of the harmonics above 0.
    samples : int
        Of a period, from which F was summed.

    Returns
    -------
    (n, n_point) ndarray
        [N mm]

    References
    ----------
    N. J. Higham, Accuracy and Stability of Numerical Algorithms (2002), ch. 3: errors of sums.
    """
    a, b = W[..., offset::2], W[..., offset + 1 :: 2]
    area = np.einsum("k,npck->np", k, F[..., offset::2] * b - F[..., offset + 1 :: 2] * a)
    terms = np.einsum("npc,k,npck->np", np.abs(F).sum(axis=-1), k, np.abs(a) + np.abs(b))
    return np.pi * np.where(np.abs(area) > samples * EPS * terms, area, 0.0)
