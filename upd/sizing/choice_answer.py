"""A chosen damper as an answer: verdict, tables, notes, and charts of worst peaks over F_C, of
peaks over F_C/F_E, and over what else is chosen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upd.plot.chart import Axis, Band, Chart, Mark, Trace
from upd.report.answer_folder import FigureAnswer
from upd.results.answer_table import AnswerTable, Rounded
from upd.scene.rotation import damper_mass
from upd.sizing.choice import GROWTHS, UNITS_OF, ChosenDamper, Sensitivity, sensitivities
from upd.sizing.worst_peak import WorstPeak

Array = NDArray[np.float64]
#: points of a curve
_CURVE = 301
_SIZE = (6.4, 4.8)


@dataclass(frozen=True, repr=False)
class BestDamper(FigureAnswer):
    """What `upd.design(..., minimise=...)` found.

    Attributes
    ----------
    found : ChosenDamper
        Its numbers.
    """

    found: ChosenDamper
    figure = "choice"

    @property
    def outcome(self) -> tuple[str, str]:
        """Whether the optimum lies within its bounds and what is known."""
        status = self.found.best.best.status
        return status.capitalize(), "passed" if status == "found" else "warning"

    @property
    def verdict(self) -> str:
        """One sentence: the optimum and its worst peak."""
        found = self.found
        place = ", ".join(
            f"{one.path} {one.of.shown(one.value)}{f' (its {one.bound} bound)' * bool(one.bound)}"
            for one in _chosen(found)
        )
        worst = f"{found.worst:.4g} {UNITS_OF[found.objective]}"
        return f"{found.ranges.scene.name}: worst peak {worst} at {place}"

    @property
    def tables(self) -> tuple[AnswerTable, ...]:
        """Both optima, what decides, and how far parameters may move."""
        found = self.found
        unit, best = UNITS_OF[found.objective], found.best.best
        shapes = found.ranges.shapes
        robust = ("over the ranges", found.centrifugal, found.best.values)
        nominal = ("the scene's values", found.nominal_centrifugal, found.plain.values)
        heights = (
            (_height(found.worst), _height(found.robust_at_nominal)),
            (_height(found.nominal_at_worst), _height(found.nominal_peak)),
        )
        optima = tuple(
            (name, Rounded(F), *(of.cell(v) for of, v in zip(shapes, values, strict=True)), *both)
            for (name, F, values), both in zip((robust, nominal), heights, strict=True)
        )
        deciding = tuple(
            (
                p.name,
                Rounded(math.exp(best.log_centrifugal - p.s)),
                Rounded(math.exp(p.s)),
                Rounded(p.frequency, ".2f"),
                Rounded(math.exp(p.y)),
            )
            for p in best.deciding
        )
        moved = tuple(
            (
                one.path,
                one.of.cell(one.value),
                _slopes(one),
                *(_span(one, ends) for ends in one.within),
            )
            for one in sensitivities(found)
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
        found = self.found
        e = found.ranges.scene.excitation
        counted = ", ".join(
            f"{one.path} {one.shown(one.low)} to {one.shown(one.high)}"
            for one in found.ranges.during
        )
        per = " per N of F_E" if found.objective == "peak" else ""
        kept = f", {found.resumed} kept of earlier calls" if found.resumed else ""
        return (
            f"Right blade, {UNITS_OF['acceleration']}{per}, {e.start:g} to {e.stop:g} Hz, "
            f"stiffness {found.stiffness}{', over ' * bool(counted)}{counted}; {_mass(found)}.",
            *warnings(found),
            f"{found.curves} whole curves by harmonic balance{kept}: {found.seconds:.1f} s.",
        )

    @property
    def charts(self) -> list[Chart]:
        """Worst peaks over F_C with the optimum, all peaks over F_C/F_E with the points solved, and
        the least worst peak over what else is chosen.
        """
        found = self.found
        charts = [_over_centrifugal(found), _over_ratio(found)]
        charts += [_over_shape(found, k) for k in range(len(found.ranges.shapes))]
        return [replace(one, figure=self.figure, size=_SIZE, columns=len(charts)) for one in charts]


def _chosen(found: ChosenDamper) -> list[Sensitivity]:
    """The sensitivities of what was chosen."""
    paths = [one.path for one in found.ranges.over]
    return [one for one in sensitivities(found) if one.path in paths]


def _height(value: float) -> str:
    return Rounded(value) if math.isfinite(value) else "not known"


def _slopes(one: Sensitivity) -> str:
    """d ln(peak)/d ln(parameter), below and above where they differ."""
    same = math.isclose(one.below, one.above, abs_tol=5e-3) or not math.isfinite(one.above)
    return " / ".join(map(_signed, (one.below,) if same else (one.below, one.above)))


def _signed(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    return f"{value:+.2f}" if abs(value) >= 5e-3 else "0"


def _span(one: Sensitivity, ends: tuple[float, float]) -> str:
    """Between which values the worst peak grows no further."""
    low, high = (one.of.shown(end) if math.isfinite(end) else "" for end in ends)
    if low and high:
        return f"{low.split()[0]} to {high}"
    return f"from {low}" if low else f"to {high}" if high else "-"


def _mass(found: ChosenDamper) -> str:
    """The mass that gives F_C at the scene's radius and speed, or the mesh's."""
    damper, own = found.ranges.scene.damper, damper_mass(found.ranges.scene)
    if damper.radius is not None and damper.speed is not None:
        mass = found.centrifugal / (damper.radius * damper.speed**2)
        moved = next((one for one in found.ranges.over if one.path.startswith("damper.")), None)
        if moved is None or moved.path == "damper.mass":
            return f"F_C = m r w^2 of {1e6 * mass:.4g} g"
    return "mass not known" if own is None else f"damper of {1e6 * own:.4g} g as meshed"


def warnings(found: ChosenDamper) -> list[str]:
    """What limits the answer."""
    out = [f"Not solved: {why}." for why in found.refused]
    if lost := found.best.worst.missed:
        out.append(f"Not known beside F_C/F_E {lost}: no whole curve reaches its end there.")
    return out


# -- charts ---------------------------------------------------------------------------------------


def _curve(worst: WorstPeak, low: float, high: float) -> tuple[Array, Array]:
    """F_C [N] from end to end and heights, nan where they are not known."""
    c, y = worst.over(math.log(low), math.log(high))
    every = slice(None, None, max(1, len(c) // _CURVE))
    return np.exp(c[every]), np.exp(y[every])


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
        Axis("worst peak", UNITS_OF[found.objective], log=True),
        traces=(
            Trace("over the ranges", shown(F), robust, "line", 0),
            Trace("the scene's own values", shown(G), plain, "dashed", 1),
            Trace("robust optimum", at[:1], np.array([found.worst]), "star", 0, outline=True),
            Trace("nominal optimum", at[1:], np.array([found.nominal_peak]), "star", 1),
        ),
        note="Between whole curves splines of their peaks.",
    )


def _over_ratio(found: ChosenDamper) -> Chart:
    """Every peak of the rigs of the optimum, as whole curves have it."""
    best = found.best
    traces: list[Trace] = []
    for w, rig in best.rigs:
        word = "".join(f", {of.shown(v)}" for of, v in zip(found.ranges.unsure, w, strict=True))
        points = {s: peaks for s, peaks in rig.peaks.points.items() if peaks}
        for name in dict.fromkeys(name for peaks in points.values() for name in peaks):
            solved = sorted((s, p[name][1]) for s, p in points.items() if name in p)
            x, y = np.exp(np.array(solved)).T
            traces.append(Trace(f"{name}{word}", x, y, "both", len(traces)))
    c, f = best.best.log_centrifugal, best.worst.f
    marks = tuple(
        Mark(math.exp(p.s), math.exp(p.y), f"F_E {math.exp(c - p.s):.3g} N", 0)
        for p in best.best.deciding
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


def _over_shape(found: ChosenDamper, k: int) -> Chart:
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
