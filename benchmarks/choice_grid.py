"""A chosen damper checked by a grid of runs: `upd sweep` over the same range and loads."""

from __future__ import annotations

import math
import resource
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upd.analyses import make_plan
from upd.analyses.forced.curves import QUARTER, point_limit
from upd.analyses.forced.model import Model, make_model
from upd.analyses.forced.plan import ForcedPlan
from upd.analyses.forced.statics import face_laws
from upd.analyses.seated.bodies import make_bodies
from upd.batch.engine import Watcher
from upd.batch.plan import plan_sweep
from upd.batch.sweeps import run_sweep
from upd.errors import InputError
from upd.progress import Stages
from upd.scene import ForcedScene
from upd.scene.quantities import FROM_FORCE, UNKNOWN
from upd.scene.ranges import with_values
from upd.sizing.choice import BestDamper
from upd.sizing.ranges import InputRange, bare
from upd.vary.outcome import Outcome

Array = NDArray[np.float64]
#: relative difference of F_C/F_E of two loads that are one
SAME = 1e-6


@dataclass(frozen=True)
class GridCheck:
    """Worst peaks by a grid of runs.

    Attributes
    ----------
    path : str
        What is varied.
    values, heights : (n,) ndarray
        In the unit inside; worst peak, nan of points that failed or lack one.
    seconds, processor_seconds : float
        Of the grid; 0 of points kept of earlier calls.
    """

    path: str
    values: Array
    heights: Array
    seconds: float
    processor_seconds: float

    @property
    def best(self) -> int:
        """Number of the lowest."""
        return int(np.nanargmin(self.heights))

    def within(self, value: float) -> bool:
        """Whether a value is between the neighbours of the lowest."""
        k = self.best
        ends = self.values[max(k - 1, 0)], self.values[min(k + 1, len(self.values) - 1)]
        return bool(ends[0] <= value <= ends[1])


def check_by_grid(
    found: BestDamper,
    count: int,
    out: str | Path,
    *,
    workers: int | None = None,
    watch: Watcher | None = None,
) -> GridCheck:
    """Worst peaks of runs on a grid, of both ends of the range of F_E and of the force that decides
    the optimum. Where F_C alone is varied every run counts for all F_C in whose range of F_E its
    F_C/F_E is: peaks per newton depend on that alone, and within the range there may be higher ones
    than at its ends.

    Parameters
    ----------
    found
        With the ranges; of what is chosen the one that sets F_C is varied, or else the first, all
        others at the optimum.
    count
        Points of the grid: evenly on a logarithmic axis of F_C, else on a linear one.
    out
        Folder of the sweep; called again with the same one, only missing points run.
    workers
        Processes.
    watch
        Called with the progress.

    Raises
    ------
    InputError
        For fewer than three points.
    """
    ranges = found.ranges
    if count < 3:
        raise InputError(f"grid: {count} points are no grid; give 3 or more")
    one = ranges.pressing or ranges.over[0]
    log = ":log" if one.only_centrifugal else ""
    vary = [f"{one.path}={one.text(one.low)}:{one.text(one.high)}:{count}{log}"]
    for unsure in ranges.unsure:
        ends = ",".join(str(unsure.text(value)) for value in _ends(unsure))
        vary.append(f"{unsure.path}={ends}")
    before = _processor()
    plan = plan_sweep(grid_scene(found), vary, Path(out), workers=workers)
    done = run_sweep(plan, Path(out), follow=["peak_*_accelerance"], watch=watch)
    tops = np.array([_tops(outcome, found) for outcome in done.outcomes], object)
    each = _worst(tops.reshape(count, -1), found, one)
    spread = np.geomspace if log else np.linspace
    return GridCheck(
        one.path, spread(one.low, one.high, count), each, done.seconds, _processor() - before
    )


def _ends(unsure: InputRange) -> list[float]:
    values = {unsure.low, unsure.high}
    if unsure.low < unsure.nominal < unsure.high:
        values.add(unsure.nominal)
    return sorted(values)


def grid_scene(found: BestDamper) -> ForcedScene:
    """The scene of every run of a grid, but for what is varied.

    Parameters
    ----------
    found
        With the ranges.
    """
    c = found.best.best.log_centrifugal
    deciding = [math.exp(c - s) for s, *_ in found.best.best.deciding]
    low, high = found.ranges.forces
    shapes = zip(found.ranges.shapes, found.best.values, strict=True)
    forces = [low, high, *(f for f in deciding if low * 1.001 < f < high / 1.001)]
    return with_values(
        found.ranges.scene,
        {
            "excitation.force": [f"{f!r} N" for f in sorted(set(forces))],
            "excitation.centrifugal_to_force": FROM_FORCE,
            # between coarser ones peaks are read too high or lost
            "excitation.points": max(_fine_points(*rig) for rig in rig_models(found)),
            "want": ["response"],
            "contact.stiffness": [found.stiffness],
            "left_out.solve": "no",
            "accuracy": UNKNOWN,
            **{of.path: of.text(value) for of, value in shapes},
        },
    )


def rig_models(found: BestDamper) -> Iterator[tuple[ForcedPlan, Model]]:
    """The rigs of the optimum again."""
    ranges = found.ranges
    for w, _ in found.best.rigs:
        given = zip((*ranges.shapes, *ranges.unsure), (*found.best.values, *w), strict=True)
        values = {of.path: of.text(value) for of, value in given}
        scene = bare(with_values(ranges.scene, values) if values else ranges.scene, found.stiffness)
        plan: ForcedPlan = make_plan(scene)
        laws = face_laws(scene.stiffnesses[found.stiffness], Stages())
        yield plan, make_model(plan, make_bodies(plan), laws)


def _fine_points(plan: ForcedPlan, model: Model) -> int:
    """Frequencies of a sweep that are a quarter of the narrowest stuck peak's width apart."""
    e, limit = plan.scene.excitation, point_limit(plan, model, True)
    modes, width = limit.modes, limit.width
    inside = width[(modes > e.start) & (modes < e.stop) & (width > 0.0)]
    if not inside.size:
        return int(e.points)
    return max(int(e.points), math.ceil((e.stop - e.start) / (QUARTER * float(inside.min()))) + 1)


def _tops(outcome: Outcome, found: BestDamper) -> dict[float, float]:
    """F_C/F_E -> the highest peak with friction of the right blade, per newton; none where a load
    lacks one.
    """
    tops: dict[float, float] = {}
    for one in outcome.results:
        ratio = one.case.force_ratio
        named = one.name.startswith("peak_") and one.name.endswith("_accelerance")
        if named and ratio is not None and not one.case.kind and one.value is not None:
            tops[ratio] = max(tops.get(ratio, 0.0), one.value)
    return tops if len(tops) == len(grid_scene(found).excitation.force) else {}


def _worst(tops: NDArray[np.object_], found: BestDamper, one: InputRange) -> Array:
    """Worst peaks (n,) of the points of a grid; nan of those whose own runs lack one.

    Parameters
    ----------
    tops
        (n, m) of every point and every value of the uncertain inputs.
    one
        What is varied.
    """
    low, high = found.ranges.forces
    out = np.full(len(tops), math.nan)
    for k, own in enumerate(tops):
        if not all(own):
            continue
        # the largest F_C/F_E belongs to the least force
        F_C = max(own[0]) * low
        runs = tops if one.only_centrifugal else tops[k : k + 1]
        inside = [
            (ratio, height)
            for each in runs.ravel()
            for ratio, height in each.items()
            if F_C / high * (1.0 - SAME) <= ratio <= F_C / low * (1.0 + SAME)
        ]
        if found.objective == "peak":
            out[k] = max(height for _, height in inside)
        else:
            out[k] = max(F_C / ratio * height for ratio, height in inside)
    return out


def _processor() -> float:
    """Seconds of all processors that this process and those it waited for have used."""
    return sum(
        use.ru_utime + use.ru_stime
        for use in (
            resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
        )
    )
