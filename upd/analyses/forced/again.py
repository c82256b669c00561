"""Peaks of the run found again with one thing changed, on its reduced models.

Linear numbers are those of the linear limits. A peak with friction is climbed to from the run's own
top; on other contact points, and where the climb fails, it is looked for in a band about it, then
in the whole sweep. A change of a top is also that of the highest motion that stays below it.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import LinearCurves, PointCurve, TimeCheck, Top
from upd.analyses.forced.linear_limits import linear_of, stuck_frequency
from upd.analyses.forced.measures import CurvePeak, numbered_peaks
from upd.analyses.forced.model import (
    BAND,
    BAND_POINTS,
    LONG_STEPS,
    SWEEP_POINTS,
    Model,
    balance_of,
    make_model,
    respond,
)
from upd.analyses.forced.peaks import climbed
from upd.analyses.forced.plan import ForcedPlan, parameters_of
from upd.analyses.forced.stiffness import face_laws
from upd.analyses.seated.bodies import Bodies, make_bodies
from upd.errors import ConvergenceError, UpdError, one_line
from upd.hbm.springs.balance import Balance
from upd.hbm.springs.peak import FIRST_REACH, is_near
from upd.hbm.springs.starts import newton
from upd.linalg.parallel import threads_for
from upd.progress import Stages
from upd.results import Case, Result
from upd.results import quantities as q
from upd.scene.forced_contact import SIDES, Side
from upd.vary.solve import changed
from upd.vary.variation import SolvedVariation, Variation

log = logging.getLogger(__name__)
#: first step of a climb that begins at the run's own top, over the usual one: maxima side by side
#: of a flat top are nearer than that
_CLOSE = 0.1
#: points of a path along a band
_MOST_POINTS = 400


class RunCurve(NamedTuple):
    """A curve of the run with friction, without its path; attributes as of `ForcedCurve`."""

    case: Case
    force: float
    balance: Balance
    peaks: Mapping[Side, Sequence[CurvePeak]]
    tops: Mapping[tuple[Side, int], Top]
    checked: Sequence[TimeCheck] = ()

    @property
    def ratio(self) -> float:
        """F_C/F_E."""
        return float(self.case.force_ratio or 0.0)


def run_curve(curve: PointCurve) -> RunCurve:
    """The curve without its path."""
    balance = curve.answer.balance
    return RunCurve(curve.case, curve.force, balance, curve.peaks, curve.tops, curve.checked)


class Run(NamedTuple):
    """What is looked for again: the curves of one contact stiffness, with its model and limits."""

    plan: ForcedPlan
    name: str
    model: Model
    linear: LinearCurves
    curves: tuple[RunCurve, ...]


class Variant(NamedTuple):
    """The run with one thing changed.

    Attributes
    ----------
    of
        The change. Without a size it is no level: peaks may then move far, and the highest of their
        mode is taken, wherever in the sweep and however high.
    plan
        With it; None where there is none.
    model
        The changed model; None where the run's own is solved with other harmonics or samples.
    seconds
        That making the model took.
    why
        Why there is no model.
    """

    of: Variation
    plan: ForcedPlan | None = None
    model: Model | None = None
    seconds: float = 0.0
    why: str = ""


def make_variant(
    plan: ForcedPlan, name: str, base: Model, bodies: Bodies | None, of: Variation
) -> Variant:
    """The model of a variation with the sliding directions and the static state of the run's.

    Parameters
    ----------
    plan, name
        With the totals of the contact stiffness of this name.
    base
        Of the run.
    bodies
        Of the run; None: they are meshed again.
    """
    begin, fixed = time.perf_counter(), "one" if base.contacts.tangents < 2 else "two"
    if not of.overrides:
        return Variant(of, why="the mesh has no such level")
    try:
        scene = changed(plan.scene, (("contact.directions", fixed), *of.overrides))
        other = replace(plan, scene=scene, parameters=parameters_of(scene), workers=1)
        if {path.partition(".")[0] for path, _ in of.overrides} == {"balance"}:
            return Variant(of, other)
        laws = face_laws(scene.stiffness[name], Stages())
        state = base.state if scene.contact.static == plan.scene.contact.static else None
        model = make_model(other, bodies or make_bodies(other), laws, state)
    except UpdError as error:
        return Variant(of, why=one_line(error))
    return Variant(of, other, model, time.perf_counter() - begin)


def solve_again(run: Run, variant: Variant) -> SolvedVariation:
    """The numbers of the run's peaks with one thing changed; a fault becomes its reason."""
    of, begin = variant.of, time.perf_counter() - variant.seconds
    model, numbers = variant.model or run.model, list[Result]()
    if variant.plan is None:
        log.info("%s, %s: %s", of.source, of.label, variant.why)
        return SolvedVariation(of, reason=variant.why)
    with threads_for(len(model.M)):
        linear = run.linear
        if variant.model is not None:
            linear = linear_of(variant.plan, model)
            numbers += limit_results(run.name, linear)
        for curve in run.curves:
            changes = _changes(run, variant.plan, model, linear, curve, of)
            numbers += changed_results(curve, changes, linear)
    return SolvedVariation(of, numbers, time.perf_counter() - begin)


# -- numbers ---------------------------------------------------------------------------------------


class Change(NamedTuple):
    """Frequency and height of a peak over those of the run; why they were not found."""

    frequency: float
    height: float
    why: str = ""


#: blade and number of a peak -> its change
Changes = Mapping[tuple[Side, int], Change]


def limit_results(name: str, linear: LinearCurves) -> list[Result]:
    """Stuck frequencies of both blades, peaks free and stuck of each."""
    results, case = [], Case(stiffness=name)
    for in_phase, quantity in ((True, q.STUCK_IN_PHASE), (False, q.STUCK_OUT_OF_PHASE)):
        if math.isfinite(frequency := stuck_frequency(linear.modes, in_phase)):
            results.append(quantity.of(frequency, case))
    for blade in SIDES[::-1]:
        for kind, peaks in (("free", linear.free_peaks), ("stuck", linear.stuck_peaks)):
            for peak in peaks[blade]:
                results += peak_results(replace(case, kind=kind), peak, blade)
    return results


def peak_results(case: Case, peak: CurvePeak, blade: Side, withheld: str = "") -> list[Result]:
    """Frequency and height of a numbered peak."""
    case = replace(case, mode=peak.mode)
    return [
        quantity.on(blade).of(value, case, n=peak.number, withheld=withheld)
        for quantity, value in (
            (q.PEAK_FREQUENCY, peak.frequency),
            (q.PEAK_ACCELERANCE, peak.height),
        )
    ]


def changed_results(curve: RunCurve, changes: Changes, linear: LinearCurves) -> Iterator[Result]:
    """Numbers of the peaks that changed, and the reduction where the highest did."""
    for side in SIDES:
        new, whys = [], []
        for peak in curve.peaks.get(side, ()):
            change = changes.get((side, peak.number), Change(1.0, 1.0))
            f, height = peak.frequency * change.frequency, peak.height * change.height
            new.append(peak._replace(frequency=f, height=height))
            whys.append(change.why)
            if (side, peak.number) in changes:
                yield from peak_results(curve.case, new[-1], side, withheld=change.why)
        free = [peak.height for peak in linear.free_peaks[side]]
        highest = max(curve.peaks.get(side, ()), key=lambda peak: peak.height, default=None)
        if free and highest is not None and (side, highest.number) in changes:
            why = next(filter(None, whys), "")
            height = math.nan if why else max(peak.height for peak in new)
            yield q.REDUCTION.on(side).of(1.0 - height / max(free), curve.case, withheld=why)


def _changes(
    run: Run,
    plan: ForcedPlan,
    model: Model,
    linear: LinearCurves,
    curve: RunCurve,
    of: Variation,
) -> dict[tuple[Side, int], Change]:
    """Of every peak of a curve: of the right blade where that has one, the other changes alike."""
    out: dict[tuple[Side, int], Change] = {}
    for number in dict.fromkeys(number for _, number in curve.tops):
        side: Side = "right" if ("right", number) in curve.tops else "left"
        top = curve.tops[side, number]
        leaves = any(one.number == number and not one.at_top for one in curve.checked)
        if model is run.model and (leaves or not top.slips):
            # all sticks, or the height is that of a time integration, which has all harmonics
            continue
        try:
            f, height = peak_again(run, plan, model, linear, curve, side, number, of)
            found = Change(f / top.frequency, height / top.height)
        except UpdError as error:
            log.info("%s, %s, %s: %s", of.source, of.label, curve.case, one_line(error))
            found = Change(math.nan, math.nan, one_line(error))
        out |= {(one, number): found for one in SIDES}
    return out


# -- peaks with friction ---------------------------------------------------------------------------


def peak_again(
    run: Run,
    plan: ForcedPlan,
    model: Model,
    linear: LinearCurves,
    curve: RunCurve,
    side: Side,
    number: int,
    of: Variation,
) -> tuple[float, float]:
    """Frequency and height of a peak on another model: climbed to from the run's top; else on a
    path along a band about it, then along the whole sweep, as the loop of a fold may be longer than
    any band.

    Raises
    ------
    ConvergenceError
        Where none is near the run's.
    """
    top, old = curve.tops[side, number], curve.balance
    b = balance_of(plan, model, curve.force, plan.scene.harmonic_numbers)
    ratio = expected(run.linear, linear, top, number)
    alike = (len(b.Psi), b.contacts.tangents, b.rigid)
    if alike == (len(old.Psi), old.contacts.tangents, old.rigid):
        x = b.embedded(top.x, old)
        for f in dict.fromkeys((ratio * top.frequency, top.frequency)):
            start = newton(b, x, f)
            if start is None:
                continue
            about, reach = top._replace(frequency=f), _CLOSE * FIRST_REACH
            new = climbed(model, b, start, f, side, curve.force, about, reach)
            if new is not None:
                return new.frequency, new.height
    f, e = ratio * top.frequency, plan.scene.excitation
    settings = replace(LONG_STEPS, most_points=_MOST_POINTS)
    for span in (
        np.linspace((1.0 - BAND) * f, (1.0 + BAND) * f, BAND_POINTS),
        np.linspace(e.start, e.stop, SWEEP_POINTS),
    ):
        try:
            answer = respond(plan, model, curve.force, span, settings=settings)
        except ConvergenceError as error:
            log.info("band about %.6g Hz: %s", f, one_line(error))
            continue
        if not len(answer.frequency):
            continue
        size = np.abs(measures.accelerance(answer, model.row(side), curve.force))
        for peak in numbered_peaks(model, answer, size, e.stop):
            near = math.isnan(of.size) or is_near(peak.frequency / f, peak.height / top.height)
            if peak.number == number and near:
                return peak.frequency, peak.height
    raise ConvergenceError("not found on the level")


def expected(own: LinearCurves, other: LinearCurves, top: Top, number: int) -> float:
    """Ratio of a peak's frequency on another model to that of the run, between those of the free
    and of the stuck mode by where the peak lies.
    """
    stuck, again = (stuck_frequency(one.modes, number % 2 == 1) for one in (own, other))
    start, free = (_free(one) for one in (own, other))
    if not math.isfinite(stuck + again + start + free) or stuck == start:
        return again / stuck if math.isfinite(again / stuck) else 1.0
    share = min(max((top.frequency - start) / (stuck - start), 0.0), 1.0)
    return free / start + share * (again / stuck - free / start)


def _free(linear: LinearCurves) -> float:
    """The lowest free peak in Hz; nan without."""
    found = linear.free_peaks["right"] or linear.free_peaks["left"]
    return found[0].frequency if found else math.nan
