"""Errors of a response's numbers by source, from the levels that were solved beside the run."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from upd.analyses.convergence import (
    ASSUMED,
    UNCONFIRMED,
    estimate_error,
    finer_level_error,
    two_level_error,
)
from upd.analyses.forced import plan as costs
from upd.analyses.forced.companions import MESH, MODES, POINTS
from upd.analyses.forced.estimates_cost import reduction_seconds
from upd.analyses.forced.level_values import ForcedLevels, Key, LevelValue, Untold
from upd.analyses.forced.levels import HARMONICS, PATH, SAMPLES, STEPS
from upd.analyses.forced.peak_results import LEFT
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.reduction_results import reduction_name
from upd.analyses.forced.solution import ForcedSolution
from upd.progress import Stages
from upd.results import Case, ErrorPart, Estimates, Result
from upd.scene.forced_contact import SIDES, Side

#: sources in the order they are told
_ORDER = (MESH, MODES, POINTS, HARMONICS, SAMPLES, STEPS, PATH)
#: numbers of the performance curve, and why they have no error where no level tells them
_RANGE = "a range tells it: the F_C/F_E of the curve beside it, and all at which a sweep is as low"
_AGAIN = "the curve over F_C/F_E is not solved again on other levels"
_UNTOLD = {
    "optimum_ratio": _RANGE,
    "optimum_peak": _AGAIN,
    "optimum_frequency": _AGAIN,
    "optimum_reduction": _AGAIN,
    "lowest_peak": _AGAIN,
    "lowest_peak_at_ratio": _AGAIN,
    "lowest_peak_of_free": _AGAIN,
}
#: points of a path or sweep for half of what it leaves between them: their error falls with the
#: square of the steps
_POINTS_FOR_HALF = math.sqrt(2.0)


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
    levels, cost = solution.levels, _Costs(solution.plan)
    keys = dict.fromkeys((*levels.values, *levels.told))
    out = {key: _parts(levels, key, cost) for key in keys}
    wanted = {(one.name, one.case): one for one in numbers if not one.withheld}
    for side in SIDES:
        out |= _reductions(wanted, out, side)
    out |= _optimum_reductions(wanted, out)
    for key, one in wanted.items():
        if one.name in _UNTOLD and key not in out:
            out[key] = (ErrorPart(PATH, math.nan, f"not estimated: {_UNTOLD[one.name]}"),)
    return out


def _parts(levels: ForcedLevels, key: Key, cost: _Costs) -> tuple[ErrorPart, ...]:
    values, told = levels.values.get(key, []), levels.told.get(key, [])
    seconds, parts = levels.curve_seconds.get(key, 0.0), []
    for source in _ORDER:
        mine = [one for one in values if one.source == source]
        known = [one for one in told if one.source == source]
        if mine or known:
            parts.append(_part(source, mine, known, cost.half(source, seconds, mine)))
    return tuple(parts)


def _part(
    source: str, values: Sequence[LevelValue], told: Sequence[Untold], half_cost: float | None
) -> ErrorPart:
    """The part of one source: the sum of its ladders' and of what is told without."""
    errors, words = [one.error for one in told], [one.why for one in told]
    for ladder in dict.fromkeys(one.ladder for one in values):
        error, basis = bound([one for one in values if one.ladder == ladder])
        errors.append(error)
        words.append(basis)
    seconds = math.fsum(one.seconds for one in values)
    return ErrorPart(source, math.fsum(errors), "; ".join(words), half_cost, seconds)


def bound(ladder: Sequence[LevelValue]) -> tuple[float, str]:
    """Bound of a number's relative error from its other levels, and how it was found.

    Of coarser levels, that of `upd.analyses.convergence.estimate_error`. Of one finer level the
    change to it, and the bound of what that level itself leaves by the same rule. Of several finer
    ones three times the range of all: harmonics come in no order of convergence where contacts
    open, and the range of the levels is then the scale of the error.

    Parameters
    ----------
    ladder
        Levels of one number.

    Returns
    -------
    float, str
        NaN where a level was not found.

    References
    ----------
    L. Eca, M. Hoekstra, J. Comput. Phys. 262 (2014) 104: the range of the data as the scale of an
    error where levels scatter.
    """
    found = [one for one in ladder if math.isfinite(one.ratio)]
    names = ", ".join(one.label for one in found)
    if not found:
        lost = ", ".join(one.label for one in ladder)
        return math.nan, f"not estimated: not found again with {lost}"
    finer = sorted((one for one in found if one.size < 1.0), key=lambda one: -one.size)
    if len(found) == 1 and not finer:
        one = found[0]
        error = UNCONFIRMED * two_level_error(one.ratio, 1.0, one.size, one.order)
        return error, f"against {names}: {_order_words(one)}"
    if not finer:
        sizes = [1.0, *(one.size for one in found)]
        told = estimate_error(sizes, [1.0, *(one.ratio for one in found)])
        return told.error, f"against {names}: {told.basis}"
    if len(finer) > 1:
        ratios = [1.0, *(one.ratio for one in finer)]
        error = UNCONFIRMED * (max(ratios) - min(ratios))
        return error, f"against {names}: {UNCONFIRMED:g} times the range, in no order"
    last = finer[0]
    error, words = finer_level_error(last.ratio, last.size, last.order), _order_words(last)
    return error, f"change with {names}, and what that leaves: {words}"


def _order_words(one: LevelValue) -> str:
    shown = "of the rule" if one.order != ASSUMED else "assumed"
    return f"two levels, order {one.order:.2g} {shown}, factor {UNCONFIRMED:g}"


class _Costs:
    """Seconds that half of an error adds to a run."""

    def __init__(self, plan: ForcedPlan) -> None:
        self.plan = plan
        self._bodies: float | None = None

    def half(self, source: str, seconds: float, values: Sequence[LevelValue]) -> float | None:
        """Of one source.

        Parameters
        ----------
        seconds
            Of the number's curve or sweeps.
        values
            Levels of the source.
        """
        makers: Mapping[str, Callable[[], float]] = {
            MESH: self._mesh,
            MODES: lambda: max((one.seconds for one in values), default=0.0),
            POINTS: lambda: seconds * max(costs.points_growth(self.plan) - 1.0, 0.0),
            PATH: lambda: seconds * (_POINTS_FOR_HALF - 1.0),
        }
        if source in makers:
            return makers[source]()
        times = [one.times for one in values if one.times is not None]
        return seconds * max(max(times, default=1.0) - 1.0, 0.0)

    def _mesh(self) -> float:
        if self._bodies is None:
            scene, size, workers = self.plan.scene, self.plan.size, self.plan.workers
            fine, own = (reduction_seconds(scene, size, workers, r) for r in (2.0, 1.0))
            self._bodies = fine - own
        return self._bodies


def _reductions(
    wanted: Mapping[Key, Result], parts: Mapping[Key, tuple[ErrorPart, ...]], side: Side
) -> dict[Key, tuple[ErrorPart, ...]]:
    """Of 100 (1 - h / free), the errors of the highest peak h and of the free one, times
    (h / free) / (1 - h / free).
    """
    out, prefix = {}, LEFT * (side == "left")
    for key, one in wanted.items():
        if one.name != reduction_name(side):
            continue
        case = one.case
        heights = [
            other
            for (name, at), other in wanted.items()
            if name.startswith(f"{prefix}peak_")
            and name.endswith("_accelerance")
            and replace(at, mode="") == replace(case, mode="")
        ]
        frees = [
            other
            for (name, at), other in wanted.items()
            if name.startswith(f"{prefix}peak_")
            and name.endswith("_accelerance")
            and at == Case(stiffness=case.stiffness, kind="free")
        ]
        if not heights or not frees or not one.value:
            continue
        top = max(heights, key=lambda r: r.value)
        free = max(frees, key=lambda r: r.value)
        both = (parts.get((r.name, r.case), ()) for r in (top, free))
        out[key] = _reduction(one, *both)
    return out


def _optimum_reductions(
    wanted: Mapping[Key, Result], parts: Mapping[Key, tuple[ErrorPart, ...]]
) -> dict[Key, tuple[ErrorPart, ...]]:
    """As `_reductions`, of the optimum of a performance curve; empty without its peak's."""
    out = {}
    for key, one in wanted.items():
        top = parts.get(("optimum_peak", one.case))
        if one.name != "optimum_reduction" or top is None or not one.value:
            continue
        case = Case(stiffness=one.case.stiffness, kind="free")
        frees = [r for k, r in wanted.items() if k[1] == case and k[0].endswith("_accelerance")]
        if frees:
            free = max(frees, key=lambda r: r.value)
            out[key] = _reduction(one, top, parts.get((free.name, free.case), ()))
    return out


def _reduction(
    one: Result, top: Sequence[ErrorPart], free: Sequence[ErrorPart]
) -> tuple[ErrorPart, ...]:
    """Parts of a reduction's error from those of the highest peak and of the free one."""
    factor, told = abs((100.0 - one.value) / one.value), []
    for source in _ORDER:
        mine = [p for p in (*top, *free) if p.source == source]
        if mine:
            error = factor * math.fsum(p.error for p in mine)
            words = f"of the highest peak and of the free one: {mine[0].basis}"
            seconds = mine[0].companion_s
            told.append(ErrorPart(source, error, words, mine[0].half_cost_s, seconds))
    return tuple(told)
