"""Peaks of a curve by harmonic balance: their tops, folds, and whether the motion stays.

A path by harmonic balance runs through motions that a rig never shows: between two folds they are
unstable, and beside a fold the last few may leave for want of harmonics. Each reported peak is
therefore confirmed by time integration that starts from its own motion. Where that leaves, the
highest motion along the path that stays is looked for by bisection down from the top. From there
time integration follows its own motion up again, as a slow sweep does, where more harmonics than
the path has count: how far it comes is the peak.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import takewhile

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import (
    AT_TOP,
    ForcedCurve,
    LinearCurves,
    PointCurve,
    TimeCheck,
    Top,
    fine_grid,
    rising,
)
from upd.analyses.forced.interface_model import SpringMarch, by_coulomb, make_springs, state_at
from upd.analyses.forced.measures import numbered_peaks
from upd.analyses.forced.model import Array, Model, respond
from upd.analyses.forced.plan import ForcedPlan, time_steps
from upd.analyses.measured import CurvePeak
from upd.errors import ConvergenceError, one_line
from upd.hbm import climb
from upd.hbm.faces.march import InterfaceMarch
from upd.hbm.faces.state import InterfaceState
from upd.hbm.faces.sweep import settle
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.coulomb import STICK
from upd.hbm.springs.peak import FIRST_REACH, is_near
from upd.scene.forced_contact import SIDES, Side

log = logging.getLogger(__name__)
#: periods of a time integration from a peak, and how steady it has to be: modal damping of 0.5 %
#: leaves 1e-4 of a disturbance after 300
PERIODS, TOLERANCE = 300, 1e-3
#: change of height up to which a motion stays where it began: one that leaves ends on another
#: branch, and what the harmonics left out change is a part of it
STAYS = 0.05
#: of a top's height, how far down the path a motion that stays is looked for: half the power
LEAST = 0.5**0.5
#: steps in a period of the time integration at least
STEPS = 256


def solve_curve(
    plan: ForcedPlan, model: Model, linear: LinearCurves, name: str, ratio: float
) -> PointCurve:
    """One curve with its peaks, each confirmed where a point slips or opens.

    Parameters
    ----------
    linear
        Linear limits of the model: where every point sticks they are the answer.
    name, ratio
        Of the contact stiffness; F_C/F_E.
    """
    begin, force = time.perf_counter(), plan.scene.damper.centrifugal / ratio
    answer = respond(plan, model, force, fine_grid(plan, model))
    H = {
        k: {side: measures.accelerance(answer, model.row(side), force, k) for side in SIDES}
        for k in model.excitation.harmonics
    }
    read = H.pop(model.excitation.lowest)
    curve = ForcedCurve(name, ratio, force, read, H, {}, answer, time.perf_counter() - begin)
    if curve.empty:
        return curve
    curve = with_tops(plan, model, linear, curve)
    folds = folds_of(curve.frequency, np.abs(curve.accelerance["right"]))
    curve = replace(curve, folds=tuple(folds))
    return confirmed(plan, model, curve)


# -- tops ------------------------------------------------------------------------------------------


def with_tops(
    plan: ForcedPlan, model: Model, linear: LinearCurves, curve: PointCurve
) -> PointCurve:
    """The curve with its peaks between the points of the path."""
    stop, a = plan.scene.excitation.stop, curve.answer
    peaks: dict[Side, tuple[CurvePeak, ...]] = {}
    tops: dict[tuple[Side, int], Top] = {}
    for side in SIDES:
        size, mine, limits = np.abs(curve.accelerance[side]), [], linear.stuck_peaks[side]
        for peak in numbered_peaks(model, a, size, stop):
            i, top = peak.sample, None
            if a.linear[max(i - 1, 0) : i + 2].all() and limits:
                near = min(limits, key=lambda p: abs(p.frequency - peak.frequency))
                top = Top(near.frequency, near.height, a.x[i], False)
            else:
                f = float(a.frequency[i])
                top = climbed(model, a.balance, a.x[i], f, side, curve.force, peak)
            if top is not None:
                peak = peak._replace(frequency=top.frequency, height=top.height)
                tops[side, peak.number] = top
            mine.append(peak)
        peaks[side] = tuple(mine)
    return replace(curve, peaks=peaks, tops=tops)


def climbed(
    model: Model,
    b: Balance,
    x: Array,
    frequency: float,
    side: Side,
    force: float,
    about: CurvePeak | Top | None = None,
    reach: float = FIRST_REACH,
) -> Top | None:
    """The top of the accelerance of a blade uphill from a solved point; None where none is near.

    Parameters
    ----------
    b, x, frequency
        The problem, its unknowns there, Hz.
    about
        The peak that is looked for; any when None.
    reach
        First step along the path.
    """
    k = model.excitation.lowest
    top = climb(b, model.row(side), x, frequency, reach, harmonic=k, power=2)
    if not top.found:
        return None
    height = 1e-3 * (2.0 * np.pi * k * top.frequency) ** 2 * top.amplitude / force
    if about and not is_near(top.frequency / about.frequency, height / about.height):
        return None
    slips = bool((b.period(top.x).state != STICK).any())
    return Top(top.frequency, float(height), top.x, slips)


# -- folds -----------------------------------------------------------------------------------------


def folds_of(f: Array, size: Array) -> Iterator[tuple[CurvePeak, CurvePeak]]:
    """Where a path turns back from rising frequency, and the highest that a slow sweep up reaches
    from where it lands then. A sweep down is one up the path from its other end, at -f.

    Parameters
    ----------
    f, size
        (n,) Hz and height along the path.
    """
    up = rising(f)
    steps = np.sign(np.diff(f))
    low, high = np.minimum(f[:-1], f[1:]), np.maximum(f[:-1], f[1:])
    for i in np.flatnonzero((steps[:-1] > 0.0) & (steps[1:] < 0.0)) + 1:
        # a stable motion at the same frequency, on the part of the path that is reached next
        on = np.flatnonzero((low <= f[i]) & (f[i] <= high) & up[:-1] & up[1:])
        on = on[on > i]
        if not len(on):
            continue
        j = int(on[0])
        share = (f[i] - f[j]) / (f[j + 1] - f[j]) if f[j + 1] != f[j] else 0.0
        top = CurvePeak(float(f[i]), float(size[j] + share * (size[j + 1] - size[j])), j)
        # and the peak that the sweep reaches from there on
        for k in takewhile(lambda k: up[k], range(j + 1, len(f))):
            if size[k] < top.height:
                break
            top = CurvePeak(float(f[k]), float(size[k]), k)
        yield CurvePeak(float(f[i]), float(size[i]), int(i)), top


# -- time integration ------------------------------------------------------------------------------


def confirmed(plan: ForcedPlan, model: Model, curve: PointCurve) -> PointCurve:
    """The curve with its peaks where a point slips or opens as time integration confirms them."""
    loose = [(key, top) for key, top in curve.tops.items() if top.slips]
    if not loose:
        return curve
    springs = make_springs(plan, model)
    steps = max(STEPS, time_steps(plan.scene))
    integrate = partial(stays, springs, model, curve, steps)
    peaks = {side: list(curve.peaks[side]) for side in SIDES}
    motions: dict[int, list[_Reached]] = {}
    checked: list[TimeCheck] = []
    for (side, number), top in loose:
        place = next(k for k, p in enumerate(peaks[side]) if p.number == number)
        found = confirmed_top(integrate, curve, side, peaks[side][place], top, motions)
        checked.append(found)
        if found.stays and not found.at_top:
            peaks[side][place] = peaks[side][place]._replace(
                frequency=found.frequency, height=found.integrated, sample=found.sample
            )
    stable = {side: tuple(mine) for side, mine in peaks.items()}
    return replace(curve, peaks=stable, checked=tuple(checked))


#: a motion that stays: heights (2, 2) of the blades by harmonic balance and by time integration,
#: (m/s2)/N, and its state at the end of a period
_Steady = tuple[Array, InterfaceState]
#: the last motion that stays on a way up to a top: its place on the path, the next one towards the
#: top, heights of `_Steady`
_Reached = tuple[int, int, Array]


def confirmed_top(
    integrate: Callable[..., _Steady | None],
    curve: PointCurve,
    side: Side,
    peak: CurvePeak,
    top: Top,
    motions: dict[int, list[_Reached]],
) -> TimeCheck:
    """The top where it stays, else the highest motion down the path that does.

    Parameters
    ----------
    motions
        Number of a peak -> those that stay beside its top, once they are looked for: one motion
        has the heights of both blades.
    """
    k = SIDES.index(side)
    best = TimeCheck(side, peak.number, peak.mode, top.frequency, top.height, math.nan, peak.sample)
    if (both := integrate(top.x, top.frequency, None)) is not None:
        balance, integrated = (float(one) for one in both[0][:, k])
        return replace(best, balance=balance, integrated=integrated, sample=AT_TOP)
    size, f = np.abs(curve.accelerance[side]), curve.frequency
    if peak.number not in motions:
        found = (_highest(integrate, curve, way) for way in _downhill(curve, size, peak.sample))
        motions[peak.number] = [one for one in found if one is not None]
    for i, beyond, heights in motions[peak.number]:
        balance, integrated = (float(height) for height in heights[:, k])
        if not best.stays or integrated > best.integrated:
            best = replace(
                best,
                frequency=float(f[i]),
                balance=balance,
                integrated=integrated,
                sample=i,
                step=abs(float(size[beyond] / size[i]) - 1.0),
                apart=abs(float(f[beyond] / f[i]) - 1.0),
            )
    return best


def _highest(
    integrate: Callable[..., _Steady | None], curve: PointCurve, way: list[int]
) -> _Reached | None:
    """The last motion of a way up to a top that stays, None without one."""
    x, f = curve.answer.x, curve.frequency
    # `low` leaves, `high` stays
    low, high = 0, len(way)
    kept: _Steady | None = None
    at = high - 1
    while high - low > 1:
        both = integrate(x[way[at]], float(f[way[at]]), None)
        if both is None:
            low = at
        else:
            high, kept = at, both
        at = (low + high) // 2
    if kept is None:
        return None
    # up again from its own motion, as long as that grows
    for k in range(high - 1, -1, -1):
        further = integrate(x[way[k]], float(f[way[k]]), kept)
        if further is None or np.linalg.norm(further[0][1]) < np.linalg.norm(kept[0][1]):
            break
        high, kept = k, further
    return way[high], way[max(high - 1, 0)], kept[0]


def _downhill(curve: PointCurve, size: Array, top: int) -> list[list[int]]:
    """Points of the path from a top down to half its power on either side, the side first on which
    the frequency rises along the path.
    """
    ways, up = [], rising(curve.frequency)
    for step in (1, -1):
        way = [top]
        while 0 <= way[-1] + step < len(size) and size[way[-1]] > LEAST * size[top]:
            way.append(way[-1] + step)
        if len(way) > 1:
            ways.append((float(np.mean(up[way])), way))
    return [way for _, way in sorted(ways, key=lambda one: -one[0])]


def stays(
    springs: SpringMarch,
    model: Model,
    curve: PointCurve,
    steps: int,
    x: Array,
    f: float,
    before: _Steady | None = None,
) -> _Steady | None:
    """The motion that time integration settles to from a place of the path, or from the one before
    on the way up; None where it leaves.
    """
    b, force, k = curve.answer.balance, curve.force, model.excitation.lowest
    scale = 1e-3 * (2.0 * np.pi * k * f) ** 2 / force
    march = InterfaceMarch(springs.march, f, force * model.excitation.drive, steps, by_coulomb)
    at = state_at(springs, model, b, x, f, force) if before is None else before[1].copy()
    try:
        # beside the end of a branch a motion settles slowly
        found = settle(march, at, TOLERANCE, PERIODS if before is None else 2 * PERIODS)
    except ConvergenceError as error:
        log.info("time integration at %.6g Hz: %s", f, one_line(error))
        return None
    integrated = scale * np.abs(found.harmonics[0, : len(SIDES)])
    H = measures.accelerance_at(model, b, x[None], np.array([f]), force)
    balance = np.array([abs(H[side][0]) for side in SIDES])
    size, near, room = np.linalg.norm(balance), balance, STAYS
    if before is not None:
        near = before[0][1]
        room += abs(float(size / np.linalg.norm(before[0][0])) - 1.0)
    change = float(np.linalg.norm(integrated) / np.linalg.norm(near)) - 1.0
    if abs(change) > room or not found.remaining <= STAYS:
        return None
    return np.array([balance, integrated]), at
