"""Progress and cost of a run: named stages, timed, reported to whoever listens.

The library itself never prints.
"""

from __future__ import annotations

import logging
import resource
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

log = logging.getLogger("upd")

#: Called with (stage, detail, seconds since the stage began, or None when it begins).
Listener = Callable[[str, str, float | None], None]


def silent(stage: str, detail: str, seconds: float | None) -> None:
    """The listener that does nothing."""


class Stages:
    """Times the stages of one run; seconds per stage add up over repeated entries."""

    def __init__(self, listener: Listener = silent) -> None:
        self._listener = listener
        self._start = time.perf_counter()
        self.seconds: dict[str, float] = {}

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
        """Seconds per stage, their total by the clock, and the largest resident memory in MB since
        `forget_peak`.
        """
        try:
            lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
            (peak,) = (line.split()[1] for line in lines if line.startswith("VmHWM"))
            memory = int(peak) * 1024 / 1e6
        except (OSError, ValueError):
            size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            memory = size / 1e6 if sys.platform == "darwin" else size / 1e3
        return {
            "stages": {k: round(v, 4) for k, v in self.seconds.items()},
            "total_s": round(self.elapsed(), 4),
            "peak_rss_mb": round(memory, 1),
        }


def forget_peak() -> None:
    """Let the kernel's peak of the resident memory begin anew; where it cannot (no Linux), it is
    that of the whole process.
    """
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
