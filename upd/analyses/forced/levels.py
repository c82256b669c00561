"""Peaks and stuck frequencies of a response on other levels: coarser and finer in one source of
error each.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

from upd.analyses.base import Resolved
from upd.analyses.forced import effects as checks
from upd.analyses.forced.checked_peak import highest_peaks, peak_changes
from upd.analyses.forced.companions import (
    MODES,
    POINTS,
    ModelMaker,
    NoModel,
    OtherModel,
)
from upd.analyses.forced.curves import LinearCurves, SweptCurve
from upd.analyses.forced.level_values import ForcedLevels, Key, LevelValue
from upd.analyses.forced.march_queue import MarchQueue
from upd.analyses.forced.marches_again import MarchedAgain, MotionAgain, SweptPeakAt
from upd.analyses.forced.mode_peaks import ModePeak, unmoved
from upd.analyses.forced.optimum_levels import between_ratios, optimum_at, optimum_keys
from upd.analyses.forced.peak_results import LEFT
from upd.analyses.forced.peaks_again import ClimbedPeak, PathPeakAt
from upd.analyses.forced.ranges import peak_ranges, sweeps_of
from upd.analyses.forced.solution import ForcedSolution
from upd.analyses.forced.spring_march import SpringMarch
from upd.analyses.forced.stiffness import FaceLaw
from upd.analyses.forced.sweeps import make_springs
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.results import Case
from upd.scene.forced_contact import SIDES, Side

HARMONICS, SAMPLES, STEPS, PATH = "harmonics", "samples", "steps", "continuation"
#: harmonics that the finer levels have more than the run, rising
MORE = (checks.MORE_HARMONICS, 2 * checks.MORE_HARMONICS)
#: times the samples, or the steps of a march, of the finer level
FINER = 2
#: what a peak tells: word of the result's name, and attribute of a level's peak
KINDS = (("frequency", "frequency"), ("accelerance", "height"))
Laws = Mapping[str, Mapping[Side, FaceLaw]]
#: a peak of a sweep with its numbers' keys and what tells them
SweptKeys = tuple[SweptPeakAt, Sequence[tuple[Key, str]]]


def solve_levels(solution: ForcedSolution, laws: Laws, stages: Stages) -> ForcedLevels:
    """Solve what errors are estimated from, and what the checks of harmonics, samples and modes
    need.

    Parameters
    ----------
    solution
        With its curves and sweeps.
    laws
        Stiffness -> side -> law of the face.
    """
    out, scene = ForcedLevels(), solution.plan.scene
    checked = _checked_peak(solution) if scene.left_out.solves else None
    if not scene.estimates and checked is None:
        return out
    maker, nodes = ModelMaker(solution), _nodes(solution)
    with quiet(), threads_for(solution.order), MarchQueue(nodes) as queue:
        for name in solution.models:
            if name not in solution.linear:
                continue
            mine = checked if checked is not None and checked.curve.stiffness == name else None
            if not scene.estimates and mine is None:
                continue
            detail = f"{name}: coarser mesh, more modes, other contact points"
            with stages("error estimates", detail):
                wanted = None if scene.estimates else (MODES,)
                one = _OfStiffness(solution, name, maker.make(name, laws[name], wanted), out)
            with stages("error estimates", f"{name}: peaks again"):
                if scene.estimates:
                    one.linear_numbers()
                    one.peaks(queue)
                if mine is not None:
                    out.checked += one.checks(mine)
    return out


@contextmanager
def quiet() -> Iterator[None]:
    """Warnings of the second solves are not the run's."""
    solver = logging.getLogger("upd.hbm")
    level = solver.level
    solver.setLevel(logging.ERROR)
    try:
        yield
    finally:
        solver.setLevel(level)


def _nodes(solution: ForcedSolution) -> int:
    return max((one.contacts.n_point for one in solution.models.values()), default=1)


def _checked_peak(solution: ForcedSolution) -> PathPeakAt | None:
    """The highest peak of the path with the lowest F_C/F_E that has one."""
    for curve, top in highest_peaks(solution):
        return PathPeakAt(solution.plan, solution.models[curve.stiffness], curve, "right", top)
    return None


@dataclass
class _OfStiffness:
    """What is solved again for one contact stiffness."""

    solution: ForcedSolution
    name: str
    made: list[OtherModel | NoModel]
    out: ForcedLevels

    @property
    def companions(self) -> list[OtherModel]:
        return [one for one in self.made if isinstance(one, OtherModel)]

    def _tell_missing(self, key: Key) -> None:
        for one in self.made:
            if isinstance(one, NoModel):
                self.out.tell(key, one.source, math.nan, f"not estimated: {one.why}")

    def linear_numbers(self) -> None:
        """Stuck frequencies, and peaks free and stuck of both blades."""
        case, own = Case(stiffness=self.name), self.solution.linear[self.name]
        for kind in ("free", "stuck"):
            for side in SIDES:
                for peak in self._linear_peaks(own, kind, side):
                    self._linear_peak(replace(case, kind=kind), kind, side, peak)
        for in_phase, word in ((True, "in_phase"), (False, "out_of_phase")):
            mine = _frequency(own, in_phase)
            if mine is None:
                continue
            key = (f"stuck_{word}", case)
            self._tell_missing(key)
            for one in self.companions:
                found = _frequency(one.linear, in_phase)
                self._add(key, one, math.nan if found is None else found / mine)

    def _linear_peaks(self, linear: LinearCurves, kind: str, side: Side) -> list[ModePeak]:
        if kind == "free":
            return unmoved(linear.free_peaks[side])
        if linear is self.solution.linear[self.name]:
            return self.solution.stuck_peaks(self.name, side)
        return unmoved(linear.stuck_peaks[side])

    def _linear_peak(self, case: Case, kind: str, side: Side, peak: ModePeak) -> None:
        own = self._linear_peaks(self.solution.linear[self.name], kind, side)
        place = own.index(peak)
        name = f"{LEFT * (side == 'left')}peak_{peak.number}"
        for word, attribute in KINDS:
            key = (f"{name}_{word}", replace(case, mode=peak.mode))
            if kind != "free":
                self._tell_missing(key)
            else:
                missing = [m for m in self.made if isinstance(m, NoModel)]
                for none in (m for m in missing if m.source != POINTS):
                    self.out.tell(key, none.source, math.nan, f"not estimated: {none.why}")
            for one in self.companions:
                if kind == "free" and one.source == POINTS:
                    continue
                found = self._linear_peaks(one.linear, kind, side)
                # both rise with frequency
                alike = sorted(found, key=lambda p: p.frequency)
                mine = sorted(own, key=lambda p: p.frequency).index(own[place])
                ratio = (
                    getattr(alike[mine], attribute) / getattr(peak, attribute)
                    if len(found) == len(own)
                    else math.nan
                )
                self._add(key, one, ratio)

    def _add(self, key: Key, one: OtherModel, ratio: float, times: float | None = None) -> None:
        value = LevelValue(
            one.source, one.ladder, one.label, one.size, ratio, one.seconds, one.order, times
        )
        self.out.add(key, value)

    def peaks(self, queue: MarchQueue) -> None:
        """Every peak of both blades, by whom it is told."""
        waiting: list[Callable[[], None]] = []
        springs = {
            one.label: make_springs(self.solution.plan, one.model) for one in self.companions
        }
        ratios = [c.ratio for c in self.solution.curves if c.stiffness == self.name]
        climbed = []
        for ratio in dict.fromkeys(ratios):
            case = Case(stiffness=self.name, force_ratio=ratio)
            sweeps = sweeps_of(self.solution, self.name, ratio)
            marched: dict[tuple[str, int, int], list[SweptKeys]] = {}
            for side in SIDES:
                told = peak_ranges(self.solution, self.name, ratio, side)
                for one in told.values():
                    if not one.agrees:
                        at = self._swept(ratio, side, one.found[0])
                        where = at.sweep.way, at.peak.sample, at.peak.number
                        keys = self._keys(case, side, at.peak)
                        marched.setdefault(where, []).append((at, keys))
                climbed += [
                    at
                    for at in self._paths(ratio, side)
                    if at.peak.number not in told or told[at.peak.number].agrees
                ]
            for peaks in marched.values():
                waiting += self._march(peaks, sweeps, springs, queue)
        optimum = optimum_at(self.solution, self.name)
        if optimum is not None:
            waiting += self._optimum(optimum, springs, queue)
        for one_path in climbed:
            self._climb(one_path)
        for take in waiting:
            take()

    def _paths(self, ratio: float, side: Side) -> list[PathPeakAt]:
        model, plan = self.solution.models[self.name], self.solution.plan
        return [
            PathPeakAt(plan, model, curve, side, peak)
            for curve in self.solution.curves
            if (curve.stiffness, curve.ratio) == (self.name, ratio) and not curve.empty
            for peak in self.solution.numbered_peaks(curve, side)
        ]

    def _swept(self, ratio: float, side: Side, top: ModePeak) -> SweptPeakAt:
        sweeps = sweeps_of(self.solution, self.name, ratio)
        sweep = next(one for one in sweeps if top in one.peaks[side])
        return SweptPeakAt(self.solution.plan, sweep, side, top)

    def _keys(self, case: Case, side: Side, peak: ModePeak) -> list[tuple[Key, str]]:
        name = f"{LEFT * (side == 'left')}peak_{peak.number}"
        return [
            ((f"{name}_{word}", replace(case, mode=peak.mode)), attribute)
            for word, attribute in KINDS
        ]

    def _expected(self, one: OtherModel, number: int, frequency: float) -> float:
        """Ratio of the frequency of a mode's peak on a companion to that of the run, between those
        of the free and of the stuck mode by where the peak lies.
        """
        own, in_phase = self.solution.linear[self.name], number % 2 == 1
        stuck, other = _frequency(own, in_phase), _frequency(one.linear, in_phase)
        free = [
            linear.free_peaks["right"] or linear.free_peaks["left"] for linear in (own, one.linear)
        ]
        if stuck is None or other is None or not all(free):
            return 1.0
        start, ends = (
            free[0][0].frequency,
            (free[1][0].frequency / free[0][0].frequency, other / stuck),
        )
        if stuck == start:
            return ends[1]
        share = min(max((frequency - start) / (stuck - start), 0.0), 1.0)
        return ends[0] + share * (ends[1] - ends[0])

    def _climb(self, at: PathPeakAt) -> None:
        """Levels of a peak that the balance tells."""
        keys = self._keys(at.curve.case, at.side, at.peak)
        base = at.top
        for key, attribute in keys:
            self.out.curve_seconds[key] = at.curve.seconds
            self._tell_missing(key)
            self.out.tell(key, PATH, *at.between_points(attribute))
            if not at.slips:
                exact = "nothing slips or opens there: the linear answer is exact"
                self.out.tell(key, HARMONICS, 0.0, exact)
                self.out.tell(key, SAMPLES, 0.0, exact)

        def add(source: str, label: str, size: float, found: ClimbedPeak) -> None:
            for key, attribute in keys:
                ratio = getattr(found, attribute) / getattr(base, attribute)
                times = found.seconds / base.seconds
                value = LevelValue(source, source, label, size, ratio, found.seconds, times=times)
                self.out.add(key, value)

        if at.slips:
            for more in MORE:
                highest = at.highest + more
                size = max(at.highest, 1) / highest
                add(HARMONICS, f"{highest} harmonics", size, at.with_harmonics(highest))
            count = FINER * at.curve.answer.balance.samples
            add(SAMPLES, f"{count} samples", 1.0 / FINER, at.with_samples(FINER))
        for one in self.companions:
            found = at.on(one, self._expected(one, at.peak.number, at.peak.frequency))
            for key, attribute in keys:
                self._add(key, one, getattr(found, attribute) / getattr(base, attribute))

    def _optimum(
        self, at: SweptPeakAt, springs: Mapping[str, SpringMarch], queue: MarchQueue
    ) -> list[Callable[[], None]]:
        """The peak of the optimum of the performance curve at its F_C/F_E; what lies between those
        of the curve.
        """
        performance, keys = self.solution.performances[self.name], optimum_keys(self.name)
        sweeps = [one for one in performance.sweeps if one.ratio == at.sweep.ratio]
        waiting = self._march([(at, keys)], sweeps, springs, queue)
        left, why = between_ratios(performance), "no lower between the F_C/F_E if convex there"
        if not math.isfinite(left):
            why = "not estimated: the curve over F_C/F_E is not convex beside the optimum"
        self.out.tell(keys[1][0], PATH, left, why)
        return waiting

    def _march(
        self,
        peaks: Sequence[SweptKeys],
        sweeps: Sequence[SweptCurve],
        springs: Mapping[str, SpringMarch],
        queue: MarchQueue,
    ) -> list[Callable[[], None]]:
        """Begin the levels of peaks at one point of a sweep; what adds them when they are ready.

        Parameters
        ----------
        peaks
            Of one mode, of either blade or both, each with its frequency's and its height's key.
        sweeps
            That they took.
        """
        seconds = sum(one.found.seconds for one in sweeps)
        for at, keys in peaks:
            for (key, _), error in zip(keys, at.interpolation(), strict=True):
                self.out.curve_seconds[key] = seconds
                self._tell_missing(key)
                why = "steps of the sweep beside the peak, and the tolerance of a steady motion"
                self.out.tell(key, PATH, error, why)
        first, _ = peaks[0]

        def add(
            make: Callable[[MarchedAgain, str], LevelValue], told: Future[list[MarchedAgain]]
        ) -> None:
            for found, (_, keys) in zip(told.result(), peaks, strict=True):
                for key, attribute in keys:
                    self.out.add(key, make(found, attribute))

        def steps(found: MarchedAgain, attribute: str) -> LevelValue:
            ratio, label = getattr(found, attribute), f"{FINER * first.sweep.found.samples} steps"
            return LevelValue(
                STEPS, STEPS, label, 1.0 / FINER, ratio, found.seconds, times=float(FINER)
            )

        def other(one: OtherModel, found: MarchedAgain, attribute: str) -> LevelValue:
            ratio, took = getattr(found, attribute), one.seconds + found.seconds
            return LevelValue(one.source, one.ladder, one.label, one.size, ratio, took, one.order)

        def read(again: MotionAgain, told: object) -> list[MarchedAgain]:
            del told
            return [at.read(again) for at, _ in peaks]

        finer = first.with_steps(FINER)
        jobs: list[Callable[[], None]] = [partial(add, steps, queue.add(partial(read, finer)))]
        frequency = float(first.sweep.frequency[first.peak.sample])
        for one in self.companions:
            expected = self._expected(one, first.peak.number, frequency)
            again = first.on(one, springs[one.label], expected)
            jobs.append(partial(add, partial(other, one), queue.add(partial(read, again))))
        return jobs

    def checks(self, at: PathPeakAt) -> list[Resolved]:
        """Changes of the checked peak with more harmonics, twice the samples and more modes."""
        base = at.top
        if not base.found:
            return []
        samples, harmonics = FINER * at.curve.answer.balance.samples, at.highest + MORE[0]
        count = self.solution.plan.scene.reduction.modes + checks.MORE_MODES
        found = [
            (
                checks.HARMONICS,
                at.with_harmonics(harmonics),
                f'set balance.harmonics = {harmonics} or more, or "adaptive"',
            ),
            (checks.SAMPLES, at.with_samples(FINER), f"set balance.samples = {samples}"),
            *(
                (
                    checks.MODES,
                    at.on(one, self._expected(one, at.peak.number, at.peak.frequency)),
                    f"set reduction.modes = {count} or more",
                )
                for one in self.companions
                if one.source == MODES
            ),
        ]
        return [
            one
            for check, peak, remedy in found
            for one in peak_changes(check, at.curve, at.peak, base, peak, remedy)
        ]


def _frequency(linear: LinearCurves, in_phase: bool) -> float | None:
    """The lowest stuck frequency of this kind, Hz."""
    modes = (m for m in linear.modes if m.axis == "x" and m.in_phase == in_phase)
    return next((m.frequency for m in modes), None)
