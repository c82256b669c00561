"""How large the noise of a measured curve is, from what a fit leaves of it.

References
----------
R. J. Carroll, D. Ruppert, Transformation and Weighting in Regression (1988), ch. 2, 3
(pseudo-likelihood of the variance); G. Schwarz, Ann. Statist. 6 (1978) 461.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from upd.mesh import FloatArray


class NoiseLevel(NamedTuple):
    """Standard deviation of a part: as a part of the value, and (m/s2)/N beside it."""

    relative: float
    constant: float


def noise_mix(r: FloatArray, size: FloatArray) -> float:
    """Share of the noise that is a part of the value, of the variance at the highest point.

    Least normal pseudo-likelihood of residuals r (parts, n) with variance s^2 v,
    v = (1 - mix) + mix size^2: n ln s^2 + sum ln v, s^2 = mean r^2 / v.

    Parameters
    ----------
    r : (parts, n) ndarray
        Residuals.
    size : (n,) ndarray
        Magnitudes over the highest.
    """
    square = (r**2).mean(axis=0)
    if not square.any():
        return 1.0

    def likelihood(mix: float) -> float:
        v = (1.0 - mix) + mix * size**2
        return float(len(v) * np.log(np.mean(square / v)) + np.log(v).sum())

    # down to a constant that is less than one of n parts of the variance at the lowest point, in
    # even steps of its logarithm
    low = float(2.0 * np.log(max(float(size.min()), np.finfo(float).eps)) - np.log(len(size)))
    found = minimize_scalar(
        lambda t: likelihood(float(-np.expm1(t))), bounds=(low, 0.0), method="bounded"
    )
    return float(-np.expm1(found.x))


def noise_of(r: FloatArray, magnitude: FloatArray, unknowns: float = 0.0) -> NoiseLevel:
    """Noise of a curve from residuals, as a part of the value or constant, both where the residuals
    show both: where the information criterion of Schwarz, -2 ln L + ln N for one more unknown, is
    lower.

    Parameters
    ----------
    r : (parts, n) ndarray
        Residuals of real and imaginary part, or of the magnitude, (m/s2)/N.
    magnitude : (n,) ndarray
        Of the fitted curve, (m/s2)/N.
    unknowns : float
        Fitted to it: so many values less are free.
    """
    top = float(magnitude.max())
    size = magnitude / top
    mix = _simplest(r, size, noise_mix(r, size))
    v = (1.0 - mix) + mix * size**2
    variance = float((r**2 / v).sum()) / max(r.size - unknowns, 1.0)
    return NoiseLevel(np.sqrt(variance * mix) / top, np.sqrt(variance * (1.0 - mix)))


def _simplest(r: FloatArray, size: FloatArray, mix: float) -> float:
    """1 or 0, noise as a part of the value or constant, where the mixture is no better by more than
    its unknown is worth.
    """
    square = (r**2).mean(axis=0)
    if not square.any():
        return mix

    def twice(share: float) -> float:
        v = np.maximum((1.0 - share) + share * size**2, np.finfo(float).tiny)
        return float(len(r) * (len(v) * np.log(np.mean(square / v)) + np.log(v).sum()))

    alone = min((1.0, 0.0), key=twice)
    return alone if twice(alone) <= twice(mix) + float(np.log(r.size)) else mix
