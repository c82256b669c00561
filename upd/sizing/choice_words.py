"""The chosen damper in words, numbers first, and as plain numbers."""

from __future__ import annotations

import math
from typing import Any

from upd.report.answer_folder import wrapped
from upd.scene.rotation import damper_mass
from upd.sizing.choice import GROWTHS, UNITS_OF, ChosenDamper
from upd.sizing.ranges import InputRange
from upd.sizing.sensitivity import Sensitivity, sensitivities

#: relative difference of F_C up to which two are one
ALIKE = 0.03
_MEANS = {
    "peak": "highest accelerance of the right blade, (m/s2) per N of F_E: all levels count alike",
    "acceleration": "highest acceleration of the right blade, m/s2",
}


def headline(found: ChosenDamper) -> str:
    """One sentence: the optimum and its worst peak."""
    scene = found.ranges.scene
    return f"{scene.name}: worst peak {_height(found, found.worst)} at {_place(found)}"


def _height(found: ChosenDamper, value: float) -> str:
    return f"{value:.4g} {UNITS_OF[found.objective]}" if math.isfinite(value) else "not known"


def _place(found: ChosenDamper) -> str:
    """The optimum's parameters."""
    told = [
        f"{one.path} {one.of.shown(one.value)}{f' (its {one.bound} bound)' if one.bound else ''}"
        for one in chosen(found)
    ]
    return ", ".join(told)


def chosen(found: ChosenDamper) -> list[Sensitivity]:
    """The sensitivities of what was chosen."""
    paths = [one.path for one in found.ranges.over]
    return [one for one in sensitivities(found) if one.path in paths]


def lines(found: ChosenDamper) -> list[str]:
    """The answer, line by line."""
    told = [*described(found), *_decided(found), *robustness(found)]
    told += [words for one in sensitivities(found) for words in _sensitivity(one)]
    told += [*notes(found), *grid_words(found), _cost(found)]
    return [
        *wrapped(headline(found), ""),
        *(line for one in told for line in wrapped(one.lstrip(), "  " * (1 + one.startswith(" ")))),
    ]


def described(found: ChosenDamper) -> list[str]:
    """What was asked, and the F_C found, a sentence each."""
    e = found.ranges.scene.excitation
    counted = ", ".join(
        f"{one.path} {one.shown(one.low)} to {one.shown(one.high)}" for one in found.ranges.during
    )
    return [
        f"{_MEANS[found.objective]}; {e.start:g} to {e.stop:g} Hz, stiffness {found.stiffness}"
        + (f", over {counted}" if counted else ""),
        f"F_C {found.centrifugal:.4g} N{mass_words(found)}",
    ]


def mass_words(found: ChosenDamper) -> str:
    """The mass that gives F_C at the scene's radius and speed, or the mesh's."""
    damper, own = found.ranges.scene.damper, damper_mass(found.ranges.scene)
    if damper.radius is not None and damper.speed is not None:
        mass = found.centrifugal / (damper.radius * damper.speed**2)
        moved = next((one for one in found.ranges.over if one.path.startswith("damper.")), None)
        if moved is None or moved.path == "damper.mass":
            return f" = m r w^2 of {1e6 * mass:.4g} g"
    return "" if own is None else f", damper of {1e6 * own:.4g} g as meshed"


def _decided(found: ChosenDamper) -> list[str]:
    c = found.best.best.log_centrifugal
    out = []
    for point in found.best.best.deciding:
        if point.share > 0.0:
            force = math.exp(c - point.s)
            out.append(
                f"decided by F_E {force:.4g} N (F_C/F_E {math.exp(point.s):.4g}): "
                f"{kind(point.name)}, {point.frequency:.2f} Hz"
            )
    if found.best.best.status == "bracketed":
        out.append(
            "the curve between solved points and the points did not agree: the lowest solved one"
        )
    return out


def kind(name: str) -> str:
    """The mode of a branch, without the frequency that tells it from others of its kind."""
    return name.partition(",")[0]


def robustness(found: ChosenDamper) -> list[str]:
    """The optimum of the scene's own values, and what standing the ranges costs."""
    here, best = found.robust_at_nominal, found.nominal_peak
    there = found.nominal_at_worst
    place = f"F_C {found.nominal_centrifugal:.4g} N"
    for shape, value in zip(found.ranges.shapes, found.plain.values, strict=True):
        place += f", {shape.path} {shape.shown(value)}"
    gain = f" ({_change(found.worst, there)} here)"
    lost = " (whole curves not followed through there)"
    least = ["" if sure else "at least " for sure in found.settled]
    return [
        f"nominal optimum, the scene's own values: {_height(found, best)} at {place}",
        f"robustness costs {least[0]}{_change(here, best)} there ({_height(found, here)})"
        if math.isfinite(here)
        else f"what robustness costs there is not known{lost}",
        f"over the ranges the nominal optimum has {least[1]}{_height(found, there)}{gain}"
        if math.isfinite(there)
        else f"what the nominal optimum has over the ranges is not known{lost}",
    ]


def _change(value: float, other: float) -> str:
    return f"{100.0 * (value / other - 1.0):+.1f} %" if other > 0.0 else "not known"


def _sensitivity(one: Sensitivity) -> list[str]:
    """A parameter: its value and its derivatives; then how far it may go, on a line of its own."""
    spans = [
        f"+{100.0 * (growth - 1.0):.0f} % {span(one, ends)}"
        for growth, ends in zip(GROWTHS, one.within, strict=True)
        if any(map(math.isfinite, ends))
    ]
    told = [f"{one.path} {one.of.shown(one.value)}: d ln(peak)/d ln(it) {slopes(one)}"]
    return told + [f"  worst peak within {', within '.join(spans)}"] * bool(spans)


def slopes(one: Sensitivity) -> str:
    """d ln(peak)/d ln(parameter), below and above where they differ."""
    slope = _signed(one.below)
    if not math.isclose(one.below, one.above, abs_tol=5e-3) and math.isfinite(one.above):
        slope += f" / {_signed(one.above)}"
    return slope


def _signed(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    return f"{value:+.2f}" if abs(value) >= 5e-3 else "0"


def span(one: Sensitivity, ends: tuple[float, float]) -> str:
    """Between which values the worst peak grows no further."""
    low, high = ends
    if not math.isfinite(low) and not math.isfinite(high):
        return "-"
    if not math.isfinite(low):
        return f"to {one.of.shown(high)}"
    if not math.isfinite(high):
        return f"from {one.of.shown(low)}"
    return f"{one.of.shown(low).split()[0]} to {one.of.shown(high)}"


def grid_words(found: ChosenDamper) -> list[str]:
    """What the grid of runs says, where one was run."""
    grid = found.grid
    if grid is None:
        return []
    if not any(map(math.isfinite, grid.heights)):
        return [f"grid of {len(grid.values)} runs: none has a peak at all loads"]
    one = next(one for one in found.ranges.over if one.path == grid.path)
    chosen = next(s.value for s in sensitivities(found) if s.path == grid.path)
    ends = [grid.values[min(max(grid.best + k, 0), len(grid.values) - 1)] for k in (-1, 1)]
    return [
        f"grid of {len(grid.values)} runs: lowest {_height(found, grid.heights[grid.best])} at "
        f"{one.shown(grid.values[grid.best])}; the optimum is "
        f"{'within' if grid.within(chosen) else 'NOT within'} its spacing, "
        f"{one.shown(ends[0]).split()[0]} to {one.shown(ends[1])}"
    ]


def notes(found: ChosenDamper) -> list[str]:
    """What limits the answer."""
    out = [f"not solved: {why}" for why in found.refused]
    for one in sensitivities(found):
        out += [f"how far {one.path} may move is withheld: {why}" for why in one.untold]
    for low, high in found.gaps:
        between = f"between F_C/F_E {low:.4g} and {high:.4g}"
        out.append(f"not known {between}: no whole curve reaches its end there")
    if found.best.best.at_jump and found.best.ends[0] < found.best.ends[1]:
        out.append("at a jump of the worst peak over F_C: beyond it another peak decides, higher")
    low = math.exp(found.best.best.reached[0])
    if low > found.best.ends[0] * (1.0 + ALIKE):
        out.append(
            f"F_C below {low:.4g} N is not told: whole curves were not followed through at F_C/F_E "
            f"{', '.join(f'{r:.4g}' for r in found.unreached)}"
        )
    out.append("of whole curves by harmonic balance, from the lowest to the highest frequency")
    return out


def _cost(found: ChosenDamper) -> str:
    kept = f"; {found.resumed} curves kept of earlier calls" if found.resumed else ""
    return f"{found.seconds:.1f} s: {found.curves} whole curves{kept}"


def plain_numbers(found: ChosenDamper) -> dict[str, Any]:
    """All numbers with their units, for JSON: what is not known is null."""
    c = found.best.best.log_centrifugal
    return {
        "scene": found.ranges.scene.name,
        "verdict": headline(found),
        "minimised": found.objective,
        "unit": UNITS_OF[found.objective],
        "stiffness": found.stiffness,
        "over": [_range(one) for one in found.ranges.over],
        "for": [_range(one) for one in found.ranges.during],
        "status": found.best.best.status,
        "optimum": {one.path: one.value for one in chosen(found)},
        "centrifugal_N": found.centrifugal,
        "worst_peak": found.worst,
        "decided_by": [
            {
                "force_N": math.exp(c - p.s),
                "centrifugal_to_force": math.exp(p.s),
                "frequency_Hz": float(p.frequency),
                "peak": kind(p.name),
                "height": math.exp(p.y),
                "share": p.share,
            }
            for p in found.best.best.deciding
        ],
        "nominal": {
            "centrifugal_N": found.nominal_centrifugal,
            "peak": found.nominal_peak,
            "worst_peak_over_ranges": _finite(found.nominal_at_worst),
            "robust_optimum_has": _finite(found.robust_at_nominal),
            "worst_peak_is_at_least": not found.settled[1],
            "robust_optimum_has_at_least": not found.settled[0],
        },
        "sensitivities": [
            {
                "parameter": one.path,
                "unit": one.of.unit,
                "value": one.value,
                "below": _finite(one.below),
                "above": _finite(one.above),
                "at_bound": one.bound,
                "within": {
                    f"{g:.2f}": [_finite(v) for v in pair]
                    for g, pair in zip(GROWTHS, one.within, strict=True)
                },
            }
            for one in sensitivities(found)
        ],
        "tried": [
            {
                "values": list(one.values),
                "centrifugal_N": math.exp(one.best.log_centrifugal),
                "worst_peak": math.exp(one.best.log_worst),
                "status": one.best.status,
            }
            for one in found.tried
        ],
        "not_followed_between_ratios": [list(pair) for pair in found.gaps],
        "notes": notes(found),
        "grid": None
        if found.grid is None
        else {
            "path": found.grid.path,
            "values": [float(v) for v in found.grid.values],
            "worst_peaks": [_finite(v) for v in found.grid.heights],
            "processor_seconds": found.grid.processor_seconds,
        },
        "whole_curves": found.curves,
        "curves_kept": found.resumed,
        "seconds": found.seconds,
    }


def _range(one: InputRange) -> dict[str, Any]:
    return {"path": one.path, "unit": one.unit, "low": one.low, "high": one.high}


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
