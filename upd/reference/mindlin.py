"""Tangential contact of spheres with friction. Units: mm, N, MPa.

After Cattaneo (1938), Mindlin (1949) and Mindlin & Deresiewicz (1953). Constant normal load N,
tangential load T along x, like materials (Dundurs' beta = 0). The tractions are taken parallel to
T everywhere: the slip has a transverse part, of the order nu/(4 - 2 nu) of the axial one, that the
closed form neglects.

References
----------
.. [1] K. L. Johnson, Contact Mechanics, Cambridge 1985, sections 7.2 (partial slip of spheres) and
   7.4 (oscillating forces).
"""

from __future__ import annotations

import numpy as np
from scipy.special import binom

from upd.reference._checks import FloatArray, Real, elastic, not_negative, plain, positive, require

#: below this T*/(mu N) the energy formula cancels and its power series is used; 40 terms of 0.25^k
#: are below machine accuracy
_SERIES_LIMIT = 0.25
_SERIES_TERMS = 40


def tangential_compliance_modulus(E1: float, nu1: float, E2: float, nu2: float) -> float:
    """C = (2 - nu1)/G1 + (2 - nu2)/G2.

    Parameters
    ----------
    E1, nu1, E2, nu2 : float
        MPa and Poisson ratios; E = inf is a rigid body.

    Returns
    -------
    float
        1/MPa.

    Raises
    ------
    InputError
        If both bodies are rigid.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, section 7.2.
    """
    C = 0.0
    for E, nu in ((E1, nu1), (E2, nu2)):
        if not np.isposinf(E):
            elastic("tangential_compliance_modulus", E, nu)
            G = E / (2 * (1 + nu))
            C += (2 - nu) / G
    require(
        C > 0,
        "tangential_compliance_modulus",
        "both bodies are rigid",
        "give one of them a finite modulus",
    )
    return C


def stick_radius(T: Real, mu: float, N: float, a: float) -> Real:
    """Radius c = a (1 - abs(T)/(mu N))^(1/3) of the stick zone at first loading.

    Parameters
    ----------
    T : float or ndarray
        Tangential load, N.
    mu : float
    N : float
        N.
    a : float
        Contact radius, mm.

    Returns
    -------
    float or ndarray
        mm.

    Raises
    ------
    InputError
        For abs(T) > mu N (gross slip).
    """
    positive("stick_radius", a=a)
    # Rounding must not push it beyond the contact radius.
    c: Real = np.minimum(a, a * np.cbrt(1 - _ratio("stick_radius", T, mu, N)))
    return c


def traction(r: Real, a: float, c: float, mu: float, N: float) -> Real:
    """Tangential traction at first loading.

    3 mu N/(2 pi a^3) [ sqrt(a^2 - r^2) - sqrt(c^2 - r^2) ], each root zero where it ends.

    Parameters
    ----------
    r : float or ndarray
        Radius >= 0, mm.
    a : float
        Contact radius, mm.
    c : float
        Stick radius, 0 <= c <= a, mm.
    mu : float
    N : float
        N.

    Returns
    -------
    float or ndarray
        MPa.

    Raises
    ------
    InputError
        For a stick radius beyond the contact radius.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, section 7.2.
    """
    not_negative("traction", r=r, c=c)
    positive("traction", a=a, mu=mu, N=N)
    require(
        c <= a,
        "traction",
        f"stick radius {c} exceeds the contact radius {a}",
        "take it from stick_radius",
    )
    q: Real = 3 * mu * N / (2 * np.pi * a**3) * (_root(a, r) - _root(c, r))
    return q


def unloading_traction(r: Real, T: float, T_max: float, mu: float, N: float, a: float) -> Real:
    """Tangential traction after loading to T_max and unloading to T.

    First loading less twice a counter-slip.

    Parameters
    ----------
    r : float or ndarray
        Radius >= 0, mm.
    T : float
        T >= -T_max, N.
    T_max : float
        T_max >= 0, N.
    mu : float
    N : float
        N.
    a : float
        Contact radius, mm.

    Returns
    -------
    float or ndarray
        MPa.
    """
    _branch("unloading_traction", T, T_max)
    first = traction(r, a, stick_radius(T_max, mu, N, a), mu, N)
    q: Real = first - 2 * traction(r, a, stick_radius((T_max - T) / 2, mu, N, a), mu, N)
    return q


def displacement(T: Real, mu: float, N: float, a: float, C: float) -> Real:
    """Relative displacement of distant points of the two bodies at first loading, odd in T.

    d = 3 mu N C/(16 a) [ 1 - (1 - T/(mu N))^(2/3) ].

    Parameters
    ----------
    T : float or ndarray
        Tangential load, N.
    mu : float
    N : float
        N.
    a : float
        Contact radius, mm.
    C : float
        1/MPa, from `tangential_compliance_modulus`.

    Returns
    -------
    float or ndarray
        mm.

    Raises
    ------
    InputError
        For abs(T) > mu N (gross slip).

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, section 7.2.

    Examples
    --------
    >>> import numpy as np
    >>> from upd.reference import mindlin
    >>> C = mindlin.tangential_compliance_modulus(200e3, 0.3, 200e3, 0.3)
    >>> d = mindlin.displacement(np.array([5.0, 10.0, 20.0]), mu=0.5, N=50.0, a=0.12, C=C)
    >>> (1e3 * d).round(4).tolist()
    [0.2387, 0.4983, 1.1361]
    >>> stuck = 5.0 / mindlin.initial_tangential_stiffness(0.12, C)
    >>> print(f"{1e3 * stuck:.4f} um if nothing slipped")
    0.2302 um if nothing slipped
    """
    positive("displacement", a=a, C=C)
    q = _ratio("displacement", T, mu, N)
    with np.errstate(divide="ignore"):  # log(0) at q = 1 is meant: exp(-inf) = 0
        # 1 - (1 - q)^(2/3), without cancellation at small q
        part = -np.expm1(2 / 3 * np.log1p(-q))
    d: Real = np.sign(T) * 3 * mu * N * C / (16 * a) * part
    return d


def unloading(T: Real, T_max: float, mu: float, N: float, a: float, C: float) -> Real:
    """Displacement as T falls from T_max: d(T_max) - 2 d((T_max - T)/2).

    Parameters
    ----------
    T : float or ndarray
        -T_max <= T <= T_max, N.
    T_max : float
        N.
    mu, N, a, C
        As for `displacement`.

    Returns
    -------
    float or ndarray
        mm.

    References
    ----------
    .. [1] Mindlin & Deresiewicz 1953.
    """
    _branch("unloading", T, T_max)
    d: Real = displacement(T_max, mu, N, a, C) - 2 * displacement((T_max - T) / 2, mu, N, a, C)
    return d


def reloading(T: Real, T_max: float, mu: float, N: float, a: float, C: float) -> Real:
    """Displacement while T rises again from -T_max: the unloading branch turned by 180 degrees.

    Parameters
    ----------
    T : float or ndarray
        -T_max <= T <= T_max, N.
    T_max : float
        N.
    mu, N, a, C
        As for `displacement`.

    Returns
    -------
    float or ndarray
        mm.

    References
    ----------
    .. [1] Mindlin & Deresiewicz 1953.
    """
    _branch("reloading", T, T_max)
    d: Real = -unloading(-T, T_max, mu, N, a, C)
    return d


def loop(T: FloatArray, mu: float, N: float, a: float, C: float) -> FloatArray:
    """Displacements along a load history that starts from the unloaded contact.

    Every reversal opens a branch of twice the first-loading curve; a branch that closes a smaller
    loop rejoins the larger one (constant normal load). A list [0 .. T*, .. -T*, .. T*] draws the
    whole hysteresis loop.

    Parameters
    ----------
    T : (n,) array_like
        N; any sequence with abs(T) <= mu N.
    mu, N, a, C
        As for `displacement`.

    Returns
    -------
    (n,) ndarray
        mm.

    Raises
    ------
    InputError
        For gross slip, or a history that is not one row.

    References
    ----------
    .. [1] Mindlin & Deresiewicz 1953.
    """
    history = np.asarray(T, dtype=float)
    require(
        history.ndim == 1,
        "loop",
        f"T has shape {history.shape}",
        "give the load history as one row (n,)",
    )
    _ratio("loop", history, mu, N)
    result = np.empty_like(history)
    reversals: list[tuple[float, float]] = []
    last, d, direction = 0.0, 0.0, 0.0
    for k, now in enumerate(history.tolist()):
        if now != last:
            turn = 1.0 if now > last else -1.0
            if turn == -direction:
                reversals.append((last, d))
            direction = turn
            # forget the reversals of every loop the load has passed
            while len(reversals) >= 2 and direction * (now - reversals[-2][0]) >= 0:
                del reversals[-2:]
            # the first branch meets the first-loading curve again at the opposite load
            if len(reversals) == 1 and direction * (now + reversals[0][0]) >= 0:
                reversals.clear()
            if reversals:
                start, offset = reversals[-1]
                d = offset + 2 * displacement((now - start) / 2, mu, N, a, C)
            else:
                d = displacement(now, mu, N, a, C)
            last = now
        result[k] = d
    return result


def cycle_energy(q: Real, mu: float, N: float, a: float, C: float) -> Real:
    """Energy lost in one full cycle between +T* and -T*.

    9 mu^2 N^2 C/(10 a) { 1 - (1-q)^(5/3) - 5q/6 [1 + (1-q)^(2/3)] }; about T*^3 C/(36 a mu N) when
    q is small.

    Parameters
    ----------
    q : float or ndarray
        T*/(mu N), in [0, 1].
    mu, N, a, C
        As for `displacement`.

    Returns
    -------
    float or ndarray
        N mm.

    Raises
    ------
    InputError
        For q outside [0, 1].

    References
    ----------
    .. [1] Mindlin & Deresiewicz 1953.
    .. [2] K. L. Johnson, Contact Mechanics, section 7.4.
    """
    positive("cycle_energy", mu=mu, N=N, a=a, C=C)
    s = np.asarray(q, dtype=float)
    require(
        (s >= 0) & (s <= 1),
        "cycle_energy",
        f"q = {q} is outside [0, 1]",
        "q is the amplitude T* over mu N",
    )
    k = np.arange(3, _SERIES_TERMS)
    coefficients = (-1.0) ** k * (5 / 6 * binom(2 / 3, k - 1) - binom(5 / 3, k))
    small = np.minimum(s, _SERIES_LIMIT)
    series = np.polynomial.polynomial.polyval(small, np.concatenate([np.zeros(3), coefficients]))
    closed = 1 - (1 - s) ** (5 / 3) - 5 * s / 6 * (1 + np.cbrt(1 - s) ** 2)
    energy: Real = plain(
        9 * (mu * N) ** 2 * C / (10 * a) * np.where(s < _SERIES_LIMIT, series, closed)
    )
    return energy


def initial_tangential_stiffness(a: Real, C: float) -> Real:
    """Slope dT/dd = 8 a/C of the unloaded contact; 4 G a/(2 - nu) for two identical bodies.

    Parameters
    ----------
    a : float or ndarray
        Contact radius, mm.
    C : float
        1/MPa.

    Returns
    -------
    float or ndarray
        N/mm.

    References
    ----------
    .. [1] K. L. Johnson, Contact Mechanics, section 7.2.
    """
    positive("initial_tangential_stiffness", a=a, C=C)
    K: Real = 8 * a / C
    return K


def _ratio(where: str, T: Real, mu: float, N: float) -> Real:
    """|T|/(mu N), refused above one."""
    positive(where, mu=mu, N=N)
    limit = mu * N
    # sums such as (T* + T*)/2 may pass the limit by a rounding
    allowed = np.abs(T) <= limit * (1 + 4 * np.finfo(float).eps)
    require(
        allowed,
        where,
        f"gross slip: |T| = {np.max(np.abs(T)):.6g} N exceeds mu N = {mu:g} x {N:g} = "
        f"{limit:.6g} N",
        "lower T or raise mu or N",
    )
    q: Real = np.minimum(np.abs(T) / limit, 1.0)
    return q


def _root(a: float, r: Real) -> Real:
    s: Real = np.sqrt(np.maximum((a - r) * (a + r), 0.0))
    return s


def _branch(where: str, T: Real, T_max: float) -> None:
    not_negative(where, T_max=T_max)
    require(
        np.abs(T) <= T_max,
        where,
        f"T = {T} is outside +-T_max = {T_max}",
        "the branch runs between the two turning loads",
    )
