"""Residuals of the balance over one parameter, and the size of its unknowns.

The bridge between the mechanics and the continuation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.newton import Function, Scale
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.jacobian import BalanceJacobian
from upd.linalg.compiled import compiled

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)
#: arclength unit of frequency, as a share of the mean frequency: a resonance of a few per cent is
#: one unit wide
FREQUENCY_SHARE = 0.05
#: smallest mean displacement, relative to what the static loads cause, that is converged to its own
#: size
STATIC_SHARE = 1e-5
#: smallest motion, relative to the mean displacement, that is converged to its own size
SMALL_MOTION = 1e-3


def over_frequency(b: Balance) -> Function:
    """Residual over frequency for the continuation.

    Parameters
    ----------
    b : Balance

    Returns
    -------
    callable
        (x, frequency [Hz], with Jacobian) -> residual, Jacobian or None, derivative by the
        frequency.
    """

    def function(
        x: FloatArray, f: float, jacobian: bool
    ) -> tuple[FloatArray, BalanceJacobian | None, FloatArray]:
        residual, parts, slope = b.linearised(x, 2 * np.pi * f, jacobian)
        return residual, parts, 2 * np.pi * slope

    return function


def over_load(b: Balance, frequency: float) -> Function:
    """Residual over a factor on the dynamic loads at one frequency; linear in the factor.

    Parameters
    ----------
    b : Balance
    frequency : float
        [Hz]

    Returns
    -------
    callable
        (x, factor, with Jacobian) -> residual, Jacobian or None, derivative by the factor.
    """
    omega = 2 * np.pi * frequency
    none = b.unexcited()
    zero = np.zeros(b.size)
    slope = b.linearised(zero, omega, False)[0] - none.linearised(zero, omega, False)[0]

    def function(
        x: FloatArray, s: float, jacobian: bool
    ) -> tuple[FloatArray, BalanceJacobian | None, FloatArray]:
        residual, parts, _ = none.linearised(x, omega, jacobian)
        return residual + s * slope, parts, slope

    return function


def scale_of(b: Balance, least: FloatArray | None = None) -> Scale:
    """Units of the unknowns for the continuation: a path is measured by the energy of the springs.

    Every contact p with the largest coefficient m_p and the stiffness kappa_p = k_n + k_t counts in
    the length of a change dw with its share of the energy,

        |dw|^2 = sum_p kappa_p |dw_p|^2 / sum_p kappa_p m_p^2,

    so that a contact cut into parts, kappa_p with it, counts as before: the unit of its unknowns is
    their `sizes_of` times sqrt(sum_q kappa_q (m_q/m)^2 / kappa_p), m the largest m_q.

    Parameters
    ----------
    b : Balance
    least : (n_unknown,) ndarray, optional
        An answer of typical size that keeps the unit when the solution starts from rest.

    Returns
    -------
    callable
        x (n_unknown,) -> units (n_unknown,).
    """
    law = b.contacts.law
    kappa = (law.k_n + law.k_t) / float((law.k_n + law.k_t).max())
    return _sized(b, least, kappa)


def sizes_of(b: Balance) -> Scale:
    """Sizes of the unknowns.

    The largest mean displacement, the largest dynamic one and the rigid amplitudes, each measured
    by its own.

    Parameters
    ----------
    b : Balance

    Returns
    -------
    callable
        x (n_unknown,) -> sizes (n_unknown,).
    """
    return _sized(b, None, np.zeros(0))


def _sized(b: Balance, least: FloatArray | None, kappa: FloatArray) -> Scale:
    o, rigid = b.harmonics.offset, b.rigid
    # the motion below which the unit stays: that of a typical answer, or one that does not matter
    floor = _floor(b) if least is None else float(np.abs(b.split(least)[0]).max())
    # the mean is a difference of static terms: below their rounding, as the tolerance magnifies it,
    # it is not resolved
    resolved = STATIC_SHARE * float(np.abs(b.u0).max(initial=0.0))
    rigid_rows = float(np.abs(b.Psi[:, b.modal.rigid]).max(initial=0.0)) or 1.0

    def scale(x: FloatArray) -> FloatArray:
        D: FloatArray = _units(b.split(x)[0], kappa, o, floor, resolved, rigid_rows, rigid)
        return D

    return scale


@compiled
def _units(W, kappa, o, floor, resolved, rigid_rows, rigid):  # type: ignore[no-untyped-def]
    """Sizes of all unknowns, of those of each contact by its share of the energy if `kappa`."""
    n_point, d1, size = W.shape
    each, mean = np.zeros(n_point), 0.0
    for p in range(n_point):
        for i in range(d1):
            for m in range(o):
                mean = max(mean, abs(W[p, i, m]))
            for m in range(o, size):
                each[p] = max(each[p], abs(W[p, i, m]))
    moving = each.max()
    still = max(mean, moving, floor, resolved)
    # a motion far below the mean displacement is measured by its own size as far as the rounding of
    # the mean lets it
    moves = max(moving, SMALL_MOTION * mean, floor)
    energy, most = 0.0, max(moving, floor)
    for p in range(len(kappa)):
        energy += kappa[p] * (max(each[p], floor) / most) ** 2
    D = np.empty(n_point * d1 * size + rigid)
    place = 0
    for p in range(n_point):
        share = np.sqrt(energy / kappa[p]) if len(kappa) > 0 else 1.0
        for _ in range(d1):
            for m in range(size):
                D[place] = share * (still if m < o else moves)
                place += 1
    D[place:] = still / rigid_rows
    return D


def _floor(b: Balance) -> float:
    """A displacement below which nothing matters.

    Rounding of the motions the loads cause across the contact springs.
    """
    k = float(max(b.contacts.law.k_t.max(), b.contacts.law.k_n.max()))
    force = max(
        float(np.abs(b.static).max()),
        float(np.abs(b.dynamic).max()),
        float(b.contacts.law.preload.max()),
    )
    return float(max(1e4 * EPS * force / k, float(np.finfo(float).tiny) ** 0.5))


def over_preload(b: Balance, frequency: float, P: FloatArray) -> Function:
    """Residual over q, with (1 - q) P more preload balanced by as much static load.

    q = 0 sticks when P is enough, q = 1 is the problem.

    Parameters
    ----------
    b : Balance
    frequency : float
        [Hz]
    P : (n_point,) ndarray
        Extra preload [N].

    Returns
    -------
    callable
        (x, q, with Jacobian) -> residual, Jacobian or None, derivative by q.
    """
    omega = 2 * np.pi * frequency

    def function(
        x: FloatArray, q: float, jacobian: bool
    ) -> tuple[FloatArray, BalanceJacobian | None, FloatArray]:
        residual, parts, _ = b.pressed((1 - q) * P).linearised(x, omega, jacobian)
        h = EPS ** (1 / 3)
        if not jacobian:
            return residual, None, np.zeros(b.size)
        up, down = (b.pressed((1 - q - d) * P).linearised(x, omega, False)[0] for d in (h, -h))
        return residual, parts, (up - down) / (2 * h)

    return function
