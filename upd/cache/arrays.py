"""What is kept on disk under a key: arrays as .npz files without pickle, in a folder of bounded
size; and what a long search found, line by line.

A search takes the same way every time: begun again after it was stopped, it reads what is kept and
continues from there.
"""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from upd.cache.files import whole_file
from upd.errors import InputError
from upd.units import parse_quantity

log = logging.getLogger(__name__)

#: Bytes the folder may hold; $UPD_CACHE_LIMIT ("500 MB") sets another bound. The files used longest
#: ago go first.
LIMIT_BYTES = 4e9
#: Age in s after which a half-written file is one of a killed process.
_ABANDONED_S = 3600.0


def cache_folder(cache_dir: Path | str | None = None) -> Path:
    """``cache_dir``, else $UPD_CACHE, else upd/ in $XDG_CACHE_HOME or ~/.cache."""
    if cache_dir is not None:
        return Path(cache_dir)
    if os.environ.get("UPD_CACHE"):
        return Path(os.environ["UPD_CACHE"])
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")  # noqa: PTH111, PTH118 (Path.home() may raise)
    return Path(base) / "upd"


def cache_limit() -> float:
    """Bytes from $UPD_CACHE_LIMIT, else `LIMIT_BYTES`.

    Raises InputError for a text that is no amount of memory.
    """
    given = os.environ.get("UPD_CACHE_LIMIT")
    try:
        return parse_quantity(given, "memory") if given else LIMIT_BYTES
    except InputError as error:
        raise InputError(f"the environment variable UPD_CACHE_LIMIT: {error}") from None


def load_arrays(path: Path) -> dict[str, NDArray[Any]] | None:
    """Arrays of the file ``path``, or None.

    A damaged file counts as absent (the zip carries checksums).
    """
    try:
        # numpy leaves a file it opened itself open when that is no zip
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    except FileNotFoundError:
        return None
    # Whatever a damaged zip makes the readers raise: the arrays can always be made again.
    except Exception as problem:
        unreadable(path, problem)
        return None
    with suppress(OSError):
        # Used now: the last to be thrown away.
        os.utime(path)
    return arrays


def unreadable(path: Path, problem: Exception) -> None:
    """Log that a kept file is of no use."""
    log.warning("%s cannot be read (%s: %s): made again", path, type(problem).__name__, problem)


def save_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Keep ``arrays`` in the file ``path``, whole or not at all.

    Where the folder cannot be written, only a log line.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as temporary, temporary.open("wb") as file:
            np.savez(file, **cast(dict[str, Any], dict(arrays)))
    except OSError as problem:
        log.warning("%s is not kept (%s): it is made again next time", path, problem)


def trim(folder: Path, limit_bytes: float, newest: str) -> None:
    """Remove the files used longest ago until the rest fits, ``newest`` last, and what killed
    processes left.
    """
    known = []
    for path in folder.glob("*"):
        with suppress(OSError):
            status = path.stat()
            if path.suffix in (".npz", ".jsonl") and not path.name.startswith("."):
                known.append((path.name == newest, status.st_mtime, status.st_size, path))
            elif time.time() - status.st_mtime > _ABANDONED_S:
                path.unlink(missing_ok=True)
    total = sum(size for _, _, size, _ in known)
    for _, _, size, path in sorted(known):
        if total <= limit_bytes:
            return
        with suppress(OSError):
            path.unlink(missing_ok=True)
        total -= size


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
            with suppress(ValueError):
                self.lines.append(json.loads(line))

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
        with suppress(OSError):
            self.path.unlink(missing_ok=True)


# -- what the points of a sweep share in one process: the folder of kept arrays, and the last large
# object of each kind in memory; off unless `sharing` is entered, for a single run and the cost
# studies measure what they do themselves

Found = TypeVar("Found")


@dataclass
class Store:
    """Where condensations are kept, how many threads may make them, and what was taken from where.

    Attributes
    ----------
    counts
        "made" (factorised), "disk" (read), "factor" (factorised again for displacements inside
        a body), "memory" (a whole model kept).
    """

    folder: Path
    threads: int = 1
    limit_bytes: float = LIMIT_BYTES
    counts: dict[str, int] = field(
        default_factory=lambda: {"made": 0, "disk": 0, "factor": 0, "memory": 0}
    )
    _memory: dict[str, tuple[str, Any]] = field(default_factory=dict)

    def remembered(self, kind: str, key: str, make: Callable[[], Found]) -> Found:
        """What `make` gives, kept in memory for the next point with the same `key`.

        One object of each kind: another is released before the new one is made, so that two never
        stand side by side.
        """
        held = self._memory.get(kind)
        if held is not None and held[0] == key:
            self.counts["memory"] += 1
            return cast(Found, held[1])
        del held
        self._memory.pop(kind, None)
        made = make()
        self._memory[kind] = (key, made)
        return made


_active: list[Store] = []


def active() -> Store | None:
    """The store of the sweep that runs in this process, if any."""
    return _active[-1] if _active else None


@contextmanager
def sharing(store: Store) -> Iterator[Store]:
    """Take condensations from `store` inside the block."""
    _active.append(store)
    try:
        yield store
    finally:
        _active.remove(store)
