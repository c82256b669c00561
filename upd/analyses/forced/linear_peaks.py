"""Peaks of the linear limits, free and stuck, sought around their own modes: they do not depend on
the frequencies asked for.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import minimize_scalar

from upd.analyses.forced import measures
from upd.analyses.forced.measures import Array, Balanced, PathPeak, chosen_peaks
from upd.hbm.balance import Balance
from upd.hbm.contact_points import stuck_stiffness

#: half-power widths on each side of a mode in which its peak is sought, and of a width between two
#: points there
_WIDTHS, QUARTER = 3, 0.25


def linear_modes(balance: Balance, stuck: bool) -> tuple[Array, Array]:
    """Natural frequencies and half-power widths without contacts or with all points stuck.

    In the mass-normalised modes of the system without contacts, K = Lambda + Psi^T k Psi and
    C = Phi^T C Phi. A mode v of it, w^2 = v^T K v, has the width 2 zeta f = v^T C v / (2 pi).

    Returns
    -------
    frequency, width
        (m,) Hz, rising; widths as if the damping did not couple the modes.

    References
    ----------
    D. J. Ewins, Modal Testing: Theory, Practice and Application, 2nd ed. (2000), 2.4 and 4.2.
    """
    modal, Psi = balance.modal, balance.Psi
    k = stuck_stiffness(balance.contacts).ravel() if stuck else np.zeros(len(Psi))
    values, shapes = eigh(np.diag(modal.eigenvalues) + Psi.T @ (k[:, None] * Psi))
    C = np.diag(modal.damping) if modal.proportional else modal.damping
    width = np.einsum("ij,ik,kj->j", shapes, C, shapes) / (2.0 * np.pi)
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi), np.maximum(width, 0.0)


def around_modes(frequency: Array, width: Array, start: float, stop: float) -> Array:
    """Frequencies (n,) from start to stop in Hz that pass every mode in steps of a quarter of its
    half-power width.
    """
    steps = np.linspace(-_WIDTHS, _WIDTHS, round(2 * _WIDTHS / QUARTER) + 1)
    near = (frequency[:, None] + width[:, None] * steps).ravel()
    inside = near[(near > start) & (near < stop)]
    return np.unique(np.concatenate([[start], inside, [stop]]))


def finer(frequency: Array, modes: Array, width: Array) -> Array:
    """Frequencies of a sweep, and around every mode that they are too coarse for, further apart
    than a quarter of its half-power width, such ones.

    Between coarser ones a curve has peaks that no point shows, and contact points begin to slip
    unseen.

    Parameters
    ----------
    frequency
        (n,) Hz, rising.
    modes, width
        (m,) Hz.
    """
    if len(frequency) < 2:
        return frequency
    place = np.clip(np.searchsorted(frequency, modes) - 1, 0, len(frequency) - 2)
    coarse = np.diff(frequency)[place] > QUARTER * width
    ends = float(frequency[0]), float(frequency[-1])
    return np.union1d(frequency, around_modes(modes[coarse], width[coarse], *ends))


def exact_peaks(height: Callable[[Array], Array], f: Array, grid: Array) -> list[PathPeak]:
    """The peaks of a curve, each by a local search between its neighbours.

    Parameters
    ----------
    height
        Of the curve at any frequencies (n,) in Hz.
    f
        (n,) Hz, rising, fine enough to hold every peak.
    grid
        (m,) Hz on which the curve is kept: the point next to a peak is one of these.
    """
    a = height(f)
    found = [
        _top(height, f[i - 1], f[i + 1])
        for i in np.flatnonzero((a[1:-1] > a[:-2]) & (a[1:-1] >= a[2:])) + 1
    ]
    highest = max([float(a.max(initial=0.0)), *(top for _, top in found)])
    peaks = [
        PathPeak(at, top, int(np.abs(grid - at).argmin()))
        for at, top in found
        if top >= measures.PEAKS_ABOVE * highest
    ]
    return chosen_peaks(peaks)


def _top(height: Callable[[Array], Array], low: float, high: float) -> tuple[float, float]:
    # flat at the top: to half of the digits of f, of the height lacks (eps^1/2 f / width)^2
    found = minimize_scalar(
        lambda f: -float(height(np.array([f]))[0]),
        bounds=(low, high),
        method="bounded",
        options={"xatol": float(np.sqrt(np.finfo(float).eps)) * high},
    )
    return float(found.x), -float(found.fun)


def linear_peaks(
    answer: Balanced, row: Array, force: float, grid: Array, stuck: bool
) -> list[PathPeak]:
    """Peaks of the accelerance without contacts or with all points stuck.

    Parameters
    ----------
    row
        (n_dof,) output.
    force
        Excitation of the answer, N.
    grid
        (n,) Hz, rising: the sweep.
    stuck
        All points closed and sticking; else without contacts.

    Returns
    -------
    list of PathPeak
        At most the two highest within the sweep, by rising frequency; heights in (m/s2)/N.
    """
    # a mode answers where the harmonic that is read meets it
    k = measures.read_harmonic(answer)
    modes, width = linear_modes(answer.balance, stuck)

    def height(f: NDArray[np.float64]) -> Array:
        return np.abs(measures.linear_accelerance(answer, row, force, f, stuck))

    f = around_modes(modes / k, width / k, float(grid[0]), float(grid[-1]))
    return exact_peaks(height, f, grid)
