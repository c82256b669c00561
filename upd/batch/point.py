"""One point of a batch: a JSON task in, a JSON outcome out.

Sweeps and studies give the same tasks to the same workers.
"""

from __future__ import annotations

import json
import logging
import os
import socket
import threading
import time
import tomllib
import traceback
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from upd.cache.arrays import LIMIT_BYTES, Store, cache_folder, sharing
from upd.cache.sources import key_of, source_digest
from upd.errors import UpdError
from upd.linalg.pardiso import load as load_pardiso
from upd.linalg.select import has_pardiso
from upd.report.notebook import RunResult
from upd.scene import AnyScene, load_scene
from upd.scene.quantities import UNKNOWN
from upd.vary.outcome import Outcome

log = logging.getLogger(__name__)

#: Outputs that only files show; points write none.
_FILES_ONLY = ("fields",)
#: One point at a time in a process: limits of threads and what is shared belong to the process.
_turn = threading.Lock()
_stores: dict[tuple[Path, int, float], Store] = {}
#: Begins the failure of a worker with other sources than those of whoever gives the points.
OTHER_CODE = "the worker runs another version of upd, of its libraries or of the recipe"


@dataclass(frozen=True)
class Task:
    """What a worker is given.

    Attributes
    ----------
    scene
        The scene as TOML.
    settings
        Path -> value: what this point changes in the scene.
    threads
        Threads of the libraries, which the last digits depend on; 0: as many as they take by
        themselves.
    limit_bytes
        Bytes that the worker's folder of kept condensations may hold.
    recipe
        The scene's recipe.
    code
        Digest of the sources the worker must have; "" asks for none.
    alone
        Share nothing with other points and leave no output out: seconds and memory are then those
        of a single run.
    """

    scene: str
    settings: Mapping[str, Any]
    threads: int = 1
    limit_bytes: float = LIMIT_BYTES
    recipe: str = ""
    code: str = ""
    alone: bool = False

    def text(self) -> str:
        """The task as JSON."""
        return json.dumps(asdict(self))

    def key(self) -> str:
        """Name of the point's file.

        Scene, values, threads (rounding) and the code that solves it.
        """
        return key_of(
            {
                "scene": self.scene,
                "set": self.settings,
                "threads": self.threads,
                "alone": self.alone,
                "code": self.code,
            }
        )[:20]


def solve_task(text: str) -> str:
    """Solve the point of a JSON task and return its JSON outcome; a failure becomes its reason.

    Runs in the workers.
    """
    task = Task(**json.loads(text))
    with _turn:
        if task.code and task.code != source_digest(task.recipe):
            return Outcome(failure=f"{OTHER_CODE} on {socket.gethostname()}", final=False).text()
        here = f"{socket.gethostname()}:{os.getpid()}"
        return replace(_solved(task), where=here).text()


def forget() -> None:
    """Release the models kept in this process."""
    _stores.clear()


def load_point(task: Task) -> AnyScene:
    """The scene of a point. Raises InputError where it does not take the settings."""
    data = tomllib.loads(task.scene)
    settings = task.settings if task.alone else point_settings(data, task.settings)
    scene: AnyScene = load_scene(data, dict(settings))
    return scene


def point_settings(data: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a point that shares with others: without outputs that only files show, and
    without estimates unless an accuracy is asked for, which would cost a third of a sweep.
    """
    mine = {} if "accuracy" in data else {"accuracy": UNKNOWN}
    mine |= settings
    want = settings.get("want", data.get("want"))
    if not isinstance(want, Sequence) or isinstance(want, str):
        return mine
    kept = [w for w in want if w not in _FILES_ONLY]
    return {**mine, "want": kept} if kept and len(kept) < len(want) else mine


def _solved(task: Task) -> Outcome:
    from upd.runner import run

    begin = time.perf_counter()
    mine = cache_folder() / "condensed", task.threads, task.limit_bytes
    store = None if task.alone else _stores.setdefault(mine, Store(*mine))
    before = {} if store is None else dict(store.counts)
    try:
        scene = load_point(task)
        with ExitStack() as around:
            if task.threads:
                if has_pardiso():
                    # Loaded first, so that its threads are limited too.
                    load_pardiso()
                around.enter_context(threadpool_limits(limits=task.threads))
            if store is not None:
                around.enter_context(sharing(store))
            result = run(scene)
    except Exception as error:  # a point must not end the batch, whatever it meets
        return _failed(error, time.perf_counter() - begin)
    return _outcome(
        result, {} if store is None else {k: n - before[k] for k, n in store.counts.items()}
    )


def _failed(error: Exception, seconds: float) -> Outcome:
    final = isinstance(error, (UpdError, ArithmeticError))
    known = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    if not final:
        log.exception("point failed")
        last = traceback.extract_tb(error.__traceback__)[-1]
        known += f" ({Path(last.filename).name}, line {last.lineno})"
    return Outcome(failure=" ".join(known.split()), final=final, seconds=seconds)


def _outcome(result: RunResult, shared: Mapping[str, int]) -> Outcome:
    return Outcome(
        result.results,
        seconds=float(result.cost["total_s"]),
        memory_mb=float(result.cost["peak_rss_mb"]),
        stages=dict(result.cost["stages"]),
        n_dof=int(sum(result.size["n_dof"].values())),
        warnings=(
            *sorted({c.name for c in result.checks if not c.passed}),
            *(
                f"{r.name} ({r.case}) not reached: {r.withheld}"
                for r in result.results
                if r.withheld
            ),
        ),
        shared=shared,
    )
