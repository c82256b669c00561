"""Progress and cost of a run: named stages, timed, reported to whoever listens.

The library itself never prints.
"""

from __future__ import annotations

import logging
import resource
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

log = logging.getLogger("upd")

#: Called with (stage, detail, seconds since the stage began, or None when it begins).
Listener = Callable[[str, str, float | None], None]

#: seconds between two samples of the memory
_PERIOD_S = 0.05


def silent(stage: str, detail: str, seconds: float | None) -> None:
    """The listener that does nothing."""


class Stages:
    """Times the stages of one run; seconds per stage add up over repeated entries."""

    def __init__(self, listener: Listener = silent) -> None:
        self._listener = listener
        self._start = time.perf_counter()
        self.seconds: dict[str, float] = {}
        self._peak, self._stop = [_resident_mb()], threading.Event()
        # the thread does not know this object: it ends when nobody asks any more
        threading.Thread(target=_watch, args=(self._peak, self._stop), daemon=True).start()

    def __del__(self) -> None:
        self._stop.set()

    @contextmanager
    def __call__(self, stage: str, detail: str = "") -> Iterator[None]:
        """Time the block as ``stage``."""
        self._listener(stage, detail, None)
        log.info("%s: %s", stage, detail or "begins")
        begin = time.perf_counter()
        try:
            yield
        finally:
            took = time.perf_counter() - begin
            self.seconds[stage] = self.seconds.get(stage, 0.0) + took
            log.info("%s: %.3f s", stage, took)
            self._listener(stage, detail, took)

    def elapsed(self) -> float:
        """Seconds since the run began."""
        return time.perf_counter() - self._start

    def cost(self) -> dict[str, float | dict[str, float]]:
        """Seconds per stage, their total by the clock, and the largest resident memory during this
        run in MB: sampled on Linux (the kernel's own peak counts earlier runs), else the process's
        peak.
        """
        return {
            "stages": {k: round(v, 4) for k, v in self.seconds.items()},
            "total_s": round(self.elapsed(), 4),
            "peak_rss_mb": round(max(*self._peak, _resident_mb()), 1),
        }


def _watch(peak: list[float], stop: threading.Event) -> None:
    while not stop.wait(_PERIOD_S):
        peak[0] = max(peak[0], _resident_mb())


def _resident_mb() -> float:
    try:
        with open("/proc/self/statm", encoding="ascii") as f:  # noqa: PTH123 - read twenty times a second
            return int(f.read().split()[1]) * resource.getpagesize() / 1e6
    except OSError:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak / 1e6 if sys.platform == "darwin" else peak / 1e3
