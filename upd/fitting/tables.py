"""The answer of a fit: its verdict, its tables and its notes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upd.fitting.first_order import TOLD, is_bent
from upd.fitting.fitted_inputs import FittedInputs
from upd.fitting.profile import Profile
from upd.fitting.weights import CurveNoise
from upd.results.answer_table import AnswerTable, Rounded

Array = NDArray[np.float64]
#: growth of the input that moves most along a direction that is printed
_GROWTH = 1.1
#: relative error of targets without half-widths, for how far the inputs move
_OFF = 1e-3
#: further measurements that are printed, and what they leave of the widest direction's half-width
#: at most
_FURTHER, _GAIN = 6, 0.9
#: sets of inputs that are printed
_MEMBERS = 5


def verdict(found: FittedInputs) -> str:
    """One sentence: whether the targets are met, and whether by one set of inputs."""
    name, count = found.source.name, len(found.targets) + len(found.measured)
    targets = {1: "the target", 2: "both targets"}.get(count, f"all {count} targets")
    if found.status == "not reached":
        return f"{name}: not reached; the nearest inputs have {_farthest(found)}"
    unknown = int(found.known.unknown.sum())
    sets = {
        "found": "one set of inputs",
        "several": f"{len(found.answers)} different sets of inputs",
        "family": f"a family of inputs, with {unknown} unknown direction{'s' * (unknown > 1)},",
    }[found.status]
    text = f"{name}: {sets} meet{'s' * (found.status != 'several')} {targets}"
    off = [one.off for one in found.measured]
    if len(found.targets) > len(found.parameters) and not found.widths:
        off += [abs(_off(found, i)) for i in range(len(found.targets))]
    return f"{text} within {100.0 * max(off):.2g} %" if off else text


def _farthest(found: FittedInputs) -> str:
    """The target that is off most."""
    off = [abs(_off(found, i)) for i in range(len(found.targets))]
    rms = [one.noise.rms for one in found.measured]
    if max(rms, default=0.0) > max(off, default=0.0):
        one = found.measured[int(np.argmax(rms))]
        return f"{one.target.name} {100.0 * one.off:.2g} % off, {max(rms):.2g} half-widths"
    i = int(np.argmax(off))
    target = found.targets[i]
    return f"{target.name} {found.numbers[i]:.6g} {target.unit} for {target.shown}"


def _off(found: FittedInputs, i: int) -> float:
    """Difference of a number from its target in half-widths, or relative to it."""
    one = found.targets[i]
    return float((found.numbers[i] - one.value) / one.scale)


def tables(found: FittedInputs) -> tuple[AnswerTable, ...]:
    """Inputs, other sets of inputs, targets, and what to measure next."""
    others, members = found.answers[1:], family_members(found)
    return (
        _inputs(found),
        _sets("Family that meets the targets, times the scene's values", found, members),
        _sets("Other sets, times the scene's values", found, others if not members else []),
        _targets(found),
        _measurements(found),
    )


def _inputs(found: FittedInputs) -> AnswerTable:
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


def _interval_note(found: FittedInputs) -> str:
    own = [one.name for k, one in enumerate(found.parameters) if found.is_traced(k)]
    if not found.widths:
        if own:
            return "From and to: ends of all sets that meet the targets, by profiles."
        if found.known.error is None:
            return "No intervals: the targets have no half-widths."
        moved = ", ".join(f"{100.0 * _OFF * error:.2g}" for error in found.known.error)
        return (
            "No intervals: the targets have no half-widths. Targets that are off by 0.1 % move the "
            f"inputs by {moved} %."
        )
    kind = "By profiles" if own else "To first order"
    if 0 < len(own) < len(found.parameters):
        kind = f"To first order, of {' and '.join(own)} by the profile"
    if any(one.noise.estimated for one in found.measured):
        return f"{kind}, 95 % intervals."
    return f"{kind}, in the same multiple of standard deviations as the targets' half-widths."


def _sets(heading: str, found: FittedInputs, sets: Sequence[Array]) -> AnswerTable:
    """Sets of inputs beside each other."""
    shown = sets[:_MEMBERS]
    rows = tuple(
        (one.name, *(Rounded(math.exp(z[k])) for z in shown))
        for k, one in enumerate(found.parameters)
        if shown
    )
    return AnswerTable(heading, ("input", *(f"#{i + 1}" for i in range(len(shown)))), rows)


def _targets(found: FittedInputs) -> AnswerTable:
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


def _measurements(found: FittedInputs) -> AnswerTable:
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


def notes(found: FittedInputs) -> tuple[str, ...]:
    """What is unknown, what makes intervals wrong, and the cost."""
    known, names = found.known, [one.name for one in found.parameters]
    out = [
        f"The targets do not determine {_direction(found, row)}."
        for row in known.directions[known.unknown]
    ]
    if found.status == "family" and not found.profiles:
        out.append("The family was not traced: every evaluation makes new blades.")
    if known.correlation is not None and len(names) > 1:
        upper = np.triu(np.abs(known.correlation), 1)
        i, j = np.unravel_index(int(np.argmax(upper)), upper.shape)
        out.append(
            f"Least known: {_direction(found, known.directions[-1])}, "
            f"{known.singular[0] / known.singular[-1]:.2g} times less than the best known; largest "
            f"correlation {known.correlation[i, j]:+.2f}, of {names[i]} and {names[j]}."
        )
    bent = [
        name
        for k, name in enumerate(names)
        if known.rises is not None and not found.is_traced(k) and is_bent(known.rises[k], TOLD)
    ]
    if bent:
        out.append(
            f"The misfit is not quadratic within the interval of {', '.join(bent)}: ask for "
            "profiles."
        )
    out += [
        f"{one.target.name}: residuals of neighbouring points are correlated "
        f"({one.noise.correlation:+.2f}, limit {one.noise.limit:.2f}): the model lacks something "
        "that the curve has, and intervals are too narrow."
        for one in found.measured
        if not one.noise.white
    ]
    ended = sum(math.isfinite(one.misfit) for one in found.starts)
    slopes = "exact" if all(found.exact) else "partly" * any(found.exact) + " by differences"
    out.append(
        f"{ended} of {len(found.starts)} starts ended; {found.evaluations} models in "
        f"{found.seconds:.1f} s; derivatives {slopes.strip()}."
    )
    return tuple(out)


def _direction(found: FittedInputs, row: Array) -> str:
    """A direction of the inputs: which factors go together, the one that moves most growing."""
    row = row / row[int(np.argmax(np.abs(row)))]
    factors = zip(found.parameters, _GROWTH**row, strict=True)
    return " with ".join(f"{one.name} x {f:.4g}" for one, f in factors if abs(f - 1.0) >= 5e-5)


def on_bound(found: FittedInputs, k: int) -> bool:
    """Whether the answer lies on a bound of a parameter, within a thousandth of the room."""
    low, high = found.parameters[k].bounds
    z = float(found.answers[0][k])
    return min(z - low, high - z) < 1e-3 * (high - low)


def interval(found: FittedInputs, k: int) -> tuple[float, float] | None:
    """ln(factor) between which a parameter fits as well: of all sets that profiles passed through
    where it has one, else to first order.
    """
    if found.is_traced(k):
        traced = np.concatenate([one.z[:, k] for one in found.profiles])
        return float(traced.min()), float(traced.max())
    if found.known.error is None or not found.widths:
        return None
    z, half = float(found.answers[0][k]), float(found.known.error[k])
    return z - half, z + half


def _distinct(low: float, high: float) -> tuple[str, str]:
    """Both ends of an interval, with so many digits that they differ."""
    for digits in range(4, 10):
        ends = Rounded(low, f".{digits}g"), Rounded(high, f".{digits}g")
        if ends[0] != ends[1]:
            break
    return ends


def family_members(found: FittedInputs) -> list[Array]:
    """Some sets of a family that was traced, from end to end."""
    one = family_profile(found)
    if one is None:
        return []
    return [one.z[i] for i in np.unique(np.linspace(0, len(one.z) - 1, _MEMBERS).astype(int))]


def family_profile(found: FittedInputs) -> Profile | None:
    """The profile of the parameter that moves most along the unknown directions; None without."""
    if not found.profiles or not found.known.unknown.any():
        return None
    moved = np.abs(found.known.directions[found.known.unknown]).max(axis=0)
    return found.profiles[int(np.argmax(moved))]
