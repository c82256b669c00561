"""What an answer left out, measured afterwards: sticking proven, harmonics truncated, samples folded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upd.hbm.balance import Balance
from upd.hbm.contacts import stuck_constant, stuck_stiffness
from upd.hbm.fourier import Harmonics, analysis, harmonics, synthesis, to_complex
from upd.hbm.friction import harmonic_force, march

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)


def stuck_points(b: Balance, omega: FloatArray) -> NDArray[np.bool_]:
    """Frequencies (n,) where the linear stuck answer keeps |T| <= mu N and N > 0 at every sample: there it solves the balance exactly."""
    k, constant = stuck_stiffness(b.contacts), stuck_constant(b.contacts)
    # the friction cone is convex: a mean force outside it puts a sample outside at every frequency
    mean = b.split(b.stuck(float(omega[0])))[0][..., 0] * k + constant if b.harmonics.static else constant
    held = b.contacts.law.mu * mean[:, 0]
    if np.any(np.hypot.reduce(mean[:, 1:], axis=1) > held + 1e3 * EPS * np.abs(held)):
        return np.zeros(len(omega), dtype=bool)
    return np.array([sticking_margin(b, b.stuck(float(w))) >= 1 for w in omega])


def sticking_margin(b: Balance, x: FloatArray) -> float:
    """Smallest mu N/|T| over the cycle of the stuck answer x (n_unknown,): it is exact from 1 up; 0 where a contact opens."""
    motion = b.split(x)[0] @ b.E.T
    force = stuck_stiffness(b.contacts)[..., None] * motion + stuck_constant(b.contacts)[..., None]
    N, T = force[:, 0], np.sqrt((force[:, 1:] ** 2).sum(axis=1))
    if np.any(N <= 0):
        return 0.0
    held = b.contacts.law.mu[:, None] * N
    return float(np.min(held[T > 0] / T[T > 0], initial=np.inf))


def missing(h: Harmonics) -> Harmonics:
    """Harmonics that are not in the set, up to twice its highest plus three."""
    return harmonics(k for k in range(1, 2 * h.highest + 4) if k not in h.numbers)


def truncation(b: Balance, frequency: FloatArray, x: FloatArray) -> FloatArray:
    """Largest contact motion that the harmonics left out of the force would cause, relative to the contact motion, (n,)."""
    rest = missing(b.harmonics)
    Q, out = analysis(rest, b.samples) if b.samples > 2 * rest.highest else analysis(rest, 4 * rest.highest), np.zeros(len(x))
    E = synthesis(b.harmonics, Q.shape[1])
    zero = np.zeros((len(rest.dynamic), len(b.modal.eigenvalues)), dtype=complex)
    for i, row in enumerate(x):
        W = b.split(row)[0]
        force = march(b.contacts.law, np.ascontiguousarray(W @ E.T), E, start=b.start, slider=b.slider, jacobian=False).force
        F = to_complex((force @ Q.T).reshape(len(b.Psi), -1), rest)
        G, *_ = b.modal.receptance(b.Psi, 2 * np.pi * frequency[i] * rest.dynamic, zero)
        motion = np.einsum("kcd,dk->ck", G, F)
        size = float(np.abs(to_complex(W, b.harmonics)).max())
        # the force of the motion added would bring most of it back: springs in series with the structure
        k = stuck_stiffness(b.contacts).ravel()
        motion /= 1 + np.abs(np.einsum("kcc->ck", G)) * k[:, None]
        out[i] = float(np.abs(motion).max()) / size if size > 0 else 0.0
    return out


def aliasing(b: Balance, x: FloatArray, force: FloatArray) -> FloatArray:
    """Largest change of the contact force coefficients with twice the samples, relative to the largest of them, (n,)."""
    E, Q, out = synthesis(b.harmonics, 2 * b.samples), analysis(b.harmonics, 2 * b.samples), np.zeros(len(x))
    for i, row in enumerate(x):
        finer = harmonic_force(b.contacts.law, b.split(row)[0], E, Q, start=b.start, slider=b.slider, jacobian=False).force
        size = float(np.abs(force[i]).max())
        out[i] = float(np.abs(finer - force[i]).max()) / size if size > 0 else 0.0
    return out
