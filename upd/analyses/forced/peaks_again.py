"""A peak of the run found again on another model, or with other choices of the balance.

Climbed to from the run's own top, and looked for in a band about it where that fails.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import ForcedCurve, LinearCurves, TimeCheck, Top
from upd.analyses.forced.linear_limits import linear_limits_of
from upd.analyses.forced.measures import Unsolved
from upd.analyses.forced.mode_peaks import numbered_peaks
from upd.analyses.forced.model import Array, Model
from upd.analyses.forced.paths import (
    BAND,
    BAND_POINTS,
    LONG_STEPS,
    SWEEP_POINTS,
    balance_of,
    respond,
)
from upd.analyses.forced.peaks import climbed, confirmed, with_tops
from upd.analyses.forced.plan import ForcedPlan
from upd.errors import ConvergenceError, one_line
from upd.hbm.balance import Balance
from upd.hbm.peaks import FIRST_REACH, is_near
from upd.hbm.starts import newton
from upd.scene.forced_contact import SIDES, Side

log = logging.getLogger(__name__)
#: first step of a climb that begins at the run's own top, over the usual one: maxima side by side
#: of a flat top are nearer than that
_CLOSE = 0.1
#: points of a path along a band
_MOST_POINTS = 400


class Found(NamedTuple):
    """Frequency in Hz and height in (m/s2)/N of a peak on a level; nan where it was not found."""

    frequency: float
    height: float


NOT_FOUND = Found(math.nan, math.nan)


@dataclass(frozen=True)
class FoundPeaks:
    """What is looked for on every level, by one contact stiffness.

    Attributes
    ----------
    plan, model
        Of the run.
    linear
        Its linear limits.
    curves
        With their peaks and tops.
    """

    plan: ForcedPlan
    model: Model
    linear: LinearCurves
    curves: tuple[ForcedCurve, ...]

    @property
    def bare(self) -> FoundPeaks:
        """Without what a level does not need of the curves: less to send."""
        return replace(self, curves=tuple(_bare(one) for one in self.curves))


def _bare(curve: ForcedCurve) -> ForcedCurve:
    a = curve.answer
    nothing = {name: getattr(a, name)[:0] for name in _ALONG}
    return replace(curve, answer=replace(a, **nothing), accelerance={}, more={})


_ALONG = (
    "frequency",
    "x",
    "contact_displacement",
    "contact_force",
    "state",
    "energy",
    "linear",
    "truncation",
    "aliasing",
    "periodic",
    "highest_harmonic",
)


def linear_of(plan: ForcedPlan, model: Model) -> LinearCurves:
    """The linear limits of a model."""
    force = plan.scene.damper.centrifugal
    problem = balance_of(plan, model, force, (0, *model.excitation.harmonics))
    return linear_limits_of(plan, model, Unsolved(problem), force)


def stuck_frequency(linear: LinearCurves, in_phase: bool) -> float:
    found = (m.frequency for m in linear.modes if m.axis == "x" and m.in_phase == in_phase)
    return next(found, math.nan)


class RunPeak(NamedTuple):
    """A peak of a curve of the run with friction: its blade, the number of its mode, its top."""

    curve: ForcedCurve
    blade: Side
    number: int
    top: Top


def peak_on(
    peaks: FoundPeaks, model: Model, linear: LinearCurves, one: RunPeak, move: Array | None
) -> Found:
    """A peak with friction on another model.

    Parameters
    ----------
    move
        (n, n_run) motion of the model's points from that of the run's; None where they are the
        same.
    """
    old, top = one.curve.answer.balance, one.top
    ratio = expected(peaks.linear, linear, one.number, top.frequency)
    check = one.curve.stayed(one.blade, one.number)
    if check is not None:
        return confirmed_again(peaks.plan, model, linear, one.curve, check, ratio)
    b = balance_of(peaks.plan, model, one.curve.force, old.harmonics.numbers, old.samples)
    x = top.x if move is None else carried(b, old, top.x, move)
    return found_again(peaks.plan, model, one, b, x, ratio)


def confirmed_again(
    plan: ForcedPlan,
    model: Model,
    linear: LinearCurves,
    curve: ForcedCurve,
    check: TimeCheck,
    ratio: float,
) -> Found:
    """The highest motion that stays on another model, where the top of the run's path leaves: the
    border between both moves too.
    """
    old, f, e = curve.answer.balance, ratio * check.frequency, plan.scene.excitation
    given: dict[str, Any] = {"harmonics": old.harmonics.numbers, "samples": old.samples}
    given["settings"] = replace(LONG_STEPS, most_points=_MOST_POINTS)
    for band in (
        np.linspace((1.0 - 2.0 * BAND) * f, (1.0 + 2.0 * BAND) * f, 2 * BAND_POINTS),
        # the loop of a fold may be longer than any band
        np.linspace(e.start, e.stop, SWEEP_POINTS),
    ):
        try:
            answer = respond(plan, model, curve.force, band, **given)
        except ConvergenceError as error:
            log.info("band about %.6g Hz: %s", f, one_line(error))
            continue
        blades = {s: measures.accelerance(answer, model.row(s), curve.force) for s in SIDES}
        path = replace(curve, answer=answer, accelerance=blades, peaks={}, tops={}, checked=())
        if path.empty:
            continue
        path = with_tops(plan, model, linear, path)
        # the other blade changes alike
        tops = {key: top for key, top in path.tops.items() if key == (check.blade, check.number)}
        path = confirmed(plan, model, replace(path, tops=tops))
        for peak in path.peaks[check.blade] if tops else ():
            near = is_near(peak.frequency / f, peak.height / check.integrated)
            if peak.number == check.number and near:
                return Found(peak.frequency, peak.height)
    return NOT_FOUND


def expected(own: LinearCurves, other: LinearCurves, number: int, frequency: float) -> float:
    """Ratio of a peak's frequency on another model to that of the run, between those of the free
    and of the stuck mode by where the peak lies.
    """
    in_phase = number % 2 == 1
    stuck, again = stuck_frequency(own, in_phase), stuck_frequency(other, in_phase)
    free = [one.free_peaks["right"] or one.free_peaks["left"] for one in (own, other)]
    if not (math.isfinite(stuck) and math.isfinite(again) and all(free)):
        return 1.0
    start = free[0][0].frequency
    ends = free[1][0].frequency / start, again / stuck
    if stuck == start:
        return ends[1]
    share = min(max((frequency - start) / (stuck - start), 0.0), 1.0)
    return ends[0] + share * (ends[1] - ends[0])


def found_again(
    plan: ForcedPlan,
    model: Model,
    one: RunPeak,
    b: Balance,
    x: Array,
    ratio: float = 1.0,
    *,
    any_height: bool = False,
    **changes: Any,
) -> Found:
    """A peak of another problem: climbed to from the run's top; in a band about it, then in the
    whole sweep, as the highest of several maxima, where the run has these or the climb fails.

    Parameters
    ----------
    b, x
        The problem, and the run's motion at the top in its unknowns.
    ratio
        Of its frequency to that of the run, as far as the linear limits tell.
    any_height
        Whether it may lie anywhere in the sweep and have any height: the highest of its mode.
    **changes
        Of the problem, as `respond` takes them.
    """
    top, force = one.top, one.curve.force
    for factor in dict.fromkeys((ratio, 1.0)) if not top.crowded else ():
        f = factor * top.frequency
        start = newton(b, x, f)
        if start is not None:
            about = top._replace(frequency=f)
            new = climbed(model, b, start, f, one.blade, force, about, _CLOSE * FIRST_REACH)
            if new is not None:
                return Found(new.frequency, new.height)
    f = ratio * top.frequency
    e = plan.scene.excitation
    bands = [
        np.linspace((1.0 - BAND) * f, (1.0 + BAND) * f, BAND_POINTS),
        # the loop of a fold may be longer than any band
        np.linspace(e.start, e.stop, SWEEP_POINTS),
    ]
    for band in bands:
        given: dict[str, Any] = {"harmonics": b.harmonics.numbers, "samples": b.samples}
        given["settings"] = replace(LONG_STEPS, most_points=_MOST_POINTS)
        try:
            peak = peak_of_mode(
                plan, model, force, one.blade, one.number, band, **(given | changes)
            )
        except ConvergenceError as error:
            log.info("band about %.6g Hz: %s", f, one_line(error))
            continue
        if peak is not None and (any_height or is_near(peak[0] / f, peak[1] / top.height)):
            return Found(*peak)
    return NOT_FOUND


def moved_points(base: Model, other: Model) -> Array | None:
    """(n, n_base) displacements of a model's points from those of the run's, on the same faces, by
    straight lines up the slope; None where the points are the same.
    """
    if np.array_equal(base.position.shape, other.position.shape) and np.allclose(
        _up(base), _up(other), atol=1e-6 * float(np.ptp(_up(base)) or 1.0)
    ):
        return None
    out = np.zeros((other.contacts.n_point, base.contacts.n_point))
    for k in range(len(SIDES)):
        mine, new = np.flatnonzero(base.face == k), np.flatnonzero(other.face == k)
        x, s = _up(base)[mine], _up(other)[new]
        rows = np.unique(np.round(x, 9))
        weight = straight(rows, s)
        for j, row in enumerate(rows):
            on = mine[np.isclose(x, row, atol=1e-8 * max(np.ptp(x), 1.0))]
            # along the damper the motion hardly changes: the mean of the row's points
            out[np.ix_(new, on)] = weight[:, j : j + 1] / len(on)
    return out


def _up(model: Model) -> Array:
    """(n,) places up the slope from the middle of each face, mm."""
    out = np.zeros(len(model.face))
    for k, side in enumerate(SIDES):
        on, face = model.face == k, model.faces[side]
        local = face.position @ face.frame[2]
        out[on] = local - face.weight @ local
    return out


def carried(b: Balance, old: Balance, x: Array, move: Array) -> Array:
    """Unknowns of a motion on another model: the same motion of its points, and the rigid motion
    that goes with it.
    """
    W, _ = old.split(x)
    moved = np.einsum("pq,qdk->pdk", move, W)
    flat = np.concatenate([moved.ravel(), np.zeros(b.rigid)])
    if not b.rigid:
        return flat
    F = b.force(flat, False).force.reshape(len(b.Psi), -1)
    rows = b.Psi[:, b.modal.rigid]
    mean = moved.reshape(len(b.Psi), -1)[:, 0] + b.G0 @ F[:, 0] - b.u0
    a = np.linalg.lstsq(rows, mean, rcond=None)[0]
    return np.concatenate([moved.ravel(), a])


def moved(model: Model, factor: float) -> Model | None:
    """The model with its points nearer to the middle of each face, up the slope.

    The motion of a point between others is theirs by straight lines: that of a face under a rigid
    damper is nearly one. Stiffness and static forces stay with the points.

    Parameters
    ----------
    factor
        On the places up the slope from the middle of a face, at most 1.

    Returns
    -------
    Model or None
        None where the points are in one row.
    """
    n = model.contacts.n_point
    at = np.zeros((n, n))
    faces = {}
    for k, side in enumerate(SIDES):
        face, on = model.faces[side], np.flatnonzero(model.face == k)
        up = face.position @ face.frame[2]
        up = up - face.weight @ up
        rows = np.unique(np.round(up, 6))
        if len(rows) < 2:
            return None
        weight = straight(rows, factor * rows)
        row = np.abs(up[:, None] - rows).argmin(axis=1)
        column = face.position @ face.frame[1]
        mine = np.zeros((len(on), len(on)))
        for i in range(len(on)):
            # the points of every row nearest along the damper
            for j in range(len(rows)):
                there = np.flatnonzero(row == j)
                near = there[np.abs(column[there] - column[i]).argmin()]
                mine[i, near] += weight[row[i], j]
        at[np.ix_(on, on)] = mine
        faces[side] = replace(face, position=mine @ face.position, values=mine @ face.values)

    def rows_of(of: Array) -> Array:
        return np.ascontiguousarray(np.einsum("gp,pdn->gdn", at, of))

    contacts = replace(model.contacts, rows=rows_of(model.contacts.rows))
    return replace(model, contacts=contacts, damper_rows=rows_of(model.damper_rows), faces=faces)


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


# -- a band about a peak ---------------------------------------------------------------------------


def peak_of_mode(
    plan: ForcedPlan,
    model: Model,
    force: float,
    side: Side,
    number: int,
    frequency: Array,
    **changes: object,
) -> tuple[float, float] | None:
    """Frequency and height of a mode's peak on a path along some frequencies; None without.

    Parameters
    ----------
    number
        Of the mode.
    frequency
        (n,) Hz.
    **changes
        As `respond` takes them.
    """
    answer = respond(plan, model, force, frequency, **changes)
    if not len(answer.frequency):
        return None
    size = np.abs(measures.accelerance(answer, model.row(side), force))
    found = numbered_peaks(model, answer, size, plan.scene.excitation.stop)
    mine = [p for p in found if p.number == number]
    return (mine[0].frequency, mine[0].height) if mine else None
