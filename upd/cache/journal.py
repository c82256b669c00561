"""What a long search found, kept on disk line by line.

A search takes the same way every time: begun again after it was stopped, it reads what is kept and
continues from there.
"""

from __future__ import annotations

import json
import logging
from typing import Any

from upd.cache.arrays import cache_folder, unreadable

log = logging.getLogger(__name__)


class Journal:
    """Lines of JSON in a file of the cache.

    Parameters
    ----------
    name
        Of what is sought, with the key of all that it depends on.
    """

    def __init__(self, name: str) -> None:
        self.path = cache_folder() / f"{name}.jsonl"
        #: what an earlier call kept; a last line that was cut short is omitted
        self.lines: list[Any] = []
        try:
            text = self.path.read_text("utf-8") if self.path.exists() else ""
        except (OSError, UnicodeDecodeError) as problem:
            unreadable(self.path, problem)
            return
        for line in text.splitlines():
            try:
                self.lines.append(json.loads(line))
            except ValueError:
                continue

    def keep(self, line: Any) -> None:
        """Add a line; where the disk does not take it, only a log line."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("a", encoding="utf-8") as file:
                file.write(f"{json.dumps(line)}\n")
        except OSError as problem:
            log.warning("%s: not kept (%s)", self.path, problem)

    def done(self) -> None:
        """Remove the file: the search has ended."""
        try:
            self.path.unlink(missing_ok=True)
        except OSError as problem:
            log.warning("%s: not removed (%s)", self.path, problem)
