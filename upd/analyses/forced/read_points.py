"""Points of a sweep that numbers are read from, marched on until they settle.

A sweep goes on after a number of periods whether its motion repeats or not. What is read from it,
its highest point and its peaks, has to be a motion that lasts: beside a fold one dies out so slowly
that hundreds of periods change it by less than a thousandth, and it ends at a fraction of that. A
motion that never repeats, as where a damper rattles on a face that carries nearly nothing, is told
by the range in which it wanders.
"""

from __future__ import annotations

import numpy as np

from upd.analyses.forced.curves import SweptCurve
from upd.analyses.forced.excitation import excitation_of
from upd.analyses.forced.interface_model import by_coulomb
from upd.analyses.forced.march_modes import stuck_modes_of
from upd.analyses.forced.mode_peaks import CANDIDATES
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.sweeps import MOST_PERIODS, TOLERANCE, SweepJob, swept
from upd.hbm.refined_sweep import WATCHED, Told, march_on
from upd.scene.forced_contact import SIDES

#: why a height is a range
WANDERS = f"no steady motion: the range of {WATCHED} periods"


def settle_read(
    plan: ForcedPlan, job: SweepJob, sweep: SweptCurve, told: Told | None = None
) -> SweptCurve:
    """The sweep with those points marched on that the right blade's numbers are read from.

    Where one then falls, others are read instead, and marched on in their turn, each once.

    Parameters
    ----------
    job
        That the sweep is of.
    sweep
        Up or down.
    told
        Called with every frequency before it is marched.
    """
    excitation = excitation_of(plan.scene.excitation)
    modes = stuck_modes_of(job.march, CANDIDATES * plan.scene.excitation.stop)
    done = set[int]()
    while True:
        settled = sweep.found.settled
        wanted = [i for i in read_points(sweep) if not settled[i] and i not in done]
        if not wanted:
            return sweep
        found = sweep.found
        for i in wanted:
            if told is not None:
                told(float(found.frequency[i]))
            found = march_on(
                found,
                i,
                watched=range(len(SIDES)),
                least_step=job.least * float(job.frequency.mean()),
                tolerance=TOLERANCE,
                most_periods=MOST_PERIODS,
                fallback=by_coulomb,
            )
        done.update(wanted)
        k = excitation.lowest
        sweep = swept(job.name, job.ratio, sweep.force, sweep.way, found, modes, job.choice, k)


def read_points(sweep: SweptCurve) -> list[int]:
    """Numbers of the highest point and of all peaks of the right blade, rising."""
    if not len(sweep.frequency):
        return []
    top = int(np.abs(sweep.accelerance["right"]).argmax())
    return sorted({top, *(peak.sample for peak in sweep.peaks["right"])})


def ends(sweep: SweptCurve, at: int, height: float) -> tuple[float, float]:
    """Least and largest height of a point: apart where its motion is not settled, (m/s2)/N.

    Parameters
    ----------
    at
        Number of the point.
    height
        Of the last period there.
    """
    found, row = sweep.found, SIDES.index("right")
    if found.settled[at]:
        return height, height
    per_mm = abs(sweep.accelerance["right"][at]) / abs(found.amplitude[at, row])
    least, most = (float(per_mm * part[at, row]) for part in (found.lowest, found.highest))
    return min(least, height), max(most, height)


def wanders(sweep: SweptCurve) -> bool:
    """Whether the height of the highest point is not that of a motion that lasts.

    One that does not repeat, or only after several periods of the force, may hold its height.
    """
    found = sweep.found
    if not len(sweep.frequency):
        return False
    size = np.abs(sweep.accelerance["right"])
    at = int(size.argmax())
    if found.settled[at]:
        return False
    low, high = ends(sweep, at, float(size[at]))
    return bool(found.periods[at] < MOST_PERIODS or high > (1.0 + TOLERANCE) * low)
