"""Self-checks of a forced response: of the result, not of what lies between.

Each recomputes what it checks from unprocessed quantities, so that it can fail.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import FacesCurve, ForcedCurve, SweptCurve, WholeFaces
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.levels import HARMONICS, SAMPLES, PeakLevel
from upd.analyses.forced.model import Model
from upd.analyses.forced.performance import Performance
from upd.analyses.forced.solution import ForcedSolution, MarchedPeak, TimeMarch
from upd.analyses.forced.statics import BALANCE, StaticState
from upd.analyses.forced.sweeps import TOLERANCE
from upd.analyses.measured import fit_checks
from upd.hbm.adaptive import TRUNCATION
from upd.results import Case, Check
from upd.scene.forced_contact import SIDES

#: what may be left of the equations, over what they are made of: the corrections of Newton's method
#: end at 1e-6 of the unknowns, and what they leave is of their square
_RESIDUAL = 1e-6
#: what the samples of a period may lose of its energy: slips are weighted with the mean of the
#: forces at the ends of a step, so that it closes with the square of the step
_ENERGY = 1e-2
#: motion of the faces by blades' harmonics left out before a warning
_LEFT_OUT = 10.0 * TRUNCATION
#: largest step of a path at a peak, in half-power widths: of one mode two points or more then lie
#: within them, and the highest is at most 1 - 1/sqrt(1 + 1/4), 11 %, below the peak between them
WIDEST_STEP = 0.5
#: largest imbalance of work and losses over a cycle, and of static forces on the damper: far above
#: the solver's tolerance
_BALANCE = 1e-6
#: difference of a time integration from harmonic balance, at a frequency that a scene names
_MARCH = 5e-3
#: largest change of a reported height by more harmonics, and by twice the samples; of a reported
#: height by time integration from its own motion. A tenth is what an engineer can use.
_HARMONICS, _SAMPLES, _INTEGRATED = 0.1, 0.01, 0.05
CONFIRMED = "confirmed by time integration"
#: what the steps of a sweep may lose of a period's energy, which they damp where the damper
#: rattles, see `upd.hbm.interface_march`: ten times what a settled motion may still change
_SWEEP_ENERGY = 10.0 * TOLERANCE
#: difference of the sum of the nodes' losses from that of the sweep: the rounding of its steps
_NODES = 1e-9
#: a curve that stopped early or misses a check is kept: none ends the run
_warning = partial(Check, fatal=False)


def check_solution(solution: ForcedSolution) -> list[Check]:
    """All self-checks."""
    checks: list[Check] = []
    scene = solution.plan.scene
    least = scene.damper.centrifugal / max(scene.excitation.centrifugal_to_force, default=np.inf)
    for name, model in solution.models.items():
        checks += _model_checks(name, model, least)
    for name, faces in solution.faces.items():
        checks.append(_faces_balance(name, faces))
        checks.append(_preloaded(name, faces.state, faces_mu(faces), least))
    for curve in solution.curves:
        checks.append(_path(curve))
        if not curve.empty:
            checks += _curve_checks(solution, curve)
    for path in solution.balanced:
        read = excitation_of(solution.plan.scene.excitation).lowest
        checks.append(_path(path))
        if not path.empty:
            checks += check_faces_curve(path, solution.plan.scene.excitation.points, read)
    checks += [_march(solution, march) for march in solution.marches]
    for one in solution.sweeps:
        checks += _sweep_checks(one)
    checks += [_loss_by_nodes(one) for one in solution.marched]
    checks += [_complete(name, one) for name, one in solution.performances.items()]
    checks += fit_checks(solution.plan.scene.measured)
    limits = solution.plan.scene.left_out
    return checks + [one.check(limits) for one in solution.omissions]


def faces_mu(faces: WholeFaces) -> float:
    """Friction of whole faces."""
    return float(faces.march.friction.max(initial=0.0))


def _model_checks(name: str, model: Model, least: float) -> list[Check]:
    """Static forces of the points in balance, and away from the limits of contact."""
    if model.state is None:
        return []
    mu = float(model.contacts.law.mu.max(initial=0.0))
    return [
        _warning(
            "static balance",
            Case(stiffness=name, choice=model.state.name),
            measures.static_error(model),
            BALANCE,
            "|static contact forces - F_C| / F_C, moments by their arms",
            "report this scene",
        ),
        _preloaded(name, model.state, mu, least),
    ]


def _preloaded(name: str, state: StaticState, mu: float, least: float) -> Check:
    """A face that carries nothing, or whose friction is all mobilised, before vibration: what is
    left of it is below the least F_E of the run, in N.

    A stiff unilateral spring without preload, or a slider at its limit, has no amplitude scale: the
    response then does not tend to the stuck one as F_C/F_E grows, and motions are not unique.
    """
    empty = " and the ".join(state.empty)
    left = (mu * state.N - np.abs(state.T))[state.N > 0.0]
    mobilised = mu > 0.0 and bool((left < least).any())
    worst = 1.0 if state.empty or mobilised else 0.0
    what = (
        f"the {empty} face carries nothing before vibration"
        if state.empty
        else "every point of a face carries mu N before vibration"
    )
    remedy = (
        f"{what}, so that the response depends on how the damper came to rest and does not tend to "
        "the stuck one: upd design tells whether this damper hangs or jams; set contact.static = "
        '"frictionless", or N and T of both faces'
    )
    return _warning(
        "preloaded contact",
        Case(stiffness=name, choice=state.name),
        worst,
        0,
        "faces without preload, or whose friction is mobilised everywhere",
        remedy,
    )


def _path(curve: ForcedCurve | FacesCurve) -> Check:
    astray = 0
    if isinstance(curve, ForcedCurve):
        astray = int((~curve.answer.periodic).sum())
    if curve.stopped:
        remedy = (
            f"{curve.answer.message}, so that peaks beyond are missing: fewer contact points, "
            "another balance.slider or a lower start may go further"
        )
    else:
        remedy = (
            f"at {astray} points the contact forces do not come back to their start, so that "
            'they are no steady state: balance.slider = "mid", or contact.directions = "one"'
        )
    return _warning(
        "path complete",
        curve.case,
        float(curve.stopped) or float(astray),
        0,
        "curves that stopped early, or points that are not periodic",
        remedy,
    )


def _curve_checks(solution: ForcedSolution, curve: ForcedCurve) -> list[Check]:
    answer, case = curve.answer, curve.case
    balance = float(np.abs(answer.energy_balance).max())
    rest = measures.rest_error(answer, solution.models[curve.stiffness])
    levels = solution.levels.get(curve.stiffness, [])
    return [
        _warning(
            "balance residual",
            case,
            measures.residual_error(answer),
            _BALANCE,
            "misfit of contact motion and force at the worst point, evaluated again, relative",
            "that point is off by about this share, beside a contact that changes its state: read "
            "the curve there from its neighbours",
        ),
        _warning(
            "energy balance",
            case,
            balance,
            _BALANCE,
            "|work - viscous loss - friction| / work",
            "report this scene",
        ),
        _warning(
            "damper at rest",
            case,
            rest,
            _BALANCE,
            "|mean contact forces - F_C| / F_C",
            "report this scene",
        ),
        *_by_level(curve, levels),
        *_integrated(curve),
    ]


def _by_level(curve: ForcedCurve, levels: list[PeakLevel]) -> list[Check]:
    """Reported heights with more harmonics and with twice the samples."""
    highest = curve.answer.harmonics.highest
    bisected = {(c.blade, c.number) for c in curve.checked if c.stays and not c.at_top}
    out = []
    for source, name, limit, remedy in (
        (
            HARMONICS,
            "more harmonics",
            _HARMONICS,
            f"the peak needs more: balance.harmonics = {highest + 4}",
        ),
        (
            SAMPLES,
            "twice the samples",
            _SAMPLES,
            f"the peak needs more: balance.samples = {2 * curve.answer.balance.samples}",
        ),
    ):
        mine = [one for one in levels if one.source == source]
        # the farthest level is the judge; a height by time integration holds all harmonics
        last = mine[-1] if mine else None
        changes = []
        for key, top in curve.tops.items():
            if last is None or not top.slips or key in bisected:
                continue
            found = last.peaks.get((curve.ratio, *key))
            if found is not None:
                change = abs(found.height / top.height - 1.0)
                changes.append(change if math.isfinite(change) else math.inf)
        if changes:
            says = f"largest change of a peak's height with {last.label}" if last else ""
            out.append(_warning(name, curve.case, max(changes), limit, says, remedy))
    return out


def _integrated(curve: ForcedCurve) -> list[Check]:
    """Reported peaks from which time integration leaves, or that no climb reached."""
    for side in SIDES:
        for peak in curve.peaks.get(side, ()):
            if (side, peak.number) not in curve.tops:
                remedy = (
                    f"of peak {peak.number} of the {side} blade near {peak.frequency:.5g} Hz only "
                    "a point is known, its top was not reached: take more excitation.points"
                )
                says = "the top of a peak that was not reached"
                case = replace(curve.case, mode=peak.mode)
                return [_warning(CONFIRMED, case, math.inf, _INTEGRATED, says, remedy)]
    if not curve.checked:
        return []
    worst = max(curve.checked, key=lambda one: one.difference)
    goes = "no motion near it stays" if not worst.stays else f"it gives {worst.integrated:.4g}"
    remedy = (
        f"peak {worst.number} of the {worst.blade} blade at {worst.frequency:.5g} Hz is not "
        f"confirmed ({goes}), so that a test may not show it: take more balance.harmonics, or "
        'sweep as a test does: balance.method = "march"'
    )
    return [
        _warning(
            CONFIRMED,
            replace(curve.case, mode=worst.mode),
            worst.difference,
            _INTEGRATED,
            "|time integration from the peak's own motion / harmonic balance - 1|",
            remedy,
        )
    ]


def _complete(name: str, found: Performance) -> Check:
    lost = [one.ratio for one in found.points if not one.arrived]
    at = ", ".join(f"{one:.3g}" for one in lost)
    remedy = (
        f"the curves at F_C/F_E {at} ended early, so that a higher peak may be missing: raise "
        "performance.lowest"
    )
    return _warning(
        "performance complete",
        Case(stiffness=name, name="performance"),
        float(len(lost)),
        0,
        f"of {len(found.points)} curves that ended early",
        remedy,
    )


def _march(solution: ForcedSolution, march: TimeMarch) -> Check:
    case = replace(march.curve.case, frequency=march.frequency)
    if not march.verifies:
        return _warning(
            "time march",
            case,
            1.0,
            0,
            "time integrations that found no period to compare with",
            f"{march.steady.message}: it verifies nothing; choose another frequency",
        )
    marched = march.accelerance(solution.models[march.curve.stiffness])
    remedy = (
        f"{march.steady.message}; take more harmonics (balance.harmonics), or points that stay "
        "stuck remember another slider start"
    )
    return _warning(
        "time march",
        case,
        abs(marched / march.height - 1.0),
        _MARCH,
        "|time integration / harmonic balance - 1|",
        remedy,
    )


def _faces_balance(name: str, faces: WholeFaces) -> Check:
    """Forces of all nodes at rest against F_C, turns by their arms."""
    march = faces.march
    off = march.columns.T @ faces.start.f - march.load
    turns = np.array(faces.of.kept) >= 3
    arm = float(np.abs(march.columns[: march.n, turns]).max(initial=1.0))
    size = float(np.abs(march.load).max())
    return _warning(
        "static balance",
        Case(stiffness=name, choice=faces.state.name),
        float(np.abs(off / np.where(turns, arm, 1.0)).max() / size),
        BALANCE,
        "|static contact forces - F_C| / F_C, moments by their arms",
        "report this scene",
    )


def _sweep_checks(one: SweptCurve) -> list[Check]:
    """A sweep that came to its end, whose motions settled, and whose energy closes."""
    found = one.found
    work = np.abs(found.energy).sum(axis=1)
    off = np.abs(found.energy[:, 0] - found.energy[:, 1:].sum(axis=1))[found.settled]
    loss = off / np.where(work > 0.0, work, 1.0)[found.settled]
    lost = int((~found.settled).sum())
    return [
        _warning(
            "sweep complete",
            one.case,
            float(found.status == "stopped"),
            0,
            "sweeps that stopped early",
            f"{found.message}. What was found is kept",
        ),
        _warning(
            "sweep settled",
            one.case,
            float(lost),
            0,
            f"of {len(found.settled)} frequencies that did not settle",
            f"{lost} of {len(found.settled)} frequencies did not settle: their amplitudes are "
            "those of the last period",
        ),
        _warning(
            "sweep energy",
            one.case,
            float(loss.max(initial=0.0)),
            _SWEEP_ENERGY,
            "|work - damping - friction| / their sum, of a period",
            "the damper rattles on its faces faster than the steps resolve, which damps it: take "
            "more balance.samples",
        ),
    ]


def _loss_by_nodes(one: MarchedPeak) -> Check:
    """The losses of all nodes are that of the sweep where the period was read."""
    return _warning(
        "loss by nodes",
        one.case,
        one.off,
        _NODES,
        f"|sum over nodes - friction| / work and losses, at {one.frequency:.5g} Hz",
        "a step has two answers there: take more steps (balance.samples)",
    )


# -- whole faces by harmonic balance ---------------------------------------------------------------


def check_faces_curve(curve: FacesCurve, points: int, harmonic: int) -> list[Check]:
    """What is left of the equations and of a period's energy, harmonics left out, steps at peaks.

    Parameters
    ----------
    points
        Frequencies asked for.
    harmonic
        That is read.
    """
    answer, case = curve.answer, curve.case
    work = np.abs(answer.energy).sum(axis=1)
    off = np.abs(answer.energy[:, 0] - answer.energy[:, 1:].sum(axis=1))
    loss = off / np.where(work > 0.0, work, 1.0)
    residual = [one.residual for one in answer.points]
    left_out = [one.unresolved for one in answer.points]
    highest = answer.equations.highest
    return [
        _warning(
            "balance residual",
            case,
            float(max(residual)),
            _RESIDUAL,
            "misfit of blades' forces, slips and damper's motion of a period, relative",
            "report this scene",
        ),
        _warning(
            "energy balance",
            case,
            float(loss.max()),
            _ENERGY,
            "|work - damping - friction| / their sum, of a period",
            "take more samples: balance.samples",
        ),
        _warning(
            "truncation",
            case,
            float(max(left_out)),
            _LEFT_OUT,
            f"motion of the faces by blades' harmonics above {highest}, relative",
            f"take more: balance.harmonics = {highest + 2}",
        ),
        *_step(curve, points, harmonic),
    ]


def _step(curve: FacesCurve, points: int, harmonic: int) -> list[Check]:
    """The steps beside the right blade's peaks against their widths."""
    f, steps = curve.frequency, {}
    for peak in curve.peaks["right"]:
        beside = np.diff(f[max(peak.sample - 1, 0) : peak.sample + 2])
        # one that a jump ends lies on its point
        if len(beside) == 2 and not {peak.sample - 1, peak.sample} & set(curve.answer.jumps):
            steps[peak] = float(beside.max()) / half_power_width(curve, peak.sample, harmonic)
    if not steps:
        return []
    widest = max(steps, key=lambda peak: steps[peak])
    more = math.ceil((points - 1) * steps[widest] / WIDEST_STEP) + 1
    return [
        _warning(
            "frequency step",
            curve.case,
            steps[widest],
            WIDEST_STEP,
            "largest step at a peak over its half-power width",
            f"peak {widest.number} at {widest.frequency:.4g} Hz lies between points too far apart "
            f"for its height; take more: excitation.points = {more}",
        )
    ]


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
