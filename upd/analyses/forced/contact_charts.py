"""Charts of the contact and of the damper along a curve and at its peaks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upd.analyses.forced.chart_parts import (
    HZ_AXIS,
    MOTIONS,
    PATH_TICKS,
    SHARES,
    SHEET,
    ChartedCurve,
    ChartedPeak,
)
from upd.plot.chart import Area, Axis, Chart, Group, Pies, Trace
from upd.plot.common import UM
from upd.scene.forced_contact import SIDES


def shares_chart(curve: ChartedCurve, k: int) -> Chart:
    """Share of the cycle that one face sticks, slips and is lifted off, stacked over frequency."""
    share, f = 100.0 * curve.data("share")[:, k], curve.frequency
    top = np.cumsum(share, axis=1)
    steps = np.diff(f)
    turns = not ((steps > 0.0).all() or (steps < 0.0).all())
    # A path that turns back has several states at one frequency: they are drawn one after the
    # other.
    place = np.arange(len(f), dtype=float)
    x = place if turns else f
    # A path of one point has no ends.
    low, high = (float(x[[0, -1]].min()), float(x[[0, -1]].max())) if len(f) > 1 else (None, None)
    axis = Axis("frequency", "Hz", low=low, high=high)
    if turns:
        ticks = tuple(
            (float(at), f"{np.interp(at, place, f):.1f}")
            for at in np.linspace(0, len(f) - 1, PATH_TICKS)
        )
        axis = Axis("frequency along the path", "Hz", low=low, high=high, ticks=ticks)
    areas = tuple(
        Area(state, x, top[:, j] - share[:, j], top[:, j], j, state)
        for j, state in enumerate(SHARES)
    )
    y, case = Axis("share of the cycle", "%", low=0.0, high=100.0), f"{curve.case}, {SIDES[k]} face"
    return Chart("Contact state", axis, y, areas=areas, case=case, figure="contact_state", **SHEET)


def contact_map(at: ChartedPeak, points: Group, k: int) -> Chart:
    """Contact points of one face at a peak.

    Sectors of stick, slip and lift-off, size by the friction loss.
    """
    on, energy = np.asarray(points["face"].data) == k, at.curve.data("energy")[at.index]
    # Of all points, so that rounding on a face that sticks does not show.
    most = float(energy.max())
    size = np.maximum(energy[on], 0.0) / most if most > 0.0 else np.zeros(int(on.sum()))
    y, up = (np.asarray(points[name].data)[on] for name in ("along", "up"))
    pies = Pies(y, up, at.curve.data("state")[at.index][on], size, SHARES, "friction loss")
    axes = (Axis("along the damper y", "mm"), Axis("up the slope", "mm"))
    case = f"{at.case}, {SIDES[k]} face"
    return Chart(
        "Contact points at the peak",
        *axes,
        pies=(pies,),
        case=case,
        figure="contact_map",
        detail=at.detail,
        **SHEET,
    )


def loops_chart(at: ChartedPeak) -> Chart:
    """Hysteresis loops of the points that lose most at a peak."""
    curve = at.curve
    traces: list[Trace] = []
    for one in np.flatnonzero(curve.data("loop_peak") == at.number):
        side, y, up, energy = (
            curve.data(f"loop_{name}")[one] for name in ("side", "along", "up", "energy")
        )
        label = f"{SIDES[side]}, y {y + 0.0:.1f}, up {up:.1f} mm: {energy:.3g} N mm"
        d, T = (
            np.append(loop, loop[:1])
            for loop in (curve.data("loop_displacement")[one], curve.data("loop_traction")[one])
        )
        traces.append(Trace(label, UM * d, T, "line", len(traces)))
    axes = (Axis("sliding displacement", "µm"), Axis("friction force", "N"))
    return Chart(
        "Hysteresis",
        *axes,
        tuple(traces),
        case=at.case.label,
        figure="hysteresis",
        detail=at.detail,
        **SHEET,
    )


def loss_chart(curves: Sequence[ChartedCurve]) -> Chart:
    """Friction loss of all points over frequency."""
    traces = tuple(
        Trace(c.case.label, c.frequency, 1e3 * c.data("power").sum(axis=1), "line", k)
        for k, c in enumerate(curves)
    )
    return Chart("Friction loss", HZ_AXIS, Axis("power of all contact points", "mW"), traces)


def motion_chart(curve: ChartedCurve, kind: int) -> Chart:
    """The damper's degrees of freedom over frequency: amplitudes of the first harmonic."""
    name, unit, scale, first, names = MOTIONS[kind]
    amplitude = scale * curve.data("damper_amplitude")[:, first : first + 3]
    # Motions that symmetry forbids are rounding.
    shown = [
        k
        for k in range(3)
        if amplitude[:, k].max() > np.sqrt(np.finfo(float).eps) * amplitude.max()
    ]
    traces = tuple(Trace(names[k], curve.frequency, amplitude[:, k], "line", k) for k in shown)
    y = Axis(f"{name}, first harmonic", unit)
    return Chart(
        f"Damper motion: {name}",
        HZ_AXIS,
        y,
        traces,
        case=curve.case.label,
        figure="damper_motion",
        **SHEET,
    )


def turn_chart(at: ChartedPeak, kind: int) -> Chart:
    """The damper's degrees of freedom over a period at a peak, about their means."""
    name, unit, scale, first, names = MOTIONS[kind]
    motion = scale * at.curve.data("damper_motion")[at.index, first : first + 3]
    motion = motion - motion.mean(axis=1, keepdims=True)
    size = np.abs(motion).max(axis=1)
    # Motions that symmetry forbids are rounding.
    shown = np.flatnonzero(size > np.sqrt(np.finfo(float).eps) * size.max())
    turn = np.arange(1, motion.shape[1] + 1) / motion.shape[1]
    traces = tuple(Trace(names[k], turn, motion[k], "line", int(k)) for k in shown)
    return Chart(
        f"Damper motion over a period: {name}",
        Axis("time in periods", low=0.0, high=1.0),
        Axis(f"{name} about its mean", unit),
        traces,
        case=at.case.label,
        figure="damper_period",
        detail=at.detail,
        **SHEET,
    )
