"""What every command does on the terminal: print, warn, show progress."""

from __future__ import annotations

import logging
import sys
import time
from typing import Annotated, Any

from cyclopts import Parameter
from rich.console import Console

from upd.report.columns import text_width

console = Console(highlight=False, width=None if sys.stdout.isatty() else text_width())
errors = Console(stderr=True, highlight=False, soft_wrap=True)

SetOption = Annotated[
    list[str] | None,
    Parameter(
        name="--set",
        negative=(),
        help="path=value, for example contact.friction=0.3; may be repeated",
    ),
]


def plain(value: object) -> str:
    """Text as it is: square brackets are no markup."""
    from rich.markup import escape

    return escape(str(value))


class Notes(logging.Handler):
    """Warnings that a user should see before anything else, on stderr."""

    def emit(self, record: logging.LogRecord) -> None:
        errors.print(f"upd: {plain(record.getMessage())}")


class Live:
    """Progress on the terminal: the running stage with a clock, and a line per stage that is done
    unless ``stages`` is false.

    Plain lines when the output is no terminal.
    """

    def __init__(self, *, stages: bool = True) -> None:
        self._stages = stages
        self._status: Any = None
        self._begin = time.perf_counter()

    def __enter__(self) -> Live:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """End the running line."""
        if self._status is not None:
            self._status.stop()
            self._status = None

    def __call__(self, stage: str, detail: str, seconds: float | None) -> None:
        self.stop()
        if seconds is None:
            if console.is_terminal:
                self._status = console.status(f"{stage}: {plain(detail)}")
                self._status.start()
            return
        if not self._stages and stage != "folder":
            return
        elapsed = time.perf_counter() - self._begin
        console.print(f"[dim]{elapsed:7.1f} s[/dim] {seconds:7.2f} s  {stage}: {plain(detail)}")
