"""Charts of a forced response, from the run folder's arrays alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced.arrays import (
    FRICTION,
    LINEAR,
    MARCHED,
    MODES,
    PERFORMANCE,
    POINTS,
    SWEEP,
)
from upd.analyses.measured import damping_charts, measured_traces
from upd.plot.chart import Area, Array, Axis, Chart, Mark, Scatter, Style, Trace
from upd.plot.common import UM, case_of, frequency_of, magnitude, scalar, with_content
from upd.results import Arrays, Case, Group
from upd.scene.forced_contact import SIDES

#: the blade that is excited first
BLADES = ("right", "left")
#: shares of the cycle, in the order of the variables
SHARES = ("stick", "slip", "lift-off")
STICK_SHARE, SLIP_SHARE = 0, 1
PER_N = "(m/s²)/N"
HZ_AXIS = Axis("frequency", "Hz")
_HEIGHT = Axis("accelerance", PER_N, log=True)
#: ticks of a path that turns back
PATH_TICKS = 6


Axes = tuple[Axis, Axis]


def _sheet(figure: str, title: str, axes: Axes, **parts: Any) -> Chart:
    """A chart on a sheet of the run folder."""
    return Chart(title, *axes, figure=figure, columns=2, size=(6.4, 4.4), **parts)


@dataclass(frozen=True)
class ChartedCurve:
    """A curve with friction and its colour, one for every F_C/F_E."""

    group: Group
    case: Case
    colour: int

    def data(self, name: str) -> NDArray[Any]:
        """A variable."""
        return np.asarray(self.group[name].data)

    @property
    def frequency(self) -> Array:
        """Hz, along the path."""
        return frequency_of(self.group)

    @property
    def moves(self) -> bool:
        """Whether a contact point slips or lifts off anywhere on it."""
        return bool(self.data("state")[..., STICK_SHARE].min() < 1.0)

    def slides(self, k: int) -> bool:
        """Whether a contact point slips at its k-th peak."""
        return bool(self.data("state")[self.data("peak_index")[k], :, SLIP_SHARE].max() > 0.0)

    def peak(self, k: int) -> tuple[int, Case, str]:
        """Place on the path and case of its k-th peak; where that lies, and the sweep that found it
        where that is no balance.
        """
        i, number = int(self.data("peak_index")[k]), int(self.data("peak")[k])
        modes = str(self.group["peak"].attributes.get("modes", "")).split(", ")
        case = replace(self.case, peak=number, mode=modes[k] if any(modes) else "", choice="")
        by = f"time integration, {self.case.choice}, " if self.case.choice else ""
        return i, case, f"{by}{self.frequency[i]:.1f} Hz"


def shares_chart(curve: ChartedCurve, side: int) -> Chart:
    """Share of the cycle that one face sticks, slips and is lifted off, stacked over frequency."""
    share, x = 100.0 * curve.data("share")[:, side], curve.frequency
    top, steps, axis = np.cumsum(share, axis=1), np.diff(x), HZ_AXIS
    if not ((steps > 0.0).all() or (steps < 0.0).all()):
        # A path that turns back has several states at one frequency: they are drawn one after the
        # other.
        place = np.arange(len(x), dtype=float)
        at = np.linspace(0, len(x) - 1, PATH_TICKS)
        ticks = tuple((float(k), f"{np.interp(k, place, x):.1f}") for k in at)
        axis, x = Axis("frequency along the path", "Hz", ticks=ticks), place
    # A path of one point has no ends.
    if len(x) > 1:
        axis = replace(axis, low=float(x.min()), high=float(x.max()))
    areas = tuple(
        Area(state, x, top[:, j] - share[:, j], top[:, j], j, state)
        for j, state in enumerate(SHARES)
    )
    axes = axis, Axis("share of the cycle", "%", low=0.0, high=100.0)
    case = f"{curve.case}, {SIDES[side]} face"
    return _sheet("contact_state", "Contact state", axes, areas=areas, case=case)


def contact_maps(curve: ChartedCurve, k: int, points: Group, side: int) -> Iterator[Chart]:
    """Contact points of one face at a peak: how much of the cycle they slip, and are lifted off."""
    i, case, detail = curve.peak(k)
    on, energy = np.asarray(points["face"].data) == side, curve.data("energy")[i]
    # Of all points, so that rounding on a face that sticks does not show.
    most = float(energy.max())
    size = np.maximum(energy[on], 0.0) / most if most > 0.0 else np.zeros(int(on.sum()))
    y, up = (np.asarray(points[name].data)[on] for name in ("along", "up"))
    axes = (Axis("along the damper y", "mm"), Axis("up the slope", "mm"))
    for state, share in zip(SHARES, curve.data("state")[i][on].T, strict=True):
        if state != "stick" and share.any():
            value = Axis(state, "% of the cycle", low=0.0, high=100.0)
            more = {
                "scatters": (Scatter(y, up, 100.0 * share, size, value),),
                "case": f"{case}, {SIDES[side]} face",
                "detail": detail,
                "note": "The area of a mark is its friction loss.",
            }
            yield _sheet("contact_map", f"Contact points at the peak: {state}", axes, **more)


def loops_chart(curve: ChartedCurve, k: int) -> Chart:
    """Hysteresis loops of the points that lose most at a peak."""
    _, case, detail = curve.peak(k)
    traces: list[Trace] = []
    for one in np.flatnonzero(curve.data("loop_peak") == case.peak):
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
    given = {"traces": tuple(traces), "case": case.label, "detail": detail}
    return _sheet("hysteresis", "Hysteresis", axes, **given)


_STAR = 5
#: curves at most: the highest of all and of single modes
_MOST = 3


def _performance(group: Group) -> Chart:
    """Peaks of both blades over F_C/F_E."""
    ratio = group["ratio"].data
    traces = [Trace("highest of all", ratio, group["highest_accelerance"].data, "line", 0)]
    names = [key for key in group if key.startswith("peak_") and key.endswith("_right")]
    for name in sorted(key for key in names if "accelerance" in key):
        mode = str(group[name].attributes.get("mode", ""))
        height, colour = group[name].data, len(traces)
        found = np.isfinite(height)
        if found.sum() > 1 and len(traces) < _MOST:
            label = f"right blade, {mode}"
            traces.append(Trace(label, ratio[found], height[found], "both", colour))
    ends = np.array([ratio.min(), ratio.max()])
    styles: tuple[tuple[str, Style], ...] = (("free", "dashed"), ("stuck", "dashdot"))
    for kind, style in styles:
        limit = np.full(2, float(group[f"{kind}_peak"].data))
        traces.append(Trace(kind, ends, limit, style, closed=True))
    if "best_ratio" in group:
        best, least = (float(group[f"best_{name}"].data) for name in ("ratio", "accelerance"))
        label = f"best, F_C/F_E {best:.3g}"
        traces.append(Trace(label, np.array([best]), np.array([least]), "star", _STAR))
    axes = Axis("F_C/F_E", log=True), Axis("peak accelerance", PER_N, log=True)
    case = f"stiffness {group.attributes['stiffness']}"
    return _sheet("performance", "Performance", axes, traces=tuple(traces), case=case)


def mode_charts(arrays: Arrays) -> Iterator[Chart]:
    """Damping and frequency over the amplitude, the modes of a stiffness on one chart each."""
    groups = list(with_content(arrays, MODES))
    x = Axis("acceleration, right accelerometer", "m/s²", log=True)
    for name in dict.fromkeys(str(g.attributes["stiffness"]) for g in groups):
        mine = [g for g in groups if g.attributes["stiffness"] == name]
        for quantity, axis, scale in (
            ("damping", Axis("damping ratio", "%"), 100.0),
            ("frequency", HZ_AXIS, 1.0),
        ):
            curves = [(g["acceleration_right"].data, scale * g[quantity].data) for g in mine]
            modes = [str(g.attributes["mode"]) for g in mine]
            traces = tuple(Trace(modes[k], *one, "line", k) for k, one in enumerate(curves))
            title, case = f"{axis.name.capitalize()} over the amplitude", f"stiffness {name}"
            yield _sheet("nonlinear_modes", title, (x, axis), traces=traces, case=case)


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Responses free, stuck and with friction, and the peaks over F_C/F_E; what was asked for of
    the contact behind them.
    """
    del summary
    groups = [with_content(arrays, content) for content in (FRICTION, SWEEP, MARCHED)]
    ratios = dict.fromkeys(g.attributes["force_ratio"] for some in groups for g in some)
    colours = {ratio: k for k, ratio in enumerate(ratios)}
    curves, swept, recorded = (
        [ChartedCurve(g, case_of(g), colours[g.attributes["force_ratio"]]) for g in some]
        for some in groups
    )
    found = [group for group in with_content(arrays, PERFORMANCE) if group["ratio"].data.size]
    return [
        *_responses(arrays, [*curves, *swept], colours),
        *map(_performance, found),
        *mode_charts(arrays),
        *damping_charts(arrays),
        *_behind(with_content(arrays, POINTS), curves, recorded),
    ]


def _behind(
    points: Sequence[Group], curves: Sequence[ChartedCurve], recorded: Sequence[ChartedCurve]
) -> Iterator[Chart]:
    """States and loops; the page opens on the lowest F_C/F_E, which slips most."""
    shown, others = (
        sorted(some, key=lambda c: c.case.force_ratio or 0.0) for some in (curves, recorded)
    )
    both, sides = [*shown, *others], range(len(SIDES))
    peaks = [(c, k) for c in both if "peak" in c.group for k in range(len(c.data("peak")))]
    peaks = [(c, k) for c, k in peaks if c.slides(k)] or peaks[:1]
    places = {group.attributes["stiffness"]: group for group in points}
    for c in [c for c in shown if c.moves] or shown[:1]:
        yield from (shares_chart(c, k) for k in sides if "share" in c.group)
    for c, k in peaks:
        for side in sides if "share" in c.group else ():
            yield from contact_maps(c, k, places[c.case.stiffness], side)
    for c, k in peaks:
        if "loop_peak" in c.group and c.data("peak")[k] in c.data("loop_peak"):
            yield loops_chart(c, k)


def _responses(
    arrays: Arrays, curves: Sequence[ChartedCurve], colours: Mapping[float | None, int]
) -> list[Chart]:
    """Both blades for every stiffness: free, stuck, every curve with friction, measured ones."""
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
        for blade in BLADES:
            traces = [
                *measured_traces(arrays, blade, colours),
                *_limit("free", linear, blade, "dashed"),
                *_limit("stuck", linear, blade, "dashdot"),
                *(one for c in mine for one in _curve(c, blade)),
            ]
            marks = [one for c in mine for one in _marks(c, blade)]
            parts = {"traces": tuple(traces), "marks": tuple(marks), "detail": detail}
            parts |= {"case": f"{blade} blade, stiffness {name}"}
            out.append(_sheet("response", "Frequency response", (x, _HEIGHT), **parts))
    return out


def _limit(label: str, group: Group, blade: str, style: Style) -> Iterator[Trace]:
    """A linear limit; none for a blade at rest."""
    H = magnitude(group[f"accelerance_{label}_{blade}"])
    if H.max() > 0.0:
        shown = np.where(H > 0.0, H, np.nan)
        yield Trace(label, frequency_of(group), shown, style, closed=True)


def _curve(curve: ChartedCurve, blade: str) -> Iterator[Trace]:
    """A curve with friction, unstable parts dashed under the same name; steady motions of a sweep
    as points.
    """
    H, f, case = magnitude(curve.group[f"accelerance_{blade}"]), curve.frequency, curve.case
    label = Case(force_ratio=case.force_ratio, choice=case.choice).label
    if not H.max() > 0.0:
        return
    if case.choice:
        yield Trace(label, f, H, "crosses" if f[-1] < f[0] else "points", curve.colour)
        return
    stable = curve.data("stable") > 0 if "stable" in curve.group else np.ones(len(f), bool)
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
    """The frequency at every peak."""
    names = (f"peak_frequency_{blade}", f"peak_accelerance_{blade}")
    if set(names) <= set(curve.group) and not curve.case.choice and curve.moves:
        for f, height in zip(*(curve.data(name) for name in names), strict=True):
            yield Mark(float(f), float(height), f"{f:.1f} Hz", curve.colour)
