"""The answer of a forced response: what an engineer would say of it, as tables, and its charts.

From the numbers and arrays of a run as its folder has them, so that a folder is answered alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced.results import FRICTION, LINEAR, MARCHED, MODES, PERFORMANCE, POINTS, SWEEP
from upd.analyses.measured import measured_traces
from upd.labels import percent_of
from upd.plot.answer_table import AnswerTable
from upd.plot.chart import Area, Array, Axis, Chart, Entry, Mark, Scatter, Style, Trace
from upd.plot.common import UM, case_of, frequency_of, magnitude, scalar, with_content
from upd.results import Arrays, Case, Group, Result
from upd.results import quantities as q
from upd.results.number import read_result
from upd.results.quantities import Quantity, quantity_of
from upd.scene.forced_contact import SIDES

#: the numbers that matter, most important first (shell patterns), in tables of sweeps and studies
MAIN = (
    "peak_?_frequency",
    "peak_?_accelerance",
    "reduction_of_free_peak",
    "friction_energy",
    "best_ratio",
    "best_peak",
    "stuck_in_phase",
    "stuck_out_of_phase",
    "static_N",
    "static_T",
    "fitted_damping",
    "computed_peak_frequency",
    "frac",
    "magnitude_correlation",
)
#: inputs that are shown
_INPUTS = 3
#: changes that weigh alike: an accuracy of frequency and of height that an engineer asks for
_WEIGHTS = {q.FREQUENCY_CHANGE: 1.5, q.ACCELERANCE_CHANGE: 10.0}
#: numbers that were reached, by name and case
Known = Mapping[tuple[str, Case], Result]


def headline(results: Sequence[Entry]) -> list[Entry]:
    """Peaks free and of the curve of the lowest F_C/F_E, which slips most, its reduction and loss,
    the best F_C/F_E, the stuck frequencies, the static forces of both faces.
    """
    first: dict[tuple[bool, int, str, str], Entry] = {}
    cases = [(Case(**one["case_fields"]), one) for one in results]
    for case, entry in sorted(cases, key=lambda pair: pair[0].force_ratio or 0.0):
        rank = next((k for k, one in enumerate(MAIN) if fnmatchcase(entry["name"], one)), None)
        side = case.side if entry["name"] in (q.STATIC_N.name, q.STATIC_T.name) else ""
        # The peaks of the stuck curve are the stuck frequencies.
        if rank is not None and case.kind != "stuck":
            first.setdefault((case.kind != "free", rank, entry["name"], side), entry)
    return [first[key] for key in sorted(first)]


def answer(results: Sequence[Entry]) -> list[AnswerTable]:
    """Static state, peaks, the best damper, what the answer depends on most."""
    numbers = map(read_result, results)
    known = {(one.name, one.case): one for one in numbers if math.isfinite(one.value)}
    tables = [_static(known), _peaks(known), _best(known), _modes(known), _inputs(known)]
    return [table for table in tables if table.rows]


# -- tables ----------------------------------------------------------------------------------------


def _table(
    title: str, rows: Sequence[Any], note: str, *columns: tuple[str, Callable[[Any], str]]
) -> AnswerTable:
    """A table of columns, heads and what makes their cells of a row."""
    cells = tuple(tuple(cell(row) for _, cell in columns) for row in rows)
    return AnswerTable(title, tuple(head for head, _ in columns), cells, note)


def _is(one: Result, *quantities: Quantity) -> bool:
    return quantity_of(one.name)[0] in quantities


def _beside(known: Known, one: Result, quantity: Quantity, **case: Any) -> Result | None:
    """Another number of the same mode and case, which may say more."""
    return known.get((quantity.named(quantity_of(one.name)[1]), replace(one.case, **case)))


def _text(words: str, one: Result | None) -> str:
    """A value in words; "" where there is none."""
    return "" if one is None else words.format(one.value)


def _bound(one: Result) -> str:
    return "" if one.estimated_error is None else percent_of(one.estimated_error)


def _height(one: Result) -> str:
    return f"{one.value:.0f}" if one.value >= 100.0 else f"{one.value:.1f}"


def _together(*words: str) -> str:
    return ", ".join(filter(None, words))


def _static(known: Known) -> AnswerTable:
    """N and T of both faces."""
    forces = [one for one in known.values() if _is(one, q.STATIC_N)]
    mine = [one for one in forces if one.case.stiffness == forces[0].case.stiffness]
    state = mine[0].case.choice if mine else ""
    return _table(
        "Static state",
        mine,
        f'Static state: "{state}".',
        ("face", lambda N: N.case.side),
        ("#N, N", lambda N: f"{N.value:.1f}"),
        ("#T, N", lambda N: _text("{:.1f}", _beside(known, N, q.STATIC_T))),
    )


def _peaks(known: Known) -> AnswerTable:
    """One row for every F_C/F_E and mode of the right blade: frequency and height."""
    found = [f for f in known.values() if _is(f, q.PEAK_FREQUENCY) and f.case.kind != "stuck"]
    several = len({f.case.stiffness for f in found}) > 1
    rows = [(f, _beside(known, f, q.PEAK_ACCELERANCE)) for f in sorted(found, key=_order)]
    rows = [(f, height) for f, height in rows if height is not None]
    free = max((h.value for f, h in rows if h and f.case.kind == "free"), default=math.nan)

    def case(f: Result) -> str:
        ratio = f.case.force_ratio
        kind = f.case.kind if ratio is None else f"{ratio:g}"
        return _together(f.case.stiffness if several else "", kind, f.case.choice)

    def mode(f: Result) -> str:
        alone = "one blade" if f.case.kind == "free" else f"peak {quantity_of(f.name)[1]}"
        return f.case.mode or alone

    def against(height: Result) -> str:
        change = 100.0 * (height.value / free - 1.0)
        shown = height.case.kind != "free" and math.isfinite(change)
        return f"{change:+.0f} %" if shown else ""

    def moves(f: Result, quantity: Quantity) -> str:
        return _text("{:.0f} %", _beside(known, f, quantity, peak=int(quantity_of(f.name)[1])))

    def reaches(f: Result) -> str:
        fold, up = (
            _beside(known, f, one) for one in (q.SWEEP_UP_ACCELERANCE, q.SWEEP_UP_FREQUENCY)
        )
        return f"{_height(fold)} at {up.value:.1f}" if fold and up else ""

    swept = [("# a sweep up reaches", lambda row: reaches(row[0]))]
    return _table(
        "Peaks",
        rows,
        "Right blade; shares of all contact points and of the cycle.",
        ("F_C/F_E", lambda row: case(row[0])),
        ("mode", lambda row: mode(row[0])),
        ("# Hz", lambda row: f"{row[0].value:.1f}"),
        ("# ±", lambda row: _bound(row[0])),
        ("# (m/s²)/N", lambda row: _height(row[1])),
        ("# ±", lambda row: _bound(row[1])),
        ("# against free", lambda row: against(row[1])),
        ("# slips", lambda row: moves(row[0], q.CONTACT_SLIP)),
        ("# opens", lambda row: moves(row[0], q.CONTACT_LIFT)),
        ("# measured Hz", lambda row: f"{row[0].reference:g}" if row[0].reference else ""),
        *(swept if any(reaches(f) for f, _ in rows) else ()),
    )


def _order(f: Result) -> tuple[Any, ...]:
    case = f.case
    return case.kind != "free", case.stiffness, -(case.force_ratio or math.inf), f.name


def _best(known: Known) -> AnswerTable:
    """The best damper."""
    found = {quantity_of(one.name)[0]: one for one in known.values()}
    rows = [found[q.BEST_PEAK]] if {q.BEST_RATIO, q.BEST_PEAK} <= set(found) else []
    inside, down = found.get(q.BEST_INSIDE), found.get(q.BEST_REDUCTION)
    end = inside is not None and not inside.value
    how = "still falls at this end of the curve" if end else "is lowest here"
    return _table(
        "Best F_C/F_E",
        rows,
        f"The highest peak of both blades and all modes {how}.",
        ("#F_C/F_E", lambda _: f"{found[q.BEST_RATIO].value:.3g}"),
        ("#highest peak, (m/s²)/N", _height),
        ("# ±", _bound),
        ("# against free", lambda _: "" if down is None else f"{-down.value:+.0f} %"),
        ("where", lambda peak: _together(f"{peak.case.blade} blade", peak.case.mode)),
        ("#with half of F_C", lambda _: _text("{:+.0f} %", found.get(q.HALF_OF_BEST))),
        ("#with twice F_C", lambda _: _text("{:+.0f} %", found.get(q.TWICE_THE_BEST))),
    )


def _modes(known: Known) -> AnswerTable:
    """The largest damping of every mode, where it is, and the F_C that puts a vibration there."""
    rows = [one for one in known.values() if _is(one, q.LARGEST_DAMPING)]

    def at(quantity: Quantity, words: str) -> Callable[[Result], str]:
        return lambda one: _text(words, _beside(known, one, quantity))

    acceleration = at(q.DAMPING_ACCELERATION, "{:.3g}")
    note = "Right accelerometer. F_C of the last column times an amplitude damps that one most."
    if not all(acceleration(one) for one in rows):
        note += " Without amplitude: the damping still rises where the path ends."
    return _table(
        "Damping over amplitude",
        rows,
        note,
        ("mode", lambda one: _together(one.case.mode, one.case.choice)),
        ("#largest damping", lambda one: f"{one.value:.2f} %"),
        ("#at m/s²", acceleration),
        ("#Hz", at(q.DAMPING_FREQUENCY, "{:.1f}")),
        ("#against stuck", at(q.DAMPING_SHIFT, "{:+.1f} %")),
        ("#F_C per m/s², N", at(q.FORCE_FOR_DAMPING, "{:.3g}")),
    )


# -- inputs ----------------------------------------------------------------------------------------


def _inputs(known: Known) -> AnswerTable:
    """The inputs that change the peaks most, beside the numerical error."""
    changes: dict[str, list[Result]] = {}
    for one in known.values():
        if _is(one, *_WEIGHTS):
            changes.setdefault(one.case.choice.partition(": ")[0], []).append(one)
    ranked = sorted(
        changes.items(),
        key=lambda pair: (
            -max(abs(one.value) / _WEIGHTS[quantity_of(one.name)[0]] for one in pair[1])
        ),
    )
    rows = [
        (
            name,
            " or ".join(dict.fromkeys(one.case.choice.partition(": ")[2] for one in mine)),
            _span(mine, q.FREQUENCY_CHANGE, 1),
            _span(mine, q.ACCELERANCE_CHANGE, 0),
        )
        for name, mine in ranked[:_INPUTS]
    ]
    bounds = _largest_bound(known, q.PEAK_FREQUENCY), _largest_bound(known, q.PEAK_ACCELERANCE)
    if rows and any(bounds):
        rows.append(("numerical error", "largest bound", *bounds))
    ratios = (one.case.force_ratio or 0.0 for mine in changes.values() for one in mine)
    note = f"Changes of the right blade's peaks at F_C/F_E {min(ratios, default=0.0):g}."
    if others := ", ".join(name for name, _ in ranked[_INPUTS:]):
        note += f" Less than these: {others}."
    heads = ("input", "changed to", "#frequency", "#height")
    return AnswerTable("What the answer depends on most", heads, tuple(rows), note)


def _largest_bound(known: Known, quantity: Quantity) -> str:
    """Of a number of all peaks with friction."""
    errors = [
        one.estimated_error
        for one in known.values()
        if _is(one, quantity) and one.case.force_ratio and one.estimated_error is not None
    ]
    return f"±{percent_of(max(errors))}" if errors else ""


def _span(changes: Sequence[Result], quantity: Quantity, digits: int) -> str:
    values = [one.value for one in changes if _is(one, quantity)]
    ends = [f"{end:+.{digits}f}" for end in sorted({min(values), max(values)})] if values else []
    return f"{' to '.join(ends)} %" if ends else ""


# -- charts ----------------------------------------------------------------------------------------


#: shares of the cycle, in the order of the variables
SHARES = ("stick", "slip", "lift-off")
STICK_SHARE, SLIP_SHARE = 0, 1
PER_N = "(m/s²)/N"
HZ_AXIS = Axis("frequency", "Hz")
_HEIGHT = Axis("accelerance", PER_N, log=True)
#: ticks of a path that turns back
PATH_TICKS = 6


def _sheet(figure: str, title: str, axes: tuple[Axis, Axis], **parts: Any) -> Chart:
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
    for name in sorted(key for key in group if key.endswith("_accelerance_right")):
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
        for blade in SIDES[::-1]:
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
