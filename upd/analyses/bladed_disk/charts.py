"""Charts of a bladed disk, from the run folder's arrays alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upd.analyses.bladed_disk.output import BY_DIAMETER, CAMPBELL, CROSSINGS, PERFORMANCE, WAVE
from upd.plot.chart import Axis, Band, Chart, Mark, Trace
from upd.plot.common import case_of, frequency_of, scalar, with_content
from upd.results import Arrays, Group

_HZ = Axis("frequency", "Hz")


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Campbell diagram, interference diagram, frequencies by nodal diameter."""
    del summary
    crossings = with_content(arrays, CROSSINGS)
    found = [_wave(group) for group in with_content(arrays, WAVE)]
    found += [_performance(group) for group in with_content(arrays, PERFORMANCE)]
    found += [_campbell(group, crossings) for group in with_content(arrays, CAMPBELL)]
    return found + [_by_diameter(group) for group in reversed(with_content(arrays, BY_DIAMETER))]


def _campbell(group: Group, crossings: list[Group]) -> Chart:
    """Modes of the nodal diameters that engine orders excite, over the speed."""
    speed, f = np.asarray(group["speed"].data), frequency_of(group)
    orders = np.asarray(group["engine_order"].data)
    N, top = int(group["sectors"].data), float(f.max())
    by_order = {int(order): min(order % N, -order % N) for order in orders}
    traces = []
    for colour, n in enumerate(dict.fromkeys(int(n) for n in by_order.values())):
        for k in range(f.shape[2]):
            label = f"nodal diameter {n}"
            mine = f"{label}, mode {k + 1}"
            traces.append(Trace(mine, speed, f[n, :, k], "line", colour, entry=label))
    for order in by_order:
        line = order * speed / 60.0
        shown = np.where(line <= top, line, np.nan)
        traces.append(Trace(f"EO {order}", speed, shown, "dotted", closed=True, entry="EO"))
    marks = [
        Mark(float(w), float(at), f"EO {order}")
        for one in crossings
        for order, w, at in zip(
            one["engine_order"].data, one["speed"].data, one["frequency"].data, strict=True
        )
    ]
    operating = scalar(group, "operating_speed") or 0.0
    band = Band("operating speed", "x", operating, operating, dashed=True)
    x = Axis("speed", "rpm", low=float(speed[0]), high=float(speed[-1]))
    return Chart(
        "Campbell diagram",
        x,
        _HZ,
        tuple(traces),
        bands=(band,),
        figure="campbell",
        marks=tuple(marks),
    )


def _by_diameter(group: Group) -> Chart:
    """Frequencies over the nodal diameter; at a speed with the zigzag of the engine orders."""
    n, f = np.asarray(group["nodal_diameter"].data, float), frequency_of(group)
    traces = [
        Trace(f"mode {k + 1}", n, f[:, k], "both", k % 10, entry="modes") for k in range(f.shape[1])
    ]
    speed, marks = scalar(group, "speed"), list[Mark]()
    title, case, figure = "Frequencies by nodal diameter", case_of(group).label, "nodal_diameters"
    if speed is not None:
        title, case, figure = "Interference diagram", f"{speed:.5g} rpm", "interference"
        N, per_order = int(group["sectors"].data), speed / 60.0
        orders = np.arange(int(f.max() / per_order) + 1)
        at = np.asarray(np.minimum(orders % N, -orders % N), float)
        over = np.asarray(orders * per_order, float)
        traces.append(Trace("engine orders", at, over, "dotted", closed=True))
        for order in np.asarray(group["engine_order"].data):
            place = float(min(order % N, -order % N))
            marks.append(Mark(place, float(order * per_order), f"EO {order}", closed=True))
    x = Axis("nodal diameter", ticks=tuple((k, f"{k:g}") for k in n[:: 1 + len(n) // 16].tolist()))
    return Chart(title, x, _HZ, tuple(traces), case=case, figure=figure, marks=tuple(marks))


def _wave(group: Group) -> Chart:
    """Free, stuck and damped amplitude at the tip."""
    f, on = frequency_of(group), np.asarray(group["damped_frequency"].data)
    traces = (
        Trace("free", f, np.asarray(group["free"].data), "dashed", closed=True),
        Trace("stuck", f, np.asarray(group["stuck"].data), "dotted", closed=True),
        Trace("damped", on, np.asarray(group["damped"].data), "both", 0),
    )
    y = Axis("amplitude at the tip", "µm", log=True)
    label = case_of(group).label
    return Chart("Response to an engine order", _HZ, y, traces, case=label, figure="response")


def _performance(group: Group) -> Chart:
    """Peak over F_C/F_E."""
    ratio, height = (np.asarray(group[name].data) for name in ("ratio", "height"))
    x, y = Axis("F_C/F_E", log=True), Axis("peak at the tip", "µm/N", log=True)
    traces = (Trace("peak", ratio, height, "both", 0),)
    label = case_of(group).label
    return Chart("Performance curve", x, y, traces, case=label, figure="performance")
