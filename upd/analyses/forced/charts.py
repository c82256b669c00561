"""Charts of a forced response, from the run folder's arrays alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from upd.analyses.forced.array_parts import (
    BAND,
    FRICTION,
    HARMONICS,
    LINEAR,
    MARCHED,
    MEASURED,
    POINTS,
    SPREAD,
    SWEEP,
)
from upd.analyses.forced.chart_parts import (
    BLADES,
    MOTIONS,
    PER_N,
    SHEET,
    SLIP_SHARE,
    ChartedCurve,
    ChartedPeak,
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
from upd.analyses.forced.performance_charts import again_chart, performance_charts
from upd.analyses.measured.charts import damping_charts, measured_traces
from upd.plot.chart import Area, Array, Arrays, Axis, Band, Chart, Group, Mark, Style, Trace
from upd.plot.common import case_of, frequency_of, magnitude, scalar, with_content
from upd.results import Case
from upd.scene.forced_contact import SIDES


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Responses free, stuck and with friction.

    Contact states and loops at the peaks, loss, damper motion, performance, convergence.
    """
    del summary
    groups, others = with_content(arrays, FRICTION), with_content(arrays, MARCHED)
    ratios = list(dict.fromkeys(g.attributes["force_ratio"] for g in groups + others))
    curves, marched = (
        [ChartedCurve(g, case_of(g), ratios.index(g.attributes["force_ratio"])) for g in some]
        for some in (groups, others)
    )
    # The page opens on a curve on which something slips.
    curves.sort(key=lambda c: not c.slips)
    peaks = [one for c in marched for one in charted_peaks(c)]
    at = [*_left_to_balance(curves, peaks), *peaks]
    # Where only the sweeps have a curve, the balance has one point of it.
    swept = {c.told for c in marched}
    paths = [c for c in curves if len(c.frequency) > 1 or c.told not in swept]
    # Where every point sticks over the whole cycle there is nothing to see.
    moving = [c for c in paths if c.moves] or paths[:1]
    sliding = [
        one for one in at if one.curve.data("state")[one.index, :, SLIP_SHARE].max() > 0.0
    ] or at[:1]
    points = {g.attributes["stiffness"]: g for g in with_content(arrays, POINTS)}
    return [
        *_responses(arrays, curves),
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
        *([loss_chart(paths)] if paths else []),
        *(
            motion_chart(c, k)
            for c in paths
            if "damper_amplitude" in c.group
            for k in range(len(MOTIONS))
        ),
        *(
            turn_chart(one, k)
            for one in peaks
            if "damper_motion" in one.curve.group
            for k in range(len(MOTIONS))
        ),
        *performance_charts(arrays),
        *(
            again_chart(g, "Slider starts", "start of the sliders", "spread")
            for g in with_content(arrays, SPREAD)
        ),
        *(
            again_chart(g, "Harmonics kept", "highest harmonic", "harmonics")
            for g in with_content(arrays, HARMONICS)
        ),
    ]


def _left_to_balance(
    curves: Sequence[ChartedCurve], peaks: Sequence[ChartedPeak]
) -> list[ChartedPeak]:
    """The peaks of the balance that the sweeps tell alike; no highest point without a peak where
    the sweeps have peaks.
    """
    told = {(*one.curve.told, one.number) for one in peaks}
    told |= {(*one.curve.told, 0) for one in peaks}
    return [
        one
        for c in curves
        if "peak" in c.group
        for one in charted_peaks(c)
        if (*c.told, one.number) not in told
    ]


def _responses(arrays: Arrays, curves: Sequence[ChartedCurve]) -> list[Chart]:
    """Both blades for every stiffness.

    Free, stuck, every curve with friction, the measured peaks.
    """
    out = []
    bands = tuple(
        Band(f"measured ({group['frequency'].attributes['source']})", "x", float(f), float(f))
        for group in with_content(arrays, MEASURED)
        for f in group["frequency"].data
    )
    for linear in with_content(arrays, LINEAR):
        name = str(linear.attributes["stiffness"])
        f = frequency_of(linear)
        x = Axis("frequency", "Hz", low=float(f[0]), high=float(f[-1]))
        damping = scalar(linear, "damping")
        detail = f"damping {100.0 * damping:.4g} %" if damping is not None else ""
        excited = str(linear["frequency"].attributes.get("excitation", ""))
        detail = ", ".join(part for part in (excited, detail) if part)
        mine = [c for c in curves if c.case.stiffness == name]
        colours = {c.case.force_ratio: c.colour for c in mine}
        for blade in BLADES:
            found = [
                *_curve("free", linear, f"free_{blade}", "dashed", 0, closed=True),
                *_curve("stuck", linear, f"stuck_{blade}", "dashdot", 0, closed=True),
                *(
                    one
                    for c in mine
                    for one in _curve(
                        _words(c.case),
                        c.group,
                        blade,
                        "dotted" if c.case.reversed else "line",
                        c.colour,
                    )
                ),
            ]
            for group in with_content(arrays, SWEEP):
                if group.attributes["stiffness"] == name:
                    found += _sweep(group, blade, colours)
            areas = tuple(
                Area(
                    f"{_words(c.case)}, band of static states",
                    frequency_of(group),
                    np.asarray(group[f"lowest_{blade}"].data, float),
                    np.asarray(group[f"highest_{blade}"].data, float),
                    c.colour,
                )
                for group in with_content(arrays, BAND)
                for c in mine
                if c.case == case_of(group) and np.nanmax(group[f"lowest_{blade}"].data) > 0.0
            )
            # lines lie over the measured points
            traces = measured_traces(arrays, blade, colours) + tuple(trace for trace, _ in found)
            marks = tuple(mark for _, some in found for mark in some)
            y, case = Axis("accelerance", PER_N, log=True), f"{blade} blade, stiffness {name}"
            out.append(
                Chart(
                    "Frequency response",
                    x,
                    y,
                    traces,
                    (),
                    case,
                    "response",
                    areas=areas,
                    marks=marks,
                    bands=bands,
                    detail=detail,
                    **SHEET,
                )
            )
    return out


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


def _sweep(
    group: Group, blade: str, colours: Mapping[float | None, int]
) -> list[tuple[Trace, list[Mark]]]:
    """The steady motions of a sweep, and where they jump to another: words beside the point before,
    an arrow the way the sweep goes.
    """
    case, f, H = case_of(group), frequency_of(group), magnitude(group[f"accelerance_{blade}"])
    if not H.max() > 0.0:
        return []
    falling = f[-1] < f[0]
    colour = colours.get(case.force_ratio, 0)
    label = Case(force_ratio=case.force_ratio, choice=case.choice).label
    trace = Trace(label, f, H, "crosses" if falling else "points", colour)
    return [(trace, _jumps(group, H, colour))]


def _jumps(group: Group, H: Array, colour: int) -> list[Mark]:
    """Where the motions along a curve jump, marked at the point before."""
    if "jump" not in group:
        return []
    f = frequency_of(group)
    words = "← jump" if f[-1] < f[0] else "jump →"
    jumps = np.flatnonzero(np.asarray(group["jump"].data))
    return [Mark(float(f[i]), float(H[i]), words, colour) for i in jumps]


def _words(case: Case) -> str:
    """A curve within its stiffness."""
    return Case(force_ratio=case.force_ratio, reversed=case.reversed).label


def _curve(
    label: str, group: Group, name: str, style: Style, colour: int, *, closed: bool = False
) -> list[tuple[Trace, list[Mark]]]:
    """A curve with a mark on each of its peaks; none for a blade at rest."""
    H = magnitude(group[f"accelerance_{name}"])
    if not H.max() > 0.0:
        return []
    trace = Trace(
        label, frequency_of(group), np.where(H > 0.0, H, np.nan), style, colour, closed=closed
    )
    names = (f"peak_frequency_{name}", f"peak_accelerance_{name}")
    pairs = (
        zip(*(group[key].data for key in names), strict=True) if set(names) <= set(group) else ()
    )
    return [
        (
            trace,
            [
                *(
                    Mark(float(f), float(height), f"{f:.1f} Hz", colour, closed)
                    for f, height in pairs
                ),
                *_jumps(group, H, colour),
            ],
        )
    ]
