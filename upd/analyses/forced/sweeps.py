"""Curves by time integration: stepped sine up and down, as in an experiment.

Where friction and lift-off leave several steady motions, a curve by harmonic balance follows one
path through all of them. A sweep shows what a rig would: rising, the motion that the past below
leads to; falling, the one from above.
"""

from __future__ import annotations

import numpy as np

from upd.analyses.forced.curves import SweptCurve, Way
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.interface_model import by_coulomb
from upd.analyses.forced.march_modes import stuck_modes_of
from upd.analyses.forced.measures import PEAKS_ABOVE, PathPeak
from upd.analyses.forced.mode_peaks import CANDIDATES, ModePeak, ModeShapes, numbered
from upd.analyses.forced.model import Array
from upd.analyses.forced.paths import grid
from upd.analyses.forced.plan import ForcedPlan, time_steps
from upd.hbm.interface_state import InterfaceModel, InterfaceState
from upd.hbm.interface_sweep import SteppedSine, stepped_sine
from upd.linalg.parallel import threads_for
from upd.scene.forced_contact import SIDES

#: how steady a motion has to be
TOLERANCE = 1e-3
#: periods after which a motion counts as not settled: light damping, 0.5 %, leaves 1e-3 of a
#: transient after 220, and a third of the damping after 660
MOST_PERIODS = 700


def both_ways(
    plan: ForcedPlan, name: str, ratio: float, march: InterfaceModel, start: InterfaceState
) -> list[SweptCurve]:
    """The sweep up from a state, and the one down from where that ends.

    Parameters
    ----------
    name, ratio
        Of the contact; F_C/F_E.
    march, start
        What is integrated, and where it begins.
    """
    scene, out = plan.scene, []
    force, excitation = scene.damper.centrifugal / ratio, excitation_of(scene.excitation)
    modes, frequency = stuck_modes_of(march, CANDIDATES * scene.excitation.stop), grid(plan)
    ways: tuple[tuple[Way, Array], ...] = (("up", frequency), ("down", frequency[::-1]))
    with threads_for(3 * march.n):
        for way, f in ways:
            found = stepped_sine(
                march,
                f,
                force * excitation.drive,
                start,
                samples=time_steps(scene),
                tolerance=TOLERANCE,
                most_periods=MOST_PERIODS,
                fallback=by_coulomb,
                accelerate=False,
            )
            start, k = found.state, excitation.lowest
            scale = -((2.0 * np.pi * k * found.frequency) ** 2) * 1e-3 / force
            H = {side: scale * found.amplitude[:, j] for j, side in enumerate(SIDES)}
            peaks = {side: _peaks(found, np.abs(H[side]), modes) for side in SIDES}
            out.append(SweptCurve(name, ratio, force, way, found, H, peaks))
    return out


def _peaks(found: SteppedSine, size: Array, modes: ModeShapes) -> tuple[ModePeak, ...]:
    maxima = sweep_maxima(found.frequency, size)
    at = np.array([one.sample for one in maxima], int)
    return tuple(numbered(modes, maxima, found.amplitude[at, len(SIDES) :]))


def sweep_maxima(frequency: Array, size: Array) -> list[PathPeak]:
    """Local maxima of a sweep, at its own points: the motion may jump between two of them.

    Parameters
    ----------
    frequency, size
        (k,) in the order of the sweep.
    """
    if len(size) < 3:
        return []
    inner = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    least = PEAKS_ABOVE * float(size.max())
    return [
        PathPeak(float(frequency[i]), float(size[i]), int(i)) for i in inner if size[i] >= least
    ]
