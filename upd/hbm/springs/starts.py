"""First points of a curve.

Newton from linear answers, then homotopies that start from an answer known to be exact.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.continuation import follow
from upd.hbm.core.fourier import harmonics
from upd.hbm.core.newton import Settings, solve
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.checks import sticking_preload
from upd.hbm.springs.residuals import over_frequency, over_load, over_preload, scale_of

FloatArray = NDArray[np.float64]
#: Newton at one point may take long where a whole path would rather shorten its step
PATIENCE = 60


def place_sliders(b: Balance, frequency: float, settings: Settings | None = None) -> Balance | None:
    """The problem with its sliders where its start wants them before the march.

    Parameters
    ----------
    b : Balance
    frequency : float
        [Hz]
    settings : Settings, optional

    Returns
    -------
    Balance or None
        None for the start "static" when the static loads alone have no solution. Sliders that have
        a place keep it.
    """
    if b.start != "static" or b.slider is not None:
        return b
    statics = static_point(b, frequency, settings)
    return None if statics is None else b.with_sliders("static", sliders(b, statics))


def first_point(
    b: Balance, frequency: float, settings: Settings | None = None
) -> FloatArray | None:
    """A solution at one frequency.

    Newton from the stuck and the free answer; then preload taken away from where every
    point sticks; then the dynamic loads raised from zero.

    Parameters
    ----------
    b : Balance
    frequency : float
        [Hz]
    settings : Settings, optional

    Returns
    -------
    (n_unknown,) ndarray or None
        Unknowns; None when no solution was found.
    """
    omega = 2 * np.pi * frequency
    placed = place_sliders(b, frequency, settings)
    if placed is None:
        return None
    b = placed
    for x in (b.stuck(omega), b.free(omega)):
        found = newton(b, x, frequency, settings)
        if found is not None:
            return found
    released = from_stuck(b, frequency, settings)
    if released is not None:
        return released
    statics = static_point(b, frequency, settings)
    if statics is None:
        return None
    path = follow(
        over_load(b, frequency),
        (statics, 0.0),
        1.0,
        scale=scale_of(b, b.stuck(omega)),
        p_scale=1.0,
        settings=settings,
    )
    return path.x[-1] if path.status == "complete" else None


def newton(
    b: Balance, x: FloatArray, frequency: float, settings: Settings | None = None
) -> FloatArray | None:
    """A solution at one frequency by damped Newton.

    Parameters
    ----------
    b : Balance
    x : (n_unknown,) ndarray
        Initial guess.
    frequency : float
        [Hz]
    settings : Settings, optional

    Returns
    -------
    (n_unknown,) ndarray or None
        None when it does not converge.
    """
    patient = replace(settings or Settings(), iterations=PATIENCE)
    found = solve(over_frequency(b), x, frequency, scale_of(b), patient)
    return found.x if found.tangent is not None else None


def from_stuck(b: Balance, frequency: float, settings: Settings | None = None) -> FloatArray | None:
    """A solution at one frequency, released from a state in which every point sticks.

    Pressed until every point sticks, where the linear answer is exact, then released by
    continuation. The harmonic 0 carries the loads that balance the extra preload, so it must be
    among the harmonics.

    Parameters
    ----------
    b : Balance
    frequency : float
        [Hz]
    settings : Settings, optional

    Returns
    -------
    (n_unknown,) ndarray or None
        None when the path does not arrive.
    """
    x = b.stuck(2 * np.pi * frequency)
    P = sticking_preload(b, x)
    if not np.all(np.isfinite(P)):
        return None
    # exact for sliders in given places; with the others the residual traction is still to be found
    pressed = newton(b.pressed(P), x, frequency, settings)
    if pressed is None or not np.any(P):
        return pressed
    x = pressed
    path = follow(
        over_preload(b, frequency, P),
        (x, 0.0),
        1.0,
        scale=scale_of(b, x),
        p_scale=1.0,
        settings=settings,
    )
    return path.x[-1] if path.status == "complete" else None


def static_point(
    b: Balance, frequency: float, settings: Settings | None = None
) -> FloatArray | None:
    """Unknowns under the static loads alone, sliders at zero.

    Solved with the fewest harmonics and samples that hold a constant.

    Parameters
    ----------
    b : Balance
    frequency : float
        [Hz]
    settings : Settings, optional

    Returns
    -------
    (n_unknown,) ndarray or None
        None when no solution was found.
    """
    if not b.harmonics.static:
        return np.zeros(b.size)
    few = harmonics((0, int(b.harmonics.dynamic[0])))
    samples = 2 * few.highest + 1
    rest = replace(
        b.with_loads(1.0, 0.0),
        harmonics=few,
        samples=samples,
        dynamic=np.zeros((1, len(b.static)), complex),
        start="zero",
    )
    rest = rest.with_sliders("zero", b.slider if b.start == "zero" else None)
    x = newton(rest, rest.stuck(2 * np.pi * frequency), frequency, settings)
    x = from_stuck(rest, frequency, settings) if x is None else x
    return None if x is None else b.embedded(x, rest)


def sliders(b: Balance, x: FloatArray) -> FloatArray:
    """Slider positions after the static loads have led to an answer, from sliders at zero.

    Parameters
    ----------
    b : Balance
    x : (n_unknown,) ndarray
        Unknowns under the static loads.

    Returns
    -------
    (n_point, 2) ndarray
        Positions [mm].
    """
    rest = b.with_loads(1.0, 0.0).with_sliders("zero")
    out, d = np.zeros((b.contacts.n_point, 2)), b.contacts.tangents
    if b.harmonics.static:
        T = rest.force(x).force[:, 1:, 0]
        out[:, :d] = b.split(x)[0][:, 1:, 0] - T / b.contacts.law.k_t[:, None]
    return out
