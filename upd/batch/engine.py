"""Points to workers, outcomes to files as they come: what sweeps and studies run on.

Points of one group follow each other on one worker, a dead worker's point is given out again. Who
solves them is this process, processes of this machine, or the workers of a Dask cluster, of the
scheduler at `tcp://host:port`.
"""

from __future__ import annotations

import importlib
import importlib.util
import logging
import math
import multiprocessing
import os
import re
import signal
import threading
import time
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, TypedDict

from upd.batch.point import OTHER_CODE, Task, forget, solve_task
from upd.batch.store import PointStore
from upd.errors import InputError, UpdError
from upd.linalg import select
from upd.vary.outcome import Outcome, read_outcome

#: What sets the number of threads of the libraries, before they are loaded.
_THREADS = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


#: A point whose worker dies this often is given up.
ATTEMPTS = 3
#: Seconds after which an executor is asked again who is there.
_LOOK_S = 1.0
#: Seconds to wait for the first worker, and for one to come back when all are gone.
PATIENCE_S = 60.0
_SCHEDULER = re.compile(r"(tcp|tls)://.+:\d+")
_MISSING = (
    '--cluster needs Dask: pip install "updampers[cluster]", or leave it out to use this machine'
)
_KILLED = (
    "the worker was killed {} times, most likely for lack of memory: use fewer --workers, a "
    'coarser mesh or solver.name = "amg"; the next call tries again'
)
_LOST = "the connection to the cluster's scheduler was lost"
_AGAIN = ", then the same command; it takes up where it stood"


class Processes:
    """Processes of this machine, started (spawn) when first needed, or this one itself.

    Each is a pool of its own, so that one that dies takes no other along.

    Parameters
    ----------
    count
        Processes side by side; 0: this process, one point at a time.
    threads
        Threads of each; 0: as many as the libraries take by themselves.
    fresh
        A new process for every point: nothing an earlier one left counts in its memory, nor
        shortens its time.

    Attributes
    ----------
    deaths
        What the future of a task raises whose worker died.
    """

    deaths: tuple[type[BaseException], ...] = (BrokenExecutor,)

    def __init__(self, count: int, threads: int, *, fresh: bool = False) -> None:
        self._names = [f"process {k + 1}" for k in range(count)]
        self._threads, self._fresh = threads, fresh
        #: worker -> its pool, and the number of its process
        self._pools: dict[str, tuple[ProcessPoolExecutor, Future[int]]] = {}

    def workers(self) -> Sequence[str]:
        """Names of the workers there are. Raises UpdError when none will come."""
        return self._names or ["here"]

    def submit(self, worker: str, task: str) -> Future[str]:
        """Let a worker that has nothing to do solve the task: the future of its JSON outcome."""
        if not self._names:
            future = Future[str]()
            future.set_result(solve_task(task))
            return future
        if self._fresh:
            self._end(worker)
        # Its process may have died while idle.
        with suppress(KeyError, BrokenExecutor):
            return self._pools[worker][0].submit(solve_task, task)
        self._end(worker)
        pool = ProcessPoolExecutor(
            1, multiprocessing.get_context("spawn"), initializer=_begin_worker
        )
        with _environment({name: str(self._threads) for name in _THREADS if self._threads}):
            self._pools[worker] = (pool, pool.submit(os.getpid))
        return pool.submit(solve_task, task)

    def close(self) -> None:
        """End the workers, at once."""
        if not self._names:
            forget()
        for worker in list(self._pools):
            self._end(worker)

    def _end(self, worker: str) -> None:
        if worker in self._pools:
            pool, number = self._pools.pop(worker)
            with suppress(BrokenExecutor):
                mine = number.result()
                for child in multiprocessing.active_children():
                    if child.pid == mine:
                        child.kill()
            pool.shutdown()


def _begin_worker() -> None:
    # Ctrl-C reaches the whole group: the batch itself ends its processes.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Failures come back as outcomes; tracebacks between the lines of progress help nobody.
    logging.getLogger("upd").addHandler(logging.NullHandler())
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


class DaskCluster:
    """The workers of a scheduler, each with one point at a time.

    A worker that dies is Dask's to replace; its point is given out again.

    Workers live on from point to point: the memory of a point counts what earlier ones left there.

    Parameters
    ----------
    address
        Of the scheduler, "tcp://host:port".

    Raises
    ------
    InputError
        When the address is none, Dask is missing, or no worker comes within a minute.
    """

    def __init__(self, address: str) -> None:
        check_address(address)
        dask = importlib.import_module("distributed")
        self.deaths: tuple[type[BaseException], ...] = (dask.KilledWorker, CancelledError, OSError)
        self._patience = PATIENCE_S
        # Dask's loggers are silent: what goes wrong is reported once, by an error of ours.
        known = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
        self._levels = {logger: logger.level for logger in map(logging.getLogger, known)}
        for logger in self._levels:
            logger.setLevel(logging.CRITICAL + 1)
        self._executors: dict[str, Any] = {}
        self._known: tuple[float, list[str]] = (-_LOOK_S, [])
        self._seen = time.monotonic()
        try:
            self._client = dask.Client(address, timeout=min(self._patience, 15.0))
        except OSError as error:
            raise InputError(
                f"--cluster {address}: no scheduler answers there ({type(error).__name__}): start "
                "one with `dask scheduler`"
            ) from None
        try:
            self._client.wait_for_workers(1, timeout=self._patience)
        except OSError:
            self.close()
            raise InputError(
                f"--cluster {address}: no worker came within {self._patience:g} s: start some "
                f"with `dask worker {address} --nthreads 1`"
            ) from None

    def workers(self) -> Sequence[str]:
        """Addresses of the workers there are, asked for once a second.

        A look costs as much as a point's traffic.
        """
        if self._client.status not in ("running", "connecting"):
            raise UpdError(f"{_LOST}: start it again{_AGAIN}")
        now = time.monotonic()
        if now - self._known[0] > _LOOK_S:
            try:
                self._known = (now, sorted(self._client.nthreads()))
            except (OSError, RuntimeError) as error:
                raise UpdError(
                    f"{_LOST} ({type(error).__name__}): start it again{_AGAIN}"
                ) from None
        if self._known[1]:
            self._seen = now
        elif now - self._seen > self._patience:
            raise UpdError(
                f"the cluster has had no worker for {self._patience:g} s: start some{_AGAIN}"
            )
        return self._known[1]

    def submit(self, worker: str, task: str) -> Future[str]:
        if worker not in self._executors:
            # pure=False: Dask must not take two equal texts for one.
            self._executors[worker] = self._client.get_executor(workers=[worker], pure=False)
        future: Future[str] = self._executors[worker].submit(solve_task, task)
        return future

    def close(self) -> None:
        try:
            if self._client.status == "running":
                for executor in self._executors.values():
                    executor.shutdown(wait=False)
                # Other people's workers keep nothing of ours.
                self._client.run(forget, on_error="ignore")
        except OSError:
            pass
        self._client.close(timeout=5)
        for logger, level in self._levels.items():
            logger.setLevel(level)


#: who solves points: names of workers, `submit`, `close`
Executor = Processes | DaskCluster


def check_address(address: str) -> None:
    """Raise InputError for an address that is none, or when Dask is missing."""
    if not _SCHEDULER.fullmatch(address):
        raise InputError(
            f"--cluster {address}: write the address of a Dask scheduler, tcp://host:port; on this "
            "machine alone use --workers"
        )
    if importlib.util.find_spec("distributed") is None:
        raise InputError(_MISSING)


class WorkersAsked(TypedDict, total=False):
    """Who shall solve the points, as a user gives it: see `upd.sweep` and `upd.study`."""

    workers: int | None
    threads: int | None
    cluster: str


@dataclass(frozen=True)
class Workers:
    """Who solves the points.

    Attributes
    ----------
    count
        Processes side by side on this machine; 0: this process itself.
    threads
        Threads of each; 0: as many as the libraries take by themselves.
    cluster
        "tcp://host:port": the workers of a Dask scheduler instead.
    fresh
        A new process for every point, so that its seconds and memory are its own.
    """

    count: int = 1
    threads: int = 1
    cluster: str = ""
    fresh: bool = False

    def open(self) -> Executor:
        """The workers, not yet started. Raises InputError when there is no such cluster."""
        if self.cluster:
            return DaskCluster(self.cluster)
        return Processes(self.count, self.threads, fresh=self.fresh)


@dataclass(frozen=True)
class Progress:
    """How far a batch is.

    Attributes
    ----------
    rate, left_s
        Points per s of this call, and s to go: as predicted for each point, corrected by what the
        finished ones took.
    label, seconds, failure
        Of the point that has just ended; "" when none has.
    """

    done: int
    total: int
    failed: int
    rate: float
    left_s: float
    label: str = ""
    seconds: float = 0.0
    failure: str = ""


Watcher = Callable[[Progress], None]
_NONE = Outcome()


def check_who(workers: int | None, threads: int, cluster: str) -> None:
    """Raise InputError unless workers and threads are numbers this machine can have, and the
    cluster, where one is asked for, an address.
    """
    if cluster:
        check_address(cluster)
    cores = select.threads()
    if workers is not None and workers < 0:
        raise InputError(f"--workers {workers}: give 1 or more")
    if not 1 <= threads <= cores:
        raise InputError(f"--threads {threads}: this machine has {cores} cores; give 1 to {cores}")


def fitting(asked: int | None, threads: int, missing: int, memory: float) -> tuple[int, list[str]]:
    """Processes side by side.

    Parameters
    ----------
    asked
        By the user: None for as many as cores and memory allow, 0 for this process itself.
    threads
        Of each process.
    missing
        Points to solve.
    memory
        Bytes of the largest one.

    Returns
    -------
    int, list of str
        How many, and why they are fewer than asked for.
    """
    if asked == 0:
        return 0, []
    cores = select.threads()
    room = cores // threads
    by_memory = math.floor(select.memory_left() / memory) if memory else room
    many = max(1, min(room, missing, by_memory, asked or room))
    notes = []
    if asked and asked > room:
        notes.append(
            f"{asked} workers of {threads} threads are more than the {cores} cores: {many} "
            "run side by side"
        )
    if by_memory < min(room, missing, asked or room):
        notes.append(f"memory allows {max(1, by_memory)} workers of {memory / 1e9:.2g} GB")
    return many, notes


def time_left(
    numbers: Sequence[int],
    finished: Collection[int],
    passed: float,
    side_by_side: int,
    expected: Mapping[int, float] | None = None,
) -> float:
    """Seconds to go of a batch.

    Parameters
    ----------
    numbers, finished
        All points of this call, and those that have ended.
    passed
        Seconds since it began.
    side_by_side
        Points solved at a time.
    expected
        Number -> seconds predicted; None: all alike.

    Returns
    -------
    float
        What is predicted for the others, times what the finished ones took of their prediction by
        the clock (sharing, start of workers and a wrong prediction included). Infinite when nothing
        is predicted and none has finished.
    """
    work = {k: 1.0 if expected is None else expected.get(k, 0.0) for k in numbers}
    done = sum(work[k] for k in finished)
    rest = sum(work.values()) - done
    if done > 0.0:
        return rest * passed / done
    return float("inf") if expected is None else max(0.0, rest / side_by_side - passed)


@dataclass(frozen=True)
class Batch:
    """Points to solve.

    Attributes
    ----------
    known
        Number -> outcome there is already.
    label
        Number -> words for the point.
    groups
        Number -> what the point shares with others: points of one group follow each other on one
        worker.
    seconds
        Number -> predicted for the point; None: all alike.
    """

    tasks: Sequence[Task]
    workers: Workers
    known: Mapping[int, Outcome]
    label: Callable[[int], str] = str
    groups: Mapping[int, str] = field(default_factory=dict)
    seconds: Mapping[int, float] | None = None


def run_points(
    batch: Batch,
    store: PointStore,
    *,
    check: Callable[[Outcome], None] | None = None,
    watch: Watcher | None = None,
) -> tuple[Outcome, ...]:
    """Solve the tasks whose outcome is not known yet, and keep what is final in the store, which
    the caller holds (`PointStore.sole`).

    A point that fails is an outcome with its reason; one whose worker dies is tried again,
    `ATTEMPTS` times in all. Kill the batch at any moment: finished points are kept.

    Parameters
    ----------
    check
        Called with every solved outcome; what it raises ends the batch.
    watch
        Called whenever a point has ended, and about once a second.

    Returns
    -------
    tuple of Outcome
        One per task, in their order.

    Raises
    ------
    InputError
        When there is no such cluster, or a worker has other sources.
    UpdError
        When the disk is full or the cluster has gone.
    """
    outcomes, tasks = dict(batch.known), batch.tasks
    missing = {k: task.text() for k, task in enumerate(tasks) if k not in outcomes}
    finished = set[int]()
    begin = time.perf_counter()

    def show(label: str = "", outcome: Outcome = _NONE) -> None:
        if watch is not None:
            passed, side_by_side = time.perf_counter() - begin, max(1, batch.workers.count)
            watch(
                Progress(
                    done=len(outcomes),
                    total=len(tasks),
                    failed=sum(bool(one.failure) for one in outcomes.values()),
                    rate=len(finished) / max(passed, 1e-9),
                    left_s=time_left(list(missing), finished, passed, side_by_side, batch.seconds),
                    label=label,
                    seconds=outcome.seconds,
                    failure=outcome.failure,
                )
            )

    def record(number: int, outcome: Outcome) -> None:
        store.keep(tasks[number], outcome)
        if check is not None and not outcome.failure:
            check(outcome)
        outcomes[number] = outcome
        finished.add(number)
        show(batch.label(number), outcome)

    if missing:
        executor = batch.workers.open()
        try:
            dispatch(missing, batch.groups, executor, record, show)
        finally:
            executor.close()
    return tuple(outcomes[k] for k in range(len(tasks)))


def _take(waiting: dict[str, deque[int]], own: str, opened: set[str]) -> tuple[str, int]:
    """Group and number of a worker's next point: of its own group, else of an unopened one, else of
    the largest.
    """
    largest = max(waiting, key=lambda group: len(waiting[group]))
    fresh = next((group for group in waiting if group not in opened), largest)
    group = own if own in waiting else fresh
    opened.add(group)
    number = waiting[group].popleft()
    if not waiting[group]:
        del waiting[group]
    return group, number


def dispatch(
    tasks: Mapping[int, str],
    groups: Mapping[int, str],
    executor: Executor,
    record: Callable[[int, Outcome], None],
    tick: Callable[[], None],
) -> None:
    """Have all points solved.

    Parameters
    ----------
    tasks
        Number of the point -> its JSON task.
    groups
        Number -> what it shares with others.
    record
        Called with each point's number and outcome, once.
    tick
        Called about once a second.

    Raises
    ------
    InputError, UpdError
        When a worker has other sources, or cannot run points; and whatever ``record`` raises.
    """
    waiting, opened = defaultdict[str, deque[int]](deque), set[str]()
    for number in tasks:
        waiting[groups.get(number, "")].append(number)
    #: worker -> group of its last point
    own: dict[str, str] = {}
    running: dict[Future[str], tuple[str, int]] = {}
    deaths: Counter[int] = Counter()
    while waiting or running:
        there = executor.workers()
        busy = {worker for worker, _ in running.values()}
        for worker in there:
            if waiting and worker not in busy:
                own[worker], number = _take(waiting, own.get(worker, ""), opened)
                running[executor.submit(worker, tasks[number])] = (worker, number)
        tick()
        done = wait(running, _LOOK_S, FIRST_COMPLETED).done
        if not running:
            time.sleep(_LOOK_S)
        for future, (worker, number) in list(running.items()):
            # A worker that is gone does not come back under its name.
            if future not in done and worker in there:
                continue
            del running[future]
            outcome = _outcome(future, executor) if future in done else None
            if outcome is not None:
                record(number, outcome)
                continue
            future.cancel()
            deaths[number] += 1
            if deaths[number] < ATTEMPTS:
                waiting[groups.get(number, "")].appendleft(number)
            else:
                record(number, Outcome(failure=_KILLED.format(deaths[number]), final=False))


def _outcome(future: Future[str], executor: Executor) -> Outcome | None:
    """Of a task; None where the worker died."""
    try:
        text = future.result()
    except executor.deaths:
        return None
    except Exception as error:
        raise UpdError(
            f"a worker cannot run points ({type(error).__name__}: {error}): install the same upd "
            "there as here"
        ) from error
    outcome = read_outcome(text)
    if outcome.failure.startswith(OTHER_CODE):
        raise InputError(
            f"{outcome.failure}: install the same there, or numbers of one table would "
            "come from different codes"
        )
    return outcome
