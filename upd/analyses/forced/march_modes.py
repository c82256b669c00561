"""Linear limits of what a time march is given: stuck modes, curves free and stuck."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from scipy.linalg import eigh

from upd.analyses.forced.excitation import Excitation
from upd.analyses.forced.linear_peaks import around_modes, exact_peaks
from upd.analyses.forced.measures import PEAKS_ABOVE, ComplexArray, PathPeak, StuckMode
from upd.analyses.forced.mode_peaks import ModePeak, ModeShapes, mode_words, numbered
from upd.analyses.forced.model import Array
from upd.hbm.interface_state import InterfaceModel
from upd.scene.forced_contact import SIDES, Side


def stuck_system(march: InterfaceModel) -> tuple[Array, Array, Array]:
    r"""Modes with every contact closed and sticking.

    With the relative motion held, f = G^-1 (B s - Phi q), and
    K = [[Lambda + Phi' G^-1 Phi, -Phi' G^-1 B], [-B' G^-1 Phi, B' G^-1 B]] on (q, s),
    M = diag(1, M_D).

    Parameters
    ----------
    march
        Its first two outputs are the tips along x.

    Returns
    -------
    frequency, shapes, tips
        (k,) Hz rising; (m, k) in the coordinates of the blades' modes; (2, k) of both tips.
    """
    m = len(march.frequency)
    both = np.hstack([-march.shapes, march.columns])
    force = np.linalg.solve(march.compliance, both)
    K = both.T @ force
    K[:m, :m] += np.diag(march.omega**2)
    M = np.eye(len(K))
    M[m:, m:] = march.mass
    values, shapes = eigh(0.5 * (K + K.T), M)
    tips = march.seen_modes[:2] @ shapes[:m] + march.seen_contact[:2] @ (force @ shapes)
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi), shapes[:m], tips


def stuck_modes_of(march: InterfaceModel, below: float) -> ModeShapes:
    """Stuck modes that move the tips along x, on the outputs behind the tips.

    Parameters
    ----------
    march
        Its first two outputs are the tips along x, the others coordinates of blades' modes.
    below
        Hz; modes above are left out.
    """
    frequency, shapes, tips = stuck_system(march)
    count, column, number, words = {True: 0, False: 0}, [], [], []
    for k, mode in enumerate(_told(frequency, tips, below)):
        if mode.axis == "x":
            count[mode.in_phase] += 1
            column.append(k)
            number.append(2 * count[mode.in_phase] - mode.in_phase)
            words.append(mode_words(count[mode.in_phase], mode.in_phase))
    rows = march.seen_modes[len(SIDES) :]
    return ModeShapes(np.eye(len(rows)), rows @ shapes[:, column], tuple(number), tuple(words))


def stuck_peaks_of(
    march: InterfaceModel, peaks: Sequence[PathPeak], below: float, excitation: Excitation
) -> list[ModePeak]:
    """Peaks of a stuck curve by the numbers of their modes.

    Parameters
    ----------
    below
        Hz; modes above have no number.
    excitation
        Of the curve.
    """
    if not peaks:
        return []
    f = excitation.lowest * np.array([one.frequency for one in peaks])
    motion = march.linear_response(f, excitation.read, stuck=True)[:, len(SIDES) :]
    return numbered(stuck_modes_of(march, below), peaks, motion)


def stuck_modes_list(march: InterfaceModel, below: float) -> list[StuckMode]:
    """Stuck modes below ``below`` Hz."""
    frequency, _, tips = stuck_system(march)
    return _told(frequency, tips, below)


def _told(frequency: Array, tips: Array, below: float) -> list[StuckMode]:
    size = np.abs(tips).max(axis=0)
    moved = size > PEAKS_ABOVE * size.max()
    return [
        StuckMode(float(f), "x" if x else "y", bool(tips[0, k] * tips[1, k] > 0.0))
        for k, (f, x) in enumerate(zip(frequency, moved, strict=True))
        if f < below
    ]


def linear_curves(
    march: InterfaceModel, frequency: Array, excitation: Excitation, *, stuck: bool
) -> tuple[Mapping[Side, ComplexArray], Mapping[Side, list[PathPeak]]]:
    """Accelerance of both blades per newton of F_E, (m/s2)/N, and its peaks, free or stuck.

    Parameters
    ----------
    frequency
        (n,) Hz, rising: the sweep.
    excitation
        What of the blades is excited.
    stuck
        Every node closed and sticking; else none touches.
    """
    at = stuck_system(march)[0] if stuck else np.sort(march.frequency)
    width = 2.0 * float(march.damping.max()) * at
    low, high, k = float(frequency[0]), float(frequency[-1]), excitation.lowest
    # a mode answers where the harmonic that is read meets it
    fine = around_modes(at / k, width / k, low, high)
    curve, moving = partial(_accelerance, march, stuck, excitation), excitation.free_blades
    rest = np.zeros(len(frequency), complex)
    return (
        {s: curve(j, frequency) if stuck or s in moving else rest for j, s in enumerate(SIDES)},
        {
            s: exact_peaks(partial(_size, curve, j), fine, frequency)
            if stuck or s in moving
            else []
            for j, s in enumerate(SIDES)
        },
    )


def _accelerance(
    march: InterfaceModel, stuck: bool, excitation: Excitation, blade: int, f: Array
) -> ComplexArray:
    f = excitation.lowest * f
    moved = march.linear_response(f, excitation.read, stuck=stuck)[:, blade]
    return np.asarray(-((2.0 * np.pi * f) ** 2) * 1e-3 * moved)


def _size(curve: partial[ComplexArray], k: int, f: Array) -> Array:
    return np.asarray(np.abs(curve(k, f)))
