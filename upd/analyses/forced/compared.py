"""Computed curves of a forced response beside the measured ones of the same blade and state."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from upd.analyses.forced import measures
from upd.analyses.forced.array_parts import HZ, MEASURED_CURVE, PER_N, complex_array
from upd.analyses.forced.curves import FrictionCurve, SweptCurve
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.march_modes import linear_curves
from upd.analyses.forced.mode_peaks import ModePeak, unmoved
from upd.analyses.forced.model import Array, ComplexArray
from upd.analyses.forced.solution import ForcedSolution
from upd.dynamics import find_peaks
from upd.errors import InputError
from upd.measured import (
    MeasuredCurve,
    MeasuredPeak,
    fit_damping,
    frac,
    magnitude_correlation,
    noisy_peaks,
)
from upd.measured.compare import on_path, paired, within
from upd.measured.curve import LEAST_POINTS
from upd.results import ArrayGroup, Case, Check, ErrorPart, Result, with_parts, withheld
from upd.scene.forced import Side
from upd.scene.measured import MeasuredChoice, fit_of

FREE, STUCK = "free", "stuck"
#: half-power widths on each side of a computed peak, and points in one, for its damping
_WIDTHS, _POINTS = 4, 25


@dataclass(frozen=True)
class Computed:
    """A computed curve: its case, band in Hz, accelerance at frequencies (nan where it has not one
    value), peaks by their numbers.
    """

    case: Case
    band: tuple[float, float]
    at: Callable[[Array], ComplexArray]
    peaks: Sequence[ModePeak]


def measured_results(solution: ForcedSolution) -> list[Result]:
    """Differences at peaks, correlation over the common band, damping, of every measured curve."""
    results: list[Result] = []
    for name, choice in solution.plan.scene.measured.items():
        curve = choice.read()
        found = list(_computed(solution, choice))
        if not found:
            case = Case(
                name=name,
                kind=choice.state or "",
                blade=choice.blade,
                force_ratio=choice.centrifugal_to_force,
            )
            reason = _nothing(solution, choice)
            results += [withheld(one, case, unit, reason) for one, unit in _asked(curve)]
        peaks = noisy_peaks(curve.frequency, curve.magnitude)
        for one in found:
            results += _correlation(name, curve, one) + _differences(name, curve, peaks, one)
        if choice.state == FREE:
            results += _damping(solution, name, choice, curve, peaks, found)
    return results


def _asked(curve: MeasuredCurve) -> tuple[tuple[str, str], ...]:
    """Names and units of what a comparison begins with."""
    return (("computed_peak_frequency", "Hz"), (_criterion(curve), ""))


def _criterion(curve: MeasuredCurve) -> str:
    return "frac" if curve.is_complex else "magnitude_correlation"


def _nothing(solution: ForcedSolution, choice: MeasuredChoice) -> str:
    """Why nothing stands beside a measured curve."""
    if choice.state is not None:
        return (
            f"the {choice.blade} blade is at rest without the damper"
            if choice.state == FREE
            else "the run has no stuck curve"
        )
    ratios = ", ".join(f"{r:g}" for r in solution.plan.scene.excitation.centrifugal_to_force)
    return (
        f"the run has no curve at F_C/F_E {choice.centrifugal_to_force:g}, it has {ratios}; add it "
        "to excitation.centrifugal_to_force"
    )


def _computed(solution: ForcedSolution, choice: MeasuredChoice) -> Iterator[Computed]:
    """The computed curves of the blade and state of a measured one."""
    side, scene = choice.blade, solution.plan.scene
    if choice.state is not None:
        stuck = choice.state == STUCK
        if not stuck and side not in excitation_of(scene.excitation).free_blades:
            return
        for name, linear in solution.linear.items():
            told = solution.stuck_peaks(name, side) if stuck else unmoved(linear.free_peaks[side])
            case = Case(stiffness=name, kind=choice.state, blade=side)
            band = (scene.excitation.start, scene.excitation.stop)
            yield Computed(case, band, _linear_at(solution, name, side, stuck), told)
        return
    curves: list[FrictionCurve] = [*solution.curves, *solution.balanced, *solution.sweeps]
    # as the labels of curves tell them apart
    wanted = f"{choice.centrifugal_to_force:.6g}"
    for c in curves:
        if f"{c.ratio:.6g}" == wanted and len(c.frequency) >= LEAST_POINTS:
            yield _with_friction(solution, c, side)


def _linear_at(
    solution: ForcedSolution, name: str, side: Side, stuck: bool
) -> Callable[[Array], ComplexArray]:
    """Accelerance of a blade free or stuck, exact at any frequency."""
    if name in solution.faces:
        excitation = excitation_of(solution.plan.scene.excitation)
        march = solution.faces[name].march
        return lambda f: np.asarray(linear_curves(march, f, excitation, stuck=stuck)[0][side])
    model = solution.models[name]
    one = next(c for c in solution.curves if c.stiffness == name)
    row = model.row(side)
    return lambda f: measures.linear_accelerance(one.answer, row, one.force, f, stuck)


def _with_friction(solution: ForcedSolution, c: FrictionCurve, side: Side) -> Computed:
    """A curve with friction, between its points by straight lines."""
    f, H = c.frequency, c.accelerance[side]  # type: ignore[attr-defined]
    way = slice(None) if f[-1] > f[0] else slice(None, None, -1)
    f, H = f[way], H[way]
    peaks = (
        c.peaks[side] if isinstance(c, SweptCurve) else solution.numbered_peaks(c, side)  # type: ignore[arg-type]
    )
    return Computed(
        replace(c.case, blade=side),  # type: ignore[attr-defined]
        (float(f.min()), float(f.max())),
        lambda at: on_path(at, f, H),
        list(peaks),
    )


def _correlation(name: str, curve: MeasuredCurve, one: Computed) -> list[Result]:
    """FRAC over the common band, or the correlation of magnitudes, at the measured frequencies."""
    case, what = replace(one.case, name=name), _criterion(curve)
    on = within(curve.frequency, *one.band)
    if on.sum() < LEAST_POINTS:
        return [withheld(what, case, "", _apart(curve, one))]
    H, mine = one.at(curve.frequency[on]), curve.accelerance[on]
    lost = int(np.isnan(H).sum())
    if lost:
        reason = (
            f"the computed path turns back and has several motions at {lost} of {len(H)} measured "
            "frequencies"
        )
        return [withheld(what, case, "", reason)]
    try:
        return [
            Result(what, case, (frac if curve.is_complex else magnitude_correlation)(mine, H), "")
        ]
    except InputError as error:
        return [withheld(what, case, "", str(error))]


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
    case, asked = replace(one.case, name=name), "computed_peak_frequency"
    low, high = max(one.band[0], curve.band[0]), min(one.band[1], curve.band[1])
    if low >= high:
        return [withheld(asked, case, "Hz", _apart(curve, one))]
    seen = [p for p in peaks if low <= p.frequency <= high]
    mine = [p for p in one.peaks if low <= p.frequency <= high]
    if not seen or not mine:
        whose = "measured" if not seen else "computed"
        reason = f"the {whose} curve has no peak within the common band, {low:g} to {high:g} Hz"
        return [withheld(asked, case, "Hz", reason)]
    pairs = paired([p.frequency for p in seen], [p.frequency for p in mine])
    results: list[Result] = []
    for k, c in enumerate(mine):
        at = replace(case, peak=c.number, mode=c.mode)
        if k not in pairs:
            reason = "the measured curve has fewer peaks in the common band"
            results.append(withheld(asked, at, "Hz", reason))
            continue
        m, source = seen[pairs[k]], f"measured, {name}"
        results += [
            Result(asked, at, c.frequency, "Hz", m.frequency, source, exact=False),
            Result("peak_frequency_difference", at, c.frequency - m.frequency, "Hz"),
            Result(
                "computed_peak_accelerance",
                at,
                c.height,
                "(m/s2)/N",
                m.height,
                source,
                exact=False,
            ),
        ]
    return results


def _damping(
    solution: ForcedSolution,
    name: str,
    choice: MeasuredChoice,
    curve: MeasuredCurve,
    peaks: Sequence[MeasuredPeak],
    found: Sequence[Computed],
) -> list[Result]:
    """By half power of both curves, and fitted to the whole measured one."""
    results: list[Result] = []
    for one in found:
        results += _half_power(solution, name, peaks, one)
    case = Case(name=name, kind=FREE, blade=choice.blade)
    try:
        fit = fit_of(choice)
    except InputError as error:
        return [*results, withheld("fitted_damping", case, "%", str(error))]
    for k in range(len(fit.zeta)):
        at = replace(case, peak=k + 1)
        zeta, f = float(fit.zeta[k]), float(fit.frequency[k])
        errors = float(fit.zeta_error[k]), float(fit.frequency_error[k])
        results += [
            _within(Result("fitted_damping", at, 100.0 * zeta, "%"), errors[0] / zeta),
            Result("fitted_damping_error", at, 100.0 * errors[0], "%"),
            _within(Result("fitted_frequency", at, f, "Hz"), errors[1] / f),
            Result("fitted_frequency_error", at, errors[1], "Hz"),
        ]
    results += [
        Result("fitted_noise", case, 100.0 * fit.noise.relative, "%"),
        Result("fitted_noise_constant", case, fit.noise.constant, "(m/s2)/N"),
    ]
    # of all stiffnesses: without the damper they are one
    return results + (_scales(case, curve, fit.constant, found[0]) if found else [])


def _within(result: Result, standard_error: float) -> Result:
    """A fitted number with what the noise leaves of it, by its relative standard error."""
    basis = "95 % interval of the fit: 1.96 standard errors"
    bound = float(norm.ppf(0.975)) * standard_error
    return with_parts(result, [ErrorPart("measurement noise", bound, basis)])


def _half_power(
    solution: ForcedSolution, name: str, peaks: Sequence[MeasuredPeak], one: Computed
) -> list[Result]:
    """Damping of the computed peaks beside that of the measured ones, both by half power."""
    zeta = solution.plan.scene.excitation.damping
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
            out.append(withheld("half_power_damping", case, "%", reason))
            continue
        out.append(
            Result(
                "half_power_damping",
                case,
                100.0 * float(near.zeta[0]),
                "%",
                100.0 * peaks[j].zeta,
                f"measured, {name}",
                exact=False,
            )
        )
    return out


def _scales(case: Case, curve: MeasuredCurve, constant: Array, one: Computed) -> list[Result]:
    """Modal constants of the measured over those of the computed curve, both fitted alike."""
    try:
        like = fit_damping(replace(curve, accelerance=one.at(curve.frequency)))
    except InputError as error:
        return [withheld("fitted_scale", case, "", f"computed curve: {error}")]
    if len(like.constant) != len(constant):
        reason = "the computed curve has another number of peaks in the measured band"
        return [withheld("fitted_scale", case, "", reason)]
    return [
        Result("fitted_scale", replace(case, peak=k), float(abs(a / b)), "")
        for k, (a, b) in enumerate(zip(constant, like.constant, strict=True), 1)
    ]


def fit_checks(solution: ForcedSolution) -> list[Check]:
    """Whether what fits leave of the measured free curves are independent errors."""
    checks = []
    for name, choice in solution.plan.scene.measured.items():
        if choice.state != FREE:
            continue
        try:
            fit = fit_of(choice)
        except InputError:
            continue  # the number is withheld with the reason
        checks.append(
            Check(
                "measured damping",
                Case(name=name, kind=FREE, blade=choice.blade),
                abs(fit.correlation),
                fit.correlation_limit,
                "correlation of neighbouring residuals of the fit",
                "the curve has what its modes have not (a mode more, a nonlinear joint), so "
                "standard errors are too small: measure a narrower band or with a smaller force",
                fatal=False,
            )
        )
    return checks


def measured_arrays(solution: ForcedSolution) -> dict[str, ArrayGroup]:
    """Every measured curve as it is compared, with the fit to a free one."""
    out = {}
    for name, choice in solution.plan.scene.measured.items():
        curve = choice.read()
        H = curve.accelerance
        case = Case(
            name=name,
            kind=choice.state or "",
            blade=choice.blade,
            force_ratio=choice.centrifugal_to_force,
        )
        variables = {
            "frequency": (("frequency",), curve.frequency, HZ),
            f"accelerance_{choice.blade}": complex_array(H)
            if curve.is_complex
            else (("frequency",), H, PER_N),
        }
        if choice.state == FREE:
            # where there is none, its number is withheld with the reason
            with suppress(InputError):
                variables["fitted"] = complex_array(fit_of(choice).response(curve.frequency))
        out[f"measured {name}"] = ArrayGroup(
            variables,
            content=MEASURED_CURVE,
            case=case,
            source=curve.source.name,
            digest=choice.digest or "",
            measured_as=f"{curve.quantity}, {curve.unit}",
        )
    return out
