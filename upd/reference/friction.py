"""Jenkins element (spring k_t in series with a Coulomb slider of limit mu N), first harmonic.

Units: mm, N, t, s, rad/s.

References
----------
Classical closed forms:

.. [1] I. A. Iwan, J. Appl. Mech. 28 (1961).
.. [2] J. H. Griffin, J. Eng. Power 102 (1980).
"""

from __future__ import annotations

import numpy as np

from upd.reference._checks import FloatArray, Real, not_negative, plain, positive, require


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
