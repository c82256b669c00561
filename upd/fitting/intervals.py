r"""What the targets of a fit leave unknown: to first order, and by the ends of profiles, one
parameter moved and the others fitted; and which further measurement would tell most of it.

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
G. A. F. Seber, C. J. Wild, Nonlinear Regression (1989), 3.3 and 5.4; F. Pukelsheim, Optimal Design
of Experiments (2006), ch. 6; A. C. Atkinson, A. N. Donev, R. D. Tobias, Optimum Experimental
Designs, with SAS (2007), ch. 10 (augmented designs).
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from upd.analyses.forced.model import quiet
from upd.errors import UpdError, one_line
from upd.fitting.models import is_seated
from upd.fitting.residuals import Residuals
from upd.fitting.responses import FitResponses
from upd.fitting.targets import (
    CONTACT_TOTALS,
    PEAK_NUMBERS,
    STUCK_MODES,
    FitTarget,
    Targets,
)
from upd.scene import ForcedScene

log = logging.getLogger(__name__)
Array = NDArray[np.float64]
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


@dataclass(frozen=True)
class FurtherMeasurement:
    """What a measurement that was not made would tell.

    Attributes
    ----------
    name, unit
        Of the number, as a target names it.
    low, high
        What the fit predicts for it today.
    half_width
        Assumed of the measurement.
    widest
        Half-width of the widest direction today, as a factor of the inputs.
    then
        The same with the measurement.
    """

    name: str
    unit: str
    low: float
    high: float
    half_width: float
    widest: float
    then: float


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
    found = [FitTarget(of, 1.0, None, _unit(of), ratio) for of, ratio in names]
    return Targets(tuple(one for one in found if one.name not in made))


def rank_measurements(residuals: Residuals, best: Array) -> tuple[FurtherMeasurement, ...]:
    """Measurements by how much each would narrow the widest direction, the most telling first.

    Parameters
    ----------
    residuals
        Of the fit.
    best
        (n,) the answer.
    """
    made = residuals.responses
    scene, targets = made.scene, made.targets
    friction = bool(targets.ratios) or (made.cheap and not is_seated(scene))
    asked = candidates(scene, targets, friction=friction)
    responses = FitResponses(scene, asked, made.parameters, needed=False, like=made)
    try:
        with quiet():
            value, slope = responses.at(best)
    except UpdError as error:
        log.info("further measurements: %s", one_line(error))
        return ()
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
            ends = v - spread, v + spread
            out.append(FurtherMeasurement(one.name, one.unit, *ends, half, now, then))
    return tuple(sorted(out, key=lambda one: one.then))


def _unit(of: str) -> str:
    if of in CONTACT_TOTALS:
        return "N/mm"
    return "(m/s2)/N" if of.endswith("accelerance") else "Hz"


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
