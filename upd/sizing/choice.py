"""What a choice of damper found: its optimum over the ranges, the nominal one, how both were found,
what moves them, and how far F_C, F_E and other parameters may move until the worst peak has grown
by so much, on whole curves that were solved there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from upd.plot.answer_table import AnswerTable, Rounded
from upd.plot.chart import Axis, Band, Chart, Mark, Trace
from upd.report.answer import FigureAnswer
from upd.scene.rotation import damper_mass
from upd.sizing.ranges import FORCE, TURNING, InputRange, Ranges
from upd.sizing.worst_peak import SLOPE_STEP, LowestWorst, PeaksOver, WorstPeak, reached

Array = NDArray[np.float64]
#: what is minimised: peaks per newton of F_E, accelerations
Objective = Literal["peak", "acceleration"]
UNITS_OF: dict[Objective, str] = {"peak": "(m/s2)/N", "acceleration": "m/s2"}
#: growths of the worst peak up to which parameters may move
GROWTHS = (1.05, 1.10)
#: beyond a range of F_E up to which its ends may move, as ln F_E
REACH = 3.0
#: points between which curves are searched
_FINE = 801
#: share of a value within which it lies at a bound
_AT_BOUND = 5e-4
#: points of a curve
_CURVE = 301
_SIZE = (6.4, 4.8)
_UNKNOWN_BESIDE = "Not known beside F_C/F_E {}: no whole curve reaches its end there."
#: of a range of F_E
_ENDS = ("lowest", "highest")
#: at which bound F_C is
_BOUNDS = {"at the lower bound": "lower", "at the upper bound": "upper"}
#: values below and above, nan where they are not known
Span = tuple[float, float]
_UNKNOWN: Span = (math.nan, math.nan)


@dataclass(frozen=True)
class Tried:
    """One place of what is chosen beside F_C.

    Attributes
    ----------
    values : tuple of float
        In the units inside; empty where nothing else is chosen.
    rigs : tuple of (tuple of float, PeaksOver)
        Values of the uncertain inputs -> their rig.
    worst, best : WorstPeak, LowestWorst
        Worst peaks over all ranges, and where they are least.
    plain, nominal : WorstPeak, LowestWorst
        The same of the scene's own values.
    ends : (float, float)
        F_C [N] between which it is sought.
    """

    values: tuple[float, ...]
    rigs: tuple[tuple[tuple[float, ...], PeaksOver], ...]
    worst: WorstPeak
    best: LowestWorst
    plain: WorstPeak
    nominal: LowestWorst
    ends: tuple[float, float]


def best_of(tried: Iterable[Tried]) -> Tried:
    """The robust optimum."""
    return min(tried, key=lambda one: one.best.log_worst)


def curves_of(tried: Iterable[Tried]) -> int:
    """Whole curves that were solved for them in this call."""
    return sum(rig.solved for one in tried for _, rig in one.rigs)


def is_along(values: Sequence[float], others: Sequence[float], k: int) -> bool:
    """Whether values are the same but for one of them.

    Parameters
    ----------
    values, others
        Of the same inputs.
    k
        Number of that one.
    """
    return all(
        math.isclose(a, b) for i, (a, b) in enumerate(zip(values, others, strict=True)) if i != k
    )


@dataclass(frozen=True, repr=False)
class BestDamper(FigureAnswer):
    """What `upd.design(..., minimise=...)` found: the damper with the lowest worst peak.

    Attributes
    ----------
    ranges : Ranges
        As asked for.
    objective : {"peak", "acceleration"}
        What is least.
    stiffness : str
        Name of the contact stiffness.
    tried : tuple of Tried
        All places of what is chosen beside F_C, in their order.
    best, plain : Tried
        Of them the robust optimum, and the nominal one.
    refused : tuple of str
        Values that were not solved, with the reason.
    seconds : float
        Of this call.
    reaches : mapping
        Name of a parameter -> how far it may move down and up from the robust optimum, for each of
        `GROWTHS`: what sets F_C [N], and the ends of the range of F_E [N].
    robust_at_nominal : float
        Peak of the robust optimum with the scene's own values; nan where it is not known.
    nominal_at_worst : float
        Worst peak of the nominal optimum over all ranges; nan where it is not known.
    curves, resumed : int
        Whole curves that were solved in this call; points kept of earlier ones.
    """

    ranges: Ranges
    objective: Objective
    stiffness: str
    tried: tuple[Tried, ...]
    best: Tried
    plain: Tried
    refused: tuple[str, ...]
    seconds: float
    reaches: Mapping[str, tuple[Span, ...]]
    robust_at_nominal: float
    nominal_at_worst: float
    curves: int
    resumed: int
    figure = "choice"

    def along(self, k: int) -> list[tuple[float, Tried]]:
        """Values of one of the inputs chosen beside F_C and what was tried there, all others as at
        the robust optimum, rising.

        Parameters
        ----------
        k
            Its number among them.
        """
        found = [(t.values[k], t) for t in self.tried if is_along(t.values, self.best.values, k)]
        return sorted(found, key=lambda pair: pair[0])

    @property
    def centrifugal(self) -> float:
        """F_C of the robust optimum [N]."""
        return math.exp(self.best.best.log_centrifugal)

    @property
    def worst(self) -> float:
        """Its worst peak."""
        return math.exp(self.best.best.log_worst)

    @property
    def outcome(self) -> tuple[str, str]:
        """Whether the optimum lies within its bounds and what is known."""
        status = self.best.best.status
        return status.capitalize(), "passed" if status == "found" else "warning"

    @property
    def verdict(self) -> str:
        """One sentence: the optimum and its worst peak."""
        chosen = [one.path for one in self.ranges.over]
        place = ", ".join(
            f"{one.path} {one.of.shown(one.value)}{f' (its {one.bound} bound)' * bool(one.bound)}"
            for one in sensitivities(self)
            if one.path in chosen
        )
        worst = f"{self.worst:.4g} {UNITS_OF[self.objective]}"
        return f"{self.ranges.scene.name}: worst peak {worst} at {place}"

    @property
    def tables(self) -> tuple[AnswerTable, ...]:
        """Both optima, what decides, and how far parameters may move."""
        unit, best = UNITS_OF[self.objective], self.best.best
        shapes = self.ranges.shapes
        robust = ("over the ranges", self.centrifugal, self.best.values)
        plain, F = self.plain.nominal, math.exp(self.plain.nominal.log_centrifugal)
        nominal = ("the scene's values", F, self.plain.values)
        heights = (
            (_height(self.worst), _height(self.robust_at_nominal)),
            (_height(self.nominal_at_worst), _height(math.exp(plain.log_worst))),
        )
        optima = tuple(
            (name, Rounded(F), *(of.cell(v) for of, v in zip(shapes, values, strict=True)), *both)
            for (name, F, values), both in zip((robust, nominal), heights, strict=True)
        )
        deciding = tuple(
            (
                name,
                Rounded(math.exp(best.log_centrifugal - s)),
                Rounded(math.exp(s)),
                Rounded(frequency, ".2f"),
                Rounded(math.exp(y)),
            )
            for s, y, name, frequency in best.deciding
        )
        moved = tuple(
            (
                one.path,
                one.of.cell(one.value),
                _slopes(one),
                *(_within(one, ends) for ends in one.within),
            )
            for one in sensitivities(self)
        )
        heads = ("best for", "#F_C, N", *(f"#{of.path}" for of in shapes))
        within = tuple(f"+{100.0 * (g - 1.0):.0f} % within" for g in GROWTHS)
        return (
            AnswerTable(
                f"Worst peak, {unit}", (*heads, "#over the ranges", "#the scene's values"), optima
            ),
            AnswerTable(
                "What decides",
                ("peak", "#F_E, N", "#F_C/F_E", "#Hz", f"#height, {UNITS_OF['peak']}"),
                deciding,
            ),
            AnswerTable(
                "How far parameters may move",
                ("parameter", "#value", "#slope", *within),
                moved,
                "Slope: d ln(peak) / d ln(parameter), below and above the optimum where both "
                "differ, all else as it is. Within: the worst peak stays below so many per cent "
                "more, by whole curves.",
            ),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What was asked, what limits the answer, and the cost."""
        e = self.ranges.scene.excitation
        counted = ", ".join(
            f"{one.path} {one.shown(one.low)} to {one.shown(one.high)}"
            for one in self.ranges.during
        )
        per = " per N of F_E" if self.objective == "peak" else ""
        kept = f", {self.resumed} kept of earlier calls" if self.resumed else ""
        lost = self.best.worst.missed
        return (
            f"Right blade, {UNITS_OF['acceleration']}{per}, {e.start:g} to {e.stop:g} Hz, "
            f"stiffness {self.stiffness}{', over ' * bool(counted)}{counted}; {_mass(self)}.",
            *(f"Not solved: {why}." for why in self.refused),
            *([_UNKNOWN_BESIDE.format(lost)] if lost else []),
            f"{self.curves} whole curves by harmonic balance{kept}: {self.seconds:.1f} s.",
        )

    @property
    def charts(self) -> list[Chart]:
        """Worst peaks over F_C with the optimum, all peaks over F_C/F_E with the points solved, and
        the least worst peak over what else is chosen.
        """
        charts = [_over_centrifugal(self), _over_ratio(self)]
        charts += [_over_shape(self, k) for k in range(len(self.ranges.shapes))]
        return [replace(one, figure=self.figure, size=_SIZE, columns=len(charts)) for one in charts]


# -- how far the optimum reaches -------------------------------------------------------------------


def reaches_of(one: Tried, ranges: Ranges) -> dict[str, tuple[Span, ...]]:
    """How far F_C and the ends of the range of F_E may move from the robust optimum until the worst
    peak has grown, for each of `GROWTHS`; nan where it does not grow so far within what is known.

    Parameters
    ----------
    one
        The optimum.
    ranges
        Chosen, and counted over.
    """
    worst, c, nan = one.worst, one.best.log_centrifugal, math.nan
    limits = [one.best.log_worst + math.log(growth) for growth in GROWTHS]
    found: dict[str, list[Sequence[float]]] = {}
    if ranges.pressing is not None:
        ends = [math.log(end) for end in one.ends]
        found[ranges.pressing.path] = [
            [reached(lambda at: (worst, at), c, end, limit) for end in ends] for limit in limits
        ]
    low, high = worst.f
    for of in ranges.during:
        if of.path == FORCE:
            lower, upper = (f"{of.path}, {word}" for word in _ENDS)
            begin, end = low - REACH, high + REACH
            found[lower] = [
                (reached(lambda at: (worst.with_forces(at, high), c), low, begin, limit), nan)
                for limit in limits
            ]
            found[upper] = [
                (nan, reached(lambda at: (worst.with_forces(low, at), c), high, end, limit))
                for limit in limits
            ]
    return {
        path: tuple((math.exp(low), math.exp(high)) for low, high in spans)
        for path, spans in found.items()
    }


# -- what moves it ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sensitivity:
    """Of the worst peak by one parameter, all others at the optimum.

    Attributes
    ----------
    path : str
        Of the parameter; an end of a range has a word behind it.
    value : float
        At the optimum, in the unit inside.
    below, above : float
        d ln(peak) / d ln(parameter) towards lower and higher values; nan where it is not known.
    within : tuple of (float, float)
        Between which the worst peak grows by less than 5 % and 10 %; nan where it does not within
        what is known.
    bound : str
        "lower" or "upper" where it sits at a bound of its range.
    of : InputRange
        The parameter.
    """

    path: str
    value: float
    below: float
    above: float
    within: tuple[tuple[float, float], ...]
    bound: str
    of: InputRange


def sensitivities(found: BestDamper) -> list[Sensitivity]:
    """Of every parameter chosen or counted over.

    Parameters
    ----------
    found : BestDamper
        The optimum.
    """
    out = []
    shapes = found.ranges.shapes
    for one in found.ranges.over:
        out.append(
            _pressing(found, one) if one.only_centrifugal else _shape(found, one, shapes.index(one))
        )
    for one in found.ranges.during:
        out += _forces(found, one) if one.path == FORCE else [_unsure(found, one)]
    return out


def _pressing(found: BestDamper, one: InputRange) -> Sensitivity:
    best, scene = found.best, found.ranges.scene
    power = TURNING.get(one.path, 1.0)
    c, read = best.best.log_centrifugal, best.worst.read
    within = [
        (one.value_at(low, scene), one.value_at(high, scene))
        for low, high in found.reaches[one.path]
    ]
    return Sensitivity(
        one.path,
        one.value_at(found.centrifugal, scene),
        power * (read(c) - read(c - SLOPE_STEP)) / SLOPE_STEP,
        power * (read(c + SLOPE_STEP) - read(c)) / SLOPE_STEP,
        tuple(within),
        _BOUNDS.get(best.best.status, ""),
        one,
    )


def _shape(found: BestDamper, one: InputRange, k: int) -> Sensitivity:
    """From the values that were tried, all else as at the optimum."""
    line = found.along(k)
    x = np.array([value for value, _ in line])
    y = np.array([tried.best.log_worst for _, tried in line])
    value = found.best.values[k]
    at_low, at_high = (abs(value - end) <= _AT_BOUND * value for end in (one.low, one.high))
    i = int(np.abs(x - value).argmin())

    def end(way: int, growth: float) -> float:
        grid = np.linspace(value, x[way], _FINE)
        over = np.flatnonzero(PchipInterpolator(x, y)(grid) > y[i] + math.log(growth))
        return float(grid[over[0]]) if over.size else math.nan

    whole = len(x) > 1
    within = tuple((end(0, g), end(-1, g)) if whole else _UNKNOWN for g in GROWTHS)
    bound = "lower" if at_low else "upper" if at_high else ""
    return Sensitivity(one.path, value, *_beside(x, y, i), within, bound, one)


def _beside(x: Array, y: Array, i: int) -> tuple[float, float]:
    """Differences dy / d ln x to the neighbours of a place below and above; nan without one."""
    slope = np.diff(y) / np.diff(np.log(x))
    return (
        float(slope[i - 1]) if i > 0 else math.nan,
        float(slope[i]) if i < len(slope) else math.nan,
    )


def _forces(found: BestDamper, one: InputRange) -> list[Sensitivity]:
    """Of both ends of the range of F_E, F_C as chosen."""
    worst, c = found.best.worst, found.best.best.log_centrifugal
    out = []
    for k, (word, end) in enumerate(zip(_ENDS, (one.low, one.high), strict=True)):
        y = []
        for step in (-SLOPE_STEP, 0.0, SLOPE_STEP):
            moved = [f + step * (i == k) for i, f in enumerate(worst.f)]
            y.append(worst.with_forces(*moved).read(c))
        below, above = np.diff(y) / SLOPE_STEP
        name = f"{one.path}, {word}"
        out.append(Sensitivity(name, end, below, above, found.reaches[name], "", one))
    return out


def _unsure(found: BestDamper, one: InputRange) -> Sensitivity:
    """From the values that were solved, all others as at the worst."""
    best, ranges = found.best, found.ranges
    k = ranges.unsure.index(one)
    c, weight = best.best.log_centrifugal, best.worst.weight
    heights = {w: WorstPeak([rig], ranges.forces, weight).read(c) for w, rig in best.rigs}
    worst = max(heights, key=lambda w: heights[w])
    line = sorted((w[k], y) for w, y in heights.items() if is_along(w, worst, k))
    values, y = np.array(line).T
    top = int(y.argmax())
    bound = "lower" if top == 0 else "upper" if top == len(values) - 1 else ""
    slopes = _beside(values, y, top)
    name = f"{one.path}, worst"
    return Sensitivity(name, worst[k], *slopes, (_UNKNOWN, _UNKNOWN), bound, one)


# -- the answer ------------------------------------------------------------------------------------


def _height(value: float) -> str:
    return Rounded(value) if math.isfinite(value) else "not known"


def _slopes(one: Sensitivity) -> str:
    """d ln(peak)/d ln(parameter), below and above where they differ."""
    same = math.isclose(one.below, one.above, abs_tol=5e-3) or not math.isfinite(one.above)
    texts = []
    for value in (one.below,) if same else (one.below, one.above):
        signed = f"{value:+.2f}" if abs(value) >= 5e-3 else "0"
        texts.append(signed if math.isfinite(value) else "-")
    return " / ".join(texts)


def _within(one: Sensitivity, ends: tuple[float, float]) -> str:
    """Between which values the worst peak grows no further."""
    low, high = (one.of.shown(end) if math.isfinite(end) else "" for end in ends)
    if low and high:
        return f"{low.split()[0]} to {high}"
    return f"from {low}" if low else f"to {high}" if high else "-"


def _mass(found: BestDamper) -> str:
    """The mass that gives F_C at the scene's radius and speed, or the mesh's."""
    damper, own = found.ranges.scene.damper, damper_mass(found.ranges.scene)
    if damper.radius is not None and damper.speed is not None:
        mass = found.centrifugal / (damper.radius * damper.speed**2)
        moved = next((one for one in found.ranges.over if one.path.startswith("damper.")), None)
        if moved is None or moved.path == "damper.mass":
            return f"F_C = m r w^2 of {1e6 * mass:.4g} g"
    return "mass not known" if own is None else f"damper of {1e6 * own:.4g} g as meshed"


# -- charts ---------------------------------------------------------------------------------------


def _curve(worst: WorstPeak, low: float, high: float) -> tuple[Array, Array]:
    """F_C [N] from end to end and heights, nan where they are not known."""
    c, y = worst.over(math.log(low), math.log(high))
    every = slice(None, None, max(1, len(c) // _CURVE))
    return np.exp(c[every]), np.exp(y[every])


def _over_centrifugal(found: BestDamper) -> Chart:
    best, press = found.best, found.ranges.pressing
    low, high = best.ends
    scene = found.ranges.scene
    if low == high:
        low, high = low / 2.0, high * 2.0

    def shown(F: Array) -> Array:
        return np.array([F_C if press is None else press.value_at(F_C, scene) for F_C in F])

    (F, robust), (G, plain) = (_curve(w, low, high) for w in (best.worst, found.plain.plain))
    solved = np.array([found.centrifugal, math.exp(found.plain.nominal.log_centrifugal)])
    peaks = np.exp([best.best.log_worst, found.plain.nominal.log_worst])
    at = shown(solved)
    name = "F_C" if press is None or press.path.endswith("centrifugal") else press.path
    return Chart(
        f"{scene.name}: worst peak",
        Axis(name, "N" if press is None else press.unit, log=True),
        Axis("worst peak", UNITS_OF[found.objective], log=True),
        traces=(
            Trace("over the ranges", shown(F), robust, "line", 0),
            Trace("the scene's own values", shown(G), plain, "dashed", 1),
            Trace("robust optimum", at[:1], peaks[:1], "star", 0, outline=True),
            Trace("nominal optimum", at[1:], peaks[1:], "star", 1),
        ),
        note="Between whole curves splines of their peaks.",
    )


def _over_ratio(found: BestDamper) -> Chart:
    """Every peak of the rigs of the optimum, as whole curves have it."""
    best = found.best
    traces: list[Trace] = []
    for w, rig in best.rigs:
        word = "".join(f", {of.shown(v)}" for of, v in zip(found.ranges.unsure, w, strict=True))
        points = {s: peaks for s, peaks in rig.points.items() if peaks}
        for name in dict.fromkeys(name for peaks in points.values() for name in peaks):
            solved = sorted((s, p[name][1]) for s, p in points.items() if name in p)
            x, y = np.exp(np.array(solved)).T
            traces.append(Trace(f"{name}{word}", x, y, "both", len(traces)))
    c, f = best.best.log_centrifugal, best.worst.f
    marks = tuple(
        Mark(math.exp(s), math.exp(y), f"F_E {math.exp(c - s):.3g} N", 0)
        for s, y, *_ in best.best.deciding
    )
    return Chart(
        "Peaks over F_C/F_E",
        Axis("F_C/F_E", log=True),
        Axis("peak accelerance", UNITS_OF["peak"], log=True),
        traces=tuple(traces),
        marks=marks,
        bands=(Band("F_E of the optimum", "x", math.exp(c - f[1]), math.exp(c - f[0])),),
        note="Scaling F_C and F_E alike changes nothing: one curve serves all pairs of forces.",
    )


def _over_shape(found: BestDamper, k: int) -> Chart:
    shape = found.ranges.shapes[k]
    x, tried = (np.array(column) for column in zip(*found.along(k), strict=True))
    robust = np.exp([one.best.log_worst for one in tried])
    plain = np.exp([one.nominal.log_worst for one in tried])
    return Chart(
        f"Least worst peak over {shape.path}",
        Axis(shape.path, shape.unit),
        Axis("worst peak at its best F_C", UNITS_OF[found.objective], log=True),
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
