"""Curves of whole faces by harmonic balance, and what a march makes of their peaks.

Blades in frequency, damper and contact in time, see `upd.hbm.interface_balance`: every node of both
faces with its past, as a sweep from the static state at rising frequency.
"""

from __future__ import annotations

import logging

import numpy as np

from upd.analyses.forced.curves import FacesCurve, WholeFaces
from upd.analyses.forced.excitation import ComplexArray, excitation_of
from upd.analyses.forced.faces_cost import SAMPLES, blade_harmonics
from upd.analyses.forced.interface_model import by_coulomb
from upd.analyses.forced.march_modes import stuck_modes_of
from upd.analyses.forced.mode_peaks import CANDIDATES, ModePeak, ModeShapes, numbered
from upd.analyses.forced.model import Array
from upd.analyses.forced.paths import grid
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.solution import Confirmation, ForcedSolution
from upd.analyses.forced.sweeps import (
    BESIDE,
    MOST_PERIODS,
    TOLERANCE,
    SweepJob,
    spread,
    sweep_maxima,
    whole_faces_jobs,
)
from upd.errors import ConvergenceError
from upd.hbm.interface_balance import InterfaceResponse, interface_response
from upd.hbm.interface_march import InterfaceMarch
from upd.hbm.interface_settle import settle
from upd.hbm.interface_step import STICK
from upd.progress import Stages
from upd.scene.forced_contact import SIDES

log = logging.getLogger(__name__)


def solve_faces(solution: ForcedSolution, name: str, stages: Stages) -> list[SweepJob]:
    """The balance's curves where they are asked for; the sweeps that wait to be marched.

    Parameters
    ----------
    solution
        With the faces; curves are added to it, and with "auto" what their peaks settle at.
    name
        Of the contact.
    """
    scene = solution.plan.scene
    if scene.balance.method == "march":
        return whole_faces_jobs(solution, name)
    jobs, faces = [], solution.faces[name]
    for ratio in scene.excitation.centrifugal_to_force:
        with stages("friction", f"{name}, F_C/F_E {ratio:g}: {faces.of.n} nodes"):
            curve = balance_curve(solution.plan, name, faces, ratio)
            solution.balanced.append(curve)
        if scene.balance.method == "balance":
            continue
        with stages("time march", f"{curve.case}: its peaks, from their own motion"):
            solution.confirmations += [
                confirm_faces(solution.plan, faces, curve, p) for p in curve.peaks["right"]
            ]
        jobs += _job(solution.plan, faces, curve)
    return jobs


def balance_curve(plan: ForcedPlan, name: str, faces: WholeFaces, ratio: float) -> FacesCurve:
    """The balance from the static state along the sweep, rising.

    Parameters
    ----------
    name
        Of the contact.
    ratio
        F_C/F_E.
    """
    b, force = plan.scene.balance, plan.scene.damper.centrifugal / ratio
    excitation = excitation_of(plan.scene.excitation)
    found = interface_response(
        faces.march,
        grid(plan),
        force * excitation.drive,
        faces.start,
        harmonics=blade_harmonics(plan.scene),
        samples=SAMPLES if b.samples == "auto" else b.samples,
        fallback=by_coulomb,
    )
    read = found.amplitude[:, excitation.lowest]
    scale = -((2.0 * np.pi * excitation.lowest * found.frequency) ** 2) * 1e-3 / force
    H = {side: scale * read[:, k] for k, side in enumerate(SIDES)}
    modes = stuck_modes_of(faces.march, CANDIDATES * plan.scene.excitation.stop)
    peaks = {side: _peaks(found, np.abs(H[side]), read, modes) for side in SIDES}
    return FacesCurve(name, ratio, force, found, H, peaks)


def _peaks(
    found: InterfaceResponse, size: Array, read: ComplexArray, modes: ModeShapes
) -> tuple[ModePeak, ...]:
    if not len(size):
        return ()
    maxima = sweep_maxima(found.frequency, size, found.jumps)
    at = np.array([one.sample for one in maxima], int)
    return tuple(numbered(modes, maxima, read[at, len(SIDES) :]))


def confirm_faces(
    plan: ForcedPlan, faces: WholeFaces, curve: FacesCurve, peak: ModePeak
) -> Confirmation:
    """March on from the balance's motion at a peak.

    Parameters
    ----------
    peak
        Of the curve.
    """
    answer, i = curve.answer, peak.sample
    height, f = float(np.abs(curve.accelerance["right"][i])), float(answer.frequency[i])
    excitation = excitation_of(plan.scene.excitation)
    drive = curve.force * excitation.drive
    march = InterfaceMarch(faces.march, f, drive, answer.equations.samples, by_coulomb)
    try:
        found = settle(march, answer.state_at(i), TOLERANCE, MOST_PERIODS)
    except ConvergenceError as error:
        log.info("%s, peak %d: %s", curve.case, peak.number, error)
        return Confirmation(curve, peak, height, float("nan"), False)
    size = (2.0 * np.pi * excitation.lowest * f) ** 2 * 1e-3 / curve.force
    marched = size * abs(found.first_harmonic[SIDES.index("right")])
    return Confirmation(curve, peak, height, float(marched), found.settled)


def _job(plan: ForcedPlan, faces: WholeFaces, curve: FacesCurve) -> list[SweepJob]:
    """Sweeps where nodes move or motions are missing and a little beside, from the balance's
    motion there; none where all sticks.
    """
    e, f = plan.scene.excitation, curve.frequency
    moving = f[curve.answer.share[:, STICK] < 1.0] if not curve.empty else f
    moving = np.append(moving, curve.answer.missed)
    if not curve.answer.arrived:
        moving = np.append(moving, [f[-1] if len(f) else e.start, e.stop])
    if not len(moving):
        return []
    low = max(e.start, float(moving.min()) * (1.0 - BESIDE))
    high = min(e.stop, float(moving.max()) * (1.0 + BESIDE))
    frequency, start = spread(low, high), faces.start
    before = np.flatnonzero(f <= low)
    if len(before):
        start = curve.answer.state_at(int(before[-1]))
    return [SweepJob(curve.stiffness, curve.ratio, faces.march, frequency, start)]
