"""Who solves which point when.

Points of one group follow each other on one worker, a dead worker's point is given out again.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass

from upd.batch.executors import Executor
from upd.batch.point import OTHER_CODE, Outcome, read_outcome
from upd.errors import InputError, UpdError

#: A point whose worker dies this often is given up.
ATTEMPTS = 3
#: Seconds after which an executor is asked again who is there.
_LOOK_S = 1.0


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
