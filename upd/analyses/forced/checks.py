"""Self-checks of a forced response: of the result, not of what lies between.

Each recomputes what it checks from unprocessed quantities, so that it can fail.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import TOLERANCE, FacesCurve, ForcedCurve, PointCurve
from upd.analyses.forced.plan import CONFIRMED, excitation_of
from upd.analyses.forced.solve import ForcedSolution
from upd.analyses.forced.statics import StaticState
from upd.analyses.measured import fit_checks
from upd.hbm.faces.balance import InterfaceResponse
from upd.hbm.faces.sweep import SteppedSine
from upd.hbm.springs.response import TRUNCATION
from upd.hbm.springs.stability import OSCILLATING, motion_stability
from upd.results import Case, Check
from upd.scene.forced_contact import SIDES

#: largest step of a path at a peak, in half-power widths: of one mode two points or more then lie
#: within them, and the highest is at most 1 - 1/sqrt(1 + 1/4), 11 %, below the peak between them
WIDEST_STEP = 0.5
#: largest imbalance of work and losses over a cycle: far above the solver's tolerance
_BALANCE = 1e-6


_PERIOD = "|work - damping - friction| / their sum, of a period"
_PATH = "curves that stopped early, or points that are not periodic"
_CONFIRMED = "|time integration / harmonic balance - 1| at the peak"
#: check -> its limit, what its value is, and the remedy, templates
_RULES: Mapping[str, tuple[float, str, str]] = {
    "preloaded contact": (
        0,
        "faces without preload, or whose friction is mobilised everywhere",
        "{what} before vibration, so that the response depends on how the damper came to rest and "
        "does not tend to the stuck one: upd design shows whether this damper hangs or jams; set "
        'contact.static = "frictionless", or N and T of both faces',
    ),
    "path complete, stopped": (
        0,
        _PATH,
        "{message}, so that peaks beyond are missing: fewer contact points, another "
        "balance.slider or a lower start may go further",
    ),
    "path complete, periodic": (
        0,
        _PATH,
        "at {count} points the contact forces do not come back to their start, so that they are no "
        'steady state: balance.slider = "mid", or contact.directions = "one"',
    ),
    "balance residual": (
        _BALANCE,
        "misfit of contact motion and force at the worst point, evaluated again, relative",
        "that point is off by about this share, beside a contact that changes its state: read the "
        "curve there from its neighbours",
    ),
    "energy balance, points": (
        _BALANCE,
        "|work - viscous loss - friction| / work",
        "report this scene",
    ),
    # slips are weighted with the mean of the forces at the ends of a step: of the step's square
    "energy balance, nodes": (1e-2, _PERIOD, "take more samples: balance.samples"),
    "truncation": (
        TRUNCATION,
        "motion of the faces by blades' harmonics above {highest}, relative",
        "take more: balance.harmonics = {more}",
    ),
    "frequency step": (
        WIDEST_STEP,
        "largest step at a peak over its half-power width",
        "peak {number} at {frequency:.4g} Hz lies between points too far apart for its height; "
        "take more: excitation.points = {more}",
    ),
    f"{CONFIRMED}, top": (
        0.05,
        "the top of a peak that was not reached",
        "of peak {number} of the {blade} blade near {frequency:.5g} Hz only a point is known, its "
        "top was not reached: take more excitation.points",
    ),
    f"{CONFIRMED}, worst": (
        0.05,
        _CONFIRMED,
        "peak {number} of the {blade} blade at {frequency:.5g} Hz has the height of time "
        "integration, {integrated:.4g}; the curve and the slip there have too few harmonics: take "
        'more balance.harmonics, or sweep as a test does: balance.method = "march"',
    ),
    f"{CONFIRMED}, none": (
        0.05,
        _CONFIRMED,
        "peak {number} of the {blade} blade at {frequency:.5g} Hz is not confirmed (no motion near "
        "it is stable), so that a test may not show it: take more balance.harmonics, or sweep as a "
        'test does: balance.method = "march"',
    ),
    "oscillating motion": (
        0,
        "of the {count} reported peaks that oscillate about their period",
        "peak {number} at {frequency:.5g} Hz oscillates about its period (multiplier {size:.3f}): "
        'its height varies with time; sweep as a test does: balance.method = "march"',
    ),
    "performance complete": (
        0,
        "of {count} curves that ended early",
        "the curves at F_C/F_E {at} ended early, so that a higher peak may be missing: raise "
        "performance.lowest",
    ),
    "sweep settled": (
        0,
        "of {count} frequencies that did not settle",
        "{lost} of {count} frequencies did not settle: their amplitudes are those of the last "
        "period",
    ),
    # steps damp where the damper rattles, see `upd.hbm.faces.march`: ten times what a settled
    # motion may still change
    "sweep energy": (
        10.0 * TOLERANCE,
        _PERIOD,
        "the damper rattles on its faces faster than the steps resolve, which damps it: take more "
        "balance.samples",
    ),
}


def _check(rule: str, case: Case, value: float, **words: Any) -> Check:
    """A check by its rule, its name before a comma; none ends the run: a curve that stopped early
    is kept.
    """
    limit, what, remedy = _RULES[rule]
    texts = what.format(**words), remedy.format(**words)
    return Check(rule.partition(",")[0], case, value, limit, *texts, fatal=False)


def check_solution(solution: ForcedSolution) -> list[Check]:
    """All self-checks."""
    checks: list[Check] = []
    scene, models, faces = solution.plan.scene, solution.models, solution.faces
    least = scene.damper.centrifugal / max(scene.excitation.centrifugal_to_force, default=np.inf)
    states = {name: (one.state, one.contacts.law.mu) for name, one in models.items()}
    states |= {name: (one.state, one.march.friction) for name, one in faces.items()}
    for name, (state, mu) in states.items():
        if state is not None:
            checks.append(_preloaded(name, state, float(mu.max(initial=0.0)), least))
    for curve in solution.curves:
        checks += _curve_checks(solution, curve)
    for name, found in solution.performances.items():
        lost = [f"{one.ratio:.3g}" for one in found.points if not one.arrived]
        case, words = Case(stiffness=name, name="performance"), {"at": ", ".join(lost)}
        words["count"] = str(len(found.points))
        checks.append(_check("performance complete", case, float(len(lost)), **words))
    checks += fit_checks(scene.measured)
    return checks + [one.check(scene.left_out) for one in solution.omissions]


def _preloaded(stiffness: str, state: StaticState, mu: float, least: float) -> Check:
    """A face that carries nothing, or whose friction is all mobilised, before vibration: the rest
    is below the least F_E of the run, in N.

    A stiff unilateral spring without preload, or a slider at its limit, has no amplitude scale: the
    response then does not tend to the stuck one as F_C/F_E grows, and motions are not unique.
    """
    rest = (mu * state.N - np.abs(state.T))[state.N > 0.0]
    mobilised = mu > 0.0 and bool((rest < least).any())
    what = "every point of a face carries mu N"
    if state.empty:
        what = f"the {' and the '.join(state.empty)} face carries nothing"
    case = Case(stiffness=stiffness, choice=state.name)
    return _check("preloaded contact", case, float(bool(state.empty) or mobilised), what=what)


def _curve_checks(solution: ForcedSolution, curve: ForcedCurve[Any]) -> Iterator[Check]:
    """Whether a curve came to its end, and what its method leaves."""
    e, answer, case = solution.plan.scene.excitation, curve.answer, curve.case
    yield path_check(curve)
    if curve.empty:
        return
    if isinstance(answer, SteppedSine):
        lost, loss = int((~answer.settled).sum()), _open_energy(answer.energy)[answer.settled]
        words = {"lost": lost, "count": len(answer.settled)}
        yield _check("sweep settled", case, float(lost), **words)
        yield _check("sweep energy", case, float(loss.max(initial=0.0)))
    elif isinstance(answer, InterfaceResponse):
        yield from _faces_checks(curve, e.points, excitation_of(e).lowest)
    else:
        yield _check("balance residual", case, measures.residual_error(answer))
        yield _check("energy balance, points", case, float(np.abs(answer.energy_balance).max()))
        yield from _integrated(curve)
        yield from _oscillating(curve)


def path_check(curve: ForcedCurve[Any]) -> Check:
    if curve.stopped:
        return _check("path complete, stopped", curve.case, 1.0, message=curve.answer.message)
    astray = int((~curve.answer.periodic).sum()) if hasattr(curve.answer, "periodic") else 0
    return _check("path complete, periodic", curve.case, float(astray), count=astray)


def _integrated(curve: PointCurve) -> Iterator[Check]:
    """Reported peaks that no climb reached, or the one that time integration confirms worst."""
    for side in SIDES:
        for peak in curve.peaks.get(side, ()):
            if (side, peak.number) not in curve.tops:
                where = {"number": peak.number, "blade": side, "frequency": peak.frequency}
                case = replace(curve.case, mode=peak.mode)
                yield _check(f"{CONFIRMED}, top", case, math.inf, **where)
                return
    if curve.checked:
        worst = max(curve.checked, key=lambda one: one.difference)
        rule = "worst" if worst.stays else "none"
        yield _check(
            f"{CONFIRMED}, {rule}",
            replace(curve.case, mode=worst.mode),
            worst.difference,
            **vars(worst),
        )


def _oscillating(curve: PointCurve) -> Iterator[Check]:
    """Reported peaks whose motion is unstable other than at a fold, by the multipliers of the
    period map: one of each resonance, where a point slips or opens.
    """
    answer, lost = curve.answer, 0
    words = {"number": 0, "frequency": 0.0, "size": 0.0}
    motions: dict[int, tuple[float, Any]] = {}
    for (side, number), top in curve.tops.items():
        if top.slips and number not in motions:
            motions[number] = top.frequency, top.x
            if below := curve.stayed(side, number):
                motions[number] = float(answer.frequency[below.sample]), answer.x[below.sample]
    for number, (f, x) in motions.items():
        label, multipliers = motion_stability(answer.balance, x, f)
        if label == OSCILLATING:
            lost += 1
            words = {"number": number, "frequency": f, "size": abs(multipliers[0])}
    if motions:
        yield _check("oscillating motion", curve.case, lost, count=len(motions), **words)


def _open_energy(energy: np.ndarray[Any, np.dtype[np.float64]]) -> Any:
    """(n,) what is missing of work (n, 0) and losses (n, 1:) of periods, over their sum."""
    work = np.abs(energy).sum(axis=1)
    return np.abs(energy[:, 0] - energy[:, 1:].sum(axis=1)) / np.where(work > 0.0, work, 1.0)


# -- whole faces by harmonic balance ---------------------------------------------------------------


def _faces_checks(curve: FacesCurve, points: int, harmonic: int) -> Iterator[Check]:
    """What remains of a period's energy, harmonics left out, steps at peaks.

    Parameters
    ----------
    points
        Frequencies asked for.
    harmonic
        That is read.
    """
    answer, case, highest = curve.answer, curve.case, curve.answer.equations.highest
    truncated = max(one.unresolved for one in answer.points)
    yield _check("energy balance, nodes", case, float(_open_energy(answer.energy).max()))
    yield _check("truncation", case, float(truncated), highest=highest, more=highest + 2)
    # the steps beside the right blade's peaks against their widths
    f, steps = curve.frequency, {}
    for peak in curve.peaks["right"]:
        beside = np.diff(f[max(peak.sample - 1, 0) : peak.sample + 2])
        # one that a jump ends lies on its point
        if len(beside) == 2 and not {peak.sample - 1, peak.sample} & set(answer.jumps):
            steps[peak] = float(beside.max()) / half_power_width(curve, peak.sample, harmonic)
    if steps:
        widest = max(steps, key=lambda peak: steps[peak])
        more = math.ceil((points - 1) * steps[widest] / WIDEST_STEP) + 1
        where = {"number": widest.number, "frequency": widest.frequency, "more": more}
        yield _check("frequency step", case, steps[widest], **where)


def half_power_width(curve: FacesCurve, i: int, harmonic: int) -> float:
    """Of a resonance of a harmonic at point i, Hz: f eta with the loss factor eta = lost / (2 pi E)
    of one of its cycles.

    E is the largest kinetic energy of the blades, 1/2 omega^2 sum |q|^2 in mass-normalised modes;
    the damper's is small beside it.
    """
    one, model = curve.answer.points[i], curve.answer.equations.model
    omega, mine = 2.0 * np.pi * harmonic * one.frequency, one.q[2 * harmonic - 1 :][:2]
    energy = 0.5 * model.copies * omega**2 * float((mine**2).sum())
    return one.frequency * float(one.energy[1:].sum()) / harmonic / (2.0 * np.pi * energy)
