"""Charts of a forced response, from the run folder's arrays alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upd.analyses.forced.array_parts import (
    BAND,
    FRICTION,
    HARMONICS,
    HIGHEST,
    LINEAR,
    MARCHED,
    MEASURED,
    PERFORMANCE,
    POINTS,
    SPREAD,
    SWEEP,
)
from upd.plot.chart import Area, Array, Arrays, Axis, Band, Chart, Group, Mark, Pies, Style, Trace
from upd.plot.common import UM, case_of, magnitude, scalar, with_content
from upd.results import Case
from upd.scene.forced import SIDES

#: the blade that is excited first
_BLADES = ("right", "left")
#: shares of the cycle, in the order of the variables
_SHARES = ("stick", "slip", "lift-off")
_STICK, _SLIP = 0, 1
_PER_N = "(m/s²)/N"
_HZ = Axis("frequency", "Hz")
_PEAK = Axis("peak accelerance", _PER_N)
_SHEET: dict[str, Any] = {"columns": 2, "size": (6.4, 4.4)}
#: name, unit, scale, first degree of freedom and names of the damper's motions
_MOTIONS = (
    ("translation", "µm", 1e3, 0, ("x, across the blades", "y, along the damper", "z, radial")),
    ("rotation", "mrad", 1e3, 3, ("about x", "about y", "about z")),
)
#: ticks of a path that turns back
_PATH_TICKS = 6
_STAR = 5


@dataclass(frozen=True)
class _Curve:
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
        return _frequency(self.group)

    @property
    def slips(self) -> bool:
        """Whether a contact point slips anywhere on it."""
        return bool(self.data("state")[..., _SLIP].max() > 0.0)

    @property
    def moves(self) -> bool:
        """Whether a contact point slips or lifts off anywhere on it."""
        return bool(self.data("state")[..., _STICK].min() < 1.0)

    @property
    def told(self) -> tuple[str, float | None]:
        """Stiffness and F_C/F_E."""
        return self.case.stiffness, self.case.force_ratio


@dataclass(frozen=True)
class _At:
    """A peak of a curve: its number and its place on the path, its mode where it is told."""

    curve: _Curve
    number: int
    index: int
    mode: str = ""

    @property
    def case(self) -> Case:
        """The curve's, at the peak."""
        given = self.curve.case.given() | {"peak": self.number, "mode": self.mode}
        return replace(Case(**given), choice="")

    def moves(self, points: Group, side: int) -> bool:
        """Whether a contact point of a face slips or lifts off."""
        stick = self.curve.data("state")[self.index, :, _STICK]
        return bool((stick[np.asarray(points["face"].data) == side] < 1.0).any())

    @property
    def detail(self) -> str:
        """Where it lies, and the sweep that tells it where that is no balance."""
        words = [f"{self.curve.frequency[self.index]:.1f} Hz"]
        if self.curve.case.choice:
            words = ["time march", self.curve.case.choice, *words]
        return ", ".join(words)


def charts(arrays: Arrays, summary: Mapping[str, Any]) -> list[Chart]:
    """Responses free, stuck and with friction.

    Contact states and loops at the peaks, loss, damper motion, performance, convergence.
    """
    del summary
    groups, others = with_content(arrays, FRICTION), with_content(arrays, MARCHED)
    ratios = list(dict.fromkeys(g.attributes["force_ratio"] for g in groups + others))
    curves, marched = (
        [_Curve(g, case_of(g), ratios.index(g.attributes["force_ratio"])) for g in some]
        for some in (groups, others)
    )
    # The page opens on a curve on which something slips.
    curves.sort(key=lambda c: not c.slips)
    peaks = [one for c in marched for one in _marked(c)]
    at = [*_left_to_balance(curves, peaks), *peaks]
    # Where only the sweeps have a curve, the balance has one point of it.
    swept = {c.told for c in marched}
    paths = [c for c in curves if len(c.frequency) > 1 or c.told not in swept]
    # Where every point sticks over the whole cycle there is nothing to see.
    moving = [c for c in paths if c.moves] or paths[:1]
    sliding = [one for one in at if one.curve.data("state")[one.index, :, _SLIP].max() > 0.0] or at[
        :1
    ]
    points = {g.attributes["stiffness"]: g for g in with_content(arrays, POINTS)}
    return [
        *_responses(arrays, curves),
        *_more_harmonics(arrays, curves),
        *(_shares(c, k) for c in moving if "share" in c.group for k in range(len(SIDES))),
        *(
            _map(one, points[one.case.stiffness], k)
            for one in sliding
            if "share" in one.curve.group
            for k in range(len(SIDES))
            if one.moves(points[one.case.stiffness], k)
        ),
        *(
            _loops(one)
            for one in sliding
            if "loop_peak" in one.curve.group and one.number in one.curve.data("loop_peak")
        ),
        *([_loss(paths)] if paths else []),
        *(
            _motion(c, k)
            for c in paths
            if "damper_amplitude" in c.group
            for k in range(len(_MOTIONS))
        ),
        *(
            _turn(one, k)
            for one in peaks
            if "damper_motion" in one.curve.group
            for k in range(len(_MOTIONS))
        ),
        *_performance(arrays),
        *(
            _again(g, "Slider starts", "start of the sliders", "spread")
            for g in with_content(arrays, SPREAD)
        ),
        *(
            _again(g, "Harmonics kept", "highest harmonic", "harmonics")
            for g in with_content(arrays, HARMONICS)
        ),
    ]


def _marked(curve: _Curve) -> list[_At]:
    """The peaks of a curve; older files do not tell their modes."""
    numbers, index = curve.data("peak"), curve.data("peak_index")
    told = str(curve.group["peak"].attributes.get("modes", ""))
    modes = told.split(", ") if told else [""] * len(numbers)
    return [
        _At(curve, int(number), int(i), mode)
        for number, i, mode in zip(numbers, index, modes, strict=True)
    ]


def _left_to_balance(curves: Sequence[_Curve], peaks: Sequence[_At]) -> list[_At]:
    """The peaks of the balance that the sweeps tell alike; no highest point without a peak where
    the sweeps have peaks.
    """
    told = {(*one.curve.told, one.number) for one in peaks}
    told |= {(*one.curve.told, 0) for one in peaks}
    return [
        one
        for c in curves
        if "peak" in c.group
        for one in _marked(c)
        if (*c.told, one.number) not in told
    ]


def _frequency(group: Group) -> Array:
    return np.asarray(group["frequency"].data, float)


def _responses(arrays: Arrays, curves: Sequence[_Curve]) -> list[Chart]:
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
        f = _frequency(linear)
        x = Axis("frequency", "Hz", low=float(f[0]), high=float(f[-1]))
        damping = scalar(linear, "damping")
        detail = f"damping {100.0 * damping:g} %" if damping is not None else ""
        excited = str(linear["frequency"].attributes.get("excitation", ""))
        detail = ", ".join(part for part in (excited, detail) if part)
        mine = [c for c in curves if c.case.stiffness == name]
        colours = {c.case.force_ratio: c.colour for c in mine}
        for blade in _BLADES:
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
                    _frequency(group),
                    np.asarray(group[f"lowest_{blade}"].data, float),
                    np.asarray(group[f"highest_{blade}"].data, float),
                    c.colour,
                )
                for group in with_content(arrays, BAND)
                for c in mine
                if c.case == case_of(group) and np.nanmax(group[f"lowest_{blade}"].data) > 0.0
            )
            traces = tuple(trace for trace, _ in found)
            marks = tuple(mark for _, some in found for mark in some)
            y, case = Axis("accelerance", _PER_N, log=True), f"{blade} blade, stiffness {name}"
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
                    **_SHEET,
                )
            )
    return out


def _more_harmonics(arrays: Arrays, curves: Sequence[_Curve]) -> list[Chart]:
    """Both blades in the harmonics that are excited beside the one that is read."""
    colours = {c.case.force_ratio: c.colour for c in curves}
    groups = [c.group for c in curves] + with_content(arrays, SWEEP)
    found: dict[tuple[str, str, str], list[Trace]] = {}
    for group in groups:
        case = case_of(group)
        for blade in _BLADES:
            begins = f"accelerance_{blade}_harmonic_"
            for name in (key for key in group if key.startswith(begins)):
                label = replace(case, stiffness="").label
                colour = colours.get(case.force_ratio, 0)
                trace = Trace(label, _frequency(group), magnitude(group[name]), "line", colour)
                at = (str(case.stiffness), blade, name.removeprefix(begins))
                found.setdefault(at, []).append(trace)
    return [
        Chart(
            f"Frequency response, harmonic {k}",
            Axis("frequency of the first harmonic", "Hz"),
            Axis("accelerance", _PER_N, log=True),
            tuple(traces),
            case=f"{blade} blade, stiffness {name}",
            figure="response_harmonics",
            **_SHEET,
        )
        for (name, blade, k), traces in found.items()
    ]


def _sweep(
    group: Group, blade: str, colours: Mapping[float | None, int]
) -> list[tuple[Trace, list[Mark]]]:
    """The steady motions of a sweep, and where they jump to another: words beside the point before,
    an arrow the way the sweep goes.
    """
    case, f, H = case_of(group), _frequency(group), magnitude(group[f"accelerance_{blade}"])
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
    f = _frequency(group)
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
        label, _frequency(group), np.where(H > 0.0, H, np.nan), style, colour, closed=closed
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


def _shares(curve: _Curve, k: int) -> Chart:
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
            for at in np.linspace(0, len(f) - 1, _PATH_TICKS)
        )
        axis = Axis("frequency along the path", "Hz", low=low, high=high, ticks=ticks)
    areas = tuple(
        Area(state, x, top[:, j] - share[:, j], top[:, j], j, state)
        for j, state in enumerate(_SHARES)
    )
    y, case = Axis("share of the cycle", "%", low=0.0, high=100.0), f"{curve.case}, {SIDES[k]} face"
    return Chart("Contact state", axis, y, areas=areas, case=case, figure="contact_state", **_SHEET)


def _map(at: _At, points: Group, k: int) -> Chart:
    """Contact points of one face at a peak.

    Sectors of stick, slip and lift-off, size by the friction loss.
    """
    on, energy = np.asarray(points["face"].data) == k, at.curve.data("energy")[at.index]
    # Of all points, so that rounding on a face that sticks does not show.
    most = float(energy.max())
    size = np.maximum(energy[on], 0.0) / most if most > 0.0 else np.zeros(int(on.sum()))
    y, up = (np.asarray(points[name].data)[on] for name in ("along", "up"))
    pies = Pies(y, up, at.curve.data("state")[at.index][on], size, _SHARES, "friction loss")
    axes = (Axis("along the damper y", "mm"), Axis("up the slope", "mm"))
    case = f"{at.case}, {SIDES[k]} face"
    return Chart(
        "Contact points at the peak",
        *axes,
        pies=(pies,),
        case=case,
        figure="contact_map",
        detail=at.detail,
        **_SHEET,
    )


def _loops(at: _At) -> Chart:
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
        **_SHEET,
    )


def _loss(curves: Sequence[_Curve]) -> Chart:
    traces = tuple(
        Trace(c.case.label, c.frequency, 1e3 * c.data("power").sum(axis=1), "line", k)
        for k, c in enumerate(curves)
    )
    return Chart("Friction loss", _HZ, Axis("power of all contact points", "mW"), traces)


def _motion(curve: _Curve, kind: int) -> Chart:
    """The damper's degrees of freedom over frequency: amplitudes of the first harmonic."""
    name, unit, scale, first, names = _MOTIONS[kind]
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
        _HZ,
        y,
        traces,
        case=curve.case.label,
        figure="damper_motion",
        **_SHEET,
    )


def _turn(at: _At, kind: int) -> Chart:
    """The damper's degrees of freedom over a period at a peak, about their means."""
    name, unit, scale, first, names = _MOTIONS[kind]
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
        **_SHEET,
    )


def _performance(arrays: Arrays) -> list[Chart]:
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
        axes = (Axis("F_C/F_E", log=True), Axis("peak accelerance", _PER_N, log=True))
        out.append(
            Chart(
                "Performance",
                *axes,
                tuple(traces),
                case=f"right blade, stiffness {name}",
                figure="performance",
                **_SHEET,
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


def _again(group: Group, title: str, axis: str, figure: str) -> Chart:
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
        title, x, _PEAK, traces, case=case_of(group).label, figure=figure, marks=marks, **_SHEET
    )
