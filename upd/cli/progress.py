"""How far a batch is, on a terminal: one line for sweeps and studies alike."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from rich.console import Console
from rich.markup import escape

from upd.batch.engine import Progress

#: Least seconds between two lines of progress when the output is no terminal.
_PAUSE_S = 5.0


class ProgressLine:
    """One line that keeps moving on a terminal; a line every few seconds elsewhere.

    Failures are always shown.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._status: Any = console.status("starting") if console.is_terminal else None
        self._last = 0.0

    def __enter__(self) -> Callable[[Progress], None]:
        if self._status is not None:
            self._status.start()
        return self._show

    def __exit__(self, *_: object) -> None:
        if self._status is not None:
            with suppress(Exception):
                self._status.stop()

    def _show(self, progress: Progress) -> None:
        if progress.failure:
            self._console.print(escape(f"failed: {progress.label}: {progress.failure}"))
        text = escape(progress_text(progress))
        if self._status is not None:
            self._status.update(text)
        elif progress.label and (
            progress.done == progress.total or time.monotonic() - self._last > _PAUSE_S
        ):
            self._last = time.monotonic()
            self._console.print(text)


def progress_text(progress: Progress) -> str:
    """Points done, rate, time left and the last point in words."""
    text = f"{progress.done}/{progress.total} points"
    if progress.failed:
        text += f", {progress.failed} failed"
    if progress.rate:
        pace = (
            f"{progress.rate:.2g}/s"
            if progress.rate >= 1.0
            else f"one in {1.0 / progress.rate:.2g} s"
        )
        text += (
            f", {pace}, {duration(progress.left_s)} left" if progress.left_s > 0.0 else f", {pace}"
        )
    return text + (f"; last: {progress.label}, {progress.seconds:.2g} s" if progress.label else "")


def counted(count: int, what: str) -> str:
    """1 point, 2 points, 3 meshes."""
    return (
        f"{count} {what}" if count == 1 else f"{count} {what}{'es' if what.endswith('sh') else 's'}"
    )


def duration(seconds: float) -> str:
    """Seconds in words."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
