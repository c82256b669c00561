"""Self-checks of curves of whole faces by harmonic balance."""

from __future__ import annotations

import math

import numpy as np

from upd.analyses.forced.curves import FacesCurve
from upd.hbm.adaptive import TRUNCATION
from upd.results import Check

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
        Check(
            "balance residual",
            case,
            float(max(residual)),
            _RESIDUAL,
            "misfit of blades' forces, slips and damper's motion of a period, relative",
            "report this scene",
            fatal=False,
        ),
        Check(
            "energy balance",
            case,
            float(loss.max()),
            _ENERGY,
            "|work - damping - friction| / their sum, of a period",
            "take more samples: balance.samples",
            fatal=False,
        ),
        Check(
            "truncation",
            case,
            float(max(left_out)),
            _LEFT_OUT,
            f"motion of the faces by blades' harmonics above {highest}, relative",
            f"take more: balance.harmonics = {highest + 2}",
            fatal=False,
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
        Check(
            "frequency step",
            curve.case,
            steps[widest],
            WIDEST_STEP,
            "largest step at a peak over its half-power width",
            f"peak {widest.number} at {widest.frequency:.4g} Hz lies between points too far apart "
            f"for its height; take more: excitation.points = {more}",
            fatal=False,
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
