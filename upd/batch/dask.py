"""Workers of a Dask cluster.

``local:N`` on this machine, or the scheduler at ``tcp://host:port``.
"""

from __future__ import annotations

import importlib
import importlib.util
import logging
import re
import time
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future
from typing import Any

from upd.batch.point import forget, solve_task
from upd.errors import InputError, UpdError

#: Seconds to wait for the first worker, and for one to come back when all are gone.
PATIENCE_S = 60.0
_LOOK_S = 1.0
_LOCAL, _SCHEDULER = re.compile(r"local:([1-9]\d*)"), re.compile(r"(tcp|tls)://.+:\d+")
_MISSING = (
    '--cluster needs Dask: pip install "updampers[cluster]", or leave it out to use this machine'
)
_LOST = "the connection to the cluster's scheduler was lost"
_AGAIN = ", then the same command; it takes up where it stood"


class DaskCluster:
    """The workers of a scheduler, each with one point at a time.

    A worker that dies is Dask's to replace; its point is given out again.

    Workers live on from point to point: the memory of a point counts what earlier ones left there.

    Parameters
    ----------
    address
        "local:4" (workers on this machine) or "tcp://host:port".

    Raises
    ------
    InputError
        When the address is none, Dask is missing, or no worker comes within a minute.
    """

    def __init__(self, address: str) -> None:
        check_address(address)
        dask = importlib.import_module("distributed")
        self.deaths: tuple[type[BaseException], ...] = (dask.KilledWorker, CancelledError, OSError)
        self._patience, self._levels = PATIENCE_S, _quiet()
        self._executors: dict[str, Any] = {}
        self._known: tuple[float, list[str]] = (-_LOOK_S, [])
        self._seen = time.monotonic()
        self._local: Any = None
        local = _LOCAL.fullmatch(address)
        if local is not None:
            self._local = dask.LocalCluster(
                n_workers=int(local[1]),
                threads_per_worker=1,
                host="127.0.0.1",
                # any free port: without an address dask takes 8787, which another may have
                dashboard_address=":0",
                worker_dashboard_address=None,
            )
        try:
            self._client = dask.Client(self._local or address, timeout=min(self._patience, 15.0))
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
            if self._local is None and self._client.status == "running":
                for executor in self._executors.values():
                    executor.shutdown(wait=False)
                # Other people's workers keep nothing of ours.
                self._client.run(forget, on_error="ignore")
        except OSError:
            pass
        self._client.close(timeout=5)
        if self._local is not None:
            self._local.close(timeout=10)
        for logger, level in self._levels.items():
            logger.setLevel(level)


def _quiet() -> dict[logging.Logger, int]:
    """Dask's loggers silenced, and their levels before.

    What goes wrong is reported once, by an error of ours.
    """
    known = list(logging.root.manager.loggerDict)
    loggers = [logging.getLogger(name) for name in known if name.startswith("distributed")]
    levels = {logger: logger.level for logger in loggers}
    for logger in levels:
        logger.setLevel(logging.CRITICAL + 1)
    return levels


def check_address(address: str) -> None:
    """Raise InputError for an address that is none, or when Dask is missing."""
    if not (_LOCAL.fullmatch(address) or _SCHEDULER.fullmatch(address)):
        raise InputError(
            f"--cluster {address}: write local:4 (workers on this machine) or the "
            "scheduler's address, tcp://host:port"
        )
    if importlib.util.find_spec("distributed") is None:
        raise InputError(_MISSING)
