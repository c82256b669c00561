"""Every peak of a curve over the admissible static states and the start positions of the sliders.

Friction leaves the static state open (see `upd.analyses.forced.statics`), and points that stick
over the whole cycle remember where their sliders began. The curve is followed again from every
named static state that exists, sliders where its traction has them, and in the run's own state from
the other starts. What lies between is the band of every number read from it.

A curve that was marched is marched again from every static state, at rest, up and down: the starts
of the sliders are then those states, and what the sweeps leave behind.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import ForcedCurve, SweptCurve
from upd.analyses.forced.mode_peaks import ModePeak
from upd.analyses.forced.model import Array, Model, preloaded
from upd.analyses.forced.paths import STARTS, SWEEP_POINTS, path_settings, respond
from upd.analyses.forced.ranges import peak_ranges
from upd.analyses.forced.solution import AS_RUN, BandCurve, CurveBand, ForcedSolution
from upd.analyses.forced.statics import StaticState, admissible, same
from upd.analyses.forced.steady_peaks import with_steady_peaks
from upd.analyses.forced.sweeps import SweepJob, make_springs, spread, stretch
from upd.errors import InputError
from upd.hbm.peaks import climb
from upd.progress import Stages
from upd.scene.forced_contact import SIDES

log = logging.getLogger(__name__)
#: sliders that begin where the static state has them
_PLACED = ("zero", "static")
#: difference of the faces' forces, over F_C, up to which two states give one curve: far below the
#: shares by which the named states differ
_ALIKE = 1e-3
#: how the name of a choice of the static state begins
_STATIC = "static "


@dataclass(frozen=True)
class _Choice:
    """What a curve is followed again with: its name, the model, changes of the balance."""

    name: str
    model: Model
    changes: dict[str, Any]


def solve_band(solution: ForcedSolution, curve: ForcedCurve, stages: Stages) -> CurveBand:
    """Follow a curve again from every static state and start.

    Parameters
    ----------
    solution
        With the models of the curve's stiffness.
    curve
        As run.
    """
    model = solution.models[curve.stiffness]
    sweeps = [
        s for s in solution.sweeps if (s.stiffness, s.ratio) == (curve.stiffness, curve.ratio)
    ]
    if solution.plan.scene.balance.method != "balance":
        return _swept_band(solution, curve, sweeps)
    found = [_read(solution, AS_RUN, curve, model)]
    e = solution.plan.scene.excitation
    sweep, settings = np.linspace(e.start, e.stop, SWEEP_POINTS), path_settings(e.points)
    for choice in _choices(solution, model, stages):
        begin = time.perf_counter()
        answer = respond(
            solution.plan, choice.model, curve.force, sweep, settings=settings, **choice.changes
        )
        blades = {
            side: measures.accelerance(answer, model.row(side), curve.force) for side in SIDES
        }
        took = time.perf_counter() - begin
        again = replace(curve, answer=answer, accelerance=blades, seconds=took, left=())
        again = with_steady_peaks(solution.plan, choice.model, again)
        found.append(_read(solution, choice.name, again, choice.model))
    return CurveBand(curve, tuple(found))


def band_jobs(solution: ForcedSolution, curve: ForcedCurve, stages: Stages) -> list[SweepJob]:
    """Sweeps of a curve from rest in every static state but its own.

    Parameters
    ----------
    solution
        With the models and curves of the stiffness.
    curve
        As run.
    """
    plan = solution.plan
    e, own = plan.scene.excitation, stretch(plan, [curve])
    # what sticks in the run's state may slip in another
    frequency = own if len(own) else spread(e.start, e.stop)
    jobs = []
    for choice in _choices(solution, solution.models[curve.stiffness], stages):
        if choice.name.startswith(_STATIC):
            springs = make_springs(plan, choice.model)
            start = springs.at_rest()
            jobs.append(
                SweepJob(curve.stiffness, curve.ratio, springs.march, frequency, start, choice.name)
            )
    return jobs


def _swept_band(
    solution: ForcedSolution, curve: ForcedCurve, sweeps: Sequence[SweptCurve]
) -> CurveBand:
    """The run itself and all sweeps of it, those from rest in other static states among them."""
    ranges = peak_ranges(solution, curve.stiffness, curve.ratio)
    peaks = [] if curve.empty else solution.numbered_peaks(curve)
    # where the sweeps do not tell the balance's peak alike, it is none of the band
    agreed = [one for one in peaks if one.number not in ranges or ranges[one.number].agrees]
    found = [BandCurve(AS_RUN, curve, tuple(agreed))]
    for one in sweeps:
        name = f"{one.choice or AS_RUN}, sweep {one.way}"
        found.append(BandCurve(name, one, one.peaks["right"]))
    return CurveBand(curve, tuple(found))


def _choices(solution: ForcedSolution, model: Model, stages: Stages) -> Iterator[_Choice]:
    """Every other static state, then every other start in the run's own."""
    plan, own = solution.plan, model.state
    slider, F = plan.scene.balance.slider, plan.scene.damper.centrifugal
    assert solution.bodies is not None
    known: list[StaticState] = []
    for state in [] if own is None else [own, *admissible(plan, solution.bodies, stages)]:
        if any(same(state, other, F, _ALIKE) for other in known):
            continue
        known.append(state)
        if state is own and slider in _PLACED:
            continue
        try:
            yield _Choice(f"{_STATIC}{state.name}", preloaded(model, state), {"start": "zero"})
        except InputError as error:
            log.info("static state %s left out of the band: %s", state.name, error)
    for start in STARTS:
        # with a static state zero and static are where it has the sliders, in the states above
        if start != slider and not (own is not None and start in _PLACED):
            yield _Choice(f"start {start}", model, {"start": start})


def _read(solution: ForcedSolution, name: str, curve: ForcedCurve, model: Model) -> BandCurve:
    """Peaks of the right blade, climbed to from the points of the path."""
    peaks = [] if curve.empty else solution.numbered_peaks(curve)
    return BandCurve(name, curve, tuple(_top(curve, model, one) for one in peaks))


def _top(curve: ForcedCurve, model: Model, peak: ModePeak) -> ModePeak:
    """The peak solved at its top; as the path shows it where the climb ends elsewhere."""
    a, i = curve.answer, peak.sample
    if curve.stopped or a.highest_harmonic[i] < a.harmonics.highest:
        return peak
    k = model.excitation.lowest
    top = climb(a.balance, model.row("right"), a.x[i], float(a.frequency[i]), harmonic=k)
    height = 1e-3 * (2 * np.pi * k * top.frequency) ** 2 * top.amplitude / curve.force
    near = a.frequency[max(i - 1, 0) : i + 2]
    if not top.found or not near.min() <= top.frequency <= near.max():
        return peak
    return peak._replace(frequency=top.frequency, height=height)


def envelope(band: CurveBand, frequency: Array, blade: str) -> tuple[Array, Array]:
    """Lowest and highest accelerance of a blade over all curves of a band.

    Parameters
    ----------
    frequency
        (n,) Hz, rising.
    blade
        "left" or "right".

    Returns
    -------
    low, high
        (n,) in (m/s2)/N; nan where no curve reaches.
    """
    low, high = np.full(len(frequency), np.inf), np.full(len(frequency), -np.inf)
    for one in band.curves:
        f, H = one.curve.frequency, np.abs(one.curve.accelerance[blade])  # type: ignore[index]
        for j in range(len(f) - 1):
            begin, end = sorted((f[j], f[j + 1]))
            at = slice(*np.searchsorted(frequency, (begin, end), side="left"))
            at = slice(at.start, min(len(frequency), at.stop + 1))
            inside = (frequency[at] >= begin) & (frequency[at] <= end)
            if not inside.any():
                continue
            share = (frequency[at][inside] - f[j]) / (f[j + 1] - f[j]) if end > begin else 0.0
            value = H[j] + share * (H[j + 1] - H[j])
            places = np.flatnonzero(inside) + at.start
            low[places] = np.minimum(low[places], value)
            high[places] = np.maximum(high[places], value)
    none = high < low
    low[none], high[none] = np.nan, np.nan
    return low, high
