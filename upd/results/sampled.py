"""A number over a sample of uncertain inputs, beside its first-order band.

The inputs are drawn evenly between the limits that their half-widths give, so that a half-width is
sqrt(3) standard deviations (JCGM 100:2008, 4.3.7); the band of a number is the same multiple of its
own. To first order the number at a point with the inputs z_k half-widths off their values is

    q_i = q_0 (1 + sum_k c_k z_ik),

with c_k the relative change by half-width k. The standard deviations of both over the same points
have the ratio rho: what the sample makes of the first-order band B is rho B. Both feel the points
that were drawn alike, so that rho is known far better than either; where the first order is exact,
it is 1 on every sample. Its sampling error is that of the jackknife for independent draws, which
those of a Latin hypercube undercut.

References
----------
JCGM 101:2008, Propagation of distributions using a Monte Carlo method, 6.4.2 (limits) and 8.1 (when
a first-order band is validated: as far as its two digits go).
B. Efron, C. Stein (1981), The jackknife estimate of variance, Annals of Statistics 9, 586-596.
A. B. Owen (1997), Monte Carlo variance of scrambled net quadrature, SIAM Journal on Numerical
Analysis 34, 1884-1910: a Latin hypercube of n points is no worse than n - 1 independent draws.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from upd.labels import percent_of
from upd.results.number import InputPart

Array = NDArray[np.float64]

#: half-widths of limits over the standard deviation of what lies evenly between them
LIMITS = math.sqrt(3.0)
#: part of the sample beyond either end that is reported, and of its distribution beyond either end
#: of a comparison's 95 % interval
TAIL = 0.025
#: verdicts
AGREES, DIFFERS, UNKNOWN_BAND = "agrees", "differs", "unknown"


@dataclass(frozen=True)
class SampledNumber:
    """What a sample makes of a number.

    Attributes
    ----------
    name, case, unit
        Of the number.
    nominal
        With every input at its value.
    first_order
        Band by the inputs relative to it, None where it is not known.
    count
        Points that have the number.
    mean, deviation
        Of the sample, in ``unit``.
    low, high
        Ends of the middle 95 % of the sample, in ``unit``; of fewer than 40 points the least and
        the largest: a fortieth of them is no point.
    band
        What the sample makes of the first-order band, relative to the nominal number; without one
        sqrt(3) deviations.
    band_low, band_high
        Ends of its 95 % interval by the sampling error; None where there is none.
    outcome
        "agrees", "differs" or "unknown".
    verdict
        In words.
    """

    name: str
    case: str
    unit: str
    nominal: float | None
    first_order: float | None
    count: int
    mean: float | None = None
    deviation: float | None = None
    low: float | None = None
    high: float | None = None
    band: float | None = None
    band_low: float | None = None
    band_high: float | None = None
    outcome: str = UNKNOWN_BAND
    verdict: str = ""

    @property
    def resolved(self) -> bool:
        """Whether the ends are those of the middle 95 %."""
        return TAIL * self.count >= 1.0


def sampled_number(
    name: str,
    case: str,
    unit: str,
    values: Array,
    shifts: Array,
    paths: Sequence[str],
    inputs: Sequence[InputPart],
) -> SampledNumber:
    """A number over the sample.

    Parameters
    ----------
    values
        (1 + n,) in ``unit``, the first with every input at its value; NaN where there is none.
    shifts
        (1 + n, n_input) half-widths from it, zeros first.
    paths
        (n_input,) of the inputs.
    inputs
        Their first-order changes of the number; empty where the nominal run has none.
    """
    known = np.isfinite(values)
    drawn, nominal = values[1:][known[1:]], float(values[0]) if known[0] else None
    found = SampledNumber(name, case, unit, nominal, None, len(drawn))
    if found.count:
        ends = (TAIL, 1.0 - TAIL) if found.resolved else (0.0, 1.0)
        low, high = map(float, np.quantile(drawn, ends))
        deviation = float(np.std(drawn, ddof=1)) if found.count > 2 else None
        found = replace(found, mean=float(drawn.mean()), deviation=deviation, low=low, high=high)
    why = _unknown(found, inputs, paths)
    if nominal and found.deviation is not None:
        found = replace(found, band=LIMITS * found.deviation / abs(nominal))
    if nominal and not why:
        changes = {part.path: part.change for part in inputs}
        c = np.array([changes[path] for path in paths])
        predicted = nominal * (1.0 + shifts[1:][known[1:]] @ c)
        found = replace(found, first_order=float(np.linalg.norm(c)))
        found = _compared(found, drawn, predicted, nominal)
    missing = len(values) - 1 - len(drawn)
    lost = f"; {missing} of {len(values) - 1} points have no such number" if missing else ""
    return replace(found, verdict=(why or found.verdict) + lost)


def _unknown(number: SampledNumber, inputs: Sequence[InputPart], paths: Sequence[str]) -> str:
    """Why its sample is not compared with a first-order band, "" where it is."""
    found = {part.path: part for part in inputs}
    lost = [f"{p}: {found[p].basis}" for p in paths if p in found and not found[p].known]
    lost += [f"{path}: not found" for path in paths if path not in found]
    reasons = {
        "no number with the inputs at their values": number.nominal is None,
        "the number is 0: nothing is relative to it": number.nominal == 0.0,
        "too few points have it for a standard deviation": number.deviation is None,
        "no first-order band: it is none of the run's main numbers": not found,
        f"no first-order band ({'; '.join(lost)})": bool(lost),
    }
    return next((why for why, holds in reasons.items() if holds), "")


def _compared(found: SampledNumber, drawn: Array, first: Array, nominal: float) -> SampledNumber:
    """The sample's band and mean against those to first order."""
    n, band = len(drawn), found.first_order or 0.0
    if not np.ptp(first):
        still = not np.ptp(drawn)
        moved = f"{percent_of(found.band)} where first order has none"
        verdict = "nothing moves it" if still else moved
        return replace(found, outcome=AGREES if still else DIFFERS, verdict=verdict)
    t = float(stdtrit(n - 1, 1.0 - TAIL))
    left = (drawn - first) / abs(nominal)
    shift, shift_error = float(left.mean()), t * float(np.std(left, ddof=1)) / math.sqrt(n)
    log_ratio = 0.5 * float(np.log(np.var(drawn) / np.var(first))) if np.ptp(drawn) else -math.inf
    error = t * _jackknife(drawn, first)
    low, high = (band * math.exp(log_ratio + sign * error) for sign in (-1.0, 1.0))
    # a band is reported with two digits: closer is the same
    digit = 0.5 * 10.0 ** (math.floor(math.log10(band)) - 1)
    words = []
    if not (low <= band + digit and high >= band - digit):
        by = percent_of(abs(math.expm1(log_ratio)))
        words.append(f"{by} {'wider' if log_ratio > 0.0 else 'narrower'} than first order")
    if not abs(shift) <= shift_error + digit:
        words.append(f"mean off by {'+' if shift > 0.0 else '-'}{percent_of(abs(shift))}")
    return replace(
        found,
        band=band * math.exp(log_ratio),
        band_low=low,
        band_high=high,
        outcome=DIFFERS if words else AGREES,
        verdict=", ".join(words) or AGREES,
    )


def _jackknife(drawn: Array, first: Array) -> float:
    """Standard error of the logarithm of the ratio of two deviations over the same points."""
    ours, theirs = ([np.var(np.delete(x, k)) for k in range(len(x))] for x in (drawn, first))
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = 0.5 * np.log(np.divide(ours, theirs))
    return math.sqrt(len(drawn) - 1) * float(np.std(logs)) if np.isfinite(logs).all() else math.inf


def sample_sentence(numbers: Sequence[SampledNumber]) -> str:
    """How many first-order bands the sample confirms, and how it was compared."""
    compared = [one for one in numbers if one.outcome != UNKNOWN_BAND]
    agree = sum(one.outcome == AGREES for one in compared)
    return (
        f"First order agrees with the sample for {agree} of {len(compared)} numbers: to 95 % "
        "confidence, as far as two digits of the band go. Bands are sqrt(3) standard deviations, "
        "as the half-widths of limits are."
    )
