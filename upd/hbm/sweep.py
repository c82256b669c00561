"""Curves of the balance over frequency, load or slider start: the bridge between the mechanics and the continuation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upd.hbm.balance import Balance
from upd.hbm.checks import sticking_margin
from upd.hbm.continuation import Function, Path, Scale, Settings, Solution, follow, solve

FloatArray = NDArray[np.float64]
EPS = float(np.finfo(float).eps)
#: arclength unit of frequency, as a share of the mean frequency: a resonance of a few per cent is one unit wide
FREQUENCY_SHARE = 0.05
#: smallest motion, relative to the mean displacement, that is converged to its own size
SMALL_MOTION = 1e-3
#: difference, relative to their size, at which two answers at one frequency are different solutions
OTHER_BRANCH = 1e-6


@dataclass(frozen=True)
class Curve:
    """Points of a sweep: p (n,) [Hz], x (n, n_unknown), exact (n,) where the linear stuck answer was taken, status, message."""

    p: FloatArray
    x: FloatArray
    exact: NDArray[np.bool_]
    status: str
    message: str


class First(NamedTuple):
    """A first solved point, or None, and the slider positions (n_point, 2) the static loads leave."""

    x: FloatArray | None
    slider: FloatArray | None


def over_frequency(b: Balance) -> Function:
    """Residual over frequency [Hz] for the continuation."""

    def function(x: FloatArray, f: float, jacobian: bool) -> tuple[FloatArray, FloatArray | None, FloatArray]:
        e = b.evaluate(x, 2 * np.pi * f, jacobian)
        return e.residual, e.jacobian, 2 * np.pi * e.by_frequency

    return function


def over_load(b: Balance, frequency: float, static: bool = False) -> Function:
    """Residual over a factor on the dynamic loads (or the static ones) at one frequency; linear in the factor."""
    omega = 2 * np.pi * frequency
    none = b.with_loads(0.0, 1.0) if static else b.with_loads(1.0, 0.0)
    zero = np.zeros(b.size)
    slope = b.evaluate(zero, omega, False).residual - none.evaluate(zero, omega, False).residual

    def function(x: FloatArray, s: float, jacobian: bool) -> tuple[FloatArray, FloatArray | None, FloatArray]:
        e = none.evaluate(x, omega, jacobian)
        return e.residual + s * slope, e.jacobian, slope

    return function


def scale_of(b: Balance, least: FloatArray | None = None) -> Scale:
    """Size of the unknowns: the largest mean displacement, the largest dynamic one and the rigid amplitudes, each measured by its own.

    `least` (n_unknown,) is an answer of typical size that keeps the unit when the solution starts from rest.
    """
    o = b.harmonics.offset
    floor = _floor(b) if least is None else float(np.abs(b.split(least)[0]).max())

    rigid_rows = float(np.abs(b.Psi[:, b.modal.rigid]).max(initial=0.0)) or 1.0

    def scale(x: FloatArray) -> FloatArray:
        W, a = b.split(x)
        moving, mean = float(np.abs(W[..., o:]).max()), float(np.abs(W[..., :o]).max(initial=0.0))
        still = max(mean, moving, floor)
        # a motion far below the mean displacement is measured by its own size as far as the rounding of the mean lets it
        D = np.full(W.shape, max(moving, SMALL_MOTION * mean, floor))
        D[..., :o] = still
        return np.concatenate([D.ravel(), np.full(len(a), still / rigid_rows)])

    return scale


def _floor(b: Balance) -> float:
    """A displacement below which nothing matters: rounding of the motions the loads cause across the contact springs."""
    k = float(max(b.contacts.law.k_t.max(), b.contacts.law.k_n.max()))
    force = max(float(np.abs(b.static).max()), float(np.abs(b.dynamic).max()), float(b.contacts.law.preload.max()))
    return float(max(1e4 * EPS * force / k, float(np.finfo(float).tiny) ** 0.5))


def over_friction(b: Balance, frequency: float) -> Function:
    """Residual over q, friction coefficients mu/q: q -> 0 is the stuck answer, q = 1 the problem itself."""
    omega, law = 2 * np.pi * frequency, b.contacts.law

    def at(q: float) -> Balance:
        return replace(b, contacts=replace(b.contacts, law=replace(law, mu=law.mu / q)))

    def function(x: FloatArray, q: float, jacobian: bool) -> tuple[FloatArray, FloatArray | None, FloatArray]:
        e, h = at(q).evaluate(x, omega, jacobian), EPS ** (1 / 3) * q
        if not jacobian:
            return e.residual, None, np.zeros(b.size)
        up, down = (at(q + d).evaluate(x, omega, False).residual for d in (h, -h))
        return e.residual, e.jacobian, (up - down) / (2 * h)

    return function


def from_stuck(b: Balance, frequency: float, settings: Settings | None = None) -> FloatArray | None:
    """Unknowns at one frequency [Hz], friction lowered from the value at which the stuck answer is exact; None when it does not arrive."""
    x = b.stuck(2 * np.pi * frequency)
    q = sticking_margin(b, x)
    if q >= 1:
        return x
    if q <= 0:
        return None
    q *= 1 - EPS**0.5
    path = follow(over_friction(b, frequency), (x, q), 1.0, scale=scale_of(b, x), p_scale=1.0, settings=settings)
    return path.x[-1] if path.status == "complete" else None


def first_point(b: Balance, frequency: float, guess: FloatArray | None = None, settings: Settings | None = None) -> First:
    """A solution at one frequency [Hz]: Newton from the guess, the stuck and the free answer; then friction lowered from sticking; then
    the dynamic loads raised from zero."""
    omega, scale = 2 * np.pi * frequency, scale_of(b)
    statics = _static(b, frequency, settings) if b.start == "static" else None
    slider = None if statics is None else _sliders(b, statics)
    b = replace(b, slider=slider) if b.start == "static" else b
    for x in (guess, b.stuck(omega), b.free(omega)):
        if x is not None:
            found = solve(over_frequency(b), x, frequency, scale, settings)
            if found.tangent is not None:
                return First(found.x, slider)
    lowered = from_stuck(b, frequency, settings)
    if lowered is not None:
        return First(lowered, slider)
    statics = _static(b, frequency, settings) if statics is None else statics
    if statics is None:
        return First(None, slider)
    path = follow(over_load(b, frequency), (statics, 0.0), 1.0, scale=scale_of(b, b.stuck(omega)), p_scale=1.0, settings=settings)
    return First(path.x[-1] if path.status == "complete" else None, slider)


def _static(b: Balance, frequency: float, settings: Settings | None) -> FloatArray | None:
    """Unknowns under the static loads alone, sliders at zero."""
    rest = replace(b.with_loads(1.0, 0.0), start="zero", slider=None)
    found: Solution = solve(over_frequency(rest), rest.stuck(2 * np.pi * frequency), frequency, scale_of(b), settings)
    return found.x if found.tangent is not None else from_stuck(rest, frequency, settings)


def _sliders(b: Balance, x: FloatArray) -> FloatArray:
    rest = replace(b.with_loads(1.0, 0.0), start="zero", slider=None)
    out, d = np.zeros((b.contacts.n_point, 2)), b.contacts.tangents
    if b.harmonics.static:
        T = rest.force(x).force[:, 1:, 0]
        out[:, :d] = b.split(x)[0][:, 1:, 0] - T / b.contacts.law.k_t[:, None]
    return out


def sweep(b: Balance, f: FloatArray, exact: NDArray[np.bool_], guess: FloatArray | None = None, settings: Settings | None = None) -> Curve:
    """The curve over f (n,) [Hz], in that order: exact stuck answers where proven, continuation over each stretch between."""
    parts: list[Curve] = []
    i = 0
    while i < len(f):
        if exact[i]:
            stop = i + int(np.argmin(np.append(exact[i:], False)))
            x = np.array([b.stuck(2 * np.pi * v) for v in f[i:stop]])
            parts.append(Curve(f[i:stop], x, np.ones(stop - i, dtype=bool), "complete", ""))
            i = stop
            continue
        stop = i + int(np.argmax(np.append(exact[i:], True)))
        part, i = _to_the_next(b, f, i, stop, parts[-1].x[-1] if parts else guess, bool(parts), settings)
        parts.append(part)
        if part.status != "complete":
            break
    p, x, e = (np.concatenate([getattr(c, name) for c in parts]) for name in ("p", "x", "exact"))
    done = f"reached {f[-1]:.9g} Hz in {len(p)} points, {int(e.sum())} of them by the linear stuck answer"
    return Curve(p, x, e, parts[-1].status, parts[-1].message or done)


def _to_the_next(
    b: Balance, f: FloatArray, i: int, stop: int, x: FloatArray | None, known: bool, settings: Settings | None
) -> tuple[Curve, int]:
    """Continuation over f[i:stop] and onto the next exact answer; arriving on another branch, it follows that to the end."""
    last = stop < len(f)
    part = _stretch(b, f, list(range(i, stop + last)), x, known, settings)
    if not last or part.status != "complete":
        return part, stop
    there, here = b.stuck(2 * np.pi * f[stop]), part.x[-1]
    if float(np.abs((here - there) / scale_of(b)(there)).max()) <= OTHER_BRANCH:
        return Curve(part.p[:-1], part.x[:-1], part.exact[:-1], part.status, part.message), stop
    return _stretch(b, f, list(range(i, len(f))), x, known, settings), len(f)


def _stretch(b: Balance, f: FloatArray, index: list[int], x: FloatArray | None, known: bool, settings: Settings | None) -> Curve:
    """Continuation over the consecutive frequencies f[index], from the solved point before them when `known`."""
    begin = f[index[0] - 1] if known else f[index[0]]
    if not known:
        x = first_point(b, begin, x, settings).x
    if x is None:
        empty = np.zeros((0, b.size))
        message = f"no solution found at {begin:.9g} Hz: start at a frequency far from resonance or change the slider start"
        return Curve(np.zeros(0), empty, np.zeros(0, dtype=bool), "stopped", message)
    end, wanted = f[index[-1]], f[index]
    p_scale = FREQUENCY_SHARE * float(np.mean(f))
    if begin == end:
        return Curve(np.array([begin]), x[None], np.zeros(1, dtype=bool), "complete", "")
    path: Path = follow(over_frequency(b), (x, begin), end, scale=scale_of(b), p_scale=p_scale, wanted=wanted, settings=settings)
    keep = slice(1, None) if known else slice(None)
    return Curve(
        path.p[keep], path.x[keep], np.zeros(len(path.p[keep]), dtype=bool), path.status, path.message if path.status != "complete" else ""
    )
