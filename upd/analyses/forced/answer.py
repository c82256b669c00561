"""The answer of a forced response: what an engineer would say of it, as tables, and its charts.

From the numbers and arrays of a run as its folder has them, so that a folder is answered alike.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from typing import Any

import numpy as np

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
#: numbers that were reached, by quantity, then by name and case
Known = Mapping[Quantity, Mapping[tuple[str, Case], Result]]
#: heads of a table with their cells
Row = tuple[tuple[str, str], ...]


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
    known: dict[Quantity, dict[tuple[str, Case], Result]] = defaultdict(dict)
    for one in map(read_result, results):
        if math.isfinite(one.value):
            known[quantity_of(one.name)[0]][one.name, one.case] = one
    tables = [_static(known), _peaks(known), _best(known), _modes(known), _inputs(known)]
    return [table for table in tables if table.rows]


# -- tables ----------------------------------------------------------------------------------------


def _table(heading: str, rows: Sequence[Row], note: str) -> AnswerTable:
    """A table of rows of heads and cells, the heads of all rows alike."""
    heads = tuple(head for head, _ in rows[0]) if rows else ()
    return AnswerTable(heading, heads, tuple(tuple(cell for _, cell in row) for row in rows), note)


def _beside(known: Known, one: Result, quantity: Quantity, **case: Any) -> Result | None:
    """Another number of the same mode and case, which may say more."""
    name = quantity.named(quantity_of(one.name)[1])
    return known[quantity].get((name, replace(one.case, **case)))


def _text(known: Known, one: Result, quantity: Quantity, words: str, **case: Any) -> str:
    """Another number of the same mode and case in words; "" where there is none."""
    found = _beside(known, one, quantity, **case)
    return "" if found is None else words.format(found.value)


def _bound(one: Result) -> str:
    return "" if one.estimated_error is None else percent_of(one.estimated_error)


def _height(one: Result) -> str:
    return f"{one.value:.0f}" if one.value >= 100.0 else f"{one.value:.1f}"


def _static(known: Known) -> AnswerTable:
    """N and T of both faces."""
    forces = list(known[q.STATIC_N].values())
    mine = [one for one in forces if one.case.stiffness == forces[0].case.stiffness]
    state = mine[0].case.choice if mine else ""
    rows = [
        (
            ("face", N.case.side),
            ("#N, N", f"{N.value:.1f}"),
            ("#T, N", _text(known, N, q.STATIC_T, "{:.1f}")),
        )
        for N in mine
    ]
    return _table("Static state", rows, f'Static state: "{state}".')


def _peaks(known: Known) -> AnswerTable:
    """One row for every F_C/F_E and mode of the right blade: frequency and height."""
    found = [f for f in known[q.PEAK_FREQUENCY].values() if f.case.kind != "stuck"]
    found.sort(
        key=lambda f: (
            f.case.kind != "free",
            f.case.stiffness,
            -(f.case.force_ratio or math.inf),
            f.name,
        )
    )
    several = len({f.case.stiffness for f in found}) > 1
    pairs = [(f, height) for f in found if (height := _beside(known, f, q.PEAK_ACCELERANCE))]
    free = max((height.value for f, height in pairs if f.case.kind == "free"), default=math.nan)
    rows = [_peak_row(known, *pair, free, several) for pair in pairs]
    if not any(reached for *_, (_, reached) in rows):
        rows = [row[:-1] for row in rows]
    return _table("Peaks", rows, "Right blade; shares of all contact points and of the cycle.")


def _peak_row(known: Known, f: Result, height: Result, free: float, several: bool) -> Row:
    """Frequency and height of a peak, and what is known of it.

    Parameters
    ----------
    free
        Height of the highest peak without damper.
    several
        Whether there are several contact stiffnesses.
    """
    case, n = f.case, int(quantity_of(f.name)[1])
    ratio = case.kind if case.force_ratio is None else f"{case.force_ratio:g}"
    curve = case.stiffness if several else "", ratio, case.choice
    alone = "one blade" if case.kind == "free" else f"peak {n}"
    change = math.nan if case.kind == "free" else 100.0 * (height.value / free - 1.0)
    fold, up = (_beside(known, f, one) for one in (q.SWEEP_UP_ACCELERANCE, q.SWEEP_UP_FREQUENCY))
    return (
        ("F_C/F_E", ", ".join(filter(None, curve))),
        ("mode", case.mode or alone),
        ("# Hz", f"{f.value:.1f}"),
        ("# ±", _bound(f)),
        ("# (m/s²)/N", _height(height)),
        ("# ±", _bound(height)),
        ("# against free", f"{change:+.0f} %" if math.isfinite(change) else ""),
        ("# slips", _text(known, f, q.CONTACT_SLIP, "{:.0f} %", peak=n)),
        ("# opens", _text(known, f, q.CONTACT_LIFT, "{:.0f} %", peak=n)),
        ("# measured Hz", f"{f.reference:g}" if f.reference else ""),
        ("# a sweep up reaches", f"{_height(fold)} at {up.value:.1f}" if fold and up else ""),
    )


def _best(known: Known) -> AnswerTable:
    """The best damper."""
    end = any(not inside.value for inside in known[q.BEST_INSIDE].values())
    how = "still falls at this end of the curve" if end else "is lowest here"
    rows = [
        (
            ("#F_C/F_E", _text(known, peak, q.BEST_RATIO, "{:.3g}")),
            ("#highest peak, (m/s²)/N", _height(peak)),
            ("# ±", _bound(peak)),
            ("# against free", f"{-down.value:+.0f} %" if down else ""),
            ("where", ", ".join(filter(None, (f"{peak.case.blade} blade", peak.case.mode)))),
            ("#with half of F_C", _text(known, peak, q.HALF_OF_BEST, "{:+.0f} %")),
            ("#with twice F_C", _text(known, peak, q.TWICE_THE_BEST, "{:+.0f} %")),
        )
        for peak in known[q.BEST_PEAK].values()
        for down in (_beside(known, peak, q.BEST_REDUCTION),)
    ]
    note = f"The highest peak of both blades and all modes {how}."
    return _table("Best F_C/F_E", rows, note)


def _modes(known: Known) -> AnswerTable:
    """The largest damping of every mode, where it is, and the F_C that puts a vibration there."""
    found = list(known[q.LARGEST_DAMPING].values())
    note = "Right accelerometer. F_C of the last column times an amplitude damps that one most."
    if not all(_beside(known, one, q.DAMPING_ACCELERATION) for one in found):
        note += " Without amplitude: the damping still rises where the path ends."
    rows = [
        (
            ("mode", ", ".join(filter(None, (one.case.mode, one.case.choice)))),
            ("#largest damping", f"{one.value:.2f} %"),
            ("#at m/s²", _text(known, one, q.DAMPING_ACCELERATION, "{:.3g}")),
            ("#Hz", _text(known, one, q.DAMPING_FREQUENCY, "{:.1f}")),
            ("#against stuck", _text(known, one, q.DAMPING_SHIFT, "{:+.1f} %")),
            ("#F_C per m/s², N", _text(known, one, q.FORCE_FOR_DAMPING, "{:.3g}")),
        )
        for one in found
    ]
    return _table("Damping over amplitude", rows, note)


def _inputs(known: Known) -> AnswerTable:
    """The inputs that change the peaks most, beside the numerical error."""
    changes: dict[str, list[tuple[Quantity, Result]]] = {}
    for quantity in _WEIGHTS:
        for one in known[quantity].values():
            changes.setdefault(one.case.choice.partition(": ")[0], []).append((quantity, one))
    ranked = sorted(
        changes.items(), key=lambda pair: -max(abs(one.value) / _WEIGHTS[of] for of, one in pair[1])
    )
    rows: list[tuple[str, ...]] = [
        (
            name,
            " or ".join(dict.fromkeys(one.case.choice.partition(": ")[2] for _, one in mine)),
            _span(mine, q.FREQUENCY_CHANGE, 1),
            _span(mine, q.ACCELERANCE_CHANGE, 0),
        )
        for name, mine in ranked[:_INPUTS]
    ]
    bounds = []
    for of in (q.PEAK_FREQUENCY, q.PEAK_ACCELERANCE):
        damped = [one.estimated_error for one in known[of].values() if one.case.force_ratio]
        errors = [error for error in damped if error is not None]
        bounds.append(f"±{percent_of(max(errors))}" if errors else "")
    if rows and any(bounds):
        rows.append(("numerical error", "largest bound", *bounds))
    ratios = (one.case.force_ratio or 0.0 for mine in changes.values() for _, one in mine)
    note = f"Changes of the right blade's peaks at F_C/F_E {min(ratios, default=0.0):g}."
    if others := ", ".join(name for name, _ in ranked[_INPUTS:]):
        note += f" Less than these: {others}."
    heads = ("input", "changed to", "#frequency", "#height")
    return AnswerTable("What the answer depends on most", heads, tuple(rows), note)


def _span(changes: Sequence[tuple[Quantity, Result]], quantity: Quantity, digits: int) -> str:
    values = [one.value for of, one in changes if of == quantity]
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


#: a chart on a sheet of the run folder
_sheet = partial(Chart, size=(6.4, 4.4))


def _moves(curve: Group) -> bool:
    """Whether a contact point slips or lifts off anywhere on a curve."""
    return bool(curve["state"].data[..., STICK_SHARE].min() < 1.0)


def _peak_of(curve: Group, k: int) -> tuple[int, Case, str]:
    """Place on the path and case of its k-th peak; where that lies, and the sweep that found it
    where that is no balance.
    """
    i, number, case = curve["peak_index"].data[k], int(curve["peak"].data[k]), case_of(curve)
    modes = str(curve["peak"].attributes.get("modes", "")).split(", ")
    by = f"time integration, {case.choice}, " if case.choice else ""
    at = replace(case, peak=number, mode=modes[k] if any(modes) else "", choice="")
    return int(i), at, f"{by}{frequency_of(curve)[i]:.1f} Hz"


def shares_chart(curve: Group, side: int) -> Chart:
    """Share of the cycle that one face sticks, slips and is lifted off, stacked over frequency."""
    share, x = 100.0 * curve["share"].data[:, side], frequency_of(curve)
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
    y, case = Axis("share of the cycle", "%", low=0.0, high=100.0), case_of(curve)
    parts: dict[str, Any] = {"areas": areas, "case": f"{case}, {SIDES[side]} face"}
    return _sheet("Contact state", axis, y, figure="contact_state", **parts)


def contact_maps(curve: Group, k: int, points: Group, side: int) -> Iterator[Chart]:
    """Contact points of one face at a peak: how much of the cycle they slip, and are lifted off."""
    i, case, detail = _peak_of(curve, k)
    on, energy = points["face"].data == side, curve["energy"].data[i]
    # Of all points, so that rounding on a face that sticks does not show.
    most = float(energy.max())
    size = np.maximum(energy[on], 0.0) / most if most > 0.0 else np.zeros(int(on.sum()))
    y, up = (points[name].data[on] for name in ("along", "up"))
    axes = (Axis("along the damper y", "mm"), Axis("up the slope", "mm"))
    for state, share in zip(SHARES, curve["state"].data[i][on].T, strict=True):
        if state != "stick" and share.any():
            value = Axis(state, "% of the cycle", low=0.0, high=100.0)
            parts: dict[str, Any] = {
                "figure": "contact_map",
                "scatters": (Scatter(y, up, 100.0 * share, size, value),),
                "case": f"{case}, {SIDES[side]} face",
                "detail": detail,
                "note": "The area of a mark is its friction loss.",
            }
            yield _sheet(f"Contact points at the peak: {state}", *axes, **parts)


def loops_chart(curve: Group, k: int) -> Chart:
    """Hysteresis loops of the points that lose most at a peak."""
    _, case, detail = _peak_of(curve, k)
    traces: list[Trace] = []
    for one in np.flatnonzero(curve["loop_peak"].data == case.peak):
        side, y, up, energy = (
            curve[f"loop_{name}"].data[one] for name in ("side", "along", "up", "energy")
        )
        label = f"{SIDES[side]}, y {y + 0.0:.1f}, up {up:.1f} mm: {energy:.3g} N mm"
        d, T = (
            np.append(loop, loop[:1])
            for loop in (curve["loop_displacement"].data[one], curve["loop_traction"].data[one])
        )
        traces.append(Trace(label, UM * d, T, "line", len(traces)))
    axes = (Axis("sliding displacement", "µm"), Axis("friction force", "N"))
    parts: dict[str, Any] = {"traces": tuple(traces), "case": case.label, "detail": detail}
    return _sheet("Hysteresis", *axes, figure="hysteresis", **parts)


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
    return _sheet("Performance", *axes, figure="performance", traces=tuple(traces), case=case)


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
            yield _sheet(title, x, axis, figure="nonlinear_modes", traces=traces, case=case)


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Responses free, stuck and with friction, and the peaks over F_C/F_E; what was asked for of
    the contact behind them.
    """
    del summary
    curves, swept, recorded = (
        with_content(arrays, content) for content in (FRICTION, SWEEP, MARCHED)
    )
    ratios = (g.attributes["force_ratio"] for g in (*curves, *swept, *recorded))
    colours = {ratio: k for k, ratio in enumerate(dict.fromkeys(ratios))}
    found = [group for group in with_content(arrays, PERFORMANCE) if group["ratio"].data.size]
    return [
        *_responses(arrays, [*curves, *swept], colours),
        *map(_performance, found),
        *mode_charts(arrays),
        *_behind(with_content(arrays, POINTS), curves, recorded),
    ]


def _behind(
    points: Sequence[Group], curves: Sequence[Group], recorded: Sequence[Group]
) -> Iterator[Chart]:
    """States and loops; the page opens on the lowest F_C/F_E, which slips most."""
    shown, others = (
        sorted(some, key=lambda c: case_of(c).force_ratio or 0.0) for some in (curves, recorded)
    )
    sides = range(len(SIDES))
    peaks = [(c, k) for c in (*shown, *others) if "peak" in c for k in range(len(c["peak"].data))]
    slip = [
        (c, k)
        for c, k in peaks
        if c["state"].data[c["peak_index"].data[k], :, SLIP_SHARE].max() > 0.0
    ]
    peaks = slip or peaks[:1]
    places = {group.attributes["stiffness"]: group for group in points}
    for c in [c for c in shown if _moves(c)] or shown[:1]:
        yield from (shares_chart(c, k) for k in sides if "share" in c)
    for c, k in peaks:
        for side in sides if "share" in c else ():
            yield from contact_maps(c, k, places[c.attributes["stiffness"]], side)
    for c, k in peaks:
        if "loop_peak" in c and c["peak"].data[k] in c["loop_peak"].data:
            yield loops_chart(c, k)


def _responses(
    arrays: Arrays, curves: Sequence[Group], colours: Mapping[float | None, int]
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
        mine = [
            (c, colours[c.attributes["force_ratio"]])
            for c in curves
            if c.attributes["stiffness"] == name
        ]
        for blade in SIDES[::-1]:
            traces = [
                *measured_traces(arrays, blade, colours),
                *_limit("free", linear, blade, "dashed"),
                *_limit("stuck", linear, blade, "dashdot"),
                *(one for c, colour in mine for one in _curve(c, blade, colour)),
            ]
            parts: dict[str, Any] = {
                "figure": "response",
                "traces": tuple(traces),
                "marks": tuple(one for c, colour in mine for one in _marks(c, blade, colour)),
                "case": f"{blade} blade, stiffness {name}",
                "detail": detail,
            }
            out.append(_sheet("Frequency response", x, _HEIGHT, **parts))
    return out


def _limit(label: str, group: Group, blade: str, style: Style) -> Iterator[Trace]:
    """A linear limit; none for a blade at rest."""
    H = magnitude(group[f"accelerance_{label}_{blade}"])
    if H.max() > 0.0:
        shown = np.where(H > 0.0, H, np.nan)
        yield Trace(label, frequency_of(group), shown, style, closed=True)


def _curve(curve: Group, blade: str, colour: int) -> Iterator[Trace]:
    """A curve with friction, unstable parts dashed under the same name; steady motions of a sweep
    as points.
    """
    H, f, case = magnitude(curve[f"accelerance_{blade}"]), frequency_of(curve), case_of(curve)
    label = Case(force_ratio=case.force_ratio, choice=case.choice).label
    if not H.max() > 0.0:
        return
    if case.choice:
        yield Trace(label, f, H, "crosses" if f[-1] < f[0] else "points", colour)
        return
    stable = curve["stable"].data > 0 if "stable" in curve else np.ones(len(f), bool)
    yield Trace(label, f, _only(H, stable), "line", colour, entry=label)
    if not stable.all():
        yield Trace(f"{label}, unstable", f, _only(H, ~stable), "dotted", colour, entry=label)


def _only(H: Array, on: Any) -> Array:
    """Values of some points and of their neighbours, so that parts of a curve touch; else nan."""
    wide = on.copy()
    wide[1:] |= on[:-1] & ~on[1:]
    wide[:-1] |= on[1:] & ~on[:-1]
    return np.where(wide, H, np.nan)


def _marks(curve: Group, blade: str, colour: int) -> Iterator[Mark]:
    """The frequency at every peak."""
    names = (f"peak_frequency_{blade}", f"peak_accelerance_{blade}")
    if set(names) <= set(curve) and not case_of(curve).choice and _moves(curve):
        for f, height in zip(*(curve[name].data for name in names), strict=True):
            yield Mark(float(f), float(height), f"{f:.1f} Hz", colour)
