"""Charts of a forced response, from the run folder's arrays alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from upd.analyses.forced.array_parts import FRICTION, LINEAR, MARCHED, MEASURED, POINTS, SWEEP
from upd.analyses.forced.chart_parts import (
    BLADES,
    MOTIONS,
    PER_N,
    SHEET,
    SLIP_SHARE,
    ChartedCurve,
    charted_peaks,
)
from upd.analyses.forced.contact_charts import (
    contact_map,
    loops_chart,
    loss_chart,
    motion_chart,
    shares_chart,
    turn_chart,
)
from upd.analyses.forced.performance_chart import performance_charts
from upd.analyses.measured.charts import damping_charts, measured_traces
from upd.plot.chart import Array, Arrays, Axis, Band, Chart, Group, Mark, Style, Trace
from upd.plot.common import case_of, frequency_of, magnitude, scalar, with_content
from upd.results import Case
from upd.scene.forced_contact import SIDES


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Responses free, stuck and with friction, and the peaks over F_C/F_E; what was asked for of
    the contact and the damper behind them.
    """
    del summary
    groups, others = with_content(arrays, FRICTION), with_content(arrays, MARCHED)
    swept = with_content(arrays, SWEEP)
    ratios = list(dict.fromkeys(g.attributes["force_ratio"] for g in [*groups, *swept, *others]))
    curves, marched = (
        [ChartedCurve(g, case_of(g), ratios.index(g.attributes["force_ratio"])) for g in some]
        for some in (groups, others)
    )
    # the page opens on the lowest F_C/F_E on which something slips
    shown, shown_marched = (sorted(some, key=_rank) for some in (curves, marched))
    peaks = [one for c in (*shown, *shown_marched) if "peak" in c.group for one in charted_peaks(c)]
    moving = [c for c in shown if c.moves] or shown[:1]
    sliding = [
        one for one in peaks if one.curve.data("state")[one.index, :, SLIP_SHARE].max() > 0.0
    ] or peaks[:1]
    points = {g.attributes["stiffness"]: g for g in with_content(arrays, POINTS)}
    rubbed = [c for c in curves if "loop_peak" in c.group]
    return [
        *_responses(arrays, curves, {r: k for k, r in enumerate(ratios)}),
        *performance_charts(arrays),
        *damping_charts(arrays),
        *_more_harmonics(arrays, curves),
        *(shares_chart(c, k) for c in moving if "share" in c.group for k in range(len(SIDES))),
        *(
            contact_map(one, points[one.case.stiffness], k)
            for one in sliding
            if "share" in one.curve.group
            for k in range(len(SIDES))
            if one.moves(points[one.case.stiffness], k)
        ),
        *(
            loops_chart(one)
            for one in sliding
            if "loop_peak" in one.curve.group and one.number in one.curve.data("loop_peak")
        ),
        *([loss_chart(rubbed)] if rubbed else []),
        *(
            motion_chart(c, k)
            for c in shown
            if "damper_amplitude" in c.group
            for k in range(len(MOTIONS))
        ),
        *(
            turn_chart(one, k)
            for one in peaks
            if "damper_motion" in one.curve.group
            for k in range(len(MOTIONS))
        ),
    ]


def _rank(curve: ChartedCurve) -> tuple[bool, float]:
    """Curves on which something slips first, by rising F_C/F_E."""
    return not curve.slips, float(curve.case.force_ratio or 0.0)


def _responses(
    arrays: Arrays, curves: Sequence[ChartedCurve], colours: Mapping[float | None, int]
) -> list[Chart]:
    """Both blades for every stiffness: free, stuck, every curve with friction, measured peaks."""
    out = []
    for linear in with_content(arrays, LINEAR):
        name = str(linear.attributes["stiffness"])
        f = frequency_of(linear)
        x = Axis("frequency", "Hz", low=float(f[0]), high=float(f[-1]))
        damping = scalar(linear, "damping")
        detail = f"damping {100.0 * damping:.4g} %" if damping is not None else ""
        excited = str(linear["frequency"].attributes.get("excitation", ""))
        detail = ", ".join(part for part in (excited, detail) if part)
        mine = [c for c in curves if c.case.stiffness == name]
        sweeps = [g for g in with_content(arrays, SWEEP) if g.attributes["stiffness"] == name]
        for blade in BLADES:
            traces = [
                *measured_traces(arrays, blade, colours),
                *_limit("free", linear, blade, "dashed"),
                *_limit("stuck", linear, blade, "dashdot"),
                *(one for c in mine for one in _curve(c, blade)),
                *(one for group in sweeps for one in _sweep(group, blade, colours)),
            ]
            marks = [one for c in mine for one in _marks(c, blade)]
            out.append(
                Chart(
                    "Frequency response",
                    x,
                    Axis("accelerance", PER_N, log=True),
                    tuple(traces),
                    (),
                    f"{blade} blade, stiffness {name}",
                    "response",
                    marks=tuple(marks),
                    bands=tuple(_measured(arrays)),
                    detail=detail,
                    **SHEET,
                )
            )
    return out


def _measured(arrays: Arrays) -> Iterator[Band]:
    """Measured frequencies, under one name."""
    for group in with_content(arrays, MEASURED):
        label = f"measured ({group['frequency'].attributes['source']})"
        for f in group["frequency"].data:
            yield Band(label, "x", float(f), float(f))


def _limit(label: str, group: Group, blade: str, style: Style) -> Iterator[Trace]:
    """A linear limit; none for a blade at rest."""
    H = magnitude(group[f"accelerance_{label}_{blade}"])
    if H.max() > 0.0:
        shown = np.where(H > 0.0, H, np.nan)
        yield Trace(label, frequency_of(group), shown, style, closed=True)


def _curve(curve: ChartedCurve, blade: str) -> Iterator[Trace]:
    """A curve with friction: unstable parts dashed, under the same name."""
    H, f = magnitude(curve.group[f"accelerance_{blade}"]), curve.frequency
    if not H.max() > 0.0:
        return
    label = _words(curve.case)
    stable = np.ones(len(f), bool)
    if "stable" in curve.group:
        stable = curve.data("stable") > 0
    yield Trace(label, f, _only(H, stable), "line", curve.colour, entry=label)
    if not stable.all():
        yield Trace(f"{label}, unstable", f, _only(H, ~stable), "dotted", curve.colour, entry=label)


def _only(H: Array, on: Any) -> Array:
    """Values of some points and of their neighbours, so that parts of a curve touch; else nan."""
    wide = on.copy()
    wide[1:] |= on[:-1] & ~on[1:]
    wide[:-1] |= on[1:] & ~on[:-1]
    return np.where(wide, H, np.nan)


def _marks(curve: ChartedCurve, blade: str) -> Iterator[Mark]:
    """The frequency at every peak, and what a slow sweep reaches at a fold."""
    names = (f"peak_frequency_{blade}", f"peak_accelerance_{blade}")
    if set(names) <= set(curve.group) and curve.moves:
        for f, height in zip(*(curve.data(name) for name in names), strict=True):
            yield Mark(float(f), float(height), f"{f:.1f} Hz", curve.colour)
    if blade != BLADES[0] or "fold_frequency" not in curve.group:
        return
    up = curve.data("fold_up") > 0
    rise = curve.data("fold_reached") - curve.data("fold_before")
    for k in np.flatnonzero(up & (rise > _SEEN * curve.data("fold_reached"))):
        f, before, reached = (
            float(curve.data(f"fold_{name}")[k]) for name in ("frequency", "before", "reached")
        )
        yield Mark(f, before, f"a sweep up jumps and reaches {reached:.0f}", curve.colour)


#: least jump that is marked, over the height it reaches
_SEEN = 0.2


def _more_harmonics(arrays: Arrays, curves: Sequence[ChartedCurve]) -> list[Chart]:
    """Both blades in the harmonics that are excited beside the one that is read."""
    colours = {c.case.force_ratio: c.colour for c in curves}
    groups = [c.group for c in curves] + with_content(arrays, SWEEP)
    found: dict[tuple[str, str, str], list[Trace]] = {}
    for group in groups:
        case = case_of(group)
        for blade in BLADES:
            begins = f"accelerance_{blade}_harmonic_"
            for name in (key for key in group if key.startswith(begins)):
                label = replace(case, stiffness="").label
                colour = colours.get(case.force_ratio, 0)
                trace = Trace(label, frequency_of(group), magnitude(group[name]), "line", colour)
                at = (str(case.stiffness), blade, name.removeprefix(begins))
                found.setdefault(at, []).append(trace)
    return [
        Chart(
            f"Frequency response, harmonic {k}",
            Axis("frequency of the first harmonic", "Hz"),
            Axis("accelerance", PER_N, log=True),
            tuple(traces),
            case=f"{blade} blade, stiffness {name}",
            figure="response_harmonics",
            **SHEET,
        )
        for (name, blade, k), traces in found.items()
    ]


def _sweep(group: Group, blade: str, colours: Mapping[float | None, int]) -> Iterator[Trace]:
    """The steady motions of a sweep."""
    case, f, H = case_of(group), frequency_of(group), magnitude(group[f"accelerance_{blade}"])
    if H.max() > 0.0:
        label = Case(force_ratio=case.force_ratio, choice=case.choice).label
        style: Style = "crosses" if f[-1] < f[0] else "points"
        yield Trace(label, f, H, style, colours.get(case.force_ratio, 0))


def _words(case: Case) -> str:
    """A curve within its stiffness."""
    return Case(force_ratio=case.force_ratio, reversed=case.reversed).label
