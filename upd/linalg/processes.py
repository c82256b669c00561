"""Independent pieces of interpreted work on both processors: this process and others beside it.

Threads do not help where Python itself is busy, as in a continuation on small matrices. A process
beside this one is started once, imports while this one works, and takes jobs from the same list.
It runs ``python -m upd.linalg.processes``, so that a script that calls the library needs no guard.
"""

from __future__ import annotations

import logging
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, suppress
from importlib import import_module
from typing import IO, Any

from threadpoolctl import threadpool_limits

from upd.errors import UpdError
from upd.linalg.select import threads_used

#: a function that another process finds by its name, and its arguments
Job = tuple[Callable[..., Any], tuple[Any, ...]]
#: processes beside this one at most: each holds its own libraries in memory
MOST_BESIDE = 3
#: with one thread each, before the libraries are loaded
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


class SideProcesses(AbstractContextManager["SideProcesses"]):
    """Processes that wait for jobs; left, they end.

    Parameters
    ----------
    modules : str
        Imported there at once: what the jobs will need.
    count : int, optional
        Processes beside this one; those that its threads allow when None.
    """

    def __init__(self, *modules: str, count: int | None = None) -> None:
        wanted = threads_used() - 1 if count is None else count
        self._beside = [_start(modules) for _ in range(max(0, min(MOST_BESIDE, wanted)))]

    def __exit__(self, *_: object) -> None:
        self._kill()

    def _kill(self) -> None:
        for one in self._beside:
            one.kill()
            one.wait()
            for pipe in (one.stdin, one.stdout):
                if pipe is not None:
                    with suppress(OSError):
                        pipe.close()

    def run(self, jobs: Sequence[Job]) -> list[Any]:
        """Results of the jobs in their order, each in whichever process is free.

        Parameters
        ----------
        jobs : sequence of (function, arguments)
            Long ones first; function, arguments and result are pickled.

        Returns
        -------
        list
            What each job returned, or the UpdError it raised.
        """
        out: list[Any] = [None] * len(jobs)
        waiting = deque(range(len(jobs)))
        faults: list[BaseException] = []

        def serve(one: subprocess.Popen[bytes]) -> None:
            try:
                while waiting and not faults:
                    try:
                        k = waiting.popleft()
                    except IndexError:
                        return
                    try:
                        _write(one.stdin, jobs[k])
                        good, found = _read(one.stdout)
                    except (OSError, EOFError, pickle.UnpicklingError):
                        # the process died: this one takes the job
                        waiting.append(k)
                        return
                    if not good:
                        raise found
                    out[k] = found
            except BaseException as error:
                faults.append(error)

        threads = [threading.Thread(target=serve, args=(one,)) for one in self._beside]
        for thread in threads:
            thread.start()
        try:
            with threadpool_limits(limits=1, user_api="blas"):
                while not faults:
                    try:
                        k = waiting.popleft()
                    except IndexError:
                        if not any(thread.is_alive() for thread in threads) and not waiting:
                            break
                        for thread in threads:
                            thread.join(0.05)
                        continue
                    out[k] = _done(jobs[k])
        except BaseException as error:
            faults.append(error)
        if faults:
            # nobody waits for jobs whose results are lost: the readers see the end of the pipes
            self._kill()
        for thread in threads:
            thread.join()
        if faults:
            raise faults[0]
        return out


def _done(job: Job) -> Any:
    function, arguments = job
    try:
        return function(*arguments)
    except UpdError as error:
        return error


def _start(modules: Sequence[str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "upd.linalg.processes", *modules],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | _ONE_THREAD | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )


def _write(pipe: IO[bytes] | None, content: Any) -> None:
    assert pipe is not None
    pickle.dump(content, pipe, pickle.HIGHEST_PROTOCOL)
    pipe.flush()


def _read(pipe: IO[bytes] | None) -> Any:
    assert pipe is not None
    return pickle.load(pipe)


def main() -> None:
    """What a process beside another one does: one job after the other until the pipe ends."""
    # Ctrl-C reaches the whole group: the first process ends the others
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    logging.getLogger("upd").addHandler(logging.NullHandler())
    logging.getLogger("upd").propagate = False
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    # whatever is printed must not lie between the answers
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    for name in sys.argv[1:]:
        # what the jobs will need, while the first process still works
        import_module(name)
    while True:
        try:
            job = _read(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer = True, _done(job)
        except Exception as error:
            answer = False, error
        try:
            _write(answers, answer)
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            _write(answers, (False, error))


if __name__ == "__main__":
    main()
