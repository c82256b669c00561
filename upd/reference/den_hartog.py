"""Forced vibration with Coulomb friction, m x'' + k x + mu N sgn(x') = F cos(w t).

Exact steady state in motion without stops [1]_. Only ratios enter: g = w/w_n, friction = mu N/F;
amplitudes come as x_0 k/F (all without unit).

References
----------
.. [1] J. P. Den Hartog, Forced Vibrations with Combined Coulomb and Viscous Friction, Trans. ASME
   53 (1931) APM-53-9, 107-115.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from upd.reference._checks import FloatArray, Real, not_negative, plain, positive, require

#: search points per shortest wave of the velocity, before the golden-section step
_POINTS_PER_WAVE = 64


def den_hartog_functions(g: Real) -> tuple[Real, Real]:
    """Den Hartog's V = 1/(1 - g^2) and U = sin(pi/g)/(g (1 + cos(pi/g))).

    Parameters
    ----------
    g : float or ndarray
        Frequency ratio w/w_n > 0.

    Returns
    -------
    V, U : float or ndarray

    Raises
    ------
    InputError
        At resonance, g = 1.

    Examples
    --------
    >>> from upd.reference import den_hartog_functions
    >>> V, U = den_hartog_functions(2.0 / 3.0)
    >>> print(f"{V:.4f} {U:.4f}")
    1.8000 -1.5000
    """
    positive("den_hartog_functions", g=g)
    require(
        np.asarray(g) != 1,
        "den_hartog_functions",
        "g = 1 is the undamped resonance",
        "the response is unbounded or at rest: take g beside it",
    )
    V: Real = 1 / ((1 - g) * (1 + g))
    U: Real = np.tan(np.pi / (2 * g)) / g
    return V, U


def den_hartog_stop_limit(g: Real) -> Real:
    """Smallest x_0/x_f, x_f = mu N/k, for motion without stops.

    The velocity then keeps its sign over half a cycle.
    S = max of [U (cos t - cos(t/g)) + sin(t/g)/g] / sin t over 0 < t < pi; S >= 1/g^2, its value at
    t -> 0.

    Parameters
    ----------
    g : float or ndarray
        Frequency ratio w/w_n > 0.

    Returns
    -------
    float or ndarray
        S.

    Raises
    ------
    InputError
        At resonance, g = 1.

    Examples
    --------
    >>> from upd.reference import den_hartog_stop_limit
    >>> print(f"{den_hartog_stop_limit(0.5):.4f}")
    4.0000
    """
    U = den_hartog_functions(g)[1]
    ratios, values = (
        np.atleast_1d(np.asarray(g, dtype=float)),
        np.atleast_1d(np.asarray(U, dtype=float)),
    )
    limits = [
        _stop_limit(float(x), float(u)) for x, u in zip(ratios.ravel(), values.ravel(), strict=True)
    ]
    S: Real = plain(np.array(limits).reshape(np.shape(g)))
    return S


def den_hartog_amplitude(g: Real, friction: float) -> Real:
    """Amplitude x_0 k/F = sqrt(V^2 - (friction U)^2).

    Parameters
    ----------
    g : float or ndarray
        Frequency ratio w/w_n > 0.
    friction : float
        mu N/F >= 0.

    Returns
    -------
    float or ndarray
        x_0 k/F.

    Raises
    ------
    InputError
        At resonance, and wherever the mass would stop within the cycle, so that the formula
        does not hold.

    Examples
    --------
    >>> import numpy as np
    >>> from upd.reference import den_hartog_amplitude
    >>> den_hartog_amplitude(np.array([0.5, 2.0 / 3.0]), 0.2).round(4).tolist()
    [1.3333, 1.7748]
    >>> print(f"{den_hartog_amplitude(2.0 / 3.0, 0.4):.4f}")
    1.6971
    """
    not_negative("den_hartog_amplitude", friction=friction)
    V, U = den_hartog_functions(g)
    square = (np.abs(V) - friction * np.abs(U)) * (np.abs(V) + friction * np.abs(U))
    where, remedy = "den_hartog_amplitude", "lower mu N/F or integrate in time"
    require(
        square > 0, where, f"no steady motion without stops at g = {g}, mu N/F = {friction}", remedy
    )
    x_0: Real = np.sqrt(square)
    if np.any(np.asarray(friction) > 0):
        stops = friction * den_hartog_stop_limit(g)
        require(
            np.asarray(x_0) > stops,
            where,
            f"the mass stops within the cycle at g = {g}, mu N/F = {friction}",
            remedy,
        )
    return x_0


def den_hartog_phase(g: Real, friction: float) -> Real:
    """Phase lag of the turning point x = x_0 behind the force maximum.

    Parameters
    ----------
    g, friction
        As for `den_hartog_amplitude`.

    Returns
    -------
    float or ndarray
        rad, in (-pi, pi].

    Raises
    ------
    InputError
        As for `den_hartog_amplitude`.

    Examples
    --------
    >>> from upd.reference import den_hartog_phase
    >>> print(f"{den_hartog_phase(2.0 / 3.0, 0.4):.4f} rad")
    0.3398 rad
    """
    x_0 = den_hartog_amplitude(g, friction)
    V, U = den_hartog_functions(g)
    lag: Real = np.arctan2(-friction * U * np.sign(V), x_0 * np.sign(V))
    return lag


def _stop_limit(g: float, U: float) -> float:
    def negative(t: float) -> float:
        return float(-_velocity_ratio(np.array([t]), g, U)[0])

    waves = max(1.0, 1.0 / g)
    n = int(np.ceil(_POINTS_PER_WAVE * waves))
    t = np.pi * np.arange(1, n) / n
    values = _velocity_ratio(t, g, U)
    best = int(np.argmax(values))
    low, high = np.pi * best / n, np.pi * (best + 2) / n
    found = minimize_scalar(negative, bounds=(low, high), method="bounded")
    return max(1 / g**2, float(values[best]), float(-found.fun))


def _velocity_ratio(t: FloatArray, g: float, U: float) -> FloatArray:
    return np.asarray((U * (np.cos(t) - np.cos(t / g)) + np.sin(t / g) / g) / np.sin(t))
