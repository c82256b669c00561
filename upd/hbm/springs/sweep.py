"""The curve over frequency.

Exact stuck answers where proven, continuation over each stretch between. Its first points: Newton
from linear answers, then homotopies that start from an answer known to be exact. Residuals over one
parameter, and the sizes of the unknowns, are the bridge between mechanics and continuation.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upd.hbm.core.continuation import follow
from upd.hbm.core.factors import EPS, FactorsOf
from upd.hbm.core.fourier import harmonics
from upd.hbm.core.newton import Function, PathProblem, Scale, Settings
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.checks import separated, sticking_preload, stuck_points
from upd.hbm.springs.terms import unit_sizes

log = logging.getLogger(__name__)

FloatArray = NDArray[np.float64]
Linearised = tuple[FloatArray, FactorsOf | None, FloatArray]
#: arclength unit of frequency, as a share of the mean frequency: a resonance of a few per cent is
#: one unit wide
FREQUENCY_SHARE = 0.05
#: smallest mean displacement, relative to what the static loads cause, that is converged to its own
#: size
STATIC_SHARE = 1e-5
#: share of the range by which a path may come back behind the first frequency before it is ended
BEHIND = 0.05
#: difference, relative to their size, at which two answers at one frequency are different solutions
OTHER_BRANCH = 1e-6
#: Newton at one point may take long where a whole path would rather shorten its step
PATIENCE = 60


@dataclass(frozen=True)
class Curve:
    """Points of a sweep.

    Attributes
    ----------
    p : (n,) ndarray
        Frequencies [Hz].
    x : (n, n_unknown) ndarray
        Unknowns.
    exact : (n,) ndarray of bool
        Answered by an exact linear solution.
    status : {"complete", "stopped", "step limit"}
    message : str
        Where and why the curve ended.
    """

    p: FloatArray
    x: FloatArray
    exact: NDArray[np.bool_]
    status: str
    message: str


def solve_curve(
    b: Balance, f: FloatArray, fast: bool, settings: Settings | None
) -> tuple[Balance, Curve]:
    """The curve of a problem whose sliders are placed first, and that problem.

    Parameters
    ----------
    b : Balance
    f : (n,) ndarray
        Frequencies [Hz], rising or falling.
    fast : bool
        Take the exact linear answers where they are proven.
    settings : Settings or None
        Step control of the continuation.

    Returns
    -------
    tuple of Balance and Curve
    """
    omega = 2 * np.pi * f
    linear = stuck_points(b, omega) if fast and b.start == "zero" else np.zeros(len(f), dtype=bool)
    if linear.all():
        message = "every point sticks over the whole cycle: the linear answer is exact"
        return b, _stuck(b, f, message)
    apart = separated(b, omega) if fast else None
    if apart is not None:
        message = "nothing presses the contacts: the free answer is exact"
        return b, Curve(f, apart, np.ones(len(f), dtype=bool), "complete", message)
    placed = place_sliders(b, float(f[0]), settings)
    if placed is None:
        message = (
            'start "static": no solution under the static loads alone, so the sliders have no '
            'place to start from; to fix it: start = "zero" or "mid", or static loads that press '
            "the contacts"
        )
        log.warning(message)
        return b, Curve(f[:0], np.zeros((0, b.size)), linear[:0], "stopped", message)
    return placed, sweep(placed, f, linear, settings)


def sweep(
    b: Balance,
    f: FloatArray,
    exact: NDArray[np.bool_],
    settings: Settings | None = None,
) -> Curve:
    """The curve over frequency: exact stuck answers where proven, continuation over the rest.

    Parameters
    ----------
    b : Balance
    f : (n,) ndarray
        Frequencies [Hz], rising or falling; answered in that order.
    exact : (n,) ndarray of bool
        Frequencies at which every point is proven to stick.
    settings : Settings, optional
        Step control of the continuation.

    Returns
    -------
    Curve
    """
    parts: list[Curve] = []
    i = 0
    while i < len(f):
        others = np.flatnonzero(exact[i:] != exact[i])
        stop = i + int(others[0]) if len(others) else len(f)
        if exact[i]:
            parts.append(_stuck(b, f[i:stop]))
            i = stop
            continue
        # onto the next exact answer; arriving on another branch, the path follows that to the end
        x = parts[-1].x[-1] if parts else None
        part = _stretch(b, f, slice(i, stop + 1), x, settings)
        if stop < len(f) and part.status == "complete":
            there = b.stuck(2 * np.pi * f[stop])
            if (
                float(np.abs((part.x[-1] - there) / scale_of(b, by_energy=False)(there)).max())
                <= OTHER_BRANCH
            ):
                part = replace(part, p=part.p[:-1], x=part.x[:-1], exact=part.exact[:-1])
            else:
                part, stop = _stretch(b, f, slice(i, len(f)), x, settings), len(f)
        parts.append(part)
        i = stop
        if part.status != "complete":
            break
    p, x, e = (np.concatenate([getattr(c, name) for c in parts]) for name in ("p", "x", "exact"))
    done = (
        f"reached {f[-1]:.9g} Hz in {len(p)} points, {int(e.sum())} of them by the linear "
        "stuck answer"
    )
    return Curve(p, x, e, parts[-1].status, parts[-1].message or done)


def _stuck(b: Balance, f: FloatArray, message: str = "") -> Curve:
    """The stuck answers, where they are exact."""
    x = np.array([b.stuck(2 * np.pi * v) for v in f])
    return Curve(f, x, np.ones(len(f), dtype=bool), "complete", message)


def _stretch(
    b: Balance, f: FloatArray, part: slice, x: FloatArray | None, settings: Settings | None
) -> Curve:
    """Continuation over the consecutive frequencies f[part].

    From x, the solved point before them, where there is one.
    """
    wanted, known = f[part], int(x is not None)
    begin, end = f[part.start - known], wanted[-1]
    if x is None:
        x = first_point(b, begin, settings)
    if x is None:
        message = (
            f"no solution found at {begin:.9g} Hz: start at a frequency far from resonance or "
            "change the slider start"
        )
        return Curve(f[:0], np.zeros((0, b.size)), np.zeros(0, dtype=bool), "stopped", message)
    if begin == end:
        return Curve(np.array([begin]), x[None], np.zeros(1, dtype=bool), "complete", "")
    problem = over_frequency(b, FREQUENCY_SHARE * float(np.mean(f)), settings)
    behind = float(f[0] - BEHIND * (f[-1] - f[0]))
    path = follow(problem, (x, begin), end, wanted=wanted, turned=behind)
    p, message = path.p[known:], "" if path.status == "complete" else path.message
    return Curve(p, path.x[known:], np.zeros(len(p), dtype=bool), path.status, message)


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
    if statics is None:
        return None
    # positions after the static loads have led there, from sliders at zero
    rest = b.unexcited().with_sliders("zero")
    out, d = np.zeros((b.contacts.n_point, 2)), b.contacts.tangents
    if b.harmonics.static:
        T = rest.force(statics)[:, 1:, 0]
        out[:, :d] = b.split(statics)[0][:, 1:, 0] - T / b.contacts.law.k_t[:, None]
    return b.with_sliders("static", out)


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
    none, zero = b.unexcited(), np.zeros(b.size)
    slope = b.linearised(zero, omega, False)[0] - none.linearised(zero, omega, False)[0]

    def raised(x: FloatArray, s: float, jacobian: bool) -> Linearised:
        """Residual over a factor on the dynamic loads, linear in it."""
        residual, factors, _ = _linearised(none, x, omega, jacobian)
        return residual + s * slope, factors, slope

    return _to_one(b, raised, statics, b.stuck(omega), settings)


def _to_one(
    b: Balance, function: Function, x: FloatArray, like: FloatArray, settings: Settings | None
) -> FloatArray | None:
    """The answer at 1 of a parameter by continuation from one at 0; `like` has its size."""
    problem = PathProblem(function, scale_of(b, like), settings=settings or Settings())
    path = follow(problem, (x, 0.0), 1.0)
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
    found = over_frequency(b, 1.0, patient).solve(x, frequency)
    return None if found is None else found.x


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
    omega = 2 * np.pi * frequency
    x = b.stuck(omega)
    P = sticking_preload(b, x)
    if not np.all(np.isfinite(P)):
        return None
    # exact for sliders in given places; with the others the residual traction is still to be found
    pressed = newton(b.pressed(P), x, frequency, settings)
    if pressed is None or not np.any(P):
        return pressed

    def released(x: FloatArray, q: float, jacobian: bool) -> Linearised:
        """Residual with (1 - q) P more preload balanced by as much static load."""
        residual, factors, _ = _linearised(b.pressed((1 - q) * P), x, omega, jacobian)
        h = EPS ** (1 / 3)
        if not jacobian:
            return residual, None, np.zeros(b.size)
        up, down = (b.pressed((1 - q - d) * P).linearised(x, omega, False)[0] for d in (h, -h))
        return residual, factors, (up - down) / (2 * h)

    return _to_one(b, released, pressed, pressed, settings)


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
        b.unexcited(),
        harmonics=few,
        samples=samples,
        dynamic=np.zeros((1, len(b.static)), complex),
        start="zero",
    )
    rest = rest.with_sliders("zero", b.slider if b.start == "zero" else None)
    x = newton(rest, rest.stuck(2 * np.pi * frequency), frequency, settings)
    x = from_stuck(rest, frequency, settings) if x is None else x
    return None if x is None else b.embedded(x, rest)


def _linearised(b: Balance, x: FloatArray, omega: float, jacobian: bool) -> Linearised:
    """Residual, what gives the factors of its Jacobian, derivative by omega."""
    residual, parts, slope = b.linearised(x, omega, jacobian)
    return residual, None if parts is None else parts.bordered, slope


def over_frequency(b: Balance, p_scale: float, settings: Settings | None) -> PathProblem:
    """The balance over the frequency in Hz for the continuation.

    Parameters
    ----------
    b : Balance
    p_scale : float
        Size of the frequency [Hz].
    settings : Settings or None

    Returns
    -------
    PathProblem
    """

    def function(x: FloatArray, f: float, jacobian: bool) -> Linearised:
        residual, factors, slope = _linearised(b, x, 2 * np.pi * f, jacobian)
        return residual, factors, 2 * np.pi * slope

    return PathProblem(function, scale_of(b), p_scale, settings or Settings(), "{:.9g} Hz".format)


def scale_of(b: Balance, least: FloatArray | None = None, *, by_energy: bool = True) -> Scale:
    """Units of the unknowns for the continuation: a path is measured by the energy of the springs.

    Every contact p with the largest coefficient m_p and the stiffness kappa_p = k_n + k_t counts in
    the length of a change dw with its share of the energy,

        |dw|^2 = sum_p kappa_p |dw_p|^2 / sum_p kappa_p m_p^2,

    so that a contact cut into parts, kappa_p with it, counts as before: the unit of its unknowns is
    their size times sqrt(sum_q kappa_q (m_q/m)^2 / kappa_p), m the largest m_q. Sizes are the
    largest mean displacement, the largest dynamic one and the rigid amplitudes, each by its own.

    Parameters
    ----------
    b : Balance
    least : (n_unknown,) ndarray, optional
        An answer of typical size that keeps the unit when the solution starts from rest.
    by_energy : bool
        Otherwise the units are the sizes alone.

    Returns
    -------
    callable
        x (n_unknown,) -> units (n_unknown,).
    """
    law, o, rigid = b.contacts.law, b.harmonics.offset, b.rigid
    kappa = np.zeros(0)
    if by_energy:
        kappa = (law.k_n + law.k_t) / float((law.k_n + law.k_t).max())
    if least is None:
        # a displacement below which nothing matters: rounding of the motions the loads cause across
        # the contact springs
        k = float(max(law.k_t.max(), law.k_n.max()))
        force = max(float(np.abs(f).max()) for f in (b.static, b.dynamic))
        force = max(force, float(law.preload.max()))
        floor = float(max(1e4 * EPS * force / k, float(np.finfo(float).tiny) ** 0.5))
    else:
        floor = float(np.abs(b.split(least)[0]).max())
    # the mean is a difference of static terms: below their rounding, as the tolerance magnifies it,
    # it is not resolved
    resolved = STATIC_SHARE * float(np.abs(b.u0).max(initial=0.0))
    rigid_rows = float(np.abs(b.Psi[:, b.modal.rigid]).max(initial=0.0)) or 1.0

    def scale(x: FloatArray) -> FloatArray:
        D: FloatArray = unit_sizes(b.split(x)[0], kappa, o, floor, resolved, rigid_rows, rigid)
        return D

    return scale
