"""Self-checks of a forced response.

Path complete, energy balance, harmonics and samples left out, damper at rest on its contacts.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from upd.analyses.forced import measures
from upd.analyses.forced.curves import FacesCurve, ForcedCurve, SweptCurve, WholeFaces
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.faces_checks import WIDEST_STEP, check_faces_curve
from upd.analyses.forced.mode_peaks import MAJORITY
from upd.analyses.forced.model import Model
from upd.analyses.forced.performance_curve import Branch, Performance
from upd.analyses.forced.ranges import peak_ranges, sweeps_of
from upd.analyses.forced.read_points import WANDERS, wanders
from upd.analyses.forced.solution import (
    Confirmation,
    CurveBand,
    ForcedSolution,
    MarchedPeak,
    TimeMarch,
)
from upd.analyses.forced.statics import BALANCE
from upd.analyses.forced.sweeps import TOLERANCE
from upd.analyses.measured import fit_checks
from upd.hbm.adaptive import TRUNCATION
from upd.hbm.response import ALIASING
from upd.results import Case, Check
from upd.scene.forced_contact import SIDES

#: largest imbalance of work and losses over a cycle, and of static forces on the damper: far above
#: the solver's tolerance
_BALANCE = 1e-6
#: largest contact motion by harmonics left out, and difference of a time march, before a warning
_LEFT_OUT, _MARCH = 10.0 * TRUNCATION, 5e-3
#: what the steps of a march may lose of a period's energy, which they damp where the damper
#: rattles, see `upd.hbm.interface_march`: ten times what a settled motion may still change
_SWEEP_ENERGY = 10.0 * TOLERANCE
#: difference of the sum of the nodes' losses from that of the march: the rounding of its steps
_NODES = 1e-9
#: share of the cycle that a whole face may be lifted off
_OPEN = 0.9
#: largest difference of a law's two tangential stiffnesses, relative to their mean
_ANISOTROPY = 0.2


def check_solution(solution: ForcedSolution) -> list[Check]:
    """All self-checks. None ends the run: a curve that stopped early is kept, with a warning."""
    checks: list[Check] = []
    for curve in solution.curves:
        checks.append(_path(curve, covered=_swept_whole(solution, curve)))
        if not curve.empty:
            checks.append(_periodic(curve))
            checks.append(_left(curve, solution.plan.scene.balance.method))
            checks += _curve_checks(solution, curve)
    excitation = solution.plan.scene.excitation
    for path in solution.balanced:
        points, read = excitation.points, excitation_of(excitation).lowest
        checks.append(_path(path, covered=_swept_whole(solution, path)))
        if not path.empty:
            checks += [*check_faces_curve(path, points, read), *_told_apart(solution, path)]
    checks += [_march(solution, march) for march in solution.marches]
    for one in solution.sweeps:
        checks += _sweep_checks(one)
    checks += [_faces_balance(name, faces) for name, faces in solution.faces.items()]
    for name, ratio in dict.fromkeys((s.stiffness, s.ratio) for s in solution.sweeps):
        checks += _told_alike(solution, name, ratio)
    checks += [_loss_by_nodes(one) for one in solution.marched]
    checks += [_confirmed(one) for one in solution.confirmations]
    checks += [
        _complete(name, branch)
        for name, curve in solution.performances.items()
        for branch in curve.branches
    ]
    checks += [
        _tops_settled(name, one) for name, one in solution.performances.items() if one.sweeps
    ]
    checks += [
        _all_followed(name, one) for name, one in solution.performances.items() if not one.sweeps
    ]
    checks += [_band_complete(band) for band in solution.bands]
    for name, model in solution.models.items():
        checks += _model_checks(name, model)
    checks += fit_checks(solution.plan.scene.measured)
    limits = solution.plan.scene.left_out
    again = (*solution.omissions, *solution.levels.checked)
    return checks + [one.check(limits) for one in again]


def _complete(name: str, branch: Branch) -> Check:
    case = Case(stiffness=name, branch=branch.name, mode=branch.mode)
    remedy = (
        f"{branch.message}. What was found is kept; bring performance.lowest and highest "
        "nearer to the scene's F_C/F_E"
    )
    return Check(
        "performance complete",
        case,
        float(not branch.complete),
        0,
        "curves stopped early",
        remedy,
        fatal=False,
    )


def _tops_settled(name: str, found: Performance) -> Check:
    """Sweeps of a performance curve whose highest point is of no motion that lasts."""
    lost = [one for one in found.sweeps if wanders(one)]
    at = ", ".join(dict.fromkeys(f"{one.ratio:.3g}" for one in lost))
    remedy = f"F_C/F_E {at}: {WANDERS}"
    return Check(
        "performance settled",
        Case(stiffness=name, name="performance"),
        float(len(lost)),
        0,
        f"of {len(found.sweeps)} sweeps whose highest point wanders",
        remedy,
        fatal=False,
    )


def _all_followed(name: str, found: Performance) -> Check:
    """Whole curves whose highest point is on no followed branch."""
    return Check(
        "performance highest",
        Case(stiffness=name, name="performance"),
        float(len(found.beside)),
        0,
        "whole curves whose highest point no followed peak reaches",
        f'{found.missed}. Let sweeps tell the curve: balance.method = "auto"',
        fatal=False,
    )


def _band_complete(band: CurveBand) -> Check:
    """Static states and starts whose curve did not arrive: the band may be wider."""
    lost = [f"{one.choice} ({one.curve.where})" for one in band.curves if one.curve.stopped]
    remedy = f"the band lacks {', '.join(lost)}; it may be wider. Take more excitation.points"
    return Check(
        "band complete",
        band.curve.case,
        float(len(lost)),
        0,
        f"of {len(band.curves)} curves of the band stopped early",
        remedy,
        fatal=False,
    )


def _model_checks(name: str, model: Model) -> list[Check]:
    """Static forces of the points in balance; two tangential stiffnesses of a law, of which the
    model takes the mean.
    """
    checks = []
    if model.state is not None:
        checks.append(
            Check(
                "static balance",
                Case(stiffness=name, choice=model.state.name),
                measures.static_error(model),
                BALANCE,
                "|static contact forces - F_C| / F_C, moments by their arms",
                "report this scene",
                fatal=False,
            )
        )
    for side in SIDES:
        value, case = model.laws[side].anisotropy, Case(stiffness=name, side=side)
        if value is not None:
            remedy = (
                "the answer along y and up the slope shares one k_t; read it for the direction "
                "that slides"
            )
            checks.append(
                Check(
                    "k_t anisotropy",
                    case,
                    value,
                    _ANISOTROPY,
                    "|k_tx - k_ty| / mean",
                    remedy,
                    fatal=False,
                )
            )
    return checks


def _periodic(curve: ForcedCurve) -> Check:
    remedy = (
        "their contact forces do not come back to their start within the periods marched: no "
        'steady state; balance.slider = "mid", or contact.directions = "one"'
    )
    return Check(
        "contact forces periodic",
        curve.case,
        float((~curve.answer.periodic).sum()),
        0,
        f"of {len(curve.answer.periodic)} points of the curve not periodic",
        remedy,
        fatal=False,
    )


def _march(solution: ForcedSolution, march: TimeMarch) -> Check:
    if not march.verifies:
        return Check(
            "time march",
            replace(march.curve.case, frequency=march.frequency),
            1.0,
            0,
            "marches that found no period to compare with",
            f"{march.steady.message}: it verifies nothing; choose another frequency",
            fatal=False,
        )
    marched = march.accelerance(solution.models[march.curve.stiffness])
    remedy = (
        f"{march.steady.message}; take more harmonics (balance.harmonics), or points that stay "
        "stuck remember another slider start"
    )
    case, says = (
        replace(march.curve.case, frequency=march.frequency),
        "|time march / harmonic balance - 1|",
    )
    return Check(
        "time march", case, abs(marched / march.height - 1.0), _MARCH, says, remedy, fatal=False
    )


def _faces_balance(name: str, faces: WholeFaces) -> Check:
    """Forces of all nodes at rest against F_C, turns by their arms."""
    march = faces.march
    off = march.columns.T @ faces.start.f - march.load
    turns = np.array(faces.of.kept) >= 3
    arm = float(np.abs(march.columns[: march.n, turns]).max(initial=1.0))
    size = float(np.abs(march.load).max())
    return Check(
        "static balance",
        Case(stiffness=name, choice=faces.state.name),
        float(np.abs(off / np.where(turns, arm, 1.0)).max() / size),
        BALANCE,
        "|static contact forces - F_C| / F_C, moments by their arms",
        "report this scene",
        fatal=False,
    )


def _sweep_checks(one: SweptCurve) -> list[Check]:
    """A sweep that came to its end, whose motions settled, and whose energy closes."""
    found = one.found
    work = np.abs(found.energy).sum(axis=1)
    off = np.abs(found.energy[:, 0] - found.energy[:, 1:].sum(axis=1))[found.settled]
    loss = off / np.where(work > 0.0, work, 1.0)[found.settled]
    return [
        Check(
            "sweep complete",
            one.case,
            float(found.status == "stopped"),
            0,
            "sweeps that stopped early",
            f"{found.message}. What was found is kept",
            fatal=False,
        ),
        Check(
            "sweep settled",
            one.case,
            float((~found.settled).sum()),
            0,
            f"of {len(found.settled)} frequencies without a steady motion",
            "there the motion does not repeat with the period of the force, or only after very "
            "long: read its heights as of the last periods",
            fatal=False,
        ),
        Check(
            "sweep energy",
            one.case,
            float(loss.max(initial=0.0)),
            _SWEEP_ENERGY,
            "|work - damping - friction| / their sum, of a period",
            "the damper rattles on its faces faster than the steps resolve, which damps it: read "
            "the heights there with that error",
            fatal=False,
        ),
    ]


def _loss_by_nodes(one: MarchedPeak) -> Check:
    """The losses of all nodes are that of the sweep where the period was read."""
    return Check(
        "loss by nodes",
        one.case,
        one.off,
        _NODES,
        f"|sum over nodes - friction| / work and losses, at {one.frequency:.5g} Hz",
        "a step of the march has two answers there: take more steps (balance.samples)",
        fatal=False,
    )


def _told_alike(solution: ForcedSolution, name: str, ratio: float) -> list[Check]:
    """Peaks on which sweeps up and down, and the balance, do not agree."""
    ranges = [r for side in SIDES for r in peak_ranges(solution, name, ratio, side).values()]
    right = peak_ranges(solution, name, ratio)
    says = "; ".join(f"peak {k}: {one.why}" for k, one in right.items() if not one.agrees)
    return [
        Check(
            "one steady motion",
            Case(stiffness=name, force_ratio=ratio),
            float(sum(not one.single for one in ranges)),
            0,
            f"of {len(ranges)} peaks on which sweeps up and down differ",
            f"{says}. Friction and lift-off leave several steady motions: read the peak as a range",
            fatal=False,
        )
    ]


def _left(curve: ForcedCurve, method: str) -> Check:
    """Maxima of the path that a march leaves."""
    of = "; ".join(f"{'left blade, ' * (one.blade == 'left')}{one.words}" for one in curve.left)
    remedy = (
        "there the motion of the balance is not steady, or has too few harmonics (balance."
        f"harmonics): a march goes from {of}. "
        "A lower maximum of the mode that is steady is told as its peak; "
    )
    sweeps = 'balance.method = "auto" sweeps as a test does'
    remedy += sweeps if method == "balance" else "the sweeps tell what a test shows"
    return Check(
        "maxima steady",
        curve.case,
        float(len(curve.left)),
        0,
        "of the maxima of the path that a march leaves by more than half the power",
        remedy,
        fatal=False,
    )


def _confirmed(one: Confirmation) -> Check:
    goes = f"goes to {one.marched:.4g} (m/s2)/N" if one.settled else "does not settle"
    remedy = (
        f"a march from the balance's motion at peak {one.peak.number}, "
        f"{one.peak.frequency:.4g} Hz, {goes}: the peak's end "
        "is a fold, or the harmonics do not suffice (balance.harmonics); the sweeps tell the peak"
    )
    return Check(
        "steady at the peak",
        replace(one.curve.case, peak=one.peak.number, mode=one.peak.mode),
        one.difference,
        _MARCH,
        "|time march from the balance's motion / the balance - 1|",
        remedy,
        fatal=False,
    )


def _swept_whole(solution: ForcedSolution, curve: ForcedCurve | FacesCurve) -> bool:
    """Whether both sweeps of a curve came to their ends."""
    sweeps = sweeps_of(solution, curve.stiffness, curve.ratio)
    return bool(sweeps) and not any(one.stopped for one in sweeps)


def _path(curve: ForcedCurve | FacesCurve, *, covered: bool) -> Check:
    stopped = curve.stopped and not covered
    remedy = f"{curve.answer.message}. What was found is kept; " + (
        'balance.method = "auto" sweeps there'
        if isinstance(curve, FacesCurve)
        else "fewer contact points, another balance.slider or a lower start may go further"
    )
    return Check(
        "path complete",
        curve.case,
        float(stopped),
        0,
        "curves that stopped early, sweeps included",
        remedy,
        fatal=False,
    )


def _curve_checks(solution: ForcedSolution, curve: ForcedCurve) -> list[Check]:
    answer, case = curve.answer, curve.case
    highest = answer.harmonics.highest
    # The next odd one: friction without a mean offset answers in odd harmonics.
    more = highest + 1 + highest % 2
    balance = float(np.abs(answer.energy_balance).max())
    rest = measures.rest_error(answer, solution.models[curve.stiffness])
    return [
        Check(
            "balance residual",
            case,
            measures.residual_error(answer),
            _BALANCE,
            "misfit of contact motion and force at the worst point, evaluated again, relative",
            "that point is off by about this share, beside a contact that changes its state: read "
            "the curve there from its neighbours",
            fatal=False,
        ),
        Check(
            "energy balance",
            case,
            balance,
            _BALANCE,
            "|work - viscous loss - friction| / work",
            "report this scene",
            fatal=False,
        ),
        Check(
            "damper at rest",
            case,
            rest,
            _BALANCE,
            "|mean contact forces - F_C| / F_C",
            "report this scene",
            fatal=False,
        ),
        Check(
            "truncation",
            case,
            float(answer.truncation.max()),
            _LEFT_OUT,
            f"contact motion by harmonics above {highest}, relative",
            f'take more: balance.harmonics = {more}, {more + 2}, ... or "adaptive"',
            fatal=False,
        ),
        Check(
            "aliasing",
            case,
            float(answer.aliasing.max()),
            ALIASING,
            "contact force with twice the samples, relative change",
            "take more samples: balance.samples",
            fatal=False,
        ),
        *_told_apart(solution, curve),
        *_step(solution, curve),
        _face_open(solution, curve),
    ]


def _told_apart(solution: ForcedSolution, curve: ForcedCurve | FacesCurve) -> list[Check]:
    """A peak whose motion is less than half that of its mode: the number says little."""
    peaks = solution.numbered_peaks(curve)
    if not peaks:
        return []
    least = min(peaks, key=lambda peak: peak.mac)
    remedy = (
        f"peak {least.number} at {least.frequency:.4g} Hz moves as no stuck mode does (MAC "
        f"{least.mac:.2f} with the mode {least.mode}): nearly free blades have none; read its "
        "frequency and contact states, not its number"
    )
    return [
        Check(
            "peaks told apart by mode",
            curve.case,
            1.0 - least.mac,
            1.0 - MAJORITY,
            "1 - lowest MAC of a peak with its stuck mode",
            remedy,
            fatal=False,
        )
    ]


def _step(solution: ForcedSolution, curve: ForcedCurve) -> list[Check]:
    """The path's steps beside its peaks against their widths: what lies between is interpolated."""
    e, f = solution.plan.scene.excitation, curve.answer.frequency
    steps = {}
    for peak in solution.numbered_peaks(curve):
        step = float(np.abs(np.diff(f[peak.sample - 1 : peak.sample + 2])).max())
        steps[peak] = step / measures.half_power_width(curve.answer, peak.sample)
    if not steps:
        return []
    widest = max(steps, key=lambda peak: steps[peak])
    points = math.ceil((e.points - 1) * steps[widest] / WIDEST_STEP) + 1
    remedy = (
        f"peak {widest.number} at {widest.frequency:.4g} Hz lies between points too far apart for "
        f"its height; take more: excitation.points = {points}"
    )
    return [
        Check(
            "frequency step",
            curve.case,
            steps[widest],
            WIDEST_STEP,
            "largest step at a peak over its half-power width",
            remedy,
            fatal=False,
        )
    ]


def _face_open(solution: ForcedSolution, curve: ForcedCurve) -> Check:
    """A face that carries nothing over the whole path: the stuck answer is then never reached."""
    model, answer = solution.models[curve.stiffness], curve.answer
    lift = {
        side: float(share[:, 2].max()) for side, share in measures.shares(answer, model).items()
    }
    side = max(lift, key=lambda s: lift[s])
    remedy = (
        f"the {side} face opens over the cycle; on an asymmetric damper friction above "
        "tan(slope) lets one face carry it alone: "
        "lower contact.friction, or start the sliders elsewhere (balance.slider)"
    )
    return Check(
        "both faces carry",
        curve.case,
        lift[side],
        _OPEN,
        "largest share of a face lifted off",
        remedy,
        fatal=False,
    )
