"""Independent pieces of linear algebra side by side: one thread each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, nullcontext
from functools import cache
from typing import TypeVar, cast

from threadpoolctl import ThreadpoolController, threadpool_limits

from upd.linalg.pardiso import load
from upd.linalg.select import has_pardiso

Found = TypeVar("Found")
#: order of a dense matrix below which a second thread gains nothing on its factor, 3 ms on one and
#: on two at 420; and where others work on the machine, threads that wait for each other cost ten
#: times that
SMALL = 1000


#: finding the libraries takes a millisecond: once
_controller = cache(ThreadpoolController)


def threads_for(order: int, small: int = SMALL) -> AbstractContextManager[object]:
    """One thread for dense algebra on many small matrices, all there are on large ones.

    Parameters
    ----------
    order : int
        Of the matrices.
    small : int
        From here on they count as large.
    """
    if order >= small:
        return nullcontext()
    return cast("AbstractContextManager[object]", _controller().limit(limits=1, user_api="blas"))


def in_parallel(jobs: Sequence[Callable[[], Found]], workers: int) -> list[Found]:
    """Results of the jobs in their order, `workers` at a time.

    Ordering and the top of a factorisation run on one thread whatever the library, so two matrices
    side by side finish earlier than one after the other. While more than one job runs, BLAS and
    OpenMP keep to one thread each. An error is raised after all have ended.

    Parameters
    ----------
    jobs : sequence of callable
        Without arguments.
    workers : int

    Returns
    -------
    list
        What each job returned.
    """
    if workers < 2 or len(jobs) < 2:
        return [job() for job in jobs]
    if has_pardiso():
        # Loaded first, so that its threads are limited too.
        load()
    with threadpool_limits(limits=1), ThreadPoolExecutor(workers) as pool:
        waiting = [pool.submit(job) for job in jobs]
    return [one.result() for one in waiting]


class SideBySide:
    """Threads that stay, for short jobs again and again; BLAS keeps to one thread meanwhile.

    Outside of its `with` the jobs run one after the other. The jobs are the same either way, so
    that what they return does not depend on the number of threads.

    Parameters
    ----------
    workers : int
        Jobs at a time.
    """

    def __init__(self, workers: int = 1) -> None:
        self.workers = workers
        self._pool: ThreadPoolExecutor | None = None
        self._stack = ExitStack()

    def __enter__(self) -> SideBySide:
        self._stack.enter_context(threadpool_limits(limits=1, user_api="blas"))
        if self.workers > 1:
            self._pool = self._stack.enter_context(ThreadPoolExecutor(self.workers))
        return self

    def __exit__(self, *_: object) -> None:
        self._pool = None
        self._stack.close()

    def run(self, jobs: Sequence[Callable[[], Found]]) -> list[Found]:
        """Results of the jobs in their order.

        Parameters
        ----------
        jobs : sequence of callable
            Without arguments; side by side only what leaves the interpreter to others.

        Returns
        -------
        list
            What each job returned.
        """
        if self._pool is None or len(jobs) < 2:
            return [job() for job in jobs]
        waiting = [self._pool.submit(job) for job in jobs]
        return [one.result() for one in waiting]
