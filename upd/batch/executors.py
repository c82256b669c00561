"""Who solves the points: this process, or processes of this machine.

The workers of a cluster are in `upd.batch.dask`.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from typing import Protocol

from upd.batch.point import forget, solve_task

#: What sets the number of threads of the libraries, before they are loaded.
_THREADS = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


class Executor(Protocol):
    """Workers that take a JSON task each.

    Attributes
    ----------
    deaths
        What the future of a task raises whose worker died.
    """

    deaths: tuple[type[BaseException], ...]

    def workers(self) -> Sequence[str]:
        """Names of the workers there are. Raises UpdError when none will come."""

    def submit(self, worker: str, task: str) -> Future[str]:
        """Let a worker that has nothing to do solve the task: the future of its JSON outcome."""

    def close(self) -> None:
        """End the workers, at once."""


class InProcess:
    """This process itself, one point at a time."""

    deaths: tuple[type[BaseException], ...] = ()

    def workers(self) -> Sequence[str]:
        return ["here"]

    def submit(self, worker: str, task: str) -> Future[str]:
        future = Future[str]()
        future.set_result(solve_task(task))
        return future

    def close(self) -> None:
        forget()


class Processes:
    """Processes of this machine, started (spawn) when first needed.

    Each is a pool of its own, so that one that dies takes no other along.

    Parameters
    ----------
    count
        Processes side by side.
    threads
        Threads of each; 0: as many as the libraries take by themselves.
    fresh
        A new process for every point: nothing an earlier one left counts in its memory, nor
        shortens its time.
    """

    deaths: tuple[type[BaseException], ...] = (BrokenExecutor,)

    def __init__(self, count: int, threads: int, *, fresh: bool = False) -> None:
        self._names = [f"process {k + 1}" for k in range(count)]
        self._threads, self._fresh = threads, fresh
        #: worker -> its pool, and the number of its process
        self._pools: dict[str, tuple[ProcessPoolExecutor, Future[int]]] = {}

    def workers(self) -> Sequence[str]:
        return self._names

    def submit(self, worker: str, task: str) -> Future[str]:
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
