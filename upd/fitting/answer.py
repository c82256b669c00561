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
from upd.fitting.intervals import SHOWN, Knowledge, Profile, is_bent
from upd.fitting.next_measurement import FurtherMeasurement
from upd.fitting.parameters import VariedInput, fitted_scene
from upd.fitting.residuals import CurveNoise, Start
from upd.fitting.targets import CurveTarget, FitTarget
from upd.plot.chart import Axis, Band, Chart, Trace
from upd.report.answer_folder import FigureAnswer
from upd.results.answer_table import AnswerTable, Rounded
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
#: reach of the tangents where curves would need new blades, in ln(factor)
_REACH = 0.05


@dataclass(frozen=True)
class FittedCurve:
    """A measured curve and the fitted one.

    Attributes
    ----------
    target : CurveTarget
        What was measured.
    noise : CurveNoise
        How well it is taken to be known.
    computed : ndarray
        (n,) of the first answer, complex or magnitudes, (m/s2)/N.
    """

    target: CurveTarget
    noise: CurveNoise
    computed: NDArray[np.complex128]

    @property
    def off(self) -> float:
        """Root of the mean square of the differences, over that of the measured values."""
        H = self.target.curve.accelerance
        computed = self.computed if self.target.curve.is_complex else np.abs(self.computed)
        return float(np.linalg.norm(computed - H) / np.linalg.norm(H))


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
    profiles : tuple of Profile
        Sets that fit as well, by the parameter moved; only of those that were traced.
    curves : tuple of ndarray
        (k, 1 + m) for every parameter: its ln(factor), and the numbers as it moves alone; empty
        where an evaluation takes seconds.
    further : tuple of FurtherMeasurement
        What measurements that were not made would tell, the most telling first.
    starts : list of Start
        Where every start ended, the best first.
    directions : str
        contact.directions that the fitted scene has to name; "" where its own word does.
    exact : tuple of bool
        Which parameters have exact derivatives.
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
    profiles: tuple[Profile, ...]
    curves: tuple[Array, ...]
    further: tuple[FurtherMeasurement, ...]
    starts: list[Start]
    directions: str
    exact: tuple[bool, ...]
    evaluations: int
    seconds: float

    def is_traced(self, k: int) -> bool:
        """Whether there is a profile of a parameter, by its number."""
        return any(one.parameter == k for one in self.profiles)

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
        members = family_members(self)
        which = "Family that meets the targets" if members else "Other sets"
        return (
            _inputs(self),
            _sets(f"{which}, times the scene's values", self, members or self.answers[1:]),
            _directions(self),
            _targets(self),
            _measurements(self),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What makes intervals wrong, and the cost."""
        known, names, out = self.known, [one.name for one in self.parameters], list[str]()
        if self.status == "family" and not self.profiles:
            out.append("The family was not traced: every evaluation makes new blades.")
        bent = [
            name
            for k, name in enumerate(names)
            if known.rises is not None and not self.is_traced(k) and is_bent(known.rises[k], SHOWN)
        ]
        if bent:
            out.append(
                f"The misfit is not quadratic within the interval of {', '.join(bent)}: ask for "
                "profiles."
            )
        out += [
            f"{one.target.name}: residuals of neighbouring points are correlated "
            f"({one.noise.correlation:+.2f}, limit {one.noise.limit:.2f}): the model lacks "
            "something that the curve has, and intervals are too narrow."
            for one in self.measured
            if not one.noise.white
        ]
        ended = sum(math.isfinite(one.misfit) for one in self.starts)
        slopes = "exact" if all(self.exact) else "partly" * any(self.exact) + " by differences"
        out.append(
            f"{ended} of {len(self.starts)} starts ended; {self.evaluations} models in "
            f"{self.seconds:.1f} s; derivatives {slopes.strip()}."
        )
        return tuple(out)

    @property
    def charts(self) -> list[Chart]:
        """Measured curves, the family, and what each input does to the targets."""
        return fit_charts(self)


def _farthest(found: Fit) -> str:
    """The target that is off most."""
    off = [abs(_off(found, i)) for i in range(len(found.targets))]
    rms = [one.noise.rms for one in found.measured]
    if max(rms, default=0.0) > max(off, default=0.0):
        one = found.measured[int(np.argmax(rms))]
        return f"{one.target.name} {100.0 * one.off:.2g} % off, {max(rms):.2g} half-widths"
    i = int(np.argmax(off))
    target = found.targets[i]
    return f"{target.name} {found.numbers[i]:.6g} {target.unit} for {target.shown}"


def _off(found: Fit, i: int) -> float:
    """Difference of a number from its target in half-widths, or relative to it."""
    one = found.targets[i]
    return float((found.numbers[i] - one.value) / one.scale)


def _inputs(found: Fit) -> AnswerTable:
    rows: list[tuple[str, ...]] = []
    for k, one in enumerate(found.parameters):
        factor, ends = math.exp(found.answers[0][k]), interval(found, k)
        for path, value in zip(one.paths, one.values, strict=True):
            span = ("-", "-") if ends is None else _distinct(*(value * math.exp(z) for z in ends))
            bound = " (bound)" if on_bound(found, k) else ""
            fitted = Rounded(value * factor, ".5g", f"{{}}{bound}")
            rows.append((path, one.unit, Rounded(value, ".5g"), fitted, *span))
    heads = ("input", "unit", "#scene", "#fitted", "#from", "#to")
    return AnswerTable("Inputs", heads, tuple(rows), _interval_note(found))


def _interval_note(found: Fit) -> str:
    own = [one.name for k, one in enumerate(found.parameters) if found.is_traced(k)]
    kind = "By profiles" if own else "To first order"
    if 0 < len(own) < len(found.parameters):
        kind = f"To first order, of {' and '.join(own)} by the profile"
    if not found.widths:
        of = "all sets that meet the targets" if own else f"targets off by {100.0 * _OFF:g} %"
        return f"From and to: {kind.lower()}, of {of}."
    if any(one.noise.estimated for one in found.measured):
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
        off = Rounded(size * _off(found, i), "+.2g", text)
        half = "" if one.half_width is None else Rounded(one.half_width, ".3g")
        wanted, fitted = Rounded(one.value, ".8g"), Rounded(found.numbers[i], ".7g")
        rows.append((one.name, one.unit, wanted, fitted, off, half))
    for curve in found.measured:
        of = curve.target.curve
        values = f"{len(of.frequency)} {'complex' if of.is_complex else 'magnitudes'}"
        off = Rounded(100.0 * curve.off, ".2g", "{} % rms")
        rows.append((curve.target.name, "(m/s2)/N", values, "", off, _half_width(curve.noise)))
    heads = ("target", "unit", "#wanted", "#fitted", "#off", "half-width")
    return AnswerTable("Targets", heads, tuple(rows))


def _half_width(noise: CurveNoise) -> str:
    """Of a curve."""
    parts = [f"{100.0 * noise.relative:.2g} %"] if noise.relative else []
    parts += [f"{noise.constant:.2g}"] if noise.constant else []
    return f"{' and '.join(parts) or '0'}{' (estimated)' if noise.estimated else ''}"


def _measurements(found: Fit) -> AnswerTable:
    """Measurements that were not made, the one that narrows the inputs most first."""
    rows = tuple(
        (
            one.name,
            one.unit,
            Rounded(one.half_width, ".2g"),
            *_distinct(one.low, one.high),
            Rounded(one.then),
        )
        for one in found.further
        if one.then < one.widest**_GAIN
    )[:_FURTHER]
    widest = f"{found.further[0].widest:.3g}" if found.further else ""
    return AnswerTable(
        "Next measurement",
        ("number", "unit", "#half-width", "#from", "#to", "#then x/"),
        rows,
        f"The least known direction of the inputs is known within x/ {widest} today. Half-widths "
        "are assumed; from and to are what the fit predicts.",
    )


def _directions(found: Fit) -> AnswerTable:
    """How well the targets determine the inputs together, the least known direction first."""
    known = found.known
    rows = tuple(
        (_direction(found, row), "not determined" if unknown else Rounded(known.singular[0] / s))
        for row, s, unknown in zip(known.directions, known.singular, known.unknown, strict=True)
    )
    heads = ("direction", "#times less known than the best")
    shown = len(rows) > 1 or bool(known.unknown.any())
    return AnswerTable("Directions of the inputs", heads, rows[::-1] if shown else ())


def _direction(found: Fit, row: Array) -> str:
    """A direction of the inputs: which factors go together, the one that moves most growing."""
    row = row / row[int(np.argmax(np.abs(row)))]
    factors = zip(found.parameters, _GROWTH**row, strict=True)
    return " with ".join(f"{one.name} x {f:.4g}" for one, f in factors if abs(f - 1.0) >= 5e-5)


def on_bound(found: Fit, k: int) -> bool:
    """Whether the answer lies on a bound of a parameter, within a thousandth of the room."""
    low, high = found.parameters[k].bounds
    z = float(found.answers[0][k])
    return min(z - low, high - z) < 1e-3 * (high - low)


def interval(found: Fit, k: int) -> tuple[float, float] | None:
    """ln(factor) between which a parameter fits as well: of all sets that profiles passed through
    where it has one, else to first order; without half-widths, for targets that are off by `_OFF`.
    """
    if found.is_traced(k):
        traced = np.concatenate([one.z[:, k] for one in found.profiles])
        return float(traced.min()), float(traced.max())
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


def family_members(found: Fit) -> list[Array]:
    """Some sets of a family that was traced, from end to end."""
    one = family_profile(found)
    if one is None:
        return []
    return [one.z[i] for i in np.unique(np.linspace(0, len(one.z) - 1, _MEMBERS).astype(int))]


def family_profile(found: Fit) -> Profile | None:
    """The profile of the parameter that moves most along the unknown directions; None without."""
    if not found.profiles or not found.known.unknown.any():
        return None
    moved = np.abs(found.known.directions[found.known.unknown]).max(axis=0)
    return found.profiles[int(np.argmax(moved))]


# -- charts ---------------------------------------------------------------------------------------


def fit_charts(found: Fit) -> list[Chart]:
    """Measured curves, the family where there is one, and what each parameter does to the
    targets.

    Parameters
    ----------
    found : Fit
        Of the fit.
    """
    charts: list[Chart] = []
    family = family_profile(found)
    if family is not None and len(found.parameters) > 1:
        charts.append(_family(found, family))
    charts = [_over(one, k) for k, one in enumerate(found.measured)] + charts
    if found.targets:
        charts += [_moves(found, k) for k in range(len(found.parameters))]
    return [replace(chart, figure=Fit.figure, size=_SIZE) for chart in charts]


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


def _axis(found: Fit, k: int) -> Axis:
    one = found.parameters[k]
    # the name of a table stands once: a second line would lie on the legend
    table = one.paths[0].rpartition(".")[0] + "."
    more = (path.removeprefix(table) for path in one.paths[1:])
    return Axis(" + ".join((one.paths[0], *more)), one.unit, log=True)


def _values(found: Fit, k: int, z: np.ndarray) -> np.ndarray:
    return np.asarray(found.parameters[k].values[0] * np.exp(z))


def _family(found: Fit, one: Profile) -> Chart:
    k = one.parameter
    x = _values(found, k, one.z[:, k])
    others = [j for j in range(len(found.parameters)) if j != k]
    best = found.answers[0]
    return Chart(
        f"{found.source.name}: sets that fit equally well",
        _axis(found, k),
        Axis("factor of the scene's value", log=True),
        traces=(
            *(
                Trace(found.parameters[j].name, x, np.exp(one.z[:, j]), "line", colour)
                for colour, j in enumerate(others)
            ),
            *(
                Trace(
                    f"the one written, {found.parameters[j].name}",
                    _values(found, k, best[k : k + 1]),
                    np.exp(best[j : j + 1]),
                    "star",
                    colour,
                    entry="the one written",
                )
                for colour, j in enumerate(others)
            ),
        ),
        note="Along these lines no target changes by more than it is known.",
    )


def _moves(found: Fit, k: int) -> Chart:
    z = float(found.answers[0][k])
    if found.curves:
        at, numbers = found.curves[k][:, 0], found.curves[k][:, 1:]
    else:
        at = z + np.array([-_REACH, _REACH])
        numbers = found.numbers + (at - z)[:, None] * found.slopes[:, k]
    x = _values(found, k, at)
    here = _values(found, k, np.array([z]))
    return Chart(
        f"What {found.parameters[k].name} does",
        _axis(found, k),
        Axis("number over its target, less 1", "%"),
        traces=tuple(
            Trace(one.name, x, 100.0 * (numbers[:, i] / one.value - 1.0), "line", i)
            for i, one in enumerate(found.targets)
        ),
        bands=(Band("fitted", "x", float(here[0]), float(here[0]), dashed=True),),
        note="" if found.curves else "To first order.",
    )
