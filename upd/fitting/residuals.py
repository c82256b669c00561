r"""Residuals of a fit, the nearest answer to a start by bounded least squares, and what the targets
leave unknown: to first order, and by the ends of profiles, one parameter moved and the others
fitted; and which further measurement would tell most of it.

With residuals r_i = (value_i - target_i) / scale_i and the logarithms z of the factors,

    min 1/2 |r(z)|^2,   low <= z <= high,

by the trust-region reflective method. Scales of measured curves are stated half-widths, or 95 %
ones estimated from what the fit leaves.

With residuals r of N values and p inputs, the noise sigma^2 = (a |H|)^2 + b^2 follows by
`upd.measured.damping` and the half-width is t sigma, t of Student's distribution with N - p degrees
of freedom at 95 %. It holds for independent errors: what the curve has and the model has not makes
neighbouring residuals alike, and `FittedCurve.correlation` shows it.

J = dr/dz at the answer shows what is known: with the singular values s and right singular vectors w
of J diag(high - low), a share t of the room along w_i moves the residuals by s_i t. The covariance
of z is (J'J)^-1, in squared half-widths of the targets.

Beyond what the targets tell, the bounds are all that is known: half of the room between them,

    C = (J'J + P)^-1,   P = diag(1 / (half of the room))^2.

A further measurement of a number with the derivatives g and the half-width s leaves

    C' = C - C g g'C / (s^2 + g'C g),

and is ranked by the largest eigenvalue of C', the square of the half-width of the widest direction
(E-optimality).

References
----------
M. A. Branch, T. F. Coleman, Y. Li, SIAM J. Sci. Comput. 21 (1999) 1.
G. A. F. Seber, C. J. Wild, Nonlinear Regression (1989), 3.3 and 5.4; F. Pukelsheim, Optimal Design
of Experiments (2006), ch. 6; A. C. Atkinson, A. N. Donev, R. D. Tobias, Optimum Experimental
Designs, with SAS (2007), ch. 10 (augmented designs).
"""

from __future__ import annotations

import itertools
import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import norm, qmc
from scipy.stats import t as student

from upd.analyses.forced.model import quiet
from upd.errors import ConvergenceError, UpdError, one_line
from upd.fitting.responses import STEP, FitResponses
from upd.fitting.targets import (
    CONTACT_TOTALS,
    PEAK_NUMBERS,
    STUCK_MODES,
    CurveTarget,
    FitTarget,
    Targets,
    kind_of,
)
from upd.measured.damping import noise_of
from upd.scene import ForcedScene
from upd.units import unit_inside

Array = NDArray[np.float64]
#: half of the digits: below, a change of an exact number is rounding
ROUNDING = float(np.sqrt(np.finfo(float).eps))
#: to so much of its frequency a peak with friction is climbed
CLIMBED = 1e-6
#: change of ln(factor) below which the fit of a curve ends
FLAT = 1e-6
#: evaluations of one start at most
EVALUATIONS = 100
#: share of the room between the bounds that a start keeps away from them
_ROOM = 1e-6
#: probability with which an estimated half-width holds
PROBABILITY = 0.95


@dataclass(frozen=True)
class Start:
    """Where one start ended.

    Attributes
    ----------
    begin, end : ndarray
        (n,) ln(factor); the end is the begin where it failed.
    misfit : float
        |r|^2; infinite where it failed.
    failure : str
        Why it failed, "" where it did not.
    """

    begin: Array
    end: Array
    misfit: float
    failure: str = ""


class Residuals:
    """Residuals of a fit and their Jacobian.

    Parameters
    ----------
    responses
        What is aimed at.

    Attributes
    ----------
    curves : list of FittedCurve
        What the weights of the measured curves are made of.
    """

    def __init__(self, responses: FitResponses) -> None:
        self.responses = responses
        targets = responses.targets
        self.numbers = len(targets.numbers)
        values = [np.array([one.value for one in targets.numbers])]
        self.target = np.concatenate([*values, *(one.values for one in targets.curves)])
        self.known = bool(targets.curves) or targets.numbers[0].half_width is not None
        self.low, self.high = np.array([one.bounds for one in responses.parameters]).T
        self.curves = []
        for one in targets.curves:
            noise = one.relative or 0.0, one.constant or 0.0
            if not one.stated:
                # each point by its own size, down to where differences of the highest are rounding
                noise = 1.0, float(np.finfo(float).eps ** 0.5 * one.curve.magnitude.max())
            self.curves.append(FittedCurve(one, *noise, estimated=not one.stated))
        self.scale = self._scales([one.curve.magnitude for one in targets.curves])
        ends = self.numbers + np.cumsum([0, *(len(one.values) for one in targets.curves)])
        #: values of every curve
        self.parts = [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]

    def __call__(self, z: Array) -> Array:
        """(m,) residuals."""
        return self._with_slopes(z)[0]

    def jacobian(self, z: Array) -> Array:
        """(m, n) their derivatives by ln(factor)."""
        return self._with_slopes(z)[1]

    def _with_slopes(self, z: Array, coarse: bool = False) -> tuple[Array, Array]:
        """Residuals and Jacobian.

        Coarse ones count curves by the logarithms of their magnitudes, ln |H| / |H_measured| of
        every point, which lead to the answer from far: a peak at another frequency is seen from
        beside it.
        """
        value, slope = self.responses.at(z)
        r, J = (value - self.target) / self.scale, slope / self.scale[:, None]
        if not coarse:
            return r, J
        rows, lines = [r[: self.numbers]], [J[: self.numbers]]
        for one, part in zip(self.responses.targets.curves, self.parts, strict=True):
            H, dH = as_complex(one, value[part]), as_complex(one, slope[part])
            size = np.maximum(np.abs(H), np.finfo(float).tiny)
            measured = one.curve.magnitude
            least = np.finfo(float).eps * measured.max()
            rows.append(np.log(size / np.maximum(measured, least)))
            lines.append((H.conj()[:, None] * dH).real / size[:, None] ** 2)
        return np.concatenate(rows), np.concatenate(lines)

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
            size.append(np.abs(as_complex(one, value[part])))
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
        """What a residual without half-width may be off: where contacts are solved again or peaks
        are climbed, their own error.
        """
        steps = [step**2 for step in self.responses.steps if step > STEP]
        followed = [CLIMBED] if self.responses.targets.ratios else []
        return max([ROUNDING, *steps, *followed])

    def _scales(self, size: Sequence[Array]) -> Array:
        """(m,) half-widths, with curves of these magnitudes."""
        targets, parts = self.responses.targets, []
        for one, noise, H in zip(targets.curves, self.curves, size, strict=True):
            half = np.hypot(noise.relative * H, noise.constant)
            parts.append(np.tile(half, one.parts))
        return np.concatenate([np.array([one.scale for one in targets.numbers]), *parts])

    def solve(self, begin: Array, held: int | None = None, coarse: bool = False) -> Start:
        """The nearest answer to a start; with one parameter held where it is.

        Parameters
        ----------
        begin
            (n,) within the bounds.
        held
            Number of a parameter.
        coarse
            Whether curves count by the logarithms of their magnitudes.
        """
        free = np.array([k for k in range(len(begin)) if k != held], int)

        def whole(part: Array) -> Array:
            z = np.array(begin, float)
            z[free] = part
            return z

        def residual(part: Array) -> Array:
            try:
                return self._with_slopes(whole(part), coarse)[0]
            except ConvergenceError:
                # the method takes a shorter step
                return np.full(len(first), np.inf)

        def slope(part: Array) -> Array:
            return self._with_slopes(whole(part), coarse)[1][:, free]

        try:
            first = self._with_slopes(begin, coarse)[0]
            if not free.size:
                return Start(begin, begin, float((first**2).sum()))
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
            return Start(begin, begin, np.inf, one_line(error))
        return Start(begin, whole(found.x), 2.0 * float(found.cost))

    def inside(self, z: Array) -> Array:
        """Strictly within the bounds, as the method asks for."""
        room = _ROOM * (self.high - self.low)
        return np.clip(z, self.low + room, self.high - room)

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
class FittedCurve:
    """A measured curve, how well it is taken to be known, and the fitted one.

    Attributes
    ----------
    target
        What was measured.
    relative, constant
        Half-width of a part: of the value, and (m/s2)/N.
    estimated
        Whether from the residuals of the fit.
    computed
        (n,) of the answer, complex or magnitudes, (m/s2)/N; empty before a fit.
    correlation
        Of residuals of neighbouring points over their half-widths, 0 for independent errors.
    limit
        Three standard deviations of it for independent errors.
    rms
        Of the residuals, over the half-widths.
    rounding
        Whether the residuals are no more than what the model itself is off.
    """

    target: CurveTarget
    relative: float
    constant: float
    estimated: bool
    computed: NDArray[np.complex128] = field(default_factory=lambda: np.zeros(0, complex))
    correlation: float = 0.0
    limit: float = 1.0
    rms: float = 0.0
    rounding: bool = False

    @property
    def white(self) -> bool:
        """Whether the residuals may be independent errors, or are rounding."""
        return self.rounding or abs(self.correlation) <= self.limit

    @property
    def off(self) -> float:
        """Root of the mean square of the differences, over that of the measured values."""
        H = self.target.curve.accelerance
        computed = self.computed if self.target.curve.is_complex else np.abs(self.computed)
        return float(np.linalg.norm(computed - H) / np.linalg.norm(H))


def as_complex(target: CurveTarget, parts: Array) -> NDArray[np.complex128]:
    """Values from their parts (real, then imaginary; or magnitudes) along the first axis."""
    if not target.curve.is_complex:
        return parts.astype(complex)
    real, imaginary = np.split(parts, 2)
    return np.asarray(real + 1j * imaginary)


def noise_after(
    target: CurveTarget, parts: Array, unknowns: float, free: int, least: float
) -> FittedCurve:
    """From what a fit leaves.

    Parameters
    ----------
    parts
        Of the fitted curve.
    unknowns
        Inputs that were fitted to this curve.
    free
        Values of all targets less inputs.
    least
        Part of a value that the model itself is off.
    """
    r = (parts - target.values).reshape(target.parts, -1)
    computed = as_complex(target, parts)
    size = np.abs(computed)
    if target.stated:
        relative, constant = target.relative or 0.0, target.constant or 0.0
    else:
        found = noise_of(r, size, unknowns)
        factor = float(student.ppf(0.5 * (1.0 + PROBABILITY), max(free, 1)))
        relative, constant = factor * max(found.relative, least), factor * found.constant
    u = r / np.hypot(relative * size, constant)
    square = float((u**2).sum())
    near = float((u[:, 1:] * u[:, :-1]).sum()) / max(square, np.finfo(float).tiny)
    limit = 3.0 / np.sqrt(u.size)
    rms = float(np.sqrt(square / u.size))
    left = float(np.linalg.norm(r) / np.linalg.norm(size))
    return FittedCurve(
        target,
        relative,
        constant,
        not target.stated,
        computed,
        near,
        float(limit),
        rms,
        left <= least,
    )


# -- what the targets leave unknown, and what to measure next --------------------------------------


log = logging.getLogger(__name__)
#: quantile of 95 % intervals
_T = float(norm.ppf(0.975))
#: shares of a first-order half-width by which its ends may be off: without a note; and such that
#: a 95 % interval keeps its probability to half of its last digit, 2 t phi(t) share = 0.005
SHOWN, KEPT = 0.1, 0.005 / (2.0 * _T * float(norm.pdf(_T)))
#: steps to an end of a profile at most, growth from one to the next, and halvings of the last
_STEPS, _LONGER, _HALVINGS = 40, 1.3, 8
#: half-widths that are assumed of a measurement, as a part of its value, by its unit, where no
#: target has that unit
_ASSUMED = {"Hz": 1e-3, "(m/s2)/N": 0.05, "N/mm": 0.05}
#: F_C/F_E beside the scene's own, as parts of its lowest
_LOWER = (0.3, 0.1)


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
    rises : ndarray, optional
        (n, 2) how far the misfit rises to the ends of the intervals, 1 where it is quadratic; None
        where there are none.
    """

    singular: Array
    directions: Array
    unknown: NDArray[np.bool_]
    correlation: Array | None
    error: Array | None
    rises: Array | None = None


def misfit_rises(
    residuals: Callable[[Array], Array], known: Knowledge, z: Array, low: Array, high: Array
) -> Array:
    """How far the misfit rises to the ends of the first-order intervals.

    With C = (J'J)^-1 the least misfit with z_k held moves z along C e_k: to the end of its interval
    by d_k = C e_k / C_kk^(1/2), and to first order the misfit rises by |J d_k|^2 = 1. Where slopes
    change within the interval, as where contact points begin to slip, it rises otherwise.

    Parameters
    ----------
    residuals
        z (n,) -> (m,) in half-widths.
    known
        Of the answer, with its correlation and errors.
    z, low, high
        (n,) the answer and the bounds.

    Returns
    -------
    ndarray
        (n, 2) at the lower and the upper end; nan beyond a bound, where nothing was solved,
        and where the scene refuses the parameters.

    References
    ----------
    D. M. Bates, D. G. Watts, Nonlinear Regression Analysis and Its Applications (1988), 6.1.
    """
    assert known.correlation is not None and known.error is not None
    steps = known.correlation * known.error
    best = float(np.sum(residuals(z) ** 2))

    def rise(at: Array) -> float:
        if (at < low).any() or (at > high).any():
            return math.nan
        try:
            return float(np.sum(residuals(at) ** 2)) - best
        except UpdError:
            return math.nan

    return np.array([[rise(z - d), rise(z + d)] for d in steps])


def is_bent(rises: Array, share: float) -> bool:
    """Whether the misfit is not quadratic within a first-order interval: its true end is about the
    half-width over the root of the rise away.

    Parameters
    ----------
    rises
        (2,) to its ends; nan where not known.
    share
        Of the half-width by which an end may be off.
    """
    roots = np.sqrt(np.maximum(rises[np.isfinite(rises)], 0.0))
    return bool((np.abs(roots - 1.0) > share).any())


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


def profile_ends(residuals: Residuals, known: Knowledge, best: Array, k: int) -> Array:
    """Between which values of one parameter sets fit as well as the answer, the others fitted.

    A set fits as well while |r|^2 rises by no more than 1, with half-widths: an interval in the
    same multiple of standard deviations as they are; without, while the targets are met. First
    steps lead to the ends of first order, where there are any.

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

    Returns
    -------
    ndarray
        (2,) ln(factor).
    """
    least = float((residuals(best) ** 2).sum())
    span = float(residuals.high[k] - residuals.low[k])
    first = span / _STEPS
    if residuals.known and known.error is not None:
        first = min(first, float(known.error[k]))
    others = np.arange(len(best)) != k

    def moved(place: float, near: Array) -> tuple[bool, Array]:
        """Whether the set with the parameter there fits as well, sought from another set."""
        begin = near.copy()
        begin[k] = place
        begin[others] = residuals.inside(begin)[others]
        one = residuals.solve(begin, held=k)
        if residuals.known:
            return one.misfit - least <= 1.0, one.end
        return bool(np.isfinite(one.misfit)) and residuals.met(one.end), one.end

    ends = []
    for sign, bound in ((-1.0, residuals.low[k]), (1.0, residuals.high[k])):
        near, step, outside = best, first, math.nan
        while math.isnan(outside) and near[k] != bound:
            place = bound if sign * (bound - near[k]) <= step else near[k] + sign * step
            fits, z = moved(float(place), near)
            near, outside = (z, outside) if fits else (near, float(place))
            step = min(step * _LONGER, span / _STEPS)
        for _ in range(0 if math.isnan(outside) else _HALVINGS):
            middle = 0.5 * (float(near[k]) + outside)
            fits, z = moved(middle, near)
            near, outside = (z, outside) if fits else (near, middle)
        ends.append(near[k])
    return np.array(ends)


# -- what to measure next --------------------------------------------------------------------------


#: a number with the half-width that is assumed of its measurement, half of what the inputs leave it
#: today, and the half-width of the widest direction then, as a factor of the inputs
Further = tuple[FitTarget, float, float]


def candidates(scene: ForcedScene, targets: Targets, *, friction: bool) -> Targets:
    """Measurements that may be made: modes and peaks of the limits, peaks with friction at the
    scene's F_C/F_E and below, contact stiffness of the damper alone.

    Parameters
    ----------
    targets
        Those that were made; they are left out.
    friction
        Whether peaks with friction are among them.
    """
    names: list[tuple[str, float | None]] = [(one, None) for one in STUCK_MODES]
    names += [(name, None) for name, (kind, *_) in PEAK_NUMBERS.items() if kind]
    if friction:
        own = scene.excitation.centrifugal_to_force
        ratios = sorted({*own, *(round(part * min(own), 6) for part in _LOWER)})
        names += [
            (name, ratio)
            for ratio in ratios
            for name, (kind, side, *_) in PEAK_NUMBERS.items()
            if not kind and side == "right"
        ]
    names += [(one, None) for one in CONTACT_TOTALS]
    made = {one.name for one in targets.numbers}
    found = [FitTarget(of, 1.0, None, unit_inside(kind_of(of)), ratio) for of, ratio in names]
    return Targets(tuple(one for one in found if one.name not in made))


def rank_measurements(residuals: Residuals, best: Array) -> tuple[float, tuple[Further, ...]]:
    """Half-width of the widest direction today, as a factor of the inputs, and measurements by how
    much each would narrow it, the most telling first.

    Parameters
    ----------
    residuals
        Of the fit.
    best
        (n,) the answer.
    """
    made = residuals.responses
    scene, targets = made.scene, made.targets
    friction = bool(targets.ratios) or (made.cheap and not made.seated)
    asked = candidates(scene, targets, friction=friction)
    responses = FitResponses(scene, asked, made.parameters, needed=False, like=made)
    try:
        with quiet():
            value, slope = responses.at(best)
    except UpdError as error:
        log.info("further measurements: %s", one_line(error))
        return math.nan, ()
    J = residuals.jacobian(best)
    if not residuals.known:
        each = [_half(one.unit, one.value, targets) for one in targets.numbers]
        J = J * (residuals.target / each)[:, None]
    room = 0.5 * (residuals.high - residuals.low)
    C = np.linalg.inv(J.T @ J + np.diag(room**-2.0))
    now, out = _widest(C), []
    for one, v, g in zip(asked.numbers, value.tolist(), slope, strict=True):
        if np.isfinite(v) and np.isfinite(g).all():
            half, spread = _half(one.unit, v, targets), float(np.sqrt(g @ C @ g))
            then = _widest(C - np.outer(C @ g, C @ g) / (half**2 + spread**2))
            out.append((replace(one, value=v, half_width=half), spread, then))
    return now, tuple(sorted(out, key=lambda one: one[2]))


def _half(unit: str, value: float, targets: Targets) -> float:
    """Half-width of a measurement: relative, as the widest of the targets of that unit."""
    known = [
        one.half_width / one.value
        for one in targets.numbers
        if one.unit == unit and one.half_width is not None
    ]
    return abs(value) * max(known, default=_ASSUMED[unit])


def _widest(C: NDArray[Any]) -> float:
    """Half-width along the widest direction, as a factor of the inputs."""
    return float(np.exp(np.sqrt(np.linalg.eigvalsh(C)[-1])))
