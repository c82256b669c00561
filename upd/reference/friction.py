"""Oscillators with dry friction. Units: mm, N, t, s, rad/s.

Jenkins element (spring k_t in series with a Coulomb slider of limit mu N), first harmonic. Den
Hartog's forced vibration, m x'' + k x + mu N sgn(x') = F cos(w t), the exact steady state in motion
without stops [3]_: only ratios enter, g = w/w_n, friction = mu N/F; amplitudes come as x_0 k/F (all
without unit).

References
----------
Classical closed forms:

.. [1] I. A. Iwan, J. Appl. Mech. 28 (1961).
.. [2] J. H. Griffin, J. Eng. Power 102 (1980).
.. [3] J. P. Den Hartog, Forced Vibrations with Combined Coulomb and Viscous Friction, Trans. ASME
   53 (1931) APM-53-9, 107-115.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from upd.reference._checks import FloatArray, Real, not_negative, plain, positive, require

#: search points per shortest wave of the velocity, before the golden-section step
_POINTS_PER_WAVE = 64


def critical_amplitude(k_t: float, mu: float, N: float) -> float:
    """Amplitude x_c = mu N / k_t at which the slider begins to slip.

    Parameters
    ----------
    k_t : float
        N/mm.
    mu : float
    N : float
        N.

    Returns
    -------
    float
        mm.

    Raises
    ------
    InputError
        For a value that is not positive.

    Examples
    --------
    >>> from upd.reference import critical_amplitude
    >>> critical_amplitude(k_t=1e4, mu=0.5, N=20.0)
    0.001
    """
    positive("critical_amplitude", k_t=k_t, mu=mu, N=N)
    return mu * N / k_t


def jenkins_harmonic(amplitude: Real, k_t: float, mu: float, N: float) -> tuple[Real, Real]:
    """First harmonic of the force of a Jenkins element that follows x = A cos(theta).

    f ~ a1 cos(theta) + b1 sin(theta) with theta* = acos(1 - 2 x_c/A), a1 = k_t A/pi (theta* - sin(2
    theta*)/2), b1 = -4 mu N/pi (1 - x_c/A); (k_t A, 0) while it sticks, A <= x_c.

    Parameters
    ----------
    amplitude : float or ndarray
        A >= 0, mm.
    k_t : float
        N/mm.
    mu : float
    N : float
        N.

    Returns
    -------
    a1, b1 : float or ndarray
        N.

    Raises
    ------
    InputError
        For a negative amplitude.

    Examples
    --------
    >>> from upd.reference import jenkins_harmonic
    >>> a1, b1 = jenkins_harmonic(3e-3, k_t=1e4, mu=0.5, N=20.0)
    >>> print(f"{a1:.4f} N, {b1:.4f} N")
    8.7537 N, -8.4883 N
    """
    not_negative("jenkins_harmonic", amplitude=amplitude)
    x_c = critical_amplitude(k_t, mu, N)
    share = x_c / np.maximum(amplitude, x_c)
    # atan2 of the half angle: acos(1 - 2 s) loses half the digits at both ends
    angle = 2 * np.arctan2(np.sqrt(share), np.sqrt(1 - share))
    a1: Real = k_t * amplitude / np.pi * (angle - np.sin(2 * angle) / 2)
    b1: Real = -4 * mu * N / np.pi * (1 - share)
    return a1, b1


def jenkins_loop_area(amplitude: Real, k_t: float, mu: float, N: float) -> Real:
    """Energy 4 mu N (A - x_c) lost per cycle, zero while it sticks; equals -pi A b1.

    Parameters
    ----------
    amplitude : float or ndarray
        A >= 0, mm.
    k_t : float
        N/mm.
    mu : float
    N : float
        N.

    Returns
    -------
    float or ndarray
        N mm.

    Raises
    ------
    InputError
        For a negative amplitude.

    Examples
    --------
    >>> from upd.reference import jenkins_loop_area
    >>> print(f"{jenkins_loop_area(3e-3, k_t=1e4, mu=0.5, N=20.0):.3f} N mm")
    0.080 N mm
    """
    not_negative("jenkins_loop_area", amplitude=amplitude)
    area: Real = 4 * mu * N * np.maximum(amplitude - critical_amplitude(k_t, mu, N), 0.0)
    return area


def jenkins_force(x: FloatArray, k_t: float, mu: float, N: float) -> FloatArray:
    """Forces along a displacement history, exact, step by step.

    The slider is at rest at x = 0 without force.

    Parameters
    ----------
    x : (n,) array_like
        mm.
    k_t : float
        N/mm.
    mu : float
    N : float
        N.

    Returns
    -------
    (n,) ndarray
        N.

    Raises
    ------
    InputError
        For a history that is not one row.

    Examples
    --------
    >>> from upd.reference import jenkins_force
    >>> jenkins_force([0.0, 1e-3, 2e-3, 1e-3, -1e-3], k_t=1e4, mu=0.5, N=20.0).round(6).tolist()
    [0.0, 10.0, 10.0, 0.0, -10.0]
    """
    limit = mu * N
    critical_amplitude(k_t, mu, N)
    history = np.asarray(x, dtype=float)
    require(
        history.ndim == 1,
        "jenkins_force",
        f"x has shape {history.shape}",
        "give the history as one row (n,)",
    )
    force = np.empty_like(history)
    last, f = 0.0, 0.0
    for k, now in enumerate(history.tolist()):
        f = min(max(f + k_t * (now - last), -limit), limit)
        force[k], last = f, now
    return force


def jenkins_peak(mu_N: Real, F: float, k_t: float) -> Real:
    """Resonance amplitude of an undamped oscillator on a Jenkins element under F cos(w t).

    One harmonic; A = (mu N/k_t) / (1 - pi F/(4 mu N)).

    Parameters
    ----------
    mu_N : float or ndarray
        Friction limit, N.
    F : float
        N.
    k_t : float
        N/mm.

    Returns
    -------
    float or ndarray
        mm.

    Raises
    ------
    InputError
        If mu N <= pi F/4, where friction cannot hold the excitation and the peak is infinite.

    Examples
    --------
    >>> from upd.reference import jenkins_peak
    >>> print(f"{jenkins_peak(20.0, F=10.0, k_t=1e4):.6f} mm")
    0.003293 mm
    """
    positive("jenkins_peak", mu_N=mu_N, F=F, k_t=k_t)
    bound = np.pi * F / 4
    require(
        np.asarray(mu_N) > bound,
        "jenkins_peak",
        f"mu N = {mu_N} N is not above pi F/4 = {bound:.6g} N",
        "the peak is infinite there: raise mu N",
    )
    A: Real = mu_N / k_t / (1 - bound / mu_N)
    return A


def jenkins_peak_frequency(mu_N: Real, F: float, m: float, k: float, k_t: float) -> Real:
    """Angular frequency of the peak of `jenkins_peak`: w^2 = (k + a1/A)/m.

    Parameters
    ----------
    mu_N : float or ndarray
        Friction limit, N.
    F : float
        N.
    m : float
        Mass, t.
    k, k_t : float
        Stiffness of the oscillator (k >= 0) and of the element, N/mm.

    Returns
    -------
    float or ndarray
        rad/s.

    Raises
    ------
    InputError
        As for `jenkins_peak`.

    Examples
    --------
    At the best friction limit the element counts half.

    >>> import numpy as np
    >>> from upd.reference import jenkins_peak_frequency
    >>> w = jenkins_peak_frequency(5.0 * np.pi, F=10.0, m=1e-3, k=5e3, k_t=1e4)
    >>> print(f"{w:.3f} rad/s")
    3162.278 rad/s
    """
    positive("jenkins_peak_frequency", m=m)
    not_negative("jenkins_peak_frequency", k=k)
    A = jenkins_peak(mu_N, F, k_t)
    share = mu_N / k_t / A
    angle = 2 * np.arctan2(np.sqrt(share), np.sqrt(1 - share))
    w: Real = np.sqrt((k + k_t / np.pi * (angle - np.sin(2 * angle) / 2)) / m)
    return w


def jenkins_optimum(F: Real, k_t: float) -> tuple[Real, Real]:
    """Best friction limit and its peak, (mu N, A) = (pi F/2, pi F/k_t).

    No other mu N gives a smaller resonance amplitude.

    Parameters
    ----------
    F : float or ndarray
        N.
    k_t : float
        N/mm.

    Returns
    -------
    mu_N : float or ndarray
        N.
    A : float or ndarray
        mm.

    Examples
    --------
    >>> from upd.reference import jenkins_optimum
    >>> limit, amplitude = jenkins_optimum(F=10.0, k_t=1e4)
    >>> print(f"{limit:.4f} N, {amplitude:.6f} mm")
    15.7080 N, 0.003142 mm
    """
    positive("jenkins_optimum", F=F, k_t=k_t)
    limit: Real = np.pi * F / 2
    A: Real = np.pi * F / k_t
    return limit, A


def jenkins_optimum_frequency(m: float, k: float, k_t: float) -> float:
    """Angular frequency of the peak at the best friction limit: w^2 = (k + k_t/2)/m.

    Parameters
    ----------
    m : float
        t.
    k, k_t : float
        N/mm.

    Returns
    -------
    float
        rad/s.

    Examples
    --------
    >>> from upd.reference import jenkins_optimum_frequency
    >>> print(f"{jenkins_optimum_frequency(m=1e-3, k=5e3, k_t=1e4):.3f} rad/s")
    3162.278 rad/s
    """
    positive("jenkins_optimum_frequency", m=m, k_t=k_t)
    not_negative("jenkins_optimum_frequency", k=k)
    return float(np.sqrt((k + k_t / 2) / m))


def jenkins_frequencies(
    amplitude: Real, F: float, m: float, k: float, k_t: float, mu: float, N: float
) -> tuple[Real, Real]:
    """The two angular frequencies at which the oscillator answers F cos(w t) with an amplitude.

    w^2 = [k + a1/A -+ sqrt(F^2 - b1^2)/A]/m.

    Parameters
    ----------
    amplitude : float or ndarray
        A > 0, mm.
    F : float
        N.
    m : float
        t.
    k, k_t : float
        Stiffness of the oscillator (k >= 0) and of the element, N/mm.
    mu : float
    N : float
        N.

    Returns
    -------
    low, high : float or ndarray
        rad/s; the lower one is NaN where w^2 < 0 (no such response).

    Raises
    ------
    InputError
        Above the peak amplitude.

    Examples
    --------
    >>> from upd.reference import jenkins_frequencies
    >>> low, high = jenkins_frequencies(2e-3, F=10.0, m=1e-3, k=5e3, k_t=1e4, mu=1.0, N=20.0)
    >>> print(f"{low:.2f} and {high:.2f} rad/s")
    3162.28 and 4472.14 rad/s
    """
    positive("jenkins_frequencies", amplitude=amplitude, F=F, m=m)
    not_negative("jenkins_frequencies", k=k)
    a1, b1 = jenkins_harmonic(amplitude, k_t, mu, N)
    # at the peak itself |b1| = F up to rounding
    excess = np.abs(b1) <= F * (1 + 8 * np.finfo(float).eps)
    require(
        excess,
        "jenkins_frequencies",
        f"friction alone takes more than F = {F} N at amplitude {amplitude}",
        "stay below jenkins_peak",
    )
    spread = np.sqrt(np.maximum(F - np.abs(b1), 0.0) * (F + np.abs(b1)))
    low2, high2 = ((k + (a1 - spread) / amplitude) / m, (k + (a1 + spread) / amplitude) / m)
    low: Real = plain(np.sqrt(np.where(low2 >= 0, low2, np.nan)))
    high: Real = np.sqrt(high2)
    return low, high


# -- Den Hartog ------------------------------------------------------------------------------------


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
    waves = max(1.0, 1.0 / g)
    n = int(np.ceil(_POINTS_PER_WAVE * waves))
    t = np.pi * np.arange(1, n) / n
    values = _velocity_ratio(t, g, U)
    best = int(np.argmax(values))
    low, high = np.pi * best / n, np.pi * (best + 2) / n
    found = minimize_scalar(
        lambda t: -_velocity_ratio(t, g, U), bounds=(low, high), method="bounded"
    )
    return max(1 / g**2, float(values[best]), float(-found.fun))


def _velocity_ratio(t: Real, g: float, U: float) -> Real:
    ratio: Real = (U * (np.cos(t) - np.cos(t / g)) + np.sin(t / g) / g) / np.sin(t)
    return ratio
