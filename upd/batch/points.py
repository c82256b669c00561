"""One point of a sweep: a JSON task in, a JSON outcome out, and the file it is kept in."""

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
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from upd.cache.arrays import LIMIT_BYTES
from upd.cache.shared import Store, condensation_folder, sharing
from upd.cache.sources import key_of, source_digest
from upd.errors import UpdError
from upd.linalg.pardiso import load as load_pardiso
from upd.linalg.select import has_pardiso
from upd.report.notebook import RunResult
from upd.scene import load_scene

log = logging.getLogger(__name__)

#: Outputs that only files show; points write none.
_FILES_ONLY = ("fields",)
#: One point at a time in a process: limits of threads and what is shared belong to the process.
_turn = threading.Lock()
_stores: dict[tuple[str, int, float], Store] = {}


@dataclass(frozen=True)
class Task:
    """What a worker is told. cache: folder of kept condensations, or "" for the worker's own; code: digest of the sources it must have."""

    scene: str
    settings: Mapping[str, Any]
    threads: int = 1
    cache: str = ""
    limit_bytes: float = LIMIT_BYTES
    recipe: str = ""
    code: str = ""

    def text(self) -> str:
        """The task as JSON."""
        return json.dumps(asdict(self))

    def key(self) -> str:
        """Name of the point's file: scene, values, threads (rounding) and the code that solves it."""
        code = source_digest(self.recipe)
        return key_of({"scene": self.scene, "set": self.settings, "threads": self.threads, "code": code})[:20]


@dataclass(frozen=True)
class Outcome:
    """What a point gave: rows (name, case, unit, value), or the reason it failed.

    final  : whether the same would come out again; other failures (killed, no memory) are tried again by the next call.
    shared : what was taken from where, see `upd.cache.shared.Store`.
    """

    rows: tuple[tuple[str, str, str, float | None], ...] = ()
    failure: str = ""
    final: bool = True
    seconds: float = 0.0
    memory_mb: float = 0.0
    stages: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    shared: Mapping[str, int] = field(default_factory=dict)
    where: str = ""

    def text(self) -> str:
        """The outcome as JSON."""
        return json.dumps(asdict(self), indent=1, allow_nan=False)


def read_outcome(text: str) -> Outcome:
    """The outcome in a JSON text. Raises ValueError, TypeError or KeyError for anything else."""
    data = json.loads(text)
    rows = tuple((str(n), str(c), str(u), None if v is None else float(v)) for n, c, u, v in data["rows"])
    return Outcome(**(data | {"rows": rows, "warnings": tuple(data["warnings"])}))


def read_point(path: Path) -> Outcome | None:
    """The outcome kept in `path`; None when there is none or the file is damaged."""
    try:
        return read_outcome(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, TypeError, KeyError):
        return None


def solve_task(text: str) -> str:
    """Solve the point of a JSON task and return its JSON outcome; a failure becomes its reason. Runs in the workers."""
    task = Task(**json.loads(text))
    with _turn:
        if task.code and task.code != source_digest(task.recipe):
            return Outcome(failure=f"{OTHER_CODE} on {socket.gethostname()}", final=False).text()
        return _solved(task).text()


#: Begins the failure of a worker with other sources than the sweep's.
OTHER_CODE = "the worker runs another version of upd, of its libraries or of the recipe"


def forget() -> None:
    """Let go of the models kept in this process."""
    _stores.clear()


def point_settings(data: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a point, and the scene's outputs without those that only files show."""
    want = settings.get("want", data.get("want"))
    if not isinstance(want, Sequence) or isinstance(want, str):
        return dict(settings)
    kept = [w for w in want if w not in _FILES_ONLY]
    return {**settings, "want": kept} if kept and len(kept) < len(want) else dict(settings)


def _solved(task: Task) -> Outcome:
    from upd.runner import run

    begin = time.perf_counter()
    store = _store(task)
    before = dict(store.counts)
    try:
        if has_pardiso():
            # Loaded first, so that its threads are limited too.
            load_pardiso()
        data = tomllib.loads(task.scene)
        with threadpool_limits(limits=task.threads), sharing(store):
            result = run(load_scene(data, point_settings(data, task.settings)))
    except Exception as error:  # a point must not end the sweep, whatever it meets
        return _failed(error, time.perf_counter() - begin)
    return _outcome(result, time.perf_counter() - begin, {k: n - before[k] for k, n in store.counts.items()})


def _store(task: Task) -> Store:
    folder = task.cache or str(condensation_folder())
    return _stores.setdefault((folder, task.threads, task.limit_bytes), Store(Path(folder), task.threads, task.limit_bytes))


def _failed(error: Exception, seconds: float) -> Outcome:
    final = isinstance(error, (UpdError, ArithmeticError))
    known = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    if not final:
        log.exception("point failed")
        last = traceback.extract_tb(error.__traceback__)[-1]
        known += f" ({Path(last.filename).name}, line {last.lineno})"
    return Outcome(failure=" ".join(known.split()), final=final, seconds=seconds, where=_where())


def _outcome(result: RunResult, seconds: float, shared: Mapping[str, int]) -> Outcome:
    return Outcome(
        tuple((r.name, r.case, r.unit, float(r.value) if abs(r.value) < float("inf") else None) for r in result.rows),
        seconds=seconds,
        memory_mb=float(result.cost["peak_rss_mb"]),
        stages=dict(result.cost["stages"]),
        warnings=tuple(sorted({c.name for c in result.checks if not c.passed})),
        shared=shared,
        where=_where(),
    )


def _where() -> str:
    return f"{socket.gethostname()}:{os.getpid()}"
