"""Processes of this machine.

Tasks and outcomes are JSON bytes on pipes; a process that dies is replaced.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from upd.batch.executors import Answer
from upd.batch.point import solve_task

#: What sets the number of threads of the libraries, before they are loaded.
_THREADS = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


class Pool:
    """Processes of this machine, started (spawn) when first needed.

    Parameters
    ----------
    workers
        Processes side by side.
    threads
        Threads of each; 0: as many as the libraries take by themselves.
    fresh
        A new process for every point: nothing an earlier one left counts in its memory, nor
        shortens its time.
    """

    def __init__(self, workers: int, threads: int, *, fresh: bool = False) -> None:
        self._threads, self._fresh = threads, fresh
        self._places: dict[str, tuple[BaseProcess, Connection] | None] = {
            f"process {k + 1}": None for k in range(workers)
        }
        self._busy: dict[str, int] = {}

    def free(self) -> Sequence[str]:
        return [name for name in self._places if name not in self._busy]

    def give(self, worker: str, number: int, task: str) -> None:
        self._busy[worker] = number
        # When it died while idle the pipe is broken: wait() finds its end and says so.
        with suppress(OSError):
            self._at(worker)[1].send_bytes(task.encode())

    def wait(self, seconds: float) -> list[Answer]:
        pipes = {
            place[1]: name
            for name, place in self._places.items()
            if place is not None and name in self._busy
        }
        return [
            self._answer(pipes[pipe])
            for pipe in wait(list(pipes), seconds)
            if isinstance(pipe, Connection)
        ]

    def close(self) -> None:
        for name in self._places:
            self._end(name)

    def _at(self, name: str) -> tuple[BaseProcess, Connection]:
        place = self._places[name]
        if place is None:
            place = self._places[name] = _start(self._threads)
        return place

    def _answer(self, name: str) -> Answer:
        number = self._busy.pop(name)
        try:
            text = self._at(name)[1].recv_bytes().decode()
        except (EOFError, OSError):
            self._end(name)
            return Answer(number, None)
        if self._fresh:
            self._end(name)
        return Answer(number, text)

    def _end(self, name: str) -> None:
        place = self._places[name]
        if place is not None:
            process, pipe = place
            pipe.close()
            process.kill()
            process.join()
            process.close()
        self._places[name] = None


def _start(threads: int) -> tuple[BaseProcess, Connection]:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=work, args=(theirs,), daemon=True)
    with _environment({name: str(threads) for name in _THREADS} if threads else {}):
        process.start()
    # Held by the child alone: its death ends the pipe.
    theirs.close()
    return process, ours


def work(pipe: Connection) -> None:
    """What a process does: one task after the other, until the batch ends or is killed."""
    # Ctrl-C reaches the whole group: the batch itself ends its processes.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Failures come back as outcomes; tracebacks between the lines of progress help nobody.
    logging.getLogger("upd").addHandler(logging.NullHandler())
    threading.Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            task = pipe.recv_bytes().decode()
            pipe.send_bytes(solve_task(task).encode())
        except (EOFError, OSError):
            return


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
