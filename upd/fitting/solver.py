"""Bounded least squares from several starts, and what the targets leave unknown.

With residuals r_i = (value_i - target_i) / scale_i and the logarithms z of the factors,

    min 1/2 |r(z)|^2,   low <= z <= high,

by the trust-region reflective method. J = dr/dz at the answer tells, to first order, what is
known: with the singular values s and right singular vectors w of J diag(high - low), a share t of
the room along w_i moves the residuals by s_i t. The covariance of z is (J'J)^-1, in squared
half-widths of the targets.

References
----------
M. A. Branch, T. F. Coleman, Y. Li, SIAM J. Sci. Comput. 21 (1999) 1; G. A. F. Seber, C. J. Wild,
Nonlinear Regression (1989), 3.3 and 5.4.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import qmc

from upd.errors import ConvergenceError, UpdError, one_line
from upd.fitting.noise import as_complex, first_noise, magnitude_of, noise_after
from upd.fitting.responses import FitResponses

Array = NDArray[np.float64]
Status = Literal["found", "several", "family", "not reached"]
#: half of the digits: below, a change of an exact number is rounding
ROUNDING = float(np.sqrt(np.finfo(float).eps))
#: to so much of its frequency a peak with friction is climbed
CLIMBED = 1e-6
#: change of ln(factor) below which the fit of a curve ends
FLAT = 1e-6
#: rounds in which the weights of curves are renewed, and change of a weight below which they end
_ROUNDS, _SETTLED = 12, 1e-3
#: evaluations of one start at most
EVALUATIONS = 100
#: times that curves with friction are followed afresh at the end of a start at most
_BRANCHES = 4
#: seconds of a start that is told when it ends
_TOLD_S = 2.0
#: two ends of starts nearer than this in every ln(factor) are one answer
_SAME = 1e-3


@dataclass(frozen=True)
class Start:
    """Where one start ended.

    Attributes
    ----------
    begin, end : ndarray
        (n,) ln(factor); the end is the begin where it failed.
    misfit : float
        |r|^2; infinite where it failed.
    evaluations : int
        Of the numbers and their derivatives.
    failure : str
        Why it failed, "" where it did not.
    """

    begin: Array
    end: Array
    misfit: float
    evaluations: int
    failure: str = ""


class Residuals:
    """Residuals of a fit and their Jacobian.

    Parameters
    ----------
    responses
        What is aimed at.

    Attributes
    ----------
    curves : list of CurveNoise
        What the weights of the measured curves are made of.
    coarse : bool
        Whether curves count by the logarithms of their magnitudes, which lead to the answer from
        far: a peak at another frequency is seen from beside it.
    """

    def __init__(self, responses: FitResponses) -> None:
        self.responses = responses
        targets = responses.targets
        self.numbers = len(targets.numbers)
        values = [np.array([one.value for one in targets.numbers])]
        self.target = np.concatenate([*values, *(one.values for one in targets.curves)])
        self.known = bool(targets.curves) or targets.numbers[0].half_width is not None
        self.low, self.high = np.array([one.bounds for one in responses.parameters]).T
        self.coarse = False
        self.curves = [first_noise(one) for one in targets.curves]
        self.scale = self._scales([one.curve.magnitude for one in targets.curves])
        ends = self.numbers + np.cumsum([0, *(len(one.values) for one in targets.curves)])
        #: values of every curve
        self.parts = [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]

    def __call__(self, z: Array) -> Array:
        """(m,) residuals."""
        value = self.responses.at(z)[0]
        out = np.asarray((value - self.target) / self.scale)
        return self._coarse(value, out, None)[0] if self.coarse else out

    def jacobian(self, z: Array) -> Array:
        """(m, n) their derivatives by ln(factor)."""
        value, slope = self.responses.at(z)
        J = np.asarray(slope / self.scale[:, None])
        if not self.coarse:
            return J
        return self._coarse(value, (value - self.target) / self.scale, (slope, J))[1]

    def weigh(self, z: Array) -> float:
        """Weights of the measured curves by what the fit has there: their noise by the magnitude of
        the fitted curve, estimated from its residuals where it was not stated.

        Returns
        -------
        float
            Largest relative change of a weight.
        """
        value, before = self.responses.at(z)[0], self.scale
        count = len(self.target)
        self.curves, size = [], []
        for one, part in zip(self.responses.targets.curves, self.parts, strict=True):
            unknowns = len(self.low) * len(one.values) / count
            noise = noise_after(one, value[part], unknowns, count - len(self.low), self.rounding)
            self.curves.append(noise)
            size.append(magnitude_of(one, value[part]))
        self.scale = self._scales(size)
        change = np.abs(self.scale / before - 1.0)
        return float(change.max(initial=0.0))

    def met(self, z: Array) -> bool:
        """Whether every target is met: numbers within their half-widths, or exactly where they have
        none, curves within theirs in the mean of the squares.
        """
        r = self(z)
        limit = 1.0 if self.known else self.rounding
        numbers = bool(np.abs(r[: self.numbers]).max(initial=0.0) <= limit)
        return numbers and all(float(np.mean(r[part] ** 2)) <= 1.0 for part in self.parts)

    @property
    def rounding(self) -> float:
        """What a residual without half-width may be off: of differences and of peaks that are
        climbed, their own error.
        """
        steps = [
            step**2
            for step, exact in zip(self.responses.source.steps, self.responses.exact, strict=True)
            if not exact
        ]
        followed = [CLIMBED] if self.responses.targets.ratios else []
        return max([ROUNDING, *steps, *followed])

    def _scales(self, size: Sequence[Array]) -> Array:
        """(m,) half-widths, with curves of these magnitudes."""
        targets, parts = self.responses.targets, []
        for one, noise, H in zip(targets.curves, self.curves, size, strict=True):
            half = np.hypot(noise.relative * H, noise.constant)
            parts.append(np.tile(half, one.parts))
        return np.concatenate([np.array([one.scale for one in targets.numbers]), *parts])

    def _coarse(
        self, value: Array, r: Array, slopes: tuple[Array, Array] | None
    ) -> tuple[Array, Array]:
        """Residuals and Jacobian with one row ln |H| / |H_measured| for every point of a curve."""
        rows, lines = [r[: self.numbers]], []
        if slopes is not None:
            lines.append(slopes[1][: self.numbers])
        for one, part in zip(self.responses.targets.curves, self.parts, strict=True):
            H = as_complex(one, value[part])
            size = np.maximum(np.abs(H), np.finfo(float).tiny)
            measured = one.curve.magnitude
            least = np.finfo(float).eps * measured.max()
            rows.append(np.log(size / np.maximum(measured, least)))
            if slopes is not None:
                dH = as_complex(one, slopes[0][part])
                lines.append((H.conj()[:, None] * dH).real / size[:, None] ** 2)
        return np.concatenate(rows), np.concatenate(lines) if lines else np.zeros(0)

    def solve(self, begin: Array, held: int | None = None) -> Start:
        """The nearest answer to a start; with one parameter held where it is.

        Parameters
        ----------
        begin
            (n,) within the bounds.
        held
            Number of a parameter.
        """
        free = np.array([k for k in range(len(begin)) if k != held], int)

        def whole(part: Array) -> Array:
            z = np.array(begin, float)
            z[free] = part
            return z

        def residual(part: Array) -> Array:
            return self(whole(part))

        def slope(part: Array) -> Array:
            return self.jacobian(whole(part))[:, free]

        try:
            if not free.size:
                return Start(begin, begin, float((self(begin) ** 2).sum()), 1)
            # with noise the misfit stays, and the last digits of z change nothing that is known
            small = self.rounding if not self.parts else max(self.rounding, FLAT)
            found = least_squares(
                residual,
                begin[free],
                jac=slope,
                bounds=(self.low[free], self.high[free]),
                xtol=(1.0 if self.parts else 0.1) * small,
                ftol=small**1.9,
                gtol=small**1.9,
                max_nfev=EVALUATIONS,
            )
        except (UpdError, np.linalg.LinAlgError) as error:
            return Start(begin, begin, np.inf, 0, one_line(error))
        return Start(begin, whole(found.x), 2.0 * float(found.cost), int(found.nfev))

    def starts(self, count: int) -> list[Array]:
        """The scene itself, and points spread evenly over the bounds, the same ones every time."""
        n = len(self.low)
        inside = 0.5 * (self.high - self.low)
        middle = self.low + inside
        # strictly inside, as the method asks for
        first = np.clip(np.zeros(n), middle - 0.99 * inside, middle + 0.99 * inside)
        points = qmc.Halton(n, scramble=True, rng=0).random(max(count - 1, 0))
        return [first, *(self.low + points * (self.high - self.low))]


@dataclass(frozen=True)
class Knowledge:
    """What the targets tell of the parameters at an answer, to first order.

    Attributes
    ----------
    singular : ndarray
        (n,) singular values, falling, of J times the room of ln(factor) between the bounds: how far
        residuals move from bound to bound; 0 beyond the targets' number.
    directions : ndarray
        (n, n) a row each, of length 1 in ln(factor).
    unknown : ndarray
        (n,) of bool: directions that leave all residuals as they are. With half-widths those that
        move residuals by less than one from bound to bound.
    correlation : ndarray, optional
        (n, n) of the parameters; None where directions are unknown.
    error : ndarray, optional
        (n,) half-widths of ln(factor), or what ln(factor) moves as every target is known to its own
        size alone; None where directions are unknown.
    """

    singular: Array
    directions: Array
    unknown: NDArray[np.bool_]
    correlation: Array | None
    error: Array | None


def knowledge(residuals: Residuals, z: Array) -> Knowledge:
    """What is known at an answer.

    Parameters
    ----------
    residuals
        Of the fit.
    z
        (n,) the answer.
    """
    J, span = residuals.jacobian(z), residuals.high - residuals.low
    n = len(span)
    _, s, W = np.linalg.svd(J * span)
    s = np.concatenate([s, np.zeros(n - len(s))])
    V = W * span
    V /= np.linalg.norm(V, axis=1)[:, None]
    unknown = s < (1.0 if residuals.known else residuals.rounding * s[0])
    if unknown.any():
        return Knowledge(s, V, unknown, None, None)
    covariance = span[:, None] * ((W.T / s**2) @ W) * span
    error = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(error, error)
    return Knowledge(s, V, unknown, correlation, error)


def search(
    residuals: Residuals, count: int, tell: Callable[[str, float | None], None]
) -> list[Start]:
    """All starts, the best end first.

    Parameters
    ----------
    residuals
        Of the fit.
    count
        Of starts.
    tell
        Told where each begins, and with its seconds where one that took long ends.

    Raises
    ------
    ConvergenceError
        When all fail.
    """
    done = []
    for k, begin in enumerate(residuals.starts(count), 1):
        tell(f"start {k} of {count}", None)
        since = time.perf_counter()
        done.append(_from(residuals, begin))
        took = time.perf_counter() - since
        if took > _TOLD_S:
            end = done[-1].failure or f"misfit {done[-1].misfit:.3g}"
            tell(f"start {k} of {count}: {end}", took)
    if not np.isfinite([one.misfit for one in done]).any():
        raise ConvergenceError(f"no start of the fit came to an answer: {done[0].failure}")
    return sorted(done, key=lambda one: one.misfit)


def _from(residuals: Residuals, begin: Array) -> Start:
    """One start: of curves their magnitudes first, as logarithms, then as they are."""
    if not residuals.parts:
        return residuals.solve(begin)
    residuals.responses.forget()
    residuals.coarse = True
    try:
        near = residuals.solve(begin)
    finally:
        residuals.coarse = False
    if near.failure:
        return near
    found, count = near, near.evaluations
    for _ in range(_BRANCHES):
        # curves with friction may have been followed onto another of their branches
        residuals.responses.forget()
        again = residuals.solve(_inside(residuals, found.end))
        count += again.evaluations
        nearer = found is near or again.misfit < (1.0 - _SETTLED) * found.misfit
        found = again if nearer and not again.failure else found
        if not nearer or again.failure or not residuals.responses.targets.ratios:
            break
    if found is near:
        return replace(again, begin=begin, evaluations=count)
    return replace(found, begin=begin, evaluations=count)


def _inside(residuals: Residuals, z: Array) -> Array:
    """Strictly within the bounds, as the method asks for."""
    room = 1e-6 * (residuals.high - residuals.low)
    return np.clip(z, residuals.low + room, residuals.high - room)


def settled(residuals: Residuals, done: list[Start]) -> list[Start]:
    """The starts again with weights by the best fit, until these agree with it.

    Parameters
    ----------
    residuals
        Of the fit; its weights are renewed.
    done
        Of `search`.

    Returns
    -------
    list of Start
        The best first; those that ended elsewhere with their misfit under the new weights.
    """
    if not residuals.parts:
        return done
    best = done[0]
    for _ in range(_ROUNDS):
        change = residuals.weigh(best.end)
        again = residuals.solve(_inside(residuals, best.end))
        if not again.failure:
            best = replace(
                again, begin=best.begin, evaluations=best.evaluations + again.evaluations
            )
        if change < _SETTLED:
            break
    others = []
    for one in done[1:]:
        if np.isfinite(one.misfit):
            one = replace(one, misfit=float((residuals(one.end) ** 2).sum()))
        others.append(one)
    return sorted([best, *others], key=lambda one: one.misfit)


def answers(residuals: Residuals, done: Sequence[Start]) -> list[Array]:
    """Ends that fit as well as the best and differ from each other, the one nearest to the scene
    first.

    Parameters
    ----------
    residuals
        Of the fit.
    done
        Of `search`.
    """
    best = done[0].misfit
    J = residuals.jacobian(done[0].end) if residuals.known else None

    def apart(a: Array, b: Array) -> bool:
        """Whether two ends differ, and by more than is known."""
        told = J is None or float(((J @ (a - b)) ** 2).sum()) > 1.0
        return bool(np.abs(a - b).max() > _SAME) and told

    more = 1.0 if residuals.known else max(residuals.rounding**2, ROUNDING * best)
    out: list[Array] = []
    for one in done:
        if one.misfit <= best + more and all(apart(one.end, z) for z in out):
            out.append(one.end)
    return sorted(out, key=lambda z: float(np.linalg.norm(z)))


def status_of(residuals: Residuals, known: Knowledge, found: Sequence[Array]) -> Status:
    """How a fit ended.

    Parameters
    ----------
    residuals
        Of the fit.
    known
        At the best answer.
    found
        Of `answers`.
    """
    compromise = len(residuals.target) > len(residuals.low) and not residuals.known
    compromise |= any(one.estimated for one in residuals.curves)
    if not compromise and not residuals.met(found[0]):
        return "not reached"
    if known.unknown.any():
        return "family"
    return "several" if len(found) > 1 else "found"


@dataclass(frozen=True)
class Profile:
    """Sets of parameters that fit as well as the answer, one parameter moved, the others fitted.

    Attributes
    ----------
    parameter : int
        Which is moved.
    z : ndarray
        (k, n) sets, rising in the parameter moved.
    rise : ndarray
        (k,) of |r|^2 above the answer's.
    ends : tuple of float
        Of ln(factor) between which they fit as well.
    bounded : tuple of bool
        Whether an end is one of the bounds.
    """

    parameter: int
    z: Array
    rise: Array
    ends: tuple[float, float]
    bounded: tuple[bool, bool]


#: points of a profile to each side at most, and halvings of the interval that holds an end
_POINTS, _HALVINGS = 40, 10
_LONGER = 1.3


def profile(residuals: Residuals, known: Knowledge, best: Array, k: int) -> Profile:
    """The profile of one parameter, from the answer to both sides.

    A set fits as well while |r|^2 rises by no more than 1, with half-widths: an interval in the
    same multiple of standard deviations as they are; without, while the targets are met.

    Parameters
    ----------
    residuals
        Of the fit.
    known
        At the answer.
    best
        (n,) the answer.
    k
        Number of the parameter.
    """
    least = float((residuals(best) ** 2).sum())
    span = float(residuals.high[k] - residuals.low[k])
    step = span / _POINTS
    if residuals.known and known.error is not None:
        step = min(step, 0.25 * float(known.error[k]))

    def fits(one: Start) -> bool:
        if residuals.known:
            return one.misfit - least <= 1.0
        return bool(np.isfinite(one.misfit)) and residuals.met(one.end)

    def at(place: float, near: Array) -> Start:
        begin = near.copy()
        begin[k] = place
        others = np.arange(len(begin)) != k
        room = 1e-6 * (residuals.high - residuals.low)
        begin[others] = np.clip(begin, residuals.low + room, residuals.high - room)[others]
        return residuals.solve(begin, held=k)

    sides, ends, bounded = [], [], []
    for sign, bound in ((-1.0, residuals.low[k]), (1.0, residuals.high[k])):
        rows, here, length = [(best, 0.0)], best, step
        end, on_bound = float(best[k]), False
        for _ in range(_POINTS):
            place = here[k] + sign * length
            on_bound = bool(sign * (place - bound) >= 0.0)
            one = at(float(bound) if on_bound else float(place), here)
            if not fits(one):
                inside, outside, on_bound = float(here[k]), float(one.end[k]), False
                for _ in range(_HALVINGS):
                    middle = 0.5 * (inside + outside)
                    again = at(middle, here)
                    inside, outside = (middle, outside) if fits(again) else (inside, middle)
                    if fits(again):
                        rows.append((again.end, again.misfit - least))
                        here = again.end
                end = inside
                break
            here, end = one.end, float(one.end[k])
            rows.append((here, one.misfit - least))
            if on_bound:
                break
            length = min(length * _LONGER, span / _POINTS)
        sides.append(rows)
        ends.append(end)
        bounded.append(on_bound)
    low, high = sides
    rows = [*reversed(low[1:]), *high]
    z = np.array([row for row, _ in rows])
    return Profile(
        k, z, np.array([rise for _, rise in rows]), (ends[0], ends[1]), (bounded[0], bounded[1])
    )
