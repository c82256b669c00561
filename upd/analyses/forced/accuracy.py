"""Errors of a response's numbers by source, from the levels that were solved beside the run.

Coarser levels that show an order give Richardson's error with the factor 1.25 of three grids, of
the order that re-entrant edges leave on fine meshes: a higher one is an accident of coarse levels.
Levels without an order (heights that the mesh hardly changes, harmonics where contacts open and
close) have their range as the scale of the error; more contact points are taken as of first order.

A wanted accuracy is reached at the least cost by rounds: they solve the peaks, estimate what every
source leaves in them, and raise what pays: mesh, modes kept, contact points, harmonics, samples.

References
----------
P. J. Roache, Verification and Validation in Computational Science and Engineering (1998), ch. 5;
L. Eca, M. Hoekstra, J. Comput. Phys. 262 (2014) 104: the range of data as the scale of an error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from upd.analyses.base import chosen_by_accuracy, refuse_oversize
from upd.analyses.forced.curves import TimeCheck
from upd.analyses.forced.levels import (
    HARMONICS,
    MESH,
    MODES,
    POINTS,
    RECIPE,
    SAMPLES,
    TIME,
    graded,
    lines_named,
    of_geometry,
    with_gauss,
)
from upd.analyses.forced.peaks_again import (
    STUCK_MODE,
    PeaksAgain,
    Place,
    stuck_places,
)
from upd.analyses.forced.plan import ForcedPlan, make_plan, time_steps
from upd.analyses.forced.results import make_results
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.solve import solve
from upd.hbm.core.fourier import harmonics, sample_count
from upd.progress import Stages
from upd.results import Case, ErrorPart, Estimates, Result
from upd.results import quantities as q
from upd.results.quantities import Quantity, quantity_of
from upd.scene import ForcedScene
from upd.scene.forced_contact import GAUSS, SIDES, Side
from upd.vary.orders import observed_order, two_level_error
from upd.vary.solve import changed
from upd.vary.variation import Overrides, SolvedVariation, Variation
from upd.vary.wanted import LevelChoice, Wanted, plan_wanted, solve_wanted

#: names of accuracies -> numbers they are asked of
ASKED = {"peak_frequency": "peak_?_frequency", "peak": "peak_?_accelerance"}
#: times the elements of the coarsest graded mesh; the first level is the scene's own mesh
_FINER = (1, 1.5, 2, 2.5, 3)
#: times the samples
_MORE_SAMPLES = (1, 2, 4, 8)
#: Gauss points up the slope in place of the scene's lines, which are the first level, and those
#: along the damper
_GAUSS, _COLUMNS = (0, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64), 2
_MODES = (5, 10, 20, 40)
_HARMONICS = (1, 3, 5, 7, 9, 11, 13)


def choices(scene: ForcedScene) -> list[LevelChoice]:
    """What may be chosen of a scene, by source.

    The scene's own mesh and contact points are the lowest levels, finer meshes are graded
    (`graded`); numbers of modes and harmonics may fall below its own. Gauss points
    stand for a face whatever its mesh, so that both errors fall, each by its own choice.
    """
    found = [
        _choice(MODES, "modes kept", _MODES, _modes, "{} a blade"),
        _choice(HARMONICS, "harmonics", _HARMONICS, _highest, "to {}"),
        _choice(SAMPLES, "samples", _MORE_SAMPLES, _samples, "x {}"),
    ]
    if scene.recipe == RECIPE:
        found.insert(0, _choice(MESH, "mesh", _FINER, _mesh, "graded x {:g}", own=True))
    if _raisable(scene):
        # before the mesh, which it decides the counts of
        words = "{} Gauss points up the slope"
        found.insert(0, _choice(POINTS, "contact points", _GAUSS, _points, words, own=True))
    return found


def _choice(
    source: str,
    name: str,
    levels: Sequence[float],
    overrides: Callable[[ForcedScene, Any], Overrides],
    words: str,
    *,
    own: bool = False,
) -> LevelChoice:
    """Levels as overrides of the scene; ``own``: the first is the scene's."""
    labels = [words.format(n) for n in levels]
    if own:
        labels[0] = "of the scene"

    def at(scene: ForcedScene, k: int) -> ForcedScene:
        given: ForcedScene = changed(scene, overrides(scene, levels[k]))
        return scene if own and k == 0 else given

    return LevelChoice(source, name, labels, at)


def _raisable(scene: ForcedScene) -> bool:
    """Whether Gauss points can stand for the scene's: not for lines that it names."""
    return (
        scene.contact.rule != GAUSS
        and scene.contact.share == "area"
        and not lines_named(scene.contact)
    )


def _mesh(scene: ForcedScene, factor: float) -> Overrides:
    return of_geometry(graded(scene, factor))


def _points(scene: ForcedScene, rows: int) -> Overrides:
    del scene
    return with_gauss(rows, _COLUMNS)


def _modes(scene: ForcedScene, count: int) -> Overrides:
    del scene
    return (("reduction.modes", count),)


def _highest(scene: ForcedScene, harmonic: int) -> Overrides:
    del scene
    return (("balance.harmonics", harmonic),)


def _samples(scene: ForcedScene, factor: int) -> Overrides:
    if factor == 1:
        return ()
    needed = sample_count(harmonics(scene.harmonic_numbers))
    return (("balance.samples", factor * max(needed, time_steps(scene))),)


def _trial(scene: ForcedScene) -> ForcedScene:
    return replace(scene, want=("response",), left_out=replace(scene.left_out, solve="no"))


def _estimate(
    solution: ForcedSolution,
    numbers: Sequence[Result],
    stages: Stages,
    memo: list[SolvedVariation],
) -> Estimates:
    """By the levels that the solution has itself."""
    del memo
    return estimate(solution, numbers, stages)


WANTED = Wanted(
    choices,
    ASKED,
    make_plan,
    solve,
    make_results,
    _estimate,
    refuse_oversize,
    chosen_by_accuracy,
    _trial,
)


def plan_to_accuracy(scene: ForcedScene) -> ForcedPlan:
    """The plan of a scene, as `upd.vary.wanted.plan_wanted`."""
    plan: ForcedPlan = plan_wanted(WANTED, make_plan, scene)
    return plan


def solve_to_accuracy(plan: ForcedPlan, stages: Stages) -> ForcedSolution:
    """Run the plan, as `upd.vary.wanted.solve_wanted`."""
    solution: ForcedSolution = solve_wanted(WANTED, plan, stages)[0]
    return solution


# -- errors by source ------------------------------------------------------------------------------


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
        for place, case, own, check in _own(solution, name):
            out |= _of_peak(levels, place, case, own, check)
        for (_, _, number), found in stuck_places(solution.linear[name].modes).items():
            stuck = q.STUCK_IN_PHASE if number == 1 else q.STUCK_OUT_OF_PHASE
            key = stuck.name, Case(stiffness=name)
            if math.isfinite(found.frequency):
                out[key] = _parts(levels, (STUCK_MODE, "right", number), 0, found.frequency)
    wanted = {(one.name, one.case): one for one in numbers if not one.withheld}
    for side in SIDES:
        out |= _reductions(wanted, out, side)
    for key, one in wanted.items():
        if (quantity := quantity_of(one.name)[0]) in _BEST:
            out[key] = _of_best(solution, quantity, one, out)
    return {key: parts for key, parts in out.items() if parts}


def _own(
    solution: ForcedSolution, name: str
) -> Iterator[tuple[Place, Case, tuple[float, float], TimeCheck | None]]:
    """Place, case, frequency and height of every peak that levels are compared with, and what time
    integration makes of it.
    """
    for kind in ("free", "stuck"):
        for side in SIDES:
            for peak in getattr(solution.linear[name], f"{kind}_peaks")[side]:
                case = Case(stiffness=name, kind=kind, mode=peak.mode)
                yield (kind, side, peak.number), case, (peak.frequency, peak.height), None
    for curve in (c for c in solution.curves if c.stiffness == name):
        for side in SIDES:
            for peak in curve.peaks[side]:
                mine = [c for c in curve.checked if (c.blade, c.number) == (side, peak.number)]
                case = replace(curve.case, mode=peak.mode)
                own = curve.compared(side, peak.number) or (peak.frequency, peak.height)
                yield (curve.ratio, side, peak.number), case, own, next(iter(mine), None)


def _of_peak(
    levels: Sequence[PeaksAgain],
    place: Place,
    case: Case,
    own: tuple[float, float],
    check: TimeCheck | None,
) -> dict[Key, tuple[ErrorPart, ...]]:
    """Errors of a peak's frequency and height."""
    _, side, number = place
    out: dict[Key, tuple[ErrorPart, ...]] = {}
    mesh = 0.0
    for k, quantity in enumerate((q.PEAK_FREQUENCY, q.PEAK_ACCELERANCE)):
        parts = list(_parts(levels, place, k, own[k]))
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
        out[quantity.on(side).named(number), case] = tuple(parts)
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


def _parts(levels: Sequence[PeaksAgain], place: Place, k: int, own: float) -> tuple[ErrorPart, ...]:
    """Parts of one number's error.

    Parameters
    ----------
    place, k
        Of its peak; 0 its frequency, 1 its height.
    own
        The number of the run.
    """
    out = []
    for source in (MESH, MODES, POINTS, HARMONICS, SAMPLES):
        mine = [one for one in levels if one.of.source == source]
        if source in (HARMONICS, SAMPLES):
            # solved where something slips
            mine = [one for one in mine if place in one.peaks]
        if not mine or (source == POINTS and place[0] == "free"):
            continue
        ratios = [(one.of, one.peaks[place][k] / own) for one in mine if place in one.peaks]
        good = [(of, ratio) for of, ratio in ratios if math.isfinite(ratio)]
        seconds = math.fsum(one.seconds for one in mine)
        if not good:
            why = next((one.why for one in mine if one.why), "not found on the level")
            out.append(ErrorPart(source, math.nan, f"not estimated: {why}", None, seconds))
            continue
        error, words = bound(source, good)
        out.append(ErrorPart(source, error, words, None, seconds))
    return tuple(out)


def bound(source: str, found: Sequence[tuple[Variation, float]]) -> tuple[float, str]:
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
        # the rule is of second order: a quarter of the change remains
        return spread / (1.0 - 0.25), f"change with {names}, order 2"
    if source == MODES:
        return spread, f"change from {names}: what more modes change is less"
    if source == POINTS:
        # of an error C h^p, p >= 1, levels from the size s to S >= 1 show at least the part S - s
        sizes = [1.0, *(one.size for one, _ in found)]
        return spread / (max(sizes) - min(sizes)), f"range with {names}, order 1"
    return _SAFETY * spread, f"range with {names}, factor {_SAFETY:g}"


def _of_meshes(found: Sequence[tuple[Variation, float]]) -> tuple[float, str]:
    """Richardson's error of the run from coarser meshes; their range where they show no order."""
    near = sorted(found, key=lambda one: one[0].size)[:2]
    ratios, size = [1.0, *(r for _, r in near)], near[0][0].size
    error = _SAFETY * two_level_error(ratios[1], 1.0, size, _ORDER)
    if len(near) < 2:
        return error, f"order {_ORDER:.2g} of re-entrant edges, two levels, factor {_SAFETY:g}"
    shown = observed_order([1.0, *(one.size for one, _ in near)], ratios)
    if not shown >= _LEAST:
        return _SAFETY * (max(ratios) - min(ratios)), f"range, in no order, factor {_SAFETY:g}"
    words = f"order {shown:.1f}, taken as {_ORDER:.2g} of re-entrant edges, factor {_SAFETY:g}"
    return error, words


def _reductions(
    wanted: Mapping[Key, Result], parts: Mapping[Key, tuple[ErrorPart, ...]], side: Side
) -> dict[Key, tuple[ErrorPart, ...]]:
    """Of 100 (1 - h / free), the errors of the highest peak h and of the free one, times
    (h / free) / (1 - h / free).
    """
    out, height = {}, q.PEAK_ACCELERANCE.on(side)
    heights = [one for one in wanted.values() if quantity_of(one.name)[0] == height]
    for key, one in wanted.items():
        if one.name != q.REDUCTION.on(side).name or not one.value:
            continue
        free_case = Case(stiffness=one.case.stiffness, kind="free")
        own = [h for h in heights if replace(h.case, mode="") == one.case]
        free = [h for h in heights if h.case == free_case]
        if own and free:
            both = (max(some, key=lambda r: r.value) for some in (own, free))
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
        key: found
        for key, found in parts.items()
        if quantity_of(key[0])[0] in (of, of.on("left"))
        and key[1].stiffness == name
        and key[1].force_ratio is not None
    }
    if not mine:
        return ()
    worst = max(mine.values(), key=lambda found: math.fsum(p.error for p in found if p.known))
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
