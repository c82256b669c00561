"""Weights of measured curves in a fit: stated half-widths, or 95 % ones estimated from what the fit
leaves.

With residuals r of N values and p inputs, the noise sigma^2 = (a |H|)^2 + b^2 follows by
`upd.measured.noise` and the half-width is t sigma, t of Student's distribution with N - p degrees
of freedom at 95 %. It holds for independent errors: what the curve has and the model has not makes
neighbouring residuals alike, and `CurveNoise.correlation` shows it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from upd.fitting.targets import CurveTarget
from upd.measured.noise import noise_of

Array = NDArray[np.float64]
#: probability with which an estimated half-width holds
PROBABILITY = 0.95


@dataclass(frozen=True)
class CurveNoise:
    """How well a measured curve is taken to be known.

    Attributes
    ----------
    relative, constant
        Half-width of a part: of the value, and (m/s2)/N.
    estimated
        Whether from the residuals of the fit.
    correlation
        Of residuals of neighbouring points over their half-widths, 0 for independent errors.
    limit
        Three standard deviations of it for independent errors.
    rms
        Of the residuals, over the half-widths.
    rounding
        Whether the residuals are no more than what the model itself is off.
    """

    relative: float
    constant: float
    estimated: bool
    correlation: float = 0.0
    limit: float = 1.0
    rms: float = 0.0
    rounding: bool = False

    @property
    def white(self) -> bool:
        """Whether the residuals may be independent errors, or are rounding."""
        return self.rounding or abs(self.correlation) <= self.limit


def first_noise(target: CurveTarget) -> CurveNoise:
    """Before any fit: as stated, else each point by its own size."""
    if target.stated:
        return CurveNoise(target.relative or 0.0, target.constant or 0.0, False)
    # down to where differences of the highest are rounding
    floor = float(np.finfo(float).eps ** 0.5 * target.curve.magnitude.max())
    return CurveNoise(1.0, floor, True)


def as_complex(target: CurveTarget, parts: Array) -> NDArray[np.complex128]:
    """Values from their parts (real, then imaginary; or magnitudes) along the first axis."""
    if not target.curve.is_complex:
        return parts.astype(complex)
    real, imaginary = np.split(parts, 2)
    return np.asarray(real + 1j * imaginary)


def magnitude_of(target: CurveTarget, parts: Array) -> Array:
    """(n,) of a computed curve."""
    return np.abs(as_complex(target, parts))


def noise_after(
    target: CurveTarget, parts: Array, unknowns: float, free: int, least: float
) -> CurveNoise:
    """From what a fit leaves.

    Parameters
    ----------
    parts
        Of the fitted curve.
    unknowns
        Inputs that were fitted to this curve.
    free
        Values of all targets less inputs.
    least
        Part of a value that the model itself is off.
    """
    r = (parts - target.values).reshape(target.parts, -1)
    size = magnitude_of(target, parts)
    if target.stated:
        relative, constant = target.relative or 0.0, target.constant or 0.0
    else:
        found = noise_of(r, size, unknowns)
        factor = float(student.ppf(0.5 * (1.0 + PROBABILITY), max(free, 1)))
        relative, constant = factor * max(found.relative, least), factor * found.constant
    u = r / np.hypot(relative * size, constant)
    square = float((u**2).sum())
    near = float((u[:, 1:] * u[:, :-1]).sum()) / max(square, np.finfo(float).tiny)
    limit = 3.0 / np.sqrt(u.size)
    rms = float(np.sqrt(square / u.size))
    left = float(np.linalg.norm(r) / np.linalg.norm(size))
    stated = target.stated
    return CurveNoise(relative, constant, not stated, near, float(limit), rms, left <= least)
