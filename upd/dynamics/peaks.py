"""Resonance peaks of a sampled response: frequency, height, damping by half power."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from upd.errors import InputError
from upd.labels import Shown
from upd.mesh import FloatArray, IntArray


@dataclass(frozen=True, repr=False)
class Peaks(Shown):
    """Resonance peaks, lowest frequency first.

    Attributes
    ----------
    frequency : (p,) ndarray
        Frequencies [Hz].
    height : (p,) ndarray
        In the unit of the magnitude.
    zeta : (p,) ndarray
        Damping ratio by half power, NaN where a side does not fall to 1/sqrt(2) before it rises
        again or the samples end.
    sample : (p,) ndarray of int
        Number of the highest sample of each.
    """

    frequency: FloatArray
    height: FloatArray
    zeta: FloatArray
    sample: IntArray


def find_peaks(frequency: ArrayLike, magnitude: ArrayLike, *, above: float = 0.0) -> Peaks:
    """Local maxima of a sampled response.

    Refined by a parabola of 1 / magnitude^2 over frequency^2 through three samples: exact for the
    receptance of one damped mode, whose inverse square is that parabola; the half-power points are
    where it doubles. Samples must be finer than the peak's width.

    Parameters
    ----------
    frequency : (n_f,) array_like
        Rising frequencies [Hz].
    magnitude : (n_f,) array_like
        Modulus of the response, any unit.
    above : float
        Peaks must reach this part of the highest magnitude.

    Returns
    -------
    Peaks

    Raises
    ------
    InputError
        For other shapes, frequencies that do not rise, or a negative magnitude.

    References
    ----------
    D. J. Ewins, Modal Testing, 4.3 (half power).

    Examples
    --------
    One mode of 100 Hz and 1 % damping: its receptance is highest at f sqrt(1 - 2 zeta^2).

    >>> import numpy as np
    >>> from upd.dynamics import find_peaks
    >>> f, f0, zeta = np.linspace(90.0, 110.0, 81), 100.0, 0.01
    >>> H = 1.0 / (f0**2 - f**2 + 2j * zeta * f0 * f)
    >>> peaks = find_peaks(f, np.abs(H))
    >>> bool(np.isclose(peaks.frequency[0], f0 * np.sqrt(1 - 2 * zeta**2), rtol=1e-9))
    True
    >>> peaks.zeta.round(4).tolist()
    [0.01]
    """
    f, a = np.asarray(frequency, dtype=np.float64), np.asarray(magnitude, dtype=np.float64)
    if (
        f.ndim != 1
        or a.shape != f.shape
        or not (np.diff(f) > 0.0).all()
        or not np.isfinite(a).all()
        or (a < 0.0).any()
    ):
        raise InputError(
            "Peaks need rising frequencies (n,) and finite magnitudes (n,) of zero or "
            f"more; got {f.shape} and {a.shape}."
        )
    rising, falling = np.diff(a)[:-1] > 0.0, np.diff(a)[1:] <= 0.0
    top: IntArray = np.flatnonzero(rising & falling) + 1
    top = top[a[top] >= above * a.max(initial=0.0)]
    found = [_refined(f, a, int(i)) for i in top]
    where, height, zeta = (np.array([one[j] for one in found]) for j in range(3))
    return Peaks(where, height, zeta, top)


def _refined(f: FloatArray, a: FloatArray, i: int) -> tuple[float, float, float]:
    x = f[i - 1 : i + 2] ** 2
    # Scaled, so that neither squares nor their inverses overflow.
    with np.errstate(divide="ignore"):
        y = (a[i] / a[i - 1 : i + 2]) ** 2
    x0, y0 = x[1], 1.0
    if np.isfinite(y).all():
        slope = np.diff(y) / np.diff(x)
        curve = (slope[1] - slope[0]) / (x[2] - x[0])
        middle = slope[0] + curve * (x[1] - x[0])
        if curve > 0.0:
            step = -0.5 * middle / curve
            lowest = 1.0 + 0.5 * middle * step
            # A minimum at or below zero: the samples are coarser than the peak.
            if lowest > 0.0:
                x0, y0 = x[1] + step, lowest
    height = a[i] / np.sqrt(y0)
    sides = [_crossing(f, a, i, way, height / np.sqrt(2.0)) for way in (-1, 1)]
    width = sides[1] ** 2 - sides[0] ** 2
    return float(np.sqrt(x0)), float(height), float(0.25 * width / x0)


def _crossing(f: FloatArray, a: FloatArray, i: int, way: int, level: float) -> float:
    """Frequency where the magnitude first falls to `level` on one side of sample i, NaN when it
    rises or ends before.
    """
    k = i
    while 0 <= k + way < len(a) and a[k + way] <= a[k]:
        k += way
        if a[k] <= level:
            return float(np.sqrt(_between(f, a, k, way, level)))
    return float("nan")


def _between(f: FloatArray, a: FloatArray, k: int, way: int, level: float) -> float:
    """Squared frequency of the crossing between samples k - way and k.

    By the parabola through them and one more, else by the chord.
    """
    third = k + way if 0 <= k + way < len(a) and 0.0 < a[k + way] < a[k] else k - 2 * way
    if a[k] == 0.0 or not 0 <= third < len(a):
        third = k
    inner, outer = f[k - way] ** 2, f[k] ** 2
    # In t from 0 at the inner sample to 1 at the outer one; y is level^2 / a^2 - 1 and changes
    # sign.
    y0, y1 = (level / a[k - way]) ** 2 - 1.0, ((level / a[k]) ** 2 - 1.0 if a[k] > 0.0 else np.inf)
    t = -y0 / (y1 - y0) if np.isfinite(y1) else 0.5
    if third != k:
        s, y2 = (f[third] ** 2 - inner) / (outer - inner), (level / a[third]) ** 2 - 1.0
        curve = ((y2 - y0) / s - (y1 - y0)) / (s - 1.0)
        roots = np.roots([curve, y1 - y0 - curve, y0])
        good = [float(r.real) for r in roots if abs(r.imag) == 0.0 and 0.0 <= r.real <= 1.0]
        t = good[0] if len(good) == 1 else t
    return float(inner + t * (outer - inner))
