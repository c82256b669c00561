"""Charts of peaks over F_C/F_E and of peaks followed again."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced.array_parts import HIGHEST, PERFORMANCE
from upd.analyses.forced.chart_parts import PEAK_AXIS, PER_N, SHEET
from upd.analyses.measured.charts import measured_peak_traces
from upd.plot.chart import Array, Arrays, Axis, Chart, Group, Mark, Style, Trace
from upd.plot.common import case_of, with_content

_STAR = 5


def performance_charts(arrays: Arrays) -> list[Chart]:
    """Peak accelerance of the right blade over F_C/F_E, one chart for every stiffness."""
    out = []
    branches = [g for g in with_content(arrays, PERFORMANCE) if np.size(g["ratio"].data)]
    limits = {g.attributes["stiffness"]: g for g in with_content(arrays, HIGHEST)}
    for name in dict.fromkeys(g.attributes["stiffness"] for g in branches):
        mine = [g for g in branches if g.attributes["stiffness"] == name]
        traces = [trace for k, g in enumerate(mine) for trace in _branch(g, k)]
        if name in limits:
            ratios = np.concatenate([np.asarray(g["ratio"].data, float) for g in mine])
            traces += _limits(limits[name], np.array([ratios.min(), ratios.max()]))
        traces += measured_peak_traces(arrays, "right", len(mine))
        axes = (Axis("F_C/F_E", log=True), Axis("peak accelerance", PER_N, log=True))
        out.append(
            Chart(
                "Performance",
                *axes,
                tuple(traces),
                case=f"right blade, stiffness {name}",
                figure="performance",
                **SHEET,
            )
        )
    return out


def _branch(group: Group, colour: int) -> list[Trace]:
    """A followed peak, with open marks where points lift off."""
    ratio, height, lift = (
        np.asarray(group[name].data, float) for name in ("ratio", "peak_accelerance", "lift")
    )
    name = str(group.attributes["branch"])
    if mode := group.attributes.get("mode", ""):
        name += f", {mode}"
    marks: tuple[tuple[NDArray[np.bool_], Style, str], ...] = (
        (lift <= 0.0, "points", name),
        (lift > 0.0, "open points", f"{name}, points lift off"),
    )
    line = Trace(name, ratio, height, "line", colour)
    least = group.get("peak_accelerance_lower_sweep")
    lower = [] if least is None else _lower(name, ratio, height, np.asarray(least.data), colour)
    return [
        line,
        *lower,
        *(
            Trace(label, ratio[on], height[on], style, colour)
            for on, style, label in marks
            if on.any()
        ),
    ]


def _lower(name: str, ratio: Array, height: Array, least: Array, colour: int) -> list[Trace]:
    """The lower of both sweeps, where they differ."""
    if (least >= height).all():
        return []
    return [Trace(f"{name}, the lower of both sweeps", ratio, least, "dotted", colour)]


def _limits(group: Group, ends: Array) -> list[Trace]:
    """Free and stuck peak from end to end, and the optimum of the highest peak."""
    styles: tuple[tuple[str, Style], ...] = (("free", "dashed"), ("stuck", "dashdot"))
    out = [
        Trace(kind, ends, np.full(2, float(group[f"{kind}_peak"].data)), style, closed=True)
        for kind, style in styles
    ]
    if "optimum_ratio" in group:
        ratio, f, height = (
            float(group[f"optimum_{name}"].data) for name in ("ratio", "frequency", "accelerance")
        )
        out.append(
            Trace(
                f"optimum {ratio:.3g}, {f:.1f} Hz",
                np.array([ratio]),
                np.array([height]),
                "star",
                _STAR,
            )
        )
    return out


def again_chart(group: Group, title: str, axis: str, figure: str) -> Chart:
    """A peak followed again with one choice changed; choices that did not find it have no point."""
    if "start" in group:
        choices = [
            f"start {name}" for name in str(group["start"].attributes["flag_meanings"]).split()
        ]
    else:
        choices = [f"{int(h)}" for h in group["highest_harmonic"].data]
    f, height = (
        np.asarray(group[name].data, float) for name in ("peak_frequency", "peak_accelerance")
    )
    good = np.flatnonzero(np.isfinite(height))
    place = np.arange(len(good), dtype=float)
    marks = tuple(
        Mark(at, float(height[k]), f"{f[k]:.2f} Hz") for at, k in zip(place, good, strict=True)
    )
    x = Axis(
        axis,
        low=-0.5,
        high=len(good) - 0.5,
        ticks=tuple((at, choices[k]) for at, k in zip(place, good, strict=True)),
    )
    traces = (Trace("peak accelerance", place, height[good], "both"),)
    return Chart(
        title, x, PEAK_AXIS, traces, case=case_of(group).label, figure=figure, marks=marks, **SHEET
    )
