"""What a sweep will do before it does it: which points are missing, what they share, how many may run side by side."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from upd.analyses import analysis_of
from upd.analyses.base import Needs
from upd.batch.dask import check_address
from upd.batch.grid import Axis, Place, parse_axes, places, settings
from upd.batch.points import Outcome, Task, point_settings, read_point
from upd.cache.arrays import cache_limit
from upd.cache.sources import source_digest
from upd.errors import InputError
from upd.linalg import select
from upd.scene import AnyScene, load_scene


@dataclass(frozen=True)
class SweepPlan:
    """A sweep before it runs.

    tasks    : one per point of the grid, in its order. kept : outcomes of earlier calls. refused : points the scene does not allow.
    groups   : point -> what it shares with others (model of the two bodies; meshes).
    meshes, condensations : how many different ones the missing points need.
    memory_bytes : of the largest point.
    """

    scene: AnyScene
    axes: tuple[Axis, ...]
    places: tuple[Place, ...]
    tasks: tuple[Task, ...]
    files: tuple[str, ...]
    kept: dict[int, Outcome]
    refused: dict[int, Outcome]
    groups: dict[int, str]
    meshes: int
    condensations: int
    memory_bytes: float
    workers: int
    threads: int
    notes: tuple[str, ...]

    @property
    def missing(self) -> list[int]:
        """Numbers of the points to solve."""
        return sorted(self.groups)


def plan_sweep(
    scene: AnyScene,
    vary: Sequence[str],
    folder: Path,
    *,
    workers: int | None = None,
    threads: int = 1,
    cache: Path | None = None,
    cluster: str = "",
) -> SweepPlan:
    """Plan the full factorial of ``vary`` (texts path=first:last:count or path=value,value); `folder` may hold earlier points.

    workers : processes side by side, at most as threads allow; None: as many as cores and memory allow.
    cache   : folder of kept condensations; None: the user's.
    Raises InputError for a bad grid, and when the scene allows none of its points.
    """
    if cluster:
        check_address(cluster)
    cores = select.threads()
    _check_numbers(workers, threads, cores)
    data = tomllib.loads(scene.text)
    axes = parse_axes(vary, data)
    grid = tuple(places(axes))
    code = source_digest(scene.recipe) if cluster else ""
    limit = cache_limit()
    where = "" if cache is None else str(cache.resolve())
    tasks = tuple(Task(scene.text, settings(axes, place), threads, where, limit, scene.recipe, code) for place in grid)
    files = tuple(f"{replace(task, cache='', limit_bytes=0.0, code='').key()}.json" for task in tasks)
    kept = {place.number: found for place in grid if (found := _kept(folder / "points" / files[place.number])) is not None}
    refused: dict[int, Outcome] = {}
    needs: dict[int, Needs] = {}
    memory = 0.0
    for place in grid:
        if place.number in kept:
            continue
        try:
            needs[place.number], taken = _needs(data, tasks[place.number])
            memory = max(memory, taken)
        except InputError as error:
            refused[place.number] = Outcome(failure=" ".join(f"InputError: {error}".split()))
    if len(refused) == len(grid):
        raise InputError(f"no point of the grid can be run. The first: {refused[0].failure.removeprefix('InputError: ')}")
    many, notes = _workers(workers, threads, cores, len(needs), memory)
    parts = frozenset().union(*(need.condensations for need in needs.values()))
    return SweepPlan(
        scene=scene,
        axes=axes,
        places=grid,
        tasks=tasks,
        files=files,
        kept=kept,
        refused=refused,
        groups={number: need.model for number, need in needs.items()},
        meshes=len({need.mesh for need in needs.values()}),
        condensations=len(parts),
        memory_bytes=memory,
        workers=many,
        threads=threads,
        notes=(*notes, *_sharing_notes(needs)),
    )


def _check_numbers(workers: int | None, threads: int, cores: int) -> None:
    if workers is not None and workers < 0:
        raise InputError(f"--workers {workers}: give 1 or more")
    if not 1 <= threads <= cores:
        raise InputError(f"--threads {threads}: this machine has {cores} cores; give 1 to {cores}")


def _kept(path: Path) -> Outcome | None:
    found = read_point(path)
    return found if found is not None and found.final else None


def _needs(data: dict[str, Any], task: Task) -> tuple[Needs, float]:
    """What one point needs, and its bytes."""
    scene = load_scene(data, point_settings(data, task.settings))
    analysis = analysis_of(scene)
    plan = analysis.make_plan(scene)
    return analysis.needs(plan, task.threads), plan.memory_bytes


def _workers(asked: int | None, threads: int, cores: int, missing: int, memory: float) -> tuple[int, list[str]]:
    """Processes side by side, and why fewer than asked for."""
    if asked == 0:
        return 0, []
    room = cores // threads
    fitting = math.floor(select.memory_left() / memory) if memory else room
    many = max(1, min(room, missing, fitting, asked or room))
    notes = []
    if asked and asked > room:
        notes.append(f"{asked} workers of {threads} threads are more than the {cores} cores: {many} run side by side")
    if fitting < min(room, missing, asked or room):
        notes.append(f"memory allows {max(1, fitting)} workers of {memory / 1e9:.2g} GB")
    return many, notes


def _sharing_notes(needs: dict[int, Needs]) -> list[str]:
    notes = []
    if any(need.factors for need in needs.values()):
        notes.append("displacements inside the bodies are asked for: their factor is not kept on disk, each worker makes it once a model")
    if any(need.condensations for need in needs.values()):
        notes.append(
            "points do not start from their neighbours: a contact set is found from load to load inside a point, at hardly any cost"
        )
    elif needs:
        notes.append("points do not start from their neighbours: each is solved on its own")
    return notes
