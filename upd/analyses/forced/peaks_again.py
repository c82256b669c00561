"""Peaks of the run found again with one thing changed, on its reduced models.

A linear number is read from the linear limits. A peak on which a point slips or opens is climbed to
from the run's own top; where that fails it is looked for in a band about it, then in the whole
sweep. Where the top of the run is unstable, the highest stable motion is looked for there.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import ForcedCurve, LinearCurves, PointCurve, TimeCheck, Top
from upd.analyses.forced.linear_limits import linear_of, stuck_frequency
from upd.analyses.forced.measures import (
    CANDIDATES,
    CurvePeak,
    StuckMode,
    numbered_peaks,
    stuck_modes,
)
from upd.analyses.forced.model import (
    BAND,
    BAND_POINTS,
    LONG_STEPS,
    SWEEP_POINTS,
    Array,
    Model,
    balance_of,
    respond,
)
from upd.analyses.forced.peaks import climbed, confirmed, with_tops
from upd.analyses.forced.plan import ForcedPlan
from upd.errors import ConvergenceError, UpdError, one_line
from upd.hbm import FrequencyResponse
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.peak import FIRST_REACH, is_near
from upd.hbm.springs.sweep import newton
from upd.linalg.parallel import threads_for
from upd.results import Case
from upd.scene.forced_contact import SIDES, Side
from upd.vary.variation import Variation

log = logging.getLogger(__name__)
#: first step of a climb that begins at the run's own top, over the usual one: maxima side by side
#: of a flat top are nearer than that
_CLOSE = 0.1
#: points of a path along a band
_MOST_POINTS = 400
#: F_C/F_E of a curve or kind of a linear limit; blade; number of the peak
Place = tuple[float | str, Side, int]
#: in place of a kind: the lowest stuck mode in phase, number 1, and out of phase, number 2
STUCK_MODE = "stuck mode"


class Found(NamedTuple):
    """Frequency in Hz and height in (m/s2)/N of a peak; nan where it was not found."""

    frequency: float
    height: float


NOT_FOUND = Found(math.nan, math.nan)


class RunPeak(NamedTuple):
    """The peak of a mode on a curve of the run with friction.

    Attributes
    ----------
    case, force
        Of the curve; F_E, N.
    balance
        Its problem.
    blade, number, mode
        The right blade where that has one.
    top
        By harmonic balance.
    check
        The highest motion that stays, where the top leaves and it lies well below; None else.
    own, other
        What levels are compared with, of this blade and of the other one; None without.
    """

    case: Case
    force: float
    balance: Balance
    blade: Side
    number: int
    mode: str
    top: Top
    check: TimeCheck | None = None
    own: Found = NOT_FOUND
    other: Found | None = None

    @property
    def ratio(self) -> float:
        """F_C/F_E."""
        return float(self.case.force_ratio or 0.0)

    def places(self, again: Found) -> dict[Place, Found]:
        """The peak found again, and the other blade's of the same mode: it changes alike."""
        out: dict[Place, Found] = {(self.ratio, self.blade, self.number): again}
        if self.other is not None:
            f, height = again.frequency / self.own[0], again.height / self.own[1]
            other: Side = "left" if self.blade == "right" else "right"
            out[self.ratio, other, self.number] = Found(f * self.other[0], height * self.other[1])
        return out


class FoundPeaks(NamedTuple):
    """What is looked for again: model, linear limits and peaks of one contact stiffness."""

    plan: ForcedPlan
    model: Model
    linear: LinearCurves
    peaks: tuple[RunPeak, ...]


def run_peaks(curve: PointCurve) -> Iterator[RunPeak]:
    """The peak of every mode once, of the right blade where that has one."""
    for number in dict.fromkeys(number for _, number in curve.tops):
        side: Side = "right" if ("right", number) in curve.tops else "left"
        mode = next(p.mode for p in curve.peaks[side] if p.number == number)
        own, other = (curve.compared(s, number) for s in (side, *(o for o in SIDES if o != side)))
        yield RunPeak(
            curve.case,
            curve.force,
            curve.answer.balance,
            side,
            number,
            mode,
            curve.tops[side, number],
            curve.below(side, number),
            NOT_FOUND if own is None else Found(*own),
            None if own is None or other is None else Found(*other),
        )


class Variant(NamedTuple):
    """The run with one thing changed.

    Attributes
    ----------
    of
        The change, and its size where it is a level.
    model
        The changed model; None where the run's own is solved with other harmonics or samples.
    plan
        With these.
    any_height
        Whether peaks may move far: they are always solved with friction, and the highest of their
        mode is taken, wherever in the sweep and however high.
    seconds
        That making the model took.
    why
        Why there is no model.
    """

    of: Variation
    model: Model | None = None
    plan: ForcedPlan | None = None
    any_height: bool = False
    seconds: float = 0.0
    why: str = ""


class PeaksAgain(NamedTuple):
    """The peaks of the run with one thing changed.

    Attributes
    ----------
    of
        The change.
    peaks
        Place -> what is found there.
    seconds
        It took.
    why
        Why something was not found; "" otherwise.
    """

    of: Variation
    peaks: Mapping[Place, Found]
    seconds: float
    why: str = ""


def solve_again(peaks: FoundPeaks, variant: Variant) -> PeaksAgain:
    """The peaks of the run with one thing changed; a fault becomes its reason."""
    of, model, why = variant.of, variant.model, variant.why
    nothing = PeaksAgain(of, {}, 0.0, why)
    begin = time.perf_counter() - variant.seconds
    if not why and model is not None and model.halved != peaks.model.halved:
        nothing = nothing._replace(why="another kind of contact points")
    if nothing.why:
        log.info("%s, %s: %s", of.source, of.label, nothing.why)
        return nothing
    found: dict[Place, Found] = {}
    with threads_for(len(peaks.model.M if model is None else model.M)):
        try:
            linear, free = peaks.linear, 1.0
            modes: Sequence[StuckMode] = ()
            if model is not None and variant.any_height:
                modes = stuck_modes(model, CANDIDATES * peaks.plan.scene.excitation.stop)
            elif model is not None:
                linear = linear_of(peaks.plan, model)
                modes, free = linear.modes, _free(linear) / _free(peaks.linear)
                found |= stuck_places(modes) | dict(_limits_again(peaks, linear))
        except UpdError as error:
            return nothing._replace(why=one_line(error))
        move = None if model is None else moved_points(peaks.model, model)
        for one in peaks.peaks:
            try:
                if model is None:
                    again = _other_balance(peaks, variant, one)
                elif one.top.slips or variant.any_height:
                    ratio = expected(peaks.linear, modes, free, one)
                    again = peak_on(peaks, model, linear, one, move, ratio, variant.any_height)
                else:
                    again = found.get(("stuck", one.blade, one.number), NOT_FOUND)
            except UpdError as error:
                why = one_line(error)
                log.info("%s, %s, %s: %s", of.source, of.label, one.case, why)
                again = NOT_FOUND
            if again is not None:
                found |= one.places(again)
    return PeaksAgain(of, found, time.perf_counter() - begin, why)


# -- linear limits ---------------------------------------------------------------------------------


def _free(linear: LinearCurves) -> float:
    """The lowest free peak in Hz; nan without."""
    found = linear.free_peaks["right"] or linear.free_peaks["left"]
    return found[0].frequency if found else math.nan


def stuck_places(modes: Sequence[StuckMode]) -> dict[Place, Found]:
    """The lowest stuck modes in phase and out of phase."""
    return {
        (STUCK_MODE, "right", number): Found(stuck_frequency(modes, number == 1), math.nan)
        for number in (1, 2)
    }


def _limits_again(peaks: FoundPeaks, linear: LinearCurves) -> Iterator[tuple[Place, Found]]:
    """Peaks of other limits by rising frequency, with the numbers they have in the run."""
    for kind in ("free", "stuck"):
        for side in SIDES:
            own, other = (
                sorted(getattr(of, f"{kind}_peaks")[side], key=lambda p: p.frequency)
                for of in (peaks.linear, linear)
            )
            for one, peak in zip(own, other, strict=True) if len(own) == len(other) else ():
                yield (kind, side, one.number), Found(peak.frequency, peak.height)


def expected(own: LinearCurves, modes: Sequence[StuckMode], free: float, one: RunPeak) -> float:
    """Ratio of a peak's frequency on another model to that of the run, between those of the free
    and of the stuck mode by where the peak lies.

    Parameters
    ----------
    modes
        Stuck modes of the other model.
    free
        Ratio of the free frequencies.
    """
    in_phase = one.number % 2 == 1
    stuck, again = (stuck_frequency(found, in_phase) for found in (own.modes, modes))
    start = _free(own)
    if not math.isfinite(stuck + again + start + free):
        return 1.0
    if stuck == start:
        return again / stuck
    share = min(max((one.top.frequency - start) / (stuck - start), 0.0), 1.0)
    return free + share * (again / stuck - free)


# -- peaks with friction ---------------------------------------------------------------------------


def _other_balance(peaks: FoundPeaks, variant: Variant, one: RunPeak) -> Found | None:
    """A peak with more harmonics or samples; None where neither matters: all sticks, or the height
    is that of a time integration.
    """
    top, old = one.top, one.balance
    if variant.plan is None or not top.slips or one.check is not None:
        return None
    b = balance_of(variant.plan, peaks.model, one.force, variant.plan.scene.harmonic_numbers)
    if old.start == "static":
        # from the static state of the run
        b = b.with_sliders("static", old.slider)
    return found_again(peaks, peaks.model, one, b, b.embedded(top.x, old))


def peak_on(
    peaks: FoundPeaks,
    model: Model,
    linear: LinearCurves,
    one: RunPeak,
    move: Array | None,
    ratio: float = 1.0,
    any_height: bool = False,
) -> Found:
    """A peak with friction on another model.

    Parameters
    ----------
    linear
        Limits of that model.
    move
        (n, n_run) motion of the model's points from that of the run's; None where they are the
        same.
    ratio
        Of its frequency to that of the run, as far as the linear limits tell.
    any_height
        As of `Variant`.
    """
    old, top = one.balance, one.top
    if one.check is not None:
        return _confirmed_again(peaks.plan, model, linear, one, one.check, ratio)
    b = balance_of(peaks.plan, model, one.force, old.harmonics.numbers, old.samples)
    same = move is None and b.contacts.tangents == old.contacts.tangents
    x = top.x if same else carried(b, old, top.x, move)
    return found_again(peaks, model, one, b, x, ratio, any_height)


def _confirmed_again(
    plan: ForcedPlan,
    model: Model,
    linear: LinearCurves,
    one: RunPeak,
    check: TimeCheck,
    ratio: float,
) -> Found:
    """The highest stable motion on another model, where the top of the run is unstable: the border
    between both moves too.
    """
    key = check.blade, check.number

    def stable(answer: FrequencyResponse) -> Iterator[CurvePeak]:
        blades = {s: measures.accelerance(answer, model.row(s), one.force) for s in SIDES}
        path = ForcedCurve(one.case.stiffness, one.ratio, one.force, blades, {}, {}, answer, 0.0)
        path = with_tops(plan, model, linear, path)
        # the other blade changes alike
        tops = {at: top for at, top in path.tops.items() if at == key}
        path = confirmed(plan, model, replace(path, tops=tops), check)
        return iter(path.peaks[check.blade] if tops else ())

    f = ratio * check.frequency
    return _on_a_path(plan, model, one, one.balance, f, check.integrated, 2 * BAND, stable)


def found_again(
    peaks: FoundPeaks,
    model: Model,
    one: RunPeak,
    b: Balance,
    x: Array,
    ratio: float = 1.0,
    any_height: bool = False,
) -> Found:
    """A peak of another problem: climbed to from the run's top; on a path as the highest of several
    maxima, where the run has these or the climb fails.

    Parameters
    ----------
    b, x
        The problem, and the run's motion at the top in its unknowns.
    ratio, any_height
        As of `peak_on`.
    """
    top, force = one.top, one.force
    for factor in dict.fromkeys((ratio, 1.0)) if not top.crowded else ():
        f = factor * top.frequency
        start = newton(b, x, f)
        if start is not None:
            about = top._replace(frequency=f)
            new = climbed(model, b, start, f, one.blade, force, about, _CLOSE * FIRST_REACH)
            if new is not None:
                return Found(new.frequency, new.height)

    def balanced(answer: FrequencyResponse) -> Iterator[CurvePeak]:
        size = np.abs(measures.accelerance(answer, model.row(one.blade), force))
        return iter(numbered_peaks(model, answer, size, peaks.plan.scene.excitation.stop))

    height = math.nan if any_height else top.height
    return _on_a_path(peaks.plan, model, one, b, ratio * top.frequency, height, BAND, balanced)


def _on_a_path(
    plan: ForcedPlan,
    model: Model,
    one: RunPeak,
    b: Balance,
    f: float,
    height: float,
    width: float,
    read: Callable[[FrequencyResponse], Iterator[CurvePeak]],
) -> Found:
    """A peak on the path along a band about its frequency, else along the whole sweep: the loop of
    a fold may be longer than any band.

    Parameters
    ----------
    b
        Its harmonics and samples.
    f, height
        Where it is expected, Hz and (m/s2)/N; nan where any height is taken.
    width
        Half of that of the band, as a share of f.
    read
        The peaks of a path.
    """
    e = plan.scene.excitation
    settings = replace(LONG_STEPS, most_points=_MOST_POINTS)
    for band in (
        np.linspace((1.0 - width) * f, (1.0 + width) * f, round(BAND_POINTS * width / BAND)),
        np.linspace(e.start, e.stop, SWEEP_POINTS),
    ):
        given = {"harmonics": b.harmonics.numbers, "samples": b.samples, "settings": settings}
        try:
            answer = respond(plan, model, one.force, band, **given)
        except ConvergenceError as error:
            log.info("band about %.6g Hz: %s", f, one_line(error))
            continue
        for peak in read(answer) if len(answer.frequency) else ():
            near = math.isnan(height) or is_near(peak.frequency / f, peak.height / height)
            if peak.number == one.number and near:
                return Found(peak.frequency, peak.height)
    return NOT_FOUND


# -- on other contact points -----------------------------------------------------------------------


def moved_points(base: Model, other: Model) -> Array | None:
    """(n, n_base) displacements of a model's points from those of the run's, on the same faces, by
    straight lines up the slope; None where the points are the same.
    """
    here, there = places_up(base), places_up(other)
    if here.shape == there.shape and np.allclose(
        here, there, atol=1e-6 * float(np.ptp(here) or 1.0)
    ):
        return None
    out = np.zeros((other.contacts.n_point, base.contacts.n_point))
    for k in range(len(SIDES)):
        mine, new = np.flatnonzero(base.face == k), np.flatnonzero(other.face == k)
        x, s = here[mine], there[new]
        rows = np.unique(np.round(x, 9))
        weight = straight(rows, s)
        for j, row in enumerate(rows):
            on = mine[np.isclose(x, row, atol=1e-8 * max(np.ptp(x), 1.0))]
            # along the damper the motion hardly changes: the mean of the row's points
            out[np.ix_(new, on)] = weight[:, j : j + 1] / len(on)
    return out


def places_up(model: Model) -> Array:
    """(n,) places up the slope from the middle of each face, mm."""
    out = np.zeros(len(model.face))
    for k, side in enumerate(SIDES):
        on, face = model.face == k, model.faces[side]
        local = face.position @ face.frame[2]
        out[on] = local - face.weight @ local
    return out


def carried(b: Balance, old: Balance, x: Array, move: Array | None) -> Array:
    """Unknowns of a motion on another model: the same motion of its points, and the rigid motion
    that goes with it.

    Parameters
    ----------
    move
        As of `moved_points`. A model with both sliding directions does not move along the damper.
    """
    W, rest = old.split(x)
    if b.contacts.tangents > old.contacts.tangents:
        W = np.insert(W, 1, 0.0, axis=1)
    if move is None:
        return np.concatenate([W.ravel(), rest])
    moved = np.einsum("pq,qdk->pdk", move, W)
    flat = np.concatenate([moved.ravel(), np.zeros(b.rigid)])
    if not b.rigid:
        return flat
    F = b.force(flat).force.reshape(len(b.Psi), -1)
    rows = b.Psi[:, b.modal.rigid]
    mean = moved.reshape(len(b.Psi), -1)[:, 0] + b.G0 @ F[:, 0] - b.u0
    a = np.linalg.lstsq(rows, mean, rcond=None)[0]
    return np.concatenate([moved.ravel(), a])


def straight(rows: Array, s: Array) -> Array:
    """(m, n) values at s by straight lines between rows, and beyond their ends.

    Parameters
    ----------
    rows
        (n,) rising.
    s
        (m,).
    """
    if len(rows) == 1:
        return np.ones((len(s), 1))
    k = np.clip(np.searchsorted(rows, s) - 1, 0, len(rows) - 2)
    share = (s - rows[k]) / (rows[k + 1] - rows[k])
    out = np.zeros((len(s), len(rows)))
    out[np.arange(len(s)), k], out[np.arange(len(s)), k + 1] = 1.0 - share, share
    return out
