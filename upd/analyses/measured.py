"""Measured curves beside the computed ones of any analysis: numbers, checks, arrays, charts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from upd.analyses.base import conditions
from upd.dynamics import find_peaks
from upd.errors import InputError
from upd.measured import (
    MeasuredCurve,
    MeasuredPeak,
    frac,
    noisy_peaks,
)
from upd.measured.compare import paired
from upd.measured.curve import LEAST_POINTS
from upd.plot.chart import Trace
from upd.plot.common import case_of, frequency_of, magnitude, with_content
from upd.results import Arrays, Case, Check, ErrorPart, Group, Result, variable, with_parts
from upd.results import quantities as q
from upd.results.quantities import Quantity
from upd.scene.measured import MeasuredChoice, fit_of

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
MeasuredChoices = Mapping[str, MeasuredChoice]
FREE, STUCK = "free", "stuck"
#: what the groups of measured curves in result.nc hold, their attribute ``content``
MEASURED_CURVE = "measured curve"
#: half-power widths on each side of a computed peak, and points in one, for its damping
_WIDTHS, _POINTS = 4, 25


_NOT_WHITE = (
    "the curve has what its modes have not (a mode more, a nonlinear joint), so errors are too "
    "small: measure a narrower band or with a smaller force"
)


class CurvePeak(NamedTuple):
    """A peak of a curve: frequency in Hz, height, and the point of the path next to it.

    Number, words and MAC of its mode; "" and nan of a curve that moves in no stuck mode (free). The
    blade, where peaks of both stand together.
    """

    frequency: float
    height: float
    sample: int
    number: int = 0
    mode: str = ""
    mac: float = float("nan")
    blade: Literal["left", "right", ""] = ""


@dataclass(frozen=True)
class Computed:
    """A computed curve: its case, band in Hz, accelerance at frequencies (nan where it has not one
    value), its peaks.
    """

    case: Case
    band: tuple[float, float]
    at: Callable[[Array], ComplexArray]
    peaks: Sequence[CurvePeak]


def measured_results(
    measured: MeasuredChoices,
    computed: Callable[[MeasuredChoice], Iterable[Computed]],
    missing: Callable[[MeasuredChoice], str],
    damping: float,
) -> list[Result]:
    """Differences at peaks, correlation over the common band, damping, of every measured curve.

    Parameters
    ----------
    measured
        Name -> the scene's choice.
    computed
        The computed curves of its blade and state.
    missing
        Why there is none.
    damping
        Damping ratio, for the width of computed peaks.
    """
    results: list[Result] = []
    for name, choice in measured.items():
        curve = choice.read()
        criterion = q.FRAC if curve.is_complex else q.MAGNITUDE_CORRELATION
        found = list(computed(choice))
        if not found:
            reason = missing(choice)
            case = _case(name, choice)
            asked = (q.COMPUTED_FREQUENCY, criterion)
            results += [quantity.withheld(case, reason) for quantity in asked]
        peaks = noisy_peaks(curve.frequency, curve.magnitude)
        for one in found:
            results.append(_correlation(criterion, name, curve, one))
            results += _differences(name, curve, peaks, one)
        if choice.state == FREE:
            results += _damping(damping, name, choice, peaks, found)
    return results


def _case(name: str, choice: MeasuredChoice) -> Case:
    return Case(
        name=name,
        kind=choice.state or "",
        blade=choice.blade,
        force_ratio=choice.centrifugal_to_force,
    )


def _correlation(what: Quantity, name: str, curve: MeasuredCurve, one: Computed) -> Result:
    """FRAC over the common band, or the correlation of magnitudes, at the measured frequencies."""
    case = replace(one.case, name=name)
    on = (curve.frequency >= one.band[0]) & (curve.frequency <= one.band[1])
    if on.sum() < LEAST_POINTS:
        return what.withheld(case, _apart(curve, one))
    H, mine = one.at(curve.frequency[on]), curve.accelerance[on]
    lost = int(np.isnan(H).sum())
    if lost:
        reason = (
            f"the computed path turns back and has several motions at {lost} of {len(H)} measured "
            "frequencies"
        )
        return what.withheld(case, reason)
    try:
        return what.of(frac(mine, H if curve.is_complex else np.abs(H)), case)
    except InputError as error:
        return what.withheld(case, str(error))


def _apart(curve: MeasuredCurve, one: Computed) -> str:
    low, high = curve.band
    return (
        f"the measured band, {low:g} to {high:g} Hz, and the computed one, {one.band[0]:g} to "
        f"{one.band[1]:g} Hz, do not overlap in {LEAST_POINTS} points"
    )


def _differences(
    name: str, curve: MeasuredCurve, peaks: Sequence[MeasuredPeak], one: Computed
) -> list[Result]:
    """Frequencies and heights of peaks, computed beside measured ones."""
    case, asked = replace(one.case, name=name), q.COMPUTED_FREQUENCY
    low, high = max(one.band[0], curve.band[0]), min(one.band[1], curve.band[1])
    if low >= high:
        return [asked.withheld(case, _apart(curve, one))]
    seen = [p for p in peaks if low <= p.frequency <= high]
    mine = [p for p in one.peaks if low <= p.frequency <= high]
    if not seen or not mine:
        whose = "measured" if not seen else "computed"
        reason = f"the {whose} curve has no peak within the common band, {low:g} to {high:g} Hz"
        return [asked.withheld(case, reason)]
    pairs = paired([p.frequency for p in seen], [p.frequency for p in mine])
    results: list[Result] = []
    for k, c in enumerate(mine):
        at = replace(case, peak=c.number, mode=c.mode)
        if k not in pairs:
            reason = "the measured curve has fewer peaks in the common band"
            results.append(asked.withheld(at, reason))
            continue
        m, source = seen[pairs[k]], f"measured, {name}"
        results += [
            asked.of(c.frequency, at, m.frequency, source, exact=False),
            q.FREQUENCY_DIFFERENCE.of(c.frequency - m.frequency, at),
            q.COMPUTED_ACCELERANCE.of(c.height, at, m.height, source, exact=False),
        ]
    return results


def _damping(
    damping: float,
    name: str,
    choice: MeasuredChoice,
    peaks: Sequence[MeasuredPeak],
    found: Sequence[Computed],
) -> list[Result]:
    """By half power of both curves, and fitted to the whole measured one."""
    results: list[Result] = []
    for one in found:
        results += _half_power(damping, name, peaks, one)
    case = Case(name=name, kind=FREE, blade=choice.blade)
    try:
        fit = fit_of(choice)
    except InputError as error:
        return [*results, q.FITTED_DAMPING.withheld(case, str(error))]
    # what the noise leaves of a fitted number
    basis = "95 % interval of the fit: 1.96 standard errors"
    for k in range(len(fit.zeta)):
        at = replace(case, peak=k + 1)
        for quantity, values, errors in (
            (q.FITTED_DAMPING, fit.zeta, fit.zeta_error),
            (q.FITTED_FREQUENCY, fit.frequency, fit.frequency_error),
        ):
            value = float(values[k])
            bound = float(ndtri(0.975) * (errors[k] / value))
            part = ErrorPart("measurement noise", bound, basis)
            results.append(with_parts(quantity.of(value, at), [part]))
    noise = q.FITTED_NOISE.of(fit.noise.relative, case)
    return [*results, noise, q.NOISE_CONSTANT.of(fit.noise.constant, case)]


def _half_power(
    zeta: float, name: str, peaks: Sequence[MeasuredPeak], one: Computed
) -> list[Result]:
    """Damping of the computed peaks beside that of the measured ones, both by half power."""
    steps = np.linspace(-_WIDTHS, _WIDTHS, 2 * _WIDTHS * _POINTS + 1)
    pairs = paired([p.frequency for p in peaks], [p.frequency for p in one.peaks])
    out = []
    for k, j in pairs.items():
        c = one.peaks[k]
        f = c.frequency * (1.0 + zeta * steps)
        near = find_peaks(f, np.abs(one.at(f)), above=0.5)
        case = replace(one.case, name=name, peak=c.number, mode=c.mode)
        if not len(near.zeta) or not np.isfinite([near.zeta[0], peaks[j].zeta]).all():
            reason = "a side of the peak does not fall to half power"
            out.append(q.HALF_POWER_DAMPING.withheld(case, reason))
            continue
        source = f"measured, {name}"
        out.append(q.HALF_POWER_DAMPING.of(near.zeta[0], case, peaks[j].zeta, source, exact=False))
    return out


def fit_checks(measured: MeasuredChoices) -> list[Check]:
    """Whether what fits leave of the measured free curves are independent errors."""
    checks = list[Check]()
    for name, choice in measured.items():
        if choice.state != FREE:
            continue
        try:
            fit = fit_of(choice)
        except InputError:
            continue  # the number is withheld with the reason
        what = "correlation of neighbouring residuals of the fit"
        row = "measured damping", abs(fit.correlation), fit.correlation_limit, what
        checks += conditions(
            Case(name=name, kind=FREE, blade=choice.blade), _NOT_WHITE, row, fatal=False
        )
    return checks


def accelerance_array(H: Any) -> tuple[Any, ...]:
    """Real and imaginary part along a curve."""
    return variable(
        "frequency part", np.stack([H.real, H.imag], axis=-1), "(m/s2)/N", part="real imaginary"
    )


def measured_arrays(measured: MeasuredChoices) -> dict[str, Group]:
    """Every measured curve as it is compared, with the fit to a free one."""
    out = {}
    for name, choice in measured.items():
        curve = choice.read()
        H = curve.accelerance
        variables: dict[str, Any] = {
            "frequency": variable("frequency", curve.frequency, "Hz"),
            f"accelerance_{choice.blade}": accelerance_array(H)
            if curve.is_complex
            else variable("frequency", H, "(m/s2)/N"),
        }
        if choice.state == FREE:
            # where there is none, its number is withheld with the reason
            with suppress(InputError):
                variables["fitted"] = accelerance_array(fit_of(choice).response(curve.frequency))
        out[f"measured {name}"] = Group(
            variables,
            content=MEASURED_CURVE,
            case=_case(name, choice),
            source=curve.source.name,
            digest=choice.digest or "",
            measured_as=f"{curve.quantity}, {curve.unit}",
        )
    return out


# -- charts ----------------------------------------------------------------------------------------

#: points of a measured curve that are drawn: so many that they touch would hide the computed one
_DRAWN = 100


def measured_traces(arrays: Arrays, blade: str, colours: Mapping[Any, int]) -> tuple[Trace, ...]:
    """The measured curves of a blade as open points, with the modes fitted to free ones.

    Parameters
    ----------
    arrays
        Of the run.
    blade
        "right" or "left".
    colours
        Of the computed curves by their F_C/F_E, of linear limits by their kind; a measured curve
        beside none of them has one of its own.
    """
    out, spare = [], 1 + max(colours.values(), default=-1)
    for group in with_content(arrays, MEASURED_CURVE):
        if f"accelerance_{blade}" not in group:
            continue
        case = case_of(group)
        colour = colours.get(case.kind if case.force_ratio is None else case.force_ratio)
        if colour is None:
            colour, spare = spare, spare + 1
        f, H = frequency_of(group), magnitude(group[f"accelerance_{blade}"])
        words = Case(kind=case.kind, force_ratio=case.force_ratio).label
        on = np.unique([*range(0, len(f), 1 + (len(f) - 1) // _DRAWN), int(H.argmax())])
        some = f", {len(on)} of {len(f)} points" if len(on) < len(f) else ""
        out.append(Trace(f"measured, {words}{some}", f[on], H[on], "open points", colour))
        if "fitted" in group:
            H = magnitude(group["fitted"])
            out.append(Trace(f"modes fitted to {case.name}", f, H, "dotted", colour))
    return tuple(out)
