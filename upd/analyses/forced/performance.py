"""Performance curve: peak accelerance of the right blade and its frequency against F_C/F_E.

While every point sticks a peak is followed by itself. Below the F_C/F_E at which a point moves at a
peak, harmonic balance alone follows it on, through folds and until it is lost; a scene that asks
for time marches is swept there, up and down over the whole range, each F_C/F_E from its static
state: at some of the curve, and at all beside the lowest highest point.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import replace
from functools import partial

import numpy as np

from upd.analyses.forced.curves import ForcedCurve, LinearCurves, SweptCurve
from upd.analyses.forced.march_queue import MarchQueue
from upd.analyses.forced.measures import ComplexArray, PathPeak
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.performance_curve import Branch, Performance
from upd.analyses.forced.plan import EVERY, ForcedPlan
from upd.analyses.forced.read_points import ends, settle_read
from upd.analyses.forced.solution import ForcedSolution, tell_stuck_peaks
from upd.analyses.forced.spring_march import SpringMarch
from upd.analyses.forced.sweeps import SweepJob, both_ways, make_springs, spread
from upd.hbm.checks import stuck_points
from upd.hbm.coulomb import LIFT
from upd.hbm.peaks import performance_curve
from upd.hbm.refined_sweep import Told
from upd.progress import Stages

#: steps of the sweeps and the smallest beside peaks, as shares of the frequency, and the periods
#: after which they go on: coarser than the sweeps of a curve, which the peaks' heights feel by
#: about a hundredth; what is read from them is marched on, see `upd.analyses.forced.read_points`
STEP, LEAST, MOST_PERIODS = 0.02, 2e-3, 220
#: difference of a whole curve's highest point from the highest followed peak, between whose points
#: it is read, beyond which it is another peak
OTHER = 0.05


def follow_peaks(
    plan: ForcedPlan, model: Model, curve: ForcedCurve, linear: LinearCurves
) -> Performance:
    """Follow every stuck peak from the highest F_C/F_E to the lowest by harmonic balance.

    Parameters
    ----------
    curve
        Any solved curve of the model: its harmonic balance is scaled.
    linear
        Of the model: its stuck peaks are where every branch begins.
    """
    told = _named_peaks(plan, model, linear)
    branches = tuple(_branch(plan, model, curve, peak, name) for name, peak in told.items())
    return _between_limits(model, linear, branches)


def stuck_peaks(
    plan: ForcedPlan, model: Model, curve: ForcedCurve, linear: LinearCurves
) -> Performance:
    """The stuck peaks, down to the last F_C/F_E at which every point sticks.

    Parameters
    ----------
    curve, linear
        As `follow_peaks`.
    """
    told = _named_peaks(plan, model, linear)
    branches = tuple(_stuck_branch(plan, curve, peak, name) for name, peak in told.items())
    return _between_limits(model, linear, branches)


def beside_branches(found: Performance, curves: Sequence[ForcedCurve]) -> Performance:
    """The peaks followed, with what whole curves of the same model have beside them.

    Where points move even at the highest F_C/F_E, a stuck peak may lead to a branch that is not the
    highest: only a whole curve tells.

    Parameters
    ----------
    curves
        Of the same model; those that stopped early say nothing.
    """
    ratio, _, height, _ = found.highest
    beside = []
    for one in (c for c in curves if not c.stopped):
        if not len(ratio) or not ratio[0] <= one.ratio <= ratio[-1]:
            continue
        size = np.abs(one.accelerance["right"])
        at = int(size.argmax())
        followed = float(np.exp(np.interp(np.log(one.ratio), np.log(ratio), np.log(height))))
        if abs(float(size[at]) / followed - 1.0) > OTHER:
            beside.append((one.ratio, float(one.frequency[at]), float(size[at]), followed))
    return replace(found, beside=tuple(beside))


def _named_peaks(plan: ForcedPlan, model: Model, linear: LinearCurves) -> dict[str, ModePeak]:
    told = tell_stuck_peaks(model, linear.stuck_peaks["right"], plan.scene.excitation.stop)
    return {f"peak {one.number}" if len(told) > 1 else "peak": one for one in told}


def _between_limits(
    model: Model, linear: LinearCurves, branches: tuple[Branch, ...]
) -> Performance:
    # the right blade's own, or where it is not excited that of the left one
    free = model.excitation.free_blades[-1]
    return Performance(
        branches,
        _highest(linear.free[free], linear.free_peaks[free]),
        _highest(linear.stuck["right"], linear.stuck_peaks["right"]),
    )


def _stuck_branch(plan: ForcedPlan, curve: ForcedCurve, peak: ModePeak, name: str) -> Branch:
    omega = np.array([2.0 * np.pi * peak.frequency])
    kept = []
    for ratio in _ratios(plan):
        b = curve.answer.balance.with_loads(1.0, float(curve.ratio / ratio))
        if not stuck_points(b, omega)[0]:
            break
        kept.append(ratio)
    ratio = np.array(kept[::-1])
    every = np.ones(len(ratio))
    f, height = peak.frequency * every, peak.height * every
    return Branch(name, ratio, f, height, 0.0 * every, complete=True, message="", mode=peak.mode)


class PerformanceSweeps:
    """As `follow_peaks` while every point sticks, and by sweeps up and down below.

    Those that are known to be wanted begin at once.

    Parameters
    ----------
    curve, linear
        As `follow_peaks`.
    queue
        Where they run.
    """

    def __init__(
        self, solution: ForcedSolution, curve: ForcedCurve, linear: LinearCurves, queue: MarchQueue
    ) -> None:
        self.plan, self.name, self.queue = solution.plan, curve.stiffness, queue
        model = solution.models[self.name]
        self.stuck = stuck_peaks(self.plan, model, curve, linear)
        ratio = _ratios(self.plan)
        least = [one.ratio.min(initial=np.inf) for one in self.stuck.branches]
        # every branch sticks above; the swept ones fall
        self.swept = ratio[ratio < max(least, default=np.inf)]
        self._begun: dict[int, Future[list[SweptCurve]]] = {}
        if len(self.swept):
            self.springs = make_springs(self.plan, model)
            self._begin(sorted({*range(0, len(self.swept), EVERY), len(self.swept) - 1}))

    def _begin(self, wanted: Sequence[int]) -> None:
        for k in wanted:
            job = _job(self.plan, self.springs, self.name, self.swept[k])
            self._begun[k] = self.queue.add(partial(_settled_ways, self.plan, job))

    def finish(self, stages: Stages) -> Performance:
        """Wait for them, and sweep beside the lowest highest point."""
        known, found = self.stuck, dict[int, list[SweptCurve]]()
        while len(found) < len(self._begun):
            count = len(self._begun) - len(found)
            with stages("performance", f"{self.name}: sweeps up and down at {count} F_C/F_E"):
                found = {k: one.result() for k, one in self._begun.items()}
            known = _joined(self.stuck, found, self.swept)
            self._begin(_beside(known, self.swept, found))
        return known


def _ratios(plan: ForcedPlan) -> Array:
    """(n,) F_C/F_E of the curve, falling."""
    choice = plan.scene.performance
    return np.asarray(np.geomspace(choice.highest, choice.lowest, choice.points))


def _job(plan: ForcedPlan, springs: SpringMarch, name: str, ratio: float) -> SweepJob:
    e = plan.scene.excitation
    return SweepJob(
        name,
        float(ratio),
        springs.march,
        spread(e.start, e.stop, STEP),
        springs.at_rest(),
        least=LEAST,
        most_periods=MOST_PERIODS,
    )


def _settled_ways(plan: ForcedPlan, job: SweepJob, told: Told | None = None) -> list[SweptCurve]:
    """Sweeps up and down, settled where they are read."""
    return [settle_read(plan, job, one, told) for one in both_ways(plan, job, told)]


def _beside(known: Performance, swept: Array, found: dict[int, list[SweptCurve]]) -> list[int]:
    """The F_C/F_E next to the lowest highest point that are not swept yet."""
    ratio, _, height, _ = known.highest
    at = int(np.abs(swept - ratio[height.argmin()]).argmin())
    return [k for k in (at - 1, at + 1) if 0 <= k < len(swept) and k not in found]


def _joined(stuck: Performance, found: dict[int, list[SweptCurve]], swept: Array) -> Performance:
    """The branches that stick, and the peaks of the sweeps below them."""
    tops, rising = [], sorted(found, reverse=True)
    for k in rising:
        top = highest_of(found[k])
        if top is not None:
            tops.append((float(swept[k]), *top))
    sweeps = tuple(one for k in rising for one in found[k])
    return replace(
        stuck,
        branches=tuple(_with_sweeps(one, sweeps) for one in stuck.branches),
        swept=np.array(tops).reshape(len(tops), 4).T,
        sweeps=sweeps,
    )


def highest_of(sweeps: Sequence[SweptCurve]) -> tuple[float, float, float] | None:
    """Frequency of the highest point of some sweeps, its height, and the least of their highest;
    None where nothing was swept.
    """
    tops = [_top(one) for one in sweeps if len(one.frequency)]
    if not tops:
        return None
    f, _, height = max(tops, key=lambda one: one[2])
    return f, height, min(one[1] for one in tops)


def sweep_peak(
    plan: ForcedPlan, springs: SpringMarch, name: str, ratio: float
) -> tuple[float, float, float] | None:
    """As `highest_of` the sweeps up and down of a performance curve at one F_C/F_E.

    Parameters
    ----------
    springs
        Of the model.
    name
        Of its stiffness.
    """
    return highest_of(_settled_ways(plan, _job(plan, springs, name, ratio)))


def _top(one: SweptCurve) -> tuple[float, float, float]:
    """Frequency of the highest point of a sweep, and its least and largest height."""
    size = np.abs(one.accelerance["right"])
    at = int(size.argmax())
    points = [(float(one.frequency[at]), *ends(one, at, float(size[at])))]
    points += [
        (peak.frequency, *ends(one, peak.sample, peak.height)) for peak in one.peaks["right"]
    ]
    return max(points, key=lambda point: point[2])


def _with_sweeps(branch: Branch, sweeps: Sequence[SweptCurve]) -> Branch:
    """A branch that sticks, with the peaks of its mode in the sweeps below."""
    rows: list[tuple[float, ...]] = []
    for at in dict.fromkeys(one.ratio for one in sweeps):
        mine = [
            (peak, one.found, ends(one, peak.sample, peak.height))
            for one in sweeps
            for peak in one.peaks["right"]
            if one.ratio == at and peak.mode == branch.mode
        ]
        if mine:
            peak, found, (_, height) = max(mine, key=lambda row: row[2][1])
            low = min(ends[0] for _, _, ends in mine)
            rows.append((at, peak.frequency, height, float(found.share[peak.sample, 0]), low))
    told = np.array(rows).reshape(len(rows), 5).T
    own = (branch.ratio, branch.frequency, branch.height, branch.lift, branch.height)
    above = branch.ratio > max((one.ratio for one in sweeps), default=0.0)
    columns = [np.append(part, one[above]) for part, one in zip(told, own, strict=True)]
    ratio, frequency, high, lift, least = columns
    ended = next((one for one in sweeps if one.stopped), None)
    message = "" if ended is None else f"{ended.where}, at F_C/F_E {ended.ratio:.4g}"
    return Branch(
        branch.name, ratio, frequency, high, lift, ended is None, message, branch.mode, least
    )


def _highest(curve: ComplexArray, peaks: Sequence[PathPeak]) -> float:
    """Of a curve within the sweep, an end of it among them."""
    return max([float(np.abs(curve).max()), *(one.height for one in peaks)])


def _branch(
    plan: ForcedPlan, model: Model, curve: ForcedCurve, peak: ModePeak, name: str
) -> Branch:
    k = model.excitation.lowest
    # With every gap closed at rest a factor on F_E is its inverse on F_C.
    found = performance_curve(
        curve.answer.balance,
        model.row("right"),
        curve.ratio / _ratios(plan),
        peak.frequency,
        harmonic=k,
    )
    omega = 2 * np.pi * k * found.frequency
    height = 1e-3 * omega**2 * found.amplitude / (curve.force * found.factor)
    lift = found.state[..., LIFT].mean(axis=1)
    ratios, frequency, height, lift = (
        part[::-1] for part in (curve.ratio / found.factor, found.frequency, height, lift)
    )
    message = "" if found.status == "complete" else found.message
    return Branch(name, ratios, frequency, height, lift, not message, message, peak.mode)
