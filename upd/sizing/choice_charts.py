"""Charts of a chosen damper: worst peaks over F_C, peaks over F_C/F_E, and over what else is
chosen.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Axis, Band, Chart, Mark, Trace
from upd.sizing.choice import UNITS_OF, ChosenDamper
from upd.sizing.ratio_curves import SAME
from upd.sizing.worst_peak import WorstPeak

Array = NDArray[np.float64]
FIGURE = "choice"
#: points of a curve
_CURVE = 301
_SIZE = (6.4, 4.8)
#: room above and below the curves, as a factor
_ROOM = 1.25


def choice_charts(found: ChosenDamper) -> list[Chart]:
    """Worst peaks over F_C with the optimum, all peaks over F_C/F_E with the points solved, and the
    least worst peak over what else is chosen.

    Parameters
    ----------
    found : ChosenDamper
        The optimum.
    """
    charts = [_over_centrifugal(found), _over_ratio(found)]
    charts += [_over_shape(found, k) for k in range(len(found.ranges.shapes))]
    return [replace(one, figure=FIGURE, size=_SIZE, columns=len(charts)) for one in charts]


def _height_axis(found: ChosenDamper, name: str, *values: Array) -> Axis:
    known = np.concatenate([v[np.isfinite(v) & (v > 0.0)] for v in values])
    ends = (known.min() / _ROOM, known.max() * _ROOM) if known.size else (None, None)
    return Axis(name, UNITS_OF[found.objective], log=True, low=ends[0], high=ends[1])


def _curve(worst: WorstPeak, low: float, high: float) -> tuple[Array, Array]:
    """F_C [N] from end to end and heights, nan where they are not known."""
    c, y = worst.over(math.log(low), math.log(high))
    every = slice(None, None, max(1, len(c) // _CURVE))
    c, y = c[every], y[every]
    return np.exp(c), np.where(c >= worst.known_from() - SAME, np.exp(y), math.nan)


def _over_centrifugal(found: ChosenDamper) -> Chart:
    best, press = found.best, found.ranges.pressing
    low, high = best.ends
    scene = found.ranges.scene
    if low == high:
        low, high = low / 2.0, high * 2.0

    def shown(F: Array) -> Array:
        return np.array([F_C if press is None else press.value_at(F_C, scene) for F_C in F])

    (F, robust), (G, plain) = (_curve(w, low, high) for w in (best.worst, found.plain.plain))
    solved = np.array([math.log(found.centrifugal), math.log(found.nominal_centrifugal)])
    at = shown(np.exp(solved))
    name = "F_C" if press is None or press.path.endswith("centrifugal") else press.path
    return Chart(
        f"{scene.name}: worst peak",
        Axis(name, "N" if press is None else press.unit, log=True),
        _height_axis(found, "worst peak", robust, plain, np.array([found.worst])),
        traces=(
            Trace("over the ranges", shown(F), robust, "line", 0),
            Trace("the scene's own values", shown(G), plain, "dashed", 1),
            Trace("robust optimum", at[:1], np.array([found.worst]), "star", 0, outline=True),
            Trace("nominal optimum", at[1:], np.array([found.nominal_peak]), "star", 1),
        ),
        note="Between whole curves the cubic of their peaks and exact slopes.",
    )


def _over_ratio(found: ChosenDamper) -> Chart:
    """Every peak of the rigs of the optimum."""
    best = found.best
    traces: list[Trace] = []
    heights: list[Array] = []
    for w, rig in best.rigs:
        word = "".join(f", {of.shown(v)}" for of, v in zip(found.ranges.unsure, w, strict=True))
        s = np.linspace(rig.peaks.low, rig.peaks.high, _CURVE)
        curves = rig.peaks.curves()
        for name, curve in curves.items():
            y = curve(s)
            heights.append(np.exp(y[np.isfinite(y)]))
            values = np.where(np.isfinite(y), np.exp(y), math.nan)
            colour = len({t.colour for t in traces})
            label = f"{name}{word}"
            traces.append(Trace(label, np.exp(s), values, "line", colour))
            solved = sorted(
                (t, p[name].log_height) for t, p in rig.found.points.items() if name in p
            )
            x, v = np.exp(np.array(solved)).T
            inside = (np.log(x) >= rig.peaks.low - SAME) & (np.log(x) <= rig.peaks.high + SAME)
            traces.append(
                Trace(f"{label}, solved", x[inside], v[inside], "points", colour, entry=label)
            )
    c, f = best.best.log_centrifugal, best.worst.f
    marks = tuple(
        Mark(math.exp(p.s), math.exp(p.y), f"F_E {math.exp(c - p.s):.3g} N", 0)
        for p in best.best.deciding
        if p.share > 0.0
    )
    return Chart(
        "Peaks over F_C/F_E",
        Axis("F_C/F_E", log=True),
        _height_axis(replace(found, objective="peak"), "peak accelerance", *heights),
        traces=tuple(traces),
        marks=marks,
        bands=(Band("F_E of the optimum", "x", math.exp(c - f[1]), math.exp(c - f[0])),),
        note="Scaling F_C and F_E alike changes nothing: one curve serves all pairs of forces.",
    )


def _over_shape(found: ChosenDamper, k: int) -> Chart:
    shape = found.ranges.shapes[k]
    x, tried = (np.array(column) for column in zip(*found.along(k), strict=True))
    robust = np.exp([one.best.log_worst for one in tried])
    plain = np.exp([one.nominal.log_worst for one in tried])
    return Chart(
        f"Least worst peak over {shape.path}",
        Axis(shape.path, shape.unit),
        _height_axis(found, "worst peak at its best F_C", robust, plain),
        traces=(
            Trace("over the ranges", x, robust, "both", 0),
            Trace("the scene's own values", x, plain, "both", 1),
            Trace(
                "robust optimum",
                np.array([found.best.values[k]]),
                np.array([found.worst]),
                "star",
                0,
                outline=True,
            ),
        ),
        note="Every point is a rig of its own, at the F_C that is best for it"
        + (", all else as at the optimum." if len(found.ranges.shapes) > 1 else "."),
    )
