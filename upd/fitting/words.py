"""A fit in words, the answer first, and as plain numbers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from upd.fitting.first_order import TOLD, is_bent
from upd.fitting.found import FittedInputs
from upd.fitting.further import FurtherMeasurement
from upd.fitting.profile import Profile
from upd.fitting.weights import CurveNoise
from upd.report.answer_folder import WIDTH, wrapped

Array = NDArray[np.float64]
#: change of the parameter that moves most along a direction that is told in words
_TOLD = 1.1
#: of the targets, for how far the parameters move when the targets are off
_OFF = 1e-3
#: a distance from a bound, as a share of the room, below which an answer lies on it
_ON_BOUND = 1e-3
#: further measurements that are printed, and what they leave of the widest direction's half-width
#: at most
_FURTHER, _TELLS = 6, 0.9
#: sets of a family that are printed
_MEMBERS = 5


def headline(found: FittedInputs) -> str:
    """One sentence: whether the targets are met, and whether by one set of parameters."""
    m, n = len(found.targets), len(found.parameters)
    begin, curves = f"{found.source.name}:", found.measured
    total = m + len(curves)
    all_met = f"all {total} targets are met" if total > 2 else "both targets are met"
    if total == 1:
        all_met = "the target is met"
    if curves:
        worst = 100.0 * max(one.off for one in curves)
        all_met += f", {'curves' if len(curves) > 1 else 'the curve'} within {worst:.2g} %"
    if found.status == "not reached":
        return f"{begin} not reached: the nearest has {_farthest(found)}"
    if found.status == "family":
        count = int(found.known.unknown.sum())
        return (
            f"{begin} {all_met} by a family of parameter sets, not by one: {total} "
            f"target{'s' * (total > 1)}, {n} parameters, {count} direction{'s' * (count > 1)} "
            "unknown"
        )
    if found.status == "several":
        return f"{begin} {all_met} by {len(found.answers)} sets of parameters apart from each other"
    if m > n and not found.widths:
        worst = 100.0 * max(abs(_off(found, i)) for i in range(m))
        return f"{begin} one set of parameters is nearest to all {m} targets, within {worst:.2g} %"
    return f"{begin} {all_met} by one set of parameters"


def _farthest(found: FittedInputs) -> str:
    """The target that is off most, in words."""
    off = [abs(_off(found, i)) for i in range(len(found.targets))]
    rms = [one.noise.rms for one in found.measured]
    if rms and max(rms) > max(off, default=0.0):
        one = found.measured[int(np.argmax(rms))]
        return f"{one.target.name} {100.0 * one.off:.2g} % off, {max(rms):.2g} half-widths"
    i = int(np.argmax(off))
    target = found.targets[i]
    return f"{target.name} {found.numbers[i]:.6g} {target.unit} for {target.shown}"


def lines(found: FittedInputs) -> list[str]:
    """The answer, line by line: targets, parameters, what is unknown, what would tell it, cost."""
    out = [*wrapped(headline(found), "")]
    out += target_lines(found)
    out += curve_lines(found)
    out += parameter_lines(found)
    out += unknown_lines(found)
    out += further_lines(found)
    began = len(found.starts)
    ended = sum(math.isfinite(one.misfit) for one in found.starts)
    exact = sum(found.exact)
    slopes = "exact" if all(found.exact) else "by differences" if not exact else "exact and by both"
    out += wrapped(
        f"{ended} of {began} starts ended, {found.evaluations} models solved, derivatives "
        f"{slopes.replace('exact and by both', 'exact, some by differences')}, "
        f"{found.seconds:.1f} s"
    )
    if found.cost:
        out += wrapped(found.cost)
    return out


def _off(found: FittedInputs, i: int) -> float:
    """Difference of a number from its target in half-widths, or relative to it."""
    one = found.targets[i]
    return float((found.numbers[i] - one.value) / one.scale)


def target_lines(found: FittedInputs) -> list[str]:
    """Every target, what came out, and the difference."""
    if not found.targets:
        return []
    wide = max(len(one.name) for one in found.targets)
    out = [f"  {'number':<{wide}} {'target':>10} {'fitted':>11}  difference"]
    for i, one in enumerate(found.targets):
        told = target_difference(found, i)
        out.append(
            f"  {one.name:<{wide}} {one.value:>10.7g} {found.numbers[i]:>11.7g}  {one.unit}, {told}"
        )
    return out


def target_difference(found: FittedInputs, i: int) -> str:
    """How far a number is off its target, in half-widths or per cent."""
    off = _off(found, i)
    if found.targets[i].half_width is None:
        return f"{100.0 * off:+.2g} %"
    return f"{off:+.2g} half-widths"


def curve_lines(found: FittedInputs) -> list[str]:
    """Every measured curve: its points, how far off the fitted one is, its noise."""
    return [line for words in curve_words(found) for line in wrapped(words)]


def curve_words(found: FittedInputs) -> list[str]:
    """The same in sentences."""
    out = []
    for one in found.measured:
        of, noise = one.target.curve, one.noise
        blade = "" if of.blade == "right" else "left blade, "
        out.append(
            f"{one.target.name}: {blade}{one.target.state}, {len(of.frequency)} "
            f"{'complex values' if of.is_complex else 'magnitudes'} from {of.band[0]:.6g} to "
            f"{of.band[1]:.6g} Hz, off by {100.0 * one.off:.2g} % (rms); {_noise(noise)}"
        )
        if not noise.white:
            out.append(
                f"{one.target.name}: residuals of neighbouring points are alike (correlation "
                f"{noise.correlation:+.2f}, independent errors within {noise.limit:.2f}): the "
                "curve has what the model has not, and intervals are too narrow"
            )
    return out


def _noise(noise: CurveNoise) -> str:
    """Half-widths of a curve in words."""
    parts = []
    if noise.relative:
        parts.append(f"{100.0 * noise.relative:.2g} % of the value")
    if noise.constant:
        parts.append(f"{noise.constant:.2g} (m/s2)/N")
    size = " and ".join(parts) or "0"
    if noise.estimated:
        return f"half-width estimated from what is left, 95 %: {size}"
    return f"half-width {size}"


def parameter_lines(found: FittedInputs) -> list[str]:
    """Every input with its value, factor, and what is known of it."""
    wide = max(len(path) for one in found.parameters for path in one.paths)
    out = [f"  {'input':<{wide}} {'fitted':>10}  unit   times scene"]
    for k, one in enumerate(found.parameters):
        z = float(found.answers[0][k])
        for path, value in zip(one.paths, one.values, strict=True):
            out.append(
                f"  {path:<{wide}} {value * math.exp(z):>10.5g}  {one.unit:<6} {math.exp(z):.5g}"
                f"{', at its bound' if on_bound(found, k) else ''}"
            )
        told = _known_of(found, k)
        if told:
            out += wrapped(told, "    ")
    if found.status == "several":
        out += wrapped(f"other sets, as factors: {_factors(found.answers[1:])}")
    return out


def on_bound(found: FittedInputs, k: int, z: float | None = None) -> bool:
    """Whether the answer, or ln(factor) z, lies on a bound of a parameter."""
    low, high = found.parameters[k].bounds
    room = _ON_BOUND * (high - low)
    at = float(found.answers[0][k]) if z is None else z
    return at - low < room or high - at < room


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


def _known_of(found: FittedInputs, k: int) -> str:
    one, ends = found.parameters[k], interval(found, k)
    if ends is not None:
        traced = found.is_traced(k)
        told = ends_of(one.value(ends[0]), one.value(ends[1]))
        low, high = (
            f"{text}{' (bound)' * (traced and on_bound(found, k, z))}"
            for text, z in zip(told, ends, strict=True)
        )
        how = _bent(found, k) if traced else f" (to first order{_bent(found, k)})"
        return f"fits as well from {low} to {high} {one.unit}".rstrip() + how
    if found.known.error is None:
        return ""
    # targets off by independent errors of that size
    return f"moves {100.0 * _OFF * found.known.error[k]:.2g} % when targets are off 0.1 %"


def _bent(found: FittedInputs, k: int) -> str:
    """What a first-order interval has where the misfit is not quadratic within it: the rises to its
    ends, or beside the profile's interval its own ends.
    """
    rises = None if found.rises is None else found.rises[k]
    if rises is None:
        return ""
    own = next((one for one in found.profiles if one.parameter == k), None)
    if own is not None:
        z, error, one = float(found.answers[0][k]), found.known.error, found.parameters[k]
        assert error is not None
        first = " to ".join(ends_of(one.value(z - error[k]), one.value(z + error[k])))
        return f" (by its profile, {own.models} models; to first order {first})"
    if not is_bent(rises, TOLD):
        return ""
    told = " and ".join(f"{r:.2g}" if np.isfinite(r) else "not known" for r in rises)
    return f"; the misfit rises by {told} to its ends, not by 1: ask for profiles"


def _factors(sets: list[Array]) -> str:
    return "; ".join(", ".join(f"{math.exp(z):.4g}" for z in one) for one in sets[:_MEMBERS])


def direction_words(found: FittedInputs, row: Array) -> str:
    """A direction of the parameters: which factors go together."""
    top = np.abs(row).max()
    # the one that moves most grows
    signed = row * np.sign(row[int(np.argmax(np.abs(row)))]) / top
    parts = [
        f"{one.name} x {_TOLD**v:.4g}"
        for one, v in zip(found.parameters, signed, strict=True)
        if abs(_TOLD**v - 1.0) >= 5e-5
    ]
    return " with ".join(parts)


def unknown_words(found: FittedInputs) -> list[str]:
    """Directions that leave the targets as they are, and correlations, in sentences."""
    known = found.known
    out = [
        f"not told by these targets: {direction_words(found, row)}"
        for row, unknown in zip(known.directions, known.unknown, strict=True)
        if unknown
    ]
    if known.correlation is not None and len(found.parameters) > 1:
        upper = np.triu(np.abs(known.correlation), 1)
        i, j = np.unravel_index(int(np.argmax(upper)), upper.shape)
        names = [found.parameters[int(k)].name for k in (i, j)]
        out.append(
            f"least known: {direction_words(found, known.directions[-1])}, "
            f"{known.singular[0] / known.singular[-1]:.2g} times less than the best known"
        )
        out.append(f"largest correlation {known.correlation[i, j]:+.2f}: {names[0]} and {names[1]}")
    return out


def unknown_lines(found: FittedInputs) -> list[str]:
    """The same in lines, with members of the family."""
    out = [line for words in unknown_words(found) for line in wrapped(words)]
    if found.status == "family":
        if found.profiles:
            out += _family(found)
        else:
            out += wrapped("the family was not traced: an evaluation makes new blades")
    return out


def further_lines(found: FittedInputs) -> list[str]:
    """Measurements that were not made, the most telling first."""
    chosen = [one for one in found.further if one.then < one.widest**_TELLS][:_FURTHER]
    if not chosen:
        return []
    widest = chosen[0].widest
    out = wrapped(
        f"a further measurement would tell more; the least known direction is within x/{widest:.3g}"
        " today, and with it within:"
    )
    wide = max(len(one.name) for one in chosen)
    for one in chosen:
        line = f"    {one.name:<{wide}} x/{one.then:<6.4g} if ±{one.half_width:.2g} {one.unit};"
        now = f"now {_span(one)}"
        fits = len(line) + 1 + len(now) <= WIDTH
        out += [f"{line} {now}"] if fits else [line, f"    {'':<{wide}} {now}"]
    return out


def _span(one: FurtherMeasurement) -> str:
    """What a fit predicts for a measurement: so many digits that its ends differ."""
    return " to ".join(ends_of(one.low, one.high))


def ends_of(low: float, high: float) -> tuple[str, str]:
    """Both ends of an interval, with so many digits that they differ."""
    for digits in range(4, 10):
        told = f"{low:.{digits}g}", f"{high:.{digits}g}"
        if told[0] != told[1]:
            break
    return told


def _family(found: FittedInputs) -> list[str]:
    one = family_profile(found)
    if one is None:
        return []
    rows = np.unique(np.linspace(0, len(one.z) - 1, _MEMBERS).astype(int))
    out = wrapped("members, as factors of the scene's values:")
    for k, parameter in enumerate(found.parameters):
        numbers = "".join(f"{math.exp(one.z[i, k]):>10.4g}" for i in rows)
        out += [f"    {parameter.name}", f"      {numbers}"]
    apart = outside(found)
    if apart:
        out += wrapped(f"other sets outside this family's limits, as factors: {_factors(apart)}")
    return out


def outside(found: FittedInputs) -> list[Array]:
    """Answers with a parameter outside of what profiles reach: of another branch."""
    ends = [interval(found, k) for k in range(len(found.parameters))]
    return [
        z
        for z in found.answers
        if any(e is not None and not e[0] <= at <= e[1] for at, e in zip(z, ends, strict=True))
    ]


def family_profile(found: FittedInputs) -> Profile | None:
    """The profile of the parameter that moves most along the unknown directions; None without."""
    if not found.profiles or not found.known.unknown.any():
        return None
    moved = np.abs(found.known.directions[found.known.unknown]).max(axis=0)
    return found.profiles[int(np.argmax(moved))]
