"""What a sweep will do before it does it.

Which points are missing, what they share, how many may run side by side.
"""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from upd.analyses import analysis_of, make_plan
from upd.analyses.base import Needs
from upd.batch.engine import Workers, check_address, check_numbers, fitting
from upd.batch.grid import (
    Place,
    Sample,
    draw_sample,
    parse_axes,
    places,
    sample_axes,
    sample_places,
    sample_texts,
    settings,
)
from upd.batch.point import Task, load_point
from upd.batch.store import PointStore
from upd.cache.arrays import cache_limit
from upd.cache.sources import source_digest
from upd.errors import InputError
from upd.plot.sweep_charts import Parameter
from upd.scene import AnyScene
from upd.vary.outcome import Outcome

_FACTORS = (
    "displacements inside the bodies are asked for: their factor is not kept on disk, each worker "
    "makes it once a model"
)


@dataclass(frozen=True)
class SweepPlan:
    """A sweep before it runs.

    Attributes
    ----------
    tasks
        One per point of the grid, in its order.
    kept
        Outcomes of earlier calls.
    refused
        Points the scene does not allow.
    groups
        Missing point -> what it shares with others (model of the two bodies; meshes).
    meshes, condensations
        How many different ones the missing points need.
    memory_bytes
        Of the largest point.
    seconds
        Missing point -> seconds predicted for it.
    workers
        Who solves them.
    notes
        What a user should know of sharing and workers.
    sample
        The points are drawn from the scene's uncertain inputs; None for a grid.
    """

    scene: AnyScene
    axes: tuple[Parameter, ...]
    places: tuple[Place, ...]
    tasks: tuple[Task, ...]
    kept: dict[int, Outcome]
    refused: dict[int, Outcome]
    groups: dict[int, str]
    meshes: int
    condensations: int
    memory_bytes: float
    seconds: dict[int, float]
    workers: Workers
    notes: tuple[str, ...]
    sample: Sample | None = None

    def label(self, number: int) -> str:
        """Values of a point in words: friction 0.3, centrifugal 350 N."""
        if self.sample is not None:
            return f"point {number} of {self.sample.count}" if number else "inputs as given"
        return ", ".join(
            axis.with_unit(k) for axis, k in zip(self.axes, self.places[number], strict=True)
        )


def plan_sweep(
    scene: AnyScene,
    vary: Sequence[str],
    folder: Path,
    *,
    sample: int | None = None,
    seed: int | None = None,
    workers: int | None = None,
    threads: int = 1,
    cluster: str = "",
) -> SweepPlan:
    """Plan the full factorial of ``vary``, or a sample of the scene's uncertain inputs.

    Parameters
    ----------
    vary
        Texts path=first:last:count or path=value,value.
    folder
        May hold earlier points.
    sample
        Points drawn from the limits of the uncertain inputs, in place of ``vary``.
    seed
        Of the draw; None: that of the sample in the folder, else 0.
    workers
        Processes side by side, at most as threads allow; None: as many as cores and memory allow;
        0: this process.
    cluster
        "local:4" or "tcp://host:port".

    Raises
    ------
    InputError
        For a bad grid or sample, for both together, and when the scene allows none of the points.
    """
    if cluster:
        check_address(cluster)
    check_numbers(workers, threads)
    store = PointStore(folder, "sweep")
    drawn = _drawn(scene, vary, store, sample, seed)
    if drawn is None:
        axes = parse_axes(vary, tomllib.loads(scene.text))
        grid = tuple(places(axes))
        given = [(scene.text, settings(axes, place)) for place in grid]
    else:
        axes, grid = sample_axes(drawn), sample_places(drawn)
        given = [(text, {}) for text in sample_texts(scene, drawn, axes)]
    code = source_digest(scene.recipe)
    limit = cache_limit()
    tasks = tuple(
        Task(text, changed, threads, limit, scene.recipe, code) for text, changed in given
    )
    kept = store.finished(tasks)
    needs, refused = point_needs(tasks, kept)
    if len(refused) == len(grid):
        raise InputError(
            f"no point of the {'grid' if drawn is None else 'sample'} can be run. The first: "
            f"{refused[0].failure.removeprefix('InputError: ')}"
        )
    memory = max((one.memory_bytes for one in needs.values()), default=0.0)
    many, notes = fitting(workers, threads, len(needs), memory)
    shared = [one.shared for one in needs.values()]
    return SweepPlan(
        scene=scene,
        axes=axes,
        places=grid,
        tasks=tasks,
        kept=kept,
        refused=refused,
        groups={number: one.shared.model for number, one in needs.items()},
        meshes=len({one.mesh for one in shared}),
        condensations=len(frozenset().union(*(one.condensations for one in shared))),
        memory_bytes=memory,
        seconds={number: one.seconds for number, one in needs.items()},
        workers=Workers(many, threads, cluster),
        notes=(*notes, *([_FACTORS] if any(one.factors for one in shared) else [])),
        sample=drawn,
    )


def _drawn(
    scene: AnyScene, vary: Sequence[str], store: PointStore, count: int | None, seed: int | None
) -> Sample | None:
    """The sample that is asked for; None for a grid."""
    if count is None:
        if seed is not None:
            raise InputError(f"--seed {seed}: is for --sample; give its number of points too")
        return None
    if vary:
        raise InputError(
            f"--sample {count}, --vary {vary[0]}: a sample draws the scene's uncertain inputs, a "
            "grid goes through values that are given; to fix it: give one of both (--set fixes "
            "a value in a sample)"
        )
    return draw_sample(scene, count, store.kept_seed() if seed is None else seed)


class PointNeeds(NamedTuple):
    """What a point shares with others, its memory and its seconds."""

    shared: Needs
    memory_bytes: float
    seconds: float


def point_needs(
    tasks: Sequence[Task], kept: Collection[int] = ()
) -> tuple[dict[int, PointNeeds], dict[int, Outcome]]:
    """What every missing point needs, and the points that the scene does not allow."""
    needs: dict[int, PointNeeds] = {}
    refused: dict[int, Outcome] = {}
    for number, task in enumerate(tasks):
        if number in kept:
            continue
        try:
            scene = load_point(task)
            plan = make_plan(scene)
            shared = analysis_of(scene).needs(plan, task.threads)
        except InputError as error:
            refused[number] = Outcome(failure=" ".join(f"InputError: {error}".split()))
        else:
            needs[number] = PointNeeds(shared, plan.memory_bytes, plan.seconds)
    return needs, refused
