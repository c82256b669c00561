"""Peaks of a forced response by the mode that moves, not by their order in frequency.

A number of a peak is the number of a stuck mode of both blades with the damper: 1 is the lowest
in which the tips move in phase, 2 the lowest out of phase, 3 and 4 the next of each. It stays the
mode's own where two peaks cross as a parameter changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from upd.analyses.forced import measures
from upd.analyses.forced.measures import ComplexArray, CurvePeak, StuckMode
from upd.analyses.forced.model import Array, Model
from upd.hbm import FrequencyResponse
from upd.hbm.core.fourier import to_complex

#: share of the motion above which a mode has more than all others together
MAJORITY = 0.5
#: modes up to so many times the highest frequency of a sweep are found in it
CANDIDATES = 2.0


@dataclass(frozen=True)
class ModeShapes:
    """Stuck modes that move the tips along x.

    Attributes
    ----------
    M
        (n, n) of both blades and the damper, t.
    shape
        (n, m) orthonormal in M.
    number, words
        (m,) of each mode.
    """

    M: Array
    shape: Array
    number: tuple[int, ...]
    words: tuple[str, ...]


def mode_shapes(model: Model, below: float) -> ModeShapes:
    """The stuck modes along x below ``below`` Hz, numbered by the phase of the tips."""
    M, values, shapes = measures.stuck_shapes(model)
    return shapes_along_x(M, shapes, measures.tell_modes(model, values, shapes, below))


def shapes_along_x(M: Array, shapes: Array, modes: Sequence[StuckMode]) -> ModeShapes:
    """Of shapes (n, k), the first of which are these modes, those along x, numbered."""
    count, column, number, words = {True: 0, False: 0}, [], [], []
    for j, mode in enumerate(modes):
        if mode.axis == "x":
            count[mode.in_phase] += 1
            k = count[mode.in_phase]
            column.append(j)
            number.append(2 * k - mode.in_phase)
            kind = "in phase" if mode.in_phase else "out of phase"
            words.append(kind + (f" {k}" if k > 1 else ""))
    return ModeShapes(M, shapes[:, column], tuple(number), tuple(words))


def motion_shares(M: Array, motion: ComplexArray, shape: Array) -> Array:
    """Modal assurance criterion, mass-weighted, of motions and modes.

    MAC = |phi^T M z|^2 / ((phi^T M phi) (z^H M z)). With modes orthonormal in M it is the share of
    the mode in the kinetic energy of the harmonic z, and the shares of all modes sum to 1.

    Parameters
    ----------
    M
        (n, n) mass.
    motion
        (n_peak, n) complex amplitudes z.
    shape
        (n, n_mode) modes phi.

    Returns
    -------
    Array
        (n_peak, n_mode), 0 to 1.

    References
    ----------
    R. J. Allemang, The modal assurance criterion - twenty years of use and abuse, Sound and
    Vibration 37 (2003), eq. 1, with M as weight.
    """
    MZ = motion @ M
    energy = np.einsum("pi,pi->p", motion.conj(), MZ).real
    modal = np.einsum("ij,ik,kj->j", shape, M, shape)
    return np.asarray(np.abs(MZ @ shape) ** 2 / (energy[:, None] * modal))


def tell_apart(share: Array, height: Array) -> dict[int, int]:
    """Which maximum of a curve is the peak of which mode.

    A mode that has more than half of the motion at a maximum has more than all others together:
    the maximum is its own, and the highest of its own is its peak. Maxima in which no mode has so
    much go to the modes left over, by the assignment with the largest sum of MAC.

    Parameters
    ----------
    share
        (n_maximum, n_mode) MAC.
    height
        (n_maximum,).

    Returns
    -------
    dict
        Mode -> maximum, each at most once.
    """
    own = share > MAJORITY
    found = {
        int(mode): int(max(np.flatnonzero(own[:, mode]), key=lambda k: height[k]))
        for mode in np.flatnonzero(own.any(axis=0))
    }
    unclear = np.flatnonzero(~own.any(axis=1))
    left = np.array([mode for mode in range(share.shape[1]) if mode not in found], int)
    rows, columns = linear_sum_assignment(share[np.ix_(unclear, left)], maximize=True)
    return found | {int(left[j]): int(unclear[i]) for i, j in zip(rows, columns, strict=True)}


def numbered_peaks(
    model: Model, answer: FrequencyResponse, height: Array, stop: float
) -> list[CurvePeak]:
    """Peaks of a path by the numbers of their modes.

    Parameters
    ----------
    model
        Of the rig.
    answer
        The path.
    height
        (n,) what has peaks along it.
    stop
        End of the sweep, Hz.
    """
    maxima = measures.path_maxima(answer.frequency, height)
    if not maxima:
        return []
    motion = first_harmonic(answer, np.array([one.sample for one in maxima]))
    if not answer.arrived:
        # where a path turns round it has a maximum that is no resonance
        on = in_quadrature(model, motion)
        maxima, motion = [one for one, keep in zip(maxima, on, strict=True) if keep], motion[on]
    return numbered(mode_shapes(model, CANDIDATES * stop), maxima, motion)


def numbered(
    modes: ModeShapes, maxima: Sequence[CurvePeak], motion: ComplexArray
) -> list[CurvePeak]:
    """Peaks by the number of their mode.

    Parameters
    ----------
    maxima
        Of a curve.
    motion
        (n_maximum, n) complex amplitude of all dofs at each.
    """
    if not maxima:
        return []
    share = motion_shares(modes.M, motion, modes.shape)
    found = tell_apart(share, np.array([one.height for one in maxima]))
    named = [
        maxima[i]._replace(number=modes.number[j], mode=modes.words[j], mac=float(share[i, j]))
        for j, i in found.items()
    ]
    return sorted(named, key=lambda peak: peak.number)


def first_harmonic(answer: FrequencyResponse, points: NDArray[np.int64]) -> ComplexArray:
    """Amplitudes (m, n_dof) of all dofs at some points of a path, lowest harmonic excited, mm."""
    j = measures.read_place(answer.balance)
    found = [to_complex(answer.coefficients[i], answer.harmonics)[:, j] for i in points]
    return np.asarray(found)


def in_quadrature(model: Model, motion: ComplexArray) -> NDArray[np.bool_]:
    """Whether motions lie within the half-power band of a resonance.

    The displacement that the forces do work on, f^H z. Of one mode it is
    |phi^T f|^2 / (w_r^2 - w^2 + 2 i zeta w_r w): out of phase with the force by 90 degrees at the
    resonance, and by 45 and 135, where real and imaginary part are equal, at half its power.

    Parameters
    ----------
    motion
        (m, n) amplitudes of all dofs.

    Returns
    -------
    NDArray
        (m,) of bool.

    References
    ----------
    D. J. Ewins, Modal Testing: Theory, Practice and Application, 2nd ed. (2000), 4.2.
    """
    driven = motion[:, : len(model.force)] @ model.force.conj()
    return np.asarray(np.abs(driven.imag) >= np.abs(driven.real))


def stuck_motion(model: Model, frequency: Array) -> ComplexArray:
    """Amplitudes (m, n_dof) of all dofs with every point stuck, mm per newton of F_E, in the lowest
    harmonic that is excited.
    """
    M, C, K, _ = model.linear(stuck=True)
    force = np.concatenate([model.force, np.zeros(len(M) - len(model.force))])
    omega = 2.0 * np.pi * model.excitation.lowest * np.asarray(frequency)
    return np.array([np.linalg.solve(K + 1j * w * C - w**2 * M, force) for w in omega])


def unmoved(peaks: Sequence[CurvePeak]) -> list[CurvePeak]:
    """Peaks of a curve of no stuck mode, numbered by frequency."""
    return [peak._replace(number=k) for k, peak in enumerate(peaks, 1)]


def tell_stuck_peaks(model: Model, peaks: Sequence[CurvePeak], stop: float) -> list[CurvePeak]:
    """Peaks of a stuck curve by the numbers of their modes.

    Parameters
    ----------
    stop
        End of the sweep, Hz.
    """
    if not peaks:
        return []
    motion = stuck_motion(model, np.array([one.frequency for one in peaks]))
    return numbered(mode_shapes(model, CANDIDATES * stop), peaks, motion)
