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
    MEASURED,
    MODES,
    PERFORMANCE,
    POINTS,
    SWEEP,
)
from upd.analyses.measured import measured_traces
from upd.plot.chart import Area, Array, Axis, Band, Chart, Mark, Scatter, Style, Trace
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
#: name, unit, scale, first degree of freedom and names of the damper's motions
MOTIONS = (
    ("translation", "µm", 1e3, 0, ("x, across the blades", "y, along the damper", "z, radial")),
    ("rotation", "mrad", 1e3, 3, ("about x", "about y", "about z")),
)
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
    def rank(self) -> tuple[bool, float]:
        """Curves on which a contact point slips come first, by rising F_C/F_E."""
        slips = self.data("state")[..., SLIP_SHARE].max() > 0.0
        return not slips, float(self.case.force_ratio or 0.0)

    @property
    def moves(self) -> bool:
        """Whether a contact point slips or lifts off anywhere on it."""
        return bool(self.data("state")[..., STICK_SHARE].min() < 1.0)


@dataclass(frozen=True)
class ChartedPeak:
    """A peak of a curve: its number, its place on the path, its mode where it is known."""

    curve: ChartedCurve
    number: int
    index: int
    mode: str = ""

    @property
    def case(self) -> Case:
        """The curve's, at the peak."""
        given = self.curve.case.given() | {"peak": self.number, "mode": self.mode}
        return replace(Case(**given), choice="")

    @property
    def detail(self) -> str:
        """Where it lies, and the sweep that found it where that is no balance."""
        words = [f"{self.curve.frequency[self.index]:.1f} Hz"]
        if self.curve.case.choice:
            words = ["time integration", self.curve.case.choice, *words]
        return ", ".join(words)


def charted_peaks(curve: ChartedCurve) -> list[ChartedPeak]:
    """The peaks of a curve."""
    numbers, index = curve.data("peak"), curve.data("peak_index")
    words = str(curve.group["peak"].attributes.get("modes", ""))
    modes = words.split(", ") if words else [""] * len(numbers)
    return [
        ChartedPeak(curve, int(number), int(i), mode)
        for number, i, mode in zip(numbers, index, modes, strict=True)
    ]


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
    axes = axis, Axis("share of the cycle", "%", low=0.0, high=100.0)
    case = f"{curve.case}, {SIDES[k]} face"
    return _sheet("contact_state", "Contact state", axes, areas=areas, case=case)


def contact_maps(at: ChartedPeak, points: Group, k: int) -> Iterator[Chart]:
    """Contact points of one face at a peak: how much of the cycle they slip, and are lifted off."""
    on, energy = np.asarray(points["face"].data) == k, at.curve.data("energy")[at.index]
    # Of all points, so that rounding on a face that sticks does not show.
    most = float(energy.max())
    size = np.maximum(energy[on], 0.0) / most if most > 0.0 else np.zeros(int(on.sum()))
    y, up = (np.asarray(points[name].data)[on] for name in ("along", "up"))
    axes = (Axis("along the damper y", "mm"), Axis("up the slope", "mm"))
    for state, share in zip(SHARES, at.curve.data("state")[at.index][on].T, strict=True):
        if state != "stick" and share.any():
            value = Axis(state, "% of the cycle", low=0.0, high=100.0)
            more = {
                "scatters": (Scatter(y, up, 100.0 * share, size, value),),
                "case": f"{at.case}, {SIDES[k]} face",
                "detail": at.detail,
                "note": "The area of a mark is its friction loss.",
            }
            yield _sheet("contact_map", f"Contact points at the peak: {state}", axes, **more)


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
    given = {"traces": tuple(traces), "case": at.case.label, "detail": at.detail}
    return _sheet("hysteresis", "Hysteresis", axes, **given)


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
    amplitude = scale * curve.data("damper_amplitude")[:, first : first + 3].T
    axes = HZ_AXIS, Axis(f"{name}, first harmonic", unit)
    # those that symmetry forbids are rounding
    size = amplitude.max(axis=1)
    shown = np.flatnonzero(size > np.sqrt(np.finfo(float).eps) * size.max())
    traces = tuple(Trace(names[k], curve.frequency, amplitude[k], "line", int(k)) for k in shown)
    title, case = f"Damper motion: {name}", curve.case.label
    return _sheet("damper_motion", title, axes, traces=traces, case=case)


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
    the contact and the damper behind them.
    """
    del summary
    groups, others = with_content(arrays, FRICTION), with_content(arrays, MARCHED)
    swept = with_content(arrays, SWEEP)
    ratios = list(dict.fromkeys(g.attributes["force_ratio"] for g in [*groups, *swept, *others]))
    curves, recorded = (
        [ChartedCurve(g, case_of(g), ratios.index(g.attributes["force_ratio"])) for g in some]
        for some in (groups, others)
    )
    # the page opens on the lowest F_C/F_E on which something slips
    shown, shown_recorded = (sorted(some, key=lambda c: c.rank) for some in (curves, recorded))
    peaks = [
        one for c in (*shown, *shown_recorded) if "peak" in c.group for one in charted_peaks(c)
    ]
    moving = [c for c in shown if c.moves] or shown[:1]
    sliding = [
        one for one in peaks if one.curve.data("state")[one.index, :, SLIP_SHARE].max() > 0.0
    ] or peaks[:1]
    points = {g.attributes["stiffness"]: g for g in with_content(arrays, POINTS)}
    rubbed = [c for c in curves if "loop_peak" in c.group]
    return [
        *_responses(arrays, curves, {r: k for k, r in enumerate(ratios)}),
        *(
            _performance(group)
            for group in with_content(arrays, PERFORMANCE)
            if group["ratio"].data.size
        ),
        *mode_charts(arrays),
        *(shares_chart(c, k) for c in moving if "share" in c.group for k in range(len(SIDES))),
        *(
            chart
            for one in sliding
            if "share" in one.curve.group
            for k in range(len(SIDES))
            for chart in contact_maps(one, points[one.case.stiffness], k)
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
    ]


def _responses(
    arrays: Arrays, curves: Sequence[ChartedCurve], colours: Mapping[float | None, int]
) -> list[Chart]:
    """Both blades for every stiffness: free, stuck, every curve with friction, measured peaks."""
    out, bands = [], tuple(_measured(arrays))
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
            parts = {"traces": tuple(traces), "marks": tuple(marks), "detail": detail}
            parts |= {"bands": bands, "case": f"{blade} blade, stiffness {name}"}
            out.append(_sheet("response", "Frequency response", (x, _HEIGHT), **parts))
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
    label = Case(force_ratio=curve.case.force_ratio).label
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


def _sweep(group: Group, blade: str, colours: Mapping[float | None, int]) -> Iterator[Trace]:
    """The steady motions of a sweep."""
    case, f, H = case_of(group), frequency_of(group), magnitude(group[f"accelerance_{blade}"])
    if H.max() > 0.0:
        label = Case(force_ratio=case.force_ratio, choice=case.choice).label
        style: Style = "crosses" if f[-1] < f[0] else "points"
        yield Trace(label, f, H, style, colours.get(case.force_ratio, 0))
