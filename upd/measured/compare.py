"""Peaks of a measured curve, whose noise makes local maxima of its own, and how much a computed
curve is like a measured one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment
from scipy.special import ndtri

from upd.errors import InputError
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
    noise, from the median of the second differences d: median|d| / (0.6745 sqrt(6)). A second
    difference of independent errors has six times their variance; of a normal variable the median
    of the modulus is 0.6745 standard deviations.

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
        deviation = np.median(np.abs(np.diff(a, 2))) / (_MEDIAN * np.sqrt(6.0))
        noise = 2.0 * np.sqrt(2.0 * np.log(len(a))) * deviation
        top = top[(rise >= noise) | (a[top] == a[top].max())]
    return [_refined(f, a, int(i)) for i in top]


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


# -- likeness --------------------------------------------------------------------------------------


def frac(measured: ArrayLike, computed: ArrayLike) -> float:
    r"""Frequency response assurance criterion of two complex responses at the same frequencies.

    FRAC = |sum_k conj(H_m) H_c|^2 / (sum_k |H_m|^2 sum_k |H_c|^2)

    1 where they differ by a factor only, which it does not see: compare heights beside it.

    Of magnitudes alone, for curves without phase, it is no FRAC but the correlation of [3]_: phases
    that differ do not lower it, so it is the larger of the two, and closer to 1 for unlike curves.

    Parameters
    ----------
    measured, computed : (n,) array_like of complex
        Any one unit each.

    Returns
    -------
    float
        0 to 1.

    Raises
    ------
    InputError
        For other shapes, or a response that is zero throughout.

    References
    ----------
    .. [1] W. Heylen, S. Lammens, FRAC: a consistent way of comparing frequency response
       functions, Proc. Int. Conf. Identification in Engineering Systems, Swansea (1996), 48-57.
    .. [2] W. Heylen, P. Avitabile, Correlation considerations - part 5 (degree of freedom
       correlation techniques), Proc. 16th Int. Modal Analysis Conf. (1998), 207-214.
    .. [3] C. Zang, H. Grafe, M. Imregun, Frequency-domain criteria for correlating and updating
       dynamic finite element models, Mech. Syst. Signal Process. 15 (2001), 139-155.

    Examples
    --------
    >>> from upd.measured import frac
    >>> frac([1.0, 2j], [2.0, 4j])
    1.0
    >>> frac([1.0, 2j], [2.0, -4j])
    0.36
    """
    a, b = np.asarray(measured, complex), np.asarray(computed, complex)
    if a.ndim != 1 or a.shape != b.shape:
        raise InputError(
            f"FRAC takes two responses (n,) at the same frequencies; got {a.shape} and {b.shape}."
        )
    power = float(np.vdot(a, a).real) * float(np.vdot(b, b).real)
    if not power > 0.0:
        raise InputError("FRAC of a response that is zero throughout is not defined.")
    return float(abs(np.vdot(a, b)) ** 2 / power)


def paired(measured: Sequence[float], computed: Sequence[float]) -> dict[int, int]:
    """Which of the measured peaks each computed one is: computed place -> measured place.

    One to one, with the least sum of |ln(f_c / f_m)|.

    Parameters
    ----------
    measured, computed
        Hz.
    """
    if not len(measured) or not len(computed):
        return {}
    m, c = np.asarray(measured, float), np.asarray(computed, float)
    rows, columns = linear_sum_assignment(np.abs(np.log(c[:, None] / m[None, :])))
    return {int(i): int(j) for i, j in zip(rows, columns, strict=True)}


def on_path(
    at: NDArray[np.float64], frequency: NDArray[np.float64], values: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """A path in frequency read at (k,) frequencies, by straight lines of real and imaginary part.

    Parameters
    ----------
    at
        (k,) Hz.
    frequency, values
        (n,) along the path, which may turn back.

    Returns
    -------
    (k,) ndarray
        NaN where the path has no value, or several.
    """
    low, high = frequency[:-1] <= at[:, None], frequency[1:] <= at[:, None]
    passed = low != high
    k = passed.argmax(axis=1)
    share = (at - frequency[k]) / np.where(passed.any(axis=1), np.diff(frequency)[k], 1.0)
    found = values[k] + share * (values[k + 1] - values[k])
    # a highest frequency is passed by none, or twice where the path turns
    last = at == frequency[-1]
    found = np.where(last & ~passed.any(axis=1), values[-1], found)
    one = (passed.sum(axis=1) == 1) | (last & (passed.sum(axis=1) == 0))
    return np.asarray(np.where(one, found, np.nan))
