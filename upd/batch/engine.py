"""Points to workers, outcomes to files as they come: what sweeps and studies run on.

Points of one group follow each other on one worker, a dead worker's point is given out again.
"""

from __future__ import annotations

import math
import time
from collections import Counter, deque
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass

from upd.batch.executors import Executor, InProcess, Processes
from upd.batch.point import OTHER_CODE, Task
from upd.batch.store import PointStore
from upd.errors import InputError, UpdError
from upd.linalg import select
from upd.vary.outcome import Outcome, read_outcome

#: A point whose worker dies this often is given up.
ATTEMPTS = 3
#: Seconds after which an executor is asked again who is there.
_LOOK_S = 1.0


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
        "local:4" or "tcp://host:port": the workers of a Dask cluster instead.
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
            from upd.batch.dask import DaskCluster

            return DaskCluster(self.cluster)
        if self.count == 0:
            return InProcess()
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
    running: int
    rate: float
    left_s: float
    label: str = ""
    seconds: float = 0.0
    failure: str = ""


Watcher = Callable[[Progress], None]


def check_numbers(workers: int | None, threads: int) -> None:
    """Raise InputError unless workers and threads are numbers this machine can have."""
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


def run_points(
    tasks: Sequence[Task],
    store: PointStore,
    workers: Workers,
    *,
    known: Mapping[int, Outcome] | None = None,
    groups: Mapping[int, str] | None = None,
    label: Callable[[int], str] = str,
    check: Callable[[Outcome], None] | None = None,
    expected: Mapping[int, float] | None = None,
    watch: Watcher | None = None,
) -> tuple[Outcome, ...]:
    """Solve the tasks whose outcome is not known yet, and keep what is final in the store, which
    the caller holds (`PointStore.sole`).

    A point that fails is an outcome with its reason; one whose worker dies is tried again,
    `ATTEMPTS` times in all. Kill the batch at any moment: finished points are
    kept.

    Parameters
    ----------
    known
        Number -> outcome there is already; None: those the store has.
    groups
        Number -> what the point shares with others: points of one group follow each other on one
        worker.
    label
        Words for a point, for ``watch``.
    check
        Called with every solved outcome; what it raises ends the batch.
    expected
        Number -> seconds predicted for the point; None: all alike.
    watch
        Called whenever a point has ended or the number of running ones may have changed.

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
    outcomes = dict(store.finished(tasks) if known is None else known)
    jobs = [
        Job(k, task.text(), groups[k] if groups else "")
        for k, task in enumerate(tasks)
        if k not in outcomes
    ]
    if not jobs:
        return tuple(outcomes[k] for k in range(len(tasks)))
    begin, before, running = time.perf_counter(), len(outcomes), 0
    finished: set[int] = set()

    def show(name: str = "", seconds: float = 0.0, failure: str = "") -> None:
        if watch is not None:
            done = len(outcomes)
            rate = (done - before) / max(time.perf_counter() - begin, 1e-9)
            passed = time.perf_counter() - begin
            numbers = [job.number for job in jobs]
            left = time_left(numbers, finished, passed, max(1, workers.count), expected)
            failed = sum(bool(outcome.failure) for outcome in outcomes.values())
            watch(Progress(done, len(tasks), failed, running, rate, left, name, seconds, failure))

    def record(number: int, outcome: Outcome) -> None:
        store.keep(tasks[number], outcome)
        if check is not None and not outcome.failure:
            check(outcome)
        outcomes[number] = outcome
        finished.add(number)
        show(label(number), outcome.seconds, outcome.failure)

    def idle(now: int) -> None:
        nonlocal running
        running = now
        show()

    executor = workers.open()
    try:
        dispatch(jobs, executor, record, idle)
    finally:
        executor.close()
    return tuple(outcomes[k] for k in range(len(tasks)))


@dataclass(frozen=True)
class Job:
    """A point to solve: its number, its task, and the group of points that share what is costly."""

    number: int
    task: str
    group: str


class _Queue:
    """Jobs by group. A worker stays with its group.

    Then it opens a new one; then it helps with the longest.
    """

    def __init__(self, jobs: Sequence[Job]) -> None:
        self._waiting: dict[str, deque[Job]] = {}
        for job in jobs:
            self._waiting.setdefault(job.group, deque()).append(job)
        self._opened: set[str] = set()
        self._at: dict[str, str] = {}

    def __len__(self) -> int:
        return sum(map(len, self._waiting.values()))

    def take(self, worker: str) -> Job:
        group = self._group(worker)
        job = self._waiting[group].popleft()
        if not self._waiting[group]:
            del self._waiting[group]
        self._opened.add(group)
        self._at[worker] = group
        return job

    def put_back(self, job: Job) -> None:
        self._waiting.setdefault(job.group, deque()).appendleft(job)

    def _group(self, worker: str) -> str:
        own = self._at.get(worker)
        if own in self._waiting:
            return own
        fresh = next((group for group in self._waiting if group not in self._opened), None)
        return fresh or max(self._waiting, key=lambda group: len(self._waiting[group]))


def dispatch(
    jobs: Sequence[Job],
    executor: Executor,
    record: Callable[[int, Outcome], None],
    idle: Callable[[int], None],
) -> None:
    """Have all jobs solved.

    Parameters
    ----------
    record
        Called with each point's number and outcome, once.
    idle
        Called with how many points run, whenever that may have changed.

    Raises
    ------
    InputError, UpdError
        When a worker has other sources, or cannot run points; and whatever ``record`` raises.
    """
    queue = _Queue(jobs)
    running: dict[Future[str], tuple[str, Job]] = {}
    deaths: Counter[int] = Counter()
    while len(queue) or running:
        there = executor.workers()
        busy = {worker for worker, _ in running.values()}
        for worker in there:
            if len(queue) and worker not in busy:
                job = queue.take(worker)
                running[executor.submit(worker, job.task)] = (worker, job)
        idle(len(running))
        done = wait(running, _LOOK_S, FIRST_COMPLETED).done
        if not running:
            time.sleep(_LOOK_S)
        for future, (worker, job) in list(running.items()):
            # A worker that is gone does not come back under its name.
            if future not in done and worker in there:
                continue
            del running[future]
            text = _text(future, executor) if future in done else None
            if text is not None:
                record(job.number, _checked(read_outcome(text)))
                continue
            future.cancel()
            deaths[job.number] += 1
            if deaths[job.number] < ATTEMPTS:
                queue.put_back(job)
            else:
                record(job.number, Outcome(failure=_killed(deaths[job.number]), final=False))


def _text(future: Future[str], executor: Executor) -> str | None:
    """The outcome as JSON; None where the worker died."""
    try:
        return future.result()
    except executor.deaths:
        return None
    except Exception as error:
        raise UpdError(
            f"a worker cannot run points ({type(error).__name__}: {error}): install the same upd "
            "there as here"
        ) from error


def _killed(times: int) -> str:
    return (
        f"the worker was killed {times} times, most likely for lack of memory: "
        'use fewer --workers, a coarser mesh or solver.name = "amg"; the next call tries again'
    )


def _checked(outcome: Outcome) -> Outcome:
    if outcome.failure.startswith(OTHER_CODE):
        raise InputError(
            f"{outcome.failure}: install the same there, or numbers of one table would "
            "come from different codes"
        )
    return outcome
