"""Errors of a response's numbers by source, from the levels that were solved beside the run.

Coarser levels that show an order give Richardson's error with the factor 1.25 of three grids, of
the order that re-entrant edges leave on fine meshes: a higher one is an accident of coarse levels.
Levels without an order (heights that the mesh hardly changes, harmonics where contacts open and
close) have their range as the scale of the error; more contact points are taken as of first order.

References
----------
P. J. Roache, Verification and Validation in Computational Science and Engineering (1998), ch. 5;
L. Eca, M. Hoekstra, J. Comput. Phys. 262 (2014) 104: the range of data as the scale of an error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from upd.analyses.forced.curves import TimeCheck
from upd.analyses.forced.levels import (
    HARMONICS,
    MESH,
    MODES,
    POINTS,
    SAMPLES,
    TIME,
    PeakLevel,
    Place,
    at_place,
    linear_numbers,
)
from upd.analyses.forced.measures import CurvePeak
from upd.analyses.forced.solution import ForcedSolution
from upd.progress import Stages
from upd.results import Case, ErrorPart, Estimates, Result
from upd.results import quantities as q
from upd.results.quantities import quantity_of
from upd.results.quantity import Quantity
from upd.scene.forced_contact import SIDES, Side
from upd.vary.orders import observed_order, two_level_error

Key = tuple[str, Case]
#: factor of safety of three levels that show an order
_SAFETY = 1.25
#: order of frequencies on fine meshes: twice the exponent of displacements at a re-entrant edge of
#: 270 degrees (M. L. Williams, J. Appl. Mech. 19, 1952, 526)
_ORDER = 2.0 * 0.5445
#: order below which levels show none
_LEAST = 0.5
#: numbers of the performance curve: their error is that of the peaks beside
_BEST = (q.BEST_RATIO, q.BEST_PEAK, q.BEST_FREQUENCY, q.BEST_REDUCTION)


def estimate(solution: ForcedSolution, numbers: Sequence[Result], stages: Stages) -> Estimates:
    """What every source adds to the error of the peaks, stuck frequencies and reductions.

    Parameters
    ----------
    solution
        With its levels.
    numbers
        Of the run.
    stages
        Of the run.
    """
    del stages
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    for name, levels in solution.levels.items():
        out |= _linear_numbers(solution, name, levels)
        for curve in (c for c in solution.curves if c.stiffness == name):
            for side in SIDES:
                for peak in curve.peaks[side]:
                    out |= _of_peak(solution, levels, curve.case, curve.ratio, side, peak)
    wanted = {(one.name, one.case): one for one in numbers if not one.withheld}
    for side in SIDES:
        out |= _reductions(wanted, out, side)
    for key, one in wanted.items():
        if (quantity := quantity_of(one.name)[0]) in _BEST:
            out[key] = _of_best(solution, quantity, one, out)
    return {key: parts for key, parts in out.items() if parts}


def _linear_numbers(
    solution: ForcedSolution, name: str, levels: Sequence[PeakLevel]
) -> dict[Key, tuple[ErrorPart, ...]]:
    """Peaks of both limits, and the stuck frequencies."""
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    linear, peaks = solution.linear[name], solution.searched[name]
    for kind in ("free", "stuck"):
        for side in SIDES:
            own = sorted(getattr(linear, f"{kind}_peaks")[side], key=lambda p: p.frequency)
            told = solution.stuck_peaks(name, side) if kind == "stuck" else []
            modes = {one.number: one.mode for one in told}
            for number, peak in zip(linear_numbers(peaks, kind, side), own, strict=False):
                case = Case(stiffness=name, kind=kind, mode=modes.get(number, ""))
                mine = peak._replace(number=number)
                out |= _of_peak(solution, levels, case, kind, side, mine)
    for k, stuck in enumerate((q.STUCK_IN_PHASE, q.STUCK_OUT_OF_PHASE)):
        in_phase = stuck == q.STUCK_IN_PHASE
        own_f = [m.frequency for m in linear.modes if m.axis == "x" and m.in_phase == in_phase]
        if own_f:
            parts = _parts(levels, partial(_stuck_ratio, k, own_f[0]))
            out[stuck.name, Case(stiffness=name)] = parts
    return out


def _stuck_ratio(k: int, own: float, level: PeakLevel) -> float:
    return level.stuck[k] / own


def _peak_ratio(place: Place, k: int, own: float, level: PeakLevel) -> float:
    return level.peaks[place][k] / own


def _of_peak(
    solution: ForcedSolution,
    levels: Sequence[PeakLevel],
    case: Case,
    at: float | str,
    side: Side,
    peak: CurvePeak,
) -> dict[Key, tuple[ErrorPart, ...]]:
    """Errors of a peak's frequency and height."""
    place: Place = (at, side, peak.number)
    case = replace(case, mode=peak.mode or case.mode)
    own = peak.frequency, peak.height
    check = None
    if not isinstance(at, str):
        curve = next(c for c in solution.curves if c.case == replace(case, mode=""))
        own = curve.compared(side, peak.number) or own
        mine = [one for one in curve.checked if (one.blade, one.number) == (side, peak.number)]
        check = mine[0] if mine else None
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    mesh = 0.0
    for k, quantity in enumerate((q.PEAK_FREQUENCY, q.PEAK_ACCELERANCE)):
        parts = list(_parts(levels, partial(_peak_ratio, place, k, own[k]), place))
        # of a height that the meshes show by chance: no better known than its frequency
        known = [one.error for one in parts if one.source == MESH and one.known]
        parts = [
            replace(one, error=mesh, basis=f"as of its frequency; {one.basis}")
            if one.source == MESH and one.known and one.error < mesh
            else one
            for one in parts
        ]
        mesh = max(known, default=0.0)
        if check is not None:
            parts = _with_time(parts, check, quantity)
        out[quantity.on(side).named(peak.number), case] = tuple(parts)
    return out


def _with_time(parts: Sequence[ErrorPart], check: TimeCheck, of: Quantity) -> list[ErrorPart]:
    """The parts with what time integration shows: it holds all harmonics, so that where it gives
    the reported motion no more are missing.
    """
    if check.at_top:
        return list(parts)
    kept = [one for one in parts if one.source not in (HARMONICS, SAMPLES)]
    error = check.step if of == q.PEAK_ACCELERANCE else check.apart
    if not math.isfinite(check.difference):
        error = math.nan
    why = "the highest motion that stays, and the next towards the top, which leaves"
    return [*kept, ErrorPart(TIME, error, why)]


def _parts(
    levels: Sequence[PeakLevel], ratio: Callable[[PeakLevel], float], place: Place | None = None
) -> tuple[ErrorPart, ...]:
    """Parts of one number's error.

    Parameters
    ----------
    ratio
        Level -> the number there over that of the run.
    place
        Where the number is, for peaks.
    """
    out = []
    for source in (MESH, MODES, POINTS, HARMONICS, SAMPLES):
        mine = [one for one in levels if one.source == source]
        if place is not None and source in (HARMONICS, SAMPLES):
            mine = [one for one, _ in at_place(levels, source, place)]
        elif place is None:
            mine = [one for one in mine if source not in (HARMONICS, SAMPLES)]
        if place is not None and place[0] == "free":
            mine = [one for one in mine if source != POINTS]
        if not mine:
            continue
        found = [
            (one, ratio(one))
            for one in mine
            if (one.peaks or not one.why) and (place is None or place in one.peaks)
        ]
        good = [(one, r) for one, r in found if math.isfinite(r)]
        seconds = math.fsum(one.seconds for one in mine)
        if not good:
            why = next((one.why for one in mine if one.why), "not found on the level")
            out.append(ErrorPart(source, math.nan, f"not estimated: {why}", None, seconds))
            continue
        error, words = bound(source, good)
        out.append(ErrorPart(source, error, words, None, seconds))
    return tuple(out)


def bound(source: str, found: Sequence[tuple[PeakLevel, float]]) -> tuple[float, str]:
    """Bound of a number's relative error from its other levels, and how it was found.

    Parameters
    ----------
    found
        Levels with the number over that of the run.
    """
    names = ", ".join(one.label for one, _ in found)
    ratios = [1.0, *(r for _, r in found)]
    spread = max(ratios) - min(ratios)
    if source == MESH:
        error, words = _of_meshes(found)
        return error, f"against {names}: {words}"
    if source == SAMPLES:
        # the rule is of second order: a quarter of the change is left
        return spread / (1.0 - 0.25), f"change with {names}, order 2"
    if source == MODES:
        return spread, f"change from {names}: what more modes change is less"
    if source == POINTS:
        # of an error C h^p, p >= 1, levels to the size s show at least the part 1 - s
        return spread / (1.0 - min(one.size for one, _ in found)), f"range with {names}, order 1"
    return _SAFETY * spread, f"range with {names}, factor {_SAFETY:g}"


def _of_meshes(found: Sequence[tuple[PeakLevel, float]]) -> tuple[float, str]:
    """Richardson's error of the run from coarser meshes; their range where they show no order."""
    near = sorted(found, key=lambda one: one[0].size)
    ratios = [1.0, *(r for _, r in near[:2])]
    if len(near) < 2:
        return _SAFETY * two_level_error(ratios[1], 1.0, near[0][0].size, _ORDER), (
            f"order {_ORDER:.2g} of re-entrant edges, two levels, factor {_SAFETY:g}"
        )
    shown = observed_order([1.0, *(one.size for one, _ in near[:2])], ratios)
    if not shown >= _LEAST:
        return _SAFETY * (max(ratios) - min(ratios)), f"range, in no order, factor {_SAFETY:g}"
    error = _SAFETY * two_level_error(ratios[1], 1.0, near[0][0].size, _ORDER)
    return error, (
        f"order {shown:.1f}, taken as {_ORDER:.2g} of re-entrant edges, factor {_SAFETY:g}"
    )


def _reductions(
    wanted: Mapping[Key, Result], parts: Mapping[Key, tuple[ErrorPart, ...]], side: Side
) -> dict[Key, tuple[ErrorPart, ...]]:
    """Of 100 (1 - h / free), the errors of the highest peak h and of the free one, times
    (h / free) / (1 - h / free).
    """
    out, height = {}, q.PEAK_ACCELERANCE.on(side)
    peaks = [one for one in wanted.values() if quantity_of(one.name)[0] == height]
    for key, one in wanted.items():
        if one.name != q.REDUCTION.on(side).name or not one.value:
            continue
        mine = [peak for peak in peaks if replace(peak.case, mode="") == one.case]
        of_free = Case(stiffness=one.case.stiffness, kind="free")
        free = [peak for peak in peaks if peak.case == of_free]
        if mine and free:
            both = (max(found, key=lambda r: r.value) for found in (mine, free))
            out[key] = _reduction(one, *(parts.get((r.name, r.case), ()) for r in both))
    return out


def _reduction(
    one: Result, top: Sequence[ErrorPart], free: Sequence[ErrorPart]
) -> tuple[ErrorPart, ...]:
    """Parts of a reduction's error from those of the highest peak and of the free one."""
    factor, out = abs((100.0 - one.value) / one.value), []
    for source in dict.fromkeys(p.source for p in (*top, *free)):
        mine = [p for p in (*top, *free) if p.source == source]
        error = factor * math.fsum(p.error for p in mine)
        words = f"of the highest peak and of the free one: {mine[0].basis}"
        out.append(ErrorPart(source, error, words, None, mine[0].companion_s))
    return tuple(out)


def _of_best(
    solution: ForcedSolution,
    quantity: Quantity,
    one: Result,
    parts: Mapping[Key, tuple[ErrorPart, ...]],
) -> tuple[ErrorPart, ...]:
    """The best F_C/F_E lies between its neighbours on the curve; its peak is as well known as the
    worst known one of the run's curves, beside what more harmonics change there.
    """
    name = one.case.stiffness
    performance = solution.performances[name]
    best = performance.best
    if best is None:
        return ()
    if quantity == q.BEST_RATIO:
        known = [p.ratio for p in performance.known]
        k = known.index(best.ratio)
        beside = [known[i] for i in (k - 1, k + 1) if 0 <= i < len(known)]
        if not beside:
            return ()
        error = max(max(r / best.ratio, best.ratio / r) for r in beside) - 1.0
        return (ErrorPart("points of the curve", error, "the next F_C/F_E on either side"),)
    of = q.PEAK_FREQUENCY if quantity == q.BEST_FREQUENCY else q.PEAK_ACCELERANCE
    mine = {
        key: told
        for key, told in parts.items()
        if quantity_of(key[0])[0] in (of, of.on("left"))
        and key[1].stiffness == name
        and key[1].force_ratio is not None
    }
    if not mine:
        return ()
    worst = max(mine.values(), key=lambda told: math.fsum(p.error for p in told if p.known))
    out = [replace(p, basis=f"as of the run's peaks: {p.basis}") for p in worst]
    again, top = performance.again, best.worst
    if again is not None and top is not None:
        few, more = (
            next((p for p in one.peaks if (p.blade, p.number) == (top.blade, top.number)), None)
            for one in again
        )
        if few is not None and more is not None:
            here, there = (few.frequency, more.frequency)
            if of == q.PEAK_ACCELERANCE:
                here, there = few.height, more.height
            out = [part for part in out if part.source != HARMONICS]
            change = abs(there / here - 1.0)
            basis = f"change with the harmonics of the run, at F_C/F_E {again[0].ratio:.3g}"
            out.append(ErrorPart(HARMONICS, change, basis))
    if quantity == q.BEST_REDUCTION and one.value:
        factor = abs((100.0 - one.value) / one.value)
        out = [replace(p, error=factor * p.error) for p in out]
    return tuple(out)
