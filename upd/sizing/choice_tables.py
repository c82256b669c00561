"""A chosen damper as verdict, tables, notes and plain numbers."""

from __future__ import annotations

import math
from typing import Any

from upd.results.answer_table import AnswerTable
from upd.scene.rotation import damper_mass
from upd.sizing.choice import GROWTHS, UNITS_OF, ChosenDamper
from upd.sizing.ranges import InputRange
from upd.sizing.sensitivity import Sensitivity, sensitivities
from upd.sizing.statics_tables import finite

#: relative difference of F_C up to which two are one
ALIKE = 0.03


def verdict(found: ChosenDamper) -> str:
    """One sentence: the optimum and its worst peak."""
    place = ", ".join(
        f"{one.path} {one.of.shown(one.value)}{f' (its {one.bound} bound)' if one.bound else ''}"
        for one in _chosen(found)
    )
    worst = f"{found.worst:.4g} {UNITS_OF[found.objective]}"
    return f"{found.ranges.scene.name}: worst peak {worst} at {place}"


def _chosen(found: ChosenDamper) -> list[Sensitivity]:
    """The sensitivities of what was chosen."""
    paths = [one.path for one in found.ranges.over]
    return [one for one in sensitivities(found) if one.path in paths]


def tables(found: ChosenDamper) -> tuple[AnswerTable, ...]:
    """Both optima, what decides, and how far parameters may move."""
    unit, best = UNITS_OF[found.objective], found.best.best
    shapes = found.ranges.shapes
    robust = ("over the ranges", found.centrifugal, found.best.values)
    nominal = ("the scene's values", found.nominal_centrifugal, found.plain.values)
    heights = (
        (_height(found.worst), _height(found.robust_at_nominal, found.settled[0])),
        (_height(found.nominal_at_worst, found.settled[1]), _height(found.nominal_peak)),
    )
    optima = tuple(
        (name, f"{F:.4g}", *(of.shown(v) for of, v in zip(shapes, values, strict=True)), *both)
        for (name, F, values), both in zip((robust, nominal), heights, strict=True)
    )
    deciding = tuple(
        (
            peak_of(p.name),
            f"{math.exp(best.log_centrifugal - p.s):.4g}",
            f"{math.exp(p.s):.4g}",
            f"{p.frequency:.2f}",
            f"{math.exp(p.y):.4g}",
        )
        for p in best.deciding
        if p.share > 0.0
    )
    moved = tuple(
        (
            one.path,
            one.of.shown(one.value),
            _slopes(one),
            *(_span(one, ends) for ends in one.within),
        )
        for one in sensitivities(found)
    )
    heads = ("best for", "#F_C, N", *(f"#{of.path}" for of in shapes))
    within = tuple(f"+{100.0 * (g - 1.0):.0f} % within" for g in GROWTHS)
    return (
        AnswerTable(
            f"Worst peak, {unit}", (*heads, "#over the ranges", "#the scene's values"), optima
        ),
        AnswerTable(
            "What decides",
            ("peak", "#F_E, N", "#F_C/F_E", "#Hz", f"#height, {UNITS_OF['peak']}"),
            deciding,
        ),
        AnswerTable(
            "How far parameters may move",
            ("parameter", "#value", "#slope", *within),
            moved,
            "Slope: d ln(peak) / d ln(parameter), below and above the optimum where both differ. "
            "Within: the worst peak stays below so many per cent more, by whole curves.",
        ),
    )


def _height(value: float, exact: bool = True) -> str:
    if not math.isfinite(value):
        return "not known"
    return f"{'' if exact else 'at least '}{value:.4g}"


def peak_of(name: str) -> str:
    """The mode of a branch, without the frequency that distinguishes it from others."""
    return name.partition(",")[0]


def _slopes(one: Sensitivity) -> str:
    """d ln(peak)/d ln(parameter), below and above where they differ."""
    same = math.isclose(one.below, one.above, abs_tol=5e-3) or not math.isfinite(one.above)
    return " / ".join(map(_signed, (one.below,) if same else (one.below, one.above)))


def _signed(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    return f"{value:+.2f}" if abs(value) >= 5e-3 else "0"


def _span(one: Sensitivity, ends: tuple[float, float]) -> str:
    """Between which values the worst peak grows no further."""
    low, high = (one.of.shown(end) if math.isfinite(end) else "" for end in ends)
    if low and high:
        return f"{low.split()[0]} to {high}"
    return f"from {low}" if low else f"to {high}" if high else "-"


def notes(found: ChosenDamper) -> tuple[str, ...]:
    """What was asked, what limits the answer, and the cost."""
    e, best = found.ranges.scene.excitation, found.best.best
    counted = ", ".join(
        f"{one.path} {one.shown(one.low)} to {one.shown(one.high)}" for one in found.ranges.during
    )
    per = " per N of F_E" if found.objective == "peak" else ""
    kept = f", {found.resumed} kept of earlier calls" if found.resumed else ""
    return (
        f"Right blade, {UNITS_OF['acceleration']}{per}, {e.start:g} to {e.stop:g} Hz, stiffness "
        f"{found.stiffness}{', over ' if counted else ''}{counted}; {_mass(found)}.",
        *warnings(found),
        *(["The curve between solved points did not agree."] * (best.status == "bracketed")),
        f"{found.curves} whole curves by harmonic balance{kept}: {found.seconds:.1f} s.",
    )


def _mass(found: ChosenDamper) -> str:
    """The mass that gives F_C at the scene's radius and speed, or the mesh's."""
    damper, own = found.ranges.scene.damper, damper_mass(found.ranges.scene)
    if damper.radius is not None and damper.speed is not None:
        mass = found.centrifugal / (damper.radius * damper.speed**2)
        moved = next((one for one in found.ranges.over if one.path.startswith("damper.")), None)
        if moved is None or moved.path == "damper.mass":
            return f"F_C = m r w^2 of {1e6 * mass:.4g} g"
    return "mass not known" if own is None else f"damper of {1e6 * own:.4g} g as meshed"


def warnings(found: ChosenDamper) -> list[str]:
    """What limits the answer."""
    out = [f"Not solved: {why}." for why in found.refused]
    for one in sensitivities(found):
        out += [f"How far {one.path} may move is withheld: {why}." for why in one.withheld]
    for low, high in found.gaps:
        between = f"between F_C/F_E {low:.4g} and {high:.4g}"
        out.append(f"Not known {between}: no whole curve reaches its end there.")
    if found.best.best.at_jump and found.best.ends[0] < found.best.ends[1]:
        out.append("At a jump of the worst peak over F_C: beyond it another peak decides, higher.")
    low = math.exp(found.best.best.reached[0])
    if low > found.best.ends[0] * (1.0 + ALIKE):
        out.append(
            f"Not known for F_C below {low:.4g} N: no whole curve reaches its end at F_C/F_E "
            f"{', '.join(f'{r:.4g}' for r in found.unreached)}."
        )
    return out


def plain_numbers(found: ChosenDamper) -> dict[str, Any]:
    """All numbers with their units, for JSON: what is not known is null."""
    c = found.best.best.log_centrifugal
    return {
        "scene": found.ranges.scene.name,
        "verdict": verdict(found),
        "minimised": found.objective,
        "unit": UNITS_OF[found.objective],
        "stiffness": found.stiffness,
        "over": [_range(one) for one in found.ranges.over],
        "for": [_range(one) for one in found.ranges.during],
        "status": found.best.best.status,
        "optimum": {one.path: one.value for one in _chosen(found)},
        "centrifugal_N": found.centrifugal,
        "worst_peak": found.worst,
        "decided_by": [
            {
                "force_N": math.exp(c - p.s),
                "centrifugal_to_force": math.exp(p.s),
                "frequency_Hz": float(p.frequency),
                "peak": peak_of(p.name),
                "height": math.exp(p.y),
                "share": p.share,
            }
            for p in found.best.best.deciding
        ],
        "nominal": {
            "centrifugal_N": found.nominal_centrifugal,
            "peak": found.nominal_peak,
            "worst_peak_over_ranges": finite(found.nominal_at_worst),
            "robust_optimum_has": finite(found.robust_at_nominal),
            "worst_peak_is_at_least": not found.settled[1],
            "robust_optimum_has_at_least": not found.settled[0],
        },
        "sensitivities": [
            {
                "parameter": one.path,
                "unit": one.of.unit,
                "value": one.value,
                "below": finite(one.below),
                "above": finite(one.above),
                "at_bound": one.bound,
                "within": {
                    f"{g:.2f}": [finite(v) for v in pair]
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
        "notes": warnings(found),
        "whole_curves": found.curves,
        "curves_kept": found.resumed,
        "seconds": found.seconds,
    }


def _range(one: InputRange) -> dict[str, Any]:
    return {"path": one.path, "unit": one.unit, "low": one.low, "high": one.high}
