"""Peaks of a measured curve, whose noise makes local maxima of its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from upd.mesh import FloatArray

#: by how much a curve falls on both sides of a peak before it rises above it: to half the power
PROMINENCE = float(np.sqrt(2.0))
#: standard deviations that the median of a normal variable's modulus is
_MEDIAN = float(ndtri(0.75))
#: part of a peak's height above which its points make the parabola
_TOP = 0.9
#: fewest points of a parabola
_LEAST = 3


class MeasuredPeak(NamedTuple):
    """A peak of a measured curve.

    Attributes
    ----------
    frequency
        Hz.
    height
        In the unit of the magnitude.
    zeta
        Damping ratio by half power.
    sample
        Number of its highest point.
    """

    frequency: float
    height: float
    zeta: float
    sample: int


def noisy_peaks(
    frequency: ArrayLike, magnitude: ArrayLike, *, above: float = 0.1
) -> list[MeasuredPeak]:
    """Peaks from which the curve falls to half power on both sides, and by more than noise.

    Beside the highest one they rise above their valleys by more than the extremes of n independent
    errors are apart, 2 sqrt(2 ln n) standard deviations. These are of the constant part of the
    noise, from the median of the second differences d: median|d| / (0.6745 sqrt(6)).

    Each is the top of a parabola of 1 / magnitude^2 over frequency^2, by least squares through the
    points above 0.9 of the highest one (three at least): of a damped mode's receptance exactly,
    and noise averages out. Damping by half power,
    zeta = (f_2^2 - f_1^2) / (4 f^2), f_1 and f_2 where the curve first falls below 1/sqrt(2) of it.

    Parameters
    ----------
    frequency : (n,) array_like
        Hz, rising.
    magnitude : (n,) array_like
        Zero or more, any unit.
    above : float
        Peaks must reach this part of the highest magnitude.

    Returns
    -------
    list of MeasuredPeak
        By rising frequency; empty where none lies within the band.

    References
    ----------
    D. J. Ewins, Modal Testing: Theory, Practice and Application, 2nd ed. (2000), 4.3.

    Examples
    --------
    >>> import numpy as np
    >>> from upd.measured import noisy_peaks
    >>> f, f0, zeta = np.linspace(330.0, 350.0, 201), 340.0, 0.005
    >>> H = np.abs(f**2 / (f0**2 - f**2 + 2j * zeta * f0 * f))
    >>> noise = 1.0 + 0.02 * np.random.default_rng(1).standard_normal(len(f))
    >>> (peak,) = noisy_peaks(f, H * noise)
    >>> round(peak.frequency, 1), round(peak.zeta, 3)
    (340.0, 0.005)
    """
    # slow to import: only where it is called
    from scipy.signal import find_peaks, peak_prominences

    f, a = np.asarray(frequency, dtype=np.float64), np.asarray(magnitude, dtype=np.float64)
    level = np.log(np.maximum(a, np.finfo(float).tiny))
    top, _ = find_peaks(level, prominence=np.log(PROMINENCE))
    top = top[a[top] >= above * a.max(initial=0.0)]
    if len(top) > 1:
        rise = peak_prominences(a, top)[0]
        noise = 2.0 * np.sqrt(2.0 * np.log(len(a))) * _constant_noise(a)
        top = top[(rise >= noise) | (a[top] == a[top].max())]
    return [_refined(f, a, int(i)) for i in top]


def _constant_noise(a: FloatArray) -> float:
    """Standard deviation of the errors of (n,) samples of a smooth curve.

    The second difference of independent ones has six times their variance; of a normal variable the
    median of the modulus is 0.6745 standard deviations.
    """
    return float(np.median(np.abs(np.diff(a, 2))) / (_MEDIAN * np.sqrt(6.0)))


def _refined(f: FloatArray, a: FloatArray, i: int) -> MeasuredPeak:
    low, high = (_first_below(a, i, way, _TOP * a[i]) for way in (-1, 1))
    part = slice(min(low + 1, i - 1), max(high, i + 2))
    x, y = f[part] ** 2, (a[i] / a[part]) ** 2
    at, height = float(f[i]), float(a[i])
    if len(x) >= _LEAST:
        # about the top and by its width: the squares then are of one size
        span = float(np.ptp(x))
        curve, slope, least = np.polyfit((x - f[i] ** 2) / span, y, 2)
        step = -0.5 * slope / curve if curve > 0.0 else np.inf
        lowest = least + 0.5 * slope * step if np.isfinite(step) else 0.0
        square = f[i] ** 2 + step * span
        if x[0] <= square <= x[-1] and lowest > 0.0:
            at, height = float(np.sqrt(square)), float(a[i] / np.sqrt(lowest))
    sides = [_crossing(f, a, i, way, height / PROMINENCE) for way in (-1, 1)]
    return MeasuredPeak(at, height, 0.25 * (sides[1] ** 2 - sides[0] ** 2) / at**2, i)


def _first_below(a: FloatArray, i: int, way: int, level: float) -> int:
    """Number of the first sample below a level on one side of sample i, -1 or n without."""
    k = i
    while 0 <= k < len(a) and a[k] >= level:
        k += way
    return k


def _crossing(f: FloatArray, a: FloatArray, i: int, way: int, level: float) -> float:
    """Frequency at which the curve first falls below a level, 1 / a^2 linear in f^2 between two
    samples; NaN where the samples end before.
    """
    k = _first_below(a, i, way, level)
    if not 0 <= k < len(a):
        return float("nan")
    if k == i:
        return float(f[i])
    y0, y1 = (level / a[k - way]) ** 2, (level / a[k]) ** 2 if a[k] > 0.0 else np.inf
    share = (1.0 - y0) / (y1 - y0) if np.isfinite(y1) else 0.5
    x0, x1 = f[k - way] ** 2, f[k] ** 2
    return float(np.sqrt(x0 + share * (x1 - x0)))
