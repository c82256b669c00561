"""What every command does on the terminal: print, warn, show progress."""

from __future__ import annotations

import io
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from rich.console import Console
from rich.text import Text

from upd.errors import InputError
from upd.progress import Listener
from upd.report.columns import text_width

if TYPE_CHECKING:
    from upd.batch.engine import Progress


def _open_streams() -> None:
    """Give closed streams the null device, and "?" for what a stream's encoding lacks."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            # it takes the free descriptor, which else the first file of a run would
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115
        elif name == "stdout" and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


class Terminal(Console):
    """A console that loses the lines nobody takes: what was computed lies in files."""

    def print(self, *objects: Any, **options: Any) -> None:
        """Print; a pipe without a reader and a full disk end nothing."""
        try:
            super().print(*objects, **options)
        except OSError:
            self.on_broken_pipe()

    def on_broken_pipe(self) -> None:
        """Let all further lines go nowhere."""
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, self.file.fileno())
        os.close(null)


_open_streams()
_own_width = sys.stdout.isatty() and "COLUMNS" not in os.environ
#: square brackets are no markup: titles, paths and messages may hold them
console = Terminal(highlight=False, markup=False, width=None if _own_width else text_width())
errors = Terminal(stderr=True, highlight=False, markup=False, soft_wrap=True)

#: least seconds between two lines of a batch's progress when the output is no terminal
_PAUSE_S = 5.0

SetOption = Annotated[
    list[str] | None,
    Parameter(name="--set", help="path=value, for example contact.friction=0.3; may be repeated"),
]


def warn(message: object, style: str = "") -> None:
    """A fault, a line on stderr."""
    errors.print(Text.assemble(("upd:", style), f" {message}"))


def check_ending(path: Path | None, option: str, *endings: str) -> None:
    """Raise InputError for a file of another ending, before anything is done."""
    if path is not None and path.suffix.lower() not in endings:
        known = ", ".join(endings)
        raise InputError(f"{option} {path}: the ending {path.suffix!r} is not known; use {known}")


@contextmanager
def run_progress(*, stages: bool = True) -> Iterator[Listener]:
    """Progress on the terminal: the running stage with a clock, and a line per finished stage
    unless ``stages`` is false.

    Plain lines when the output is no terminal.
    """
    begin, status = time.perf_counter(), console.status("")

    def show(stage: str, detail: str, seconds: float | None) -> None:
        status.stop()
        if seconds is None and console.is_terminal:
            status.update(Text(f"{stage}: {detail}"))
            status.start()
        elif seconds is not None and (stages or stage == "folder"):
            elapsed = time.perf_counter() - begin
            line = f" {seconds:7.2f} s  {stage}: {detail}"
            console.print(Text.assemble((f"{elapsed:7.1f} s", "dim"), line))

    try:
        yield show
    finally:
        status.stop()


@contextmanager
def batch_progress() -> Iterator[Callable[[Progress], None]]:
    """How far a sweep or study is: one line that keeps moving on a terminal, a line every few
    seconds elsewhere. Failures are always shown.
    """
    last = 0.0

    def show(progress: Progress) -> None:
        nonlocal last
        if progress.failure:
            console.print(f"failed: {progress.label}: {progress.failure}")
        status.update(Text(progress_text(progress)))
        done = progress.done == progress.total or time.monotonic() - last > _PAUSE_S
        if not console.is_terminal and progress.label and done:
            last = time.monotonic()
            console.print(progress_text(progress))

    status = console.status("starting")
    if console.is_terminal:
        status.start()
    try:
        yield show
    finally:
        status.stop()


def progress_text(progress: Progress) -> str:
    """Points done, rate, time left and the last point."""
    text = f"{progress.done}/{progress.total} points"
    if progress.failed:
        text += f", {progress.failed} failed"
    if progress.rate:
        slow = progress.rate < 1.0
        text += f", one in {1.0 / progress.rate:.2g} s" if slow else f", {progress.rate:.2g}/s"
        text += f", {duration(progress.left_s)} left" if progress.left_s > 0.0 else ""
    return text + (f"; last: {progress.label}, {progress.seconds:.2g} s" if progress.label else "")


def duration(seconds: float) -> str:
    """Seconds, minutes or hours."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
