"""Marches beside what the interpreter does.

The loops of a march are compiled and leave the interpreter to others: sweeps run while harmonic
balance, itself mostly interpreted, goes on with the next curve.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from typing import TypeVar

from upd.linalg.parallel import threads_for
from upd.linalg.select import threads_used

Found = TypeVar("Found")
#: marches at a time
MOST_WORKERS = 2


class _NotWantedError(Exception):
    """Nobody waits for the march any more."""


class MarchQueue:
    """Runs marches in the order they are added, two at a time.

    Left by an error, marches that wait are dropped and those that run end at their next frequency.

    Parameters
    ----------
    nodes : int
        Largest number of contact nodes of a march; of few, matrices are factored on one thread.

    Attributes
    ----------
    added : int
        Marches so far.
    """

    def __init__(self, nodes: int) -> None:
        self.added, self._order, self._stack = 0, 3 * nodes, ExitStack()
        self._pool = ThreadPoolExecutor(max(1, min(MOST_WORKERS, threads_used())))
        self._ended = threading.Event()

    def __enter__(self) -> MarchQueue:
        self._stack.enter_context(threads_for(self._order))
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._ended.set()
        self._pool.shutdown(wait=True, cancel_futures=kind is not None)
        self._stack.close()

    def add(self, march: Callable[[Callable[[float], None]], Found]) -> Future[Found]:
        """Run a march when its turn comes.

        Parameters
        ----------
        march : callable
            Takes a function that it is to call with every frequency it comes to, Hz.

        Returns
        -------
        Future
            Of what the march returns.
        """
        self.added += 1
        return self._pool.submit(march, self._look)

    def _look(self, frequency: float) -> None:
        del frequency
        if self._ended.is_set():
            raise _NotWantedError
