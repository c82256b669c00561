"""What a fit found and what is known of it, as verdict, tables, notes and charts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upd.errors import InputError
from upd.fitting.residuals import SHOWN, FittedCurve, Further, Knowledge, Start, is_bent
from upd.fitting.targets import FitTarget, VariedInput, fitted_scene
from upd.plot.answer_table import AnswerTable, Rounded
from upd.plot.chart import Axis, Band, Chart, Trace
from upd.report.answer import FigureAnswer
from upd.scene import ForcedScene

Array = NDArray[np.float64]
Status = Literal["found", "several", "family", "not reached"]
#: word and kind of every way a fit ends
_OUTCOMES = {
    "found": ("Found", "passed"),
    "several": ("Several", "warning"),
    "family": ("A family", "warning"),
    "not reached": ("Not reached", "failed"),
}
#: growth of the input that moves most along a direction that is printed
_GROWTH = 1.1
#: relative error of targets without half-widths, for how far the inputs move
_OFF = 1e-3
#: further measurements that are printed, and what they leave of the widest direction's half-width
#: at most
_FURTHER, _GAIN = 6, 0.9
#: sets of inputs that are printed
_MEMBERS = 5
_SIZE = (6.4, 4.6)
#: reach of the tangents in ln(factor)
_REACH = 0.05


@dataclass(frozen=True, repr=False)
class Fit(FigureAnswer):
    """What `upd.fit` found.

    Attributes
    ----------
    source : ForcedScene
        The scene that was varied.
    stiffness : str
        Name of the contact stiffness that the numbers are of.
    targets : tuple of FitTarget
        Numbers that were to come out.
    measured : tuple of FittedCurve
        Measured curves that were, with what came out.
    parameters : tuple of VariedInput
        What was varied.
    status : str
        "found"; "several": answers apart from each other; "family": the targets leave a direction
        of the parameters unknown; "not reached": the nearest.
    answers : list of ndarray
        (n,) ln(factor) of every answer, the one nearest to the scene first; of a family, some of
        its members.
    numbers : ndarray
        (m,) of the first answer, in the units of the targets that are numbers.
    slopes : ndarray
        (m, n) their derivatives by ln(factor).
    known : Knowledge
        What the targets tell, to first order.
    ends : ndarray
        (n, 2) ln(factor) between which sets of inputs fit as well, the others fitted; nan where
        these were not sought.
    widest : float
        Half-width of the widest direction, as a factor of the inputs.
    further : tuple of (FitTarget, float, float)
        What measurements that were not made would tell, the most telling first: the number with the
        half-width that is assumed, half of what the inputs leave it, and the widest then.
    starts : list of Start
        Where every start ended, the best first.
    directions : str
        contact.directions that the fitted scene has to name; "" where its own word does.
    evaluations : int
        Solved models.
    seconds : float
        Of the fit.
    """

    source: ForcedScene
    stiffness: str
    targets: tuple[FitTarget, ...]
    measured: tuple[FittedCurve, ...]
    parameters: tuple[VariedInput, ...]
    status: Status
    answers: list[Array]
    numbers: Array
    slopes: Array
    known: Knowledge
    ends: Array
    widest: float
    further: tuple[Further, ...]
    starts: list[Start]
    directions: str
    evaluations: int
    seconds: float

    @property
    def widths(self) -> bool:
        """Whether targets have half-widths: then there are intervals."""
        return bool(self.measured) or self.targets[0].half_width is not None

    figure = "fit"

    def value(self, path: str) -> float:
        """What the first answer has for an input, in the unit inside.

        Raises
        ------
        InputError
            For an input that was not varied.
        """
        for one, z in zip(self.parameters, self.answers[0], strict=True):
            if path in one.paths:
                return float(one.values[one.paths.index(path)] * np.exp(z))
        known = ", ".join(path for one in self.parameters for path in one.paths)
        raise InputError(f"{path}: was not varied; known here: {known}")

    @cached_property
    def scene(self) -> ForcedScene:
        """The scene with the first answer's values."""
        more = {"contact.directions": self.directions} if self.directions else {}
        name = f"{self.source.name}-fitted"
        return fitted_scene(self.source, self.parameters, self.answers[0], name=name, **more)

    @property
    def outcome(self) -> tuple[str, str]:
        """How the fit ended."""
        return _OUTCOMES[self.status]

    @property
    def verdict(self) -> str:
        """One sentence: whether the targets are met, and whether by one set of inputs."""
        name, count = self.source.name, len(self.targets) + len(self.measured)
        targets = {1: "the target", 2: "both targets"}.get(count, f"all {count} targets")
        if self.status == "not reached":
            return f"{name}: not reached; the nearest inputs have {_farthest(self)}"
        unknown = int(self.known.unknown.sum())
        sets = {
            "found": "one set of inputs",
            "several": f"{len(self.answers)} different sets of inputs",
            "family": f"a family of inputs, with {unknown} unknown direction{'s' * (unknown > 1)},",
        }[self.status]
        text = f"{name}: {sets} meet{'s' * (self.status != 'several')} {targets}"
        off = [one.off for one in self.measured]
        if len(self.targets) > len(self.parameters) and not self.widths:
            off += [abs(_off(self, i)) for i in range(len(self.targets))]
        return f"{text} within {100.0 * max(off):.2g} %" if off else text

    @property
    def tables(self) -> tuple[AnswerTable, ...]:
        """Inputs, other sets of inputs, directions, targets, and what to measure next."""
        which = "Others of the family" if self.status == "family" else "Other sets"
        return (
            _inputs(self),
            _sets(f"{which}, times the scene's values", self, self.answers[1:]),
            _directions(self),
            _targets(self),
            _measurements(self),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What makes intervals wrong, and the cost."""
        known, names, out = self.known, [one.name for one in self.parameters], list[str]()
        bent = [
            name
            for k, name in enumerate(names)
            if known.rises is not None
            and not _is_sought(self, k)
            and is_bent(known.rises[k], SHOWN)
        ]
        if bent:
            out.append(f"The misfit is not quadratic within the interval of {', '.join(bent)}.")
        out += [
            f"{one.target.name}: residuals of neighbouring points are correlated "
            f"({one.correlation:+.2f}, limit {one.limit:.2f}): the model lacks "
            "something that the curve has, and intervals are too narrow."
            for one in self.measured
            if not one.white
        ]
        ended = sum(math.isfinite(one.misfit) for one in self.starts)
        out.append(
            f"{ended} of {len(self.starts)} starts ended; {self.evaluations} models in "
            f"{self.seconds:.1f} s."
        )
        return tuple(out)

    @property
    def charts(self) -> list[Chart]:
        """Measured curves, and what each input does to the targets."""
        charts = [_over(one, k) for k, one in enumerate(self.measured)]
        if self.targets:
            charts += [_moves(self, k) for k in range(len(self.parameters))]
        return [replace(chart, figure=self.figure, size=_SIZE) for chart in charts]


def _farthest(found: Fit) -> str:
    """The target that is off most."""
    off = [abs(_off(found, i)) for i in range(len(found.targets))]
    rms = [one.rms for one in found.measured]
    if max(rms, default=0.0) > max(off, default=0.0):
        one = found.measured[int(np.argmax(rms))]
        return f"{one.target.name} {100.0 * one.off:.2g} % off, {max(rms):.2g} half-widths"
    i = int(np.argmax(off))
    target = found.targets[i]
    width = "" if target.half_width is None else f" ± {target.half_width:.3g} {target.unit}"
    wanted = f"{target.value:.8g} {target.unit}{width}"
    return f"{target.name} {found.numbers[i]:.6g} {target.unit} for {wanted}"


def _off(found: Fit, i: int) -> float:
    """Difference of a number from its target in half-widths, or relative to it."""
    one = found.targets[i]
    return float((found.numbers[i] - one.value) / one.scale)


def _inputs(found: Fit) -> AnswerTable:
    rows: list[tuple[str, ...]] = []
    for k, one in enumerate(found.parameters):
        z, ends, (low, high) = float(found.answers[0][k]), interval(found, k), one.bounds
        # within a thousandth of the room
        bound = " (bound)" if min(z - low, high - z) < 1e-3 * (high - low) else ""
        for path, value in zip(one.paths, one.values, strict=True):
            span = ("-", "-") if ends is None else _distinct(*(value * math.exp(e) for e in ends))
            fitted = Rounded(value * math.exp(z), ".5g", f"{{}}{bound}")
            rows.append((path, one.unit, Rounded(value, ".5g"), fitted, *span))
    heads = ("input", "unit", "#scene", "#fitted", "#from", "#to")
    return AnswerTable("Inputs", heads, tuple(rows), _interval_note(found))


def _interval_note(found: Fit) -> str:
    own = [one.name for k, one in enumerate(found.parameters) if _is_sought(found, k)]
    kind = "By profiles" if own else "To first order"
    if 0 < len(own) < len(found.parameters):
        kind = f"To first order, of {' and '.join(own)} by the profile"
    if not found.widths:
        of = "all sets that meet the targets" if own else f"targets off by {100.0 * _OFF:g} %"
        return f"From and to: {kind.lower()}, of {of}."
    if any(one.estimated for one in found.measured):
        return f"{kind}, 95 % intervals."
    return f"{kind}, in the same multiple of standard deviations as the targets' half-widths."


def _sets(heading: str, found: Fit, sets: Sequence[Array]) -> AnswerTable:
    """Sets of inputs beside each other."""
    shown = sets[:_MEMBERS]
    rows = tuple(
        (one.name, *(Rounded(math.exp(z[k])) for z in shown))
        for k, one in enumerate(found.parameters)
        if shown
    )
    return AnswerTable(heading, ("input", *(f"#{i + 1}" for i in range(len(shown)))), rows)


def _targets(found: Fit) -> AnswerTable:
    rows: list[tuple[str, ...]] = []
    for i, one in enumerate(found.targets):
        none = one.half_width is None
        size, text = (100.0, "{} %") if none else (1.0, "{} half-widths")
        off = Rounded(size * _off(found, i), "+.3f", text)
        half = "" if one.half_width is None else Rounded(one.half_width, ".3g")
        wanted, fitted = Rounded(one.value, ".8g"), Rounded(found.numbers[i], ".7g")
        rows.append((one.name, one.unit, wanted, fitted, off, half))
    for curve in found.measured:
        of = curve.target.curve
        values = f"{len(of.frequency)} {'complex' if of.is_complex else 'magnitudes'}"
        off = Rounded(100.0 * curve.off, ".2g", "{} % rms")
        sizes = [f"{100.0 * curve.relative:.2g} %"] if curve.relative else []
        sizes += [f"{curve.constant:.2g}"] if curve.constant else []
        half = f"{' and '.join(sizes) or '0'}{' (estimated)' if curve.estimated else ''}"
        rows.append((curve.target.name, "(m/s2)/N", values, "", off, half))
    heads = ("target", "unit", "#wanted", "#fitted", "#off", "half-width")
    return AnswerTable("Targets", heads, tuple(rows))


def _measurements(found: Fit) -> AnswerTable:
    """Measurements that were not made, the one that narrows the inputs most first."""
    rows = tuple(
        (
            one.name,
            one.unit,
            Rounded(one.half_width or 0.0, ".2g"),
            *_distinct(one.value - spread, one.value + spread),
            Rounded(then),
        )
        for one, spread, then in found.further
        if then < found.widest**_GAIN
    )[:_FURTHER]
    heads = ("number", "unit", "#half-width", "#from", "#to", "#factor then")
    note = (
        "The least known direction of the inputs is known within a factor of "
        f"{found.widest:.3g} today, and of the last column after the measurement. Half-widths are "
        "assumed; the fit predicts from and to."
    )
    return AnswerTable("Next measurement", heads, rows, note)


def _directions(found: Fit) -> AnswerTable:
    """How well the targets determine the inputs together, the least known direction first."""
    known = found.known
    rows = []
    for row, s, unknown in zip(known.directions, known.singular, known.unknown, strict=True):
        # which factors go together, the one that moves most growing
        growth = _GROWTH ** (row / row[int(np.argmax(np.abs(row)))])
        factors = zip(found.parameters, growth, strict=True)
        names = " with ".join(f"{p.name} x {f:.4g}" for p, f in factors if abs(f - 1.0) >= 5e-5)
        rows.append((names, "not determined" if unknown else Rounded(known.singular[0] / s)))
    heads = ("direction", "#times less known than the best")
    shown = tuple(rows[::-1]) if len(rows) > 1 or known.unknown.any() else ()
    note = "Inputs changed by the factors of the first direction move the targets least."
    return AnswerTable("Directions of the inputs", heads, shown, note)


def _is_sought(found: Fit, k: int) -> bool:
    """Whether the ends of a parameter are those of its profile."""
    return bool(np.isfinite(found.ends[k]).all())


def interval(found: Fit, k: int) -> tuple[float, float] | None:
    """ln(factor) between which a parameter fits as well: by its profile where that was sought, else
    to first order; without half-widths, for targets that are off by `_OFF`.
    """
    if _is_sought(found, k):
        return float(found.ends[k, 0]), float(found.ends[k, 1])
    if found.known.error is None:
        return None
    off = 1.0 if found.widths else _OFF
    z, half = float(found.answers[0][k]), off * float(found.known.error[k])
    return z - half, z + half


def _distinct(low: float, high: float) -> tuple[str, str]:
    """Both ends of an interval, with so many digits that they differ."""
    for digits in range(4, 10):
        ends = Rounded(low, f".{digits}g"), Rounded(high, f".{digits}g")
        if ends[0] != ends[1]:
            break
    return ends


# -- charts ---------------------------------------------------------------------------------------


def _over(one: FittedCurve, k: int) -> Chart:
    """A measured curve and the fitted one."""
    of = one.target.curve
    blade = f"{of.blade} blade"
    return Chart(
        f"{one.target.name}: {blade}"
        + (f", {one.target.state}" if one.target.state not in one.target.name else ""),
        Axis("frequency", "Hz"),
        Axis("accelerance", "(m/s2)/N", log=True),
        traces=(
            Trace("measured", of.frequency, of.magnitude, "points", k),
            Trace("fitted", of.frequency, np.abs(one.computed), "line", k),
        ),
    )


def _moves(found: Fit, k: int) -> Chart:
    """The numbers as one parameter moves alone, to first order."""
    one, z = found.parameters[k], float(found.answers[0][k])
    at = np.array([-_REACH, _REACH])
    numbers = found.numbers + at[:, None] * found.slopes[:, k]
    x, fitted = one.values[0] * np.exp(z + at), one.values[0] * math.exp(z)
    # the name of a table stands once: a second line would lie on the legend
    table = one.paths[0].rpartition(".")[0] + "."
    name = " + ".join((one.paths[0], *(path.removeprefix(table) for path in one.paths[1:])))
    return Chart(
        f"What {one.name} does",
        Axis(name, one.unit, log=True),
        Axis("difference from the target", "%"),
        traces=tuple(
            Trace(target.name, x, 100.0 * (numbers[:, i] / target.value - 1.0), "line", i)
            for i, target in enumerate(found.targets)
        ),
        bands=(Band("fitted", "x", fitted, fitted, dashed=True),),
        note="To first order.",
    )
